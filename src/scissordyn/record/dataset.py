"""Convert a trajectory to the variables and attributes of a run's Dataset."""

from __future__ import annotations

import json
import math
import re
from dataclasses import replace

import numpy as np

from scissordyn.casefile.configuration import RUN_TITLE
from scissordyn.components.declaration import Component
from scissordyn.components.place import Point
from scissordyn.components.port import AXIS
from scissordyn.control.signal import RECORDABLE
from scissordyn.errors import InputError
from scissordyn.mechanics.monitored import (
    COMPONENT_FORCE,
    COMPONENT_OUTPUT,
    DRIVE_TORQUE,
    FRICTION_RATIO,
    FRICTION_RATIO_MAX,
    INDENTATION,
    PRESSURE_VELOCITY,
)
from scissordyn.mechanics.sample import Record
from scissordyn.mechanics.system import COMPONENT_RESULTS_MAX
from scissordyn.plan.acting import states_of
from scissordyn.plan.plan import Plan
from scissordyn.record.bars import bar_variables
from scissordyn.record.coupling import coupling_variables
from scissordyn.record.deferred import Deferred, DeferredArray
from scissordyn.record.events import ENERGY_TERMS, accounts, contact_variables, event_variables
from scissordyn.record.film import film_variables
from scissordyn.record.results import Results, Variables, described, labels, located
from scissordyn.record.track import track_variables
from scissordyn.record.trajectory import Trajectory
from scissordyn.record.transmitted import transmitted_variables
from scissordyn.units import State


def results(plan: Plan, configuration: str | Deferred[str], path: Trajectory, record: Record) -> Results:
    """Return all variables and attributes of a run; those that take long are computed when they are first read."""
    variables = {
        "time": described("time", path.samples.time, "s", "time"),
        "body": labels("body", [body.name for body in plan.bodies]),
        "joint": labels("joint", list(plan.mechanism.joint_names)),
        "axis": labels("axis", ["x", "y"]),
        **motion_variables(plan, record),
        **_joint_variables(plan, path, record),
        **_rod_variables(plan, record),
        **_control_variables(plan, path, record),
        **_energy_variables(plan, path, record),
        **_drive_variables(plan, path, record),
        **coupling_variables(plan, path, record),
        **contact_variables(plan, path.contacts, path.statistics.get("step", 0.0)),
        **track_variables(path, record),
        **synchronisation_variables(plan, record),
        **event_variables(plan, path.log),
    }
    components = component_variables(plan, path, record)
    for name in components.keys() & variables.keys():
        raise InputError(
            f"the output '{name}' of a component has the name of a variable of every run",
            "another name of the output or component",
        )
    variables |= components
    attributes = {
        "title": RUN_TITLE,
        "status": path.status,
        "cause": path.cause,
        "end": path.end,
        "statistics": json.dumps(path.statistics),
        "warnings": "[]",
        "configuration": configuration,
        "length_error": float(record.length_error[0]),
    }
    return Results(variables, attributes)


def motion_variables(plan: Plan, record: Record) -> Variables:
    point, rotation = ("time", "body", "axis"), ("time", "body")
    origin = DeferredArray(record.position.shape, lambda: _origins(plan, record))
    variables = {
        "origin": described(point, origin, "m", "position of the origin of the body's frame, which a body calls position"),
        "position": described(point, record.position, "m", "position of the mass centre"),
        "velocity": described(point, record.velocity, "m/s", "velocity of the mass centre"),
        "acceleration": described(point, record.acceleration, "m/s^2", "acceleration of the mass centre"),
        "angle": described(rotation, record.angle, "rad", "angle"),
        "angular_velocity": described(rotation, record.angular_velocity, "rad/s", "angular velocity"),
        "angular_acceleration": described(rotation, record.angular_acceleration, "rad/s^2", "angular acceleration"),
    }
    guide = plan.mechanism.output_guide
    if guide is not None:
        guided = plan.coordinates.place(guide.follower)
        along = np.array([math.cos(guide.direction), math.sin(guide.direction)])

        def travel(columns: np.ndarray, origin: Point) -> DeferredArray:
            return DeferredArray(columns.shape[:1], lambda: (guided.at(columns) - np.array(origin)) @ along)

        for name, values, units in (
            ("position", travel(record.X, guide.through), "m"),
            ("velocity", travel(record.V, (0.0, 0.0)), "m/s"),
            ("acceleration", travel(record.A, (0.0, 0.0)), "m/s^2"),
        ):
            text = f"{name} of the guided point along its guide"
            variables[f"slider_{name}"] = described("time", values, units, text)
    return variables


