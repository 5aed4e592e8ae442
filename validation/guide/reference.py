"""Rigid contact of the slider-crank with a clearance guide, impact by impact."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.integrate import solve_ivp

from reference import moreau

__all__ = ["START", "Impact", "cluster", "free_flight"]

START = np.array([0.0, 0.0, 0.0, 150.0, -75.0, -0.01])


class Impact(NamedTuple):
    """Corner (1 rear, 2 front, both upper), time [s], approach and rebound speed [m/s]."""

    corner: int
    time: float
    approach: float
    rebound: float


def free_flight(until: float, model: moreau.SliderCrank) -> np.ndarray:
    """Return directions and rates without contact."""

    def rate(_: float, state: np.ndarray) -> np.ndarray:
        m, h = moreau.matrices(model, state[:3], state[3:])
        return np.concatenate([state[3:], np.linalg.solve(m, h)])

    return solve_ivp(rate, (0.0, until), START, "DOP853", rtol=1e-13, atol=1e-14).y[:, -1]


def cluster(model: moreau.SliderCrank, begin: float, until: float, most: int = 12) -> tuple[list[Impact], np.ndarray]:
    """Return the impacts with friction after a free flight until `begin`, and the state at `until`.

    Single impacts follow Newton's law.
    """
    state, t = free_flight(begin, model), begin
    impacts: list[Impact] = []
    while len(impacts) < most:
        events = []
        for k in range(2):

            def gap(_: float, s: np.ndarray, k: int = k) -> float:
                return moreau.corner(model, s[:3], k)[0]

            gap.terminal, gap.direction = True, -1.0  # type: ignore[attr-defined]
            events.append(gap)

        def rate(_: float, s: np.ndarray) -> np.ndarray:
            m, h = moreau.matrices(model, s[:3], s[3:])
            return np.concatenate([s[3:], np.linalg.solve(m, h)])

        found = solve_ivp(rate, (t, until), state, "DOP853", events=events, rtol=1e-13, atol=1e-15, max_step=1e-8)
        state, t = found.y[:, -1].copy(), float(found.t[-1])
        hit = [k for k in range(2) if found.t_events[k].size]
        if not hit:
            break
        k = hit[0]
        m, _ = moreau.matrices(model, state[:3], state[3:])
        inverse = np.linalg.inv(m)
        _, n, tangent = moreau.corner(model, state[:3], k)
        u = state[3:]
        approach = -float(n @ u)
        # unknown impulses: Newton's law along the normal; sliding friction is at its limit
        slip = np.sign(tangent @ u)
        direction = inverse @ (n - model.friction * slip * tangent)
        impulse = (1.0 + model.restitution) * approach / float(n @ direction)
        state[3:] = u + direction * impulse
        impacts.append(Impact(k + 1, t, approach, float(n @ state[3:])))
    return impacts, state
