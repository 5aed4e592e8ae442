"""Run small experiments that show laws: an impact of a free mass on a fixed surface, steady sliding, a slow oscillation."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.integrate import solve_ivp
from scipy.optimize import root

from scissordyn.laws.contact import Damping, Elastic, Friction, JointContact
from scissordyn.laws.evaluate import elastic_force, friction_force, friction_states, normal_force
from scissordyn.plugin.element import pointers, row_of


@dataclass(frozen=True)
class Impact:
    """Time history of one impact, from onset to release."""

    time: np.ndarray  # (n,) t [s], delta [m], delta' [m/s], F_n [N] from touch to release
    indentation: np.ndarray  # (n,)
    rate: np.ndarray  # (n,)
    force: np.ndarray  # (n,)

    @property
    def restitution(self) -> float:
        """Restitution coefficient: rebound over approach speed [1]."""
        return float(-self.rate[-1] / self.rate[0])


def impact(
    stiffness: Elastic, damping: Damping, joint: JointContact, *, mass: float, speed: float, samples: int = 400
) -> Impact:
    """Simulate the impact of a free mass on a fixed surface, m delta'' = -F_n."""
    of_elastic, of_damping = row_of(stiffness, joint), row_of(damping, joint)
    at_elastic, at_damping = pointers(stiffness)["force"], pointers(damping)["force"]
    rates = np.zeros(len(damping.states))

    def force(delta: float, rate: float, states: np.ndarray) -> float:
        """Return the normal force; write the rates of the damping states."""
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
            method="LSODA" if rates.size else "DOP853",  # quickly relaxing states are stiff
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


def steady_coefficient(friction: Friction, joint: JointContact, slip_speed: ArrayLike) -> np.ndarray:
    """Return friction over normal force in steady sliding."""
    row, states, at = row_of(friction, joint), np.zeros(len(friction.states)), pointers(friction)
    rates = np.zeros_like(states)
    speeds = np.asarray(slip_speed, float)
    coefficients = np.empty(speeds.size)
    for index, speed in enumerate(speeds.flat):
        if states.size and not at["steady"]:
            states = _settled(friction, at, float(speed), row)
        else:
            friction_states(at["steady"], speed, states, row)
        coefficients[index] = friction_force(at["force"], speed, 1.0, states, rates, row)
    return coefficients.reshape(speeds.shape)


def _sizes(friction: Friction, at: Mapping[str, int], row: np.ndarray) -> np.ndarray:
    """Return the scale of each state: its declared scale, or its size in steady sliding at 1 m/s."""
    sliding = np.zeros(len(friction.states))
    friction_states(at["steady"] or at["start"], 1.0, sliding, row)
    declared = [
        size if state.scale is None else state.size(friction) for state, size in zip(friction.states, sliding, strict=True)
    ]
    return np.array([abs(size) or 1.0 for size in declared])


def _settled(friction: Friction, at: Mapping[str, int], speed: float, row: np.ndarray) -> np.ndarray:
    """Return the states whose rates vanish at a slip speed; NaN if there are none."""
    size = _sizes(friction, at, row)
    begun = np.zeros_like(size)
    friction_states(at["start"], speed, begun, row)

    def rates(z: np.ndarray) -> np.ndarray:
        rates_of_states = np.zeros_like(size)
        friction_force(at["force"], speed, 1.0, z * size, rates_of_states, row)
        return rates_of_states / (size * abs(speed))

    solved = root(rates, begun / size, tol=1e-12)
    return np.asarray(solved.x * size) if solved.success else np.full_like(size, np.nan)


@dataclass(frozen=True)
class Oscillation:
    displacement: np.ndarray  # (n,) x [m] and F_t/F_n [1]
    coefficient: np.ndarray  # (n,)


def oscillation(
    friction: Friction, joint: JointContact, *, amplitude: float, frequency: float, samples: int = 400
) -> Oscillation:
    """Simulate the slip x = a sin(2 pi f t) from undeflected bristles, and return the friction in its third period."""
    row, count, at = row_of(friction, joint), len(friction.states), pointers(friction)
    size = _sizes(friction, at, row)
    omega = 2.0 * math.pi * frequency

    def force(t: float, z: np.ndarray) -> tuple[float, np.ndarray]:
        rates = np.zeros(count)
        slip = amplitude * omega * math.cos(omega * t)
        return friction_force(at["force"], slip, 1.0, np.ascontiguousarray(z * size), rates, row), rates / size

    time = np.linspace(2.0, 3.0, samples) / frequency
    states = np.zeros((count, samples))
    if count:
        solution = solve_ivp(
            lambda t, z: force(t, z)[1], (0.0, time[-1]), np.zeros(count), method="Radau", t_eval=time, rtol=1e-9, atol=1e-10
        )
        states = np.ascontiguousarray(solution.y)
    coefficient = np.array([force(t, np.ascontiguousarray(states[:, k]))[0] for k, t in enumerate(time)])
    return Oscillation(amplitude * np.sin(omega * time), coefficient)
