"""Define the signals of a controller, and functions shared by several controllers.

The signals of an actuator form one row, in the order of `SIGNALS`. Angles and speeds are those of its body relative to its
base.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Annotated

from scissordyn.errors import InputError, did_you_mean
from scissordyn.kernel import call_at, kernel
from scissordyn.units import Meaning

SIGNALS = (
    "reference_angle",
    "reference_speed",
    "reference_acceleration",
    "error",
    "speed",
    "sensor_x",
    "sensor_y",
    "sensor_rate_x",
    "sensor_rate_y",
    "delayed",
    "feed_forward",
)
"""Signals of an actuator, in order.

They are the reference motion [rad, rad/s, rad/s^2]; the error, reference minus measured angle, in (-pi, pi]; the measured speed
[rad/s]; the sensor vector [m] and its rate [m/s]; the recorded signal one delay ago; the feed-forward torque [N m].
"""

# Index in `SIGNALS` of a signal, or of the first of its signals
REFERENCE, ERROR, SPEED, SENSOR, DELAYED, FEED_FORWARD = (
    0,
    3,
    4,
    5,
    9,
    10,
)

RECORDABLE: Mapping[str, str] = MappingProxyType(
    {"error": "rad", "speed": "rad/s", "sensor_x": "m", "sensor_y": "m", "sensor_rate_x": "m/s", "sensor_rate_y": "m/s"}
)
"""Units of the signals that can be recorded, so that a controller can use their delayed values."""

Recorded = Annotated[
    str,
    Meaning(
        'the signal y: "error" (reference minus angle [rad]), "speed" [rad/s], "sensor_x", "sensor_y" [m] or their rates '
        '"sensor_rate_x", "sensor_rate_y" [m/s]'
    ),
]


@kernel
def control_torque(pointer, t, recorded, q, z, dz, p):
    """Return the torque [N m] of the controller kernel at `pointer`; write the rates of its internal states z into dz.

    t is the time, q the signals, `recorded` the present value of the recorded signal, p the parameters. Without a controller
    (pointer 0) the torque is zero.
    """
    if pointer == 0:
        return 0.0
    return call_at(pointer, q, (), z, (t, recorded), p, dz)


def check_signal(owner: str, name: str) -> None:
    """Raise `InputError` unless a signal of that name can be recorded."""
    if name not in RECORDABLE:
        raise InputError(f"{owner}: unknown signal recorded = {name!r}{did_you_mean(name, RECORDABLE)}", ", ".join(RECORDABLE))


@kernel
def limited(torque, limit):
    """Return the torque clipped to [-limit, limit]; NaN stays NaN."""
    if torque > limit:
        return limit
    if torque < -limit:
        return -limit
    return torque


@kernel
def ramped(t, begin, duration):
    """Return a factor that rises linearly from 0 at `begin` to 1 after `duration`."""
    if t < begin:
        return 0.0
    if t >= begin + duration:
        return 1.0
    return (t - begin) / duration
