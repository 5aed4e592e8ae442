"""Force that depends on the stroke of a point."""

from __future__ import annotations

from typing import Annotated

from scissordyn.components.curve import ACTS, Acts, active_fraction, check_curve, check_start, curve_at, curve_knots
from scissordyn.components.declaration import component
from scissordyn.components.place import BodyPoint, Point
from scissordyn.components.port import TRAVEL, Output
from scissordyn.components.time_function import Factor
from scissordyn.kernel import kernel
from scissordyn.units import Pairs, Quantity

# Units and help text of the load's force curve
CURVE = Pairs(("travels", "forces"), ("m", "N"), help="the force over the coordinate of the point along the direction")


@kernel
def force(travel, speed, factor, acts, transition, count, table):
    """Return the force along the direction [N], and the excess of the point's coordinate beyond the curve [m]."""
    value, _, beyond = curve_at(travel, table, 3, int(count))  # the knots follow the scalar parameters
    return factor * active_fraction(speed, acts, transition) * value, beyond


@component(
    port=TRAVEL,
    force=force,
    outputs=(Output("beyond", "m", "how far the point is beyond the curve", monitored=True),),
    context=("factor",),
    passive=False,
    symbol="travel",
    example={
        "point": "slider.centre",
        "direction": "90 deg",
        "curve": {"travels": "0, 0.6, 1.2 m", "forces": "-20, -40, 0 N"},
        "acts": "forward",
        "time_function": {"cycloidal": {"start": 0, "end": 1, "duration": "2 s"}},
    },
    source="Fritsch and Butland 1984, doi:10.1137/0905021",
)
class StrokeLoad:
    """Force on a point along a direction that depends on its coordinate in that direction: cutting, pressing, gas pressure.

    Between the pairs the curve is a monotone cubic (Fritsch and Butland). Beyond them the force is constant, with a warning.
    """

    name: str
    point: BodyPoint
    direction: Annotated[
        float, Quantity("rad", minimum=-1e4, maximum=1e4, help="direction of force and coordinate in the fixed frame")
    ]
    curve: Annotated[tuple[Point, ...], CURVE]
    acts: Acts = "both"
    transition: Annotated[
        float,
        Quantity("m/s", above=0.0, maximum=1e3, help="v_0 of a one-way force, in (1 + tanh(v/v_0))/2"),
    ] = 1e-3
    time_function: Factor = None

    def check(self) -> None:
        check_curve(f"stroke load '{self.name}'", self.curve, CURVE)

    def parameters(self, start: tuple[float, ...]) -> tuple[float, ...]:
        """Return the direction, v_0 [m/s], the number of knots, and the knots."""
        check_start(f"stroke load '{self.name}'", self.curve, start[0], "m")
        return float(ACTS.index(self.acts)), self.transition, float(len(self.curve)), *curve_knots(self.curve)
