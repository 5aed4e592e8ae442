"""Internal forces, deflection and buckling of bending bars, by equilibrium and closed forms, and their measures."""

import dataclasses
import math

import numpy as np
import pytest
import xarray as xr
from tests.build import on_pin

import scissordyn as sd
from scissordyn.cli.main import status_of

PLACES = (0.0, 0.1, 0.33, 0.5, 0.97, 1.0)  # Places along a bar, as fractions of its length
RIGIDITY = 100.0  # [N m^2] bending stiffness of the bar


def clamped(elements, *, gravity=0.0, **options):
    """Return a bar of 1 m clamped at the origin."""
    given = options or {"bending_stiffness": RIGIDITY, "axial_stiffness": 1e7}
    mass = 7850.0 * 4e-4 if options else 1.0
    return sd.with_bending(on_pin(sd.bar("bar", length=1.0, mass=mass), gravity=gravity), elements=elements, **given)


def still(mechanism):
    """Return a run in static equilibrium."""
    return sd.simulate(mechanism, until=1e-6, samples=2, start="static")


def by_modes(*loads, **options):
    """Return a bar of 1 m and 1 kg with modes, clamped at the origin by its drive."""
    given = {"bending_stiffness": RIGIDITY, "axial_stiffness": 1e7, "modes": 8} | options
    return sd.with_bending(on_pin(sd.bar("bar", length=1.0, mass=1.0), *loads), **given)


@pytest.mark.parametrize("modes", [2, 12])
@pytest.mark.parametrize("axial", [1e5, 1e9])
def test_internal_forces_of_a_bar_by_modes_are_in_equilibrium(modes, axial):
    """Identity: N = P sin(angle), Q = P cos(angle), M = P (x_tip - x) for any EA and few modes, P L^2/EI = 10."""
    force = 10.0 * RIGIDITY
    made = by_modes(sd.Force("push", ("bar", "end"), (0.0, force)), modes=modes, axial_stiffness=axial).driven(speed=0.0)
    run = still(made)
    found = sd.internal_forces(run, made, places=[0.0, 0.5, 1.0]).isel(time=0, bar=0)
    x = run["position"].sel(body=["bar", "bar/1", "bar/2"], axis="x")[0].values
    assert found["bending_moment"].values == pytest.approx(force * (x[-1] - x), abs=1e-6 * force)
    assert np.hypot(found["axial_force"], found["shear_force"]).values == pytest.approx([force] * 3, rel=1e-6)
    tip = float(run["angle"].sel(body="bar/2")[0])
    assert found["axial_force"].values[[0, 2]] == pytest.approx([0.0, force * math.sin(tip)], abs=1e-5 * force)
    ends, starts = run["beam_end_axial_force"][0].values, run["beam_start_axial_force"][0].values
    assert starts[1:] == pytest.approx(ends[:-1], abs=1e-7 * force)  # no steps where nothing acts


@pytest.mark.parametrize("force", [(1000.0, 0.0), (-1000.0, 0.0)])
def test_axial_force_up_to_a_load(force):
    """Closed form: the axial force is the load up to its point, and zero beyond."""
    made = by_modes(sd.Force("push", ("bar", "middle"), force)).driven(speed=0.0)
    found = sd.internal_forces(still(made), made, places=[0.0, 0.2, 0.499, 0.501, 1.0])["axial_force"].isel(time=0, bar=0)
    assert found.values == pytest.approx([force[0]] * 3 + [0.0] * 2, abs=1e-5)


@pytest.mark.parametrize("units", [1, 2])
def test_free_ends_of_a_moving_array(units):
    """Identity: free ends carry no force, pins no moment, and the driven end the reaction."""
    arm = sd.scissor(units=units).with_clearance("A", sd.Clearance(0.5e-3))
    made = sd.with_bending(arm, section="tube 60x60x1.56 mm", material="steel", modes=4).driven(speed=sd.rpm(150))
    run = sd.simulate(made, until=4e-3, samples=41)
    found = sd.internal_forces(run, made, places=[0.0, 1.0])
    largest = float(np.abs(found["axial_force"]).max())
    free = found.sel(bar=[f"unit {units}/bar 1", f"unit {units}/bar 2"]).isel(place=1)
    for name in ("axial_force", "shear_force", "bending_moment"):
        assert float(np.abs(free[name]).max()) < 1e-7 * largest
    root = found.isel(place=0).sel(bar="unit 1/bar 1")
    reaction = np.hypot(*run["reaction"].sel(joint="O").values.T)
    assert np.hypot(root["axial_force"], root["shear_force"]).values == pytest.approx(reaction, rel=1e-9)


