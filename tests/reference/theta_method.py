"""The theta method of Moreau and Jean at theta = 1/2 with projection of positions, as used for published records.

A step solves M (v+ - v) = h (F + F+)/2 + H^T P with q+ = q + h (v + v+)/2, and mass, forces F+ and gradients at the end
of the step, by Newton's method until the momentum balance holds within a tolerance. P follows from Newton's impact law
and Coulomb's law on the velocities of the active contacts. The variants differ in the choice of active contacts and in the
correction of positions: Acary 2013, doi:10.1016/j.cma.2012.12.012. Nothing of the package is used.
"""

import itertools
from collections.abc import Callable
from typing import Protocol

import numpy as np

__all__ = ["System", "by_enumeration", "combined", "direct", "free", "sweeps"]

Solver = Callable[[np.ndarray, np.ndarray, float], np.ndarray]
"""Function that returns impulses z from W, b and the friction coefficient; velocities are W z + b, normal and tangential."""


class System(Protocol):
    """A mechanism in its own coordinates."""

    friction: float
    restitution: np.ndarray

    def mass(self, q):
        """Return the mass matrix of the coordinates."""

    def force(self, time, q, v):
        """Return all forces that are not impulses, with terms of the velocities."""

    def slopes(self, time, q, v):
        """Return derivatives of the force by coordinates and velocities, as far as Newton's method uses them."""

    def gaps(self, q):
        """Return the gaps of all contacts [m]."""

    def gradients(self, q):
        """Return gradients of normal and tangential velocities of each contact in turn, shape (2 contacts, coordinates)."""


