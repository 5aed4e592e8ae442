"""Parts of rigid bars attached to a bar that bends: the limit of rigid bars, energy, hard contact, oil in the joints."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from tests.build import assert_balance, chain, counts_of

import scissordyn as sd
from scissordyn.record.summary import summary_of

LENGTH, MASS = 1.0, 2.0  # Length [m] and mass [kg] of a bar
SOFT = {"bending_stiffness": 2000.0, "axial_stiffness": 2e6}  # Bending stiffness [N m^2] and axial stiffness [N] of a soft bar
# Bending stiffness [N m^2] and axial stiffness [N] of a bar that is nearly rigid
STIFF = {"bending_stiffness": 4e6, "axial_stiffness": 4e8}

Attach = Callable[[sd.Mechanism], sd.Mechanism]


def bars():
    """Return a bar that falls about a pin, with a point at 0.3 m, and one that hangs on its end; the first bends."""
    arm = sd.bar("arm", length=LENGTH, mass=MASS, angle=0.4)
    arm = replace(arm, points={**arm.points, "third": (0.3, 0.0)}, angular_velocity=1.0)
    fore = sd.bar("fore", length=0.8, mass=1.0, angle=-1.2)
    return chain(arm, fore, pins=("O", "elbow"), ground={"wall": (1.3, 0.9)}, input_body="arm", output_body="fore")


def adding(field, *parts):
    """Return a function that adds parts to a mechanism."""
    return lambda made: made.with_parts({field: (*getattr(made, field), *parts)})


def rod_between(made):
    """Add a bar that is pinned to the point at 0.3 m and to a block on a guide."""
    third = made.place(("arm", "third"))
    link = sd.bar("link", length=0.5, mass=0.4, position=third, angle=0.0)
    block = sd.point_mass("block", mass=0.5, position=(third[0] + 0.5, third[1]))
    pins = (sd.Revolute("third", ("link", "start"), ("arm", "third")), sd.Revolute("end", ("link", "end"), ("block", "centre")))
    guide = sd.Guide("guide", ("block", "centre"), through=(0.0, third[1]))
    parts = {"bodies": (*made.bodies, link, block), "joints": (*made.joints, *pins), "guides": (guide,)}
    return made.with_parts(parts)


def welded(made):
    """Weld the second bar to the end of the first instead of pinning it."""
    return made.with_parts({"joints": made.joints[:1], "welds": (sd.Weld("weld", ("fore", "start"), ("arm", "end")),)})


def in_a_channel(made):
    """Let the second bar, still pinned to the first, move with clearance in a channel of the ground."""
    block = sd.GuideClearance(1e-3, length=0.2, width=0.04)
    guide = sd.Guide("channel", ("fore", "middle"), made.place(("fore", "middle")), -1.2, aligned=True, clearance=block)
    return made.with_parts({"guides": (guide,)})


def own_in_a_channel(made):
    """Let the bar that bends move in a channel of the ground instead of turning on its pin."""
    block = sd.GuideClearance(1e-3, length=0.2, width=0.04)
    guide = sd.Guide("channel", ("arm", "third"), made.place(("arm", "third")), 0.4, aligned=True, clearance=block)
    return made.with_parts({"joints": made.joints[1:], "guides": (guide,)})


ENDS = ("arm", "end"), ("ground", "wall")  # Points between which components act
ATTACHED = {
    "pin at a place": rod_between,
    "weld": welded,
    "clearance joint": lambda made: made.with_clearance("elbow", sd.Clearance(5e-4, friction=sd.LuGre(kinetic=0.1))),
    "clearance joint with oil": lambda made: made.with_clearance(
        "elbow", sd.Clearance(5e-4, friction=sd.NoFriction(), lubrication=sd.Lubrication(viscosity=0.05))
    ),
    "clearance guide of a body on it": in_a_channel,
    "clearance guide of the bar": own_in_a_channel,
    "spring": adding("components", sd.Spring("part", *ENDS, stiffness=500.0, free_length=0.3, damping=5.0)),
    "constant-force spring": adding("components", sd.ConstantForceSpring("part", *ENDS, tension=60.0)),
    "cable": adding("components", sd.Cable("part", *ENDS, stiffness=4e3, free_length=0.5, damping=20.0)),
    "torsion spring": adding("components", sd.TorsionSpring("part", "arm", stiffness=60.0, damping=2.0)),
    "tape spring": adding("components", sd.TapeSpring("part", "fore", "arm", 20.0, 15.0, 5.0, 10.0, 4.0, 0.0)),
    "clutch": adding("components", sd.Clutch("part", "arm", capacity=8.0)),
    "bushing": adding("components", sd.Bushing("part", *ENDS, 300.0, 400.0, 0.0, 20.0, 3.0, 3.0)),
    "force": adding("components", sd.Force("part", ("arm", "third"), (0.0, 80.0), follows=True)),
    "torque": adding("components", sd.Torque("part", "arm", 30.0)),
    "motor": adding("components", sd.Motor("part", "arm", stall_torque=40.0, no_load_speed=8.0, inertia=0.02)),
    "angle stop": adding("components", sd.AngleStop("part", "arm", 0.4025, stiffness=2e4)),
    "travel stop": adding(
        "components", sd.TravelStop("part", ("arm", "end"), direction=1.5707963267948966, limit=0.391, stiffness=1e6)
    ),
    "rod": adding("rods", sd.Rod("part", ("fore", "end"), ("ground", "wall"))),
    "latch": adding("latches", sd.Latch("part", "arm", 0.403)),
    "drive": lambda made: made.driven(speed=2.0),
    "controller": lambda made: made.controlled(sd.PID(300.0, 5.0), speed=2.0),
}
"""Functions that attach a part to a flexible bar, by name of the part."""


@pytest.mark.parametrize("name", list(ATTACHED))
def test_it_acts_as_on_a_rigid_bar(name):
    """Limit: with a very stiff bar the second bar moves as with rigid ones, and not as without the part."""
    factor = 100.0 if name in ("latch", "clearance joint") else 1.0  # impulses bend bars more
    rigid = ATTACHED[name](bars())
    stiff = sd.with_bending(rigid, "arm", modes=2, **{key: factor * value for key, value in STIFF.items()})
    runs = [sd.simulate(made, until=0.02, samples=2) for made in (stiff, rigid, bars())]
    found, exact, without = (run["position"].sel(body="fore").values[-1] for run in runs)
    assert runs[0].attrs["status"] == "complete"
    assert np.abs(found - exact).max() < 0.02 * np.abs(without - exact).max()


@pytest.mark.parametrize("name", list(ATTACHED))
@pytest.mark.parametrize("how", [{"modes": 3}, {"elements": 3}], ids=["modes", "elements"])
def test_its_energy_is_kept(name, how):
    """Identity: the balance of energy of soft bars."""
    run = sd.simulate(sd.with_bending(ATTACHED[name](bars()), "arm", **how, **SOFT), until=0.01, samples=9)
    assert_balance(run, 1e-6)


TUBE = 42743.0, 7.5e7  # Bending stiffness EI [N m^2] and axial stiffness EA [N] of a steel tube


def with_tubes(rigid, stiffness=1.0, **how):
    """Return a mechanism whose bars are tubes, with a multiple of their stiffness."""
    rigidity, axial = (stiffness * value for value in TUBE)
    return sd.with_bending(rigid, bending_stiffness=rigidity, axial_stiffness=axial, **how)


def oiled(viscosity=0.1):
    """Return a clearance of 0.4 mm with oil in it."""
    return sd.Clearance(4e-4, friction=sd.NoFriction(), lubrication=sd.Lubrication(viscosity=viscosity))


def test_hard_contact_on_bars_that_bend(array):
    """Second model: the first impact is that of compliant contact, and the impulse over 3 ms agrees to 5 %."""
    laws = {"damping": sd.Flores(restitution=0.9), "friction": sd.NoFriction()}
    loose = (sd.Clearance(0.5e-3, contact=kind, **laws) for kind in ("hard", "compliant"))
    hard, soft = (sd.simulate(with_tubes(array.with_clearance("A", joint), modes=4), until=3e-3, samples=11) for joint in loose)
    assert hard.attrs["status"] == "complete"
    for name, within in (("contact_start", 1e-5), ("approach_speed", 1e-4)):
        assert float(hard[name][0]) == pytest.approx(float(soft[name][0]), rel=within)
    assert float(hard["impulse"].sum()) == pytest.approx(float(soft["impulse"].sum()), rel=0.05)
    assert hard["impulse"].size > 10 * soft["impulse"].size  # the light end of the bar is pushed back again and again


def test_the_summary_of_bars():
    """Identity: stress, moment, deflection and compression of the summary are those of the run."""
    made = sd.scissor(units=1, angle=0.6)
    made = sd.with_bending(made, section="tube 60x60x1.56 mm", material="steel", modes=3).driven(speed=0.0)
    run = sd.simulate(made, until=1e-4, samples=2, start="static")
    said = summary_of(run).plain()["bars"]
    assert said["stress"] == pytest.approx(float(np.abs(run["bar_largest_stress"]).max()), rel=1e-12)
    assert said["utilisation"] == pytest.approx(said["stress"] / 235e6, rel=1e-12)
    assert said["deflection"] == pytest.approx(float(np.abs(run["bar_largest_deflection"]).max()), rel=1e-12)
    ratio = float(run["bar_largest_buckling_ratio"].max())
    assert said["buckling"] == 1.0 / ratio
    # a second road: linear buckling of the straight mechanism under its weight
    assert said["buckling"] == pytest.approx(float(sd.buckling(made)["load_factor"][0]), rel=0.02)
    assert "of its yield strength; largest deflection" in str(summary_of(run))


@pytest.mark.parametrize("how", [{"modes": 4}, {"elements": 2}])
@pytest.mark.parametrize("method", ["dop853", "rodas5p"])
def test_a_film_on_bars_that_bend_keeps_the_balance_of_energy(array, method, how):
    """Identity: the energy balance with both formulations and integrators, down to a thin film."""
    bent = with_tubes(array.with_clearance("A", oiled()), **how)
    run = sd.simulate(bent, until=4e-3, samples=41, method=method, rtol=1e-9)
    assert run.attrs["status"] == "complete"
    assert float(run["film_least_thickness"].min()) < 0.2 * 4e-4
    assert float(run["film_power_lost"].max()) > 1.0
    assert float(np.abs(run["energy_residual"]).max()) < 1e-8 * float(np.ptp(run["kinetic_energy"].values))


def test_stiff_bars_with_a_film_tend_to_rigid_ones(array):
    """Limit: the largest deviation of the journal over a millisecond as 1/EI tends to zero, of the first order."""
    length, apart = 1e-3, []
    oily = array.with_clearance("A", oiled())
    rigid = sd.simulate(oily, until=length, samples=41)["eccentricity"].sel(joint="A").values
    for factor in (1e5, 1e6):
        run = sd.simulate(with_tubes(oily, factor, modes=2), until=length, samples=41, method="rodas5p")
        apart.append(float(np.abs(run["eccentricity"].sel(joint="A").values - rigid).max()))
    assert apart[0] < 0.01 * 4e-4
    assert 7.0 < apart[0] / apart[1] < 13.0


def test_thick_oil_is_integrated_by_the_stiff_method(array):
    """Contract: by the damping of the film where it is thin; thin oil and dry joints of bars that bend are not stiff."""
    bent = (with_tubes(array.with_clearance("A", oiled(viscosity)), modes=4) for viscosity in (0.1, 0.001))
    runs = [sd.simulate(made, until=1e-6, samples=2) for made in bent]
    assert [counts_of(run)["method"] for run in runs] == ["rodas5p", "dop853"]


def test_a_straight_edge_along_a_bar_that_bends_is_refused() -> None:
    """Contract: an edge is straight, so it cannot follow the bar; a disc at one of its points can."""
    edge = sd.EdgeContact("edge", ("arm", "start"), ("fore", "end"), length=0.3, half_width=0.01)
    with pytest.raises(
        sd.InputError, match="the straight edge of component 'edge' acts on flexible bar 'arm'; expected a rigid"
    ):
        sd.with_bending(adding("components", edge)(bars()), "arm", **SOFT)
    disc = replace(edge, length=0.0)
    bent = sd.with_bending(adding("components", disc)(bars()), "arm", **SOFT)
    assert bent.components[0].start == ("arm", "start")
