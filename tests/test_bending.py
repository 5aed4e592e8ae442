"""Bars that bend, by elements and by modes: closed forms, a second formulation, limits, and all that can be attached."""

import dataclasses
import math

import numpy as np
import pytest
import scipy.sparse as sp
from tests import build
from tests.build import assert_balance, case_of, on_pin, warnings_of

import scissordyn as sd
from scissordyn.model.section import read_section
from scissordyn.plan.bending import dissected
from scissordyn.plan.flexible import contact_frequency, mode_count
from scissordyn.plan.plan import plan
from scissordyn.plan.shapes import shapes_of

# Length [m], mass [kg], bending stiffness EI [N m^2] and axial stiffness EA [N] of a bar
LENGTH, MASS, RIGIDITY, AXIAL = 2.0, 5.68, 2252.0, 7.5e7
BAR = sd.bar("bar", length=LENGTH, mass=MASS)  # Rigid bar that the tests make flexible
BENT = {"bending_stiffness": RIGIDITY, "axial_stiffness": AXIAL}  # Bending stiffness [N m^2] and axial stiffness [N] of the bar
BETA = 1.87510406871196, 4.69409113297417, 7.85475743823761  # Wave numbers beta L of the first three modes of a cantilever
# Bending stiffness [N m^2] and axial stiffness [N] of a steel tube
TUBE = {"bending_stiffness": 42743.0, "axial_stiffness": AXIAL}


def cantilever(*, rigidity=RIGIDITY, gravity=0.0, **how):
    """Return a bar clamped by its drive."""
    return sd.with_bending(on_pin(BAR, gravity=gravity), **{**BENT, "bending_stiffness": rigidity}, **how).driven(speed=0.0)


def array(*, contact="compliant", **options):
    """Return the array of the paper with a frictionless clearance at A, its bars tubes."""
    return sd.with_bending(build.array(sd.Clearance(0.5e-3, contact=contact)), **{**TUBE, **options})


@pytest.mark.parametrize(("how", "within"), [({"elements": 16}, 1e-5), ({"modes": 2}, 1e-9)])
def test_a_bar_on_three_pins_has_twice_pi_first(how, within):
    """Closed form: beta L = 2 pi, antisymmetric, of a bar pinned at both ends and its middle; it is one of the shapes."""
    guides = (sd.Guide("middle", ("bar", "middle")), sd.Guide("end", ("bar", "end")))
    omega = float(
        sd.modes(sd.with_bending(on_pin(BAR, guides=guides), **BENT, **how), position="concentric")["angular_frequency"][0]
    )
    assert math.sqrt(omega * math.sqrt(MASS * LENGTH**3 / RIGIDITY)) == pytest.approx(2.0 * math.pi, rel=within)


@pytest.mark.parametrize(("how", "within"), [({"elements": 8}, 5e-5), ({"modes": 12}, 1e-5)])
def test_axial_force_changes_the_frequency_down_to_buckling(how, within):
    """Closed form: omega^2 = omega_0^2 (1 - P/P_cr) of a bar on two pins, P_cr = pi^2 EI/L^2; geometric stiffness."""
    critical, first = math.pi**2 * RIGIDITY / LENGTH**2, (math.pi / LENGTH) ** 2 * math.sqrt(RIGIDITY * LENGTH / MASS)
    for part in (-0.5, 0.3, 0.9):
        load = sd.Force("load", ("bar", "end"), (-part * critical, 0.0))
        made = on_pin(BAR, load, guides=(sd.Guide("end", ("bar", "end")),))
        omega = float(
            sd.modes(sd.with_bending(made, **{**BENT, "axial_stiffness": 1e9}, **how), count=1)["angular_frequency"][0]
        )
        assert (omega / first) ** 2 == pytest.approx(1.0 - part, abs=within)


@pytest.mark.parametrize("method", ["dop853", "rodas5p"])
@pytest.mark.parametrize(("how", "within"), [({"elements": 2}, 1e-7), ({"modes": 4}, 1e-8)])
def test_a_released_cantilever_keeps_its_energy(how, within, method):
    """Identity: the energy balance with strain energy."""
    run = sd.simulate(cantilever(gravity=9.81, **how), until=0.05, samples=101, method=method)
    assert_balance(run, within, ("potential_energy",))
    assert float(run["stored_energy"].max()) > 0.1 * float(np.ptp(run["potential_energy"].values))


