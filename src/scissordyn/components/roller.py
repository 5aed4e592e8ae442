"""Roller on a flexible bar, or guide with clearance that runs along it."""

from __future__ import annotations

from typing import Annotated

from scissordyn.components.declaration import component
from scissordyn.components.place import BodyPoint
from scissordyn.components.port.rail import RAIL
from scissordyn.components.stop import push, stop_damping
from scissordyn.kernel import kernel
from scissordyn.units import Meaning, Quantity


@kernel
def limit(gap, gap_rate, mode, approach_speed, effective_mass, stiffness, damping, clearance, factor):
    """Return the distance [m] by which the point is beyond the clearance on the nearer side of the bar, and its rate [m/s]."""
    if clearance == 0.0:
        return -1.0, 0.0
    side = 1.0 if gap > 0.0 else -1.0
    return side * gap - clearance, side * gap_rate


@kernel
def force(gap, gap_rate, mode, approach_speed, effective_mass, stiffness, damping, clearance, factor):
    """Return the force across the bar [N], elastic energy [J] and dissipated power [W]."""
    if clearance == 0.0:
        return -stiffness * gap - damping * gap_rate, 0.5 * stiffness * gap * gap, damping * gap_rate * gap_rate
    side = 1.0 if gap > 0.0 else -1.0
    depth, rate = side * gap - clearance, side * gap_rate
    normal, energy, lost = push(mode, approach_speed, effective_mass, depth, rate, stiffness, 1.0, factor)
    return -side * normal, energy, lost


@component(
    port=RAIL,
    force=force,
    gap=limit,
    context=("mode", "approach_speed", "effective_mass"),
    symbol="roller",
    example={"point": "rod.end", "rail": "crank", "stiffness": "5 MN/m"},
    events=("left", "reached"),
    source="Flores, Machado, Silva and Martins 2011, doi:10.1007/s11044-010-9237-4 (the factor xi)",
)
class Roller:
    r"""Point that runs along a bending bar without friction: rollers on both sides of the bar, or a guide with clearance.

    .. math:: F = -K g - D \dot g, \qquad\text{or}\quad F = K\delta\,(1 + \xi\,\dot\delta/v),\ \delta = |g| - c

    g is the distance of the point from the nearest place of the bar's axis, across it, K the stiffness of the rollers. Two of
    them hold the direction of a block. The bar continues straight beyond its ends.
    v is the speed at the touch, or more where the side is loaded later. xi is the damping factor of Flores et al. 2011 for the
    restitution coefficient, an approximation: a free body rebounds with 0.470 of its speed for a coefficient of 0.5, and with
    0.069 for 0.1.
    """

    name: str
    point: BodyPoint
    rail: Annotated[str, Meaning("the bar, which bends as one part")]
    stiffness: Annotated[float, Quantity("N/m", above=0.0, maximum=1e12, help="stiffness K of the rollers against the bar")] = (
        1e7
    )
    damping: Annotated[
        float, Quantity("N s/m", minimum=0.0, maximum=1e9, help="damping D of the rollers, without clearance")
    ] = 0.0
    clearance: Annotated[
        float,
        Quantity("m", minimum=0.0, maximum=1.0, help="clearance c on either side of the bar", zero="rollers on both sides"),
    ] = 0.0
    restitution: Annotated[float, Quantity("1", minimum=0.01, maximum=1.0, help="restitution coefficient, with clearance")] = (
        0.5
    )

    def parameters(self, start: tuple[float, ...]) -> tuple[float, ...]:
        """Return K, D, c and xi."""
        return self.stiffness, self.damping, self.clearance, stop_damping(self.restitution)
