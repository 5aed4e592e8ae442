"""The damping factor that returns the given restitution coefficient exactly."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache

from scissordyn.laws.damping.proportional import DampingFactor, PositiveRestitution
from scissordyn.plugin.element import element

EXPONENT_MAX = 700.0
"""Largest u of the search for s = 1 - e^-u: u resolves the roots near s = 1 of soft contacts, and e^-700 is a normal number."""

SERIES_ARGUMENT_MAX = 0.1  # [-] below, x - ln(1+x) loses digits and a series replaces it


def _excess(x: float) -> float:
    """Return x - ln(1+x) without cancellation."""
    if abs(x) > SERIES_ARGUMENT_MAX:
        return x - math.log1p(x)
    r = x / (2.0 + x)  # ln(1+x) = 2 artanh r, and x - 2 r = x r
    return x * r - 2.0 * sum(r**k / k for k in range(3, 17, 2))


def _root(factor_of: Callable[[float], float]) -> float:
    """Return the s = xi c_e in [0, 1) with s + ln(1-s) = ln(1+xi) - xi; `factor_of` gives xi for s."""
    low, high = 0.0, EXPONENT_MAX
    for _ in range(80):
        u = 0.5 * (low + high)
        s = -math.expm1(-u)
        lost = _excess(-s) if s < SERIES_ARGUMENT_MAX else u - s
        if lost < _excess(factor_of(s)):
            low = u
        else:
            high = u
    return -math.expm1(-0.5 * (low + high))


@cache
def exact_factor(restitution: float) -> float:
    """Return the root xi in (0, 1/c_e) of ln[(1+xi)/(1-xi c_e)] = xi (1+c_e); zero for c_e = 1.

    Notes
    -----
    Below c_e = 1/700 it is 1/c_e to all digits.
    """
    return 0.0 if restitution == 1.0 else _root(lambda s: s / restitution) / restitution


@cache
def returned_restitution(factor: float) -> float:
    """Return the restitution coefficient of a free body with a damping factor, from the equation of `exact_factor`."""
    return 1.0 if factor == 0.0 else _root(lambda s: factor) / factor


@element(
    name="exact",
    restitution_range=(0.0, 1.0),
    source="Carvalho, Martins 2019, doi:10.1016/j.mechmachtheory.2019.03.028; the root by bisection",
)
class Exact(DampingFactor):
    r"""The factor with which a free body, whatever the elastic part, rebounds with c_e times its approach speed.

    .. math:: \ln\frac{1+\xi}{1-\xi c_e} = \xi (1 + c_e)
    """

    restitution: PositiveRestitution = 0.9

    @staticmethod
    def _xi(c: float) -> float:
        return exact_factor(c)
