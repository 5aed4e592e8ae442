"""Summary of a run: tracked points, actuators, largest force, bars, span, work and predictability horizon."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from scissordyn.casefile.configuration import ATTRIBUTE, Configuration, read_configuration
from scissordyn.components.actuator import Actuator
from scissordyn.components.motor import Motor
from scissordyn.errors import InputError, printable
from scissordyn.model.options import Options
from scissordyn.record.joint_force import (
    Answer,
    ForceAnswer,
    JointSummary,
    clearance_joints,
    force_after_start,
    ideal_summaries,
    joint_summaries,
)
from scissordyn.record.placement import placed
from scissordyn.record.results import Run, along
from scissordyn.record.sampling import check_whole
from scissordyn.record.track import PARTS
from scissordyn.record.warn import LIMIT_RATIO_MIN, largest_energy_change
from scissordyn.tolerance import ASSEMBLY_TOL, REPORTED_FRACTION, ROUND_OFF_TOL
from scissordyn.units import counted, short

WORKS = (("drive_work", "drives"), ("motor_work", "motors and actuators"), ("load_work", "forces and torques"))
"""Variables of work in a run, and the parts that do this work."""


@dataclass(frozen=True)
class PointAnswer(Answer):
    """Deviation of a tracked point from its commanded path, compared with its tolerance."""

    DERIVED = ("met",)

    name: str
    deviation: float  # Largest distance from the path in the rigid ideal mechanism [m]; NaN if that path ends early
    when: float  # Instant of the largest distance [s]
    tolerance: float | None  # [m]
    # Instant from which the point stays within its tolerance [s]; None without tolerance, or if it is outside at the end
    settled: float | None
    at_end: float  # Deviation at the last sample [m]
    # Contributions of servos, bending and clearance to the deviation, where present [m]: at its largest value, and at the end
    parts: dict[str, float]
    parts_at_end: dict[str, float]

    @property
    def met(self) -> bool | None:
        """True if the point never leaves its tolerance; None without a tolerance or a known deviation."""
        if self.tolerance is None or not math.isfinite(self.deviation):
            return None
        return self.deviation <= self.tolerance

    @property
    def share(self) -> float:
        """Ratio of deviation to tolerance; 0 without a tolerance, -1 if the deviation is not known."""
        return self.deviation / (self.tolerance or math.inf) if math.isfinite(self.deviation) else -1.0

    def __str__(self) -> str:
        name = f"Tracked point {printable(self.name)}"
        if not math.isfinite(self.deviation):
            return f"{name}: its deviation is not known, as the rigid ideal mechanism does not reach the end of the run."
        text = f"{name}: off by up to {short(self.deviation, 'm')}, at {short(self.when, 's')}{_parts(self.parts)}"
        text += f"; {short(self.at_end, 'm')} at the end{_parts(self.parts_at_end)}"
        if self.tolerance is None:
            return f"{text}; no tolerance is given."
        if self.met:
            return f"{text}; tolerance {short(self.tolerance, 'm')}: met."
        ratio = self.deviation / self.tolerance
        settled = f"; within it from {short(self.settled, 's')} on" if self.settled is not None else ""
        return f"{text}; tolerance {short(self.tolerance, 'm')}: not met, by a factor of {ratio:.3g}{settled}."


def _parts(sizes: dict[str, float]) -> str:
    """Return the contributions to a deviation as text, without those that are negligible; empty if all are zero."""
    least = REPORTED_FRACTION * max(sizes.values(), default=0.0)
    shown = {name: size for name, size in sizes.items() if size > least}
    text = ", ".join(f"{name} {short(size, 'm')}" for name, size in shown.items())
    return f" ({text})" if len(shown) > 1 else f", by {next(iter(shown))}" if shown else ""


@dataclass(frozen=True)
class ActuatorAnswer(Answer):
    """Largest torque of a drive, an actuator or a motor, compared with its limit."""

    name: str
    kind: str
    torque: float  # Largest torque [N m] or force [N]
    when: float  # Instant of the largest torque [s]; NaN if the run does not contain it
    limit: float | None  # [N m]
    time_at_limit: float  # Time at the limit, from the samples [s]
    unit: str = "N m"

    @property
    def saturated(self) -> bool:
        """True if the torque reaches its limit."""
        return self.limit is not None and self.torque >= LIMIT_RATIO_MIN * self.limit

    def __str__(self) -> str:
        when = f" at {short(self.when, 's')}" if math.isfinite(self.when) else ""
        name = f"{self.kind.capitalize().replace('_', ' ')} {printable(self.name)}"
        if math.isinf(self.torque):
            return f"{name}: the torque grows without limit towards the locking position{when}."
        quantity = "torque" if self.unit == "N m" else "force"
        text = f"{name}: largest {quantity} {short(self.torque, self.unit)}{when}"
        if self.limit is None:
            return f"{text}."
        if not self.saturated:
            return f"{text}, {self.torque / self.limit:.2g} of its limit of {short(self.limit, 'N m')}."
        lasting = f"for {short(self.time_at_limit, 's')}" if self.time_at_limit > 0.0 else "for less than a sample"
        return f"{text}: at its limit of {short(self.limit, 'N m')} {lasting}."


@dataclass(frozen=True)
class SpanAnswer(Answer):
    """Width and height of the bounding box of all body points, at the start and at the end."""

    DERIVED = ("change",)

    start: tuple[float, float]  # Width and height at the first sample [m]
    end: tuple[float, float]  # Width and height at the last sample [m]

    @property
    def change(self) -> str:
        """Text with the change of width and height."""
        senses: dict[str, list[str]] = {}
        for axis, first, last in zip("xy", self.start, self.end, strict=True):
            same = abs(last - first) <= REPORTED_FRACTION * max(*self.start, *self.end)
            senses.setdefault("keeps its size" if same else "grows" if last > first else "shrinks", []).append(axis)
        return " and ".join(f"{sense} along {' and '.join(axes)}" for sense, axes in senses.items())

    @property
    def sides(self) -> tuple[str, str]:
        """Texts 'width x height' of the mechanism at the start and at the end."""
        first, last = (f"{short(width, 'm')} x {short(height, 'm')}" for width, height in (self.start, self.end))
        return first, last

    def __str__(self) -> str:
        first, last = self.sides
        return f"Span: {first} at the start, {last} at the end: it {self.change}."


@dataclass(frozen=True)
class BarAnswer(Answer):
    """Most loaded flexible bar, and the largest deflection and buckling risk of all flexible bars."""

    bar: str  # Bar with the largest utilisation; without a material, with the largest bending moment
    moment: float  # Largest bending moment of that bar [N m]
    stress: float  # Largest stress of that bar [Pa]; NaN without a material
    utilisation: float  # Ratio of the stress to the yield strength; NaN if the strength is not known
    when: float  # Instant of the largest value [s]
    place: float  # Distance of that place from the bar's first end [m]
    deflection: float  # Largest distance of a point of any bar from the line through that bar's ends [m]
    deflected: str  # Bar with the largest deflection
    # Smallest factor on the axial forces of all bars at which the mechanism with locked drives buckles; NaN without compression
    buckling: float
    buckled: str  # Bar with the largest compression in the buckling mode; empty without compression
    start: str = ""  # Start option of the run; empty if it is not known

    @property
    def begin(self) -> str:
        """Text on the shape of the bars at the start."""
        if not self.start:
            return ""
        return f", {'in equilibrium' if self.start == 'static' else 'not in equilibrium'} at the start ({self.start})"

    def __str__(self) -> str:
        has_material = math.isfinite(self.stress)
        what = (
            f"largest stress {short(self.stress, 'Pa')}"
            if has_material
            else f"largest bending moment {short(self.moment, 'N m')}"
        )
        where = f"{printable(self.bar)}, {short(self.place, 'm')} from its end, at {short(self.when, 's')}"
        text = f"Bars{self.begin}: {what} in {where}"
        if math.isfinite(self.utilisation):
            text += f", {self.utilisation:.3g} of its yield strength"
        text += f"; largest deflection from the line through a bar's ends {short(self.deflection, 'm')}"
        text += f" ({printable(self.deflected)})"
        if math.isfinite(self.buckling):
            text += f"; buckles, drives locked, at {self.buckling:.3g} times its axial forces ({printable(self.buckled)})"
        return f"{text}."


@dataclass(frozen=True)
class Summary(Answer):
    """Summary of a run for a designer, in SI units; ``scissordyn run`` prints its text."""

    DERIVED = ("met",)

    points: tuple[PointAnswer, ...]  # Tracked points
    actuators: tuple[ActuatorAnswer, ...]  # Drives, actuators and motors
    force: ForceAnswer | None  # Largest force; None if no joint transmits a force
    span: SpanAnswer | None  # None if the positions of points are not known
    bars: BarAnswer | None  # None if no bar bends
    work: dict[str, float]  # Work over the whole run by the parts that do it, and the energy "dissipated" [J]
    horizon: float | None  # Predictability horizon [s]; None if it was not computed
    horizon_contacts: int | None  # Number of contacts before the horizon
    horizon_text: str = ""  # Text of the run that replaces the horizon and its contacts

    @property
    def met(self) -> bool | None:
        """True if every tracked point with a tolerance stays within it; None without such points."""
        judged = [point.met for point in self.points if point.met is not None]
        return all(judged) if judged else None

    @property
    def lines(self) -> list[str]:
        """Sentences of the summary, one for each part."""
        lines = [str(part) for part in (*self.points, *self.actuators, self.force, self.span, self.bars) if part is not None]
        if self.work:
            parts = [f"{whose} {short(value, 'J')}" for whose, value in self.work.items() if whose != "dissipated"]
            lines.append(f"Work: {', '.join(parts) or 'none'}; dissipated: {short(self.work['dissipated'], 'J')}.")
        if self.horizon is not None:
            lines.append(f"Trusted until {short(self.horizon, 's')}, through {counted(self.horizon_contacts or 0)}.")
        elif self.horizon_text:
            lines.append(f"The predictability horizon is {self.horizon_text}.")
        return lines

    def __str__(self) -> str:
        return "\n".join(self.lines)


def summary_of(run: Run, configuration: Configuration | None = None) -> Summary:
    """Return the summary of a run; by default its configuration is read from its attributes."""
    if configuration is None and ATTRIBUTE in run.attrs:
        configuration = read_configuration(run)
    described = None if configuration is None else configuration.mechanism
    options = None if configuration is None else configuration.options
    check_whole(run, options, "summary")
    trusted = float(run.attrs.get("trusted_until", math.nan))
    is_known = math.isfinite(trusted)
    return Summary(
        points=tuple(point_answers(run, described)),
        actuators=tuple(_actuators(run, described)),
        force=_force(run, described, options),
        span=_span(run, described),
        bars=_bars(run, "" if options is None else options.start),
        work=_work(run),
        horizon=trusted if is_known else None,
        horizon_contacts=int(run.attrs["trusted_contacts"]) if is_known else None,
        horizon_text="" if is_known else str(run.attrs.get("predictability", "")),
    )


def _force(run: Run, described: Any, options: Options | None) -> ForceAnswer | None:
    """Return the largest force of all joints, and that of clearance joints if it differs."""
    loose = _largest(joint_summaries(run) if "contact_joint" in run else [])
    whole = _largest([*ideal_summaries(run), *([] if loose is None else [loose])])
    if whole is None:
        return None
    start, after = (None if options is None else force_after_start(run, options.start, whole)) or (None, None)
    answer = _answer(run, whole, described)
    loose_answer = None if loose is None or loose is whole else _answer(run, loose, described)
    partial = whole is not loose and "peak_force_estimate" in run
    return dataclasses.replace(answer, start=start, after=after, loose=loose_answer, partial=partial)


def _largest(joints: Sequence[JointSummary]) -> JointSummary | None:
    loaded = [joint for joint in joints if joint.largest > 0.0]
    return max(loaded, key=lambda joint: joint.largest, default=None)


def _answer(run: Run, joint: JointSummary, described: Any) -> ForceAnswer:
    return ForceAnswer(
        joint.name,
        _kind(run, joint.name, described),
        joint.largest,
        joint.when,
        joint.estimated,
        metal=joint.metal,
        film=joint.film,
        least=joint.least,
    )


def _kind(run: Run, joint: str, described: Any) -> str:
    """Return the kind of a joint, guide or weld as text."""
    if "weld" in run and joint in run["weld"].values.tolist():
        return "weld"
    guides = [] if described is None else described.guides
    if joint in [guide.name for guide in guides]:
        return "guide"
    if joint in [point.name for point in ([] if described is None else described.contact_points)]:
        return "contact point"
    return "clearance joint" if joint in clearance_joints(run) else "ideal joint"


def point_answers(run: Run, described: Any) -> Iterator[PointAnswer]:
    """Yield the deviation of each tracked point over the whole run, for the described mechanism or None."""
    if "peak_track_deviation" not in run or not run.sizes["time"]:
        return
    tolerances = {} if described is None else {track.name: track.tolerance for track in described.tracks}
    parts = along(run["deviation_part"], "track", "axis", "time", "part")
    at_peak = along(run["peak_deviation_part"], "track", "axis", "part")
    least = 0.0 if described is None else ASSEMBLY_TOL * float(described.size)
    for k, name in enumerate(run["track"].values.astype(str).tolist()):
        settled, sizes = float(run["settling_time"].values[k]), np.hypot(*parts[k])
        largest = np.hypot(*at_peak[k])
        relevant = [part for part in range(len(PARTS)) if np.any(sizes[:, part] > least) or largest[part] > least]
        yield PointAnswer(
            name=name,
            deviation=_zero_below(float(run["peak_track_deviation"].values[k]), least),
            when=float(run["peak_track_deviation_time"].values[k]),
            tolerance=tolerances.get(name),
            settled=settled if math.isfinite(settled) else None,
            at_end=_zero_below(float(along(run["track_deviation"], "track", "time")[k, -1]), least),
            parts={PARTS[part]: _zero_below(float(largest[part]), least) for part in relevant},
            parts_at_end={PARTS[part]: _zero_below(float(sizes[-1, part]), least) for part in relevant},
        )


def _zero_below(size: float, least: float) -> float:
    """Return a size, or zero if it is smaller than its error `least`."""
    return 0.0 if size < least else size


def actuator_limits(run: Run) -> dict[str, float]:
    """Return the torque limits of actuators and motors by name [N m]; those without a limit are left out."""
    return _limits(read_configuration(run).mechanism if ATTRIBUTE in run.attrs else None)


def _limits(described: Any) -> dict[str, float]:
    limits = {}
    for part in () if described is None else described.components:
        kind = type(part)
        if kind not in (Actuator, Motor):
            continue
        try:
            limit = getattr(part.controller if kind is Actuator else part, "limit", None)
        except InputError:  # a controller without a limit
            limit = None
        if limit is not None:
            limits[str(part.name)] = float(limit)
    return limits


def at_limit(time: np.ndarray, torque: np.ndarray, limit: float | None) -> list[tuple[float, float]]:
    """Return the intervals in which a torque is at its limit [s], extended by half a sample on both sides."""
    if limit is None or time.size < 2:
        return []
    middle = np.concatenate([time[:1], 0.5 * (time[1:] + time[:-1]), time[-1:]])
    is_at_limit = np.concatenate([[False], np.abs(torque) >= LIMIT_RATIO_MIN * limit, [False]]).astype(int)
    change = np.diff(is_at_limit)
    return list(zip(middle[change == 1].tolist(), middle[change == -1].tolist(), strict=True)) if is_at_limit.any() else []


def _actuators(run: Run, described: Any) -> Iterator[ActuatorAnswer]:
    if "peak_drive_torque" in run:
        for k, name in enumerate(run["drive"].values.astype(str).tolist()):
            torque, when = (float(run[part].values[k]) for part in ("peak_drive_torque", "peak_drive_torque_time"))
            if "singular position" in run.attrs["cause"] and when >= float(run["time"].values[-1:].sum()):
                torque = math.inf  # near this position the torque grows with each step: no finite largest value exists
            yield ActuatorAnswer(name, "drive", torque, when, None, 0.0)
    for dim, kind in (("coordinate_drive", "drive"), ("coupling", "coupling")):
        if f"peak_{dim}_force" not in run:
            continue
        columns = (run[name].values.tolist() for name in (dim, f"{dim}_unit", f"peak_{dim}_force", f"peak_{dim}_force_time"))
        for name, unit, force, when in zip(*columns, strict=True):
            yield ActuatorAnswer(str(name), kind, force, when, None, 0.0, "N m" if unit == "rad" else "N")
    limits = _limits(described)
    for kind, curve, peak in (
        ("actuator", "control_torque", "peak_control_torque"),
        ("motor", "motor_torque", "motor_peak_torque"),
        ("tabulated_motor", "tabulated_motor_torque", "tabulated_motor_peak_torque"),
        ("linear_motor", "linear_motor_force", "linear_motor_peak_force"),
    ):
        if curve not in run or peak not in run:
            continue
        for k, name in enumerate(run[kind].values.astype(str).tolist()):
            values, limit = along(run[curve], "time", kind)[:, k], limits.get(name)
            lasting = sum(end - start for start, end in at_limit(run["time"].values, values, limit))
            when = float(run[f"{peak}_time"].values[k]) if f"{peak}_time" in run else math.nan
            unit = run[curve].attrs["units"]
            yield ActuatorAnswer(name, kind, float(run[peak].values[k]), when, limit, lasting, unit)


def _span(run: Run, described: Any) -> SpanAnswer | None:
    if described is None or "position" not in run or not run.sizes["time"]:
        return None
    places = {str(name): k for k, name in enumerate(run["body"].values)}
    position = along(run["position"], "time", "body", "axis")[[0, -1]]
    angle = along(run["angle"], "time", "body")[[0, -1]]
    points = []
    for body in described.bodies:
        k, local = places[body.name], np.array([body.centre, *dict(body.points).values()], float) - np.array(body.centre, float)
        points.append(placed(position[:, k], angle[:, k] if body.inertia is not None else np.zeros(2), local))
    if not points:
        return None
    sides = np.ptp(np.concatenate(points, axis=1), axis=1)
    start, end = np.where(sides < ROUND_OFF_TOL * sides.max(), 0.0, sides).tolist()
    return SpanAnswer(tuple(start), tuple(end))


def _bars(run: Run, start: str) -> BarAnswer | None:
    """Return the bars with the largest load, deflection and buckling ratio, or None if no bar bends or there is no sample."""
    if "bar_largest_buckling_ratio" not in run or not run.sizes["bar"]:
        return None
    names = run["bar"].values.astype(str).tolist()
    size = {
        name: np.abs(run[f"bar_largest_{name}"].values) for name in ("stress", "utilisation", "bending_moment", "deflection")
    }
    by = next((name for name in ("utilisation", "stress") if size[name].any()), "bending_moment")
    most, bent = int(np.argmax(size[by])), int(np.argmax(size["deflection"]))
    ratio = run["bar_largest_buckling_ratio"].values
    pressed = int(np.argmax(ratio))
    return BarAnswer(
        bar=names[most],
        moment=float(size["bending_moment"][most]),
        stress=float(size["stress"][most]) if size["stress"].any() else math.nan,
        utilisation=float(size["utilisation"][most]) if by == "utilisation" else math.nan,
        when=float(run[f"bar_largest_{by}_time"].values[most]),
        place=float(run[f"bar_largest_{by}_place"].values[most]),
        deflection=float(size["deflection"][bent]),
        deflected=names[bent],
        buckling=1.0 / float(ratio[pressed]) if ratio[pressed] > 0.0 else math.nan,
        buckled=names[pressed] if ratio[pressed] > 0.0 else "",
        start=start,
    )


def _work(run: Run) -> dict[str, float]:
    if "dissipated_energy" not in run or not run.sizes["time"]:
        return {}
    least = ROUND_OFF_TOL * largest_energy_change(run)
    works = {whose: run[name].values for name, whose in WORKS if name in run and np.any(np.abs(run[name].values) > least)}
    energies = {**works, "dissipated": run["dissipated_energy"].values}
    return {whose: 0.0 if abs(values[-1]) < least else float(values[-1]) for whose, values in energies.items()}
