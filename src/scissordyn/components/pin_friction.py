"""Friction in an ideal pin, from the force that the pin transmits, and parts shared with friction in guides."""

from __future__ import annotations

import math
from typing import Annotated

from scissordyn.components.declaration import component
from scissordyn.components.place import GROUND
from scissordyn.components.port import HINGE, Output
from scissordyn.kernel import kernel
from scissordyn.units import Meaning, Quantity

Kinetic = Annotated[float, Quantity("1", minimum=0.0, maximum=10.0, help="coefficient of friction in motion")]
Static = Annotated[
    float,
    Quantity(
        "1",
        minimum=0.0,
        maximum=10.0,
        help="coefficient of friction at the start of motion; 0 for the kinetic one",
        zero="the kinetic coefficient",
    ),
]
StribeckSpeed = Annotated[
    float, Quantity("m/s", above=0.0, maximum=1e3, help="speed over which friction falls from static to kinetic")
]
Transition = Annotated[float, Quantity("m/s", above=0.0, maximum=1e3, help="speed over which friction changes its sign")]


@kernel
def friction_ratio(slip, kinetic, static, stribeck_speed, transition):
    """Return friction over normal force at a slip speed: Coulomb friction with Stribeck's peak, smooth about zero."""
    peak = (static - kinetic) * math.exp(-(slip * slip) / (stribeck_speed * stribeck_speed)) if static > 0.0 else 0.0
    return (kinetic + peak) * math.tanh(slip / transition)


@kernel
def force(angle, speed, reaction, radius, kinetic, static, stribeck_speed, transition):
    """Return torque [N m], stored energy [J], dissipated power [W] and the reaction [N]."""
    ratio = friction_ratio(radius * speed, kinetic, static, stribeck_speed, transition)
    # the reaction is the resultant of normal force and friction, at the friction angle to the normal force
    torque = radius * reaction * ratio / math.sqrt(1.0 + ratio * ratio)
    return -torque, 0.0, torque * speed, reaction


@component(
    port=HINGE,
    force=force,
    outputs=(Output("reaction", "N", "force that the pin transmits"),),
    context=("reaction",),
    symbol="hinge",
    example={"body": "rod", "base": "crank", "radius": "10 mm", "kinetic": 0.12},
    source="Armstrong-Helouvry, Dupont and Canudas de Wit 1994, doi:10.1016/0005-1098(94)90209-7",
)
class PinFriction:
    r"""Friction in the ideal pin that joins two bodies, with the force that the pin transmits at each instant.

    .. math:: T = -R\,W \sin\varphi,\quad \tan\varphi = \left(\mu_k + (\mu_s - \mu_k) e^{-(v/v_s)^2}\right)
        \tanh\frac{v}{v_0},\quad v = R\,\omega

    W is the reaction, the resultant of normal force and friction, so that it touches the friction circle R sin(phi). Friction
    changes the reactions, on which it depends: both are solved for together. Where no reaction is in balance with its friction,
    the mechanism jams, and a run ends with that cause. Below v_0 joints creep: friction holds nothing at rest.
    """

    name: str
    body: Annotated[str, Meaning("both bodies of one ideal pin")]
    radius: Annotated[float, Quantity("m", above=0.0, maximum=1e3, help="radius of the journal")]
    kinetic: Kinetic
    base: Annotated[str, Meaning("both bodies of one ideal pin")] = GROUND
    static: Static = 0.0
    stribeck_speed: StribeckSpeed = 0.01
    transition: Transition = 1e-3
