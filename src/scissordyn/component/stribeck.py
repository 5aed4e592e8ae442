"""What friction in ideal pins and guides shares: its coefficient over the slip speed, and the fields of that."""

from __future__ import annotations

import math
from typing import Annotated

from scissordyn.kernel import kernel
from scissordyn.units import Quantity

Kinetic = Annotated[float, Quantity("1", minimum=0.0, maximum=10.0, help="coefficient of friction in motion")]
Static = Annotated[float, Quantity("1", minimum=0.0, maximum=10.0, help="at the start of motion; 0: the same")]
StribeckSpeed = Annotated[
    float, Quantity("m/s", above=0.0, maximum=1e3, help="over which friction falls from static to kinetic")
]
Transition = Annotated[float, Quantity("m/s", above=0.0, maximum=1e3, help="over which friction changes its sign")]


@kernel
def friction_ratio(slip, kinetic, static, stribeck_speed, transition):
    """Friction over normal force at a slip speed: Coulomb's with Stribeck's peak, smooth about zero."""
    peak = (static - kinetic) * math.exp(-(slip * slip) / (stribeck_speed * stribeck_speed)) if static > 0.0 else 0.0
    return (kinetic + peak) * math.tanh(slip / transition)
