"""Bars that are heated and damped: closed forms, the balance of energy, refusals, and the same from a case file."""

import dataclasses
import math
from pathlib import Path

import numpy as np
import pytest

import scissordyn as sd
from scissordyn.config.file import read_case
from scissordyn.errors import InputError
from scissordyn.model.payload import with_payload

LENGTH, DEPTH, EXPANSION = 1.0, 0.02, 12e-6
MASS = 7850.0 * DEPTH**2 * LENGTH


def cantilever(*, elements: int = 4, gravity: float = 0.0, guided: bool = False, **more: object) -> sd.Mechanism:
    """A steel bar clamped by its drive; guided, its other end slides along x."""
    made = sd.Mechanism(
        bodies=(sd.bar("bar", length=LENGTH, mass=MASS),),
        joints=(sd.Revolute("O", ("bar", "start"), ("ground", "O")),),
        guides=(sd.Guide("end", ("bar", "end"), (LENGTH, 0.0), math.pi / 2.0),) if guided else (),
        ground=(("O", (0.0, 0.0)),),
        gravity=gravity,
        input_body="bar",
    )
    bent = made.with_bending(section="solid 20x20 mm", material="steel", elements=elements, **more)
    return bent.driven(speed=0.0)


def test_a_free_bar_extends_and_curves_without_stress() -> None:
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


def test_a_bar_between_walls_is_pressed_by_its_expansion() -> None:
    """Closed form: EA alpha Delta T against a guide across the bar, which keeps its end."""
    run = sd.simulate(cantilever(guided=True, temperature_rise=50.0), until=1e-4, samples=2, start="static")
    force = 210e9 * DEPTH**2 * EXPANSION * 50.0
    assert run["beam_axial_force"].isel(time=0).values == pytest.approx(np.full(4, -force), rel=1e-6)


@pytest.mark.parametrize("method", ["dop853", "rodas5p"])
def test_heating_is_work_in_the_balance(method: str) -> None:
    """Identity: what heat does against the stress is the work of a load; kinetic, stored and dissipated energy are the rest."""
    warming = sd.Cycloidal(0.0, 1.0, 0.02)
    made = cantilever(elements=2, temperature_difference=100.0, temperature_rise=50.0, time_function=warming, damping=1e-5)
    run = sd.simulate(made, until=0.03, samples=61, method=method)
    work = float(np.abs(run["load_work"]).max())
    assert work > 1e-3
    assert float(np.abs(run["energy_residual"]).max()) < 1e-6 * work
    assert float(run["dissipated_energy"][-1]) > 0.0


def test_vibration_decays_by_half_the_damping_time_times_the_frequency() -> None:
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


def test_what_cannot_be_heated_is_refused() -> None:
    """Bad input: no expansion, no depth, degrees Celsius for a difference."""
    arm = sd.scissor(bar_length=2.0, bar_mass=5.68)
    with pytest.raises(InputError, match="without a thermal_expansion"):
        arm.with_bending(bending_stiffness=1e4, axial_stiffness=1e7, temperature_rise=10.0)
    with pytest.raises(InputError, match="a section, which has a depth"):
        arm.with_bending(bending_stiffness=1e4, axial_stiffness=1e7, temperature_difference=10.0, thermal_expansion=1e-5)


CASE = """
[structure]
kind = "scissor"
bar_length = "2 m"
bar_mass = "5.68 kg"

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


def test_case_file_and_python_agree(tmp_path: Path) -> None:
    """Round trip: the table reads as the arguments do, and the elements are written and read with all they have."""
    path = tmp_path / "case.toml"
    path.write_text(CASE)
    made = read_case(path).mechanism
    arguments = {"damping": 2e-5, "temperature_rise": 40.0, "temperature_difference": -15.0}
    arguments |= {"time_function": sd.Cycloidal(0.0, 1.0, 2.0)}
    same = sd.scissor(bar_length=2.0, bar_mass=5.68).with_bending(
        "unit 1/*",
        section="tube 60x60x1.56 mm",
        material="steel",
        elements=2,
        **arguments,
    )
    assert made.components == same.components
    path.write_text(made.to_case(sd.Options(1e-3)))
    assert read_case(path).mechanism.components == made.components
    path.write_text(CASE.replace("40 K", "40 degC"))
    with pytest.raises(InputError, match="a temperature in place of a difference"):
        read_case(path)
    assert dataclasses.replace(made.components[0], damping=0.0) != made.components[0]


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


def test_bars_of_a_structure_have_the_mass_of_their_section(tmp_path: Path) -> None:
    """Contract: the key of [structure] is with_bending of all bars, mass = "section"; payloads go to a cross-section."""
    path = tmp_path / "case.toml"
    path.write_text(WITH_BARS)
    made = read_case(path).mechanism
    per_length = 7850.0 * (0.06**2 - (0.06 - 2 * 0.00156) ** 2)
    assert made.body("unit 1/bar 2").mass == pytest.approx(0.5 * per_length, rel=1e-12)
    assert made.body("unit 1/bar 1/2").mass == pytest.approx(0.5 * per_length + 3.0, rel=1e-12)
    run = sd.simulate(made.driven(speed=0.0), until=1e-4, samples=2, start="static")
    held = float(run["reaction"].sel(axis="y").isel(time=0).sel(joint="O"))
    rigid = with_payload(sd.scissor(units=1, bar_length=2.0, bar_mass=2.0 * per_length), "unit 1/bar 1.end", 3.0)
    same = sd.simulate(rigid.driven(speed=0.0), until=1e-4, samples=2, start="static")
    assert held == pytest.approx(float(same["reaction"].sel(axis="y").isel(time=0).sel(joint="O")), rel=1e-3)
    path.write_text(WITH_BARS.replace("bars = {", "bars = { bars = 'x',"))
    with pytest.raises(InputError, match="bars within bars"):
        read_case(path)
    with pytest.raises(InputError, match="without a section and a material"):
        sd.scissor().with_bending(bending_stiffness=1e4, axial_stiffness=1e7, mass="section")
