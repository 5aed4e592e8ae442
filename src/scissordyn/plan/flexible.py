"""Flexible bars among the natural coordinates: clamped cross-sections, numbers of modes, vectors of the shapes."""

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

MODES_MAX = 24  # Largest number of bending modes that is chosen automatically for a bar


def flexible_bars(mechanism: Mechanism) -> tuple[FlexibleBar, ...]:
    return tuple(part for part in mechanism.components if isinstance(part, FlexibleBar))


def clamped_bodies(mechanism: Mechanism) -> frozenset[str]:
    """Return the cross-sections whose direction is a coordinate.

    A drive, or another part than a joint, acts on the direction, or something else than the bar is fixed to the body.
    """
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
        # another inertia than that of the bar's section: something else is fixed to it
        if not alone or abs((body.inertia or 0.0) - local) > 1e-9 * local:
            clamped.add(name)
    return frozenset(clamped)


@dataclass(frozen=True, eq=False)
class Axis:
    """Flexible bar with its shapes and the indices of its natural coordinates.

    A shape vector is the coefficient of a shape function; the sum of all is the axis of the bar.
    """

    bar: FlexibleBar
    shapes: Shapes
    first: np.ndarray  # (count,) Natural coordinate of the x component of each shape vector; y follows
    # (count,) Angle from the natural vector to the shape vector [rad], for directions of cross-sections at an angle
    turned: np.ndarray
    # Cross-sections with a direction of their own; a slope at other ones, if it is a coordinate, has any length
    directed: tuple[int, ...]

    @cached_property
    def stretching(self) -> np.ndarray:
        """Twice the bar's axial energy over EA as a form in the strains at quadrature points, shape (points, points) [m]."""
        return self.shapes.stretching(self.bar.bending_stiffness / self.bar.axial_stiffness)

    @property
    def highest_frequency(self) -> float:
        """Highest natural frequency of the bar's modes, which have fixed cross-sections [Hz]; 0 without modes."""
        if self.shapes.modes == 0:
            return 0.0
        speed = math.sqrt(self.bar.bending_stiffness / self.bar.mass_per_length)
        return float(self.shapes.wave_numbers[self.shapes.modes - 1]) ** 2 * speed / (2.0 * math.pi)

    @property
    def slopes(self) -> list[int]:
        """Indices of the first coordinates of the slope vectors at cross-sections without a direction of their own."""
        slopes = self.first[len(self.bar.sections) : self.shapes.interface_count]
        return [p for p, k in zip(slopes.tolist(), self.shapes.clamped, strict=True) if k not in self.directed]

    @property
    def terms(self) -> list[tuple[int, int, float]]:
        """Index of each shape, first natural coordinate of its vector, and angle by which the vector is rotated."""
        return list(zip(range(self.shapes.count), self.first.tolist(), self.turned.tolist(), strict=True))

    def expression(self, weights: np.ndarray) -> tuple[Expression, Expression]:
        """Return a linear combination of the shape vectors, in natural coordinates."""
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
        """Return the shape vectors (..., count, 2) for natural coordinates (..., nZ)."""
        x, y, cos, sin = natural[..., self.first], natural[..., self.first + 1], np.cos(self.turned), np.sin(self.turned)
        return np.stack([cos * x - sin * y, sin * x + cos * y], axis=-1)

    def static_amplitudes(self, natural: np.ndarray) -> np.ndarray:
        """Return the amplitudes in static deflection under forces at the cross-sections, shape (modes, 2)."""
        return np.asarray(self.shapes.mean @ self.vectors(natural)[: self.shapes.interface_count])

    def add_forces(self, forces: np.ndarray, target: np.ndarray) -> None:
        """Add forces on the shape vectors (..., count, 2) to forces on natural coordinates (..., nZ)."""
        for k, p, angle in self.terms:
            cos, sin = math.cos(angle), math.sin(angle)
            target[..., p] += cos * forces[..., k, 0] + sin * forces[..., k, 1]
            target[..., p + 1] += cos * forces[..., k, 1] - sin * forces[..., k, 0]


def contact_frequency(mechanism: Mechanism, mass: float) -> float:
    """Return 1/T for the shortest duration T of an impact at 1 m/s between a mass and a clearance joint [Hz]; 0 if none.

    For spheres the duration scales with the fifth root of mass squared over speed, so neither must be known well. A hard
    contact uses the stiffness law of the impact that its impulse replaces.
    """
    clearances = {contact.clearance for contact in mechanism.contacts if contact.clearance is not None}
    return max((1.0 / _impact_duration(clearance.stiffness, clearance.surfaces, mass) for clearance in clearances), default=0.0)


@lru_cache(256)
def _impact_duration(law: Any, contact: Any, mass: float, speed: float = 1.0) -> float:
    """Return the duration of an elastic impact [s]: twice the integral of 1/v over the indentation."""
    pointer, row = pointers(law), row_of(law, contact)

    def stored(depth: float) -> float:
        return float(elastic_energy(pointer["energy"], pointer["force"], depth, row))

    energy, deepest = 0.5 * mass * speed**2, 1e-9
    while stored(deepest) < energy and deepest < 1.0:
        deepest *= 1.5
    from scipy.optimize import brentq  # imported here: it takes an eighth of a second

    deepest = float(brentq(lambda depth: stored(depth) - energy, 0.0, deepest, rtol=1e-10)) if deepest < 1.0 else deepest
    points, weights = np.polynomial.legendre.leggauss(24)
    u = 0.5 * (points + 1.0)  # depth = (1 - u^2) deepest removes the singularity at the reversal
    rates = np.sqrt([max(2.0 * (energy - stored(deepest * (1.0 - x * x))) / mass, 1e-300) for x in u.tolist()])
    return float(2.0 * deepest * np.sum(0.5 * weights * 2.0 * u / rates))


def mode_count(mechanism: Mechanism, bar: FlexibleBar) -> int:
    """Return the number of bending modes of a bar: as given, or those up to the frequency of contacts, at least 2 per span."""
    if bar.modes is not None:
        return bar.modes
    least = 2 * (len(bar.sections) - 1)
    below = modes_below(bar, contact_frequency(mechanism, bar.mass_per_length * bar.length))
    return min(max(least, below), MODES_MAX)


def with_mode_counts(mechanism: Mechanism, count: int | None = None) -> Mechanism:
    """Return the mechanism with `count` modes for each bar; by default `mode_count` replaces missing numbers only."""
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
    """Return the number of bending modes of a bar up to a frequency [Hz], with cross-sections held; at most `MODES_MAX`."""
    shapes = shapes_of(tuple(place - bar.places[0] for place in bar.places), (), MODES_MAX)
    speed = math.sqrt(bar.bending_stiffness / bar.mass_per_length)
    return min(int(np.sum(shapes.wave_numbers**2 * speed <= 2.0 * math.pi * frequency)), MODES_MAX)


def axes_of(mechanism: Mechanism, offsets: dict[str, int], clamped: frozenset[str], first: int) -> tuple[tuple[Axis, ...], int]:
    """Return the flexible bars, with their slopes and modes numbered from `first` on, and the total number of coordinates."""
    axes = []
    for bar in flexible_bars(mechanism):
        clamped_at = tuple(k for k, name in enumerate(bar.sections) if name in clamped)
        # a temperature difference applies a moment at both ends: modes without a moment there would converge slowly
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
