"""The table of contacts, from the event log."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from scissordyn.integrate.integration import RESET_DATA

__all__ = ["PEAK", "Contact", "contacts"]


PEAK = 3 + RESET_DATA
"""Column of the event log with the largest normal force; behind it when, then the integrals."""


class Contact(NamedTuple):
    """One contact of one joint.

    Parameters
    ----------
    joint : int
        Which clearance joint.
    start : float
        [s]
    approach_speed : float
        delta'(-) [m/s].
    angle : float
        Direction of n at the start [rad].
    peak_force : float
        Largest normal force [N].
    peak_time : float
        From the start of the contact to the peak [s].
    duration : float
        [s]; NaN if the run ended first.
    rebound_speed : float
        delta' at the end [m/s], negative; NaN if the run ended first.
    impulse : float
        Of the normal force [N s].
    damping_loss, friction_loss : float
        Energy dissipated by contact damping and by friction [J].
    """

    joint: int
    start: float
    approach_speed: float
    angle: float
    peak_force: float
    peak_time: float
    duration: float
    rebound_speed: float
    impulse: float
    damping_loss: float
    friction_loss: float


def contacts(log: np.ndarray, peak: np.ndarray) -> list[Contact]:
    """Pair the starts and ends in an event log.

    Parameters
    ----------
    log : ndarray, shape (events, LOG_COLUMNS)
        Time, joint, 1 for a start and 0 for an end, delta', angle of n, 0, largest normal force and when, impulse and losses.
    peak : ndarray, shape (nj, 5)
        The last five for contacts that have not ended; guards after the joints are left out.

    Returns
    -------
    list of Contact
        In order of their starts.
    """
    open_, found = {}, []
    for row in log.tolist():
        joint = int(row[1])
        if joint >= peak.shape[0]:
            continue
        if row[2] == 1.0:
            open_[joint] = row
        elif joint in open_:
            start = open_.pop(joint)
            timing = row[PEAK + 1] - start[0], row[0] - start[0]
            found.append(Contact(joint, start[0], start[3], start[4], row[PEAK], *timing, row[3], *row[PEAK + 2 :]))
    for joint, start in open_.items():
        force, when, *integrals = peak[joint].tolist()
        found.append(Contact(joint, start[0], start[3], start[4], force, when - start[0], math.nan, math.nan, *integrals))
    return sorted(found, key=lambda contact: contact.start)


def columns(found: list[Contact]) -> dict[str, np.ndarray]:
    """The contacts as one array per field."""
    return {
        name: np.array([contact[place] for contact in found], int if name == "joint" else float)
        for place, name in enumerate(Contact._fields)
    }
