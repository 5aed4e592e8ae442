"""One number of a mechanism, by name: its value and quantity, and the mechanism with another value."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Any

from scissordyn.errors import InputError, did_you_mean
from scissordyn.model.drive import Drive
from scissordyn.model.mechanism import Mechanism
from scissordyn.units import Quantity, quantities

__all__ = ["Parameter", "parameter", "varied"]

DRIVE = "drive"


@dataclass(frozen=True)
class Parameter:
    """A number that can be varied.

    Parameters
    ----------
    path : str
    value : float
        Its present value.
    quantity : Quantity
        Its unit, bounds and meaning.
    """

    path: str
    value: float
    quantity: Quantity


def parameter(mechanism: Mechanism, path: str) -> Parameter:
    """The number at a path.

    Parameters
    ----------
    mechanism : Mechanism
    path : str
        "gravity"; a joint and a field of its clearance ("A.clearance", "A.friction.kinetic"); "drive" and a field of the
        motion of the driven body ("drive.speed", "drive.angular_frequency"), with the body between them if there are
        several drives.

    Returns
    -------
    Parameter

    Raises
    ------
    InputError
        If there is no number with a unit at the path.
    """
    owner: Any = mechanism
    *inner, name = path.split(".")
    if inner and inner[0] == DRIVE:
        owner = _drive(mechanism, inner[1:], path).motion
    elif inner:
        _check_head(mechanism, inner[0], path)
        owner = mechanism.joint(inner[0]).clearance
        if owner is None:
            raise InputError(f"'{path}': joint '{inner[0]}' is ideal", "a clearance joint")
        for step in inner[1:]:
            owner = _field(owner, step, path)
    value = _field(owner, name, path)
    described: type = type(owner)
    declared = quantities(described)
    if name not in declared or isinstance(value, bool) or not isinstance(value, int | float):
        raise InputError(f"'{path}' is not a number with a unit", ", ".join(declared) or "the path of a number")
    return Parameter(path, float(value), declared[name])


def varied(mechanism: Mechanism, path: str, value: float) -> Mechanism:
    """The same mechanism with one number changed.

    Parameters
    ----------
    mechanism : Mechanism
    path : str
        As in `parameter`.
    value : float
        In SI.

    Returns
    -------
    Mechanism
    """
    head, *inner = path.split(".")
    if head != DRIVE or not inner:
        if inner:
            _check_head(mechanism, head, path)
        return mechanism.replace(path, value)
    drive = _drive(mechanism, inner[:-1], path)
    motion: Any = drive.motion
    _field(motion, inner[-1], path)
    return mechanism.driven(dataclasses.replace(motion, **{inner[-1]: value}), body=drive.body)


def _check_head(mechanism: Mechanism, head: str, path: str) -> None:
    """Raise `InputError` for a path that begins with nothing that has numbers to vary."""
    if head in (joint.name for joint in mechanism.joints):
        return
    described: type = type(mechanism)
    heads = [joint.name for joint in mechanism.clearance_joints] + ([DRIVE] if mechanism.drives else [])
    known = [f"{joint.name}.clearance" for joint in mechanism.clearance_joints[:6]]
    motions: list[type] = [type(drive.motion) for drive in mechanism.drives[:1]]
    known += [f"{DRIVE}.{name}" for motion in motions for name in quantities(motion)]
    raise InputError(
        f"'{path}': '{head}' is neither a joint nor 'drive'{did_you_mean(head, heads)}",
        ", ".join((*known, *quantities(described))) + "; other values need a case file for each",
        known[0] if known else "gravity",
    )


def _drive(mechanism: Mechanism, body: list[str], path: str) -> Drive:
    name = ".".join(body) or (mechanism.drives[0].body if len(mechanism.drives) == 1 else mechanism.input_body)
    for drive in mechanism.drives:
        if drive.body == name:
            return drive
    known = [drive.body for drive in mechanism.drives]
    raise InputError(
        f"'{path}': body '{name}' has no drive{did_you_mean(name, known)}", ", ".join(f"drive.{b}" for b in known) or "a drive"
    )


def _field(owner: Any, name: str, path: str) -> Any:
    names = [field.name for field in dataclasses.fields(owner)] if dataclasses.is_dataclass(owner) else []
    if name not in names:
        kind = type(owner).__name__
        raise InputError(f"'{path}': no field '{name}' in {kind}{did_you_mean(name, names)}", ", ".join(names) or "no field")
    return getattr(owner, name)
