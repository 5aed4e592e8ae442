"""Torque over speed compared with a motor's curve, in a run and in a study, and the smallest sufficient limit."""

import numpy as np
import pytest
import xarray as xr
from tests.build import EXAMPLES

import scissordyn as sd
from scissordyn.cli.main import status_of
from scissordyn.cli.response import motor as command
from scissordyn.config.study import read_motor, read_study
from studies.test_study import UNTIL, arm

CURVE = sd.MotorCurve((0.0, 10.0, 30.0), (60.0, 60.0, 0.0))  # Torque-speed curve of a motor

# Case file with a drive
CASE = """
[structure]
kind = "scissor"
[drive]
speed = "150 rpm"
[[clearance]]
joint = "A"
clearance = "0.2 mm"
[run]
until = "5 ms"
"""


# Table of a servo that replaces the drive
CONTROL = """
[[control]]
name = "servo"
controller = { name = "feed-forward", proportional = "37000 N m/rad", derivative = "2700 N m s/rad" }
feed_forward = "ideal"
reference = { harmonic = { mean = "30 deg", amplitude = "2 deg", angular_frequency = "20 Hz" } }
"""


def needed(torque, speed):
    """Return torques at speeds."""
    return xr.Dataset({"torque": ("time", torque), "speed": ("time", speed)})


def test_motor_curve():
    """Closed form: 60 N m up to 10 rad/s, 30 N m at 20 rad/s, none beyond 30 rad/s, in both directions."""
    np.testing.assert_allclose(CURVE.available(np.array([0.0, 10.0, -20.0, 30.0, 40.0])), [60.0, 60.0, 30.0, 0.0, 0.0])
    share = CURVE.fraction(needed([30.0, -30.0, 15.0, 0.0, 0.0, 1.0], [0.0, 20.0, -20.0, 30.0, 31.0, 30.0]))
    np.testing.assert_allclose(share, [0.5, 1.0, 0.5, 0.0, np.inf, np.inf])


def test_motor_with_a_gear():
    """Closed form: a ratio of 5 gives 300 N m up to 2 rad/s, and none beyond 6 rad/s."""
    geared = sd.MotorCurve(CURVE.speeds, CURVE.torques, ratio=5.0)
    np.testing.assert_allclose(geared.available(np.array([0.0, 2.0, 4.0, 6.5])), [300.0, 300.0, 150.0, 0.0])
    assert geared.fraction(needed([75.0], [4.0]))[0] == pytest.approx(0.5)


@pytest.mark.parametrize(
    ("speeds", "torques", "ratio", "what"),
    [
        ((0.0,), (1.0,), 1.0, "1 speeds"),
        ((0.0, 1.0), (1.0,), 1.0, "2 speeds and 1 torques"),
        ((1.0, 2.0), (1.0, 1.0), 1.0, "speeds of a motor are 1, 2"),
        ((0.0, 2.0, 2.0), (1.0, 1.0, 0.0), 1.0, "speeds of a motor are 0, 2, 2"),
        ((0.0, 1.0), (1.0, -1.0), 1.0, "torques of a motor"),
        ((0.0, 1.0), (0.0, 0.0), 1.0, "torques of a motor"),
        ((0.0, 1.0), (1.0, 0.0), 0.0, "gear ratio is 0"),
    ],
)
def test_wrong_curves_are_refused(speeds, torques, ratio, what):
    """Contract: the error gives the wrong values."""
    with pytest.raises(sd.InputError, match=what):
        sd.MotorCurve(speeds, torques, ratio=ratio)


def test_texts_of_a_curve():
    """Contract: points have units of speed and torque; a missing comma or a wrong unit is refused."""
    found = read_motor(["0 rpm, 60 N m", "300 rpm, 0.04 kN m", "600 rpm, 0 N m"], "servo", 2.0)
    np.testing.assert_allclose(found.speeds, np.array([0.0, 10.0, 20.0]) * np.pi)
    assert (found.torques, found.of, found.ratio) == (pytest.approx((60.0, 40.0, 0.0)), "servo", 2.0)
    for text, words in (("0 rpm 60 N m", "a comma"), ("0 rpm, 60 N", "wrong dimension"), ("-1 rpm, 60 N m", "out of bounds")):
        with pytest.raises(sd.InputError, match=words):
            read_motor([text, "300 rpm, 0 N m"])


