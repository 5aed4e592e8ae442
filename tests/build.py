"""Mechanisms, runs and what they report, for tests of all rooms.

Import from here (``from tests.build import array, on_pin, warnings_of``) instead of building the same mechanism in a test file:

- `array`: the paper's scissor array, with clearance at one joint if a clearance is given.
- `on_pin`, `hanging`, `in_bearing`: one body on a ground pin, or in a bearing with clearance.
- `chain`: bars pinned end to end. `wheel`, `gears`, `planetary`: bodies for couplings.
- `case_of`: a case from its text. `one_line_error`: an expected error.
- `warnings_of`, `counts_of`, `assert_balance`, `momenta`: what a run reports, its energy balance and momenta.

The fixture ``answer`` of the top-level conftest runs a command and returns what it prints.
"""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
import xarray as xr
from h5netcdf.core import File

import scissordyn as sd
from scissordyn.compiler.c import load_source
from scissordyn.compiler.unit import Unit
from scissordyn.file.checksum import checksum_line
from scissordyn.file.netcdf import Hdf5File
from scissordyn.integrate import advance as loop
from scissordyn.integrate.integration import Problem
from scissordyn.kernel import I1, PYTHON, Entry

EXAMPLES = Path(__file__).parents[1] / "examples"  # Folder of the package's example cases

ORIGIN = (("O", (0.0, 0.0)),)  # Ground of a mechanism with one point, "O", at the origin

# mechanisms ---------------------------------------------------------------------------------------------------------------


def array(gap: sd.Clearance | None = None, *, joint: str = "A", units: int = 2, **structure: Any) -> sd.Mechanism:
    """Return the paper's scissor array, driven at 150 rpm, with clearance at one joint if it is given."""
    driven = sd.scissor(units=units, **structure).driven(speed=sd.rpm(150))
    return driven if gap is None else driven.with_clearance(joint, gap)


def hanging(*elements: Any, inertia: float = 0.2, angle: float = 0.3, gravity: float = 0.0, spin: float = 0.0) -> sd.Mechanism:
    """Return a bar of 1 kg and 1 m that rotates about a ground pin at its start, with components."""
    rod = replace(sd.bar("rod", length=1.0, mass=1.0, inertia=inertia, angle=angle), angular_velocity=spin)
    pin = sd.Revolute("pin", ("rod", "start"), ("ground", "origin"))
    ground = (("origin", (0.0, 0.0)), ("wall", (1.5, 0.5)))
    return sd.Mechanism((rod,), joints=(pin,), components=elements, ground=ground, gravity=gravity, input_body="rod")


def on_pin(body: sd.Body, *elements: Any, gravity: float = 0.0, **parts: Any) -> sd.Mechanism:
    """Return a body on the ground pin "O" at its first point, where a drive can clamp it, with components."""
    pin = sd.Revolute("O", (body.name, next(iter(body.points))), ("ground", "O"))
    return sd.Mechanism((body,), (pin,), ground=ORIGIN, gravity=gravity, input_body=body.name, components=elements, **parts)


def in_bearing(gap: sd.Clearance, *, mass: float = 1.0, **motion: Any) -> sd.Mechanism:
    """Return a point mass whose pin has clearance in a bearing at the origin."""
    ball = sd.Body("ball", mass, None, {"centre": (0.0, 0.0)}, **motion)
    pin = sd.Revolute("pin", ("ball", "centre"), ("ground", "o"), gap)
    return sd.Mechanism((ball,), joints=(pin,), ground=(("o", (0.0, 0.0)),))


def chain(
    *bars: sd.Body, pins: Iterable[str] = "ABCDEFGH", ground: Mapping[str, tuple[float, float]] = {}, **parts: Any
) -> Any:
    """Return bars that are pinned end to end from the ground point "O" on; each is moved to the end of the one before."""
    placed, joints, place, bearing = [], [], (0.0, 0.0), ("ground", "O")
    for name, bar in zip(pins, bars, strict=False):
        placed.append(replace(bar, position=place))
        joints.append(sd.Revolute(name, (bar.name, "start"), bearing))
        place, bearing = placed[-1].place("end"), (bar.name, "end")
    return sd.Mechanism(tuple(placed), tuple(joints), ground=(*ORIGIN, *ground.items()), **parts)


def wheel(
    name: str, inertia: float = 0.01, place: tuple[float, float] = (0.0, 0.0), *, mass: float = 1.0, **more: Any
) -> sd.Body:
    """Return a wheel with the point "c" at its centre."""
    return sd.Body(name, mass, inertia, {"c": (0.0, 0.0)}, position=place, **{"angle": 0.0, **more})


def gears(ratio: float, *components: Any, inertia: tuple[float, float] = (0.01, 0.01), apart: float = 0.15, **how: Any) -> Any:
    """Return a pinion at "O" and a wheel at "P", on the pins "A" and "B", coupled by "mesh"; options of the coupling follow."""
    bodies = wheel("pinion", inertia[0]), wheel("wheel", inertia[1], (apart, 0.0))
    pins = sd.Revolute("A", ("pinion", "c"), ("ground", "O")), sd.Revolute("B", ("wheel", "c"), ("ground", "P"))
    mesh = sd.Coupling("mesh", sd.RelativeAngle("wheel"), sd.RelativeAngle("pinion"), ratio, **how)
    ground = (*ORIGIN, ("P", (apart, 0.0)))
    return sd.Mechanism(bodies, pins, ground=ground, gravity=0.0, components=components, couplings=(mesh,))


