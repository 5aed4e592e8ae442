"""Export of runs to other programs: a table over time as CSV or Parquet, or all arrays as a MATLAB file."""

from __future__ import annotations

import io
import os
import re
from collections.abc import Iterator
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from scissordyn.errors import InputError, did_you_mean
from scissordyn.file.output_file import check_target, write_file

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

EXPORT_ENDINGS = (".csv", ".mat", ".parquet")  # file name endings of the export formats


def check_export(path: str | os.PathLike[str]) -> None:
    """Raise `InputError` unless a run can be exported in the format of the file name's ending."""
    ending = Path(path).suffix.lower()
    if ending not in EXPORT_ENDINGS:
        raise InputError(
            f"'{path}': unknown export format '{ending}'{did_you_mean(ending, EXPORT_ENDINGS)}",
            "a name that ends in " + ", ".join(EXPORT_ENDINGS),
            "run.csv",
        )
    if ending == ".parquet" and find_spec("pyarrow") is None:
        raise InputError("Parquet needs the package pyarrow, which is not installed", "run.csv, or pip install pyarrow")


def export(run: xr.Dataset, path: str | os.PathLike[str], *, contacts: bool = False) -> Path:
    """Export a run in the format of the file name's ending; the file is written completely or not at all.

    With `contacts`, a CSV or Parquet file has a row for each contact instead of each instant.
    """
    check_export(path)
    target = Path(path)
    check_target(target, sample=f"table{target.suffix.lower()}")
    ending = target.suffix.lower()
    if ending == ".mat":
        content = _matlab(run)
    else:
        table = contact_table(run) if contacts else time_table(run)
        stream = io.BytesIO()
        if ending == ".csv":
            table.to_csv(stream, index=False, lineterminator="\n")
        else:
            table.to_parquet(stream, index=False)
        content = stream.getvalue()
    return write_file(target, content, sample=f"table{ending}")


def time_table(run: xr.Dataset) -> pd.DataFrame:
    """Return all variables over time as a table: one row per instant, one column per quantity and component."""
    import pandas as pd

    columns: dict[str, np.ndarray] = {"time [s]": run["time"].values}
    for column in time_columns(run):
        values = column.of(run)
        if not (values.dtype.kind == "f" and np.isnan(values).all()):
            shown = "" if column.unit in ("1", "") else f" [{column.unit}]"
            columns[f"{column.heading}{shown}"] = values.astype(int) if values.dtype.kind == "b" else values
    return pd.DataFrame(columns)


@dataclass(frozen=True)
class TimeColumn:
    """Column of a table over time: a quantity of a run, or one component of it."""

    heading: str  # for example "angle of unit 1/bar 1" or "position of slider, x"
    unit: str  # SI unit
    variable: str
    index: tuple[int, ...]  # indices along the dimensions of the variable except time

    def of(self, run: xr.Dataset) -> np.ndarray:
        """Return the column's values in a run, shape (time,)."""
        values = run.variables[self.variable]
        moved = np.moveaxis(values.values, values.dims.index("time"), 0)
        place: Any = (..., *self.index)
        return np.asarray(moved[place])


def time_columns(run: xr.Dataset) -> Iterator[TimeColumn]:
    """Yield the columns of the table over time of a run."""
    for name, values in run.data_vars.items():
        if "time" not in values.dims or values.dtype.kind not in "fbiu":
            continue
        dims = [dim for dim in values.dims if dim != "time"]
        for index in np.ndindex(*(values.sizes[dim] for dim in dims)):
            of = ", ".join(_label(run, dim, k) for dim, k in zip(dims, index, strict=True))
            yield TimeColumn(f"{name}{f' of {of}' if of else ''}", values.attrs.get("units", "1"), str(name), index)


def contact_table(run: xr.Dataset) -> pd.DataFrame:
    """Return the contacts of a run as a table with one row per contact."""
    import pandas as pd

    columns = {}
    for name, values in run.data_vars.items():
        if values.dims == ("contact",):
            unit = values.attrs.get("units", "1")
            columns[f"{name}{'' if unit in ('1', '') else f' [{unit}]'}"] = values.values
    return pd.DataFrame(columns)


def _label(run: xr.Dataset, dim: Any, index: int) -> str:
    return str(run[dim].values[index]) if dim in run.coords else str(index + 1)


def _matlab(run: xr.Dataset) -> bytes:
    from scipy.io import savemat

    arrays = {_matlab_name(str(name)): _to_matlab(values.values) for name, values in run.variables.items()}
    units = {
        _matlab_name(str(name)): str(values.attrs["units"]) for name, values in run.variables.items() if "units" in values.attrs
    }
    dims = {_matlab_name(str(name)): ", ".join(map(str, values.dims)) for name, values in run.variables.items()}
    attributes = {_matlab_name(str(name)): value for name, value in run.attrs.items()}
    stream = io.BytesIO()
    savemat(
        stream,  # type: ignore[arg-type]
        {"run": {**arrays, "units": units, "dims": dims, "attributes": attributes}},
        long_field_names=True,
        oned_as="column",
    )
    return stream.getvalue()


def _to_matlab(values: np.ndarray) -> np.ndarray:
    """Convert texts to a cell array and booleans to integers, for a MATLAB file."""
    if values.dtype.kind in "OUS":
        return np.array([str(value) for value in values.ravel()], dtype=object).reshape(values.shape)
    return values.astype(np.uint8) if values.dtype.kind == "b" else values


def _matlab_name(name: str) -> str:
    identifier = re.sub(r"\W", "_", name)
    return identifier if identifier[:1].isalpha() else f"x{identifier}"
