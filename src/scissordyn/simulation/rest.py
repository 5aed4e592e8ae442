"""Static equilibrium of a mechanism with its clearance joints under gravity, springs and loads."""

from __future__ import annotations

import dataclasses
import math
from typing import TypeVar

import numpy as np

from scissordyn.component.time_function import ConstantSpeed, Polynomial, TimeFunction
from scissordyn.errors import InputError
from scissordyn.jit import Handle
from scissordyn.laws.friction.none import NoFriction
from scissordyn.mechanics import functions
from scissordyn.mechanics.reduced_model import ReducedModel
from scissordyn.mechanics.system import System
from scissordyn.mechanics.time_function import function_start
from scissordyn.model.joint import Guide, Revolute
from scissordyn.model.mechanism import Mechanism

__all__ = ["at_rest", "equilibrium"]

Joint = TypeVar("Joint", Revolute, Guide)

AT_REST = 1e-9
"""Unbalanced force, relative to the load, below which a mechanism is in equilibrium: the round-off of a stiff contact."""

STILL = 1e-14
"""A step of the coordinates, relative to the mechanism's size, below which they are equilibrium to round-off."""

LONGEST = 1e6
"""Step [s] from which the iteration is Newton's method."""

MOST_STEPS = 500
MOST_CORRECTIONS = 12

SOLVED = 0.1
"""An implicit step has converged when a correction is this fraction of the step."""

MOST_GROWTH = 10.0
"""An implicit step that increases the force by more than this factor is rejected."""


def at_rest(mechanism: Mechanism) -> Mechanism:
    """The same mechanism with its drives and prescribed distances constant at their values of t = 0, and without friction."""

    def constant(motion: TimeFunction, start: float) -> TimeFunction:
        return Polynomial((start if isinstance(motion, ConstantSpeed) else function_start(motion),))

    return dataclasses.replace(
        mechanism,
        drives=tuple(
            dataclasses.replace(drive, motion=constant(drive.motion, mechanism.body(drive.body).angle))
            for drive in mechanism.drives
        ),
        joints=tuple(_frictionless(joint) for joint in mechanism.joints),
        guides=tuple(_frictionless(guide) for guide in mechanism.guides),
        rods=tuple(dataclasses.replace(rod, motion=rod.motion and constant(rod.motion, 0.0)) for rod in mechanism.rods),
    )


def _frictionless(joint: Joint) -> Joint:
    if joint.clearance is None:
        return joint
    return dataclasses.replace(joint, clearance=dataclasses.replace(joint.clearance, friction=NoFriction()))


def equilibrium(reduced: ReducedModel, handle: Handle, position: np.ndarray) -> np.ndarray:
    """Free coordinates of a stable equilibrium, by descent from a given position.

    Pseudo-transient continuation: implicit Euler steps from rest, each solved by Newton's method, with a step size that grows
    as long as it converges, so that the iteration tends to Newton's method. Steps from rest reduce the potential energy, and so
    lead to stable equilibrium.

    Parameters
    ----------
    reduced : ReducedModel
        Of a mechanism with constant drives (see `at_rest`).
    handle : Handle
        Of a `System` of it; its state is overwritten.
    position : ndarray, shape (n,)

    Returns
    -------
    ndarray, shape (n,)

    Raises
    ------
    InputError
        If no equilibrium is found.

    References
    ----------
    Kelley and Keyes 1998, doi:10.1137/S0036142996304796
    """
    system: System = handle.content
    n, internal = reduced.free, int(system.model.state_start[-1])
    state = np.concatenate([position, np.zeros(n + internal)])
    rate, by_time, answer = np.zeros(state.size), np.zeros(state.size), np.zeros(2)
    # the weight that ideal guides bear counts, too: the part along them may be round-off only
    mechanism = reduced.mechanism
    inertia = math.sqrt(sum(body.mass for body in mechanism.bodies))
    load = mechanism.gravity * inertia
    step, force, scale = 1e-3, np.inf, load
    for _ in range(MOST_STEPS):
        base, before, solved = state[:n].copy(), force, False
        for _correction in range(MOST_CORRECTIONS):
            functions.accept(0.0, state, handle.address, answer)
            _touch(handle, state)
            functions.linearise(0.0, state, handle.address, rate, by_time)
            force = float(np.linalg.norm(rate[n : 2 * n]))
            if mechanism.gravity == 0.0:
                load = max(load, force)
            scale = load + float(np.linalg.norm(system.work.force[:n]))
            if force <= AT_REST * scale:
                return state[:n].copy()
            if solved and force <= MOST_GROWTH * before:
                break
            left = rate[n : 2 * n] - (state[:n] - base) / step**2
            change = np.concatenate([np.zeros(n), left, np.zeros(internal)])
            if functions.factorize(step, handle.address) >= 0:
                continue
            functions.solve(change, handle.address)
            state[:n] += change[:n]
            # the residual normal to the constraints does not vanish, the correction does
            moved = float(np.linalg.norm(state[:n] - base))
            if step >= LONGEST and moved <= STILL * inertia * reduced.size:
                return state[:n].copy()
            solved = bool(np.linalg.norm(change[:n]) <= SOLVED * moved)
        else:
            state[:n], force = base, before
            step *= 0.2
            continue
        step = min(LONGEST, 3.0 * step)
    raise InputError(
        f"start = 'static': no equilibrium was found (unbalanced force {force / scale:.2g} of the load)",
        "a mechanism that gravity, springs and drives keep in equilibrium",
        "start = 'concentric'",
    )


def _touch(handle: Handle, state: np.ndarray) -> None:
    """Let every contact and component act that is past its gap, but for latches."""
    system: System = handle.content
    value, rate = np.zeros(system.state.mode.size), np.zeros(system.state.mode.size)
    functions.guards(0.0, state, handle.address, value, rate)
    system.state.mode[:] = value > 0.0
    system.state.mode[system.model.component_guard[system.model.latch[:, 2]]] = 0
    system.state.memory[:] = 1.0
