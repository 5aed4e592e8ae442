"""Run the engines, each in an environment of its own, and write the page of their errors."""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from benchmarks.measure import machine, table

from validation.engines.convergence import COLUMNS, convergence
from validation.engines.picture import draw, sections, table_rows
from validation.engines.problem import CLEARANCE, Problem, problems
from validation.page import stamp

HERE = Path(__file__).parent
PAGE = HERE.parents[1] / "docs" / "decisions" / "measured" / "engines.md"
TIMEOUT = 600.0  # [s] for one problem and setting


class Engine(NamedTuple):
    """Engine, its pinned package, and what its settings are."""

    name: str
    package: str  # Requirement for pip, after "npm:" for npm, after "apt:" for Debian; "this:" is the running environment
    default: str = ""
    careful: str = ""  # Empty if there is nothing to choose
    reason: str = ""  # Reason why it is not run, if there is one


ENGINES = (
    Engine("mujoco", "mujoco==4.0.0", "2 ms, Euler, solref 20 ms", "0.1 ms, RK4, solref 0.2 ms (hole: 10 us, solref 3 ms)"),
    Engine("exudyn", "exudyn==1.13.6 numpy==2.4.6", "100 steps, generalised alpha", "0.1 ms, Newton 1e-10"),
    Engine("pymunk", "pymunk==7.3.1", "1/60 s, 10 iterations", "0.1 ms, 50 iterations, no slop"),
    Engine("box2d", "Box2D==2.3.10", "1/60 s, 8 and 3 iterations", "0.1 ms, 200 and 50 iterations, bullets"),
    Engine("planck", "npm:planck@1.4.2", "1/60 s, 8 and 3 iterations", "0.1 ms, 200 and 50 iterations, slop 1 um"),
    Engine("rapier", "npm:@dimforge/rapier2d-compat@0.21.0", "1/60 s, 4 iterations", "0.1 ms, 50 iterations, length unit 1 cm"),
    Engine("pybullet", "pybullet==3.2.7 numpy==1.26.4", "1/240 s, 50 iterations", "0.1 ms, 500 iterations, erp 1"),
    Engine("drake", "drake==1.51.1", "1 ms", "0.1 ms, rigid SAP (hole: 10 us)"),
    Engine("dart", "dartpy==6.20.0", "1 ms", "0.1 ms, error reduction 0.2"),
    Engine("pinocchio", "pin==4.1.0", "1 ms, semi-implicit Euler (ours)", "0.1 ms, RK4 (ours), Baumgarte 1 ms"),
    Engine("newton xpbd", "newton==1.8.0", "1/600 s, 2 iterations", "1 ms, 20 iterations"),
    Engine("newton kamino", "newton==1.8.0", "2.5 ms"),
    Engine("siconos", "apt:python3-siconos", "0.5 ms, theta 0.50001", "0.1 ms, theta 0.5, projection to 1e-10"),
    Engine("kimech", "kimech==0.7.0", "kinematics"),
    Engine("pylinkage", "pylinkage==1.3.0", "kinematics"),
    Engine("pyondsel", "pyondsel==0.0.3 numpy==2.4.6", "kinematics"),
    Engine("solvespace", "python-solvespace==3.0.8", "kinematics"),
    Engine("scissordyn", "this:", "defaults", "tolerance 1e-10 (hole: 10 us)"),
    Engine("chrono", "pychrono==1.1.0", reason="not Chrono: a library for delays and timers"),
)


