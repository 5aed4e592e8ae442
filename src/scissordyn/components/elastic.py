"""What beam elements and bars that bend as one part declare alike: bounds of their numbers, loads of temperatures."""

from __future__ import annotations

from typing import Annotated, Any

from scissordyn.errors import InputError
from scissordyn.units import Quantity

AxialStiffness = Annotated[float, Quantity("N", above=0.0, maximum=1e18, help="axial stiffness EA")]
BendingStiffness = Annotated[float, Quantity("N m^2", above=0.0, maximum=1e18, help="bending stiffness EI")]
Depth = Annotated[float, Quantity("m", minimum=0.0, help="depth of the section in the plane, 0 if unknown")]
Modulus = Annotated[float, Quantity("Pa", minimum=0.0, help="Young's modulus, 0 if unknown")]
OF_SECTIONS = "the section or material of the bar, from which the masses of its cross-sections follow, too"
YieldStrength = Annotated[float, Quantity("Pa", minimum=0.0, help="yield strength, 0 if unknown")]
Damping = Annotated[float, Quantity("s", minimum=0.0, maximum=1e3, help="damping time tau: loss factor over angular frequency")]
EXPANSION = Quantity("1/K", minimum=0.0, maximum=1e-2, help="coefficient of thermal expansion alpha")
Expansion = Annotated[float, EXPANSION]
Warmer = Annotated[float, Quantity("K", minimum=-2000.0, maximum=2000.0, help="temperature Delta T over that of assembly")]
Across = Annotated[
    float, Quantity("K", minimum=-2000.0, maximum=2000.0, help="difference Delta T_h linear over the depth, warmer at -y")
]


def check_depth(bar: Any, what: str) -> None:
    """Refuse a temperature difference across an unknown depth, with what the bar is."""
    if bar.temperature_difference and not bar.depth:
        raise InputError(f"{what} with a temperature difference across an unknown depth", "a depth > 0")


def node_inertia(mass_per_length: float, length: float) -> float:
    """What an element adds to the moment of inertia of the cross-section at each of its ends [kg m^2]."""
    return mass_per_length * length**3 / 105.0


def thermal_loads(bar: Any) -> tuple[float, float]:
    """Strain [1] and curvature [1/m] that temperatures give a bar without stress."""
    gradient = bar.temperature_difference / bar.depth if bar.depth else 0.0
    return bar.thermal_expansion * bar.temperature_rise, bar.thermal_expansion * gradient
