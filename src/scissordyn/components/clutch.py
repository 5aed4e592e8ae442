"""Friction clutch or brake between two bodies."""

from __future__ import annotations

from typing import Annotated

from scissordyn.components.declaration import component
from scissordyn.components.place import GROUND
from scissordyn.components.port import HINGE
from scissordyn.components.time_function import Factor
from scissordyn.units import Quantity, State


def force(speed, load, factor, capacity, yield_angle):
    """Return torque [N m], stored energy [J], dissipated power [W] and s' [1/s]; `load` is s, the used part of the capacity."""
    torque = factor * capacity * load
    return -torque, 0.0, torque * speed, (speed - abs(speed) * load) / yield_angle


@component(
    port=HINGE,
    force=force,
    states=(State("load", "1", scale=1.0),),
    context=("factor",),
    symbol="hinge",
    example={
        "body": "rod",
        "base": "crank",
        "capacity": "2 N m",
        "yield_angle": "0.5 deg",
        "time_function": {"cycloidal": {"start": 0, "end": 1, "duration": "0.1 s"}},
    },
    source="Dahl 1976, Solid friction damping of mechanical vibrations, doi:10.2514/3.61511",
)
class Clutch:
    r"""Friction clutch or brake: its linings twist elastically, and slip as the torque approaches the capacity.

    .. math:: T = -M(t)\,s,\quad \theta_s s' = \omega - |\omega| s

    s is the part of the capacity M that is used; it tends to the sign of the speed within some yield angles. The time function
    engages and releases the clutch. The twist holds up to M theta_s/2 of energy, which counts as dissipated and is given back
    as the linings relax.
    """

    name: str
    body: str
    capacity: Annotated[float, Quantity("N m", above=0.0, maximum=1e9, help="largest torque M")]
    base: str = GROUND
    yield_angle: Annotated[float, Quantity("rad", minimum=1e-9, maximum=1.0, help="twist theta_s over which linings yield")] = (
        1e-3
    )
    time_function: Factor = None
