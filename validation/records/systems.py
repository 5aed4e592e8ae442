"""Three mechanisms of the records, in the records' coordinates."""

from __future__ import annotations

import math

import numpy as np

from reference import moreau, woodpecker
from validation.controlled_four_bar.steering import law

__all__ = ["FourBar", "SliderCrank", "Woodpecker"]


class SliderCrank:
    """Directions of crank, rod and slider, with four corners of the slider in its guide; the record starts without rotation."""

    model = moreau.SliderCrank()
    friction = model.friction
    restitution = np.full(4, model.restitution)
    start = (np.zeros(3), np.array([150.0, -75.0, 0.0]))

    def mass(self, q: np.ndarray) -> np.ndarray:
        """Return the mass matrix of the directions."""
        return moreau.matrices.py_func(self.model, q, np.zeros(3))[0]

    def force(self, _: float, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Return weights and terms of the velocities."""
        return moreau.matrices.py_func(self.model, q, v)[1]

    def slopes(self, _: float, q: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the derivatives of the force by coordinates and velocities."""
        p = self.model
        both = (0.5 * p.rod_mass + p.slider_mass) * p.crank * p.rod
        sine, cosine = both * math.sin(q[0] - q[1]), both * math.cos(q[0] - q[1])
        by_place, by_speed = np.zeros((3, 3)), np.zeros((3, 3))
        by_place[0, :2] = np.array([-1.0, 1.0]) * cosine * v[1] ** 2
        by_place[1, :2] = np.array([1.0, -1.0]) * cosine * v[0] ** 2
        by_place[0, 0] += (0.5 * p.crank_mass + p.rod_mass + p.slider_mass) * p.gravity * p.crank * math.sin(q[0])
        by_place[1, 1] += (0.5 * p.rod_mass + p.slider_mass) * p.gravity * p.rod * math.sin(q[1])
        by_speed[0, 1], by_speed[1, 0] = -2.0 * sine * v[1], 2.0 * sine * v[0]
        return by_place, by_speed

    def gaps(self, q: np.ndarray) -> np.ndarray:
        """Return the gaps of the corners [m]."""
        return np.array([moreau.corner.py_func(self.model, q, k)[0] for k in range(4)])

    def gradients(self, q: np.ndarray) -> np.ndarray:
        """Return the gradients of the corners' gaps."""
        return np.array([row for k in range(4) for row in moreau.corner.py_func(self.model, q, k)[1:]])


class Woodpecker:
    """Height and rotation of the sleeve, rotation of the bird, small angles; contacts of the beak and the sleeve's edges."""

    friction = 0.3
    restitution = woodpecker.RESTITUTION
    start = (np.array([0.0, -0.1036, -0.2788]), np.array([-0.3411, 4.8572e-15, -7.4583]))

    def mass(self, _: np.ndarray) -> np.ndarray:
        """Return the mass matrix of the coordinates."""
        one, arms = woodpecker.MASS_BIRD, np.array([1.0, woodpecker.TO_SPRING, woodpecker.TO_BIRD])
        own = np.diag([woodpecker.MASS_SLEEVE, woodpecker.INERTIA_SLEEVE, woodpecker.INERTIA_BIRD])
        return own + one * np.outer(arms, arms)

    def force(self, _: float, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Return weights and the spring's force."""
        weight = self.mass(q)[0] * woodpecker.GRAVITY
        return self.slopes(0.0, q, v)[0] @ q - weight

    def slopes(self, _: float, q: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the derivatives of the spring's force."""
        by_place = np.zeros((3, 3))
        by_place[1:, 1:] = woodpecker.STIFFNESS * np.array([[-1.0, 1.0], [1.0, -1.0]])
        return by_place, np.zeros((3, 3))

    def gaps(self, q: np.ndarray) -> np.ndarray:
        """Return the gaps of beak, lower and upper edge [m]."""
        return woodpecker._gaps.py_func(q)

    def gradients(self, _: np.ndarray) -> np.ndarray:
        """Return the gradients of these gaps."""
        high, up, over = woodpecker.HALF_HEIGHT, woodpecker.BEAK_UP, woodpecker.SLEEVE
        beak = [1.0, woodpecker.TO_SPRING, woodpecker.TO_BIRD - woodpecker.BEAK_BACK]
        edge = [1.0, over, 0.0]
        return np.array([[0.0, 0.0, -up], beak, [0.0, high, 0.0], edge, [0.0, -high, 0.0], edge])


class FourBar:
    """Angles of crank, coupler and rocker, mass centres of the last two; the rocker's x is measured from its ground pin."""

    friction = 0.1
    restitution = np.zeros(3)
    crank, coupler, rocker, ground = 1.0, 4.0, 2.5, 3.0
    clearance, journal, bearing, gravity = 5e-3, 55e-3, 60e-3, 9.81
    start = (
        np.array(
            [
                1.570823772407980,
                0.3532842020624460,
                1.264872058968431,
                1.876454585097650,
                1.691962091335582,
                0.3764686197082958,
                1.191962183453451,
            ]
        ),
        np.zeros(7),
    )

    def mass(self, _: np.ndarray) -> np.ndarray:
        """Return the mass matrix; each bar has 1 kg."""
        return np.diag([self.crank**2 / 3.0, self.coupler**2 / 12.0, self.rocker**2 / 12.0, 1.0, 1.0, 1.0, 1.0])

    def force(self, time: float, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Return weights and the torque on the crank."""
        phase, rate = 0.75 * math.pi * time, 0.75 * math.pi
        wanted = 6.0 * math.sin(phase)
        given = law(wanted, 6.0 * rate * math.cos(phase), -wanted * rate**2, wanted - q[0], v[0], 200.0, 10.0)
        weight = -0.5 * self.crank * self.gravity * math.cos(q[0])
        return np.array([given + weight, 0.0, 0.0, 0.0, -self.gravity, 0.0, -self.gravity])

    def slopes(self, _: float, q: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the derivatives of the weights; the record's model omits those of the torque."""
        by_place = np.zeros((7, 7))
        by_place[0, 0] = 0.5 * self.crank * self.gravity * math.sin(q[0])
        return by_place, np.zeros((7, 7))

    def offsets(self, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return offsets of the bearings from the other centre [m] and their gradients, by joint."""
        c, s = np.cos(q[:3]), np.sin(q[:3])
        arms = np.array([self.crank, 0.5 * self.coupler, 0.5 * self.rocker])
        x, y = arms * c, arms * s
        turned = np.array([-y, x])
        places = np.array(
            [
                [q[3] - x[1] - x[0], q[4] - y[1] - y[0]],
                [self.ground + q[5] + x[2] - x[1] - q[3], q[6] + y[2] - y[1] - q[4]],
                [q[5] - x[2], q[6] - y[2]],
            ]
        )
        slopes = np.zeros((3, 2, 7))
        slopes[0, :, 0], slopes[0, :, 1] = -turned[:, 0], -turned[:, 1]
        slopes[1, :, 1], slopes[1, :, 2], slopes[2, :, 2] = -turned[:, 1], turned[:, 2], -turned[:, 2]
        slopes[0, :, 3:5], slopes[1, :, 3:5] = np.eye(2), -np.eye(2)
        slopes[1, :, 5:], slopes[2, :, 5:] = np.eye(2), np.eye(2)
        return places, slopes

    def gaps(self, q: np.ndarray) -> np.ndarray:
        """Return the gaps of crank pin, rocker pin and rocker bearing [m]."""
        return self.clearance - np.hypot(*self.offsets(q)[0].T)

    def gradients(self, q: np.ndarray) -> np.ndarray:
        """Return the gradients of the three joints' gaps; journals turn with crank, coupler and rocker."""
        rows = []
        for k, (place, slope) in enumerate(zip(*self.offsets(q), strict=True)):
            x, y = place / np.hypot(*place)
            surface = np.zeros(7)
            surface[k] = -self.journal
            if k < 2:
                surface[k + 1] = self.bearing
            rows += [-np.array([x, y]) @ slope, np.array([y, -x]) @ slope + surface]
        return np.array(rows)
