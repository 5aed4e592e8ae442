"""Internal forces of flexible bars with modes: axial and shear force, bending moment, strain and stress along the bar."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from scissordyn.components.beam import Beam
from scissordyn.components.elastic import thermal_loads
from scissordyn.components.flexible_bar import FlexibleBar
from scissordyn.mechanics.sample import Record
from scissordyn.mechanics.time_function import function_at, function_rows
from scissordyn.plan.bending import beam_mass, bends
from scissordyn.plan.flexible import Axis, modes_below
from scissordyn.plan.plan import Plan
from scissordyn.plan.rail import rail_axes, shapes_beyond
from scissordyn.record.deferred import Deferred, DeferredArray
from scissordyn.record.results import Run, Variables, described, labels
from scissordyn.record.variable import Variable
from scissordyn.warning import RunWarning, warning

if TYPE_CHECKING:
    from scissordyn.record.trajectory import Trajectory

_POINTS, _WEIGHTS = np.polynomial.legendre.leggauss(6)  # Nodes and weights of Gauss's rule on [-1, 1]


SPAN_PARTS = 4  # Number of parts of a bar's span between two cross-sections; bending moments are reported at the ends of parts


PART_VARIABLES = (
    ("axial_force", "N", "axial force, tension positive (beam)"),
    ("start_moment", "N m", "bending moment at the start (beam)"),
    ("end_moment", "N m", "bending moment at the end (beam)"),
    ("shear_force", "N", "shear force in the middle, minus the change of the bending moment over the length (beam)"),
    ("start_axial_force", "N", "axial force at the start, tension positive (beam)"),
    ("end_axial_force", "N", "axial force at the end, tension positive (beam)"),
    ("start_shear_force", "N", "shear force at the start (beam)"),
    ("end_shear_force", "N", "shear force at the end (beam)"),
    ("fibre_strain", "1", "largest strain of an extreme fibre, of the axis alone if the depth is unknown (beam)"),
    ("stress", "Pa", "stress in the extreme fibre, 0 if the material is unknown (beam)"),
    ("utilisation", "1", "stress in the extreme fibre over the yield strength, 0 if the strength is unknown (beam)"),
    ("energy", "J", "strain energy by the internal forces (beam)"),
    ("deflection", "m", "deflection of the end, across the line between the ends of the bar (beam)"),
)
"""Name, unit and meaning of the variables that a run reports for each part of a bar."""


class Resultants(NamedTuple):
    """Internal forces at places along a bar: those of the part after each place on the part before it, shape (nt, places).

    Each has two values, just before and just after a load at the place itself.
    """

    axial: tuple[np.ndarray, np.ndarray]  # [N]
    shear: tuple[np.ndarray, np.ndarray]  # [N]
    moment: tuple[np.ndarray, np.ndarray]  # Bending moment [N m]


def part_boundaries(bar: FlexibleBar) -> np.ndarray:
    """Return the distances of the ends of a bar's parts from its first end [m], in increasing order."""
    places = np.array(bar.places) - bar.places[0]
    inside = [np.linspace(a, b, SPAN_PARTS + 1)[:-1] for a, b in itertools.pairwise(places)]
    return np.append(np.concatenate(inside), places[-1])


def part_names(bar: FlexibleBar) -> list[str]:
    return [f"{bar.name} {k + 1}" for k in range(SPAN_PARTS * (len(bar.sections) - 1))]


@dataclass(frozen=True)
class BarMotion:
    """Motion of a flexible bar, and the loads along it, at given instants."""

    vectors: np.ndarray  # (nt, count, 2) Vectors that multiply the bar's shape functions
    rates: np.ndarray  # (nt, count, 2) Rates of these vectors
    accelerations: np.ndarray  # (nt, count, 2) Accelerations of these vectors minus gravity
    factor: np.ndarray  # (nt,) Factor that multiplies the bar's temperatures
    # Components that move along the bar: distance from its first end, shape (nt,) [m], and force there, shape (nt, 2) [N]
    running: tuple[tuple[np.ndarray, np.ndarray], ...] = ()
    # Contacts and films on cross-sections that follow the slope of the bar: index of the cross-section, torque, and generalised
    # force along the slope, shape (nt,) [N m]
    turning: tuple[tuple[int, np.ndarray, np.ndarray], ...] = ()


