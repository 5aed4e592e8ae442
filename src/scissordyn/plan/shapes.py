"""Shapes of a straight flexible bar: static shapes of its cross-sections, and bending modes with these held.

A bar is r(s) = sum S_k(s) q_k with plane vectors q_k: points of its cross-sections, directions of clamped ones, and
amplitudes of modes. Shapes depend only on lengths; bars with the same lengths share them.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from numpy.polynomial import legendre

# Quadrature points per span of a slender bar and of a stocky bar, in addition to those that the span's modes need
EXTRA_POINTS, STOCKY_EXTRA_POINTS = 2, 4

HERMITE_CUBICS = np.array(
    [[0.5, -0.75, 0.0, 0.25], [0.25, -0.25, -0.25, 0.25], [0.5, 0.75, 0.0, -0.25], [-0.25, -0.25, 0.25, 0.25]]
)
"""Coefficients of the four cubic Hermite polynomials, by powers of xi: unit value or slope at xi = -1, then at xi = 1."""


@dataclass(frozen=True, eq=False)
class Shapes:
    """Shape functions of all flexible bars with the same lengths and clamped cross-sections."""

    places: tuple[float, ...]  # Distances of the cross-sections from the first one [m]
    clamped: tuple[int, ...]  # Cross-sections whose direction is a coordinate
    modes: int
    unit: tuple[int, ...] = ()  # Clamped cross-sections with a unit direction, so that r' has no strain there
    further: int = EXTRA_POINTS

    @property
    def interface_count(self) -> int:
        """Number of points and directions, which come before the amplitudes of modes."""
        return len(self.places) + len(self.clamped)

    @property
    def count(self) -> int:
        """Number of shapes."""
        return self.interface_count + self.modes

    @cached_property
    def degree(self) -> int:
        """Degree of the polynomials in each span between cross-sections: the number of modes per span plus 11.

        The natural frequencies of the modes then have relative errors below 1e-9.
        """
        return 11 + -(-self.modes // (len(self.places) - 1))

    @cached_property
    def _bases(self) -> tuple[tuple[float, np.ndarray, np.ndarray], ...]:
        """Length, active basis functions and their Legendre coefficients of each span; functions are once differentiable."""
        sections, inner = len(self.places), self.degree - 3
        bubble, bases = legendre.poly2leg([1.0, 0.0, -2.0, 0.0, 1.0]), []
        for k, length in enumerate(np.diff(self.places).tolist()):
            rows = [legendre.poly2leg(power * (1.0 if j % 2 == 0 else 0.5 * length)) for j, power in enumerate(HERMITE_CUBICS)]
            rows += [legendre.legmul(bubble, [0.0] * j + [1.0]) / (j + 1.0) ** 2 for j in range(inner)]
            table = np.zeros((len(rows), self.degree + 1))
            for row, coefficients in zip(table, rows, strict=True):
                row[: len(coefficients)] = coefficients
            functions = [*range(2 * k, 2 * k + 4), *range(2 * sections + k * inner, 2 * sections + (k + 1) * inner)]
            bases.append((length, np.array(functions), table))
        return tuple(bases)

    @cached_property
    def _forms(self) -> tuple[np.ndarray, np.ndarray]:
        """Integrals of products of the basis functions, and of their second derivatives."""
        size = 2 * len(self.places) + (len(self.places) - 1) * (self.degree - 3)
        mass, bending = np.zeros((2, size, size))
        points, weights = legendre.leggauss(self.degree + 1)
        for length, functions, table in self._bases:
            value = legendre.legval(points, table.T)
            second = legendre.legval(points, legendre.legder(table.T, 2, axis=0)) * (2.0 / length) ** 2
            mass[np.ix_(functions, functions)] += 0.5 * length * (value * weights) @ value.T
            bending[np.ix_(functions, functions)] += 0.5 * length * (second * weights) @ second.T
        return mass, bending

    @cached_property
    def _solved(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Coefficients of the shapes in the basis functions, means c_ki of static shapes N_i over modes phi_k, and beta^4.

        Static shapes are made orthogonal to the modes, so that the mass matrix is decoupled: S_i = N_i - sum c_ki phi_k.
        """
        mass, bending = self._forms
        sections = len(self.places)
        fixed = np.array([2 * k for k in range(sections)] + [2 * k + 1 for k in self.clamped])
        free = np.setdiff1d(np.arange(mass.shape[0]), fixed)
        inside = np.ix_(free, free)
        import scipy.linalg as sl  # imported here: mechanisms of rigid bodies do not need it

        squares, vectors = sl.eigh(bending[inside], mass[inside])
        table = np.zeros((mass.shape[0], self.count))
        table[fixed, range(self.interface_count)] = 1.0
        table[free, : self.interface_count] = -np.linalg.solve(bending[inside], bending[np.ix_(free, fixed)])
        table[free, self.interface_count :] = vectors[:, : self.modes]
        free_part = table[:, self.interface_count :]
        mean = free_part.T @ mass @ table[:, : self.interface_count]
        table[:, : self.interface_count] -= free_part @ mean
        return table, mean, squares

    @cached_property
    def mass(self) -> np.ndarray:
        """Integrals of S_k S_l, shape (count, count) [m]; modes are orthonormal and decoupled."""
        form = self._solved[0].T @ self._forms[0] @ self._solved[0]
        form[:, self.interface_count :] = form[self.interface_count :] = 0.0
        form[range(self.interface_count, self.count), range(self.interface_count, self.count)] = 1.0
        return np.asarray(form)

    @cached_property
    def bending(self) -> np.ndarray:
        """Integrals of S_k'' S_l'', shape (count, count) [1/m^3]."""
        form = self._solved[0].T @ self._forms[1] @ self._solved[0]
        return np.asarray(0.5 * (form + form.T))

    @property
    def mean(self) -> np.ndarray:
        """Amplitude of each mode in each static shape N_i, shape (modes, held)."""
        return self._solved[1]

    @property
    def wave_numbers(self) -> np.ndarray:
        """Wave numbers beta of all bending modes that the polynomials represent [1/m]: omega = beta^2 sqrt(EI/mu)."""
        return np.asarray(self._solved[2] ** 0.25)

    @cached_property
    def quadrature(self) -> tuple[np.ndarray, np.ndarray]:
        """Points [m] and weights [m] for the axial strain; fewer than 1.5 points per mode would leave axial motions soft."""
        lengths = np.diff(self.places)
        counts = [int(1.5 * max(1, round(self.modes * float(part)))) + self.further for part in lengths / lengths.sum()]
        rules = [legendre.leggauss(count) for count in counts]
        points = [first + 0.5 * l * (x + 1.0) for first, l, (x, _) in zip(self.places, lengths, rules, strict=False)]
        return np.concatenate(points), np.concatenate([0.5 * l * w for l, (_, w) in zip(lengths, rules, strict=True)])

    def stretching(self, ratio: float) -> np.ndarray:
        """Return twice the axial energy over EA as a form in the strains at quadrature points, shape (points, points) [m].

        The bending energy of all vectors, EI int |r''|^2 ds, contains the squared derivative e' of the strain in addition to
        the curvature. It is subtracted here: int e^2 - (EI/EA) e'^2 ds, with e a polynomial in each span. A subtracted
        fraction x leaves 1 - x up to x = 1/2, and 1/(4 x) beyond, so that the energy stays positive.

        The strain is projected on the strains of axial motions. Those of a straight bar are unchanged. Other strains of a
        strongly bent bar, which axial motions cannot remove, then do not lock its bending.
        """
        points, weights = self.quadrature
        form, slopes = np.zeros((2, points.size, points.size))
        for first, last in zip(self.places, self.places[1:], strict=False):
            inside = np.flatnonzero((points > first) & (points < last))
            root = np.sqrt(weights[inside])
            powers = legendre.legvander(2.0 * (points[inside] - first) / (last - first) - 1.0, inside.size - 1)
            derived = np.zeros_like(powers)
            for k in range(1, inside.size):
                slope = legendre.legder(np.eye(inside.size)[k])
                derived[:, k] = powers[:, : slope.size] @ slope * 2.0 / (last - first)
            slopes[np.ix_(inside, inside)] = slope_of = np.linalg.solve(powers.T, derived.T).T
            scaled = root[:, None] * slope_of / root
            parts, vectors = np.linalg.eigh(ratio * scaled.T @ scaled)
            left = np.where(parts <= 0.5, 1.0 - parts, 0.25 / np.maximum(parts, 0.5))
            form[np.ix_(inside, inside)] = root[:, None] * (vectors * left) @ vectors.T * root
        projected = self._onto_axial_strains.T @ form @ self._onto_axial_strains
        return self._with_strain_at_clamps(projected, weights[:, None] * slopes, ratio) if self.unit else projected

    @cached_property
    def _onto_axial_strains(self) -> np.ndarray:
        """Matrix that projects strains at the points on those that the slopes of the shapes span, in the norm int e^2 ds."""
        points, weights = self.quadrature
        root = np.sqrt(weights)[:, None]
        vectors, values, _ = np.linalg.svd(root * self.at(points, 1), full_matrices=False)
        axial = vectors[:, values > 1e-10 * values[0]]  # smaller ones are round-off: a translation causes no strain
        return np.asarray(axial / root @ (axial * root).T)

    def _with_strain_at_clamps(self, form: np.ndarray, slopes: np.ndarray, ratio: float) -> np.ndarray:
        """Return the form minimised over strains a of the unit directions.

        With l the slope of a direction's shape, the strain is g = e + a l. The bending form contains g'^2 - 2 a e' l' - a^2
        l'^2 instead of g'^2. If the points do not resolve e' and a motion would lose its stiffness, this is not corrected.
        """
        points, weights = self.quadrature
        rows = [len(self.places) + self.clamped.index(k) for k in self.unit]
        tables = self.at(points, 1), self.at(points, 2)
        first, second = (table[:, rows] for table in tables)
        free = np.setdiff1d(np.arange(self.count), rows)
        moved = tables[0][:, free]
        for part in (ratio, 0.0):
            coupled = form @ first + part * slopes.T @ second
            unit = first.T @ form @ first + part * second.T @ (weights[:, None] * second)
            relaxed = form - coupled @ np.linalg.solve(unit, coupled.T)
            stiffness = np.linalg.eigvalsh(moved.T @ relaxed @ moved + ratio * self.bending[np.ix_(free, free)])
            if stiffness[0] > -1e-10 * stiffness[-1]:  # a translation has zero stiffness up to round-off
                break
        return np.asarray(relaxed)

    def at(self, places: np.ndarray, derivative: int = 0) -> np.ndarray:
        """Return the shapes or their derivatives at some places, shape (places, count); read-only."""
        return _evaluated(self, tuple(places.tolist()), derivative)


