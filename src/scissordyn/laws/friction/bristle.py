"""Common parts of bristle laws: their parameters, the fading of damping with slip, the deflection at a contact's start."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, ClassVar

from scissordyn.kernel import kernel
from scissordyn.laws.friction.coefficients import (
    Kinetic,
    Static,
    StaticFriction,
    StribeckExponent,
    StribeckSpeed,
    Viscous,
    viscous_limit,
)
from scissordyn.laws.friction.stribeck import sliding_coefficient
from scissordyn.plugin.element import Kernel
from scissordyn.units import Quantity, State

PRESLIDING_SPEED = 1e-3
"""Slip speed [m/s] that separates presliding from sliding in a law without a Stribeck speed: the usual Stribeck speed."""

DAMPING_SPEED_MAX = 1e6  # [m/s] largest v_d; it makes sigma_1 constant up to round-off at all slip speeds of machines

DEFLECTION = State("bristle_deflection", "m")  # Internal state z of bristle laws

BristleStiffness = Annotated[float, Quantity("1/m", minimum=1.0, maximum=1e9, help="sigma_0 per unit normal force")]
BristleDamping = Annotated[float, Quantity("s/m", minimum=0.0, maximum=1e6, help="sigma_1 per unit normal force")]
DampingSpeed = Annotated[
    float | None,
    Quantity(
        "m/s",
        minimum=1e-9,
        maximum=DAMPING_SPEED_MAX,
        help="v_d, over which sigma_1 fades; by default so small that friction stays within mu_s; with 1e6 sigma_1 is constant",
    ),
]


def fading_speed(largest: float, bristle_damping: float) -> float:
    """Return the slip speed v_d [m/s] for which the maximum of sigma_1 |v| exp(-(v/v_d)^2) is a given coefficient."""
    return math.sqrt(2.0 * math.e) * largest / bristle_damping if bristle_damping > 0.0 else DAMPING_SPEED_MAX


@kernel
def micro_damping(v, damping, damping_speed):
    """Return the bristle damping sigma_1 [s/m] at slip speed v [m/s] (Canudas de Wit, Lischinsky 1997)."""
    x = v / damping_speed
    return damping * math.exp(-x * x)


@kernel
def onset(v, presliding_speed):
    """Return the fraction of the steady deflection at a contact's start at slip speed v [m/s], with the sign of v.

    The bristles have not been dragged before. At rest the fraction is zero, and it approaches one for slip speeds well
    above the presliding speed.
    """
    return math.tanh(v / presliding_speed)


def steady(slip_speed, kinetic, static, stribeck_speed, stribeck_exponent, bristle_stiffness):
    """Return the deflection of steady sliding at slip speed v [m/s], zero at rest."""
    return (
        math.copysign(sliding_coefficient(slip_speed, kinetic, static, stribeck_speed, stribeck_exponent), slip_speed)
        / bristle_stiffness
        if slip_speed != 0.0
        else 0.0
    )


def start(slip_speed, kinetic, static, stribeck_speed, stribeck_exponent, bristle_stiffness):
    """Return the deflection at a contact's start at slip speed v [m/s]."""
    return (
        onset(slip_speed, stribeck_speed)
        * sliding_coefficient(slip_speed, kinetic, static, stribeck_speed, stribeck_exponent)
        / bristle_stiffness
    )


@dataclass(frozen=True)
class BristleFriction(StaticFriction):
    """Base of laws whose bristles deflect up to the Stribeck curve."""

    kernels: ClassVar[Mapping[str, Kernel]] = {"start": start, "steady": steady, "limit": viscous_limit}

    kinetic: Kinetic = 0.05
    static: Static = None
    stribeck_speed: StribeckSpeed = 1e-3
    stribeck_exponent: StribeckExponent = 2.0
    bristle_stiffness: BristleStiffness = 1e5
    bristle_damping: BristleDamping = 316.0
    viscous: Viscous = 0.0
    damping_speed: DampingSpeed = None