def planetary(*components: Any, **how: Any) -> sd.Mechanism:
    """Return a planetary gear: sun of 20 teeth, planet of 17 on an arm of 37 mm, and a ring of 54 teeth that is the ground."""
    arm = sd.Body("arm", 0.2, 2e-4, {"c": (0.0, 0.0), "p": (0.037, 0.0)}, position=(0.0, 0.0), angle=0.0)
    planet = wheel("planet", 7e-5, (0.037, 0.0), mass=0.25)
    pins = ("S", ("sun", "c"), ("ground", "O")), ("A", ("arm", "c"), ("ground", "O")), ("P", ("planet", "c"), ("arm", "p"))
    turned = sd.RelativeAngle("planet", "arm")
    couplings = (
        sd.Coupling("inner", turned, sd.RelativeAngle("sun", "arm"), -20.0 / 17.0, **how),
        sd.Coupling("outer", turned, sd.RelativeAngle("ground", "arm"), 54.0 / 17.0, **how),
    )
    bodies, joints = (wheel("sun", 1e-4), arm, planet), tuple(sd.Revolute(*pin) for pin in pins)
    return sd.Mechanism(bodies, joints, ground=ORIGIN, gravity=0.0, components=components, couplings=couplings)


# runs and files -----------------------------------------------------------------------------------------------------------

# Terms of the energy balance of a run
ENERGIES = ("kinetic_energy", "potential_energy", "stored_energy", "dissipated_energy", "drive_work", "load_work")


def warnings_of(run: xr.Dataset) -> list[str]:
    """Return the warnings of a run."""
    return json.loads(run.attrs["warnings"])


def counts_of(run: xr.Dataset) -> dict[str, Any]:
    """Return the statistics of a run, such as the number of steps, by name."""
    return json.loads(run.attrs["statistics"])


def balanced(run: xr.Dataset, bound: float = 1e-9, *, terms: tuple[str, ...] = ("load_work",)) -> bool:
    """Return True if the energy error is below `bound` times the converted energy, which is kinetic or in `terms`."""
    turnover = max(float(run["kinetic_energy"].max()), *(float(np.ptp(run[name].values)) for name in terms))
    return float(np.max(np.abs(run["energy_residual"]))) < bound * turnover


def assert_balance(run: xr.Dataset, bound: float = 1e-8, terms: Iterable[str] = ENERGIES) -> None:
    """Check that a run is complete and that its balance closes, relative to the largest change of the energies in `terms`."""
    assert run.attrs["status"] == "complete", run.attrs["cause"]
    turnover = max(float(np.ptp(run[name].values)) for name in terms)
    assert float(np.max(np.abs(run["energy_residual"].values))) < bound * turnover


def momenta(run: xr.Dataset, mechanism: sd.Mechanism) -> tuple[np.ndarray, np.ndarray]:
    """Return the linear momentum (time, 2) of all bodies, and their angular momentum (time,) about the origin."""
    mass, inertia = (np.array([getattr(body, name) or 0.0 for body in mechanism.bodies]) for name in ("mass", "inertia"))
    x, v = run["position"].values, run["velocity"].values
    orbital = mass * (x[..., 0] * v[..., 1] - x[..., 1] * v[..., 0])
    return np.einsum("b,tba->ta", mass, v), np.sum(orbital + inertia * run["angular_velocity"].values, axis=1)


@contextmanager
def one_line_error(*texts: str, match: str | None = None) -> Iterator[None]:
    """Check that the block raises an `InputError` whose message is one line, contains all texts and matches an expression."""
    with pytest.raises(sd.InputError, match=match) as caught:
        yield
    assert [text for text in texts if text not in str(caught.value)] == []
    assert "\n" not in str(caught.value)


def case_of(folder: Path, text: str, changes: Iterable[str] = ()) -> sd.Case:
    """Return the case of a text, which is written to case.toml of a folder, with changes."""
    path = folder / "case.toml"
    path.write_text(text, encoding="utf-8")
    return sd.read_case(path, list(changes))


def write_as_other(run: xr.Dataset, path: str | Path, *, invalid: bool = False) -> None:
    """Write a Dataset without its checks, as another program could, with a valid checksum."""
    with Hdf5File(path, "w", track_order=True) as hdf5, File(hdf5, "w", invalid_netcdf=invalid) as file:
        run.dump_to_store(xr.backends.H5NetCDFStore(file))
    add_checksum(Path(path))


def copy_with_attribute(source: Path, target: Path, name: str, value: Any) -> None:
    """Copy a file and replace one of its attributes as another program could, or delete it if the value is None."""
    shutil.copy(source, target)
    with h5py.File(target, "r+") as file:
        file.attrs.pop(name, None)
        if value is not None:
            file.attrs[name] = value
    add_checksum(target)


def add_checksum(path: Path) -> None:
    """Append the checksum of the content of a file."""
    content = path.read_bytes()
    path.write_bytes(content + checksum_line(content))


# compiled kernels ---------------------------------------------------------------------------------------------------------


def in_c(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile a function with annotated arguments and everything that it calls."""
    entry, unit = Entry(function), Unit()
    if PYTHON:
        return entry
    unit.entry(entry)
    return entry.bound(load_source(unit.text()))


def loop_of(functions: Mapping[str, Any]) -> Callable[..., None]:
    """Return the time loop of a problem, from the names of its functions."""
    return _loop(Problem(**functions))


@cache
def _loop(problem: Problem) -> Callable[..., None]:
    def advance_problem(systems: I1, addresses: I1, most_steps: int, statuses: I1) -> None:
        for k in range(systems.size):
            statuses[k] = loop.advance(problem, systems[k], addresses[k], most_steps)

    return in_c(advance_problem)
