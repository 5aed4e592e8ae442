"""The attribute "configuration" of a saved run, a case file: its reader and its writer."""

from __future__ import annotations

import os
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, Any, Protocol

from scissordyn.annotation import is_number, shown
from scissordyn.casefile.case import CaseTable, read_values
from scissordyn.casefile.case_text import record_text
from scissordyn.casefile.code import AbsentCode, AbsentPart, AllowedCode, Code
from scissordyn.casefile.table import instance, made_table
from scissordyn.errors import InputError
from scissordyn.model.mechanism import Mechanism
from scissordyn.model.options import Options

ATTRIBUTE = "configuration"

WRITTEN = "a Dataset that scissordyn made"

NOT_WRITTEN = {"control", "payload", "panels", "bending", "joint_friction"}
"""Tables of a case file that a run does not contain: it has the bodies and components that they make."""

TITLE = "scissordyn run"  # Of what `simulate` returns; a map or a diagram has a configuration too, and is not run again from it


RecordTable = made_table(
    "RecordTable",
    CaseTable,
    {
        "run": (Annotated[Options | None, CaseTable.declared_keys()["run"].reader], None),
        "diagram": (Annotated[Mapping[str, Any], read_values], MappingProxyType({})),
    },
)
"""The tables of a configuration: those of a case file, [run] optional, and the further entries of a diagram."""


class HasAttributes(Protocol):
    """A Dataset, or results of which no Dataset has been made."""

    @property
    def attrs(self) -> dict[Any, Any]: ...


@dataclass(frozen=True)
class Configuration:
    """The case file that a saved run carries. Reading it executes nothing."""

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
    """The mechanism of a configuration, with user-defined classes from files that may be executed."""
    return _read(str(text), lambda digests: AllowedCode(allow_code, digests)).mechanism


@lru_cache(maxsize=16)
def _facts(text: str) -> Configuration:
    return _read(text, lambda digests: AbsentCode(None, digests))


def _read(text: str, code: Any) -> Configuration:
    if not text.strip():
        raise InputError("an empty attribute 'configuration'", WRITTEN)
    try:
        tree = tomllib.loads(text)
        for section in NOT_WRITTEN & tree.keys():
            raise InputError(f"[[{section}]] in a run", "the tables that scissordyn writes there")
        digests = tree.get("code", {})
        chosen: Code = code(digests if isinstance(digests, dict) else {})
        table = instance(RecordTable, tree, {"code": chosen})
        absent = tuple(part for part in table.component if isinstance(part, AbsentPart))
        return Configuration(text, table.mechanism(), table.run, table.diagram, absent)
    except (ValueError, RecursionError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"the attribute 'configuration' is not whole TOML: {error}", WRITTEN) from None


def is_run(data: HasAttributes) -> bool:
    """Whether `simulate` made it."""
    return data.attrs.get("title") == TITLE


def read_configuration(run: HasAttributes) -> Configuration:
    text = run.attrs.get(ATTRIBUTE)
    if not isinstance(text, str):
        raise InputError(f"a dataset without the attribute '{ATTRIBUTE}'", WRITTEN)
    return _facts(text)


def number_attribute(run: HasAttributes, name: str) -> float:
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
    return record_text(mechanism, options, diagram)
