"""Bars that are heated and damped: closed forms, the balance of energy, derivatives, and refusals."""

import math

import numpy as np
import pytest
from tests.build import case_of, on_pin

import scissordyn as sd
from reference.kernels import at_start, check_element_slopes, check_time_derivative

LENGTH, DEPTH, EXPANSION = 1.0, 0.02, 12e-6  # Length [m], depth [m] and coefficient of thermal expansion [1/K] of a bar
MASS = 7850.0 * DEPTH**2 * LENGTH  # [kg] mass of a square steel bar
WARMING = sd.Cycloidal(0.0, 1.0, 0.02)  # Factor of the temperatures, which rises in 0.02 s
LONG = sd.bar("bar", length=2.0, mass=5.68)  # Rigid bar that the tests make flexible


def cantilever(*, elements=4, gravity=0.0, guided=False, **more):
    """Return a steel bar clamped by its drive; guided, its other end slides along x."""
    guides = (sd.Guide("end", ("bar", "end"), (LENGTH, 0.0), math.pi / 2.0),) if guided else ()
    bar = on_pin(sd.bar("bar", length=LENGTH, mass=MASS), gravity=gravity, guides=guides)
    return sd.with_bending(bar, section="solid 20x20 mm", material="steel", elements=elements, **more).driven(speed=0.0)


def damped():
    """Return a free unit with everything that the kernel of modes has: damping, and heat over time."""
    made = sd.scissor(units=1, angle=0.6)
    heat = {"temperature_rise": 80.0, "temperature_difference": 30.0, "time_function": WARMING}
    return sd.with_bending(made, section="tube 60x60x1.56 mm", material="steel", modes=3, damping=1e-4, **heat)


# Cantilevers that are heated, by the kind of their flexible bar
HEATED = {
    "elements": cantilever(
        elements=2, temperature_difference=100.0, temperature_rise=50.0, time_function=WARMING, damping=1e-5
    ),
    "modes": damped().driven(speed=3.0),
}


def test_a_free_bar_extends_and_curves_without_stress():
    """Closed forms: alpha Delta T L, and an arc of the curvature alpha Delta T_h/h."""
    made = cantilever(temperature_rise=80.0, temperature_difference=30.0)
    run = sd.simulate(made, until=1e-4, samples=2, start="static")
    kappa, longer = EXPANSION * 30.0 / DEPTH, 1.0 + EXPANSION * 80.0
    turn = kappa * LENGTH
    x, y = (float(run["position"].sel(body="bar/4", axis=axis)[0]) for axis in "xy")
    assert float(run["angle"].sel(body="bar/4")[0]) == pytest.approx(turn, rel=1e-9)
    assert x == pytest.approx(longer * LENGTH * math.sin(turn) / turn, rel=1e-10)
    assert y == pytest.approx(longer * LENGTH * (1.0 - math.cos(turn)) / turn, rel=1e-7)
    assert float(np.abs(run["beam_stress"]).max()) < 1e3


def test_a_bar_between_walls_is_pressed_by_its_expansion():
    """Closed form: EA alpha Delta T against a guide across the bar, which keeps its end."""
    run = sd.simulate(cantilever(guided=True, temperature_rise=50.0), until=1e-4, samples=2, start="static")
    force = 210e9 * DEPTH**2 * EXPANSION * 50.0
    assert run["beam_axial_force"].isel(time=0).values == pytest.approx(np.full(4, -force), rel=1e-6)


def test_the_force_between_walls_follows_the_warming():
    """Closed form: EA alpha Delta T times the factor of the temperatures, all along a bar by modes, at each instant."""
    made = cantilever(guided=True, elements=None, modes=2, temperature_rise=50.0, time_function=WARMING)
    run = sd.simulate(made, until=0.03, samples=31)
    turned = 2.0 * math.pi * np.minimum(run["time"].values / 0.02, 1.0)
    force = 210e9 * DEPTH**2 * EXPANSION * 50.0 * (turned - np.sin(turned)) / (2.0 * math.pi)
    found = sd.internal_forces(run, made, places=[0.0, 0.5, 1.0])["axial_force"].sel(bar="bar")
    np.testing.assert_allclose(found, np.tile(-force[:, None], 3), rtol=0.0, atol=1e-9 * force.max())


@pytest.mark.parametrize("method", ["dop853", "rodas5p"])
@pytest.mark.parametrize("kind", HEATED)
def test_heating_is_work_in_the_balance(kind, method):
    """Identity: what heat does against the stress is the work of a load; kinetic, stored and dissipated energy are the rest."""
    run = sd.simulate(HEATED[kind], until=0.03, samples=61, method=method)
    work = float(np.abs(run["load_work"]).max())
    assert work > 1e-3
    assert float(np.abs(run["energy_residual"]).max()) < 1e-6 * work
    assert float(run["dissipated_energy"][-1]) > 0.0


def test_the_analytic_derivatives_are_those_of_the_forces():
    """Identity, by differences: derivatives by position, rate and time at a bent position, with damping and heat."""
    system, y = at_start(damped())
    n, random = system.content.model.n, np.random.default_rng(1)
    y[:n] += 1e-2 * random.standard_normal(n)
    y[n : 2 * n] += random.standard_normal(n)
    check_element_slopes(system, y, 0.007)
    check_time_derivative(system, y, 1e-6, time=0.007, rtol=1e-6)


