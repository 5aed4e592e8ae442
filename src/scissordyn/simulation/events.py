"""The events of latches and end stops in a run, from its event log."""

from __future__ import annotations

import numpy as np

from scissordyn.component.angle_stop import AngleStop
from scissordyn.component.travel_stop import TravelStop
from scissordyn.integrate.advance import RECORD
from scissordyn.model.mechanism import Mechanism

__all__ = ["event_variables", "latch_losses"]

KINDS = {0.0: "left", 1.0: "reached"}


def event_variables(mechanism: Mechanism, log: np.ndarray) -> dict[str, tuple[tuple[str, ...], np.ndarray, dict[str, str]]]:
    """Table of the events of latches and end stops, for the Dataset.

    Parameters
    ----------
    mechanism : Mechanism
    log : ndarray, shape (events, LOG_COLUMNS)

    Returns
    -------
    dict
        Empty for a mechanism that has neither.
    """
    latches = [latch.name for latch in mechanism.latches]
    stops = [element.name for element in mechanism.elements if isinstance(element, AngleStop | TravelStop)]
    if not latches and not stops:
        return {}
    first = len(mechanism.contacts)
    rows = log[log[:, 1] >= first]
    which = rows[:, 1].astype(int) - first
    names = np.array([*latches, *stops])[which]
    kinds = [("locked" if k < len(latches) else KINDS[mode]) for k, mode in zip(which, rows[:, 2], strict=True)]
    along = ("event",)
    return {
        "event_time": (along, rows[:, 0], {"units": "s", "long_name": "instant of the event"}),
        "event_name": (along, names.astype(str), {"long_name": "latch or end stop"}),
        "event_kind": (along, np.array(kinds, dtype=str), {"long_name": "locked, reached or left"}),
        "event_speed": (along, rows[:, 3], {"units": "SI", "long_name": "rate of approach"}),
        "event_loss": (along, rows[:, 2 + RECORD], {"units": "J", "long_name": "energy lost in the impact of locking"}),
    }


def latch_losses(mechanism: Mechanism, log: np.ndarray, time: np.ndarray) -> np.ndarray:
    """Energy dissipated by latches up to each instant [J], shape (nt,)."""
    first = len(mechanism.contacts)
    rows = log[(log[:, 1] >= first) & (log[:, 1] < first + len(mechanism.latches))]
    return np.asarray((time[:, None] >= rows[None, :, 0]) @ rows[:, 2 + RECORD])
