"""Singular positions of a mechanism with ideal joints, along a path.

At a singular position the gradients of the closure equations are dependent: with fixed inputs the mechanism can move to first
order. It is a change point if branches of the assembly meet there, a locking position if the input cannot go further. At a
near change point branches come near each other without meeting.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from scissordyn.components.place import GROUND
from scissordyn.kinematics.closure import Closure
from scissordyn.plan.elimination import in_words
from scissordyn.warning import NAMES_MAX

CHANGE_KIND, LOCKING_KIND, NEAR_KIND = "change point", "locking position", "near change point"  # Kinds of singular positions


Places = tuple[float, float, float]  # Path parameter at the sample before a suspected position, near it and after it


@dataclass(frozen=True)
class SingularPosition:
    """Singular position of a mechanism on its path."""

    kind: str
    place: float  # Path parameter: value of the input [rad or m], or time [s]
    bodies: tuple[str, ...]  # Bodies that can move to first order with the inputs fixed, largest motion first
    joints: tuple[str, ...]  # Joints that turn in that motion
    # Distance between the branches of a near change point, in mechanism sizes
    miss: float = 0.0

    @property
    def subject(self) -> str:
        """Bodies and joints of the motion, for messages."""
        bodies = in_words([f"'{name}'" for name in self.bodies], NAMES_MAX) or "the mechanism"
        joints = in_words([f"'{name}'" for name in self.joints], NAMES_MAX)
        at = f" at joint{'s' if len(self.joints) > 1 else ''} {joints}" if joints else ""
        return f"{'bodies' if len(self.bodies) > 1 else 'body'} {bodies}{at}" if self.bodies else bodies


def measure(closure: Closure, z: np.ndarray, few_equations: int = 24) -> np.ndarray:
    """Return a measure of the independence of the closure equations' gradients, which is zero if they are dependent.

    The measure is the smallest singular value. With many equations it is the volume of the gradients as a fraction of the
    largest.

    Shapes: `z` (samples, nZ); returns (samples,).

    `few_equations`: largest number of equations with singular values at each sample; for more, a factorization is cheaper.
    """
    rows = closure.jacobian(z)
    if not rows.shape[1]:
        return np.ones(len(z))
    if rows.shape[1] <= few_equations:
        return np.asarray(np.linalg.svd(rows, compute_uv=False)[:, -1])
    # the square root of the Gram determinant is known to 1e-8 only, enough to choose samples
    if rows.shape[1] == rows.shape[2]:
        volume = np.linalg.slogdet(rows)[1]
    else:
        volume = 0.5 * np.linalg.slogdet(rows @ np.swapaxes(rows, -1, -2))[1]
    largest = np.max(volume)
    return np.exp(volume - largest) if np.isfinite(largest) else np.zeros(len(z))


def suspected_samples(volume: np.ndarray) -> list[int]:
    """Return the indices of samples near which the gradients may be dependent, from their `measure`."""
    if volume.size < 3:
        return list(range(volume.size))
    padded = np.concatenate([volume[1:2], volume, volume[-2:-1]])
    before, after = padded[:-2], padded[2:]
    least = (volume <= before) & (volume <= after)
    change = np.maximum(np.abs(before - volume), np.abs(after - volume))
    change[[0, -1]] = np.maximum(change[[0, -1]], change[[1, -2]])  # the zero may be between an end and its neighbour
    # a singular measure falls to zero linearly or faster, a minimum elsewhere is flat
    near = volume <= 1.5 * change
    low = volume <= 0.15 * np.median(volume)  # branches nearly meet at a smooth, low minimum
    low[[0, -1]] = False
    return np.flatnonzero(least & (near | low)).tolist()


def smallest(closure: Closure, z: np.ndarray) -> float:
    """Return the smallest singular value of the gradients at a position."""
    values = np.linalg.svd(closure.jacobian(z), compute_uv=False)
    return float(values[-1]) if values.size else 1.0


def locate(
    closure: Closure, position: Callable[[float], np.ndarray], places: Places, typical: float, zero: float = 1e-5
) -> float | None:
    """Return the path parameter between `places` at which the gradients are dependent; None if there is none.

    `zero`: ratio of a singular value to its typical value below which it counts as zero at a position interpolated on the path.
    """
    from scipy.optimize import minimize_scalar  # imported here: it takes a tenth of a second, and most runs do not need it

    # three pairs of singular vectors: a singular value may also fall to zero quadratically, without a change of sign
    for pair in range(1, 1 + min(3, closure.chosen.size)):
        crossing = _zero(closure, position, places, pair)
        if crossing is not None and smallest(closure, position(crossing)) < zero * typical:
            return crossing

    def value(place: float) -> float:
        return smallest(closure, position(place))

    low, _, high = places  # without a change of sign the minimum is searched
    result = minimize_scalar(value, bounds=(low, high), method="bounded", options={"xatol": 1e-8 * (high - low)})
    return float(result.x) if result.fun < zero * typical else None


def _zero(closure: Closure, position: Callable[[float], np.ndarray], places: Places, pair: int) -> float | None:
    """Return the zero of a smooth test function u^T Phi_y v, with u and v the `pair`-th last singular vectors nearby.

    It is the test function of a bordered matrix (Govaerts 2000, Numerical Methods for Bifurcations of Dynamical Equilibria,
    chapter 3).
    """
    from scipy.optimize import brentq

    low, zero, high = places
    width, bracketed = 0.5 * (high - low), False
    for distance in (0.0, 0.2, 0.1, 0.05):  # distance of the singular vectors from the last zero, in samples
        step = distance * width
        left, _, right = np.linalg.svd(closure.jacobian(position(zero + step)), full_matrices=False)
        u, v = left[:, -pair], right[-pair]

        def test(place: float, u: np.ndarray = u, v: np.ndarray = v) -> float:
            return float(u @ closure.jacobian(position(place)) @ v)

        if not bracketed:
            if not test(low) * test(high) <= 0.0:
                return None
            zero, bracketed = float(brentq(test, low, high, xtol=1e-4 * width)), True
            continue
        # a cubic through points around the position: at the position itself Newton's method is accurate to the root
        # of round-off only
        around = zero + step * np.array([-2.0, -1.0, 1.0, 2.0])
        roots = np.polynomial.Polynomial.fit(around, [test(place) for place in around], 3).roots().tolist()
        near = min((complex(root) for root in roots), key=lambda root: abs(root - zero), default=complex(zero))
        if abs(near - zero) > 2.0 * step:
            return None
        zero = near.real
    return zero


def moving_parts(
    closure: Closure, z: np.ndarray, typical: float, least: float = 0.2
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return the bodies that can move to first order at a singular position, and the joints that turn in that motion.

    Shapes: `z` (nZ,).

    `least`: amplitude, relative to the largest, above which a body or joint is named in the warning.
    """
    rows = closure.jacobian(z)
    _, values, right = np.linalg.svd(rows, full_matrices=False)
    loose = max(1, int(np.sum(values < max(1e-4 * typical, 2.0 * values[-1]))))  # number of zero singular values
    motion = closure.free @ right[len(values) - loose :].T
    speed: dict[str, np.ndarray] = {GROUND: np.zeros(loose)}
    size: dict[str, float] = {}
    for body in closure.plan.bodies:
        p = closure.first[body.name]
        speed[body.name] = np.zeros(loose)
        if closure.natural.rotates(body.name):
            (cos, sin), (dx, dy) = z[p + 2 : p + 4], motion[p + 2 : p + 4]
            speed[body.name] = cos * dy - sin * dx
        size[body.name] = float(np.sqrt(np.sum(motion[p : p + 2] ** 2) + np.sum(speed[body.name] ** 2)))
    most = max(size.values())
    bodies = [name for name, value in size.items() if value > least * most and np.any(speed[name])]
    bodies = bodies or [name for name, value in size.items() if value > least * most]
    turning = {
        joint.name: float(np.linalg.norm(speed[joint.bodies[0]] - speed[joint.bodies[1]]))
        for joint in closure.plan.mechanism.joints
    }
    largest = max(turning.values(), default=0.0)
    joints = [name for name, value in turning.items() if value > least * largest and largest > 0.0]
    return (
        tuple(sorted(bodies, key=lambda name: -round(size[name], 6))),
        tuple(sorted(joints, key=lambda name: -round(turning[name], 6))),
    )
