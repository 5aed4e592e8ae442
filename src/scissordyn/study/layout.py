"""The arrays of a store, as they are before anything is computed: Zarr 3, one chunk of each array for each block."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from scissordyn.extra import library
from scissordyn.run.engine import STATES
from scissordyn.run.measure import COMPONENT_UNIT
from scissordyn.study.description import Study
from scissordyn.study.seal import RECORD

if TYPE_CHECKING:
    import zarr

PENDING, COMPLETE, FAILED = range(len(STATES))
"""Status of a case; pending is the fill value: a block that nobody has written is pending."""

TIMING = "timing"
"""Group of what differs from run to run; the arrays at the root do not."""

NOTED = f"{TIMING}/blocks"

TIMES = ("seconds", "integration_seconds", "cases", "attempts")


def column(address: str) -> str:
    """Name of the array of an address; a slash would make a group of it."""
    return address.replace("/", "_")


def write_layout(folder: Path, study: Study, pilot: xr.Dataset, block: int, attributes: dict[str, Any]) -> dict[str, int]:
    """Write the descriptions of the arrays."""
    zarr = library("zarr", "study", "a study")
    root = zarr.open_group(str(folder), mode="w", zarr_format=3)
    chosen = {factor.address for factor in study.factors}
    for address in study.addresses:
        about = {**pilot[address].attrs, "role": "factor" if address in chosen else "uncertain", "address": address}
        _array(root, column(address), study.cases, block, (), float, np.nan, about)
    for name in study.measure_names:
        dims = tuple(map(str, pilot[name].dims[1:]))
        sizes = tuple((dim, pilot.sizes[dim]) for dim in dims)
        _array(root, name, study.cases, block, sizes, float, np.nan, {**pilot[name].attrs, "role": "measure"})
        for dim in dims:
            _labels(root, dim, pilot[dim])
            if COMPONENT_UNIT in pilot[name].coords:
                _labels(root, COMPONENT_UNIT, pilot[COMPONENT_UNIT])
    for name, meaning in (("cause", "why a case failed"), ("warnings", "warnings of a complete case, one a line")):
        _array(root, name, study.cases, block, (), str, "", {"long_name": meaning})
    about = {"long_name": "status", "flag_values": list(range(len(STATES))), "flag_meanings": " ".join(STATES)}
    _array(root, "status", study.cases, block, (), np.int8, PENDING, about)
    root.create_group(TIMING).create_array(
        "blocks",
        shape=(-(-study.cases // block), len(TIMES)),
        chunks=(1, len(TIMES)),
        dtype=float,
        fill_value=0.0,
        dimension_names=["block", "what"],
        attributes={"what": list(TIMES)},
        compressors=_codecs(),
    )
    root.create_group(RECORD)
    by_case = {name: array.ndim for name, array in sorted(root.arrays()) if array.metadata.dimension_names[0] == "case"}
    root.attrs.update({**attributes, "arrays": by_case})
    consolidate(root)
    return by_case


def consolidate(root: zarr.Group) -> None:
    """One file with all descriptions, so that `xarray.open_zarr` reads them at once."""
    zarr = library("zarr", "study", "a study")
    with warnings.catch_warnings():  # zarr says that other programs may not know of it, and need not
        warnings.simplefilter("ignore")
        zarr.consolidate_metadata(root.store)


def _array(
    root: Any,
    name: str,
    cases: int,
    block: int,
    inner: tuple[tuple[str, int], ...],
    kind: Any,
    fill: Any,
    about: dict[str, Any],
) -> None:
    sizes = [size for _, size in inner]
    root.create_array(
        name,
        shape=(cases, *sizes),
        chunks=(block, *(max(size, 1) for size in sizes)),
        dtype=kind,
        fill_value=fill,
        dimension_names=["case", *(dim for dim, _ in inner)],
        attributes=about,
        compressors=_codecs(),
    )


def _codecs() -> tuple[Any, ...]:
    """Compression, and a checksum of each chunk that every reader of Zarr checks."""
    from zarr.codecs import Crc32cCodec, ZstdCodec

    return ZstdCodec(), Crc32cCodec()


def _labels(root: Any, name: str, labels: xr.DataArray) -> None:
    """Texts along a dimension, written once."""
    if name in root:
        return
    texts = np.array([str(text) for text in labels.values], object)
    array = root.create_array(
        name,
        shape=texts.shape,
        dtype=str,
        fill_value="",
        dimension_names=list(map(str, labels.dims)),
        compressors=_codecs(),
    )
    array[:] = texts
