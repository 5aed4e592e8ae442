"""Every face of every component comes from its file: table, variables, check, picture, film, page, and class in Python.

The examples of docs/components.md are the case files: the first block is a whole case, each other one is added to it.
"""

from __future__ import annotations

import dataclasses
import inspect
import re
import subprocess
import sys
from typing import Any

import numpy as np
import pytest
import xarray as xr

import scissordyn as sd
from scissordyn.components.catalogue import COMPONENTS
from scissordyn.components.port import ACTUATOR, LINE, PORTS
from scissordyn.config.template import template
from scissordyn.plot.animation import Film
from scissordyn.plot.animation_scene import picture_corners, scene_of
from scissordyn.plot.canvas import page as film_page
from scissordyn.plot.still import structure
from scissordyn.plot.symbol import symbols
from scissordyn.record.placement import Placement

from .page import PAGE, SECTIONS, heading, outputs, parts, snippets
from .shared import assert_documented, checked, read

# Case file at the start of the documentation page, to which tables are appended
BASE = snippets(PAGE.read_text(encoding="utf-8"))[0]

# Python file with a user-defined component of ten lines
TEN_LINES = '''
from typing import Annotated
import scissordyn as sd

@sd.component(port="hinge", force=lambda angle, speed, drag: (-drag * speed * abs(speed), 0.0, drag * abs(speed) ** 3))
class Paddle:
    """A paddle in a fluid."""
    name: str
    body: str
    base: str = "ground"
    drag: Annotated[float, sd.Quantity("N m s^2/rad^2", minimum=0.0, help="of the square of the speed")] = 0.1
'''


def example(section: str) -> str:
    """Return the case file of the example of a component."""
    (own,) = [text for text in snippets(parts()[heading(section)]) if f"[[{section}]]" in text]
    return BASE + "\n" + own


def run_of(mechanism: sd.Mechanism) -> xr.Dataset:
    """Return a short run of a mechanism."""
    run = sd.simulate(mechanism, until=0.1, samples=11)
    assert run.attrs["status"] == "complete", run.attrs["cause"]
    return run


def assert_drawn(run: xr.Dataset, mechanism: sd.Mechanism, name: str, strokes: int) -> None:
    """Check that a symbol is in a picture, a film and the film's page, with its name, and not outside the frame."""
    axes = structure(run, mechanism, times=[float(run["time"][3])])[0]
    assert name in [text.get_text() for text in axes.texts]
    placed = Placement.at(mechanism, run, [3])
    low, high = picture_corners(placed)
    (drawn,) = [symbol for symbol in symbols(run, mechanism, placed, [3], 0.03) if symbol.name == name]
    assert len(drawn.strokes) >= strokes
    for stroke in drawn.strokes:
        assert np.all(np.isfinite(stroke))
        assert np.all((stroke > low - 0.1) & (stroke < high + 0.1))
    scene = scene_of(run, mechanism, np.array([0, 3, 10]), [])
    assert sum(shape.name == name for shape in scene.shapes) == len(drawn.strokes)
    Film(scene, 10.0).show(2)
    assert f'"name":"{name}"' in film_page(scene, run, 10.0)


@pytest.mark.parametrize("section", SECTIONS)
def test_every_face_of_a_component(section, tmp_path, capsys):
    """Contract: the example of its page is read, checked, run, documented in the Dataset, saved, run again and drawn."""
    declared = COMPONENTS[section].declaration
    text = example(section)
    mechanism = read(tmp_path, text)
    held = (*mechanism.components, *mechanism.rods, *mechanism.latches)
    own = [(type(part), part.name) for part in held if not isinstance(part, sd.FlexibleBar)]  # of a bar that it runs along
    assert own == [(COMPONENTS[section], "example")]
    assert f"{declared.label.capitalize()} example." in checked(tmp_path, text, capsys)
    run = run_of(mechanism)
    names = dict(re.findall(r"`(\w+)` \[([^]]+)\]", outputs(section)))
    names |= {f"{name}_time": "s" for name in names if "_peak_" in name}
    assert_documented(run, names)
    made = {name for name in run.variables if str(name) == section or str(name).startswith(f"{section}_")}
    assert made - {"motor_work"} == {section, *names}  # the work of all motors belongs to the energy balance
    assert all(run[name].dims[0] == "time" or "_peak_" in name for name in names)
    again = sd.replay(run)
    for name in names:
        np.testing.assert_array_equal(again[name], run[name])
    assert_drawn(run, mechanism, "example", len(declared.port.symbols[declared.symbol]))


