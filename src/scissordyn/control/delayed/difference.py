"""The torque that `pyragas` and `extended` share."""

from __future__ import annotations

import math
from typing import Any

from scissordyn.control.signal import DELAYED, SIGNALS, check_signal, limited, ramped
from scissordyn.jit import kernel

__all__ = ["difference_numbers", "torque"]

_limited, _ramped = limited, ramped


def difference_numbers(described: Any, recursion_gain: float) -> tuple[float, ...]:
    """K, R, limit, onset, ramp and index of the recorded signal, of a controller that has these fields."""
    check_signal(type(described).__name__, described.recorded)
    limit = math.inf if described.limit is None else described.limit
    onset = described.delay if described.onset is None else described.onset
    return described.gain, recursion_gain, limit, onset, described.ramp, float(SIGNALS.index(described.recorded))


@kernel()
def torque(t, q, p):
    """Torque [N m] at signals q: K [(1-R) S(t-T) - y(t)] from the onset on."""
    if t < p[3]:
        return 0.0
    command = p[0] * ((1.0 - p[1]) * q[DELAYED] - q[int(p[5])])
    return _limited(command if p[4] == 0.0 else _ramped(t, p[3], p[4]) * command, p[2])
