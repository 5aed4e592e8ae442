"""Inverse dynamics: forces and torques that a prescribed motion requires."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from functools import partial
from typing import TYPE_CHECKING, Annotated

import numpy as np

from scissordyn.casefile.configuration import write_configuration
from scissordyn.components.actuator import Actuator
from scissordyn.components.force import Force
from scissordyn.components.rod import Rod
from scissordyn.components.time_function import Polynomial, Tabulated, TimeFunction
from scissordyn.equilibrium.start import ideal_reactions
from scissordyn.errors import InputError
from scissordyn.mechanics.sample import Record
from scissordyn.model.commanded import rigid, with_rotors
from scissordyn.model.coupling import Coordinate, CoordinateDrive
from scissordyn.model.mechanism import Mechanism
from scissordyn.model.options import EndTime, Options, SampleCount
from scissordyn.plan.coordinates import Coordinates
from scissordyn.plan.coupling import coupling_parts
from scissordyn.plan.elimination import in_words
from scissordyn.plan.gradients import Gradients
from scissordyn.plan.plan import Plan, plan
from scissordyn.record.coupling import sampled_coordinate
from scissordyn.record.results import Results, described, labels
from scissordyn.record.variable import Variable
from scissordyn.run.advance.interrupt import raise_if_interrupted
from scissordyn.run.simulate import simulate
from scissordyn.run.trajectory import compute, record_trajectory
from scissordyn.tolerance import DATA_TOL
from scissordyn.units import Meaning, checked

if TYPE_CHECKING:
    import xarray as xr


@checked
def inverse_dynamics(
    mechanism: Annotated[Mechanism, Meaning("a mechanism", "read_case('case.toml').mechanism")],
    inputs: Annotated[Mapping[str, Coordinate], Meaning("coordinates by name", '{"motor": RelativeAngle("crank")}')],
    *,
    until: EndTime,
    samples: SampleCount = 501,
) -> xr.Dataset:
    """Compute the forces and torques at chosen inputs that produce the motion prescribed by the coordinate drives.

    The driven coordinates are the outputs of servo constraints. They determine the motion, and the inputs do the work of the
    drives.

    Parameters
    ----------
    mechanism : Mechanism
        Mechanism with ideal joints and as many coordinate drives as degrees of freedom.
    inputs : mapping of str to RelativeAngle, Slide or Distance
        Input coordinates by name, as many as coordinate drives.
    until : float
        End of the motion [s].
    samples : int
        Number of instants.

    Returns
    -------
    Dataset
        `input_force` [N m or N], `input_value` [rad or m], `input_rate` and `input_power` [W] over (time, input), the
        coordinate `input_unit`, and `output_value` over (time, output).

    Raises
    ------
    InputError
        If the outputs do not determine the motion, or the inputs cannot produce it.

    References
    ----------
    García de Jalón and Bayo 1994, Kinematic and Dynamic Simulation of Multibody Systems, doi:10.1007/978-1-4612-2600-0
    """
    options, whole = Options(until, samples=samples), plan(mechanism)
    _check(whole, len(inputs))
    path, motion = record_trajectory(whole, options, compute(whole, options))
    if path.status != "complete":
        raise InputError(f"inverse dynamics of a motion that {path.status}: {path.cause}", "outputs that can be reached")
    outputs = mechanism.coordinate_drives
    force, authority, side = _forces(path.plan.coordinates, motion, inputs, [drive.name for drive in outputs])
    _check_authority(list(inputs), [drive.name for drive in outputs], path.samples.time, authority, side)
    measured = partial(sampled_coordinate, path.plan, motion)
    values, rates = (np.stack(part, axis=1) for part in zip(*map(measured, inputs.values()), strict=True))
    output = np.stack([measured(drive.coordinate)[0] for drive in outputs], axis=1)
    over = ("time", "input")
    variables = {
        "time": described("time", path.samples.time, "s", "time"),
        "input": labels("input", list(inputs)),
        "output": labels("output", [drive.name for drive in outputs], "driven coordinate"),
        "input_unit": labels("input", [coordinate.unit for coordinate in inputs.values()], "unit of an input"),
        "input_force": Variable(over, force, {"long_name": "torque [N m] or force [N] at an input"}),
        "input_value": Variable(over, values, {"long_name": "angle [rad] or length [m] of an input"}),
        "input_rate": Variable(over, rates, {"long_name": "rate of an input"}),
        "input_power": described(over, force * rates, "W", "power of an input"),
        "output_value": Variable(("time", "output"), output, {"long_name": "prescribed coordinate"}),
    }
    from scissordyn.record.xarray_dataset import as_dataset  # imports xarray, which takes longer than most runs

    attributes = {"title": "scissordyn inverse dynamics", "configuration": write_configuration(mechanism, options)}
    return as_dataset(Results(variables, attributes))


def _forces(
    coordinates: Coordinates, motion: Record, inputs: Mapping[str, Coordinate], outputs: list[str]
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return input forces, smallest relative motion of the inputs, and sign of the determinant at each sample.

    Shapes: (nt, inputs) [N m or N], (nt,) and (nt,).
    """
    n, basis, constraints = coordinates.free, coordinates.basis, coordinates.constraints
    names = [constraint.name for constraint in constraints]
    at = [names.index(output) for output in outputs]
    others = [k for k in range(len(constraints)) if k not in at]
    scale = np.array([constraints[k].scale for k in at])
    drives = [CoordinateDrive(name, coordinate, Polynomial((0.0,))) for name, coordinate in inputs.items()]
    driven = [coupling_parts(coordinates, drive.terms, drive.name) for drive in drives]
    holding, moving = Gradients(n, basis, constraints), Gradients(n, basis, driven)
    moving_scale = np.array([constraint.scale for constraint in driven])[:, None]
    force, authority, side = np.zeros((len(motion.X), len(at))), np.zeros(len(motion.X)), np.zeros(len(motion.X))
    for row, (full, multiplier) in enumerate(zip(motion.X, motion.multiplier, strict=True)):
        # virtual motions that satisfy all other constraints
        gradients = _dense(holding.jacobian(full))[:, :n]
        free = np.linalg.svd(gradients[others])[2][len(others) :].T if others else np.eye(n)
        by_output = gradients[at] * scale[:, None] @ free
        rows = _dense(moving.jacobian(full))[:, :n] * moving_scale
        by_input = rows @ free
        sizes = np.linalg.norm(rows, axis=1)
        authority[row] = np.linalg.svd(by_input / np.where(sizes > 0.0, sizes, 1.0)[:, None], compute_uv=False)[-1]
        side[row] = np.linalg.slogdet(np.vstack([gradients[others], rows]))[0]
        if authority[row] > DATA_TOL:
            # drives and inputs do the same virtual work
            force[row] = np.linalg.solve(by_input.T, by_output.T @ (-multiplier[at] / scale))
    return force, authority, side


