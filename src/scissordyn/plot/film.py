"""The film of a lubricated joint: thickness, pressure and power lost."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes

from scissordyn.errors import InputError, did_you_mean
from scissordyn.plot.picture import picture
from scissordyn.plot.scale import engineering
from scissordyn.plot.series import Joints, finish, names_of, time_scale, window
from scissordyn.plot.style import BLUE, GREY, LINE, VERMILION, Canvas, legend, literal, panels
from scissordyn.run.answer.film import MIXED
from scissordyn.run.configuration import read_configuration

if TYPE_CHECKING:
    import xarray as xr

DRY = 0.1  # Films are drawn down to this part of the roughness; contacts are drawn there


@picture("Three panels.")
def film(
    run: xr.Dataset,
    *,
    joint: Joints = None,
    start: float | None = None,
    end: float | None = None,
    axes: Canvas = None,
) -> list[Axes]:
    """Thickness of the film on a logarithmic scale with the roughness, its largest pressure, and the force of the film.

    Parameters
    ----------
    joint : str or sequence of str, optional
        One lubricated joint; that with the thinnest film if not given.

    Raises
    ------
    InputError
        If no joint is lubricated, or a named one is not.
    """
    run = window(run, start, end)
    films = [] if "film" not in run.dims else run["film"].values.astype(str).tolist()
    if not films:
        sample = "sd.Clearance(..., lubrication=sd.Lubrication(viscosity=0.05))"
        raise InputError("a run without oil", "a run with a lubricated joint", sample)
    chosen = films[int(np.argmin(run["film_least_thickness"].values))] if joint is None else names_of(joint)[0]
    if chosen not in films:
        raise InputError(f"joint '{chosen}'{did_you_mean(chosen, films)}", "a lubricated joint: " + ", ".join(films))
    described: dict[str, Any] = {joint.name: joint for joint in read_configuration(run).mechanism.joints}
    rough, time = float(described[chosen].clearance.lubrication.roughness), time_scale(run)
    here, x = run.sel(film=chosen), time.factor * run["time"].values
    drawn = panels(axes, 3, size=(8.0, 7.0))
    size = engineering("m", rough)
    thickness = size.factor * here["film_thickness"].values
    dry = size.factor * DRY * rough
    drawn[0].plot(x, np.where(thickness > dry, thickness, np.nan), color=BLUE, linewidth=LINE, label="film")
    touching = np.where(thickness <= dry, dry, np.nan)
    drawn[0].plot(x, touching, color=VERMILION, linewidth=3.0 * LINE, label="contact")
    drawn[0].axhline(size.factor * MIXED * rough, color=GREY, linewidth=LINE, linestyle="--", label="three roughnesses")
    drawn[0].set_ylabel(size.label("film thickness"))
    drawn[0].set_title(literal(chosen), fontsize="medium")
    shown = (("film_pressure", "Pa", "largest pressure"), ("film_force", "N", "force of the film"))
    for panel, (name, unit, text) in zip(drawn[1:], shown, strict=True):
        values = here[name].values
        values = np.linalg.norm(values, axis=-1) if values.ndim == 2 else values
        scale = engineering(unit, values)
        panel.plot(x, scale.factor * values, color=BLUE, linewidth=LINE)
        panel.set_ylabel(scale.label(text))
    finish(drawn, run, time)
    drawn[0].set_yscale("log")
    legend(drawn, above=axes is None)
    return drawn
