"""Torque law of the published four-bar linkage: inverse dynamics of the ideal linkage with feedback."""

import math

import scissordyn as sd


@sd.element(slot="controller")
def torque(reference_angle, reference_speed, reference_acceleration, error, speed, gain, rate):
    """Return the torque on the crank [N m]."""
    ground, crank, coupler, rocker = 3.0, 1.0, 4.0, 2.5
    mass, gravity = 1.0, 9.81
    angle = reference_angle - error
    # the rocker pin is an intersection of circles around crank pin and ground pin
    x, y = ground - crank * math.cos(angle), -crank * math.sin(angle)
    across = math.hypot(x, y)
    alpha = math.atan2(y, x) + math.acos((coupler**2 + across**2 - rocker**2) / (2.0 * coupler * across))
    phi = math.atan2(coupler * math.sin(alpha) - y, coupler * math.cos(alpha) - x)
    # angular velocities of coupler and rocker divided by that of the crank, and their derivatives by the crank's angle
    sine, cosine = math.sin(alpha - phi), math.cos(alpha - phi)
    s = crank * math.sin(phi - angle) / (coupler * sine)
    r = crank * math.sin(alpha - angle) / (rocker * sine)
    ds = crank * math.cos(phi - angle) * (r - 1.0) / (coupler * sine) - s * (s - r) * cosine / sine
    dr = crank * math.cos(alpha - angle) * (s - 1.0) / (rocker * sine) - r * (s - r) * cosine / sine
    c, dc = math.cos(alpha - angle), -math.sin(alpha - angle) * (s - 1.0)
    j1, j2, j3 = 4.0 / 3.0 * mass * crank**2, mass * coupler**2 / 3.0, mass * rocker**2 / 3.0
    p = 0.5 * mass * crank * coupler
    inertia = j1 + j2 * s * s + j3 * r * r + 2.0 * p * c * s
    # as in the source, which uses the rocker's inertia about its centre instead of its end: half of j3 instead of j3
    slope = j2 * s * ds + 0.5 * j3 * r * dr + p * (c * ds + s * dc)
    arms = 1.5 * crank * math.cos(angle) + 0.5 * coupler * s * math.cos(alpha) + 0.5 * rocker * r * math.cos(phi)
    lag, drift = -error, speed - reference_speed
    ahead = inertia * (reference_acceleration - rate * drift) + slope * speed * (speed - rate * lag)
    return ahead - gain * (drift + rate * lag) + mass * gravity * arms


law = torque.declaration.kernels["torque"]  # The Python function of the kernel
