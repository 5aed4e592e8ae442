"""The store of a study: Zarr 3, one chunk of each array for each block, written by one writer, the status last."""

from __future__ import annotations

import json
import os
import shutil
import warnings
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from scissordyn.errors import InputError, ScissordynError
from scissordyn.lock import hold
from scissordyn.simulation.measure import COMPONENT_UNIT
from scissordyn.study.description import OwnMeasure, Study
from scissordyn.study.design import Design

if TYPE_CHECKING:
    import zarr

__all__ = ["COMPLETE", "FAILED", "PENDING", "Store", "StoreError", "column"]

PENDING, COMPLETE, FAILED = 0, 1, 2
"""Status of a case; pending is the fill value: a block that nobody has written is pending."""

TITLE = "scissordyn study"

UNFINISHED = ".new"
"""Behind the name of a store that is being made."""

TIMING = "timing"
"""Group of what differs from run to run; the arrays at the root do not."""

NOTED = f"{TIMING}/blocks"

TIMES = ("seconds", "integration_seconds", "cases", "attempts")


class StoreError(ScissordynError):
    """A store that could be read or written before and cannot now: a full disk, a disk that is gone."""


def column(address: str) -> str:
    """Name of the array of an address; a slash would make a group of it."""
    return address.replace("/", "_")


