"""The store of a study: Zarr 3, one chunk of each array for each block, written by one writer, the status last."""

from __future__ import annotations

import hashlib
import json
import os
import secrets
import shutil
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from scissordyn.errors import InputError, ScissordynError
from scissordyn.extra import library
from scissordyn.lock import hold
from scissordyn.run.measure import COMPONENT_UNIT
from scissordyn.study.description import OwnMeasure, Study
from scissordyn.study.design import Design
from scissordyn.study.layout import COMPLETE as COMPLETE
from scissordyn.study.layout import FAILED as FAILED
from scissordyn.study.layout import NOTED, TIMES, consolidate, write_layout
from scissordyn.study.layout import PENDING as PENDING
from scissordyn.study.layout import column as column
from scissordyn.study.seal import RECORD, chunk_file, clear_way, fault, make_room, seal
from scissordyn.study.store_copy import COPIES, broken, keep, kept, mend

if TYPE_CHECKING:
    import zarr

TITLE = "scissordyn study"

FORMAT = 2
"""Of the store; the first had no seals."""

SHOWN = 8
"""Damaged blocks that are named."""


class StoreError(ScissordynError):
    """A store that could be read or written before and cannot now: a full disk, a disk that is gone."""


def program_digest(fingerprint: Mapping[str, str]) -> str:
    """One digest of all that a study's numbers depend on."""
    return hashlib.sha256(json.dumps(dict(fingerprint), sort_keys=True).encode()).hexdigest()[:16]


