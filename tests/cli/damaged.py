"""Damaged files of runs: attributes and variables lost, of another type, without units, with other numbers, files cut off."""

from __future__ import annotations

import random
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from scissordyn.run.store import load

ATTRIBUTES: tuple[Any, ...] = (
    *("", "soon", "{", "[]", "{}", "null", "NaN", '{"mechanism": {}}', '{"steps": "x"}', "[3]", '"x"', "x" * 5000),
    *(0, -1, 3.5, 1e308, float("nan"), float("inf"), np.array([1.0, 2.0]), np.array([], float), np.int8(3), True),
)
"""What an attribute may hold in place of its value."""

NUMBERS = (float("nan"), float("inf"), -float("inf"), 1e308, -1e308, 5e-324, 0.0, -1.0)

UNITS: tuple[Any, ...] = ("", "furlong", "1", "m", "N m/s^2", 3, 2.5, np.array([1.0, 2.0]), "$\\frac{", "x" * 500)


def damaged_run(whole: Path, target: Path, number: int) -> None:
    """Write a damaged copy of a run; the same for the same number.

    Parameters
    ----------
    whole, target : Path
    number : int
    """
    chance = random.Random(number)
    if chance.random() < 0.15:
        target.write_bytes(_bytes(whole.read_bytes(), chance))
        return
    run = _loaded(whole)
    for _ in range(chance.choice((1, 1, 2, 3))):
        run = chance.choice((_attribute, _attribute, _about, _about, _variable, _variable, _variable))(run, chance)
    run = run.copy()
    for name, variable in run.variables.items():  # NetCDF stores no objects but texts
        if variable.dtype.kind == "O":
            run[name] = variable.dims, [str(value) for value in variable.values.ravel()], variable.attrs
    target.unlink(missing_ok=True)
    run.to_netcdf(target, engine="h5netcdf", invalid_netcdf=True)


@cache
def _loaded(path: Path) -> xr.Dataset:
    return load(path)


def _bytes(content: bytes, chance: random.Random) -> bytes:
    """A file that is cut off, or in which some bytes are others."""
    if chance.random() < 0.5:
        return content[: chance.randrange(len(content))]
    found = bytearray(content)
    for _ in range(chance.choice((1, 5, 50, 500))):
        found[chance.randrange(len(found))] = chance.randrange(256)
    return bytes(found)


def _attribute(run: xr.Dataset, chance: random.Random) -> xr.Dataset:
    """An attribute of the run is lost or another; those that the commands read more often."""
    name = chance.choice((*run.attrs, *("end", "title", "configuration", "status", "trusted_until", "statistics", "warnings")))
    attributes = {key: value for key, value in run.attrs.items() if key != name}
    text = run.attrs.get(name)
    if chance.random() < 0.7:
        attributes[name] = chance.choice(ATTRIBUTES)
    elif chance.random() < 0.5 and isinstance(text, str) and text:
        at = chance.randrange(len(text))
        attributes[name] = text[:at] + chance.choice(("", "x", '"', "9", "null", "}")) + text[at + 1 :]
    changed = run.copy()
    changed.attrs = attributes
    return changed


def _about(run: xr.Dataset, chance: random.Random) -> xr.Dataset:
    """Unit or long name of a variable are lost or others."""
    changed = run.copy(deep=True)
    about = changed[chance.choice(list(map(str, run.variables)))].attrs
    name = chance.choice(("units", "units", "long_name", "scale_factor"))
    if chance.random() < 0.5:
        about.pop(name, None)
    else:
        about[name] = chance.choice(UNITS)
    return changed


def _variable(run: xr.Dataset, chance: random.Random) -> xr.Dataset:
    """A variable is lost, cut, of another type or dimension, or has other numbers."""
    name = chance.choice(list(map(str, run.variables)))
    found, kind = run[name], chance.random()
    if kind < 0.3:
        return run.drop_vars(name)
    if kind < 0.4 and found.dims:
        dim = chance.choice(found.dims)
        return run.isel({dim: slice(0, chance.randrange(run.sizes[dim] + 1))})
    others = run.drop_vars(name)
    if name in others.dims:  # a coordinate that others go over can be lost, but is no number
        return others
    if kind < 0.5:
        return others.assign({name: 3.0 if chance.random() < 0.5 else "text"})
    if kind < 0.6:
        return others.assign({name: ("other", np.arange(3.0), found.attrs)})
    values = found.values.copy()
    if kind < 0.75 or values.dtype.kind != "f":
        if values.dtype.kind in "OU":
            new = [chance.choice(("", "A", "ground", "x\x1b[31m", "$\\frac{", text)) for text in values.ravel().tolist()]
            values = np.array(new, dtype=str).reshape(values.shape) if chance.random() < 0.7 else np.arange(float(values.size))
        else:
            made = values.astype(str) if chance.random() < 0.5 else np.nan_to_num(values).astype(np.int32)
            values = made
    elif values.size:
        flat = values.reshape(-1)
        for _ in range(chance.choice((1, 1, flat.size))):
            flat[chance.randrange(flat.size)] = chance.choice(NUMBERS)
    return others.assign({name: (found.dims, values, found.attrs)})
