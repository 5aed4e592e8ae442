"""The event log as tables: contacts, events of components, and what events add to the energy balance."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from scissordyn.integrate.integration import RISE
from scissordyn.mechanics.monitored import POWERS
from scissordyn.plan.plan import Plan
from scissordyn.run.results import Variables, described, labels

ACCOUNTS = (*POWERS, "switching_loss")
"""The accounts of the energy balance: integrals of powers, to which events add, and what events alone dissipate."""

LARGEST = ("largest", "largest_time", "impulse", "damping_loss", "friction_loss", "struck", "struck_time")
EVENT = ("guard", "mode", "time", "rate", "angle", "mass", *LARGEST)


def event_variables(plan: Plan, log: np.ndarray) -> Variables:
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
    """The accounts of the energy balance at some instants, from integrals of powers (nt, powers), shape (nt, accounts) [J]."""
    energy = np.column_stack([total, np.zeros(len(time))])
    rows = log[log["guard"] >= len(plan.contacts)]
    if rows.size:
        past = time[:, None] > rows["time"]  # a sample at an event is the state before it
        energy[:, ACCOUNTS.index("drive_work")] += past @ rows["drive_work"]
        energy[:, ACCOUNTS.index("switching_loss")] += past @ rows["loss"]
    return energy


class Contact(NamedTuple):
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
    return {
        name: np.array([contact[place] for contact in table], int if name == "joint" else float)
        for place, name in enumerate(Contact._fields)
    }