def bar_motions(plan: Plan, record: Record, time: np.ndarray) -> list[BarMotion]:
    """Return the motion of each flexible bar at the instants of a record."""
    matrix, axes = plan.coordinates.matrix, plan.coordinates.natural.axes
    if not axes:
        return []
    position, velocity, acceleration = (np.asarray((matrix @ part.T).T) for part in (record.X, record.V, record.A))
    acceleration -= plan.coordinates.natural.translation(plan.gravity_vector)
    running: dict[int, list[tuple[np.ndarray, np.ndarray]]] = {}
    for i, axis in rail_axes(axes, plan.acting).items():
        force = -record.wrench[:, len(plan.contacts) + i, :2]
        running.setdefault(id(axis), []).append((record.coordinate[:, i, 1], force))
    turning: dict[int, list[tuple[int, np.ndarray, np.ndarray]]] = {}
    films = len(plan.contacts) + len(plan.mechanism.components)
    joints = enumerate(plan.mechanism.clearance_joints)
    for i, joint in (*joints, *((films + f, joint) for f, (joint, _, _) in enumerate(plan.lubricated))):
        journal, bearing = plan.coordinates.place(joint.journal), plan.coordinates.place(joint.bearing)
        # the force of a film on the bearing acts at the journal's centre, not at the bearing's centre
        pulls = np.zeros(time.size), np.sum(record.wrench[:, i, :2] * (journal.at(record.X) - bearing.at(record.X)), axis=1)
        for side, (body, _) in enumerate((joint.journal, joint.bearing)):
            if body in plan.coordinates.natural.tangents:
                axis, k = plan.coordinates.natural.tangents[body]
                turning.setdefault(id(axis), []).append((k, record.wrench[:, i, 2 + side], pulls[side * (i >= films)]))
    return [
        BarMotion(
            axis.vectors(position),
            axis.vectors(velocity),
            axis.vectors(acceleration),
            _temperature_factor(axis.bar, time),
            tuple(running.get(id(axis), ())),
            tuple(turning.get(id(axis), ())),
        )
        for axis in axes
    ]


def _temperature_factor(bar: FlexibleBar, time: np.ndarray) -> np.ndarray:
    """Return the factor that multiplies a bar's temperatures at given instants, shape (nt,)."""
    factor = np.ones(time.size)
    if bar.time_function is not None:
        rows, value = function_rows(bar.time_function, 0.0), np.zeros(4)
        for k, instant in enumerate(time.tolist()):
            function_at(instant, rows, value)
            factor[k] = value[0]
    return factor


