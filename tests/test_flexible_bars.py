"""Bars that bend as one part: closed forms, a second formulation (beam elements), derivatives, and all that can be attached."""

import json
import math
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pytest

import scissordyn as sd
from reference.kernels import element_slopes
from scissordyn.config.file import read_case
from scissordyn.errors import InputError
from scissordyn.mechanics import functions
from scissordyn.plan.flexible import contact_frequency, mode_count
from scissordyn.plan.plan import plan
from scissordyn.plan.shapes import shapes_of
from scissordyn.run.advance.system import make_system
from scissordyn.run.start.start import prepare_start

LENGTH, MASS, RIGIDITY, AXIAL = 2.0, 5.68, 2252.0, 7.5e7
BETA = 1.87510406871196, 4.69409113297417, 7.85475743823761
TUBE: dict[str, Any] = {"bending_stiffness": 42743.0, "axial_stiffness": 7.5e7}


def bar(*, gravity: float = 0.0, **parts: Any) -> sd.Mechanism:
    """A bar pinned at its start."""
    pin = sd.Revolute("O", ("bar", "start"), ("ground", "O"))
    body = sd.bar("bar", length=LENGTH, mass=MASS)
    return sd.Mechanism((body,), (pin,), ground=(("O", (0.0, 0.0)),), gravity=gravity, input_body="bar", **parts)


def cantilever(modes: int, *, rigidity: float = RIGIDITY, **more: Any) -> sd.Mechanism:
    """A bar clamped by its drive."""
    return bar(**more).with_bending(bending_stiffness=rigidity, axial_stiffness=AXIAL, modes=modes).driven(speed=0.0)


def array(*, contact: Literal["compliant", "hard"] = "compliant", **options: Any) -> sd.Mechanism:
    """The array of the paper with a frictionless clearance at A, its bars tubes."""
    loose = sd.scissor(units=2).with_clearance("A", sd.Clearance(0.5e-3, contact=contact))
    return loose.with_bending(**TUBE, **options).driven(speed=sd.rpm(150))


def test_shapes_are_those_of_a_straight_bar() -> None:
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


def test_frequencies_of_a_cantilever() -> None:
    """Closed form: beta L of a clamped bar, from above, better with each mode."""
    worst = []
    for modes in (4, 8, 12):
        omega = sd.modes(cantilever(modes), position="concentric")["angular_frequency"].values[:3]
        errors = np.sqrt(omega * math.sqrt(MASS * LENGTH**3 / RIGIDITY)) / BETA - 1.0
        assert np.all(errors > -1e-9)
        worst.append(errors)
    assert np.all(worst[0] > worst[1])
    assert np.all(worst[2] < [1e-7, 2e-6, 6e-6])


def test_a_bar_on_three_pins_has_twice_pi_first() -> None:
    """Closed form: beta L = 2 pi; the mode is one of the shapes."""
    guides = (sd.Guide("middle", ("bar", "middle")), sd.Guide("end", ("bar", "end")))
    made = bar(guides=guides).with_bending(bending_stiffness=RIGIDITY, axial_stiffness=AXIAL, modes=2)
    omega = float(sd.modes(made, position="concentric")["angular_frequency"][0])
    assert math.sqrt(omega * math.sqrt(MASS * LENGTH**3 / RIGIDITY)) == pytest.approx(2.0 * math.pi, rel=1e-9)


def test_axial_force_changes_the_frequency_down_to_buckling() -> None:
    """Closed form: omega^2 = omega_0^2 (1 - P/P_cr) of a bar on two pins; geometric stiffness."""
    critical, first = math.pi**2 * RIGIDITY / LENGTH**2, (math.pi / LENGTH) ** 2 * math.sqrt(RIGIDITY * LENGTH / MASS)
    for part in (-0.5, 0.3, 0.9):
        load = sd.Force("load", ("bar", "end"), (-part * critical, 0.0))
        made = bar(guides=(sd.Guide("end", ("bar", "end")),), components=(load,))
        made = made.with_bending(bending_stiffness=RIGIDITY, axial_stiffness=1e9, modes=12)
        omega = float(sd.modes(made, count=1)["angular_frequency"][0])
        assert (omega / first) ** 2 == pytest.approx(1.0 - part, abs=1e-5)


@pytest.mark.parametrize("method", ["dop853", "rodas5p"])
def test_a_released_cantilever_keeps_its_energy(method: str) -> None:
    """Identity: the energy balance with strain energy."""
    run = sd.simulate(cantilever(4, gravity=9.81), until=0.05, samples=101, method=method)
    turned_over = float(np.ptp(run["potential_energy"].values))
    assert float(np.max(np.abs(run["energy_residual"].values))) < 1e-8 * turned_over
    assert float(run["stored_energy"].max()) > 0.1 * turned_over