class Store:
    """The store of one study."""

    def __init__(self, address: str | os.PathLike[str]) -> None:
        text = os.fspath(address)
        if "://" in text:
            raise InputError(f"'{text}' as a store", "a folder, on a disk that all workers share", "-o study.zarr")
        self.address = str(Path(text).expanduser().absolute())
        self._group: Any = None
        self._arrays: dict[str, Any] = {}
        self._held = False
        self.restored: tuple[str, ...] = ()

    # --- beginning ------------------------------------------------------------------------------------------------------

    def exists(self) -> bool:
        """Whether there is a study; an `InputError` if there is anything else. Broken descriptions are restored."""
        path = Path(self.address)
        with _said(self.address):
            if not path.exists() or (path.is_dir() and not any(path.iterdir())):
                return False
            files = kept(path)
            if files is None:
                raise self._no_study(path)
            wrong = broken(path, files)
            if wrong:
                with self.alone():
                    wrong = broken(path, files := kept(path) or files)
                    mend(path, files, wrong)
                    self.restored += tuple(wrong)
                    self._forget()
        return True

    def check_place(self) -> None:
        """Raise `InputError` if there is no folder for the store to be in."""
        parent = Path(os.path.realpath(self.address)).parent
        if not parent.is_dir():
            raise InputError(f"'{self.address}' as a store: no folder '{parent}'", "a folder that exists", "-o study.zarr")

    def begun(self) -> bool:
        """Whether there is anything to resume."""
        return any((Path(self.address) / copy).exists() for copy in COPIES)

    def _no_study(self, path: Path) -> InputError:
        """What a folder without a whole copy of its descriptions is."""
        try:
            attributes = json.loads((path / "zarr.json").read_bytes())["attributes"]
            ours, number = attributes["title"] == TITLE, attributes.get("format", 1)
        except (OSError, ValueError, TypeError, KeyError, AttributeError):
            ours, number = (path / RECORD).is_dir(), FORMAT
        if not ours:
            return InputError(f"'{path}' is no study", "the folder of a study, or a name that is not taken", "-o study.zarr")
        if number != FORMAT:
            what = f"'{path}' is a store of format {number}, which has no checksums, and not of format {FORMAT}"
            return InputError(what, "the version of scissordyn that made it, or xarray.open_zarr", "-o another.zarr")
        what = f"both copies of the descriptions in '{path}/{RECORD}' are damaged"
        return InputError(what, "one that is whole, as from a backup; xarray.open_zarr reads the arrays", "-o another.zarr")

    @property
    def group(self) -> zarr.Group:
        """The root group."""
        if self._group is None:
            zarr = library("zarr", "study", "a study")
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
        """Write the arrays' descriptions; nothing is computed yet."""
        attributes = {
            "title": TITLE,
            "format": FORMAT,
            "study": json.dumps(study.to_plain()),
            "fingerprint": study.fingerprint(),
            "block": block,
            "samples": study.sampling.samples,
            "members": study.members,
        }
        target = Path(os.path.realpath(self.address))
        # a process that is killed here leaves no half of a store; nobody else has a folder of this name
        beside = target.parent / f".{secrets.token_hex(16)}.part"
        with _said(self.address), _removed_after_error(beside):
            by_case = write_layout(beside, study, pilot, block, attributes)
            keep(beside, (*by_case, NOTED))
            os.rename(beside, target)
            self._forget()

    def study(
        self, *, allow_code: Sequence[Path] = (), own_measures: Sequence[OwnMeasure] = (), reading: bool = False
    ) -> Study:
        """The study that the store is of."""
        plain = json.loads(str(self.group.attrs["study"]))
        return Study.from_plain(plain, allow_code=allow_code, own_measures=own_measures, reading=reading)

    def design(self) -> Design:
        """The design, with the number of points that it has by now."""
        return Design(**json.loads(str(self.group.attrs["study"]))["design"])

    def check(self, study: Study) -> None:
        """Raise `InputError` if the store is of another study, or of the same with another version of the program."""
        differs = self.differs(study.fingerprint())
        if differs:
            raise InputError(
                f"'{self.address}' holds another study (differs in {', '.join(differs)})",
                "the store of the same study, or a name that is not taken",
                "-o another.zarr",
            )

    def differs(self, fingerprint: Mapping[str, str]) -> list[str]:
        """In what a study or a program differs from those that the store was begun with."""
        there: Mapping[str, str] = self.group.attrs["fingerprint"]
        return [name for name, digest in fingerprint.items() if there.get(name) != digest]

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
        """Status of every case, shape (cases,); those of a block that is not whole are pending."""
        found = np.full(self.cases, PENDING, np.int8)
        faults = self._faults()
        with _said(self.address):
            for part in self._whole_ranges(faults):
                found[part] = self.group["status"][part]
        return found

    def damage(self) -> dict[int, str]:
        """Blocks that were written and are not whole, and why; their cases count as pending."""
        return {block: why for block, why in enumerate(self._faults()) if why}

    def _faults(self) -> list[str | None]:
        with _said(self.address):
            return [self._fault(block) for block in range(-(-self.cases // self.block))]

    def _fault(self, block: int) -> str | None:
        return fault(Path(self.address), block, self._by_case, self._program)

    @cached_property
    def _by_case(self) -> dict[str, int]:
        """Names and numbers of dimensions of the arrays along the cases."""
        return dict(self.group.attrs["arrays"])

    @cached_property
    def _program(self) -> str:
        return program_digest(self.group.attrs["fingerprint"])

    def _whole_ranges(self, faults: list[str | None]) -> Iterator[slice]:
        """Cases of whole blocks, as many in one piece as there are."""
        whole = np.array([why is None for why in faults] + [False])
        ends = np.flatnonzero(np.diff(np.concatenate([[False], whole])))
        for first, last in zip(ends[::2], ends[1::2], strict=True):
            yield slice(int(first) * self.block, min(int(last) * self.block, self.cases))

    def cases_of(self, block: int) -> tuple[np.ndarray, np.ndarray]:
        """Numbers and status of the cases of a block; all are pending if it is not whole."""
        first, size = block * self.block, int(self._array("status").shape[0])
        cases = np.arange(first, min(first + self.block, size))
        with _said(self.address):
            if self._fault(block) is not None:
                return cases, np.full(cases.size, PENDING, np.int8)
            return cases, np.asarray(self._array("status")[cases[0] : cases[-1] + 1])

    def write(
        self,
        cases: np.ndarray,
        columns: Mapping[str, np.ndarray],
        status: np.ndarray,
        times: Sequence[float],
        program: str | None = None,
    ) -> None:
        """Write the results of cases of one block: the status is the last of the arrays, then all is sealed."""
        block, folder = int(cases[0]) // self.block, Path(self.address)
        with _said(self.address):
            if self._fault(block) is not None:
                make_room(folder, block, self._by_case)
            for name, values in columns.items():
                self._set(name, cases, values)
            self._set_times(block, times)
            self._set("status", cases, status)
            seal(folder, block, self._by_case, self._program if program is None else program)

    def _set_times(self, block: int, times: Sequence[float]) -> None:
        noted, path = self._array(NOTED), chunk_file(Path(self.address), NOTED, 2, block)
        try:
            before = np.asarray(noted[block])
        except Exception:  # a broken chunk: the libraries of codecs raise whatever they like
            before = np.zeros((1, len(TIMES)))
            clear_way(Path(self.address), path)
        noted[block] = before + np.array([*times, 1.0])

    def _set(self, name: str, cases: np.ndarray, values: np.ndarray) -> None:
        array, first, last = self._array(name), int(cases[0]), int(cases[-1]) + 1
        if last - first != cases.size:  # those between stay as they are
            every = np.array(array[first:last])
            every[cases - first] = values
            values = every
        array[first:last] = values

    def times(self) -> dict[str, np.ndarray]:
        """Seconds, seconds of integration, cases and attempts of every block; zero where they cannot be read."""
        array = self.group[NOTED]
        noted = np.zeros(array.shape)
        try:
            noted[:] = array[:]
        except Exception:  # one chunk is broken
            for block in range(noted.shape[0]):
                with suppress(Exception):
                    noted[block] = array[block]
        return dict(zip(TIMES, noted.T, strict=True))

    def extend(self, study: Study) -> None:
        """Make room for more points of the same design."""
        with _said(self.address):
            root = self.group
            for name in self._by_case:
                array = self._array(name)
                array.resize((study.cases, *array.shape[1:]))
            self._array(NOTED).resize((-(-study.cases // self.block), len(TIMES)))
            root.attrs["study"] = json.dumps(study.to_plain())
            consolidate(root)
            keep(Path(self.address), (*self._by_case, NOTED))  # until here it is the study that it was
            self._forget()

    # --- reading --------------------------------------------------------------------------------------------------------

    def results(self) -> xr.Dataset:
        """All arrays, in memory, with the point, sample and member of each case.

        Cases of blocks that are not whole are pending and without values; the attribute `damage` says which, if there are any.
        """
        faults = self._faults()
        with _said(self.address):
            lazy = xr.open_zarr(self.address, chunks=None, consolidated=True)  # whatever else lies in the folder
            whole = list(self._whole_ranges(faults))
            found: xr.Dataset = lazy.assign({name: self._readable(lazy[name], whole) for name in self._by_case}).load()
        if damaged := {block: why for block, why in enumerate(faults) if why}:
            found.attrs["damage"] = damage_text(damaged, self.block)
        per_point = int(found.attrs["samples"]) * int(found.attrs["members"])
        point, rest = np.divmod(np.arange(found.sizes["case"]), per_point)
        sample, member = np.divmod(rest, int(found.attrs["members"]))
        found = found.set_coords([name for name in (COMPONENT_UNIT,) if name in found])
        return found.assign_coords(point=("case", point), sample=("case", sample), member=("case", member))

    @staticmethod
    def _readable(lazy: xr.DataArray, whole: Sequence[slice]) -> xr.Variable:
        """An array along the cases with the values of whole blocks, and its fill value elsewhere."""
        variable, fill = lazy.variable, {"f": np.nan, "i": PENDING}.get(lazy.dtype.kind, "")
        if len(whole) == 1 and whole[0] == slice(0, lazy.sizes["case"]):
            return variable
        kind = lazy.dtype if lazy.dtype.kind in "fi" else object
        values = np.full(variable.shape, fill, kind)
        for part in whole:
            values[part] = variable[part].values
        return xr.Variable(variable.dims, values, variable.attrs)

    @contextmanager
    def alone(self) -> Iterator[None]:
        """No other process hands out blocks of this store meanwhile; it exists, or nothing is done."""
        if self._held:
            yield
            return
        path = Path(self.address) / RECORD / "lock"
        with _said(self.address):
            clear_way(Path(self.address), path)
            path.parent.mkdir(exist_ok=True)
            handle = os.open(path, os.O_CREAT | os.O_RDWR, 0o666)
        try:
            if not hold(handle):
                raise InputError(f"'{self.address}' is being computed by another process", "one at a time")
            self._held = True
            try:
                yield
            finally:
                self._held = False
        finally:
            os.close(handle)  # the file stays: another process may have opened it by now


def damage_text(damaged: Mapping[int, str], block: int) -> str:
    """Blocks that are not whole, in words."""
    shown = [f"{number} (cases {number * block} to {(number + 1) * block - 1}: {why})" for number, why in damaged.items()]
    more = [f"{len(shown) - SHOWN} more"] if len(shown) > SHOWN else []
    verb = "block is" if len(shown) == 1 else "blocks are"
    return f"{len(shown)} {verb} damaged or not whole, and pending: {', '.join(shown[:SHOWN] + more)}"


@contextmanager
def _removed_after_error(folder: Path) -> Iterator[None]:
    try:
        yield
    except BaseException:
        shutil.rmtree(folder, ignore_errors=True)
        raise


@contextmanager
def _said(address: str) -> Iterator[None]:
    """Errors of the disk as one line."""
    try:
        yield
    except OSError as error:
        reason = error.strerror or str(error) or type(error).__name__
        raise StoreError(f"'{address}' cannot be read or written: {reason}; what is complete is kept") from error
