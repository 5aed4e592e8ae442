"""State entries that guards and monitored quantities read, compared with differences of the guards."""

import numpy as np

import scissordyn as sd
from reference.kernels import at_start
from scissordyn.mechanics import functions
from scissordyn.mechanics.monitored import FRICTION_RATIO, INDENTATION, PRESSURE_VELOCITY, entries_read, monitored_rows

JOINTS = ("unit 1/upper", "unit 4/pivot")  # Clearance joints of the array


def test_entries_read_by_a_contact():
    """Independent formulation: a contact reads the entries that change its gap or gap rate, and its friction states."""
    arm = sd.scissor(units=5, angle=0.6).driven(speed=2.0)
    for joint in JOINTS:
        arm = arm.with_clearance(joint, sd.Clearance(5e-4, friction=sd.LuGre(0.1)))
    handle, state = at_start(arm)
    model = handle.content.model
    start, entries = entries_read(model, len(JOINTS))

    def gaps(y):
        value, rate = np.zeros(2), np.zeros(2)
        functions.guards(0.0, y, handle.address, value, rate)
        return np.stack([value, rate], axis=1)

    state[: 2 * model.n] += 1e-3 * np.random.default_rng(2).normal(size=2 * model.n)
    for k in range(len(JOINTS)):
        moving = set()
        for i in range(2 * model.n):
            there = state.copy()
            there[i] += 1e-4
            if np.any(np.abs(gaps(there) - gaps(state))[k] > 1e-9):
                moving.add(i)
        own = range(2 * model.n + int(model.state_start[k]), 2 * model.n + int(model.state_start[k + 1]))
        rows = [k, *(monitored_rows(model, kind)[k] for kind in (PRESSURE_VELOCITY, INDENTATION, FRICTION_RATIO))]
        for row in rows:
            read = set(entries[start[row] : start[row + 1]].tolist())
            assert moving | set(own) <= read
            assert len(read) < state.size
