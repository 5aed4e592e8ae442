"""Sections of a study's answers: sentences, a table and notes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass


@dataclass(frozen=True)
class Section:
    """A part of the answers; the last column of its table may be "command", what can be typed."""

    head: tuple[str, ...] = ()
    rows: Sequence[tuple[str, ...]] = ()
    title: str = ""
    notes: tuple[str, ...] = ()  # Sentences below the table
    lines: Sequence[object] = ()  # Above it
