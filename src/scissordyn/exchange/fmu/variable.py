"""The variables of a unit: names, units, starts, and where they are in an instance."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from scissordyn.component.actuator import Actuator
from scissordyn.mechanics.outputs import Record
from scissordyn.mechanics.time_function import function_at
from scissordyn.plan.plan import Plan
from scissordyn.run.advance.driver import Driver


@dataclass(frozen=True)
class Variable:
    """One number of a unit."""

    name: str
    reference: int
    unit: str = ""
    description: str = ""
    start: float | bool | None = None
    place: str = ""  # In C, for an output


@dataclass(frozen=True)
class Prescribed:
    """A prescribed angle that an input can take the place of."""

    name: str
    function: int  # Which time function
    start: tuple[float, float, float]  # Angle, speed and acceleration at t = 0


@dataclass(frozen=True)
class Variables:
    """All variables of a unit, in the order of their references."""

    states: tuple[Variable, ...]
    rates: tuple[Variable, ...]
    guards: tuple[Variable, ...]
    flags: tuple[Variable, ...]
    inputs: tuple[Variable, ...]
    outputs: tuple[Variable, ...]


def prescribed(plan: Plan, driver: Driver) -> tuple[Prescribed, ...]:
    """The drives, and the references of actuators."""
    model, parameters = driver.system.content.model, driver.system.content.parameters
    motions = [(f"drives.{drive.body}", k) for k, drive in enumerate(plan.drives)]
    for i, component in enumerate(plan.acting):
        if isinstance(component, Actuator) and model.function[i] >= 0:
            motions.append((f"references.{component.name}", int(model.function[i])))
    rows = []
    for name, function in motions:
        value = np.zeros(4)
        start, stop = parameters.motion_start[function : function + 2].tolist()
        function_at(0.0, np.ascontiguousarray(parameters.motion[start:stop]), value)
        rows.append(Prescribed(name, function, (float(value[0]), float(value[1]), float(value[2]))))
    return tuple(rows)


class _Numbers:
    """References, one after the other."""

    def __init__(self) -> None:
        self.next = 1

    def take(self, rows: Iterable[tuple[str, str, str, float | bool | None, str]]) -> tuple[Variable, ...]:
        variables = [Variable(name, self.next + k, *rest) for k, (name, rest) in enumerate((row[0], row[1:]) for row in rows)]
        self.next += len(variables)
        return tuple(variables)


def variables(plan: Plan, driver: Driver, record: Record) -> Variables:
    """The variables of a mechanism."""
    numbers, motions = _Numbers(), prescribed(plan, driver)
    states = driver.state.y.size
    guards = [getattr(contact, "name", str(k)) for k, contact in enumerate(plan.contacts)]
    guards += [f"component {k + 1}" for k in range(driver.state.mode.size - len(guards))]
    orders = (("angle", "rad"), ("speed", "rad/s"), ("acceleration", "rad/s2"))
    return Variables(
        states=numbers.take((f"states.{k + 1}", "", "state of the equations", None, "") for k in range(states)),
        rates=numbers.take((f"der(states.{k + 1})", "", "its rate", None, "") for k in range(states)),
        guards=numbers.take(
            (f"guards.{k + 1}", "", f"changes its sign at an event of {name}", None, "") for k, name in enumerate(guards)
        ),
        flags=numbers.take(
            (f"{motion.name}.external", "", "whether the inputs prescribe the motion", False, "") for motion in motions
        ),
        inputs=numbers.take(
            (f"{motion.name}.{name}", unit, f"prescribed {name}", motion.start[k], "")
            for motion in motions
            for k, (name, unit) in enumerate(orders)
        ),
        outputs=numbers.take(_outputs(plan, record)),
    )


def _outputs(plan: Plan, record: Record) -> list[tuple[str, str, str, float | None, str]]:
    rows: list[tuple[str, str, str, float | None, str]] = []

    def add(name: str, unit: str, what: str, array: str, *at: int) -> None:
        shape = getattr(record, array.partition(".")[0]).shape[1:]
        index = int(np.ravel_multi_index(at, shape)) if shape else 0
        head, _, tail = array.partition(".")
        place = f"&m->record.{head}.p[{index}]" + (f".{tail}" if tail else "")
        rows.append((name, unit, what, None, place))

    for b, body in enumerate(plan.bodies):
        for axis, letter in enumerate("xy"):
            add(f"bodies.{body.name}.{letter}", "m", "position of the mass centre", "position", b, axis)
        for axis, letter in enumerate("xy"):
            add(f"bodies.{body.name}.velocity_{letter}", "m/s", "velocity of the mass centre", "velocity", b, axis)
        if body.rotates:
            add(f"bodies.{body.name}.angle", "rad", "angle", "angle", b)
            add(f"bodies.{body.name}.angular_velocity", "rad/s", "angular velocity", "angular_velocity", b)
    for d, drive in enumerate(plan.drives):
        add(f"drives.{drive.body}.torque", "N.m", "torque of the drive", "torque", d)
    for j, contact in enumerate(plan.contacts):
        for axis, letter in enumerate("xy"):
            add(f"joints.{contact.name}.force_{letter}", "N", "force on the journal", "wrench", j, axis)
        for name, unit in (("normal", "N"), ("tangential", "N"), ("depth", "m"), ("slip", "m/s")):
            add(f"joints.{contact.name}.{name}", unit, CONTACT[name], f"contact.{name}", j)
    for i, component in enumerate(plan.acting):
        port = component.declaration.port
        for k, force in enumerate(port.forces):
            add(f"components.{component.name}.{force}", "", "what it exerts", "result", i, k)
        for k, coordinate in enumerate(port.coordinates):
            add(f"components.{component.name}.{coordinate}", "", "what it acts along", "coordinate", i, k)
    return rows


CONTACT = {
    "normal": "normal force",
    "tangential": "friction force",
    "depth": "indentation; the gap with a minus sign",
    "slip": "slip speed of the surfaces",
}
"""Of a contact what is an output."""
