"""Runs that end early or leave reactions undetermined: they name the cause, without NaN in the motion."""

import dataclasses
import math

import numpy as np
import pytest
from test_bad_mechanisms import HUNG, PIN, braced_frame, mechanism, part, pin, refused, tripod
from tests.build import warnings_of

import scissordyn as sd
from scissordyn.plan.plan import plan

ROPE = ("u", "b"), ("ground", "P")  # End points of a rod
KNEE = pin("knee", "u.b", "v.a")  # Pin between bodies "u" and "v"


def shrinking(rate):
    """Return a rod of 0.3 m whose length changes at a rate."""
    return sd.Rod("rope", *ROPE, motion=sd.Polynomial((0.3, rate)))


def two_bars(*rods):
    """Return two bars with a knee, and rods."""
    return mechanism(part("u"), part("v", x=1.0, angle=1.0), joints=(HUNG, KNEE), rods=rods)


def latched_rocker():
    """Return a driven four-bar whose rocker reaches the angle of a latch."""
    linkage = sd.four_bar(gravity=0.0).driven(speed=3.0)
    return dataclasses.replace(linkage, latches=(sd.Latch("hold", "rocker", linkage.body("rocker").angle + 0.05),))


# Function that builds a mechanism, time at which its run ends [s], and names in the cause
ENDS = {
    "rod that shrinks to nothing": (
        lambda: mechanism(part("u", angle=0.3), joints=(HUNG,), rods=(shrinking(-1.0),)),
        0.3,
        ("'rope'",),
    ),
    "rod longer than two bars": (
        lambda: two_bars(sd.Rod("rope", ("u", "a"), ("v", "b"), motion=sd.Polynomial((1.8, 1.0)))),
        0.2,
        ("'rope'", "'u'", "'v'"),
    ),
    "rod that changes between fixed points": (
        lambda: mechanism(
            part("u"), joints=(HUNG,), rods=(sd.Rod("rope", ("u", "a"), ("ground", "P"), motion=sd.Polynomial((1.0, 1.0))),)
        ),
        0.0,
        ("'rope'",),
    ),
    "bars stretched between the ground's points": (
        lambda: mechanism(part("u"), part("v", x=1.0), joints=(HUNG, KNEE, pin("far", "v.b", "ground.Q"))),
        0.0,
        ("'u'", "'v'"),
    ),
    "latch against a drive": (latched_rocker, 0.045964247, ("'hold'", "'rocker'")),
}


@pytest.mark.parametrize("case", ENDS)
def test_end_of_a_run(case):
    """Closed form: a run ends at the instant of the singular position, names the cause, and has no NaN.

    The rope has no length after 0.3 s, and the bars are straight at 1.8 m + 0.2 m. The latch's instant is that at which the
    rocker of a run without it has turned by 0.05 rad (interpolated).
    """
    build, end, names = ENDS[case]
    run = sd.simulate(build(), until=1.0, samples=101, rtol=1e-10, atol=1e-10)
    assert run.attrs["status"] == "failed"
    assert run.attrs["end"] == pytest.approx(end, abs=1e-6)
    assert [name for name in names if name not in run.attrs["cause"]] == []
    assert run.sizes["time"] == int(100.0 * run.attrs["end"] + 1.0 - 1e-9 if end > 0.0 else 0)
    for name in ("position", "angle", "velocity", "acceleration", "energy_residual", "rod_force", "latch_torque"):
        if name in run:
            assert np.all(np.isfinite(run[name].values)), name


def test_instant_of_the_contradicting_latch():
    """Cross-check: without the latch the rocker reaches the latch's angle at the instant at which the run with it ends."""
    linkage = dataclasses.replace(latched_rocker(), latches=())
    run = sd.simulate(linkage, until=0.05, samples=2001, rtol=1e-12, atol=1e-12)
    turned = run["angle"].sel(body="rocker").values - linkage.body("rocker").angle
    assert float(np.interp(0.05, turned, run["time"].values)) == pytest.approx(0.045964247, abs=1e-8)


