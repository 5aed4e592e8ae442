"""What a saved run says of itself: the one reader and the one writer of the attribute "configuration"."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import Any

from scissordyn.annotation import is_number, shown
from scissordyn.errors import InputError
from scissordyn.model.description import Description, build, from_plain, parse
from scissordyn.model.mechanism import Mechanism
from scissordyn.model.record import to_plain
from scissordyn.run.options import Options
from scissordyn.run.results import Run

ATTRIBUTE = "configuration"

TITLE = "scissordyn run"
"""Of what `simulate` returns; a map or a diagram has a configuration too, and is not run again from it."""

ENTRIES = ("mechanism", "options", "diagram")


@dataclass(frozen=True)
class Configuration:
    """What a saved run says of itself, compared with the declarations. Reading it executes nothing."""

    mechanism: Description  # The mechanism as it was described. `build_mechanism` makes it; its facts can be read without
    plain: Mapping[str, Any]  # The same as plain data, to compare with `model.record.to_plain`
    options: Options | None = None  # How it was simulated; None where the file does not say
    diagram: Mapping[str, Any] = field(default_factory=lambda: MappingProxyType({}))  # Further entries of a bifurcation diagram

    def build_mechanism(self, allow_code: str | os.PathLike[str] | Sequence[str | os.PathLike[str]] = ()) -> Mechanism:
        """The mechanism itself."""
        files = [allow_code] if isinstance(allow_code, str | os.PathLike) else allow_code
        mechanism: Mechanism = build(self.mechanism, allow_code=[Path(file) for file in files])
        return mechanism


def is_run(data: Run) -> bool:
    """Whether `simulate` made it."""
    return data.attrs.get("title") == TITLE


def read_configuration(run: Run) -> Configuration:
    """What a saved run says of itself."""
    text = run.attrs.get(ATTRIBUTE)
    if not isinstance(text, str):
        raise InputError(f"a dataset without the attribute '{ATTRIBUTE}'", "a Dataset that scissordyn made")
    try:
        plain = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise InputError(f"the attribute '{ATTRIBUTE}' is not whole JSON: {error}", "a Dataset that scissordyn made") from None
    if not isinstance(plain, dict) or "mechanism" not in plain:
        raise InputError(f"the attribute '{ATTRIBUTE}' describes no mechanism", "a Dataset that scissordyn made of one")
    unknown = plain.keys() - set(ENTRIES)
    if unknown:
        raise InputError(f"the attribute '{ATTRIBUTE}' has '{min(unknown)}'", ", ".join(ENTRIES))
    diagram, options = plain.get("diagram", {}), plain.get("options")
    if not isinstance(diagram, dict) or not all(isinstance(value, str | int | float | bool) for value in diagram.values()):
        raise InputError("diagram is not a table of texts and numbers", "what scissordyn writes there")
    return Configuration(
        mechanism=parse(plain["mechanism"], Mechanism),
        plain=MappingProxyType(plain["mechanism"]),
        options=None if options is None else from_plain(options, Options),
        diagram=MappingProxyType(diagram),
    )


def number_attribute(run: Run, name: str) -> float:
    """An attribute of a run that is a number."""
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
    """The attribute "configuration" of a run."""
    plain: dict[str, Any] = {}
    if options is not None:
        plain["options"] = to_plain(options)
    if diagram is not None:
        plain["diagram"] = dict(diagram)
    rest = json.dumps(plain)
    return f'{{"mechanism": {json.dumps(to_plain(mechanism))}{", " if plain else ""}{rest[1:]}'
