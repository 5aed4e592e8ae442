"""Cam with a given profile against a roller or an edge."""

from __future__ import annotations

import math
from typing import Annotated

import numpy as np

from scissordyn.components.curve import check_curve
from scissordyn.components.declaration import component
from scissordyn.components.place import BodyPoint, Point
from scissordyn.components.port import FRAME, Output
from scissordyn.components.port.stroke import arc
from scissordyn.components.stop import START_DEPTH_FRACTION, Exponent, Restitution, push, stop_damping
from scissordyn.errors import InputError
from scissordyn.interpolation import periodic_spline
from scissordyn.kernel import kernel
from scissordyn.units import Meaning, Pairs, Quantity

# Units and help text of a cam's profile
PROFILE = Pairs(("angles", "radii"), ("rad", "m"), help="radius of the cam over the angle from its body's x axis, a whole turn")


PITCH_NODES = 720  # Number of nodes of a cam's pitch curve in the table of the kernels
PROFILE_POINTS = 5760  # Number of points of a cam's profile from which the pitch curve is computed


@kernel
def pitch_at(angle, table, count):
    """Return the radius of the pitch curve in a direction [m], and its first two derivatives by the angle."""
    step = math.tau / count
    part = angle / step
    part = part - count * math.floor(part / count)
    low = min(int(part), count - 1)
    high = low + 1 if low + 1 < count else 0
    t = part - low
    a, b = 4 + 2 * low, 4 + 2 * high  # the nodes follow the scalar parameters
    # cubic Hermite polynomial through the nodes of a spline, whose second derivative is continuous
    y, z, p, q = table[a], table[b], step * table[a + 1], step * table[b + 1]
    c, d = 3.0 * (z - y) - 2.0 * p - q, 2.0 * (y - z) + p + q
    return y + t * (p + t * (c + t * d)), (p + t * (2.0 * c + 3.0 * t * d)) / step, (2.0 * c + 6.0 * t * d) / (step * step)


@kernel
def depth_at(x, y, table, count):
    """Return the depth of a point inside the pitch curve [m], and its derivatives by the point's coordinates."""
    radius = math.sqrt(x * x + y * y)
    R, slope, bend = pitch_at(math.atan2(y, x), table, count)
    # (R - r) cos(a) with the pressure angle a of the curve through the point: the distance to first order
    inside, square = R - radius, radius * radius + slope * slope
    cos = radius / math.sqrt(square)
    cubed = square * math.sqrt(square)
    along = -cos + inside * slope * slope / cubed
    across = slope * cos / radius - inside * slope * bend / cubed
    return inside * cos, (along * x - across * y) / radius, (along * y + across * x) / radius


@kernel
def gap(x, y, angle, x_rate, y_rate, speed, mode, approach_speed, effective_mass, stiffness, exponent, damping, count, table):
    """Return the follower's depth in the cam [m] and its rate [m/s]."""
    depth, gx, gy = depth_at(x, y, table, int(count))
    return depth, gx * x_rate + gy * y_rate


@kernel
def force(x, y, angle, x_rate, y_rate, speed, mode, approach_speed, effective_mass, stiffness, exponent, damping, count, table):
    """Return force on the follower in the cam's frame [N], zero torque, elastic energy [J], dissipated power, normal force."""
    depth, gx, gy = depth_at(x, y, table, int(count))
    rate = gx * x_rate + gy * y_rate
    normal, energy, lost = push(mode, approach_speed, effective_mass, depth, rate, stiffness, exponent, damping)
    return -normal * gx, -normal * gy, 0.0, energy, lost, normal


