"""Cross-sections and materials of flexible bars."""

from __future__ import annotations

import inspect
import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Annotated

from scissordyn.errors import InputError, did_you_mean
from scissordyn.units import Quantity, check_quantities, documented


@documented
@dataclass(frozen=True)
class Section:
    """Cross-section properties for bending in the plane."""

    area: Annotated[float, Quantity("m^2", above=0.0, help="area")]
    second_moment: Annotated[float, Quantity("m^4", above=0.0, help="second moment of area about the axis across the plane")]
    depth: Annotated[float, Quantity("m", above=0.0, help="twice the distance of the extreme fibre from the neutral axis")]

    def __post_init__(self) -> None:
        check_quantities(self, "section")


@documented
@dataclass(frozen=True)
class StructuralMaterial:
    """Material of a bar."""

    youngs_modulus: Annotated[float, Quantity("Pa", above=0.0, help="Young's modulus")]
    density: Annotated[float, Quantity("kg/m^3", above=0.0, help="density")]
    yield_strength: Annotated[float, Quantity("Pa", above=0.0, help="yield strength or 0.2 % proof stress")]
    source: str = "the user"
    thermal_expansion: Annotated[float, Quantity("1/K", minimum=0.0, maximum=1e-2, help="coefficient of thermal expansion")] = (
        0.0
    )

    def __post_init__(self) -> None:
        check_quantities(self, "material")


MATERIALS: Mapping[str, StructuralMaterial] = MappingProxyType(
    {
        "steel": StructuralMaterial(210e9, 7850.0, 235e6, "EN 1993-1-1, S235", 12e-6),
        "aluminium": StructuralMaterial(70e9, 2700.0, 250e6, "EN 1999-1-1, 6082-T6", 23e-6),
        "titanium": StructuralMaterial(114e9, 4430.0, 880e6, "Ti-6Al-4V, typical data sheet values", 8.6e-6),
    }
)
"""Materials of flexible bars by name, with nominal values."""


def _box(width: float, depth: float, wall: float) -> Section:
    """Return the section of a rectangular tube."""
    _check_wall(wall, min(width, depth))
    w, d = width - 2.0 * wall, depth - 2.0 * wall
    return Section(width * depth - w * d, (width * depth**3 - w * d**3) / 12.0, depth)


def _pipe(diameter: float, wall: float) -> Section:
    """Return the section of a round tube."""
    _check_wall(wall, diameter)
    inside = diameter - 2.0 * wall
    return Section(0.25 * math.pi * (diameter**2 - inside**2), math.pi / 64.0 * (diameter**4 - inside**4), diameter)


def _rectangle(width: float, depth: float) -> Section:
    """Return a solid rectangular section."""
    return Section(width * depth, width * depth**3 / 12.0, depth)


def _rod(diameter: float) -> Section:
    """Return a solid round section."""
    return Section(0.25 * math.pi * diameter**2, math.pi / 64.0 * diameter**4, diameter)


def _angle(width: float, depth: float, wall: float) -> Section:
    """Return an angle section with sharp corners, about the axis parallel to its leg `width`; shear offset neglected."""
    _check_wall(wall, min(width, depth), walls=1)
    flat, upright = (width - wall) * wall, depth * wall
    area = flat + upright
    height = (flat * 0.5 * wall + upright * 0.5 * depth) / area
    second = (width - wall) * wall**3 / 12.0 + flat * (height - 0.5 * wall) ** 2
    second += wall * depth**3 / 12.0 + upright * (0.5 * depth - height) ** 2
    return Section(area, second, 2.0 * max(height, depth - height))


def _check_wall(wall: float, across: float, walls: int = 2) -> None:
    """Raise `InputError` if the walls do not fit next to each other."""
    if not walls * wall < across:
        raise InputError(
            f"a section {across * 1e3:g} mm across cannot have a wall of {wall * 1e3:g} mm",
            f"a wall below {across / walls * 1e3:g} mm",
            'section = "tube 60x60x1.5 mm"',
        )


SECTIONS: Mapping[str, tuple[Mapping[int, Callable[..., Section]], str]] = MappingProxyType(
    {
        "tube": ({3: _box, 2: _pipe}, "tube 60x60x1.5 mm (width, depth, wall) or tube 50x2 mm (diameter, wall)"),
        "box": ({3: _box}, "box 80x40x3 mm (width, depth, wall)"),
        "solid": ({2: _rectangle, 1: _rod}, "solid 20x30 mm (width, depth) or solid 25 mm (diameter)"),
        "angle": ({3: _angle}, "angle 40x40x4 mm (width, depth, wall)"),
        "strip": ({2: _rectangle}, "strip 30x2 mm (width, thickness in the plane)"),
    }
)
"""Kinds of bar sections by name: functions that compute a section, by count of dimensions, and examples of its text.

The depth lies in the plane of motion.
"""

UNITS = {"mm": 1e-3, "cm": 1e-2, "m": 1.0, "in": 0.0254}  # Length of each unit of a bar section's dimensions [m]
# Pattern of the text of a bar section, "tube 60x60x1.5 mm": kind, dimensions and unit
SECTION_PATTERN = re.compile(r"\s*([a-z]+)\s+([-+0-9.e]+(?:\s*x\s*[-+0-9.e]+)*)\s*([a-z]+)\s*")


def read_section(text: str | Section) -> Section:
    """Return a section from its text, such as ``"tube 60x60x1.5 mm"``."""
    if isinstance(text, Section):
        return text
    maker, numbers, unit = _parse_section(text)
    return maker(*(number * UNITS[unit] for number in numbers))


def with_dimension(text: str, name: str, value: float) -> str:
    """Return the text of a section with another dimension, such as its wall [m]."""
    maker, numbers, unit = _parse_section(text)
    dimensions = list(inspect.signature(maker).parameters)
    if name not in dimensions:
        raise InputError(
            f"section '{text}' has no '{name}'{did_you_mean(name, dimensions)}",
            ", ".join(dimensions),
            f"section.{dimensions[-1]}",
        )
    numbers[dimensions.index(name)] = value / UNITS[unit]
    return f"{text.split()[0]} {'x'.join(f'{number:.12g}' for number in numbers)} {unit}"


def _parse_section(text: str) -> tuple[Callable[..., Section], list[float], str]:
    """Split the text of a section into its function, dimensions and unit."""
    match = SECTION_PATTERN.fullmatch(str(text))
    kind = match[1] if match else str(text).split(" ")[0]
    allowed = "; ".join(sample for _, sample in SECTIONS.values())
    if kind not in SECTIONS:
        raise InputError(f"section = {text!r}{did_you_mean(kind, SECTIONS)}", allowed, 'section = "tube 60x60x1.5 mm"')
    makers, sample = SECTIONS[kind]
    try:
        numbers = [float(number) for number in re.split(r"\s*x\s*", match[2])] if match else []
    except ValueError:
        numbers = []
    if (
        match is None
        or len(numbers) not in makers
        or match[3] not in UNITS
        or not all(0.0 < number < 1e6 for number in numbers)
    ):
        raise InputError(f"section = {text!r}", sample, f'section = "{sample.split(" (")[0]}"')
    return makers[len(numbers)], numbers, match[3]


def read_material(name: str | StructuralMaterial) -> StructuralMaterial:
    if isinstance(name, StructuralMaterial):
        return name
    if name not in MATERIALS:
        raise InputError(f"material = {name!r}{did_you_mean(name, MATERIALS)}", ", ".join(MATERIALS), 'material = "steel"')
    return MATERIALS[name]
