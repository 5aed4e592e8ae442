"""The kernel that all line-contact laws with a logarithm share, inverted to round-off.

Johnson, Radzimovsky, ESDU 78035 and Dubowsky and Freudenstein all read delta = A F ln(G/F) for a force F. With w = F/G and
y = delta/(A G) that is y = -w ln w, one function for all of them: its ascending branch is w = y/t, where t = -ln w > 1 solves
t - ln t = -ln y (t is -W_{-1}(-y), the lower real branch of Lambert's function).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from decimal import Decimal, localcontext
from operator import mul
from typing import ClassVar

import numpy as np

from scissordyn.interpolation import EXTENDED
from scissordyn.kernel import kernel
from scissordyn.laws.contact import TangentElastic
from scissordyn.plugin.element import Kernel

TANGENT_T = 1.25
"""Smallest t of the laws themselves; for larger indentations they continue along the tangent at this t.

At t = 1 the laws have their largest indentation and an infinite stiffness. The tangent begins at 97 % of that indentation.
"""


def row(compliance: float, ceiling: float) -> tuple[float, ...]:
    """Return the kernel parameters for delta = A F ln(G/F)."""
    w = math.exp(-TANGENT_T)
    return (
        1.0 / (compliance * ceiling),
        ceiling,
        compliance * ceiling * TANGENT_T * w,
        ceiling * w,
        1.0 / (compliance * (TANGENT_T - 1.0)),
    )


PIECES_PER_UNIT, S_MAX, DEGREE = 8, 8, 8
"""Table of t over s = sqrt(L - 1) with L = -ln y: number of polynomials per unit of s, largest s, degree of the polynomials."""


def _pieces() -> np.ndarray:
    """Return the coefficients of the polynomials for t over s, shape (PIECES_PER_UNIT * S_MAX, DEGREE + 1).

    t is analytic in s: its branch point becomes t = 1 + sqrt(2) s + ... The nearest singularities, at L = 1 +- 2 pi i, are 1.77
    away from the real axis, the width of fourteen pieces. Each degree reduces the error of Chebyshev interpolation by 57.
    """
    pieces = []
    with localcontext(EXTENDED):
        half = Decimal(1) / (2 * PIECES_PER_UNIT)
        s = half
        rest = Decimal(2).sqrt() * s + s * s  # t - 1; from above Newton's method falls without overshooting
        for _ in range(6):
            rest -= (rest - (1 + rest).ln() - s * s) * (1 + rest) / rest
        for _ in range(PIECES_PER_UNIT * S_MAX):
            series = _taylor(s, rest, half)
            pieces.append(_interpolant(series))
            rest = sum(term * 2**n for n, term in enumerate(series)) - 1
            s += 2 * half
    return np.array(pieces, float)


def _taylor(s: Decimal, rest: Decimal, half: Decimal, terms: int = 20) -> list[Decimal]:
    """Return the Taylor series of t in x = -1 .. 1 across a piece about s, of (r^2)' = 4 s t where r = t - 1.

    `terms`: terms of a Taylor series: its remainder is 1e-29 at the end of a piece, 1e-23 at the middle of the next.
    """
    series = [1 + rest, 2 * half * s * (1 + rest) / rest]
    for n in range(2, terms):
        square = 4 * half * (s * series[n - 1] + half * series[n - 2]) / n  # term of r^2
        products = sum(map(mul, series[1:n], series[n - 1 : 0 : -1]))
        series.append((square - products) / (2 * rest))
    return series


def _interpolant(series: list[Decimal]) -> list[Decimal]:
    """Return the interpolant at the roots of Chebyshev's polynomial of degree 9: the remainder of a division by it."""
    left = list(series)
    while len(left) > DEGREE + 1:
        last = left.pop()
        for power, coefficient in _CHEBYSHEV_9.items():
            left[len(left) - 9 + power] -= last * coefficient / 256
    return left


_CHEBYSHEV_9 = {1: 9, 3: -120, 5: 432, 7: -576}  # T_9 = 256 x^9 - 576 x^7 + 432 x^5 - 120 x^3 + 9 x


_PIECES = _pieces()  # Table of the logarithmic laws' polynomials, which give t as a function of s


@kernel
def force(indentation, inverse, ceiling, deepest, last_force, last_stiffness):
    """Return the force [N] at indentation delta > 0 [m]."""
    if indentation >= deepest:
        return last_force + last_stiffness * (indentation - deepest)
    y = indentation * inverse
    level = -math.log(y)
    s = PIECES_PER_UNIT * math.sqrt(level - 1.0)
    if s < PIECES_PER_UNIT * S_MAX:
        k = int(s)
        x = 2.0 * (s - k) - 1.0
        # even and odd halves of the polynomial, which a processor computes at the same time
        x2 = x * x
        x4 = x2 * x2
        low = (_PIECES[k, 0] + _PIECES[k, 1] * x) + (_PIECES[k, 2] + _PIECES[k, 3] * x) * x2
        high = (_PIECES[k, 4] + _PIECES[k, 5] * x) + (_PIECES[k, 6] + _PIECES[k, 7] * x) * x2
        t = low + (high + _PIECES[k, 8] * x4) * x4
    else:  # y < e^-65: t = L + ln t, each turn 65 times nearer
        t = level
        for _ in range(12):
            t = level + math.log(t)
    return ceiling * y / t


def energy(indentation, inverse, ceiling, deepest, last_force, last_stiffness):
    """Return the work [J] up to delta [m]: F delta/2 - A F^2/4, the integral of F d delta = A F (ln(G/F) - 1) dF."""
    rest = max(indentation - deepest, 0.0)
    within = indentation - rest
    at = force(within, inverse, ceiling, deepest, last_force, last_stiffness)
    return 0.5 * at * within - 0.25 * at * at / (inverse * ceiling) + rest * (at + 0.5 * last_stiffness * rest)


class Logarithmic(TangentElastic):
    """Base of line contacts with delta = A F ln(G/F), whose parameters come from `row`."""

    kernels: ClassVar[Mapping[str, Kernel]] = {"force": force, "energy": energy}
    small_contact = True
