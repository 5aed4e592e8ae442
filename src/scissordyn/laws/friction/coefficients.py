"""Common parts of friction laws: parameters with bounds, the default static coefficient, the limits of friction."""

from __future__ import annotations

from typing import Annotated

from scissordyn.errors import InputError
from scissordyn.laws.contact import Friction, JointContact
from scissordyn.plugin.element import numbers
from scissordyn.units import Quantity, check_quantities

# dry contacts have coefficients of 1e-3 (graphite, ice) to 2 (clean metals in vacuum, rubber); the bounds leave a margin
Coefficient = Annotated[float, Quantity("1", minimum=1e-6, maximum=10.0, help="friction coefficient mu")]
Kinetic = Annotated[float, Quantity("1", minimum=1e-6, maximum=10.0, help="kinetic friction coefficient mu_k")]
Static = Annotated[float | None, Quantity("1", minimum=1e-6, maximum=10.0, help="static friction coefficient mu_s")]
StribeckSpeed = Annotated[float, Quantity("m/s", minimum=1e-7, maximum=10.0, help="Stribeck speed v_s")]
StribeckExponent = Annotated[float, Quantity("1", minimum=0.1, maximum=10.0, help="exponent gamma of the Stribeck curve")]
Viscous = Annotated[float, Quantity("s/m", minimum=0.0, maximum=1e3, help="sigma_2 per unit normal force")]
RampSpeed = Annotated[float, Quantity("m/s", minimum=0.0, maximum=10.0, help="v_0 over which the sign of v is smoothed")]


def static_coefficient(law: str, kinetic: float, static: float | None, ratio: float = 1.5) -> float:
    if static is None:
        return ratio * kinetic
    if static < kinetic:
        raise InputError(
            f"{law}: static = {static:g} below kinetic = {kinetic:g}", "static >= kinetic", f"static = {ratio * kinetic:g}"
        )
    return static


class StaticFriction(Friction):
    """Base of friction laws with a static coefficient, by default a multiple of the kinetic one."""

    kinetic: float
    static: float | None

    def __post_init__(self) -> None:
        check_quantities(self)
        self._static_coefficient()

    def _static_coefficient(self) -> float:
        return static_coefficient(type(self).__name__, self.kinetic, self.static)

    def parameters(self, joint: JointContact) -> tuple[float, ...]:
        """Return the kernel's parameters; by default mu_s is computed."""
        return numbers(self, static=self._static_coefficient())


def kinetic_limit(slip_speed, normal_force, kinetic):
    """Return the largest |F_t| [N] of a law without a static coefficient at slip speed v [m/s]."""
    return kinetic * normal_force


def static_limit(slip_speed, normal_force, static):
    """Return the largest |F_t| [N] of a law without a viscous part."""
    return static * normal_force


def viscous_limit(slip_speed, normal_force, static, viscous):
    """Return the largest |F_t| [N] of static friction and the viscous part."""
    return normal_force * (static + viscous * abs(slip_speed))
