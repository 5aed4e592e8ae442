"""A latch that locks, and an end stop that is reached afterwards, against Lagrange's equations of two bars."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import minimize_scalar
from tests.build import chain

import scissordyn as sd

LENGTH, MASS, GRAVITY = np.array([0.5, 0.4]), np.array([1.2, 0.8]), 9.81  # Lengths [m], masses [kg], gravity [m/s^2]
START = 0.9, 2.2  # Angles of both bars at the start [rad]
LOCKED, STOP = 0.35, -0.6  # Angle of the elbow where the latch locks, angle of the first bar at its end stop [rad]
STIFFNESS, EXPONENT, RESTITUTION = 4e4, 1.5, 0.6  # End stop
SPRING, FREE, DAMPER = 3.0, 0.2, 0.01  # Hinge spring at the elbow [N m/rad], [rad], [N m s/rad]
UNTIL = 0.7  # Duration [s]


class Arms:
    """Two bars with the angles a, b as coordinates; one coordinate after the latch has locked."""

    def __init__(self):
        self.locked, self.touch, self.pieces, self.log = False, None, [], []

    def mass(self, a, b):
        """Return the mass matrix [kg m^2]."""
        (r, s), (m, n) = LENGTH, MASS
        cross = 0.5 * n * r * s * math.cos(a - b)
        return np.array([[(m / 3.0 + n) * r * r, cross], [cross, n * s * s / 3.0]])

    def loads(self, y):
        """Return accelerations, elastic and whole torque of the stop, and torque of the latch."""
        (r, s), (m, n), (a, b, w, u) = LENGTH, MASS, y[:4]
        twist, spring = 0.5 * n * r * s * math.sin(a - b), -SPRING * (b - a - FREE) - DAMPER * (u - w)
        depth = max(STOP - a, 0.0) if self.touch else 0.0
        elastic = STIFFNESS * depth**EXPONENT
        push = elastic * (1.0 - 1.6 * (1.0 / RESTITUTION - 1.0) * w / (self.touch or 1.0))
        force = [
            -twist * u * u - (0.5 * m + n) * r * GRAVITY * math.cos(a) - spring + push,
            twist * w * w - 0.5 * n * s * GRAVITY * math.cos(b) + spring,
        ]
        matrix = self.mass(a, b)
        if not self.locked:
            return np.linalg.solve(matrix, force), elastic, push, 0.0
        both = np.full(2, sum(force) / matrix.sum())
        return both, elastic, push, float((matrix @ both - force)[1])

    def rate(self, _, y):
        """Return the derivatives of angles, speeds, the damper's and the stop's loss."""
        acceleration, elastic, push, _ = self.loads(y)
        return [*y[2:4], *acceleration, DAMPER * (y[3] - y[2]) ** 2, (elastic - push) * y[2]]

    def run(self):
        """Integrate from event to event."""
        t, y = 0.0, np.array([*START, 0.0, 0.0, 0.0, 0.0])
        while t < UNTIL:
            elbow, shoulder = lambda t, y: LOCKED + 9.0 * self.locked - y[1] + y[0], lambda t, y: y[0] - STOP
            elbow.terminal = shoulder.terminal = True
            shoulder.direction = 1.0 if self.touch else -1.0
            found = solve_ivp(
                self.rate, (t, UNTIL), y, "DOP853", rtol=1e-13, atol=1e-14, events=[elbow, shoulder], dense_output=True
            )
            self.pieces.append((self.locked, self.touch, found))
            t, y = float(found.t[-1]), found.y[:, -1].copy()
            if found.t_events[0].size:
                matrix, before = self.mass(*y[:2]), y[2:4].copy()
                y[2:4] = (matrix @ before).sum() / matrix.sum()
                self.log.append((t, before[1] - before[0], 0.5 * (before @ matrix @ before - y[2:4] @ matrix @ y[2:4])))
                self.locked = True
            elif found.t_events[1].size:
                self.log.append((t, abs(y[2]), 0.0))
                self.touch = None if self.touch else -y[2]
        return self

    def at(self, t):
        """Return the state, accelerations and torques of stop and latch at a time."""
        self.locked, self.touch, found = next(piece for piece in self.pieces if t <= piece[2].t[-1])
        y = found.sol(t)
        acceleration, _, push, latch = self.loads(y)
        return [*y, *acceleration, push, latch]


def test_stop_after_a_latch():
    """Second formulation: motion, impact, torques and their peak, losses, reactions of two bars, the stop met as one body."""
    bars = [sd.bar(name, length=r, mass=m, angle=q) for name, r, m, q in zip("ab", LENGTH, MASS, START, strict=True)]
    spring = sd.TorsionSpring("hinge", "b", "a", stiffness=SPRING, free_angle=FREE, damping=DAMPER)
    stop = sd.AngleStop("stop", "a", STOP, stiffness=STIFFNESS, exponent=EXPONENT, restitution=RESTITUTION)
    arm = chain(*bars, components=(spring, sd.Latch("latch", "b", LOCKED, base="a"), stop))
    run, arms = sd.simulate(arm, until=UNTIL, rtol=1e-12, atol=1e-12, samples=141), Arms().run()
    assert run["event_kind"].values.tolist() == ["locked", "reached", "left"]
    times, speeds, losses = np.transpose(arms.log)
    assert run["event_time"].values == pytest.approx(times, rel=1e-10)
    assert np.abs(run["event_speed"].values) == pytest.approx(np.abs(speeds), rel=1e-9)
    assert run["event_loss"].values[0] == pytest.approx(losses[0], rel=1e-10)
    assert run["switching_loss"].values[-1] == pytest.approx(losses[0], rel=1e-10)
    expected = np.array([arms.at(t) for t in run["time"].values])
    angle, speed, turned = expected[:, :2], expected[:, 2:4], expected[:, 6:8]
    assert run["angle"].values == pytest.approx(angle, abs=1e-10)
    assert run["angular_velocity"].values == pytest.approx(speed, abs=1e-9)
    assert run["angular_acceleration"].values == pytest.approx(turned, abs=1e-7)
    assert run["angle_stop_torque"].values[:, 0] == pytest.approx(expected[:, 8], abs=1e-7)
    assert run["latch_torque"].values[:, 0] == pytest.approx(expected[:, 9], abs=1e-7)
    assert run["damper_loss"].values == pytest.approx(expected[:, 4] + expected[:, 5], abs=1e-9)
    along, across = np.stack([np.cos(angle), np.sin(angle)], axis=2), np.stack([-np.sin(angle), np.cos(angle)], axis=2)
    ends = LENGTH[:, None] * (turned[..., None] * across - speed[..., None] ** 2 * along)
    elbow = MASS[1] * (ends[:, 0] + 0.5 * ends[:, 1] + [0.0, GRAVITY])
    assert run["reaction"].sel(joint="B").values == pytest.approx(elbow, abs=1e-7)
    shoulder = elbow + MASS[0] * (0.5 * ends[:, 0] + [0.0, GRAVITY])
    assert run["reaction"].sel(joint="A").values == pytest.approx(shoulder, abs=1e-7)
    found = minimize_scalar(lambda t: -arms.at(t)[8], bounds=times[1:], method="bounded", options={"xatol": 1e-12})
    assert run["angle_stop_peak_torque"].values[0] == pytest.approx(-found.fun, rel=1e-11)
    assert run["angle_stop_peak_torque_time"].values[0] == pytest.approx(found.x, rel=1e-7)
