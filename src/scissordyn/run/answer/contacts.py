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
    peak_normal_force: float  # [N]
    peak_normal_time: float  # From the start of the contact to it [s]
    duration: float  # [s]; NaN if the run ended first
    rebound_speed: float  # delta' at the end [m/s], negative; NaN if the run ended first
    impulse: float  # Of the normal force [N s]
    damping_loss: float  # Energy dissipated by contact damping, or restitution, and by friction [J]
    friction_loss: float
    effective_mass: float = math.nan  # Of a hard contact, along the normal at its start [kg]; NaN of a compliant one
    struck: float = 0.0  # Of a hard contact the largest impact while it lasts, as m v^2 of the single impact of its impulse [J]
    struck_time: float = 0.0  # From the start of the contact to that [s]
    peak_force: float = 0.0  # Normal force and friction [N]
    peak_time: float = 0.0  # From the start of the contact to it [s]


def contacts(log: np.ndarray, peak: np.ndarray, companion: np.ndarray) -> list[Contact]:
    """Pair the starts and ends in an event log; `peak` is for contacts that have not ended, `companion` is of `monitored`."""
    open_, closed = dict[int, tuple[float, float, float, float]](), []

    def close(joint: int, duration: float, rebound: float, largest: list[float]) -> None:
        start, approach, direction, mass = open_.pop(joint)
        force, when, impulse, damping, friction, second, second_when = largest
        frictional = companion[joint] >= 0
        struck, whole = ((0.0, start), (second, second_when)) if frictional else ((second, second_when), (force, when))
        closed.append(
            Contact(
                *(joint, start, approach, direction, force, when - start, duration, rebound, impulse, damping, friction, mass),
                *(struck[0], struck[1] - start, whole[0], whole[1] - start),
            )
        )

    for guard, mode, time, rate, angle, mass, *largest in log[log["guard"] < companion.size][list(EVENT)].tolist():
        joint = int(guard)
        if mode == RISE:
            open_[joint] = time, rate, angle, mass if mass > 0.0 else math.nan
        elif joint in open_:
            close(joint, time - open_[joint][0], rate, largest)
    for joint in list(open_):
        largest = list(peak[list(LARGEST)][joint].tolist())
        if companion[joint] >= 0:
            largest[-2:] = peak[["largest", "largest_time"]][companion[joint]].tolist()
        close(joint, math.nan, math.nan, largest)
    return sorted(closed, key=lambda contact: contact.start)


def columns(table: list[Contact]) -> dict[str, np.ndarray]:
    """The contacts as one array per field."""
    return {
        name: np.array([contact[place] for contact in table], int if name == "joint" else float)
        for place, name in enumerate(Contact._fields)
    }
