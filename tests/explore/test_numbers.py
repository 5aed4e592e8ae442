"""Every number on the page is of one run, however fast numbers are changed."""

import base64
import json
import random
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial import KDTree

import scissordyn as sd

from .browser import Tab, served

PAPER = Path(__file__).parents[2] / "examples" / "paper.toml"  # Case file of the paper's array
KEY = "clearance.0.clearance"  # Key of the clearance in the explorer

LOOK = """() => {
  const parts = ["#sd-canvas canvas", ".sd-contacts", ".sd-state", "#sd-curves"].map(wanted => document.querySelector(wanted));
  window.numbers = () => parts.map(each => Number(each.dataset.run));
  [window.looked, window.mixed] = [0, []];
  const look = () => {
    window.looked++;
    if (new Set(window.numbers()).size > 1) window.mixed.push(window.numbers());
    requestAnimationFrame(look);
  };
  look();
}"""
"""JavaScript function that compares the run numbers of drawing, table, bar and curves before each frame."""

# JavaScript function that returns the curves and texts of the page
SHOWN = """() => {
  const { figures, orbit, horizon, bar, scene } = window.scissordyn.shown;
  const line = ({ label, x, y, style }) => ({ label, x: Array.from(x), y: Array.from(y), style });
  const plain = figure => ({ ...figure, lines: figure.lines.map(line) });
  return { figures: figures.map(plain), orbit: plain(orbit), horizon, bar, scene };
}"""

LINES = {
    ("output", ""): ("slider_position", ""),
    ("slip", ""): ("slip_speed", "A"),
    ("force", "friction"): ("friction_force", "A"),
    ("force", "force"): ("", "A"),
    ("torque", "driving torque"): ("drive_torque", ""),
    ("energy", "kinetic"): ("kinetic_energy", ""),
    ("energy", "potential"): ("potential_energy", ""),
    ("energy", "drives"): ("drive_work", ""),
    ("loss", ""): ("dissipated_energy", ""),
}
"""Variable and joint that each line of a figure shows, by figure and label of the line."""

PREFIX = {"m": 1e3, "k": 1e-3, "M": 1e-6, "µ": 1e6}  # Factors by which numbers are larger with a unit prefix, by prefix


@pytest.fixture(scope="module")
def tab(browser):
    """Yield the page of the paper's case."""
    with served(PAPER) as url:
        opened = Tab(browser, url, size=(1280, 800))
        yield opened
        opened.close()


def factor(unit):
    """Return the factor from SI to a unit of the page."""
    return PREFIX[unit[0]] if len(unit) > 1 and unit[0] in PREFIX and unit not in ("m", "m/s") else 1.0


def floats(text):
    """Unpack numbers of the drawing."""
    return np.frombuffer(base64.b64decode(text), np.float32)


def compare(tab, run, fine, number):
    """Compare all that the page shows with a run, whose curves may have the instants of contacts already."""
    shown = tab.page.evaluate(SHOWN)
    assert tab.page.evaluate("window.numbers()") == [number] * 4
    drawn = {(figure["name"], line["label"]): (figure["unit"], line) for figure in shown["figures"] for line in figure["lines"]}
    assert set(drawn) == set(LINES)
    for name, (variable, joint) in LINES.items():
        unit, line = drawn[name]
        time, curve = np.array(line["x"]), np.array(line["y"], float)
        at = np.searchsorted(time, 1e3 * run["time"].values * (1.0 - 1e-12))
        np.testing.assert_allclose(time[at], 1e3 * run["time"].values, rtol=1e-12)
        if variable:
            values = (run[variable].sel(joint=joint) if joint else run[variable]).values
        else:  # normal force and friction together
            values = np.hypot(*(run[part].sel(joint=joint).values for part in ("normal_force", "friction_force")))
        wanted = factor(unit) * values
        np.testing.assert_allclose(curve[at], wanted, rtol=1e-9, atol=1e-9 * np.abs(wanted).max(), err_msg=str(name))
    unit, force = drawn["force", "force"]
    assert max(force["y"]) == pytest.approx(factor(unit) * float(run["peak_force"].max()), rel=1e-9)
    orbit = shown["orbit"]["lines"][-1]
    _compare_orbit(np.array([orbit["x"], orbit["y"]], float).T, run, fine)
    assert shown["horizon"] is None
    _compare_table(tab.table(), run, number)
    statistics = json.loads(run.attrs["statistics"])
    assert tab.state.startswith("computed in ")
    detail = tab.page.locator(".sd-state").get_attribute("title")
    assert detail == f"{statistics['steps']} steps of {statistics['method']}"
    assert shown["bar"]["warnings"] == json.loads(run.attrs["warnings"])
    _compare_scene(json.loads(shown["scene"]), run)


