"""The Dataset of a trajectory."""

from __future__ import annotations

import dataclasses
import json
import math
import platform
from functools import cache
from importlib.metadata import version

import numpy as np
import xarray as xr

from scissordyn.component.actuator import Actuator
from scissordyn.component.place import GROUND
from scissordyn.integrate.problem import Samples
from scissordyn.mechanics.bodies import BodyMotion, body_motion
from scissordyn.mechanics.outputs import Record, record
from scissordyn.mechanics.reactions import connection_forces, journal_forces, known_loads, solve_reactions
from scissordyn.model.mechanism import Mechanism
from scissordyn.model.record import to_plain
from scissordyn.simulation.cause import singular_position
from scissordyn.simulation.contacts import columns, contacts
from scissordyn.simulation.events import event_variables, latch_losses
from scissordyn.simulation.options import Options
from scissordyn.simulation.trajectory import Trajectory

__all__ = ["to_dataset"]

Variable = tuple[tuple[str, ...], np.ndarray, dict[str, str]]


@cache
def _versions() -> str:
    packages = ("scissordyn", "numpy", "scipy", "numba")
    return json.dumps({"python": platform.python_version(), **{name: version(name) for name in packages}})


def _described(dims: tuple[str, ...], values: np.ndarray, units: str, long_name: str) -> Variable:
    return dims, values, {"units": units, "long_name": long_name}


def to_dataset(mechanism: Mechanism, options: Options, path: Trajectory) -> xr.Dataset:
    """All results of a run.

    Parameters
    ----------
    mechanism : Mechanism
    options : Options
    path : Trajectory

    Returns
    -------
    Dataset
        With the names of the package's contract; all values in SI units and radians.
    """
    path, found = _recorded(path)
    samples = path.samples
    motion = body_motion(path.layout, found)
    variables = {
        **_motion_variables(mechanism, motion),
        **_joint_variables(mechanism, path, found, motion),
        **_element_variables(mechanism, found),
        **_connection_variables(path, found),
        **_control_variables(mechanism, path, found),
        **_energy_variables(path, found),
        **_contact_variables(mechanism, path),
        **event_variables(mechanism, path.log),
    }
    coordinates = {
        "time": _described(("time",), samples.time, "s", "time"),
        "body": ("body", [body.name for body in mechanism.bodies]),
        "joint": ("joint", list(mechanism.joint_names)),
        "axis": ("axis", ["x", "y"]),
    }
    attributes = {
        "title": "scissordyn run",
        "status": path.status,
        "cause": path.cause,
        "end": path.end,
        "statistics": json.dumps(path.statistics),
        "warnings": "[]",
        "configuration": json.dumps({"mechanism": to_plain(mechanism), "options": to_plain(options)}),
        "versions": _versions(),
        "length_error": float(found.length_error[0]),
        "trusted_until": math.nan,
        "trusted_contacts": -1,
    }
    return xr.Dataset(variables, coords=coordinates, attrs=attributes)


def _recorded(path: Trajectory) -> tuple[Trajectory, Record]:
    """The recorded samples, up to the first at which the accelerations are not defined; the run counts as failed there."""
    samples = path.samples
    found = record(path.system, samples.time, samples.state, samples.mode, samples.memory)
    undefined = np.flatnonzero(~np.all(np.isfinite(found.A), axis=1))
    if not undefined.size:
        return path, found
    first, time = int(undefined[0]), float(samples.time[undefined[0]])
    why = singular_position(path.layout, path.system, samples.state[first], time) or "accelerations are not defined"
    kept = Samples(*(part[:first] for part in samples))
    cause = f"stopped at t = {time:.9g} s: {why}"
    log = path.log[path.log[:, 0] < time]
    cut = dataclasses.replace(path, samples=kept, log=log, end=time, status="failed", cause=cause)
    return cut, record(cut.system, kept.time, kept.state, kept.mode, kept.memory)


