"""Natural frequencies and mode shapes of a mechanism, its drives locked, at its start or along its motion."""

from __future__ import annotations

from typing import Annotated, Any, Literal, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from scissordyn.errors import InputError
from scissordyn.kinematics.assembly import Start, natural_state
from scissordyn.kinematics.closure import Inputs
from scissordyn.mechanics import functions
from scissordyn.model.mechanism import Mechanism
from scissordyn.plan.plan import Plan, plan
from scissordyn.plan.rest import at_rest
from scissordyn.run.deflection import places
from scissordyn.run.driver import make_system
from scissordyn.run.rest import count_turns, equilibrium, turns
from scissordyn.run.start import assembled_near, prepare_start
from scissordyn.units import Quantity, checked

__all__ = ["modes"]

INDEPENDENT = 1e-9
"""Singular values of the constraints' gradients below this part of the largest count as zero."""

NEAR = 0.1
"""Largest change of an input [rad, m/m] from one position to the next, which starts from it."""

Position = Literal["static", "concentric"]


class _Place(NamedTuple):
    """A position: natural coordinates, and by how much each body has turned."""

    natural: np.ndarray
    turned: dict[str, float]


@checked
def modes(
    mechanism: Mechanism,
    *,
    count: Annotated[int, Quantity("1", minimum=1, help="number of modes")] = 10,
    position: Position = "static",
    times: ArrayLike | None = None,
) -> xr.Dataset:
    """Natural frequencies and mode shapes of small undamped oscillations about a position, or about many along the motion.

    Drives and prescribed distances are locked at their values of t = 0, or of each of `times`; clearance joints are taken as
    ideal, friction and dampers are left out, loads are those of t = 0. With Z the motions that the constraints allow, f the
    forces, lambda the constraints' multipliers and coordinates in which the mass matrix is the identity:
    Z^T (-df/dx + lambda d^2 Phi) Z a = omega^2 a.

    Parameters
    ----------
    mechanism : Mechanism
    count : int
        Number of modes, from the lowest; fewer if the mechanism has fewer.
    position : {"static", "concentric"}
        In static equilibrium, bars bent by their loads; or with bars unbent, ideal joints as assembled.
    times : array_like, optional
        Instants of the drives' motion [s], increasing; each position is found from the one before.

    Returns
    -------
    Dataset
        With the coordinates mode, body, axis: `frequency` [Hz], `angular_frequency` [rad/s] (negative where the position is
        unstable: minus the rate of growth), `shape`, displacements of the mass centres, and `rotation` of the bodies, both
        scaled so that the largest displacement is 1 m; `position` [m] and `angle` [rad] of the bodies there. With `times` all
        of them along `time` too, and `input`, what each `drive` holds, in its `unit`, rad or m.

    Raises
    ------
    InputError
        If nothing of the mechanism can move, it has no static equilibrium, or `times` are not increasing.
    """
    ideal = mechanism.ideal()
    if times is None:
        return _at(plan(at_rest(ideal)), count, position, None)[0]
    asked = np.asarray(times, float)
    if asked.ndim != 1 or asked.size == 0 or not np.all(np.isfinite(asked)) or np.any(np.diff(asked) <= 0.0):
        raise InputError("times that are not increasing", "instants of the drives' motion [s]", "times=[0.0, 0.1, 0.2]")
    inputs = Inputs(plan(ideal))
    if inputs.count == 0:
        raise InputError("modes along the motion of a mechanism without a drive", "a drive, or modes without times")
    found, place = [], None
    for before, time in zip((0.0, *asked.tolist()), asked.tolist(), strict=False):
        change = float(np.max(np.abs(inputs.at(time) - inputs.at(before))))
        for between in np.linspace(before, time, max(1, int(np.ceil(change / NEAR))) + 1)[1:-1]:
            place = _placed(plan(at_rest(ideal, float(between))), position, place)[2]
        one, place = _at(plan(at_rest(ideal, time)), count, position, place)
        found.append(one)
    along = xr.concat(found, xr.DataArray(asked, dims="time", name="time", attrs={"units": "s"}), combine_attrs="override")
    units = ["rad"] * len(inputs.bodies) + ["m"] * len(inputs.rods)
    return along.assign(
        input=(("time", "drive"), inputs.over(asked), {"long_name": "what the drive holds, in its unit"})
    ).assign_coords(drive=[*inputs.bodies, *inputs.rods], unit=("drive", units))


def _placed(still: Plan, position: Position, before: _Place | None) -> tuple[Any, np.ndarray, _Place]:
    """System, state and place of a mechanism whose drives stand still, from the place before if there is one."""
    system, n = make_system(still), still.coordinates.free
    if before is None:
        y = prepare_start(still, system, position).y
    else:
        count_turns(still, system.content, before.turned)
        found = assembled_near(still, system.content, before.natural, straight=position == "concentric").position
        if position == "static":
            found = equilibrium(still, system, found)[0]
        y = np.zeros(2 * n + int(system.content.model.state_start[-1]))
        y[:n] = found
    functions.accept(0.0, y, system.address, np.zeros(2))
    natural = natural_state(still, system.content, Start(y[:n], 0.0 * y[:n]))[0]
    return system, y, _Place(natural, turns(still, system.content))


def _at(still: Plan, count: int, position: Position, before: _Place | None) -> tuple[xr.Dataset, _Place]:
    """Modes at one position, and the position."""
    system, y, place = _placed(still, position, before)
    stiffness, allowed = _stiffness(still, system, y)
    if allowed.shape[1] == 0:
        raise InputError("modes of a mechanism that cannot move", "bars that bend, springs, or a mechanism without its drive")
    squares, vectors = np.linalg.eigh(allowed.T @ stiffness @ allowed)
    squares, vectors = squares[:count], (allowed @ vectors)[:, :count]
    angular = np.sign(squares) * np.sqrt(np.abs(squares))
    bodies, turning = _shapes(still, system, vectors)
    largest = np.max(np.hypot(bodies[..., 0], bodies[..., 1]), axis=1)
    scale = np.where(largest > 0.0, 1.0 / np.where(largest > 0.0, largest, 1.0), 1.0)
    where = places(still, place.natural)[0]
    angle = np.array([body.angle + place.turned[body.name] for body in still.bodies])
    vector, one = ("mode", "body", "axis"), ("mode", "body")
    variables = {
        "frequency": ("mode", angular / (2.0 * np.pi), {"units": "Hz", "long_name": "natural frequency"}),
        "angular_frequency": ("mode", angular, {"units": "rad/s", "long_name": "natural angular frequency"}),
        "shape": (vector, bodies * scale[:, None, None], {"units": "m", "long_name": "displacement of the mass centre"}),
        "rotation": (one, turning * scale[:, None], {"units": "rad", "long_name": "rotation"}),
        "position": (("body", "axis"), where, {"units": "m", "long_name": "mass centre"}),
        "angle": ("body", angle, {"units": "rad", "long_name": "angle"}),
    }
    names = [body.name for body in still.bodies]
    coordinates = {"mode": np.arange(1, squares.size + 1), "body": names, "axis": ["x", "y"]}
    return xr.Dataset(variables, coordinates, {"title": "scissordyn modes", "position": position}), place


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
