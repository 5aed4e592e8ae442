"""A run in a notebook: the page of a film, with its player."""

from __future__ import annotations

from dataclasses import dataclass, field
from html import escape
from typing import TYPE_CHECKING

from scissordyn.errors import InputError
from scissordyn.plot.canvas import SECONDS, packed_scene, page, run_scene
from scissordyn.run.configuration import read_configuration

if TYPE_CHECKING:
    import xarray as xr

HIGH = 520  # Of the frame in a notebook [pixel]


@dataclass(frozen=True)
class View:
    """A film that a notebook shows.

    Parameters
    ----------
    html : str
        Its page.
    """

    html: str = field(repr=False)

    def _repr_html_(self) -> str:
        # a frame keeps the styles and scripts of page and notebook apart
        return f'<iframe srcdoc="{escape(self.html)}" style="width: 100%; height: {HIGH}px; border: 0"></iframe>'


def view(run: xr.Dataset, *, ghost: xr.Dataset | None = None) -> View:
    """The motion of a run in a notebook, with its clearance joints magnified.

    Parameters
    ----------
    run : Dataset
    ghost : Dataset, optional
        Another run, drawn dashed at the same times.

    Returns
    -------
    View
        Jupyter, marimo and whatever else shows HTML display it; `html` is the page, without other files or network access.

    Raises
    ------
    InputError
        If a run has fewer than two samples.
    """
    if any(shown.sizes.get("time", 0) < 2 for shown in (run, ghost) if shown is not None):
        raise InputError("a run of fewer than two samples", "a longer run")
    mechanism = read_configuration(run).build_mechanism()
    other = "" if ghost is None else packed_scene(ghost, read_configuration(ghost).build_mechanism())
    return View(page(run_scene(run, mechanism), run, SECONDS, ghost=other))
