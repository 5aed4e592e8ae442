"""System of a plan: everything that the kernels of mechanics read and write, at the start of a case."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

from scissordyn.kernel import Handle, Template
from scissordyn.mechanics import functions
from scissordyn.mechanics.system import Parameters, System
from scissordyn.mechanics.workspace import initial_state, make_workspace, worn_surfaces
from scissordyn.plan.plan import Plan


def make_system(plan: Plan) -> Handle:
    """Return a new system of a plan, at rest with all contacts open; each thread needs its own."""
    numbers = plan.numbers()
    template = plan.template("system", lambda: _template(_new_system(plan, numbers)))
    if template is None:
        return Handle(_new_system(plan, numbers))
    replaced_parts: dict[str, Any] = {f"Workspace.{name}": part for name, part in worn_surfaces(numbers).items()}
    replaced_parts |= {"System.model": plan.model, "System.parameters": numbers}
    if "System.friction" in template.shared:
        replaced_parts["System.friction"] = plan.friction_workspace()
    else:
        replaced_parts |= {"FrictionWorkspace.balance": plan.balance, "FrictionWorkspace.maps": plan.maps}
    system = template.copy(replaced_parts)
    content: System = system.content
    content.state.reference[:] = plan.angles
    content.work.value[0] = numbers.value
    content.work.part_weight[:] = _part_weights(plan, content)
    content.friction.gravity[:] = plan.gravity_vector
    return system


def _part_weights(plan: Plan, content: System) -> np.ndarray:
    """Return the weights of the parts of constraints; those of inactive constraints are zero."""
    return np.asarray(plan.model.part_full * (1.0 - content.work.inactive[plan.model.part_constraint]))


def _new_system(plan: Plan, numbers: Parameters) -> System:
    state, work = initial_state(plan.model, plan.angles), make_workspace(plan.model, numbers)
    return System(plan.model, numbers, state, work, plan.friction_workspace())


def _template(first: System) -> Template:
    """Return the template from which systems with the same tables are copied."""
    shared = {"System.model", "System.parameters", *(f"Workspace.{name}" for name in worn_surfaces(first.parameters))}
    # with friction in ideal joints its tables depend on the case; without it the nested ones are empty
    tables = {f"FrictionWorkspace.{name}" for name in ("balance", "maps", "bending")}
    return Template(first, shared | ({"System.friction"} if first.friction.component.size else tables))


def put_numbers(system: Handle, plan: Plan) -> bool:
    """Replace the parameters of a system by those of another case and reset its state; return False if shapes differ."""
    content: System = system.content
    model, parameters, state = plan.model, plan.numbers(), initial_state(plan.model, plan.angles)
    # `compare_with` sets the table of the ideal mechanism, which differs for each case
    parameters = parameters._replace(ideal=content.parameters.ideal, ideal_step=content.parameters.ideal_step)
    pairs = [*zip(content.parameters, parameters, strict=True), *zip(content.state, state, strict=True)]
    if state.initial_history.size or any(old.shape != new.shape for old, new in pairs):
        return False
    for old, new in pairs:
        if new.size:
            old[...] = new
    work = content.work
    work.instant[:] = np.nan
    work.value[0] = parameters.value
    work.inactive[:] = 0.0
    work.inactive[model.latch[:, 0]] = 1.0
    work.part_weight[:] = _part_weights(plan, content)
    return True


@contextmanager
def state_kept(system: Handle) -> Iterator[None]:
    """Restore the state of a system at the end of a `with` block."""
    state = system.content.state
    before = [part.copy() for part in state]
    yield
    for part, kept in zip(state, before, strict=True):
        part[...] = kept


def guard_values(system: Handle, time: float, state: np.ndarray) -> np.ndarray:
    """Return the values of all guards at a state, shape (guards,)."""
    values = np.zeros((2, system.content.state.mode.size))
    functions.guards(time, state, system.address, *values)
    return np.asarray(values[0])


def rates(system: Handle, time: float, state: np.ndarray) -> np.ndarray:
    """Return the rates at a state, shape (ny,)."""
    rate = np.zeros(state.size)
    functions.rate(time, state, system.address, rate)
    return rate
