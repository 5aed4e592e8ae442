"""LuGre friction: bristles that bend and slide."""

from __future__ import annotations

from scissordyn.laws.contact import JointContact
from scissordyn.laws.friction.bristle import DEFLECTION, BristleFriction, fading_speed, micro_damping
from scissordyn.laws.friction.stribeck import sliding_coefficient
from scissordyn.plugin.element import element, numbers


def force(
    slip_speed,
    normal_force,
    bristle_deflection,
    kinetic,
    static,
    stribeck_speed,
    stribeck_exponent,
    bristle_stiffness,
    bristle_damping,
    viscous,
    damping_speed,
):
    """Return the tangential force [N] and z' [m/s], the rate of the bristle deflection."""
    rate = slip_speed - bristle_stiffness * abs(slip_speed) * bristle_deflection / sliding_coefficient(
        slip_speed, kinetic, static, stribeck_speed, stribeck_exponent
    )
    force = normal_force * (
        bristle_stiffness * bristle_deflection
        + micro_damping(slip_speed, bristle_damping, damping_speed) * rate
        + viscous * slip_speed
    )
    return force, rate


@element(
    name="lugre",
    force=force,
    states=(DEFLECTION,),
    source=(
        "Canudas de Wit et al. 1995, doi:10.1109/9.376053; fading sigma_1: Canudas de Wit, Lischinsky 1997, "
        "Int. J. Adaptive Control and Signal Processing 11, 65-80"
    ),
)
class LuGre(BristleFriction):
    r"""Bristle friction with pre-sliding, Stribeck effect and stick-slip.

    .. math::
        z' = v - \sigma_0 \frac{|v|}{g(v)} z,\quad g = \mu_k + (\mu_s - \mu_k) e^{-|v/v_s|^\gamma},\quad
        F_t = F_n (\sigma_0 z + \sigma_1 e^{-(v/v_d)^2} z' + \sigma_2 v)

    bristle_deflection z is in m. The static coefficient is 1.5 times the kinetic one unless it is given. With a constant
    sigma_1 friction would exceed the static limit many times over when slip reverses under load; it stays within mu_s F_n, plus
    the viscous part, as long as sigma_1 v_d <= sqrt(2 e) mu_k; equality is the default (decision 0006).
    """

    def parameters(self, joint: JointContact) -> tuple[float, ...]:
        """Return the kernel's parameters; by default mu_s and v_d are computed."""
        fading = self.damping_speed or fading_speed(self.kinetic, self.bristle_damping)
        return numbers(self, static=self._static_coefficient(), damping_speed=fading)
