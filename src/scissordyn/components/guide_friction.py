"""Friction in an ideal guide, from the force that the guide transmits."""

from __future__ import annotations

import math
from typing import Annotated

from scissordyn.components.declaration import component
from scissordyn.components.pin_friction import Kinetic, Static, StribeckSpeed, Transition, friction_ratio
from scissordyn.components.place import BodyPoint
from scissordyn.components.port import FRAME, Output
from scissordyn.plugin.element import numbers
from scissordyn.units import Meaning, Quantity

GuideStart = Annotated[BodyPoint, Meaning("a point of the body that carries the guide, or of the ground")]
GuidedPoint = Annotated[BodyPoint, Meaning("the guided point")]
GuideDirection = Annotated[
    float, Quantity("rad", minimum=-1e4, maximum=1e4, help="direction of the guide in the frame of its body")
]


def force(x, y, angle, x_rate, y_rate, speed, reaction, kinetic, static, stribeck_speed, transition, along_x, along_y):
    """Return the force along the guide [N], stored energy [J], dissipated power [W] and the normal force [N]."""
    slip = along_x * x_rate + along_y * y_rate
    friction = reaction * friction_ratio(slip, kinetic, static, stribeck_speed, transition)
    return -friction * along_x, -friction * along_y, 0.0, 0.0, friction * slip, reaction


@component(
    port=FRAME,
    force=force,
    outputs=(Output("reaction", "N", "force across the guide, or sum of those at its edges"),),
    context=("reaction",),
    symbol="frame",
    example={"start": "ground.O", "end": "slider.centre", "direction": "90 deg", "kinetic": 0.1},
    source="Armstrong-Helouvry, Dupont and Canudas de Wit 1994, doi:10.1016/0005-1098(94)90209-7",
)
class GuideFriction:
    r"""Friction in an ideal guide, with the force that the guide transmits at each instant.

    .. math:: F = -N\left(\mu_k + (\mu_s - \mu_k) e^{-(v/v_s)^2}\right)\tanh\frac{v}{v_0}

    N is the force across the guide. A guide that keeps its follower aligned presses with both edges if its moment M is large
    enough: :math:`N = \max(|F_n|, 2|M|/l)` with the length l of the follower. Reactions and friction are solved for together;
    without a solution the guide jams like a drawer, and the run ends with that cause. Below v_0 the follower creeps.
    """

    name: str
    start: GuideStart
    end: GuidedPoint
    direction: GuideDirection
    kinetic: Kinetic
    static: Static = 0.0
    stribeck_speed: StribeckSpeed = 0.01
    transition: Transition = 1e-3
    length: Annotated[float, Quantity("m", minimum=0.0, maximum=1e4, help="length of a follower that is kept aligned")] = 0.0

    def parameters(self, start: tuple[float, ...]) -> tuple[float, ...]:
        """Return the kernel's parameters, with the direction as a unit vector."""
        return numbers(self, along_x=math.cos(self.direction), along_y=math.sin(self.direction))
