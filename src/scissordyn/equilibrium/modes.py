"""Natural frequencies and mode shapes of a mechanism at its start or along its motion."""

from __future__ import annotations

from typing import Annotated, Any, Literal

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from scissordyn.equilibrium.deflection import places
from scissordyn.equilibrium.rest import At, stiffness
from scissordyn.equilibrium.small_motion import Position, along, placed, released
from scissordyn.errors import InputError
from scissordyn.kinematics.closure import Inputs
from scissordyn.laws.evaluate import elastic_force, normal_force
from scissordyn.model.mechanism import Mechanism
from scissordyn.plan.flexible import with_mode_counts
from scissordyn.plan.plan import plan
from scissordyn.plan.rest import frictionless, still_at
from scissordyn.units import Quantity, checked

UNRESOLVED = 1e-15
"""A square of an angular frequency below this part of the largest, times the number of coordinates, is round-off: zero."""

Joints = Literal["ideal", "contact"]

Drives = Literal["locked", "released"]


@checked
def modes(
    mechanism: Mechanism,
    *,
    count: Annotated[int, Quantity("1", minimum=1, help="number of modes")] = 10,
    position: Position = "static",
    joints: Joints = "ideal",
    drive: Drives = "locked",
    times: ArrayLike | None = None,
) -> xr.Dataset:
    """Natural frequencies and mode shapes of small undamped oscillations about a position, or about many along the motion.

    Drives and prescribed distances are locked at their values of t = 0, or of each of `times`; friction and dampers are left
    out, loads are those of t = 0. With Z the motions that the constraints allow, f the
    forces, lambda the constraints' multipliers and coordinates in which the mass matrix is the identity:
    Z^T (-df/dx + lambda d^2 Phi) Z a = omega^2 a.

    Parameters
    ----------
    mechanism : Mechanism
    count : int
        Number of modes, from the lowest; fewer if the mechanism has fewer.
    position : {"static", "concentric"}
        In static equilibrium, bars bent by their loads; or with bars unbent, ideal joints as assembled.
    joints : {"ideal", "contact"}
        Clearance joints and guides as ideal; or in contact, with the stiffness of their contact law at the force that they
        carry in static equilibrium. A journal that carries nothing there is free.
    drive : {"locked", "released"}
        Prescribed rotations as constraints; or replaced by the constant torques that hold the position, so that the driven
        bodies move with the others.
    times : array_like, optional
        Instants of the drives' motion [s], increasing; each position is found from the one before.

    Returns
    -------
    Dataset
        With the coordinates mode, body, axis: `frequency` [Hz], `angular_frequency` [rad/s] (negative where the position is
        unstable: minus the rate of growth), `shape`, displacements of the mass centres, and `rotation` of the bodies, both
        scaled so that the largest displacement is 1 m; `position` [m] and `angle` [rad] of the bodies there. With `times` all
        of them along `time` too, and `input`, what each `drive` holds, in its `unit`, rad or m. With joints in contact
        `contact_force` [N] and `contact_stiffness` [N/m] of each `contact`, zero where nothing is carried.

    Raises
    ------
    InputError
        If nothing of the mechanism can move, it has no static equilibrium, or `times` are not increasing.
    """
    if joints == "contact":
        if position != "static":
            raise InputError('joints = "contact" with position = "concentric", where nothing touches', 'position = "static"')
        if not mechanism.contacts:
            raise InputError('joints = "contact" of a mechanism without clearance joints', 'joints = "ideal"')
    if drive == "released" and not mechanism.drives:
        raise InputError('drive = "released" of a mechanism without a drive', 'drive = "locked"')
    ideal, released_drive = with_mode_counts(mechanism).ideal(), drive == "released"
    taken = ideal if joints == "ideal" else mechanism
    if times is None:
        at, place = placed(plan(taken).at_rest, position, None)
        return _at(at, place, count, position, released_drive)
    instants = np.asarray(times, float)
    if instants.ndim != 1 or instants.size == 0 or not np.all(np.isfinite(instants)) or np.any(np.diff(instants) <= 0.0):
        raise InputError("times that are not increasing", "instants of the drives' motion [s]", "times=[0.0, 0.1, 0.2]")
    inputs = Inputs(plan(ideal))
    if inputs.count == 0:
        raise InputError("modes along the motion of a mechanism without a drive", "a drive, or modes without times")
    whole = plan(frictionless(taken))
    rests = along(lambda time, turned: still_at(whole, time, turned), inputs, instants.tolist(), position)
    datasets = [_at(at, place, count, position, released_drive) for at, place in rests]
    joined = xr.concat(
        datasets, xr.DataArray(instants, dims="time", name="time", attrs={"units": "s"}), combine_attrs="override"
    )
    return joined.assign(
        input=(("time", "drive"), inputs.over(instants), {"long_name": "what the drive holds, in its unit"})
    ).assign_coords(drive=[*inputs.bodies, *inputs.timed], unit=("drive", inputs.units))


