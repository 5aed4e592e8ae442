"""Instant until which a gradient is valid for a given change of its parameter."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from scissordyn.integrate.integration import RISE
from scissordyn.sensitivity.forward import Forward

LIMIT_REASONS = {
    "far": "moves a journal by more than a tenth of its clearance",
    "grazing": "may remove a contact",
    "near": "may begin or end a contact, stop or latch that nearly does so",
    "mode": "may change whether surfaces separate, stick or slip in an impact",
}
"""Reasons why a gradient is valid only until an instant, as the end of the sentence "a change of 1 % ..."."""


class Limit(NamedTuple):
    """Time until which a gradient is valid for a given change of its parameter, and the reason, a key of `LIMIT_REASONS`.

    `change` is the smallest relative change of the parameter that may remove every contact of the run.
    """

    time: float
    reason: str
    change: float


def find_limit(run: Forward, parameter: int, change: float, far: float = 0.1) -> Limit:
    """Return the first event at which a change of the parameter moves a journal too far, or may add or remove a contact.

    The approach speed of a contact that grazes is a square root of the parameter, so that half the change that its derivative
    requires removes the contact.

    Without a change, as of a parameter that is zero, there is no such event.

    `far`: [clearances] Displacement of a journal at an event up to which the gradient counts as valid.
    """
    if not change:
        return Limit(run.driver.time, "", math.inf)
    log, slope = run.driver.log, run.log[..., parameter]
    clearance = run.driver.system.content.parameters.contact["clearance"]
    later = log["time"] > 0.0
    log, slope = log[later], slope[later]
    removing = np.full(len(log), math.inf)
    np.divide(0.5 * np.abs(log["rate"]), np.abs(slope[:, 3]), out=removing, where=slope[:, 3] != 0.0)
    onsets = removing[log["mode"] == RISE]
    largest = float(np.max(onsets)) if onsets.size else math.inf
    limits = [(run.driver.time, ""), (float(run.nearby[parameter]), "near"), (float(run.doubt[parameter]), "mode")]
    for row, by, least in zip(log, slope, removing.tolist(), strict=True):
        guard, time = int(row["guard"]), float(row["time"])
        if guard < clearance.size and abs(row["rate"] * by[0]) * change > far * clearance[guard]:
            limits.append((time, "far"))
        elif least < change:
            limits.append((time, "grazing"))
    return Limit(*min(limits, key=lambda limit: limit[0]), largest)
