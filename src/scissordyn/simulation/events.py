"""The events of latches, end stops, cables and their like in a run, from its event log."""

from __future__ import annotations

import numpy as np

from scissordyn.integrate.integration import RESET_DATA
from scissordyn.mechanics.acting import acting
from scissordyn.model.mechanism import Mechanism

__all__ = ["event_variables", "switching_losses"]

LOSS = 2 + RESET_DATA
"""Column of the event log with the energy that an event of a component dissipates."""


def event_variables(mechanism: Mechanism, log: np.ndarray) -> dict[str, tuple[tuple[str, ...], np.ndarray, dict[str, str]]]:
    """Table of the events of components, for the Dataset.

    Parameters
    ----------
    mechanism : Mechanism
    log : ndarray, shape (events, LOG_COLUMNS)

    Returns
    -------
    dict
        Empty for a mechanism without such components.
    """
    guarded = [part for part in acting(mechanism) if part.declaration.gap is not None]
    if not guarded:
        return {}
    first = len(mechanism.contacts)
    rows = log[log[:, 1] >= first]
    parts = [guarded[k] for k in (rows[:, 1].astype(int) - first).tolist()]
    kinds = [part.declaration.events[int(mode)] for part, mode in zip(parts, rows[:, 2], strict=True)]
    along = ("event",)
    coordinates = [output.unit for part in guarded for output in part.declaration.port.outputs if output.coordinate]
    rates = " or ".join(dict.fromkeys(f"{unit}/s" for unit in coordinates)) or "1/s"
    return {
        "event_time": (
            along,
            rows[:, 0],
            {"units": "s", "long_name": "instant of the event, 0 of what acts from the start on"},
        ),
        "event_name": (along, np.array([part.name for part in parts], dtype=str), {"long_name": "component"}),
        "event_kind": (along, np.array(kinds, dtype=str), {"long_name": "what happened"}),
        "event_speed": (along, rows[:, 3], {"units": rates, "long_name": "rate of approach"}),
        "event_loss": (along, rows[:, LOSS], {"units": "J", "long_name": "energy dissipated by the event"}),
    }


def switching_losses(mechanism: Mechanism, log: np.ndarray, time: np.ndarray) -> np.ndarray:
    """Energy dissipated by events of components up to each instant [J], shape (nt,)."""
    rows = log[log[:, 1] >= len(mechanism.contacts)]
    if not rows.size:
        return np.zeros(time.size)
    return np.asarray((time[:, None] >= rows[None, :, 0]) @ rows[:, LOSS])
