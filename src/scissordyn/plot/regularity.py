"""Draw the regularity of a motion: maps, spectra, bifurcations, the 0-1 test, recurrences, distributions."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from scissordyn.errors import InputError, did_you_mean
from scissordyn.plot.scale import Scale, engineering, scale_of
from scissordyn.plot.series import BEYOND_HORIZON, chosen_joints, picture
from scissordyn.plot.style import (
    BLACK,
    BLUE,
    GREY,
    LINE_WIDTH,
    SIZES,
    VERMILION,
    Canvas,
    legend,
    literal,
    normal,
    number_decades,
    panels,
    signed,
    small,
)

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

# Style of dots in maps of motion (matplotlib): no line between them, no edge
DOT_STYLE: dict[str, Any] = {"linestyle": "", "marker": ".", "markeredgewidth": 0.0}


@picture()
def stroboscopic_map(
    strobe: xr.Dataset, *, x: str = "slider_position", y: str = "slider_velocity", joint: str = "", axes: Canvas = None
) -> list[Axes]:
    """Draw a Poincare map with one dot per period or crossing.

    Parameters
    ----------
    strobe : Dataset
        Result of `stroboscopic` or `section`, or the cycles of a long periodic run.
    x, y : str
        Variables of `strobe`; "eccentricity" is its x component on the abscissa and its y component on the ordinate.
    joint : str
        Joint of a joint variable; by default the first one.

    Raises
    ------
    InputError
        If the variable or joint does not exist.
    """
    (drawn,) = panels(axes, 1, size=(5.4, 4.6))
    time = np.asarray(strobe["time"].values, float) if "time" in strobe.coords else np.zeros(0)
    trusted = float(strobe.attrs.get("trusted_until", np.nan))
    shown, labels = [], []
    for side, name in enumerate((x, y)):
        variable = _select_series(strobe, name, side, joint)
        scale = engineering(variable.attrs.get("units", "1"), variable.values)
        shown.append(scale.factor * variable.values)
        labels.append(scale.label(_long_name(variable, name)))
    drawn.set(xlabel=labels[0], ylabel=labels[1])
    count = shown[0].size
    before = time <= trusted if np.isfinite(trusted) and time.size else np.ones(count, bool)
    for part, color, label in ((before, BLUE, "one period"), (~before, GREY, BEYOND_HORIZON)):
        if np.any(part):
            look: dict[str, Any] = {"color": color, "markersize": _dot_size(count, 3.0, 9.0), **DOT_STYLE}
            drawn.plot(shown[0][part], shown[1][part], label=None if np.all(before) else label, **look)
    drawn.ticklabel_format(style="plain", useOffset=False)
    legend([drawn], above=axes is None)
    return [drawn]


@picture()
def velocity_acceleration(scatter: xr.Dataset, ideal: xr.Dataset | None = None, *, axes: Canvas = None) -> list[Axes]:
    """Draw velocity over acceleration at every sample: the paper's "Poincare map".

    Parameters
    ----------
    scatter : Dataset
        Dataset with `velocity` and `acceleration`.
    ideal : Dataset, optional
        The same dataset of the ideal mechanism, drawn as a line.
    """
    (drawn,) = panels(axes, 1, size=(5.4, 4.6))
    both, names = [scatter] if ideal is None else [scatter, ideal], ("velocity", "acceleration")
    scales = [engineering(scatter[name].attrs["units"], *(part[name].values for part in both)) for name in names]
    dots: dict[str, Any] = {"color": BLUE, "markersize": 3.0, "label": None if ideal is None else "with clearance", **DOT_STYLE}
    line = {"color": BLACK, "linewidth": LINE_WIDTH, "label": "ideal joints"}
    for part, look in zip(both, (dots, line), strict=False):
        drawn.plot(*(scale.factor * part[name].values for scale, name in zip(scales, names, strict=True)), **look)
    labels = [scale.label(_long_name(scatter[name], name)) for scale, name in zip(scales, names, strict=True)]
    drawn.set(xlabel=labels[0], ylabel=labels[1])
    legend([drawn], above=axes is None)
    return [drawn]


@picture()
def power_spectrum(spectrum: xr.Dataset, *, peaks: int = 3, axes: Canvas = None) -> list[Axes]:
    """Draw the power spectral density on a logarithmic scale and mark its dominant frequencies.

    Parameters
    ----------
    spectrum : Dataset
        Result of the measure `spectrum`.
    peaks : int
        Number of dominant frequencies that are marked.
    """
    (drawn,) = panels(axes, 1, size=(7.2, 3.8))
    frequency, density = spectrum["frequency"].values[1:], spectrum["power_density"].values[1:]
    top = float(np.max(density, initial=0.0)) or 1.0
    # smaller values are round-off
    floor = 1e-16 * top
    drawn.semilogy(frequency, np.maximum(density, floor), color=BLUE, linewidth=LINE_WIDTH)
    marked = [spectrum[name].values[:peaks] for name in ("dominant_frequency", "dominant_density")]
    drawn.plot(*marked, linestyle="", marker="v", markersize=5.0, color=VERMILION)
    look: dict[str, Any] = {"textcoords": "offset points", "ha": "center", "fontsize": small(), "color": BLACK}
    for where, high in zip(*marked, strict=True):
        drawn.annotate(f"{where:.4g}", (where, high), (0.0, 5.0), **look)
    lowest = float(np.min(np.maximum(density, floor), initial=top))
    drawn.set_ylim(0.5 * lowest, top * (top / lowest) ** 0.12)
    number_decades(drawn.yaxis)
    drawn.set_xlim(0.0, float(frequency[-1]))
    unit = spectrum["frequency"].attrs["units"]
    density_unit = spectrum["power_density"].attrs["units"].replace("^2", "²").replace("(1)²", "").strip()
    drawn.set_xlabel("frequency [Hz]" if unit == "Hz" else "frequency per sample")
    drawn.set_ylabel(Scale(1.0, density_unit).label("power density"))
    return [drawn]


@picture()
def bifurcation(diagram: xr.Dataset, *, variable: str = "", joint: str = "", axes: Canvas = None) -> list[Axes]:
    """Draw a bifurcation diagram: the asymptotic motion over a parameter.

    Parameters
    ----------
    diagram : Dataset
        Dataset with variables along `value` and `cycle`, and the coordinate `value` in its unit.
    variable : str
        Variable to draw; by default slider_velocity, or the first variable along both dimensions.
    joint : str
        Joint of a joint variable; by default the first one.

    Raises
    ------
    InputError
        If the variable or joint does not exist.
    """
    usable = [str(name) for name in diagram if {"value", "cycle"} <= set(diagram[name].dims)]
    chosen = variable or ("slider_velocity" if "slider_velocity" in usable else (usable or [""])[0])
    _check("a bifurcation diagram of", chosen, usable)
    (drawn,) = panels(axes, 1, size=(7.2, 4.6))
    values = _select_series(diagram, chosen, 0, joint).transpose("value", "cycle")
    value = diagram["value"]
    across, up = scale_of(value), scale_of(values)
    look: dict[str, Any] = {"markersize": _dot_size(values.size, 3.0, 7.0), "rasterized": values.size > 20_000, **DOT_STYLE}
    x = np.repeat(across.factor * value.values, values.shape[1])
    drawn.plot(x, up.factor * values.values.ravel(), color=BLUE, **look)
    parameter, meaning = literal(str(diagram.attrs.get("parameter", ""))), _long_name(value, "parameter")
    varied = f"{parameter}: {meaning}" if parameter and parameter != meaning else meaning
    drawn.set(xlabel=across.label(varied), ylabel=up.label(_long_name(values, chosen)))
    drawn.ticklabel_format(style="plain", useOffset=False)
    return [drawn]


@picture("Two.")
def zero_one(test: xr.Dataset, *, axes: Canvas = None) -> list[Axes]:
    """Draw a 0-1 test for chaos: the path (p, q) of the translation at one angle, and the correlation K over the angles.

    Parameters
    ----------
    test : Dataset
        Result of `zero_one_test`.
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
    title = signed(f"median K = {float(test['K']):.3f}") if finite else "K undecided: only round-off varies"
    spread.set_title(title, loc="left", fontsize=normal(), color=VERMILION)
    return [plane, spread]


