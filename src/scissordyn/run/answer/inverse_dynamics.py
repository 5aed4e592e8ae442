"""Which forces and torques at some coordinates give the motion that is prescribed at others."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated

import numpy as np

from scissordyn.component.time_function import Polynomial
from scissordyn.errors import InputError
from scissordyn.mechanics.outputs import Record
from scissordyn.model.coupling import Coordinate, CoordinateDrive
from scissordyn.model.mechanism import Mechanism
from scissordyn.plan.coordinates import Coordinates
from scissordyn.plan.coupling import coupling_parts
from scissordyn.plan.elimination import in_words
from scissordyn.plan.gradients import Gradients
from scissordyn.plan.plan import Plan, plan
from scissordyn.run.advance.trajectory import compute, recorded
from scissordyn.run.answer.coupling import SampledCoordinates
from scissordyn.run.configuration import write_configuration
from scissordyn.run.options import EndTime, Options, SampleCount
from scissordyn.run.results import Results, Variable, described, labels
from scissordyn.units import Meaning, checked

if TYPE_CHECKING:
    import xarray as xr

AUTHORITY = 1e-6  # A motion that moves the inputs by less than this fraction of what moves them most is beyond them


@checked
def inverse_dynamics(
    mechanism: Annotated[Mechanism, Meaning("a mechanism", "read_case('case.toml').mechanism")],
    inputs: Annotated[Mapping[str, Coordinate], Meaning("coordinates by name", '{"motor": RelativeAngle("crank")}')],
    *,
    until: EndTime,
    samples: SampleCount = 501,
) -> xr.Dataset:
    """Forces and torques at chosen inputs that give the motion which the coordinate drives of a mechanism prescribe.

    The drives are the outputs of servo constraints: they determine the motion, and the inputs exert what the drives would.

    Parameters
    ----------
    mechanism : Mechanism
        With ideal joints and as many coordinate drives as degrees of freedom.
    inputs : mapping of str to RelativeAngle, Slide or Distance
        As many as outputs.
    until : float
        End of the motion [s].
    samples : int
        Number of instants.

    Returns
    -------
    Dataset
        `input_force`, `input_value`, `input_rate` and `input_power` over (time, input), the coordinate `input_unit`, and
        `output_value` over (time, output).

    Raises
    ------
    InputError
        If the outputs do not determine the motion, or the inputs cannot bring it about.

    References
    ----------
    García de Jalón and Bayo 1994, Kinematic and Dynamic Simulation of Multibody Systems, doi:10.1007/978-1-4612-2600-0
    """
    options, whole = Options(until, samples=samples), plan(mechanism)
    _check(whole, len(inputs))
    path, motion = recorded(whole, options, compute(whole, options))
    if path.status != "complete":
        raise InputError(f"inverse dynamics of a motion that {path.status}: {path.cause}", "outputs that can be reached")
    outputs = mechanism.coordinate_drives
    force, authority, side = _forces(path.plan.coordinates, motion, inputs, [drive.name for drive in outputs])
    _check_authority(list(inputs), [drive.name for drive in outputs], path.samples.time, authority, side)
    measured = SampledCoordinates(path.plan, motion)
    values, rates = (np.stack(part, axis=1) for part in zip(*map(measured.coordinate, inputs.values()), strict=True))
    output = np.stack([measured.coordinate(drive.coordinate)[0] for drive in outputs], axis=1)
    over = ("time", "input")
    variables = {
        "time": described("time", path.samples.time, "s", "time"),
        "input": labels("input", list(inputs)),
        "output": labels("output", [drive.name for drive in outputs], "driven coordinate"),
        "input_unit": labels("input", [coordinate.unit for coordinate in inputs.values()], "its unit"),
        "input_force": Variable(over, force, {"long_name": "torque [N m] or force [N] at an input"}),
        "input_value": Variable(over, values, {"long_name": "angle [rad] or length [m] of an input"}),
        "input_rate": Variable(over, rates, {"long_name": "its rate"}),
        "input_power": described(over, force * rates, "W", "power of an input"),
        "output_value": Variable(("time", "output"), output, {"long_name": "prescribed coordinate"}),
    }
    attributes = {"title": "scissordyn inverse dynamics", "configuration": write_configuration(mechanism, options)}
    return Results(variables, attributes).dataset()


def _forces(
    coordinates: Coordinates, motion: Record, inputs: Mapping[str, Coordinate], outputs: list[str]
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """What the inputs exert at each sample; how much the least of their motions moves them, and the sign of the determinant."""
    n, basis, constraints = coordinates.free, coordinates.basis, coordinates.constraints
    names = [constraint.name for constraint in constraints]
    at = [names.index(output) for output in outputs]
    others = [k for k in range(len(constraints)) if k not in at]
    scale = np.array([constraints[k].scale for k in at])
    drives = [CoordinateDrive(name, coordinate, Polynomial((0.0,))) for name, coordinate in inputs.items()]
    driven = [coupling_parts(coordinates, drive) for drive in drives]
    holding, moving = Gradients(n, basis, constraints), Gradients(n, basis, driven)
    moving_scale = np.array([constraint.scale for constraint in driven])[:, None]
    force, authority, side = np.zeros((len(motion.X), len(at))), np.zeros(len(motion.X)), np.zeros(len(motion.X))
    for row, (full, multiplier) in enumerate(zip(motion.X, motion.multiplier, strict=True)):
        # virtual motions that all other constraints admit
        gradients = _dense(holding.jacobian(full))[:, :n]
        free = np.linalg.svd(gradients[others])[2][len(others) :].T if others else np.eye(n)
        by_output = gradients[at] * scale[:, None] @ free
        rows = _dense(moving.jacobian(full))[:, :n] * moving_scale
        by_input = rows @ free
        sizes = np.linalg.norm(rows, axis=1)
        authority[row] = np.linalg.svd(by_input / np.where(sizes > 0.0, sizes, 1.0)[:, None], compute_uv=False)[-1]
        side[row] = np.linalg.slogdet(np.vstack([gradients[others], rows]))[0]
        if authority[row] > AUTHORITY:
            # both do the same virtual work
            force[row] = np.linalg.solve(by_input.T, by_output.T @ (-multiplier[at] / scale))
    return force, authority, side


def _dense(matrix: np.ndarray) -> np.ndarray:
    return matrix if isinstance(matrix, np.ndarray) else matrix.toarray()


def _check(whole: Plan, inputs: int) -> None:
    """Raise `InputError` unless outputs determine the motion, and there are as many inputs."""
    mechanism, outputs = whole.mechanism, len(whole.mechanism.coordinate_drives)
    if mechanism.contacts:
        raise InputError(
            f"inverse dynamics with clearance at '{mechanism.contacts[0].name}'", "ideal joints", "mechanism.ideal()"
        )
    if not outputs:
        raise InputError("inverse dynamics of a mechanism without a driven coordinate", "a CoordinateDrive of what is to move")
    if inputs != outputs:
        raise InputError(f"{inputs} inputs for {outputs} driven coordinates", "as many inputs as outputs")
    active = sum(not constraint.latch for constraint in whole.coordinates.constraints)
    motions = whole.coordinates.free - active + outputs
    if motions != outputs:
        raise InputError(
            f"{outputs} driven coordinates of a mechanism with {motions} degrees of freedom",
            "as many, so that they determine the motion",
        )


def _check_authority(inputs: list[str], outputs: list[str], time: np.ndarray, authority: np.ndarray, side: np.ndarray) -> None:
    """Raise `InputError` where the inputs do not move with every motion that is left, at a sample or between two."""
    lost = np.flatnonzero((authority <= AUTHORITY) | (side != side[0]))
    if not lost.size:
        return
    quoted, wanted = (in_words([f"'{name}'" for name in names]) for names in (inputs, outputs))
    if np.all(authority <= AUTHORITY):
        raise InputError(f"input {quoted} without authority over {wanted}: it does not move with the motion", "other inputs")
    raise InputError(
        f"no force at input {quoted} gives the motion of {wanted} up to t = {time[lost[0]]:.6g} s, past a singular position",
        "a motion that stays away from it",
    )
