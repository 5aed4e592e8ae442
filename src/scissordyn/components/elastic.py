"""Common declarations of beam elements and flexible bars: bounds of their parameters, and thermal loads."""

from __future__ import annotations

from typing import Annotated, Any

from scissordyn.errors import InputError
from scissordyn.units import Quantity

AxialStiffness = Annotated[float, Quantity("N", above=0.0, maximum=1e18, help="axial stiffness EA")]
BendingStiffness = Annotated[float, Quantity("N m^2", above=0.0, maximum=1e18, help="bending stiffness EI")]
Depth = Annotated[float, Quantity("m", minimum=0.0, help="depth of the section in the plane, 0 if unknown")]
Modulus = Annotated[float, Quantity("Pa", minimum=0.0, help="Young's modulus, 0 if unknown")]
# Parameters that errors suggest to change instead of a flexible bar's mass per length
SECTION_OR_MATERIAL = "the section or material of the bar, from which the masses of its cross-sections follow, too"
YieldStrength = Annotated[float, Quantity("Pa", minimum=0.0, help="yield strength, 0 if unknown")]
Damping = Annotated[float, Quantity("s", minimum=0.0, maximum=1e3, help="damping time tau: loss factor over angular frequency")]

# Unit, bounds and help text of thermal expansion
EXPANSION = Quantity("1/K", minimum=0.0, maximum=1e-2, help="coefficient of thermal expansion alpha")
Expansion = Annotated[float, EXPANSION]
Warmer = Annotated[float, Quantity("K", minimum=-2000.0, maximum=2000.0, help="temperature Delta T over that of assembly")]
Across = Annotated[
    float, Quantity("K", minimum=-2000.0, maximum=2000.0, help="difference Delta T_h linear over the depth, warmer at -y")
]


def check_depth(bar: Any, what: str) -> None:
    """Raise `InputError` for a temperature difference across an unknown depth; `what` names the bar."""
    if bar.temperature_difference and not bar.depth:
        raise InputError(f"{what} has a temperature difference across an unknown depth", "a depth > 0")


def node_inertia(mass_per_length: float, length: float) -> float:
    """Return the contribution of an element to the moment of inertia of each of its cross-sections [kg m^2]."""
    return mass_per_length * length**3 / 105.0


def thermal_loads(bar: Any) -> tuple[float, float]:
    """Return the strain [1] and curvature [1/m] at which a heated bar has no stress."""
    gradient = bar.temperature_difference / bar.depth if bar.depth else 0.0
    return bar.thermal_expansion * bar.temperature_rise, bar.thermal_expansion * gradient
