"""Natural frequencies and mode shapes of a mechanism at a position, its drives locked."""

from __future__ import annotations

from typing import Annotated, Any, Literal

import numpy as np
import xarray as xr

from scissordyn.errors import InputError
from scissordyn.mechanics import functions
from scissordyn.model.mechanism import Mechanism
from scissordyn.plan.plan import Plan, plan
from scissordyn.run.driver import make_system
from scissordyn.run.start import prepare_start
from scissordyn.units import Quantity, checked

__all__ = ["modes"]

INDEPENDENT = 1e-9
"""Singular values of the constraints' gradients below this part of the largest count as zero."""


@checked
def modes(
    mechanism: Mechanism,
    *,
    count: Annotated[int, Quantity("1", minimum=1, help="number of modes")] = 10,
    position: Literal["static", "concentric"] = "static",
) -> xr.Dataset:
    """Natural frequencies and mode shapes of small undamped oscillations about a position.

    Drives and prescribed distances are locked at their values of t = 0, clearance joints are taken as ideal, friction and
    dampers are left out. With Z the motions that the constraints allow, f the forces, lambda the constraints' multipliers and
    coordinates in which the mass matrix is the identity: Z^T (-df/dx + lambda d^2 Phi) Z a = omega^2 a.

    Parameters
    ----------
    mechanism : Mechanism
    count : int
        Number of modes, from the lowest; fewer if the mechanism has fewer.
    position : {"static", "concentric"}
        In static equilibrium, bars bent by their loads; or with bars unbent, ideal joints as assembled.

    Returns
    -------
    Dataset
        With the coordinates mode, body, axis: `frequency` [Hz], `angular_frequency` [rad/s] (negative where the position is
        unstable: minus the rate of growth), and `shape`, displacements of the mass centres, `rotation` of the bodies, both
        scaled so that the largest displacement is 1 m.

    Raises
    ------
    InputError
        If nothing of the mechanism can move, or it has no static equilibrium.
    """
    still = plan(mechanism.ideal()).at_rest
    system = make_system(still)
    start = prepare_start(still, system, position)
    stiffness, allowed = _stiffness(still, system, start.y)
    if allowed.shape[1] == 0:
        raise InputError("modes of a mechanism that cannot move", "bars that bend, springs, or a mechanism without its drive")
    squares, vectors = np.linalg.eigh(allowed.T @ stiffness @ allowed)
    squares, vectors = squares[:count], (allowed @ vectors)[:, :count]
    angular = np.sign(squares) * np.sqrt(np.abs(squares))
    bodies, turning = _shapes(still, system, vectors)
    largest = np.max(np.hypot(bodies[..., 0], bodies[..., 1]), axis=1)
    scale = np.where(largest > 0.0, 1.0 / np.where(largest > 0.0, largest, 1.0), 1.0)
    names = [body.name for body in still.bodies]
    return xr.Dataset(
        {
            "frequency": ("mode", angular / (2.0 * np.pi), {"units": "Hz", "long_name": "natural frequency"}),
            "angular_frequency": ("mode", angular, {"units": "rad/s", "long_name": "natural angular frequency"}),
            "shape": (
                ("mode", "body", "axis"),
                bodies * scale[:, None, None],
                {"units": "m", "long_name": "displacement of the mass centre"},
            ),
            "rotation": (("mode", "body"), turning * scale[:, None], {"units": "rad", "long_name": "rotation"}),
        },
        {"mode": np.arange(1, squares.size + 1), "body": names, "axis": ["x", "y"]},
        {"title": "scissordyn modes", "position": position},
    )


def _stiffness(still: Plan, system: Any, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Stiffness in the free coordinates, and an orthonormal basis of the motions that the constraints allow."""
    content = system.content
    model, work, n = content.model, content.work, content.model.n
    y = y.copy()
    y[n : 2 * n] = 0.0
    rate, by_time = np.zeros(y.size), np.zeros(y.size)
    functions.activate(system.address)
    functions.linearise(0.0, y, system.address, rate, by_time)
    stiffness = np.zeros((n, n))
    for e in range(model.element_start.size - 1):
        first, last = model.element_start[e], model.element_start[e + 1]
        columns = model.element_column[first:last]
        block = work.block_x[model.block_start[e] : model.block_start[e + 1]].reshape(last - first, last - first)
        free = columns < n
        stiffness[np.ix_(columns[free], columns[free])] -= block[np.ix_(free, free)]
    gradients = np.zeros((work.multiplier.size, n))
    for p in range(model.part_constraint.size):
        first, last = model.part_start[p], model.part_start[p + 1]
        k, columns = model.part_constraint[p], model.constraint_column[first:last]
        free = columns < n
        rows = model.constraint_row[:, first:last][:, free]
        weight = work.part_weight[p]
        stiffness[np.ix_(columns[free], columns[free])] += work.multiplier[k] * weight * rows.T @ rows
        gradients[k, columns[free]] += work.gradient[first:last][free]
    _, sizes, basis = np.linalg.svd(gradients)
    rank = int(np.sum(sizes > INDEPENDENT * max(sizes.max(initial=0.0), 1.0)))
    return 0.5 * (stiffness + stiffness.T), basis[rank:].T


def _shapes(still: Plan, system: Any, vectors: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Displacements of the mass centres and rotations, by mode and body."""
    n, maps, work = system.content.model.n, still.maps, system.content.work
    moved = np.zeros((vectors.shape[1], len(still.bodies), 4))
    direction = np.zeros((len(still.bodies), 2))
    for b in range(len(still.bodies)):
        part = slice(maps.start[b], maps.start[b + 1])
        columns, rows = maps.column[part], maps.row[:, part]
        free = columns < n
        moved[:, b] = (rows[:, free] @ vectors[columns[free]]).T
        direction[b] = rows[2:] @ work.X[columns]
    turning = direction[:, 0] * moved[..., 3] - direction[:, 1] * moved[..., 2]
    return moved[..., :2], turning
