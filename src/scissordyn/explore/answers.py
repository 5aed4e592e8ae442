"""Prepare the results of a run for the page: cards, the contact table, and curves and orbit as figures for curves.js."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from scissordyn.file.output_file import csv_text
from scissordyn.numeral import decimals
from scissordyn.plot.contact import force_curve, torque_sources
from scissordyn.plot.scale import DEGREES, Scale, engineering
from scissordyn.plot.series import predictability_horizon
from scissordyn.record.joint_force import LATER_FORCE_RATIO_MAX, ForceAnswer, clearance_joints, kinds_left_out, parts_of_oiled
from scissordyn.record.results import Run, along, values_at
from scissordyn.units import counted, short

if TYPE_CHECKING:
    import xarray as xr

    from scissordyn.explore.case import Case
    from scissordyn.record.summary import ActuatorAnswer, PointAnswer, Summary


# Columns of the page's table of contacts: variable of the run, heading, unit
CONTACT_COLUMNS = (
    ("contact_start", "start", "s"),
    ("approach_speed", "approach", "m/s"),
    ("impulse", "impulse", "N s"),
    ("peak_force", "peak force", "N"),
    ("contact_duration", "duration", "s"),
    ("rebound_speed", "rebound", "m/s"),
)

SMALL_UNITS = {"s": (10.0, "ms"), "m/s": (0.2, "mm/s")}
"""Bound and smaller unit, by SI unit: a column with only smaller values than the bound is shown in the smaller unit."""

CURRENT_COLOUR, PINNED_COLOURS = "blue", ("vermilion", "green", "purple")
"""Names in page.css of the colours of the shown run and of pinned runs, newest first."""

LINE_COLOURS = ("blue", "orange", "green", "purple", "vermilion", "sky")
"""Colours of the lines in figures of the page other than the energy figure, in order."""

# colours of the lines in the page's energy figure, in the order of `ENERGY_LINES`
ENERGY_COLOURS = ("blue", "green", "purple", "vermilion", "orange", "sky")

# Largest number of points of a curve in the browser; longer curves are reduced to the extremes of intervals
CURVE_POINTS_MAX = 100_000

ENERGY_LINES = {
    "kinetic_energy": ("kinetic", "kinetic energy"),
    "potential_energy": ("potential", "potential energy"),
    "stored_energy": ("springs", "energy of springs"),
    "drive_work": ("drives", "work of drives"),
    "motor_work": ("motors", "work of motors"),
    "load_work": ("loads", "work of loads"),
}
"""Label of the line in the page's energy figure and column name in a CSV file, by energy variable."""

OPTIONAL_COLUMNS = ("friction", "stored_energy", "drive_work", "motor_work", "load_work", "dissipated_energy", "stress")
"""Columns of the page's tables that are left out if they are zero throughout."""


class Tangent(NamedTuple):
    """Run after a small change of a number, to first order, and the factor by which the changes of its curves are drawn."""

    label: str
    run: xr.Dataset
    widening: float


Card = dict[str, str]
Columns = dict[str, np.ndarray]


def cards(summary: Summary) -> Iterator[Card]:
    """Yield the cards with the main results."""
    most_cards = 3  # largest number of cards for points, and for torques; those with the largest excess come first
    force, bars = summary.force, summary.bars
    if force is not None:
        less = "" if force.loose is None else f"{short(force.loose.force, 'N')} at {_describe_joint(force.loose)}"
        yield _card("largest force", short(force.force, "N"), _describe_joint(force), less)
    yield from map(_point_card, sorted(summary.points, key=lambda point: -point.share)[:most_cards])
    torques = [actuator for actuator in summary.actuators if math.isfinite(actuator.torque)]
    torques.sort(key=lambda actuator: -actuator.torque / (actuator.limit or math.inf))
    yield from map(_torque_card, torques[:most_cards])
    if bars is not None and math.isfinite(bars.stress):
        detail = f"{bars.bar}, at {short(bars.when, 's')}"
        limited = math.isfinite(bars.utilisation)
        utilised = f"{bars.utilisation:.3g} of yield strength" if limited else ""
        met = bars.utilisation <= 1.0 if limited else None
        yield _card("largest stress", short(bars.stress, "Pa"), detail, utilised, met=met)
    if summary.span is not None:
        start, end = summary.span.sides
        yield _card("span at the end", end, summary.span.change, f"{start} at the start")
    if summary.horizon is not None:
        yield _card("trusted until", short(summary.horizon, "s"), f"through {counted(summary.horizon_contacts or 0)}")


