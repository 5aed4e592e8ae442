"""User-defined laws, controllers and components, declared with `sd.element` in a file: they work as the package's own."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline

import scissordyn as sd
from scissordyn.cli.main import status_of
from scissordyn.explore.case import open_case
from scissordyn.model.record import to_plain
from scissordyn.run.engine import outcomes
from scissordyn.run.simulate import compute_results

# Python file with user-defined laws and controllers
MINE = '''
from typing import Annotated

import scissordyn as sd


def force(slip_speed, normal_force, short, long, kinetic, stiff, soft):
    """Two bristles side by side; each carries half of the force of sliding."""
    first = slip_speed - 2.0 * stiff * abs(slip_speed) * short / kinetic
    second = slip_speed - 2.0 * soft * abs(slip_speed) * long / kinetic
    return normal_force * (stiff * short + soft * long), first, second


def limit(slip_speed, normal_force, kinetic):
    return kinetic * normal_force


@sd.element(
    slot="friction",
    force=force,
    limit=limit,
    states=(
        sd.State("short", "m", scale=lambda law: 0.5 * law.kinetic / law.stiff),
        sd.State("long", "m", scale=lambda law: 0.5 * law.kinetic / law.soft),
    ),
)
class TwoBristles:
    """Friction of two bristles side by side."""

    kinetic: Annotated[float, sd.Quantity("1", minimum=0.0, maximum=10.0, help="coefficient of sliding")] = 0.1
    stiff: Annotated[float, sd.Quantity("1/m", above=0.0, help="stiffness of the first per normal force")] = 2e5
    soft: Annotated[float, sd.Quantity("1/m", above=0.0, help="stiffness of the second per normal force")] = 2e4


def torque(error, reference_speed, speed, filtered, gain, damping, filter_time):
    """Proportional gain, and the filtered rate of the error."""
    return gain * error + damping * filtered, (reference_speed - speed - filtered) / filter_time


@sd.element(slot="controller", torque=torque, states=(sd.State("filtered", "rad/s", scale=1.0),))
class FilteredRate:
    """Feedback of the error and of its filtered rate."""

    gain: Annotated[float, sd.Quantity("N m/rad", minimum=0.0, help="of the error")]
    damping: Annotated[float, sd.Quantity("N m s/rad", minimum=0.0, help="of its rate")] = 0.0
    filter_time: Annotated[float, sd.Quantity("s", above=0.0, help="time constant of the filter")] = 0.01


def push(indentation, stiffness):
    return stiffness * indentation


@sd.element(slot="stiffness", force=push)
class Rubber:
    """A linear layer."""

    stiffness: Annotated[float, sd.Quantity("N/m", above=0.0, help="of the layer")] = 2e7


def lossy(elastic, rate, approach, loss):
    return elastic * (1.0 + loss * rate / approach)


@sd.element(slot="damping", force=lossy)
class Lossy:
    """A loss in proportion to the rate."""

    loss: Annotated[float, sd.Quantity("1", minimum=0.0, maximum=1.0, help="at the approach speed")] = 0.2


def layer(length, rate, stiffness):
    return stiffness * length, 0.5 * stiffness * length * length, 0.0


@sd.component(port="line", force=layer)
class Band:
    """A band."""

    name: str
    start: tuple[str, str]
    end: tuple[str, str]
    stiffness: Annotated[float, sd.Quantity("N/m", above=0.0, help="of the band")] = 10.0
'''

# Case file with a user-defined controller and friction law
CASE = """
[structure]
kind = "scissor"
units = 1
angle = "40 deg"

[[control]]
controller = { name = "mine.py:FilteredRate", gain = "4e4 N m/rad", damping = "3000 N m s/rad", filter_time = "1 ms" }
reference = { cycloidal = { start = "40 deg", end = "42 deg", duration = "20 ms" } }

[[component]]
type = "mine.py:Band"
name = "band"
start = "unit 1/bar 1.end"
end = "unit 1/bar 2.end"

[[clearance]]
joint = "A"
clearance = "0.2 mm"
stiffness = { law = "mine.py:Rubber", stiffness = "30 kN/mm" }
damping = "mine.py:Lossy"
friction = { law = "mine.py:TwoBristles", kinetic = 0.2 }

[run]
until = "20 ms"
samples = 41
start = "in-contact"
"""


@pytest.fixture
def case(tmp_path):
    """Write a case file and the user's file next to it."""
    (tmp_path / "mine.py").write_text(MINE, encoding="utf-8")
    (tmp_path / "case.toml").write_text(CASE, encoding="utf-8")
    return tmp_path / "case.toml"


