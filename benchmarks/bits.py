"""Compare digests of a fixed set of runs before and after a change.

``python -m benchmarks.bits --write FILE`` saves digests of every variable of every case; ``python -m benchmarks.bits --compare
FILE`` prints the variables that have changed. ``--only NAME ...`` selects cases, ``--list`` prints their names. Values depend
on libm: run both on the same machine.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import math
import sys
import tempfile
from collections.abc import Callable
from dataclasses import replace
from itertools import zip_longest
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

import scissordyn as sd
from benchmarks.horizon_cases import KINDS, horizon_case
from scissordyn.laws.catalogue import DAMPING, ELASTIC, FRICTION

EXAMPLES = Path(__file__).parent.parent / "examples"

LONGEST = {"solar_array": 0.15, "mast": 0.2, "long": 0.02, "ring": 0.15, "lift": 0.3, "self_deploying": 0.5, "controlled": 0.3}
"""Ends of runs that would take long [s]; others end as in their case file."""

OWN = {
    name: [f"structure.angle={first} deg", f"drive.cycloidal.start={first} deg", f"drive.cycloidal.end={last} deg"]
    for name, first, last in (("solar_array", 15, 75), ("controlled", 30, 60))
}
"""Changes of cases that fold here and deploy in their files."""

HORIZON = 0.12  # End of the runs of random mechanisms [s]; runs without contact are ten times as long


def _example(name: str) -> sd.Case:
    return sd.read_case(EXAMPLES / f"{name}.toml", OWN.get(name, []))


def _run_example(name: str) -> xr.Dataset:
    case = _example(name)
    options = {**vars(case.run), "trust": False, "until": LONGEST.get(name, case.run.until)}
    return sd.simulate(case.mechanism, **options)


def _run_laws(names: tuple[str, str, str]) -> xr.Dataset:
    stiffness, damping, friction = (table[name]() for table, name in zip((ELASTIC, DAMPING, FRICTION), names, strict=True))
    clearance = sd.Clearance(5e-4, stiffness=stiffness, damping=damping, friction=friction)
    array = sd.scissor(units=2).driven(speed=sd.rpm(150)).with_clearance("A", clearance)
    return sd.simulate(array, until=0.02, samples=101)


def _run_kind(kind: str) -> xr.Dataset:
    case = horizon_case(kind, 7)
    until = min(case.until, 10.0 * HORIZON if kind in ("ideal joints", "stops, cables, latches") else HORIZON)
    return sd.simulate(case.mechanism, until=until, rtol=case.rtol, atol=case.rtol, samples=101)


_TIP = 0.4 * math.cos(0.3) + 0.3 * math.cos(0.8), 0.4 * math.sin(0.3) - 0.3 * math.sin(0.8)


def _pendulum(**options: Any) -> sd.Mechanism:
    """Return two bars, the second hanging on the first."""
    one = sd.bar("one", length=0.4, mass=1.0, angle=0.3)
    end = 0.4 * math.cos(0.3), 0.4 * math.sin(0.3)
    two = sd.bar("two", length=0.3, mass=0.5, position=end, angle=-0.8)
    return sd.Mechanism(
        bodies=(one, two),
        joints=(
            sd.Revolute("root", ("one", "start"), ("ground", "O")),
            sd.Revolute("knee", ("two", "start"), ("one", "end")),
        ),
        ground=(("O", (0.0, 0.0)), ("P", (0.1, 0.6))),
        gravity=9.81,
        input_body="one",
        **options,
    )


def _run_components() -> xr.Dataset:
    tip, mid, anchor = ("two", "end"), ("one", "end"), ("ground", "P")
    parts = (
        sd.Spring("spring", anchor, mid, 40.0, free_length=0.3, damping=0.5),
        sd.ConstantForceSpring("coil", anchor, tip, 2.0),
        sd.Cable("rope", anchor, tip, 2e4, 0.7, 1.0),
        sd.TorsionSpring("knee spring", "two", "one", 3.0, damping=0.02),
        sd.TapeSpring("tape", "two", "one", 5.0, 0.5, 0.1, 0.3, 0.05, -1.1),
        sd.Force("push", tip, (1.0, -2.0), follows=True),
        sd.Torque("twist", "one", 0.4),
        sd.AngleStop("high", "two", 0.2, "one"),
        sd.AngleStop("low", "two", -2.4, "one", restitution=0.5),
    )
    return sd.simulate(_pendulum(components=parts), until=1.0, samples=201)


def _run_bushing(method: str) -> xr.Dataset:
    loose = _pendulum()
    parts = (sd.Bushing("bush", ("one", "end"), ("two", "start"), 2e5, 1e5, 10.0, 50.0, 40.0, 0.1),)
    held = replace(loose, joints=loose.joints[:1], components=parts)
    return sd.simulate(held, until=0.1, samples=101, method=method)


def _run_motor() -> xr.Dataset:
    crank = sd.slider_crank().with_clearance("slider pin", sd.Clearance(2e-4))
    return sd.simulate(replace(crank, components=(sd.Motor("motor", "crank", 5.0, 60.0),)), until=0.2, samples=101)


def _run_rod() -> xr.Dataset:
    rod = sd.Rod("rod", ("ground", "P"), ("two", "end"), length=math.dist((0.1, 0.6), _TIP))
    return sd.simulate(_pendulum(components=(rod,)), until=0.5, samples=101)


def _run_latch() -> xr.Dataset:
    latch = sd.Latch("latch", "two", -1.5, "one")
    return sd.simulate(_pendulum(components=(latch,)), until=1.0, samples=201)


def _controlled(controller: Any) -> sd.Mechanism:
    crank = sd.slider_crank().with_clearance("slider pin", sd.Clearance(2e-4, friction=sd.LuGre(0.05)))
    return crank.controlled(controller, reference=sd.Cycloidal(0.0, 2.0, 0.05))


def _run_controller(controller: Any) -> xr.Dataset:
    return sd.simulate(_controlled(controller), until=0.1, samples=101)


@sd.element(slot="stiffness")
def _soft(indentation: float, stiffness: float = 5e10) -> float:
    return stiffness * indentation * math.sqrt(indentation)


@sd.element(slot="friction")
def _sticky(slip_speed: float, normal_force: float, coefficient: float = 0.05) -> float:
    return coefficient * normal_force * math.tanh(slip_speed / 1e-3)


@sd.element(slot="controller")
def _proportional(error: float, reference_speed: float, speed: float) -> float:
    return 30.0 * error + 0.5 * (reference_speed - speed)


def _run_user() -> xr.Dataset:
    clearance = sd.Clearance(5e-4, stiffness=_soft(), friction=_sticky(), damping=sd.Flores())
    array = sd.scissor(units=2).driven(speed=sd.rpm(150)).with_clearance("A", clearance)
    return sd.simulate(array, until=0.02, samples=101)


def _run_batch() -> xr.Dataset:
    array = sd.scissor(units=2).driven(speed=sd.rpm(150)).with_clearance("A", sd.Clearance(5e-4, friction=sd.LuGre(0.02)))
    return sd.simulate_many(array, {"A.clearance": np.linspace(2e-4, 8e-4, 8)}, until=0.03, threads=2)


def _run_checkpoint() -> xr.Dataset:
    def stop(time: float) -> None:
        if time > 0.01:
            raise KeyboardInterrupt

    array = sd.scissor(units=2).driven(speed=sd.rpm(150)).with_clearance("A", sd.Clearance(5e-4, friction=sd.LuGre(0.02)))
    with tempfile.TemporaryDirectory() as folder:
        place = sd.Checkpoint(Path(folder) / "state.nc", every=0.0, keep=True)
        sd.simulate(array, until=0.03, checkpoint=place, progress=stop)
        return sd.simulate(array, until=0.03, checkpoint=place)


def _run_cycles() -> xr.Dataset:
    return sd.cycle(_example("periodic").mechanism, cycles=4, keep=3)


def _cases() -> dict[str, Callable[[], xr.Dataset]]:
    found: dict[str, Callable[[], xr.Dataset]] = {}
    for path in sorted(EXAMPLES.glob("*.toml")):
        found[f"example {path.stem}"] = lambda name=path.stem: _run_example(name)
    names = [list(ELASTIC), list(DAMPING), [*sorted(set(FRICTION) - {"maxwell-slip"})[:-2], "threlfall", "none"]]
    for k, _ in enumerate(zip_longest(*names)):
        laws = tuple(listed[k % len(listed)] for listed in names)
        found["laws " + " ".join(laws)] = lambda laws=laws: _run_laws(laws)
    for kind in KINDS:
        found[f"random {kind}"] = lambda kind=kind: _run_kind(kind)
    found |= {
        "components": _run_components,
        "bushing": lambda: _run_bushing("rodas5p"),
        "motor": _run_motor,
        "rod": _run_rod,
        "latch": _run_latch,
        "pid": lambda: _run_controller(sd.PID(30.0, 0.5, 5.0, limit=8.0)),
        "feed-forward": lambda: _run_controller(sd.FeedForward()),
        "pyragas": lambda: _run_controller(sd.Pyragas(0.5, 0.01)),
        "extended": lambda: _run_controller(sd.ExtendedDelayedFeedback(0.5, 0.01, 0.3, "error")),
        "user controller": lambda: _run_controller(_proportional()),
        "user laws": _run_user,
        "batch": _run_batch,
        "checkpoint": _run_checkpoint,
        "cycles": _run_cycles,
    }
    return found


CASES = _cases()


def digests(run: xr.Dataset) -> dict[str, str]:
    """Return digests of the variables and warnings of a run and of how it ended."""
    found = {}
    for name, variable in sorted(run.variables.items(), key=lambda item: str(item[0])):
        values = np.ascontiguousarray(variable.values)
        data = values.tobytes() if values.dtype.kind in "biuf" else json.dumps(values.tolist(), default=str).encode()
        found[str(name)] = hashlib.sha256(data).hexdigest()[:16]
    for name in ("warnings", "status", "cause"):
        found[f"attribute {name}"] = hashlib.sha256(str(run.attrs.get(name)).encode()).hexdigest()[:16]
    return found


def main() -> int:
    """Write or compare digests; return 0 if all are equal."""
    asked = argparse.ArgumentParser(description=__doc__)
    asked.add_argument("--write", type=Path)
    asked.add_argument("--compare", type=Path)
    asked.add_argument("--only", nargs="*", default=[])
    asked.add_argument("--list", action="store_true")
    given = asked.parse_args()
    names = [name for name in CASES if not given.only or any(part in name for part in given.only)]
    if given.list:
        print("\n".join(names))
        return 0
    before = json.loads(given.compare.read_text()) if given.compare else {}
    found, other = {}, 0
    for name in names:
        try:
            found[name] = digests(CASES[name]())
        except Exception as error:
            found[name] = {"error": f"{type(error).__name__}: {error}"}
        said = "written" if not before else "new" if name not in before else "same"
        if said == "same":
            mine, theirs = found[name], before[name]
            differ = sorted(key for key in theirs if mine.get(key) != theirs[key])
            more = sorted(set(mine) - set(theirs))
            said = f"OTHER in {', '.join(differ)}" if differ else "same"
            said += f"; more: {', '.join(more)}" if more else ""
            other += bool(differ)
        print(f"{name:60} {said} {found[name].get('error', '')}", flush=True)
    if given.write:
        given.write.write_text(json.dumps(found, indent=1) + "\n")
    print(f"{len(names)} cases, {other} not the same" if before else f"{len(names)} cases")
    return 1 if other else 0


if __name__ == "__main__":
    sys.exit(main())
