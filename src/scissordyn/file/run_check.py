"""Check a run that was read from a file, which may be damaged or written by another program."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import numpy as np

from scissordyn.annotation import is_number, shown
from scissordyn.errors import InputError
from scissordyn.model.mechanism import Mechanism

if TYPE_CHECKING:
    import xarray as xr

VECTOR_DIMS, ANGLE_DIMS = ("time", "body", "axis"), ("time", "body")  # dimensions of positions and of angles of bodies

# Dimensions of the variables of a run with the motion of its bodies
MOTION_VARIABLE_DIMS = {
    **dict.fromkeys(("position", "velocity", "acceleration"), VECTOR_DIMS),
    **dict.fromkeys(("angle", "angular_velocity", "angular_acceleration"), ANGLE_DIMS),
}
# names of the variables of every run that are an energy or a work
ENERGY_VARIABLES = ("kinetic_energy", "potential_energy", "drive_work", "dissipated_energy", "energy_residual")

# variables of every run that have a finite value at every instant
FINITE_VARIABLES = {"time": ("time",), **MOTION_VARIABLE_DIMS, **dict.fromkeys(ENERGY_VARIABLES, ("time",))}

JOINT_VARIABLES = {
    "reaction": ("time", "joint", "axis"),
    "reaction_moment": ("time", "joint"),
    "eccentricity": ("time", "joint", "axis"),
    **dict.fromkeys(("indentation", "normal_force", "friction_force", "slip_speed", "in_contact"), ("time", "joint")),
    "clearance": ("joint",),
}
"""Variables of runs with clearance joints and their dimensions; NaN for ideal joints."""

CONTACT_VARIABLES = (
    *("contact_start", "approach_speed", "contact_angle", "peak_force", "peak_time", "peak_normal_force", "peak_normal_time"),
    *("contact_duration", "rebound_speed"),
)
"""Names of the variables of a run along the dimension `contact`, in addition to `contact_joint`."""

# variables of a run along the dimension `event`, with NumPy's letter for the kind of their values
EVENT_VARIABLES = {"event_time": "f", "event_loss": "f", "event_name": "U", "event_kind": "U"}

PEAK_DIMS = {
    "joint_peak_force": "joint",
    "weld_peak_force": "weld",
    "peak_drive_torque": "drive",
    "peak_coordinate_drive_force": "coordinate_drive",
    "peak_coupling_force": "coupling",
}
"""Dimension of each variable of a run with largest values; the run contains their instants too, as `NAME_time`."""

# dimensions of a run along which units differ; a variable `DIM_unit` contains the units
UNIT_DIMS = ("coordinate_drive", "coupling")

NAME_COORDINATES = ("body", "joint", "axis")  # coordinates of a run whose entries are names

TEXT_ATTRIBUTES = ("status", "cause", "configuration")  # attributes of every run that are texts

EXPECTED_RUN = "a run as scissordyn wrote it"  # expected value in errors about damaged runs


def check_run(run: xr.Dataset) -> None:
    """Raise `InputError` unless a dataset has all attributes and variables of a run, with right dimensions, types and units."""
    _check_attributes(run.attrs)
    for name, dims in (*FINITE_VARIABLES.items(), *((name, (name,)) for name in NAME_COORDINATES)):
        _check_dims(run, name, dims)
    for variable_name, variable in run.variables.items():
        _check_variable(str(variable_name), variable)
    for name in FINITE_VARIABLES:
        if not np.all(np.isfinite(run[name].values)):
            raise _make_error(name, "has values that are not finite")
    if np.any(np.diff(run["time"].values) < 0.0):
        raise _make_error("time", "decreases")
    # in a run with ideal joints the dimension of contacts has length zero
    if "indentation" in run or run.sizes.get("contact"):
        for name, dims in JOINT_VARIABLES.items():
            _check_dims(run, name, dims)
    for name, dim in PEAK_DIMS.items():
        if name in run:
            _check_dims(run, name, (dim,))
            _check_dims(run, f"{name}_time", (dim,))
            if dim in UNIT_DIMS:
                _check_dims(run, f"{dim}_unit", (dim,))
    if "contact" in run.sizes:
        _check_contacts(run)
    if "event" in run.sizes:
        for name in EVENT_VARIABLES:
            _check_dims(run, name, ("event",))
        if not np.all(np.isfinite(run["event_time"].values)):
            raise _make_error("event_time", "has values that are not finite")


def check_names(run: xr.Dataset, mechanism: Mechanism) -> None:
    """Raise `InputError` unless the bodies and joints of a run have the names of those of its mechanism."""
    for dim, names in (("body", [body.name for body in mechanism.bodies]), ("joint", list(mechanism.joint_names))):
        if run[dim].values.tolist() != names:
            raise _make_error(dim, "has other names than the run's mechanism")


def _make_error(name: str, what: str) -> InputError:
    return InputError(f"damaged run: the variable '{name}' {what}", EXPECTED_RUN)


def _check_attributes(attributes: dict[Any, Any]) -> None:
    for name in TEXT_ATTRIBUTES:
        if not isinstance(attributes.get(name), str):
            raise InputError(
                f"damaged run: the attribute '{name}' is {shown(attributes.get(name))}", f"a text, in {EXPECTED_RUN}"
            )
    has_horizon = attributes.get("trusted_until") is not None
    for name, always in (("end", True), ("trusted_until", False), ("trusted_contacts", has_horizon)):
        value = attributes.get(name)
        if (always or value is not None) and not (is_number(value) and np.isfinite(float(value))):  # type: ignore[arg-type]
            raise InputError(f"damaged run: the attribute '{name}' is {shown(value)}", f"a finite number, in {EXPECTED_RUN}")
    for name, kind in (("statistics", dict), ("warnings", list)):
        try:
            content = json.loads(attributes.get(name, ""))
        except (TypeError, ValueError, RecursionError):
            content = None
        if not isinstance(content, kind):
            what = f"damaged run: the attribute '{name}' is {shown(attributes.get(name))}"
            raise InputError(what, f"a JSON {'object' if kind is dict else 'list'}, in {EXPECTED_RUN}")


def _check_dims(run: xr.Dataset, name: str, dims: tuple[str, ...]) -> None:
    if name not in run.variables:
        raise InputError(f"damaged run: the variable '{name}' is missing", EXPECTED_RUN)
    if run[name].dims != dims:
        raise _make_error(
            name, f"has the dimensions {', '.join(map(str, run[name].dims)) or 'none'}; expected {', '.join(dims)}"
        )


def _check_variable(name: str, variable: xr.Variable) -> None:
    """Raise `InputError` for a wrong variable: names must be different texts, other values numbers with a unit."""
    if not isinstance(variable.attrs.get("long_name"), str):
        raise _make_error(name, "has no long name")
    named = variable.dims == (name,) and name != "time"
    if named or name == "contact_joint" or name.endswith("_unit") or EVENT_VARIABLES.get(name) == "U":
        values = variable.values.tolist()
        if variable.dtype.kind not in "OU" or not all(isinstance(value, str) for value in values):
            raise _make_error(name, f"holds {variable.dtype}, not texts")
        if named and len(set(values)) < len(values):
            raise _make_error(name, "has the same name twice")
        return
    if variable.dtype.kind not in "fbiu":
        raise _make_error(name, f"holds {variable.dtype}, not numbers")
    if not isinstance(variable.attrs.get("units"), str):
        raise _make_error(name, "has no unit")


def _check_contacts(run: xr.Dataset) -> None:
    for name in ("contact_joint", *CONTACT_VARIABLES):
        _check_dims(run, name, ("contact",))
    if not set(run["contact_joint"].values.tolist()) <= set(run["joint"].values.tolist()):
        raise _make_error("contact_joint", "names joints that the run does not have")
    if not np.all(np.isfinite(run["contact_start"].values)):
        raise _make_error("contact_start", "has values that are not finite")
