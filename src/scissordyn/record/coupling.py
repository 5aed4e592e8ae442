"""What couplings and coordinate drives transmit at the samples of a run: coordinates, and forces on them."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from scissordyn.components.angle_stop import AngleStop
from scissordyn.components.place import GROUND
from scissordyn.mechanics.monitored import COUPLING_FORCE
from scissordyn.mechanics.outputs import Record
from scissordyn.mechanics.rotation import TURN
from scissordyn.model.coupling import Coordinate, RelativeAngle, Slide
from scissordyn.model.mechanism import Mechanism
from scissordyn.plan.plan import Plan
from scissordyn.record.results import Variables, described, labels
from scissordyn.warning import RunWarning, warning

if TYPE_CHECKING:
    from scissordyn.record.trajectory import Trajectory


def sampled_coordinate(plan: Plan, motion: Record, coordinate: Coordinate) -> tuple[np.ndarray, np.ndarray]:
    """Values and rates of a coordinate, shape (samples,)."""
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
        # from the origin of the base to the point, along a direction that turns with the base
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


def centre_warnings(mechanism: Mechanism) -> list[RunWarning]:
    """A warning for each clearance joint in which a coupled wheel turns: the relation is that of angles alone."""
    warnings = list[RunWarning]()
    for part in mechanism.couplings:
        angles = [coordinate for _, coordinate in part.terms if isinstance(coordinate, RelativeAngle)]
        for angle in angles:
            stops = [stop for stop in mechanism.components if isinstance(stop, AngleStop) and stop.base == angle.body]
            wheels = [{body, angle.base} for body in (angle.body, *(stop.body for stop in stops))]
            for joint in mechanism.clearance_joints:
                if joint.clearance is not None and set(joint.bodies) in wheels:
                    body = next(name for name in joint.bodies if name != angle.base)
                    gap = 1e3 * joint.clearance.clearance
                    warnings.append(warning("moving centre", joint.name, coupling=part.name, body=body, clearance=gap))
    return warnings


def coupling_variables(plan: Plan, path: Trajectory, motion: Record) -> Variables:
    """Coordinates, forces and powers of couplings and coordinate drives, and the largest forces."""
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
        rows = [(part, *linear[part.name]) for part in parts if part.name in linear]  # others follow from ideal joints
        if not rows:
            continue
        along, terms = ("time", dim), [part.terms for part, _, _ in rows]
        force = np.stack([-motion.multiplier[:, k] / constraint.scale for _, k, constraint in rows], axis=1)
        values, rates = (np.stack(part, axis=1) for part in zip(*(measured(first[0][1]) for first in terms), strict=True))
        variables[dim] = labels(dim, [part.name for part, _, _ in rows])
        output = "output" if dim == "coupling" else "value"
        if dim == "coordinate_drive":
            # a motion may begin some turns away from the place of the body
            for column, (_, _, constraint) in enumerate(rows):
                if constraint.turning:
                    values[:, column] += TURN * np.round((constraint.value * constraint.scale - values[:1, column]) / TURN)
        else:
            values_in = np.stack([measured(first[1][1])[0] for first in terms], axis=1)
            force_in = force * np.array([first[1][0] for first in terms])
            units = [first[1][1].unit for first in terms]
            variables[f"{dim}_input"] = described(along, values_in, _joined(units), "input coordinate of a coupling")
            words = "torque or force of a coupling on its input coordinate"
            variables[f"{dim}_input_force"] = described(along, force_in, _of_forces(units), words)
            variables[f"{dim}_input_unit"] = labels(dim, units, "unit of the coordinate")
        units = [first[0][1].unit for first in terms]
        variables[f"{dim}_{output}"] = described(along, values, _joined(units), f"coordinate that {label} acts on")
        variables[f"{dim}_force"] = described(along, force, _of_forces(units), f"torque or force of {label} on it")
        variables[f"{dim}_power"] = described(along, force * rates, "W", f"power that {label} gives to that coordinate")
        variables[f"{dim}_unit"] = labels(dim, units, "unit of the coordinate")
        largest = np.array([peaks[k]["largest"] / constraint.scale for _, k, constraint in rows])
        when = np.array([peaks[k]["largest_time"] for _, k, _ in rows])
        variables[f"peak_{dim}_force"] = described(dim, largest, _of_forces(units), f"largest torque or force of {label}")
        variables[f"peak_{dim}_force_time"] = described(dim, when, "s", "when it is largest")
    return variables


def _joined(units: list[str]) -> str:
    """The unit of some values, or the units of values of several."""
    return " or ".join(dict.fromkeys(units))


def _of_forces(units: list[str]) -> str:
    """The unit of what acts on coordinates of some units."""
    return _joined(["N m" if unit == "rad" else "N" for unit in units])