def main(given: list[str]) -> int:
    """Print the table; with --write replace the page of measurements, with --draw its texts and pictures."""
    parser = argparse.ArgumentParser(prog="python -m validation engines", description="Compare engines on four mechanisms.")
    parser.add_argument("names", nargs="*", metavar="ENGINE", help="engines; all if left out")
    parser.add_argument("--folder", type=Path, help="keep the environments of the engines in this folder")
    parser.add_argument("--write", action="store_true", help="write the page; rows of engines that are not named stay")
    parser.add_argument("--draw", action="store_true", help="write texts and pictures of the page again, without runs")
    options = parser.parse_args(given)
    known = {engine.name: engine for engine in ENGINES}
    if unknown := [name for name in options.names if name not in known]:
        parser.error(f"unknown: {', '.join(unknown)}; expected {', '.join(known)}")
    if options.draw:
        if given != ["--draw"]:
            parser.error("--draw takes no other arguments")
        _write(rewritten())
        return 0
    wanted = problems()
    with tempfile.TemporaryDirectory() as temporary:
        folder = (options.folder or Path(temporary)).resolve()
        folder.mkdir(parents=True, exist_ok=True)
        for name, problem in wanted.items():
            (folder / f"{name.replace(' ', '-')}.json").write_text(json.dumps(problem))
        rows: dict[str, list[list[str]]] = {name: [] for name in wanted}
        for engine in [known[name] for name in options.names] or [engine for engine in ENGINES if not engine.reason]:
            command, failure = _install(engine, folder)
            for name, problem in wanted.items():
                for setting in ("default", "careful") if engine.careful else ("default",):
                    row = ["", "", "", "", failure] if failure else _measured(command, folder, name, setting, problem)
                    rows[name].append([engine.name, setting, *row])
                    print(name, *rows[name][-1], sep=" | ", flush=True)
        if options.write:
            _write(_page(_with_kept(rows), convergence(folder), stamp(machine())))
    return 0


def _install(engine: Engine, folder: Path) -> tuple[list[str], str]:
    """Return the command that runs an engine, and the reason if it cannot run."""
    if engine.reason:
        return [], engine.reason  # wanted by name
    file, *solver = engine.name.split()
    place = folder / file
    kind, _, package = engine.package.rpartition(":")
    if kind == "npm":
        place.mkdir(exist_ok=True)
        steps = [["npm", "install", "--silent", "--prefix", str(place), package]]
        for name in (f"run_{file}.mjs", "shared.mjs"):  # Node looks for packages next to the file
            (place / name).write_text((HERE / name).read_text())
        command = ["node", str(place / f"run_{file}.mjs")]
    elif kind in ("apt", "this"):
        python = "/usr/bin/python3" if kind == "apt" else sys.executable
        place.mkdir(exist_ok=True)
        steps = [[python, "-c", f"import {file}"]]
        command = [python, str(HERE / f"run_{file}.py")]
    else:
        python = str(place / "bin" / "python")
        steps = [[sys.executable, "-m", "venv", str(place)], [python, "-m", "pip", "install", "-q", *package.split()]]
        command = [python, str(HERE / f"run_{file}.py"), *solver]
    marker = place / "installed"
    for step in () if marker.exists() else steps:
        made = subprocess.run(step, capture_output=True, text=True, check=False)
        if made.returncode and kind == "apt":
            return [], f"needs `apt-get install --no-install-recommends {package}`"
        if made.returncode:
            return [], f"does not install: {(made.stderr.strip().splitlines() or ['no message'])[-1][:100]}"
    marker.touch()
    return command, ""


def _measured(command: list[str], folder: Path, name: str, setting: str, problem: Problem) -> list[str]:
    """Return gap, energy error, angle error and time of an engine, and what it said."""
    file, solver = str(folder / f"{name.replace(' ', '-')}.json"), command[2:]
    try:
        made = subprocess.run(
            [*command[:2], file, setting, *solver], capture_output=True, text=True, timeout=TIMEOUT, check=False, cwd=folder
        )
    except subprocess.TimeoutExpired:
        return ["", "", "", "", f"not finished after {TIMEOUT:g} s"]
    lines = made.stdout.strip().splitlines()
    if made.returncode or not lines or not lines[-1].startswith("{"):
        said = (made.stderr.strip() or made.stdout.strip() or f"status {made.returncode}").splitlines()[-1]
        return ["", "", "", "", f"not run: {said[:110]}"]
    found = json.loads(lines[-1])
    states = np.array(found["states"], float)
    lines = [line.strip() for line in made.stderr.splitlines() if "arning" in line or "rror" in line]
    said = "; ".join(line for line in lines if "Deprecation" not in line and "CUDA" not in line)[:80]
    if not np.all(np.isfinite(states[..., :3])):
        return ["not finite", "", "", f"{found['seconds']:.2g}", said]
    values = [f"{value:.1e}" if np.isfinite(value) else "" for value in errors(states, problem)]
    return [*values, f"{found['seconds']:.2g}", said]


