"""Checkpoints of long runs: a file with the whole state of a driver, from which the run continues bit for bit."""

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

TITLE = "scissordyn checkpoint"  # Attribute `title` of a checkpoint file

EXAMPLE = "-o run.nc --checkpoint '60 s'"  # Correct command-line options for a checkpoint, which error texts show


@dataclass(frozen=True)
class Checkpoint:
    """File that regularly stores the state of a long run; the same run, started again, continues from it.

    Parameters
    ----------
    path : path
        The file. It must not exist, or be a checkpoint with the same description, options and package version.
    every : float
        Time on the clock between two checkpoints [s]; 0 writes one after each slice of about a tenth of a second.
    keep : bool
        Keep the file when the run is complete. The file of an interrupted run is always kept.
    """

    path: str | os.PathLike[str]
    every: Annotated[float, Quantity("s", minimum=0.0, maximum=1e7, help="time between two checkpoints")] = 60.0
    keep: bool = False

    def __post_init__(self) -> None:
        check_quantities(self)

    def remove(self) -> None:
        """Remove the file if it exists."""
        Path(self.path).unlink(missing_ok=True)


class Part(NamedTuple):
    """State of one computation of a run, for example of the run itself or of its repetition at a tighter tolerance."""

    content: bytes  # the driver's arrays by name, as written by `numpy.savez`
    seconds: float  # computing time so far [s]


@dataclass
class Keeper:
    """Checkpoint file of a run, with the states of all its computations."""

    checkpoint: Checkpoint
    attributes: Mapping[str, str]  # attributes of the file; a file with other attributes belongs to another run
    parts: dict[str, Part] = field(default_factory=dict)  # states as last written or read
    last: float = field(default_factory=clocks.monotonic)  # clock time of the last write or read [s]
    problem: str = ""  # reason why a checkpoint could not be written, or ""

    def restore(
        self, name: str, driver: Driver, progress: Callable[[float], None] | None
    ) -> tuple[float, Callable[[float], None]]:
        """Restore a part's state into its driver, if the file has one.

        Return the clock time [s] at which the computation would have started without interruption, and a progress function.
        This function calls `progress` and writes a checkpoint when one is due.
        """
        began = clocks.perf_counter()
        if name in self.parts:
            part = self.parts[name]
            began -= part.seconds
            try:
                with np.load(io.BytesIO(part.content)) as arrays:
                    driver.load_arrays(dict(arrays))
            except (InputError, KeyError, ValueError) as error:
                raise _refused(self.checkpoint.path, f"does not fit this run ({error})") from None

        def keep(time: float) -> None:
            if clocks.monotonic() - self.last >= self.checkpoint.every:
                self.write(name, driver, clocks.perf_counter() - began)
            if progress is not None:
                progress(time)

        return began, keep

    def write(self, name: str, driver: Driver, seconds: float) -> None:
        """Write all parts to the file; update the part `name` from its driver first. A failure is stored in `problem`."""
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
        except InputError as error:  # a full disk must not end the run
            self.problem = error.what

    def finish(self) -> None:
        if not self.checkpoint.keep:
            self.checkpoint.remove()


def open_checkpoint(checkpoint: Checkpoint, configuration: str) -> Keeper:
    """Return the keeper of a run's checkpoints, with the parts that its file holds already."""
    keeper = Keeper(checkpoint, {"configuration": configuration, "versions": provenance()})
    check_target(checkpoint.path, sample=EXAMPLE)
    folder = Path(checkpoint.path).absolute().parent
    if not folder.is_dir():
        raise InputError(
            f"cannot write '{checkpoint.path}': no folder '{folder}'", "a file name in a folder that exists", EXAMPLE
        )
    if Path(checkpoint.path).exists() and os.stat(checkpoint.path).st_size:
        keeper.parts = _read(checkpoint.path, keeper.attributes)
    return keeper


def _read(path: str | os.PathLike[str], expected: Mapping[str, str]) -> dict[str, Part]:
    """Return the parts in a file; raise `InputError` if they belong to another run."""
    from scissordyn.record.store import load

    stored = load(path)
    if stored.attrs.get("title") != TITLE:
        raise _refused(path, f"is a '{stored.attrs.get('title')}'")
    for name, text in expected.items():
        stored_text = stored.attrs.get(name)
        if not isinstance(stored_text, str) or stored_text != text:
            raise _refused(path, f"belongs to another run: {_difference(stored_text, text, name)}")
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


def _refused(path: str | os.PathLike[str], reason: str) -> InputError:
    return InputError(
        f"the checkpoint '{path}' {reason}", "the checkpoint of the same case, options and version, or none", f"rm '{path}'"
    )


def _difference(stored_text: Any, expected_text: str, name: str) -> str:
    """Return the first difference between two JSON or TOML texts."""
    try:
        stored, expected = (
            json.loads(text) if text.startswith("{") else tomllib.loads(text) for text in (stored_text, expected_text)
        )
    except (AttributeError, TypeError, ValueError):
        return f"its {name} cannot be read"
    if stored == expected:
        return f"its {name} is written in another form"
    place, stored_value, expected_value = first_difference(stored, expected, name)
    return f"{place} = {_short(stored_value)} in the checkpoint, {_short(expected_value)} in this run"


def _short(value: Any) -> str:
    text = json.dumps(value)
    return text if len(text) <= 40 else f"{text[:37]}..."