def _card(title: str, value: str, *details: str, met: bool | None = None) -> Card:
    judged = "" if met is None else "met" if met else "missed"
    return {"title": title, "value": value, "detail": "; ".join(filter(None, details)), "judged": judged}


def _describe_joint(force: ForceAnswer) -> str:
    where = f"{force.kind} {force.joint}, at {short(force.when, 's')}"
    return f"{where}{_estimate_note(force)}{parts_of_oiled(force.metal, force.film)}"


def _estimate_note(force: ForceAnswer) -> str:
    least = f" from {short(force.least, 'N')} on" if force.least < LATER_FORCE_RATIO_MAX * force.force else ""
    return f", an estimate{least}" if force.estimated else ""


def _point_card(point: PointAnswer) -> Card:
    title = f"{point.name} off by"
    if not math.isfinite(point.deviation):
        return _card(title, "unknown", "the ideal mechanism ends earlier")
    allowed = "" if point.tolerance is None else f"allowed {short(point.tolerance, 'm')}"
    met = None if point.tolerance is None else point.met
    return _card(title, short(point.deviation, "m"), f"at {short(point.when, 's')}", allowed, met=met)


def _torque_card(actuator: ActuatorAnswer) -> Card:
    quantity = "force" if actuator.unit == "N" else "torque"
    title = f"{f'driving {quantity} on' if actuator.kind == 'drive' else f'{quantity} of'} {actuator.name}"
    value = short(actuator.torque, actuator.unit)
    if actuator.saturated:
        return _card(title, value, f"at its limit for {short(actuator.time_at_limit, 's')}", met=False)
    when = f"at {short(actuator.when, 's')}" if math.isfinite(actuator.when) else ""
    limit = "" if actuator.limit is None else f"limit {short(actuator.limit, 'N m')}"
    return _card(title, value, when, limit, met=True if limit else None)


def contact_table(run: Run) -> dict[str, Any]:
    """Return the contacts of a run as columns, in suitable units."""
    columns = []
    left_out = kinds_left_out(run)
    for name, title, unit in CONTACT_COLUMNS:
        if name in left_out:
            continue
        values = run[name].values
        finite = np.abs(values[np.isfinite(values)])
        scale = engineering(unit, finite) if unit in ("s", "N") else Scale(1.0, unit)
        bound, smaller = SMALL_UNITS.get(scale.unit, (0.0, ""))
        if finite.max(initial=0.0) < bound:
            scale = Scale(1e3, smaller)
        shown = scale.factor * values
        columns.append({"title": f"{title} [{scale.unit}]", "values": shown, "places": decimals(shown.tolist())})
    joints, starts = run["contact_joint"].values.astype(str).tolist(), run["contact_start"].values.copy()
    return {"joints": joints, "seconds": starts, "columns": columns}


def differences(cases: Sequence[Case]) -> list[str]:
    """Return a legend text for each case: the values in which the cases differ."""
    most_values = 4  # largest number of values in a legend text; the number of further ones is appended
    keys = dict.fromkeys(key for case in cases for key in case.fields)
    numbers = {key: [case.fields.get(key) for case in cases] for key in keys}
    differing = [key for key, fields in numbers.items() if len({field and (field.value or field.text) for field in fields}) > 1]
    texts = []
    for k in range(len(cases)):
        parts = [f"{field.label} {field.shown}" for key in differing if (field := numbers[key][k])]
        more = len(parts) - most_values
        texts.append(", ".join(parts[:most_values]) + (f" and {more} more" if more > 0 else "") or "the same values")
    return texts


class Figure(NamedTuple):
    """Figure with curves over time."""

    unit: str  # SI unit
    title: str
    lines: Mapping[str, tuple[str, str]]  # Label of each curve and its column name in a CSV file, by name of the curve