# Functions that build a mechanism with a wrong rod, and names in its error
RODS = {
    "too short to reach": (
        lambda: mechanism(part("u"), joints=(HUNG,), rods=(sd.Rod("rope", ("u", "b"), ("ground", "Q"), length=5.0),)),
        ("'rope'", "'u'"),
    ),
    "given twice": (
        lambda: two_bars(
            sd.Rod("one", ("u", "a"), ("v", "b"), length=1.75), sd.Rod("two", ("u", "a"), ("v", "b"), length=1.75)
        ),
        ("'one'|'two'",),
    ),
    "contradicting": (
        lambda: two_bars(sd.Rod("one", ("u", "a"), ("v", "b"), length=1.75), sd.Rod("two", ("u", "a"), ("v", "b"), length=1.7)),
        ("'one'", "'two'"),
    ),
    "moving beside a rigid one": (
        lambda: mechanism(part("u"), joints=(HUNG,), rods=(shrinking(-1.0), sd.Rod("rod", *ROPE, length=0.31))),
        ("'rope'", "'rod'"),
    ),
}


@pytest.mark.parametrize("case", RODS)
def test_impossible_rods(case):
    """Contract: rods of impossible, contradicting or redundant lengths are refused by name."""
    build, names = RODS[case]
    refused(build, *names)


def test_clearance_joint_of_a_rigid_ring():
    """Contract: a single clearance joint in a rigid ring cannot move, with a warning; one in a linkage can."""
    ring = sd.hoberman_ring(units=4).driven(speed=-0.3).with_clearance("unit 1/upper", PIN)
    run = sd.simulate(ring, until=0.1, samples=11)
    assert float(np.nanmax(np.hypot(*np.moveaxis(run["eccentricity"].values, -1, 0)))) < 1e-12
    assert any("'unit 1/upper' cannot move" in sentence for sentence in warnings_of(run))
    linkage = sd.four_bar().driven(speed=1.0).with_clearance("crank pin", PIN)
    assert not any("cannot move" in sentence for sentence in warnings_of(sd.simulate(linkage, until=0.01, samples=3)))


def test_hinge_spring_beyond_half_a_revolution():
    """Closed form: the energy of a hinge spring is that of its whole angle, after several turns."""
    wheel = mechanism(
        part("u", angular_velocity=20.0),
        joints=(HUNG,),
        components=(sd.TorsionSpring("coil", "u", stiffness=1e-2),),
        gravity=0.0,
    )
    run = sd.simulate(wheel, until=2.0, samples=201)
    turned = run["angle"].values[:, 0] - run["angle"].values[0, 0]
    assert np.ptp(turned) > 4.0 * math.pi
    np.testing.assert_allclose(run["torsion_spring_energy"].values[:, 0], 0.5e-2 * turned**2, rtol=1e-12)
    assert float(np.max(np.abs(run["energy_residual"]))) < 1e-7 * float(run["kinetic_energy"].max())
    assert warnings_of(run) == []


def test_determined_reactions_are_kept():
    """Cross-check: in a tripod with a redundant foot the pin of the hanging bar has the reaction of a tripod without it."""
    whole = tripod(1.0)
    statically_determined = dataclasses.replace(
        whole,
        bodies=tuple(body for body in whole.bodies if body.name != "w"),
        joints=tuple(joint for joint in whole.joints if "w" not in joint.bodies),
    )
    runs = [sd.simulate(model, until=0.5, samples=26, rtol=1e-12, atol=1e-12) for model in (whole, statically_determined)]
    pulls = [run["reaction"].sel(joint="hinge").values for run in runs]
    assert np.allclose(*pulls, rtol=0, atol=1e-9 * np.max(np.abs(pulls[1])))
    others = runs[0]["reaction"].drop_sel(joint="hinge").values
    assert np.all(np.isnan(others).any(axis=2))
    (sentence,) = warnings_of(runs[0])
    assert "redundant ideal joints" in sentence
    assert "'hinge'" not in sentence


def test_no_reaction_of_a_braced_frame_is_determined():
    """Identity: the frame's self-stress loads every bar, hence every pin, at every instant of its rotation."""
    run = sd.simulate(braced_frame(1.0), until=3.0, samples=2001)
    assert np.all(np.isnan(run["reaction"].values).any(axis=2))
    (sentence,) = warnings_of(run)
    assert "redundant ideal joints" in sentence


@pytest.mark.parametrize(("build", "count"), [(lambda: braced_frame(1.0), 1), (lambda: tripod(1.0), 1), (sd.four_bar, 0)])
def test_redundant_constraints_are_left_out(build, count):
    """Contract: a frame with a redundant bar loses one constraint; a linkage, also one that starts straight, loses none."""
    made = plan(build())
    assert len(made.coordinates.redundant) == count
    straight = mechanism(part("u"), part("v", x=1.0), joints=(HUNG, KNEE, pin("far", "v.b", "ground.Q")))
    assert plan(straight).coordinates.redundant == ()