def _at(at: At, place: At, count: int, position: Position, released_drive: bool) -> xr.Dataset:
    """Modes at one position."""
    still = at.plan
    if released_drive:
        at = released(at)
    matrix, allowed = stiffness(at)
    if allowed.shape[1] == 0:
        raise InputError("modes of a mechanism that cannot move", 'bars that bend, springs, or drive = "released"')
    squares, vectors = np.linalg.eigh(allowed.T @ matrix @ allowed)
    squares[np.abs(squares) < UNRESOLVED * squares.size * np.max(np.abs(squares))] = 0.0
    squares, vectors = squares[:count], (allowed @ vectors)[:, :count]
    angular = np.sign(squares) * np.sqrt(np.abs(squares))
    bodies, turning = _shapes(at, vectors)
    largest = np.max(np.hypot(bodies[..., 0], bodies[..., 1]), axis=1)
    scale = np.where(largest > 0.0, 1.0 / np.where(largest > 0.0, largest, 1.0), 1.0)
    where = places(at.plan, at.natural)[0]
    angle = np.array([body.placed_angle + place.turned[body.name] for body in still.bodies])
    vector, scalar = ("mode", "body", "axis"), ("mode", "body")
    variables = {
        "frequency": ("mode", angular / (2.0 * np.pi), {"units": "Hz", "long_name": "natural frequency"}),
        "angular_frequency": ("mode", angular, {"units": "rad/s", "long_name": "natural angular frequency"}),
        "shape": (vector, bodies * scale[:, None, None], {"units": "m", "long_name": "displacement of the mass centre"}),
        "rotation": (scalar, turning * scale[:, None], {"units": "rad", "long_name": "rotation"}),
        "position": (("body", "axis"), where, {"units": "m", "long_name": "mass centre"}),
        "angle": ("body", angle, {"units": "rad", "long_name": "angle"}),
    }
    coordinates = {"mode": np.arange(1, squares.size + 1), "body": [body.name for body in still.bodies], "axis": ["x", "y"]}
    contacts = _contacts(at)
    if contacts:
        coordinates["contact"] = [contact.name for contact in still.contacts]
    attributes = {"title": "scissordyn modes", "position": position}
    return xr.Dataset(variables | contacts, coordinates, attributes)


def _contacts(at: At) -> dict[str, Any]:
    """What the clearance joints carry, and the stiffness of their laws there; empty if all are ideal."""
    content = at.system.content
    if not at.plan.contacts:
        return {}
    numbers, contact = content.parameters, content.work.contact
    force = np.where(content.state.mode[: contact.size] == 1, contact["elastic"], 0.0)
    slope = np.zeros(contact.size)
    states, start = at.state[2 * content.model.n :], content.model.state_start

    def suddenly(j: int, depth: float) -> float:
        """Normal force of contact j, before anything relaxes."""
        law = numbers.law[j]
        frozen = states[start[j] + law["bristles"] : start[j + 1]]
        elastic = elastic_force(law["stiffness"], depth, numbers.elastic[j])
        return float(normal_force(law["damping"], elastic, depth, 0.0, 1.0, frozen, np.zeros_like(frozen), numbers.damping[j]))

    for j in np.flatnonzero(force > 0.0).tolist():
        depth = float(contact["depth"][j])
        step = 1e-5 * depth
        slope[j] = (suddenly(j, depth + step) - suddenly(j, depth - step)) / (2.0 * step)
    return {
        "contact_force": ("contact", force, {"units": "N", "long_name": "static normal force of a contact"}),
        "contact_stiffness": ("contact", slope, {"units": "N/m", "long_name": "stiffness of the contact law there"}),
    }


def _shapes(at: At, vectors: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Displacements of the mass centres and rotations, by mode and body."""
    still, content = at.plan, at.system.content
    n, maps, work = content.model.n, still.maps, content.work
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
