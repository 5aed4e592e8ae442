"""Coordinates, forces and power of couplings and coordinate drives at the samples of a run."""

from __future__ import annotations

import math
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from scissordyn.components.angle_stop import AngleStop
from scissordyn.components.place import GROUND
from scissordyn.mechanics.body_maps import BELT
from scissordyn.mechanics.monitored import COUPLING_FORCE
from scissordyn.mechanics.sample import Record
from scissordyn.model.coupling import Belt, Coordinate, Coupling, Distance, RelativeAngle, Screw, Slide, Teeth
from scissordyn.model.mechanism import Mechanism
from scissordyn.plan.coordinates import Constraint
from scissordyn.plan.plan import Plan
from scissordyn.plan.transmission import direction_on, separating_force_of, wheel_centre
from scissordyn.record.results import Run, Variables, along, described, labels
from scissordyn.tolerance import DATA_TOL
from scissordyn.warning import RunWarning, warning

if TYPE_CHECKING:
    from scissordyn.record.trajectory import Trajectory


def sampled_coordinate(plan: Plan, motion: Record, coordinate: Coordinate) -> tuple[np.ndarray, np.ndarray]:
    """Return values and rates of a coordinate at the samples, each of shape (samples,)."""
    coordinates, moving = plan.coordinates, (motion.X, motion.V)
    if isinstance(coordinate, RelativeAngle):
        names, still = [body.name for body in plan.bodies], np.zeros(len(motion.X))
        (angle, rate), (base, base_rate) = (
            (still, still)
            if body == GROUND
            else (motion.angle[:, names.index(body)], motion.angular_velocity[:, names.index(body)])
            for body in coordinate.bodies
        )
        return angle - base, rate - base_rate
    if isinstance(coordinate, Slide):
        # distance from the origin of the base to the point, along a direction that turns with the base
        cos, sin = np.cos(coordinate.direction), np.sin(coordinate.direction)
        rotation = np.array([[cos, sin], [-sin, cos]])
        way, along = (
            [point_map.at(part) for part in moving]
            for point_map in (coordinates.place(coordinate.point), coordinates.frame(coordinate.base))
        )
        if coordinate.base != GROUND:
            origin = coordinates.origin(coordinate.base)
            way = [part - origin.at(base) for part, base in zip(way, moving, strict=True)]
        direction, turning = (part @ rotation for part in along)
        return np.sum(way[0] * direction, axis=1), np.sum(way[1] * direction + way[0] * turning, axis=1)
    (end, end_rate), (start, start_rate) = (
        [coordinates.place(place).at(part) for part in moving] for place in (coordinate.end, coordinate.start)
    )
    span, rate = end - start, end_rate - start_rate
    length = np.hypot(*span.T)
    return length, np.sum(span * rate, axis=1) / length


def coupling_warnings(mechanism: Mechanism) -> list[RunWarning]:
    """Warn of couplings whose force has no point of action, so that bearings and moving wheel centres get no load from it."""
    warnings = list[RunWarning]()
    for part in mechanism.couplings:
        angles = [coordinate for _, coordinate in part.terms if isinstance(coordinate, RelativeAngle)]
        if part.transmission is not None or not angles or _rolls(part):
            continue
        warnings.append(warning("unseen force", part.name, "coupling"))
        for angle in angles:
            stops = [stop for stop in mechanism.components if isinstance(stop, AngleStop) and stop.base == angle.body]
            wheels = [{body, angle.base} for body in (angle.body, *(stop.body for stop in stops))]
            for joint in mechanism.clearance_joints:
                if joint.clearance is not None and set(joint.bodies) in wheels:
                    body = next(name for name in joint.bodies if name != angle.base)
                    gap = 1e3 * joint.clearance.clearance
                    warnings.append(warning("moving centre", joint.name, coupling=part.name, body=body, clearance=gap))
    return warnings


def flank_warnings(plan: Plan, run: Run) -> list[RunWarning]:
    """Warn of each coupling with movable wheel centres whose chosen flank is in tension at some samples."""
    warnings, moving = [], {constraint.name for constraint in plan.coordinates.constraints if constraint.moving}
    for part in plan.mechanism.couplings:
        if part.name not in moving or not isinstance(part.transmission, Teeth) or not part.transmission.sense:
            continue
        place = run["coupling"].values.tolist().index(part.name)
        pushed = part.transmission.sense * along(run["coupling_force"], "coupling", "time")[place]
        if (pulls := pushed < 0.0).any():
            worst, unit = int(np.argmin(pushed)), "N m" if part.output.unit == "rad" else "N"
            numbers = {"fraction": float(np.mean(pulls)), "force": -pushed[worst], "time": run["time"].values[worst]}
            warnings.append(warning("pulling flank", part.name, "coupling", unit=unit, **numbers))
    return warnings


