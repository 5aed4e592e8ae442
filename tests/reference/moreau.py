"""Hard contact: Moreau's time stepping for a slider-crank whose slider is a block in a channel with clearance.

Coordinates are the directions of crank, rod and slider, measured from the line of the guide; all three are free. Contacts are
unilateral constraints with Newton's impact law and Coulomb friction on the velocities of a step; no compliance, no event.
First order in the step. Formulation of Flores, Leine and Glocker 2010, doi:10.1007/s11044-009-9178-y.
"""

from typing import NamedTuple

import numpy as np
from numba import njit

__all__ = ["SliderCrank", "corner", "impulses", "march", "matrices"]


class SliderCrank(NamedTuple):
    """Lengths [m], masses [kg], inertias about mass centres [kg m^2], half sizes of the block, and gap on each side [m]."""

    crank: float = 0.153
    rod: float = 0.306
    crank_mass: float = 0.038
    rod_mass: float = 0.038
    slider_mass: float = 0.076
    crank_inertia: float = 7.4e-5
    rod_inertia: float = 5.9e-4
    slider_inertia: float = 2.7e-6
    half_length: float = 0.05
    half_width: float = 0.025
    gap: float = 1e-3
    gravity: float = 9.81
    restitution: float = 0.4
    friction: float = 0.01


ALONG = (-1.0, 1.0, -1.0, 1.0)  # Signs of the four corners along the guide
ACROSS = (1.0, 1.0, -1.0, -1.0)  # Signs of the four corners across the guide: two at the upper surface, two at the lower one


@njit
def matrices(p, q, u):
    m = np.zeros((3, 3))
    one = 0.25 * p.crank_mass + p.rod_mass + p.slider_mass
    both = (0.5 * p.rod_mass + p.slider_mass) * p.crank * p.rod
    m[0, 0] = p.crank_inertia + one * p.crank**2
    m[1, 1] = p.rod_inertia + (0.25 * p.rod_mass + p.slider_mass) * p.rod**2
    m[0, 1] = m[1, 0] = both * np.cos(q[0] - q[1])
    m[2, 2] = p.slider_inertia
    sine = both * np.sin(q[0] - q[1])
    h = np.array(
        [
            -sine * u[1] ** 2 - (0.5 * p.crank_mass + p.rod_mass + p.slider_mass) * p.gravity * p.crank * np.cos(q[0]),
            sine * u[0] ** 2 - (0.5 * p.rod_mass + p.slider_mass) * p.gravity * p.rod * np.cos(q[1]),
            0.0,
        ]
    )
    return m, h


@njit
def corner(p, q, k):
    """Return the gap of a corner and the directions of its normal and tangential velocity."""
    along, across = ALONG[k] * p.half_length, ACROSS[k] * p.half_width
    c, s = np.cos(q[2]), np.sin(q[2])
    height = p.crank * np.sin(q[0]) + p.rod * np.sin(q[1]) + s * along + c * across
    gap = p.half_width + p.gap - ACROSS[k] * height
    normal = -ACROSS[k] * np.array([p.crank * np.cos(q[0]), p.rod * np.cos(q[1]), c * along - s * across])
    tangent = np.array([-p.crank * np.sin(q[0]), -p.rod * np.sin(q[1]), -s * along - c * across])
    return gap, normal, tangent


@njit
def impulses(p, u, free, inverse, active, normals, tangents, most, accuracy):
    """Return the velocities after a step by Newton's and Coulomb's laws, with Gauss-Seidel iteration.

    `u` and `free` are the velocities before the step, and after it without contacts. `normals` and `tangents`, shape (4, 3),
    are directions at the corners. The iteration ends after `most` rounds, or with changes of less than `accuracy` [m/s].
    """
    new = free.copy()
    push, drag = np.zeros(4), np.zeros(4)
    for _ in range(most):
        change = 0.0
        for k in range(4):
            if not active[k]:
                continue
            n, t = normals[k], tangents[k]
            mass_n = n @ (inverse @ n)
            wanted = max(push[k] - (n @ new + p.restitution * (n @ u)) / mass_n, 0.0)
            new = new + inverse @ n * (wanted - push[k])
            change = max(change, abs(wanted - push[k]) * mass_n)
            push[k] = wanted
            mass_t = t @ (inverse @ t)
            if mass_t > 1e-12:
                limit = p.friction * push[k]
                wanted = min(max(drag[k] - (t @ new) / mass_t, -limit), limit)
                new = new + inverse @ t * (wanted - drag[k])
                change = max(change, abs(wanted - drag[k]) * mass_t)
                drag[k] = wanted
        if change < accuracy:
            break
    return new


@njit
def march(p, q, u, until, step, every):
    """Return the state at every `every`-th step, and the number of contact onsets of each corner."""
    steps = int(np.round(until / step))
    kept = np.empty((steps // every + 1, 6))
    kept[0, :3], kept[0, 3:] = q, u
    touching = np.zeros(4, np.bool_)
    starts = np.zeros(4, np.int64)
    for i in range(1, steps + 1):
        middle = q + 0.5 * step * u
        m, h = matrices(p, middle, u)
        inverse = np.linalg.inv(m)
        free = u + inverse @ (h * step)
        active = np.zeros(4, np.bool_)
        normals, tangents = np.zeros((4, 3)), np.zeros((4, 3))
        for k in range(4):
            gap, n, t = corner(p, middle, k)
            normals[k], tangents[k] = n, t
            active[k] = gap <= 0.0
            if active[k] and not touching[k]:
                starts[k] += 1
            touching[k] = active[k]
        u = impulses(p, u, free, inverse, active, normals, tangents, 2000, 1e-13) if active.any() else free
        q = middle + 0.5 * step * u
        if i % every == 0:
            kept[i // every, :3], kept[i // every, 3:] = q, u
    return kept, starts
