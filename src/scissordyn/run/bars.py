"""What bars that bend as one part carry, at places along them: axial force, bending moment, stress, energy, deflection."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import xarray as xr

from scissordyn.component.beam import Beam
from scissordyn.component.elastic import thermal_loads
from scissordyn.component.flexible_bar import FlexibleBar
from scissordyn.mechanics.outputs import Record
from scissordyn.mechanics.time_function import function_at, function_rows
from scissordyn.plan.flexible import Axis, modes_below
from scissordyn.plan.plan import Plan

__all__ = ["PARTS", "bar_motions", "bar_variables", "marks_of", "mode_warnings", "part_names", "shape_forces"]

SHARE = 0.1
"""Part of the largest force of a run that a contact has to reach for its duration to count: slighter touches excite little."""

PARTS = 4
"""Parts of each span between two cross-sections at whose ends moments are reported."""


VARIABLES = (
    ("axial_force", "N", "axial force, tension positive (beam)"),
    ("start_moment", "N m", "bending moment at the start (beam)"),
    ("end_moment", "N m", "bending moment at the end (beam)"),
    ("shear_force", "N", "mean shear force, by the change of the bending moment (beam)"),
    ("fibre_strain", "1", "largest strain of an extreme fibre, of the axis alone if the depth is unknown (beam)"),
    ("stress", "Pa", "stress in the extreme fibre, 0 if the material is unknown (beam)"),
    ("utilisation", "1", "that stress over the yield strength, 0 if it is unknown (beam)"),
    ("energy", "J", "stored energy (beam)"),
    ("deflection", "m", "of the end, across the line between the ends of the bar (beam)"),
)
"""Name, unit and meaning of what parts of bars carry."""


@dataclass(frozen=True)
class Carried:
    """What the parts of a bar carry, each of shape (nt, parts).

    Parameters
    ----------
    axial_force : ndarray
        In the middle of each [N].
    start_moment, end_moment : ndarray
        [N m]
    energy : ndarray
        [J]
    deflection : ndarray
        Of the end of each, across the line between the ends of the bar [m].
    length : ndarray, shape (parts,)
        [m]
    """

    axial_force: np.ndarray
    start_moment: np.ndarray
    end_moment: np.ndarray
    energy: np.ndarray
    deflection: np.ndarray
    length: np.ndarray


def marks_of(bar: FlexibleBar) -> np.ndarray:
    """Distances of the ends of the parts of a bar from its first end [m]."""
    places = np.array(bar.places) - bar.places[0]
    inside = [np.linspace(a, b, PARTS + 1)[:-1] for a, b in itertools.pairwise(places)]
    return np.append(np.concatenate(inside), places[-1])


def part_names(axis: Axis) -> list[str]:
    """Names of the parts of a bar."""
    return [f"{axis.bar.name} {k + 1}" for k in range(PARTS * (len(axis.bar.sections) - 1))]


@dataclass(frozen=True)
class BarMotion:
    """Of a bar at some instants: vectors of its shapes and their rates, factor of its temperatures."""

    vectors: np.ndarray
    rates: np.ndarray
    factor: np.ndarray


def bar_motions(plan: Plan, found: Record, time: np.ndarray) -> list[BarMotion]:
    """Motion of each flexible bar at the instants of a record."""
    matrix, axes = plan.coordinates.matrix, plan.coordinates.natural.axes
    position, velocity = (np.asarray((matrix @ part.T).T) if axes else part for part in (found.X, found.V))
    return [BarMotion(axis.vectors(position), axis.vectors(velocity), _warmth(axis.bar, time)) for axis in axes]


def _warmth(bar: FlexibleBar, time: np.ndarray) -> np.ndarray:
    """Factor of the temperatures of a bar at some instants."""
    factor = np.ones(time.size)
    if bar.time_function is not None:
        rows, value = function_rows(bar.time_function, 0.0), np.zeros(4)
        for k, instant in enumerate(time.tolist()):
            function_at(instant, rows, value)
            factor[k] = value[0]
    return factor


def _strain(axis: Axis, motion: BarMotion, places: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """R' at some places, the strain that has an elastic stress, that of damping, and the unit tangent."""
    slopes, damped = axis.shapes.at(places, 1), np.zeros((motion.factor.size, len(places)))
    slope = slopes @ motion.vectors
    size = np.sqrt(slope[..., 0] ** 2 + slope[..., 1] ** 2)
    tangent = slope / size[..., None]
    if axis.bar.damping > 0.0:
        damped = axis.bar.damping * np.sum((slopes @ motion.rates) * tangent, axis=-1)
    return slope, size - 1.0 - motion.factor[:, None] * thermal_loads(axis.bar)[0], damped, tangent


