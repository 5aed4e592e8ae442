"""What tests of several rooms share: compiled kernels, bars on a pin, a mass in a bearing, and what a run says of itself."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

import scissordyn as sd
from scissordyn.compiler.c import loaded
from scissordyn.compiler.unit import Unit
from scissordyn.file.checksum import checksum_line
from scissordyn.integrate import advance as loop
from scissordyn.integrate.integration import Problem
from scissordyn.kernel import I1, PYTHON, Entry

EXAMPLES = Path(__file__).parents[1] / "examples"


def warnings_of(run: xr.Dataset) -> list[str]:
    return json.loads(run.attrs["warnings"])


def counts_of(run: xr.Dataset) -> dict[str, Any]:
    """What the integrator counted."""
    return json.loads(run.attrs["statistics"])


def write_as_other(run: xr.Dataset, path: str | Path, *, invalid: bool = False) -> None:
    """Write a Dataset as another program could, with a checksum that is right: what is in the file is read."""
    run.to_netcdf(path, engine="h5netcdf", invalid_netcdf=invalid)
    add_checksum(Path(path))


def add_checksum(path: Path) -> None:
    """Append the checksum of what a file holds."""
    content = path.read_bytes()
    path.write_bytes(content + checksum_line(content))


def in_c(function: Callable[..., Any]) -> Callable[..., Any]:
    """A function with annotated arguments, compiled with all that it calls."""
    entry, unit = Entry(function), Unit()
    if PYTHON:
        return entry
    unit.entry(entry)
    return entry.bound(loaded(unit.text()))


def loop_of(functions: Mapping[str, Any]) -> Callable[..., None]:
    """The time loop of a problem, by the names of its functions."""
    return _loop(Problem(**functions))


@cache
def _loop(problem: Problem) -> Callable[..., None]:
    def advance_problem(systems: I1, addresses: I1, most_steps: int, statuses: I1) -> None:
        for k in range(systems.size):
            statuses[k] = loop.advance(problem, systems[k], addresses[k], most_steps)

    return in_c(advance_problem)


def hanging(*elements: Any, inertia: float = 0.2, angle: float = 0.3, gravity: float = 0.0, spin: float = 0.0) -> sd.Mechanism:
    """A bar of 1 kg and 1 m that rotates about a ground pin at its start, with some elements."""
    rod = replace(sd.bar("rod", length=1.0, mass=1.0, inertia=inertia, angle=angle), angular_velocity=spin)
    pin = sd.Revolute("pin", ("rod", "start"), ("ground", "origin"))
    ground = (("origin", (0.0, 0.0)), ("wall", (1.5, 0.5)))
    return sd.Mechanism((rod,), joints=(pin,), components=elements, ground=ground, gravity=gravity, input_body="rod")


def on_pin(bar: sd.Body, *elements: Any, gravity: float = 0.0, **parts: Any) -> sd.Mechanism:
    """A bar on a ground pin at its start, where a drive can clamp it, with some elements."""
    pin = sd.Revolute("O", (bar.name, "start"), ("ground", "O"))
    return sd.Mechanism(
        (bar,), (pin,), ground=(("O", (0.0, 0.0)),), gravity=gravity, input_body=bar.name, components=elements, **parts
    )


def in_bearing(gap: sd.Clearance, *, mass: float = 1.0, **motion: Any) -> sd.Mechanism:
    """A point mass whose pin has clearance in a bearing at the origin."""
    ball = sd.Body("ball", mass, None, {"centre": (0.0, 0.0)}, **motion)
    pin = sd.Revolute("pin", ("ball", "centre"), ("ground", "o"), gap)
    return sd.Mechanism((ball,), joints=(pin,), ground=(("o", (0.0, 0.0)),))


def balanced(run: xr.Dataset, bound: float = 1e-9, *, terms: tuple[str, ...] = ("load_work",)) -> bool:
    """Whether the energy balance closes relative to the energy that is converted, in motion or in some terms."""
    turnover = max(float(run["kinetic_energy"].max()), *(float(np.ptp(run[name].values)) for name in terms))
    return float(np.max(np.abs(run["energy_residual"]))) < bound * turnover