def test_bars_by_modes_extend_and_curve_without_stress():
    """Closed forms: alpha Delta T L, and an arc of the curvature alpha Delta T_h/h."""
    rise = {"thermal_expansion": EXPANSION, "temperature_rise": 80.0}
    made = sd.with_bending(on_pin(LONG), bending_stiffness=2252.0, axial_stiffness=7.5e7, modes=6, **rise)
    guided = made.with_parts({"guides": (sd.Guide("end", ("bar/2", "end")),)})
    run = sd.simulate(guided, until=1e-4, samples=2, start="static")
    assert float(run["position"].sel(body="bar/2", axis="x")[0]) == pytest.approx(2.0 * (1.0 + EXPANSION * 80.0), rel=1e-9)
    assert float(np.abs(run["beam_axial_force"][0]).max()) < 1e-3  # of 72 kN
    run = sd.simulate(made.driven(speed=0.0), until=1e-4, samples=2, start="static")
    longer = float(run["position"].sel(body="bar/2", axis="x")[0]) - 2.0
    assert longer == pytest.approx(2.0 * EXPANSION * 80.0, rel=5e-3)  # a clamp has no strain at its one cross-section
    curved = {"temperature_difference": 30.0, "mass": "section"}
    warm = sd.with_bending(on_pin(LONG), section="solid 20x20 mm", material="steel", modes=6, **curved)
    run = sd.simulate(warm.driven(speed=0.0), until=1e-4, samples=2, start="static")
    turn = EXPANSION * 30.0 / DEPTH * 2.0
    assert float(run["angle"].sel(body="bar/2")[0]) == pytest.approx(turn, rel=1e-5)
    assert float(run["position"].sel(body="bar/2", axis="y")[0]) == pytest.approx(2.0 * (1 - math.cos(turn)) / turn, rel=1e-5)


@pytest.mark.parametrize("rise", [0.0, 80.0, 800.0])
def test_a_bar_that_is_longer_curves_as_much(rise):
    """Closed form: between a pin and a guide an arc of the curvature alpha Delta T_h/h, without stress, however long."""
    loose = on_pin(LONG, guides=(sd.Guide("end", ("bar", "end")),))
    heat = {"temperature_difference": 30.0, "temperature_rise": rise}
    warm = sd.with_bending(loose, section="solid 20x20 mm", material="steel", modes=6, mass="section", **heat)
    run = sd.simulate(warm, until=1e-4, samples=2, start="static")
    turn = EXPANSION * 30.0 / DEPTH * 2.0
    radius = (1.0 + EXPANSION * rise) * 2.0 / turn
    assert float(np.abs(run["beam_deflection"][0]).max()) == pytest.approx(radius * (1.0 - math.cos(0.5 * turn)), rel=1e-7)
    assert float(np.abs(run["beam_start_moment"][0]).max()) < 1e-5 * 210e9 * DEPTH**4 / 12.0 * turn / 2.0


def test_vibration_decays_by_half_the_damping_time_times_the_frequency():
    """Closed form: successive maxima about the static sag fall by exp(2 pi zeta/sqrt(1 - zeta^2)), zeta = tau w/2."""
    omega = float(sd.modes(cantilever(), position="concentric", count=1)["angular_frequency"][0])
    tau = 2.0 * 0.02 / omega
    period = 2.0 * math.pi / (omega * math.sqrt(1.0 - 0.02**2))
    made = cantilever(gravity=0.1, damping=tau)
    run = sd.simulate(made, until=4.5 * period, samples=9001, method="dop853")
    still = sd.simulate(made, until=1e-4, samples=2, start="static")
    path, time = (run["position"] - still["position"][0]).sel(body="bar/4", axis="y").values, run["time"].values
    tops = [path[(time > (k - 0.25) * period) & (time < (k + 0.25) * period)].max() for k in (2, 3, 4)]
    expected = math.exp(2.0 * math.pi * 0.02 / math.sqrt(1.0 - 0.02**2))
    assert tops[0] / tops[1] == pytest.approx(expected, rel=1e-3)
    assert tops[1] / tops[2] == pytest.approx(expected, rel=1e-3)


# Case file with flexible bars
WITH_BARS = """
[structure]
kind = "scissor"
units = 1
bar_length = "2 m"
bars = { section = "tube 60x60x1.56 mm", material = "steel", elements = 2 }

[[payload]]
at = "unit 1/bar 1.end"
mass = "3 kg"

[run]
until = "1 ms"
"""


def test_bars_of_a_structure_have_the_mass_of_their_section(tmp_path):
    """Contract: the key of [structure] is with_bending of all bars, mass = "section"; payloads go to a cross-section."""
    made = case_of(tmp_path, WITH_BARS).mechanism
    per_length = 7850.0 * (0.06**2 - (0.06 - 2 * 0.00156) ** 2)
    assert made.body("unit 1/bar 2").mass == pytest.approx(0.5 * per_length, rel=1e-12)
    assert made.body("unit 1/bar 1/2").mass == pytest.approx(0.5 * per_length + 3.0, rel=1e-12)
    run = sd.simulate(made.driven(speed=0.0), until=1e-4, samples=2, start="static")
    held = float(run["reaction"].sel(axis="y").isel(time=0).sel(joint="O"))
    rigid = sd.with_payload(sd.scissor(units=1, bar_length=2.0, bar_mass=2.0 * per_length), "unit 1/bar 1.end", 3.0)
    same = sd.simulate(rigid.driven(speed=0.0), until=1e-4, samples=2, start="static")
    assert held == pytest.approx(float(same["reaction"].sel(axis="y").isel(time=0).sel(joint="O")), rel=1e-3)
    with pytest.raises(sd.InputError, match="a key bars in the table of all bars"):
        case_of(tmp_path, WITH_BARS.replace("bars = {", "bars = { bars = 'x',"))