def _curvature(axis: Axis, motion: BarMotion, places: np.ndarray) -> np.ndarray:
    """The curvature that has a stress, with that of damping."""
    first, second = axis.shapes.at(places, 1), axis.shapes.at(places, 2)
    a, b = first @ motion.vectors, second @ motion.vectors
    found = _cross(a, b) / (a[..., 0] ** 2 + a[..., 1] ** 2) - motion.factor[:, None] * thermal_loads(axis.bar)[1]
    if axis.bar.damping > 0.0:
        found += axis.bar.damping * (_cross(first @ motion.rates, b) + _cross(a, second @ motion.rates))
    return np.asarray(found)


def _cross(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    return np.asarray(one[..., 0] * other[..., 1] - one[..., 1] * other[..., 0])


def carried(axis: Axis, motion: BarMotion) -> Carried:
    """What a bar carries at some instants.

    Parameters
    ----------
    axis : Axis
    motion : BarMotion

    Returns
    -------
    Carried
    """
    shapes, bar = axis.shapes, axis.bar
    ends = marks_of(bar)
    length = np.diff(ends)
    points, weights = shapes.quadrature
    _, elastic, damped, _ = _strain(axis, motion, points)
    force = bar.axial_stiffness * (elastic + damped)
    axial = np.zeros((motion.factor.size, length.size))
    for k, (a, b) in enumerate(zip(shapes.places, shapes.places[1:], strict=False)):
        # where bending shortens the axis the strain is that of its points of quadrature: a line through them in each span
        inside, parts = (points > a) & (points < b), slice(PARTS * k, PARTS * (k + 1))
        own, w, mid = points[inside] - 0.5 * (a + b), weights[inside], ends[:-1][parts] + 0.5 * length[parts] - 0.5 * (a + b)
        mean, slope = force[:, inside] @ w / (b - a), force[:, inside] @ (w * own) * 12.0 / (b - a) ** 3
        axial[:, parts] = mean[:, None] + slope[:, None] * mid
    moment = bar.bending_stiffness * _curvature(axis, motion, ends)
    within = bar.bending_stiffness * _curvature(axis, motion, ends[:-1] + 0.5 * length)
    squares = (moment[:, :-1] ** 2 + 4.0 * within**2 + moment[:, 1:] ** 2) / 6.0
    energy = 0.5 * length * (axial**2 / bar.axial_stiffness + squares / bar.bending_stiffness)
    where = shapes.at(ends) @ motion.vectors
    chord = where[:, -1:] - where[:, :1]
    across = _cross(chord, where - where[:, :1]) / np.linalg.norm(chord, axis=-1)
    return Carried(axial, moment[:, :-1], moment[:, 1:], energy, across[:, 1:], length)


def bar_variables(plan: Plan, time: np.ndarray, found: Record, known: Mapping[str, xr.Variable]) -> dict[str, xr.Variable]:
    """What the parts of flexible bars carry, after the beam elements along their dimension, and how many modes bars have.

    Parameters
    ----------
    plan : Plan
    time : ndarray, shape (nt,)
    found : Record
    known : mapping of str to Variable
        With those of beam elements, if there are any; what these alone have becomes NaN for the parts.

    Returns
    -------
    dict
        Empty without flexible bars.
    """
    axes = plan.coordinates.natural.axes
    if not axes:
        return {}
    elements = [part for part in plan.components if isinstance(part, Beam)]
    motions = bar_motions(plan, found, time)
    carried_by = [_table(axis.bar, carried(axis, motion)) for axis, motion in zip(axes, motions, strict=True)]
    names = [part.name for part in elements] + [name for axis in axes for name in part_names(axis)]
    variables = {"beam": xr.Variable(("beam",), np.array(names, dtype=str), {"long_name": "beam"})}
    further = len(names) - len(elements)
    for name, variable in known.items():
        if "beam" in variable.dims and name != "beam":
            missing = {"beam": (0, further)}
            variables[name] = variable.pad(missing, constant_values=np.nan)
    for name, unit, text in VARIABLES:
        parts = [table[name] for table in carried_by]
        if elements:
            none = np.full((time.size, len(elements)), np.nan)
            parts.insert(0, known[f"beam_{name}"].values if f"beam_{name}" in known else none)
        variables[f"beam_{name}"] = xr.Variable(
            ("time", "beam"), np.concatenate(parts, axis=1), {"units": unit, "long_name": text}
        )
    hard = "; hard contacts have the frequency of their stiffness law" if plan.hard_places else ""
    bars = {
        "flexible_bar": (np.array([axis.bar.name for axis in axes], dtype=str), {"long_name": "flexible bar"}),
        "flexible_bar_modes": (
            np.array([axis.shapes.modes for axis in axes]),
            {"units": "1", "long_name": f"bending modes with the cross-sections held{hard}"},
        ),
        "flexible_bar_frequency": (
            np.array([axis.highest_frequency for axis in axes]),
            {"units": "Hz", "long_name": "frequency of the highest of them, with the cross-sections held"},
        ),
    }
    return variables | {name: xr.Variable(("flexible_bar",), values, attributes) for name, (values, attributes) in bars.items()}


def _table(bar: FlexibleBar, has: Carried) -> dict[str, np.ndarray]:
    largest = np.maximum(np.abs(has.start_moment), np.abs(has.end_moment))
    strain = np.abs(has.axial_force) / bar.axial_stiffness + 0.5 * bar.depth * largest / bar.bending_stiffness
    return {
        "axial_force": has.axial_force,
        "start_moment": has.start_moment,
        "end_moment": has.end_moment,
        "shear_force": (has.start_moment - has.end_moment) / has.length,
        "fibre_strain": strain,
        "stress": bar.youngs_modulus * strain,
        "utilisation": bar.youngs_modulus * strain / bar.yield_strength if bar.yield_strength else 0.0 * strain,
        "energy": has.energy,
        "deflection": has.deflection,
    }


def shape_forces(axis: Axis, motion: BarMotion) -> np.ndarray:
    """What the elastic and damping stresses of a bar exert on the vectors of its shapes, shape (nt, count, 2) [N]."""
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


def mode_warnings(plan: Plan, run: xr.Dataset) -> list[str]:
    """Whether a contact was so short that it excites bending modes which bars were left without.

    Parameters
    ----------
    plan : Plan
    run : Dataset

    Returns
    -------
    list of str
        At most one: the shortest contact, and how many modes it needs.
    """
    axes = [axis for axis in plan.coordinates.natural.axes if axis.shapes.modes > 0]
    if not axes or not run["contact_start"].size:
        return []
    force, lasting = run["peak_force"].values, run["contact_duration"].values
    counts = np.isfinite(lasting) & (lasting > 0.0) & (force >= SHARE * np.max(force, initial=0.0))
    if not counts.any():
        return []
    at = int(np.argmin(np.where(counts, lasting, np.inf)))
    frequency = 1.0 / float(lasting[at])
    needed = [modes_below(axis.bar, frequency) for axis in axes]
    short = [axis for axis, need in zip(axes, needed, strict=True) if need > axis.shapes.modes]
    if not short:
        return []
    kept = min(axis.highest_frequency for axis in short)
    joint, start = run["contact_joint"].values[at], float(run["contact_start"].values[at])
    return [
        f"joint '{joint}': the contact at t = {start:.6g} s lasts {1e3 * lasting[at]:.3g} ms and excites bending up to "
        f"{frequency:.3g} Hz; {len(short)} of {len(axes)} bars keep modes up to {kept:.3g} Hz: modes = {max(needed)} keeps "
        "those of the contact"
    ]
