"""Define ports: attachment of an element to bodies, its coordinates and its forces."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from scissordyn.components.place import GROUND
from scissordyn.components.port.stroke import Drawn, Scene, Strokes

Point = tuple[float, float]
Where = Callable[[tuple[str, Any]], Point]  # Initial position of a body's point [m]
Turned = Callable[[str], float]  # Initial angle of a body [rad]; 0 for the ground

Ends = tuple[tuple[str, str | Point | None], tuple[str, str | Point | None]]
"""Both bodies on which an element acts, each with its point: a name, coordinates in its frame, or None for a torque alone."""


@dataclass(frozen=True)
class Attachment:
    """Vector of the mechanism that is added to a pair of the six rows (u, a, b) of an element's maps."""

    row: int  # 0 for u, a point or a vector between points; 2 and 4 for the unit directions a and b of both bodies
    sign: float
    # "place": a body's point in the fixed frame [m]; "direction": the direction of a rotating body;
    # "frame": the direction of any body or the ground
    what: str
    body: str
    point: str | Point | None = None  # Point of a "place": a name, or coordinates in the body's frame [m]
    along: float | None = None  # Direction of the only component of a "place" that counts [rad]


def place(point: tuple[str, Any], sign: float = 1.0, *, along: float | None = None) -> Attachment:
    """Return the attachment of a body's point to the vector u."""
    return Attachment(0, sign, "place", *point, along)


def direction(row: int, body: str) -> Attachment:
    """Return the attachment of a rotating body's direction; nothing for other bodies."""
    return Attachment(row, 1.0, "direction", body)


def frame(row: int, body: str) -> Attachment:
    """Return the attachment of the x direction of a body or of the ground."""
    return Attachment(row, 1.0, "frame", body)


@dataclass(frozen=True)
class Output:
    """Quantity that a run reports for a component.

    Parameters
    ----------
    name : str
        Second part of the variable's name after the component's section, for example "force" in "spring_force".
    unit : str
    help : str
    first : int
        Index among the kernel's results, or among the port's coordinates.
    components : int
        1 for a scalar, 2 for a vector in the plane.
    coordinate : bool
        True for a coordinate of the port, False for a result of the kernel.
    monitored : bool
        True if its largest value is located within the steps, not only among the samples.
    """

    name: str
    unit: str
    help: str
    first: int = 0
    components: int = 1
    coordinate: bool = False
    monitored: bool = False


def ends_of(component: Any) -> Ends:
    """Return the bodies and points on which a component acts: a pair of bodies, both ends, or a point and the ground."""
    port = component.declaration.port
    if port.turning:
        body, base = (getattr(component, field) for field in port.turning)
        return (body, None), (base, None)
    end, *start = (getattr(component, field) for field in reversed(port.points))
    return end, start[0] if start else (GROUND, (0.0, 0.0))


@dataclass(frozen=True, kw_only=True)
class Port:
    """Way in which a component is attached to bodies, with its coordinates and forces; each port has its own file.

    The forces do work on the coordinates: their power on the mechanism is `sense` times the sum of force times rate.
    """

    name: str
    code: int  # Index of the port's branch in the kernels
    coordinates: tuple[str, ...]  # Arguments and leading results of the component's kernel
    rates: tuple[str, ...]
    forces: tuple[str, ...]
    points: tuple[str, ...] = ()  # Fields of the component that name a body and a point of it
    turning: tuple[str, ...] = ()  # Fields that name a body with an angle; the first must not be the ground
    numbers: tuple[str, ...] = ()  # Fields with further parameters of the attachment, such as a direction
    outputs: tuple[Output, ...] = ()
    symbols: Mapping[str, Strokes]  # Symbols of components with this port; the first is the default
    # Return the attachments of a component's maps, in order
    attachments: Callable[[Any], tuple[Attachment, ...]]
    # Return the initial coordinates from a component and the initial positions and angles
    start: Callable[[Any, Where, Turned], tuple[float, ...]]
    # Return the strokes in a `Scene`, and the position of the name, from a component and its symbol's strokes
    drawn: Callable[[Any, Strokes, Scene], Drawn]
    # Return what a component acts on; the first gets the force, the second the opposite force
    ends: Callable[[Any], Ends] = ends_of
    angle: bool = False  # True if the last coordinate is the angle of the first of these bodies relative to the second
    sense: float = 1.0  # -1 for a tension, which acts against its coordinate
