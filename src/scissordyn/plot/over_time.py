"""Draw quantities over time: motion, torques, deviations of tracked points, energies, and the comparison of two runs."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes

from scissordyn.casefile.configuration import ATTRIBUTE, read_configuration
from scissordyn.errors import InputError, did_you_mean
from scissordyn.plot.contact import TorqueSource, force_curve, insert_points, torque_sources
from scissordyn.plot.scale import Scale, engineering
from scissordyn.plot.series import (
    compare,
    draw_curves,
    draw_limit,
    finish_time_axes,
    largest_forces,
    mark_largest,
    picture,
    select_window,
    time_scale,
)
from scissordyn.plot.style import (
    BLACK,
    BLUE,
    GREEN,
    LINE_WIDTH,
    ORANGE,
    OUTSIDE,
    PURPLE,
    SKY,
    VERMILION,
    Canvas,
    legend,
    literal,
    normal,
    panels,
    small,
)
from scissordyn.record.joint_force import clearance_joints
from scissordyn.record.results import Curve, Run, curve_of, values_at
from scissordyn.record.summary import at_limit, point_answers

if TYPE_CHECKING:
    import xarray as xr


DEFAULT_BODY = "unit 1/bar 2"  # Body whose rotation is drawn if the mechanism has it: coupler of the first scissor unit

# Variables of the slider's position and its two derivatives, by the label of their axis
SLIDER = {"position": "slider_position", "velocity": "slider_velocity", "acceleration": "slider_acceleration"}
ROTATION = {name: name.replace(" ", "_") for name in ("angle", "angular velocity", "angular acceleration")}
"""Variables of a body's rotation and its two derivatives, by the label of their axis."""

RPM = Scale(30.0 / math.pi, "rpm")  # Conversion of rotational speeds from rad/s to rpm in pictures


ENERGIES = (
    (
        "energy",
        (
            ("kinetic_energy", "kinetic", BLUE),
            ("potential_energy", "potential", GREEN),
            ("stored_energy", "springs and other components", PURPLE),
            ("drive_work", "work of the drive", VERMILION),
            ("motor_work", "work of motors and actuators", ORANGE),
            ("load_work", "work of forces and torques", SKY),
        ),
    ),
    (
        "contacts",
        (
            ("elastic_energy", "elastic", ORANGE),
            ("damping_loss", "damping of contacts", BLUE),
            ("friction_loss", "friction of contacts", GREEN),
            ("damper_loss", "dampers and other components", VERMILION),
            ("switching_loss", "latches and snapping", SKY),
            ("dissipated_energy", "dissipated", PURPLE),
        ),
    ),
    ("residual", (("energy_residual", "residual of the balance", BLACK),)),
)
"""Panels of the energy picture from top to bottom: name, and variable, label and colour of each curve."""

ALWAYS_DRAWN = ("kinetic_energy", "potential_energy", "elastic_energy", "dissipated_energy", "energy_residual")
"""Energies that are always drawn; the others are drawn only if they are not zero throughout."""

# Dissipated energies outside contacts; with them the panel "contacts" is called "losses"
NON_CONTACT_LOSSES = ("damper_loss", "switching_loss")


SECOND_RUN_STYLE: dict[str, Any] = {"color": VERMILION, "linewidth": LINE_WIDTH, "linestyle": (0, (5, 1.5)), "zorder": 3.0}
"""Line style of the second of two compared runs: dashed and on top, so that both are visible where they agree."""

WORKS = ("drive_work", "motor_work", "load_work")  # Variables whose sum is the work that `comparison` draws


