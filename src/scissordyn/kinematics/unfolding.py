"""Unfolding: a scalar equation that is equivalent to the closure equations near a position with one small singular value.

With the singular vectors u and v of that value, F(y, s) = g u and v (y - y0) = a define a smooth function g(a, s). Its
zeros are the positions of the mechanism (Lyapunov-Schmidt reduction by a bordered system; Govaerts 2000, Numerical Methods for
Bifurcations of Dynamical Equilibria, chapters 3 and 6). Singular positions are zeros of g with dg/da = 0. Where both
derivatives vanish, g is the distance between two branches of the assembly; they meet if g is zero.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from scissordyn.kinematics.closure import Closure
from scissordyn.tolerance import ASSEMBLY_TOL, CONSTRAINT_TOL

SEARCH_DISTANCE_MAX = 1.0  # Largest Newton step and largest distance of a found position; coordinates are of the order of one
INPUT_STEP_FRACTION = 0.01  # Step of finite differences of inputs, as a fraction of the width of the searched range

AtPlace = Callable[[float], np.ndarray]  # Inputs as a function of the path parameter


@dataclass(frozen=True)
class Point:
    """Position with the value and the derivatives of g."""

    a: float
    place: float
    z: np.ndarray  # (nZ,) Natural coordinates
    g: float
    slope: np.ndarray  # (2,) Derivatives of g by a and by the path parameter
    curvature: np.ndarray  # (2, 2)

    @property
    def saddle(self) -> float:
        """Minus the determinant of the second derivatives; positive where two branches meet or nearly meet."""
        return float(self.curvature[0, 1] ** 2 - self.curvature[0, 0] * self.curvature[1, 1])


class Unfolding:
    """Scalar function g(a, s) whose zeros are the positions of the mechanism near `z` (nZ,)."""

    def __init__(self, closure: Closure, inputs: AtPlace, place: float, z: np.ndarray, width: float) -> None:
        self.closure, self.inputs, self.place, self.z, self.width = closure, inputs, place, z, width
        left, self.values, right = np.linalg.svd(closure.jacobian(z))
        self.u, self.v = left[:, -1], right[-1]
        self._y0 = z[closure.stays]

    def at(self, a: float, place: float, guess: np.ndarray, max_steps: int = 25) -> Point | None:
        """Compute value and derivatives of g; return None if the equations are not solved near the guess (nZ,)."""
        closure, n = self.closure, self._y0.size
        driven, value = closure.driven_part(self.inputs(place)), closure.right_sides(self.inputs(place))
        y, g, last = guess[closure.stays].copy(), 0.0, np.inf
        z = closure.join_unknowns(driven, guess)
        allowed = 1e-15 * (10.0 + closure.total)  # round-off of the bordered equations
        border = np.zeros((n + 1, n + 1))
        border[:n, n], border[n, :n] = -self.u, self.v
        error = np.empty(n + 1)
        for _ in range(max_steps):
            border[:n, :n] = closure.jacobian(z)
            error[:n], error[n] = closure.left_sides(z) - value - g * self.u, self.v @ (y - self._y0) - a
            worst = float(np.max(np.abs(error)))
            if worst < allowed or (worst < ASSEMBLY_TOL and worst >= 0.5 * last):
                return self._derivatives(border, a, place, z, g)
            try:
                change = np.linalg.solve(border, error)
            except np.linalg.LinAlgError:
                return None
            if not np.max(np.abs(change[:n])) < SEARCH_DISTANCE_MAX:
                return None
            y, g, last = y - change[:n], g - float(change[n]), worst
            z[closure.stays] = y
            z = closure.join_unknowns(driven, z)
        return None

    def _derivatives(self, border: np.ndarray, a: float, place: float, z: np.ndarray, g: float) -> Point | None:
        """Return a point with the first and second derivatives of g; None if the bordered matrix is singular."""
        closure, n = self.closure, self._y0.size
        h = INPUT_STEP_FRACTION * self.width
        rows = [self.inputs(place + k * h) for k in (-2, -1, 0, 1, 2)]
        driven, value = (np.array([part(row) for row in rows]) for part in (closure.driven_part, closure.right_sides))
        first, second = (
            np.array([1.0, -8.0, 0.0, 8.0, -1.0]) / (12.0 * h),
            np.array([-1.0, 16.0, -30.0, 16.0, -1.0]) / (12.0 * h * h),
        )
        moved, bent = first @ driven, second @ driven
        sides = np.zeros((n + 1, 2))
        sides[n, 0], sides[:n, 1] = 1.0, first @ value - closure.derivative(z, moved)
        last = np.zeros(n + 1)
        last[n] = 1.0
        try:
            derivative, across = np.linalg.solve(border, sides), np.linalg.solve(border.T, last)[:n]
        except np.linalg.LinAlgError:
            return None
        by_a, by_s = closure.free @ derivative[:n, 0], closure.free @ derivative[:n, 1] + moved
        straight = -across @ closure.second_derivative(z, by_a, by_a), -across @ closure.second_derivative(z, by_a, by_s)
        along = -across @ (closure.second_derivative(z, by_s, by_s) + closure.derivative(z, bent) - second @ value)
        curvature = np.array([[straight[0], straight[1]], [straight[1], along]])
        return Point(a, place, z, g, derivative[n], curvature)

    def meeting(self) -> Point | None:
        """Return the stationary point of g, where branches meet or come near each other; None if there is none nearby."""
        return self._newton(lambda point: (point.slope, point.curvature))

    def limit(self) -> Point | None:
        """Return the limit of the input, where g = dg/da = 0; None if there is none nearby."""

        def equations(point: Point) -> tuple[np.ndarray, np.ndarray]:
            return np.array([point.g, point.slope[0]]), np.array([point.slope, point.curvature[0]])

        return self._newton(equations)

    def _newton(self, equations: Callable[[Point], tuple[np.ndarray, np.ndarray]], max_steps: int = 25) -> Point | None:
        """Solve two equations for a and the path parameter by Newton's method; return None if it does not converge nearby."""
        point, unit, last = self.at(0.0, self.place, self.z), np.array([1.0, self.width]), np.inf
        for _ in range(max_steps):
            if point is None or abs(point.a) > SEARCH_DISTANCE_MAX or abs(point.place - self.place) > 3.0 * self.width:
                return None
            error, matrix = equations(point)
            try:
                change = -np.linalg.solve(matrix, error)
            except np.linalg.LinAlgError:
                return None
            size = float(np.max(np.abs(change / unit)))
            if not np.isfinite(size):
                return None
            if size < CONSTRAINT_TOL or (size < ASSEMBLY_TOL and size >= 0.5 * last):
                return point
            change, last = change / max(1.0, 2.0 * size), size
            point = self.at(point.a + change[0], point.place + change[1], point.z)
        return None