def test_torque_and_speed_of_a_drive():
    """Contract: the driving torque at every sample and at its located maximum, and the prescribed speed."""
    run = sd.simulate(arm(), until=UNTIL)
    found = sd.torque_over_speed(run)
    assert found.attrs == {"of": "drive", "body": str(arm().drives[0].body)}
    assert found.sizes["time"] == run.sizes["time"] + 1
    assert np.abs(found["torque"]).max() == float(run["peak_drive_torque"][0])
    at_samples = found.sel(time=np.setdiff1d(found["time"], [float(run["peak_drive_torque_time"][0])]))
    np.testing.assert_array_equal(np.isin(run["drive_torque"], found["torque"]), True)
    np.testing.assert_allclose(at_samples["speed"], sd.rpm(150), rtol=1e-9)
    peak = float(run["peak_drive_torque"][0])
    assert sd.MotorCurve((0.0, 100.0), (peak, peak))(run) == pytest.approx(1.0)
    assert sd.MotorCurve((0.0, 10.0), (peak, peak))(run) == np.inf  # 150 rpm are 15.7 rad/s
    with pytest.raises(sd.InputError, match="torque of 'servo'"):
        sd.torque_over_speed(run, "servo")


def test_motor_with_the_name_of_the_drive_is_refused():
    """Contract: a name that drive and motor share selects neither, and the error says so; another name selects its part."""

    def run(name):
        motor = sd.Motor(name, "unit 1/bar 2", stall_torque=1.0, no_load_speed=8.0)
        driven = sd.scissor(units=2).driven(speed=sd.rpm(60))
        return sd.simulate(driven.with_parts({"components": (motor,)}), until=1e-3, samples=5)

    assert sd.torque_over_speed(run("motor"), "drive").attrs["body"] == "unit 1/bar 1"
    with pytest.raises(sd.InputError, match="torque of 'drive', a name of 2 parts: drive and motor"):
        sd.torque_over_speed(run("drive"), "drive")


def test_speed_at_the_largest_torque():
    """Limit: the largest torque of a servo is between samples, its speed there is that of a run with many samples."""
    reference = sd.Cycloidal(sd.degrees(60), sd.degrees(30), 0.5)
    lift = sd.scissor(units=2, gravity=9.81).controlled(sd.PID(2e4, derivative=500.0), reference=reference)
    few, many = (sd.torque_over_speed(sd.simulate(lift, until=0.5, samples=samples)) for samples in (21, 2001))
    at = int(np.argmax(np.abs(few["torque"].values)))
    assert float(few["speed"][at]) == pytest.approx(float(many["speed"].sel(time=few["time"][at])), rel=5e-3)


def test_root_mean_square_of_part_of_a_run():
    """Closed form: the torque of the second half of a stroke, not of the whole, if a run is cut to it."""
    reference = sd.Cycloidal(sd.degrees(60), sd.degrees(30), 0.5)
    run = sd.simulate(sd.scissor(units=2, gravity=9.81).driven(reference), until=0.5, samples=2001)
    late = run.isel(time=slice(1000, None))
    torque, time = late["drive_torque"].values, late["time"].values
    wanted = np.sqrt(np.trapezoid(torque**2, time) / (time[-1] - time[0]))
    assert float(sd.torque_over_speed(late)["root_mean_square"]) == pytest.approx(wanted, rel=1e-12)
    assert (
        float(sd.torque_over_speed(run)["root_mean_square"])
        == float(run["rms_drive_torque"][0])
        != pytest.approx(wanted, rel=0.05)
    )


def test_figures_of_merit_of_the_end_of_a_run():
    """Identity: a run without its first samples has the figures of the whole run after these samples."""
    run, ideal = (sd.simulate(made, until=UNTIL, samples=101) for made in (arm(), arm().ideal()))
    cut = sd.figures_of_merit(run.isel(time=slice(60, None)), ideal)
    xr.testing.assert_allclose(cut, sd.figures_of_merit(run, ideal, after=float(run["time"][60])), rtol=1e-12)


def test_root_mean_square_of_a_torque_with_impacts(tmp_path, capsys):
    """Cross-check: few samples between impacts give the root mean square over time that many samples do, printed too."""
    drop = arm().replace("A.clearance", 0.5e-3)
    torque = sd.simulate(drop, until=UNTIL, samples=200001)["drive_torque"].values
    wanted = float(np.sqrt(np.mean(torque**2)))
    few = sd.simulate(drop, until=UNTIL, samples=51)
    for found in (sd.torque_over_speed(few)["root_mean_square"], sd.figures_of_merit(few, few)["torque_root_mean_square"]):
        assert found.item() == pytest.approx(wanted, rel=1e-4)
    case = tmp_path / "case.toml"
    case.write_text(CASE.replace('until = "5 ms"', 'until = "15 ms"\nsamples = 51'))
    assert command(case) == 0
    printed = float(capsys.readouterr().out.split("root mean square")[1].split()[0])
    run = sd.simulate(sd.read_case(case).mechanism, until=0.015, samples=200001)
    assert printed == pytest.approx(float(np.sqrt(np.mean(run["drive_torque"].values ** 2))), rel=1e-3)


