"""Pictures of the regularity of a motion: maps, spectra, bifurcations, the 0-1 test, recurrences, distributions."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from scissordyn.errors import InputError, did_you_mean
from scissordyn.plot.scale import Scale, engineering, scale_of
from scissordyn.plot.series import BEYOND, chosen_joints, picture
from scissordyn.plot.style import BLACK, BLUE, GREY, LINE, VERMILION, Canvas, legend, literal, normal, panels, small

if TYPE_CHECKING:
    import xarray as xr

__all__ = [
    "bifurcation",
    "distribution",
    "power_spectrum",
    "recurrence_plot",
    "stroboscopic_map",
    "velocity_acceleration",
    "zero_one",
]

DOTS: dict[str, Any] = {"linestyle": "", "marker": ".", "markeredgewidth": 0.0}

BARS = 30  # Bars of a distribution
DECADE = 10.0  # Ratio of largest to smallest value from which a distribution is drawn logarithmically
MOST_PIXELS = 1000  # Points along the side of a recurrence plot, about its resolution


@picture()
def stroboscopic_map(
    strobe: xr.Dataset, *, x: str = "slider_position", y: str = "slider_velocity", joint: str = "", axes: Canvas = None
) -> list[Axes]:
    """A Poincare map: one dot per period or crossing.

    Parameters
    ----------
    strobe : Dataset
        Of `stroboscopic`, `section`, or the cycles of a long periodic run.
    x, y : str
        Variables of it; "eccentricity" is its x along the abscissa and its y along the ordinate.
    joint : str
        Whose, for variables of joints; the first one if not given.

    Raises
    ------
    InputError
        If there is no such variable or joint.
    """
    (drawn,) = panels(axes, 1, size=(5.4, 4.6))
    time = np.asarray(strobe["time"].values, float) if "time" in strobe.coords else np.zeros(0)
    trusted = float(strobe.attrs.get("trusted_until", np.nan))
    shown, labels = [], []
    for side, name in enumerate((x, y)):
        variable = _along(strobe, name, side, joint)
        scale = engineering(variable.attrs.get("units", "1"), variable.values)
        shown.append(scale.factor * variable.values)
        labels.append(scale.label(_long_name(variable, name)))
    drawn.set(xlabel=labels[0], ylabel=labels[1])
    count = shown[0].size
    before = time <= trusted if np.isfinite(trusted) and time.size else np.ones(count, bool)
    for part, color, label in ((before, BLUE, "one period"), (~before, GREY, BEYOND)):
        if np.any(part):
            look: dict[str, Any] = {"color": color, "markersize": _dot(count, 3.0, 9.0), **DOTS}
            drawn.plot(shown[0][part], shown[1][part], label=None if np.all(before) else label, **look)
    drawn.ticklabel_format(style="plain", useOffset=False)
    legend([drawn], above=axes is None)
    return [drawn]


@picture()
def velocity_acceleration(scatter: xr.Dataset, ideal: xr.Dataset | None = None, *, axes: Canvas = None) -> list[Axes]:
    """Velocity against acceleration at every sample: the paper's "Poincare map".

    Parameters
    ----------
    scatter : Dataset
        With `velocity` and `acceleration`.
    ideal : Dataset, optional
        The same of the ideal mechanism, drawn as a line.
    """
    (drawn,) = panels(axes, 1, size=(5.4, 4.6))
    both, names = [scatter] if ideal is None else [scatter, ideal], ("velocity", "acceleration")
    scales = [engineering(scatter[name].attrs["units"], *(part[name].values for part in both)) for name in names]
    dots: dict[str, Any] = {"color": BLUE, "markersize": 3.0, "label": None if ideal is None else "with clearance", **DOTS}
    line = {"color": BLACK, "linewidth": LINE, "label": "ideal joints"}
    for part, look in zip(both, (dots, line), strict=False):
        drawn.plot(*(scale.factor * part[name].values for scale, name in zip(scales, names, strict=True)), **look)
    drawn.set(xlabel=scales[0].label("velocity"), ylabel=scales[1].label("acceleration"))
    legend([drawn], above=axes is None)
    return [drawn]


@picture()
def power_spectrum(spectrum: xr.Dataset, *, peaks: int = 3, axes: Canvas = None) -> list[Axes]:
    """The power spectral density on a logarithmic scale, with its dominant frequencies marked.

    Parameters
    ----------
    spectrum : Dataset
        Of the measure `spectrum`.
    peaks : int
        Number of dominant frequencies that are marked and named.
    """
    (drawn,) = panels(axes, 1, size=(7.2, 3.8))
    frequency, density = spectrum["frequency"].values[1:], spectrum["power_density"].values[1:]
    top = float(np.max(density, initial=0.0)) or 1.0
    # values below are round-off
    floor = 1e-16 * top
    drawn.semilogy(frequency, np.maximum(density, floor), color=BLUE, linewidth=LINE)
    marked = [spectrum[name].values[:peaks] for name in ("dominant_frequency", "dominant_density")]
    drawn.plot(*marked, linestyle="", marker="v", markersize=5.0, color=VERMILION)
    look: dict[str, Any] = {"textcoords": "offset points", "ha": "center", "fontsize": small(), "color": BLACK}
    for where, high in zip(*marked, strict=True):
        drawn.annotate(f"{where:.4g}", (where, high), (0.0, 5.0), **look)
    lowest = float(np.min(np.maximum(density, floor), initial=top))
    drawn.set_ylim(0.5 * lowest, top * (top / lowest) ** 0.12)
    drawn.set_xlim(0.0, float(frequency[-1]))
    unit = spectrum["frequency"].attrs["units"]
    density_unit = spectrum["power_density"].attrs["units"].replace("^2", "²").replace("(1)²", "").strip()
    drawn.set_xlabel("frequency [Hz]" if unit == "Hz" else "frequency per sample")
    drawn.set_ylabel(Scale(1.0, density_unit).label("power density"))
    return [drawn]


@picture()
def bifurcation(diagram: xr.Dataset, *, variable: str = "", joint: str = "", axes: Canvas = None) -> list[Axes]:
    """A bifurcation diagram: the asymptotic motion over a parameter.

    Parameters
    ----------
    diagram : Dataset
        Variables along `value` and `cycle`, with the coordinate `value` in its unit.
    variable : str
        Which; slider_velocity if not given, or the first one along both.
    joint : str
        Whose, for variables of joints; the first one if not given.

    Raises
    ------
    InputError
        If there is no such variable or joint.
    """
    usable = [str(name) for name in diagram if {"value", "cycle"} <= set(diagram[name].dims)]
    chosen = variable or ("slider_velocity" if "slider_velocity" in usable else (usable or [""])[0])
    _check("a bifurcation diagram of", chosen, usable)
    (drawn,) = panels(axes, 1, size=(7.2, 4.6))
    values = _along(diagram, chosen, 0, joint).transpose("value", "cycle")
    value = diagram["value"]
    across, up = scale_of(value), scale_of(values)
    look: dict[str, Any] = {"markersize": _dot(values.size, 0.8, 4.0), "rasterized": values.size > 20_000, **DOTS}
    x = np.repeat(across.factor * value.values, values.shape[1])
    drawn.plot(x, up.factor * values.values.ravel(), color=BLUE, **look)
    drawn.set(xlabel=across.label(_long_name(value, "parameter")), ylabel=up.label(_long_name(values, chosen)))
    drawn.ticklabel_format(style="plain", useOffset=False)
    return [drawn]


@picture("Two.")
def zero_one(test: xr.Dataset, *, axes: Canvas = None) -> list[Axes]:
    """The 0-1 test: the translation for one angle, and the distribution of K over the angles.

    Parameters
    ----------
    test : Dataset
        Of `zero_one_test`.
    """
    plane, spread = panels(axes, 1, 2, size=(8.4, 4.0), share=False)
    plane.plot(test["p"].values, test["q"].values, color=BLUE, linewidth=0.6)
    plane.set_aspect("equal", adjustable="datalim")
    plane.set(xlabel="p", ylabel="q")
    plane.set_title(f"translation at c = {test.attrs['shown_angle']:.3f}", loc="left", fontsize=normal())
    spread.hist(test["correlation"].values, bins=np.linspace(-1.0, 1.0, 41).tolist(), color=BLUE)
    finite = bool(np.isfinite(test["K"]))
    if finite:
        spread.axvline(float(test["K"]), color=VERMILION, linewidth=1.5)
    spread.set(xlim=(-1.0, 1.05), xlabel="growth at one angle", ylabel="angles")
    title = f"median K = {float(test['K']):.3f}" if finite else "K undecided: nothing but errors varies"
    spread.set_title(title, loc="left", fontsize=normal(), color=VERMILION)
    return [plane, spread]


@picture()
def recurrence_plot(recurrence: xr.Dataset, *, axes: Canvas = None) -> list[Axes]:
    """A recurrence plot: dark where two samples are near each other.

    Parameters
    ----------
    recurrence : Dataset
        Of the measure `recurrence`.
    """
    (drawn,) = panels(axes, 1, size=(5.2, 5.4))
    matrix = recurrence["recurrent"].values.astype(float)
    count = len(matrix)
    block = -(-count // MOST_PIXELS)
    whole = count // block
    # a pixel of several samples is as dark as the fraction of them that recur
    shown = matrix[: whole * block, : whole * block].reshape(whole, block, whole, block).mean(axis=(1, 3))
    end = whole * block
    drawn.imshow(shown, cmap="Greys", vmin=0.0, vmax=1.0, origin="lower", extent=(0, end, 0, end), interpolation="nearest")
    drawn.grid(visible=False)
    drawn.set(xlabel="sample", ylabel="sample")
    rate, lines = float(recurrence["recurrence_rate"]), float(recurrence["determinism"])
    drawn.set_title(f"recurrence rate {rate:.3f}, determinism {lines:.3f}", loc="left", fontsize=normal())
    return [drawn]


@picture()
def distribution(run: xr.Dataset, *, variable: str = "peak_force", joint: str = "", axes: Canvas = None) -> list[Axes]:
    """The distribution of a quantity of the contacts of a joint, logarithmic if it spans more than a decade.

    Parameters
    ----------
    variable : str
        A column of the table of contacts: peak_force, impulse, contact_duration, approach_speed, ...
    joint : str
        Which; the clearance joint with the largest force if not given.

    Raises
    ------
    InputError
        If there is no such column or joint.
    """
    columns = [str(name) for name in run if run[name].dims == ("contact",) and run[name].dtype.kind == "f"]
    _check("a distribution of", variable, columns)
    names = chosen_joints(run, joint or None)
    joint = max(names, key=lambda name: float(run["normal_force"].sel(joint=name).max()))
    (drawn,) = panels(axes, 1, size=(6.0, 3.8))
    values = run[variable].values[run["contact_joint"].values.astype(str) == joint]
    values = values[np.isfinite(values) & (values > 0.0)]
    name = literal(str(run[variable].attrs.get("long_name", variable)))
    scale = engineering(run[variable].attrs["units"], values)
    drawn.set(xlabel=scale.label(name), ylabel="contacts")
    drawn.set_title(f"joint {literal(joint)}, {values.size} contacts", loc="left", fontsize=normal())
    if not values.size:
        drawn.text(0.5, 0.5, "no contact in this run", transform=drawn.transAxes, ha="center", fontsize=small(), color=GREY)
        return [drawn]
    shown = scale.factor * values
    low, high = float(np.min(shown)), float(np.max(shown))
    decades = high / low > DECADE
    if high / low < 1.0 + 1e-9:
        low, high = 0.9 * low, 1.1 * high
    edges = np.geomspace(low, high, BARS + 1) if decades else np.linspace(low, high, BARS + 1)
    # the round-off at the ends of a geometric series would exclude the extreme contacts
    edges[0], edges[-1] = low, high
    drawn.hist(shown, bins=edges.tolist(), color=BLUE)
    if decades:
        drawn.set_xscale("log")
    drawn.axvline(float(np.median(shown)), color=VERMILION, linewidth=1.5, label="median")
    drawn.yaxis.set_major_locator(MaxNLocator(integer=True))
    legend([drawn], above=axes is None)
    return [drawn]


def _check(what: str, name: str, allowed: Sequence[str]) -> None:
    if name not in allowed:
        raise InputError(f"{what} '{name}'{did_you_mean(name, allowed)}", "one of " + (", ".join(allowed) or "none"))


def _along(data: xr.Dataset, name: str, side: int, joint: str) -> xr.DataArray:
    """One series of a map or diagram."""
    _check("variable", name, [str(other) for other in data])
    values = data[name]
    if "joint" in values.dims:
        names = [str(other) for other in values["joint"].values]
        if "clearance" in data:
            names = [other for other in names if np.isfinite(float(data["clearance"].sel(joint=other)))]
        _check("joint", joint or names[0], names)
        values = values.sel(joint=joint or names[0])
    if "axis" in values.dims:
        letter = str(values["axis"].values[side])
        values = values.isel(axis=side)
        values.attrs["long_name"] = f"{letter} of the journal" if name == "eccentricity" else f"{letter} of the {name}"
    return values


def _long_name(data: xr.DataArray, otherwise: str) -> str:
    """What an axis is called: a saved file may say anything."""
    return literal(str(data.attrs.get("long_name", otherwise)).split(" along ")[0])


def _dot(count: int, least: float, largest: float) -> float:
    """Size of dots [pt], smaller for more dots, so that bands stay visible."""
    return float(np.clip(120.0 / np.sqrt(max(count, 1)), least, largest))
