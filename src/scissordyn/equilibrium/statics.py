"""Static forces of a mechanism along the stroke of its drives, without inertia."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Annotated, Any, Literal

import numpy as np

from scissordyn.casefile.configuration import write_configuration
from scissordyn.components.time_function import Polynomial
from scissordyn.equilibrium.bar_extremes import bar_extremes
from scissordyn.equilibrium.cause import describe_jam
from scissordyn.equilibrium.small_motion import INPUT_STEP_MAX, equilibria_along_motion
from scissordyn.equilibrium.static_position import StaticPosition, count_turns
from scissordyn.errors import InputError
from scissordyn.integrate.integration import Samples
from scissordyn.kinematics.assembly import Held, Start, assemble, whole_state
from scissordyn.kinematics.closure import Closure, Inputs
from scissordyn.kinematics.path import INPUT_SAMPLES, has_kink, smooth_peak, start_of
from scissordyn.mechanics.monitored import POWERS
from scissordyn.mechanics.sample import Record
from scissordyn.model.commanded import commanded
from scissordyn.model.mechanism import Mechanism
from scissordyn.model.options import EndTime, Options
from scissordyn.plan.bending import bends
from scissordyn.plan.elimination import in_words
from scissordyn.plan.plan import Plan, plan
from scissordyn.plan.rest import frictionless, lock_drives, lock_loads, with_inputs
from scissordyn.plan.system import make_system
from scissordyn.record.coupling import coupling_warnings
from scissordyn.record.dataset import results
from scissordyn.record.results import Results, Variables, labels
from scissordyn.record.trajectory import LOG, PEAK, Trajectory
from scissordyn.record.variable import Variable
from scissordyn.record.warn import beyond_outputs
from scissordyn.tolerance import ASSEMBLY_TOL
from scissordyn.units import Quantity, checked
from scissordyn.warning import warning

if TYPE_CHECKING:
    import xarray as xr

TITLE = "scissordyn statics"  # Attribute `title` of the Dataset that `statics` returns

POINTS, POINTS_MIN = 201, 51  # Positions along a stroke: default of `statics`, and smallest number for measures of studies

CREEP_SPEED = 1e-9
"""Assumed speed of the fastest drive, which gives friction and one-way loads their sense [rad/s, m/s].

Its square, and thus all inertia forces, are below round-off.
"""

TRANSITION_SPEED_MIN = 1e-30
"""Transition speed of friction and one-way loads in statics [m/s, rad/s]: far below `CREEP_SPEED`, so that friction slides."""

SENSE_PARAMETERS: dict[str, tuple[str, tuple[str, ...]]] = {
    "pin_friction": ("transition", ("kinetic", "static")),
    "guide_friction": ("transition", ("kinetic", "static")),
    "edge_contact": ("ramp_speed", ("kinetic",)),
    "gas_spring": ("friction_speed", ("friction",)),
    "stroke_load": ("transition", ()),
    "angle_load": ("transition", ()),
}
"""Components that depend on the sense of motion, by section: name of the transition speed, names of friction parameters.

