"""Drag of a fluid on a point of a body."""

from __future__ import annotations

import math
from typing import Annotated

from scissordyn.components.declaration import component
from scissordyn.components.place import BodyPoint, Point
from scissordyn.components.port import POINT
from scissordyn.errors import InputError
from scissordyn.kernel import kernel
from scissordyn.plugin.element import numbers
from scissordyn.units import Quantity


@kernel
def force(x_rate, y_rate, damping, quadratic, flow_x, flow_y):
    """Return both components of the force [N], no stored energy, dissipated power [W] and the power that the flow gives [W]."""
    u, v = x_rate - flow_x, y_rate - flow_y
    factor = damping + quadratic * math.sqrt(u * u + v * v)
    return -factor * u, -factor * v, 0.0, factor * (u * u + v * v), -factor * (u * flow_x + v * flow_y)


@component(
    port=POINT,
    force=force,
    supplied=True,
    symbol="arrow",
    example={"point": "rod.end", "drag_coefficient": 1.2, "area": "0.05 m^2", "flow": "2, 0 m/s"},
    source="Batchelor 2000, An Introduction to Fluid Dynamics, Cambridge University Press",
)
class Drag:
    r"""Drag of a fluid on a point of a body, against the velocity of the point relative to the fluid.

    .. math:: \mathbf F = -\left(c + \tfrac12 \rho\,C_d A\,|\mathbf w|\right)\mathbf w,\qquad \mathbf w = \mathbf v - \mathbf u

    The first part is that of slow, viscous flow, the second that of fast flow. The force does not depend on the direction of
    the body, and there is neither lift, buoyancy nor added mass.
    """

    name: str
    point: BodyPoint
    damping: Annotated[float, Quantity("N s/m", minimum=0.0, maximum=1e12, help="coefficient c of slow flow")] = 0.0
    drag_coefficient: Annotated[float, Quantity("1", minimum=0.0, maximum=1e3, help="coefficient C_d of fast flow")] = 0.0
    area: Annotated[float, Quantity("m^2", minimum=0.0, maximum=1e8, help="area A that C_d refers to")] = 0.0
    density: Annotated[float, Quantity("kg/m^3", above=0.0, maximum=1e5, help="density rho of the fluid, by default air")] = 1.2
    flow: Annotated[Point, Quantity("m/s", minimum=-1e4, maximum=1e4, help="velocity u of the fluid")] = (0.0, 0.0)

    def check(self) -> None:
        if (self.drag_coefficient > 0.0) != (self.area > 0.0) or not self.damping + self.area > 0.0:
            raise InputError(
                f"drag '{self.name}': damping = {self.damping:g}, drag_coefficient = {self.drag_coefficient:g}, "
                f"area = {self.area:g}",
                "a damping, or both a drag_coefficient and an area, above 0",
                'drag_coefficient = 1.2, area = "0.05 m^2"',
            )

    def parameters(self, start: tuple[float, ...]) -> tuple[float, ...]:
        """Return c [N s/m], rho C_d A/2 [kg/m] and the velocity of the fluid [m/s]."""
        quadratic = 0.5 * self.density * self.drag_coefficient * self.area
        return numbers(self, quadratic=quadratic, flow_x=self.flow[0], flow_y=self.flow[1])
