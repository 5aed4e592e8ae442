"""Instant until which a gradient is valid for a given change of its parameter."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from scissordyn.integrate.integration import RISE
from scissordyn.sensitivity.forward import Forward

LIMIT_REASONS = {
    "start": "moves the start of the run far from that by the derivatives, or prevents its assembly",
    "far": "moves a journal by more than a tenth of its clearance",
    "order": "moves another event by more than half of the duration of a contact that it meets",
    "grazing": "may remove a contact",
    "near": "may begin or end a contact, stop or latch that nearly does so",
    "mode": "may change whether surfaces separate, stick or slip in an impact",
}
"""Reasons why a gradient is valid only until an instant; each ends the sentence "a change of 1 % ..."."""


class Limit(NamedTuple):
    """Time until which a gradient is valid for a given change of its parameter, and the reason, a key of `LIMIT_REASONS`.

    `change` is the smallest relative change of the parameter that may remove every contact of the run.
    """

    time: float
    reason: str
    change: float


def find_limit(run: Forward, parameter: int, change: float, start: str = "") -> Limit:
    """Return the first instant at which a change of the parameter moves a journal too far, or may add or remove a contact.

    An event counts from the instant at which a changed run has it, if that is earlier. The approach speed of a contact that
    grazes is a square root of the parameter, so that half the change that its derivative requires removes the contact.

    Without a change, as of a parameter that is zero, there is no such instant.

    `start`: reason why the gradient is not valid at the start, or empty.
    """
    if not change:
        return Limit(run.driver.time, "", math.inf)
    log, slope = run.driver.log, run.log[..., parameter]
    later = log["time"] > 0.0
    log, slope = log[later], slope[later]
    removing = np.full(len(log), math.inf)
    np.divide(0.5 * np.abs(log["rate"]), np.abs(slope[:, 3]), out=removing, where=slope[:, 3] != 0.0)
    onsets = removing[log["mode"] == RISE]
    largest = float(np.max(onsets)) if onsets.size else math.inf
    times = [run.driver.time, *run.limits[:, parameter].tolist(), float(run.doubt[parameter]), 0.0 if start else math.inf]
    time, reason = min(zip(times, ("", "near", "far", "grazing", "mode", start), strict=True), key=lambda limit: limit[0])
    order = _order_limit(log, change * slope[:, 0], time)
    return Limit(order, "order", largest) if order < time else Limit(time, reason, largest)


def _order_limit(log: np.ndarray, shift: np.ndarray, end: float, far: float = 0.5) -> float:
    """Return the first instant before `end` from which an event moves too far in a contact of another guard, or infinity.

    `shift` is the change of each event's instant [s].

    `far`: [durations of the contact] Change of the time between the event and the contact up to which both count as unchanged.
    """
    first, before = math.inf, log["time"] < end
    for guard in np.unique(log["guard"]):
        own_events, others = np.flatnonzero(log["guard"] == guard), (log["guard"] != guard) & before
        time, moves = log["time"][others], shift[others]
        for begin, close in pairwise(own_events):
            start, stop = log["time"][[begin, close]]
            apart = np.maximum(np.abs(moves - shift[begin]), np.abs(moves - shift[close]))
            meets = (time > start - apart) & (time < stop + apart) & (apart > far * (stop - start))
            if before[begin] and log["mode"][begin] == RISE and np.any(meets):
                first = min(first, start - abs(shift[begin]), float(np.min((time - np.abs(moves))[meets])))
    return max(first, 0.0)
