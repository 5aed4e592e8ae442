"""The final state of one mechanism as the start of a slightly different one."""

from __future__ import annotations

import numpy as np

from scissordyn.errors import InputError
from scissordyn.integrate.advance import RECORD
from scissordyn.jit import Handle
from scissordyn.mechanics import functions
from scissordyn.mechanics.layout import lay_out
from scissordyn.mechanics.start import Start, carry_over, natural_state
from scissordyn.mechanics.system import APPROACH_FLOOR, build_system
from scissordyn.model.mechanism import Mechanism
from scissordyn.simulation.stroboscope import CycleState

__all__ = ["carried", "consistent"]


def carried(before: Mechanism, state: CycleState, after: Mechanism) -> CycleState:
    """The state of one mechanism as the start of another, with the same positions and velocities of bodies.

    Both are at the same phase of their drives; time restarts from zero.

    Parameters
    ----------
    before : Mechanism
    state : CycleState
        Of `before`, between two cycles.
    after : Mechanism
        Of the same bodies and joints; lengths, masses, drives, clearances and laws may differ.

    Returns
    -------
    CycleState

    Raises
    ------
    InputError
        If they are not of the same bodies and clearance joints.
    """
    if [b.name for b in before.bodies] != [b.name for b in after.bodies] or _clearance_joints(before) != _clearance_joints(
        after
    ):
        raise InputError("follow = True over mechanisms of different bodies or clearance joints", "follow = False")
    old, new = lay_out(before), lay_out(after)
    system = build_system(new)
    n = old.free
    position, velocity = natural_state(old, build_system(old), Start(state.state[:n], state.state[n : 2 * n]))
    start = carry_over(new, system, position, velocity)
    internal = state.state[2 * n :]
    if internal.size != int(system.state_start[-1]):
        raise InputError("follow = True over mechanisms whose friction laws have different states", "follow = False")
    full = np.concatenate([start.position, start.velocity, internal])
    system.mode[:], system.approach[:] = state.mode, state.approach
    return consistent(Handle(system), full)


def consistent(system: Handle, state: np.ndarray, *, cycle: int = 0, period: float = 0.0) -> CycleState:
    """A consistent start from a state with slightly violated constraints and possibly outdated contact modes.

    A joint that was in contact and has indentation stays in contact, with its approach speed and internal states; another joint
    with indentation starts a new contact.

    Parameters
    ----------
    system : Handle
        Of a `System` whose mode and approach are those before.
    state : ndarray, shape (ny,)
    cycle, period : int and float
        The start is at the time that is their product [s].

    Returns
    -------
    CycleState
    """
    content, now = system.content, cycle * period
    y = state.copy()
    functions.project(now, y, system.address)
    gap, rate = np.zeros(content.mode.size), np.zeros(content.mode.size)
    functions.guards(now, y, system.address, gap, rate)
    for j in range(content.mode.size):
        if (gap[j] > 0.0) != (content.mode[j] == 1):
            # a reset toggles the contact, and starts its friction in steady sliding
            functions.reset(now, y, j, system.address, np.zeros(RECORD))
    return CycleState(
        cycle=cycle,
        state=y,
        mode=content.mode.copy(),
        approach=np.maximum(content.approach, APPROACH_FLOOR),
        force=np.zeros(content.mode.size),
        total=np.zeros(5),
        stepping=np.zeros(0),
    )


def _clearance_joints(mechanism: Mechanism) -> list[str]:
    return [joint.name for joint in mechanism.contacts]