def _origins(plan: Plan, record: Record) -> np.ndarray:
    """Return the positions of the origins of the bodies' frames, shape (nt, bodies, 2) [m]."""
    x, y = np.array([body.centre for body in plan.bodies]).T
    cos, sin = np.cos(record.angle), np.sin(record.angle)
    return np.asarray(record.position - np.stack([cos * x - sin * y, sin * x + cos * y], axis=-1))


# Meaning, in a run, of the variables of the pressure-velocity product
PV_TEXT = "product of mean pressure F_n/(2 R_J L_b) and slip speed"


def spread_over(values: np.ndarray, places: np.ndarray, count: int, fill: float = np.nan) -> np.ndarray:
    """Return an array of length `count` along the last axis, with the values at `places` and `fill` elsewhere."""
    full = np.full((*values.shape[:-1], count), fill).astype(values.dtype)
    full[..., places[: values.shape[-1]]] = values
    return full


def _joint_variables(plan: Plan, path: Trajectory, record: Record) -> Variables:
    """Return the variables along `joint`; variables of clearance joints are NaN for ideal joints."""
    per_joint, joints = ("time", "joint"), len(plan.mechanism.joint_names)
    variables = transmitted_variables(plan, path, record)
    if not plan.contacts:
        return variables
    at = plan.places(contact.name for contact in plan.contacts)
    contact, mode = record.contact, path.samples.mode[:, : at.size]
    shape = mode.shape[0], joints

    def over_time(name: str) -> DeferredArray:
        return DeferredArray(shape, lambda: spread_over(contact[name], at, joints))

    def eccentricity() -> np.ndarray:
        towards, aside, nx, ny = (contact[part] for part in ("distance", "aside", "nx", "ny"))
        parts = towards * nx, towards * ny
        if np.any(aside):  # a worn contour touches in another direction
            parts = parts[0] - aside * ny, parts[1] + aside * nx
        return np.stack([spread_over(part, at, joints) for part in parts], axis=-1)

    touching = DeferredArray(shape, lambda: spread_over(mode == 1, at, joints, fill=False), bool)
    clearance = spread_over(path.system.content.parameters.contact["clearance"], at, joints)
    about = "journal centre relative to the bearing centre; for a contact point, the displacement across the guide"
    variables |= {
        "eccentricity": described((*per_joint, "axis"), DeferredArray((*shape, 2), eccentricity), "m", about),
        "indentation": described(per_joint, over_time("depth"), "m", "indentation, negative in free flight"),
        "normal_force": described(per_joint, over_time("normal"), "N", "normal contact force"),
        "friction_force": described(per_joint, over_time("tangential"), "N", "tangential contact force"),
        "slip_speed": described(per_joint, over_time("slip"), "m/s", "slip speed of the two surfaces"),
        "in_contact": described(per_joint, touching, "1", "journal and bearing in contact"),
        "clearance": described("joint", clearance, "m", "radial clearance"),
    }
    variables |= _joint_peaks(plan, path, at)
    if plan.mechanism.contact_points:
        plane = np.isin(plan.mechanism.joint_names, [point.name for point in plan.mechanism.contact_points])
        variables["plane_contact"] = described("joint", plane, "1", "contact point of a block at a guide surface")
    for j in plan.compliant_places:
        first = 2 * plan.coordinates.free + int(path.system.content.model.state_start[j])
        for s, declared in enumerate(states_of(plan.contacts[j])):
            state = np.where(path.samples.mode[:, j] == 1, path.samples.state[:, first + s], np.nan)
            _enter_state(variables, declared, per_joint, joints, int(at[j]), state)
    return variables