def test_static_start_has_the_deflection_under_weight() -> None:
    """Closed form: w = q L^4/(8 EI), reaction = weight, moment = q L^2/2, shear q L; what parts carry and store."""
    stiff, weight = 1e6, MASS * 9.81
    run = sd.simulate(cantilever(6, gravity=9.81, rigidity=stiff), until=1e-4, samples=2, start="static", method="dop853")
    now = run.isel(time=0)
    assert -float(now["position"].sel(body="bar/2", axis="y")) == pytest.approx(weight * LENGTH**3 / (8.0 * stiff), rel=1e-6)
    assert float(now["reaction"].sel(joint="O", axis="y")) == pytest.approx(weight, rel=1e-7)
    assert float(now["drive_torque"].values.ravel()[0]) == pytest.approx(0.5 * weight * LENGTH, rel=1e-7)
    assert -float(now["beam_start_moment"][0]) == pytest.approx(0.5 * weight * LENGTH, rel=5e-3)
    middle = -float(now["beam_shear_force"][3:5].mean())  # about x = L/2
    assert middle == pytest.approx(0.5 * weight, rel=2e-2)
    along = sd.internal_forces(run, places=[0.0, 0.3, 1.0]).isel(time=0, bar=0)
    assert -along["shear_force"].values[:2] == pytest.approx([weight, 0.7 * weight], rel=3e-2)
    assert -along["bending_moment"].values[:2] == pytest.approx([0.5 * weight * LENGTH, 0.245 * weight * LENGTH], rel=5e-3)
    sag = weight / (24.0 * stiff * LENGTH) * 0.6**2 * (0.6**2 - 4.0 * LENGTH * 0.6 + 6.0 * LENGTH**2)  # at x = 0.6 m
    tip = weight * LENGTH**3 / (8.0 * stiff)
    assert -float(along["deflection"][1]) == pytest.approx(sag - 0.3 * tip, rel=1e-3)
    assert float(now["bar_largest_bending_moment_place"][0]) == 0.0
    assert float(now["beam_energy"].sum()) == pytest.approx(float(now["stored_energy"]), rel=1e-3)


def damped() -> sd.Mechanism:
    """A free unit with everything that a bar's kernel has: damping, and heat over time."""
    made = sd.scissor(units=1, angle=0.6)
    heat = {"temperature_rise": 80.0, "temperature_difference": 30.0, "time_function": sd.Cycloidal(0.0, 1.0, 0.02)}
    return made.with_bending(section="tube 60x60x1.56 mm", material="steel", modes=3, damping=1e-4, **heat)


def test_the_analytic_derivatives_are_those_of_the_forces() -> None:
    """Identity, by differences: derivatives by position, rate and time at a bent position, with damping and heat."""
    made = plan(damped())
    system, n, t = make_system(made), made.coordinates.free, 0.007
    y = prepare_start(made, system, "concentric").y
    random = np.random.default_rng(1)
    y[:n] += 1e-2 * random.standard_normal(n)
    y[n : 2 * n] += random.standard_normal(n)
    by_time = np.zeros_like(y)
    functions.linearise(t, y, system.address, np.zeros_like(y), by_time)
    analytic = element_slopes(system, n)

    def rate(y: np.ndarray, t: float = t) -> np.ndarray:
        found = np.zeros_like(y)
        functions.rate(t, y.copy(), system.address, found)
        return found[n : 2 * n]

    steps = 1e-6 * np.eye(y.size)[: 2 * n]
    numeric = np.stack([(rate(y + h) - rate(y - h)) / 2e-6 for h in steps], axis=1).reshape(n, 2, n).transpose(1, 0, 2)
    for ours, theirs in zip(analytic, numeric, strict=True):
        assert np.abs(ours - theirs).max() < 1e-7 * np.abs(ours).max()
    changed = (rate(y, t + 1e-6) - rate(y, t - 1e-6)) / 2e-6
    assert np.abs(by_time[n : 2 * n] - changed).max() < 1e-6 * np.abs(changed).max()


@pytest.mark.parametrize("method", ["dop853", "rodas5p"])
def test_heating_and_damping_are_in_the_balance(method: str) -> None:
    """Identity: heat against a stress is work of a load, damping a loss."""
    run = sd.simulate(damped().driven(speed=3.0), until=0.03, samples=31, method=method)
    work = float(np.abs(run["load_work"]).max())
    assert work > 1e-3
    assert float(np.abs(run["energy_residual"]).max()) < 1e-6 * work
    assert float(run["dissipated_energy"][-1]) > 0.0


