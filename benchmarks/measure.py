"""Comparable times: runs of all candidates alternate in one process, and their medians are compared."""

from __future__ import annotations

import argparse
import os
import platform
import re
import statistics
import textwrap
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import scipy

from scissordyn.kernel import LIBRARY

__all__ = ["DECISIONS", "Times", "command", "fitted_exponent", "interleaved", "machine", "paragraph", "table", "write_section"]

DECISIONS = Path(__file__).parent.parent / "docs" / "decisions"

Measured = Callable[[], float | None]
"""A candidate: a function that returns its time in seconds, or None to be timed from outside."""


@dataclass(frozen=True)
class Times:
    """Times of several runs.

    Parameters
    ----------
    median : float
        Median [s].
    least : float
        Least time, the nearest to an undisturbed machine [s].
    """

    median: float
    least: float


def interleaved(candidates: Mapping[str, Measured], repeats: int) -> dict[str, Times]:
    """Return times of alternating candidates, without the first run of each.

    Parameters
    ----------
    candidates : mapping
    repeats : int

    Returns
    -------
    dict of Times
    """
    found: dict[str, list[float]] = {name: [] for name in candidates}
    for turn in range(repeats + 1):
        for name, run in candidates.items():
            began = time.perf_counter()
            own = run()
            seconds = time.perf_counter() - began
            if turn:
                found[name].append(seconds if own is None else own)
    return {name: Times(statistics.median(values), min(values)) for name, values in found.items()}


def fitted_exponent(size: Sequence[float], cost: Sequence[float]) -> float:
    """Return the slope of log cost over log size."""
    return float(np.polyfit(np.log(size), np.log(cost), 1)[0])


def table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return a Markdown table; the first column is text."""
    width = [max(len(row[k]) for row in (head, *rows)) for k in range(len(head))]
    lines = [
        " | ".join(cell.ljust(width[0]) if k == 0 else cell.rjust(width[k]) for k, cell in enumerate(row))
        for row in (head, *rows)
    ]
    rule = " | ".join("-" * width[k] if k == 0 else "-" * (width[k] - 1) + ":" for k in range(len(head)))
    return "\n".join(f"| {line} |" for line in (lines[0], rule, *lines[1:])) + "\n"


def machine() -> str:
    """Return the machine and the versions that produced the figures."""
    model = platform.processor() or "unknown processor"
    try:
        for line in Path("/proc/cpuinfo").read_text().splitlines():
            if line.startswith("model name"):
                model = line.split(":", 1)[1].strip()
                break
    except OSError:  # not Linux
        pass
    load = f", load {os.getloadavg()[0]:.1f} at the end" if hasattr(os, "getloadavg") else ""
    versions = f"Python {platform.python_version()}, numpy {np.__version__}, scipy {scipy.__version__}"
    return f"{model}, {os.cpu_count()} cores{load}; {versions}; kernels by {_compiler()}."


def _compiler() -> str:
    """Return the C compiler that the kernel library names."""
    content = LIBRARY.read_bytes() if LIBRARY.is_file() else b""
    named = re.search(rb"(GCC): \([^)]*\) ([\d.]+)|(clang) version ([\d.]+)", content)
    return " ".join(part.decode() for part in named.groups() if part) if named else "a C compiler without a name"


def command(name: str, measure: Callable[..., str], options: Mapping[str, Mapping[str, Any]] | None = None) -> None:
    """Run one benchmark from the command line.

    Parameters
    ----------
    name : str
        Name of the page that ``--write`` saves in docs/decisions/measured.
    measure : callable
        Function from `quick`, and the values of further options, to a Markdown page.
    options : mapping, optional
        Arguments of `add_argument` for each further option; ``metavar`` is shown in the page.
    """
    parser = argparse.ArgumentParser(description=f"Measure: {name}.")
    parser.add_argument("--write", action="store_true", help="save the figures in docs/decisions/measured")
    parser.add_argument("--quick", action="store_true", help="fewer and smaller runs")
    typed = f"python -m benchmarks.{name}"
    for option, about in (options or {}).items():
        parser.add_argument(option, **about)
        typed += f" {option} {about['metavar']}"
    given = vars(parser.parse_args())
    writes = given.pop("write")
    page = f"{measure(**given)}\n{machine()}\n"
    print(page)
    if writes:
        folder = DECISIONS / "measured"
        folder.mkdir(parents=True, exist_ok=True)
        text = f"# {name}\n\nWritten by `{typed} --write`.\n\n{page}"
        (folder / f"{name}.md").write_text(text, encoding="utf-8")


def paragraph(*parts: str) -> str:
    """Return parts of a text as one paragraph in lines of 120 characters."""
    return textwrap.fill(" ".join(parts), 120, break_long_words=False, break_on_hyphens=False)


def write_section(page: str, heading: str, typed: str, text: str) -> None:
    """Write a section of a page of docs/decisions/measured; it replaces a section with the same heading.

    Parameters
    ----------
    page, heading : str
    typed : str
        Command that writes it.
    text : str
    """
    path = DECISIONS / "measured" / f"{page}.md"
    path.parent.mkdir(parents=True, exist_ok=True)
    before = path.read_text(encoding="utf-8") if path.exists() else f"# {page}\n"
    first, *sections = re.split(r"^## ", before, flags=re.MULTILINE)
    named = {section.partition("\n")[0]: section for section in sections}
    named[heading] = f"{heading}\n\nWritten by `{typed}`.\n\n{text}"
    path.write_text("\n".join([first.rstrip() + "\n", *(f"## {body.rstrip()}\n" for body in named.values())]), encoding="utf-8")
