"""Spring with a force-length curve."""

from __future__ import annotations

from typing import Annotated

from scissordyn.components.curve import check_curve, check_start, curve_at, curve_knots
from scissordyn.components.declaration import component
from scissordyn.components.place import BodyPoint, Point
from scissordyn.components.port import LINE, Output
from scissordyn.kernel import kernel
from scissordyn.units import Pairs, Quantity

# Units and help text of the spring's force curve
CURVE = Pairs(("lengths", "forces"), ("m", "N"), help="tension over length; a spring that pushes has negative forces")


@kernel
def force(length, rate, damping, count, table):
    """Return the tension [N] of the spring and its damper, stored energy [J], dissipated power [W], and `beyond` [m].

    `beyond` is the distance of the length from the ends of the curve, 0 within it.
    """
    tension, energy, beyond = curve_at(length, table, 2, int(count))  # the knots follow the scalar parameters
    return tension + damping * rate, energy, damping * rate * rate, beyond


@component(
    port=LINE,
    force=force,
    outputs=(Output("beyond", "m", "how far the length is beyond the curve", monitored=True),),
    symbol="spring",
    example={
        "start": "rod.middle",
        "end": "ground.O",
        "curve": {"lengths": "0.1, 0.5, 1, 2 m", "forces": "0, 20, 100, 400 N"},
        "damping": "2 N s/m",
    },
    source="Fritsch and Butland 1984, doi:10.1137/0905021",
)
class NonlinearSpring:
    """Spring and damper between two points with a curve of tension over length: progressive, degressive or measured.

    Between the pairs the curve is a monotone cubic (Fritsch and Butland). Beyond them the force is constant, with a warning.
    The stored energy is the integral of the curve from its first length.
    """

    name: str
    start: BodyPoint
    end: BodyPoint
    curve: Annotated[tuple[Point, ...], CURVE]
    damping: Annotated[float, Quantity("N s/m", minimum=0.0, maximum=1e12, help="damping d")] = 0.0

    def check(self) -> None:
        check_curve(f"nonlinear spring '{self.name}'", self.curve, CURVE)

    def parameters(self, start: tuple[float, ...]) -> tuple[float, ...]:
        """Return the damping [N s/m], the number of knots, and the knots."""
        check_start(f"nonlinear spring '{self.name}'", self.curve, start[0], "m")
        return self.damping, float(len(self.curve)), *curve_knots(self.curve)
