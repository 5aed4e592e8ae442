"""The events of latches, end stops, cables and their like in a run, from its event log."""

from __future__ import annotations

import numpy as np

from scissordyn.mechanics.monitored import POWERS
from scissordyn.plan.plan import Plan
from scissordyn.run.results import Variables, described, labels

ACCOUNTS = (*POWERS, "switching_loss")
"""The accounts of the energy balance at some instants, from integrals of powers (nt, powers), shape (nt, accounts) [J]."""


def event_variables(plan: Plan, log: np.ndarray) -> Variables:
    """Table of the events of components, for the Dataset."""
    guarded = [part for part in plan.acting if part.declaration.gap is not None]
    if not guarded:
        return {}
    first = len(plan.contacts)
    rows = log[log["guard"] >= first]
    parts = [guarded[k] for k in (rows["guard"].astype(int) - first).tolist()]
    kinds = [part.declaration.events[int(mode)] for part, mode in zip(parts, rows["mode"], strict=True)]
    coordinates = [output.unit for part in guarded for output in part.declaration.port.outputs if output.coordinate]
    rates = " or ".join(dict.fromkeys(f"{unit}/s" for unit in coordinates)) or "1/s"
    return {
        "event_time": described("event", rows["time"], "s", "instant of the event, 0 of what acts from the start on"),
        "event_name": labels("event", [part.name for part in parts], "component"),
        "event_kind": labels("event", kinds, "what happened"),
        "event_speed": described("event", rows["rate"], rates, "rate of approach"),
        "event_loss": described("event", rows["loss"], "J", "energy dissipated by the event"),
        "event_drive_work": described("event", rows["drive_work"], "J", "work of the drives' impulses in the event"),
    }


def accounts(plan: Plan, total: np.ndarray, log: np.ndarray, time: np.ndarray) -> np.ndarray:
    """The accounts of the energy balance at some instants.

    Shapes: `total` (nt, powers) [J], `log` (events,), `time` (nt,) [s]; returns (nt, accounts) [J].
    """
    energy = np.column_stack([total, np.zeros(len(time))])
    rows = log[log["guard"] >= len(plan.contacts)]
    if rows.size:
        past = time[:, None] > rows["time"]  # a sample at an event is the state before it
        energy[:, ACCOUNTS.index("drive_work")] += past @ rows["drive_work"]
        energy[:, ACCOUNTS.index("switching_loss")] += past @ rows["loss"]
    return energy