def test_command_names_the_fall_of_the_journals(tmp_path, capsys):
    """Limit: of a slow move the largest torque is that of the fall at the start; from then on it is near the ideal torque."""
    case = tmp_path / "case.toml"
    slow = 'cycloidal = { start = "60 deg", end = "15 deg", duration = "20 s" }'
    case.write_text(CASE.replace('speed = "150 rpm"', slow).replace('until = "5 ms"', 'until = "0.5 s"'))
    assert command(case) == 0
    told = " ".join(capsys.readouterr().out.split())
    largest, later = (float(told.split(words)[1].split()[0]) for words in ("largest torque", "from then on at most"))
    ideal = sd.simulate(sd.read_case(case).mechanism.ideal(), until=0.5, samples=51)
    static = float(ideal["peak_drive_torque"].item())
    assert largest > 10.0 * static
    assert 0.99 * static < later < 2.0 * static
    case.write_text(f'{case.read_text()}start = "in-contact"\n')
    assert command(case) == 0
    assert "journals fall" not in capsys.readouterr().out


def test_command_refuses_a_case_without_a_torque(tmp_path, capsys, monkeypatch):
    """Contract: a jack, or nothing that drives, is refused before the run, in terms of the case file."""
    monkeypatch.setattr("scissordyn.run.simulate.simulate", None)
    lift = str(EXAMPLES / "lift.toml")
    assert status_of(["motor", lift]) == 2
    says = f"[drive], [control] or [[motor]]; the force of a jack is a result of statics; for example scissordyn statics {lift}"
    assert says in capsys.readouterr().err
    (tmp_path / "case.toml").write_text('[structure]\nkind = "scissor"\n[run]\nuntil = "1 ms"\n')
    assert status_of(["motor", str(tmp_path / "case.toml")]) == 2
    assert "expected [drive], [control] or [[motor]]; for example [drive]" in capsys.readouterr().err


def test_motor_in_a_study(tmp_path):
    """Contract: the store keeps the curve, and continues with it."""
    (tmp_path / "case.toml").write_text(CASE)
    file = tmp_path / "study.toml"
    file.write_text(
        'case = "case.toml"\nrequire = ["motor_fraction < 1"]\n[vary]\n"A.clearance" = "0.1, 0.4 mm"\n'
        '[motor]\npoints = ["0 rpm, 2 kN m", "200 rpm, 1.8 kN m"]\nof = "drive"\n'
    )
    found = sd.study(file, store=tmp_path / "motor.db")
    assert found.counts["complete"] == 2
    again = sd.open_study(tmp_path / "motor.db")
    assert again.recommend().margins == found.recommend().margins
    assert again.built().own_measures[0].function == read_study(file).motor
    assert again.resume().counts["complete"] == 2
    for wrong, words in (
        ('points = "0 rpm"', "a list of texts"),
        ('of = "drive"', "points"),
        ("points = []\ntorque = 1", "'torque'"),
    ):
        file.write_text(f'case = "case.toml"\n[vary]\n"A.clearance" = "0.1, 0.4 mm"\n[motor]\n{wrong}\n')
        with pytest.raises(sd.InputError, match=words):
            read_study(file)


def test_motor_fraction_of_a_replayed_case(tmp_path):
    """Identity: the fraction does not depend on samples = "auto", and is that of the replayed case bit for bit."""
    text = CASE.replace('until = "5 ms"', 'until = "20 ms"\nsamples = SAMPLES').replace('[drive]\nspeed = "150 rpm"\n', CONTROL)
    values = []
    for samples in ('"auto"', "2001"):
        (tmp_path / "case.toml").write_text(text.replace("SAMPLES", samples))
        file = tmp_path / "study.toml"
        file.write_text(
            'case = "case.toml"\nrequire = ["motor_fraction < 1"]\n[vary]\n"A.clearance" = "0.1, 0.4 mm"\n'
            '[motor]\npoints = ["0 rpm, 2 kN m", "200 rpm, 0.1 kN m"]\nof = "servo"\n'
        )
        found = sd.study(file, store=tmp_path / f"{len(values)}.db")
        values.append(found.dataset["motor_fraction"].values.tolist())
        curve = read_study(file).motor
        assert curve is not None
        assert [curve(found.replay(case)) for case in (0, 1)] == values[-1]
    assert values[0] == values[1]


