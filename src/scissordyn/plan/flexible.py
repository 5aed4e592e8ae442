"""Bars that bend as one part: which of their cross-sections are clamped, and where their shapes are among the coordinates."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any

import numpy as np

from scissordyn.components.elastic import node_inertia
from scissordyn.components.flexible_bar import FlexibleBar
from scissordyn.components.port import AXIS
from scissordyn.laws.evaluate import elastic_energy
from scissordyn.model.coupling import RelativeAngle, Slide
from scissordyn.model.mechanism import Mechanism
from scissordyn.plan.elimination import Expression
from scissordyn.plan.shapes import Shapes, shapes_of
from scissordyn.plugin.element import pointers, row_of

IMPACT_SPEED = 1.0  # Of the impact whose duration stands for that of contacts [m/s]
LEAST_MODES, MOST_MODES = 2, 24  # Modes of each span at least, and of a bar at most, if their number is not given

SAME_INERTIA = 1e-9
"""Largest relative difference of the inertia of a cross-section from that of its bar: beyond, something else is fixed to it."""


def flexible_bars(mechanism: Mechanism) -> tuple[FlexibleBar, ...]:
    return tuple(part for part in mechanism.components if isinstance(part, FlexibleBar))


def clamped_bodies(mechanism: Mechanism) -> frozenset[str]:
    """The bodies whose direction something acts on beside joints, or that have more than a cross-section."""
    bars = flexible_bars(mechanism)
    parts: tuple[Any, ...] = (*mechanism.components, *mechanism.latches)
    clamped = {drive.body for drive in mechanism.drives}
    clamped |= {body for weld in mechanism.welds for body, _ in (weld.start, weld.end)}
    clamped |= {part.body for part in parts if part.declaration.motor and part.declaration.port.turning}
    for part in parts:
        if part.declaration.port is not AXIS:
            clamped |= {place.body for place in part.declaration.port.attachments(part) if place.what != "place"}
    for part in mechanism.coupling_parts:
        for _, coordinate in part.terms:
            if isinstance(coordinate, RelativeAngle):
                clamped |= set(coordinate.bodies)
            elif isinstance(coordinate, Slide):
                clamped.add(coordinate.base)
    for guide in mechanism.guides:
        clamped |= {guide.body, *((guide.follower[0],) if guide.aligned or guide.clearance is not None else ())}
    inertia: dict[str, float] = {}
    times: dict[str, int] = {}
    for bar in bars:
        for k, name in enumerate(bar.sections):
            spans = np.diff(bar.places)[max(0, k - 1) : k + 1].tolist()
            inertia[name] = inertia.get(name, 0.0) + sum(node_inertia(bar.mass_per_length, span) for span in spans)
            times[name] = times.get(name, 0) + 1
    for name, local in inertia.items():
        body = mechanism.body(name)
        alone = times[name] == 1 and body.centre == (0.0, 0.0) and all(point == (0.0, 0.0) for point in body.points.values())
        if not alone or abs((body.inertia or 0.0) - local) > SAME_INERTIA * local:
            clamped.add(name)
    return frozenset(clamped)


@dataclass(frozen=True, eq=False)
class Axis:
    """A bar that bends among the natural coordinates."""

    bar: FlexibleBar
    shapes: Shapes
    first: np.ndarray  # (count,) Natural coordinate of the x component of the vector of each shape; y follows
    # (count,) By which angle the natural vector is turned to be that of the shape [rad]: directions of cross-sections at an
    # angle
    turned: np.ndarray
    # Cross-sections with a direction of their own; the slope at other ones, if it is a coordinate, has any length
    directed: tuple[int, ...]

    @cached_property
    def stretching(self) -> np.ndarray:
        """`Shapes.stretching` of the bar."""
        return self.shapes.stretching(self.bar.bending_stiffness / self.bar.axial_stiffness)

    @property
    def highest_frequency(self) -> float:
        """Of the modes that the bar has, its cross-sections held [Hz]; 0 without modes."""
        if self.shapes.modes == 0:
            return 0.0
        speed = math.sqrt(self.bar.bending_stiffness / self.bar.mass_per_length)
        return float(self.shapes.wave_numbers[self.shapes.modes - 1]) ** 2 * speed / (2.0 * math.pi)

    @property
    def slopes(self) -> list[int]:
        """Natural vectors that are slopes at cross-sections without a direction of their own."""
        slopes = self.first[len(self.bar.sections) : self.shapes.held]
        return [p for p, k in zip(slopes.tolist(), self.shapes.clamped, strict=True) if k not in self.directed]

    @property
    def terms(self) -> list[tuple[int, int, float]]:
        """Shape, natural vector and angle by which this is turned."""
        return list(zip(range(self.shapes.count), self.first.tolist(), self.turned.tolist(), strict=True))

    def expression(self, weights: np.ndarray) -> tuple[Expression, Expression]:
        """A combination of the vectors of the shapes, in natural coordinates."""
        x: Expression = {}
        y: Expression = {}
        for k, p, angle in self.terms:
            cos, sin = float(weights[k]) * math.cos(angle), float(weights[k]) * math.sin(angle)
            for row, terms in ((x, {p: cos, p + 1: -sin}), (y, {p: sin, p + 1: cos})):
                for column, value in terms.items():
                    if value != 0.0:
                        row[column] = row.get(column, 0.0) + value
        return x, y

    def vectors(self, natural: np.ndarray) -> np.ndarray:
        """The vectors of the shapes, from natural coordinates of shape (..., nZ), shape (..., count, 2)."""
        x, y, cos, sin = natural[..., self.first], natural[..., self.first + 1], np.cos(self.turned), np.sin(self.turned)
        return np.stack([cos * x - sin * y, sin * x + cos * y], axis=-1)

    def in_static_deflection(self, natural: np.ndarray) -> np.ndarray:
        """The amplitudes with which the bar is bent as by forces at its cross-sections alone, shape (modes, 2)."""
        return np.asarray(self.shapes.mean @ self.vectors(natural)[: self.shapes.held])

    def added(self, forces: np.ndarray, target: np.ndarray) -> None:
        """Add forces on the vectors, shape (..., count, 2), to those on natural coordinates, shape (..., nZ)."""
        for k, p, angle in self.terms:
            cos, sin = math.cos(angle), math.sin(angle)
            target[..., p] += cos * forces[..., k, 0] + sin * forces[..., k, 1]
            target[..., p + 1] += cos * forces[..., k, 1] - sin * forces[..., k, 0]


def contact_frequency(mechanism: Mechanism, mass: float) -> float:
    """One over the duration of the shortest impact of a mass on a clearance joint or guide at 1 m/s [Hz]; 0 without contacts.

    The duration goes with the fifth root of mass squared over speed for a contact as that of spheres, so that neither has to be
    known well. A hard contact has the stiffness law of the impact that its impulse stands for.
    """
    clearances = {contact.clearance for contact in mechanism.contacts if contact.clearance is not None}
    return max((1.0 / _impact_duration(clearance.stiffness, clearance.surfaces, mass) for clearance in clearances), default=0.0)


@lru_cache(256)
def _impact_duration(law: Any, contact: Any, mass: float) -> float:
    """Of an elastic impact [s]: twice the integral of 1/v over the indentation, where the energy (V^2 - v^2) m/2 is stored."""
    pointer, row = pointers(law), row_of(law, contact)

    def stored(depth: float) -> float:
        return float(elastic_energy(pointer["energy"], pointer["force"], depth, row))

    energy, deepest = 0.5 * mass * IMPACT_SPEED**2, 1e-9
    while stored(deepest) < energy and deepest < 1.0:
        deepest *= 1.5
    from scipy.optimize import brentq  # takes an eighth of a second to import

    deepest = float(brentq(lambda depth: stored(depth) - energy, 0.0, deepest, rtol=1e-10)) if deepest < 1.0 else deepest
    points, weights = np.polynomial.legendre.leggauss(24)
    u = 0.5 * (points + 1.0)  # depth = (1 - u^2) deepest: the root of the speed is no longer singular
    speed = np.sqrt([max(2.0 * (energy - stored(deepest * (1.0 - x * x))) / mass, 1e-300) for x in u.tolist()])
    return float(2.0 * deepest * np.sum(0.5 * weights * 2.0 * u / speed))


def mode_count(mechanism: Mechanism, bar: FlexibleBar) -> int:
    """Bending modes of a bar, with its cross-sections held: as given, or those up to the frequency of contacts."""
    if bar.modes is not None:
        return bar.modes
    least = LEAST_MODES * (len(bar.sections) - 1)
    below = modes_below(bar, contact_frequency(mechanism, bar.mass_per_length * bar.length))
    return min(max(least, below), MOST_MODES)


def with_mode_counts(mechanism: Mechanism, count: int | None = None) -> Mechanism:
    """The same mechanism with so many modes of each bar, or with `mode_count` in place of none given; itself if all are."""
    if count is None and all(bar.modes is not None for bar in flexible_bars(mechanism)):
        return mechanism
    components = tuple(
        dataclasses.replace(part, modes=mode_count(mechanism, part) if count is None else count)
        if isinstance(part, FlexibleBar)
        else part
        for part in mechanism.components
    )
    return mechanism.with_parts({"components": components}, check=False)


def modes_below(bar: FlexibleBar, frequency: float) -> int:
    """Number of bending modes of a bar, with its cross-sections held, up to a frequency [Hz]; at most `MOST_MODES`."""
    shapes = shapes_of(tuple(place - bar.places[0] for place in bar.places), (), MOST_MODES)
    speed = math.sqrt(bar.bending_stiffness / bar.mass_per_length)
    return min(int(np.sum(shapes.wave_numbers**2 * speed <= 2.0 * math.pi * frequency)), MOST_MODES)


def axes_of(mechanism: Mechanism, offsets: dict[str, int], clamped: frozenset[str], first: int) -> tuple[tuple[Axis, ...], int]:
    """The bars that bend, their further vectors from a natural coordinate on; and how many coordinates there are then."""
    axes = []
    for bar in flexible_bars(mechanism):
        clamped_at = tuple(k for k, name in enumerate(bar.sections) if name in clamped)
        # a temperature difference is a moment on both ends: modes with none there would converge slowly
        bent = {0, len(bar.sections) - 1} if bar.temperature_difference else set()
        sloped = tuple(sorted({*clamped_at, *bent}))
        shapes = shapes_of(
            tuple(place - bar.places[0] for place in bar.places),
            sloped,
            mode_count(mechanism, bar),
            clamped_at,
            bar.bending_stiffness / bar.axial_stiffness,
        )
        points = [offsets[name] for name in bar.sections]
        directions, turned = [], np.zeros(shapes.count)
        for row, k in enumerate(sloped, len(points)):
            if k in clamped_at:
                directions.append(points[k] + 2)
                turned[row] = bar.angles[k]
            else:
                directions.append(first)
                first += 2
        places = [*points, *directions, *range(first, first + 2 * shapes.modes, 2)]
        axes.append(Axis(bar, shapes, np.array(places, np.int64), turned, clamped_at))
        first += 2 * shapes.modes
    return tuple(axes), first
