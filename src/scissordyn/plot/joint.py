"""Draw the forces of clearance joints, the orbit of a journal in its bearing, and the oil film."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection
from matplotlib.colors import Normalize

from scissordyn.casefile.configuration import read_configuration
from scissordyn.errors import InputError, did_you_mean
from scissordyn.plot.contact import ContactTimes, contact_times, force_curve
from scissordyn.plot.file import figure_of
from scissordyn.plot.scale import Scale, engineering
from scissordyn.plot.series import (
    BEYOND_HORIZON,
    Joints,
    chosen_joints,
    clearance_pins,
    draw_curves,
    finish_time_axes,
    names_of,
    note_more,
    picture,
    predictability_horizon,
    select_window,
    time_scale,
)
from scissordyn.plot.style import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    IDEAL,
    LIGHT,
    LINE_WIDTH,
    TIME_MAP,
    VERMILION,
    Canvas,
    dark_map,
    figure_width,
    is_column,
    legend,
    literal,
    normal,
    number_decades,
    panels,
    small,
    wrap_text,
)
from scissordyn.record.film import MIXED_RATIO_MAX
from scissordyn.record.joint_force import clearance_joints
from scissordyn.record.results import Curve, Run, curve_of, values_at


@picture("One per joint, followed by one for its friction if it has any.")
def force(
    run: Run,
    ideal: Run | None = None,
    *,
    joint: Joints = None,
    start: float | None = None,
    end: float | None = None,
    axes: Canvas = None,
) -> list[Axes]:
    """Draw the force of each clearance joint with its friction, oil film, contacts and the ideal mechanism's reaction.

    Parameters
    ----------
    ideal : Dataset, optional
        Run of the ideal mechanism; the magnitude of its reaction is drawn as a dashed line.

    Raises
    ------
    InputError
        If no joint has clearance, or a named joint has none.
    """
    run = select_window(run, start, end)
    chosen = chosen_joints(run, joint)
    frictional = [bool(np.any(np.nan_to_num(values_at(run, "friction_force", "time", joint=name)))) for name in chosen]
    ratios = [ratio for has_friction in frictional for ratio in ((2.0, 1.2) if has_friction else (2.0,))]
    drawn = panels(axes, len(ratios), size=(9.0, 0.6 + 1.35 * sum(ratios)), ratios=ratios)
    time = time_scale(run)
    following = iter(drawn)
    for name, has_friction in zip(chosen, frictional, strict=True):
        _force(panel := next(following), run, ideal, name, time)
        if len(chosen) > 1:
            panel.set_title(f"joint {literal(name)}", loc="left", fontsize=normal())
        if has_friction:
            friction = curve_of(run, "friction_force", joint=name)
            draw_curves(next(following), "friction force", [(friction, {"color": BLUE})], time)
    finish_time_axes(drawn, run, time)
    legend(drawn)
    if joint is None and axes is None:
        note_more(drawn, clearance_joints(run), chosen)
    return drawn


def _force(axes: Axes, run: Run, ideal: Run | None, joint: str, time: Scale) -> None:
    strip = 0.06  # height of the strip that marks contacts as a fraction of the panel
    oiled = "film" in run.sizes and joint in run["film"].values
    contacts = contact_times(run, joint, normal=oiled)
    curves: list[tuple[Curve, dict[str, Any]]] = [(force_curve(run, joint), {"color": BLUE, "label": "force"})]
    if ideal is not None and "reaction" in ideal and joint in ideal["joint"].values:
        curves.append((_magnitude(ideal, "reaction", joint=joint), IDEAL | {"label": "ideal reaction"}))
    if oiled:
        curves.append((force_curve(run, joint, normal=True), {"color": GREEN, "label": "normal force of the metal"}))
    scale = engineering("N", contacts.peak, *(curve.values for curve, _ in curves))
    draw_curves(axes, "force", curves, time, scale=scale)
    if contacts.peak.size:
        look: dict[str, Any] = {"linestyle": "", "marker": "o", "markersize": 2.5, "color": BLACK}
        axes.plot(time.factor * contacts.peak_time, scale.factor * contacts.peak, label="peak of a contact", **look)
        _name_peak(axes, contacts, time, scale)
    top = scale.factor * max([0.0, *contacts.peak.tolist(), *(float(np.nanmax(curve.values)) for curve, _ in curves)]) or 1.0
    # forces are magnitudes, so the region below zero is free for the strip of contacts
    axes.set_ylim(-1.5 * strip * top, 1.06 * top)
    axes.axhline(0.0, color=GREY, linewidth=0.6)
    if contacts.start.size:
        spans = list(zip(time.factor * contacts.start, time.factor * (contacts.end - contacts.start), strict=True))
        look = {"facecolor": VERMILION, "edgecolor": VERMILION, "linewidth": 0.5, "label": "in contact"}
        axes.broken_barh(spans, (0.0, strip), transform=axes.get_xaxis_transform(), **look)
    else:
        axes.text(0.5, 0.5, "no contact in this run", transform=axes.transAxes, ha="center", fontsize=small(), color=GREY)


def _name_peak(axes: Axes, contacts: ContactTimes, time: Scale, scale: Scale) -> None:
    """Write value and instant of the largest contact force next to its mark."""
    largest = int(np.argmax(np.nan_to_num(contacts.peak)))
    when, value = contacts.peak_time[largest], contacts.peak[largest]
    text = f"{scale.with_unit(value, 3)} at {time.with_unit(when, 3)}"
    low, high = np.min(contacts.start), np.max(contacts.end)
    right = when <= 0.5 * (low + high)  # on the side where more of the panel is free
    axes.annotate(
        text,
        (time.factor * when, scale.factor * value),
        xytext=(5.0 if right else -5.0, -2.0),
        textcoords="offset points",
        ha="left" if right else "right",
        va="center",
        fontsize=small(),
        color=BLACK,
    )


def _magnitude(run: Run, name: str, **labels: str) -> Curve:
    """Return the magnitude of a vector over time."""
    x, y = (curve_of(run, name, axis=axis, **labels) for axis in "xy")
    return x._replace(values=np.hypot(x.values, y.values))


@picture("One per joint.")
def orbit(
    run: Run,
    *,
    joint: Joints = None,
    exaggeration: float | None = None,
    start: float | None = None,
    end: float | None = None,
    axes: Canvas = None,
) -> list[Axes]:
    """Draw the path of the journal centre in the clearance circle, coloured by time; contact is a thick line.

    Parameters
    ----------
    exaggeration : float, optional
        Magnification of indentations, shown in the title. By default chosen for each joint.

    Raises
    ------
    InputError
        If no revolute joint has clearance, or a named joint has none.
    """
    least_width = 1.7  # least width of an orbit's panel in a figure of user-defined width [inch]
    most_columns = 3  # largest number of orbits in a row
    run = select_window(run, start, end)
    pins = clearance_pins(run)
    chosen = chosen_joints(run, joint, pins)
    columns = (
        max(1, min(len(chosen), most_columns, int(min(figure_width() / least_width, most_columns)))) if axes is None else 1
    )
    rows = math.ceil(len(chosen) / columns)
    width = 5.4 if columns == 1 else 3.8 * columns
    if axes is None:
        drawn = panels(None, rows, columns, size=(width, 0.8 + (4.6 if columns == 1 else 3.9) * rows), share=False)
        for spare in drawn[len(chosen) :]:
            spare.remove()
        drawn = drawn[: len(chosen)]
    else:
        drawn = panels(axes, len(chosen), size=(width, width))
    room = min(figure_width(), width) / columns - 0.5
    for panel, name in zip(drawn, chosen, strict=True):
        path = draw_orbit(panel, run, name, exaggeration)
        panel.set_xlabel(path.scale.label("x of the journal"))
        panel.set_ylabel(path.scale.label("y of the journal"))
        panel.set_title(wrap_text(path.title, room, normal()), loc="left", fontsize=normal())
    legend(drawn, above=axes is None)
    write_time_bar(drawn if axes is None else drawn[-1:], run)
    if joint is None and axes is None:
        note_more(drawn, pins, chosen)
    return drawn


@dataclass(frozen=True)
class JournalPath:
    """Drawn path of a journal's centre."""

    points: np.ndarray  # (samples, 2) Displayed coordinates of the centre, with the indentation magnified
    scale: Scale  # Scale of the coordinates
    title: str  # Name of the joint, and the magnification of the indentation


