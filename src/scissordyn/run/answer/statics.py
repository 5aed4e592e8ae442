"""Forces of a mechanism along the stroke of its drives without inertia."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated, Any, Literal

import numpy as np

from scissordyn.component.time_function import Polynomial
from scissordyn.errors import InputError
from scissordyn.integrate.integration import Samples
from scissordyn.kinematics.assembly import Held, Start, assemble, basis_at_start
from scissordyn.kinematics.closure import Closure, Inputs
from scissordyn.kinematics.path import start_of
from scissordyn.kinematics.peak import smooth_peak
from scissordyn.mechanics.monitored import POWERS
from scissordyn.mechanics.outputs import Record, record
from scissordyn.model.commanded import commanded
from scissordyn.model.mechanism import Mechanism
from scissordyn.plan.elimination import in_words
from scissordyn.plan.plan import Plan, plan
from scissordyn.plan.rest import at_rest, loads_at
from scissordyn.run.advance.cause import full_coordinates, jam
from scissordyn.run.advance.log import LOG, PEAK
from scissordyn.run.advance.system import make_system
from scissordyn.run.advance.trajectory import Trajectory
from scissordyn.run.answer.dataset import results
from scissordyn.run.answer.warn import ROUNDED, beyond_outputs
from scissordyn.run.configuration import write_configuration
from scissordyn.run.options import EndTime, Options
from scissordyn.run.results import Variable, Variables
from scissordyn.run.start.rest import count_turns, turns
from scissordyn.run.start.small_motion import Place, placed, towards
from scissordyn.run.start.stiffness import At
from scissordyn.units import Quantity, checked
from scissordyn.warning import warning

if TYPE_CHECKING:
    import xarray as xr

TITLE = "scissordyn statics"

POINTS = 201

OF_COORDINATES = "X", "V", "A", "multiplier"
"""Fields of a record that depend on how a mechanism is reduced to free coordinates."""

CREEP = 1e-9
"""Speed of the fastest drive [rad/s, m/s], which tells friction and one-way loads their sense; squares of it are round-off."""

AT_ONCE = 1e-30
"""In the place of the speed over which friction or a one-way load sets in [m/s, rad/s]."""

SENSES = {
    "pin_friction": (4, (1, 2)),
    "guide_friction": (5, (2, 3)),
    "gas_spring": (6, (5,)),
    "stroke_load": (1, ()),
    "angle_load": (1, ()),
}
"""Components that depend on the sense of their motion: where that speed stands among their parameters, and friction."""

Friction = Literal["none", "forward", "backward"]

DYNAMIC = ("_energy", "_loss", "_work", "_residual", "peak_", "_peak", "contact_", "event_", "_speed", "impulse")
"""Parts of names of variables that only a motion has."""


@checked
def statics(
    mechanism: Mechanism,
    *,
    until: EndTime,
    points: Annotated[int, Quantity("1", minimum=2, maximum=100_000, help="number of positions")] = POINTS,
    friction: Friction = "none",
) -> xr.Dataset:
    """Forces in pins, guides, drives, rods, springs and bars along the motion of the drives, without inertia.

    At each position drives and prescribed distances stand still, loads have their values of that instant, and whatever else can
    move is in static equilibrium. Clearances, dampers, clutches and brakes are left out; servos hold their references.

    Parameters
    ----------
    mechanism : Mechanism
    until : float
        End of the time of the drives [s].
    points : int
        Number of positions, evenly spaced in time.
    friction : {"none", "forward", "backward"}
        Without friction in ideal joints and gas springs, or with that of a slow motion as the drives move, or against it.

    Returns
    -------
    Dataset
        The variables of a run that have a meaning at rest, over `time`, and `input (time, prescribed)`, what drives and
        prescribed distances hold, in `prescribed_unit`. All forces and torques once more in one table, `force (time, quantity)`
        in `quantity_unit`, with `least`, `largest`, `least_time` and `largest_time` of each, located between the positions.

    Raises
    ------
    InputError
        If nothing is prescribed, a position has no static equilibrium, or what depends on the sense of the motion, as friction
        does, acts on a mechanism that the drives do not move alone.
    """
    ideal = commanded(mechanism).ideal()
    whole = plan(ideal)
    inputs = Inputs(whole)
    if not inputs.count:
        raise InputError(
            "statics of a mechanism without a drive, a servo or a driven rod, which has no stroke",
            "a drive, or a rod with a motion",
        )
    times = np.linspace(0.0, until, points)
    path, rested = _rested(whole, inputs, times, friction)
    forces = results(whole, write_configuration(ideal, Options(until=until, samples=points)), path, rested)
    variables = {name: part for name, part in forces.variables.items() if not any(word in name for word in DYNAMIC)}
    variables |= _inputs(inputs, times)
    variables |= _envelope(variables, times)
    forces.variables = variables
    forces.attrs.update(title=TITLE, warnings=json.dumps(_warnings(whole, variables, path)))
    return forces.dataset()


def _rested(whole: Plan, inputs: Inputs, times: np.ndarray, friction: Friction) -> tuple[Trajectory, Record]:
    """The positions of equilibrium at some instants, as the trajectory and the record of a run."""
    moving = _moving(whole, inputs, times, friction)
    place: Place | None = None
    rests: list[At] = []
    for before, time in zip((0.0, *times[:-1].tolist()), times.tolist(), strict=True):
        for instant in (*towards(inputs, before, time), time):
            frozen = loads_at(at_rest(whole.mechanism, instant), instant)
            still = whole.case(frozen) if whole.fits(frozen) else plan(frozen)
            try:
                at, place = placed(still, "static", place)
            except InputError as error:
                reason = error.what.removeprefix("start = 'static': ")
                raise InputError(f"statics at t = {instant:.6g} s: {reason}", error.allowed) from None
        rests.append(at)
    system = make_system(whole)
    n = whole.coordinates.free
    bases = [full_coordinates(whole, system.content, np.zeros(n), time)[n:] for time in times.tolist()]
    # a mechanism whose rods have another length may have other coordinates
    position = np.stack([whole.coordinates.nearest(b, at.natural) for b, at in zip(bases, rests, strict=True)])
    X = np.concatenate([position, bases], axis=1)
    warnings: list[str] = []
    if moving is not None:
        rests = [_creeping(at, rates, friction) for at, rates in zip(rests, moving, strict=True)]
    records = []
    for at, time in zip(rests, times.tolist(), strict=True):
        records.append(record(at.plan.maps, at.system, _samples([at], at.state[None], np.zeros(1)))._asdict())
        stuck = jam(at.plan, at.system)
        if stuck and not warnings:
            warnings.append(f"{stuck}, first at t = {time:.6g} s")
    kept = {name: np.concatenate([part[name] for part in records]) for name in Record._fields if name not in OF_COORDINATES}
    for name in ("velocity", "angular_velocity"):
        kept[name][:] = 0.0
    state = np.zeros((times.size, system.content.work.scratch.size))
    state[:, :n] = position
    model = system.content.model
    path = Trajectory(
        plan=whole,
        system=system,
        samples=_samples(rests, state, times),
        log=np.zeros(0, LOG),
        peak=np.zeros(model.guard_component.size + model.monitor.shape[0], PEAK),
        end=float(times[-1]),
        status="complete",
        cause="",
        statistics={},
        immobile=(),
        warnings=tuple(warnings),
        band=times[:0],
    )
    return path, Record(X=X, V=0.0 * X, A=0.0 * X, multiplier=np.zeros((times.size, 0)), **kept)


def _moving(whole: Plan, inputs: Inputs, times: np.ndarray, friction: Friction) -> np.ndarray | None:
    """Rates of the inputs in a slow motion, shape (instants, inputs); None if nothing depends on its sense."""
    parts: list[Any] = [part for part in whole.components if part.declaration.section in SENSES]
    friction_parts = [part for part in parts if SENSES[part.declaration.section][1]]
    if friction != "none" and not friction_parts:
        what = f"friction = '{friction}' of a mechanism without friction in ideal joints or gas springs"
        raise InputError(what, "components [[pin_friction]], [[guide_friction]], [[gas_spring]]", "friction = 'none'")
    one_way = [part for part in parts if getattr(part, "acts", "both") != "both"]
    if not one_way and friction == "none":
        return None
    closure = Closure(whole)
    if start_of(closure) is None or closure.mobility != 0:
        name = (one_way or friction_parts)[0].name
        raise InputError(
            f"statics with '{name}', whose sense is unknown, as the drives do not determine the motion", "a drive more"
        )
    rates = np.gradient(inputs.over(times), times, axis=0)
    fastest = np.abs(rates).max(axis=1, keepdims=True)
    sense = -1.0 if friction == "backward" else 1.0
    return np.asarray(sense * CREEP * rates / np.where(fastest > 0.0, fastest, 1.0))


def _creeping(at: At, rates: np.ndarray, friction: Friction) -> At:
    """The same position in a slow motion."""
    mechanism = at.plan.mechanism
    pending = iter(rates.tolist())

    def slowly(motion: Any) -> Polynomial:
        return Polynomial((motion.coefficients[0], next(pending)))

    drives = tuple(dataclasses.replace(drive, motion=slowly(drive.motion)) for drive in mechanism.drives)
    rods = tuple(dataclasses.replace(rod, motion=slowly(rod.motion)) if rod.motion else rod for rod in mechanism.rods)
    changed = dataclasses.replace(mechanism, drives=drives, rods=rods)
    slow = at.plan.case(changed) if at.plan.fits(changed) else plan(changed)
    system = make_system(slow)
    content = system.content
    count_turns(slow, content, turns(at.plan, at.system.content))
    for i, part in enumerate(slow.components):
        speed, coefficients = SENSES.get(part.declaration.section, (0, ()))
        if part.declaration.section in SENSES:
            content.parameters.component[i, speed] = AT_ONCE
            content.parameters.component[i, list(coefficients)] *= friction != "none"
    position = slow.coordinates.nearest(basis_at_start(content)[0], at.natural)
    start = assemble(slow, content, Start(position, 0.0 * position), Held())
    content.state.mode[:], content.state.memory[:] = at.system.content.state.mode, at.system.content.state.memory
    return At(slow, system, np.concatenate([start.position, start.velocity, np.zeros(int(content.model.state_start[-1]))]))


def _samples(rests: Sequence[At], state: np.ndarray, times: np.ndarray) -> Samples:
    """States at rest as samples of a run."""
    states = [at.system.content.state for at in rests]
    several = (np.stack([getattr(part, name).copy() for part in states]) for name in ("mode", "memory", "reference"))
    return Samples(times, state, np.zeros((times.size, len(POWERS))), *several)


def _inputs(inputs: Inputs, times: np.ndarray) -> Variables:
    """What drives and prescribed distances hold."""
    names = [*inputs.bodies, *inputs.timed]
    return {
        "prescribed": Variable(("prescribed",), np.array(names), {"long_name": "driven body or rod"}),
        "prescribed_unit": Variable(("prescribed",), np.array(inputs.units), {"long_name": "unit of its input"}),
        "input": Variable(("time", "prescribed"), inputs.over(times), {"long_name": "prescribed angle or distance"}),
    }


def _envelope(variables: Variables, times: np.ndarray) -> Variables:
    """All forces and torques in one table, the least and the largest value of each, and when."""
    names, units, columns = [], [], []
    for name, part in variables.items():
        unit = part.attrs.get("units")
        if part.dims[0] != "time" or unit not in ("N", "N m") or "beam" in part.dims or name == "drive_torques":
            continue
        values = np.linalg.norm(part.values, axis=-1) if part.dims[-1] == "axis" else part.values
        parts = variables[part.dims[1]].values.tolist() if part.dims[1:] else [""]
        names += [f"{name.replace('_', ' ')} {label}".strip() for label in parts]
        units += [unit] * len(parts)
        columns.append(values.reshape(times.size, -1))
    force = np.concatenate(columns, axis=1) if columns else np.zeros((times.size, 0))
    largest, least = (np.array([smooth_peak(times, sign * column) for column in force.T]).reshape(-1, 2) for sign in (1, -1))
    return {
        "quantity": Variable(("quantity",), np.array(names, dtype=str), {"long_name": "force or torque"}),
        "quantity_unit": Variable(("quantity",), np.array(units, dtype=str), {"long_name": "unit of its values"}),
        "force": Variable(("time", "quantity"), force, {"long_name": "force or torque, of reactions the size"}),
        **{
            name: Variable(("quantity",), column, {"long_name": text})
            for name, column, text in (
                ("least", 0.0 - least[:, 0], "least value"),
                ("least_time", least[:, 1], "when it is least [s]"),
                ("largest", largest[:, 0], "largest value"),
                ("largest_time", largest[:, 1], "when it is largest [s]"),
            )
        },
    }


def _warnings(plan: Plan, variables: Variables, path: Trajectory) -> list[str]:
    """Reactions that are not determined, and curves and strokes that are left, in words."""
    warnings, times = list(path.warnings), variables["time"].values
    for _, part, output in beyond_outputs(plan):
        section = part.declaration.section
        far = variables[f"{section}_beyond"].values[:, variables[section].values.tolist().index(part.name)]
        worst = int(np.argmax(far))
        if far[worst] > ROUNDED:
            numbers = {"beyond": far[worst], "unit": output.unit, "time": times[worst]}
            warnings.append(str(warning("beyond", part.name, part.declaration.label, **numbers)))
    lost = np.isnan(variables["reaction"].values).any(axis=(0, 2))
    names = variables["joint"].values[lost].tolist()
    if names and not path.warnings:
        joints = in_words([repr(name) for name in names])
        warnings.append(f"reactions of {joints} are not determined: there are more joints than needed")
    return warnings
