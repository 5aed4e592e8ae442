"""Forces along the stroke without inertia against closed forms, virtual work and slow runs."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path

import numpy as np
import pytest

import scissordyn as sd
from scissordyn.cli.main import status_of

G = 9.81

EXAMPLES = Path(__file__).parents[2] / "examples"


def slider_crank(**more: object) -> sd.Mechanism:
    """Crank 0.1 m, rod 0.3 m, driven through a turn."""
    crank = sd.slider_crank(crank=0.1, rod=0.3, gravity=0.0)
    return dataclasses.replace(crank.driven(speed=1.0), **more)  # type: ignore[arg-type]


@pytest.mark.parametrize("units", [1, 2, 3])
def test_jack_of_a_lift_of_several_stages(units: int) -> None:
    """Closed form: N (W + W_a/2) / tan(inclination) across the foot, W on top, W_a the weight of the arms."""
    length, payload, arm = 1.2, 80.0, 5.0
    lift = sd.scissor(
        units=units,
        bar_length=length,
        bar_mass=arm,
        slider_mass=7.0,
        angle=math.radians(75.0),
        gravity=G,
        gravity_direction=math.pi,
    )
    lift = sd.with_payload(lift, f"unit {units}/bar 1.end", payload)
    first, last = (length * math.sin(math.radians(angle)) for angle in (75.0, 30.0))
    jack = sd.Rod("jack", ("ground", "origin"), ("slider", "centre"), motion=sd.Polynomial((first, last - first)))
    found = sd.statics(dataclasses.replace(lift, rods=(jack,)), until=1.0, points=21)
    foot = found["rod_length"].values[:, 0]
    tangent = np.sqrt(length**2 - foot**2) / foot
    np.testing.assert_allclose(
        found["rod_force"].values[:, 0], units * G * (payload + 0.5 * 2 * units * arm) / tangent, rtol=1e-11
    )


def test_torque_of_a_crank_that_presses() -> None:
    """Closed form: T = P dx/dtheta, and the force in the rod's pins P / cos(angle of the rod)."""
    force = 250.0
    loaded = slider_crank(components=(sd.Force("cut", ("slider", "centre"), force=(-force, 0.0)),))
    found = sd.statics(loaded, until=6.0, points=61)
    angle = found["input"].values[:, 0]
    sine = np.sin(angle) / 3.0
    slope = -0.1 * np.sin(angle) - 0.3 * sine * (np.cos(angle) / 3.0) / np.sqrt(1.0 - sine**2)
    np.testing.assert_allclose(found["drive_torque"], force * slope, atol=1e-12 * force)
    pins = np.linalg.norm(found["reaction"].values, axis=2)
    names = found["joint"].values.tolist()
    np.testing.assert_allclose(pins[:, names.index("crank pin")], force / np.sqrt(1.0 - sine**2), rtol=1e-12)


def test_loads_have_their_values_of_the_instant() -> None:
    """Identity: the torque is proportional to a load that grows with time."""
    growing = sd.Force("cut", ("slider", "centre"), force=(-100.0, 0.0), time_function=sd.Polynomial((0.0, 1.0)))
    constant = dataclasses.replace(growing, time_function=None)
    one, other = (sd.statics(slider_crank(components=(part,)), until=3.0, points=7) for part in (growing, constant))
    np.testing.assert_allclose(one["drive_torque"], other["drive_torque"] * one["time"], atol=1e-12)


def test_springs_by_virtual_work() -> None:
    """Cross-check: the torque is the derivative of the energy of springs and gravity over the angle."""
    crank = dataclasses.replace(slider_crank(), gravity=G)
    spring = sd.Spring("return", ("slider", "centre"), ("ground", "anchor"), stiffness=900.0, free_length=0.1)
    anchor = (*crank.ground, ("anchor", (0.0, 0.05)))
    crank = dataclasses.replace(crank, components=(spring,), ground=anchor)
    found = sd.statics(crank, until=1.0, points=2001)
    height = found["position"].values[:, :, 1] @ np.array([body.mass for body in crank.bodies])
    energy = 450.0 * (found["spring_length"].values[:, 0] - 0.1) ** 2 + G * height
    slope = np.gradient(energy, found["input"].values[:, 0], edge_order=2)
    np.testing.assert_allclose(found["drive_torque"].values[1:-1], slope[1:-1], atol=1e-6 * np.abs(slope).max())


def test_slow_motion_tends_to_statics() -> None:
    """Order of convergence: the forces of a run differ from those at rest with the square of its speed."""
    four_bar = sd.four_bar(ground=0.4, crank=0.1, coupler=0.3, rocker=0.35, gravity=G)
    still = sd.statics(four_bar.driven(speed=1.0), until=6.0, points=25)
    differences = []
    for speed in (0.2, 0.1):
        run = sd.simulate(four_bar.driven(speed=speed), until=6.0 / speed, samples=25)
        differences.append(np.abs(run["reaction"].values - still["reaction"].values).max())
    assert math.log2(differences[0] / differences[1]) == pytest.approx(2.0, abs=0.02)