def test_frequencies_of_a_cantilever_converge_with_the_fourth_order():
    """Closed form and order of convergence: beta L of a clamped bar."""
    errors = []
    for elements in (4, 8, 16):
        omega = sd.modes(cantilever(elements=elements), position="concentric")["angular_frequency"].values[:3]
        errors.append(np.sqrt(omega * math.sqrt(MASS / LENGTH * LENGTH**4 / RIGIDITY)) / BETA - 1.0)
    assert abs(errors[2][0]) < 1e-7
    order = np.log2(np.array(errors[1]) / np.array(errors[2]))
    assert np.all(np.abs(order - 4.0) < 0.2)


def test_shapes_are_those_of_a_straight_bar():
    """Closed forms and identities: beta l of modes between pins and at a clamp; what is straight stays straight; the mass."""
    pinned, clamped = shapes_of((0.0, 1.0, 2.0), (), 4), shapes_of((0.0, 2.0), (0,), 2)
    assert pinned.wave_numbers[:4] == pytest.approx([math.pi, 3.92660231204792, 2.0 * math.pi, 7.06858274562873], rel=1e-9)
    assert 2.0 * clamped.wave_numbers[:2] == pytest.approx([3.92660231204792, 7.06858274562873], rel=1e-9)
    places = np.linspace(0.0, 2.0, 9)
    held = np.array([[0.0, 1.0], [1.0, 1.5], [2.0, 2.0]])  # a line
    vectors = np.vstack([held, pinned.mean @ held])
    assert pinned.at(places) @ vectors == pytest.approx(np.stack([places, 1.0 + 0.5 * places], axis=1), abs=1e-12)
    assert np.abs(pinned.bending @ vectors).max() < 1e-7  # of some 1e3: free of strain
    assert vectors[:, 0] @ pinned.mass @ vectors[:, 0] == pytest.approx(8.0 / 3.0, rel=1e-12)


def test_frequencies_of_a_cantilever():
    """Closed form: beta L of a clamped bar, from above, better with each mode."""
    worst = []
    for modes in (4, 8, 12):
        omega = sd.modes(cantilever(modes=modes), position="concentric")["angular_frequency"].values[:3]
        errors = np.sqrt(omega * math.sqrt(MASS * LENGTH**3 / RIGIDITY)) / BETA - 1.0
        assert np.all(errors > -1e-9)
        worst.append(errors)
    assert np.all(worst[0] > worst[1])
    assert np.all(worst[2] < [1e-7, 2e-6, 6e-6])


STIFF = 1e6  # [N m^2] bending stiffness with which deflections are small


@pytest.mark.parametrize(
    ("how", "tip", "bounds"), [({"elements": 8}, "bar/8", (1e-4, 1e-6, 1e-5)), ({"modes": 6}, "bar/2", (1e-6, 1e-7, 1e-7))]
)
def test_static_start_has_the_deflection_under_weight(how, tip, bounds):
    """Closed form: w = q L^4/(8 EI) of a stiff cantilever, reaction = weight, moment = q L^2/2."""
    made, weight = cantilever(gravity=9.81, rigidity=STIFF, **how), MASS * 9.81
    now = sd.simulate(made, until=1e-4, samples=2, start="static", method="dop853").isel(time=0)
    sag, reaction = -now["position"].sel(body=tip, axis="y"), now["reaction"].sel(joint="O", axis="y")
    exact = weight * LENGTH**3 / (8.0 * STIFF), weight, 0.5 * weight * LENGTH
    for value, expected, within in zip((sag, reaction, now["drive_torque"]), exact, bounds, strict=True):
        assert value.item() == pytest.approx(expected, rel=within)