Those of a contact are parameters of its friction law.
"""

Friction = Literal["none", "forward", "backward"]

MOTION_VARIABLE_PARTS = (
    *("kinetic_energy", "elastic_energy", "dissipated_energy", "_loss", "_work", "_residual", "_power", "impulse"),
    *("peak_", "_peak", "contact_", "event_", "_speed"),
)
"""Parts of variable names that occur in the results of a motion, but not in those of statics."""


@checked
def statics(
    mechanism: Mechanism,
    *,
    until: EndTime,
    points: Annotated[int, Quantity("1", minimum=2, maximum=100_000, help="number of positions")] = POINTS,
    friction: Friction = "none",
) -> xr.Dataset:
    """Return forces in pins, guides, drives, rods, springs and bars along the motion of the drives, without inertia.

    At each position the drives and prescribed distances are locked and loads have their values at that time. All other
    coordinates are in static equilibrium. Clearances, dampers, clutches and brakes are left out; servos hold their references.
    Latches stay open; a warning names those that would lock.

    Parameters
    ----------
    mechanism : Mechanism
    until : float
        Final time of the drives [s].
    points : int
        Number of positions, evenly spaced in time.
    friction : {"none", "forward", "backward"}
        Friction in ideal joints and gas springs: none, as in a slow motion along the drives, or in the opposite direction.
        One-way loads act in the same sense of motion; with "none" that is along the drives.

    Returns
    -------
    Dataset
        The variables of a run that exist at rest, over `time`. `input (time, prescribed)` are the values of drives and
        prescribed distances, in `prescribed_unit`. `quantity_value (time, quantity)` in `quantity_unit` repeats all forces and
        torques in one table, with the magnitude of reactions. `least`, `largest`, `least_time` and `largest_time` are the
        extremes of each quantity, located between the positions.

    Raises
    ------
    InputError
        If nothing is prescribed or a position has no static equilibrium. Also if a component depends on the sense of motion,
        as friction does, and the drives do not determine the motion.
    """
    from scissordyn.record.xarray_dataset import as_dataset  # imports xarray, which takes longer than most runs

    return as_dataset(static_results(mechanism, until, points, friction))


def static_results(mechanism: Mechanism, until: float, points: int, friction: Friction) -> Results:
    """Return the results of `statics` before their conversion to a Dataset."""
    check_stroke(mechanism)
    ideal = frictionless(commanded(mechanism).ideal())
    whole = plan(ideal)
    inputs = Inputs(whole)
    times = np.linspace(0.0, until, points)
    path, rested = _equilibria(whole, inputs, times, friction)
    forces = results(whole, write_configuration(ideal, Options(until=until, samples=points)), path, rested)
    forces.variables |= bar_extremes(path, rested, forces.variables)
    variables = {
        name: part for name, part in forces.variables.items() if not any(word in name for word in MOTION_VARIABLE_PARTS)
    }
    variables |= _input_variables(inputs, times)
    variables |= _envelope(variables, times, [guide.name for guide in ideal.ideal_guides if guide.aligned])
    forces.variables = variables
    forces.attrs.update(title=TITLE, warnings=json.dumps(_warnings(whole, variables, path)))
    return forces


def static_peaks(mechanism: Mechanism, until: float) -> dict[str, float]:
    """Return the largest magnitude of each force, torque and bar stress, with forward friction if there is any."""
    points = max(POINTS_MIN, 1 + math.ceil(rotations(mechanism, until)[-1] / INPUT_STEP_MAX))
    parts = frictionless(mechanism.ideal()).components
    names = ((part, SENSE_PARAMETERS.get(part.declaration.section, ("", ()))[1]) for part in parts)
    rubbing = any(getattr(_rubbing(part), name, 0.0) for part, coefficients in names for name in coefficients)
    forces = static_results(mechanism, until, points, "forward" if rubbing else "none").variables
    sizes = np.maximum(np.abs(forces["least"].values), np.abs(forces["largest"].values))
    peaks = dict(zip(forces["quantity"].values.tolist(), sizes.tolist(), strict=True))
    if "bar" in forces:
        names, stresses = (forces[name].values.tolist() for name in ("bar", "bar_largest_stress"))
        peaks |= {f"bar stress {name}": stress for name, stress in zip(names, stresses, strict=True)}
    return peaks


def _rubbing(part: Any) -> Any:
    """Return the description with the friction parameters of a component: a contact's friction law, or the component itself."""
    return part.friction if part.declaration.contact else part


def rotations(mechanism: Mechanism, until: float) -> np.ndarray:
    """Return the rotation of the drive that rotates most, summed in both senses [rad], at evenly spaced instants."""
    inputs = Inputs(plan(commanded(mechanism).ideal()))
    turned = np.abs(np.diff(inputs.over(np.linspace(0.0, until, INPUT_SAMPLES)), axis=0, prepend=inputs.at(0.0)[None]))
    angles = turned[:, np.array(inputs.units) == "rad"]
    return np.asarray(np.cumsum(angles.max(axis=1, initial=0.0)))