def errors(states: np.ndarray, problem: Problem) -> tuple[float, float, float]:
    """Return the largest gap of a joint [m], error of the energy [J], and error of an angle [rad] over all samples."""
    reference = np.array(problem["reference"])
    turn = states[..., 2] - reference[..., 2]
    angle = np.abs(np.arctan2(np.sin(turn), np.cos(turn)))[:, [bool(body["inertia"]) for body in problem["bodies"]]].max()
    energy = np.abs(_energy(states, problem) - _energy(reference, problem)).max()
    return _gap(states, problem), float(energy), float(angle)


def _energy(states: np.ndarray, problem: Problem) -> np.ndarray:
    mass, inertia = (np.array([body[key] for body in problem["bodies"]]) for key in ("mass", "inertia"))
    weight = states[..., :2] @ np.array(problem["gravity"])
    parts = 0.5 * mass * np.sum(states[..., 3:5] ** 2, axis=-1) + 0.5 * inertia * states[..., 5] ** 2 - mass * weight
    return np.asarray(parts.sum(axis=1))


def _gap(states: np.ndarray, problem: Problem) -> float:
    """Return the largest distance of the two points of a pin, or of a slider from its line, or depth of the pin in the hole."""

    def place(k: int, local: list[float]) -> Any:
        if k < 0:
            return complex(*local)
        return states[:, k, 0] + 1j * states[:, k, 1] + complex(*local) * np.exp(1j * states[:, k, 2])

    gaps = [np.abs(place(a, point) - place(b, other)).max() for a, point, b, other in problem["pins"]]
    for k, turn in problem["slides"]:
        start = complex(*problem["bodies"][k]["pose"][:2])
        gaps.append(np.abs(((place(k, [0.0, 0.0]) - start) * np.exp(-1j * turn)).imag).max())
    if "hole" in problem:
        gaps.append(max(0.0, float(np.abs(place(0, problem["hole"]["place"])).max()) - CLEARANCE))
    return float(max(gaps))


def _with_kept(rows: dict[str, list[list[str]]]) -> dict[str, list[list[str]]]:
    """Return the rows in the order of the engines; rows of engines that were not run are those of the page."""
    kept = sections(PAGE.read_text(encoding="utf-8")).values()
    order = [engine.name for engine in ENGINES]
    for (name, found), text in zip(rows.items(), kept, strict=False):
        fresh = {row[0] for row in found}
        old = [row for row in table_rows(text) if row[0] in order and row[0] not in fresh]
        rows[name] = sorted([*found, *old], key=lambda row: order.index(row[0]))
    return rows


def rewritten() -> str:
    """Return the page with new texts; its numbers, date and machine are those that it has."""
    before = PAGE.read_text(encoding="utf-8")
    *mechanisms, order = sections(before)
    run = next(line for line in before.splitlines() if line.startswith("*Run:*"))
    return _page(_with_kept({name: [] for name in mechanisms}), table_rows(sections(before)[order])[2:], f"{run}\n")


def _page(rows: dict[str, list[list[str]]], order: list[list[str]], run: str) -> str:
    """Return the page: the texts of README.md with their tables, of which `order` is the last; `run` is date and machine."""
    head, *texts = (HERE / "README.md").read_text(encoding="utf-8").split("\n## ")
    settings = [[engine.name, engine.package.strip(":"), engine.default, engine.careful or engine.reason] for engine in ENGINES]
    parts = [head, table(["engine", "package", "default", "careful"], settings)]
    columns = ["engine", "setting", "gap [m]", "energy error [J]", "angle error [rad]", "time [s]", "message"]
    tables = [*(table(columns, found) for found in rows.values()), table(COLUMNS, order)]
    for text, found in zip(texts, tables, strict=True):
        parts.append(f"## {text.strip()}\n\n{found}")
    return "\n".join([*parts, run]) + "\n"


def _write(page: str) -> None:
    """Write the page and draw its pictures."""
    PAGE.write_text(page, encoding="utf-8")
    draw(page, PAGE.parent)
