"""Impacts of a bar in a hard bearing with Coulomb friction, against free flights and Newton's and Coulomb's laws."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from tests.build import ORIGIN

import scissordyn as sd
from scissordyn.laws.friction.coulomb import Coulomb

RESTITUTION, CLEARANCE, RADIUS = 0.6, 4e-3, 0.03  # Restitution coefficient, radial clearance and journal radius [m]
LENGTH, MASS = 0.3, 0.9  # Of the bar [m], [kg]
INERTIA = np.array([MASS, MASS, MASS * LENGTH**2 / 12.0])  # Masses of x, y and the angle


def cross(a, b):
    """Return the product of two plane vectors."""
    return a[0] * b[1] - a[1] * b[0]


def eccentricity(y):
    """Return the journal's eccentricity and the vector from the mass centre to the journal [m]."""
    arm = -0.5 * LENGTH * np.array([math.cos(y[2]), math.sin(y[2])])
    return y[:2] + arm, arm


def gap(_, y):
    """Return the eccentricity beyond the clearance [m]."""
    return math.hypot(*eccentricity(y)[0]) - CLEARANCE


gap.terminal, gap.direction = True, 1.0


def impact(y, friction):
    """Return the velocities after an impact, whether it sticks, and what a run reports of it."""
    place, arm = eccentricity(y)
    normal = place / math.hypot(*place)
    along = np.array([-normal[1], normal[0]])
    rows = np.array([[*normal, cross(arm, normal)], [*along, cross(arm, along) + RADIUS]])
    before, matrix = rows @ y[3:], rows / INERTIA @ rows.T
    pushed = np.linalg.solve(matrix, [-(1.0 + RESTITUTION) * before[0], -before[1]])
    sticks = abs(pushed[1]) <= -friction * pushed[0]
    for sense in (1.0, -1.0):
        slipping = np.array([-1.0, -sense * friction])
        slipping *= (1.0 + RESTITUTION) * before[0] / -(matrix[0] @ slipping)
        if not sticks and sense * (before[1] + matrix[1] @ slipping) >= 0.0:
            pushed = slipping
            break
    velocity = y[3:] + rows.T @ pushed / INERTIA
    after = rows @ velocity
    lost = -0.5 * pushed * (before + after)
    angle = math.atan2(place[1], place[0])
    return velocity, sticks, [before[0], after[0], -pushed[0], angle, lost[0], lost[1], 1.0 / matrix[0, 0]]


def impacts(y, friction, count):
    """Return instants and values of the first impacts, and which of them stick."""
    t, rows, sticking = 0.0, [], []
    fall = lambda t, y: [*y[3:], 0.0, -9.81, 0.0]  # noqa: E731
    for _ in range(count):
        found = solve_ivp(fall, (t, t + 1.0), y, "DOP853", rtol=1e-13, atol=1e-15, events=gap, max_step=2e-3)
        t, y = float(found.t[-1]), found.y[:, -1].copy()
        y[3:], sticks, values = impact(y, friction)
        rows.append([t, *values])
        sticking.append(sticks)
    return np.array(rows), sticking


@pytest.mark.parametrize(
    ("friction", "angle", "spin", "sticking"),
    [(0.3, -1.2, -4.0, [False, True, False, False]), (0.6, 2.2, -9.0, [False, False, True]), (0.05, 0.7, 30.0, [False] * 4)],
)
def test_impacts_with_friction(friction, angle, spin, sticking):
    """Second formulation, order of convergence: instants, speeds, impulses, losses of impacts that slip either way or stick."""
    law = {"friction": Coulomb(friction), "damping": sd.LankaraniNikravesh(RESTITUTION)}
    pin = sd.Clearance(CLEARANCE, journal_radius=RADIUS, contact="hard", **law)
    arm = 0.5 * LENGTH * np.array([math.cos(angle), math.sin(angle)])
    velocity = 0.1 - spin * arm[1], -0.05 + spin * arm[0]
    start = {"position": tuple(arm.tolist()), "angle": angle, "velocity": velocity, "angular_velocity": spin}
    bar = sd.Body("bar", MASS, INERTIA[2], {"end": (-0.5 * LENGTH, 0.0)}, **start)
    mechanism = sd.Mechanism((bar,), (sd.Revolute("pin", ("bar", "end"), ("ground", "O"), pin),), ground=ORIGIN)
    expected, stuck = impacts(np.array([*arm, angle, *velocity, spin]), friction, len(sticking))
    assert stuck == sticking
    names = "contact_start", "approach_speed", "rebound_speed", "impulse", "contact_angle"
    losses = "contact_damping_loss", "contact_friction_loss", "effective_mass"
    coarse, fine = (
        np.transpose([run[name].values[: len(sticking)] for name in (*names, *losses)])
        for run in (
            sd.simulate(mechanism, until=expected[-1, 0] + 1e-4, start="as-placed", samples=3, step=step)
            for step in (4e-5, 2e-5)
        )
    )
    # the error of a step has even orders, so that two runs give the limit
    assert fine + (fine - coarse) / 3.0 == pytest.approx(expected, rel=1e-8)
    assert np.max(np.abs(fine / expected - 1.0)) < 0.3 * np.max(np.abs(coarse / expected - 1.0))
