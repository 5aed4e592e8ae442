"""The event log as tables: contacts and their estimated forces, events of components, what events add to the energy balance."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from scissordyn.integrate.integration import RISE
from scissordyn.laws.evaluate import elastic_energy, elastic_force
from scissordyn.laws.validity import LAW_SAMPLES
from scissordyn.mechanics.monitored import POWERS
from scissordyn.model.clearance import Clearance, GuideClearance
from scissordyn.plan.plan import Plan
from scissordyn.plugin.element import pointers, row_of
from scissordyn.record.results import Variables, described, labels

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
    """Return the accounts of the energy balance [J] from integrals of powers (nt, powers), shape (nt, accounts)."""
    energy = np.column_stack([total, np.zeros(len(time))])
    rows = log[log["guard"] >= len(plan.contacts)]
    if rows.size:
        past = time[:, None] > rows["time"]  # a sample at an event is the state before it
        energy[:, ACCOUNTS.index("drive_work")] += past @ rows["drive_work"]
        energy[:, ACCOUNTS.index("switching_loss")] += past @ rows["loss"]
    return energy


CONTACTS = {
    "contact_start": ("start", "s", "start of the contact"),
    "approach_speed": ("approach_speed", "m/s", "approach speed"),
    "contact_angle": ("angle", "rad", "direction of the normal at the start"),
    "effective_mass": ("effective_mass", "kg", "effective mass along the normal at the start"),
    "peak_force": ("peak_force", "N", "largest force: normal force and friction"),
    "peak_time": ("peak_time", "s", "time from the start to the largest force"),
    "peak_normal_force": ("peak_normal_force", "N", "largest normal force"),
    "peak_normal_time": ("peak_normal_time", "s", "time from the start to the largest normal force"),
    "contact_duration": ("duration", "s", "duration"),
    "rebound_speed": ("rebound_speed", "m/s", "rate of indentation at the end"),
    "impulse": ("impulse", "N s", "impulse of the normal force"),
    "contact_damping_loss": ("damping_loss", "J", "energy dissipated by damping in the contact"),
    "contact_friction_loss": ("friction_loss", "J", "energy dissipated by friction in the contact"),
}
"""Variables of contacts: columns of their table, with unit and meaning. A contact that the run ends has NaN as its duration."""

IMPACT = ("struck", "struck_time")
"""Columns of hard contacts: the largest impact as m v^2 of the single impact of its impulse [J], and the time to it from the
start [s]; 0 of compliant ones."""

COLUMNS = (*(column for column, _, _ in CONTACTS.values()), *IMPACT)


def contacts(log: np.ndarray, peak: np.ndarray, companion: np.ndarray) -> np.recarray:
    """Return the table of contacts, ordered by onset, from the onsets and releases in an event log, with the joint index.

    `peak` is for contacts that have not ended, `companion` is of `monitored`.
    """
    begun, rows = dict[int, tuple[float, float, float, float]](), []

    def close(joint: int, duration: float, rebound: float, largest: list[float]) -> None:
        start, approach, angle, mass = begun.pop(joint)
        force, when, impulse, damping, friction, second, second_when = largest
        frictional = companion[joint] >= 0
        struck, whole = ((0.0, start), (second, second_when)) if frictional else ((second, second_when), (force, when))
        peaks = whole[0], whole[1] - start, force, when - start
        losses = impulse, damping, friction
        rows.append((joint, start, approach, angle, mass, *peaks, duration, rebound, *losses, struck[0], struck[1] - start))

    for guard, mode, time, rate, angle, mass, *largest in log[log["guard"] < companion.size][list(EVENT)].tolist():
        joint = int(guard)
        if mode == RISE:
            begun[joint] = time, rate, angle, mass if mass > 0.0 else math.nan
        elif joint in begun:
            close(joint, time - begun[joint][0], rate, largest)
    for joint in list(begun):
        largest = list(peak[list(LARGEST)][joint].tolist())
        if companion[joint] >= 0:
            largest[-2:] = peak[["largest", "largest_time"]][companion[joint]].tolist()
        close(joint, math.nan, math.nan, largest)
    table = np.array(rows, [("joint", int), *((name, float) for name in COLUMNS)])
    return table[np.argsort(table["start"], kind="stable")].view(np.recarray)


def contact_variables(plan: Plan, table: np.recarray, step: float) -> Variables:
    """Return the table of contacts, with estimated peaks for hard ones; `step` is that of time stepping."""
    estimates = _impact_variables(plan, table, step)
    names = np.array([joint.name for joint in plan.contacts], dtype=object)
    return {
        **estimates,
        "contact_joint": labels("contact", (names[table["joint"]] if names.size else names).tolist(), "joint"),
        **{
            name: described("contact", np.ascontiguousarray(table[column]), unit, text)
            for name, (column, unit, text) in CONTACTS.items()
        },
    }


LOCATED = "peak_force", "peak_time", "peak_normal_force", "peak_normal_time"  # Columns of contacts that hard ones have not


def _impact_variables(plan: Plan, table: np.recarray, step: float) -> Variables:
    """Return the variables of impacts in hard joints; their largest force is an estimate."""
    hard = plan.hard_places
    if not hard:
        return {}
    estimate, when, least = np.full((3, table["joint"].size), np.nan)
    for j in hard:
        here, clearance = table["joint"] == j, plan.clearances[j]
        struck, lasting = peak_forces(clearance, table["struck"][here]), table["peak_normal_force"][here]
        estimate[here] = np.fmax(struck, lasting)
        # what is largest in the first step of a contact may be an impulse that others pass on to it
        lasting = np.where(table["peak_normal_time"][here] > step, lasting, 0.0)
        approach = peak_forces(clearance, table["effective_mass"][here] * table["approach_speed"][here] ** 2)
        least[here] = np.fmin(np.fmax(approach, lasting), estimate[here])
        when[here] = np.where(struck >= lasting, table["struck_time"][here], table["peak_normal_time"][here])
        for name in LOCATED:
            table[name][here] = np.nan
    text = "estimated largest normal force in a hard contact: of the compliant law at its impacts, or the force that lasts"
    return {
        "peak_force_estimate": described("contact", estimate, "N", text),
        "peak_force_estimate_time": described("contact", when, "s", "time from the start to that force"),
        "peak_force_estimate_least": described("contact", least, "N", f"{text}; by its approach and lasting forces"),
    }


DAMPING_FACTOR_MIN = 1e-6  # [-] smaller damping factors are none: the formula would lose its digits


def peak_forces(clearance: Clearance | GuideClearance, struck: np.ndarray) -> np.ndarray:
    """Estimate the largest normal forces [N] of impacts with m v^2 [J] by the laws of a joint, shape (k,).

    Of a free body of mass m that comes in at v on F = F_el(delta) (1 + xi delta'/v), with s = delta'/v:

        W(delta) = int F_el d delta = m v^2 ((1 - s)/xi - ln((1 + xi)/(1 + xi s))/xi^2),

    so that at the deepest point, s = 0, int F_el d delta = m v^2 (xi - ln(1 + xi))/xi^2. The force is largest at some s in
    between.
    """
    surfaces, law = clearance.surfaces, clearance.stiffness
    damping: Any = clearance.damping
    at, row, xi = pointers(law), row_of(law, surfaces), float(damping.factor)
    depth = np.geomspace(1e-9, 2.0, LAW_SAMPLES) * surfaces.journal_radius
    force = np.array([elastic_force(at["force"], d, row) for d in depth.tolist()])
    energy = np.array([elastic_energy(at["energy"], at["force"], d, row) for d in depth.tolist()])
    sensible = np.isfinite(force) & np.isfinite(energy) & (force > 0.0) & (energy > 0.0)
    s = np.linspace(0.0, 1.0, LAW_SAMPLES)[:-1]
    share = 0.5 * (1.0 - s * s) if xi < DAMPING_FACTOR_MIN else (1.0 - s) / xi - np.log((1.0 + xi) / (1.0 + xi * s)) / xi**2
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
