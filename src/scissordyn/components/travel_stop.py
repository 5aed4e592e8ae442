"""End stop of a travelling point."""

from __future__ import annotations

from typing import Annotated

from scissordyn.components.declaration import component
from scissordyn.components.place import BodyPoint
from scissordyn.components.port import TRAVEL
from scissordyn.components.stop import Exponent, Restitution, push, stop_damping
from scissordyn.kernel import kernel
from scissordyn.units import Quantity


@kernel
def gap(travel, speed, limit):
    """Return the travel beyond the stop [m] and its rate [m/s]."""
    return travel - limit, speed


@kernel
def force(travel, speed, mode, approach_speed, effective_mass, stiffness, exponent, damping, limit):
    """Return the force along the direction of travel [N], elastic energy [J] and dissipated power [W]."""
    depth = travel - limit
    normal, energy, dissipation = push(mode, approach_speed, effective_mass, depth, speed, stiffness, exponent, damping)
    return -normal, energy, dissipation


@component(
    port=TRAVEL,
    force=force,
    gap=gap,
    label="end stop",
    context=("mode", "approach_speed", "effective_mass"),
    symbol="stop",
    example={"point": "slider.centre", "direction": "90 deg", "limit": "1.5 m"},
    source="Flores, Machado, Silva and Martins 2011, doi:10.1007/s11044-010-9237-4",
)
class TravelStop:
    r"""End stop of a travelling point: beyond a line across its direction a force pushes it back.

    .. math:: F = K\delta^n\left(1 + \xi\,\dot\delta/v\right)

    v is the speed at the touch, or more where the stop is loaded later. xi is the damping factor of Flores et al. 2011 for the
    restitution coefficient, an approximation: a free body rebounds with 0.470 of its speed for a coefficient of 0.5, and with
    0.069 for 0.1.
    """

    name: str
    point: BodyPoint
    direction: Annotated[
        float, Quantity("rad", minimum=-1e4, maximum=1e4, help="direction of travel towards the stop in the fixed frame")
    ]
    limit: Annotated[float, Quantity("m", minimum=-1e4, maximum=1e4, help="coordinate along the direction at the touch")]
    stiffness: Annotated[float, Quantity("1", above=0.0, maximum=1e18, help="K, in N/m^n with the n given here")] = 1e8
    exponent: Exponent = 1.5
    restitution: Restitution = 0.5

    def parameters(self, start: tuple[float, ...]) -> tuple[float, ...]:
        """Return the stiffness K [N/m^n], exponent n and damping factor xi of the stop, and its position [m]."""
        return self.stiffness, self.exponent, stop_damping(self.restitution), self.limit
