"""The initial state of a run: journals concentric, in contact, or the mechanism in static equilibrium."""

from __future__ import annotations

import math

import numpy as np

from scissordyn.errors import InputError
from scissordyn.integrate.advance import LOG_COLUMNS, RECORD
from scissordyn.jit import Handle
from scissordyn.laws.dispatch import elastic_force
from scissordyn.mechanics import functions
from scissordyn.mechanics.bodies import body_motion
from scissordyn.mechanics.layout import Form, Layout, lay_out
from scissordyn.mechanics.motion import course_at
from scissordyn.mechanics.outputs import record
from scissordyn.mechanics.reactions import known_loads, solve_reactions
from scissordyn.mechanics.start import Start, assemble, basis_at_start, carry_over, hold_joints, natural_state
from scissordyn.mechanics.system import APPROACH_FLOOR, System, build_system
from scissordyn.model.element import Actuator
from scissordyn.model.mechanism import Mechanism
from scissordyn.simulation.cause import check_springs
from scissordyn.simulation.options import Options
from scissordyn.simulation.rest import equilibrium, standing

__all__ = ["ideal_reactions", "prepare_start"]


def prepare_start(layout: Layout, system: System, options: Options) -> tuple[np.ndarray, list[list[float]]]:
    """The initial state, and the events of joints and end stops that start in contact.

    Parameters
    ----------
    layout : Layout
    system : System
        Its contact state is set.
    options : Options

    Returns
    -------
    state : ndarray, shape (ny,)
    initial_events : list of rows of the event log
    """
    mechanism = layout.mechanism
    start = _move_to_reference(layout, system, assemble(layout, system))
    if mechanism.contacts:
        ideal = lay_out(mechanism.ideal())
        ideal_system = build_system(ideal)
        ideal_start = _move_to_reference(ideal, ideal_system, assemble(ideal, ideal_system))
        start = carry_over(layout, system, *natural_state(ideal, ideal_system, ideal_start))
    match options.start:
        case "in-contact" if mechanism.contacts:
            if mechanism.contact_points:
                raise InputError(
                    f"start = 'in-contact' with the clearance guide '{mechanism.contact_points[0].guide}', whose block may "
                    "rest in several positions",
                    "start = 'static', or 'concentric', from which the contacts settle",
                )
            offsets = _contact_offsets(mechanism, system, ideal_reactions(ideal, ideal_system, ideal_start))
            start = _at_offsets(layout, system, start, offsets)
        case "static":
            place = _equilibrium_position(mechanism)
            forms = [_eccentricity_form(system, j) for j in range(len(mechanism.clearance_joints))]
            full = np.append(place, basis_at_start(system)[0])
            offsets = np.array([form.rows @ full[form.columns] for form in forms]).reshape(-1, 2)
            start = _at_offsets(layout, system, Start(place, start.velocity), offsets)
    state = np.concatenate([start.position, start.velocity, np.zeros(int(system.state_start[-1]))])
    check_springs(layout, system, state)
    return state, _touching(system, state) if options.start != "concentric" else []


def _equilibrium_position(mechanism: Mechanism) -> np.ndarray:
    """Free coordinates of static equilibrium: first of the ideal mechanism, then of the one with clearance near it."""
    fixed = standing(mechanism)
    ideal = lay_out(fixed.ideal())
    system = build_system(ideal)
    rest = Start(equilibrium(ideal, assemble(ideal, system).position), np.zeros(ideal.free))
    if not mechanism.contacts:
        return rest.position
    clearance_layout = lay_out(fixed)
    clearance_system = build_system(clearance_layout)
    start = carry_over(clearance_layout, clearance_system, *natural_state(ideal, system, rest))
    reaction = ideal_reactions(ideal, system, rest)
    has_clearance = [joint.clearance is not None for joint in mechanism.joints]
    if np.all(np.isfinite(reaction[has_clearance])):
        start = _at_offsets(clearance_layout, clearance_system, start, _contact_offsets(fixed, clearance_system, reaction))
    return equilibrium(clearance_layout, start.position)


def _at_offsets(layout: Layout, system: System, start: Start, offsets: np.ndarray) -> Start:
    """The state with the journals at given eccentricities, shape (nj, 2) [m]."""
    forms = tuple(_eccentricity_form(system, j) for j in range(offsets.shape[0]))
    names = tuple(joint.name for joint in layout.mechanism.clearance_joints)
    return hold_joints(layout, system, start, names, forms, offsets, np.zeros_like(offsets))