def _joint_peaks(plan: Plan, path: Trajectory, at: np.ndarray) -> Variables:
    """Return the largest values of each joint, located between samples; NaN for a quantity that the joint does not have."""
    joints, about = len(plan.mechanism.joint_names), "friction over the static limit of its law"
    bristles = at[path.monitored(FRICTION_RATIO)]
    variables = {}
    if path.peaks(PRESSURE_VELOCITY).size:
        product = spread_over(path.peaks(PRESSURE_VELOCITY), at, joints)
        variables = {
            "peak_pressure_velocity": described("joint", product["largest"], "Pa m/s", f"largest {PV_TEXT}"),
            "pressure_distance": described("joint", product["integral"], "Pa m", f"integral of the {PV_TEXT}"),
        }
    variables |= located("peak_indentation", "joint", spread_over(path.peaks(INDENTATION), at, joints), "m", "indentation")
    if bristles.size:
        ratio = spread_over(path.peaks(FRICTION_RATIO), bristles, joints)
        text = f"largest {about}, where the law has internal states"
        variables["peak_friction_ratio"] = described("joint", ratio["largest"], "1", text)
        text = f"time for which {about} is above {FRICTION_RATIO_MAX:g}"
        variables["friction_excess_time"] = described("joint", ratio["excess_time"], "s", text)
    return variables


def component_variables(plan: Plan, path: Trajectory, record: Record) -> Variables:
    """Return the declared outputs of the components; each kind of component has its own dimension."""
    variables: Variables = {}
    peaks = path.peaks(COMPONENT_FORCE)
    monitored = path.monitored(COMPONENT_OUTPUT).tolist()
    kinds: dict[str, list[int]] = {}
    controlled = dict(plan.actuators)
    for i, component in enumerate(plan.acting):
        if i not in controlled and component.declaration.port is not AXIS:
            kinds.setdefault(component.declaration.section, []).append(i)
    parts: tuple[Component, ...] = plan.acting
    for section, index in kinds.items():
        declared = parts[index[0]].declaration
        variables[section] = labels(section, [parts[i].name for i in index])
        if declared.force is None:
            torque = record.wrench[:, [len(plan.contacts) + i for i in index], 2]
            text = f"torque of a locked {declared.label} on its body"
            variables[f"{section}_torque"] = described(("time", section), torque, "N m", text)
        else:
            largest = peaks[[i for i in index if i < len(plan.components)]]
            kind = "torque" if declared.port.forces == ("torque",) else "force"
            unit = "N m" if kind == "torque" else "N"
            variables |= located(f"{section}_peak_{kind}", section, largest, unit, kind)
        for output in declared.reported:
            if declared.force is None and not output.coordinate:
                continue
            source = record.coordinate if output.coordinate else record.result
            last = output.first + output.components
            values = source[:, index, output.first : last] if output.components > 1 else source[:, index, output.first]
            dims = ("time", section, "axis") if output.components > 1 else ("time", section)
            text = f"{output.help} ({declared.label})"
            variables[f"{section}_{output.name}"] = described(dims, np.ascontiguousarray(values), output.unit, text)
        for output in declared.outputs_monitored:
            rows = [monitored.index(i * COMPONENT_RESULTS_MAX + output.first) for i in index]
            peaks_of_output = path.peaks(COMPONENT_OUTPUT)[rows]
            variables |= located(f"{section}_peak_{output.name}", section, peaks_of_output, output.unit, output.help)
        first = 2 * plan.coordinates.free + path.system.content.model.state_start[[len(plan.contacts) + i for i in index]]
        for s, state in enumerate(declared.states):
            text = f"{state.name.replace('_', ' ')}, an internal state ({declared.label})"
            internal = described(("time", section), path.samples.state[:, first + s], state.unit, text)
            variables.setdefault(f"{section}_{state.name}", internal)
        for place, i in enumerate(index if declared.contact else ()):
            for s, state in enumerate(parts[i].states):
                named, values = replace(state, name=f"{section}_{state.name}"), path.samples.state[:, first[place] + s]
                _enter_state(variables, named, ("time", section), len(index), place, values)
    variables.update(bar_variables(path, record, variables))
    variables.update(film_variables(plan, path, variables))
    return variables