def _motion_variables(mechanism: Mechanism, motion: BodyMotion) -> dict[str, Variable]:
    point, rotation = ("time", "body", "axis"), ("time", "body")
    variables = {
        "position": _described(point, motion.position, "m", "position of the mass centre"),
        "velocity": _described(point, motion.velocity, "m/s", "velocity of the mass centre"),
        "acceleration": _described(point, motion.acceleration, "m/s^2", "acceleration of the mass centre"),
        "angle": _described(rotation, motion.angle, "rad", "angle"),
        "angular_velocity": _described(rotation, motion.spin, "rad/s", "angular velocity"),
        "angular_acceleration": _described(rotation, motion.spin_rate, "rad/s^2", "angular acceleration"),
    }
    for guide in mechanism.guides:
        if guide.follower[0] != mechanism.output_body or guide.body != GROUND:
            continue
        k = [body.name for body in mechanism.bodies].index(mechanism.output_body)
        along = np.array([math.cos(guide.direction), math.sin(guide.direction)])
        for name, values, units in (
            ("position", motion.position[:, k] - np.array(guide.through), "m"),
            ("velocity", motion.velocity[:, k], "m/s"),
            ("acceleration", motion.acceleration[:, k], "m/s^2"),
        ):
            variables[f"slider_{name}"] = _described(("time",), values @ along, units, f"{name} of the slider along its guide")
    return variables


def _joint_variables(mechanism: Mechanism, path: Trajectory, found: Record, motion: BodyMotion) -> dict[str, Variable]:
    """Quantities per joint; those that exist at clearance joints only are NaN at ideal ones."""
    names = list(mechanism.joint_names)
    touching_joints = np.array([names.index(joint.name) for joint in mechanism.contacts], int)
    ideal = np.array([names.index(joint.name) for joint in mechanism.ideal_joints], int)
    instants, contact = found.X.shape[0], found.joint
    normal, tangential, force = contact[..., 4], contact[..., 5], journal_forces(found)
    radius = path.system.content.radius
    joints, guided, _ = solve_reactions(
        mechanism,
        direction=motion.direction,
        position=motion.position,
        acceleration=motion.acceleration,
        spin_rate=motion.spin_rate,
        known=known_loads(path.layout, motion.direction, motion.position, found, radius),
    )
    reaction = np.zeros((instants, len(names), 2))
    reaction[:, touching_joints], reaction[:, ideal] = force, joints
    bodies = [body.name for body in mechanism.bodies]
    for point, pushed in zip(
        mechanism.contact_points, np.moveaxis(force[:, len(mechanism.clearance_joints) :], 1, 0), strict=True
    ):
        reaction[:, names.index(point.guide)] += pushed
    for g, guide in enumerate(mechanism.ideal_guides):
        across = np.array([-math.sin(guide.direction), math.cos(guide.direction)])
        if guide.body != GROUND:
            cos, sin = motion.direction[:, bodies.index(guide.body)].T
            across = np.stack([cos * across[0] - sin * across[1], sin * across[0] + cos * across[1]], axis=1)
        reaction[:, names.index(guide.name)] = guided[:, g : g + 1] * across
    what = "force on the journal (contact force at clearance joints, reaction at ideal ones), on the follower for guides"
    variables = {"reaction": _described(("time", "joint", "axis"), reaction, "N", what)}
    if touching_joints.size == 0:
        return variables

    def everywhere(values: np.ndarray) -> np.ndarray:
        full = np.full((*values.shape[:1], len(names), *values.shape[2:]), np.nan)
        full[:, touching_joints] = values
        return full

    eccentricity = contact[..., 8:9] * contact[..., 6:8]
    per_joint = ("time", "joint")
    touching = np.zeros((instants, len(names)), bool)
    touching[:, touching_joints] = path.samples.mode[:, : touching_joints.size] == 1
    clearance = np.full(len(names), np.nan)
    clearance[touching_joints] = radius[:, 0]
    variables |= {
        "eccentricity": _described(
            (*per_joint, "axis"),
            everywhere(eccentricity),
            "m",
            "journal centre relative to the bearing centre; for a contact point of a guide, the displacement across the guide",
        ),
        "indentation": _described(per_joint, everywhere(contact[..., 0]), "m", "indentation, negative in free flight"),
        "normal_force": _described(per_joint, everywhere(normal), "N", "normal contact force"),
        "friction_force": _described(per_joint, everywhere(tangential), "N", "tangential contact force"),
        "slip_speed": _described(per_joint, everywhere(contact[..., 2]), "m/s", "slip speed of the two surfaces"),
        "in_contact": _described(per_joint, touching, "1", "journal and bearing in contact"),
        "clearance": _described(("joint",), clearance, "m", "radial clearance"),
    }
    if mechanism.contact_points:
        plane_contact = np.isin(names, [point.name for point in mechanism.contact_points])
        variables["plane_contact"] = _described(
            ("joint",), plane_contact, "1", "contact point of a block at a plane guide surface"
        )
    for j, joint in enumerate(mechanism.contacts):
        assert joint.clearance is not None
        first, state = int(path.system.content.state_start[j]), path.samples.state[:, 2 * path.layout.free :]
        for s, name in enumerate(joint.clearance.friction.states):
            values = variables.setdefault(
                name, _described(per_joint, np.full(touching.shape, np.nan), "SI", name.replace("_", " "))
            )[1]
            values[:, touching_joints[j]] = np.where(path.samples.mode[:, j] == 1, state[:, first + s], np.nan)
    return variables


