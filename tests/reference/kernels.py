"""A mechanism's kernels at a state of choice, for tests of the mechanics."""

from __future__ import annotations

import numpy as np

from scissordyn.kernel import Handle
from scissordyn.mechanics import functions
from scissordyn.model.mechanism import Mechanism
from scissordyn.plan.plan import plan
from scissordyn.run.advance.system import make_system
from scissordyn.run.start.start import prepare_start

__all__ = ["accepted", "at_start"]


def at_start(mechanism: Mechanism) -> tuple[Handle, np.ndarray]:
    """The system of a mechanism and its concentric start."""
    made = plan(mechanism)
    system = make_system(made)
    return system, prepare_start(made, system, "concentric").y


def accepted(system: Handle, y: np.ndarray, time: float = 0.0) -> np.ndarray:
    """The state brought back to the constraints, in place."""
    functions.accept(time, y, system.address, np.zeros(2))
    return y
