"""How near bars of a mechanism in motion come to buckling, its drives locked."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from scissordyn.component.actuator import Actuator
from scissordyn.component.beam import Beam
from scissordyn.component.flexible_bar import FlexibleBar
from scissordyn.integrate.integration import Samples
from scissordyn.kernel import Handle
from scissordyn.kinematics.assembly import basis_at_start, whole_state
from scissordyn.mechanics.outputs import Record
from scissordyn.plan.plan import Plan
from scissordyn.run.advance.system import make_system
from scissordyn.run.answer.bars import axial_force_at_points, bar_motions, marks_of, part_names
from scissordyn.run.answer.geometric_stiffness import element_form, frame_gradients, stiffness_of_bar, stiffness_of_element
from scissordyn.run.answer.internal_forces import Bar, bars_of
from scissordyn.run.results import Variable
from scissordyn.run.start.rest import count_turns, touch_closed
from scissordyn.run.start.stiffness import At, component_maps, constraint_slopes, force_slopes, free_directions

INSTANTS = 5
"""At so many positions of a run stiffnesses are compared, each with the largest compressions of its part of the samples."""

SHARE = 0.1  # A bar takes part in a mode of buckling if so much of the work of all compressions is its own
UNRESOLVED = 1e-15  # Stiffnesses below this part of the largest, times the number of coordinates, are round-off


class Forces(NamedTuple):
    """Axial forces of a bar over time, shape (nt, places), and the distances of the places from its first end."""

    bar: Bar
    axial: np.ndarray
    places: np.ndarray

    @property
    def compression(self) -> np.ndarray:
        """Largest along the bar at each instant [N]."""
        return np.asarray(np.maximum(-self.axial, 0.0).max(axis=1))

    @property
    def slenderness(self) -> float:
        """Length squared over bending stiffness [1/N]."""
        return self.bar.length**2 / min(part.bending_stiffness for part in self.bar.parts)


def buckling_ratios(plan: Plan, samples: Samples, record: Record, variables: Mapping[str, Variable]) -> np.ndarray:
    """The largest ratio of each bar's compression to that at which the mechanism would buckle if all axial forces grew alike.

    The samples are divided into parts. At the position of each part where bars are compressed most, drives, servos and free
    motions locked and joints ideal, K a = factor G a with the stiffness K of the material and G the geometric stiffness of
    the least tension or largest compression at each place among the part's samples. The ratio is the largest 1/factor among
    the modes that a bar takes part in; 0 without compression.
    """
    bars = bars_of(plan.mechanism)
    ratio = np.zeros(len(bars))
    if not bars or not samples.time.size:
        return ratio
    forces = [_forces(bar, variables) for bar in bars]
    heed = np.max([force.compression * force.slenderness for force in forces], axis=0)
    if not heed.max() > 0.0:
        return ratio
    frozen = _Frozen(plan)
    for part in np.array_split(np.arange(samples.time.size), INSTANTS):
        if part.size and heed[part].max() > 0.0:
            k = int(part[np.argmax(heed[part])])
            ratio = np.maximum(ratio, frozen.ratios(k, samples, record, [(f, f.axial[part].min(axis=0)) for f in forces]))
    return ratio


def _forces(bar: Bar, variables: Mapping[str, Variable]) -> Forces:
    names = {name: k for k, name in enumerate(variables["beam"].values.astype(str).tolist())}
    if bar.whole:
        columns = [names[name] for name in part_names(bar.whole)]
        parts = [variables[f"beam_{at}axial_force"].values[:, columns] for at in ("start_", "", "end_")]
        ends = marks_of(bar.whole)
        places = np.stack([ends[:-1], 0.5 * (ends[1:] + ends[:-1]), ends[1:]], axis=1)
        return Forces(bar, np.stack(parts, axis=2).reshape(len(parts[0]), -1), places.ravel())
    columns = [names[beam.name] for beam in bar.beams]
    return Forces(bar, variables["beam_axial_force"].values[:, columns], np.arange(len(columns)) + 0.0)


class _Frozen:
    """The ideal mechanism at positions of a run."""

    def __init__(self, plan: Plan) -> None:
        self.plan, self.ideal = plan, plan.ideal
        self.system: Handle = make_system(self.ideal)
        n = self.ideal.coordinates.free
        columns = n + self.system.content.model.nb
        by_column = np.asarray(self.ideal.coordinates.matrix @ np.eye(columns)[:, :n]).T
        self.axes = {axis.bar.name: axis for axis in self.ideal.coordinates.natural.axes}
        self.shapes = {name: axis.vectors(by_column) for name, axis in self.axes.items()}
        self.number = {part.name: i for i, part in enumerate(self.ideal.acting)}

    def ratios(self, k: int, samples: Samples, record: Record, forces: list[tuple[Forces, np.ndarray]]) -> np.ndarray:
        """Of all bars at sample k, with some axial forces along them."""
        at = self._placed(k, samples, record)
        stiffness = force_slopes(at, float(samples.time[k]))
        geometric, strains = [], self._other_parts()
        for force, axial in forces:
            whole = force.bar.whole is not None
            parts = self._of_whole(k, samples, record, force, axial) if whole else self._of_elements(force, axial)
            now, added, strain = parts
            stiffness -= now
            geometric.append(added)
            strains.append(strain)
        content = at.system.content
        gradients, _ = constraint_slopes(at, np.zeros(content.work.multiplier.size))
        allowed = free_directions(np.vstack([gradients, *self._servos()]))
        # a bent bar that turns freely keeps a small stiffness here, of the second order in its deflection, and would buckle
        unstrained = free_directions(np.vstack(strains) @ allowed)
        allowed = allowed @ free_directions(unstrained.T)
        values, vectors = np.linalg.eigh(0.5 * allowed.T @ (stiffness + stiffness.T) @ allowed)
        stiff = values > UNRESOLVED * values.size * np.max(np.abs(values), initial=0.0)
        scaled = allowed @ vectors[:, stiff] / np.sqrt(values[stiff])
        works, modes = np.linalg.eigh(-scaled.T @ sum(geometric) @ scaled)
        shares = np.array([-np.sum((scaled @ modes) * (part @ scaled @ modes), axis=0) for part in geometric])
        least = np.minimum(SHARE * np.sum(np.maximum(shares, 0.0), axis=0), shares.max(axis=0))
        return np.asarray(np.max(np.where((shares >= least) & (works > 0.0), works, 0.0), axis=1, initial=0.0))

    def _placed(self, k: int, samples: Samples, record: Record) -> At:
        """The ideal mechanism where the one that is run is at sample k."""
        content, time = self.system.content, float(samples.time[k])
        turned = {body.name: float(record.angle[k, b] - body.placed_angle) for b, body in enumerate(self.plan.bodies)}
        count_turns(self.ideal, content, turned | {"ground": 0.0})
        natural = np.asarray(self.plan.coordinates.matrix @ record.X[k])
        position = self.ideal.coordinates.nearest(basis_at_start(content, time)[0], natural)
        state = whole_state(content, position)
        touch_closed(self.system, state)
        return At(self.ideal, self.system, state)

    def _of_whole(
        self, k: int, samples: Samples, record: Record, force: Forces, axial: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Geometric stiffness of a bar by modes, of the present axial forces and of others; and what strains it."""
        bar: Any = force.bar.whole
        axis, by = self.axes[bar.name], self.shapes[bar.name]
        present = [part[k : k + 1] if isinstance(part, np.ndarray) else part for part in record]
        motions = bar_motions(self.plan, Record(*present), samples.time[k : k + 1])
        motion = motions[[axis.bar.name for axis in self.plan.coordinates.natural.axes].index(bar.name)]
        vectors, (points, weights) = motion.vectors[0], axis.shapes.quadrature
        now = stiffness_of_bar(axis, vectors, by, points, axial_force_at_points(axis, motion)[0])
        added = stiffness_of_bar(axis, vectors, by, points, np.interp(points, force.places, axial) * weights)
        slopes = axis.shapes.at(points, 1)
        tangent = slopes @ vectors
        normal = np.stack([-tangent[:, 1], tangent[:, 0]], axis=1) / np.linalg.norm(tangent)
        moved = np.einsum("pk,nka->npa", slopes, by)
        strain = moved - np.einsum("npa,pa->n", moved, normal)[:, None, None] * normal
        return now, added, strain.reshape(len(strain), -1).T / np.linalg.norm(tangent)

    def _of_elements(self, force: Forces, axial: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The same of a chain of beam elements."""
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

    def _other_parts(self) -> list[np.ndarray]:
        """Stiffnesses of the parts that are no bars, the largest 1."""
        content = self.system.content
        model, work, contacts = content.model, content.work, content.parameters.contact.size
        rows = np.zeros((0, model.n))
        for i, part in enumerate(self.ideal.acting):
            if not isinstance(part, Beam | FlexibleBar):
                columns = model.element_column[model.element_start[contacts + i] : model.element_start[contacts + i + 1]]
                start = model.block_start[contacts + i]
                block = np.zeros((columns.size, model.n))
                free = columns < model.n
                block[:, columns[free]] = work.block_x[start : start + columns.size**2].reshape(columns.size, -1)[:, free]
                rows = np.vstack([rows, block])
        return [rows / max(float(np.abs(rows).max(initial=0.0)), np.finfo(float).tiny)]

    def _servos(self) -> list[np.ndarray]:
        """Gradients of the angles that servos hold: their stiffness is that of a controller, not of the material."""
        gradients = []
        for part in self.ideal.acting:
            if isinstance(part, Actuator):
                (_, _, ax, ay, bx, by), rows = component_maps(self.system.content, self.number[part.name])
                gradients.append(ax * rows[3] - ay * rows[2] - bx * rows[5] + by * rows[4])
        return gradients
