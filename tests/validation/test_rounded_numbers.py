"""Mechanisms with few digits, and inexact or missing angles: each one that can be assembled runs."""

import math
from dataclasses import replace

import numpy as np
import pytest
from benchmarks.change_points import rocker_angle
from benchmarks.rounded_drawings import judge
from tests.build import warnings_of

import scissordyn as sd
from scissordyn.plan.gradients import Gradients
from scissordyn.plan.plan import plan
from scissordyn.plan.redundancy import basis_of


def four_bar(lengths, angles):
    """Return ground, crank, coupler and rocker at given angles [rad]."""
    ground, crank, coupler, rocker = lengths
    a, b, c = angles
    tip = crank * math.cos(a), crank * math.sin(a)
    places = {"crank": ((0.0, 0.0), a, crank), "coupler": (tip, b, coupler), "rocker": ((ground, 0.0), c, rocker)}
    bodies = tuple(
        sd.Body(name, 1.0, 0.1, {"start": (0.0, 0.0), "end": (length, 0.0)}, position=place, angle=angle)
        for name, (place, angle, length) in places.items()
    )
    joints = (
        sd.Revolute("A", ("crank", "start"), ("ground", "O2")),
        sd.Revolute("B", ("coupler", "start"), ("crank", "end")),
        sd.Revolute("C", ("coupler", "end"), ("rocker", "end")),
        sd.Revolute("D", ("rocker", "start"), ("ground", "O4")),
    )
    fixed = (("O2", (0.0, 0.0)), ("O4", (ground, 0.0)))
    return sd.Mechanism(bodies, joints, ground=fixed, gravity=0.0, input_body="crank").driven(speed=1.0)


@pytest.mark.parametrize("seed", range(0, 60, 2))
def test_rounded_array_moves_as_the_exact_one(seed):
    """Closed form: random drawings and tables with 3 to 12 decimals; see benchmarks/rounded_drawings.py."""
    assert judge(seed).verdict == "as the exact one"


@pytest.mark.parametrize("seed", [15, 39, 886])
def test_nearly_equal_sides(seed):
    """Closed form: sides that differ by a few roundings are not taken for those of a parallelogram."""
    assert judge(seed).verdict == "as the exact one"


# Lengths and angles of four-bar linkages that close only approximately, by fault
SLOPPY = {
    "coupler as long as the ground, angle left out": ((4.0, 2.0, 4.0, 3.0), (math.pi / 3, 0.0, 1.4)),
    "parallelogram a little off": ((0.3, 0.1, 0.3, 0.1), (0.9, 1e-7, 0.9)),
    "parallelogram with wrong angles": ((0.3, 0.1, 0.3, 0.1), (0.9, 0.5, 0.3)),
    "crossed parallelogram, coupler parallel to the ground": ((0.3, 0.1, 0.3, 0.1), (0.9, 0.0, -1.9)),
    "all on one line": ((4.0, 2.0, 4.0, 3.0), (0.0, 0.0, 0.0)),
    "nearly equal sides": ((0.3, 0.1, 0.3 + 1e-9, 0.1 - 1e-10), (0.9, 0.0, 0.9)),
}


@pytest.mark.parametrize("case", SLOPPY)
def test_inexact_four_bar(case):
    """Closed form: the rocker's angle over the crank's, on one of the two branches throughout."""
    lengths, angles = SLOPPY[case]
    run = sd.simulate(four_bar(lengths, angles), until=0.6, samples=7)
    assert run.attrs["status"] == "complete"
    crank, rocker = (run["angle"].sel(body=name).values for name in ("crank", "rocker"))
    if case == "all on one line":
        crank, rocker = crank[1:], rocker[1:]
    errors = [np.max(np.abs(np.exp(1j * rocker) - np.exp(1j * rocker_angle(lengths, crank, side)))) for side in (1.0, -1.0)]
    assert min(errors) < 1e-8
    if "parallelogram" in case and "crossed" not in case:
        assert np.allclose(np.exp(1j * rocker), np.exp(1j * crank), rtol=0, atol=1e-12)


@pytest.mark.parametrize(("lengths", "pairs"), [((0.3, 0.1, 0.3, 0.1), 1), ((0.3, 0.1, 0.3 + 1e-11, 0.1), 0)])
def test_elimination_only_to_rounding(lengths, pairs):
    """Contract: the linear constraint of a parallelogram replaces quadratic ones only if the sides are equal to rounding."""
    mechanism = four_bar(lengths, (0.9, 0.0, 0.9))
    assert len(plan(mechanism).coordinates.constraints) == (0 if pairs else 2)