@lru_cache(1024)
def _evaluated(shapes: Shapes, places: tuple[float, ...], derivative: int) -> np.ndarray:
    """Return shapes or their derivatives at places, shape (places, count), cached for bars with equal shapes."""
    values = np.zeros((len(places), shapes._forms[0].shape[0]))
    span = np.clip(np.searchsorted(shapes.places, places, side="right") - 1, 0, len(shapes.places) - 2)
    for row, place, k in zip(values, places, span, strict=True):
        length, functions, table = shapes._bases[k]
        derived = legendre.legder(table.T, derivative, axis=0) if derivative else table.T
        row[functions] = (
            legendre.legval(2.0 * (place - shapes.places[k]) / length - 1.0, derived) * (2.0 / length) ** derivative
        )
    values = np.asarray(values @ shapes._solved[0])
    values.setflags(write=False)
    return values


@lru_cache(256)
def shapes_of(
    places: tuple[float, ...], clamped: tuple[int, ...], modes: int, unit: tuple[int, ...] = (), ratio: float = 0.0
) -> Shapes:
    """Return the shapes of a bar whose cross-sections are at these distances from the first one."""
    # above this EI/(EA L^2) of a clamped bar the strain changes near its clamp, and modes resolve it
    stocky = unit and ratio > 1e-5 * places[-1] ** 2
    return Shapes(places, clamped, modes, unit, STOCKY_EXTRA_POINTS if stocky else EXTRA_POINTS)
