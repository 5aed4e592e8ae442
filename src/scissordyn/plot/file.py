"""Write pictures to files, completely or not at all."""

from __future__ import annotations

import io
import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from scissordyn.errors import InputError, did_you_mean
from scissordyn.file.output_file import check_target, write_file
from scissordyn.plot.style import SIZES, apply_layout, use_minus_signs

FORMATS = ("png", "svg", "pdf")  # File formats of pictures


def check_format(format: str) -> None:
    """Raise `InputError` if the format of a picture is unknown."""
    if format not in FORMATS:
        raise InputError(
            f"unknown picture format '{format}'{did_you_mean(format, FORMATS)}", ", ".join(FORMATS), "format='png'"
        )


def figure_of(drawn: Figure | Axes | Sequence[Axes]) -> Figure:
    """Return the figure of what a plot function returned."""
    picture = drawn[0] if isinstance(drawn, Sequence) else drawn
    figure = picture if isinstance(picture, Figure) else picture.get_figure(root=True)
    assert figure is not None
    return figure


def write(drawn: Figure | Axes | Sequence[Axes], path: str | os.PathLike[str]) -> Path:
    """Write a picture in the format of the file's ending; equal pictures give equal files."""
    target = Path(path)
    format = target.suffix.lower().removeprefix(".")
    check_format(format)
    return write_content(content_of(drawn, format), target)


def content_of(drawn: Figure | Axes | Sequence[Axes], format: str) -> bytes:
    """Return the content of the file of a picture."""
    return contents_of(drawn, (format,))[0]


def write_content(content: bytes, target: Path) -> Path:
    """Write the content of the file of a picture."""
    sample = f"picture{target.suffix.lower()}"
    check_target(target, sample=sample)
    return write_file(target, content, sample=sample)


def svg(drawn: Figure | Axes | Sequence[Axes]) -> str:
    return content_of(drawn, "svg").decode()


def contents_of(drawn: Figure | Axes | Sequence[Axes], formats: Sequence[str]) -> list[bytes]:
    """Return the contents of the files of a picture in several formats, with one layout."""
    figure, files = figure_of(drawn), [io.BytesIO() for _ in formats]
    use_minus_signs(figure)
    # removes the date and random identifiers from vector files
    with mpl.rc_context({"svg.hashsalt": "scissordyn"}), _final_layout(figure):
        dated = {"svg": {"Date": None}, "pdf": {"CreationDate": None}}
        for file, format in zip(files, formats, strict=True):
            figure.savefig(file, format=format, dpi=SIZES.png_dpi, metadata=dated.get(format))
    return [file.getvalue() for file in files]


@contextmanager
def _final_layout(figure: Figure) -> Iterator[None]:
    """Apply the layout of a figure at the resolution of a file, without drawing the figure for it as matplotlib does."""
    engine, dpi = figure.get_layout_engine(), figure.dpi
    if engine is None:
        yield
        return
    figure.dpi = SIZES.png_dpi
    apply_layout(figure)
    # without an engine savefig draws once; a placeholder would make it draw twice
    with mpl.rc_context({"figure.autolayout": False, "figure.constrained_layout.use": False}):
        figure.set_layout_engine(None)
    try:
        yield
    finally:
        figure.set_layout_engine(engine)
        figure.dpi = dpi