@pytest.mark.parametrize("load", [0.1, 10.0])
def test_internal_forces_of_a_chain_of_elements(load):
    """Identity: M = P (x_tip - x), N = P sin(angle), Q = P cos(angle) along a bar that bends far."""
    made = clamped(4)
    push = sd.Force("push", ("bar/4", "end"), (0.0, RIGIDITY * load))
    made = made.with_parts({"components": (*made.components, push)}).driven(speed=0.0)
    run = still(made)
    found = sd.internal_forces(run, made, places=PLACES).isel(time=0, bar=0)
    tip = run["position"].sel(body="bar/4")[0].values
    x = found["position"].values[:, 0]
    np.testing.assert_allclose(found["bending_moment"], RIGIDITY * load * (tip[0] - x), atol=1e-7 * RIGIDITY * load)
    size = np.hypot(found["axial_force"], found["shear_force"])
    np.testing.assert_allclose(size, RIGIDITY * load, rtol=1e-6)
    assert found["axial_force"].values[0] == pytest.approx(0.0, abs=1e-5 * RIGIDITY * load)
    assert float(run["bar_largest_bending_moment"].item()) == pytest.approx(RIGIDITY * load * tip[0], rel=1e-7)
    assert float(run["bar_largest_bending_moment_place"].item()) == 0.0


def test_deflection_of_a_bar_on_two_pins():
    """Closed form: deflection 5 w L^4/(384 EI), moment w L^2/8 and its stress at the middle, shear force w L/2 at the ends."""
    slot = sd.Guide("end", ("bar", "end"), (0.0, 0.0), 0.0)
    made = on_pin(sd.bar("bar", length=1.0, mass=7850.0 * 4e-4), guides=(slot,), gravity=9.81)
    made = sd.with_bending(made, section="solid 20x20 mm", material="steel", elements=16)
    run = still(made)
    weight, rigidity = 7850.0 * 4e-4 * 9.81, 210e9 * 0.02**4 / 12.0
    found = sd.internal_forces(run, made, places=[0.0, 0.25, 0.5]).isel(time=0, bar=0)
    middle = 5.0 * weight / (384.0 * rigidity)
    quarter = weight / (24.0 * rigidity) * 0.25 * (1.0 - 2.0 * 0.25**2 + 0.25**3)
    np.testing.assert_allclose(found["deflection"], [0.0, -quarter, -middle], rtol=1e-4, atol=1e-9)
    np.testing.assert_allclose(
        np.abs(found["bending_moment"]), weight * np.array([0.0, 3.0 / 32.0, 0.125]), rtol=1e-6, atol=1e-8
    )
    np.testing.assert_allclose(np.abs(found["shear_force"]), weight * np.array([0.5, 0.25, 0.0]), rtol=1e-6, atol=1e-6)
    assert abs(run["bar_largest_stress"].item()) == pytest.approx(weight / 8.0 * 0.01 / (0.02**4 / 12.0), rel=1e-5)
    assert run["bar_largest_stress_place"].item() == pytest.approx(0.5)
    assert run["bar_largest_deflection"].item() == pytest.approx(-middle, rel=1e-4)
    assert run["bar_largest_utilisation"].item() == pytest.approx(run["bar_largest_stress"].item() / 235e6)


def test_heated_bars_bend_without_forces():
    """Closed form: an arc of curvature alpha dT/h without stress; the deflection is its sagitta."""
    made = clamped(2, section="solid 20x20 mm", material="steel", temperature_difference=30.0).driven(speed=0.0)
    found = sd.internal_forces(still(made), made, places=[0.25, 0.5]).isel(time=0, bar=0)
    radius = 0.02 / (12e-6 * 30.0)
    sagitta = radius * (1.0 - math.cos(0.5 / radius))
    assert abs(found["deflection"].values[1]) == pytest.approx(sagitta, rel=1e-7)
    assert np.all(np.abs(found["bending_moment"].values) < 1e-8)