def _dense(matrix: np.ndarray) -> np.ndarray:
    return matrix if isinstance(matrix, np.ndarray) else matrix.toarray()


def _check(whole: Plan, inputs: int) -> None:
    """Raise `InputError` unless the outputs determine the motion and there are as many inputs as outputs."""
    mechanism, outputs = whole.mechanism, len(whole.mechanism.coordinate_drives)
    if mechanism.contacts:
        raise InputError(
            f"inverse dynamics with clearance at '{mechanism.contacts[0].name}'", "ideal joints", "mechanism.ideal()"
        )
    if not outputs:
        raise InputError(
            "inverse dynamics of a mechanism without a driven coordinate", "a CoordinateDrive of the coordinate to move"
        )
    if inputs != outputs:
        raise InputError(f"{inputs} inputs for {outputs} driven coordinates", "as many inputs as outputs")
    active = sum(not constraint.latch for constraint in whole.coordinates.constraints)
    motions = whole.coordinates.free - active + outputs
    if motions != outputs:
        raise InputError(
            f"{outputs} driven coordinates of a mechanism with {motions} degrees of freedom",
            f"{motions} driven coordinates",
        )


def _check_authority(inputs: list[str], outputs: list[str], time: np.ndarray, authority: np.ndarray, side: np.ndarray) -> None:
    """Raise `InputError` if the inputs cannot control the motion at a sample or between two samples."""
    lost = np.flatnonzero((authority <= DATA_TOL) | (side != side[0]))
    if not lost.size:
        return
    input_names, output_names = (in_words([f"'{name}'" for name in names]) for names in (inputs, outputs))
    if np.all(authority <= DATA_TOL):
        raise InputError(
            f"input {input_names} cannot control {output_names}",
            "inputs that move in this motion, independently of each other",
        )
    raise InputError(
        f"no force at input {input_names} gives the motion of {output_names} up to t = {time[lost[0]]:.6g} s, past a singular "
        "position",
        "a motion that ends before the singular position",
    )


