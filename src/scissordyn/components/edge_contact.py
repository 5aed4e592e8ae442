"""Contact of a disc or point of one body with a straight edge, a bar or a disc of another body."""

from __future__ import annotations

import math
from typing import Annotated

import numpy as np

from scissordyn.components.declaration import component
from scissordyn.components.pin_friction import Static, StribeckSpeed, Transition, friction_ratio
from scissordyn.components.place import BodyPoint
from scissordyn.components.port import FRAME, Output
from scissordyn.components.port.stroke import arc
from scissordyn.components.stop import START_DEPTH_FRACTION, push, stop_damping
from scissordyn.errors import InputError
from scissordyn.kernel import kernel
from scissordyn.plugin.element import numbers
from scissordyn.units import Meaning, Quantity

UNLIMITED = -1.0  # Length of an edge without ends, in the parameters of the kernels


@kernel
def distance(x, y, along_x, along_y, length):
    """Return the distance of a point from the edge [m], and the unit vector from the edge towards the point.

    An edge without ends bounds a half plane on its right; the distance of a point in it is negative.
    """
    if length < 0.0:
        return along_x * y - along_y * x, -along_y, along_x
    place = min(length, max(0.0, along_x * x + along_y * y))
    dx, dy = x - place * along_x, y - place * along_y
    far = math.sqrt(dx * dx + dy * dy)
    return (far, dx / far, dy / far) if far > 0.0 else (0.0, -along_y, along_x)


@kernel
def indentation(x, y, x_rate, y_rate, reach, length, along_x, along_y):
    """Return the indentation [m], its rate [m/s], and the unit vector from the edge towards the disc."""
    far, nx, ny = distance(x, y, along_x, along_y, length)
    return reach - far, -(nx * x_rate + ny * y_rate), nx, ny


@kernel
def gap(
    x,
    y,
    angle,
    x_rate,
    y_rate,
    speed,
    mode,
    approach_speed,
    effective_mass,
    stiffness,
    exponent,
    damping,
    radius,
    reach,
    length,
    along_x,
    along_y,
    kinetic,
    static,
    stribeck_speed,
    transition,
):
    """Return the indentation [m] and its rate [m/s]."""
    depth, rate, _, _ = indentation(x, y, x_rate, y_rate, reach, length, along_x, along_y)
    return depth, rate


@kernel
def force(
    x,
    y,
    angle,
    x_rate,
    y_rate,
    speed,
    mode,
    approach_speed,
    effective_mass,
    stiffness,
    exponent,
    damping,
    radius,
    reach,
    length,
    along_x,
    along_y,
    kinetic,
    static,
    stribeck_speed,
    transition,
):
    """Return force and torque on the disc, elastic energy [J], dissipated power [W], normal force and friction [N]."""
    depth, rate, nx, ny = indentation(x, y, x_rate, y_rate, reach, length, along_x, along_y)
    normal, energy, lost = push(mode, approach_speed, effective_mass, depth, rate, stiffness, exponent, damping)
    slip = nx * y_rate - ny * x_rate - radius * speed  # of the disc's lowest point, to the left of the normal
    friction = normal * friction_ratio(slip, kinetic, static, stribeck_speed, transition)
    across_x, across_y = normal * nx + friction * ny, normal * ny - friction * nx
    return across_x, across_y, radius * friction, energy, lost + friction * slip, normal, friction


