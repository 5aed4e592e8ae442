"""Read and write the attribute "configuration" of a run: the text of its case file."""

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
from scissordyn.casefile.structure import FeedForward
from scissordyn.casefile.table import instance, make_table
from scissordyn.components.actuator import Actuator
from scissordyn.errors import InputError
from scissordyn.model.mechanism import Mechanism
from scissordyn.model.options import Options
from scissordyn.plugin.element import is_built_in

ATTRIBUTE = "configuration"  # Attribute of a run's Dataset that contains its case file

EXPECTED_DATASET = "a Dataset that scissordyn returned"  # Expected value in errors about Datasets from other programs

TABLES_WITHOUT_RECORD = {"control", "payload", "panels", "bending", "joint_friction"}
"""Names of case file tables that a run does not store; it stores the bodies and components that they create."""

# Title of the Dataset of a run; maps and diagrams have other titles, and cannot be run again from their configuration
RUN_TITLE = "scissordyn run"


RecordTable = make_table(
    "RecordTable",
    CaseTable,
    {
        "run": (Annotated[Options | None, CaseTable.declared_keys()["run"].reader], None),
        "diagram": (Annotated[Mapping[str, Any], read_values], MappingProxyType({})),
        "ideal": (Annotated[Mapping[str, Any], read_values], MappingProxyType({})),
    },
)
"""Tables of a configuration: those of a case file, where [run] is optional, [diagram] of a bifurcation diagram, and [ideal].

[ideal] marks a mechanism whose clearances were closed, so that couplings which became redundant are left out again.
"""


class HasAttributes(Protocol):
    """Object with attributes: a Dataset, or `Results`."""

    @property
    def attrs(self) -> dict[Any, Any]: ...


@dataclass(frozen=True)
class Configuration:
    """Contents of the case file stored in a run, read without executing code."""

    text: str
    mechanism: Mechanism  # with placeholders for user-defined classes; `build_mechanism` executes their code
    options: Options | None = None  # options of the simulation; None if the file has none
    diagram: Mapping[str, Any] = field(default_factory=lambda: MappingProxyType({}))  # further entries of a bifurcation diagram
    absent: tuple[Any, ...] = ()  # placeholders of user-defined components, which are not in the mechanism

    @property
    def mechanism_text(self) -> str:
        """Text of the tables of the mechanism without options, to compare mechanisms."""
        return self.text.partition("\n[run]\n")[0].partition("\n[diagram]\n")[0].rstrip()

    def build_mechanism(self, allow_code: str | os.PathLike[str] | Sequence[str | os.PathLike[str]] = ()) -> Mechanism:
        files = [allow_code] if isinstance(allow_code, str | os.PathLike) else allow_code
        return read_mechanism(self.text, [Path(file) for file in files])


def read_mechanism(text: str, allow_code: Sequence[Path] = ()) -> Mechanism:
    """Return the mechanism of a configuration; the allowed files with user-defined classes are executed."""
    return _read(str(text), lambda digests: AllowedCode(allow_code, digests)).mechanism


@lru_cache(maxsize=16)
def _facts(text: str) -> Configuration:
    return _read(text, lambda digests: AbsentCode(None, digests))


def _read(text: str, code: Any) -> Configuration:
    if not text.strip():
        raise InputError("the attribute 'configuration' is empty", EXPECTED_DATASET)
    try:
        tree = tomllib.loads(text)
        for section in TABLES_WITHOUT_RECORD & tree.keys():
            raise InputError(f"a run contains the table [[{section}]]", "the tables that scissordyn writes in a run")
        digests = tree.get("code", {})
        chosen: Code = code(digests if isinstance(digests, dict) else {})
        table = instance(RecordTable, tree, {"code": chosen})
        absent = tuple(part for part in table.component if isinstance(part, AbsentPart))
        return Configuration(text, mechanism_of_record(table), table.run, table.diagram, absent)
    except (ValueError, RecursionError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"the attribute 'configuration' is not valid TOML: {error}", EXPECTED_DATASET) from None


def mechanism_of_record(table: Any, feed_forward: FeedForward | None = None) -> Mechanism:
    """Return the mechanism of a `RecordTable`, marked as ideal if its clearances were closed."""
    mechanism: Mechanism = table.mechanism(feed_forward)
    return mechanism.with_parts({"_closed": True}, check=False) if table.ideal.get("clearances_closed") else mechanism


def is_run(data: HasAttributes) -> bool:
    """Return True if a dataset is a run of `simulate`."""
    return data.attrs.get("title") == RUN_TITLE


def read_configuration(run: HasAttributes) -> Configuration:
    text = run.attrs.get(ATTRIBUTE)
    if not isinstance(text, str):
        raise InputError(f"the dataset has no attribute '{ATTRIBUTE}'", EXPECTED_DATASET)
    return _facts(text)


def number_attribute(run: HasAttributes, name: str) -> float:
    value = run.attrs.get(name)
    if not is_number(value):
        raise InputError(f"the attribute '{name}' of the dataset is {shown(value)}", "a number, as scissordyn writes it")
    return float(value)  # type: ignore[arg-type]


def write_configuration(
    mechanism: Mechanism, options: Options | None = None, *, diagram: Mapping[str, str | int | float | bool] | None = None
) -> str:
    """Return the text of the attribute "configuration" for a mechanism and the options of a run or diagram."""
    return record_text(mechanism, options, diagram)


def can_write_later(mechanism: Mechanism) -> bool:
    """Return True if writing the text of a mechanism needs no user-defined code and cannot fail, so that it can wait.

    A mechanism with prescribed distances may fail: not every time function of a distance can be written.
    """
    contacts: list[Any] = [contact.clearance for contact in mechanism.contacts if contact.clearance is not None]
    contacts += [part for part in mechanism.components if part.declaration.contact]
    laws = [law for contact in contacts for law in (contact.stiffness, contact.damping, contact.friction)]
    controllers = [part.controller for part in mechanism.components if isinstance(part, Actuator)]
    timed = mechanism.coordinate_drives or any(rod.motion is not None for rod in mechanism.rods)
    return not timed and all(map(is_built_in, (*mechanism.components, *laws, *controllers)))
