"""The state a run starts from: journals concentric, or resting in contact."""

from __future__ import annotations

import numpy as np

from scissordyn.errors import InputError
from scissordyn.integrate.advance import RECORD
from scissordyn.jit import Handle
from scissordyn.laws.ladder import elastic_force
from scissordyn.mechanics import functions
from scissordyn.mechanics.bodies import body_motion
from scissordyn.mechanics.layout import Form, Layout, lay_out
from scissordyn.mechanics.outputs import record
from scissordyn.mechanics.reactions import known_loads, solve_reactions
from scissordyn.mechanics.start import Start, assemble, carry_over, hold_joints, natural_state
from scissordyn.mechanics.system import APPROACH_FLOOR, System, build_system
from scissordyn.simulation.options import Options

__all__ = ["prepare_start"]


def prepare_start(layout: Layout, system: System, options: Options) -> tuple[np.ndarray, list[list[float]]]:
    """The state to start from, and the events of joints that start in contact.

    Parameters
    ----------
    layout : Layout
    system : System
        Its contact state is set.
    options : Options

    Returns
    -------
    state : ndarray, shape (ny,)
    opening : list of rows of the event log
    """
    mechanism = layout.mechanism
    states = np.zeros(int(system.state_start[-1]))
    if not mechanism.contacts:
        start = assemble(layout, system)
        return np.concatenate([start.position, start.velocity, states]), []
    ideal = lay_out(mechanism.tighten())
    ideal_system = build_system(ideal)
    ideal_start = assemble(ideal, ideal_system)
    start = carry_over(layout, system, *natural_state(ideal, ideal_system, ideal_start))
    if options.start == "concentric":
        return np.concatenate([start.position, start.velocity, states]), []
    if mechanism.corners:
        raise InputError(
            f"start = 'in-contact' with the loose guide '{mechanism.corners[0].guide}', whose corners may rest in several ways",
            "start = 'concentric', from which they settle",
        )
    pull = _ideal_reactions(ideal, ideal_system, ideal_start)
    if not np.all(np.isfinite(pull)):
        raise InputError(
            "start = 'in-contact' in a mechanism whose ideal reactions are not determined (more joints than it needs)",
            "start = 'concentric'",
        )
    offsets = np.zeros((len(mechanism.loose), 2))
    for j, joint in enumerate(mechanism.loose):
        force = pull[[other.name for other in mechanism.joints].index(joint.name)]
        size = float(np.hypot(*force))
        depth = _indentation(system, j, size)
        offsets[j] = -(system.radius[j, 0] + depth) * force / size if size > 0.0 else 0.0
    forms = tuple(_eccentricity_form(system, j) for j in range(len(mechanism.loose)))
    start = hold_joints(layout, system, start, forms, offsets, np.zeros_like(offsets))
    state = np.concatenate([start.position, start.velocity, states])
    opening = []
    handle = Handle(system)
    for j in range(len(mechanism.loose)):
        if np.any(offsets[j]):
            remark = np.zeros(RECORD)
            functions.reset(0.0, state, j, handle.address, remark)
            opening.append([0.0, float(j), 1.0, max(float(remark[0]), APPROACH_FLOOR), float(remark[1]), 0.0, 0.0])
    return state, opening


def _eccentricity_form(system: System, j: int) -> Form:
    part = slice(system.link_start[j], system.link_start[j + 1])
    return Form(system.link_column[part], system.link_row[:2, part])


def _ideal_reactions(layout: Layout, system: System, start: Start) -> np.ndarray:
    """Force on the journal of every revolute joint of an ideal mechanism at t = 0, shape (joints, 2) [N]."""
    state = np.concatenate([start.position, start.velocity])[None, :]
    found = record(Handle(system), np.zeros(1), state, np.zeros((1, 0), np.int64), np.zeros((1, 0)))
    motion = body_motion(layout, found)
    joints, _, _ = solve_reactions(
        layout.mechanism,
        direction=motion.direction,
        position=motion.position,
        acceleration=motion.acceleration,
        spin_rate=motion.spin_rate,
        known=known_loads(layout.mechanism, motion.direction, motion.position, found, system.radius),
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
