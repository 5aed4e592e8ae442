"""The variables of a unit: names, units, starts, and where they are in an instance."""

from __future__ import annotations

import itertools
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from scissordyn.component.actuator import Actuator
from scissordyn.mechanics.outputs import Record
from scissordyn.mechanics.time_function import function_at
from scissordyn.plan.plan import Plan
from scissordyn.run.advance.driver import Driver


@dataclass(frozen=True)
class Variable:
    """One number of a unit."""

    reference: int
    name: str
    unit: str = ""
    description: str = ""
    start: float | bool | None = None
    place: str = ""  # In C, for an output
    factor: float = 1.0  # Of what is there


CONTACT = {
    "normal": ("N", "normal force"),
    "tangential": ("N", "friction force"),
    "depth": ("m", "indentation; the gap with a minus sign"),
    "slip": ("m/s", "slip speed of the surfaces"),
}
"""Of a contact what is an output, with its unit."""

VALUES = {"rad": "angle", "m": "length"}  # What is prescribed, by its unit


@dataclass(frozen=True)
class Prescribed:
    """A prescribed angle or length that an input can take the place of."""

    name: str
    function: int  # Which time function
    start: tuple[float, float, float]  # Value, speed and acceleration at t = 0
    unit: str  # Of the value


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
    """The drives, the references of actuators, and the motions of coordinates and rods."""
    model, parameters = driver.system.content.model, driver.system.content.parameters
    motions = [(f"drives.{drive.body}", k, "rad") for k, drive in enumerate(plan.drives)]
    for i, component in enumerate(plan.acting):
        if isinstance(component, Actuator) and model.function[i] >= 0:
            motions.append((f"references.{component.name}", int(model.function[i]), "rad"))
    units = {drive.name: drive.coordinate.unit for drive in plan.mechanism.coordinate_drives}
    for k, function in zip(model.timed.tolist(), model.timed_function.tolist(), strict=True):
        name = plan.coordinates.constraints[k].name
        motions.append((f"{'drives' if name in units else 'rods'}.{name}", function, units.get(name, "m")))
    rows = []
    for name, function, unit in motions:
        value = np.zeros(4)
        start, stop = parameters.motion_start[function : function + 2].tolist()
        function_at(0.0, np.ascontiguousarray(parameters.motion[start:stop]), value)
        rows.append(Prescribed(name, function, (float(value[0]), float(value[1]), float(value[2])), unit))
    return tuple(rows)


def variables(plan: Plan, driver: Driver, record: Record) -> Variables:
    """The variables of a mechanism."""
    references, motions = itertools.count(1), prescribed(plan, driver)
    states = range(driver.state.y.size)
    guards = [getattr(contact, "name", str(k)) for k, contact in enumerate(plan.contacts)]
    guards += [f"component {k + 1}" for k in range(driver.state.mode.size - len(guards))]

    def group(rows: Iterable[tuple[Any, ...]]) -> tuple[Variable, ...]:
        return tuple(Variable(next(references), *row) for row in rows)

    return Variables(
        states=group((f"states.{k + 1}", "", "state of the equations") for k in states),
        rates=group((f"der(states.{k + 1})", "", "its rate") for k in states),
        guards=group((f"guards.{k + 1}", "", f"changes its sign at an event of {name}") for k, name in enumerate(guards)),
        flags=group((f"{motion.name}.external", "", "whether the inputs prescribe the motion", False) for motion in motions),
        inputs=group(
            (f"{motion.name}.{order}", motion.unit + per, f"prescribed {order}", start)
            for motion in motions
            for order, per, start in zip(
                (VALUES[motion.unit], "speed", "acceleration"), ("", "/s", "/s2"), motion.start, strict=True
            )
        ),
        outputs=group(_outputs(plan, record)),
    )


def _outputs(plan: Plan, record: Record) -> list[tuple[Any, ...]]:
    rows: list[tuple[Any, ...]] = []

    def add(name: str, unit: str, what: str, array: str, *at: int, factor: float = 1.0) -> None:
        shape = getattr(record, array.partition(".")[0]).shape[1:]
        index = int(np.ravel_multi_index(at, shape)) if shape else 0
        head, _, tail = array.partition(".")
        place = f"&m->record.{head}.p[{index}]" + (f".{tail}" if tail else "")
        rows.append((name, unit, what, None, place, factor))

    for b, body in enumerate(plan.bodies):
        for variable, prefix, unit in (("position", "", "m"), ("velocity", "velocity_", "m/s")):
            for axis, letter in enumerate("xy"):
                add(f"bodies.{body.name}.{prefix}{letter}", unit, f"{variable} of the mass centre", variable, b, axis)
        if body.rotates:
            add(f"bodies.{body.name}.angle", "rad", "angle", "angle", b)
            add(f"bodies.{body.name}.angular_velocity", "rad/s", "angular velocity", "angular_velocity", b)
    for d, drive in enumerate(plan.drives):
        add(f"drives.{drive.body}.torque", "N.m", "torque of the drive", "torque", d)
    coordinates = {part.name: part.terms[0][1] for part in plan.mechanism.coupling_parts}
    coupled = {part.name for part in plan.mechanism.couplings}
    for k, constraint in enumerate(plan.coordinates.constraints):
        if constraint.linear and constraint.name in coordinates:
            name, turns = constraint.name, coordinates[constraint.name].unit == "rad"
            label = f"{'couplings' if name in coupled else 'drives'}.{name}.{'torque' if turns else 'force'}"
            unit, what = "N.m" if turns else "N", "on the output of the coupling" if name in coupled else "of the drive"
            add(label, unit, what, "multiplier", k, factor=-1.0 / constraint.scale)
    for j, contact in enumerate(plan.contacts):
        for axis, letter in enumerate("xy"):
            add(f"joints.{contact.name}.force_{letter}", "N", "force on the journal", "wrench", j, axis)
        for name, (unit, what) in CONTACT.items():
            add(f"joints.{contact.name}.{name}", unit, what, f"contact.{name}", j)
    for i, component in enumerate(plan.acting):
        port = component.declaration.port
        for k, force in enumerate(port.forces):
            add(f"components.{component.name}.{force}", "", "what it exerts", "result", i, k)
        for k, coordinate in enumerate(port.coordinates):
            add(f"components.{component.name}.{coordinate}", "", "what it acts along", "coordinate", i, k)
    return rows
