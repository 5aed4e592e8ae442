"""A motor whose torque over its speed is a curve."""

from __future__ import annotations

from typing import Annotated

from scissordyn.component.curve import check_curve, curve_at, curve_numbers
from scissordyn.component.declaration import check_attachment, component
from scissordyn.component.place import GROUND, Point
from scissordyn.component.port import HINGE, Output
from scissordyn.component.time_function import TimeFunction
from scissordyn.kernel import kernel
from scissordyn.units import Pairs, Quantity, check_quantities

CURVE = Pairs(("speeds", "torques"), ("rad/s", "N m"), help="the torque over the speed of the body against its base")

FIRST = 2


@kernel
def force(angle, speed, factor, ratio, count, table):
    """Torque [N m], and how far the speed is beyond the curve [rad/s]."""
    torque, _, beyond = curve_at(ratio * speed, table, FIRST, int(count))
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
)
class TabulatedMotor:
    """A motor by its torque-speed curve: an asynchronous motor with its pull-out torque, a servo with its limits, an engine.

    Between the pairs the curve is a monotone cubic (Fritsch and Butland), beyond them the torque stays, and there is a warning.

    Parameters
    ----------
    name : str
    body, base : str
        Rotor side and stator side; the base may be "ground".
    curve : tuple of (float, float)
        Speeds of the motor [rad/s], increasing, also those below zero that occur, and torques [N m].
    ratio : float
        Of a gear without losses: turns of the motor for one turn of the body.
    inertia : float
        Of the rotor and gear, turning with the body [kg m^2]: that of a rotor behind the gear times the square of the ratio.
    time_function : TimeFunction, optional
        A factor of the torque over time, 0 for a motor that is off; 1 if not given.

    References
    ----------
    Hughes and Drury 2013, Electric Motors and Drives, 4th edition, Newnes
    """

    name: str
    body: str
    curve: Annotated[tuple[Point, ...], CURVE]
    base: str = GROUND
    ratio: Annotated[float, Quantity("1", above=0.0, maximum=1e6, help="turns of the motor for one of the body")] = 1.0
    inertia: Annotated[float, Quantity("kg m^2", minimum=0.0, maximum=1e9, help="of the rotor, at the body")] = 0.0
    time_function: TimeFunction | None = None

    def __post_init__(self) -> None:
        label = f"tabulated motor '{self.name}'"
        check_quantities(self, label)
        check_attachment(self)
        check_curve(label, self.curve, CURVE)

    def parameters(self, start: tuple[float, ...]) -> tuple[float, ...]:
        """The ratio, how many knots, and these."""
        return self.ratio, float(len(self.curve)), *curve_numbers(self.curve)