class DrawnCurves:
    """Choice of the curves of a run that the page draws: of a joint, the output body, torques, and the worst tracked point."""

    def __init__(self, run: Run, summary: Summary, joint: str, output: str) -> None:
        most_torques = 4  # those with the largest values are drawn
        self.joint, bodies = joint, run["body"].values.astype(str).tolist()
        self.output = output if output in bodies else bodies[-1]
        self.point: PointAnswer | None = max(summary.points, key=lambda point: point.share, default=None)
        self._run, self._sources = run, torque_sources(run)
        sources = self._sources
        largest = sorted(range(len(sources)), key=lambda k: -float(np.abs(sources[k].curve.values).max(initial=0.0)))
        drawn = sorted(largest[:most_torques])
        self.torques = {f"torque {number}": sources[k] for number, k in enumerate(drawn, start=1)}
        self.figures = self._figures(len(sources) - len(drawn))

    def _figures(self, further: int) -> dict[str, Figure]:
        """Return the figures by name; `further` is the number of torques that are not drawn."""
        at, point = f" at {self.joint}" if self.joint else "", self.point
        output = Figure("rad", f"angle of {self.output}", {"output": ("", "output angle")})
        if "slider_position" in self._run:
            output = Figure("m", "position of the slider", {"output": ("", "slider position")})
        limits = {
            name: "" if torque.limit is None else f", limit {short(torque.limit, 'N m')}"
            for name, torque in self.torques.items()
        }
        track = f"deviation of {point.name}" if point else ""
        allowed = "" if point is None or point.tolerance is None else f"; allowed {short(point.tolerance, 'm')}"
        forces = {
            "force": ("force", f"force{at}"),
            "friction": ("friction", f"friction force{at}"),
            "metal": ("metal alone", f"normal force of the metal{at}"),
        }
        return {
            "output": output,
            "torque": Figure(
                "N m",
                f"torque; {further} more are smaller" if further else "torque",
                {name: (torque.name + limits[name], torque.name) for name, torque in self.torques.items()},
            ),
            "force": Figure("N", f"contact force{at}", forces),
            "slip": Figure("m/s", f"slip speed{at}", {"slip": ("slip", f"slip speed{at}")}),
            "energy": Figure("J", "energy", ENERGY_LINES),
            "loss": Figure("J", "dissipated energy", {"dissipated_energy": ("dissipated", "dissipated energy")}),
            "film": Figure("m", f"film thickness{at}", {"film": ("film", "film")}),
            "stress": Figure("Pa", "largest stress of the bars", {"stress": ("stress", "stress")}),
            "track": Figure("m", track + allowed, {"track": ("track", track)}),
        }

    def columns(self, run: Run) -> tuple[np.ndarray, Columns]:
        """Return the instants and the curves in SI units, including the located peaks of force and torque between samples.

        Other curves are interpolated linearly between samples. Curves that the run does not have are left out.
        """
        variables, joint, time = run.variables, self.joint, run.variables["time"].values
        labels = {dim: variables[dim].values.astype(str).tolist() for dim in ("joint", "body", "film", "track") if dim in run}
        films = labels.get("film", [])
        curves = {source.name: source.curve for source in (self._sources if run is self._run else torque_sources(run))}
        exact = {column: curves[torque.name] for column, torque in self.torques.items() if torque.name in curves}
        if joint in clearance_joints(run):
            exact["force"] = force_curve(run, joint)
        parts = [
            ("slip", "slip_speed", "joint", joint),
            ("friction", "friction_force", "joint", joint),
            ("metal", "normal_force", "joint", joint if joint in films else ""),
            ("output", "angle", "body", self.output),
            ("film", "film_thickness", "film", joint if joint in films else "".join(films[:1])),
            ("track", "track_deviation", "track", self.point.name if self.point else ""),
        ]
        sampled = {
            column: along(variables[name], dim, "time")[labels[dim].index(label)]
            for column, name, dim, label in parts
            if name in run and label in labels[dim]
        }
        sampled |= {name: variables[name].values for name in (*ENERGY_LINES, "dissipated_energy") if name in run}
        if "slider_position" in run:
            sampled["output"] = variables["slider_position"].values
        if "beam_stress" in run:
            sampled["stress"] = along(variables["beam_stress"], "beam", "time").max(axis=0)
        instants = np.unique(np.concatenate([time, *(curve.time for curve in exact.values())]))
        values = {name: np.interp(instants, curve.time, curve.values) for name, curve in exact.items()}
        for name, column in sampled.items():
            if name not in OPTIONAL_COLUMNS or np.any(np.nan_to_num(column)):
                values[name] = column if instants.size == time.size else np.interp(instants, time, column)
        present = (name for figure in self.figures.values() for name in figure.lines if name in values)
        return instants, {name: values[name] for name in present if np.isfinite(values[name]).any()}

    def levels(self, figure: str, data: Columns, nearest: float = 5.0) -> list[float]:
        """Return the limits that are drawn in a figure: those that its curves reach to at least a fifth.

        `nearest`: largest ratio of a drawn limit to the curve's largest value; a more distant limit would flatten the curve.
        """
        point = self.point
        if figure == "track" and point is not None and point.tolerance is not None:
            return [point.tolerance] if nearest * point.deviation >= point.tolerance else []
        limits = self.torques if figure == "torque" else {}
        near = (
            side * source.limit
            for name, source in limits.items()
            for side in (1.0, -1.0)
            if source.limit is not None and nearest * np.nanmax(side * data[name], initial=0.0) >= source.limit
        )
        return list(dict.fromkeys(near))


