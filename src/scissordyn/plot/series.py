"""Common parts of pictures of a run: docstrings, time window, choice of joints, curves over time, predictability horizon."""

from __future__ import annotations

import inspect
import math
import re
from collections.abc import Callable, Mapping, Sequence
from functools import wraps
from typing import TYPE_CHECKING, Any, TypeAlias, TypeVar, cast

import numpy as np

from scissordyn.errors import InputError, did_you_mean
from scissordyn.plot.scale import DEGREES, Scale, engineering
from scissordyn.plot.style import (
    BLACK,
    BLUE,
    GREY,
    IDEAL,
    LIGHT,
    LINE_WIDTH,
    OUTSIDE,
    PictureAxes,
    normal,
    small,
    use_minus_signs,
    wrap_label,
)
from scissordyn.record.joint_force import clearance_joints, joint_force, largest_force, require_clearance_joints
from scissordyn.record.results import Curve, Run
from scissordyn.warning import LISTED_MAX

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from scissordyn.model.mechanism import Mechanism

Joints: TypeAlias = "str | Sequence[str] | None"  # One joint, several, or None for the picture's own choice

# Legend text of the part of a curve after the predictability horizon, drawn pale or on a grey ground
BEYOND_HORIZON = "beyond predictability horizon"


COMMON_PARAMETERS = {
    "run": "run : Dataset",
    "ideal": "ideal : Dataset, optional\n    The run of the ideal mechanism, drawn dashed.",
    "mechanism": "mechanism : Mechanism, optional\n    Mechanism of the run; by default the one stored in the run.",
    "joint": "joint : str or sequence of str, optional\n    Joints to draw; by default those with the largest forces.",
    "start": "start, end : float, optional\n    Start and end of the drawn part of the run [s]; by default the whole run.",
    "axes": "axes : Axes or iterable of Axes, optional\n    {} By default on a new figure.",
}
"""Text about parameters that several plot functions have, for functions whose docstrings do not describe them."""

# Pattern of the heading of a docstring's section, with its underline
DOC_SECTION = re.compile(r"\n\n(Parameters|Returns|Raises)\n-+\n")
DOC_ENTRY = re.compile(r"(?m)^(?=\w)")  # Pattern of the start of an entry in a docstring's section: a line that is not indented

AnyRun = TypeVar("AnyRun", bound=Run)
Draw = TypeVar("Draw", bound=Callable[..., object])


def picture(axes: str = "One.") -> Callable[[Draw], Draw]:
    """Complete the docstring of a plot function by its common parameters and its return value; `axes` describes the Axes."""

    def completed(draw: Draw) -> Draw:
        summary, *parts = DOC_SECTION.split(inspect.cleandoc(draw.__doc__ or ""))
        sections = {"Parameters": "", "Returns": "list of Axes", **dict(zip(parts[::2], parts[1::2], strict=True))}
        special = {entry.split(" ")[0].strip(","): entry.strip() for entry in DOC_ENTRY.split(sections["Parameters"]) if entry}
        described = COMMON_PARAMETERS | {"axes": COMMON_PARAMETERS["axes"].format(axes)} | special
        names = [name for name in inspect.signature(draw).parameters if name in described]
        sections["Parameters"] = "\n".join(described[name] for name in names)
        written = [f"{title}\n{'-' * len(title)}\n{text}" for title, text in sections.items()]
        draw.__doc__ = "\n\n".join([summary, *written])

        @wraps(draw)
        def with_minus_signs(*given: Any, **options: Any) -> Any:
            drawn: Any = draw(*given, **options)
            use_minus_signs(drawn)
            return PictureAxes(drawn) if isinstance(drawn, list) else drawn

        return cast("Draw", with_minus_signs)

    return completed


def time_scale(run: Run) -> Scale:
    return engineering("s", run["time"].values)


def predictability_horizon(run: Run) -> float | None:
    """Return the predictability horizon of a run [s]; None if it is the end of the run or was not computed."""
    until = float(run.attrs.get("trusted_until", math.nan))
    return until if math.isfinite(until) and until < float(run["time"].values[-1]) else None


def clearance_pins(run: Run) -> list[str]:
    """Return the names of the clearance joints that are journal bearings; contact points of guides are left out."""
    plane = set(run["joint"].values[run["plane_contact"].values].astype(str)) if "plane_contact" in run else set()
    return [name for name in clearance_joints(run) if name not in plane]


def mechanism_of(run: Run) -> Mechanism:
    from scissordyn.casefile.configuration import read_configuration

    return read_configuration(run).build_mechanism()


def names_of(joint: str | Sequence[str]) -> list[str]:
    return [joint] if isinstance(joint, str) else list(joint)


def chosen_joints(run: Run, joint: Joints, among: list[str] | None = None) -> list[str]:
    """Return the clearance joints to draw, in order: the named ones, or the `LISTED_MAX` with the largest forces."""
    names = require_clearance_joints(run, among)
    if joint is not None:
        for name in names_of(joint):
            if name not in names:
                raise InputError(f"unknown clearance joint '{name}'{did_you_mean(name, names)}", "one of " + ", ".join(names))
        return names_of(joint)
    largest = largest_forces(run)
    kept = set(sorted(names, key=lambda name: -largest[name])[:LISTED_MAX])
    return [name for name in names if name in kept]


