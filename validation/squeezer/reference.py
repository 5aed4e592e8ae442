"""Andrews' mechanism in seven angles: Lagrange's equations of the first kind with the constraints differentiated twice.

Angles beta, Theta, gamma, Phi, delta, Omega, epsilon and parameters are those of Hairer and Wanner, Solving Ordinary
Differential Equations II, section VII.7. Body k has the direction of its own frame in `a03-squeezer` of the zoo.
"""

from __future__ import annotations

from math import cos, sin

import numpy as np
from numba.extending import register_jitable
from scipy.integrate import solve_ivp

__all__ = ["START", "TEST_SET", "angles"]

START = np.array(
    [
        -0.0617138900142764496358948458001,
        0.0,
        0.455279819163070380255912382449,
        0.222668390165885884674473185609,
        0.487364979543842550225598953530,
        -0.222668390165885884674473185609,
        1.23054744454982119249735015568,
    ]
)

TEST_SET = np.array(
    [
        15.81077119629904,
        -15.75637105984298,
        0.04082224013073101,
        -0.5347301163226948,
        0.5244099658805304,
        0.5347301163226948,
        1.048080741042263,
    ]
)
"""Angles at 0.03 s in the test set for initial value problem solvers, problem "andrews"."""

M = (0.0, 0.04325, 0.00365, 0.02373, 0.00706, 0.07050, 0.00706, 0.05498)
INERTIA = (0.0, 2.194e-6, 4.410e-7, 5.255e-6, 5.667e-7, 1.169e-5, 5.667e-7, 1.912e-5)
XA, YA, XB, YB, XC, YC = -0.06934, -0.00227, -0.03635, 0.03273, 0.014, 0.072
D, DA, E, EA, ZF, FA = 0.028, 0.0115, 0.02, 0.01421, 0.02, 0.01421
RR, RA, SS, SA, SB, SC, SD = 0.007, 0.00092, 0.035, 0.01874, 0.01043, 0.018, 0.02
ZT, TA, TB, U, UA, UB = 0.04, 0.02308, 0.00916, 0.04, 0.01228, 0.00449
STIFFNESS, FREE_LENGTH, TORQUE = 4530.0, 0.07785, 0.033


@register_jitable
def mass(q: np.ndarray) -> np.ndarray:
    """Return the mass matrix."""
    _, th, _, ph, _, om, _ = q
    m = np.zeros((7, 7))
    m[0, 0] = M[1] * RA**2 + M[2] * (RR**2 - 2 * DA * RR * cos(th) + DA**2) + INERTIA[1] + INERTIA[2]
    m[0, 1] = m[1, 0] = M[2] * (DA**2 - DA * RR * cos(th)) + INERTIA[2]
    m[1, 1] = M[2] * DA**2 + INERTIA[2]
    m[2, 2] = M[3] * (SA**2 + SB**2) + INERTIA[3]
    arm = E - EA
    m[3, 3] = M[4] * arm**2 + INERTIA[4]
    m[3, 4] = m[4, 3] = M[4] * (arm**2 + ZT * arm * sin(ph)) + INERTIA[4]
    m[4, 4] = M[4] * (ZT**2 + 2 * ZT * arm * sin(ph) + arm**2) + M[5] * (TA**2 + TB**2) + INERTIA[4] + INERTIA[5]
    other = ZF - FA
    m[5, 5] = M[6] * other**2 + INERTIA[6]
    m[5, 6] = m[6, 5] = M[6] * (other**2 - U * other * sin(om)) + INERTIA[6]
    m[6, 6] = M[6] * (other**2 - 2 * U * other * sin(om) + U**2) + M[7] * (UA**2 + UB**2) + INERTIA[6] + INERTIA[7]
    return m


