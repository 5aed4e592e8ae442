"""Natural frequencies and mode shapes of a mechanism at its start or along its motion."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Annotated, Any, Literal

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from scissordyn.components.actuator import Actuator
from scissordyn.equilibrium.damping import damped_modes, square_round_off
from scissordyn.equilibrium.deflection import places
from scissordyn.equilibrium.small_motion import Position, equilibria_along_motion, equilibrium_pair, release_drives
from scissordyn.equilibrium.static_position import StaticPosition, motions_of, stiffness_parts
from scissordyn.errors import InputError
from scissordyn.kinematics.closure import Inputs
from scissordyn.laws.evaluate import elastic_force, normal_force
from scissordyn.model.mechanism import Mechanism
from scissordyn.plan.flexible import with_mode_counts
from scissordyn.plan.plan import Plan, plan
from scissordyn.plan.rest import frictionless, lock_drives, lock_loads, plan_at_rest, without_ramps, without_seal_friction
from scissordyn.tolerance import ROUND_OFF_TOL
from scissordyn.units import Quantity, checked

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
    """Return natural frequencies, mode shapes and damping ratios of small oscillations about one or several positions.

    Drives and prescribed distances are locked at their values at t = 0, or at each of `times`; loads and references of servos
    have their values at that time, and limits of servos their full values. Frequencies and shapes are those without damping,
    with internal states held.
    The eigenvalue problem is Z^T (-df/dx + lambda d^2 Phi) Z a = omega^2 a, where Z spans the motions that the constraints
    allow, f are the forces, lambda the multipliers, and the mass matrix is the identity.

    Damping comes from the eigenvalues s of the problem with -df/dv, which includes dampers, motors and controllers with their
    internal states. Left out are friction, clutches, the damping of contacts, which depends on the speed at their onset,
    and changes of delayed signals. Each pair of eigenvalues is assigned to the undamped mode whose shape is most alike, so
    that the sum of the modal assurance criteria is largest. Strong damping that is not proportional to mass and stiffness
    mixes the modes; ratio and damped frequency are then those of a damped shape that is no longer the mode's.
    `damping_match` is the criterion, 1 for the same shape; `attrs["warnings"]` names modes where it is below 0.5,
    and actuators with delayed feedback.

    Parameters
    ----------
    mechanism : Mechanism
    count : int
        Number of modes, from the lowest; fewer if the mechanism has fewer.
    position : {"static", "concentric"}
        Static equilibrium, with flexible bars bent by their loads, or the assembled position with straight bars.
    joints : {"ideal", "contact"}
        Clearance joints and guides as ideal joints, or in contact. A contact has the stiffness of its law at its force in
        static equilibrium; a journal without force is free.
    drive : {"locked", "released"}
        Locked drives, or drives replaced by the constant torques that hold the position, so that driven bodies can move.
    times : array_like, optional
        Instants of the motion of the drives [s], increasing; each position is computed from the one before it. Latches stay
        open.

    Returns
    -------
    Dataset
        Coordinates: mode, body, axis. `frequency` [Hz] and `angular_frequency` [rad/s]; a negative value is minus the growth
        rate of an unstable position, which flutter has twice. `damping_ratio` is ``-Re(s)/|s|``, above 1 for an overdamped mode
        (minus half the sum of both real s over the root of their product), negative for an oscillation that grows, and NaN
        without a restoring force. `damped_frequency` [Hz] is Im(s)/(2 pi), 0 for a mode that does not oscillate. `shape`
        (displacements of mass centres) and `rotation` of the bodies are scaled to a largest displacement of 1 m, or to a
        largest rotation of 1 rad if all mass centres rest.
        `position` [m] and `angle` [rad] of the bodies. With `times`, all variables have the dimension `time`, and `input`
        gives the value of each `drive` in its `unit` (rad or m). With joints in contact: `contact_force` [N] and
        `contact_stiffness` [N/m] of each `contact`, zero without contact.

    Raises
    ------
    InputError
        If the mechanism cannot move or has no static equilibrium, or if `times` are not increasing.
    """
    if joints == "contact":
        if position != "static":
            raise InputError('joints = "contact" with position = "concentric": no joint is in contact', 'position = "static"')
        if not mechanism.contacts:
            raise InputError('joints = "contact" for a mechanism without clearance joints', 'joints = "ideal"')
    if drive == "released" and not mechanism.drives:
        raise InputError('drive = "released" for a mechanism without a drive', 'drive = "locked"')
    mechanism = without_ramps(without_seal_friction(mechanism))
    ideal, released_drive = with_mode_counts(mechanism).ideal(), drive == "released"
    taken = ideal if joints == "ideal" else mechanism
    if times is None:
        at, with_ideal_joints = equilibrium_pair(plan_at_rest(plan(taken)), position, None)
        return _with_warnings(_modes_at(at, with_ideal_joints, count, position, released_drive), mechanism)
    instants = np.asarray(times, float)
    if instants.ndim != 1 or instants.size == 0 or not np.all(np.isfinite(instants)) or np.any(np.diff(instants) <= 0.0):
        raise InputError(
            "times are not finite, increasing numbers", "increasing instants of the drives' motion [s]", "times=[0.0, 0.1, 0.2]"
        )
    driven = plan(ideal)
    inputs = Inputs(driven)
    if inputs.count == 0:
        raise InputError(
            "modes along the motion of a mechanism without a drive; a servo does not prescribe a motion",
            "a drive, or modes at the start alone",
            "without --until, in Python without times",
        )
    whole = plan(frictionless(taken))

    def lock(time: float, turned: Mapping[str, float]) -> Plan:
        return lock_drives(whole.case(lock_loads(whole.mechanism, time)), time, turned)

    rests = equilibria_along_motion(lock, driven, instants.tolist(), position)
    datasets = [_modes_at(at, ideal, count, position, released_drive) for at, ideal in rests]
    joined = xr.concat(
        datasets, xr.DataArray(instants, dims="time", name="time", attrs={"units": "s"}), combine_attrs="override"
    )
    joined = joined.assign(
        input=(("time", "drive"), inputs.over(instants), {"long_name": "value of the drive, in its unit"})
    ).assign_coords(drive=[*inputs.bodies, *inputs.timed], unit=("drive", inputs.units))
    return _with_warnings(joined, mechanism)


def _with_warnings(modes: xr.Dataset, mechanism: Mechanism) -> xr.Dataset:
    """Return the modes with warnings of those whose damped shape is another one, and of delayed feedback."""
    match_min = 0.5  # below this criterion, more of a damped shape belongs to other modes than to its own
    is_poor = (modes["damping_match"] < match_min) & modes["damping_ratio"].notnull()
    is_poor_somewhere = is_poor.values.reshape(-1, modes.sizes["mode"]).any(axis=0)
    poor = [str(mode) for mode in modes["mode"].values[is_poor_somewhere]]
    text = f"damping changes the shape of mode {', '.join(poor)} so much that its damping ratio is that of another shape"
    servos = (part for part in mechanism.components if isinstance(part, Actuator) and part.controller.delay > 0.0)
    delayed = [
        f"actuator '{part.name}': its delayed signal is constant in modes, and its feedback zero before the onset"
        for part in servos
    ]
    return modes.assign_attrs(warnings=json.dumps([*([text] if poor else []), *delayed]))


def _modes_at(at: StaticPosition, ideal: StaticPosition, count: int, position: Position, released_drive: bool) -> xr.Dataset:
    """Return the `count` lowest modes at one position; `ideal` is the equilibrium with ideal joints."""
    locked = at.plan
    if released_drive:
        at = release_drives(at)
    by_forces, by_constraints, allowed = stiffness_parts(at)
    matrix = by_forces + by_constraints
    squares, motions = motions_of(matrix, allowed)
    if squares.size == 0:
        raise InputError(
            "the mechanism cannot move with its drives locked, and has no modes",
            "bars that bend, springs next to free bodies, or released drives",
            "--drive released, in Python drive='released'",
        )
    round_off = square_round_off(by_forces, by_constraints)
    squares[np.abs(squares) < round_off] = 0.0
    damping = damped_modes(at, matrix, allowed, squares, motions, round_off)
    ratio, damped, match = (values[:count] for values in damping)
    squares, vectors = squares[:count], motions[:, :count]
    angular = np.sign(squares) * np.sqrt(np.abs(squares))
    bodies, turning = _shapes(at, vectors)
    moved, turned = np.max(np.hypot(bodies[..., 0], bodies[..., 1]), axis=1), np.max(np.abs(turning), axis=1)
    # displacements of bodies that turn about their mass centres are round-off
    largest = np.where(moved > ROUND_OFF_TOL * at.plan.coordinates.size * turned, moved, turned)
    scale = np.where(largest > 0.0, 1.0 / np.where(largest > 0.0, largest, 1.0), 1.0)
    where = places(at.plan, at.natural)[0]
    angle = np.array([body.placed_angle + ideal.turned[body.name] for body in locked.bodies])
    vector, scalar = ("mode", "body", "axis"), ("mode", "body")
    variables = {
        "frequency": ("mode", angular / (2.0 * np.pi), {"units": "Hz", "long_name": "natural frequency"}),
        "angular_frequency": ("mode", angular, {"units": "rad/s", "long_name": "natural angular frequency"}),
        "damping_ratio": ("mode", ratio, {"units": "1", "long_name": "damping ratio"}),
        "damped_frequency": ("mode", damped / (2.0 * np.pi), {"units": "Hz", "long_name": "damped frequency"}),
        "damping_match": ("mode", match, {"units": "1", "long_name": "likeness of damped and undamped shape"}),
        "shape": (vector, bodies * scale[:, None, None], {"units": "m", "long_name": "displacement of the mass centre"}),
        "rotation": (scalar, turning * scale[:, None], {"units": "rad", "long_name": "rotation"}),
        "position": (("body", "axis"), where, {"units": "m", "long_name": "mass centre"}),
        "angle": ("body", angle, {"units": "rad", "long_name": "angle"}),
    }
    coordinates = {"mode": np.arange(1, squares.size + 1), "body": [body.name for body in locked.bodies], "axis": ["x", "y"]}
    contacts = _contacts(at)
    if contacts:
        coordinates["contact"] = [contact.name for contact in locked.contacts]
    attributes = {"title": "scissordyn modes", "position": position}
    return xr.Dataset(variables | contacts, coordinates, attributes)


def _contacts(at: StaticPosition) -> dict[str, Any]:
    """Return the variables `contact_force` and `contact_stiffness` of clearance joints; empty if all joints are ideal."""
    content = at.system.content
    if not at.plan.contacts:
        return {}
    numbers, contact = content.parameters, content.work.contact
    force = np.where(content.state.mode[: contact.size] == 1, contact["elastic"], 0.0)
    slope = np.zeros(contact.size)
    states, start = at.state[2 * content.model.n :], content.model.state_start

    def frozen_force(j: int, depth: float) -> float:
        """Return the normal force of contact j at an indentation [N], with the contact's internal states held constant."""
        law = numbers.law[j]
        frozen = states[start[j] + law["bristles"] : start[j + 1]]
        elastic = elastic_force(law["stiffness"], depth, numbers.elastic[j])
        return float(normal_force(law["damping"], elastic, depth, 0.0, 1.0, frozen, np.zeros_like(frozen), numbers.damping[j]))

    for j in np.flatnonzero(force > 0.0).tolist():
        depth = float(contact["depth"][j])
        step = 1e-5 * depth
        slope[j] = (frozen_force(j, depth + step) - frozen_force(j, depth - step)) / (2.0 * step)
    return {
        "contact_force": ("contact", force, {"units": "N", "long_name": "static normal force of a contact"}),
        "contact_stiffness": ("contact", slope, {"units": "N/m", "long_name": "stiffness of the contact law at this force"}),
    }


def _shapes(at: StaticPosition, vectors: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the displacements of mass centres, shape (modes, bodies, 2), and the rotations, shape (modes, bodies)."""
    locked, content = at.plan, at.system.content
    n, maps, work = content.model.n, locked.maps, content.work
    moved = np.zeros((vectors.shape[1], len(locked.bodies), 4))
    direction = np.zeros((len(locked.bodies), 2))
    for b in range(len(locked.bodies)):
        part = slice(maps.start[b], maps.start[b + 1])
        columns, rows = maps.column[part], maps.row[:, part]
        free = columns < n
        moved[:, b] = (rows[:, free] @ vectors[columns[free]]).T
        direction[b] = rows[2:] @ work.X[columns]
    turning = direction[:, 0] * moved[..., 3] - direction[:, 1] * moved[..., 2]
    return moved[..., :2], turning