def _compare_orbit(points, run, fine):
    """Check that an orbit has the points of the samples or of the fine run; a few may differ by rounding."""
    places = [1e3 * one["eccentricity"].sel(joint="A").transpose("time", "axis").values for one in (run, fine)]
    apart = KDTree(points).query(places[0])[0]
    assert apart.max() < 1e-9
    assert (KDTree(np.concatenate(places)).query(points)[0] > 1e-9).sum() <= 4


def _compare_table(table, run, number):
    assert table["run"] == number
    assert len(table["rows"]) == run.sizes["contact"]
    assert table["titles"][2:] == ["start [ms]", "approach [m/s]", "peak force [kN]", "duration [ms]", "rebound [m/s]"]
    names = ("contact_start", "approach_speed", "peak_force", "contact_duration", "rebound_speed")
    factors = (1e3, 1.0, 1e-3, 1e3, 1.0)
    for k, row in enumerate(table["rows"]):
        assert row[:2] == [str(k + 1), str(run["contact_joint"].values[k])]
        for text, name, scale in zip(row[2:], names, factors, strict=True):
            value = scale * float(run[name].values[k])
            assert text == ("-" if np.isnan(value) else text)
            decimals = len(text.partition(".")[2])
            assert np.isnan(value) or float(text) == pytest.approx(value, abs=0.501 * 10.0**-decimals)
            assert np.isnan(value) or decimals >= 2 - np.log10(abs(value))  # three digits or more
    assert table["seen"] == table["rows"][: len(table["seen"])]
    assert table["seen"]


def _compare_scene(scene, run):
    time = floats(scene["time"])
    np.testing.assert_allclose(time[-1], run["time"].values[-1], rtol=1e-6)
    frames = np.linspace(0, run.sizes["time"] - 1, time.size).round().astype(int)
    (joint,) = scene["joints"]
    journal = floats(joint["journal"]).reshape(-1, 2) * float(run["clearance"].sel(joint="A"))
    wanted = run["eccentricity"].sel(joint="A").transpose("time", "axis").values[frames]
    size = np.linalg.norm(wanted, axis=1).max()
    ratio = np.linalg.norm(journal, axis=1).max() / size  # of the drawn clearance
    np.testing.assert_allclose(journal / ratio, wanted, atol=1e-5 * size)
    assert floats(joint["force"]).max() == pytest.approx(float(run["peak_force"].max()), rel=1e-6)


@pytest.mark.parametrize("drags", [2, pytest.param(100, marks=pytest.mark.slow)])
def test_page_shows_one_run_however_it_is_dragged(tab, drags):
    """Cross-check: after each drag every number on the page is that of `run`, and no frame has two runs."""
    chance = random.Random(7)
    case = sd.read_case(PAPER)
    options = case.run.keywords
    tab.page.evaluate(LOOK)
    mouse = tab.page.mouse
    slider = tab.page.locator(f".sd-row[data-key='{KEY}'] input[type=range]").first
    for _ in range(drags):
        box, before = slider.bounding_box(), tab.run
        begin, end = (box["x"] + box["width"] * chance.uniform(0.3, 0.7) for _ in range(2))
        height = box["y"] + 0.5 * box["height"]
        mouse.move(begin, height)
        mouse.down()
        steps = chance.randint(4, 12)
        for step in range(steps):
            mouse.move(begin + (end - begin) * (step + 1) / steps, height)
            tab.page.wait_for_timeout(chance.uniform(5.0, 40.0))
        mouse.up()
        tab.page.wait_for_timeout(150.0)
        number = _settled(tab, before)
        clearance = float(tab.text(KEY).split()[0]) * 1e-3
        mechanism = case.mechanism.replace("A.clearance", clearance)
        run = sd.simulate(mechanism, **options)
        compare(tab, run, sd.simulate(mechanism, **options | {"samples": "auto"}), number)
    assert tab.page.evaluate("window.looked") > 10 * drags
    assert tab.page.evaluate("window.mixed") == []


SETTLED = """key => {
  const row = document.querySelector(`.sd-row[data-key='${key}']`), state = document.querySelector(".sd-state").dataset;
  return row.dataset.text === row.querySelector("input[type=text]").value && state.computing === "false"
    && state.ordered === state.run ? Number(state.run) : null;
}"""
"""JavaScript function that returns the number of the shown run; null until the run with the value in the form is shown."""


def _settled(tab, before):
    """Return the number of the run with the clearance in the form."""
    tab.ready(before)
    return int(tab.page.wait_for_function(SETTLED, arg=KEY, polling=50, timeout=60_000).json_value())