def test_moments_of_an_array_end_at_pins():
    """Identity: a pin at a bar's end carries no moment; the largest values of the run are found at 17 points."""
    arm = sd.scissor(units=1, bar_length=2.0, bar_mass=5.68)
    arm = sd.with_bending(arm, section="tube 60x60x1.56 mm", material="steel", elements=4).driven(speed=1.0)
    run = sd.simulate(arm, until=2e-3, samples=21)
    found = sd.internal_forces(run, arm, places=[0.0, 0.5, 1.0])
    assert found.sizes == {"time": 21, "bar": 2, "place": 3, "axis": 2}
    np.testing.assert_allclose(found["distance"], [[0.0, 1.0, 2.0]] * 2)
    pinned = found["bending_moment"].sel(bar="unit 1/bar 2").values[:, [0, 2]]
    # the axis between cross-sections and the shapes of its inertia differ by the square of the rotation within an element
    assert np.max(np.abs(pinned)) < 1e-7 * float(np.abs(found["bending_moment"]).max())
    fine = sd.internal_forces(run, arm, places=17)
    for name in ("bending_moment", "deflection"):
        largest = np.abs(run[f"bar_largest_{name}"].values)
        np.testing.assert_allclose(largest, np.abs(fine[name]).max(dim=("time", "place")), rtol=1e-9)


def test_refused_internal_forces():
    """Contract: rigid bars, a point beyond the bar and an unknown bar are refused."""
    rigid = sd.scissor(units=1).driven(speed=1.0)
    run = sd.simulate(rigid, until=1e-4, samples=3)
    assert "bar" not in run.dims
    with pytest.raises(sd.InputError, match="no bar of the mechanism bends"):
        sd.internal_forces(run, rigid)
    made = clamped(1).driven(speed=0.0)
    run = still(made)
    with pytest.raises(sd.InputError, match="from 0 to 1"):
        sd.internal_forces(run, made, places=[1.5])
    with pytest.raises(sd.InputError, match="bar"):
        sd.internal_forces(run, made, bars="rod")


# Bending stiffness [N m^2] and axial stiffness [N] of a steel tube
TUBE = {"bending_stiffness": 43620.7, "axial_stiffness": 76579776.0}


@pytest.mark.parametrize("modes", [2, 6, 8, 24])
@pytest.mark.parametrize(("load", "within"), [("end", 0.003), ("middle", 0.045), ("weight", 0.007)])
def test_extension_of_a_clamped_bar(load, within, modes):
    """Closed form: F L/(EA), F L/(2 EA) for a force at the middle, m g L/(2 EA) for the weight."""
    force, body = 1000.0, "bar/1" if load == "middle" else "bar/2"
    push = sd.Force("push", ("bar", load), (force, 0.0))
    made = by_modes(*([push] if load != "weight" else []), modes=modes, **TUBE)
    if load == "weight":
        made = dataclasses.replace(made, gravity=force, gravity_direction=0.0)
    run = still(made.driven(speed=0.0))
    away = float(np.hypot(*run["position"].sel(body=body)[0].values)) - (0.5 if load == "middle" else 1.0)
    assert away == pytest.approx((1.0 if load == "end" else 0.5) * force / TUBE["axial_stiffness"], rel=within)


# Quantity of `internal_forces` that each measure is the largest value of
NAMES = {
    "peak_bar_stress": "stress",
    "peak_utilisation": "utilisation",
    "peak_deflection": "deflection",
    "peak_buckling_ratio": "buckling_ratio",
}
OVER = {"A.clearance": [0.1e-3, 0.4e-3]}  # Values of the varied parameter [m], by path


def rigid():
    """Return a scissor with a clearance joint."""
    return sd.scissor(units=2).with_clearance("A", sd.Clearance(0.5e-3)).driven(speed=sd.rpm(60))


def bent(**more):
    """Return the scissor with bars of steel tubes."""
    return sd.with_bending(rigid(), **({"section": "tube 60x60x1.56 mm", "material": "steel", "modes": 1} | more))


def test_measures_of_bending_bars():
    """Cross-check: measures of a batch, run and summary agree; the stress also follows from axial force and moment."""
    batch = sd.simulate_many(bent(), OVER, until=0.01, measures=tuple(NAMES))
    run = sd.simulate(bent().replace("A.clearance", 0.4e-3), until=0.01)
    last = batch.isel(case=1)
    for name, quantity in NAMES.items():
        np.testing.assert_array_equal(last[name].values, np.abs(run[f"bar_largest_{quantity}"].values))
    assert len(np.unique(batch["peak_bar_stress"].values)) == batch["peak_bar_stress"].size == 8
    answer = run.scissordyn.summary().bars
    assert answer.utilisation == float(last["peak_utilisation"].max())
    assert answer.buckling == 1.0 / float(last["peak_buckling_ratio"].max())
    depth, area = 60e-3, (60e-3**2 - 56.88e-3**2)
    second_moment = (60e-3**4 - 56.88e-3**4) / 12.0
    inner = sd.internal_forces(run, places=[*np.linspace(0.0, 1.0, 9), 0.5 - 1e-12])  # the pivot from both sides
    stress = np.abs(inner["axial_force"]) / area + np.abs(inner["bending_moment"]) * 0.5 * depth / second_moment
    assert stress.max(dim=("time", "place")).values == pytest.approx(last["peak_bar_stress"].values, rel=1e-6)