def draw_orbit(axes: Axes, run: Run, joint: str, exaggeration: float | None = None, *, turns: int = 0) -> JournalPath:
    """Draw the path of a journal's centre, coloured by time, after some quarter turns of the picture."""
    visible_depth = 0.1  # drawn depth of the largest indentation as a fraction of the clearance
    place = values_at(run, "eccentricity", "time", "axis", joint=joint)
    place = place @ np.linalg.matrix_power(np.array([[0.0, 1.0], [-1.0, 0.0]]), turns % 4)
    clearance = float(values_at(run, "clearance", joint=joint))
    distance = np.hypot(place[:, 0], place[:, 1])
    depth = np.maximum(distance - clearance, 0.0)
    gain = (
        _round_gain(visible_depth * clearance / np.max(depth))
        if exaggeration is None and np.any(depth)
        else exaggeration or 1.0
    )
    stretch = np.ones_like(distance)
    np.divide(distance + (gain - 1.0) * depth, distance, out=stretch, where=distance > 0.0)
    scale = engineering("m", clearance)
    drawn = scale.factor * place * stretch[:, None]

    axes.set_aspect("equal", adjustable="box")
    around = np.linspace(0.0, 2.0 * np.pi, 361)
    circle = scale.factor * clearance * np.stack([np.cos(around), np.sin(around)])
    axes.plot(*circle, color=GREY, linewidth=0.8, linestyle=(0, (2, 2)), label="clearance circle")
    _draw_path(axes, run, drawn, values_at(run, "in_contact", "time", joint=joint).astype(bool))
    axes.plot(*drawn[0], linestyle="", marker="o", markersize=4.0, color=BLACK, label="start", zorder=4.0)
    reach = 1.08 * scale.factor * max(clearance, float(np.max(distance * stretch)))
    axes.set(xlim=(-reach, reach), ylim=(-reach, reach))
    magnified = f", indentation magnified {gain:g} times" if gain != 1.0 else ""
    return JournalPath(drawn, scale, f"joint {literal(joint)}{magnified}")


