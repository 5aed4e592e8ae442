"""Forces along the stroke without inertia against closed forms, virtual work and slow runs."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path

import numpy as np
import pytest

import scissordyn as sd
from scissordyn.cli.main import status_of
from scissordyn.component.catalogue import COMPONENTS
from scissordyn.model.commanded import rigid
from scissordyn.run.answer.statics import SENSES as SENSITIVE

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


def test_every_drive_is_in_the_table() -> None:
    """Closed form: the torques of two drives of a double pendulum, each the moment of what hangs on it."""
    upper, lower = (sd.bar(name, length=0.4, mass=2.0, angle=0.0) for name in ("upper", "lower"))
    arms = sd.Mechanism(
        (upper, dataclasses.replace(lower, position=(0.4, 0.0))),
        (sd.Revolute("A", ("upper", "start"), ("ground", "O")), sd.Revolute("B", ("lower", "start"), ("upper", "end"))),
        ground=(("O", (0.0, 0.0)),),
        gravity=G,
    )
    found = sd.statics(arms.driven(speed=1.0, body="upper").driven(speed=-0.5, body="lower"), until=1.0, points=5)
    assert found["quantity"].values.tolist() == ["reaction A", "reaction B", "drive torque upper", "drive torque lower"]
    first, second = found["input"].values.T
    # a drive prescribes its body's angle against the ground
    np.testing.assert_allclose(found["quantity_value"].values[:, 2], 2.0 * G * (0.2 + 0.4) * np.cos(first), rtol=1e-12)
    np.testing.assert_allclose(found["quantity_value"].values[:, 3], 2.0 * G * 0.2 * np.cos(second), rtol=1e-12)


def test_loads_have_their_values_of_the_instant() -> None:
    """Identity: the torque is proportional to a load that grows with time."""
    growing = sd.Force("cut", ("slider", "centre"), force=(-100.0, 0.0), time_function=sd.Polynomial((0.0, 1.0)))
    constant = dataclasses.replace(growing, time_function=None)
    one, other = (sd.statics(slider_crank(components=(part,)), until=3.0, points=7) for part in (growing, constant))
    assert one["force"].values.tolist() == ["cut"]  # the coordinate of loads, beside the table of forces
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
        sd.InputError, match=r"statics of a mechanism without a drive, a servo, a driven rod or coordinate, which has no stroke"
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


def journal_crank(radius: float, kinetic: float) -> sd.Mechanism:
    """A slider-crank that presses, with friction in its crank's bearing."""
    force = sd.Force("cut", ("slider", "centre"), force=(-250.0, 0.0))
    return slider_crank(components=(force, sd.PinFriction("bearing", "crank", radius, kinetic)))


def test_friction_of_both_senses() -> None:
    """Closed form: the friction circle of the bearing, R W sin(phi), for and against the motion."""
    found = {sense: sd.statics(journal_crank(0.02, 0.2), until=6.0, points=31, friction=sense) for sense in SENSES}
    circle = 0.02 * math.sin(math.atan(0.2))
    pin = found["none"]["joint"].values.tolist().index("ground pin")
    for sense, sign in zip(SENSES, (0.0, 1.0, -1.0), strict=True):
        load = np.linalg.norm(found[sense]["reaction"].values[:, pin], axis=1)
        more = found[sense]["drive_torque"] - found["none"]["drive_torque"]
        np.testing.assert_allclose(more, sign * circle * load, atol=1e-9)
        assert not found[sense]["angular_velocity"].values.any()


SENSES = ("none", "forward", "backward")


def test_one_way_load_acts_in_its_sense() -> None:
    """Limit: at rest a load of one sense is that of the motion, not the half of it."""
    load = sd.StrokeLoad("cut", ("slider", "centre"), 0.0, ((0.1, -100.0), (0.5, -100.0)), acts="backward")
    found = sd.statics(slider_crank(components=(load,)), until=6.0, points=61)
    back = np.sin(found["input"].values[:, 0]) > 1e-3
    both = sd.statics(slider_crank(components=(dataclasses.replace(load, acts="both"),)), until=6.0, points=61)
    np.testing.assert_allclose(found["drive_torque"][back], both["drive_torque"][back], atol=1e-12)
    forth = np.sin(found["input"].values[:, 0]) < -1e-3
    np.testing.assert_allclose(found["drive_torque"][forth], 0.0, atol=1e-12)


