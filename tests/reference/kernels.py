"""Kernels of a mechanism at a chosen state, for tests of the mechanics."""

from typing import Any

import numpy as np

import scissordyn as sd
from scissordyn.equilibrium.start import prepare_start
from scissordyn.kernel import Handle
from scissordyn.mechanics import functions
from scissordyn.plan.plan import plan
from scissordyn.plan.system import make_system

INDENTATION = 2e-5  # [m] indentation to which the chosen contacts are moved


def at_start(mechanism: sd.Mechanism) -> tuple[Handle, np.ndarray]:
    """Return the system of a mechanism and its concentric start."""
    made = plan(mechanism)
    system = make_system(made)
    return system, prepare_start(made, system, "concentric").y


def touching(
    mechanism: sd.Mechanism, seed: int, chosen: Any = slice(None), *, surface: str = "clearance", spread: float = 3e-4
) -> tuple[Handle, np.ndarray]:
    """Return the system of a mechanism in a random state; the surfaces of chosen contacts are moved until they touch."""
    random, (system, state) = np.random.default_rng(seed), at_start(mechanism)
    content, n = system.content, system.content.model.n
    state[: 2 * n] += np.concatenate([spread * random.normal(size=n), random.normal(size=n)])
    state[2 * n :] = 2e-7
    accepted(system, state)
    gap, rate = np.zeros((2, content.state.mode.size))
    functions.guards(0.0, state, system.address, gap, rate)
    content.parameters.contact[surface][chosen] += gap[chosen] - INDENTATION
    content.state.mode[chosen], content.state.memory[chosen] = 1, 0.5
    return system, state


def increments(system: Handle, state: np.ndarray) -> np.ndarray:
    """Return increments of coordinates, velocities and internal states for differences."""
    n = system.content.model.n
    return np.repeat([2e-9, 1e-5, 1e-11], [n, n, state.size - 2 * n])


def check_step_matrix(system: Handle, state: np.ndarray, step: float, increments: np.ndarray, time: float = 0.0) -> None:
    """Compare W^-1 r of the structured solve with a Jacobian by central differences."""
    jacobian = np.empty((state.size, state.size))
    for i, h in enumerate(increments):
        rates = np.zeros((2, state.size))
        for rate, sign in zip(rates, (1.0, -1.0), strict=True):
            moved = state.copy()
            moved[i] += sign * h
            functions.rate(time, moved, system.address, rate)
        jacobian[:, i] = (rates[0] - rates[1]) / (2.0 * h)
    functions.linearise(time, state, system.address, np.zeros(state.size), np.zeros(state.size))
    assert functions.factorize(step, system.address) == -1
    right = np.random.default_rng(1).normal(size=state.size)
    solution = right.copy()
    functions.solve(solution, system.address)
    missing = solution / step - jacobian @ solution - right
    scale = np.abs(solution) / step + np.abs(jacobian) @ np.abs(solution) + np.abs(right)
    assert np.all(np.abs(missing) < 3e-6 * scale)


def check_time_derivative(system: Handle, state: np.ndarray, h: float, *, time: float = 0.0, rtol: float = 1e-5) -> np.ndarray:
    """Compare the partial derivative by time with a central difference at fixed state, and return it."""
    by_time, up, down = np.zeros((3, state.size))
    functions.linearise(time, state, system.address, np.zeros(state.size), by_time)
    functions.rate(time + h, state, system.address, up)
    functions.rate(time - h, state, system.address, down)
    assert np.allclose(by_time, (up - down) / (2.0 * h), rtol=rtol, atol=1e-7 * np.max(np.abs(by_time)))
    return by_time


def check_element_slopes(system: Handle, state: np.ndarray, time: float = 0.0, *, linear: bool = False) -> None:
    """Compare derivatives of the forces of elements by free coordinates and their rates with differences."""
    model, work, n = system.content.model, system.content.work, system.content.model.n
    functions.linearise(time, state, system.address, np.zeros(state.size), np.zeros(state.size))
    analytic = np.zeros((2, n, n))
    for e in range(model.element_start.size - 1):
        columns = model.element_column[model.element_start[e] : model.element_start[e + 1]]
        free = columns < n
        for total, blocks in zip(analytic, (work.block_x, work.block_v), strict=True):
            block = blocks[model.block_start[e] : model.block_start[e + 1]].reshape(columns.size, -1)
            total[np.ix_(columns[free], columns[free])] += block[np.ix_(free, free)]

    def force(y: np.ndarray) -> np.ndarray:
        functions.rate(time, y, system.address, np.zeros(y.size))
        return np.array(work.force[:n])

    steps = np.repeat([1e-6, 1.0 if linear else 1e-6], n)
    numeric = np.stack([force(state + h) - force(state - h) for h in np.diag(steps) @ np.eye(2 * n, state.size)], axis=1)
    for ours, theirs in zip(analytic, np.split(numeric / (2.0 * steps), 2, axis=1), strict=True):
        assert np.abs(ours - theirs).max() < 1e-7 * np.abs(ours).max()


def accepted(system: Handle, y: np.ndarray, time: float = 0.0) -> np.ndarray:
    """Project the state onto the constraints, in place, and return it."""
    functions.accept(time, y, system.address, np.zeros(2))
    return y
