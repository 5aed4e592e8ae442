"""Drives, which prescribe the angle of a body."""

from __future__ import annotations

from dataclasses import dataclass

from scissordyn.component.time_function import TimeFunction

__all__ = ["Drive"]


@dataclass(frozen=True)
class Drive:
    """A prescribed angle of a body; the driving torque follows from the motion.

    Parameters
    ----------
    body : str
        The driven body.
    motion : TimeFunction
        Its prescribed angle.
    """

    body: str
    motion: TimeFunction
