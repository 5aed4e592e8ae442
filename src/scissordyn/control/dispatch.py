"""Dispatch from the kernel kind of a controller to its kernel, as for the laws.

A kind without a branch gives NaN, which ends the run.
"""

from __future__ import annotations

import math

from scissordyn.control.delayed import difference
from scissordyn.control.tracking import feedback
from scissordyn.jit import kernel
from scissordyn.plugin.pointer import USER, call_at

__all__ = ["control_torque"]

_feedback, _difference = feedback.torque, difference.torque


@kernel()
def control_torque(kind, t, q, z, dz, p):
    """Torque [N m] of controller `kind` at time t and signals q; writes the rates of its internal states into dz."""
    if kind == 0:
        return 0.0
    if kind == 1:
        return _feedback(t, q, z, dz, p)
    if kind == 2:
        return _difference(t, q, p)
    if kind == USER:
        signals = (t, q[0], q[1], q[2], q[3], q[4], q[5], q[6], q[7], q[8], q[9], q[10])
        return call_at(signals, p)  # type: ignore[call-arg]
    return math.nan