def test_a_heated_bar_extends_and_curves_without_stress() -> None:
    """Closed forms: alpha Delta T L, and an arc of the curvature alpha Delta T_h/h."""
    made = bar().with_bending(
        bending_stiffness=RIGIDITY, axial_stiffness=AXIAL, modes=6, thermal_expansion=12e-6, temperature_rise=80.0
    )
    guided = made.with_parts({"guides": (sd.Guide("end", ("bar/2", "end")),)})
    run = sd.simulate(guided, until=1e-4, samples=2, start="static")
    assert float(run["position"].sel(body="bar/2", axis="x")[0]) == pytest.approx(LENGTH * (1.0 + 12e-6 * 80.0), rel=1e-9)
    assert float(np.abs(run["beam_axial_force"][0]).max()) < 1e-3  # of 72 kN
    run = sd.simulate(made.driven(speed=0.0), until=1e-4, samples=2, start="static")
    longer = float(run["position"].sel(body="bar/2", axis="x")[0]) - LENGTH
    assert longer == pytest.approx(LENGTH * 12e-6 * 80.0, rel=5e-3)  # a clamp has no strain at its one cross-section
    mass = 7850.0 * 4e-4 * LENGTH
    warm = sd.Mechanism((sd.bar("bar", length=LENGTH, mass=mass),), bar().joints, ground=bar().ground, gravity=0.0)
    warm = warm.with_bending(section="solid 20x20 mm", material="steel", modes=6, temperature_difference=30.0)
    run = sd.simulate(warm.driven(speed=0.0, body="bar"), until=1e-4, samples=2, start="static")
    turn = 12e-6 * 30.0 / 0.02 * LENGTH
    assert float(run["angle"].sel(body="bar/2")[0]) == pytest.approx(turn, rel=1e-5)
    assert float(run["position"].sel(body="bar/2", axis="y")[0]) == pytest.approx(
        LENGTH * (1 - math.cos(turn)) / turn, rel=1e-5
    )


@pytest.mark.parametrize("rise", [0.0, 80.0, 800.0])
def test_a_bar_that_is_longer_curves_as_much(rise: float) -> None:
    """Closed form: between a pin and a guide an arc of the curvature alpha Delta T_h/h, without stress, however long."""
    loose = bar().with_parts({"drives": (), "guides": (sd.Guide("end", ("bar", "end")),)})
    heat = {"temperature_difference": 30.0, "temperature_rise": rise}
    warm = loose.with_bending(section="solid 20x20 mm", material="steel", modes=6, mass="section", **heat)
    run = sd.simulate(warm, until=1e-4, samples=2, start="static")
    turn = 12e-6 * 30.0 / 0.02 * LENGTH
    radius = (1.0 + 12e-6 * rise) * LENGTH / turn
    assert float(np.abs(run["beam_deflection"][0]).max()) == pytest.approx(radius * (1.0 - math.cos(0.5 * turn)), rel=1e-7)
    assert float(np.abs(run["beam_start_moment"][0]).max()) < 1e-5 * 210e9 * 0.02**4 / 12.0 * turn / LENGTH


def test_the_first_contact_is_that_of_absolute_nodal_coordinates() -> None:
    """Cross-check by a second formulation: 2.0670 ms, 0.5787 m/s, 8.85 kN with 16 elements (`validation/bent_array`)."""
    run = sd.simulate(array(modes=8), until=3.4e-3, samples=5)
    assert float(run["contact_start"][0]) == pytest.approx(2.0670e-3, rel=3e-5)
    assert float(run["approach_speed"][0]) == pytest.approx(0.5787, rel=1e-3)
    assert float(run["peak_force"][0]) == pytest.approx(8.85e3, rel=5e-3)
    assert float(np.abs(run["energy_residual"]).max()) < 1e-6 * float(np.ptp(run["drive_work"].values))


def test_elements_and_modes_have_the_same_reactions() -> None:
    """Second formulation: reactions, moment at a pin and torque of the drive of an array at rest."""
    rigid = sd.scissor(units=2, angle=0.6)
    one, other = (
        sd.simulate(rigid.with_bending(**TUBE, **how).driven(speed=0.0), until=1e-4, samples=2, start="static").isel(time=0)
        for how in ({"modes": 6}, {"elements": 8})
    )
    assert one["reaction"].values == pytest.approx(other["reaction"].values, rel=2e-5, abs=1e-2)
    assert one["drive_torque"].values == pytest.approx(other["drive_torque"].values, rel=1e-5)
    assert float(one["stored_energy"]) == pytest.approx(float(other["stored_energy"]), rel=1e-3)


