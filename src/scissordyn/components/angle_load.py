"""Torque that depends on an angle."""

from __future__ import annotations

import math
from typing import Annotated

from scissordyn.components.curve import ACTS, KNOT_SIZE, Acts, active_fraction, check_curve, check_start, curve_at, curve_knots
from scissordyn.components.declaration import component
from scissordyn.components.place import GROUND, Point
from scissordyn.components.port import HINGE, Output
from scissordyn.components.time_function import Factor
from scissordyn.kernel import kernel
from scissordyn.units import Meaning, Pairs, Quantity

# Units and help text of the torque curve of the load
CURVE = Pairs(("angles", "torques"), ("rad", "N m"), help="the torque over the angle against the base, turns counted")

SCALARS = ("acts", "transition", "periodic", "count")  # names of the kernel's parameters before the table of knots
FIRST_KNOT = len(SCALARS)  # Index of the first knot in the kernel's parameters


@kernel
def force(angle, speed, factor, acts, transition, periodic, count, table):
    """Return the torque [N m], and the distance of the angle from the ends of the curve, 0 within it [rad].

    `factor` is the value of the time function, `acts` an index of `curve.ACTS`.
    """
    place, knots = angle, int(count)
    if periodic == 1.0:
        start, end = table[FIRST_KNOT], table[FIRST_KNOT + KNOT_SIZE * (knots - 1)]
        place = angle - (end - start) * math.floor((angle - start) / (end - start))
    value, _, beyond = curve_at(place, table, FIRST_KNOT, knots)
    return factor * active_fraction(speed, acts, transition) * value, beyond


@component(
    port=HINGE,
    force=force,
    outputs=(Output("beyond", "rad", "how far the angle is beyond the curve", monitored=True),),
    context=("factor",),
    passive=False,
    symbol="arc",
    example={
        "body": "crank",
        "curve": {"angles": "0, 90, 180, 360 deg", "torques": "0, 1.5, 0, 0 N m"},
        "periodic": True,
        "time_function": {"cycloidal": {"start": 0, "end": 1, "duration": "2 s"}},
    },
    source="Fritsch and Butland 1984, doi:10.1137/0905021",
)
class AngleLoad:
    """Torque on a body relative to its base that depends on their angle: cutting, cogging, the gas torque of an engine.

    Between the pairs the curve is a monotone cubic (Fritsch and Butland). Beyond them the torque is constant, with a warning.
    """

    name: str
    body: str
    curve: Annotated[tuple[Point, ...], CURVE]
    base: str = GROUND
    periodic: Annotated[bool, Meaning("whether the curve repeats, with the range of its angles as period")] = False
    acts: Acts = "both"
    transition: Annotated[
        float,
        Quantity("rad/s", above=0.0, maximum=1e4, help="w_0 of a one-way torque, in (1 + tanh(w/w_0))/2"),
    ] = 1e-2
    time_function: Factor = None

    def check(self) -> None:
        check_curve(f"angle load '{self.name}'", self.curve, CURVE, periodic=self.periodic)

    def parameters(self, start: tuple[float, ...]) -> tuple[float, ...]:
        """Return the direction, w_0 [rad/s], 1 for a periodic curve, the number of knots, and the knots."""
        if not self.periodic:
            check_start(f"angle load '{self.name}'", self.curve, start[0], "rad")
        knots = curve_knots(self.curve, periodic=self.periodic)
        return float(ACTS.index(self.acts)), self.transition, float(self.periodic), float(len(self.curve)), *knots
