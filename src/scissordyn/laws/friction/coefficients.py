"""Parameters that several friction laws have: their units, bounds and help, and the default static coefficient."""

from __future__ import annotations

from typing import Annotated

from scissordyn.errors import InputError
from scissordyn.units import Quantity

# dry contacts have coefficients of 1e-3 (graphite, ice) to 2 (clean metals in vacuum, rubber); the bounds leave a margin
Coefficient = Annotated[float, Quantity("1", minimum=1e-6, maximum=10.0, help="friction coefficient mu")]
Kinetic = Annotated[float, Quantity("1", minimum=1e-6, maximum=10.0, help="kinetic friction coefficient mu_k")]
Static = Annotated[float | None, Quantity("1", minimum=1e-6, maximum=10.0, help="static friction coefficient mu_s")]
StribeckSpeed = Annotated[float, Quantity("m/s", minimum=1e-7, maximum=10.0, help="Stribeck speed v_s")]
StribeckExponent = Annotated[float, Quantity("1", minimum=0.1, maximum=10.0, help="exponent gamma of the Stribeck curve")]
Viscous = Annotated[float, Quantity("s/m", minimum=0.0, maximum=1e3, help="sigma_2 per unit normal force")]
RampSpeed = Annotated[float, Quantity("m/s", minimum=0.0, maximum=10.0, help="v_0 over which the sign of v is smoothed")]

STATIC_OVER_KINETIC = 1.5  # Default of the static coefficient, as a multiple of the kinetic one


def static_coefficient(law: str, kinetic: float, static: float | None) -> float:
    if static is None:
        return STATIC_OVER_KINETIC * kinetic
    if static < kinetic:
        raise InputError(
            f"{law}: static = {static:g} below kinetic = {kinetic:g}",
            "static >= kinetic",
            f"static = {STATIC_OVER_KINETIC * kinetic:g}",
        )
    return static
