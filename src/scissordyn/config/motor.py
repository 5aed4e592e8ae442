"""Texts of the curve of a motor: ``"0 rpm, 60 N m"``."""

from __future__ import annotations

from collections.abc import Sequence

from scissordyn.analysis.motor import MotorCurve
from scissordyn.config.quantity import read_quantity
from scissordyn.errors import InputError
from scissordyn.units import Quantity

POINT = "'0 rpm, 60 N m'"

SPEED = Quantity("rad/s", minimum=0.0, help="speed of a motor")
TORQUE = Quantity("N m", minimum=0.0, help="torque of a motor")


def read_motor(points: Sequence[str], of: str = "", ratio: float = 1.0) -> MotorCurve:
    """The curve of a motor."""
    pairs = []
    for text in points:
        speed, comma, torque = text.partition(",")
        if not comma:
            raise InputError(f"point '{text}' of a motor", "a speed, a comma and a torque", POINT)
        try:
            pairs.append((read_quantity(speed.strip(), SPEED), read_quantity(torque.strip(), TORQUE)))
        except InputError as error:
            raise InputError(f"point '{text}' of a motor: {error.what}", error.allowed, POINT) from None
    return MotorCurve(tuple(pair[0] for pair in pairs), tuple(pair[1] for pair in pairs), of, ratio)