def _rod_variables(plan: Plan, record: Record) -> Variables:
    if not plan.rods:
        return {}
    place = plan.coordinates.place
    span = np.stack([place(rod.end).at(record.X) - place(rod.start).at(record.X) for rod in plan.rods], axis=1)
    length = np.sqrt(np.sum(span * span, axis=-1))
    tension = -np.sum(record.wrench[:, -len(plan.rods) :, :2] * span, axis=-1) / length
    return {
        "rod": labels("rod", [rod.name for rod in plan.rods]),
        "rod_force": described(("time", "rod"), tension, "N", "force in a rod, positive in tension"),
        "rod_length": described(("time", "rod"), length, "m", "length of a rod"),
    }


def _control_variables(plan: Plan, path: Trajectory, record: Record) -> Variables:
    """Return the variables along `actuator`; internal states and signals are NaN for controllers without them."""
    chosen = plan.actuators
    if not chosen:
        return {}
    index = [i for i, _ in chosen]
    over, content = ("time", "actuator"), path.system.content
    peaks = path.peaks(COMPONENT_FORCE)[index]
    variables: Variables = {
        "actuator": labels("actuator", [part.name for _, part in chosen]),
        "control_torque": described(over, record.result[:, index, 0], "N m", "torque that a controller gives"),
        "control_error": described(over, record.observed[:, index, 0], "rad", "reference less measured angle"),
        **located("peak_control_torque", "actuator", peaks, "N m", "torque that a controller gives"),
    }
    recorder = content.model.recorder
    if np.any(recorder >= 0):
        for name, unit in RECORDABLE.items():
            at = (recorder[index] >= 0) & [part.controller.recorded == name for _, part in chosen]
            if at.any():
                values = np.where(at, record.observed[:, index, 1], np.nan)
                text = f"{name.replace('_', ' ')} as a controller with a delay records it"
                variables[f"recorded_{name}"] = described(over, values, unit, text)
    for place, (i, part) in enumerate(chosen):
        first = 2 * plan.coordinates.free + int(content.model.state_start[len(plan.contacts) + i])
        for s, declared in enumerate(part.controller.states):
            _enter_state(variables, declared, over, len(chosen), place, path.samples.state[:, first + s])
    return variables


def _enter_state(
    variables: Variables, declared: State, dims: tuple[str, str], parts: int, place: int, values: np.ndarray
) -> None:
    """Write the values of one part's internal state to a variable, which is NaN for parts without that state."""
    if declared.name not in variables:
        empty = np.full((values.size, parts), np.nan)
        variables[declared.name] = described(dims, empty, declared.unit, declared.name.replace("_", " "))
    variables[declared.name].values[:, place] = values


def _energy_variables(plan: Plan, path: Trajectory, record: Record) -> Variables:
    """Return energies and works over time; all are computed when one of them is read."""

    def energies() -> dict[str, np.ndarray]:
        account = dict(zip(ENERGY_TERMS, accounts(plan, path.samples.total, path.log, path.samples.time).T, strict=True))
        energy = record.kinetic + record.potential + record.elastic + record.stored
        loss = account["damping_loss"] + account["friction_loss"] + account["damper_loss"] + account["switching_loss"]
        work = account["drive_work"] + account["load_work"] + account["motor_work"]
        account |= {"dissipated_energy": loss, "energy_residual": energy - energy[:1] - work + loss}
        return account | {f"{name}_energy": getattr(record, name) for name in ("kinetic", "potential", "elastic", "stored")}

    energy_values = Deferred(energies, path.system.lock)

    def of(name: str) -> DeferredArray:
        return DeferredArray(path.samples.time.shape, lambda: np.ascontiguousarray(energy_values()[name]))

    return {name: described("time", of(name), "J", text) for name, text in ENERGIES.items()}