def _element_variables(mechanism: Mechanism, found: Record) -> dict[str, Variable]:
    if not mechanism.elements:
        return {}
    return {
        "element": (("element",), np.array([element.name for element in mechanism.elements]), {"long_name": "element"}),
        "element_force": _described(("time", "element", "axis"), found.element[..., :2], "N", "force on the end of an element"),
        "element_torque": _described(("time", "element"), found.element[..., 2], "N m", "torque on the body of an element"),
    }


def _connection_variables(path: Trajectory, found: Record) -> dict[str, Variable]:
    mechanism = path.layout.mechanism
    thrust, latch_torque = connection_forces(path.layout, found)
    variables: dict[str, Variable] = {}
    if mechanism.rods:
        names = np.array([rod.name for rod in mechanism.rods])
        forms = [(path.layout.place(rod.end), path.layout.place(rod.start)) for rod in mechanism.rods]
        span = np.stack([found.X[:, a.columns] @ a.rows.T - found.X[:, b.columns] @ b.rows.T for a, b in forms], axis=1)
        length = np.sqrt(np.sum(span * span, axis=-1))
        tension = -np.sum(thrust * span, axis=-1) / length
        variables["rod"] = ("rod",), names, {"long_name": "rod"}
        variables["rod_force"] = _described(("time", "rod"), tension, "N", "force in a rod, positive in tension")
        variables["rod_length"] = _described(("time", "rod"), length, "m", "length of a rod")
    if mechanism.latches:
        variables["latch"] = ("latch",), np.array([latch.name for latch in mechanism.latches]), {"long_name": "latch"}
        variables["latch_torque"] = _described(("time", "latch"), latch_torque, "N m", "torque of a locked latch on its body")
    return variables