@pytest.mark.parametrize(
    ("mechanism", "measure", "said"),
    [
        (rigid(), "peak_deflection", "has no bars that bend"),
        (bent(section=None, material=None, bending_stiffness=4e4, axial_stiffness=7e7), "peak_bar_stress", "youngs_modulus"),
    ],
)
def test_refused_measures_of_bars(mechanism, measure, said):
    """Contract: measures of bars need bending bars, those of stress a material."""
    with pytest.raises(sd.InputError, match=said):
        sd.simulate_many(mechanism, OVER, until=0.01, measures=(measure,))


@pytest.mark.parametrize("kind", [{"modes": 1}, {"elements": 2}])
def test_measures_on_threads_and_of_members(kind):
    """Identity: two threads give the same bits; members differ from the unperturbed start by the growth of round-off."""
    mechanism = bent(**({"modes": "auto"} | kind))
    one, two = (sd.simulate_many(mechanism, OVER, until=2e-3, measures=tuple(NAMES), threads=count) for count in (1, 2))
    xr.testing.assert_equal(one[list(NAMES)], two[list(NAMES)])
    members = sd.simulate_many(mechanism, OVER, until=2e-3, measures=tuple(NAMES), members=[0, 1], threads=1)
    for name in NAMES:
        np.testing.assert_array_equal(members[name][0].values, one[name][0].values)
        largest = float(one[name][1].max())
        np.testing.assert_allclose(members[name][1].values, one[name][1].values, rtol=1e-3, atol=1e-4 * largest)
        assert np.any(members[name][1].values != one[name][1].values)


@pytest.mark.parametrize("kind", [{"modes": 8}, {"elements": 8}])
@pytest.mark.parametrize("points", [("start", "end"), ("start", "middle", "end")])
@pytest.mark.parametrize("named", [("start", "end"), ("start", "middle", "end")])
def test_buckling_ratio_of_a_pinned_bar(kind, points, named):
    """Closed form: Euler's load pi^2 EI/l^2 between supports of a heated bar; points without a support do not divide it."""
    rigidity, axial, expansion, rise = 100.0, 1e7, 1e-5, 3.0
    load, critical = axial * expansion * rise, rigidity * (np.pi * (len(points) - 1)) ** 2
    whole = sd.bar("bar", length=1.0, mass=1.0)
    body = dataclasses.replace(
        whole, points={name: whole.points[name] for name in sorted({*points, *named}, key=whole.points.get)}
    )
    rigid = sd.Mechanism(
        (body,),
        (sd.Revolute("pin", ("bar", "start"), ("ground", "O")),),
        guides=tuple(sd.Guide(name, ("bar", name)) for name in points[1:]),
        ground=(("O", (0.0, 0.0)), ("E", (1.0, 0.0))),
        gravity=0.0,
    )
    bending = {"bending_stiffness": rigidity, "axial_stiffness": axial, **kind}
    held = dataclasses.replace(rigid, guides=rigid.guides[:-1])
    held = held.with_parts({"joints": (*rigid.joints, sd.Revolute("end", ("bar", "end"), ("ground", "E")))})
    hot = sd.with_bending(held, **bending, thermal_expansion=expansion, temperature_rise=rise)
    run = sd.simulate(hot, until=1e-5, samples=2, start="static")
    ratio = float(run["bar_largest_buckling_ratio"][0])
    assert ratio == pytest.approx(load / critical, rel=2e-3)
    assert sd.internal_forces(run, places=3)["buckling_ratio"].values[0] == pytest.approx(ratio, rel=1e-6)
    assert float(run["bar_buckling_load"][0]) == pytest.approx(critical, rel=2e-3)
    assert run.scissordyn.summary().bars.buckling == 1.0 / ratio
    pushed = sd.with_bending(rigid.with_parts({"components": (sd.Force("push", ("bar", "end"), (-load, 0.0)),)}), **bending)
    assert ratio * float(sd.buckling(pushed)["load_factor"][0]) == pytest.approx(1.0, rel=2e-3)