@component(
    port=FRAME,
    force=force,
    gap=gap,
    outputs=(
        Output("normal", "N", "force across the edge"),
        Output("friction", "N", "friction force, positive against slip to the left of the normal"),
    ),
    context=("mode", "approach_speed", "effective_mass"),
    symbol="edge",
    example={"start": "ground.O", "end": "rod.end", "direction": "-90 deg", "radius": "20 mm", "stiffness": 1e6},
    events=("left", "reached"),
    source="Flores, Machado, Silva and Martins 2011, doi:10.1007/s11044-010-9237-4 (the factor xi)",
)
class EdgeContact:
    r"""Contact of a disc or point with a straight edge: a floor, the side of a bar, or the rim of another disc.

    .. math:: F = K\delta^n\left(1 + \xi\,\dot\delta/v\right),\quad \delta = R + w - d,\quad
        T = F\left(\mu_k + (\mu_s - \mu_k) e^{-(v_t/v_s)^2}\right)\tanh\frac{v_t}{v_0}

    d is the distance of the disc's centre from the axis of the edge. An edge of given length has round ends of radius w and two
    sides, as a bar has; of length 0 it is a disc. Without a length it has no ends, and everything on its right is solid.
    Both bodies are pushed at the same point. v is the speed at the touch, or more where the contact is loaded later.
    Below the slip speed v_0 friction creeps: it holds nothing at rest.
    """

    name: str
    start: Annotated[BodyPoint, Meaning("a point of the edge's axis, its beginning if it has a length")]
    end: Annotated[BodyPoint, Meaning("centre of the disc, or the point")]
    direction: Annotated[
        float, Quantity("rad", minimum=-1e4, maximum=1e4, help="direction of the edge in the frame of its body")
    ] = 0.0
    length: Annotated[
        float | None, Quantity("m", minimum=0.0, maximum=1e4, help="length of the edge's axis; no ends if it is not given")
    ] = None
    half_width: Annotated[float, Quantity("m", minimum=0.0, maximum=1e3, help="half the width w of the bar with the edge")] = (
        0.0
    )
    radius: Annotated[float, Quantity("m", minimum=0.0, maximum=1e3, help="radius R of the disc, 0 for a point")] = 0.0
    stiffness: Annotated[float, Quantity("1", above=0.0, maximum=1e18, help="K, in N/m^n with the n given here")] = 1e8
    exponent: Annotated[float, Quantity("1", minimum=1.0, maximum=5.0, help="n")] = 1.5
    restitution: Annotated[float, Quantity("1", minimum=0.01, maximum=1.0, help="restitution coefficient")] = 0.5
    kinetic: Annotated[float, Quantity("1", minimum=0.0, maximum=10.0, help="coefficient of friction in motion")] = 0.0
    static: Static = 0.0
    stribeck_speed: StribeckSpeed = 0.01
    transition: Transition = 1e-3

    def check(self) -> None:
        if self.length is not None and self.reach == 0.0:
            raise InputError(f"edge_contact '{self.name}': a point and an edge without width", "radius or half_width above 0")

    @property
    def reach(self) -> float:
        """Distance of the disc's centre from the edge's axis at the touch [m]."""
        return self.radius + self.half_width

    def parameters(self, start: tuple[float, ...]) -> tuple[float, ...]:
        """Return the kernel's parameters, with the direction as a unit vector; raise `InputError` for a start in the edge."""
        along = math.cos(self.direction), math.sin(self.direction)
        length = UNLIMITED if self.length is None else self.length
        far = float(distance(start[0], start[1], *along, length)[0])
        if self.reach > 0.0 and self.reach - far > START_DEPTH_FRACTION * self.reach:
            raise InputError(
                f"edge_contact '{self.name}': the disc starts {1e3 * (self.reach - far):.4g} mm deep in the edge",
                f"its centre at least {1e3 * self.reach:.4g} mm from the edge's axis, on the left of an edge without ends",
            )
        given = {"damping": stop_damping(self.restitution), "reach": self.reach, "length": length}
        return numbers(self, **given, along_x=along[0], along_y=along[1])

    @property
    def outline(self) -> tuple[np.ndarray, np.ndarray]:
        """Outlines for pictures: the edge in the frame of its body, and the disc about its centre [m]; none without ends."""
        disc = arc(self.radius, 0.0, 360.0, 37)
        if self.length is None:
            return np.empty((0, 2)), disc
        turn = math.degrees(self.direction)
        along = self.length * np.array([math.cos(self.direction), math.sin(self.direction)])
        ends = arc(self.half_width, turn + 90.0, turn + 270.0, 19), arc(self.half_width, turn - 90.0, turn + 90.0, 19) + along
        return np.concatenate([*ends, ends[0][:1]]), disc
