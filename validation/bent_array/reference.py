"""Paper's array by absolute nodal coordinates: bars of cubic elements with gradient vectors, pins as shared points.

Gerstmayr and Irschik 2008: a node is a point r and a gradient r_x, r(x) = S(x) q with Hermite's cubics, strain
(|r_x|^2 - 1)/2, curvature (r_x x r_xx)/|r_x|^2. The mass matrix is constant. No equation of the package is used.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.integrate import DOP853
from scipy.linalg import cho_factor, cho_solve
from scipy.optimize import brentq

from reference.laws import flores, liu

__all__ = ["BentArray", "Impact"]

GRAVITY = 9.81


@dataclass(frozen=True)
class Impact:
    """Contact of the clearance joint: time [s], approach speed [m/s], largest force [N]."""

    instant: float
    speed: float
    force: float


class BentArray:
    """Array with one ground bar driven at its first cross-section and clearance between the other bar and the slider.

    Parameters
    ----------
    elements : int
        Elements of each bar, an even number.
    bending, axial : float
        EI [N m^2], EA [N].
    units : int
    """

    length, mass, slider, clearance, width = 2.0, 5.68, 5.0, 0.5e-3, 15e-3
    start, speed, restitution = math.pi / 6.0, 5.0 * math.pi, 0.9

    def __init__(self, elements: int, bending: float, axial: float, units: int = 2) -> None:
        self.elements, self.bending, self.axial, self.bars = elements, bending, axial, 2 * units
        self.size = self.length / elements
        self.elastic, self.factor = liu(self.clearance, self.width), flores(self.restitution)
        self._number()
        self._shapes()
        self._masses()
        self.approach = 0.0

    def _number(self) -> None:
        """Number the points and gradients of every node of every bar; the slider's y is the last coordinate."""
        n, half = self.elements, self.elements // 2
        shared = {(bar, half): f"middle {bar // 2}" for bar in range(self.bars)}
        for bar in range(0, self.bars - 2, 2):
            shared |= {(bar, n): f"upper {bar}", (bar + 3, 0): f"upper {bar}"}
            shared |= {(bar + 1, n): f"lower {bar}", (bar + 2, 0): f"lower {bar}"}
        known: dict[object, int] = {}
        self.points = np.zeros((self.bars, n + 1), int)
        for bar in range(self.bars):
            for node in range(n + 1):
                self.points[bar, node] = known.setdefault(shared.get((bar, node), (bar, node)), len(known))
        self.gradients = len(known) + np.arange(self.bars * (n + 1)).reshape(self.bars, n + 1)
        self.vectors = len(known) + self.bars * (n + 1)
        ends = np.stack([self.points[:, :-1], self.gradients[:, :-1], self.points[:, 1:], self.gradients[:, 1:]], axis=-1)
        self.nodes = ends.reshape(-1, 4)  # four vectors of each element
        self.held = int(self.points[0, 0]), int(self.gradients[0, 0])
        self.journal = int(self.points[1, 0])

    def _shapes(self) -> None:
        """Evaluate Hermite's cubics and their derivatives at five Gauss points."""
        places, weights = np.polynomial.legendre.leggauss(5)
        x, size = 0.5 * (places + 1.0), self.size
        self.weights = 0.5 * size * weights
        self.values = np.array(
            [1 - 3 * x**2 + 2 * x**3, size * (x - 2 * x**2 + x**3), 3 * x**2 - 2 * x**3, size * (x**3 - x**2)]
        )
        first = np.array([6 * x**2 - 6 * x, size * (1 - 4 * x + 3 * x**2), 6 * x - 6 * x**2, size * (3 * x**2 - 2 * x)])
        second = np.array([12 * x - 6, size * (6 * x - 4), 6 - 12 * x, size * (6 * x - 2)])
        self.first, self.second = first / size, second / size**2

    def _masses(self) -> None:
        """Assemble the mass matrix of all vectors, and factorise that of the free ones."""
        one = self.mass / self.length * np.einsum("ag,bg,g->ab", self.values, self.values, self.weights)
        matrix = np.zeros((self.vectors, self.vectors))
        weight = np.zeros(self.vectors)
        for nodes in self.nodes:
            matrix[np.ix_(nodes, nodes)] += one
            weight[nodes] += self.mass / self.length * self.values @ self.weights
        self.weight = weight
        self.free = np.setdiff1d(np.arange(self.vectors), self.held)
        gradient = self.held[1]
        self.factors = cho_factor(matrix[np.ix_(self.free, self.free)])
        self.coupling = matrix[self.free, gradient]
        self.solved = cho_solve(self.factors, self.coupling)
        self.stretched = matrix[gradient, gradient] - self.coupling @ self.solved

    def begin(self) -> np.ndarray:
        """Return the start: straight bars with the velocities of rigid ones, the journal in the middle."""
        q, v = np.zeros((2, self.vectors, 2))
        angle, along = self.start, np.linspace(0.0, self.length, self.elements + 1)
        cos, sin, size = math.cos(angle), math.sin(angle), self.length
        for bar in range(self.bars):
            unit, sense = bar // 2, 1.0 if bar % 2 == 0 else -1.0
            base = np.array([unit * size * cos, 0.0 if sense > 0.0 else size * sin])
            moving = self.speed * np.array([-unit * size * sin, 0.0 if sense > 0.0 else size * cos])
            direction = np.array([cos, sense * sin])
            turning = self.speed * np.array([-sin, sense * cos])
            q[self.points[bar]], v[self.points[bar]] = base + along[:, None] * direction, moving + along[:, None] * turning
            q[self.gradients[bar]], v[self.gradients[bar]] = direction, turning
        slider = size * sin, self.speed * size * cos
        place, rate = [q[self.free].ravel(), [1.0], [slider[0]]], [v[self.free].ravel(), [0.0], [slider[1]]]
        return np.concatenate([*place, *rate, [0.0]])

    def unpacked(self, time: float, y: np.ndarray) -> tuple[np.ndarray, ...]:
        """Return all vectors and their rates, the stretch of the clamp and its rate, and position and speed of the slider."""
        count = 2 * self.free.size + 2
        place, rate = y[:count], y[count : 2 * count]
        angle = self.start + self.speed * time
        u, w = np.array([math.cos(angle), math.sin(angle)]), np.array([-math.sin(angle), math.cos(angle)])
        q, v = np.zeros((2, self.vectors, 2))
        q[self.free], v[self.free] = place[:-2].reshape(-1, 2), rate[:-2].reshape(-1, 2)
        q[self.held[1]], v[self.held[1]] = place[-2] * u, rate[-2] * u + place[-2] * self.speed * w
        return q, v, place[-2:], rate[-2:], u, w

    def contact_state(
        self, q: np.ndarray, v: np.ndarray, slider: np.ndarray, moving: np.ndarray
    ) -> tuple[float, float, np.ndarray]:
        """Return the penetration, its rate and the direction of the eccentricity."""
        e = q[self.journal] - np.array([0.0, slider[1]])
        distance = math.hypot(*e)
        normal = e / distance if distance > 0.0 else np.array([1.0, 0.0])
        return distance - self.clearance, float(normal @ (v[self.journal] - np.array([0.0, moving[1]]))), normal

    def force(self, depth: float, rate: float) -> float:
        """Return the contact force [N]."""
        if depth <= 0.0 or self.approach <= 0.0:
            return 0.0
        return max(0.0, self.elastic(depth) * (1.0 + self.factor * rate / self.approach))

    def rate(self, time: float, y: np.ndarray) -> np.ndarray:
        """Return the derivative of the state; its last entry is the power of the drive."""
        q, v, slider, moving, u, w = self.unpacked(time, y)
        # elastic forces: EA eps d(eps) + EI kappa d(kappa)
        nodes = q[self.nodes]
        r1, r2 = np.einsum("eak,ag->egk", nodes, self.first), np.einsum("eak,ag->egk", nodes, self.second)
        square = np.einsum("egk,egk->eg", r1, r1)
        tension = self.axial * 0.5 * (square - 1.0)
        cross = r1[..., 0] * r2[..., 1] - r1[..., 1] * r2[..., 0]
        kappa = cross / square
        moment = self.bending * kappa / square
        by_first = tension[..., None] * r1 + moment[..., None] * (
            np.stack([r2[..., 1], -r2[..., 0]], axis=-1) - 2.0 * kappa[..., None] * r1
        )
        by_second = moment[..., None] * np.stack([-r1[..., 1], r1[..., 0]], axis=-1)
        inner = np.einsum("egk,ag,g->eak", by_first, self.first, self.weights)
        inner += np.einsum("egk,ag,g->eak", by_second, self.second, self.weights)
        force = np.zeros((self.vectors, 2))
        np.subtract.at(force, self.nodes.ravel(), inner.reshape(-1, 2))
        force[:, 1] -= GRAVITY * self.weight
        depth, growing, normal = self.contact_state(q, v, slider, moving)
        push = self.force(depth, growing)
        force[self.journal] -= push * normal
        slid = push * normal[1] / self.slider - GRAVITY
        # the clamped gradient is lambda u(t): its acceleration is lambda'' u + 2 lambda' u' + lambda u''
        known = 2.0 * moving[0] * self.speed * w - slider[0] * self.speed**2 * u
        free = cho_solve(self.factors, force[self.free]) - np.outer(self.solved, known)
        left = force[self.held[1]] - self.coupling @ cho_solve(self.factors, force[self.free]) - self.stretched * known
        stretching = float(left @ u) / self.stretched
        free -= np.outer(self.solved, stretching * u)
        # the moment of the clamp that holds the direction is lambda times the force across u
        across = float((self.stretched * (known + stretching * u) - left) @ w)
        given = slider[0] * across * self.speed
        count = 2 * self.free.size + 2
        return np.concatenate([y[count : 2 * count], free.ravel(), [stretching, slid, given]])

    def run(self, until: float, tolerance: float = 1e-8) -> tuple[list[Impact], float]:
        """Return the contacts and the work of the drive [J]; the integration restarts at each contact."""
        y, time, found = self.begin(), 0.0, []
        inside = False
        while time < until:
            solver = DOP853(self.rate, time, y, until, rtol=tolerance, atol=tolerance * self.clearance, max_step=2e-5)
            peak = 0.0
            while solver.status == "running":
                solver.step()
                path = solver.dense_output()

                def gap(t: float) -> float:
                    return self.contact_state(*self.unpacked(t, path(t))[:4])[0]  # noqa: B023 (used before it changes)

                here = np.linspace(solver.t_old, solver.t, 5)
                gaps = [gap(t) for t in here]
                if inside:
                    peak = max(peak, *(self.force(*self.contact_state(*self.unpacked(t, path(t))[:4])[:2]) for t in here))
                crossed = [k for k in range(4) if (gaps[k] > 0.0) == inside and (gaps[k + 1] > 0.0) != inside]
                if crossed and not (solver.t_old == time and crossed[0] == 0 and abs(gaps[0]) < 1e-15):
                    k = crossed[0]
                    time = brentq(gap, here[k], here[k + 1], xtol=1e-15)
                    y = path(time)
                    break
            else:
                time, y = solver.t, solver.y
                if inside:
                    found[-1] = Impact(found[-1].instant, found[-1].speed, peak)
                break
            if inside:
                found[-1] = Impact(found[-1].instant, found[-1].speed, peak)
                self.approach = 0.0
            else:
                self.approach = self.contact_state(*self.unpacked(time, y)[:4])[1]
                found.append(Impact(time, self.approach, 0.0))
            inside = not inside
        return found, float(y[-1])