def _control_variables(mechanism: Mechanism, path: Trajectory, found: Record) -> dict[str, Variable]:
    """Quantities per actuator; internal states and recorded signals are NaN at controllers that have none."""
    chosen = [(i, element) for i, element in enumerate(mechanism.elements) if isinstance(element, Actuator)]
    if not chosen:
        return {}
    index = [i for i, _ in chosen]
    over, system = ("time", "actuator"), path.system.content
    variables: dict[str, Variable] = {
        "actuator": (("actuator",), np.array([element.name for _, element in chosen]), {"long_name": "actuator"}),
        "control_torque": _described(over, found.element[:, index, 2], "N m", "torque of a controller"),
        "control_error": _described(over, found.observed[:, index, 0], "rad", "reference less measured angle"),
    }
    recorded = np.where(system.recorder[index] >= 0, found.observed[:, index, 1], np.nan)
    if np.any(system.recorder >= 0):
        variables["control_signal"] = _described(over, recorded, "SI", "recorded signal of a controller")
    for place, (i, element) in enumerate(chosen):
        first = 2 * path.layout.free + int(system.state_start[len(mechanism.contacts) + i])
        for s, name in enumerate(element.controller.states):
            empty = np.full((found.X.shape[0], len(chosen)), np.nan)
            values = variables.setdefault(name, _described(over, empty, "N m", name.replace("_", " ")))[1]
            values[:, place] = path.samples.state[:, first + s]
    return variables


def _energy_variables(path: Trajectory, found: Record) -> dict[str, Variable]:
    work, damping, friction, loads, dampers = path.samples.total.T
    energy = found.kinetic + found.potential + found.elastic + found.springs
    locking = latch_losses(path.layout.mechanism, path.log, path.samples.time)
    lost = damping + friction + dampers + locking
    residual = energy - energy[:1] - work - loads + lost
    named = {
        "kinetic_energy": (found.kinetic, "kinetic energy"),
        "potential_energy": (found.potential, "potential energy of gravity"),
        "elastic_energy": (found.elastic, "elastic energy of the contacts"),
        "drive_work": (work, "work of the drives"),
        "damping_loss": (damping, "energy dissipated by contact damping"),
        "friction_loss": (friction, "energy dissipated by friction"),
        "spring_energy": (found.springs, "energy stored in springs"),
        "load_work": (loads, "work of forces, torques, motors and actuators"),
        "damper_loss": (dampers, "energy dissipated by dampers"),
        "latch_loss": (locking, "energy lost in the impacts of locking latches"),
        "dissipated_energy": (lost, "dissipated energy"),
        "energy_residual": (residual, "residual of the energy balance"),
    }
    variables = {name: _described(("time",), values, "J", text) for name, (values, text) in named.items()}
    if found.torque.shape[1]:
        # with several drives, `drive_torque` is that of the first; the torques of all are another variable
        variables["drive_torque"] = _described(("time",), found.torque[:, 0].copy(), "N m", "driving torque")
    if found.torque.shape[1] > 1:
        variables["drive_torques"] = _described(("time", "drive"), found.torque, "N m", "driving torque of each drive")
    return variables


def _contact_variables(mechanism: Mechanism, path: Trajectory) -> dict[str, Variable]:
    table = columns(contacts(path.log, path.peak[: len(mechanism.contacts)]))
    names = np.array([joint.name for joint in mechanism.contacts], dtype=object)
    joint = names[table["joint"]] if names.size else names
    along = ("contact",)
    return {
        "contact_joint": (along, joint.astype(str), {"long_name": "joint"}),
        "contact_start": _described(along, table["start"], "s", "start of the contact"),
        "approach_speed": _described(along, table["approach_speed"], "m/s", "approach speed"),
        "contact_angle": _described(along, table["angle"], "rad", "direction of the normal at the start"),
        "peak_force": _described(along, table["peak_force"], "N", "largest normal force"),
        "peak_time": _described(along, table["peak_time"], "s", "time from the start to the largest normal force"),
        "contact_duration": _described(along, table["duration"], "s", "duration"),
        "rebound_speed": _described(along, table["rebound_speed"], "m/s", "rate of indentation at the end"),
        "impulse": _described(along, table["impulse"], "N s", "impulse of the normal force"),
        "contact_damping_loss": _described(along, table["damping_loss"], "J", "energy dissipated by damping in the contact"),
        "contact_friction_loss": _described(along, table["friction_loss"], "J", "energy dissipated by friction in the contact"),
    }
