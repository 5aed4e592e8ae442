"""What cannot be read as a run, and the file of a run that is written without a Dataset."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
import xarray as xr

import scissordyn as sd
from scissordyn.config.file import read_case
from scissordyn.run.results import Results, Variable
from scissordyn.run.simulate import results_of
from scissordyn.run.store import write_results

EXAMPLES = Path(__file__).parents[2] / "examples"
BESIDE = {"REFERENCE_LIST", "DIMENSION_LIST"}  # where in the file dimensions are


@pytest.mark.parametrize(("name", "reads"), [("case.toml", "sd.read_case"), ("study.db", "sd.open_study")])
def test_another_file_names_what_reads_it(tmp_path: Path, name: str, reads: str) -> None:
    """Limit: a case file or a study in place of a run leads to the function for it."""
    path = tmp_path / name
    path.write_text("", encoding="utf-8")
    with pytest.raises(sd.InputError, match=rf"as a run: .*type: {reads}\('.*{name}'\)"):
        sd.load(path)


def stored(path: Path) -> list[Any]:
    """What a file has by name: types, shapes, values that count as missing, attributes."""
    with h5py.File(path) as file:
        parts = [
            (
                name,
                part.dtype,
                part.shape,
                str(part.fillvalue),
                {key: str(part.attrs[key]) for key in part.attrs.keys() - BESIDE},
            )
            for name, part in sorted(file.items())
        ]
        return [{key: str(value) for key, value in file.attrs.items()}, *parts]


def case(name: str) -> Results:
    """A short run of an example."""
    made = read_case(EXAMPLES / f"{name}.toml", ["run.until=3 ms", "run.samples=7"])
    return results_of(made.mechanism, made.run)


def no_case() -> Results:
    """Kinds that few runs have: a NUL and half a surrogate, single precision, nothing along a dimension."""
    return Results(
        {
            "name": Variable(("name",), np.array(["a\0b", "\ud800"]), {}),
            "share": Variable(("name",), np.array([0.5, np.nan], np.float32), {"units": "1"}),
            "count": Variable(("none",), np.zeros(0, np.int64), {"long_name": "é"}),
            "open": Variable(("name", "none"), np.zeros((2, 0), bool), {}),
        },
        {"title": "scissordyn \0", "end": 0.5, "count": 3, "attribute": "ü"},
    )


@pytest.mark.parametrize("name", ["paper", "four_bar", "self_deploying", ""])
def test_the_file_is_that_of_the_dataset(tmp_path: Path, name: str) -> None:
    """Cross-check by a second formulation: xarray writes the Dataset of the same results, and reads both."""
    results, files = case(name) if name else no_case(), [tmp_path / "direct.nc", tmp_path / "dataset.nc"]
    write_results(results, files[0])
    sd.save(results.dataset(), files[1])
    xr.testing.assert_identical(*map(sd.load, files))
    direct, of_dataset = map(stored, files)
    assert direct == of_dataset