def test_what_a_cantilever_carries():
    """Closed form: moment q (L - x)^2/2, shear q (L - x) and deflection under the weight; what parts carry and store."""
    weight = MASS * 9.81
    made = cantilever(gravity=9.81, rigidity=STIFF, modes=6)
    run = sd.simulate(made, until=1e-4, samples=2, start="static", method="dop853")
    now = run.isel(time=0)
    assert -float(now["beam_start_moment"][0]) == pytest.approx(0.5 * weight * LENGTH, rel=5e-3)
    middle = -float(now["beam_shear_force"][3:5].mean())  # about x = L/2
    assert middle == pytest.approx(0.5 * weight, rel=2e-2)
    along = sd.internal_forces(run, places=[0.0, 0.3, 1.0]).isel(time=0, bar=0)
    assert -along["shear_force"].values[:2] == pytest.approx([weight, 0.7 * weight], rel=3e-2)
    assert -along["bending_moment"].values[:2] == pytest.approx([0.5 * weight * LENGTH, 0.245 * weight * LENGTH], rel=5e-3)
    sag = weight / (24.0 * STIFF * LENGTH) * 0.6**2 * (0.6**2 - 4.0 * LENGTH * 0.6 + 6.0 * LENGTH**2)  # at x = 0.6 m
    tip = weight * LENGTH**3 / (8.0 * STIFF)
    assert -float(along["deflection"][1]) == pytest.approx(sag - 0.3 * tip, rel=1e-3)
    assert float(now["bar_largest_bending_moment_place"][0]) == 0.0
    assert float(now["beam_energy"].sum()) == pytest.approx(float(now["stored_energy"]), rel=1e-3)