def _rolls(part: Coupling) -> bool:
    """Return True if a wheel rolls on its base, so that its force acts at the point of contact."""
    ends = part.output, part.input
    slides, angles = [end for end in ends if isinstance(end, Slide)], [end for end in ends if isinstance(end, RelativeAngle)]
    return bool(slides and angles) and (slides[0].point[0], slides[0].base) == (angles[0].body, angles[0].base)


def transmitted_variables(plan: Plan, motion: Record, rows: list[tuple[Coupling, Constraint]], force: np.ndarray) -> Variables:
    """Return forces of teeth, belts and screws on their output bodies, the points of action, and the tensions of belts.

    Shapes: `force` (nt, couplings), generalised forces of the couplings on their output coordinates.
    """
    if all(part.transmission is None for part, _ in rows):
        return {}
    vectors, points = np.full((2, *force.shape, 2), np.nan)
    tensions = np.full((2, *force.shape), np.nan)
    for k, (part, constraint) in enumerate(rows):
        if part.transmission is None:
            continue
        vectors[:, k], points[:, k] = _force_and_point(plan, motion, part, constraint, force[:, k])
        if isinstance(part.transmission, Belt):
            effective = np.abs(force[:, k]) / part.transmission.radius
            tension_sum = np.maximum(2.0 * part.transmission.pretension, effective)
            tensions[:, :, k] = 0.5 * (tension_sum + effective), 0.5 * (tension_sum - effective)
    over, where = ("time", "coupling", "axis"), "of teeth, belt or screw on the body of the output"
    variables = {
        "coupling_transmitted_force": described(over, vectors, "N", f"force {where}"),
        "coupling_transmitted_point": described(over, points, "m", "point on the line of this force; of teeth the pitch point"),
    }
    if np.isfinite(tensions).any():
        for name, values in zip(("tight", "slack"), tensions, strict=True):
            text = f"tension of the {name} span of a belt"
            variables[f"coupling_{name}_tension"] = described(over[:2], values, "N", text)
    return variables