def by_enumeration(w, b, friction):
    """Return impulses by trying open, stick and both directions of sliding for every contact."""
    best, found = np.inf, np.zeros(len(b))
    for modes in itertools.product(range(4), repeat=len(b) // 2):
        left, right = np.eye(len(b)), np.zeros(len(b))
        for k, mode in enumerate(modes):
            n, t = 2 * k, 2 * k + 1
            if mode:
                left[n], right[n] = w[n], -b[n]
            if mode == 1:
                left[t], right[t] = w[t], -b[t]
            elif mode:
                left[t, n] = friction * (2 * mode - 5)
        try:
            z = np.linalg.solve(left, right)
        except np.linalg.LinAlgError:
            continue
        u, missed = w @ z + b, 0.0
        for k, mode in enumerate(modes):
            n, t = 2 * k, 2 * k + 1
            missed = max(missed, -z[n] if mode else -u[n])
            if mode == 1:
                missed = max(missed, abs(z[t]) - friction * z[n])
            elif mode:
                missed = max(missed, -u[t] * (2 * mode - 5))
        if missed < best:
            best, found = missed, z
        if best < 1e-13:
            break
    return found


def sweeps(tolerance, most=2000):
    """Return a solver by Gauss-Seidel iteration over contacts, which ends if the residual of the cone's projection is small."""

    def solve(w, b, friction):
        z = np.zeros(len(b))
        for _ in range(most):
            for n in range(0, len(b), 2):
                own = w[n : n + 2, n : n + 2]
                rest = b[n : n + 2] + w[n : n + 2] @ z - own @ z[n : n + 2]
                if rest[0] > 0.0:
                    z[n : n + 2] = 0.0
                    continue
                push, drag = np.linalg.solve(own, -rest)
                if abs(drag) > friction * push:
                    side = 1.0 if drag + friction * push >= 0.0 else -1.0
                    push = -rest[0] / (own[0, 0] + side * friction * own[0, 1])
                    drag = side * friction * push
                z[n], z[n + 1] = push, drag
            u = w @ z + b
            along = z[0::2] - u[0::2] - friction * np.abs(u[1::2])
            across = z[1::2] - u[1::2]
            inside, outside = np.abs(across) <= friction * along, friction * np.abs(across) <= -along
            edge = (friction * np.abs(across) + along) / (friction**2 + 1.0)
            push = np.where(outside, 0.0, np.where(inside, along, edge))
            drag = np.where(outside, 0.0, np.where(inside, across, friction * edge * np.sign(across)))
            if np.hypot(np.linalg.norm(z[0::2] - push), np.linalg.norm(z[1::2] - drag)) < tolerance * np.linalg.norm(b):
                break
        return z

    return solve


def _end(system, time, step, q, v, guess, active, approach, solver, tolerance):
    """Return coordinates and velocities at the end of a step, before positions are corrected; `guess` starts the velocities."""
    rows = np.sort(np.concatenate([2 * active, 2 * active + 1]))
    before = system.force(time, q, v)
    new, end = guess, q + 0.5 * step * (v + guess)

    def balance():
        return system.mass(end) @ (new - v) - 0.5 * step * (before + system.force(time + step, end, new))

    rest, impulse = balance(), np.zeros_like(v)
    for _ in range(50):
        by_place, by_speed = system.slopes(time + step, end, new)
        matrix = system.mass(end) - 0.5 * step * by_speed - 0.25 * step**2 * by_place
        new = new - np.linalg.solve(matrix, rest)
        if len(rows):
            gradients = system.gradients(end)[rows]
            wanted = gradients @ new
            wanted[0::2] += system.restitution[active] * approach[active]
            impulse = gradients.T @ solver(gradients @ np.linalg.solve(matrix, gradients.T), wanted, system.friction)
            new = new + np.linalg.solve(matrix, impulse)
        end = q + 0.5 * step * (v + new)
        rest = balance()
        if np.linalg.norm(rest - impulse) <= tolerance:
            break
    return end, new


def free(system, q, v, step, count):
    """Return states without projection; a contact is active if its gap would be closed half a step later."""
    kept = [np.concatenate([q, v])]
    for k in range(count):
        approach = (system.gradients(q) @ v)[0::2]
        active = np.flatnonzero(system.gaps(q) + 0.5 * step * approach <= 0.0)
        q, v = _end(system, k * step, step, q, v, v, active, approach, by_enumeration, 1e-6)
        kept.append(np.concatenate([q, v]))
    return np.array(kept)


def direct(system, q, v, step, count):
    """Return states with negative gaps projected onto zero after each step.

    A contact becomes active at a gap of 1 um, and inactive beyond 0.1 um when it opens; the records apply this rule twice.
    """
    kept, on = [np.concatenate([q, v])], np.zeros(len(system.restitution), bool)
    for k in range(count):
        gaps, approach = system.gaps(q), (system.gradients(q) @ v)[0::2]
        for _ in range(2):
            on = np.where(on, (gaps <= 1e-7) | (approach < 0.0), gaps <= 1e-6)
        q, v = _end(system, k * step, step, q, v, v, np.flatnonzero(on), approach, by_enumeration, 1e-6)
        for _ in range(10):
            if system.gaps(q).min() >= -1e-10:
                break
            normals = system.gradients(q)[0::2]
            q = q + normals.T @ _complementary(normals @ normals.T, system.gaps(q))
        kept.append(np.concatenate([q, v]))
    return np.array(kept)


def _complementary(w, b):
    """Return the solution z of 0 <= W z + b, z >= 0, z (W z + b) = 0 with the fewest contacts."""
    for chosen in sorted(itertools.product((False, True), repeat=len(b)), key=sum):
        on, z = np.array(chosen), np.zeros(len(b))
        if on.any():
            inner = w[np.ix_(on, on)]
            if np.linalg.cond(inner) > 1e12:
                continue
            z[on] = np.linalg.solve(inner, -b[on])
        if z.min() >= 0.0 and (w @ z + b).min() >= -1e-16:
            return z
    raise ValueError("no solution")


def combined(system, q, v, step, count, solver, tolerance=1e-6):
    """Return states with contacts added to a step until none closes; active gaps are projected onto zero.

    A gap that is closed at the start makes a contact active for the step; the step is solved again with each added contact. The
    tolerance [m] ends the projection.
    """
    kept = [np.concatenate([q, v])]
    for k in range(count):
        begin, before, gaps = q, v, system.gaps(q)
        on = np.zeros(len(gaps), bool)
        while True:
            on = on | (gaps <= 0.0)
            active = np.flatnonzero(on)
            approach = (system.gradients(begin) @ before)[0::2]
            q, v = _end(system, k * step, step, begin, before, v, active, approach, solver, tolerance)
            gaps = system.gaps(q)
            for _ in range(2000 if len(active) else 0):
                if np.abs(system.gaps(q)[active]).max() < tolerance:
                    break
                normals = system.gradients(q)[2 * active]
                q = q - normals.T @ np.linalg.solve(normals @ normals.T, system.gaps(q)[active])
            gaps[active] = system.gaps(q)[active]
            if not (~on & (gaps <= 0.0)).any():
                break
        kept.append(np.concatenate([q, v]))
    return np.array(kept)
