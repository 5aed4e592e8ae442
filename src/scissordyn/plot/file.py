"""Pictures on disk, written whole or not at all."""

from __future__ import annotations

import io
import os
from pathlib import Path

import matplotlib as mpl
from matplotlib.figure import Figure

from scissordyn.errors import InputError, did_you_mean
from scissordyn.file.output_file import check_target, write_file

FORMATS = ("png", "svg", "pdf")

DPI = 150
"""Dots per inch of a PNG."""


def check_format(format: str) -> None:
    """Raise `InputError` if pictures cannot be written in a format."""
    if format not in FORMATS:
        raise InputError(f"picture format '{format}'{did_you_mean(format, FORMATS)}", ", ".join(FORMATS), "format='png'")


def write(figure: Figure, path: str | os.PathLike[str]) -> Path:
    """Write a figure to a file in the format of its ending; the same figure gives the same file."""
    target = Path(path)
    format = target.suffix.lower().removeprefix(".")
    check_format(format)
    drawn = _drawn(figure, format)
    check_target(target, sample=f"picture.{format}")
    return write_file(target, drawn, sample=f"picture.{format}")


def svg(figure: Figure) -> str:
    """The text of the SVG file of a figure."""
    return _drawn(figure, "svg").decode()


def _drawn(figure: Figure, format: str) -> bytes:
    """The content of a picture file."""
    drawn = io.BytesIO()
    # without these a vector file would carry the date and random names
    with mpl.rc_context({"svg.hashsalt": "scissordyn"}):
        dated = {"svg": {"Date": None}, "pdf": {"CreationDate": None}}
        figure.savefig(drawn, format=format, dpi=DPI, metadata=dated.get(format))
    return drawn.getvalue()
