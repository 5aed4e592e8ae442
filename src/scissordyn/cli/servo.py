"""The torque that servos need to follow their references, and whether their limits allow it, before any run."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from scissordyn.model.mechanism import Mechanism
    from scissordyn.run.results import Run

SAMPLES = 501
"""Instants of the motion with ideal joints at which torques are compared with limits."""


class ServoDemand(NamedTuple):
    """Of one servo that follows its reference exactly."""

    name: str
    torque: float
    """Largest [N m]."""
    time: float
    """When it is largest [s]."""
    limit: float | None
    above: float
    """Fraction of the time for which it is above the limit."""


def servo_demands(mechanism: Mechanism, followed: Mechanism, ideal: Run) -> list[ServoDemand]:
    """The demands in a motion in which drives stand in the place of servos, see `commanded`."""
    import numpy as np

    from scissordyn.component.actuator import Actuator
    from scissordyn.kinematics.peak import smooth_peak

    demands, driven = [], [drive.body for drive in followed.drives]
    torques = np.abs(ideal["drive_torque"].values.reshape(ideal.sizes["time"], -1)) if driven else np.zeros((0, 0))
    for part in mechanism.components:
        if not isinstance(part, Actuator) or part in followed.components:
            continue
        torque = torques[:, driven.index(part.body)]
        largest, when = smooth_peak(ideal["time"].values, torque)
        limit = getattr(part.controller, "limit", None)
        limit = limit if limit is not None and math.isfinite(limit) else None
        above = 0.0 if limit is None else float(np.mean(torque > limit))
        demands.append(ServoDemand(part.name, float(largest), float(when), limit, above))
    return demands


def servo_lines(demands: Sequence[ServoDemand]) -> list[str]:
    """A line for each servo, a warning for one that cannot hold."""
    from scissordyn.units import short

    lines = []
    for servo in demands:
        said = (
            f"Servo '{servo.name}' follows its reference with up to {short(servo.torque, 'N m')}, at {short(servo.time, 's')}"
        )
        if servo.limit is None:
            lines.append(f"{said}.")
        elif servo.torque <= servo.limit:
            lines.append(f"{said}, {servo.torque / servo.limit:.2g} of its limit of {short(servo.limit, 'N m')}.")
        else:
            lines.append(
                f"Warning: {said}, {servo.torque / servo.limit:.3g} times its limit of {short(servo.limit, 'N m')}: it cannot "
                f"hold for {servo.above:.0%} of the time, and forces with ideal joints are those of a servo that can."
            )
    return lines
