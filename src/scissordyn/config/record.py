"""What a run carries, read again: its mechanism, how it was simulated, and without its code the facts."""

from __future__ import annotations

import tomllib
from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any

from scissordyn.config.case import RecordTable
from scissordyn.config.code import AbsentCode, AbsentPart, AllowedCode, Code
from scissordyn.config.table import instance
from scissordyn.errors import InputError
from scissordyn.run.configuration import Configuration

WRITTEN = "a Dataset that scissordyn made"

NOT_WRITTEN = {"control", "payload", "panels", "bending", "joint_friction"}
"""Tables that are computed with; a run has the bodies and components that they make."""


@lru_cache(maxsize=16)
def read_facts(text: str) -> Configuration:
    """What a run says of itself; nothing is executed."""
    return _read(text, lambda digests: AbsentCode(None, digests))


def read_record(text: str, allow_code: Sequence[Path] = ()) -> Configuration:
    """What a run says of itself, with its parts of classes of the user's in files that may be executed."""
    return _read(text, lambda digests: AllowedCode(allow_code, digests))


def _read(text: str, code: Any) -> Configuration:
    if not text.strip():
        raise InputError("an empty attribute 'configuration'", WRITTEN)
    if text.startswith("{"):
        raise InputError(
            "a mechanism in JSON, which an earlier version of scissordyn wrote",
            f"{WRITTEN}, or that version: git checkout d1bea37c",
        )
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
