"""Shared helpers for tests of laws: impacts of a free mass by fixed-step Runge-Kutta, and friction at given slip speeds."""

from __future__ import annotations

import math
from functools import cache

import numpy as np
from scipy.integrate import solve_ivp
from tests.build import in_c

import scissordyn as sd
from scissordyn.kernel import F1
from scissordyn.laws.contact import JointContact
from scissordyn.laws.evaluate import elastic_force, friction_force, friction_states, normal_force
from scissordyn.plugin.element import pointers, row_of

# Joint of the contacts in the tests of laws
JOINT = JointContact(clearance=0.5e-3, journal_radius=9.5e-3, length=15e-3, journal=sd.STEEL, bearing=sd.STEEL)
UNIT_LENGTH = JointContact(clearance=0.5e-3, journal_radius=9.5e-3, length=1.0, journal=sd.STEEL, bearing=sd.STEEL)
"""Joint with R_B = 10 mm, c = 0.5 mm and a bearing length of 1 m, for which publications print values."""

STATELESS = np.zeros(0)  # Array of internal states, or of their rates, of a law without states


def by_name(law):
    """Return a test id by which the mutation script selects tests."""
    return getattr(law, "name", None)


def row(law, joint=JOINT):
    """Return a law's values as the kernels read them."""
    return row_of(law, joint)


def at(law, kernel="force"):
    """Return the pointer to a law's kernel."""
    return pointers(law)[kernel]


def force(law, delta, joint=JOINT):
    """Return the elastic force at one indentation."""
    return elastic_force(at(law), delta, row(law, joint))


def _acceleration(delta, rate, stiffness, p, damping, q, speed, mass):
    if delta <= 0.0:
        return 0.0
    return -normal_force(damping, elastic_force(stiffness, delta, p), delta, rate, speed, q[0:0], q[0:0], q) / mass


def _advance(delta, rate, h, stiffness, p, damping, q, speed, mass):
    a1 = _acceleration(delta, rate, stiffness, p, damping, q, speed, mass)
    v2 = rate + 0.5 * h * a1
    a2 = _acceleration(delta + 0.5 * h * rate, v2, stiffness, p, damping, q, speed, mass)
    v3 = rate + 0.5 * h * a2
    a3 = _acceleration(delta + 0.5 * h * v2, v3, stiffness, p, damping, q, speed, mass)
    v4 = rate + h * a3
    a4 = _acceleration(delta + h * v3, v4, stiffness, p, damping, q, speed, mass)
    return delta + h / 6.0 * (rate + 2.0 * v2 + 2.0 * v3 + v4), rate + h / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4)


def bounce(stiffness, p, damping, q, speed, mass, h):
    """Return the deepest indentation and the rebound speed of one impact, computed with steps h."""
    out = np.zeros(2)
    _compiled_bounce()(stiffness, p, damping, q, speed, mass, h, out)
    return out.tolist()


@cache
def _compiled_bounce():
    return in_c(_write_bounce)


def _write_bounce(stiffness: int, p: F1, damping: int, q: F1, speed: float, mass: float, h: float, out: F1) -> None:
    out[0], out[1] = _bounce(stiffness, p, damping, q, speed, mass, h)


def _bounce(stiffness, p, damping, q, speed, mass, h):
    # the forces start with a power or a logarithm of the indentation: the first step starts tiny and doubles
    delta, rate = 0.0, speed
    for k in range(40):
        delta, rate = _advance(
            delta, rate, h * (2.0**-40 if k == 0 else 2.0 ** (k - 41)), stiffness, p, damping, q, speed, mass
        )
    deepest = 0.0
    for _ in range(10_000_000):
        new_delta, new_rate = _advance(delta, rate, h, stiffness, p, damping, q, speed, mass)
        if rate > 0.0 >= new_rate:
            part = h * rate / (rate - new_rate)
            for _ in range(6):
                d, v = _advance(delta, rate, part, stiffness, p, damping, q, speed, mass)
                part -= v / _acceleration(d, v, stiffness, p, damping, q, speed, mass)
            deepest = _advance(delta, rate, part, stiffness, p, damping, q, speed, mass)[0]
        if new_delta <= 0.0:
            part = -delta / rate
            for _ in range(6):
                d, v = _advance(delta, rate, part, stiffness, p, damping, q, speed, mass)
                part -= d / v
            return deepest, -v
        delta, rate = new_delta, new_rate
    return math.nan, math.nan


def step(stiffness, mass, speed, joint=JOINT, parts=4000):
    """Return about 1/parts of the time in which the undamped spring reverses the mass."""
    p = row(stiffness, joint)
    low, high = 1e-12, 1e-2
    for _ in range(80):
        middle = math.sqrt(low * high)
        # the work of any of the forces up to delta lies between a third and all of F delta
        low, high = (
            (middle, high) if 0.5 * elastic_force(at(stiffness), middle, p) * middle < 0.5 * mass * speed**2 else (low, middle)
        )
    return 2.0 * low / speed / parts


_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(60)  # Nodes and weights of Gauss quadrature with 60 points on [-1, 1]


def work(stiffness, deepest, joint=JOINT):
    """Integrate the elastic force up to an indentation, by Gauss quadrature in its fourth root."""
    p = row(stiffness, joint)
    r = 0.5 * (1.0 + _NODES)
    values = np.array([elastic_force(at(stiffness), deepest * x**4, p) * 4.0 * x**3 for x in r])
    return 0.5 * deepest * float(_WEIGHTS @ values)


NORMAL = 1000.0  # [N] normal force of a sliding contact


class Sliding:
    """Friction law under a constant normal force: force and rates of its states at a slip speed."""

    def __init__(self, law, normal=NORMAL):
        self.law, self.normal, self.p, self.pointer = law, normal, row(law), at(law)
        self.count = len(law.states)

    def states(self, kernel, v):
        """Return the states at the start of a contact (kernel "start") or in steady sliding ("steady")."""
        z = np.full(self.count, np.nan)
        friction_states(at(self.law, kernel), v, z, self.p)
        return z

    def __call__(self, v, z):
        """Return the force and the rates of the states."""
        dz = np.full(self.count, np.nan)
        return friction_force(self.pointer, v, self.normal, np.array(z, float), dz, self.p), dz

    def settled(self, v, z=None, time=0.1):
        """Return the force after sliding at a constant speed for `time`, by LSODA of scipy."""
        z0 = np.zeros(self.count) if z is None else z
        found = solve_ivp(lambda t, y: self(v, y)[1], (0.0, time), z0, method="LSODA", rtol=1e-10, atol=1e-18)
        return self(v, found.y[:, -1])[0]
