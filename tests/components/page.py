"""The parts of docs/components.md."""

import re
from pathlib import Path

from scissordyn.components.catalogue import COMPONENTS

PAGE = Path(__file__).parents[2] / "docs" / "components.md"  # Documentation page of the components
SECTIONS = tuple(section for section in COMPONENTS if section not in ("actuator", "flexible_bar"))
"""Sections of components with a table of their own; [control] describes an actuator, [[bending]] a flexible bar."""


def outputs(section):
    """Return the line of the page on the variables that a component adds to a run."""
    return next(line for line in parts()[heading(section)].splitlines() if line.startswith("Outputs: "))


def parts():
    """Return the sections of the page by heading."""
    pieces = re.split(r"^## (.*)$", PAGE.read_text(encoding="utf-8"), flags=re.MULTILINE)
    return dict(zip(pieces[1::2], pieces[2::2], strict=True))


def snippets(text, language="toml"):
    """Return the blocks of code in a language."""
    return re.findall(rf"^```{language}\n(.*?)^```", text, flags=re.MULTILINE | re.DOTALL)


def heading(section):
    """Return the heading of a component."""
    return f"`[[{section}]]`"