@component(
    port=FRAME,
    force=force,
    gap=gap,
    outputs=(Output("normal", "N", "force across the profile"),),
    context=("mode", "approach_speed", "effective_mass"),
    symbol="cam",
    example={
        "start": "crank.start",
        "end": "rod.end",
        "profile": {"angles": "0, 90, 180, 270, 360 deg", "radii": "1.2, 1.1, 1, 1.1, 1.2 m"},
        "roller": "50 mm",
        "stiffness": 1e5,
    },
    events=("left", "reached"),
    source="Flores, Machado, Silva and Martins 2011, doi:10.1007/s11044-010-9237-4 (the factor xi)",
)
class Cam:
    r"""Disc cam with a given profile against a roller or an edge that may lift off.

    .. math:: F = K\delta^n\left(1 + \xi\,\dot\delta/v\right)

    v is the speed at the touch, or more where the contact is loaded later. xi is the damping factor of Flores et al. 2011 for
    the restitution coefficient, an approximation: a free body rebounds with 0.470 of its speed for a coefficient of 0.5, and
    with 0.069 for 0.1. Between its pairs the profile is a periodic cubic spline. The roller rolls without friction.
    """

    name: str
    start: Annotated[BodyPoint, Meaning("centre of the cam, on the body that turns with it")]
    end: Annotated[BodyPoint, Meaning("centre of the roller, or the edge")]
    profile: Annotated[tuple[Point, ...], PROFILE]
    roller: Annotated[float, Quantity("m", minimum=0.0, maximum=1e3, help="radius of the roller, 0 for an edge")] = 0.0
    stiffness: Annotated[float, Quantity("1", above=0.0, maximum=1e18, help="K, in N/m^n with the n given here")] = 1e9
    exponent: Exponent = 1.5
    restitution: Restitution = 0.5

    def check(self) -> None:
        label = f"cam '{self.name}'"
        check_curve(label, self.profile, PROFILE, periodic=True)
        turn = self.profile[-1][0] - self.profile[0][0]
        if abs(turn - math.tau) > 1e-9:
            raise InputError(f"{label}: a profile over {math.degrees(turn):.6g} deg", "angles over a whole turn, 0 to 360 deg")
        if not min(radius for _, radius in self.profile) > 0.0 or len(self.profile) < 5:
            raise InputError(f"{label}: a profile of {len(self.profile)} pairs", "five or more, with radii > 0")
        self._pitch()

    def parameters(self, start: tuple[float, ...]) -> tuple[float, ...]:
        """Return stiffness K, exponent n, damping factor xi, and the number, radii and slopes of the pitch curve's nodes."""
        angle, radius = self._pitch()
        nodes = np.linspace(0.0, math.tau, PITCH_NODES + 1)
        at = periodic_spline(np.append(angle, angle[0] + math.tau), np.append(radius, radius[0]))(nodes)
        at[-1] = at[0]
        slopes = periodic_spline(nodes, at)(nodes, 1)
        table = np.stack([at, slopes], axis=1)[:-1].ravel()
        there = float(np.interp(math.atan2(start[1], start[0]) % math.tau, nodes, at))
        here = math.hypot(start[0], start[1])
        if there - here > START_DEPTH_FRACTION * there:
            raise InputError(
                f"cam '{self.name}': its follower starts {here:.6g} m from the centre, within the cam",
                f"about {there:.6g} m or more in that direction; there it touches the cam",
            )
        return self.stiffness, self.exponent, stop_damping(self.restitution), float(PITCH_NODES), *table.tolist()

    def _profile(self, count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Return angles, radii and their two derivatives at points of the profile."""
        curve = periodic_spline(*np.array(self.profile, float).T)
        angle = self.profile[0][0] + np.linspace(0.0, math.tau, count, endpoint=False)
        return angle, curve(angle), curve(angle, 1), curve(angle, 2)

    def _pitch(self) -> tuple[np.ndarray, np.ndarray]:
        """Return angles and radii of the pitch curve, the path of the roller's centre in contact."""
        angle, radius, slope, bend = self._profile(PROFILE_POINTS)
        square = radius**2 + slope**2
        curvature = (square + slope**2 - radius * bend) / square**1.5
        if np.min(radius) <= 0.0 or np.min(1.0 + self.roller * curvature) <= 0.0:
            hollow = -1.0 / np.min(curvature) if np.min(curvature) < 0.0 else 0.0
            what = f"a roller of {self.roller:.4g} m in a hollow of {hollow:.4g} m" if np.min(radius) > 0.0 else "radii below 0"
            raise InputError(f"cam '{self.name}': {what} between the pairs of its profile", "a smaller roller, or more pairs")
        out, back = radius + self.roller * radius / np.sqrt(square), -self.roller * slope / np.sqrt(square)
        return angle + np.arctan2(back, out), np.hypot(out, back)

    @property
    def outline(self) -> tuple[np.ndarray, np.ndarray]:
        """Outlines for pictures: the cam in its frame, and the roller about its centre [m]."""
        angle, radius, *_ = self._profile(180)
        ring = np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=1)
        return np.concatenate([ring, ring[:1]]), arc(self.roller, 0.0, 360.0, 37)
