"""Units and bounds of fields: their declaration and their check.

Inside the package every number is SI and every angle is in radians.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from functools import cache
from numbers import Real
from typing import Annotated, Any, get_args, get_origin, get_type_hints

from scissordyn.errors import InputError

__all__ = ["Pairs", "Quantity", "check_quantities", "degrees", "quantities", "rpm"]


def degrees(angle: float) -> float:
    """An angle in degrees as radians [rad]."""
    return math.radians(angle)


def rpm(speed: float) -> float:
    """A speed in revolutions per minute as angular velocity [rad/s]."""
    return speed * 2.0 * math.pi / 60.0


@dataclass(frozen=True)
class Quantity:
    """Unit, bounds and help text of an annotated number.

    Used as ``Annotated[float, Quantity("m", above=0.0, help="radial clearance")]``.

    Parameters
    ----------
    unit : str
        SI unit as shown to the user; "1" for a pure number.
    above, below : float, optional
        Open bounds.
    minimum, maximum : float, optional
        Closed bounds.
    help : str
        Description of the number in one line.
    """

    unit: str
    above: float | None = None
    below: float | None = None
    minimum: float | None = None
    maximum: float | None = None
    help: str = ""

    @property
    def allowed(self) -> str:
        """The bounds in words, e.g. ``a number > 0 [m]``."""
        bounds = [
            f"{sign} {bound:g}"
            for sign, bound in ((">", self.above), (">=", self.minimum), ("<", self.below), ("<=", self.maximum))
            if bound is not None
        ]
        number = " and ".join(bounds)
        return f"a finite number {number}".rstrip() + ("" if self.unit == "1" else f" [{self.unit}]")

    def admits(self, value: float) -> bool:
        """Whether `value` is a finite number inside the bounds."""
        return (
            math.isfinite(value)
            and (self.above is None or value > self.above)
            and (self.below is None or value < self.below)
            and (self.minimum is None or value >= self.minimum)
            and (self.maximum is None or value <= self.maximum)
        )


@dataclass(frozen=True)
class Pairs:
    """What an annotated tuple of pairs means: ``Annotated[tuple[Point, ...], Pairs(("angles", "moments"), ("rad", "N m"))]``.

    Parameters
    ----------
    names : (str, str)
        Of the first and of the second numbers.
    units : (str, str)
        SI units.
    help : str
        One line that says what the pairs are.
    """

    names: tuple[str, str]
    units: tuple[str, str]
    help: str = ""


@cache
def quantities(described: type) -> dict[str, Quantity]:
    """The quantities that the annotated fields of a dataclass declare, by field name."""
    found: dict[str, Quantity] = {}
    for name, hint in get_type_hints(described, include_extras=True).items():
        for layer in (hint, *get_args(hint)):
            if get_origin(layer) is Annotated:
                found.update((name, extra) for extra in get_args(layer)[1:] if isinstance(extra, Quantity))
    return found


@cache
def _whole(described: type) -> frozenset[str]:
    """The fields of a dataclass that hold whole numbers."""
    hints = get_type_hints(described, include_extras=True)
    return frozenset(name for name, hint in hints.items() if get_origin(hint) is Annotated and get_args(hint)[0] is int)


def check_quantities(instance: Any, named: str = "") -> None:
    """Raise `InputError` for the first field of a dataclass instance outside its declared bounds; `named` is its owner.

    Numbers of other libraries, such as numpy's, become Python's own.
    """
    described: type = type(instance)
    declared, owner = quantities(described), named or described.__name__
    for field in fields(instance):
        value = getattr(instance, field.name)
        if field.name not in declared or value is None:
            continue
        quantity = declared[field.name]
        if isinstance(value, tuple):
            if len(value) != 2 or not all(_is_number(part) and quantity.admits(float(part)) for part in value):
                raise InputError(f"{owner}: {field.name} = {value!r}", f"two of: {quantity.allowed}")
            if not all(type(part) in (int, float) for part in value):
                object.__setattr__(instance, field.name, tuple(map(float, value)))
            continue
        if not _is_number(value) or not quantity.admits(float(value)):
            raise InputError(f"{owner}: {field.name} = {value!r}", f"{field.name} must be {quantity.allowed}")
        if field.name in _whole(described) and float(value) != int(value):
            raise InputError(f"{owner}: {field.name} = {value!r}", f"{field.name} must be a whole number, {quantity.allowed}")
        if type(value) not in (int, float):
            object.__setattr__(instance, field.name, int(value) if field.name in _whole(described) else float(value))


def _is_number(value: object) -> bool:
    return isinstance(value, Real) and not isinstance(value, bool)
