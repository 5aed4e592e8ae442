"""Tables from the event log: contacts with their forces, events of components, and energy that events dissipate."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from scissordyn.integrate.integration import RISE
from scissordyn.laws.evaluate import elastic_energies, elastic_forces
from scissordyn.laws.validity import LAW_SAMPLES
from scissordyn.mechanics.monitored import POWERS
from scissordyn.model.clearance import Clearance, GuideClearance
from scissordyn.plan.plan import Plan
from scissordyn.plugin.element import pointers, row_of
from scissordyn.record.results import Variables, described, labels
from scissordyn.tolerance import DATA_TOL

ENERGY_TERMS = (*POWERS, "switching_loss")
"""Names of the terms of the energy balance: time integrals of powers with jumps at events, and losses at events only."""

# Columns of the event log with largest values and integrals of a contact, filled at its end
LARGEST = ("largest", "largest_time", "impulse", "damping_loss", "friction_loss", "struck", "struck_time")
# Columns of the event log from which the table of contacts is made
EVENT_COLUMNS = ("guard", "mode", "time", "rate", "angle", "mass", *LARGEST)


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
        "event_time": described("event", rows["time"], "s", "instant of the event; 0 for a component that acts from the start"),
        "event_name": labels("event", [part.name for part in parts], "component"),
        "event_kind": labels("event", kinds, "what happened"),
        "event_speed": described("event", rows["rate"], rates, "rate of approach"),
        "event_loss": described("event", rows["loss"], "J", "energy dissipated by the event"),
        "event_drive_work": described("event", rows["drive_work"], "J", "work of the drives' impulses in the event"),
    }


def accounts(plan: Plan, total: np.ndarray, log: np.ndarray, time: np.ndarray) -> np.ndarray:
    """Return the terms of the energy balance over time [J], shape (nt, terms), from integrals of powers (nt, powers)."""
    energy = np.column_stack([total, np.zeros(len(time))])
    rows = log[log["guard"] >= len(plan.contacts)]
    if rows.size:
        past = np.searchsorted(rows["time"], time)  # a sample at the instant of an event has the state before the event
        for term, name in ("drive_work", "drive_work"), ("switching_loss", "loss"):
            # in the order of the events: a product of matrices adds in an order that depends on processor and number of samples
            energy[:, ENERGY_TERMS.index(term)] += np.append(0.0, np.cumsum(rows[name]))[past]
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
"""Variables of contacts: column of the table, unit and meaning. A contact at the end of the run has the duration NaN."""

IMPACT = ("struck", "struck_time")
"""Columns of hard contacts: m v^2 of a single impact with the largest impulse [J], and the time from the start to it [s].

Compliant contacts have 0.
"""

CONTACT_COLUMNS = (*(column for column, _, _ in CONTACTS.values()), *IMPACT)  # Columns of the table of contacts
CONTACT_ROW = np.dtype([("joint", int), *((name, float) for name in CONTACT_COLUMNS)])  # Type of a row of the table of contacts


def contacts(log: np.ndarray, peak: np.ndarray, companion: np.ndarray) -> np.ndarray:
    """Return the table of contacts, ordered by onset, from the onsets and releases in an event log.

    `peak` has the largest values of contacts that have not ended. `companion` is the array of `monitored.companions`.
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

    for guard, mode, time, rate, angle, mass, *largest in log[log["guard"] < companion.size][list(EVENT_COLUMNS)].tolist():
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
    table = np.array(rows, CONTACT_ROW)
    return table[np.argsort(table["start"], kind="stable")]


def contact_variables(plan: Plan, table: np.ndarray, step: float) -> Variables:
    """Return the variables along `contact` from the table of contacts.

    Largest forces of hard contacts are estimates; `step` is the step size of time stepping [s].
    """
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


# Variables of largest contact forces and their instants, located within steps; only for compliant contacts
LOCATED = "peak_force", "peak_time", "peak_normal_force", "peak_normal_time"


def _impact_variables(plan: Plan, table: np.ndarray, step: float) -> Variables:
    """Return the variables of impacts in joints with hard contact, with estimates of their largest forces."""
    hard = plan.hard_places
    if not hard:
        return {}
    estimate, when, least = np.full((3, table["joint"].size), np.nan)
    clearances = [plan.clearances[j] for j in hard]
    for clearance in (part for k, part in enumerate(clearances) if part not in clearances[:k]):
        here = np.isin(table["joint"], [j for j, part in zip(hard, clearances, strict=True) if part == clearance])
        struck, lasting = peak_forces(clearance, table["struck"][here]), table["peak_normal_force"][here]
        estimate[here] = np.fmax(struck, lasting)
        # the largest impulse in the first step of a contact may come from impacts at other joints
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


def peak_forces(clearance: Clearance | GuideClearance, struck: np.ndarray) -> np.ndarray:
    """Estimate the largest normal forces of impacts from the contact laws of a joint, shape (k,) [N].

    `struck` is m v^2 of each impact [J]. For a free body of mass m and approach speed v, the contact force
    F = F_el(delta) (1 + xi delta'/v) and s = delta'/v give

        W(delta) = int F_el d delta = m v^2 ((1 - s)/xi - ln((1 + xi)/(1 + xi s))/xi^2),

    At the deepest point, s = 0, int F_el d delta = m v^2 (xi - ln(1 + xi))/xi^2. The force is largest at an s from 0 to 1.
    """
    positive, forces = np.isfinite(struck) & (struck > 0.0), np.full(np.shape(struck), np.nan)
    if not np.any(positive):
        return forces
    surfaces, law = clearance.surfaces, clearance.stiffness
    damping: Any = clearance.damping
    at, row, xi = pointers(law), row_of(law, surfaces), float(damping.factor)
    depth = np.geomspace(1e-9, 2.0, LAW_SAMPLES) * surfaces.journal_radius
    force = elastic_forces(at["force"], depth, row)
    energy = elastic_energies(at["energy"], at["force"], depth, row)
    sensible = np.isfinite(force) & np.isfinite(energy) & (force > 0.0) & (energy > 0.0)
    s = np.linspace(0.0, 1.0, LAW_SAMPLES)[:-1]
    share = 0.5 * (1.0 - s * s) if xi < DATA_TOL else (1.0 - s) / xi - np.log((1.0 + xi) / (1.0 + xi * s)) / xi**2
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
