"""The torque that `pyragas` and `extended` share."""

from __future__ import annotations

import math
from typing import Any

from scissordyn.control.signal import check_signal, limited, ramped


def difference_numbers(described: Any) -> dict[str, float]:
    """Limit and onset of a controller that has the fields of these."""
    check_signal(type(described).__name__, described.recorded)
    limit = math.inf if described.limit is None else described.limit
    return {"limit": limit, "onset": described.delay if described.onset is None else described.onset}


def torque(time, recorded, delayed, gain, recursion_gain, limit, onset, ramp):
    """Torque [N m]: K [(1-R) S(t-T) - y(t)] from the onset on."""
    if time < onset:
        return 0.0
    command = gain * ((1.0 - recursion_gain) * delayed - recorded)
    return limited(command if ramp == 0.0 else ramped(time, onset, ramp) * command, limit)
