"""Whether a run that was read from a file has what `simulate` writes: files are damaged, and made by other programs."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import numpy as np

from scissordyn.annotation import is_number, shown
from scissordyn.errors import InputError
from scissordyn.model.mechanism import Mechanism

if TYPE_CHECKING:
    import xarray as xr

POINTS, TURNS = ("time", "body", "axis"), ("time", "body")

MOTION = {
    **dict.fromkeys(("position", "velocity", "acceleration"), POINTS),
    **dict.fromkeys(("angle", "angular_velocity", "angular_acceleration"), TURNS),
}
ENERGIES = ("kinetic_energy", "potential_energy", "drive_work", "dissipated_energy", "energy_residual")

FINITE = {"time": ("time",), **MOTION, **dict.fromkeys(ENERGIES, ("time",))}  # What every run has as numbers at every instant

JOINTS = {
    "reaction": ("time", "joint", "axis"),
    "reaction_moment": ("time", "joint"),
    "eccentricity": ("time", "joint", "axis"),
    **dict.fromkeys(("indentation", "normal_force", "friction_force", "slip_speed", "in_contact"), ("time", "joint")),
    "clearance": ("joint",),
}
"""What runs with clearance joints have, NaN at ideal ones."""

CONTACTS = (
    *("contact_start", "approach_speed", "contact_angle", "peak_force", "peak_time", "peak_normal_force", "peak_normal_time"),
    *("contact_duration", "rebound_speed"),
)
"""What the contacts are described by, beside their joint."""

EVENTS = {"event_time": "f", "event_loss": "f", "event_name": "U", "event_kind": "U"}

NAMES = ("body", "joint", "axis")

TEXTS = ("status", "cause", "configuration")

FROM = "a run as scissordyn wrote it"


def check_run(run: xr.Dataset) -> None:
    """Raise `InputError` unless a dataset has the attributes and variables of a run, with their dimensions, types and units."""
    _check_attributes(run.attrs)
    for name, dims in (*FINITE.items(), *((name, (name,)) for name in NAMES)):
        _check_dims(run, name, dims)
    for variable_name, variable in run.variables.items():
        _check_variable(str(variable_name), variable)
    for name in FINITE:
        if not np.all(np.isfinite(run[name].values)):
            raise _damaged(name, "is not a number somewhere")
    if np.any(np.diff(run["time"].values) < 0.0):
        raise _damaged("time", "goes back")
    if "indentation" in run or run.sizes.get("contact"):  # a run with ideal joints has room for contacts, and none
        for name, dims in JOINTS.items():
            _check_dims(run, name, dims)
    if "contact" in run.sizes:
        _check_contacts(run)
    if "event" in run.sizes:
        for name in EVENTS:
            _check_dims(run, name, ("event",))
        if not np.all(np.isfinite(run["event_time"].values)):
            raise _damaged("event_time", "is not a number somewhere")


def check_names(run: xr.Dataset, mechanism: Mechanism) -> None:
    """Raise `InputError` if bodies or joints of a run are not those of the mechanism that it says was run."""
    for dim, names in (("body", [body.name for body in mechanism.bodies]), ("joint", list(mechanism.joint_names))):
        if run[dim].values.tolist() != names:
            raise _damaged(dim, "has other names than the mechanism of the run")


def _damaged(name: str, what: str) -> InputError:
    return InputError(f"a run whose variable '{name}' {what}", FROM)


def _check_attributes(attributes: dict[Any, Any]) -> None:
    for name in TEXTS:
        if not isinstance(attributes.get(name), str):
            raise InputError(f"a run whose attribute '{name}' is {shown(attributes.get(name))}", f"a text, in {FROM}")
    for name, always in (("end", True), ("trusted_until", False)):
        value = attributes.get(name)
        if (always or value is not None) and not (is_number(value) and np.isfinite(float(value))):  # type: ignore[arg-type]
            raise InputError(f"a run whose attribute '{name}' is {shown(value)}", f"a finite number, in {FROM}")
    for name, kind in (("statistics", dict), ("warnings", list)):
        try:
            content = json.loads(attributes.get(name, ""))
        except (TypeError, ValueError, RecursionError):
            content = None
        if not isinstance(content, kind):
            what = f"a run whose attribute '{name}' is {shown(attributes.get(name))}"
            raise InputError(what, f"JSON, in {FROM}")


def _check_dims(run: xr.Dataset, name: str, dims: tuple[str, ...]) -> None:
    if name not in run.variables:
        raise InputError(f"a run without the variable '{name}'", FROM)
    if run[name].dims != dims:
        raise _damaged(name, f"goes over {', '.join(map(str, run[name].dims)) or 'nothing'}, not over {', '.join(dims)}")


def _check_variable(name: str, variable: xr.Variable) -> None:
    """Names and units are texts, all else is numbers with a unit and a long name."""
    if not isinstance(variable.attrs.get("long_name"), str):
        raise _damaged(name, "has no long name")
    named = variable.dims == (name,) and name != "time"
    if named or name == "contact_joint" or name.endswith("_unit") or EVENTS.get(name) == "U":
        values = variable.values.tolist()
        if variable.dtype.kind not in "OU" or not all(isinstance(value, str) for value in values):
            raise _damaged(name, f"holds {variable.dtype} in place of texts")
        if named and len(set(values)) < len(values):
            raise _damaged(name, "has a name twice")
        return
    if variable.dtype.kind not in "fbiu":
        raise _damaged(name, f"holds {variable.dtype} in place of numbers")
    if not isinstance(variable.attrs.get("units"), str):
        raise _damaged(name, "has no unit")


def _check_contacts(run: xr.Dataset) -> None:
    for name in ("contact_joint", *CONTACTS):
        _check_dims(run, name, ("contact",))
    if not set(run["contact_joint"].values.tolist()) <= set(run["joint"].values.tolist()):
        raise _damaged("contact_joint", "names joints that the run does not have")
    if not np.all(np.isfinite(run["contact_start"].values)):
        raise _damaged("contact_start", "is not a number somewhere")