def check_stroke(mechanism: Mechanism) -> None:
    """Raise `InputError` if no drive, servo, rod or coordinate prescribes a motion, so that there is no stroke."""
    driven = commanded(mechanism)
    if not (driven.drives or driven.coordinate_drives or any(rod.motion for rod in driven.rods)):
        raise InputError(
            "statics of a mechanism without stroke: it has no drive, servo, driven rod or driven coordinate",
            "a drive, or a rod with a motion",
        )


def _equilibria(whole: Plan, inputs: Inputs, times: np.ndarray, friction: Friction) -> tuple[Trajectory, Record]:
    """Return the equilibrium positions at some instants, as trajectory and record of a run."""
    moving = _slow_rates(whole, inputs, times, friction)

    def lock(time: float, turned: Mapping[str, float]) -> Plan:
        return lock_drives(whole.case(lock_loads(whole.mechanism, time)), time, turned)

    try:
        places = list(equilibria_along_motion(lock, whole, times.tolist(), "static"))
    except InputError as error:
        raise InputError(f"statics {error.what}", error.expected, error.example) from None
    rests = [at for at, _ in places]
    warnings: list[str] = []
    if moving is not None:
        values = inputs.over(times)
        rests = [
            _slow_motion(at, place.turned, motion, friction)
            for (at, place), *motion in zip(places, values.tolist(), moving.tolist(), strict=True)
        ]
    records = []
    for at, time in zip(rests, times.tolist(), strict=True):
        records.append(at.record())
        stuck = describe_jam(at.plan, at.system)
        if stuck and not warnings:
            warnings.append(f"{stuck}, first at t = {time:.6g} s")
    at_rest = Record(*(np.concatenate(parts) for parts in zip(*records, strict=True)))
    for rates in (at_rest.V, at_rest.A, at_rest.velocity, at_rest.angular_velocity):
        rates[:] = 0.0
    system, n = make_system(whole), whole.coordinates.free
    state = np.zeros((times.size, system.content.work.scratch.size))
    state[:, :n] = at_rest.X[:, :n]
    model, states = system.content.model, [at.system.content.state for at in rests]
    modes = (np.stack([getattr(part, name) for part in states]) for name in ("mode", "memory", "mass", "reference"))
    path = Trajectory(
        plan=whole,
        system=system,
        samples=Samples(times, state, np.zeros((times.size, len(POWERS))), *modes),
        log=np.zeros(0, LOG),
        peak=np.zeros(model.guard_component.size + model.monitor.shape[0], PEAK),
        end=float(times[-1]),
        warnings=tuple(warnings),
        band=times[:0],
    )
    return path, at_rest


def _slow_rates(whole: Plan, inputs: Inputs, times: np.ndarray, friction: Friction) -> np.ndarray | None:
    """Return the rates of all inputs at `CREEP_SPEED`, shape (instants, inputs); None if no component depends on the sense."""
    parts: list[Any] = [part for part in whole.components if part.declaration.section in SENSE_PARAMETERS]
    friction_parts = [part for part in parts if SENSE_PARAMETERS[part.declaration.section][1]]
    one_way = [part for part in parts if getattr(part, "acts", "both") != "both"]
    if friction != "none" and not friction_parts and not one_way:
        what = f"friction = '{friction}' for a mechanism whose forces do not depend on the sense of motion"
        allowed = "components with friction, such as [[pin_friction]], or one-way loads"
        raise InputError(what, allowed, "friction = 'none'")
    if not one_way and friction == "none":
        return None
    closure = Closure(whole)
    if start_of(closure) is None or closure.mobility != 0:
        name = (one_way or friction_parts)[0].name
        allowed = "rigid bars" if bends(whole.mechanism) else "one more drive"
        raise InputError(
            f"statics with '{name}', which depends on the sense of motion: the drives do not determine the motion", allowed
        )
    rates = np.gradient(inputs.over(times), times, axis=0)
    fastest = np.abs(rates).max(axis=1, keepdims=True)
    sense = -1.0 if friction == "backward" else 1.0
    return np.asarray(sense * CREEP_SPEED * rates / np.where(fastest > 0.0, fastest, 1.0))


