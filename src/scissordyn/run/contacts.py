"""The table of contacts, from the event log."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from scissordyn.integrate.integration import RISE

LARGEST = ("largest", "largest_time", "impulse", "damping_loss", "friction_loss", "struck", "struck_time")
EVENT = ("guard", "mode", "time", "rate", "angle", "mass", *LARGEST)


class Contact(NamedTuple):
    """One contact of one joint."""

    joint: int  # Which clearance joint
    start: float  # [s]
    approach_speed: float  # delta'(-) [m/s]
    angle: float  # Direction of n at the start [rad]
    peak_force: float  # Largest normal force [N]
    peak_time: float  # From the start of the contact to the peak [s]
    duration: float  # [s]; NaN if the run ended first
    rebound_speed: float  # delta' at the end [m/s], negative; NaN if the run ended first
    impulse: float  # Of the normal force [N s]
    damping_loss: float  # Energy dissipated by contact damping, or restitution, and by friction [J]
    friction_loss: float
    effective_mass: float = math.nan  # Of a hard contact, along the normal at its start [kg]; NaN of a compliant one
    struck: float = 0.0  # Of a hard contact the largest impact while it lasts, as m v^2 of the single impact of its impulse [J]
    struck_time: float = 0.0  # From the start of the contact to that [s]


def contacts(log: np.ndarray, peak: np.ndarray) -> list[Contact]:
    """Pair the starts and ends in an event log.

    Shapes: `log` (events,), `peak` (nj,).
    """
    open_, found = dict[int, tuple[float, float, float, float]](), []
    for guard, mode, time, rate, angle, mass, *ended in log[log["guard"] < peak.size][list(EVENT)].tolist():
        joint = int(guard)
        if mode == RISE:
            open_[joint] = time, rate, angle, mass if mass > 0.0 else math.nan
        elif joint in open_:
            start, approach, direction, moved = open_.pop(joint)
            force, when, impulse, damping, friction, struck, struck_when = ended
            begun, lost = (joint, start, approach, direction, force, when - start), (impulse, damping, friction)
            found.append(Contact(*begun, time - start, rate, *lost, moved, struck, struck_when - start))
    for joint, (start, approach, direction, moved) in open_.items():
        force, when, impulse, damping, friction, struck, struck_when = peak[list(LARGEST)][joint].tolist()
        found.append(
            Contact(
                *(joint, start, approach, direction, force, when - start, math.nan, math.nan),
                *(impulse, damping, friction, moved, struck, struck_when - start),
            )
        )
    return sorted(found, key=lambda contact: contact.start)


def columns(found: list[Contact]) -> dict[str, np.ndarray]:
    """The contacts as one array per field."""
    return {
        name: np.array([contact[place] for contact in found], int if name == "joint" else float)
        for place, name in enumerate(Contact._fields)
    }