@pytest.mark.parametrize("kind", [{"modes": 8}, {"elements": 8}])
@pytest.mark.parametrize("part", [0.3, 0.9])
def test_buckling_ratio_of_a_cantilever(kind, part):
    """Closed form: a cantilever under a part of its buckling load pi^2 EI/(4 L^2)."""
    critical = np.pi**2 * 100.0 / 4.0
    push = sd.Force("push", ("bar", "end"), (-part * critical, 0.0))
    column = on_pin(sd.bar("bar", length=1.0, mass=1.0), push)
    bent = sd.with_bending(column, bending_stiffness=100.0, axial_stiffness=1e8, **kind).driven(speed=0.0)
    run = sd.simulate(bent, until=1e-6, samples=2, start="static")
    assert float(run["bar_largest_buckling_ratio"][0]) == pytest.approx(part, rel=1e-3)


def test_buckling_ratio_of_an_array():
    """Second formulation: linear buckling of two units of tubes under their weight."""
    tubes = sd.with_bending(sd.scissor(units=2), bending_stiffness=42743.0, axial_stiffness=7.5e7, modes=4).driven(speed=0.0)
    run = sd.simulate(tubes, until=1e-6, samples=2, start="static")
    factor = float(sd.buckling(tubes)["load_factor"][0])
    assert run.scissordyn.summary().bars.buckling == pytest.approx(factor, rel=0.01)


@pytest.mark.parametrize("kind", [{"modes": 4}, {"elements": 4}])
def test_buckling_ratio_with_a_servo(kind):
    """Cross-check: a stiff servo gives the ratio of a drive with the same motion."""
    tubes = sd.with_bending(sd.scissor(units=2), bending_stiffness=42743.0, axial_stiffness=7.5e7, **kind)
    motion = sd.Cycloidal(sd.degrees(45), sd.degrees(40), 0.05)
    held = tubes.controlled(sd.PID(4e6, derivative=4e3, limit=1e6), reference=motion)
    ratios = [
        float(sd.simulate(mechanism, until=0.02, samples=41)["bar_largest_buckling_ratio"].max())
        for mechanism in (tubes.driven(motion=motion), held)
    ]
    assert ratios[1] == pytest.approx(ratios[0], rel=0.05)


def test_warning_of_a_buckling_strut():
    """Closed form: a sudden force of 1.1 pi^2 EI/L^2 at most doubles in the bar, and the run warns of buckling."""
    critical = np.pi**2 * 100.0
    push = sd.Force("push", ("bar", "end"), (-1.1 * critical, 0.0))
    strut = on_pin(sd.bar("bar", length=1.0, mass=1.0), push, guides=(sd.Guide("end", ("bar", "end")),))
    run = sd.simulate(sd.with_bending(strut, bending_stiffness=100.0, axial_stiffness=1e6, modes=8), until=5e-3)
    assert 1.1 < float(run["bar_largest_buckling_ratio"][0]) < 2.5
    assert "the force at which the mechanism buckles" in run.attrs["warnings"]


def test_study_with_a_requirement_on_utilisation(tmp_path, capsys):
    """Cross-check: the utilisations of a study with a requirement are those of a batch."""
    case, store = tmp_path / "bent.toml", tmp_path / "bent.db"
    sd.write_case(bent(), case, run=sd.Options(until=0.01))
    used = sd.simulate_many(bent(), OVER, until=0.01, measures=("peak_utilisation",))["peak_utilisation"].max("bar").values
    between = float(np.mean(used))
    asks = f'"peak_utilisation < {between:.6f}", "peak_buckling_ratio < 1"'
    text = f'case = "bent.toml"\nmeasures = ["peak_bar_stress"]\nrequire = [{asks}]\n'
    asked = tmp_path / "study.toml"
    asked.write_text(text + '[vary]\n"A.clearance" = "0.1, 0.4 mm"\n', encoding="utf-8")
    assert status_of(["study", str(asked), "-o", str(store), "--threads", "1"]) == 0, capsys.readouterr().err
    found = sd.open_study(store).dataset
    np.testing.assert_array_equal(found["peak_utilisation"].max("bar").values, used)
    assert "peak_utilisation" in capsys.readouterr().out
