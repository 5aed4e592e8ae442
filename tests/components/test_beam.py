"""The beam element alone: its definition evaluated by another quadrature and root finder, its gradient, the arc."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq

import scissordyn as sd
from scissordyn.components.beam import force
from scissordyn.components.elastic import node_inertia

LENGTH, EA, EI = 0.25, 3e4, 20.0  # Length [m], axial stiffness EA [N] and bending stiffness EI [N m^2] of a beam element
# Depth of the section [m], Young's modulus [Pa] and yield strength [Pa] of a beam element
DEPTH, MODULUS, STRENGTH = 0.03, 2e9, 5e7
# Beam element between two bodies
BEAM = sd.Beam("beam", ("one", "end"), ("other", "start"), LENGTH, EA, EI, 1.2, DEPTH, MODULUS, STRENGTH)


def rotation(p1, p2, a, xi):
    """Return the rotation psi(xi); a is the amplitude of the third shape."""
    return p1 * (1.0 - xi) * (1.0 - 3.0 * xi) + p2 * xi * (3.0 * xi - 2.0) + 6.0 * a * xi * (1.0 - xi)


def curvature(p1, p2, a, xi):
    """Return the derivative of the rotation by xi."""
    return p1 * (6.0 * xi - 4.0) + p2 * (6.0 * xi - 2.0) + a * (6.0 - 12.0 * xi)


def mean(function):
    """Return the mean of a function over xi from 0 to 1."""
    return quad(function, 0.0, 1.0, epsabs=1e-14)[0]


def defined(x, y, angle):
    """Return stored energy [J] and strain of the axis by the definition in the docstring of the element."""
    chord, turn = math.hypot(x, y), math.atan2(y, x)
    ends = -turn, angle - turn
    closed = brentq(
        lambda a: quad(lambda xi: math.sin(rotation(*ends, a, xi)), 0.0, 1.0, epsabs=1e-14)[0], -1.0, 1.0, xtol=1e-15
    )
    strain = chord / (LENGTH * mean(lambda xi: math.cos(rotation(*ends, closed, xi)))) - 1.0
    bent = mean(lambda xi: curvature(*ends, closed, xi) ** 2)
    return 0.5 * EA * LENGTH * strain**2 + 0.5 * EI / LENGTH * bent, strain


@pytest.mark.parametrize("place", [(0.251, 0.004, 0.03), (0.248, -0.006, 0.02), (0.25, 0.01, -0.06)])
def test_energy_and_outputs_are_those_of_the_definition(place):
    """Second evaluation: adaptive quadrature and bracketing (the element: four Gauss points, two Newton steps)."""
    found = force(*place, 0.0, 0.0, 0.0, 1.0, 0.0, *BEAM.parameters(()))
    energy, strain = defined(*place)
    axial, start, end, fibre, stress, use = found[6:]
    ahead, behind = (defined(*place[:2], place[2] + turn)[0] for turn in (1e-5, -1e-5))
    assert found[3] == pytest.approx(energy, rel=1e-6)
    assert axial == pytest.approx(EA * strain, rel=1e-4)
    assert end == pytest.approx((ahead - behind) / 2e-5, rel=1e-4)
    balance = end - start + found[0] * place[1] - found[1] * place[0]  # of moments about the start
    assert found[2] == -end
    assert abs(balance) < 1e-9 * abs(end)
    assert fibre == pytest.approx(abs(strain) + 0.5 * DEPTH * max(abs(start), abs(end)) / EI, rel=1e-4)
    assert (stress, use) == pytest.approx((MODULUS * fibre, MODULUS * fibre / STRENGTH), rel=1e-12)
    assert force(*place, 0.0, 0.0, 0.0, 1.0, 0.0, LENGTH, EA, EI, 0.0, 0.0, 0.0, DEPTH, MODULUS, 0.0)[11] == 0.0


HEATED_AND_DAMPED = (LENGTH, EA, EI, 2e-3, 3e-3, 0.4, DEPTH, 0.0, 0.0)
"""Parameters of a beam kernel with a damping time of 2 ms, a thermal strain of 3e-3 and a thermal curvature of 0.4/m."""


@pytest.mark.parametrize("factor", [0.0, 1.0])
def test_forces_are_the_gradient_of_the_energy(factor):
    """Identity: forces and supplied power against central differences of the energy, at large deformation."""
    place = np.array([0.23, 0.04, 0.5])
    found = force(*place, 0.0, 0.0, 0.0, factor, 2.0, *HEATED_AND_DAMPED)
    for k in range(3):
        h = 1e-6 * np.eye(3)[k]
        ahead, behind = (force(*(place + h * sign), 0.0, 0.0, 0.0, factor, 0.0, *HEATED_AND_DAMPED)[3] for sign in (1.0, -1.0))
        assert found[k] == pytest.approx(-(ahead - behind) / 2e-6, rel=1e-7)
    warmer, colder = (force(*place, 0.0, 0.0, 0.0, factor + h, 0.0, *HEATED_AND_DAMPED)[3] for h in (1e-4, -1e-4))
    assert found[5] == pytest.approx(2.0 * (warmer - colder) / 2e-4, rel=1e-7)
    assert found[4] == 0.0


def test_temperatures_are_strain_and_curvature():
    """Closed forms: alpha Delta T, and alpha Delta T_h over the depth."""
    heated = replace(BEAM, damping=2e-3, thermal_expansion=1e-5, temperature_rise=300.0, temperature_difference=1200.0)
    expected = np.array(HEATED_AND_DAMPED) + np.array([0.0] * 7 + [MODULUS, STRENGTH])
    assert heated.parameters(()) == pytest.approx(expected, rel=1e-12)


def test_damping_takes_its_power_from_the_forces():
    """Identities: force times rate is less by what is dissipated; the viscous part of the axial force is tau times its rate."""
    place, rate = np.array([0.23, 0.04, 0.5]), np.array([0.3, -0.2, 4.0])
    rest = force(*place, 0.0, 0.0, 0.0, 1.0, 0.0, *HEATED_AND_DAMPED)
    found = force(*place, *rate, 1.0, 0.0, *HEATED_AND_DAMPED)
    assert found[4] > 1.0
    assert np.dot(np.subtract(found[:3], rest[:3]), rate) == pytest.approx(-found[4], rel=1e-12)
    h = 1e-6
    ahead, behind = (force(*(place + sign * h * rate), 0.0, 0.0, 0.0, 1.0, 0.0, *HEATED_AND_DAMPED) for sign in (1.0, -1.0))
    assert found[6] - rest[6] == pytest.approx(2e-3 * (ahead[6] - behind[6]) / (2.0 * h), rel=1e-5)
    straight = force(0.25, 0.0, 0.0, 0.0, 0.0, 2.0, 0.0, 0.0, *HEATED_AND_DAMPED)
    assert straight[2] == pytest.approx(-2e-3 * EI / LENGTH * 4.0 * 2.0, rel=1e-9)  # 4 EI/l, at the end that turns


def test_an_element_under_an_end_moment_is_an_arc():
    """Closed form: M = EI kappa without axial force bends a bar to a circle, and two pi EI/L closes it."""
    length, turn = 0.125, 2.0 * math.pi / 8.0
    x, y = length * math.sin(turn) / turn, length * (1.0 - math.cos(turn)) / turn
    fx, fy, torque, energy, *_ = force(x, y, turn, 0.0, 0.0, 0.0, 1.0, 0.0, length, 1e6, 3.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    assert -torque == pytest.approx(3.0 * turn / length, rel=1e-7)  # quadrature with four points
    assert energy == pytest.approx(0.5 * 3.0 * turn**2 / length, rel=1e-7)
    assert math.hypot(fx, fy) < 1e-3


def test_inertia_of_a_cross_section():
    """Closed form: mass times the square of the cubic shape that turns one end alone, x (1 - x/l)^2."""
    assert node_inertia(2.84, 0.5) == pytest.approx(
        quad(lambda x: 2.84 * (x * (1.0 - x / 0.5) ** 2) ** 2, 0.0, 0.5)[0], rel=1e-12
    )