@pytest.mark.parametrize("modes", [8, 16, 24])
@pytest.mark.parametrize("clamped", [(), (0,)])
def test_axial_frequencies_of_a_bar(clamped, modes):
    """Closed form: k pi sqrt(EA/mu)/L of a free rod, (k - 1/2) pi of a clamped one; bending and a clamp must not stiffen it."""
    shapes, mass = shapes_of((0.0, 1.0, 2.0), clamped, modes, clamped, 5.7e-4), 2.84
    bending, axial = TUBE["bending_stiffness"], TUBE["axial_stiffness"]
    slopes = shapes.at(shapes.quadrature[0], 1)
    stiffness = bending * shapes.bending + axial * slopes.T @ shapes.stretching(bending / axial) @ slopes
    free = [k for k in range(shapes.count) if not clamped or k not in (0, 3)]
    squares = np.linalg.eigvals(np.linalg.solve(mass * shapes.mass[np.ix_(free, free)], stiffness[np.ix_(free, free)])).real
    assert squares.min() > -1e-9 * squares.max()
    frequencies = np.sort(np.sqrt(np.abs(squares)))[0 if clamped else 1 : modes // 2]
    expected = (np.arange(1, modes // 2 + bool(clamped)) - 0.5 * bool(clamped)) * math.pi * math.sqrt(axial / mass) / LENGTH
    assert frequencies == pytest.approx(expected, rel=4e-3)


def test_first_contact_tends_to_that_of_rigid_bars_as_one_over_the_stiffness(clearance_array):
    """Limit, with its order: the array of the paper, started unbent at the velocities of rigid bars.

    At EI = 4e8 N m^2, EA = 7.5e11 N the contact comes at 1.344 ms, as in a second program with other elements.
    """
    starts = []
    for rigidity, axial in ((4e8, 7.5e11), (4e9, 7.5e12), (4e10, 7.5e13)):
        bent = array(bending_stiffness=rigidity, axial_stiffness=axial, elements=2)
        run = sd.simulate(bent, until=1.6e-3, samples=5, method="dop853")
        starts.append(float(run["contact_start"][0]))
    rigid = sd.simulate(clearance_array, until=1.5e-3)
    assert starts[0] == pytest.approx(1.344e-3, abs=5e-7)
    errors = np.abs(np.array(starts) - float(rigid["contact_start"][0]))
    assert abs(math.log10(errors[1] / errors[2]) - 1.0) < 0.05


def test_the_first_contact_is_that_of_absolute_nodal_coordinates():
    """Cross-check by a second formulation: 2.0670 ms, 0.5787 m/s, 8.85 kN with 16 elements (`validation/bent_array`)."""
    run = sd.simulate(array(modes=8), until=3.4e-3, samples=5)
    assert float(run["contact_start"][0]) == pytest.approx(2.0670e-3, rel=3e-5)
    assert float(run["approach_speed"][0]) == pytest.approx(0.5787, rel=1e-3)
    assert float(run["peak_force"][0]) == pytest.approx(8.85e3, rel=5e-3)
    assert float(np.abs(run["energy_residual"]).max()) < 1e-6 * float(np.ptp(run["drive_work"].values))


def test_elements_and_modes_have_the_same_reactions():
    """Second formulation: reactions, moment at a pin and torque of the drive of an array at rest."""
    rigid = sd.scissor(units=2, angle=0.6)
    one, other = (
        sd.simulate(sd.with_bending(rigid, **TUBE, **how).driven(speed=0.0), until=1e-4, samples=2, start="static").isel(time=0)
        for how in ({"modes": 6}, {"elements": 8})
    )
    assert one["reaction"].values == pytest.approx(other["reaction"].values, rel=2e-5, abs=1e-2)
    assert one["drive_torque"].values == pytest.approx(other["drive_torque"].values, rel=1e-5)
    assert float(one["stored_energy"]) == pytest.approx(float(other["stored_energy"]), rel=1e-3)


@pytest.mark.parametrize(
    ("section", "area", "second", "depth"),
    [
        ("tube 60x60x1.56 mm", 0.06**2 - 0.05688**2, (0.06**4 - 0.05688**4) / 12.0, 0.06),
        ("tube 50x2 mm", math.pi / 4 * (0.05**2 - 0.046**2), math.pi / 64 * (0.05**4 - 0.046**4), 0.05),
        ("solid 2x3 cm", 6e-4, 0.02 * 0.03**3 / 12.0, 0.03),
        ("strip 30x2 mm", 6e-5, 0.03 * 0.002**3 / 12.0, 0.002),
    ],
)
def test_sections(section, area, second, depth):
    """Closed form: area and second moment of area."""
    found = read_section(section)
    assert (found.area, found.second_moment, found.depth) == pytest.approx((area, second, depth), rel=1e-12)


# Case file with flexible bars
CASE = """
[structure]
kind = "scissor"
bar_length = "2 m"
bar_mass = "5.68 kg"
[drive]
speed = "150 rpm"
[[bending]]
bars = "unit 1/*"
section = "tube 60x60x1.56 mm"
material = "steel"
elements = 2
damping = "2e-5 s"
temperature_rise = "40 K"
temperature_difference = "-15 K"
time_function = { cycloidal = { start = 0, end = 1, duration = "2 s" } }
[run]
until = "1 ms"
"""


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("60x60x1.56", "60x60x40", "wall"),
        ("tube", "tub", "tube"),
        ('"steel"', '"stel"', "steel"),
        ('material = "steel"\n', "", "material"),
        ("5.68", "9", "bar_mass"),
        ("tube 60x60x1.56 mm", "tube 90x90x1.56 cm", "beam theory"),
        ('section = "tube 60x60x1.56 mm"\nmaterial = "steel"', 'bending_stiffness = "2 kN m^2"', "axial_stiffness (EA)"),
        ('section = "tube 60x60x1.56 mm"\nmaterial = "steel"', 'axial_stiffness = "2 MN"', "bending_stiffness (EI)"),
        ("elements = 2", "elements = 0", "elements"),
        ("2e-5 s", "-1 s", "damping"),
        ("40 K", "5000 K", "temperature_rise"),
        ("40 K", "40 degC", "a temperature in degC instead of a temperature difference"),
    ],
)
def test_bad_input_is_one_line(tmp_path, answer, old, new, said):
    """Contract: what cannot be right ends with status 2 and one line that names it."""
    (tmp_path / "case.toml").write_text(CASE.replace(old, new, 1), encoding="utf-8")
    assert said in answer("run", tmp_path / "case.toml", "-o", tmp_path / "run.nc", status=2)


def test_case_file_and_python_agree(tmp_path):
    """Identity: the table [[bending]] and `with_bending` describe the same mechanism; the written case reads back."""
    read = case_of(tmp_path, CASE)
    heat = {"temperature_rise": 40.0, "temperature_difference": -15.0, "time_function": sd.Cycloidal(0.0, 1.0, 2.0)}
    tube = {"section": "tube 60x60x1.56 mm", "material": "steel", "elements": 2, "damping": 2e-5}
    rigid = sd.scissor(bar_length=2.0, bar_mass=5.68)
    assert read.mechanism == sd.with_bending(rigid, "unit 1/*", **tube, **heat).driven(speed=sd.rpm(150))
    assert case_of(tmp_path, sd.case_text(read.mechanism, read.run)).mechanism == read.mechanism


def test_dissection_leaves_few_coordinates_in_each_other():
    """Identity and bound: all coordinates, and a row of the inverse factor has as many entries as the chain halvings."""
    count = 127
    chain = sp.csr_array(sp.diags_array([1.0, 4.0, 1.0], offsets=[-1, 0, 1], shape=(count, count)))
    order = dissected(chain)
    assert sorted(order.tolist()) == list(range(count))
    lower = np.linalg.cholesky(chain[order][:, order].toarray())
    entries = np.count_nonzero(np.abs(np.linalg.inv(lower)) > 1e-15, axis=0)
    assert entries.max() <= math.log2(count + 1) + 6  # below six coordinates a part is not divided


@pytest.mark.parametrize("elements", [None, 3])
@pytest.mark.parametrize("unplaced", ["coupler", "coupler rocker", "crank coupler rocker"])
def test_bars_without_a_place_bend_where_rigid_ones_are_assembled(unplaced, elements):
    """Identity: at the start straight bars that bend close a linkage as rigid ones do, on the same branch, to 1e-9."""
    linkage = sd.four_bar()
    bodies = (
        dataclasses.replace(body, points={k: v for k, v in body.points.items() if k != "point"}) for body in linkage.bodies
    )
    placed = (dataclasses.replace(body, position=None, angle=None) if body.name in unplaced else body for body in bodies)
    rigid = dataclasses.replace(linkage, bodies=tuple(placed)).driven(speed=sd.rpm(60))
    bent = sd.with_bending(rigid, "coupler", bending_stiffness=100.0, axial_stiffness=1e6, elements=elements)
    angles = [
        sd.simulate(case, until=1e-3, samples=2)["angle"].sel(body=["crank", "coupler", "rocker"])[0] for case in (rigid, bent)
    ]
    np.testing.assert_allclose(np.exp(1j * angles[1]), np.exp(1j * angles[0]), atol=1e-9)


def test_modes_go_up_to_the_frequency_of_contacts():
    """Contract: one over the duration of an impact of the bar at 1 m/s; two modes of a span without contacts."""
    made = array()
    part = next(each for each in made.components if isinstance(each, sd.FlexibleBar))
    frequency = contact_frequency(made, 5.68)
    assert frequency == pytest.approx(1.0 / 2.9e-4, rel=0.1)  # solve_ivp of the impact with damping: 0.28 ms
    kept = plan(made).coordinates.natural.axes[1]
    speed = math.sqrt(TUBE["bending_stiffness"] / (5.68 / 2.0)) / (2.0 * math.pi)
    assert mode_count(made, part) == kept.shapes.modes
    assert kept.shapes.wave_numbers[kept.shapes.modes] ** 2 * speed > frequency
    assert mode_count(made.ideal(), part) == 4
    hard = array(contact="hard")
    assert mode_count(hard, part) == kept.shapes.modes
    assert "stiffness law" in sd.simulate(hard, until=1e-4, samples=2)["flexible_bar_modes"].attrs["long_name"]
    assert plan(made).ideal.coordinates.natural.total == plan(made).coordinates.natural.total  # with the same modes
    run = sd.simulate(made, until=1e-4, samples=2)
    assert run["flexible_bar_modes"].values.tolist() == [kept.shapes.modes] * 4


def test_a_payload_on_a_bar_that_bends(tmp_path):
    """Contract: with inertia of its own on a bar that a controller turns; the energy balance closes, the case reads back."""
    made = sd.with_bending(sd.scissor(units=1, angle=0.6), section="tube 60x60x1.56 mm", material="steel", modes=2)
    made = sd.with_payload(made, "unit 1/bar 1.end", 2.0, inertia=0.05).controlled(sd.PID(200.0, limit=500.0), speed=0.5)
    run = sd.simulate(made, until=5e-3, samples=11)
    assert run.attrs["status"] == "complete"
    moved = float(np.ptp(run["kinetic_energy"].values)) + float(np.ptp(run["potential_energy"].values))
    assert float(np.abs(run["energy_residual"]).max()) < 1e-4 * moved
    path = sd.write_case(made, tmp_path / "case.toml")
    assert sd.read_case(path).mechanism == made


# Body that is not a bar
PLATE = sd.Body("plate", 1.0, 0.5, {"start": (0.0, 0.0), "b": (1.0, 0.0), "c": (1.0, 1.0)}, centre=(0.6, 0.3))


@pytest.mark.parametrize(
    ("made", "options", "said"),
    [
        (sd.mast(units=1, platform_mass=3.0), {"bodies": "platform"}, "platform"),
        (on_pin(PLATE), {"bodies": "plate"}, "not a uniform bar"),
        (on_pin(BAR), {"modes": 3, "elements": 2}, "modes and elements"),
        (on_pin(BAR), {"mass": "section"}, "without a section and a material"),
        (on_pin(BAR), {"temperature_rise": 10.0}, "without a thermal_expansion"),
        (on_pin(BAR), {"temperature_difference": 10.0, "thermal_expansion": 1e-5}, "a section, which has a depth"),
    ],
)
def test_what_cannot_bend(made, options, said):
    """Bad input: one line for a body that is no bar, and for options that do not fit each other."""
    with pytest.raises(sd.InputError, match=said):
        sd.with_bending(made, bending_stiffness=1e4, axial_stiffness=1e7, **options)


def test_an_aligned_guide_clamps_a_bar():
    """Closed form: a bar clamped at both ends sags by q L^4/(384 EI) in its middle; guides along x, aligned."""
    joint = sd.Guide("end", ("bar", "end"), aligned=True)
    made = sd.with_bending(on_pin(BAR, gravity=9.81, guides=(joint,)), bending_stiffness=1e6, axial_stiffness=AXIAL, modes=6)
    run = sd.simulate(made.driven(speed=0.0), until=1e-4, samples=2, start="static", method="dop853")
    sag = -float(run["position"].sel(body="bar/1", axis="y")[0])
    assert sag == pytest.approx(MASS * 9.81 * LENGTH**3 / (384.0 * 1e6), rel=1e-5)


def _struck(modes):
    """Return one unit of tubes whose driven end joint has clearance."""
    return sd.with_bending(build.array(sd.Clearance(5e-4), units=1), **TUBE, modes=modes)


def test_a_contact_shorter_than_the_modes_is_said():
    """Limit: with two modes, up to 301 Hz, a contact of 1 ms excites more of them; those that are chosen alone are enough."""
    few = sd.simulate(_struck(2), until=4.5e-3, samples=2)
    said = [text for text in warnings_of(few) if "excites bending" in text]
    shortest = float(np.nanmin(few["contact_duration"].values))
    assert len(said) == 1
    assert f"{1e3 * shortest:.3g} ms" in said[0]
    speed = math.sqrt(TUBE["bending_stiffness"] / (5.68 / 2.0)) / (2.0 * math.pi)
    numbers = plan(_struck(24)).coordinates.natural.axes[1].shapes.wave_numbers
    assert f"modes = {int(np.sum(numbers**2 * speed <= 1.0 / shortest))} keeps" in said[0]
    enough = sd.simulate(_struck("auto"), until=4.5e-3, samples=2)
    assert "excites bending" not in enough.attrs["warnings"]


def test_modes_until_a_number_stays():
    """Contract: numbers of modes from coarse to fine until a measure agrees with the next two."""
    options = sd.Options(2.5e-3)
    found = sd.convergence(_struck("auto"), options, "peak_force", within=0.05, over="modes")
    counts, forces = [level.setting for level in found.levels], [level.value for level in found.levels]
    assert found.varied == "modes"
    assert counts == [2, 4, 6, 8, 12, 16, 20, 24, 32][: len(counts)]
    assert found.setting == counts[-3]
    assert all(abs(force / forces[-1] - 1.0) < 0.05 for force in forces[-3:])
    alone = sd.simulate(_struck(int(counts[-1])), until=2.5e-3)
    # the mean of runs whose starts differ by round-off: as near as they are to each other
    assert forces[-1] == pytest.approx(float(alone["peak_force"].max()), rel=2.0 * found.levels[-1].spread + 1e-12)
    assert found.levels[-1].spread < 1e-7
    with pytest.raises(sd.InputError, match="no bar that bends"):
        sd.convergence(_struck("auto").ideal().with_parts({"components": ()}), options, "drive_work", over="modes")


@pytest.mark.parametrize("how", [{"modes": 3}, {"elements": 2}])
def test_a_load_that_acts_suddenly_is_said(how):
    """Limit: unbent bars with a weight or a constant force are warned of; equilibrium, no load and a slow force are not."""
    bare, heavy = cantilever(**how), cantilever(gravity=9.81, **how)
    tip = heavy.bodies[-1].name
    pushed, slow = (
        dataclasses.replace(
            bare,
            components=(
                *bare.components,
                sd.Force("push", (tip, next(iter(dict(bare.body(tip).points)))), (0.0, 1.0), time_function=function),
            ),
        )
        for function in (None, sd.Cycloidal(0.0, 1.0, 1.0))
    )
    for mechanism, load in ((heavy, "their weight"), (pushed, "force 'push'"), (bare, ""), (slow, "")):
        for start in ("concentric", "in-contact", "static"):
            run = sd.simulate(mechanism, until=1e-4, samples=2, start=start)
            said = f"start = '{start}' begins with bars that are not bent by {load}:" in run.attrs["warnings"]
            assert said == bool(load and start != "static"), (load, start)
            begins = "in equilibrium" if start == "static" else "not in equilibrium"
            assert str(run.scissordyn.summary().bars).startswith(f"Bars, {begins} at the start ({start}): ")


def test_a_weight_that_acts_suddenly_bends_twice_as_far():
    """Closed form: the first mode of a cantilever swings to twice its static deflection q L^4/8EI, where static stays at it."""
    heavy = cantilever(gravity=9.81, modes=2)
    tip, period = heavy.bodies[-1].name, 2.0 * math.pi * (LENGTH / BETA[0]) ** 2 * math.sqrt(MASS / LENGTH / RIGIDITY)
    sudden, still = (
        np.abs(sd.simulate(heavy, until=period, samples=401, start=start)["position"].sel(body=tip, axis="y").values).max()
        for start in ("concentric", "static")
    )
    assert still == pytest.approx(MASS * 9.81 * LENGTH**3 / (8.0 * RIGIDITY), rel=1e-3)
    assert sudden == pytest.approx(2.0 * still, rel=0.05)


@pytest.mark.parametrize("how", [{"modes": 3}, {"elements": 3}])
@pytest.mark.parametrize("held", ["weld", "two pins", "pin"])
def test_only_a_bar_that_is_held_can_start_in_equilibrium(held, how):
    """Limit: a clamped bar and one on two pins are warned of, a pendulum, which swings anyway, is not."""
    bar = sd.bar("bar", length=LENGTH, mass=MASS)
    ground = (("O", (0.0, 0.0)), ("E", (LENGTH, 0.0)))
    pins = [sd.Revolute(name, ("bar", end), ("ground", name)) for name, end in (("O", "start"), ("E", "end"))]
    welds = (sd.Weld("clamp", ("bar", "start"), ("ground", "O")),) if held == "weld" else ()
    joints = () if held == "weld" else tuple(pins[: 1 + (held == "two pins")])
    made = sd.Mechanism((bar,), joints, welds=welds, ground=ground, gravity=9.81)
    run = sd.simulate(sd.with_bending(made, **BENT, **how), until=1e-4, samples=2)
    assert ("not bent by their weight" in run.attrs["warnings"]) == (held != "pin")
