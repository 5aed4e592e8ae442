"""What a port is: how an element is attached to bodies, what it senses there, and what it exerts."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from scissordyn.components.place import GROUND
from scissordyn.components.port.stroke import Drawn, Scene, Strokes

Point = tuple[float, float]
Where = Callable[[tuple[str, Any]], Point]  # Where a point of a body is, as placed [m]
Turned = Callable[[str], float]  # Angle of a body, as placed [rad]; 0 for the ground

Ends = tuple[tuple[str, str | Point | None], tuple[str, str | Point | None]]
"""The two bodies that an element acts on, each with its point: a name, a place in its frame, or None for a torque alone."""


@dataclass(frozen=True)
class Attachment:
    """What a pair of the six rows of an element's maps (u, a, b) reads from the mechanism."""

    row: int  # 0 for u, a vector between two points or a point; 2 and 4 for a and b, unit directions of the two bodies
    sign: float
    # One of "place", "direction", "frame" A point of a body in the fixed frame [m]; the direction of a body that rotates;
    # that of any body, or of the ground
    what: str
    body: str
    point: str | Point | None = None  # Of a place: a name, or a place in the body's frame [m]
    along: float | None = None  # Direction [rad] along which alone a place counts


def place(point: tuple[str, Any], sign: float = 1.0, *, along: float | None = None) -> Attachment:
    """A point of a body as, or as a part of, the vector u."""
    return Attachment(0, sign, "place", *point, along)


def direction(row: int, body: str) -> Attachment:
    """The direction of a body that rotates; nothing for others."""
    return Attachment(row, 1.0, "direction", body)


def frame(row: int, body: str) -> Attachment:
    """The direction of the x axis of a body, or of the ground."""
    return Attachment(row, 1.0, "frame", body)


@dataclass(frozen=True)
class Output:
    """A quantity that a run reports for a component.

    Parameters
    ----------
    name : str
        The variable of a run is called after the component's section and this name, such as "spring_force".
    unit : str
    help : str
    first : int
        Where it stands in what the kernel returned, or among the port's coordinates.
    components : int
        1 for a number, 2 for a vector in the plane.
    coordinate : bool
        Whether it is a coordinate of the port rather than a result of the kernel.
    monitored : bool
        Whether its largest value is looked for within the steps, not among the samples alone.
    """

    name: str
    unit: str
    help: str
    first: int = 0
    components: int = 1
    coordinate: bool = False
    monitored: bool = False


def ends_of(component: Any) -> Ends:
    """What a component acts on: torques on two bodies, its end against its start, or its point against the ground."""
    port = component.declaration.port
    if port.turning:
        body, base = (getattr(component, field) for field in port.turning)
        return (body, None), (base, None)
    end, *start = (getattr(component, field) for field in reversed(port.points))
    return end, start[0] if start else (GROUND, (0.0, 0.0))


@dataclass(frozen=True, kw_only=True)
class Port:
    """How an element is attached; each of its own file says all of it.

    The forces do work on the coordinates: their power on the mechanism is `sense` times the sum of force times rate.
    """

    name: str
    code: int  # Branch of the kernels
    coordinates: tuple[str, ...]  # Arguments and leading results of the component's kernel
    rates: tuple[str, ...]
    forces: tuple[str, ...]
    points: tuple[str, ...] = ()  # Fields of the component that name a body and a point of it
    turning: tuple[str, ...] = ()  # Fields that name a body which must have an angle, the one that may not be the ground first
    numbers: tuple[str, ...] = ()  # Fields with further numbers of the attachment, such as a direction
    outputs: tuple[Output, ...] = ()
    symbols: Mapping[str, Strokes]  # How pictures can draw a component with this port; the first is the default
    # From a component to the `Attachment` of each row of its maps, in order
    attachments: Callable[[Any], tuple[Attachment, ...]]
    # From a component, where points are and how bodies are turned as placed, to the coordinates there
    start: Callable[[Any, Where, Turned], tuple[float, ...]]
    # From a component, the strokes of its symbol and a `Scene` to the strokes in the scene and the place of the name
    drawn: Callable[[Any, Strokes, Scene], Drawn]
    # From a component to what it acts on; the first gets the force, the second the opposite one
    ends: Callable[[Any], Ends] = ends_of
    angle: bool = False  # Whether the last coordinate is the angle of the first of these bodies against the second
    sense: float = 1.0  # -1 for a tension, which pulls against its coordinate
