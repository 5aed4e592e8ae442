"""Sections of a study's answers: sentences, a table and notes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass


@dataclass(frozen=True)
class Section:
    """A part of the answers; a last column "command" of its table has commands that can be typed."""

    head: tuple[str, ...] = ()
    rows: Sequence[tuple[str, ...]] = ()
    title: str = ""
    notes: tuple[str, ...] = ()  # Sentences below the table
    lines: Sequence[object] = ()  # Sentences above the table
