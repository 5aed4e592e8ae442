"""One impact of a free mass on a fixed surface: the simplest test of a pair of laws."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp

from scissordyn.laws.contact import Damping, Elastic, JointContact
from scissordyn.laws.evaluate import elastic_force, normal_force
from scissordyn.plugin.element import pointers, row_of


@dataclass(frozen=True)
class Impact:
    """Time history of one impact."""

    time: np.ndarray  # (n,) t [s], delta [m], delta' [m/s], F_n [N] from touch to release
    indentation: np.ndarray  # (n,)
    rate: np.ndarray  # (n,)
    force: np.ndarray  # (n,)

    @property
    def restitution(self) -> float:
        """Rebound over approach speed [1]."""
        return float(-self.rate[-1] / self.rate[0])


def impact(
    stiffness: Elastic, damping: Damping, joint: JointContact, *, mass: float, speed: float, samples: int = 400
) -> Impact:
    """A free mass against a fixed surface, m delta'' = -F_n."""
    of_elastic, of_damping = row_of(stiffness, joint), row_of(damping, joint)
    at_elastic, at_damping = pointers(stiffness)["force"], pointers(damping)["force"]
    rates = np.zeros(len(damping.states))

    def force(delta: float, rate: float, states: np.ndarray) -> float:
        """And the rates of the states of damping."""
        rates[:] = 0.0
        if delta <= 0.0:
            return 0.0
        elastic = elastic_force(at_elastic, delta, of_elastic)
        return float(normal_force(at_damping, elastic, delta, rate, speed, np.ascontiguousarray(states), rates, of_damping))

    def motion(t: float, y: np.ndarray) -> tuple[float, ...]:
        return y[1], -force(y[0], y[1], y[2:]) / mass, *rates

    def released(t: float, y: np.ndarray) -> float:
        return float(y[0])

    released.terminal, released.direction = True, -1.0  # type: ignore[attr-defined]
    # the interval is doubled until the mass has separated
    horizon = 1e-4
    while True:
        scale = np.array([speed * horizon, speed, *(state.size(damping) for state in damping.states)])
        solution = solve_ivp(
            motion,
            (0.0, horizon),
            (0.0, speed, *np.zeros(rates.size)),
            method="LSODA" if rates.size else "DOP853",  # states that relax at once are stiff
            events=released,
            dense_output=True,
            rtol=1e-9,
            atol=1e-12 * scale,
        )
        if solution.status == 1:
            break
        horizon *= 2.0
    time = np.linspace(0.0, solution.t[-1], samples)
    delta, rate, *states = solution.sol(time)  # type: ignore[misc]
    delta = np.maximum(delta, 0.0)
    delta[[0, -1]] = 0.0
    rows = np.reshape(states, (len(states), samples)).T
    return Impact(time, delta, rate, np.array([force(d, r, z) for d, r, z in zip(delta, rate, rows, strict=True)]))
