"""Bifurcation diagrams."""

import numpy as np
import pytest
from tests.build import warnings_of

import scissordyn as sd
from scissordyn.cli.response import bifurcation as command
from scissordyn.periodic.bifurcation import transfer_state
from scissordyn.periodic.stroboscope import run_cycles
from scissordyn.plot.regularity import bifurcation as draw

CLEARANCES = (0.1e-3, 0.3e-3, 0.5e-3)  # [m] values of the clearance in a diagram
TIMES = {"seconds", "processor_seconds"}  # Attributes that differ between equal computations

# Case file with a periodic drive
CASE = """
[structure]
kind = "scissor"
angle = "45 deg"
[drive]
harmonic = { mean = "45 deg", amplitude = "10 deg", angular_frequency = "8 Hz" }
[[clearance]]
joint = "A"
clearance = "0.5 mm"
friction = "none"
[run]
until = "1 s"
"""


def assert_same(one, other):
    """Compare two diagrams bit for bit, except the computing times."""
    assert set(one) == set(other)
    for name in set(one) - TIMES:
        np.testing.assert_array_equal(one[name].values, other[name].values, err_msg=str(name))


@pytest.fixture(scope="module")
def diagram(impacting):
    """Return a diagram of three values, computed in this process."""
    return sd.bifurcation(impacting, over="A.clearance", values=CLEARANCES, cycles=4, keep=2, engine=1)


def test_each_value_is_a_run(impacting, diagram):
    """Identity: each value has the last cycles of `cycle`, bit for bit."""
    assert diagram.sizes["value"] == 3
    assert diagram["value"].attrs["units"] == "m"
    assert set(diagram["status"].values) == {"complete"}
    for k, clearance in enumerate(CLEARANCES):
        run = sd.cycle(impacting.replace("A.clearance", clearance), cycles=4, keep=2)
        for name in ("slider_velocity", "eccentricity", "impacts", "peak_force", "cycle"):
            row = diagram[name] if name == "cycle" else diagram[name].isel(value=k)
            np.testing.assert_array_equal(row.values, run[name].values)
        assert str(diagram["warnings"].values[k]) == "\n".join(warnings_of(run))


def test_warnings(diagram):
    """Contract: a warning of several values appears once among those of the diagram, with the first value."""
    said = [str(text) for text in diagram["warnings"].values]
    assert all("contacts start faster than" in text for text in said[1:])
    (warning,) = (text for text in warnings_of(diagram) if "contacts start faster than" in text)
    first = next(k for k, text in enumerate(said) if "contacts start faster than" in text)
    assert warning == f"A.clearance = {CLEARANCES[first]:g} m, the first of {3 - first} values: {said[first].splitlines()[0]}"


def test_two_threads_give_the_same(impacting, diagram):
    """Identity: two threads give the same diagram, bit for bit."""
    assert_same(sd.bifurcation(impacting, over="A.clearance", values=CLEARANCES, cycles=4, keep=2, engine=2), diagram)


def test_interrupted_diagram_is_continued(impacting, diagram, tmp_path):
    """Contract: Ctrl-C after the first value keeps it in the store; a second call computes only the others."""
    store, asked = tmp_path / "diagram.nc", {"values": CLEARANCES, "cycles": 4, "keep": 2, "engine": 1}

    def stop(done, total):
        raise KeyboardInterrupt

    partial = sd.bifurcation(impacting, over="A.clearance", store=store, progress=stop, **asked)
    assert partial.attrs["status"] == "interrupted"
    assert sd.load(store)["status"].values.tolist() == ["complete", "pending", "pending"]
    seen = []
    whole = sd.bifurcation(impacting, over="A.clearance", store=store, progress=lambda *count: seen.append(count), **asked)
    assert seen == [(2, 3), (3, 3)]
    assert_same(whole, diagram)
    assert_same(sd.load(store), diagram)
    assert float(whole["seconds"][0]) == float(partial["seconds"][0])
    assert [path.name for path in tmp_path.iterdir()] == ["diagram.nc"]
    with pytest.raises(sd.InputError, match="another diagram"):
        sd.bifurcation(impacting, over="A.clearance", store=store, **{**asked, "cycles": 5})
    with pytest.raises(sd.InputError, match="another diagram"):
        sd.bifurcation(impacting.replace("gravity", 1.0), over="A.clearance", store=store, **asked)


def test_following(impacting):
    """Contract: with `follow` each value continues from the end of the previous one."""
    chain = sd.bifurcation(impacting, over="A.clearance", values=CLEARANCES[::-1], cycles=3, keep=3, follow=True)
    mechanisms = [impacting.replace("A.clearance", clearance) for clearance in CLEARANCES[::-1]]
    options = cycle_options(impacting)
    found = run_cycles(mechanisms[0], options, cycles=3)
    for k in (1, 2):
        found = run_cycles(mechanisms[k], options, cycles=3, start=transfer_state(mechanisms[k - 1], found.end, mechanisms[k]))
        np.testing.assert_array_equal(chain["peak_force"].values[k], found.values["peak_force"])
    alone = sd.bifurcation(impacting, over="A.clearance", values=CLEARANCES[::-1], cycles=3, keep=3, engine=1)
    assert not np.array_equal(chain["peak_force"].values[1], alone["peak_force"].values[1])


