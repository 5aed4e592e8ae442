"""What loads add to the stiffness by the internal forces that they cause, position and stiffness of the material kept."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.polynomial import legendre

from scissordyn.component.beam import Beam
from scissordyn.component.port import FRAME, LINE
from scissordyn.plan.flexible import Axis
from scissordyn.plan.rail import rail_axes, shapes_beyond
from scissordyn.run.answer.bars import BarMotion, shape_forces
from scissordyn.run.start.stiffness import At, component_maps, constraint_slopes, force_slopes

ROUNDING = 1e-9  # Internal forces below this part of the loads are round-off
CANCELLED = 1e-14  # Likewise of what cancels in the strain of a beam element and in the balance of forces

COMPLEX_STEP = 1e-30


def geometric_stiffness(at: At, loaded: At, slopes: np.ndarray, allowed: np.ndarray) -> np.ndarray:
    """Stiffness in the free coordinates of the forces that loads cause to the first order, shape (n, n)."""
    n = at.plan.coordinates.free
    loaded = loaded._replace(state=at.state)
    added = force_slopes(loaded)  # loads that follow their bodies turn
    force = loaded.system.content.work.force[:n].copy()
    added -= force_slopes(at)
    force -= at.system.content.work.force[:n]
    moved, stiffness = np.zeros(n), allowed.T @ slopes @ allowed
    # the second solution takes round-off along stiff bars away, which would be forces of these
    for _ in range(2):
        moved += allowed @ np.linalg.solve(stiffness, allowed.T @ (force - slopes @ moved))
    response = _Response(at, moved, loaded.plan.gravity_vector, float(np.linalg.norm(force)))
    uncertain = CANCELLED * float(np.linalg.norm(np.abs(slopes) @ np.abs(moved)))
    whole: np.ndarray = added + response.stiffness(force - slopes @ moved, uncertain)
    return whole


class _Response:
    """Internal forces of a displacement `moved`, shape (n,), to the first order, and their stiffness."""

    def __init__(self, at: At, moved: np.ndarray, gravity: np.ndarray, load: float) -> None:
        self.at, self.moved, self.gravity, self.least = at, moved, gravity, ROUNDING * load
        self.axes = at.plan.coordinates.natural.axes
        by_column = np.asarray(at.plan.coordinates.matrix @ np.eye(at.system.content.work.X.size)[:, : moved.size]).T
        self.shapes = {id(axis): axis.vectors(by_column) for axis in self.axes}

    def stiffness(self, reaction: np.ndarray, uncertain: float) -> np.ndarray:
        """Of all parts and of the reaction of the constraints, which rounding makes uncertain, shape (n, n)."""
        content = self.at.system.content
        model, work, n = content.model, content.work, self.moved.size
        matrix = np.zeros((n, n))
        contacts, rails = content.parameters.contact.size, rail_axes(self.axes, self.at.plan.acting)
        pushed: dict[int, list[tuple[float, np.ndarray]]] = {id(axis): [] for axis in self.axes}
        for i, component in enumerate(self.at.plan.acting):
            first, last = model.element_start[contacts + i], model.element_start[contacts + i + 1]
            columns, start = model.element_column[first:last], model.block_start[contacts + i]
            block = work.block_x[start : start + columns.size**2].reshape(columns.size, columns.size)
            free = columns < n
            change = np.zeros(n)
            change[columns[free]] = block[np.ix_(free, free)] @ self.moved[columns[free]]
            maps, rows = component_maps(content, i)
            if isinstance(component, Beam):
                matrix += self._of_element(component, maps, rows)
            elif component.declaration.port is LINE:
                matrix += self._of_line(maps, rows, change)
            elif component.declaration.port is FRAME:
                matrix += self._of_frame(maps, rows, change)
            elif i in rails:
                place = float(work.coordinates[i, 1])
                force, added = self._of_roller(component, rails[i], place, change)
                matrix += added
                pushed[id(rails[i])].append((place, force))
        for axis in self.axes:
            added, stretch = self._of_bar(axis, pushed[id(axis)])
            matrix += added
            reaction = reaction + stretch
        gradients, _ = constraint_slopes(self.at, np.zeros(work.multiplier.size))
        multiplier = np.linalg.lstsq(gradients.T, reaction)[0]
        multiplier[np.abs(multiplier) * np.linalg.norm(gradients, axis=1) < max(self.least, uncertain)] = 0.0
        return np.asarray(matrix + constraint_slopes(self.at, multiplier)[1])

    def _of_bar(self, axis: Axis, pushed: list[tuple[float, np.ndarray]]) -> tuple[np.ndarray, np.ndarray]:
        """Int N w'^2 ds of a bar by modes, N by equilibrium of the part before each place.

        Also what keeps the length of unit directions within the bar, which is part of its N and no force on other parts.
        """
        bar, shapes, by, count = axis.bar, axis.shapes, self.shapes[id(axis)], len(axis.bar.sections)
        vectors = axis.vectors(self.at.natural)
        step = vectors + COMPLEX_STEP * 1j * np.tensordot(self.moved, by, 1)
        still = np.zeros((1, *vectors.shape))
        outside = -np.imag(shape_forces(axis, BarMotion(step[None], still, still, np.ones(1)))[0]) / COMPLEX_STEP
        weight = axis.vectors(self.at.plan.coordinates.natural.uniform(self.gravity))
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
        for row in range(count, shapes.held):
            along = vectors[row] / np.linalg.norm(vectors[row])
            stretch += by[:, row] @ along * float(outside[row] @ along)
        return stiffness_of_bar(axis, vectors, by, at, axial * np.outer(half, weights).ravel()), stretch

    def _of_line(self, maps: np.ndarray, rows: np.ndarray, change: np.ndarray) -> np.ndarray:
        """Tension over length, across the line."""
        length = np.hypot(*maps[:2])
        if not length > 0.0:
            return np.zeros((self.moved.size, self.moved.size))
        along, across = maps[:2] @ rows[:2] / length, np.array([-maps[1], maps[0]]) @ rows[:2] / length
        tension = -float(np.linalg.lstsq(np.stack([along, across], axis=1), change)[0][0])
        return np.asarray(tension / length * np.outer(across, across))

    def _of_frame(self, maps: np.ndarray, rows: np.ndarray, change: np.ndarray) -> np.ndarray:
        """Of a force on the end that turns with the start's body."""
        fx, fy, _ = np.linalg.lstsq((frame_gradients(maps) @ rows).T, change)[0]
        return _of_turning_force(fx, fy, rows)

    def _of_element(self, beam: Beam, maps: np.ndarray, rows: np.ndarray) -> np.ndarray:
        """Int N w'^2 ds of a beam element, w cubic from the axis of its start, and the force as that turns."""
        along = maps[:2] / np.hypot(*maps[:2])
        rigidity, strained = beam.axial_stiffness / beam.length, along @ rows[:2]
        tension = rigidity * float(strained @ self.moved)
        least = max(self.least, CANCELLED * rigidity * float(np.linalg.norm(strained) * np.linalg.norm(self.moved)))
        if abs(tension) * np.linalg.norm(strained) < least:
            return np.zeros((self.moved.size, self.moved.size))
        return tension * stiffness_of_element(maps, rows)

    def _of_roller(self, roller: Any, axis: Axis, place: float, change: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The force on the bar, and its stiffness: as the bar turns, the force has a part along the motion of the point."""
        vectors, by = axis.vectors(self.at.natural), self.shapes[id(axis)]
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


def stiffness_of_bar(axis: Axis, vectors: np.ndarray, by: np.ndarray, at: np.ndarray, axial: np.ndarray) -> np.ndarray:
    """Int N w'^2 ds of a bar by modes from N ds at places; `by`, shape (n, count, 2), are the derivatives of its vectors."""
    slopes = axis.shapes.at(at, 1)
    tangent = slopes @ vectors
    size = np.linalg.norm(tangent, axis=1)
    normal = np.stack([-tangent[:, 1], tangent[:, 0]], axis=1) / size[:, None]
    turned = np.einsum("pk,nka,pa->np", slopes, by, normal, optimize=True)
    return np.asarray((turned * (axial / size)) @ turned.T)


def stiffness_of_element(maps: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """Int w'^2 ds of a beam element, w cubic from the axis of its start, and of a unit tension as that turns."""
    chord, frame = np.hypot(*maps[:2]), frame_gradients(maps) @ rows
    cos, sin = np.array([[maps[4], maps[5]], [-maps[5], maps[4]]]) @ maps[:2] / chord
    turned = (cos * frame[1] - sin * frame[0]) / chord
    return np.asarray(element_form(chord, turned, -turned, frame[2] - turned) + _of_turning_force(-cos, -sin, rows))


def element_form(chord: float, turned: np.ndarray, first: np.ndarray, last: np.ndarray) -> np.ndarray:
    """Int w'^2 ds, w cubic, from what turns the chord and the ends against it."""
    ends = 4.0 * (np.outer(first, first) + np.outer(last, last)) - np.outer(first, last) - np.outer(last, first)
    return np.asarray(chord * (np.outer(turned, turned) + ends / 30.0))


def frame_gradients(maps: np.ndarray) -> np.ndarray:
    """Of the coordinates of the port "frame" by its maps."""
    ux, uy, ax, ay, bx, by = maps
    return np.array([[bx, by, 0.0, 0.0, ux, uy], [-by, bx, 0.0, 0.0, uy, -ux], [0.0, 0.0, -ay, ax, by, -bx]])


def _of_turning_force(fx: float, fy: float, rows: np.ndarray) -> np.ndarray:
    """Stiffness of a force on the end along the axes of the start's body."""
    turned = np.zeros((6, 6))
    turned[0, 4] = turned[1, 5] = fx
    turned[0, 5], turned[1, 4] = -fy, fy
    return np.asarray(-rows.T @ (turned + turned.T) @ rows)