@picture()
def recurrence_plot(recurrence: xr.Dataset, *, axes: Canvas = None) -> list[Axes]:
    """Draw a recurrence plot, which is dark where two samples are close to each other.

    Parameters
    ----------
    recurrence : Dataset
        Result of the measure `recurrence`.
    """
    most_pixels = 1000  # largest number of pixels along a side
    (drawn,) = panels(axes, 1, size=(5.2, 5.4))
    matrix = recurrence["recurrent"].values.astype(float)
    count = len(matrix)
    block = -(-count // most_pixels)
    whole = count // block
    # a pixel of several samples shows the fraction of recurrent pairs
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
    """Draw the distribution of a contact quantity of a joint, logarithmic if it spans more than a decade.

    Parameters
    ----------
    variable : str
        Column of the contact table: peak_force, impulse, contact_duration, approach_speed, ...
    joint : str
        Clearance joint; by default the one with the largest force.

    Raises
    ------
    InputError
        If the column or joint does not exist.
    """
    decade = 10.0  # ratio of largest to smallest value above which the distribution is logarithmic
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
    decades = high / low > decade
    if high / low < 1.0 + 1e-9:
        low, high = 0.9 * low, 1.1 * high
    edges = np.geomspace(low, high, SIZES.bars + 1) if decades else np.linspace(low, high, SIZES.bars + 1)
    # round-off at the ends of a geometric series would exclude the extreme contacts
    edges[0], edges[-1] = low, high
    drawn.hist(shown, bins=edges.tolist(), color=BLUE)
    if decades:
        drawn.set_xscale("log")
        number_decades(drawn.xaxis)
    drawn.axvline(float(np.median(shown)), color=VERMILION, linewidth=1.5, label="median")
    drawn.yaxis.set_major_locator(MaxNLocator(integer=True))
    legend([drawn], above=axes is None)
    return [drawn]


def _check(what: str, name: str, allowed: Sequence[str]) -> None:
    if name not in allowed:
        raise InputError(f"{what} '{name}'{did_you_mean(name, allowed)}", "one of " + (", ".join(allowed) or "none"))


def _select_series(data: xr.Dataset, name: str, side: int, joint: str) -> xr.DataArray:
    """Return one series of a map or diagram."""
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
    """Return the name of an axis, safe for any text in a saved file."""
    return literal(str(data.attrs.get("long_name", otherwise)).split(" along ")[0])


def _dot_size(count: int, least: float, largest: float) -> float:
    """Return a size of dots that decreases with their number [pt], so that bands remain visible."""
    return float(np.clip(120.0 / np.sqrt(max(count, 1)), least, largest))
