"""Elastic bushing between two bodies."""

from __future__ import annotations

from typing import Annotated

from scissordyn.components.declaration import component
from scissordyn.components.place import BodyPoint
from scissordyn.components.port import FRAME
from scissordyn.errors import InputError
from scissordyn.plugin.element import numbers
from scissordyn.units import Quantity


def force(
    x,
    y,
    angle,
    x_rate,
    y_rate,
    speed,
    stiffness_x,
    stiffness_y,
    stiffness_xy,
    torsional_stiffness,
    damping_x,
    damping_y,
    damping_xy,
    torsional_damping,
    free_angle,
):
    """Return force [N] and torque [N m] on the end, stored energy [J] and dissipated power [W]."""
    twist = angle - free_angle
    elastic_x, elastic_y = stiffness_x * x + stiffness_xy * y, stiffness_xy * x + stiffness_y * y
    viscous_x, viscous_y = damping_x * x_rate + damping_xy * y_rate, damping_xy * x_rate + damping_y * y_rate
    elastic, viscous = torsional_stiffness * twist, torsional_damping * speed
    return (
        -elastic_x - viscous_x,
        -elastic_y - viscous_y,
        -elastic - viscous,
        0.5 * (elastic_x * x + elastic_y * y + elastic * twist),
        viscous_x * x_rate + viscous_y * y_rate + viscous * speed,
    )


# Unit, bounds and help text of a bushing's stiffness
STIFFNESS = Quantity("N/m", minimum=0.0, maximum=1e15, help="stiffness along an axis of the start's body, K_xx or K_yy")

# Unit, bounds and help text of a bushing's damping
DAMPING = Quantity("N s/m", minimum=0.0, maximum=1e12, help="damping along an axis of the start's body, D_xx or D_yy")


@component(
    port=FRAME,
    force=force,
    symbol="bushing",
    example={
        "start": "crank.end",
        "end": "rod.start",
        "stiffness_x": "1 MN/m",
        "stiffness_y": "1 MN/m",
        "damping_x": "50 N s/m",
    },
    source="Ambrósio and Verissimo 2009, doi:10.1007/s11044-009-9161-7, with constant stiffness and damping",
)
class Bushing:
    r"""Elastic and damped connection of two points and of the angle between their bodies.

    .. math:: F = -K\,u - D\,\dot u,\quad T = -k_t(\varphi - \varphi_0) - d_t\dot\varphi

    u is the vector from start to end in the frame of the start's body; K and D are symmetric 2 x 2 matrices.


    Raises
    ------
    InputError
        If K or D has a negative eigenvalue.
    """

    name: str
    start: BodyPoint
    end: BodyPoint
    stiffness_x: Annotated[float, STIFFNESS] = 0.0
    stiffness_y: Annotated[float, STIFFNESS] = 0.0
    stiffness_xy: Annotated[float, Quantity("N/m", minimum=-1e15, maximum=1e15, help="coupling of both axes, K_xy")] = 0.0
    torsional_stiffness: Annotated[float, Quantity("N m/rad", minimum=0.0, maximum=1e12, help="torsional stiffness k_t")] = 0.0
    damping_x: Annotated[float, DAMPING] = 0.0
    damping_y: Annotated[float, DAMPING] = 0.0
    damping_xy: Annotated[float, Quantity("N s/m", minimum=-1e12, maximum=1e12, help="coupling of both axes, D_xy")] = 0.0
    torsional_damping: Annotated[float, Quantity("N m s/rad", minimum=0.0, maximum=1e12, help="torsional damping d_t")] = 0.0
    free_angle: Annotated[
        float | None, Quantity("rad", minimum=-1e4, maximum=1e4, help="angle phi_0 without torque, or as placed")
    ] = None

    def check(self) -> None:
        for what in ("stiffness", "damping"):
            x, y, xy = (getattr(self, f"{what}_{axis}") for axis in ("x", "y", "xy"))
            if xy * xy > x * y * (1.0 + 1e-12):
                raise InputError(
                    f"bushing '{self.name}': {what}_xy = {xy:g} with {what}_x = {x:g} and {what}_y = {y:g}",
                    f"{what}_xy^2 <= {what}_x {what}_y, because otherwise the bushing generates energy",
                )

    def parameters(self, start: tuple[float, ...]) -> tuple[float, ...]:
        """Return the kernel's parameters; by default the free angle is the initial one."""
        return numbers(self, free_angle=start[2] if self.free_angle is None else self.free_angle)
