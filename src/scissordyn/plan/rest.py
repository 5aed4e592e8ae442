"""Lock the drives and loads of a mechanism at their values at a time, for static equilibrium."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType
from typing import Any, TypeVar

import numpy as np

from scissordyn.components.actuator import Actuator
from scissordyn.components.edge_contact import EdgeContact
from scissordyn.components.gas_spring import GasSpring
from scissordyn.components.lugre import GuideLuGre, PinLuGre
from scissordyn.components.rod import Rod
from scissordyn.components.time_function import Polynomial, TimeFunction
from scissordyn.control.tracking.feed_forward import FeedForward
from scissordyn.control.tracking.pid import PID
from scissordyn.errors import InputError
from scissordyn.laws.friction.none import NoFriction
from scissordyn.mechanics.time_function import function_at, function_rows, function_start
from scissordyn.model.coupling import CoordinateDrive
from scissordyn.model.joint import Guide, Revolute
from scissordyn.model.mechanism import Mechanism
from scissordyn.plan.acting import start_coordinates
from scissordyn.plan.plan import Plan, plan

Joint = TypeVar("Joint", Revolute, Guide)

NO_TURNS: Mapping[str, float] = MappingProxyType({})  # Rotations of bodies since the start, by name, if no body has rotated


def frictionless(mechanism: Mechanism) -> Mechanism:
    """Return the mechanism without friction in clearance joints, without bristles in components, and with compliant contacts.

    It is the mechanism itself if all joints are ideal and have no bristles.
    """
    rubbing = PinLuGre | GuideLuGre | EdgeContact
    mechanism = _with_components(mechanism, lambda part: part.without_bristles() if isinstance(part, rubbing) else part)
    if not mechanism.contacts:
        return mechanism
    joints, guides = tuple(map(_frictionless, mechanism.joints)), tuple(map(_frictionless, mechanism.guides))
    return dataclasses.replace(mechanism, joints=joints, guides=guides)


def plan_at_rest(whole: Plan) -> Plan:
    """Return the plan of the frictionless mechanism with drives and prescribed distances locked at their values at t = 0."""
    mechanism = frictionless(whole.mechanism)
    return lock_drives(whole if mechanism is whole.mechanism else plan(mechanism), 0.0)


def lock_drives(whole: Plan, time: float, turned: Mapping[str, float] = NO_TURNS) -> Plan:
    """Return the plan with drives, prescribed distances and coordinates locked at their values at a time [s]."""
    starts = {constraint.name: constraint.start for constraint in whole.coordinates.constraints}
    inputs = [(drive.motion, whole.mechanism.body(drive.body).placed_angle) for drive in whole.drives]
    inputs += [(rod.motion, 0.0) for rod in whole.rods if rod.motion]
    inputs += [(drive.motion, starts[drive.name]) for drive in whole.mechanism.coordinate_drives]
    return with_inputs(whole, [_constant(motion, start, time) for motion, start in inputs], turned)


def with_inputs(whole: Plan, inputs: Sequence[TimeFunction], turned: Mapping[str, float]) -> Plan:
    """Return the plan with other time functions of drives and rods; `turned` are the angles turned since the start [rad]."""
    mechanism, pending = whole.mechanism, iter(inputs)
    drives = tuple(dataclasses.replace(drive, motion=next(pending)) for drive in mechanism.drives)
    rods = tuple(dataclasses.replace(rod, motion=next(pending)) if rod.motion else rod for rod in mechanism.rods)
    coordinate_drives = tuple(dataclasses.replace(drive, motion=next(pending)) for drive in mechanism.coordinate_drives)
    timed: tuple[Rod | CoordinateDrive, ...] = (*rods, *coordinate_drives)
    motions = {part.name: part.motion for part in timed}
    old = whole.coordinates.constraints
    first = iter(whole.angles[whole.angles.size - sum(len(constraint.turning) for constraint in old) :].tolist())
    constraints = []
    for constraint in old:
        turning = tuple((body, next(first) + turned.get(body, 0.0)) for body, _ in constraint.turning)
        changed = dataclasses.replace(constraint, turning=turning)
        if constraint.motion:
            motion = motions[constraint.name] or constraint.motion
            ratio = function_start(motion, constraint.start) / constraint.scale
            if not constraint.linear and not ratio > 0.0:
                raise InputError(f"{constraint.subject} has the length {ratio * constraint.scale:.6g} m", "a length above 0")
            changed = dataclasses.replace(changed, motion=motion, value=ratio if constraint.linear else 0.5 * ratio**2)
        constraints.append(changed)
    # an offset that is not given is that of the start
    offsets = {constraint.name: constraint.value * constraint.scale for constraint in constraints if constraint.linear}
    couplings = tuple(dataclasses.replace(part, offset=offsets.get(part.name, part.offset)) for part in mechanism.couplings)
    coordinates = whole.coordinates
    locked = dataclasses.replace(
        whole,
        mechanism=dataclasses.replace(
            mechanism, drives=drives, rods=rods, coordinate_drives=coordinate_drives, couplings=couplings
        ),
        coordinates=coordinates.with_constraints(tuple(constraints), coordinates.redundant, coordinates.miss),
        answers={},
    )
    locked.__dict__["ideal"] = locked if whole.ideal is whole else with_inputs(whole.ideal, inputs, turned)
    return locked


def without_seal_friction(mechanism: Mechanism) -> Mechanism:
    """Return the mechanism with gas springs whose seals do not rub."""
    return _with_components(
        mechanism, lambda part: dataclasses.replace(part, friction=0.0) if isinstance(part, GasSpring) else part
    )


def without_ramps(mechanism: Mechanism) -> Mechanism:
    """Return the mechanism with servos whose limits have risen to their full values."""

    def risen(part: Any) -> Any:
        if not (isinstance(part, Actuator) and isinstance(part.controller, PID | FeedForward) and part.controller.ramp > 0.0):
            return part
        return dataclasses.replace(part, controller=dataclasses.replace(part.controller, ramp=0.0))

    return _with_components(mechanism, risen)


def _with_components(mechanism: Mechanism, changed: Callable[[Any], Any]) -> Mechanism:
    """Return the mechanism with changed components; the mechanism itself if none changes."""
    parts = tuple(map(changed, mechanism.components))
    return mechanism if parts == mechanism.components else mechanism.with_parts({"components": parts}, check=False)


def lock_loads(mechanism: Mechanism, time: float) -> Mechanism:
    """Return the mechanism with its loads, and the references of its servos, locked at their values at a time [s]."""

    def constant(part: Any) -> Any:
        if isinstance(part, Actuator):
            functions: dict[str, tuple[TimeFunction | None, float]] = {
                "reference": (part.reference, start_coordinates(mechanism, part)[0]),
                "feed_forward": (part.feed_forward, 0.0),
            }
            locked: dict[str, Any] = {
                name: _constant(motion, start, time) for name, (motion, start) in functions.items() if motion is not None
            }
            return dataclasses.replace(part, **locked) if locked else part
        motion = getattr(part, "time_function", None)
        return part if motion is None else dataclasses.replace(part, time_function=_constant(motion, 0.0, time))

    return dataclasses.replace(mechanism, components=tuple(constant(part) for part in mechanism.components))


def _constant(motion: TimeFunction, start: float, time: float) -> TimeFunction:
    value = np.zeros(4)
    function_at(time, function_rows(motion, start), value)
    return Polynomial((float(value[0]),))


def _frictionless(joint: Joint) -> Joint:
    """Return a joint with compliant contact and without friction."""
    if joint.clearance is None:
        return joint
    return dataclasses.replace(
        joint, clearance=dataclasses.replace(joint.clearance, friction=NoFriction(), contact="compliant")
    )