def _strain(axis: Axis, motion: BarMotion, places: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return slope r', elastic strain, damping times strain rate, and unit tangent of the axis at places along a bar."""
    slopes, damped = axis.shapes.at(places, 1), np.zeros((motion.factor.size, len(places)))
    slope = slopes @ motion.vectors
    size = np.sqrt(slope[..., 0] ** 2 + slope[..., 1] ** 2)
    tangent = slope / size[..., None]
    if axis.bar.damping > 0.0:
        damped = axis.bar.damping * np.sum((slopes @ motion.rates) * tangent, axis=-1)
    return slope, size - 1.0 - motion.factor[:, None] * thermal_loads(axis.bar)[0], damped, tangent


def _cross(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    return np.asarray(first[..., 0] * second[..., 1] - first[..., 1] * second[..., 0])


def outside_forces(axis: Axis, motion: BarMotion) -> np.ndarray:
    """Return the generalised forces of external loads, without weight, on a bar's shape vectors, shape (nt, count, 2) [N].

    For points these are the forces at cross-sections. For directions d they are forces whose couple is d x force. Loads that
    move along the bar, and torques on cross-sections that follow the slope of the bar, are left out.
    """
    return np.asarray(
        sum(_negative_internal_forces(axis, motion), axis.bar.mass_per_length * (axis.shapes.mass @ motion.accelerations))
    )


def _negative_internal_forces(axis: Axis, motion: BarMotion) -> Iterator[np.ndarray]:
    """Yield minus the generalised forces of stresses, moving loads and torques on shape vectors, (nt, count, 2) [N]."""
    yield -shape_forces(axis, motion)
    for places, exerted in motion.running:
        yield -shapes_beyond(axis, places)[..., None] * exerted[:, None]
    for weights, exerted in _couple_forces(axis, motion):
        yield -weights[:, None] * exerted[:, None]


def with_distributed_mass(plan: Plan, record: Record, time: np.ndarray) -> Record:
    """Add the loads of the consistent mass matrix of beam elements and flexible bars to a record.

    A body at the end of an element has half of the element's mass at its origin. The rest of the mass matrix times
    (acceleration - gravity) is a load. Other loads are the stresses of a flexible bar, components that move along it, and
    torques on its cross-sections. A generalised force along a unit direction is not a moment and is left out.
    """
    if not bends(plan.mechanism):
        return record
    coordinates = plan.coordinates
    natural = np.asarray((coordinates.matrix @ record.A.T).T) - coordinates.natural.translation(plan.gravity_vector)
    inertia = np.asarray((beam_mass(plan.mechanism, coordinates.natural) @ natural.T).T)
    for axis, motion in zip(coordinates.natural.axes, bar_motions(plan, record, time), strict=True):
        for force in _negative_internal_forces(axis, motion):
            axis.add_forces(force, inertia)
    load = record.load.copy()
    for b, body in enumerate(plan.bodies):
        p = coordinates.natural.offsets[body.name]
        load[:, b, :2] -= inertia[:, p : p + 2]
        x, y = (coordinates.origin(body.name).at(record.X) - record.position[:, b]).T
        load[:, b, 2] -= x * inertia[:, p + 1] - y * inertia[:, p]
        if coordinates.natural.rotates(body.name):
            cos, sin = record.direction[:, b].T
            load[:, b, 2] -= cos * inertia[:, p + 3] - sin * inertia[:, p + 2]
    return record._replace(load=load)


def _couple_forces(axis: Axis, motion: BarMotion) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Yield weights and forces by which torques on cross-sections that follow the bar's slope act on the shape vectors.

    A torque M on a direction d is the generalised force M J d on it; here d is the slope of the bar.

    Shapes: weights (count,), forces (nt, 2).
    """
    for k, torque, pull in motion.turning:
        weights = axis.shapes.at(np.array([axis.shapes.places[k]]), 1)[0]
        slope = weights @ motion.vectors
        along = (pull / np.sum(slope * slope, axis=1))[:, None] * slope
        yield weights, torque[:, None] * np.stack([-slope[:, 1], slope[:, 0]], axis=1) + along


def resultants(axis: Axis, motion: BarMotion, places: np.ndarray) -> Resultants:
    """Return internal forces of a bar at increasing distances from its first end, by equilibrium of the part before each place.

    With the forces R_i and couples C_i on cross-sections, f = mu (r'' - g), and sums over the cross-sections up to s:

        F(s) = int_0^s f ds - sum R_i,  M(s) = int_0^s (r - r(s)) x f ds - sum ((r_i - r(s)) x R_i + C_i).

    Both are exact for any stiffness, because the shape functions contain all motions of a rigid bar.
    """
    shapes, count = axis.shapes, len(axis.bar.sections)
    outside = outside_forces(axis, motion)
    where, slope = (shapes.at(places, k) @ motion.vectors for k in (0, 1))
    tangent = slope / np.linalg.norm(slope, axis=-1, keepdims=True)
    half = 0.5 * np.diff(places)
    inside = (places[:-1, None] + half[:, None] * (1.0 + _POINTS)).ravel()
    weight = axis.bar.mass_per_length * np.outer(half, _WEIGHTS).ravel()
    table = shapes.at(inside)
    load = weight[:, None] * (table @ motion.accelerations)
    turning = _cross(table @ motion.vectors, load)
    force, moment = (
        np.add.accumulate(np.add.reduceat(part, range(0, inside.size, _POINTS.size), axis=1), axis=1)
        for part in (load, turning)
    )
    force, moment = np.pad(force, ((0, 0), (1, 0), (0, 0))), np.pad(moment, ((0, 0), (1, 0)))
    points = np.array(shapes.places)
    arms = motion.vectors[:, :count]
    couples = np.zeros((motion.factor.size, count))
    for row, k in enumerate(shapes.clamped, count):
        couples[:, k] = _cross(motion.vectors[:, row], outside[:, row])
    for (k, _, _), (weights, exerted) in zip(motion.turning, _couple_forces(axis, motion), strict=True):
        couples[:, k] += _cross(weights @ motion.vectors, exerted)
    couples += _cross(arms, outside[:, :count])
    tables = [
        (force - past @ outside[:, :count], moment - couples @ past.T)
        for past in (points < places[:, None], points <= places[:, None])
    ]
    for at, exerted in motion.running:
        arm = np.einsum("tk,tka->ta", shapes_beyond(axis, at), motion.vectors)
        for (sum_of_forces, sum_of_moments), past in zip(tables, (at[:, None] < places, at[:, None] <= places), strict=True):
            sum_of_forces -= past[..., None] * exerted[:, None]
            sum_of_moments -= past * _cross(arm, exerted)[:, None]
    first, second = ((np.sum(f * tangent, axis=-1), _cross(tangent, f), m - _cross(where, f)) for f, m in tables)
    return Resultants(*zip(first, second, strict=True))


def bar_variables(path: Trajectory, record: Record, present: Mapping[str, Variable]) -> Variables:
    """Return the variables of flexible bars, appended to those of beam elements, and the number of modes of each bar.

    Forces, stresses, energies and deflections are computed when they are first read.
    """
    plan, time = path.plan, path.samples.time
    axes = plan.coordinates.natural.axes
    if not axes:
        return {}
    elements = [part for part in plan.components if isinstance(part, Beam)]
    names = [part.name for part in elements] + [name for axis in axes for name in part_names(axis.bar)]
    variables = {"beam": labels("beam", names)}
    further = len(names) - len(elements)
    of_elements = {name: variable for name, variable in present.items() if "beam" in variable.dims and name != "beam"}
    for name, variable in of_elements.items():
        missing = [(0, further if dim == "beam" else 0) for dim in variable.dims]
        values = np.pad(variable.values, missing, constant_values=np.nan)
        variables[name] = Variable(variable.dims, values, variable.attrs)

    def tables() -> list[dict[str, np.ndarray]]:
        return [_table(axis, motion) for axis, motion in zip(axes, bar_motions(plan, record, time), strict=True)]

    bar_tables = Deferred(tables, path.system.lock)

    def over_time(name: str) -> np.ndarray:
        parts = [table[name] for table in bar_tables()]
        if elements:
            none = np.full((time.size, len(elements)), np.nan)
            parts.insert(0, of_elements[f"beam_{name}"].values if f"beam_{name}" in of_elements else none)
        return np.concatenate(parts, axis=1)

    for name, unit, text in PART_VARIABLES:
        array = DeferredArray((time.size, len(names)), partial(over_time, name))
        variables[f"beam_{name}"] = described(("time", "beam"), array, unit, text)
    hard = "; hard contacts have the frequency of their stiffness law" if plan.hard_places else ""
    modes, frequency = (
        np.array(values) for values in zip(*((axis.shapes.modes, axis.highest_frequency) for axis in axes), strict=True)
    )
    what, of_highest = f"bending modes with the cross-sections held{hard}", "frequency of the highest bending mode"
    return variables | {
        "flexible_bar": labels("flexible_bar", [axis.bar.name for axis in axes]),
        "flexible_bar_modes": described("flexible_bar", modes, "1", what),
        "flexible_bar_frequency": described("flexible_bar", frequency, "Hz", f"{of_highest}, with the cross-sections held"),
    }


def extreme_fibre(part: Beam | FlexibleBar, axial: np.ndarray, moment: np.ndarray) -> dict[str, np.ndarray]:
    """Return strain and stress in the extreme fibre, and the ratio of the stress to the yield strength."""
    strain = np.abs(axial) / part.axial_stiffness + 0.5 * part.depth * np.abs(moment) / part.bending_stiffness
    stress = part.youngs_modulus * strain
    utilisation = stress / part.yield_strength if part.yield_strength else 0.0 * stress
    return {"fibre_strain": strain, "stress": stress, "utilisation": utilisation}


def _table(axis: Axis, motion: BarMotion) -> dict[str, np.ndarray]:
    """Return the arrays of the variables in `PART_VARIABLES` for one bar, by name, each of shape (nt, parts)."""
    bar, ends = axis.bar, part_boundaries(axis.bar)
    length, places = np.diff(ends), np.insert(ends, np.arange(1, ends.size), 0.5 * (ends[1:] + ends[:-1]))
    carried = resultants(axis, motion, places)
    axial, shear, moment = ((part[1][:, :-1:2], part[0][:, 1::2], part[0][:, 2::2]) for part in carried)
    start, end = (extreme_fibre(bar, axial[k], moment[k]) for k in (0, 2))
    squares = ((part[0] ** 2 + 4.0 * part[1] ** 2 + part[2] ** 2) / 6.0 for part in (axial, moment))
    where = axis.shapes.at(ends) @ motion.vectors
    chord = where[:, -1:] - where[:, :1]
    across = _cross(chord, where - where[:, :1]) / np.linalg.norm(chord, axis=-1)
    return {
        "axial_force": axial[1],
        "start_moment": moment[0],
        "end_moment": moment[2],
        "shear_force": shear[1],
        "start_axial_force": axial[0],
        "end_axial_force": axial[2],
        "start_shear_force": shear[0],
        "end_shear_force": shear[2],
        **{name: np.maximum(start[name], end[name]) for name in start},
        "energy": 0.5
        * length
        * sum(square / k for square, k in zip(squares, (bar.axial_stiffness, bar.bending_stiffness), strict=True)),
        "deflection": across[:, 1:],
    }


def axial_force_at_points(axis: Axis, motion: BarMotion) -> np.ndarray:
    """Return elastic axial forces times weights at the quadrature points of the equations of motion, (nt, points)."""
    return np.asarray(axis.bar.axial_stiffness * (_strain(axis, motion, axis.shapes.quadrature[0])[1] @ axis.stretching))


def shape_forces(axis: Axis, motion: BarMotion) -> np.ndarray:
    """Return the generalised forces of elastic and damping stresses on a bar's shape vectors, shape (nt, count, 2) [N]."""
    shapes, bar = axis.shapes, axis.bar
    points, weights = shapes.quadrature
    slope, elastic, damped, tangent = _strain(axis, motion, points)
    strain = elastic @ axis.stretching + damped * weights
    first, second = shapes.at(points, 1), shapes.at(points, 2)
    force = -bar.bending_stiffness * (shapes.bending @ motion.vectors)
    force -= bar.axial_stiffness * (first.T @ (strain[..., None] * tangent))
    longer, curved = thermal_loads(bar)
    curvature = motion.factor * curved * (1.0 + motion.factor * longer) ** 2
    if np.any(curvature):
        at_ends = shapes.at(np.array([0.0, shapes.places[-1]]), 1)
        ends = at_ends @ motion.vectors
        turned = np.stack([-ends[..., 1], ends[..., 0]], axis=-1) / np.sum(ends * ends, axis=-1)[..., None]
        turned *= np.array([-1.0, 1.0])[:, None] * (bar.bending_stiffness * curvature)[:, None, None]
        force += at_ends.T @ turned
    if bar.damping > 0.0:
        bend, rate, bend_rate = (
            table @ vectors for table, vectors in ((second, motion.vectors), (first, motion.rates), (second, motion.rates))
        )
        moment = bar.damping * bar.bending_stiffness * (_cross(rate, bend) + _cross(slope, bend_rate))
        by_slope = moment[..., None] * np.stack([bend[..., 1], -bend[..., 0]], axis=-1)
        by_bend = moment[..., None] * np.stack([-slope[..., 1], slope[..., 0]], axis=-1)
        force -= first.T @ (weights[:, None] * by_slope) + second.T @ (weights[:, None] * by_bend)
    return np.asarray(force)


def mode_warnings(plan: Plan, run: Run, least_force: float = 0.1) -> list[RunWarning]:
    """Warn of contacts so short that they would excite higher bending modes than the bars have.

    Contacts below the fraction `least_force` of the run's largest force are left out, because they excite little vibration.
    """
    axes = [axis for axis in plan.coordinates.natural.axes if axis.shapes.modes > 0]
    if not axes or not run["contact_start"].values.size:
        return []
    force, lasting = run["peak_force"].values, run["contact_duration"].values
    counts = np.isfinite(lasting) & (lasting > 0.0) & (force >= least_force * np.max(force, initial=0.0))
    if not counts.any():
        return []
    at = int(np.argmin(np.where(counts, lasting, np.inf)))
    frequency = 1.0 / float(lasting[at])
    needed = [modes_below(axis.bar, frequency) for axis in axes]
    short = [axis for axis, need in zip(axes, needed, strict=True) if need > axis.shapes.modes]
    if not short:
        return []
    numbers = {"time": run["contact_start"].values[at], "lasting": 1e3 * lasting[at], "frequency": frequency}
    numbers |= {"short": len(short), "bars": len(axes), "modes": max(needed)}
    numbers["highest"] = min(axis.highest_frequency for axis in short)
    return [warning("bending modes", str(run["contact_joint"].values[at]), **numbers)]
