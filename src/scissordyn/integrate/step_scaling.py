"""How time runs inside an explicit step: evenly, or slowly at that end where a contact begins or ends.

The force of most contacts grows as the power 3/2 of the indentation, so a solution has half powers of the time since the
contact began, and until it ends. In s = sqrt(time) it is smooth, and a method keeps its order: t = t0 + h s^2 after a contact
begins, t = t0 + h (1 - (1 - s)^2) before it ends, s = 0 .. 1.
"""

from __future__ import annotations

import math

from scissordyn.kernel import kernel

EVEN, AFTER_START, BEFORE_END = range(3)  # Ways in which time runs inside a step


@kernel
def fraction(scaling, s):
    """Part of the step's time that has passed at s."""
    if scaling == EVEN:
        return s
    return s * s if scaling == AFTER_START else s * (2.0 - s)


@kernel
def speed(scaling, s):
    """Derivative of `fraction` by s."""
    if scaling == EVEN:
        return 1.0
    return 2.0 * s if scaling == AFTER_START else 2.0 * (1.0 - s)


@kernel
def place(scaling, part):
    """The s at which a part of the step's time has passed."""
    if scaling == EVEN:
        return part
    return math.sqrt(part) if scaling == AFTER_START else 1.0 - math.sqrt(max(0.0, 1.0 - part))