def simulated(path: Path, **changed: object) -> object:
    """Return the run of a case file."""
    read = sd.read_case(path)
    return sd.simulate(read.mechanism, **{**read.run.keywords, **changed})


def test_case_file_and_its_run(case):
    """Second formulation: friction and torque follow from the recorded states, which scipy integrates for the same motion."""
    run = simulated(case, samples=20_001)
    assert run.attrs["status"] == "complete"
    assert run["short"].attrs["units"] == run["long"].attrs["units"] == "m"
    assert run["filtered"].attrs["units"] == "rad/s"
    at = {"joint": "A"}
    touching = run["in_contact"].sel(at).values.astype(bool)
    ends = np.flatnonzero(np.diff(np.concatenate([[0], touching.astype(int), [0]])))
    first, last = max(zip(ends[::2], ends[1::2], strict=True), key=lambda pair: pair[1] - pair[0])
    during = slice(first, last)
    assert last - first > 5000
    friction = run["normal_force"] * (2e5 * run["short"] + 2e4 * run["long"])
    np.testing.assert_allclose(run["friction_force"].sel(at)[touching], friction.sel(at)[touching], rtol=1e-9, atol=1e-9)
    time = run["time"].values[during]
    sliding = CubicSpline(time, run["slip_speed"].sel(at).values[during])
    for name, stiffness in (("short", 2e5), ("long", 2e4)):

        def rate(t: float, z: np.ndarray, stiffness: float = stiffness) -> np.ndarray:
            v = float(sliding(t))
            return v - 2.0 * stiffness * abs(v) * z / 0.2

        recorded = run[name].sel(at).values[during]
        found = solve_ivp(rate, time[[0, -1]], recorded[:1], method="Radau", t_eval=time, rtol=1e-8, atol=1e-13)
        largest = np.abs(recorded).max()
        assert largest > 1e-8
        np.testing.assert_allclose(recorded, found.y[0], atol=1e-2 * largest)
    torque = 4e4 * run["control_error"][:, 0] + 3000.0 * run["filtered"][:, 0]
    np.testing.assert_allclose(run["control_torque"][:, 0], torque, rtol=1e-9, atol=1e-9)
    assert float(abs(run["filtered"]).max()) > 1e-4


def test_replay_and_its_digest(case, tmp_path):
    """Contract: a saved run is run again bit for bit from the allowed file, and refused from an edited one."""
    run = simulated(case)
    loaded = sd.load(sd.save(run, tmp_path / "run.nc"))
    with pytest.raises(sd.InputError, match=r"of 'mine\.py', which is not executed unless you allow it"):
        sd.replay(loaded)
    again = sd.replay(loaded, allow_code=tmp_path / "mine.py")
    for name in ("friction_force", "control_torque", "short", "long", "filtered", "band_force"):
        np.testing.assert_array_equal(again[name], run[name])
    (tmp_path / "mine.py").write_text(MINE.replace("2.0 * stiff", "2.1 * stiff"), encoding="utf-8")
    with pytest.raises(sd.InputError, match=r"with the digest .* the file as it was when the run was made"):
        sd.replay(loaded, allow_code=tmp_path / "mine.py")


def test_text_of_a_case(case, tmp_path):
    """Contract: a case is written as it was read, and refused when the user's file has changed since."""
    read = sd.read_case(case)
    text = sd.write_case(read.mechanism, tmp_path / "again.toml", run=read.run).read_text(encoding="utf-8")
    assert 'friction = { law = "mine.py:TwoBristles", kinetic = 0.2 }' in text
    assert 'damping = "mine.py:Lossy"' in text
    assert 'name = "mine.py:FilteredRate"' in text
    assert 'type = "mine.py:Band"' in text
    (tmp_path / "elsewhere").mkdir()
    far = sd.write_case(read.mechanism, tmp_path / "elsewhere" / "again.toml")
    assert f'law = "{tmp_path}/mine.py:Rubber"' in far.read_text(encoding="utf-8")
    for path in (tmp_path / "again.toml", far):
        assert to_plain(sd.read_case(path).mechanism) == to_plain(read.mechanism)
    (tmp_path / "mine.py").write_text(MINE + "\n", encoding="utf-8")
    with pytest.raises(sd.InputError, match="has changed since"):
        sd.case_text(read.mechanism)


def test_relative_file_becomes_absolute(case, tmp_path, monkeypatch):
    """Contract: a file given relative to the working folder is written with its absolute path."""
    monkeypatch.chdir(tmp_path)
    arm = sd.scissor(units=1).with_clearance("A", sd.Clearance(1e-4, stiffness=sd.law("stiffness", "mine.py:Rubber")(1e7)))
    written = sd.read_case(sd.write_case(arm, "own.toml")).mechanism
    assert type(written.joint("A").clearance.stiffness).origin[0] == f"{tmp_path / 'mine.py'}:Rubber"
    assert written.replace("A.stiffness", arm.joint("A").clearance.stiffness) == arm