ENERGIES = {
    "kinetic_energy": "kinetic energy",
    "potential_energy": "potential energy of gravity",
    "elastic_energy": "elastic energy of the contacts",
    "stored_energy": "energy stored in springs and other components",
    "drive_work": "work of the drives, their impulses included",
    "motor_work": "work of motors and actuators",
    "load_work": "work of forces and torques",
    "damping_loss": "energy dissipated by contact damping",
    "friction_loss": "energy dissipated by friction",
    "damper_loss": "energy dissipated by dampers and other components",
    "switching_loss": "energy dissipated by latches that lock and tape springs that snap",
    "dissipated_energy": "dissipated energy",
    "energy_residual": "error of the energy balance",
}
"""Energy and work variables of a run, each with its meaning."""


def _drive_variables(plan: Plan, path: Trajectory, record: Record) -> Variables:
    if not plan.drives:
        return {}
    peaks = path.peaks(DRIVE_TORQUE)
    mean = path.root_mean_squares(DRIVE_TORQUE)
    variables = {
        "drive": labels("drive", [drive.body for drive in plan.drives]),
        # `drive_torque` is the torque of the first drive; `drive_torques` has all drives
        "drive_torque": described("time", record.torque[:, 0].copy(), "N m", "driving torque"),
        **located("peak_drive_torque", "drive", peaks, "N m", "driving torque"),
        "rms_drive_torque": described("drive", mean, "N m", "root mean square of the driving torque"),
    }
    if len(plan.drives) > 1:
        variables["drive_torques"] = described(("time", "drive"), record.torque, "N m", "driving torque of each drive")
    return variables


ARRAY_BAR = re.compile(r"(unit \d+)/bar ([12])")  # Pattern of the name of a bar in an array of scissor units


def synchronisation_variables(plan: Plan, record: Record) -> Variables:
    """Return the synchronisation error of each scissor unit, along `unit`; no variables for fewer than two units.

    With phi_1 and phi_2 the angles of its bars, the deployment angle of a unit is half of the angle between them,
    th = (phi_1 - phi_2)/2; in a straight array this is the inclination of the bars. In an ideal array of equal units, all units
    have the same deployment angle at every instant. The synchronisation error of unit k is the difference

        e_k = th_k - th_1
    """
    units: dict[str, tuple[int, int]] = plan.table("units", lambda: _units(plan))
    if len(units) < 2:
        return {}

    def errors() -> np.ndarray:
        first, second = np.array(list(units.values())).T
        opening = 0.5 * (record.angle[:, first] - record.angle[:, second])
        error = opening - opening[:, :1]
        error -= np.pi * np.round(error[:1] / np.pi)  # a full turn in the angle of one bar is half a turn here
        return np.asarray(error)

    error = described(("time", "unit"), DeferredArray((len(record.angle), len(units)), errors), "rad", UNIT_TEXT)
    largest = DeferredArray((len(units),), lambda: np.max(np.abs(error.values), axis=0, initial=0.0))
    return {
        "unit": labels("unit", list(units)),
        "synchronisation_error": error,
        "peak_synchronisation_error": described("unit", largest, "rad", "largest sampled size of the synchronisation error"),
    }


# Meaning, in a run, of the variable with the deployment angles of scissor units
UNIT_TEXT = "deployment angle of the unit less that of the first one"


def _units(plan: Plan) -> dict[str, tuple[int, int]]:
    """Return the indices of both bars of each scissor unit of an array, by the name of the unit."""
    bars: dict[str, dict[str, int]] = {}
    for place, body in enumerate(plan.bodies):
        match = ARRAY_BAR.fullmatch(body.name)
        if match and body.rotates:
            bars.setdefault(match[1], {})[match[2]] = place
    return {unit: (pair["1"], pair["2"]) for unit, pair in bars.items() if len(pair) == 2}
