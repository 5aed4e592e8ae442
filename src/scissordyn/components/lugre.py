"""LuGre friction in ideal pins and guides, from the force that they transmit; it sticks at rest."""

from __future__ import annotations

import math
from typing import Annotated

from scissordyn.components.declaration import component
from scissordyn.components.guide_friction import GuideDirection, GuidedPoint, GuideFriction, GuideStart
from scissordyn.components.pin_friction import PinFriction, Static, StribeckSpeed
from scissordyn.components.place import GROUND
from scissordyn.components.port import FRAME, HINGE, Output
from scissordyn.kernel import kernel
from scissordyn.laws.friction.bristle import BristleDamping, BristleStiffness, fading_speed, micro_damping
from scissordyn.laws.friction.coefficients import Kinetic, Viscous
from scissordyn.laws.friction.stribeck import sliding_coefficient
from scissordyn.units import Quantity, State

# internal state: share of the friction coefficient that bent bristles exert, sigma_0 z
BRISTLES = (State("bristles", "1", scale=0.1),)


@kernel
def bristle_ratio(slip, bristles, kinetic, static, stribeck_speed, stiffness, damping, viscous, damping_speed):
    """Return friction over normal force at a slip speed, and the rate of sigma_0 z [1/s], as in `laws.friction.lugre`."""
    rate = slip - abs(slip) * bristles / sliding_coefficient(slip, kinetic, static, stribeck_speed, 2.0)
    return bristles + micro_damping(slip, damping, damping_speed) * rate + viscous * slip, stiffness * rate


@kernel
def pin_force(speed, bristles, reaction, kinetic, static, stribeck_speed, stiffness, damping, viscous, damping_speed, radius):
    """Return torque [N m], stored energy [J], dissipated power [W], the reaction [N] and the rate of the bristles [1/s]."""
    ratio, rate = bristle_ratio(
        radius * speed, bristles, kinetic, static, stribeck_speed, stiffness, damping, viscous, damping_speed
    )
    torque = radius * reaction * ratio / math.sqrt(1.0 + ratio * ratio)
    return -torque, 0.0, torque * speed, reaction, rate


def _coefficients(part: PinLuGre | GuideLuGre) -> tuple[float, ...]:
    """Return mu_k, mu_s, v_s [m/s], sigma_0 [1/m], sigma_1, sigma_2 [s/m] and v_d [m/s]."""
    bristles = part.bristle_stiffness, part.bristle_damping, part.viscous
    damping_speed = fading_speed(part.kinetic, part.bristle_damping)
    return part.kinetic, part.static or part.kinetic, part.stribeck_speed, *bristles, damping_speed


@component(
    port=HINGE,
    force=pin_force,
    section="pin_lugre",
    label="pin friction",
    outputs=(Output("reaction", "N", "force that the pin transmits"),),
    states=BRISTLES,
    context=("reaction",),
    symbol="hinge",
    example={"body": "rod", "base": "crank", "radius": "10 mm", "kinetic": 0.12, "static": 0.15},
    source="Canudas de Wit, Olsson, Astrom and Lischinsky 1995, doi:10.1109/9.376053",
)
class PinLuGre:
    r"""Friction in an ideal pin with bristles that hold at rest, by LuGre's law with the pin's reaction.

    .. math:: T = -R\,W \sin\varphi,\quad \tan\varphi = \sigma_0 z + \sigma_1 e^{-(v/v_d)^2} z' + \sigma_2 v,\quad
        z' = v - \sigma_0 \frac{|v|}{g(v)} z,\quad g = \mu_k + (\mu_s - \mu_k) e^{-(v/v_s)^2},\quad v = R\,\omega

    W is the reaction as in `PinFriction`. At rest the pin holds up to R W sin(arctan(mu_s)), and yields elastically by
    T/(sigma_0 R^2 W) before. The energy of bent bristles counts as dissipated and is given back as they relax. v_d is such
    that friction stays within mu_s, as in the law "lugre" of clearance joints.
    """

    name: str
    body: str
    radius: Annotated[float, Quantity("m", above=0.0, maximum=1e3, help="radius R of the journal")]
    kinetic: Kinetic
    base: str = GROUND
    static: Static = 0.0
    stribeck_speed: StribeckSpeed = 0.01
    bristle_stiffness: BristleStiffness = 1e5
    bristle_damping: BristleDamping = 316.0
    viscous: Viscous = 0.0

    def parameters(self, start: tuple[float, ...]) -> tuple[float, ...]:
        """Return the coefficients and R [m]."""
        return *_coefficients(self), self.radius

    def without_bristles(self) -> PinFriction:
        """Return Coulomb friction with the same coefficients, which replaces bristles at rest."""
        return PinFriction(self.name, self.body, self.radius, self.kinetic, self.base, self.static, self.stribeck_speed)


def guide_force(
    x_rate,
    y_rate,
    bristles,
    reaction,
    kinetic,
    static,
    stribeck_speed,
    stiffness,
    damping,
    viscous,
    damping_speed,
    along_x,
    along_y,
):
    """Return force along the guide [N], stored energy [J], dissipated power [W], normal force [N] and the bristles' rate."""
    slip = along_x * x_rate + along_y * y_rate
    ratio, rate = bristle_ratio(slip, bristles, kinetic, static, stribeck_speed, stiffness, damping, viscous, damping_speed)
    friction = reaction * ratio
    return -friction * along_x, -friction * along_y, 0.0, 0.0, friction * slip, reaction, rate


@component(
    port=FRAME,
    force=guide_force,
    section="guide_lugre",
    label="guide friction",
    outputs=(Output("reaction", "N", "force across the guide, or sum of those at its edges"),),
    states=BRISTLES,
    context=("reaction",),
    symbol="frame",
    example={"start": "ground.O", "end": "slider.centre", "direction": "90 deg", "kinetic": 0.1, "static": 0.15},
    source="Canudas de Wit, Olsson, Astrom and Lischinsky 1995, doi:10.1109/9.376053",
)
class GuideLuGre:
    r"""Friction in an ideal guide with bristles that hold at rest, by LuGre's law with the guide's normal force.

    .. math:: F = -N \left(\sigma_0 z + \sigma_1 e^{-(v/v_d)^2} z' + \sigma_2 v\right),\quad
        z' = v - \sigma_0 \frac{|v|}{g(v)} z,\quad g = \mu_k + (\mu_s - \mu_k) e^{-(v/v_s)^2}

    N is the force across the guide as in `GuideFriction`, the rest as in `PinLuGre`.
    """

    name: str
    start: GuideStart
    end: GuidedPoint
    direction: GuideDirection
    kinetic: Kinetic
    static: Static = 0.0
    stribeck_speed: StribeckSpeed = 0.01
    bristle_stiffness: BristleStiffness = 1e5
    bristle_damping: BristleDamping = 316.0
    viscous: Viscous = 0.0
    length: Annotated[float, Quantity("m", minimum=0.0, maximum=1e4, help="length l of a follower that is kept aligned")] = 0.0

    def parameters(self, start: tuple[float, ...]) -> tuple[float, ...]:
        """Return the coefficients and the direction."""
        return *_coefficients(self), math.cos(self.direction), math.sin(self.direction)

    def without_bristles(self) -> GuideFriction:
        """Return Coulomb friction with the same coefficients, which replaces bristles at rest."""
        sliding = self.kinetic, self.static, self.stribeck_speed
        return GuideFriction(self.name, self.start, self.end, self.direction, *sliding, length=self.length)
