"""Singular positions of a mechanism with ideal joints, on a path of positions.

At a singular position the gradients of the closure equations are dependent: with the inputs fixed the mechanism can move to
first order. Either branches of the assembly meet there (a change point), or the input can go no further (a locking position).
Branches can also come near each other without meeting (a near change point).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from scissordyn.components.place import GROUND
from scissordyn.kinematics.closure import Closure
from scissordyn.plan.elimination import in_words

CHANGE, LOCKING, NEAR = "change point", "locking position", "near change point"

STEEP = 1.5
"""Where gradients become dependent the measure falls to zero linearly or faster: at the nearest sample it is below this
multiple of its change to a neighbour. Elsewhere it is level to first order at a minimum."""

LOW = 0.15  # Where branches nearly meet, the measure has a smooth minimum below this multiple of its median

FEW = 24
"""Up to so many equations singular values are computed at every sample; beyond it a factorization is many times cheaper."""

DISTANCES = (0.0, 0.2, 0.1, 0.05)
"""Singular vectors are taken so far from the zero found before, in samples; the error is the square of that at first."""

AROUND = np.array([-2.0, -1.0, 1.0, 2.0])
"""A cubic through the test function at these multiples of the distance has its zero at the singular position."""

DEPENDENT = 1e-4  # Singular values below this fraction of the typical smallest one count as zero at a located singular position

PAIRS = 3
"""So many pairs of singular vectors are tried: a singular value may fall to zero with its square, without a change of sign."""

ZERO = 1e-5  # Likewise, where the place is known as well as the interpolated positions on the path

Places = tuple[float, float, float]

CONCERNED = 0.2  # Bodies that move by more than this fraction of the largest amplitude in the first-order motion are named
NAMED = 3  # So many bodies and joints are named


@dataclass(frozen=True)
class SingularPosition:
    kind: str
    place: float  # Where on the path: value of the input [rad or m], or time [s]
    bodies: tuple[str, ...]  # Bodies that can move there to first order with the inputs fixed, those that move most first
    joints: tuple[str, ...]  # Joints that turn in that motion
    # By how much the branches of a near change point miss each other, in lengths as a fraction of the mechanism's size
    miss: float = 0.0

    @property
    def subject(self) -> str:
        """Bodies and joints in words."""
        bodies = in_words([f"'{name}'" for name in self.bodies], NAMED) or "the mechanism"
        joints = in_words([f"'{name}'" for name in self.joints], NAMED)
        at = f" at joint{'s' if len(self.joints) > 1 else ''} {joints}" if joints else ""
        return f"{'bodies' if len(self.bodies) > 1 else 'body'} {bodies}{at}" if self.bodies else bodies


def measure(closure: Closure, z: np.ndarray) -> np.ndarray:
    """How far the gradients of the closure equations are from dependent at some positions: zero where they are.

    That is the smallest singular value, or with many equations the volume as a fraction of the largest one.

    Shapes: `z` (samples, nZ); returns (samples,).
    """
    rows = closure.jacobian(z)
    if not rows.shape[1]:
        return np.ones(len(z))
    if rows.shape[1] <= FEW:
        return np.asarray(np.linalg.svd(rows, compute_uv=False)[:, -1])
    # the square root of the Gram determinant is known to 1e-8 only, enough to choose where to look
    if rows.shape[1] == rows.shape[2]:
        volume = np.linalg.slogdet(rows)[1]
    else:
        volume = 0.5 * np.linalg.slogdet(rows @ np.swapaxes(rows, -1, -2))[1]
    largest = np.max(volume)
    return np.exp(volume - largest) if np.isfinite(largest) else np.zeros(len(z))


def suspects(volume: np.ndarray) -> list[int]:
    """Samples next to which the gradients may be dependent."""
    if volume.size < 3:
        return list(range(volume.size))
    padded = np.concatenate([volume[1:2], volume, volume[-2:-1]])
    before, after = padded[:-2], padded[2:]
    least = (volume <= before) & (volume <= after)
    change = np.maximum(np.abs(before - volume), np.abs(after - volume))
    change[[0, -1]] = np.maximum(change[[0, -1]], change[[1, -2]])  # the zero may be between an end and its neighbour
    near = volume <= STEEP * change
    low = volume <= LOW * np.median(volume)
    low[[0, -1]] = False
    return np.flatnonzero(least & (near | low)).tolist()


def smallest(closure: Closure, z: np.ndarray) -> float:
    """Smallest singular value of the gradients at a position."""
    values = np.linalg.svd(closure.jacobian(z), compute_uv=False)
    return float(values[-1]) if values.size else 1.0


def locate(closure: Closure, position: Callable[[float], np.ndarray], places: Places, typical: float) -> float | None:
    """Where between neighbouring places on a path the gradients are dependent; None if nowhere."""
    from scipy.optimize import minimize_scalar  # a tenth of a second that most runs need not wait for

    for pair in range(1, 1 + min(PAIRS, closure.chosen.size)):
        crossing = _zero(closure, position, places, pair)
        if crossing is not None and smallest(closure, position(crossing)) < ZERO * typical:
            return crossing

    def value(place: float) -> float:
        return smallest(closure, position(place))

    low, _, high = places  # without a change of sign only the minimum is left
    result = minimize_scalar(value, bounds=(low, high), method="bounded", options={"xatol": 1e-8 * (high - low)})
    return float(result.x) if result.fun < ZERO * typical else None


def _zero(closure: Closure, position: Callable[[float], np.ndarray], places: Places, pair: int) -> float | None:
    """The zero of a smooth test function u^T Phi_y v, with u and v the `pair`-th last singular vectors near by.

    It is the test function of a bordered matrix (Govaerts 2000, Numerical
    Methods for Bifurcations of Dynamical Equilibria, chapter 3).
    """
    from scipy.optimize import brentq

    low, zero, high = places
    width, bracketed = 0.5 * (high - low), False
    for distance in DISTANCES:
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
        # at the singular position itself Newton's method leaves errors of the size of the root of round-off
        around = zero + step * AROUND
        roots = np.polynomial.Polynomial.fit(around, [test(place) for place in around], 3).roots().tolist()
        near = min((complex(root) for root in roots), key=lambda root: abs(root - zero), default=complex(zero))
        if abs(near - zero) > 2.0 * step:
            return None
        zero = near.real
    return zero


def concerned(closure: Closure, z: np.ndarray, typical: float) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """The bodies that can move at a singular position to first order, and the joints that turn in that motion.

    Shapes: `z` (nZ,).
    """
    rows = closure.jacobian(z)
    _, values, right = np.linalg.svd(rows, full_matrices=False)
    loose = max(1, int(np.sum(values < max(DEPENDENT * typical, 2.0 * values[-1]))))
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
    bodies = [name for name, value in size.items() if value > CONCERNED * most and np.any(speed[name])]
    bodies = bodies or [name for name, value in size.items() if value > CONCERNED * most]
    turning = {
        joint.name: float(np.linalg.norm(speed[joint.bodies[0]] - speed[joint.bodies[1]]))
        for joint in closure.plan.mechanism.joints
    }
    largest = max(turning.values(), default=0.0)
    joints = [name for name, value in turning.items() if value > CONCERNED * largest and largest > 0.0]
    return (
        tuple(sorted(bodies, key=lambda name: -round(size[name], 6))),
        tuple(sorted(joints, key=lambda name: -round(turning[name], 6))),
    )
