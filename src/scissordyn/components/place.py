"""Define attachment points of components: points of bodies, and the ground."""

from __future__ import annotations

from typing import Annotated

from scissordyn.units import Meaning

GROUND = "ground"  # Name of the fixed frame in references of joints and components
Point = tuple[float, float]  # Coordinates in a body's frame, or in the fixed frame [m]

BodyPoint = tuple[str, str]
"""Names of a body and of one of its points; the body may be "ground". The text "BODY.POINT" is equivalent."""

Reference = Annotated[BodyPoint, Meaning('a point, as "BODY.POINT" or "ground.POINT"')]
Name = Annotated[str, Meaning("name, unique among its kind")]
