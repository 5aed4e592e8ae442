"""Motor with a torque-speed curve."""

from __future__ import annotations

from typing import Annotated

from scissordyn.components.curve import check_curve, curve_at, curve_knots
from scissordyn.components.declaration import component
from scissordyn.components.place import GROUND, Point
from scissordyn.components.port import HINGE, Output
from scissordyn.components.time_function import Factor
from scissordyn.kernel import kernel
from scissordyn.units import Pairs, Quantity

# Units and help text of the motor's torque curve
CURVE = Pairs(("speeds", "torques"), ("rad/s", "N m"), help="the torque over the motor's speed, also below zero")


@kernel
def force(speed, factor, ratio, count, table):
    """Return the torque [N m], and the excess of the speed beyond the curve [rad/s]."""
    torque, _, beyond = curve_at(ratio * speed, table, 2, int(count))  # the knots follow the scalar parameters
    return factor * ratio * torque, beyond


@component(
    port=HINGE,
    force=force,
    outputs=(Output("beyond", "rad/s", "how far the motor's speed is beyond its curve", monitored=True),),
    context=("factor",),
    passive=False,
    motor=True,
    symbol="motor",
    example={
        "body": "crank",
        "curve": {"speeds": "-100, 0, 100, 280, 300 rpm", "torques": "4, 4, 5, 6, 0 N m"},
        "ratio": 2.0,
        "time_function": {"cycloidal": {"start": 0, "end": 1, "duration": "2 s"}},
    },
    source="Hughes and Drury 2013, Electric Motors and Drives, 4th edition, Newnes",
)
class TabulatedMotor:
    """Motor with a torque-speed curve: an asynchronous motor with its pull-out torque, a servo with its limits, an engine.

    Between the pairs the curve is a monotone cubic (Fritsch and Butland). Beyond them the torque is constant, with a warning.
    """

    name: str
    body: str
    curve: Annotated[tuple[Point, ...], CURVE]
    base: str = GROUND
    ratio: Annotated[float, Quantity("1", above=0.0, maximum=1e6, help="turns of the motor for one of the body")] = 1.0
    inertia: Annotated[
        float,
        Quantity("kg m^2", minimum=0.0, maximum=1e9, help="at the body: the rotor's times ratio^2"),
    ] = 0.0
    time_function: Factor = None

    def check(self) -> None:
        check_curve(f"tabulated motor '{self.name}'", self.curve, CURVE)

    def parameters(self, start: tuple[float, ...]) -> tuple[float, ...]:
        """Return the ratio, the number of knots, and the knots."""
        return self.ratio, float(len(self.curve)), *curve_knots(self.curve)