@checked
def feed_forward(
    mechanism: Mechanism, reference: TimeFunction, *, until: float, body: str = "", samples: int = 2001
) -> Tabulated:
    """Compute the driving torque of the ideal mechanism on a reference motion.

    Clearance joints count as ideal, bars that bend as rigid. While the joints stay in contact, the true torque of rigid bars
    differs from this torque by terms of the order of clearance divided by length.

    Parameters
    ----------
    mechanism : Mechanism
        Mechanism whose springs, motors and constant loads act. Actuators, latches and time-dependent forces are left out: the
        torque replaces the actuators but turns their rotors, a latch would hold the mechanism, and a time-dependent force is
        an unknown disturbance.
    reference : TimeFunction
        Reference angle [rad].
    until : float
        End of the table [s].
    body : str, optional
        Driven body; by default the mechanism's input body.
    samples : int
        Number of instants of the table; the error of the spline is of sixth order in their distance.

    Returns
    -------
    Tabulated
        Torque [N m] over time [s].

    Raises
    ------
    InputError
        If the ideal mechanism cannot follow the reference.
    """
    stiff = rigid(mechanism.ideal())
    components = tuple(
        element
        for element in stiff.components
        if not isinstance(element, Actuator) and not (isinstance(element, Force) and element.time_function is not None)
    )
    rotors = [(element.body, element.inertia) for element in stiff.components if isinstance(element, Actuator)]
    undriven = with_rotors(dataclasses.replace(stiff, components=components, latches=(), drives=()), rotors)
    ideal = undriven.driven(reference, body=body)
    run = raise_if_interrupted(simulate(ideal, until=until, samples=samples))
    if run.attrs["status"] != "complete":
        raise InputError(f"the ideal mechanism cannot follow the reference: {run.attrs['cause']}", "another reference")
    return Tabulated(tuple(run["time"].values.tolist()), tuple(run["drive_torque"].values.tolist()))


@checked
def constrain_contact(mechanism: Mechanism, *, indentation: float = 0.0, direction: float | None = None) -> Mechanism:
    """Return the mechanism with its clearance joints held in contact, at a constant eccentricity e = c + indentation.

    A rod of length e from the bearing centre to the journal centre replaces each clearance joint, so that e' and e'' are zero.
    In a run with a prescribed drive, `drive_torque` is the torque that this motion requires. The tension `rod_force` of the
    joint's rod is the normal force N. The rod is bilateral but a contact is unilateral: the run has a warning if N is negative.

    Parameters
    ----------
    mechanism : Mechanism
        Mechanism with clearance joints.
    indentation : float
        Indentation delta [m], the same at every joint.
    direction : float, optional
        Direction of the contact normal at t = 0 [rad]; by default the direction of the ideal reaction.

    Returns
    -------
    Mechanism

    Raises
    ------
    InputError
        If no joint has clearance, or if no direction is given and the ideal reactions are not determined.

    References
    ----------
    Yaqubi, Dardel, Daniali and Ghasemi 2016, doi:10.1007/s11044-015-9486-3
    """
    if not mechanism.clearance_joints:
        raise InputError(
            "constrain_contact() on a mechanism without clearance joints",
            "a mechanism with clearance joints",
            "mechanism.with_clearance(JOINT, CLEARANCE)",
        )
    angles = {joint.name: direction for joint in mechanism.clearance_joints}
    if direction is None:
        for joint, force in zip(mechanism.joints, ideal_reactions(plan(mechanism)), strict=True):
            if joint.clearance is None:
                continue
            if not np.all(np.isfinite(force)) or not np.any(force):
                raise InputError(f"the ideal reaction of joint '{joint.name}' has no direction at the start", "direction=ANGLE")
            angles[joint.name] = math.atan2(-float(force[1]), -float(force[0]))
    rods = tuple(
        Rod(
            joint.name,
            start=joint.bearing,
            end=joint.journal,
            length=joint.clearance.clearance + indentation,
            direction=angles[joint.name],
            tension_only=True,
        )
        for joint in mechanism.clearance_joints
        if joint.clearance is not None
    )
    return dataclasses.replace(mechanism, joints=mechanism.ideal_joints, rods=(*mechanism.rods, *rods))