def _contact_offsets(mechanism: Mechanism, system: System, reaction: np.ndarray) -> np.ndarray:
    """Eccentricities at which the elastic contact forces equal the reactions of the ideal joints."""
    offsets = np.zeros((len(mechanism.clearance_joints), 2))
    for j, joint in enumerate(mechanism.clearance_joints):
        force = reaction[[other.name for other in mechanism.joints].index(joint.name)]
        if not np.all(np.isfinite(force)):
            raise InputError(
                f"start = 'in-contact' with clearance joint '{joint.name}', whose ideal reaction is not determined (more "
                "joints than the mechanism needs, or a singular position)",
                "start = 'concentric'",
            )
        size = float(np.hypot(*force))
        depth = _indentation(system, j, size)
        offsets[j] = -(system.radius[j, 0] + depth) * force / size if size > 0.0 else 0.0
    return offsets


def _touching(system: System, state: np.ndarray) -> list[list[float]]:
    """Put every joint and end stop that is past its gap into contact; returns the rows of the event log."""
    handle, rows = Handle(system), []
    gap, rate = np.zeros(system.mode.size), np.zeros(system.mode.size)
    functions.guards(0.0, state, handle.address, gap, rate)
    for guard in np.flatnonzero(gap > 0.0).tolist():
        event = np.zeros(RECORD)
        functions.reset(0.0, state, guard, handle.address, event)
        row = [0.0, float(guard), 1.0, max(float(event[0]), APPROACH_FLOOR), float(event[1])]
        rows.append(row + [0.0] * (LOG_COLUMNS - len(row)))
    return rows


def _move_to_reference(layout: Layout, system: System, start: Start) -> Start:
    """The initial state with the bodies at the angles and speeds of their references."""
    names, forms, directions, rates = [], [], [], []
    for i, element in enumerate(layout.mechanism.elements):
        if isinstance(element, Actuator) and element.start_on_reference:
            first = system.course[i]
            course_at(0.0, system.motion[system.motion_start[first] : system.motion_start[first + 1]], system.angle)
            angle, speed = system.angle[:2].tolist()
            names.append(f"the reference of actuator '{element.name}'")
            forms.append(layout.direction(element.body))
            directions.append((math.cos(angle), math.sin(angle)))
            rates.append((-speed * math.sin(angle), speed * math.cos(angle)))
    if not forms:
        return start
    return hold_joints(layout, system, start, tuple(names), tuple(forms), np.array(directions), np.array(rates))


def _eccentricity_form(system: System, j: int) -> Form:
    part = slice(system.link_start[j], system.link_start[j + 1])
    return Form(system.link_column[part], system.link_row[:2, part])


def ideal_reactions(layout: Layout, system: System, start: Start) -> np.ndarray:
    """Force on the journal of every revolute joint of an ideal mechanism at t = 0, shape (joints, 2) [N]."""
    internal = np.zeros(int(system.state_start[-1]))
    state = np.concatenate([start.position, start.velocity, internal])[None, :]
    guards = system.mode.size
    found = record(Handle(system), np.zeros(1), state, np.zeros((1, guards), np.int64), np.zeros((1, guards)))
    motion = body_motion(layout, found)
    joints, _, _ = solve_reactions(
        layout.mechanism,
        direction=motion.direction,
        position=motion.position,
        acceleration=motion.acceleration,
        spin_rate=motion.spin_rate,
        known=known_loads(layout, motion.direction, motion.position, found, system.radius),
    )
    return np.asarray(joints[0])


def _indentation(system: System, j: int, force: float) -> float:
    """Indentation at which the elastic part of joint j balances a force (bisection on a monotone law)."""
    if force == 0.0:
        return 0.0
    low, high = 0.0, float(system.radius[j, 0])
    while elastic_force(system.law[j, 0], high, system.elastic[j]) < force and high < system.radius[j, 1]:
        high *= 2.0
    for _ in range(200):
        middle = 0.5 * (low + high)
        if elastic_force(system.law[j, 0], middle, system.elastic[j]) < force:
            low = middle
        else:
            high = middle
    return high