class Store:
    """The store of one study.

    Parameters
    ----------
    address : str
        A folder, on a disk that all workers share.

    Raises
    ------
    InputError
        For an address of anything but a folder, such as ``s3://bucket/study.zarr``.
    """

    def __init__(self, address: str | os.PathLike[str]) -> None:
        text = os.fspath(address)
        if "://" in text:
            raise InputError(f"'{text}' as a store", "a folder, on a disk that all workers share", "-o study.zarr")
        self.address = str(Path(text).expanduser().absolute())
        self._group: Any = None
        self._arrays: dict[str, Any] = {}

    # --- beginning ------------------------------------------------------------------------------------------------------

    def exists(self) -> bool:
        """Whether there is a study; an `InputError` if there is anything else."""
        path = Path(self.address)
        if not path.exists() or (path.is_dir() and not any(path.iterdir())):
            return False
        if not (path / "zarr.json").exists() or self.group.attrs.get("title") != TITLE:
            raise InputError(f"'{path}' is no study", "the folder of a study, or a name that is not taken", "-o study.zarr")
        return True

    @property
    def group(self) -> zarr.Group:
        """The root group."""
        if self._group is None:
            import zarr

            with _said(self.address):
                try:
                    self._group = zarr.open_group(self.address, mode="r+", use_consolidated=False)
                except (FileNotFoundError, KeyError):
                    raise InputError(f"no study at '{self.address}'", "the store of a study") from None
                except ValueError as error:
                    raise InputError(f"'{self.address}': {error}", "the store of a study") from None
        return self._group

    def _array(self, name: str) -> Any:
        """An array that is read and written by blocks; another process may make it longer."""
        if name not in self._arrays:
            self._arrays[name] = self.group[name]
        return self._arrays[name]

    def _forget(self) -> None:
        self._group, self._arrays = None, {}

    def create(self, study: Study, pilot: xr.Dataset, block: int) -> None:
        """Write the arrays' descriptions; nothing is computed yet.

        Parameters
        ----------
        study : Study
        pilot : Dataset
            Of at least one case, with all measures: gives dimensions and units.
        block : int
            Cases of a block.
        """
        import zarr

        attributes = {
            "title": TITLE,
            "study": json.dumps(study.to_plain()),
            "fingerprint": study.fingerprint(),
            "block": block,
            "samples": study.sampling.samples,
            "members": study.members,
        }
        beside = f"{self.address}{UNFINISHED}"  # a process that is killed here leaves no half of a store
        with _said(self.address), _removed_after_error(beside):
            root = zarr.open_group(beside, mode="w", zarr_format=3)
            for address in study.addresses:
                role = "factor" if address in {factor.address for factor in study.factors} else "uncertain"
                about = {**pilot[address].attrs, "role": role, "address": address}
                _array(root, column(address), study.cases, block, (), float, np.nan, about)
            for name in study.measure_names:
                dims = tuple(map(str, pilot[name].dims[1:]))
                sizes = {dim: pilot.sizes[dim] for dim in dims}
                _array(
                    root,
                    name,
                    study.cases,
                    block,
                    tuple(sizes.items()),
                    float,
                    np.nan,
                    {**pilot[name].attrs, "role": "measure"},
                )
                for dim in dims:
                    _labels(root, dim, pilot[dim])
                    if COMPONENT_UNIT in pilot[name].coords:
                        _labels(root, COMPONENT_UNIT, pilot[COMPONENT_UNIT])
            for name, meaning in (("cause", "why a case failed"), ("warnings", "warnings of a complete case, one a line")):
                _array(root, name, study.cases, block, (), str, "", {"long_name": meaning})
            about = {
                "long_name": "status",
                "flag_values": [PENDING, COMPLETE, FAILED],
                "flag_meanings": "pending complete failed",
            }
            _array(root, "status", study.cases, block, (), np.int8, PENDING, about)
            times = root.create_group(TIMING)
            blocks = -(-study.cases // block)
            times.create_array(
                "blocks",
                shape=(blocks, len(TIMES)),
                chunks=(1, len(TIMES)),
                dtype=float,
                fill_value=0.0,
                dimension_names=["block", "what"],
                attributes={"what": list(TIMES)},
            )
            root.attrs.update(attributes)
            _consolidate(root)
            os.rename(beside, self.address)
            self._forget()

    def study(
        self, *, allow_code: Sequence[Path] = (), own_measures: Sequence[OwnMeasure] = (), reading: bool = False
    ) -> Study:
        """The study that the store is of.

        Parameters
        ----------
        allow_code : sequence of Path
            Files of the user whose functions may be executed.
        own_measures : sequence of OwnMeasure
            The functions that are no file's.
        reading : bool
            No case will be computed: the user's functions are not needed.

        Returns
        -------
        Study
        """
        plain = json.loads(str(self.group.attrs["study"]))
        return Study.from_plain(plain, allow_code=allow_code, own_measures=own_measures, reading=reading)

    def design(self) -> Design:
        """The design, with the number of points that it has by now."""
        return Design(**json.loads(str(self.group.attrs["study"]))["design"])

    def check(self, study: Study) -> None:
        """Raise `InputError` if the store is of another study, or of the same with another version of the program."""
        there: Mapping[str, str] = self.group.attrs["fingerprint"]
        differs = [name for name, digest in study.fingerprint().items() if there.get(name) != digest]
        if differs:
            raise InputError(
                f"'{self.address}' holds another study (differs in {', '.join(differs)})",
                "the store of the same study, or a name that is not taken",
                "-o another.zarr",
            )

    # --- blocks ---------------------------------------------------------------------------------------------------------

    @property
    def block(self) -> int:
        """Cases of a block."""
        return int(self.group.attrs["block"])

    @property
    def cases(self) -> int:
        """Cases in all."""
        return int(self.group["status"].shape[0])

    def status(self) -> np.ndarray:
        """Status of every case, shape (cases,)."""
        with _said(self.address):
            return np.asarray(self.group["status"][:])

    def cases_of(self, block: int) -> tuple[np.ndarray, np.ndarray]:
        """Numbers and status of the cases of a block."""
        first, size = block * self.block, int(self._array("status").shape[0])
        cases = np.arange(first, min(first + self.block, size))
        with _said(self.address):
            return cases, np.asarray(self._array("status")[cases[0] : cases[-1] + 1])

    def write(self, cases: np.ndarray, columns: Mapping[str, np.ndarray], status: np.ndarray, times: Sequence[float]) -> None:
        """Write the results of cases of one block; the status is the last to be written.

        Parameters
        ----------
        cases : ndarray of int
            Ascending.
        columns : mapping of str to ndarray
            By the names of the arrays.
        status : ndarray
        times : sequence of float
            Seconds, seconds of integration, and cases, which are added to what is noted.
        """
        block = int(cases[0]) // self.block
        with _said(self.address):
            for name, values in columns.items():
                self._set(name, cases, values)
            noted = self._array(NOTED)
            noted[block] = np.asarray(noted[block]) + np.array([*times, 1.0])
            self._set("status", cases, status)

    def _set(self, name: str, cases: np.ndarray, values: np.ndarray) -> None:
        array, first, last = self._array(name), int(cases[0]), int(cases[-1]) + 1
        if last - first != cases.size:  # those between stay as they are
            every = np.array(array[first:last])
            every[cases - first] = values
            values = every
        array[first:last] = values

    def times(self) -> dict[str, np.ndarray]:
        """Seconds, seconds of integration, cases and attempts of every block."""
        with _said(self.address):
            noted = np.asarray(self.group[NOTED][:])
        return dict(zip(TIMES, noted.T, strict=True))

    def extend(self, study: Study) -> None:
        """Make room for more points of the same design.

        Parameters
        ----------
        study : Study
            The same with more points.
        """
        with _said(self.address):
            root = self.group
            for name, array in list(root.arrays()):
                if array.metadata.dimension_names and array.metadata.dimension_names[0] == "case":
                    self._array(name).resize((study.cases, *array.shape[1:]))
            self._array(NOTED).resize((-(-study.cases // self.block), len(TIMES)))
            root.attrs["study"] = json.dumps(study.to_plain())
            _consolidate(root)
            self._forget()

    # --- reading --------------------------------------------------------------------------------------------------------

    def results(self) -> xr.Dataset:
        """All arrays, in memory, with the point, sample and member of each case."""
        with _said(self.address):
            found: xr.Dataset = xr.open_zarr(self.address, chunks=None, consolidated=False).load()
        per_point = int(found.attrs["samples"]) * int(found.attrs["members"])
        point, rest = np.divmod(np.arange(found.sizes["case"]), per_point)
        sample, member = np.divmod(rest, int(found.attrs["members"]))
        found = found.set_coords([name for name in (COMPONENT_UNIT,) if name in found])
        return found.assign_coords(point=("case", point), sample=("case", sample), member=("case", member))

    @contextmanager
    def alone(self) -> Iterator[None]:
        """No other process hands out blocks of this store meanwhile."""
        path = Path(f"{self.address}.lock")
        if not path.parent.is_dir():
            raise InputError(f"'{self.address}' as a store: no folder '{path.parent}'", "a folder that exists", "-o study.zarr")
        with _said(self.address):
            handle = os.open(path, os.O_CREAT | os.O_RDWR)
        try:
            if not hold(handle):
                raise InputError(f"'{self.address}' is being computed by another process", "one at a time")
            try:
                yield
            finally:
                path.unlink(missing_ok=True)
        finally:
            os.close(handle)


def _consolidate(root: zarr.Group) -> None:
    """One file with all descriptions, so that `xarray.open_zarr` reads them at once."""
    import zarr

    with warnings.catch_warnings():  # zarr says that other programs may not know of it, and need not
        warnings.simplefilter("ignore")
        zarr.consolidate_metadata(root.store)


@contextmanager
def _removed_after_error(folder: str) -> Iterator[None]:
    try:
        yield
    except BaseException:
        shutil.rmtree(folder, ignore_errors=True)
        raise


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
    )


def _labels(root: Any, name: str, labels: xr.DataArray) -> None:
    """Texts along a dimension, written once."""
    if name in root:
        return
    texts = np.array([str(text) for text in labels.values], object)
    array = root.create_array(name, shape=texts.shape, dtype=str, fill_value="", dimension_names=list(map(str, labels.dims)))
    array[:] = texts


@contextmanager
def _said(address: str) -> Iterator[None]:
    """Errors of the disk as one line."""
    try:
        yield
    except OSError as error:
        reason = error.strerror or str(error) or type(error).__name__
        raise StoreError(f"'{address}' cannot be read or written: {reason}; what is complete is kept") from error