def _force_and_point(
    plan: Plan, motion: Record, part: Coupling, constraint: Constraint, force: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the force of a coupling on its output body, and a point on its line of action, each of shape (nt, 2)."""
    coordinates, mechanism, pressure = plan.coordinates, plan.mechanism, separating_force_of(plan.mechanism, part)
    slide = next((end for end in (part.output, part.input) if isinstance(end, Slide)), None)
    if isinstance(part.transmission, Screw):
        return _screw_force_and_point(plan, motion, part, force)
    if slide is not None:
        slides = slide is part.output
        pinion = coordinates.place(wheel_centre(mechanism, part, "input" if slides else "output")).at(motion.X)
        direction = direction_on(mechanism, slide)
        along = coordinates.frame(slide.point[0]).turned(math.cos(direction), math.sin(direction)).at(motion.X)
        left, radius = _left(along), part.ratio if slides else 1.0 / part.ratio
        on_rack = (force if slides else -part.ratio * force)[:, None] * along
        if pressure is not None:
            size = constraint.acting[-1][0] * force if constraint.moving else pressure.per_force * np.abs(force)
            on_rack = on_rack - math.copysign(1.0, radius) * size[:, None] * left
        return (on_rack if slides else -on_rack), pinion - radius * left
    output, input = (coordinates.place(wheel_centre(mechanism, part, end)).at(motion.X) for end in ("output", "input"))
    line = output - input
    distance = np.hypot(*line.T)[:, None]
    vector = (part.ratio - 1.0) * force[:, None] * _left(line) / distance**2
    size = np.zeros_like(force)
    if pressure is not None and pressure.kind == BELT:
        most, sine = np.maximum(pressure.numbers[0], pressure.per_force * np.abs(force)), pressure.numbers[1] / distance[:, 0]
        size = -most * np.sqrt(1.0 - sine * sine)
    elif pressure is not None and constraint.moving:
        size = constraint.acting[-1][0] * force
    elif pressure is not None:
        size = pressure.per_force * np.abs(force) / distance[:, 0]
    vector = vector + size[:, None] * line / distance
    if isinstance(part.transmission, Teeth):
        return vector, output - line / (1.0 - part.ratio)
    square = np.sum(vector * vector, axis=1)
    lever = np.divide(force, square, out=np.zeros_like(force), where=square > 0.0)
    return vector, output - lever[:, None] * _left(vector)


def _screw_force_and_point(plan: Plan, motion: Record, part: Coupling, force: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the force that a screw coupling exerts on its output body, and the position of the nut, each of shape (nt, 2)."""
    turns, (nut, size) = isinstance(part.output, RelativeAngle), (part.output, force)
    if turns:
        nut, size = part.input, -part.ratio * force
    if isinstance(nut, Slide):
        place = plan.coordinates.place(nut.point).at(motion.X)
        along = plan.coordinates.frame(nut.base).turned(math.cos(nut.direction), math.sin(nut.direction)).at(motion.X)
    else:
        assert isinstance(nut, Distance)
        bearing = wheel_centre(plan.mechanism, part, "output" if turns else "input")
        ends = [plan.coordinates.place(point).at(motion.X) for point in (nut.start, nut.end)]
        first = np.hypot(*(ends[0] - plan.coordinates.place(bearing).at(motion.X)).T).max(initial=0.0)
        at_start = bool(first <= DATA_TOL * plan.coordinates.size)
        place, other = (ends[1], ends[0]) if at_start else (ends[0], ends[1])
        along = (place - other) / np.hypot(*(place - other).T)[:, None]
    vector = size[:, None] * along
    return (-vector if turns else vector), place


def _left(vectors: np.ndarray) -> np.ndarray:
    """Return vectors rotated counter-clockwise by a quarter turn, shape (nt, 2)."""
    return np.stack([-vectors[:, 1], vectors[:, 0]], axis=1)


def coupling_variables(plan: Plan, path: Trajectory, motion: Record) -> Variables:
    """Return coordinates, forces and powers of couplings and coordinate drives, and the largest forces."""
    measured = partial(sampled_coordinate, path.plan, motion)
    linear = {
        constraint.name: (k, constraint) for k, constraint in enumerate(plan.coordinates.constraints) if constraint.linear
    }
    peaks = {int(k): peak for k, peak in zip(path.monitored(COUPLING_FORCE), path.peaks(COUPLING_FORCE), strict=True)}
    variables: Variables = {}
    for dim, parts, label in (
        ("coupling", plan.mechanism.couplings, "a coupling"),
        ("coordinate_drive", plan.mechanism.coordinate_drives, "the drive of a coordinate"),
    ):
        rows = [
            (part, *linear[part.name]) for part in parts if part.name in linear
        ]  # the other couplings follow from ideal joints
        if not rows:
            continue
        along, terms = ("time", dim), [part.terms for part, _, _ in rows]
        force = np.stack([-motion.multiplier[:, k] / constraint.scale for _, k, constraint in rows], axis=1)
        values, rates = (np.stack(part, axis=1) for part in zip(*(measured(first[0][1]) for first in terms), strict=True))
        variables[dim] = labels(dim, [part.name for part, _, _ in rows])
        output = "output" if dim == "coupling" else "value"
        if dim == "coordinate_drive":
            # a prescribed angle may begin full turns away from the angle of the body
            for column, (_, _, constraint) in enumerate(rows):
                if constraint.turning:
                    values[:, column] += math.tau * np.round(
                        (constraint.value * constraint.scale - values[:1, column]) / math.tau
                    )
        else:
            values_in = np.stack([measured(first[1][1])[0] for first in terms], axis=1)
            force_in = force * np.array([first[1][0] for first in terms])
            units = [first[1][1].unit for first in terms]
            variables[f"{dim}_input"] = described(along, values_in, _join_units(units), "input coordinate of a coupling")
            words = "torque or force of a coupling on its input coordinate"
            variables[f"{dim}_input_force"] = described(along, force_in, _force_units(units), words)
            variables[f"{dim}_input_unit"] = labels(dim, units, "unit of the coordinate")
            variables |= transmitted_variables(
                plan, motion, [(part, constraint) for part, _, constraint in rows if isinstance(part, Coupling)], force
            )
        units = [first[0][1].unit for first in terms]
        variables[f"{dim}_{output}"] = described(along, values, _join_units(units), f"coordinate that {label} acts on")
        variables[f"{dim}_force"] = described(
            along, force, _force_units(units), f"torque or force of {label} on its coordinate"
        )
        variables[f"{dim}_power"] = described(along, force * rates, "W", f"power that {label} gives to that coordinate")
        variables[f"{dim}_unit"] = labels(dim, units, "unit of the coordinate")
        largest = np.array([peaks[k]["largest"] / constraint.scale for _, k, constraint in rows])
        when = np.array([peaks[k]["largest_time"] for _, k, _ in rows])
        variables[f"peak_{dim}_force"] = described(dim, largest, _force_units(units), f"largest torque or force of {label}")
        variables[f"peak_{dim}_force_time"] = described(dim, when, "s", "when it is largest")
    return variables


def _join_units(units: list[str]) -> str:
    """Return the different units of a list, joined by "or"."""
    return " or ".join(dict.fromkeys(units))


def _force_units(units: list[str]) -> str:
    """Return the unit of the generalised force on coordinates with the given units."""
    return _join_units(["N m" if unit == "rad" else "N" for unit in units])