def test_bars_that_bend_rest_as_at_a_static_start() -> None:
    """Identity: at t = 0 the forces are those of a run that starts in static equilibrium."""
    case = sd.read_case(EXAMPLES / "lift_table.toml")
    found = sd.statics(case.mechanism, until=0.6, points=5)
    run = sd.simulate(case.mechanism.ideal(), until=1e-3, samples=2, start="static")
    for name in ("reaction", "drive_torque", "beam_axial_force", "beam_start_moment"):
        first, start = found[name].values[0], run[name].values[0]
        np.testing.assert_allclose(first, start, rtol=1e-6, atol=1e-6 * np.abs(start).max())
    along = sd.internal_forces(found, places=[0.5])
    assert float(np.abs(along["bending_moment"]).max()) > 50.0


def test_folded_mast_keeps_its_coordinates() -> None:
    """Identity: positions whose reduction differs give one Dataset, with the energy's derivative as torque."""
    case = sd.read_case(EXAMPLES / "mast.toml")
    found = sd.statics(case.mechanism, until=0.8, points=401)
    assert np.isfinite(found["drive_torque"]).all()
    masses = np.array([body.mass for body in case.mechanism.bodies])
    direction = case.mechanism.gravity_direction
    down = np.array([math.cos(direction), math.sin(direction)])
    energy = -case.mechanism.gravity * np.einsum("b,tba,a->t", masses, found["position"].values, down)
    work = np.concatenate(
        [
            [0.0],
            np.cumsum(
                0.5
                * np.diff(found["input"].values[:, 0])
                * (found["drive_torque"].values[1:] + found["drive_torque"].values[:-1])
            ),
        ]
    )
    np.testing.assert_allclose(energy - energy[0], work, atol=2e-5 * np.abs(energy).max())


def test_envelope_locates_between_positions() -> None:
    """Closed form: the largest side force of a slider-crank lies between positions."""
    loaded = slider_crank(components=(sd.Force("cut", ("slider", "centre"), force=(-100.0, 0.0)),))
    found = sd.statics(loaded, until=3.0, points=64)
    row = found.sel(quantity="reaction crank pin")
    assert float(row["largest"]) == pytest.approx(100.0 / math.sqrt(1.0 - 1.0 / 9.0), rel=1e-6)
    assert float(row["largest_time"]) == pytest.approx(0.5 * math.pi, abs=1e-3)


def test_servo_is_taken_on_its_reference() -> None:
    """Identity: a servo holds what a drive on its reference holds."""
    case = sd.read_case(EXAMPLES / "controlled.toml")
    found = sd.statics(case.mechanism, until=case.run.until, points=3)
    assert np.isfinite(found["drive_torque"]).all()


def test_nothing_prescribed() -> None:
    with pytest.raises(
        sd.InputError, match=r"statics of a mechanism without a drive, a servo or a driven rod, which has no stroke"
    ):
        sd.statics(sd.slider_crank(crank=0.1, rod=0.3), until=1.0)


def test_position_without_equilibrium_is_named() -> None:
    beyond = sd.four_bar(ground=0.4, crank=0.1, coupler=0.25, rocker=0.15, gravity=G)
    with pytest.raises(sd.InputError, match=r"statics at t = [\d.]+ s: "):
        sd.statics(beyond.driven(speed=1.0), until=6.0, points=25)


def test_command(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    table, picture = tmp_path / "forces.csv", tmp_path / "forces.png"
    words = ["statics", str(EXAMPLES / "lift_table.toml"), "--points", "9", "-o", str(table), "--plot", str(picture)]
    assert status_of([*words, "--over", "table.x"]) == 0
    printed = capsys.readouterr().out
    assert "drive torque" in printed
    assert "bar unit 1/bar 1: largest axial force 347.4 N" in printed
    head, *rows = table.read_text().splitlines()
    assert head.startswith("time [s],unit 1/bar 1 [rad],reaction O [N]")
    assert len(rows) == 9
    assert picture.stat().st_size > 10_000
    assert status_of([*words, "--over", "roof"]) == 2
    assert "forces over 'roof'; allowed: time, input, table.x, table.y" in capsys.readouterr().err
    assert status_of(["statics", str(EXAMPLES / "press.toml")]) == 2
    assert "which has no stroke; allowed: a drive, or a rod with a motion" in capsys.readouterr().err
    assert status_of(["statics", str(EXAMPLES / "lift.toml"), "-o", "forces.xlsx"]) == 2
    assert "-o forces.xlsx; allowed: a name that ends in .nc or .csv; type: -o statics.csv" in capsys.readouterr().err
