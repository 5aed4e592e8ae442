"""Newton's and Euler's equations of every bar of a rigid scissor array with ideal pins, solved for pin forces and torque."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

Plane = np.ndarray  # Two components


@dataclass(frozen=True)
class Scissor:
    """Straight array of equal bars; unit 1/bar 1 is pinned to the ground at O and driven, A slides along y at x = 0."""

    units: int
    length: float
    mass: float
    slider: float
    payload: float  # At the end of bar 1 of the last unit
    gravity: tuple[float, float]

    def points(self) -> dict[str, tuple[float, float]]:
        """Return the coefficients of (u1, u2) of each pin: u1 = (cos, sin), u2 = (cos, -sin) of the deployment angle."""
        half, points = 0.5 * self.length, {"O": (0.0, 0.0), "A": (0.5 * self.length, -0.5 * self.length)}
        for i in range(1, self.units + 1):
            points[f"unit {i}/pivot"] = half * i, half * (i - 1)
            points[f"unit {i}/upper"] = half * (i + 1), half * (i - 1)
            points[f"unit {i}/lower"] = half * i, half * i
        return points

    def bars(self) -> Iterator[tuple[str, list[tuple[str, int]]]]:
        """Yield the centre of each bar and its pins, with the sign of each pin force on it."""
        for i in range(1, self.units + 1):
            last = i == self.units
            before = [("O", 1), ("A", 1)] if i == 1 else [(f"unit {i - 1}/lower", -1), (f"unit {i - 1}/upper", -1)]
            for start, end, sign in ((before[0], "upper", 1), (before[1], "lower", -1)):
                pins = [start, (f"unit {i}/pivot", sign)]
                yield f"unit {i}/pivot", pins if last else [*pins, (f"unit {i}/{end}", 1)]

    def inertia(self, angle: float) -> float:
        """Return the inertia about the driven bar [kg m^2]: twice the kinetic energy over its squared angular velocity."""
        points = self.points()
        slope = {name: self._place(at, angle, 1) for name, at in points.items()}
        total = 2 * self.units * self.mass * self.length**2 / 12.0 + self.slider * slope["A"] @ slope["A"]
        total += self.payload * slope[f"unit {self.units}/upper"] @ slope[f"unit {self.units}/upper"]
        return float(total + sum(self.mass * slope[centre] @ slope[centre] for centre, _ in self.bars()))

    def forces(self, angle: float, speed: float, acceleration: float) -> tuple[dict[str, float], float]:
        """Return the size of the force of each pin [N] and the driving torque [N m]."""
        points, weight = self.points(), np.array(self.gravity)
        tip = f"unit {self.units}/upper"
        pins = [name for name in points if name not in (tip, f"unit {self.units}/lower")]
        rows: list[np.ndarray] = []
        right: list[float] = []
        size = 2 * len(pins) + 2  # with the guide's force and the torque
        for number, (centre, held) in enumerate(self.bars()):
            middle, block, turn = self._place(points[centre], angle, 0), np.zeros((3, size)), 1 - 2 * (number % 2)
            for name, sign in held:
                at = 2 * pins.index(name)
                arm = self._place(points[name], angle, 0) - middle
                block[0, at] = block[1, at + 1] = sign
                block[2, at : at + 2] = -sign * arm[1], sign * arm[0]
            inertial = self.mass * (self._accelerated(points[centre], angle, speed, acceleration) - weight)
            moment = turn * acceleration * self.mass * self.length**2 / 12.0
            if number == 2 * self.units - 2:
                load = self.payload * (self._accelerated(points[tip], angle, speed, acceleration) - weight)
                arm = self._place(points[tip], angle, 0) - middle
                inertial, moment = inertial + load, moment + arm[0] * load[1] - arm[1] * load[0]
            if number == 0:
                block[2, -1] = 1.0
            rows += list(block)
            right += [*inertial.tolist(), moment]
        block = np.zeros((2, size))
        block[0, 2 * pins.index("A")] = block[1, 2 * pins.index("A") + 1] = -1.0
        block[0, -2] = 1.0
        rows += list(block)
        right += (self.slider * (self._accelerated(points["A"], angle, speed, acceleration) - weight)).tolist()
        solution = np.linalg.solve(np.array(rows), np.array(right))
        sizes = np.linalg.norm(solution[:-2].reshape(-1, 2), axis=1)
        return dict(zip(pins, sizes.tolist(), strict=True)), float(solution[-1])

    @staticmethod
    def _place(at: tuple[float, float], angle: float, derivative: int) -> Plane:
        """Return a position, or a derivative of it by the angle."""
        c, s = np.cos(angle + 0.5 * np.pi * derivative), np.sin(angle + 0.5 * np.pi * derivative)
        return np.array([(at[0] + at[1]) * c, (at[0] - at[1]) * s])

    def _accelerated(self, at: tuple[float, float], angle: float, speed: float, acceleration: float) -> Plane:
        return self._place(at, angle, 1) * acceleration + self._place(at, angle, 2) * speed**2


def cycloidal(start, end, duration, t):
    """Return angle, angular velocity and angular acceleration of a move from rest to rest."""
    turn, phase = end - start, 2.0 * np.pi * min(t / duration, 1.0)
    if t >= duration:
        return end, 0.0, 0.0
    whole = turn / duration
    return (
        start + turn * (t / duration - np.sin(phase) / (2.0 * np.pi)),
        whole * (1.0 - np.cos(phase)),
        2.0 * np.pi * whole / duration * float(np.sin(phase)),
    )
