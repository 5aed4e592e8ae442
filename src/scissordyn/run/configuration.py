"""What a saved run says of itself: the one reader and the one writer of the attribute "configuration"."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import Any

from scissordyn.annotation import is_number, shown
from scissordyn.errors import InputError
from scissordyn.lookup import offered
from scissordyn.model.mechanism import Mechanism
from scissordyn.model.options import Options
from scissordyn.run.results import Run

ATTRIBUTE = "configuration"

TITLE = "scissordyn run"  # Of what `simulate` returns; a map or a diagram has a configuration too, and is not run again from it


@dataclass(frozen=True)
class Configuration:
    """What a saved run says of itself: a case file. Reading it executes nothing."""

    text: str
    mechanism: Mechanism  # Its facts; classes of the user's are only named. `build_mechanism` has them
    options: Options | None = None  # How it was simulated; None where the file does not say
    diagram: Mapping[str, Any] = field(default_factory=lambda: MappingProxyType({}))  # Further entries of a bifurcation diagram
    absent: tuple[Any, ...] = ()  # Components of the user's, which are not in the mechanism

    @property
    def mechanism_text(self) -> str:
        """The tables of the mechanism alone, to compare."""
        return self.text.partition("\n[run]\n")[0].partition("\n[diagram]\n")[0].rstrip()

    def build_mechanism(self, allow_code: str | os.PathLike[str] | Sequence[str | os.PathLike[str]] = ()) -> Mechanism:
        files = [allow_code] if isinstance(allow_code, str | os.PathLike) else allow_code
        return read_mechanism(self.text, [Path(file) for file in files])


def read_mechanism(text: str, allow_code: Sequence[Path] = ()) -> Mechanism:
    mechanism: Mechanism = offered("read_record")(str(text), allow_code).mechanism
    return mechanism


def is_run(data: Run) -> bool:
    """Whether `simulate` made it."""
    return data.attrs.get("title") == TITLE


def read_configuration(run: Run) -> Configuration:
    text = run.attrs.get(ATTRIBUTE)
    if not isinstance(text, str):
        raise InputError(f"a dataset without the attribute '{ATTRIBUTE}'", "a Dataset that scissordyn made")
    configuration: Configuration = offered("read_facts")(text)
    return configuration


def number_attribute(run: Run, name: str) -> float:
    value = run.attrs.get(name)
    if not is_number(value):
        raise InputError(f"a dataset whose attribute '{name}' is {shown(value)}", "a number, as scissordyn writes it")
    return float(value)  # type: ignore[arg-type]


def write_configuration(
    mechanism: Mechanism,
    options: Options | None = None,
    *,
    diagram: Mapping[str, str | int | float | bool] | None = None,
) -> str:
    """The attribute "configuration" of a run: a case file."""
    text: str = offered("record_text")(mechanism, options, diagram)
    return text