def test_least_value():
    """Cross-check: runs at the value and 1 % beyond it are on both sides of the requirement."""
    case = sd.Case(arm(), sd.Options(UNTIL))
    forces = sd.simulate_many(arm(), {"A.clearance": np.array([0.05e-3, 0.4e-3])}, until=UNTIL)["peak_force"].values.ravel()
    bound = float(forces.mean())
    found = sd.least_value(case, "A.clearance", 0.05e-3, 0.4e-3, [f"peak_force > {bound!r} N"])
    assert found.fails_at < found.value <= 1.0101 * found.fails_at
    ends = sd.simulate_many(arm(), {"A.clearance": np.array([found.fails_at, found.value])}, until=UNTIL)["peak_force"]
    assert ends.values.ravel()[0] <= bound < ends.values.ravel()[1]
    assert all(met == (value >= found.value) for value, met in found.tried.items())
    with pytest.raises(sd.InputError, match=r"not met at the largest value, 'A\.clearance' = 0.0001 m"):
        sd.least_value(case, "A.clearance", 0.05e-3, 0.1e-3, ["peak_force > 1e9 N"])
    with pytest.raises(sd.InputError, match="all requirements are met at the smallest value"):
        sd.least_value(case, "A.clearance", 0.05e-3, 0.1e-3, ["peak_force > 1 N"])


def test_command(tmp_path, capsys):
    """Contract: the required torque, whether the motor is sufficient, the picture, and the smallest value with its unit."""
    case = tmp_path / "case.toml"
    case.write_text(CASE)
    weak = ["0 rpm, 1 N m", "200 rpm, 1 N m"]
    assert command(case, point=weak, plot=tmp_path / "motor.png") == 0
    said = capsys.readouterr().out
    assert "at 150 rpm" in said
    assert f"at {sd.simulate(sd.read_case(case).mechanism, until=UNTIL).sizes['time'] + 1} recorded instants" in said
    assert "The motor is too weak" in said
    assert (tmp_path / "motor.png").stat().st_size > 5000
    assert command(case, point=["0 rpm, 1 N m", "100 rpm, 1 N m"]) == 0
    assert "its curve ends at 100 rpm" in capsys.readouterr().out
    with pytest.raises(sd.InputError, match="--least, --from, --to and --require together"):
        command(case, least="A.clearance")
    assert command(case, least="A.clearance", first="0.05 mm", last="0.4 mm", require=["peak_force > 60 kN"]) == 0
    assert "Least A.clearance: 0." in capsys.readouterr().out


def test_command_on_a_run_that_is_no_answer(tmp_path, capsys):
    """Contract: a run that fails gives no verdict on the motor but its cause; a servo at its limit gives a warning."""
    case = tmp_path / "case.toml"
    curve = ["0 rpm, 1 GN m", "200 rpm, 1 GN m"]
    case.write_text('[structure]\nkind = "slider-crank"\nrod = "40 mm"\n[drive]\nspeed = "60 rpm"\n[run]\nuntil = "1 s"\n')
    assert command(case, point=curve) == 3
    said = capsys.readouterr()
    assert "The motor is enough" not in said.out
    assert "singular position: body 'rod' is fully extended" in said.err
    weak = CONTROL.replace("derivative =", 'limit = "10 N m", derivative =')
    case.write_text(CASE.replace('[drive]\nspeed = "150 rpm"\n', weak))
    assert command(case, point=curve) == 0
    assert "Warning: actuator 'servo': the controller is at its limit of 10 N m" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("first", "last", "words"),
    [
        ("x", "0.5", "--from 'x': not a number"),
        ("0.1", "0.5 mm", "--to '0.5 mm': not a number"),
        ("0.5", "0.1", "--from '0.5' --to '0.1': the range is empty; expected --from below --to"),
    ],
)
def test_wrong_ends_of_the_search_are_refused(tmp_path, capsys, first, last, words):
    """Contract: the error names the option, before a run."""
    case = tmp_path / "case.toml"
    case.write_text(CASE.replace("[run]", "friction = 'ambrosio'\n[run]"))
    with pytest.raises(sd.InputError, match=words):
        command(case, least="A.friction.kinetic", first=first, last=last, require=["peak_force < 60 kN"])
    assert not capsys.readouterr().out
