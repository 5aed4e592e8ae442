"""Buckling: load factors of a mechanism at rest, and buckling ratios of bars during a run."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

import numpy as np
from numpy.polynomial import legendre

from scissordyn.components.actuator import Actuator
from scissordyn.components.beam import Beam
from scissordyn.components.flexible_bar import FlexibleBar
from scissordyn.components.force import Force
from scissordyn.components.port import FRAME, LINE
from scissordyn.components.torque import Torque
from scissordyn.equilibrium.rest import activate_closed_gaps
from scissordyn.equilibrium.small_motion import equilibrium_pair
from scissordyn.equilibrium.static_position import (
    StaticPosition,
    component_maps,
    constraint_slopes,
    count_turns,
    element_block,
    force_slopes,
    free_directions,
    has_potential,
    stiffness,
)
from scissordyn.errors import InputError
from scissordyn.integrate.integration import Samples
from scissordyn.kernel import Handle
from scissordyn.kinematics.assembly import basis_at_start, whole_state
from scissordyn.mechanics.sample import Record
from scissordyn.model.mechanism import Mechanism
from scissordyn.plan.elimination import in_words
from scissordyn.plan.flexible import Axis, with_mode_counts
from scissordyn.plan.plan import Plan, plan
from scissordyn.plan.rail import rail_axes, shapes_beyond
from scissordyn.plan.rest import plan_at_rest, without_ramps
from scissordyn.plan.system import make_system
from scissordyn.record.bars import BarMotion, axial_force_at_points, bar_motions, part_names, shape_forces
from scissordyn.record.internal_forces import Bar, bars_of
from scissordyn.record.variable import Variable
from scissordyn.tolerance import CONVERGENCE_TOL
from scissordyn.units import Quantity, checked

if TYPE_CHECKING:
    import xarray as xr


@checked
def buckling(
    mechanism: Mechanism, *, count: Annotated[int, Quantity("1", minimum=1, help="number of factors")] = 3
) -> xr.Dataset:
    """Return the factors of gravity, forces and torques at which a mechanism with locked drives buckles.

    Linear buckling solves (K + factor G) a = 0. K is the stiffness without loads, with straight bars. G is the geometric
    stiffness of the internal forces that the loads cause there: axial forces of bars, forces of springs, bushings and rollers,
    reactions. Clearance joints are taken as ideal. Deflections before buckling are neglected: where they are large, the
    mechanism fails at a smaller load. The position without loads must be stable, by flexible bars, springs or drives.

    Parameters
    ----------
    mechanism : Mechanism
        A mechanism with flexible bars.
    count : int
        Number of factors, from the smallest; fewer or none if the loads compress nothing.

    Returns
    -------
    Dataset
        `load_factor (mode)`; the position under the given loads is stable if the first factor is above one.

    Raises
    ------
    InputError
        If the mechanism has no loads, is not stable without them, or has forces without potential that turn with a body.

    References
    ----------
    Crisfield 1991, Non-linear finite element analysis of solids and structures
    """
    import scipy.linalg as sl  # imported here: they take longer to import than most runs take
    import xarray as xr

    ideal = without_ramps(with_mode_counts(mechanism).ideal())
    if ideal.gravity == 0.0 and not any(isinstance(part, Force | Torque) for part in ideal.components):
        raise InputError("buckling of a mechanism without loads", "gravity, forces or torques")
    at, _ = equilibrium_pair(plan_at_rest(plan(_with_loads(ideal, 0.0))), "concentric", None)
    slopes, allowed = stiffness(at)
    slopes = 0.5 * (slopes + slopes.T)
    rest = allowed.T @ slopes @ allowed
    if allowed.shape[1] == 0 or np.linalg.eigvalsh(rest)[0] <= 0.0:
        raise InputError("buckling of a mechanism that is not stable without loads", "a drive, springs or flexible bars")
    loads = equilibrium_pair(plan_at_rest(plan(_with_loads(ideal, 1.0))), "concentric", None)[0]
    turning = [f"'{part.name}'" for part in ideal.components if isinstance(part, Force) and part.follows]
    by_load = allowed.T @ (force_slopes(loads._replace(state=at.state)) - force_slopes(at)) @ allowed
    if turning and not has_potential(by_load):
        raise InputError(
            f"buckling under {in_words(turning)}: forces that turn with a body have no potential and can cause flutter instead",
            "forces of fixed direction",
            "modes(mechanism), which finds flutter, at several loads",
        )
    change = allowed.T @ geometric_stiffness(at, loads, slopes, allowed) @ allowed
    # change a = mu rest a with mu = -1/factor: the factors are positive where mu is negative
    inverse = sl.eigh(change, rest, eigvals_only=True)
    # values below 1e-9 of the largest are round-off
    factors = np.sort(-1.0 / inverse[inverse < -1e-9 * np.max(np.abs(inverse))])[:count]
    described = {"units": "1", "long_name": "factor of the loads at which the mechanism buckles"}
    return xr.Dataset({"load_factor": ("mode", factors, described)}, {"mode": np.arange(1, factors.size + 1)})


def _with_loads(mechanism: Mechanism, factor: float) -> Mechanism:
    """Return the mechanism with its loads multiplied by a factor."""

    def scaled(part: Any) -> Any:
        if isinstance(part, Force):
            return dataclasses.replace(part, force=(factor * part.force[0], factor * part.force[1]))
        return dataclasses.replace(part, torque=factor * part.torque) if isinstance(part, Torque) else part

    return dataclasses.replace(
        mechanism, gravity=factor * mechanism.gravity, components=tuple(scaled(part) for part in mechanism.components)
    )


class AxialForces(NamedTuple):
    """Axial forces at several places along a bar, over time."""

    bar: Bar
    axial: np.ndarray  # (samples, places) [N], tension positive
    places: np.ndarray  # Distances of the places from the first end of the bar [m]

    @property
    def severity(self) -> np.ndarray:
        """Ratio of the largest compression along the bar to EI/L^2, at each sample."""
        slenderness = self.bar.length**2 / min(part.bending_stiffness for part in self.bar.parts)
        return np.asarray(np.maximum(-self.axial, 0.0).max(axis=1) * slenderness)


def buckling_ratios(plan: Plan, samples: Samples, record: Record, variables: Mapping[str, Variable]) -> np.ndarray:
    """Return each bar's largest compression as a fraction of the compression at which the mechanism would buckle.

    The samples are divided into five parts. In each part, the position with the most severe compression is taken, with drives,
    servos and free motions locked and with ideal joints. There (K - factor G) a = 0 is solved. K is the stiffness of the
    material, G the geometric stiffness of the largest compression (or least tension) at each place during the part. The ratio
    is the largest 1/factor of the modes in which a bar takes part; it is 0 without compression.
    """
    bars = bars_of(plan.mechanism)
    ratio = np.zeros(len(bars))
    if not bars or not samples.time.size:
        return ratio
    forces = [_axial_forces(bar, variables) for bar in bars]
    heed = np.max([force.severity for force in forces], axis=0)
    if not heed.max() > 0.0:
        return ratio
    frozen = _IdealPositions(plan)
    for part in np.array_split(np.arange(samples.time.size), 5):
        if part.size and heed[part].max() > 0.0:
            k = int(part[np.argmax(heed[part])])
            ratio = np.maximum(ratio, frozen.ratios(k, samples, record, [(f, f.axial[part].min(axis=0)) for f in forces]))
    return ratio


def _axial_forces(bar: Bar, variables: Mapping[str, Variable]) -> AxialForces:
    names = variables["beam"].values.astype(str).tolist()
    columns = [names.index(name) for name in (part_names(bar.whole) if bar.whole else [beam.name for beam in bar.beams])]
    ends = bar.boundaries
    if not bar.whole:
        return AxialForces(bar, variables["beam_axial_force"].values[:, columns], ends[:-1])
    parts = [variables[f"beam_{at}axial_force"].values[:, columns] for at in ("start_", "", "end_")]
    places = np.stack([ends[:-1], 0.5 * (ends[1:] + ends[:-1]), ends[1:]], axis=1)
    return AxialForces(bar, np.stack(parts, axis=2).reshape(len(parts[0]), -1), places.ravel())


class _IdealPositions:
    """Mechanism with ideal joints at positions of a run, for the buckling of its bars."""

    def __init__(self, plan: Plan) -> None:
        self.plan, self.ideal = plan, plan.ideal
        self.system: Handle = make_system(self.ideal)
        self.axes = {axis.bar.name: axis for axis in self.ideal.coordinates.natural.axes}
        self.shapes = shapes_by_coordinate(self.ideal)
        self.number = {part.name: i for i, part in enumerate(self.ideal.acting)}

    def ratios(self, k: int, samples: Samples, record: Record, forces: list[tuple[AxialForces, np.ndarray]]) -> np.ndarray:
        """Return the buckling ratio of each bar at sample k for given axial forces along the bars."""
        at = self._ideal_position(k, samples, record)
        stiffness = force_slopes(at, float(samples.time[k]))
        geometric, strains = [], self._other_stiffness()
        present = Record(*(part[k : k + 1] for part in record))
        names = [axis.bar.name for axis in self.plan.coordinates.natural.axes]
        motions = dict(zip(names, bar_motions(self.plan, present, samples.time[k : k + 1]), strict=True))
        for force, axial in forces:
            whole = force.bar.whole
            parts = self._bar_stiffness(motions[whole.name], force, axial) if whole else self._chain_stiffness(force, axial)
            now, added, strain = parts
            stiffness -= now
            geometric.append(added)
            strains.append(strain)
        content = at.system.content
        gradients, _ = constraint_slopes(at, np.zeros(content.work.multiplier.size))
        allowed = free_directions(np.vstack([gradients, *self._servo_gradients()]))
        # a bent bar that turns freely keeps a small stiffness, quadratic in its deflection, and would seem to buckle
        unstrained = free_directions(np.vstack(strains) @ allowed)
        allowed = allowed @ free_directions(unstrained.T)
        values, vectors = np.linalg.eigh(0.5 * allowed.T @ (stiffness + stiffness.T) @ allowed)
        stiff = values > 1e-15 * values.size * np.max(np.abs(values), initial=0.0)  # above round-off
        scaled = allowed @ vectors[:, stiff] / np.sqrt(values[stiff])
        works, modes = np.linalg.eigh(-scaled.T @ sum(geometric) @ scaled)
        shares = np.array([-np.sum((scaled @ modes) * (part @ scaled @ modes), axis=0) for part in geometric])
        # a bar takes part in a mode if it does a tenth of the work of all compressions
        least = np.minimum(0.1 * np.sum(np.maximum(shares, 0.0), axis=0), shares.max(axis=0))
        return np.asarray(np.max(np.where((shares >= least) & (works > 0.0), works, 0.0), axis=1, initial=0.0))

    def _ideal_position(self, k: int, samples: Samples, record: Record) -> StaticPosition:
        """Return the ideal mechanism at the position of sample k of the run."""
        content, time = self.system.content, float(samples.time[k])
        turned = {body.name: float(record.angle[k, b] - body.placed_angle) for b, body in enumerate(self.plan.bodies)}
        count_turns(self.ideal, content, turned | {"ground": 0.0})
        natural = np.asarray(self.plan.coordinates.matrix @ record.X[k])
        position = self.ideal.coordinates.nearest(basis_at_start(content, time)[0], natural)
        state = whole_state(content, position)
        activate_closed_gaps(self.system, state)
        return StaticPosition(self.ideal, self.system, state)

    def _bar_stiffness(
        self, motion: BarMotion, force: AxialForces, axial: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the geometric stiffness of a bar for its actual and for given axial forces, and its strain gradients."""
        bar: Any = force.bar.whole
        axis, by = self.axes[bar.name], self.shapes[bar.name]
        vectors, (points, weights) = motion.vectors[0], axis.shapes.quadrature
        now = stiffness_of_bar(axis, vectors, by, points, axial_force_at_points(axis, motion)[0])
        added = stiffness_of_bar(axis, vectors, by, points, np.interp(points, force.places, axial) * weights)
        slopes = axis.shapes.at(points, 1)
        tangent = slopes @ vectors
        normal = np.stack([-tangent[:, 1], tangent[:, 0]], axis=1) / np.linalg.norm(tangent)
        moved = np.einsum("pk,nka->npa", slopes, by)
        strain = moved - np.einsum("npa,pa->n", moved, normal)[:, None, None] * normal
        return now, added, strain.reshape(len(strain), -1).T / np.linalg.norm(tangent)

    def _chain_stiffness(self, force: AxialForces, axial: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the matrices of `_bar_stiffness` for a bar that is a chain of beam elements."""
        content = self.system.content
        now, added = np.zeros((2, content.model.n, content.model.n))
        strains = []
        for beam, other in zip(force.bar.beams, axial.tolist(), strict=True):
            maps, rows = component_maps(content, self.number[beam.name])
            now += float(content.work.result[self.number[beam.name], 6]) * stiffness_of_element(maps, rows)
            strains.append(frame_gradients(maps) @ rows)
            chord = float(np.hypot(*maps[:2]))
            normal, start, end = (np.array([-maps[j + 1], maps[j]]) for j in (0, 4, 2))
            turned = normal @ rows[:2] / chord**2
            added += other * element_form(chord, turned, start @ rows[4:] - turned, end @ rows[2:4] - turned)
        return now, added, np.vstack(strains) / force.bar.length

    def _other_stiffness(self) -> list[np.ndarray]:
        """Return the stiffness matrices of components other than bars, stacked, and scaled to a largest entry of 1."""
        content = self.system.content
        n = content.model.n
        rows = np.zeros((0, n))
        for e, part in enumerate(self.ideal.acting, content.parameters.contact.size):
            if not isinstance(part, Beam | FlexibleBar):
                columns, block = element_block(content, e)
                free, by_coordinate = columns < n, np.zeros((columns.size, n))
                by_coordinate[:, columns[free]] = block[:, free]
                rows = np.vstack([rows, by_coordinate])
        return [rows / max(float(np.abs(rows).max(initial=0.0)), np.finfo(float).tiny)]

    def _servo_gradients(self) -> list[np.ndarray]:
        """Return the gradients of the angles that servos hold; these motions are locked for buckling."""
        gradients = []
        for part in self.ideal.acting:
            if isinstance(part, Actuator):
                (_, _, ax, ay, bx, by), rows = component_maps(self.system.content, self.number[part.name])
                gradients.append(ax * rows[3] - ay * rows[2] - bx * rows[5] + by * rows[4])
        return gradients


COMPLEX_STEP = 1e-30  # Imaginary step of a complex-step derivative; no subtraction, so no cancellation


def geometric_stiffness(at: StaticPosition, loaded: StaticPosition, slopes: np.ndarray, allowed: np.ndarray) -> np.ndarray:
    """Return the geometric stiffness of the internal forces that loads cause, to first order, in the free coordinates (n, n).

    `at` and `loaded` are the position without and with loads, `slopes` its stiffness, `allowed` a basis of allowed motions.
    """
    n = at.plan.coordinates.free
    loaded = loaded._replace(state=at.state)
    added = force_slopes(loaded)  # follower loads turn with their bodies
    force = loaded.system.content.work.force[:n].copy()
    added -= force_slopes(at)
    force -= at.system.content.work.force[:n]
    moved, stiffness = np.zeros(n), allowed.T @ slopes @ allowed
    # the second solution removes round-off along stiff bars, which would appear as axial force
    for _ in range(2):
        moved += allowed @ np.linalg.solve(stiffness, allowed.T @ (force - slopes @ moved))
    response = _InternalForces(at, moved, loaded.plan.gravity_vector, float(np.linalg.norm(force)))
    uncertain = CONVERGENCE_TOL * float(np.linalg.norm(np.abs(slopes) @ np.abs(moved)))
    whole: np.ndarray = added + response.stiffness(force - slopes @ moved, uncertain)
    return whole


class _InternalForces:
    """Internal forces that a small displacement `moved`, shape (n,), causes, and their geometric stiffness."""

    def __init__(self, at: StaticPosition, moved: np.ndarray, gravity: np.ndarray, load: float) -> None:
        self.at, self.moved, self.gravity, self.least = at, moved, gravity, 1e-9 * load  # smaller forces are round-off
        self.axes, self.shapes = at.plan.coordinates.natural.axes, shapes_by_coordinate(at.plan)

    def stiffness(self, reaction: np.ndarray, uncertain: float) -> np.ndarray:
        """Return the geometric stiffness of all internal forces and reactions, shape (n, n).

        `reaction` is the constraint force, `uncertain` its round-off.
        """
        content = self.at.system.content
        work, n = content.work, self.moved.size
        matrix = np.zeros((n, n))
        contacts, rails = content.parameters.contact.size, rail_axes(self.axes, self.at.plan.acting)
        pushed: dict[str, list[tuple[float, np.ndarray]]] = {axis.bar.name: [] for axis in self.axes}
        for i, component in enumerate(self.at.plan.acting):
            columns, block = element_block(content, contacts + i)
            free, change = columns < n, np.zeros(n)
            change[columns[free]] = block[np.ix_(free, free)] @ self.moved[columns[free]]
            maps, rows = component_maps(content, i)
            if isinstance(component, Beam):
                matrix += self._geometric_of_element(component, maps, rows)
            elif component.declaration.port is LINE:
                matrix += self._geometric_of_line(maps, rows, change)
            elif component.declaration.port is FRAME:
                matrix += self._geometric_of_frame(maps, rows, change)
            elif i in rails:
                place = float(work.coordinates[i, 1])
                force, added = self._geometric_of_roller(component, rails[i], place, change)
                matrix += added
                pushed[rails[i].bar.name].append((place, force))
        for axis in self.axes:
            added, stretch = self._geometric_of_bar(axis, pushed[axis.bar.name])
            matrix += added
            reaction = reaction + stretch
        gradients, _ = constraint_slopes(self.at, np.zeros(work.multiplier.size))
        multiplier = np.linalg.lstsq(gradients.T, reaction)[0]
        multiplier[np.abs(multiplier) * np.linalg.norm(gradients, axis=1) < max(self.least, uncertain)] = 0.0
        return np.asarray(matrix + constraint_slopes(self.at, multiplier)[1])

    def _geometric_of_bar(self, axis: Axis, pushed: list[tuple[float, np.ndarray]]) -> tuple[np.ndarray, np.ndarray]:
        """Return the geometric stiffness int N w'^2 ds of a modal bar; N follows from equilibrium of the bar up to each place.

        The second result is the generalised force of the constraints that keep direction vectors inside the bar at unit
        length. It is contained in N and does not act on other parts.
        """
        bar, shapes, by, count = axis.bar, axis.shapes, self.shapes[axis.bar.name], len(axis.bar.sections)
        vectors = axis.vectors(self.at.natural)
        step = vectors + COMPLEX_STEP * 1j * np.tensordot(self.moved, by, 1)
        still = np.zeros((1, *vectors.shape))
        outside = -np.imag(shape_forces(axis, BarMotion(step[None], still, still, np.ones(1)))[0]) / COMPLEX_STEP
        weight = axis.vectors(self.at.plan.coordinates.natural.translation(self.gravity))
        outside -= bar.mass_per_length * shapes.mass @ weight
        for place, force in pushed:
            outside -= np.outer(shapes_beyond(axis, np.array([place]))[0], force)
        points, weights = legendre.leggauss(shapes.degree + 1)
        ends = np.array(shapes.places)
        half = 0.5 * np.diff(ends)
        at = (ends[:-1, None] + half[:, None] * (1.0 + points)).ravel()
        before = -bar.mass_per_length * np.outer(at, self.gravity) - (ends <= at[:, None]) @ outside[:count]
        for place, force in pushed:
            before -= np.outer(place <= at, force)
        tangent = shapes.at(at, 1) @ vectors
        axial = np.sum(before * tangent, axis=1) / np.linalg.norm(tangent, axis=1)
        axial[np.abs(axial) * max(np.linalg.norm(by[:, k]) for k in range(count)) < self.least] = 0.0
        stretch = np.zeros(self.moved.size)
        for row in range(count, shapes.interface_count):
            along = vectors[row] / np.linalg.norm(vectors[row])
            stretch += by[:, row] @ along * float(outside[row] @ along)
        return stiffness_of_bar(axis, vectors, by, at, axial * np.outer(half, weights).ravel()), stretch

    def _geometric_of_line(self, maps: np.ndarray, rows: np.ndarray, change: np.ndarray) -> np.ndarray:
        """Return the geometric stiffness of a force along a line: its tension over its length, for displacements across it."""
        length = np.hypot(*maps[:2])
        if not length > 0.0:
            return np.zeros((self.moved.size, self.moved.size))
        along, across = maps[:2] @ rows[:2] / length, np.array([-maps[1], maps[0]]) @ rows[:2] / length
        tension = -float(np.linalg.lstsq(np.stack([along, across], axis=1), change)[0][0])
        return np.asarray(tension / length * np.outer(across, across))

    def _geometric_of_frame(self, maps: np.ndarray, rows: np.ndarray, change: np.ndarray) -> np.ndarray:
        """Return the geometric stiffness of a force that acts on a component's end and turns with the body of its start."""
        fx, fy, _ = np.linalg.lstsq((frame_gradients(maps) @ rows).T, change)[0]
        return _stiffness_of_turning_force(fx, fy, rows)

    def _geometric_of_element(self, beam: Beam, maps: np.ndarray, rows: np.ndarray) -> np.ndarray:
        """Return the geometric stiffness of a beam element under its axial force: tension times `stiffness_of_element`."""
        along = maps[:2] / np.hypot(*maps[:2])
        rigidity, strained = beam.axial_stiffness / beam.length, along @ rows[:2]
        tension = rigidity * float(strained @ self.moved)
        least = max(self.least, CONVERGENCE_TOL * rigidity * float(np.linalg.norm(strained) * np.linalg.norm(self.moved)))
        if abs(tension) * np.linalg.norm(strained) < least:
            return np.zeros((self.moved.size, self.moved.size))
        return tension * stiffness_of_element(maps, rows)

    def _geometric_of_roller(self, roller: Any, axis: Axis, place: float, change: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the force of a roller on its bar, which stays normal to the bar, and the geometric stiffness of the force."""
        vectors, by = axis.vectors(self.at.natural), self.shapes[axis.bar.name]
        value, slope = shapes_beyond(axis, np.array([place]))[0], axis.shapes.at(np.clip([place], 0.0, axis.bar.length), 1)[0]
        tangent = slope @ vectors / np.linalg.norm(slope @ vectors)
        normal = np.array([-tangent[1], tangent[0]])
        point = self.at.plan.coordinates.place(roller.point)
        follower = np.zeros((2, self.at.system.content.work.X.size))
        follower[:, point.columns] = point.rows
        apart = follower[:, : self.moved.size].T - np.einsum("k,nka->na", value, by)
        across, along, turned = apart @ normal, apart @ tangent, np.einsum("k,nka,a->n", slope, by, normal)
        force = float(np.linalg.lstsq(across[:, None], change)[0][0])
        return -force * normal, force * (np.outer(turned, along) + np.outer(along, turned))


def shapes_by_coordinate(plan: Plan) -> dict[str, np.ndarray]:
    """Return the derivatives of each bar's shape vectors by the free coordinates, shape (n, vectors, 2), by bar name."""
    coordinates, n = plan.coordinates, plan.coordinates.free
    by_column = np.asarray(coordinates.matrix @ np.eye(n + coordinates.basis)[:, :n]).T
    return {axis.bar.name: axis.vectors(by_column) for axis in coordinates.natural.axes}


def stiffness_of_bar(axis: Axis, vectors: np.ndarray, by: np.ndarray, at: np.ndarray, axial: np.ndarray) -> np.ndarray:
    """Return the geometric stiffness int N w'^2 ds of a modal bar, shape (n, n).

    `axial` are the products N ds at the distances `at` along the bar, `by` the derivatives of its shape vectors `vectors`.
    """
    slopes = axis.shapes.at(at, 1)
    tangent = slopes @ vectors
    size = np.linalg.norm(tangent, axis=1)
    normal = np.stack([-tangent[:, 1], tangent[:, 0]], axis=1) / size[:, None]
    turned = np.einsum("pk,nka,pa->np", slopes, by, normal, optimize=True)
    return np.asarray((turned * (axial / size)) @ turned.T)


def stiffness_of_element(maps: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """Return the geometric stiffness of a beam element under unit tension, which acts along the axis of its start.

    It is int w'^2 ds with a cubic deflection w from that axis, plus the stiffness of the tension as the axis turns.
    """
    chord, frame = np.hypot(*maps[:2]), frame_gradients(maps) @ rows
    cos, sin = np.array([[maps[4], maps[5]], [-maps[5], maps[4]]]) @ maps[:2] / chord
    turned = (cos * frame[1] - sin * frame[0]) / chord
    return np.asarray(element_form(chord, turned, -turned, frame[2] - turned) + _stiffness_of_turning_force(-cos, -sin, rows))


def element_form(chord: float, turned: np.ndarray, first: np.ndarray, last: np.ndarray) -> np.ndarray:
    """Return int w'^2 ds of a beam element with a cubic deflection w, as a matrix in the free coordinates.

    `chord` is its length; `turned`, `first` and `last` are the derivatives of the rotation of the chord, and of the rotations
    of both ends relative to it.
    """
    ends = 4.0 * (np.outer(first, first) + np.outer(last, last)) - np.outer(first, last) - np.outer(last, first)
    return np.asarray(chord * (np.outer(turned, turned) + ends / 30.0))


def frame_gradients(maps: np.ndarray) -> np.ndarray:
    """Return the derivatives of (x, y, angle) of one end of a beam, in the frame of the other end, by (u, a, b), shape (3, 6).

    u is the vector between the ends; a and b are the unit vectors along the bodies at the moving end and at the frame's end.
    """
    ux, uy, ax, ay, bx, by = maps
    return np.array([[bx, by, 0.0, 0.0, ux, uy], [-by, bx, 0.0, 0.0, uy, -ux], [0.0, 0.0, -ay, ax, by, -bx]])


def _stiffness_of_turning_force(fx: float, fy: float, rows: np.ndarray) -> np.ndarray:
    """Return the geometric stiffness of a force (fx, fy) on a component's end that turns with the body of its start (n, n).

    `rows` are the derivatives of the maps u, a and b.
    """
    turned = np.zeros((6, 6))
    turned[0, 4] = turned[1, 5] = fx
    turned[0, 5], turned[1, 4] = -fy, fy
    return np.asarray(-rows.T @ (turned + turned.T) @ rows)
