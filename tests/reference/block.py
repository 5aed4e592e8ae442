"""A rigid block between two plane surfaces, in x, y and angle, by scipy: an independent formulation of a clearance guide."""

import math
from dataclasses import dataclass, field

import numpy as np
from scipy.integrate import solve_ivp

RTOL, ATOL = 1e-12, 1e-15  # Relative and absolute tolerance of the reference solution


@dataclass
class Block:
    """A block with four rounded corners in the channel |y| < H/2; its mass centre is off the middle."""

    mass: float  # [kg]
    inertia: float  # About the mass centre [kg m^2]
    centre: tuple[float, float]  # Mass centre from the block's middle [m]
    half_length: float  # From the middle to the centres of the corners' arcs [m]
    half_width: float  # [m]
    radius: float  # Of the arcs [m]
    clearance: float  # [m]
    coefficient: float  # F = K delta^n (1 + xi delta'/delta'(-)): K, then n and xi
    exponent: float
    damping: float
    friction: float  # mu (1 - exp(-3 |v|/v_0)): mu, then v_0
    ramp_speed: float
    load: tuple[float, float]  # Constant force on the mass centre [N]
    touching: list[bool] = field(default_factory=lambda: [False] * 4)
    approach: list[float] = field(default_factory=lambda: [0.0] * 4)

    def corner(self, state, k):
        """Return the arm of corner k's tip from the mass centre, the side of its surface, its indentation and the rate."""
        _, y, turn, _, rise, spin = state
        ends = ((-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0))[k]
        side = ends[1]
        x0, y0 = ends[0] * self.half_length - self.centre[0], ends[1] * self.half_width - self.centre[1]
        arm_x = math.cos(turn) * x0 - math.sin(turn) * y0
        arm_y = math.sin(turn) * x0 + math.cos(turn) * y0
        depth = side * (y + arm_y) - self.half_width - self.clearance
        return arm_x, arm_y + side * self.radius, side, depth, side * (rise + spin * arm_x)

    def rate(self, t, state):
        """Return the rate of the state by Newton's and Euler's equations."""
        fx, fy, moment = *self.load, 0.0
        for k in range(4):
            if not self.touching[k]:
                continue
            arm_x, arm_y, side, depth, rate = self.corner(state, k)
            if depth <= 0.0:
                continue
            normal = self.coefficient * depth**self.exponent * (1.0 + self.damping * rate / self.approach[k])
            normal = max(normal, 0.0)
            slip = state[3] - state[5] * arm_y
            friction = -math.copysign(self.friction * normal * -math.expm1(-3.0 * abs(slip) / self.ramp_speed), slip)
            fx, fy = fx + friction, fy - side * normal
            moment += arm_x * -side * normal - arm_y * friction
        return np.array([*state[3:], fx / self.mass, fy / self.mass, moment / self.inertia])

    def contacts(self, state, until):
        """Return corner, start and approach speed of every contact, and the final state."""
        found, t = [], 0.0
        while t < until:
            events = []
            for k in range(4):

                def gap(t, y, k=k):
                    return self.corner(y, k)[3]

                gap.terminal, gap.direction = True, -1.0 if self.touching[k] else 1.0
                events.append(gap)
            path = solve_ivp(self.rate, (t, until), state, "DOP853", events=events, rtol=RTOL, atol=ATOL, max_step=2e-4)
            t, state = path.t[-1], path.y[:, -1]
            for k in range(4):
                _, _, _, depth, rate = self.corner(state, k)
                # a corner that makes contact together with another one is past its root when the next piece begins
                together = not self.touching[k] and depth > -1e-14 and rate > 0.0
                if path.t_events[k].size or together:
                    self.touching[k] = not self.touching[k]
                    if self.touching[k]:
                        self.approach[k] = rate
                        found.append((k, t, rate))
        return found, state