def largest_forces(run: Run) -> dict[str, float]:
    """Return the largest force of each clearance joint, including maxima between samples [N]."""
    return {
        name: float(np.nanmax([largest_force(run, name), np.max(joint_force(run, name))])) for name in clearance_joints(run)
    }


def note_more(axes: Sequence[Axes], joints: Sequence[str], chosen: Sequence[str]) -> None:
    """Write below a figure how many clearance joints are left out."""
    figure = axes[0].get_figure(root=True)
    if figure is not None:
        write_more(figure, len(set(joints) - set(chosen)))


def write_more(figure: Figure, more: int) -> None:
    """Write below a figure that `more` clearance joints have smaller forces; write nothing for zero."""
    if more:
        note = f"{more} more clearance joint{'s' * (more > 1)} with smaller forces"
        figure.supxlabel(note, fontsize=small(), color=GREY)


def draw_curves(
    axes: Axes,
    name: str,
    curves: Sequence[tuple[Curve, Mapping[str, Any]]],
    time: Scale,
    *,
    scale: Scale | None = None,
) -> Scale:
    """Draw curves of one quantity over time, each in its style, in degrees or an engineering unit."""
    unit = curves[0][0].units
    chosen = scale or (DEGREES if unit == "rad" else engineering(unit, *(curve.values for curve, _ in curves)))
    for curve, look in curves:
        axes.plot(time.factor * curve.time, chosen.factor * curve.values, **{"linewidth": LINE_WIDTH, **look})
    axes.set_ylabel(chosen.label(name))
    return chosen


def compare(
    axes: Axes,
    name: str,
    run: Curve,
    ideal: Curve | None,
    *,
    scale: Scale | None = None,
    time: Scale,
    color: str = BLUE,
    labels: tuple[str, str] = ("with clearance", "ideal joints"),
) -> Scale:
    """Draw one quantity over time together with that of the ideal mechanism."""
    beside = [] if ideal is None else [(ideal, IDEAL | {"label": labels[1]})]
    return draw_curves(axes, name, [(run, {"color": color, "label": labels[0]}), *beside], time, scale=scale)


def mark_largest(axes: Axes, when: float, value: float) -> None:
    """Mark the largest value of a curve, which may lie between samples, by a dot."""
    axes.plot(when, value, label="largest", linestyle="", marker="o", markersize=2.5, color=BLACK)


def draw_limit(axes: Axes, value: float, label: str) -> None:
    """Draw a dotted line that a curve should not cross."""
    axes.axhline(value, color=OUTSIDE, linewidth=0.8, linestyle=(0, (1, 1.5)), label=label)


def finish_time_axes(axes: Sequence[Axes], run: Run, time: Scale, *, bottom: Sequence[Axes] | None = None) -> None:
    """Label the time axes, keep constant curves flat, and shade the time beyond the predictability horizon.

    Labels that are longer than their axes are broken into lines.
    """
    first, last = time.factor * run["time"].values[[0, -1]]
    until = predictability_horizon(run)
    for k, panel in enumerate(axes):
        if last > first:
            panel.set_xlim(first, last)
        if until is not None:
            label = BEYOND_HORIZON if k == 0 else None
            panel.axvspan(time.factor * until, last, facecolor=LIGHT, alpha=0.7, linewidth=0.0, zorder=0.0, label=label)
        panel.ticklabel_format(axis="y", style="plain", useOffset=False)
        _keep_constants_flat(panel)
    for panel in axes[-1:] if bottom is None else bottom:
        panel.set_xlabel(time.label("time"))
    figure = axes[0].get_figure(root=True)
    if figure is not None:
        for panel in axes:
            height = figure.get_figheight() * panel.get_position().height
            panel.set_ylabel(wrap_label(panel.get_ylabel(), 1.1 * height, normal()))
        figure.align_ylabels(axes)


def _keep_constants_flat(axes: Axes) -> None:
    # matplotlib would magnify the round-off of a constant to the height of the panel
    low, high = axes.get_ylim()
    middle, size = 0.5 * (low + high), max(abs(low), abs(high))
    if high - low < 1e-6 * size:
        axes.set_ylim(middle - 0.1 * size, middle + 0.1 * size)


def select_window(run: AnyRun, first: float | None = None, last: float | None = None) -> AnyRun:
    """Return the samples, contacts and events of a run between two instants."""
    if first is None and last is None:
        return run
    begin, end = -math.inf if first is None else first, math.inf if last is None else last
    time = run["time"].values
    inside = (time >= begin) & (time <= end)
    if np.count_nonzero(inside) < 2:
        bounds = f"{time[0]:g} to {time[-1]:g} s" if time.size else "no samples"
        window = " ".join(f"{word} {at:g} s" for word, at in (("from", begin), ("to", end)) if math.isfinite(at))
        raise InputError(f"fewer than two samples {window}", f"at least two samples; the run has {bounds}")
    places = {"time": np.flatnonzero(inside)}
    if "contact" in run.sizes:
        start = run["contact_start"].values
        over = start + np.nan_to_num(run["contact_duration"].values, nan=math.inf)
        places["contact"] = np.flatnonzero((start <= end) & (over >= begin))
    if "event_time" in run:
        (along,) = run["event_time"].dims
        when = run["event_time"].values
        places[along] = np.flatnonzero((when >= begin) & (when <= end))
    return cast("AnyRun", run.isel(places))
