"""Controlled bodies in a case file: controller, reference motion, feed-forward torque and sensor."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

from scissordyn.component.actuator import Actuator
from scissordyn.component.place import GROUND
from scissordyn.component.time_function import ConstantSpeed, OverTime, Tabulated, TimeFunction
from scissordyn.config.code import AbsentPart, code_of
from scissordyn.config.law import named_tables
from scissordyn.config.table import About, Context, Table, build, read_as, reader, toml
from scissordyn.config.time_function import read_tabulated, table_shape
from scissordyn.control.catalogue import CONTROLLERS
from scissordyn.control.controller import Controller
from scissordyn.errors import InputError, did_you_mean
from scissordyn.model.mechanism import Mechanism
from scissordyn.run.feed_forward import feed_forward
from scissordyn.units import quantities

SAMPLE: dict[str, Any] = {"name": "pid", "proportional": "2e4 N m/rad", "derivative": "1500 N m s/rad"}
TORQUES = 'feed_forward = { time = "0 0.1 0.2 0.3 0.4 0.5 s", torque = "0 1 2 3 4 5 N m" }'
USER_FILE = "a class or function in a file as my_control.py:steer"


@reader(lambda: named_tables("name", CONTROLLERS))
def _read_controller(given: Any, context: Context) -> Controller:
    parameters = dict(given) if isinstance(given, Mapping) else {"name": given}
    name, sample = parameters.pop("name", None), f"controller = {toml(SAMPLE)}"
    allowed = ", ".join(CONTROLLERS) + f", or {USER_FILE}"
    if not isinstance(name, str):
        raise InputError("no name of a controller", allowed, sample)
    code = code_of(context)
    kind: Any = code.element("controller", name, parameters) if code.names(name) else CONTROLLERS.get(name)
    if kind is None:
        raise InputError(f"unknown controller '{name}'{did_you_mean(name, CONTROLLERS)}", allowed, sample)
    controller: Controller = kind if isinstance(kind, AbsentPart) else build(kind, parameters, context)  # type: ignore[assignment]
    return controller


read_as(Controller, _read_controller)


@reader(lambda: {"anyOf": [{"const": "ideal"}, table_shape("N m")]})
def _read_torques(given: Any, context: Context) -> str | Tabulated:
    if given == "ideal":
        return "ideal"
    if not isinstance(given, Mapping) or set(given) != {"time", "torque"}:
        raise InputError("not a feed-forward torque", '"ideal" for that of the ideal mechanism, or a table', TORQUES)
    return read_tabulated(given, Path(), "N m")


class ControlTable(Table):
    """A controlled torque in place of a drive."""

    controller: Annotated[Controller, About("scissordyn controllers lists them", examples=[SAMPLE])]
    body: Annotated[str, About("the body on which the torque acts", examples=["unit 1/bar 1"])] = ""
    reference: Annotated[
        TimeFunction | None,
        OverTime("rad", "the reference angle over time"),
        About("the reference angle; that of the body's [drive] without it", examples=[{"speed": "20 rpm"}]),
    ] = None
    feed_forward: Annotated[
        str | Tabulated | None,
        _read_torques,
        About("torque to add: that of the ideal mechanism with rigid bars, or a table", examples=["ideal"]),
    ] = None
    sensor: Annotated[str, About('a joint, whose eccentricity is measured, or a point "BODY.POINT"', examples=["A"])] = ""
    inertia: Annotated[float, quantities(Actuator)["inertia"]] = 0.0
    base: Annotated[str, About("the body against which it acts and measures, or the ground")] = GROUND
    start_on_reference: Annotated[bool, About("whether the body starts at the reference's angle and speed")] = True
    name: Annotated[str, About("name of the actuator", examples=["servo"])] = ""

    def applied(self, mechanism: Mechanism, *, until: float) -> Mechanism:
        reference, body = self.reference, self.body or mechanism.input_body
        if reference is None:
            reference = next((drive.motion for drive in mechanism.drives if drive.body == body), None)
        torque = self.feed_forward
        if isinstance(torque, str):
            if self.base != GROUND:
                raise InputError(f"feed_forward = {torque!r} against body '{self.base}'", "a table of torques over time")
            torque = feed_forward(mechanism, reference or ConstantSpeed(0.0), until=until, body=self.body)
        return mechanism.controlled(
            self.controller,
            reference=reference,
            body=self.body,
            feed_forward=torque,
            sensor=self.sensor or None,
            inertia=self.inertia,
            start_on_reference=self.start_on_reference,
            base=self.base,
            name=self.name,
        )