def test_class_imported_in_python(case, tmp_path, monkeypatch):
    """Contract: an imported class is known by its file, so that its runs can be repeated and its cases written."""
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delitem(sys.modules, "mine", raising=False)
    import mine

    arm = sd.read_case(case).mechanism
    own = arm.replace("A.friction", mine.TwoBristles(kinetic=0.2)).replace("components", ())
    assert 'law = "mine.py:TwoBristles"' in sd.case_text(own) or f'law = "{tmp_path}/mine.py:TwoBristles"' in sd.case_text(own)
    run = sd.simulate(own.controlled(mine.FilteredRate(4e4)), until=1e-3, samples=3)
    again = sd.replay(run, allow_code=tmp_path / "mine.py")
    np.testing.assert_array_equal(again["friction_force"], run["friction_force"])


def test_class_in_no_file(tmp_path):
    """Contract: for a class of a program or notebook, saving a run and writing a case say what to do."""

    def force(slip_speed, normal_force):
        return 0.1 * normal_force * slip_speed / (abs(slip_speed) + 1e-3)

    @sd.element(slot="friction", force=force)
    class Smooth:
        """Smooth friction."""

    arm = sd.scissor(units=1).driven(speed=1.0).with_clearance("A", sd.Clearance(2e-4, friction=Smooth()))
    with pytest.raises(sd.InputError, match=r"friction law: its class 'Smooth' is not in a file.*from mine import Smooth"):
        sd.case_text(arm)
    run = sd.simulate(arm, until=1e-3, samples=3)
    with pytest.warns(
        UserWarning, match=r"cannot be run again: its class 'test_class_in_no_file.*Smooth' is not defined in a file"
    ) as told:
        saved = sd.save(run, tmp_path / "run.nc")
    assert "\n" not in str(told[0].message)
    loaded = sd.load(saved)
    assert sd.contact_statistics(loaded) is not None
    with pytest.raises(sd.InputError, match=r"the Python class '.*Smooth' as a friction law, which is not in a file"):
        sd.replay(loaded)


def test_checkpoint_depends_on_the_code(case, tmp_path):
    """Contract: a checkpoint is used until the user's file is edited, and refused afterwards."""
    checkpoint = sd.Checkpoint(tmp_path / "run.checkpoint", keep=True)
    read = sd.read_case(case)
    options = {**read.run.keywords, "until": 2e-3}
    run = sd.simulate(read.mechanism, **options, checkpoint=checkpoint)
    again = sd.simulate(sd.read_case(case).mechanism, **options, checkpoint=checkpoint)
    np.testing.assert_array_equal(again["friction_force"], run["friction_force"])
    (tmp_path / "mine.py").write_text(MINE.replace("2.0 * soft", "2.1 * soft"), encoding="utf-8")
    with pytest.raises(sd.InputError, match="belongs to another run"):
        sd.simulate(sd.read_case(case).mechanism, **options, checkpoint=checkpoint)


def test_batches_and_processes(case):
    """Identity: the cases of a batch equal single runs, in threads and in other processes."""
    read = sd.read_case(case)
    kinetic, options = [0.1, 0.3], {"until": 4e-3, "start": "in-contact"}
    singles = [sd.simulate(read.mechanism.replace("A.friction.kinetic", value), **options) for value in kinetic]
    batch = sd.simulate_many(read.mechanism, {"A.friction.kinetic": kinetic}, **options)
    largest = [run["peak_force"].max() for run in singles]
    np.testing.assert_array_equal(batch["peak_force"].sel(joint="A").values, largest)

    def largest_friction(mechanism):  # of no module, which a worker would have to load
        found = compute_results(mechanism, sd.Options(1e-3, samples=11, start="in-contact"))
        return float(np.nanmax(found["friction_force"].values))

    with sd.Processes(1) as engine:
        (outcome,) = outcomes(engine, largest_friction, [read.mechanism])
    assert outcome.error is None
    assert outcome.value == largest_friction(read.mechanism) > 0.0


