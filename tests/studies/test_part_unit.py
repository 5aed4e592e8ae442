"""Units of loads of components and couplings: force or torque, in requirements, tables, reports, pictures and exports."""

from dataclasses import replace

import numpy as np
import pytest
from tests.build import ORIGIN, wheel

import scissordyn as sd
from scissordyn.cli.study import show_answers
from scissordyn.config.study import read_requirement
from scissordyn.plot.study import response_curves
from scissordyn.run.measure import load_units
from scissordyn.studies.answer.report import table
from scissordyn.studies.answer.verdict import by_point, worst_cases
from scissordyn.studies.ask.description import Study
from scissordyn.studies.ask.design import Factor
from scissordyn.studies.ask.requirement import Goal, Optimisation, Requirement
from scissordyn.studies.compute.execute import simulated
from studies.test_answer import made_up, result_of
from studies.test_study import arm

MEASURE = "peak_component_force"  # Measure whose unit depends on the component
# Component whose force is in N
SPRING = sd.Spring("tie", ("unit 1/bar 1", "end"), ("unit 1/bar 2", "end"), stiffness=100.0, free_length=1.0)
HINGE = sd.TorsionSpring("hinge", "unit 1/bar 1", stiffness=10.0)  # Component whose torque is in N m


def study(*components, **changes):
    """Return a study of the paper's array with components, over its clearance."""
    fields = {"factors": (Factor("A.clearance", sd.Interval(1e-4, 3e-4, 3)),), "measures": (MEASURE,)}
    return Study(replace(arm(), components=components), sd.Options(0.001), **(fields | changes))


def results(described):
    """Return made-up results: the first component 1, 2, 3; the second ten times as much."""
    units = load_units(described.mechanism)["component"]
    about = {"units": " or ".join(dict.fromkeys(units.values())), "role": "measure"}
    exerted = (("case", "component"), np.outer([1.0, 2.0, 3.0], 10.0 ** np.arange(len(units))), about)
    others = made_up(described, np.ones(3)).drop_vars(["peak_force", "contact_count"])
    coordinates = {"component": list(units), "component_unit": ("component", list(units.values()))}
    return others.assign({MEASURE: exerted}).assign_coords(coordinates)


@pytest.mark.parametrize(("component", "unit"), [(SPRING, "N"), (HINGE, "N m")])
def test_unit_of_one_component(component, unit):
    """Contract: the unit is that of the port's output."""
    described = study(component)
    found = results(described)
    assert found[MEASURE].attrs["units"] == unit
    assert by_point(described, found)[MEASURE].attrs["units"] == unit
    assert f"{component.name}.{MEASURE} [{unit}]" in table(found).columns


def test_unit_in_a_batch():
    """Contract: simulated results have the units."""
    described = study(SPRING, HINGE)
    found = simulated(described, np.array([0]))
    assert found["component_unit"].values.tolist() == ["N", "N m"]
    assert found[MEASURE].attrs["units"] == "N or N m"
    many = sd.simulate_many(described.mechanism, {"A.clearance": [1e-4]}, until=1e-3, measures=[MEASURE, "peak_force"])
    assert [many[name].attrs["units"] for name in (MEASURE, "peak_force")] == ["N or N m", "N"]


def test_forces_and_torques_are_kept_apart(tmp_path, capsys):
    """Contract: tables, pictures and exports separate forces and torques, each with its unit."""
    described = study(SPRING, HINGE, requirements=(read_requirement(f"{MEASURE} < 25 N m"),))
    found = results(described)
    points = by_point(described, found)
    assert points[f"{MEASURE} (torque)"].values.tolist() == [10.0, 20.0, 30.0]
    assert points[f"{MEASURE} (force)"].values.tolist() == [1.0, 2.0, 3.0]
    assert worst_cases(described, found)[0].text == "30.00 N·m"
    result = result_of(described, found)
    show_answers(result)
    shown = " ".join(capsys.readouterr().out.split())
    page = result.report(tmp_path / "r.html").read_text(encoding="utf-8")
    assert f"{MEASURE} (torque) 10.00 20.00 30.00 N·m {MEASURE} (force) 1.000 2.000 3.000 N" in shown
    assert "value 30.00 N·m; margin -20.0%" in shown
    assert "<td>30.00 N·m</td>" in page
    assert "SI" not in page.partition("<img")[0]
    labels = [axes.get_ylabel() for axes in response_curves(points)]
    assert labels == ["largest torque [N·m]", "largest force [N]"]
    assert list(table(found).columns)[3:6] == ["A.clearance [m]", f"tie.{MEASURE} [N]", f"hinge.{MEASURE} [N m]"]