def cycle_options(mechanism):
    """Return options as `bifurcation` makes them."""
    from scissordyn.model.options import Options
    from scissordyn.run.stops import drive_period

    return Options(drive_period(mechanism), samples=2, rtol=1e-6, atol=1e-6, most_steps=1_000_000)


def test_interrupted_following_is_continued(impacting, tmp_path):
    """Contract: a diagram with `follow` continues from the stored end of the previous value."""
    asked = {"values": CLEARANCES, "cycles": 2, "keep": 2, "follow": True}
    whole = sd.bifurcation(impacting, over="A.clearance", **asked)

    def stop(done, total):
        raise KeyboardInterrupt

    for _ in range(2):
        sd.bifurcation(impacting, over="A.clearance", store=tmp_path / "chain.nc", progress=stop, **asked)
    assert_same(sd.bifurcation(impacting, over="A.clearance", store=tmp_path / "chain.nc", **asked), whole)


def test_transferred_state(frictional):
    """Identity: a transfer to the same mechanism changes nothing; to a wider clearance only the contact opens."""
    options = cycle_options(frictional)
    end = run_cycles(frictional, options, cycles=2).end
    same = transfer_state(frictional, end, frictional)
    np.testing.assert_allclose(same.y, end.y, rtol=1e-12)
    assert (same.mode.tolist(), same.arrays["memory"].tolist()) == (end.mode.tolist(), end.arrays["memory"].tolist())
    wider = transfer_state(frictional, end, frictional.replace("A.clearance", 1e-3))
    np.testing.assert_allclose(wider.y, end.y, rtol=1e-12)
    assert end.mode.tolist() == [1]
    assert wider.mode.tolist() == [0]


def test_values_that_fail(impacting):
    """Contract: failed values have a cause and NaN, and do not affect the others."""
    found = sd.bifurcation(impacting, over="A.clearance", values=CLEARANCES, cycles=2, keep=1, most_steps=900, engine=1)
    states = found["status"].values.tolist()
    assert "failed" in states
    assert "complete" in states
    for k, state in enumerate(states):
        assert np.isnan(found["peak_force"].values[k]).all() == (state == "failed")
        assert ("are not enough" in found["cause"].values[k]) == (state == "failed")
    assert found.attrs["failed_values"] == states.count("failed")


def test_drive_and_function(impacting):
    """Contract: the period follows the frequency of the drive; a function of the value is equal to a path."""
    frequencies = (40.0, 60.0)
    one = sd.bifurcation(impacting, over="drive.angular_frequency", values=frequencies, cycles=2, keep=2, engine=1)
    np.testing.assert_allclose(one["period"], 2.0 * np.pi / np.array(frequencies), rtol=1e-15)

    def faster(value):
        return impacting.replace("drive.angular_frequency", value)

    assert_same(sd.bifurcation(impacting, over=faster, values=frequencies, cycles=2, keep=2, engine=1), one)


def test_refused_diagrams(impacting):
    """Contract: wrong arguments are refused in one line."""
    for options, words in (
        ({"values": ()}, "values that are empty"),
        ({"values": (1e-4,), "keep": 300}, "keep = 300"),
        ({"values": (1e-4,), "cycles": 0}, "cycles = 0"),
        ({"values": (-1e-4,)}, "clearance = -0.0001"),
        ({"values": (1e-4,), "engine": "two"}, r"engine = 'two'.*engine=2"),
    ):
        with pytest.raises(sd.InputError, match=words):
            sd.bifurcation(impacting, over="A.clearance", **{"cycles": 2, "keep": 1, **options})


def test_command(tmp_path, capsys):
    """Contract: the command writes file and picture; a value without a unit is refused."""
    case = tmp_path / "case.toml"
    case.write_text(CASE)
    asked = {"points": 2, "cycles": 2, "threads": 1, "output": tmp_path / "d.nc", "plot": tmp_path / "d.png"}
    assert command(case, "A.clearance", "0.1 mm", "0.3 mm", **asked) == 0
    shown = capsys.readouterr()
    assert "2 of 2 values of A.clearance complete, 4 cycles" in shown.out
    np.testing.assert_allclose(sd.load(tmp_path / "d.nc")["value"], (1e-4, 3e-4), rtol=1e-15)
    assert (tmp_path / "d.png").stat().st_size > 5000
    assert sd.load(tmp_path / "d.nc")["value"].attrs["shown_unit"] == "mm"
    assert command(case, "drive.angular_frequency", "150 rpm", "180 rpm", **asked | {"output": tmp_path / "rpm.nc"}) == 0
    assert "Warning: drive.angular_frequency = 150 rpm" in capsys.readouterr().out
    diagram = sd.load(tmp_path / "rpm.nc")
    np.testing.assert_allclose(diagram["value"], (5.0 * np.pi, 6.0 * np.pi), rtol=1e-14)
    (axes,) = draw(diagram)
    assert axes.get_xlabel().endswith("[rpm]")
    np.testing.assert_allclose(np.unique(axes.lines[0].get_xdata()), (150.0, 180.0), rtol=1e-14)
    for wrong, words in (("0.1", "missing unit"), ("0.1 s", "wrong dimension"), ("-1 mm", "out of bounds")):
        with pytest.raises(sd.InputError, match=words):
            command(case, "A.clearance", wrong, "0.3 mm", points=2, cycles=2)
