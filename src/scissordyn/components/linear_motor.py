"""Cylinder or linear motor with a force-speed curve."""

from __future__ import annotations

from typing import Annotated

from scissordyn.components.curve import check_curve, curve_at, curve_knots
from scissordyn.components.declaration import component
from scissordyn.components.place import BodyPoint, Point
from scissordyn.components.port import LINE, Output
from scissordyn.components.time_function import Factor
from scissordyn.kernel import kernel
from scissordyn.units import Pairs

# Units and help text of the motor's force curve
CURVE = Pairs(("speeds", "forces"), ("m/s", "N"), help="the force that pushes over the speed at which it extends")


@kernel
def force(length, rate, factor, count, table):
    """Return the tension [N], and the excess of the speed beyond the curve [m/s]."""
    push, _, beyond = curve_at(rate, table, 1, int(count))  # the knots follow the scalar parameters
    return -factor * push, beyond


@component(
    port=LINE,
    force=force,
    outputs=(Output("beyond", "m/s", "how far the speed is beyond the curve", monitored=True),),
    context=("factor",),
    passive=False,
    motor=True,
    symbol="gas",
    example={
        "start": "ground.O",
        "end": "rod.end",
        "curve": {"speeds": "-0.4, 0, 0.1, 0.2, 0.4 m/s", "forces": "600, 400, 300, 0, -200 N"},
        "time_function": {"cycloidal": {"start": 0, "end": 1, "duration": "2 s"}},
    },
    source="Fritsch and Butland 1984, doi:10.1137/0905021",
)
class LinearMotor:
    """Cylinder or linear motor with a force-speed curve: it pushes its ends apart, and pulls where the force is negative.

    Between the pairs the curve is a monotone cubic (Fritsch and Butland). Beyond them the force is constant, with a warning.
    """

    name: str
    start: BodyPoint
    end: BodyPoint
    curve: Annotated[tuple[Point, ...], CURVE]
    time_function: Factor = None

    def check(self) -> None:
        check_curve(f"linear motor '{self.name}'", self.curve, CURVE)

    def parameters(self, start: tuple[float, ...]) -> tuple[float, ...]:
        """Return the number of knots, and the knots."""
        return float(len(self.curve)), *curve_knots(self.curve)