@pytest.mark.parametrize("section", SECTIONS)
def test_its_page_and_its_table(section):
    """Contract: `sd` has the class, the printed case file its table, the page the table of its declaration and a source."""
    text, kind = parts()[heading(section)], COMPONENTS[section]
    assert getattr(sd, kind.__name__) is kind
    assert f"# [[{section}]]" in template("mechanism")
    assert f"<!-- made from declarations: component {section} -->\n| key |" in text
    assert "\nSource: " in text
    assert f"| `{kind.__name__}` |" in PAGE.read_text(encoding="utf-8")
    assert "References\n----------\n" in inspect.cleandoc(kind.__doc__ or "")


def test_every_symbol_of_every_port_has_strokes():
    """Contract: lines of two points or more, with the part of the distance first on a line; an arrow follows its force."""
    for port in (*PORTS.values(), ACTUATOR):
        for name, strokes in port.symbols.items():
            assert (len(strokes) == 0) == (name == "arrow")
            assert all(len(stroke) > 1 and stroke.shape[1] == (3 if port is LINE else 2) for stroke in strokes), name


def test_a_new_component_has_every_face(tmp_path, capsys):
    """Contract: ten lines in a file, and nothing else, make a table, a line of check, variables, and a picture."""
    (tmp_path / "paddle.py").write_text(TEN_LINES, encoding="utf-8")
    text = BASE + '\n[[component]]\ntype = "paddle.py:Paddle"\nname = "oar"\nbody = "crank"\ndrag = "0.2 N m s^2/rad^2"\n'
    mechanism = read(tmp_path, text)
    assert "Paddle oar." in checked(tmp_path, text, capsys)
    run = run_of(mechanism)
    assert_documented(run, {"paddle_torque": "N m", "paddle_angle": "rad", "paddle_energy": "J", "paddle_peak_torque": "N m"})
    speed = run["angular_velocity"].sel(body="crank")
    np.testing.assert_allclose(run["paddle_torque"].sel(paddle="oar"), -0.2 * speed * abs(speed), rtol=1e-12, atol=1e-15)
    assert_drawn(run, mechanism, "oar", 1)
    space: dict[str, Any] = {"__name__": __name__}
    exec(compile(TEN_LINES, str(tmp_path / "paddle.py"), "exec", dont_inherit=True), space)
    handed = dataclasses.replace(mechanism, components=(space["Paddle"]("oar", "crank", drag=0.2),))
    np.testing.assert_array_equal(run_of(handed)["paddle_torque"], run["paddle_torque"])


def test_the_page_s_own_component(tmp_path, capsys):
    """Contract: the page's component of a user's own does what the page says, in a process that imports nothing else."""
    text = parts()["User-defined components"]
    (code,), (added,) = snippets(text, "python"), snippets(text)
    (tmp_path / "rubber.py").write_text(code, encoding="utf-8")
    mechanism = read(tmp_path, BASE + "\n" + added)
    assert "Rubber band band." in checked(tmp_path, BASE + "\n" + added, capsys)
    run = run_of(mechanism)
    for name in ("force", "length", "energy", "peak_force"):
        assert f"rubber_band_{name}" in text
        assert f"rubber_band_{name}" in run
    stretch = run["rubber_band_length"] - 0.1
    np.testing.assert_allclose(run["rubber_band_force"], 900.0 * stretch**3, rtol=1e-12)
    found = subprocess.run([sys.executable, "rubber.py"], cwd=tmp_path, capture_output=True, text=True, check=False, timeout=60)
    assert (found.returncode, found.stderr) == (0, "")