def _slow_motion(
    at: StaticPosition, turned: Mapping[str, float], motion: Sequence[Sequence[float]], friction: Friction
) -> StaticPosition:
    """Return a static position with the slow speeds that give friction its sense; `motion` has values and rates of inputs."""
    slow = with_inputs(at.plan, [Polynomial(pair) for pair in zip(*motion, strict=True)], turned)
    system = make_system(slow)
    content = system.content
    count_turns(slow, content, turned)
    for i, part in enumerate(slow.components):
        if part.declaration.section in SENSE_PARAMETERS:
            speed, coefficients = SENSE_PARAMETERS[part.declaration.section]
            law, numbers = content.model.component_law[i], _rubbing(part).declaration.numbers
            row = content.parameters.component[i] if law < 0 else content.parameters.friction[law]
            if speed not in numbers:  # a contact without friction
                continue
            row[numbers.index(speed)] = TRANSITION_SPEED_MIN
            for name in coefficients:
                row[numbers.index(name)] *= friction != "none"
    position = at.state[: slow.coordinates.free]
    start = assemble(slow, content, Start(position, 0.0 * position), Held())
    for name in ("mode", "memory", "mass"):
        getattr(content.state, name)[:] = getattr(at.system.content.state, name)
    return StaticPosition(slow, system, whole_state(content, start.position, start.velocity))


def _input_variables(inputs: Inputs, times: np.ndarray) -> Variables:
    """Return the variables of drives and prescribed distances."""
    names = [*inputs.bodies, *inputs.timed]
    return {
        "prescribed": labels("prescribed", names, "driven body or rod"),
        "prescribed_unit": labels("prescribed", inputs.units, "unit of its input"),
        "input": Variable(("time", "prescribed"), inputs.over(times), {"long_name": "prescribed angle or distance"}),
    }


def _envelope(variables: Variables, times: np.ndarray, turned: list[str]) -> Variables:
    """Return all forces and torques in one table with their extremes; guides in `turned` keep an angle."""
    names, units, columns = [], [], []
    first_alone = "drive_torque" if "drive_torques" in variables else ""
    for name, part in variables.items():
        unit = part.attrs.get("units", "")
        if part.dims[0] != "time" or "beam" in part.dims or name == first_alone:
            continue
        parts = variables[part.dims[1]].values.tolist() if part.dims[1:] else [""]
        several = [unit] * len(parts)
        coordinate = variables.get(name.replace("_force", "_unit"), part)
        if coordinate is not part:
            several = ["N m" if unit_of == "rad" else "N" for unit_of in coordinate.values.tolist()]
        if not set(several) <= {"N", "N m"}:
            continue
        chosen = list(range(len(parts)))
        if name.startswith("coupling_"):  # some couplings have teeth or a belt, others do not
            chosen = [k for k in chosen if not np.isnan(part.values[:, k]).all()]
        if name == "reaction_moment":
            chosen = [k for k, label in enumerate(parts) if label in turned or np.any(part.values[:, k])]
        for label, of in ((parts[k], several[k]) for k in chosen):
            kind = name.replace("force", "torque").replace("torques", "torque") if of == "N m" else name
            names.append(f"{kind.replace('_', ' ')} {label}".strip())
            units.append(of)
        vectors = part.values.reshape(times.size, len(parts), math.prod(part.shape[2:]))
        columns += [vectors[:, k] for k in chosen]
    force = np.stack([_magnitude(column) for column in columns], axis=1) if columns else np.zeros((times.size, 0))
    least, largest = (np.array([_extreme(times, column, sign) for column in columns]).reshape(-1, 2) for sign in (-1.0, 1.0))
    return {
        "quantity": labels("quantity", names, "force or torque"),
        "quantity_unit": labels("quantity", units, "unit of its values"),
        "quantity_value": Variable(("time", "quantity"), force, {"long_name": "force or torque, magnitude of reactions"}),
        **{
            name: Variable(("quantity",), column, {"long_name": text})
            for name, column, text in (
                ("least", 0.0 - least[:, 0], "least value"),
                ("least_time", least[:, 1], "time of the least value [s]"),
                ("largest", largest[:, 0], "largest value"),
                ("largest_time", largest[:, 1], "time of the largest value [s]"),
            )
        },
    }


