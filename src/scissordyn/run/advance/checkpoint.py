"""Checkpoints of long runs: the whole state of a driver in a file, from which the same run goes on bit for bit."""

from __future__ import annotations

import hashlib
import io
import json
import os
import time as clocks
import tomllib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any, NamedTuple

import numpy as np

from scissordyn.errors import InputError
from scissordyn.file.output_file import check_target
from scissordyn.file.provenance import provenance
from scissordyn.model.record import DIGEST, first_difference
from scissordyn.run.advance.driver import Driver
from scissordyn.units import Quantity, check_quantities

TITLE = "scissordyn checkpoint"

SAMPLE = "-o run.nc --checkpoint '60 s'"


@dataclass(frozen=True)
class Checkpoint:
    """Where a long run keeps its state, and how often: the same run, started again, goes on from there.

    Parameters
    ----------
    path : path
        Of the file. It must be absent, or a checkpoint of the same description, options and version of the package.
    every : float
        Time on the clock between two checkpoints [s]; with 0 after each slice of about a tenth of a second.
    keep : bool
        Whether the file stays when the run is over; it is removed otherwise. One that is interrupted is kept in any case.
    """

    path: str | os.PathLike[str]
    every: Annotated[float, Quantity("s", minimum=0.0, maximum=1e7, help="time between two checkpoints")] = 60.0
    keep: bool = False

    def __post_init__(self) -> None:
        check_quantities(self)

    def remove(self) -> None:
        """Remove the file if it is there."""
        Path(self.path).unlink(missing_ok=True)


class Part(NamedTuple):
    """One computation of a run, such as the run itself or its repetition at a tighter tolerance."""

    content: bytes  # The arrays of its driver by name, as `numpy.savez` writes them
    seconds: float  # How long it has been computed [s]


@dataclass
class Keeper:
    checkpoint: Checkpoint
    attributes: Mapping[str, str]  # Of the file; a file with others is of another run
    parts: dict[str, Part] = field(default_factory=dict)  # As they were last written or read
    last: float = field(default_factory=clocks.monotonic)  # When that was [s]
    problem: str = ""  # Why a checkpoint could not be written; empty if all could

    def take_up(
        self, name: str, driver: Driver, progress: Callable[[float], None] | None
    ) -> tuple[float, Callable[[float], None]]:
        """Put the state of a part into its driver, if there is one: since when it would have been computed at one stretch.

        Also a function of the simulated time that calls `progress`, and writes a checkpoint when it is time for one.
        """
        began = clocks.perf_counter()
        if name in self.parts:
            part = self.parts[name]
            began -= part.seconds
            try:
                with np.load(io.BytesIO(part.content)) as arrays:
                    driver.take_up(dict(arrays))
            except (InputError, KeyError, ValueError) as error:
                raise _refused(self.checkpoint.path, f"does not fit this run ({error})") from None

        def keep(time: float) -> None:
            if clocks.monotonic() - self.last >= self.checkpoint.every:
                self.write(name, driver, clocks.perf_counter() - began)
            if progress is not None:
                progress(time)

        return began, keep

    def write(self, name: str, driver: Driver, seconds: float) -> None:
        """Write all parts, this one as its driver is now; if that fails, `problem` says why."""
        import xarray as xr  # takes longer to import than most runs

        from scissordyn.record.store import save

        stream = io.BytesIO()
        np.savez(stream, **driver.arrays())  # type: ignore[arg-type]  # its keywords are arrays
        self.parts[name] = Part(stream.getvalue(), seconds)
        variables = {
            key: ((f"byte_of_{key}",), np.frombuffer(part.content, np.uint8), {"long_name": "state", "seconds": part.seconds})
            for key, part in self.parts.items()
        }
        about = {"title": TITLE, **self.attributes, DIGEST: _digest(self.parts), "reached": driver.time}
        self.last = clocks.monotonic()
        try:
            save(xr.Dataset(variables, attrs=about), self.checkpoint.path)
        except InputError as error:  # a full disk is no reason to lose the run itself
            self.problem = error.what

    def finish(self) -> None:
        if not self.checkpoint.keep:
            self.checkpoint.remove()


def open_checkpoint(checkpoint: Checkpoint, configuration: str) -> Keeper:
    """What keeps the checkpoints of a run, with those that its file holds already."""
    keeper = Keeper(checkpoint, {"configuration": configuration, "versions": provenance()})
    check_target(checkpoint.path, sample=SAMPLE)
    folder = Path(checkpoint.path).absolute().parent
    if not folder.is_dir():
        raise InputError(
            f"cannot write '{checkpoint.path}': no folder '{folder}'", "a file name in a folder that exists", SAMPLE
        )
    if Path(checkpoint.path).exists() and os.stat(checkpoint.path).st_size:
        keeper.parts = _read(checkpoint.path, keeper.attributes)
    return keeper


def _read(path: str | os.PathLike[str], wanted: Mapping[str, str]) -> dict[str, Part]:
    """The parts in a file, if they are of the run that is wanted."""
    from scissordyn.record.store import load

    stored = load(path)
    if stored.attrs.get("title") != TITLE:
        raise _refused(path, f"is a '{stored.attrs.get('title')}'")
    for name, text in wanted.items():
        there = stored.attrs.get(name)
        if not isinstance(there, str) or there != text:
            raise _refused(path, f"is of another run: {_difference(there, text, name)}")
    try:
        parts = {
            str(key): Part(part.values.astype(np.uint8, casting="no").tobytes(), float(part.attrs["seconds"]))
            for key, part in stored.variables.items()
        }
    except (KeyError, TypeError, ValueError):
        parts = {}
    if str(stored.attrs.get(DIGEST)) != _digest(parts):
        raise _refused(path, "is damaged")
    return parts


def _digest(parts: Mapping[str, Part]) -> str:
    digest = hashlib.sha256()
    for name, part in sorted(parts.items()):
        digest.update(f"{name} {part.seconds!r} ".encode("utf-8", "surrogateescape"))
        digest.update(part.content)
    return digest.hexdigest()


def _refused(path: str | os.PathLike[str], why: str) -> InputError:
    return InputError(
        f"the checkpoint '{path}' {why}", "the checkpoint of the same case, options and version, or none", f"rm '{path}'"
    )


def _difference(there: Any, here: str, name: str) -> str:
    """The first place at which two JSON texts differ."""
    try:
        stored, wanted_text = (json.loads(text) if text.startswith("{") else tomllib.loads(text) for text in (there, here))
    except (AttributeError, TypeError, ValueError):
        return f"its {name} cannot be read"
    if stored == wanted_text:
        return f"its {name} is written otherwise"
    place, mine, wanted = first_difference(stored, wanted_text, name)
    return f"{place} = {_short(mine)} there, {_short(wanted)} here"


def _short(value: Any) -> str:
    text = json.dumps(value)
    return text if len(text) <= 40 else f"{text[:37]}..."
