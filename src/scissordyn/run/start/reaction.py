"""Reactions of the ideal mechanism at the start."""

from __future__ import annotations

import numpy as np

from scissordyn.integrate.integration import Samples
from scissordyn.kinematics.assembly import Held, Start, assemble, held_rods, placed_start
from scissordyn.mechanics.outputs import record
from scissordyn.mechanics.reactions import solve_reactions
from scissordyn.plan.plan import Plan
from scissordyn.run.advance.system import make_system
from scissordyn.run.answer.coupling import with_coupling_forces
from scissordyn.run.start.distributed import with_distributed_mass


def ideal_reactions(plan: Plan, position: np.ndarray | None = None, reference: np.ndarray | None = None) -> np.ndarray:
    """Forces on the journals of all revolute joints of a mechanism, taken as ideal, at t = 0.

    Shapes: `position` (n,); returns (joints, 2) [N].
    """
    plan = plan.ideal
    system = make_system(plan)
    if position is None:
        holds = Held(places=True, speeds=True)
        held_rods(plan, system.content, holds)
        start = assemble(plan, system.content, placed_start(plan, system.content), holds)
    else:
        start = Start(position, np.zeros(plan.coordinates.free))
    state = system.content.state
    internal = np.zeros(int(system.content.model.state_start[-1]))
    samples = Samples(
        time=np.zeros(1),
        state=np.concatenate([start.position, start.velocity, internal])[None, :],
        total=np.zeros((1, 0)),
        mode=state.mode[None, :].copy(),
        memory=state.memory[None, :].copy(),
        reference=(state.reference if reference is None else reference)[None, :].copy(),
    )
    outputs = with_coupling_forces(plan, record(plan.maps, system, samples))
    joints, _, _ = solve_reactions(plan.balance, plan.gravity_vector, with_distributed_mass(plan, outputs, samples.time))
    return np.asarray(joints[0])
