"""The paper's case written for scipy: minimal coordinates in plain Python, contacts as terminal events.

Two units, pinned bar driven, clearance at joint A, Liu stiffness, Flores damping, LuGre friction or none. Unknowns are psi =
th_1 + th_2 and e_y = (L/2) (sin th_1 - sin th_2) - y, both zero in the ideal array, so that tolerances stay small against the
clearance.
"""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

__all__ = ["Plain"]

L, M, MS, G = 2.0, 5.68, 5.0, 9.81
ANGLE, SPEED = math.radians(30.0), 5.0 * math.pi
C, RJ, LB = 0.5e-3, 10e-3, 15e-3
RB = RJ + C
STIFFNESS = 0.5 * math.pi * LB * 207e9 / (2.0 * (1.0 - 0.3**2))
XI = 1.6 * (1.0 / 0.9 - 1.0)
SIGMA0, SIGMA1, STRIBECK = 1e5, 316.0, 1e-3
MAX_STEP = 5e-5
"""Longest step [s]: scipy finds a root from the signs at the ends of a step, and misses contacts with longer steps."""


@dataclass
class Plain:
    """One run.

    Parameters
    ----------
    kinetic : float or None
        mu_k; None without friction.
    method : str
        Of `scipy.integrate.solve_ivp`.
    tolerance : float
    until : float
        [s]

    Attributes
    ----------
    starts : list of float
        Starts of contacts [s].
    rates : int
        Evaluations of the right-hand side.
    seconds : float
    """

    kinetic: float | None
    method: str
    tolerance: float
    until: float
    starts: list[float] = field(default_factory=list)
    rates: int = 0
    seconds: float = 0.0
    approach: float = 1.0
    touching: bool = False

    def joint(self, t: float, y: np.ndarray) -> tuple[float, ...]:
        """th_1, th_2, th_2', then e, n and delta'."""
        psi, ey, rate, uy = y[:4].tolist()
        p = ANGLE + SPEED * t
        k, wk = psi - p, rate - SPEED
        ex = -L * math.sin(0.5 * psi) * math.sin(0.5 * (p - k))
        ux = 0.5 * L * (math.sin(k) * wk - math.sin(p) * SPEED)
        e = math.hypot(ex, ey)
        nx, ny = (ex / e, ey / e) if e > 0.0 else (1.0, 0.0)
        return p, k, wk, e, nx, ny, ux * nx + uy * ny, uy * nx - ux * ny + wk * RJ

    def gap(self, t: float, y: np.ndarray) -> float:
        """Indentation [m]."""
        return self.joint(t, y)[3] - C

    def slope(self, t: float, y: np.ndarray) -> list[float]:
        """Right-hand side."""
        self.rates += 1
        p, k, wk, e, nx, ny, rate, slip = self.joint(t, y)
        fx = fy = moment = bristle = 0.0
        if self.touching:
            depth = max(e - C, 0.0)
            normal = STIFFNESS * depth * math.sqrt(depth / (2.0 * (C + depth)))
            normal = max(normal * (1.0 + XI * rate / self.approach), 0.0)
            tangential = 0.0
            if self.kinetic is not None:
                z = float(y[4])
                bristle = slip - SIGMA0 * abs(slip) * z / self.sliding(slip)
                tangential = normal * (SIGMA0 * z + self.damping(slip) * bristle)
            fx, fy = -normal * nx + tangential * ny, -normal * ny - tangential * nx
            moment = -RJ * tangential
        half, unit, difference = 0.5 * L, M * L * L, p - k
        push = half * (fx * math.sin(k) - fy * math.cos(k)) + moment
        ak = (unit * math.sin(difference) * SPEED**2 - M * G * L * math.cos(k) + push) / (2.0 / 3.0 * unit)
        journal = half * (math.sin(k) * wk * wk - math.sin(p) * SPEED**2 - math.cos(k) * ak)
        slopes = [float(y[2]), float(y[3]), ak, journal + fy / MS + G]
        return slopes if self.kinetic is None else [*slopes, bristle]

    def sliding(self, slip: float) -> float:
        """LuGre's g(v), static coefficient 1.5 times the kinetic one."""
        assert self.kinetic is not None
        ratio = slip / STRIBECK
        # a product overflows to infinity where a power raises an exception: scipy's first trial steps are long
        return self.kinetic * (1.0 + 0.5 * math.exp(-ratio * ratio))

    def damping(self, slip: float) -> float:
        """Bristle damping, which fades so fast that friction stays within its static limit (F2)."""
        assert self.kinetic is not None
        ratio = slip * SIGMA1 / (math.sqrt(2.0 * math.e) * self.kinetic)
        return SIGMA1 * math.exp(-ratio * ratio)

    def run(self) -> Plain:
        """Integrate from event to event; the bristles have the same tolerance as in the package."""
        began = time.perf_counter()
        bristles = [] if self.kinetic is None else [100.0 * self.kinetic / SIGMA0]
        atol = self.tolerance * np.array([C, C, 1.0, 1.0, *bristles])
        t, y = 0.0, np.zeros(atol.size)
        while t < self.until:
            found = self.piece(t, y, atol)
            t, y = float(found.t[-1]), found.y[:, -1].copy()
            if not found.t_events[0].size:
                break
            self.switch(t, y)
        self.seconds = time.perf_counter() - began
        return self

    def piece(self, t: float, y: np.ndarray, atol: np.ndarray) -> Any:
        """Integrate to the next event."""

        def crossing(when: float, state: np.ndarray) -> float:
            return self.gap(when, state)

        crossing.terminal, crossing.direction = True, -1.0 if self.touching else 1.0  # type: ignore[attr-defined]
        found = solve_ivp(
            self.slope,
            (t, self.until),
            y,
            method=self.method,
            rtol=self.tolerance,
            atol=atol,
            events=crossing,
            max_step=MAX_STEP,
        )
        if not found.success:
            raise RuntimeError(found.message)
        return found

    def switch(self, t: float, y: np.ndarray) -> None:
        """Begin or end a contact."""
        self.touching = not self.touching
        if not self.touching:
            return
        self.starts.append(t)
        *_, rate, slip = self.joint(t, y)
        self.approach = max(rate, 1e-6)
        if self.kinetic is not None:
            y[4] = math.tanh(slip / STRIBECK) * self.sliding(slip) / SIGMA0
