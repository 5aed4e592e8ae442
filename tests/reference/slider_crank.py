"""A slider-crank with clearance at the pin between rod and slider, in minimal coordinates."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from reference.marching import ClearanceJoint, Load, Minimal, Relative


@dataclass(frozen=True)
class SliderCrank(Minimal):
    """Crank at constant speed, rod, and slider on the x axis, without gravity.

    The journal is the end of the rod. The coordinates are its position (e_x, e_y) in the slider's bearing, from which the rod's
    direction b follows: r sin a + l sin b = e_y.
    """

    joint: ClearanceJoint
    speed: float  # Of the crank [rad/s]
    crank: float = 0.05  # r [m]
    rod: float = 0.12  # l [m]
    rod_mass: float = 0.21
    rod_inertia: float = 2.5e-4  # About the rod's middle, where its mass centre is [kg m^2]
    slider_mass: float = 0.14
    crank_inertia: float = 0.0

    def rod_motion(self, t: float, q: np.ndarray, v: np.ndarray) -> tuple[float, float, float]:
        """Return crank angle, rod angle and its rate."""
        a = self.speed * t
        b = math.asin((float(q[1]) - self.crank * math.sin(a)) / self.rod)
        return a, b, (float(v[1]) - self.crank * self.speed * math.cos(a)) / (self.rod * math.cos(b))

    def relative(self, t: float, q: np.ndarray, v: np.ndarray) -> list[Relative]:
        """Return the position of the journal in its bearing."""
        return [Relative(*q.tolist(), *v.tolist(), self.rod_motion(t, q, v)[2], 0.0)]

    def accelerate(self, t: float, q: np.ndarray, v: np.ndarray, loads: Sequence[Load]) -> tuple[np.ndarray, float, float]:
        """Return e'', the drive torque and its power."""
        load, r, rod, w = loads[0], self.crank, self.rod, self.speed
        a, b, turn = self.rod_motion(t, q, v)
        pin_x, pin_y = -r * w**2 * math.cos(a), -r * w**2 * math.sin(a)  # acceleration of the crank pin
        middle = 0.5 * rod
        inertia = self.rod_inertia + self.rod_mass * middle**2
        moment = rod * (math.cos(b) * load.fy - math.sin(b) * load.fx) + load.journal_moment
        moment -= self.rod_mass * middle * (math.cos(b) * pin_y - math.sin(b) * pin_x)
        turning = moment / inertia
        end_x = pin_x - rod * (math.sin(b) * turning + math.cos(b) * turn**2)
        end_y = pin_y + rod * (math.cos(b) * turning - math.sin(b) * turn**2)
        # the crank pin carries what the rod's mass centre needs beyond the contact
        force_x = self.rod_mass * 0.5 * (pin_x + end_x) - load.fx
        force_y = self.rod_mass * 0.5 * (pin_y + end_y) - load.fy
        torque = r * (math.cos(a) * force_y - math.sin(a) * force_x)
        return np.array([end_x + load.fx / self.slider_mass, end_y]), torque, torque * w

    def energy(self, t: float, q: np.ndarray, v: np.ndarray) -> float:
        r, rod, w = self.crank, self.rod, self.speed
        a, b, turn = self.rod_motion(t, q, v)
        middle_x = -r * w * math.sin(a) - 0.5 * rod * turn * math.sin(b)
        middle_y = r * w * math.cos(a) + 0.5 * rod * turn * math.cos(b)
        slide = -r * w * math.sin(a) - rod * turn * math.sin(b) - float(v[0])
        turning = self.rod_inertia * turn**2 + self.crank_inertia * w**2
        return 0.5 * (self.rod_mass * (middle_x**2 + middle_y**2) + turning + self.slider_mass * slide**2)
