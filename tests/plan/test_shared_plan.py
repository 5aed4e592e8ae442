"""Mechanisms that share the tables of a plan, and mechanisms that do not."""

import copy
import dataclasses
import pickle

import pytest

import scissordyn as sd
from scissordyn.plan.plan import RECENT_PLANS, compiled, plan
from scissordyn.run.advance.driver import Driver
from scissordyn.run.advance.loop import advance
from scissordyn.run.trajectory import compute, make_driver

FREE = sd.Clearance(0.5e-3)  # Clearance without friction
RUBBING = sd.Clearance(0.5e-3, friction=sd.LuGre(kinetic=0.05))  # Clearance with friction
OPTIONS = sd.Options(0.02, samples=101)  # Options of the compared runs


def array():
    """Return an array with clearance at joint A."""
    return sd.scissor(units=2).with_clearance("A", FREE).driven(speed=sd.rpm(150)).track("tip", "slider", "centre")


# Changes of a mechanism that keep the tables of its plan, by name
VARIATIONS = {
    "clearance": lambda known: known.replace("A.clearance", 0.2e-3),
    "laws": lambda known: known.with_clearance("A", sd.Clearance(0.3e-3, damping=sd.Flores(restitution=0.5))),
    "motion": lambda known: known.driven(sd.Harmonic(0.5236, 0.1, 60.0)),
    "gravity": lambda known: known.replace("gravity", 1.62),
}

# Changes of a mechanism that need other tables, by name
OTHERS = {
    "friction": lambda known: known.with_clearance("A", RUBBING),
    "ideal": lambda known: known.ideal(),
    "joint": lambda known: known.with_clearance("unit 1/pivot", FREE),
    "name": lambda known: dataclasses.replace(
        known, joints=tuple(dataclasses.replace(each, name=f"{each.name}'") for each in known.joints)
    ),
    "mass": lambda known: known.replace("slider.mass", 7.0),
    "rod": lambda known: sd.constrain_contact(known),
    "component": lambda known: dataclasses.replace(known, components=(sd.Force("load", ("slider", "centre"), (10.0, 0.0)),)),
    "contact force": lambda known: known.with_clearance("A", sd.Clearance(0.5e-3, friction=sd.Ambrosio(kinetic=0.1))),
    "drive": lambda known: dataclasses.replace(known, drives=()),
    "track": lambda known: dataclasses.replace(known, tracks=(sd.Track("tip", "slider", (0.1, 0.0)),)),
}


def run(made):
    return compute(made, OPTIONS)


def assert_same(one, other):
    """Compare two trajectories bit for bit."""
    for name in ("time", "state", "total", "mode", "memory", "mass", "reference"):
        assert getattr(one.samples, name).tobytes() == getattr(other.samples, name).tobytes(), name
    assert one.log.tobytes() == other.log.tobytes()
    assert one.peak.tobytes() == other.peak.tobytes()
    assert (one.status, one.warnings) == (other.status, other.warnings)


@pytest.mark.parametrize("variation", VARIATIONS)
def test_case_that_fits_shares_the_tables(variation):
    """Identity: the run is bit for bit that of a plan compiled for the mechanism alone."""
    known = plan(array())
    run(known)
    varied = VARIATIONS[variation](array())
    assert known.fits(varied)
    shared = known.case(varied)
    assert shared.model is known.model
    assert_same(run(shared), run(compiled(varied)))


@pytest.mark.parametrize("variation", VARIATIONS)
def test_change_of_a_planned_mechanism_shares_its_tables(variation):
    """Identity: the run is bit for bit that of the mechanism alone, warnings included."""
    known = array()
    sd.simulate(known, until=0.02, samples=101)
    varied = VARIATIONS[variation](known)
    assert plan(varied).model is plan(known).model
    near = sd.simulate(varied, until=0.02, samples=101)
    RECENT_PLANS.clear()
    far = sd.simulate(varied, until=0.02, samples=101)
    near.attrs["statistics"] = far.attrs["statistics"]  # it has the time that was taken
    assert near.identical(far)


