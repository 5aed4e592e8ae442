"""The woodpecker toy: free flight by Lagrange's equations, and Moreau's time stepping; no equation of the package is used.

Free flight has the position of the sleeve and both angles, of any size. The time stepping has the height of the sleeve, its
rotation and that of the bird, as small angles; contacts are the beak and the lower and the upper edge of the sleeve.
Model and parameters of Glocker 1995 and of Leine, Glocker and van Campen 2001.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from scipy.integrate import solve_ivp

__all__ = ["first_contact", "march"]

# Masses [kg] and moments of inertia [kg m^2] of sleeve and bird
MASS_SLEEVE, MASS_BIRD, INERTIA_SLEEVE, INERTIA_BIRD = 0.3e-3, 4.5e-3, 5e-9, 7e-7
# Distances [m] from the sleeve to the spring, to the bird, and to the beak upwards and backwards
TO_SPRING, TO_BIRD, BEAK_UP, BEAK_BACK = 0.010, 0.015, 0.020, 0.0201
# Radii of pole and sleeve and half height of the sleeve [m], spring stiffness [N m/rad], gravity [m/s^2]
POLE, SLEEVE, HALF_HEIGHT, STIFFNESS, GRAVITY = 2.5e-3, 3.1e-3, 5.8e-3, 5.6e-3, 9.81
RESTITUTION = np.array([0.5, 0.0, 0.0])  # Restitution coefficients of the beak and of both edges of the sleeve


@njit
def _gaps(q):
    return np.array(
        [
            TO_SPRING + TO_BIRD - BEAK_BACK - POLE - BEAK_UP * q[2],
            SLEEVE - POLE + HALF_HEIGHT * q[1],
            SLEEVE - POLE - HALF_HEIGHT * q[1],
        ]
    )


@njit
def march(q, u, step, until, friction):
    """Return the heights of the sleeve and the instants at which the beak hits the pole."""
    a, b = MASS_BIRD * TO_SPRING, MASS_BIRD * TO_BIRD
    mass = np.array(
        [
            [MASS_SLEEVE + MASS_BIRD, a, b],
            [a, INERTIA_SLEEVE + a * TO_SPRING, a * TO_BIRD],
            [b, b * TO_SPRING, INERTIA_BIRD + b * TO_BIRD],
        ]
    )
    inverse = np.linalg.inv(mass)
    normal = np.array([[0.0, 0.0, -BEAK_UP], [0.0, HALF_HEIGHT, 0.0], [0.0, -HALF_HEIGHT, 0.0]])
    along = np.array([[1.0, TO_SPRING, TO_BIRD - BEAK_BACK], [1.0, SLEEVE, 0.0], [1.0, SLEEVE, 0.0]])
    count = int(until / step + 0.5)
    heights, hits = np.empty(count + 1), [0.0]
    heights[0] = q[0]
    for k in range(count):
        middle = q + 0.5 * step * u
        twist = STIFFNESS * (middle[1] - middle[2])
        force = np.array(
            [
                -(MASS_SLEEVE + MASS_BIRD) * GRAVITY,
                -twist - MASS_BIRD * GRAVITY * TO_SPRING,
                twist - MASS_BIRD * GRAVITY * TO_BIRD,
            ]
        )
        free = u + step * inverse @ force
        gap = _gaps(middle)
        pressed, rubbed = np.zeros(3), np.zeros(3)
        new = free.copy()
        for _ in range(200 if gap.min() <= 0.0 else 0):
            before = new.copy()
            for i in range(3):
                if gap[i] > 0.0:
                    continue
                w, t = normal[i], along[i]
                wanted = w @ new + RESTITUTION[i] * (w @ u)
                change = max(pressed[i] - wanted / (w @ inverse @ w), 0.0) - pressed[i]
                pressed[i] += change
                new = new + inverse @ w * change
                limit = friction[i] * pressed[i]
                change = min(max(rubbed[i] - (t @ new) / (t @ inverse @ t), -limit), limit) - rubbed[i]
                rubbed[i] += change
                new = new + inverse @ t * change
            if np.max(np.abs(new - before)) < 1e-12:
                break
        if pressed[0] > 0.0 and (k * step - hits[-1]) > 0.02:
            hits.append(k * step)
        q = middle + 0.5 * step * new
        u = new
        heights[k + 1] = q[0]
    return heights, np.array(hits[1:])


def _motion(_: float, state: np.ndarray) -> np.ndarray:
    """Return the rate of the state without contact: x, y, both angles, and their rates."""
    first, second, w1, w2 = state[2], state[3], state[6], state[7]
    to_bird = np.array(
        [
            [1.0, 0.0, -TO_SPRING * np.sin(first), -TO_BIRD * np.sin(second)],
            [0.0, 1.0, TO_SPRING * np.cos(first), TO_BIRD * np.cos(second)],
        ]
    )
    inward = -TO_SPRING * w1**2 * np.array([np.cos(first), np.sin(first)])
    inward -= TO_BIRD * w2**2 * np.array([np.cos(second), np.sin(second)])
    mass = np.diag([MASS_SLEEVE, MASS_SLEEVE, INERTIA_SLEEVE, INERTIA_BIRD]) + MASS_BIRD * to_bird.T @ to_bird
    weight = np.array([0.0, -GRAVITY])
    force = MASS_BIRD * to_bird.T @ (weight - inward)
    force[:2] += MASS_SLEEVE * weight
    twist = STIFFNESS * (first - second)
    force += np.array([0.0, 0.0, -twist, twist])
    return np.concatenate([state[4:], np.linalg.solve(mass, force)])


EDGE = 0.1e-3  # [m] radius of the sleeve's edges


def _distances(_: float, state: np.ndarray) -> float:
    """Return the smallest distance of an edge of the sleeve or of the beak from the pole [m]."""
    x, first, second = state[0], state[2], state[3]
    found = []
    for side in (-1.0, 1.0):
        for end in (-1.0, 1.0):
            across = x + side * (SLEEVE + EDGE) * np.cos(first) - end * HALF_HEIGHT * np.sin(first)
            found.append(side * across - EDGE - POLE)
    beak = x + TO_SPRING * np.cos(first) + (TO_BIRD - BEAK_BACK + EDGE) * np.cos(second) - BEAK_UP * np.sin(second)
    return min(*found, beak - EDGE - POLE)


def first_contact(start: np.ndarray) -> tuple[float, float]:
    """Return time [s] and speed [m/s] of the first contact, from x, y, the angles of sleeve and bird, and their rates."""
    touch = lambda time, state: _distances(time, state)  # noqa: E731
    touch.terminal, touch.direction = True, -1.0  # type: ignore[attr-defined]
    found = solve_ivp(_motion, (0.0, 0.2), start, method="DOP853", rtol=1e-12, atol=1e-14, events=touch)
    time, state = float(found.t_events[0][0]), found.y_events[0][0]
    step = 1e-7
    ahead, behind = state + step * _motion(time, state), state - step * _motion(time, state)
    return time, float(_distances(time, behind) - _distances(time, ahead)) / (2.0 * step)
