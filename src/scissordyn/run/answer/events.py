"""The event log as tables: contacts and their estimated forces, events of components, what events add to the energy balance."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from scissordyn.integrate.integration import RISE
from scissordyn.laws.evaluate import elastic_energy, elastic_force
from scissordyn.mechanics.monitored import POWERS
from scissordyn.model.clearance import Clearance
from scissordyn.model.guide_clearance import GuideClearance
from scissordyn.plan.plan import Plan
from scissordyn.plugin.element import pointers, row_of
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


POINTS = 201  # Values of s at which the largest force is looked for, and a parabola through the best three
DEPTHS = 400  # Indentations of the table of energies, each the same factor above the one before
SMALL = 1e-6  # Damping factors below this are taken as none: the formula would lose its digits


def peak_forces(clearance: Clearance | GuideClearance, struck: np.ndarray) -> np.ndarray:
    """Estimates of the largest normal forces [N] of impacts with m v^2 [J] by the laws of a joint, shape (k,).

    Of a free body of mass m that comes in at v on F = F_el(delta) (1 + xi delta'/v), with s = delta'/v:

        W(delta) = int F_el d delta = m v^2 ((1 - s)/xi - ln((1 + xi)/(1 + xi s))/xi^2),

    so that at the deepest point, s = 0, int F_el d delta = m v^2 (xi - ln(1 + xi))/xi^2. The force is largest at some s in
    between.
    """
    surfaces, law = clearance.surfaces, clearance.stiffness
    damping: Any = clearance.damping
    at, row, xi = pointers(law), row_of(law, surfaces), float(damping.factor)
    depth = np.geomspace(1e-9, 2.0, DEPTHS) * surfaces.journal_radius
    force = np.array([elastic_force(at["force"], d, row) for d in depth.tolist()])
    energy = np.array([elastic_energy(at["energy"], at["force"], d, row) for d in depth.tolist()])
    sensible = np.isfinite(force) & np.isfinite(energy) & (force > 0.0) & (energy > 0.0)
    s = np.linspace(0.0, 1.0, POINTS)[:-1]
    share = 0.5 * (1.0 - s * s) if xi < SMALL else (1.0 - s) / xi - np.log((1.0 + xi) / (1.0 + xi * s)) / xi**2
    positive = np.isfinite(struck) & (struck > 0.0)
    forces = np.full(np.shape(struck), np.nan)
    energies = struck[positive][:, None] * share[None, :]
    logs = np.interp(np.log(energies), np.log(energy[sensible]), np.log(force[sensible]), left=np.nan, right=np.nan)
    over = np.exp(logs) * (1.0 + xi * s)
    best = np.clip(np.nanargmax(np.where(np.isnan(over), -1.0, over), axis=1), 1, s.size - 2) if over.size else np.zeros(0, int)
    rows = np.arange(best.size)
    left, middle, right = over[rows, best - 1], over[rows, best], over[rows, best + 1]
    curve = left - 2.0 * middle + right
    step = np.where(curve < 0.0, 0.5 * (left - right) / np.where(curve == 0.0, 1.0, curve), 0.0)
    forces[positive] = np.maximum(np.maximum(left, right), middle - 0.25 * (left - right) * np.clip(step, -1.0, 1.0))
    return forces