@pytest.mark.parametrize("other", OTHERS)
def test_change_of_the_tables_needs_a_plan(other):
    """Contract: a mechanism that does not fit gets the plan that it would have alone."""
    known = array()
    plan(known)
    changed = OTHERS[other](known)
    assert plan(changed).model is not plan(known).model
    assert_same(run(plan(changed)), run(compiled(changed)))


@pytest.mark.parametrize("changed", ["mass", "inertia", "length", "friction"])
def test_plans_with_the_same_structure_share_templates(changed):
    """Identity: the run in copied arrays is bit for bit that of a plan compiled for the mechanism alone."""
    known = array()
    for _ in range(2):  # the second run makes the templates
        run(plan(known))
    other = {
        "mass": known.replace("slider.mass", 7.0),
        "inertia": known.replace("unit 2/bar 1.inertia", 0.02),
        "length": with_length(known, 0.9),
        "friction": known.with_clearance("A", RUBBING),
    }[changed]
    made = plan(other)
    assert made.model is not plan(known).model
    assert (made.structural is plan(known).structural) == (changed != "friction")
    assert (made.reduction is plan(known).reduction) == (changed in ("mass", "inertia"))
    assert_same(run(made), run(compiled(other)))


def test_inertia_of_a_section_of_a_bar_can_need_coordinates_of_its_own():
    """Identity: a section with another inertia than its bar has a direction; the plan is that of the mechanism alone."""
    known = sd.with_bending(array(), section="tube 60x60x1.56 mm", material="steel")
    plan(known)
    name = next(body.name for body in known.bodies if body.name.endswith("/1"))
    other = known.replace(f"{name}.inertia", 1.01 * known.body(name).inertia)
    assert plan(other).coordinates.free > plan(known).coordinates.free
    assert plan(other).structure == compiled(other).structure


def with_length(known, factor):
    """Return a mechanism of another size."""
    return dataclasses.replace(
        known,
        bodies=tuple(
            dataclasses.replace(
                body,
                points={name: (factor * x, factor * y) for name, (x, y) in body.points.items()},
                centre=tuple(factor * x for x in body.centre),
                position=body.position and tuple(factor * x for x in body.position),
            )
            for body in known.bodies
        ),
        ground=tuple((name, (factor * x, factor * y)) for name, (x, y) in known.ground),
    )


@pytest.mark.parametrize("other", OTHERS)
def test_what_enters_the_tables_does_not_fit(other):
    """Limit: lengths, masses, joints, rods, components, drives and tracked points have a plan of their own."""
    assert not plan(array()).fits(OTHERS[other](array()))


def test_force_over_time_does_not_fit_a_constant_one():
    """Contract: a force with a time function does not share the tables of a constant one."""
    constant = sd.Force("load", ("slider", "centre"), (10.0, 0.0))
    growing = dataclasses.replace(constant, time_function=sd.Cycloidal(0.0, 1.0, 0.5))
    one, other = (dataclasses.replace(array(), drives=(), components=(part,)) for part in (constant, growing))
    assert not plan(one).fits(other)


def test_equal_mechanisms_fit():
    """Contract: equal mechanisms share a plan."""
    assert plan(array()).fits(array())


def test_plan_is_not_part_of_the_mechanism():
    """Contract: a mechanism with a plan equals one without, and is copied and pickled without it."""
    known, fresh = array(), array()
    assert plan(known) is plan(known)
    assert known == fresh
    assert len(pickle.dumps(known)) == len(pickle.dumps(fresh))
    for other in (copy.copy(known), pickle.loads(pickle.dumps(known)), dataclasses.replace(known)):
        assert other == known
        assert plan(other).model is plan(known).model


def test_numbers_are_not_shared():
    """Contract: two drivers of one plan have separate arrays."""
    made = plan(array())
    one, other = made.numbers(), made.numbers()
    for name, first, second in zip(one._fields, one, other, strict=True):
        assert not first.size or first is not second, name
    first_driver, _, _ = make_driver(made, OPTIONS)
    second_driver, _, _ = make_driver(made, OPTIONS)
    assert isinstance(first_driver, Driver)
    advance(first_driver, 0.01)
    assert second_driver.time == 0.0
    assert_same(run(made), run(compiled(array())))
