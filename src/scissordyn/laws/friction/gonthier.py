"""Gonthier's bristle friction with dwell time."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, ClassVar

from scissordyn.jit import kernel
from scissordyn.laws.contact import JointContact
from scissordyn.laws.friction.bristle import BristleStiffness, onset
from scissordyn.laws.friction.coefficients import Kinetic, Static, Viscous, static_coefficient
from scissordyn.units import Quantity, State, check_quantities

__all__ = ["GonthierBristle", "force", "start", "static_limit", "steady"]


@dataclass(frozen=True)
class GonthierBristle:
    r"""Bristles that stick at rest and slide when moving, and a static friction that grows with the time at rest.

    .. math::
        s = e^{-(v/v_s)^2},\quad z' = s v + (1 - s) \frac{\mu_k d(v) - \sigma_0 z}{\sigma_1},\quad
        \dot w = \frac{s - w}{\tau},\quad \tau = \begin{cases} \tau_d & s \ge w \\ \sigma_1/\sigma_0 & s < w \end{cases}

        F_t = F_n [\operatorname{sat}(\sigma_0 z + \sigma_1 z',\ \mu_k + (\mu_s - \mu_k) w) + \sigma_2 v]

    d(v) is the sign of v, smoothed by a cubic below the smoothing speed; sat(x, m) cuts x off at -m and m. bristle_deflection
    z is in m; dwell w is a pure number, 1 after a long rest. The source has forces where these are coefficients, times F_n.
    The static coefficient is 1.5 times the kinetic one unless it is given.
    """

    kinetic: Kinetic = 0.05
    static: Static = None
    stribeck_speed: Annotated[
        float, Quantity("m/s", minimum=1e-7, maximum=10.0, help="v_s, below which the bristles stick")
    ] = 1e-3
    smoothing_speed: Annotated[
        float, Quantity("m/s", minimum=1e-9, maximum=10.0, help="below which the sign of v is smoothed")
    ] = 1e-4
    dwell_time: Annotated[
        float, Quantity("s", minimum=1e-9, maximum=1e4, help="tau_d, in which static friction grows at rest")
    ] = 1e-3
    bristle_stiffness: BristleStiffness = 1e5
    bristle_damping: Annotated[float, Quantity("s/m", minimum=1e-6, maximum=1e6, help="sigma_1 per unit normal force")] = 10.0
    viscous: Viscous = 0.0

    name: ClassVar[str] = "gonthier-bristle"
    kernel_kind: ClassVar[int] = 10
    source: ClassVar[str] = "Gonthier, McPhee, Lange, Piedboeuf 2004, doi:10.1023/B:MUBO.0000029392.21648.bc"
    states: ClassVar[tuple[State, ...]] = (State("bristle_deflection", "m"), State("dwell", "1", scale=1.0))
    stiff: ClassVar[bool] = True

    def __post_init__(self) -> None:
        check_quantities(self)
        static_coefficient("GonthierBristle", self.kinetic, self.static)

    def parameters(self, joint: JointContact) -> tuple[float, ...]:
        """mu_k, mu_s, v_s, smoothing speed, tau_d, sigma_0, sigma_1 and sigma_2."""
        return (
            self.kinetic,
            static_coefficient("GonthierBristle", self.kinetic, self.static),
            self.stribeck_speed,
            self.smoothing_speed,
            self.dwell_time,
            self.bristle_stiffness,
            self.bristle_damping,
            self.viscous,
        )


@kernel()
def direction(v, smoothing_speed):
    """The sign of v, below the smoothing speed by a cubic with a level end."""
    r = v / smoothing_speed
    return math.copysign(1.0, v) if abs(r) >= 1.0 else r * (1.5 - 0.5 * r * r)


@kernel()
def force(v, normal, z, dz, p):
    """Tangential force [N]; writes z' [m/s] and w' [1/s] into dz. z[0] is the deflection [m], z[1] the dwell [1]."""
    x = v / p[2]
    stick = math.exp(-x * x)
    slide = -math.expm1(-x * x)
    dz[0] = stick * v + slide * (p[0] * direction(v, p[3]) - p[5] * z[0]) / p[6]
    lag = stick - z[1]
    dz[1] = lag / p[4] if lag >= 0.0 else lag * p[5] / p[6]
    largest = p[0] + (p[1] - p[0]) * z[1]
    bristle = min(largest, max(-largest, p[5] * z[0] + p[6] * dz[0]))
    return normal * (bristle + p[7] * v)


@kernel(inline=True)
def bend(v, p):
    """Coefficient of bristles in steady sliding at slip speed v != 0 [m/s], not yet bounded by friction, with the sign of v."""
    x = v / p[2]
    return p[0] * direction(v, p[3]) - p[6] * math.exp(-x * x) * v / math.expm1(-x * x)


@kernel()
def steady(v, z, p):
    """States of steady sliding at slip speed v [m/s], no bristle beyond its largest force, none bent at rest."""
    x = v / p[2]
    z[1] = math.exp(-x * x)
    largest = p[0] + (p[1] - p[0]) * z[1]
    z[0] = min(largest, max(-largest, bend(v, p))) / p[5] if v != 0.0 else 0.0


@kernel()
def start(v, z, p):
    """States at a contact's start at slip speed v [m/s]; a contact that begins has not dwelt, so kinetic friction bounds it."""
    z[1] = 0.0
    z[0] = onset(v, p[2]) * min(p[0], abs(bend(v, p))) / p[5] if v != 0.0 else 0.0


@kernel()
def static_limit(v, normal, p):
    """Largest |F_t| [N] that the law allows at slip speed v [m/s]."""
    return normal * (p[1] + p[7] * abs(v))
