"""Pictures on disk, written whole or not at all."""

from __future__ import annotations

import io
import os
from pathlib import Path

import matplotlib as mpl
from matplotlib.figure import Figure

from scissordyn.errors import InputError, did_you_mean

__all__ = ["DPI", "FORMATS", "check_format", "write"]

FORMATS = ("png", "svg")

DPI = 150
"""Dots per inch of a PNG."""


def check_format(format: str) -> None:
    """Raise `InputError` if pictures cannot be written in a format.

    Parameters
    ----------
    format : str
    """
    if format not in FORMATS:
        raise InputError(f"picture format '{format}'{did_you_mean(format, FORMATS)}", " or ".join(FORMATS), "format='png'")


def write(figure: Figure, path: str | os.PathLike[str]) -> Path:
    """Write a figure to a file in the format of its ending; the same figure gives the same file.

    Parameters
    ----------
    figure : Figure
    path : path
        Ends in .png or .svg.

    Returns
    -------
    Path

    Raises
    ------
    InputError
        If the ending is another one, or the file cannot be written.
    """
    target = Path(path)
    format = target.suffix.lower().removeprefix(".")
    check_format(format)
    drawn = io.BytesIO()
    # without these a vector file would carry the date and random names
    with mpl.rc_context({"svg.hashsalt": "scissordyn"}):
        figure.savefig(drawn, format=format, dpi=DPI, metadata={"Date": None} if format == "svg" else None)
    part = target.with_name(f".{target.name}.{os.getpid()}.part")
    try:
        try:
            part.write_bytes(drawn.getvalue())
            part.replace(target)
        finally:
            part.unlink(missing_ok=True)
    except OSError as error:
        raise InputError(
            f"cannot write '{target}': {error.strerror or error}", "a file name in a folder that can be written"
        ) from None
    return target