def test_modes_go_up_to_the_frequency_of_contacts() -> None:
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


def test_what_can_be_attached(tmp_path: Path) -> None:
    """Contract: payloads with inertia, welds, motors, springs, stops, latches, cables, aligned guides, clearance, controllers.

    Each closes its energy balance with what it does, and the mechanism is written and read.
    """
    made = sd.scissor(units=1, angle=0.6)
    made = made.with_clearance("A", sd.Clearance(5e-4, friction=sd.LuGre(kinetic=0.1)))
    made = made.with_bending(section="tube 60x60x1.56 mm", material="steel", modes=2)
    made = sd.with_payload(made, "unit 1/bar 1.end", 2.0, inertia=0.05)
    made = made.with_parts(
        {
            "components": (
                *made.components,
                sd.TorsionSpring("spring", "unit 1/bar 2", "unit 1/bar 1", stiffness=50.0, free_angle=0.0),
                sd.AngleStop("stop", "unit 1/bar 1", 0.61, stiffness=1e4),
                sd.Cable("cable", ("unit 1/bar 1/2", "end"), ("ground", "origin"), stiffness=1e4, free_length=2.5),
            )
        }
    )
    made = made.controlled(sd.PID(200.0, limit=500.0), speed=0.5)
    run = sd.simulate(made, until=5e-3, samples=11)
    assert run.attrs["status"] == "complete"
    moved = float(np.ptp(run["kinetic_energy"].values)) + float(np.ptp(run["potential_energy"].values))
    assert float(np.abs(run["energy_residual"]).max()) < 1e-4 * moved
    file = tmp_path / "case.toml"
    file.write_text(made.to_case(sd.Options(5e-3)), encoding="utf-8")
    assert read_case(file).mechanism == made


def test_an_aligned_guide_clamps_a_bar() -> None:
    """Closed form: a bar clamped at both ends sags by q L^4/(384 EI) in its middle; guides along x, aligned."""
    joint = sd.Guide("end", ("bar", "end"), aligned=True)
    made = bar(gravity=9.81, guides=(joint,)).with_bending(bending_stiffness=1e6, axial_stiffness=AXIAL, modes=6)
    run = sd.simulate(made.driven(speed=0.0), until=1e-4, samples=2, start="static", method="dop853")
    sag = -float(run["position"].sel(body="bar/1", axis="y")[0])
    assert sag == pytest.approx(MASS * 9.81 * LENGTH**3 / (384.0 * 1e6), rel=1e-5)


def test_modes_and_elements_exclude_each_other() -> None:
    """Bad input: one line."""
    with pytest.raises(InputError, match="modes and elements"):
        bar().with_bending(bending_stiffness=1e4, axial_stiffness=1e7, modes=3, elements=2)


def _struck(modes: int | Literal["auto"]) -> sd.Mechanism:
    """One unit of tubes whose driven end joint is loose."""
    made = sd.scissor(units=1)
    made = made.with_clearance("A", sd.Clearance(5e-4, friction=sd.NoFriction()))
    return made.with_bending(**TUBE, modes=modes).driven(speed=sd.rpm(150))


def test_a_contact_shorter_than_the_modes_is_said() -> None:
    """Limit: with two modes, up to 301 Hz, a contact of 1 ms excites more of them; those that are chosen alone are enough."""
    few = sd.simulate(_struck(2), until=4.5e-3, samples=2)
    said = [text for text in json.loads(few.attrs["warnings"]) if "excites bending" in text]
    shortest = float(np.nanmin(few["contact_duration"].values))
    assert len(said) == 1
    assert f"{1e3 * shortest:.3g} ms" in said[0]
    speed = math.sqrt(TUBE["bending_stiffness"] / (5.68 / 2.0)) / (2.0 * math.pi)
    numbers = plan(_struck(24)).coordinates.natural.axes[1].shapes.wave_numbers
    assert f"modes = {int(np.sum(numbers**2 * speed <= 1.0 / shortest))} keeps" in said[0]
    enough = sd.simulate(_struck("auto"), until=4.5e-3, samples=2)
    assert "excites bending" not in enough.attrs["warnings"]


def test_modes_until_a_number_stays() -> None:
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
    with pytest.raises(InputError, match="no bar that bends"):
        sd.convergence(_struck("auto").ideal().with_parts({"components": ()}), options, "drive_work", over="modes")


@pytest.mark.parametrize("modes", [8, 16, 24])
@pytest.mark.parametrize("clamped", [(), (0,)])
def test_axial_frequencies_of_a_bar(clamped: tuple[int, ...], modes: int) -> None:
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