@register_jitable
def force(q: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Return applied and gyroscopic forces."""
    _, th, ga, ph, _, om, _ = q
    be1, th1, _, ph1, de1, om1, ep1 = v
    xd, yd = SD * cos(ga) + SC * sin(ga) + XB, SD * sin(ga) - SC * cos(ga) + YB
    length = np.hypot(xd - XC, yd - YC)
    pull = -STIFFNESS * (length - FREE_LENGTH) / length
    fx, fy = pull * (xd - XC), pull * (yd - YC)
    arm, other = E - EA, ZF - FA
    return np.array(
        [
            TORQUE - M[2] * DA * RR * th1 * (th1 + 2 * be1) * sin(th),
            M[2] * DA * RR * be1**2 * sin(th),
            fx * (SC * cos(ga) - SD * sin(ga)) + fy * (SD * cos(ga) + SC * sin(ga)),
            M[4] * ZT * arm * de1**2 * cos(ph),
            -M[4] * ZT * arm * ph1 * (ph1 + 2 * de1) * cos(ph),
            -M[6] * U * other * ep1**2 * cos(om),
            M[6] * U * other * om1 * (om1 + 2 * ep1) * cos(om),
        ]
    )


def closure(q: np.ndarray) -> np.ndarray:
    """Return the six constraints: point E is reached through F, B, G and H."""
    be, th, ga, ph, de, om, ep = q
    x, y = RR * cos(be) - D * cos(be + th), RR * sin(be) - D * sin(be + th)
    return np.array(
        [
            x - SS * sin(ga) - XB,
            y + SS * cos(ga) - YB,
            x - E * sin(ph + de) - ZT * cos(de) - XA,
            y + E * cos(ph + de) - ZT * sin(de) - YA,
            x - ZF * cos(om + ep) - U * sin(ep) - XA,
            y - ZF * sin(om + ep) + U * cos(ep) - YA,
        ]
    )


@register_jitable
def jacobian(q: np.ndarray) -> np.ndarray:
    """Return the derivatives of the constraints."""
    be, th, ga, ph, de, om, ep = q
    g = np.zeros((6, 7))
    g[0::2, 0], g[1::2, 0] = -RR * sin(be) + D * sin(be + th), RR * cos(be) - D * cos(be + th)
    g[0::2, 1], g[1::2, 1] = D * sin(be + th), -D * cos(be + th)
    g[0, 2], g[1, 2] = -SS * cos(ga), -SS * sin(ga)
    g[2, 3:5] = -E * cos(ph + de), -E * cos(ph + de) + ZT * sin(de)
    g[3, 3:5] = -E * sin(ph + de), -E * sin(ph + de) - ZT * cos(de)
    g[4, 5:7] = ZF * sin(om + ep), ZF * sin(om + ep) - U * cos(ep)
    g[5, 5:7] = -ZF * cos(om + ep), -ZF * cos(om + ep) - U * sin(ep)
    return g


@register_jitable
def curvature(q: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Return the part of the constraints' second derivative that is quadratic in the rates."""
    be, th, ga, ph, de, om, ep = q
    be1, th1, ga1, ph1, de1, om1, ep1 = v
    turn, four, six = be1 + th1, ph1 + de1, om1 + ep1
    x = -RR * cos(be) * be1**2 + D * cos(be + th) * turn**2
    y = -RR * sin(be) * be1**2 + D * sin(be + th) * turn**2
    return np.array(
        [
            x + SS * sin(ga) * ga1**2,
            y - SS * cos(ga) * ga1**2,
            x + E * sin(ph + de) * four**2 + ZT * cos(de) * de1**2,
            y - E * cos(ph + de) * four**2 + ZT * sin(de) * de1**2,
            x + ZF * cos(om + ep) * six**2 + U * sin(ep) * ep1**2,
            y + ZF * sin(om + ep) * six**2 - U * cos(ep) * ep1**2,
        ]
    )


@register_jitable
def rate(_: float, state: np.ndarray) -> np.ndarray:
    """Return the right-hand side of index 1."""
    q, v = state[:7], state[7:]
    g = jacobian(q)
    matrix = np.zeros((13, 13))
    matrix[:7, :7], matrix[:7, 7:], matrix[7:, :7] = mass(q), g.T, g
    return np.concatenate((v, np.linalg.solve(matrix, np.concatenate((force(q, v), -curvature(q, v))))[:7]))


def angles(times: np.ndarray, tolerance: float = 3e-13) -> np.ndarray:
    """Return the seven angles at given times; constraints drift by less than 1e-12 m in 0.05 s."""
    found = solve_ivp(
        rate,
        (0.0, float(times[-1])),
        np.concatenate([START, np.zeros(7)]),
        "DOP853",
        t_eval=times,
        rtol=tolerance,
        atol=tolerance,
    )
    if np.max(np.abs(closure(found.y[:7, -1]))) > 1e-11:
        raise RuntimeError("the constraints have drifted")
    return found.y[:7].T
