"""Studies as tables: CSV, Parquet, NetCDF."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import xarray as xr

from scissordyn.errors import InputError
from scissordyn.file.output_file import check_target, write_file
from scissordyn.run.engine import STATES
from scissordyn.run.store import save
from scissordyn.study.ask.requirement import units_of_parts

if TYPE_CHECKING:
    import pandas as pd

ENDINGS = (".csv", ".parquet", ".nc")


def table(results: xr.Dataset) -> pd.DataFrame:
    """One row for each case; a measure of several joints has a column for each, ``A.peak_force [N]``."""
    import pandas as pd

    columns: dict[str, np.ndarray] = {name: results[name].values for name in ("point", "sample", "member")}
    for role in ("factor", "uncertain", "measure"):
        for name, variable in results.data_vars.items():
            if variable.attrs.get("role") != role:
                continue
            units = units_of_parts(results, str(name))
            if "labels" in variable.attrs:
                labels = [*variable.attrs["labels"], ""]  # of a damaged block the last
                columns[str(variable.attrs["address"])] = np.array(
                    [labels[int(label)] for label in np.nan_to_num(variable.values, nan=-1.0)]
                )
                continue
            if variable.ndim == 1:
                columns[_headed(str(variable.attrs.get("address", name)), units[0])] = variable.values
                continue
            for place, part in enumerate(variable[variable.dims[1]].values):
                columns[_headed(f"{part}.{name}", units[place])] = variable.values[:, place]
    columns["status"] = np.array([STATES[int(code)] for code in results["status"].values])
    columns["cause"] = results["cause"].values.astype(object)
    return pd.DataFrame(columns)


def _headed(name: str, unit: str) -> str:
    return name if unit in ("1", "") else f"{name} [{unit}]"


def export(results: xr.Dataset, path: Path) -> Path:
    """Write all cases to a file whose ending says in which form."""
    ending = path.suffix.lower()
    if ending not in ENDINGS:
        raise InputError(f"'{path}' as a table", f"a name that ends in {', '.join(ENDINGS)}", "-o study.csv")
    if ending == ".nc":
        check_target(path, sample="-o study.nc")
        plain = results.copy()
        for name, variable in results.variables.items():
            if variable.dtype.kind not in "fib":
                plain[name] = variable.copy(data=variable.values.astype(object))
        plain.attrs = {
            name: value if isinstance(value, (str, int, float)) else str(value) for name, value in plain.attrs.items()
        }
        return save(plain, path)
    check_target(path, sample=f"-o study{ending}")
    rows = table(results)
    try:
        content = rows.to_csv(index_label="case").encode() if ending == ".csv" else rows.to_parquet()
    except ImportError:
        raise InputError("pyarrow is not installed", "the extra 'study', or CSV", "-o study.csv") from None
    return write_file(path, content, sample=f"-o study{ending}")
