"""Numbers that are out of all proportion to the mechanism that they belong to: slips of a unit, more often than not."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from scissordyn.model.mechanism import Mechanism

LARGEST_CLEARANCE = 0.1
LARGEST_RADIUS = 2.0
LONGEST_BEARING = 10.0
LARGEST_GYRATION = 10.0
"""Clearance, radius of a journal, length of a bearing, radius of gyration: as parts of the mechanism's size."""

HEAVIEST, LARGEST = 1e6, 1e6  # Mass and extent of a body, over those of the lightest and the smallest one
LARGEST_ROTOR = 1e6  # Inertia of a rotor, over that of the whole mass at the distance of the mechanism's size

ADVICE = "; check its unit"


def proportion_warnings(mechanism: Mechanism) -> list[str]:
    """A warning for each number that is far beyond those of the rest of a mechanism."""
    return [*_of_contacts(mechanism), *_of_bodies(mechanism), *_of_rotors(mechanism)]


def _of_contacts(mechanism: Mechanism) -> Iterator[str]:
    size, warned = mechanism.size, set[str]()
    for contact in mechanism.contacts:
        assert contact.clearance is not None
        surfaces, name = contact.clearance.surfaces, getattr(contact, "guide", contact.name)
        radius = "corner radius" if surfaces.plane else "journal radius"
        for what, value, most in (
            ("clearance", contact.clearance.clearance, LARGEST_CLEARANCE),
            (radius, surfaces.journal_radius, LARGEST_RADIUS),
            ("bearing length", surfaces.length, LONGEST_BEARING),
        ):
            text = f"joint '{name}' has a {what} of {value:.4g} m, {value / size:.2g} times the size of the mechanism{ADVICE}"
            if value > most * size and text not in warned:  # a guide has four contact points
                warned.add(text)
                yield text


def _of_bodies(mechanism: Mechanism) -> Iterator[str]:
    bodies = mechanism.bodies
    for body in bodies:
        gyration = math.sqrt((body.inertia or 0.0) / body.mass)
        if gyration > LARGEST_GYRATION * mechanism.size:
            yield (
                f"body '{body.name}' has a radius of gyration of {gyration:.4g} m, {gyration / mechanism.size:.2g} times the "
                f"size of the mechanism{ADVICE}"
            )
    masses = {body.name: body.mass for body in bodies}
    extents = {
        body.name: max(math.dist(body.centre, point) for point in body.points.values()) for body in bodies if body.points
    }
    for what, unit, values, most in (
        ("a mass", "kg", masses, HEAVIEST),
        ("a length", "m", {name: extent for name, extent in extents.items() if extent > 0.0}, LARGEST),
    ):
        if values:
            high, low = max(values, key=values.__getitem__), min(values, key=values.__getitem__)
            if values[high] > most * values[low]:
                yield (
                    f"body '{high}' has {what} of {values[high]:.4g} {unit}, {values[high] / values[low]:.2g} times that of "
                    f"body '{low}'{ADVICE}"
                )


def _of_rotors(mechanism: Mechanism) -> Iterator[str]:
    whole = sum(body.mass for body in mechanism.bodies) * mechanism.size**2
    for component in mechanism.components:
        inertia = getattr(component, "inertia", None)
        if isinstance(inertia, float) and inertia > LARGEST_ROTOR * whole:
            yield (
                f"{component.declaration.label} '{component.name}' has a rotor of {inertia:.4g} kg m^2, {inertia / whole:.2g} "
                f"times the mass of the mechanism at its size{ADVICE}"
            )
