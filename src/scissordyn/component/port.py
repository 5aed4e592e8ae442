"""Ports: how a component is attached to bodies, what it senses there, and what it exerts.

The kernel of a component gets the coordinates of its port and their rates. The forces that it returns do work on these
coordinates: their power on the mechanism is the sum of force times rate, for the tension of a line with a minus sign.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

__all__ = ["ACTUATOR", "FRAME", "HINGE", "LINE", "POINT", "PORTS", "TRAVEL", "Output", "Port"]


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
    """

    name: str
    unit: str
    help: str
    first: int = 0
    components: int = 1
    coordinate: bool = False


@dataclass(frozen=True)
class Port:
    """How a component is attached.

    Parameters
    ----------
    name : str
    code : int
        Branch of the kernels.
    coordinates, rates, forces : tuple of str
        Arguments and leading results of the component's kernel.
    points : tuple of str
        Fields of the component that name a body and a point of it.
    turning : tuple of str
        Fields that name a body which must have an angle, the one that may not be the ground first.
    outputs : tuple of Output
    symbols : tuple of str
        How pictures can draw a component with this port; the first is the default.
    """

    name: str
    code: int
    coordinates: tuple[str, ...]
    rates: tuple[str, ...]
    forces: tuple[str, ...]
    points: tuple[str, ...] = ()
    turning: tuple[str, ...] = ()
    outputs: tuple[Output, ...] = ()
    symbols: tuple[str, ...] = ()


LINE = Port(
    "line",
    0,
    ("length",),
    ("rate",),
    ("tension",),
    points=("start", "end"),
    outputs=(
        Output("force", "N", "force along the line, positive in tension"),
        Output("length", "m", "distance of the two points", coordinate=True),
    ),
    symbols=("line", "spring", "cable", "coil", "rod"),
)
"""Two points: their distance [m], and a tension [N] that pulls them together."""

HINGE = Port(
    "hinge",
    1,
    ("angle",),
    ("speed",),
    ("torque",),
    turning=("body", "base"),
    outputs=(
        Output("torque", "N m", "torque on the body"),
        Output("angle", "rad", "angle of the body against its base", coordinate=True),
    ),
    symbols=("hinge", "spiral", "tape", "arc", "motor", "stop", "latch"),
)
"""Two bodies: the angle of the body against its base [rad], turns counted, and a torque on the body [N m]."""

TRAVEL = Port(
    "travel",
    2,
    ("travel",),
    ("speed",),
    ("force",),
    points=("point",),
    outputs=(
        Output("force", "N", "force along the direction of travel"),
        Output("travel", "m", "coordinate along the direction of travel", coordinate=True),
    ),
    symbols=("travel", "stop"),
)
"""A point and a fixed direction: the coordinate of the point along it [m], and a force along it [N]."""

POINT = Port(
    "point",
    3,
    ("x", "y", "cosine", "sine"),
    ("x_rate", "y_rate", "cosine_rate", "sine_rate"),
    ("force_x", "force_y"),
    points=("point",),
    outputs=(Output("force", "N", "force on the point", components=2),),
    symbols=("arrow",),
)
"""A point of a body: its place in the fixed frame [m], the direction of the body's x axis, and a force on it [N]."""

FRAME = Port(
    "frame",
    4,
    ("x", "y", "angle"),
    ("x_rate", "y_rate", "speed"),
    ("force_x", "force_y", "torque"),
    points=("start", "end"),
    outputs=(
        Output("force", "N", "force on the end point, along the axes of the start's body", components=2),
        Output("torque", "N m", "torque on the end's body", first=2),
        Output("displacement", "m", "of the end from the start, along the axes of the start's body", 0, 2, coordinate=True),
        Output("angle", "rad", "angle of the end's body against the start's", first=2, coordinate=True),
    ),
    symbols=("frame", "bushing"),
)
"""Two points: where the end is from the start in the frame of the start's body [m], turns included, the angle of the end's body
against the start's [rad], and the conjugate force [N] and torque [N m] on the end."""

ACTUATOR = Port(
    "actuator",
    5,
    ("angle",),
    ("speed",),
    ("torque",),
    turning=("body", "base"),
    outputs=(Output("torque", "N m", "torque on the body"),),
    symbols=("motor",),
)
"""A hinge whose torque a controller chooses."""

PORTS: Mapping[str, Port] = MappingProxyType({port.name: port for port in (LINE, HINGE, TRAVEL, POINT, FRAME)})
"""The ports that a component of the user's own may have, by name."""