@picture("Six Axes, row by row, slider at the left; three for a mechanism without a slider.")
def response(
    run: Run,
    ideal: Run | None = None,
    *,
    body: str = "",
    start: float | None = None,
    end: float | None = None,
    axes: Canvas = None,
) -> list[Axes]:
    """Draw position, velocity and acceleration of the slider, and the rotation of a body.

    Parameters
    ----------
    body : str
        Body whose rotation is drawn. By default the output body; if that is the slider, the coupler of the first scissor
        unit, or else the first body.

    Raises
    ------
    InputError
        If the run has no body of that name.
    """
    run = select_window(run, start, end)
    bodies = [str(name) for name in run["body"].values]
    chosen = body or _body(run, bodies)
    if chosen not in bodies:
        raise InputError(f"unknown body '{chosen}'{did_you_mean(chosen, bodies)}", "one of " + ", ".join(bodies))
    moving: list[tuple[str, dict[str, str], dict[str, str]]] = []
    if SLIDER["position"] in run:
        moving.append(("slider", SLIDER, {}))
    moving.append((chosen, ROTATION, {"body": chosen}))
    columns = len(moving)
    drawn = panels(axes, 3, columns, size=(4.6 * columns, 6.4))
    time = time_scale(run)
    for column, (title, variables, of) in enumerate(moving):
        drawn[column].set_title(literal(title), loc="left", fontsize=normal())
        for order, (panel, label) in enumerate(zip(drawn[column::columns], variables, strict=True)):
            shown = [
                _without_round_off([curve_of(shown_run, name, **of) for name in variables.values()], order)
                for shown_run in (run, ideal)
                if shown_run is not None
            ]
            compare(panel, label, shown[0], shown[1] if ideal is not None else None, time=time)
    finish_time_axes(drawn, run, time, bottom=drawn[-columns:])
    legend(drawn, above=axes is None)
    return drawn


def _without_round_off(motion: list[Curve], order: int) -> Curve:
    """Return a derivative of a motion; zero if its integral over the run is only round-off of the quantity one order lower."""
    round_off = 1e-10  # relative change over a run that counts as round-off
    curve = motion[order]
    duration = float(curve.time[-1] - curve.time[0])
    before = _magnitude(motion[order - 1]) if order else 0.0
    return curve._replace(values=0.0 * curve.values) if _magnitude(curve) * duration < round_off * before else curve


def _magnitude(curve: Curve) -> float:
    return float(np.nanmax(np.abs(curve.values), initial=0.0))


def _body(run: Run, bodies: list[str]) -> str:
    """Return the output body if its rotation is the output; otherwise a coupler, or the first body."""
    output = str(read_configuration(run).mechanism.output_body) if ATTRIBUTE in run.attrs else ""
    if output in bodies and SLIDER["position"] not in run:
        return output
    return DEFAULT_BODY if DEFAULT_BODY in bodies else bodies[0]


@picture("One for each drive, actuator and motor, in this order.")
def torque(
    run: Run,
    ideal: Run | None = None,
    *,
    start: float | None = None,
    end: float | None = None,
    axes: Canvas = None,
) -> list[Axes]:
    """Draw the torques of drives, actuators and motors with their maxima and the ideal mechanism's torques, one panel for each.

    Dotted lines mark a limit in both directions; the panel is shaded where the torque is at its limit.

    Raises
    ------
    InputError
        If the run has no drive, actuator or motor.
    """
    run = select_window(run, start, end)
    sources = torque_sources(run)
    if not sources:
        raise InputError(
            "the run has no drive, actuator or motor", "a run of a driven or controlled mechanism", "arm.driven(speed=rpm(150))"
        )
    beside = {} if ideal is None else {source.name: source.curve for source in torque_sources(ideal)}
    drawn = panels(axes, len(sources), size=(8.0, 0.7 + 2.6 * len(sources)))
    time = time_scale(run)
    for panel, source in zip(drawn, sources, strict=True):
        scale = compare(panel, literal(source.name), source.curve, beside.get(source.name), time=time)
        if source.peak is not None:
            mark_largest(panel, time.factor * source.peak[0], scale.factor * source.peak[1])
        _draw_torque_limit(panel, source, scale, time)
    finish_time_axes(drawn, run, time)
    legend(drawn, above=axes is None)
    return drawn


def _draw_torque_limit(axes: Axes, source: TorqueSource, scale: Scale, time: Scale) -> None:
    """Draw lines at the limit if the curve exceeds half of it, and shade the intervals in which the torque is at the limit."""
    if source.limit is None:
        return
    values = source.curve.values
    for sign in (1.0, -1.0):
        if np.max(sign * values, initial=0.0) > 0.5 * source.limit:
            draw_limit(axes, sign * scale.factor * source.limit, "limit")
    shaded: dict[str, Any] = {"facecolor": ORANGE, "alpha": 0.22, "linewidth": 0.0, "zorder": 0.5, "label": "at the limit"}
    for start, end in at_limit(source.curve.time, values, source.limit):
        axes.axvspan(time.factor * start, time.factor * end, **shaded)