def drawn_points(count: int, curves: Sequence[np.ndarray]) -> np.ndarray | slice:
    """Return the indices of the points to draw: all points of a short curve, or the extremes of each interval of a long one."""
    if count <= CURVE_POINTS_MAX or not curves:
        return slice(None)
    long = -(-2 * max(1, len(curves)) * count // CURVE_POINTS_MAX)
    firsts = np.arange(0, count - long + 1, long)
    points = [np.array([0, count - 1]), np.arange(firsts.size * long, count)]
    for curve in curves:
        intervals = np.nan_to_num(curve[: firsts.size * long]).reshape(firsts.size, long)
        points += [firsts + intervals.argmin(axis=1), firsts + intervals.argmax(axis=1)]
    return np.unique(np.concatenate(points))


def figures(
    run: Run,
    summary: Summary,
    pins: Sequence[Run],
    joint: str,
    output: str,
    tangent: Tangent | None = None,
) -> dict[str, Any]:
    """Return the figures of a run and of the pinned runs (the newest last).

    The changes of `tangent` are drawn as bands on both sides of the curves. Scales fit all runs, and long curves are reduced.
    Keys: "figures" over time, "orbit" (or None), "factor" from seconds to the time axis, and "until", "horizon" on that axis.
    """
    chosen, columns = DrawnCurves(run, summary, joint, output), []
    time, horizon = engineering("s", run["time"].values), predictability_horizon(run)
    for compared in (run, *reversed(pins)):
        instants, curves = chosen.columns(compared)
        rows = drawn_points(instants.size, list(curves.values()))
        columns.append({"time": time.factor * instants[rows], **{name: curve[rows] for name, curve in curves.items()}})
    drawn, (data, *before) = [], columns
    bands = {} if tangent is None else _bands(chosen, run, tangent)
    for name, (unit, title, heads) in chosen.figures.items():
        values = [part[line] for part in columns for line in heads if line in part]
        scale = DEGREES if unit == "rad" else engineering(unit, *values)
        labels = {line: label for line, (label, _) in heads.items() if line in data}
        if len(labels) == 1 and name != "torque":
            labels = dict.fromkeys(labels, "")
        first, colors = (
            next(iter(heads), ""),
            dict(zip(heads, ENERGY_COLOURS if name == "energy" else LINE_COLOURS, strict=False)),
        )
        pinned = [(PINNED_COLOURS[k], pin) for k, pin in enumerate(before) if first in pin]
        lines = [_line("", color, pin["time"], scale.factor * pin[first], "dash") for color, pin in pinned]
        for line in labels.keys() & bands.keys():
            x, y, size = bands[line]
            band = _line("", colors[line], time.factor * x, scale.factor * y, "band")
            lines.append({**band, "size": scale.factor * size})
        lines += [_line(label, colors[line], data["time"], scale.factor * data[line]) for line, label in labels.items()]
        levels = [scale.factor * level for level in chosen.levels(name, data)]
        about = {"name": name, "title": title, "unit": scale.unit or "1", "axis": f"time [{time.unit}]"}
        drawn += [{**about, "lines": lines, "levels": levels}] if labels else []
    return {
        "figures": drawn,
        "orbit": _orbit(run, pins, joint),
        "factor": time.factor,
        "until": time.factor * float(run["time"].values[-1]),
        "horizon": None if horizon is None else time.factor * horizon,
    }


def _bands(chosen: DrawnCurves, run: Run, tangent: Tangent, change_max: float = 0.1) -> dict[str, tuple[np.ndarray, ...]]:
    """Return instants, values and drawn changes of the curves; a change is NaN if it exceeds `change_max` of the curve's range.

    An impact that moves in time changes a steep curve so much that its tangent is not valid there.
    """
    (instants, curves), (before, values) = chosen.columns(tangent.run), chosen.columns(run)
    bands = dict[str, tuple[np.ndarray, ...]]()
    for line in curves.keys() & values.keys():
        value = np.interp(instants, before, values[line])
        size = np.abs(curves[line] - value)
        size[size > change_max * np.ptp(values[line])] = np.nan
        rows = drawn_points(instants.size, [value, size])
        bands[line] = instants[rows], value[rows], tangent.widening * size[rows]
    return bands


def _line(label: str, color: str, x: np.ndarray, y: np.ndarray, style: str = "solid") -> dict[str, Any]:
    return {"label": label, "color": color, "x": x, "y": y, "style": style}


def orbit(run: Run, joint: str, factor: float) -> Columns:
    """Return the journal's orbit as columns "x" and "y"; a long orbit is reduced to the outermost points of each interval."""
    k = run.variables["joint"].values.tolist().index(joint)
    x, y = factor * along(run.variables["eccentricity"], "joint", "axis", "time")[k]
    rows = drawn_points(x.size, [x, y, np.hypot(x, y)])
    return {"x": x[rows].copy(), "y": y[rows].copy()}


def _orbit(run: Run, pins: Sequence[Run], joint: str) -> dict[str, Any] | None:
    if not joint or ("plane_contact" in run and bool(values_at(run, "plane_contact", joint=joint))):
        return None
    clearance = float(values_at(run, "clearance", joint=joint))
    scale = engineering("m", clearance)
    around, size = np.linspace(0.0, 2.0 * math.pi, 181), scale.factor * clearance
    now = orbit(run, joint, scale.factor)
    before = [orbit(pin, joint, scale.factor) for pin in reversed(pins) if joint in clearance_joints(pin)]
    largest = max(float(np.abs(path[axis]).max(initial=0.0)) for path in (now, *before) for axis in "xy")
    return {
        "name": "orbit",
        "title": f"journal orbit at {joint}",
        "unit": scale.unit,
        "axis": f"x [{scale.unit}]",
        "lines": [
            _line("", "faint", size * np.cos(around), size * np.sin(around), "dots"),
            *(_line("", PINNED_COLOURS[k], path["x"], path["y"], "dash") for k, path in enumerate(before)),
            _line("", "sky", now["x"], now["y"]),
        ],
        "levels": [],
        "reach": _round_up(1.1 * max(size, largest)),
    }


def _round_up(reach: float) -> float:
    """Return a length rounded up to two digits, so that the axis stays the same when a curve changes little."""
    if reach <= 0.0:
        return 1.0
    digit = 10.0 ** (math.floor(math.log10(reach)) - 1)
    return math.ceil(reach / digit) * digit


def curves_as_csv(run: Run, summary: Summary, joint: str, output: str) -> str:
    """Return the curves of a run as drawn by the page, as CSV, including located peaks between samples."""
    chosen = DrawnCurves(run, summary, joint, output)
    time, values = chosen.columns(run)
    heads = {"time": "time [s]"}
    for unit, _, lines in chosen.figures.values():
        heads |= {column: f"{head} [{unit}]" for column, (_, head) in lines.items()}
    rows = zip(time.tolist(), *(column.tolist() for column in values.values()), strict=True)
    return csv_text([[heads[name] for name in ("time", *values)], *rows])
