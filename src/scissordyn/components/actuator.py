"""Torque computed by a controller."""

from __future__ import annotations

from typing import Annotated

from scissordyn.components.declaration import component
from scissordyn.components.place import GROUND, BodyPoint
from scissordyn.components.port import ACTUATOR
from scissordyn.components.time_function import OverTime, TimeFunction
from scissordyn.control.controller import Controller
from scissordyn.control.signal import check_signal
from scissordyn.errors import InputError
from scissordyn.units import Meaning, Quantity, State


@component(port=ACTUATOR, section="actuator", passive=False, motor=True, symbol="motor")
class Actuator:
    """Torque on a body relative to its base, computed by a controller.

    The controller's inputs are the reference motion, the angle and speed of the body relative to its base, and optionally the
    vector from the sensor's origin to the sensor.

    Raises
    ------
    InputError
        If the controller requires a missing sensor, or does not use the given sensor or feed-forward torque.
    """

    name: str
    body: str
    controller: Controller
    base: str = GROUND
    reference: Annotated[TimeFunction | None, OverTime("rad", "the reference angle over time")] = None
    feed_forward: Annotated[TimeFunction | None, OverTime("N m", "a torque over time for the controller")] = None
    sensor: Annotated[BodyPoint | None, Meaning("a point whose position is measured")] = None
    sensor_origin: Annotated[
        BodyPoint | None, Meaning("origin of the measured vector; by default the origin of the ground")
    ] = None
    inertia: Annotated[float, Quantity("kg m^2", minimum=0.0, maximum=1e9, help="moment of inertia of the rotor")] = 0.0
    start_on_reference: Annotated[bool, Meaning("whether the body starts at the angle and speed of the reference")] = False

    def check(self) -> None:
        if not isinstance(self.controller, Controller):
            raise InputError(f"actuator '{self.name}': controller = {self.controller!r}", "a controller", "PID(100.0)")
        if self.controller.recorded or self.controller.delay:
            check_signal(self.controller.name, self.controller.recorded)
        what = f"actuator '{self.name}' with the controller '{self.controller.name}'"
        if self.feed_forward is not None and not self.controller.uses_feed_forward:
            raise InputError(f"{what} does not use a feed-forward torque", "the controller 'feed-forward'")
        if self.sensor is None and (self.controller.uses_sensor or self.sensor_origin is not None):
            raise InputError(f"{what} requires a sensor", "sensor=(BODY, POINT)")
        if self.start_on_reference and (self.base != GROUND or self.reference is None):
            how = "it has no reference" if self.reference is None else f"its base is '{self.base}'"
            raise InputError(
                f"actuator '{self.name}' cannot start on its reference: {how}",
                "a reference and the ground as base, or start_on_reference = False",
            )

    @property
    def states(self) -> tuple[State, ...]:
        return self.controller.states

    def parameters(self, start: tuple[float, ...]) -> tuple[float, ...]:
        """Return no parameters: the controller has them."""
        return ()