def torque_speed(
    needed: xr.Dataset,
    *,
    speeds: np.ndarray | None = None,
    torques: np.ndarray | None = None,
    axes: Canvas = None,
) -> list[Axes]:
    """Draw the torque of a drive, an actuator or a motor over its speed."""
    least_range = 1.15  # least drawn range of the speed, as a multiple of the required speed
    (panel,) = panels(axes, 1, size=(5.4, 4.2))
    scale = engineering("N m", needed["torque"].values, *(() if torques is None else (torques,)))
    speed, torque = RPM.factor * needed["speed"].values, scale.factor * needed["torque"].values
    panel.plot(speed, torque, color=BLUE, linewidth=0.7 * LINE_WIDTH, label=literal(f"torque of {needed.attrs['of']}"))
    k = int(np.argmax(np.abs(torque)))
    panel.plot(speed[k], torque[k], linestyle="", marker="o", markersize=3.0, color=BLACK, label="largest")
    if speeds is not None and torques is not None:
        at, most = RPM.factor * speeds, scale.factor * torques
        for sense in (1.0, -1.0):
            for side in (1.0, -1.0):
                label = "motor" if sense == side == 1.0 else None
                panel.plot(side * at, sense * most, color=VERMILION, linewidth=1.5 * LINE_WIDTH, label=label)
        wide = least_range * max(float(np.max(np.abs(speed))), float(at[-1]))
        panel.set_xlim(-wide if speed.min() < -0.02 * wide else -0.02 * wide, wide)
    panel.set(xlabel=RPM.label("speed"), ylabel=scale.label("torque"))
    legend([panel], above=axes is None)
    return [panel]


def has_tracks(run: Run) -> bool:
    return "track_deviation" in run and run.sizes.get("track", 0) > 0


@picture("One for each tracked point.")
def track(run: Run, *, start: float | None = None, end: float | None = None, axes: Canvas = None) -> list[Axes]:
    """Draw the deviation of tracked points from their commanded paths, with the maximum and the tolerance.

    There is one panel for each point. The panel is shaded where the point is outside its tolerance.

    Raises
    ------
    InputError
        If the run has no tracked point with a deviation.
    """
    run = select_window(run, start, end)
    if not has_tracks(run):
        raise InputError(
            "the run has no deviation of a tracked point",
            "a run of a mechanism with clearance and a tracked point",
            'arm.track("tip", "unit 2/bar 1", "end", 1e-3)',
        )
    described = read_configuration(run).mechanism if ATTRIBUTE in run.attrs else None
    answers = {point.name: point for point in point_answers(run, described)}
    names = run["track"].values.astype(str).tolist()
    drawn = panels(axes, len(names), size=(8.0, 0.7 + 2.4 * len(names)))
    time = time_scale(run)
    for panel, name in zip(drawn, names, strict=True):
        sampled = values_at(run, "track_deviation", "time", track=name)
        point = answers.get(name)
        tolerance = None if point is None else point.tolerance
        peak = ([], []) if point is None else ([point.when], [point.deviation])
        instants, values = insert_points(run["time"].values, sampled, *map(np.array, peak))
        scale = engineering("m", values, *(() if tolerance is None else (tolerance,)))
        at, deviation = time.factor * instants, scale.factor * values
        panel.plot(at, deviation, color=BLUE, linewidth=LINE_WIDTH, label="deviation")
        if point is not None and instants[0] <= point.when <= instants[-1]:
            mark_largest(panel, time.factor * point.when, scale.factor * point.deviation)
        if tolerance is not None:
            outside, limit = values > tolerance, scale.factor * tolerance
            draw_limit(panel, limit, "tolerance")
            look: dict[str, Any] = {"facecolor": OUTSIDE, "alpha": 0.15, "linewidth": 0.0, "interpolate": True}
            panel.fill_between(at, limit, deviation, where=outside, label="outside" if outside.any() else None, **look)
        panel.set_ylim(bottom=0.0)
        panel.set_ylabel(scale.label("deviation"))
        panel.set_title(f"tracked point {literal(name)}", loc="left", fontsize=small())
    finish_time_axes(drawn, run, time)
    legend(drawn)
    return drawn