def test_fields_of_the_explorer(case, tmp_path):
    """Contract: parameters of user-defined elements are fields of the explorer, with units, and can be changed."""
    opened = open_case(case, [tmp_path / "mine.py"])
    fields = opened.fields
    for key, unit in (
        ("component.0.stiffness", "N/m"),
        ("clearance.0.friction.stiff", "1/m"),
        ("clearance.0.damping.loss", "1"),
        ("clearance.0.stiffness.stiffness", "N/m"),
        ("control.0.controller.damping", "N m s/rad"),
    ):
        assert fields[key].quantity.unit == unit, key
        assert fields[key].quantity.help
    new = opened.changed(
        {"clearance.0.damping.loss": "0.3", "component.0.stiffness": "20 N/m", "clearance.0.friction.soft": "3e4 1/m"}
    )
    clearance = new.mechanism.joint("A").clearance
    assert (clearance.damping.loss, clearance.friction.soft, clearance.friction.kinetic) == (0.3, 3e4, 0.2)
    assert new.mechanism.components[0].stiffness == 20.0
    run = sd.simulate(opened.mechanism, until=1e-3, samples=3)
    sd.save(run, tmp_path / "run.nc")
    again = open_case(tmp_path / "run.nc", [tmp_path / "mine.py"]).fields
    assert any(key.endswith("friction.soft") for key in again)


def test_commands(case, tmp_path, capsys, monkeypatch):
    """Contract: `check`, `laws` and `controllers` accept a class in a file as one of the package."""
    monkeypatch.chdir(tmp_path)
    assert status_of(["check", "case.toml"]) == 0
    assert status_of(["laws", "mine.py:TwoBristles", "--plot", "law.png"]) == 0
    assert status_of(["controllers", "mine.py:FilteredRate"]) == 0
    said = capsys.readouterr().out
    assert "Internal states: short, long." in said
    assert "filter_time" in said
    assert (tmp_path / "law.png").stat().st_size > 1000
    assert sd.law("friction", "mine.py:TwoBristles")().kinetic == 0.1
    assert sd.controller("mine.py:FilteredRate")(1.0).filter_time == 0.01


def test_steady_sliding_without_a_kernel_for_it(case, tmp_path):
    """Closed form: a law with states and no kernel of steady sliding settles at mu_k."""
    from scissordyn.laws.experiment import steady_coefficient
    from scissordyn.plot.law import DEFAULT_JOINT

    law = sd.law("friction", f"{tmp_path}/mine.py:TwoBristles")
    np.testing.assert_allclose(steady_coefficient(law(kinetic=0.3), DEFAULT_JOINT, [1e-6, 1e-3, 1.0]), 0.3, rtol=1e-9)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"slot": "frictoin"}, r"unknown slot 'frictoin' of an element \(did you mean 'friction'\?\)"),
        ({"slot": "stiffness", "states": (sd.State("z", "m", scale=1.0),)}, r"stiffness law 'Own' cannot have internal states"),
        ({"slot": "friction", "states": (sd.State("z", "m"),)}, r"state 'z' has no unit or no error scale"),
        ({"slot": "friction", "states": ("z",)}, r"state 'z' has no unit or no error scale"),
        ({"slot": "friction", "froce": 1}, r"unknown keyword 'froce' of a friction law \(did you mean 'force'\?\)"),
    ],
)
def test_wrong_declaration(options, message):
    """Contract: a wrong declaration is refused where the class is defined, in one line."""

    def force():
        return 0.0

    with pytest.raises(sd.InputError, match=message):
        sd.element(force=force, **options)(type("Own", (), {}))


def test_kernel_with_an_unknown_argument():
    """Contract: an argument that is neither an input, a state nor a parameter is refused with the nearest name."""

    def force(slip_sped):
        return 0.0

    with pytest.raises(
        sd.InputError, match=r"its kernel 'force' has the unknown argument 'slip_sped' \(did you mean 'slip_speed'\?\)"
    ):
        sd.element(slot="friction", force=force)(type("Own", (), {}))


def test_class_of_another_slot(case):
    """Contract: a controller given as a friction law is refused in one line."""
    case.write_text(CASE.replace("mine.py:TwoBristles", "mine.py:FilteredRate"), encoding="utf-8")
    with pytest.raises(sd.InputError, match=r"FilteredRate' is not a friction law"):
        sd.read_case(case)


def test_pulling_stiffness_is_refused_before_a_run():
    """Contract: a user-defined stiffness that pulls is refused before the run, in one line."""

    @sd.element(slot="stiffness", force=lambda indentation: -1e7 * indentation)
    class Own:
        """A law."""

    arm = sd.scissor(units=1).driven(speed=1.0).with_clearance("A", sd.Clearance(2e-4, stiffness=Own()))
    with pytest.raises(
        sd.InputError, match=r"stiffness law 'own' gives -2000.0 at indentation = 0.0002; expected a push at one"
    ):
        sd.simulate(arm, until=1e-3)