def _draw_path(axes: Axes, run: Run, points: np.ndarray, touching: np.ndarray) -> None:
    """Draw the lines between samples: thick where both are in contact, pale beyond the predictability horizon."""
    time, until = run["time"].values, predictability_horizon(run)
    lines = np.stack([points[:-1], points[1:]], axis=1)
    contact, middle = touching[:-1] & touching[1:], 0.5 * (time[:-1] + time[1:])
    pale = time[1:] > (math.inf if until is None else until)
    for kind, width, label in ((~contact, 0.8 * LINE_WIDTH, "free flight"), (contact, 2.2 * LINE_WIDTH, "contact")):
        for part, alpha in ((kind & ~pale, 1.0), (kind & pale, 0.3)):
            if not np.any(part):
                continue
            colours: dict[str, Any] = {"cmap": dark_map(TIME_MAP), "norm": _time_norm(run), "array": middle[part]}
            drawn = LineCollection(list(lines[part]), linewidths=width, alpha=alpha, capstyle="round", **colours)
            drawn.set_label(f"_{label}")
            axes.add_collection(drawn, autolim=False)
            if alpha == 1.0:
                axes.plot([], [], color=GREY, linewidth=width, label=label)
    if np.any(pale):
        axes.plot([], [], color=LIGHT, linewidth=LINE_WIDTH, label=f"pale: {BEYOND_HORIZON}")


def _time_norm(run: Run, factor: float = 1.0) -> Normalize:
    """Return the norm of the colours of a run's instants."""
    return Normalize(factor * float(run["time"].values[0]), factor * float(run["time"].values[-1]))