@pytest.mark.parametrize(
    ("text", "bound", "unit"),
    [("< 0.5 kN", 500.0, "N"), ("< 500 N mm", 0.5, "N m"), ("< 2 J/rad", None, None), ("< 5", None, None)],
)
def test_unit_of_a_bound(text, bound, unit):
    """Contract: a bound is a force or a torque; other units are refused."""
    if bound is None:
        with pytest.raises(sd.InputError, match=r"N or|N\] or"):
            read_requirement(f"{MEASURE} {text}")
        return
    read = read_requirement(f"{MEASURE} {text}")
    assert (read.bound, read.unit) == (bound, unit)


def test_label_of_a_bound():
    """Contract: a bound given in Python is shown with unit and prefix."""
    labels = [one.label for one in (Requirement("peak_force", "<", 500.0), Requirement("peak_track_deviation", "<", 6e-4))]
    assert labels == ["peak_force < 500 N", "peak_track_deviation < 0.6 mm"]
    assert Requirement("contact_count", "<", 5.0).label == "contact_count < 5"
    assert Requirement(MEASURE, "<", 5.0, "hinge", unit="N m").label == f"hinge.{MEASURE} < 5 N·m"
    assert Requirement("own", ">", 0.5).label == "own > 0.5"


@pytest.mark.parametrize(
    ("components", "changes", "says"),
    [
        ((SPRING,), {"requirements": (Requirement(MEASURE, "<", 5.0, unit="N m"),)}, "in N m: no such component"),
        ((SPRING, HINGE), {"requirements": (Requirement(MEASURE, "<", 5.0, "tie", unit="N m"),)}, "'tie.* in N m"),
        ((SPRING, HINGE), {"requirements": (Requirement(MEASURE, "<", 5.0),)}, "of forces and of torques"),
        ((), {"requirements": (Requirement(MEASURE, "<", 5.0),)}, "the case has no component"),
        ((SPRING, HINGE), {"optimisation": Optimisation((Goal(MEASURE),))}, "of forces and of torques"),
    ],
)
def test_bounds_that_fit_no_component(components, changes, says):
    """Contract: the error lists the components with their units."""
    with pytest.raises(sd.InputError, match=says) as error:
        study(*components, **changes)
    assert "[N" in str(error.value) or not components


def test_loads_of_couplings(tmp_path):
    """Closed form: a rack of 2 kg on an incline drives its pinion with J/R^2 times its acceleration, a force."""
    radius, slope, inertia = 0.05, 0.3, 0.001
    mechanism = sd.Mechanism(
        bodies=(wheel("pinion", inertia), sd.point_mass("rack", mass=2.0, position=(0.1, -0.05))),
        joints=(sd.Revolute("A", ("pinion", "c"), ("ground", "O")),),
        guides=(sd.Guide("bed", ("rack", "centre"), through=(0.1, -0.05), direction=slope),),
        ground=ORIGIN,
        couplings=(sd.Coupling("teeth", sd.Slide(("rack", "centre"), slope), sd.RelativeAngle("pinion"), radius),),
    )
    load = inertia / radius**2 * 9.81 * np.sin(slope) * 2.0 / (2.0 + inertia / radius**2)
    found = sd.study(
        mechanism,
        {"rack.mass": [2.0]},
        until=0.1,
        measures="peak_coupling_force",
        requirements="peak_coupling_force < 2 N",
        engine=1,
        store=tmp_path / "teeth.db",
    )
    assert found.table["teeth.peak_coupling_force [N]"].values == pytest.approx([load], rel=1e-6)
    assert found.recommend().margins[0].margin == pytest.approx(1.0 - load / 2.0, rel=1e-6)
    assert found.points["peak_coupling_force (force)"].attrs["label"] == "largest force of couplings on their outputs"
    with pytest.raises(sd.InputError, match="in N m: no such coupling"):
        sd.study(
            mechanism, {"rack.mass": [2.0]}, until=0.1, requirements="peak_coupling_force < 2 N m", store=tmp_path / "b.db"
        )
