"""Conversion of studies of format 2, which were folders, to one file."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from scissordyn.errors import InputError
from scissordyn.lookup import library
from scissordyn.studies.compute import table
from scissordyn.studies.compute.store import PENDING, TEXTS, TIMES, BlockResult, Store


def convert(folder: Path, target: Path) -> tuple[Store, list[int]]:
    """Write a study of format 2 to one file; blocks that are not as they were written are left out, and returned."""
    library("zarr", "convert", "a study of format 2")
    try:
        old = xr.open_zarr(folder, chunks=None, consolidated=True)
        attrs, names = old.attrs, list(old.attrs["arrays"])
        plain, block = json.loads(attrs["study"]), int(attrs["block"])
    except (OSError, KeyError, TypeError, ValueError):
        raise InputError(f"'{folder}' is no study of format 2", "the folder of one", "old.zarr") from None
    if (store := Store(target)).begun():
        raise InputError(f"'{target}' exists", "a name that is not taken", "-o another.db")
    of_role = sorted(set(names) - {*TEXTS, "status"}, key=lambda name: old[name].attrs["role"])
    columns, cases = table.Columns.of({name: old[name] for name in of_role}), old.sizes["case"]
    store.create_with(columns, plain, attrs["fingerprint"], block, cases)
    times, damaged = _times(folder), []
    with store.alone():
        for number in range(-(-cases // block)):
            seal = folder / "record" / "seals" / f"{number}.json"
            if not seal.exists():
                continue
            if not _is_sealed(folder, number, attrs["arrays"], seal):
                damaged.append(number)
                continue
            part = old[names].isel(case=slice(number * block, (number + 1) * block)).load()
            rows = np.flatnonzero(part["status"].values != PENDING)
            values = {array.name: part[array.name].values[rows] for array in columns.arrays}
            texts = list(zip(*(map(str, part[name].values[rows]) for name in TEXTS), strict=True))
            if rows.size:
                status = part["status"].values[rows].astype(np.int8)
                store.write(BlockResult(number * block + rows, values, status, texts, times[number]))
    return store, damaged


def _times(folder: Path) -> np.ndarray:
    """Seconds, seconds of integration and cases of each block; zero where they cannot be read."""
    zarr = library("zarr", "convert", "a study of format 2")
    array = zarr.open_array(str(folder / "timing" / "blocks"), mode="r")
    noted = np.zeros((array.shape[0], len(TIMES) - 1))
    for number in range(array.shape[0]):
        try:
            noted[number] = array[number, : len(TIMES) - 1]
        except Exception:  # a broken chunk: the libraries of codecs raise whatever they like
            continue
    return noted


def _is_sealed(folder: Path, block: int, arrays: Mapping[str, int], seal: Path) -> bool:
    """Whether the files of a block are those that its seal names."""
    try:
        digests: Any = json.loads(seal.read_bytes())["files"]
        for name, dimensions in arrays.items():
            path = folder.joinpath(name, "c", str(block), *["0"] * (dimensions - 1))
            right = hashlib.sha256(path.read_bytes()).hexdigest()[:16] if path.exists() else ""
            if digests[name] != right:
                return False
    except (OSError, ValueError, TypeError, KeyError):
        return False
    return True