@picture("Three Axes, or two for a run in which no contact stored or dissipated energy.")
def energy(run: Run, *, start: float | None = None, end: float | None = None, axes: Canvas = None) -> list[Axes]:
    """Draw energies and work, elastic energy and losses of contacts and components, and the residual of the energy balance."""
    run = select_window(run, start, end)
    shown = []
    for name, declared in ENERGIES:
        kept = [line for line in declared if line[0] in run and (line[0] in ALWAYS_DRAWN or np.any(run[line[0]].values))]
        if kept and (name != "contacts" or any(np.any(run[variable].values) for variable, _, _ in kept)):
            losses = any(variable in NON_CONTACT_LOSSES for variable, _, _ in kept)
            shown.append(("losses" if losses else name, kept))
    ratios = [1.0 if name == "residual" else 1.8 for name, _ in shown]
    drawn = panels(axes, len(shown), size=(8.5, 0.6 + 1.25 * sum(ratios)), ratios=ratios)
    time = time_scale(run)
    for panel, (name, lines) in zip(drawn, shown, strict=True):
        curves = [(curve_of(run, variable), {"color": color, "label": label}) for variable, label, color in lines]
        draw_curves(panel, name, curves, time)
    finish_time_axes(drawn, run, time)
    for panel in drawn:
        legend([panel])
    return drawn


def shared_curves(runs: Sequence[Run]) -> Iterator[tuple[str, list[Curve]]]:
    """Yield the name of each quantity that all runs have, with its curves: output, torques, forces, energies, work."""
    most_joints = 3  # those with the largest forces
    if all("slider_position" in run for run in runs):
        yield "position", [curve_of(run, "slider_position") for run in runs]
    torques = [{source.name: source.curve for source in torque_sources(run)} for run in runs]
    for name in _common_names([list(curves) for curves in torques]):
        yield name, [curves[name] for curves in torques]
    if not all("slider_position" in run for run in runs):
        for body in _common_names([run["body"].values.astype(str).tolist() for run in runs])[-1:]:
            yield f"angle of {body}", [curve_of(run, "angle", body=body) for run in runs]
    joints = _common_names([clearance_joints(run) for run in runs])
    largest = [largest_forces(run) for run in runs]
    peaks = [max(curves[joint] for curves in largest) for joint in joints]
    chosen = {joints[k] for k in np.argsort(-np.array(peaks), kind="stable")[:most_joints]}
    for joint in joints:
        if joint in chosen:
            yield f"force at {joint}", [force_curve(run, joint) for run in runs]
    for variable, name in (("kinetic_energy", "kinetic energy"), ("dissipated_energy", "dissipated")):
        if all(variable in run and np.any(run[variable].values) for run in runs):
            yield name, [curve_of(run, variable) for run in runs]
    if all(set(WORKS) <= set(run.variables) and any(np.any(run[name].values) for name in WORKS) for run in runs):
        yield "work", [Curve(run["time"].values, sum(run[name].values for name in WORKS), "J") for run in runs]


def _common_names(names: Sequence[Sequence[str]]) -> list[str]:
    return [name for name in names[0] if all(name in other for other in names[1:])]


@picture("One for each of `shared_curves`.")
def comparison(
    run: Run, other: Run, *, labels: tuple[str, str] = ("first run", "second run"), axes: Canvas = None
) -> list[Axes]:
    """Draw output, torque, contact forces and energies of two runs, each pair of curves in one panel.

    Parameters
    ----------
    run, other : Dataset
    labels : (str, str)
        Names of the runs in the legend.
    """
    curves = list(shared_curves([run, other]))
    drawn = panels(axes, len(curves), size=(8.5, 0.8 + 1.75 * len(curves)))
    longer = max(run, other, key=lambda part: float(part["time"].values[-1]))
    time = time_scale(longer)
    for panel, (name, pair) in zip(drawn, curves, strict=True):
        looks = [
            look | {"label": literal(label)} for look, label in zip(({"color": BLUE}, SECOND_RUN_STYLE), labels, strict=True)
        ]
        draw_curves(panel, literal(name), list(zip(pair, looks, strict=True)), time)
        panel.set_ylabel(panel.get_ylabel().replace(" [", "\n["))
    finish_time_axes(drawn, longer, time)
    legend(drawn, above=axes is None)
    return drawn
