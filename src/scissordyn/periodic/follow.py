"""The final state of one mechanism as the start of a slightly different one."""

from __future__ import annotations

import numpy as np

from scissordyn.errors import InputError
from scissordyn.integrate.integration import NO_EVENT, RESET_DATA
from scissordyn.kernel import Handle
from scissordyn.kinematics.assembly import Start, basis_at_start, natural_state
from scissordyn.mechanics import functions
from scissordyn.mechanics.system import APPROACH_FLOOR
from scissordyn.model.mechanism import Mechanism
from scissordyn.periodic.stroboscope import start_state
from scissordyn.plan.plan import plan
from scissordyn.run.advance.driver import Snapshot
from scissordyn.run.advance.system import make_system


def carried(before: Mechanism, state: Snapshot, after: Mechanism) -> Snapshot:
    """The state of one mechanism as the start of another, with the same positions and velocities of bodies.

    Both are at the same phase of their drives; time restarts from zero.
    """
    if [b.name for b in before.bodies] != [b.name for b in after.bodies] or _clearance_joints(before) != _clearance_joints(
        after
    ):
        raise InputError("follow = True over mechanisms of different bodies or clearance joints", "follow = False")
    old, new = plan(before), plan(after)
    system = make_system(new)
    n = old.coordinates.free
    position, velocity = natural_state(old, make_system(old).content, Start(state.y[:n], state.y[n : 2 * n]))
    b, rate = basis_at_start(system.content)
    internal = state.y[2 * n :]
    if internal.size != int(system.content.model.state_start[-1]):
        raise InputError("follow = True over mechanisms whose friction laws have different states", "follow = False")
    full = np.concatenate([new.coordinates.nearest(b, position), new.coordinates.nearest(rate, velocity), internal])
    begin = start_state(after)
    moved = begin.changed(y=full, mode=state.mode, memory=state.arrays["memory"], reference=state.arrays["reference"])
    return consistent(system, moved)


def consistent(system: Handle, state: Snapshot) -> Snapshot:
    """A consistent start from a state with slightly violated constraints and possibly outdated contact modes.

    A joint that was in contact and has indentation stays in contact, with its approach speed and internal states; another joint
    with indentation starts a new contact.
    """
    live, y, answer = system.content.state, state.y.copy(), np.zeros(2)
    live.mode[:], live.memory[:], live.reference[:] = state.mode, state.arrays["memory"], state.arrays["reference"]
    functions.activate(system.address)
    functions.accept(state.time, y, system.address, answer)
    value, rate = np.zeros(live.mode.size), np.zeros(live.mode.size)
    functions.guards(state.time, y, system.address, value, rate)
    for k in range(live.mode.size):
        if value[k] > 0.0 and live.mode[k] == 0:
            functions.touch(state.time, y, k, system.address, np.zeros(RESET_DATA))
        elif not value[k] > 0.0 and live.mode[k] == 1:
            functions.reset(state.time, y, k, system.address, np.zeros(RESET_DATA))
    clock = state.arrays["clock"].copy()
    clock["longest"], clock["prepared"], clock["first"], clock["last_event"] = answer[1], 0, 0.0, NO_EVENT
    clock["touching"], clock["reach"] = 0, np.inf
    return state.changed(
        clock=clock,
        y=y,
        mode=live.mode,
        memory=np.where(live.memory < 0.0, live.memory, np.maximum(live.memory, APPROACH_FLOOR)),
        reference=live.reference,
    )


def _clearance_joints(mechanism: Mechanism) -> list[str]:
    return [joint.name for joint in mechanism.contacts]