def test_friction_that_is_not_there_or_jams() -> None:
    """Contract: no friction, and motion that the drives do not determine, are refused; a jam is a warning with its instant."""
    with pytest.raises(sd.InputError, match="friction = 'forward' of a mechanism without friction in ideal joints"):
        sd.statics(slider_crank(), until=1.0, points=3, friction="forward")
    free = dataclasses.replace(
        journal_crank(0.02, 0.2),
        bodies=(*journal_crank(0.02, 0.2).bodies, sd.bar("pendulum", length=0.2, mass=1.0, angle=-1.5)),
    )
    pin = sd.Revolute("pendulum pin", ("pendulum", "start"), ("slider", "centre"))
    hanging = dataclasses.replace(free, joints=(*free.joints, pin), gravity=G)
    with pytest.raises(sd.InputError, match="statics with 'bearing', whose sense is unknown, as the drives do not determine"):
        sd.statics(hanging, until=1.0, points=3, friction="forward")
    # a drawer that is pulled aside of its rails
    box = sd.Body("box", mass=2.0, inertia=0.05, points={"c": (0.0, 0.0), "pull": (0.0, 0.2)})
    rails = sd.GuideFriction("rails", ("ground", "O"), ("box", "c"), 0.0, 1.1, length=0.4)
    hand = sd.Rod("hand", ("ground", "far"), ("box", "pull"), motion=sd.Polynomial((2.0, 0.1)))
    drawer = sd.Mechanism(
        (box,),
        guides=(sd.Guide("rails", ("box", "c"), aligned=True),),
        rods=(hand,),
        components=(rails, sd.Force("side", ("box", "c"), (-30.0, 0.0))),
        ground=(("O", (0.0, 0.0)), ("far", (-2.0, 0.2))),
        gravity=0.0,
    )
    jammed = sd.statics(drawer, until=1.0, points=3, friction="forward")
    assert "the mechanism jams: no reactions are in balance with friction 'rails', first at t = " in jammed.attrs["warnings"]


def test_lift_table_in_statics_preview_and_runs() -> None:
    """Limit: preview and run have the torque of statics where the drive rests, and tend to it with the square of the speed."""
    table = rigid(sd.read_case(EXAMPLES / "lift_table.toml").mechanism.ideal())
    still = sd.statics(table, until=0.5)
    assert float(still["least"].sel(quantity="drive torque")) == pytest.approx(-355.5, abs=0.05)
    beyond = []
    for duration in (0.5, 5.0, 10.0):
        slow = table.driven(sd.Cycloidal(math.radians(70.0), math.radians(45.0), duration))
        ideal, run = sd.ideal_kinematics(slow, until=duration, samples=201), sd.simulate(slow, until=duration, samples=201)
        for one, other in ((ideal, still), (run, ideal)):
            difference = np.abs(one["drive_torque"].values - other["drive_torque"].values)
            assert max(difference[0], difference[-1]) < 1e-9
        assert difference.max() < 1e-8
        beyond.append(float(np.abs(ideal["drive_torque"].values - still["drive_torque"].values).max()))
    assert beyond == pytest.approx([653.64, 6.5364, 1.63411], rel=1e-4)
    # what the example does in half a second takes 2.8 times the torque at rest
    assert float(np.abs(sd.ideal_kinematics(table, until=0.5)["drive_torque"]).max()) == pytest.approx(1004.5, abs=0.5)


def test_many_turns() -> None:
    """Closed form: a measure has the largest torque of a crank over many turns; statics with too few positions says so."""
    crank = slider_crank(components=(sd.Force("cut", ("slider", "centre"), force=(-250.0, 0.0)),))
    angle = np.linspace(0.0, 2.0 * math.pi, 100_001)
    slope = 0.1 * np.sin(angle) + 0.3 * (np.sin(angle) / 3.0) * (np.cos(angle) / 3.0) / np.sqrt(
        1.0 - (np.sin(angle) / 3.0) ** 2
    )
    batch = sd.simulate_many(crank, {"gravity": [0.0]}, until=40.0 * math.pi, measures=("static_drive_torque",))
    assert float(batch["static_drive_torque"].values[0, 0]) == pytest.approx(250.0 * slope.max(), rel=1e-3)
    coarse = sd.statics(crank, until=40.0 * math.pi, points=51)
    assert "positions are up to 144 deg of rotation apart" in coarse.attrs["warnings"]
    assert sd.statics(crank, until=6.0, points=31).attrs["warnings"] == "[]"


def test_preview_has_the_forces_at_rest(capsys: pytest.CaptureFixture[str]) -> None:
    """Closed form: the jack of the lift, 3 (W + W_a/2) / tan(20 deg); nothing where nothing is loaded."""
    assert status_of(["preview", str(EXAMPLES / "lift.toml")]) == 0
    assert "At most without inertia: rod force 4.69 kN at 'jack', reaction 7.504 kN at" in capsys.readouterr().out.replace(
        "\n", " "
    )
    assert status_of(["preview", str(EXAMPLES / "slider_crank.toml")]) == 0
    assert "inertia" not in capsys.readouterr().out


def test_components_that_depend_on_the_sense_of_motion_are_known() -> None:
    """Contract: every component with a speed over which a force changes its sense is one that statics lets creep."""
    over = {"transition", "friction_speed"}
    parts = [part.declaration for part in COMPONENTS.values()]
    assert {part.section for part in parts if over & set(part.numbers)} == set(SENSITIVE)