@pytest.mark.parametrize("decimals", [3, 4, 5, 6, 7, 9, 10, 12, 14])
@pytest.mark.parametrize("driven", [True, False])
def test_three_parallel_cranks_with_rounded_lengths(decimals, driven):
    """Closed form: three cranks of a platform stay parallel with any number of digits; contradictions give a warning."""
    rng = np.random.default_rng(decimals)
    length, feet, angle = 0.5123456789123, (0.0, 0.7123456789, 1.3987654321), 1.0

    def rounded(x):
        return x + float(rng.uniform(-0.5, 0.5)) * 10.0**-decimals

    cranks = [
        sd.Body(f"{k}", 1.0, 0.1, {"foot": (0.0, 0.0), "tip": (rounded(length), 0.0)}, position=(foot, 0.0), angle=angle)
        for k, foot in enumerate(feet)
    ]
    tip = length * math.cos(angle), length * math.sin(angle)
    platform = sd.Body("platform", 1.0, 0.1, {f"{k}": (rounded(foot), 0.0) for k, foot in enumerate(feet)}, position=tip)
    joints = [sd.Revolute(f"foot {k}", (f"{k}", "foot"), ("ground", f"{k}")) for k in range(3)]
    joints += [sd.Revolute(f"tip {k}", (f"{k}", "tip"), ("platform", f"{k}")) for k in range(3)]
    ground = tuple((f"{k}", (rounded(foot), 0.0)) for k, foot in enumerate(feet))
    mechanism = sd.Mechanism((*cranks, platform), tuple(joints), ground=ground, gravity=9.81, input_body="0")
    run = sd.simulate(mechanism.driven(speed=0.5) if driven else mechanism, until=0.3, samples=7)
    assert run.attrs["status"] == "complete"
    angles = run["angle"].values
    assert np.max(np.abs(angles[:, :3] - angles[:, :1])) < 40.0 * 10.0**-decimals + 1e-11
    assert np.max(np.abs(angles[:, 3])) < 40.0 * 10.0**-decimals + 1e-11
    assert np.ptp(angles[:, 0]) > 0.1
    contradiction = [text for text in warnings_of(run) if "contradict each other" in text]
    assert bool(contradiction) == (decimals < 8)


def rounded_ring(units, decimals):
    """Return a Hoberman ring and the same with rounded positions and points, in m and rad."""

    def rounded(place):
        return round(place[0], decimals), round(place[1], decimals)

    exact = sd.hoberman_ring(units=units, angle=0.4).driven(speed=-0.2)
    bodies = tuple(
        replace(
            body,
            points={name: rounded(place) for name, place in body.points.items()},
            centre=rounded(body.centre),
            position=rounded(body.placed_position),
            angle=round(body.placed_angle, decimals),
        )
        for body in exact.bodies
    )
    return exact, replace(exact, bodies=bodies)


@pytest.mark.parametrize("units", [3, 8, 12])
def test_kept_constraints_are_far_from_dependent(units):
    """Limit: rounding changes neither the number of kept constraints nor the condition of their gradients."""

    def condition(ring):
        coordinates = plan(ring).coordinates
        gradients = Gradients(coordinates.free, coordinates.basis, list(coordinates.constraints))
        b = basis_of(np.array([ring.bodies[0].placed_angle]))
        rows = gradients.unit(np.append(coordinates.nearest(b, coordinates.placed[0]), b))
        values = np.linalg.svd(rows if isinstance(rows, np.ndarray) else rows.toarray(), compute_uv=False)
        return values.size, float(values[0] / values[-1])

    count, exact = condition(rounded_ring(units, 12)[1])
    for decimals in range(3, 12):
        size, rounded = condition(rounded_ring(units, decimals)[1])
        assert size == count
        assert rounded < 2.0 * exact


@pytest.mark.parametrize("decimals", [3, 4, 5, 6, 7, 8, 9, 10, 12])
@pytest.mark.parametrize("units", [3, 8, 12])
def test_rounded_ring_moves_as_the_exact_one(units, decimals):
    """Limit: a ring with rounded numbers moves as the exact one."""
    exact, rounded = rounded_ring(units, decimals)
    runs = [sd.simulate(ring, until=0.5, samples=6) for ring in (exact, rounded)]
    assert [run.attrs["status"] for run in runs] == ["complete", "complete"]
    apart = np.max(np.abs(runs[1]["angle"].values - runs[0]["angle"].values))
    assert apart < 100.0 * 10.0**-decimals
    assert np.ptp(runs[0]["angle"].values[:, 0]) == pytest.approx(0.1)
    assert ("contradict each other" in runs[1].attrs["warnings"]) or decimals > 5