def _magnitude(vectors: np.ndarray) -> np.ndarray:
    """Return the magnitudes of plane vectors, shape (n, 2), or the signed values of scalars, shape (n, 1)."""
    return vectors[:, 0] if vectors.shape[1] == 1 else np.hypot(*vectors.T)


def _extreme(times: np.ndarray, vectors: np.ndarray, sign: float) -> tuple[float, float]:
    """Return the largest of sign times the values, interpolated between the positions, and its time; `sign` is 1 or -1.

    The magnitude of a reaction has a kink where the reaction passes near zero; its components are smooth and are interpolated
    by parabolas. Where a cable becomes slack or a tape spring snaps the curve has a kink, and the positions alone count.
    """
    values = sign * _magnitude(vectors)
    if vectors.shape[1] > 1 and times.size > 2 and np.isfinite(values).any():
        k = min(max(1, int(np.nanargmax(values))), times.size - 2)
        if np.isfinite(values[k - 1 : k + 2]).all() and not has_kink(vectors, k):
            before, here, after = vectors[k - 1 : k + 2, None]
            part = np.linspace(-1.0, 1.0, 401)[:, None]
            between = here + 0.5 * part * (after - before) + 0.5 * part**2 * (after - 2.0 * here + before)
            times, values = times[k] + part[:, 0] * (times[k + 1] - times[k]), sign * _magnitude(between)
    return smooth_peak(times, values)


def _warnings(plan: Plan, variables: Variables, path: Trajectory) -> list[str]:
    """Return warnings of undetermined reactions, of curves used beyond their range, and of positions that are far apart."""
    warnings, times = list(path.warnings), variables["time"].values
    angles = variables["input"].values[:, variables["prescribed_unit"].values == "rad"]
    apart = float(np.abs(np.diff(angles, axis=0)).max(initial=0.0))
    if apart > 0.4:  # [rad]
        enough = math.ceil(times.size * apart / INPUT_STEP_MAX)
        words = f"positions are up to {math.degrees(apart):.3g} deg apart: larger forces between them may be missed"
        warnings.append(f"{words}; use points = {enough} or more")
    for _, part, output in beyond_outputs(plan):
        section = part.declaration.section
        far = variables[f"{section}_beyond"].values[:, variables[section].values.tolist().index(part.name)]
        worst = int(np.argmax(far))
        if far[worst] > ASSEMBLY_TOL:
            numbers = {"beyond": far[worst], "unit": output.unit, "time": times[worst]}
            warnings.append(str(warning("beyond", part.name, part.declaration.label, **numbers)))
    for k, latch in enumerate(plan.mechanism.latches):
        beyond = variables["latch_angle"].values[:, k] - latch.angle
        locked = np.flatnonzero(beyond * beyond[0] < 0.0)
        if locked.size:
            first, then = times[locked[0] - 1 : locked[0] + 1]
            warnings.append(
                f"latch '{latch.name}' locks between {first:.6g} s and {then:.6g} s: forces after it are those of an open latch"
            )
    for k, name in enumerate(variables["tape_spring"].values.tolist() if "tape_spring" in variables else ()):
        snapped = np.flatnonzero(np.diff(variables["tape_spring_folded"].values[:, k]))
        if snapped.size:
            first, then = times[snapped[0] : snapped[0] + 2]
            warnings.append(
                f"tape spring '{name}' snaps {snapped.size} times, first between {first:.6g} s and {then:.6g} s: its largest "
                "moment is at the snap, which may exceed that of the positions"
            )
    lost = np.isnan(variables["reaction"].values).any(axis=(0, 2)) | np.isnan(variables["reaction_moment"].values).any(axis=0)
    warnings += map(str, coupling_warnings(plan.mechanism))
    names = variables["joint"].values[lost].tolist()
    if "weld" in variables:
        names += variables["weld"].values[np.isnan(variables["weld_moment"].values).any(axis=0)].tolist()
    if names and not path.warnings:
        joints = in_words([repr(name) for name in names])
        warnings.append(f"reactions of {joints} are not determined: the mechanism has redundant joints")
    return warnings
