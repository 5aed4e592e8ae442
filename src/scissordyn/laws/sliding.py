"""Two tests of a friction law: steady sliding, and a slow oscillation."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.integrate import solve_ivp
from scipy.optimize import root

from scissordyn.laws.contact import Friction, JointContact
from scissordyn.laws.evaluate import friction_force, friction_states
from scissordyn.plugin.element import pointers, row_of


def steady_coefficient(friction: Friction, joint: JointContact, slip_speed: ArrayLike) -> np.ndarray:
    """Friction over normal force in steady sliding."""
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
    """What each state is counted in: its scale, or its size in steady sliding at 1 m/s."""
    sliding = np.zeros(len(friction.states))
    friction_states(at["steady"] or at["start"], 1.0, sliding, row)
    declared = [
        size if state.scale is None else state.size(friction) for state, size in zip(friction.states, sliding, strict=True)
    ]
    return np.array([abs(size) or 1.0 for size in declared])


def _settled(friction: Friction, at: Mapping[str, int], speed: float, row: np.ndarray) -> np.ndarray:
    """States whose rates vanish at a slip speed; NaN where there are none."""
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
    """Slip x = a sin(2 pi f t) from undeflected bristles, and the friction in its third period."""
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
