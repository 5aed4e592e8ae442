"""The three user-defined elements of the how-to page, compared with those of the package, in a case file and in a run."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

import scissordyn as sd
from scissordyn.cli.main import status_of

# Text of the page about user-defined elements
PAGE = (Path(__file__).parents[2] / "docs" / "howto" / "own_elements.md").read_text(encoding="utf-8")


@pytest.fixture
def case(tmp_path):
    """Write the page's files and its case."""
    for name, code in re.findall(r"^```python\n# (\w+\.py)\n(.*?)^```", PAGE, re.MULTILINE | re.DOTALL):
        (tmp_path / name).write_text(code, encoding="utf-8")
    (only,) = re.findall(r"^```toml\n(.*?)^```", PAGE, re.MULTILINE | re.DOTALL)
    (tmp_path / "case.toml").write_text(only, encoding="utf-8")
    return tmp_path / "case.toml"


def test_case_of_the_page(case, capsys):
    """Cross-check: the user's elements give the motion of the package's; the saved run is run again from the files."""
    assert status_of(["check", str(case)]) == 0
    assert "my clutch brake." in capsys.readouterr().out.lower()
    read = sd.read_case(case)
    run = sd.simulate(read.mechanism, **read.run.keywords)
    assert run.attrs["status"] == "complete"
    law = sd.law("friction", "maxwell-slip")(kinetic=0.1)
    brake = sd.Clutch("brake", "unit 1/bar 1", 20.0, base="unit 1/bar 2", yield_angle=sd.degrees(0.2))
    arm = read.mechanism.replace("A.friction", law)
    (servo,) = (part for part in arm.components if part.name != "brake")
    (old,) = (part for part in arm.components if part.name == "brake")
    own = arm.replace(f"{servo.name}.controller", sd.controller("filtered-pd")(4e4, 3000.0))
    parts = tuple(brake if part == old else part for part in own.components)
    other = sd.simulate(own.replace("components", parts), **read.run.keywords)
    assert float(abs(other["clutch_load"]).max()) > 1e-3
    np.testing.assert_allclose(run["my_clutch_load"].values, other["clutch_load"].values, atol=1e-9)
    np.testing.assert_allclose(run["filtered"].values, other["filtered_rate"].values, atol=1e-7)
    np.testing.assert_allclose(run["position"], other["position"], atol=1e-9)
    again = sd.replay(run, allow_code=[case.parent / name for name in ("clutch.py", "bristles.py", "filtered.py")])
    np.testing.assert_array_equal(again["first"], run["first"])


def test_line_counts_of_the_page():
    """Contract: the page gives the numbers of lines of its files and of the package's."""
    code = dict(re.findall(r"^```python\n# (\w+\.py)\n(.*?)^```", PAGE, re.MULTILINE | re.DOTALL))
    for name, lines in re.findall(r"^\| .* \| `(\w+\.py)` \| (\d+) \| \d+ \|$", PAGE, re.MULTILINE):
        assert len([line for line in code[name].splitlines() if line.strip()]) == int(lines), name
    source = Path(sd.__file__).parent
    for name, lines in re.findall(r"^\| .*? \| `([\w/]+\.py)`, its test.*? \| (\d+) \| \d+ \| \d+ \|$", PAGE, re.MULTILINE):
        assert len((source / name).read_text(encoding="utf-8").splitlines()) == int(lines), name


DRAG, ENGAGES, RELEASES = 0.5, 4.0, 3.0  # Drag [N m s/rad], and speeds at which the brake engages and releases [rad/s]


def engaged(angle, speed, mode, drag, engages, releases):
    """Return the gap and its direction, as on the page."""
    threshold = engages if mode == 0.0 else releases
    return speed - threshold, 1.0 if mode == 0.0 else -1.0


def dragging(angle, speed, mode, drag, engages, releases):
    """Return a viscous torque while engaged."""
    torque = drag * speed if mode == 1.0 else 0.0
    return -torque, 0.0, torque * speed


@sd.component(port="hinge", force=dragging, gap=engaged, context=("mode",), events=("released", "engaged"))
class Centrifugal:
    """A brake that engages above a speed."""

    name: str
    body: str
    drag: float = DRAG
    engages: float = ENGAGES
    releases: float = RELEASES
    base: str = "ground"

    def parameters(self, start):
        """Return the drag and both thresholds."""
        return self.drag, self.engages, self.releases


@pytest.mark.parametrize("method", ["dop853", "rodas5p"])
def test_guard_on_a_speed(method):
    """Closed form: under a torque of 4 sin t the brake engages and releases at the speeds of two linear phases."""
    inertia, amplitude = 0.5, 4.0
    rotor = sd.Body("rotor", 1.0, inertia, {"hub": (0.0, 0.0)})
    pin = sd.Revolute("pin", ("rotor", "hub"), ("ground", "O"))
    push = sd.Torque("push", "rotor", amplitude, time_function=sd.Harmonic(0.0, 1.0, 1.0))
    parts = (Centrifugal("brake", "rotor"), push)
    mechanism = sd.Mechanism((rotor,), joints=(pin,), ground=(("O", (0.0, 0.0)),), components=parts, input_body="rotor")
    run = sd.simulate(mechanism, until=6.0, method=method, samples=601, rtol=1e-10, atol=1e-11)
    brake = run["event_name"].values == "brake"
    assert run["event_kind"].values[brake].tolist() == ["engaged", "released"]
    first, second = run["event_time"].values[brake]
    # free: I w' = A sin t from rest; engaged: I w' = A sin t - d w
    assert amplitude / inertia * (1.0 - np.cos(first)) == pytest.approx(ENGAGES, abs=1e-8)
    rate = DRAG / inertia
    forced = lambda t: amplitude / inertia * (rate * np.sin(t) - np.cos(t)) / (1.0 + rate * rate)  # noqa: E731
    speed = forced(second) + (ENGAGES - forced(first)) * np.exp(-rate * (second - first))
    assert speed == pytest.approx(RELEASES, abs=1e-8)