def write_time_bar(axes: Sequence[Axes], run: Run) -> None:
    """Add a colour bar of the time next to the orbits."""
    time = time_scale(run)
    norm = _time_norm(run, time.factor)
    if norm.vmax == norm.vmin:
        return
    colours = ScalarMappable(norm, dark_map(TIME_MAP))
    place: dict[str, Any] = {"location": "bottom", "pad": 0.05} if is_column() else {"pad": 0.02}
    bar = figure_of(axes).colorbar(colours, ax=list(axes), shrink=0.7, aspect=30, **place)
    bar.set_label(time.label("time"), fontsize=small())
    bar.ax.tick_params(labelsize=small(), color=GREY, width=0.6, length=3.0)
    bar.outline.set_visible(False)


def _round_gain(gain: float) -> float:
    """Return the largest of 1, 2, 5, 10, 20, ... that does not exceed `gain`."""
    if gain < 2.0 - 1e-9:
        return 1.0
    almost = gain * (1.0 + 1e-9)  # accepts 49.999999 as 50
    power = 10.0 ** math.floor(math.log10(almost))
    return max(step * power for step in (1.0, 2.0, 5.0) if step * power <= almost)


@picture("Three panels.")
def film(
    run: Run,
    *,
    joint: Joints = None,
    start: float | None = None,
    end: float | None = None,
    axes: Canvas = None,
) -> list[Axes]:
    """Draw the thickness of the oil film with the roughness, its largest pressure, and its force.

    Parameters
    ----------
    joint : str or sequence of str, optional
        Lubricated joint; by default the one with the thinnest film.

    Raises
    ------
    InputError
        If no joint is lubricated, or a named joint is not.
    """
    dry_fraction = 0.1  # films thinner than this fraction of the roughness are drawn as contact
    run = select_window(run, start, end)
    films = [] if "film" not in run.sizes else run["film"].values.astype(str).tolist()
    if not films:
        sample = "sd.Clearance(..., lubrication=sd.Lubrication(viscosity=0.05))"
        raise InputError("the run has no lubricated joint", "a run with a lubricated joint", sample)
    chosen = films[int(np.argmin(run["film_least_thickness"].values))] if joint is None else names_of(joint)[0]
    if chosen not in films:
        raise InputError(
            f"joint '{chosen}' is not lubricated{did_you_mean(chosen, films)}", "a lubricated joint: " + ", ".join(films)
        )
    described: dict[str, Any] = {joint.name: joint for joint in read_configuration(run).mechanism.joints}
    rough, time = float(described[chosen].clearance.lubrication.roughness), time_scale(run)
    x = time.factor * run["time"].values
    drawn = panels(axes, 3, size=(8.0, 7.0))
    size = engineering("m", rough)
    thickness = size.factor * values_at(run, "film_thickness", "time", film=chosen)
    dry = size.factor * dry_fraction * rough
    drawn[0].plot(x, np.where(thickness > dry, thickness, np.nan), color=BLUE, linewidth=LINE_WIDTH, label="film")
    touching = np.where(thickness <= dry, dry, np.nan)
    drawn[0].plot(x, touching, color=VERMILION, linewidth=3.0 * LINE_WIDTH, label="contact")
    drawn[0].axhline(
        size.factor * MIXED_RATIO_MAX * rough, color=GREY, linewidth=LINE_WIDTH, linestyle="--", label="three roughnesses"
    )
    drawn[0].set_ylabel(size.label("film thickness"))
    drawn[0].set_title(literal(chosen), fontsize="medium")
    draw_curves(drawn[1], "largest pressure", [(curve_of(run, "film_pressure", film=chosen), {"color": BLUE})], time)
    draw_curves(drawn[2], "force of the film", [(_magnitude(run, "film_force", film=chosen), {"color": BLUE})], time)
    finish_time_axes(drawn, run, time)
    drawn[0].set_yscale("log")
    number_decades(drawn[0].yaxis)
    legend(drawn, above=axes is None)
    return drawn
