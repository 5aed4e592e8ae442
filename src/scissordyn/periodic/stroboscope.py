"""Integrate a mechanism cycle by cycle, and make states that satisfy the constraints to start from."""

from __future__ import annotations

import math
import time as clocks
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from scissordyn.errors import InputError, whole_number
from scissordyn.integrate.integration import NO_EVENT, RESET_DATA, RISE, Samples
from scissordyn.kernel import Handle
from scissordyn.kinematics.closure import check_tables
from scissordyn.mechanics import functions
from scissordyn.mechanics.monitored import JOINT_FORCE, companions, oiled_contacts
from scissordyn.mechanics.outputs import record
from scissordyn.model.mechanism import Mechanism
from scissordyn.model.options import Options, StartKind
from scissordyn.plan.plan import Plan, plan
from scissordyn.plan.system import guard_values
from scissordyn.record.events import ENERGY_TERMS, accounts
from scissordyn.record.warn import Extremes
from scissordyn.run.advance.driver import Choice, Driver, Snapshot, count_steps
from scissordyn.run.stops import stops
from scissordyn.run.trajectory import current_trajectory, make_driver

CYCLE_VARIABLES = {
    "slider_position": (("cycle",), "m", "position of the slider along its guide"),
    "slider_velocity": (("cycle",), "m/s", "velocity of the slider along its guide"),
    "slider_acceleration": (("cycle",), "m/s^2", "acceleration of the slider along its guide"),
    "eccentricity": (("cycle", "joint", "axis"), "m", "journal centre relative to the bearing centre"),
    "eccentricity_rate": (("cycle", "joint", "axis"), "m/s", "rate of the eccentricity"),
    "in_contact": (("cycle", "joint"), "1", "journal and bearing in contact"),
    "energy": (("cycle",), "J", "kinetic, potential, elastic and spring energy"),
    "impacts": (("cycle", "joint"), "1", "contacts that started in the cycle"),
    "contact_fraction": (("cycle", "joint"), "1", "fraction of the cycle in contact"),
    "united_contact_fraction": (
        ("cycle", "joint"),
        "1",
        "fraction of the cycle with contact of the joint, or its guide's corners",
    ),
    "peak_force": (("cycle", "joint"), "N", "largest force that the joint transmits in the cycle"),
    "drive_work": (("cycle",), "J", "work of the drives in the cycle"),
    "dissipated_energy": (("cycle",), "J", "energy dissipated in the cycle"),
    "steps": (("cycle",), "1", "integration steps in the cycle"),
}
"""Dimensions, unit and long name of the quantities recorded once per cycle."""


@dataclass(frozen=True)
class Cycles:
    """Result of a periodic run: one sample and one row of statistics per complete cycle."""

    plan: Plan
    first: int  # index of the first cycle; cycle k lasts from k to k + 1 periods
    samples: Samples  # one row per cycle, at its start plus the phase
    values: dict[str, np.ndarray]  # quantities recorded once per cycle, by the names of `CYCLE_VARIABLES`
    end: Snapshot  # state after the last whole cycle
    status: str  # "complete", "interrupted" or "failed"
    cause: str  # reason why the run is not complete, or ""
    # method, steps, rejected, rates, jacobians, events, seconds of integration, cycles per second
    statistics: dict[str, str | int | float]
    warnings: tuple[str, ...]  # warnings about the start and the kept cycles


def start_state(
    mechanism: Mechanism, start: StartKind = "concentric", *, rtol: float = 1e-6, atol: float | None = None
) -> Snapshot:
    """Return the state at the start of a run: coordinates, velocities, internal states and contact modes."""
    driver, _, _ = make_driver(plan(mechanism), Options(1.0, start, 2, rtol, atol))
    return driver.snapshot()


def make_consistent(system: Handle, state: Snapshot) -> Snapshot:
    """Return a start that satisfies the constraints, with contact modes that fit its indentations.

    The state may violate the constraints slightly, and its contact modes may be outdated. A joint that was in contact and has
    indentation stays in contact, with its approach speed and internal states. Another joint with indentation starts a contact.
    """
    live, y, answer = system.content.state, state.y.copy(), np.zeros(2)
    live.mode[:], live.memory[:], live.mass[:] = state.mode, state.arrays["memory"], state.arrays["mass"]
    live.reference[:] = state.arrays["reference"]
    functions.activate(system.address)
    functions.accept(state.time, y, system.address, answer)
    value = guard_values(system, state.time, y)
    for k in range(live.mode.size):
        if value[k] > 0.0 and live.mode[k] == 0:
            functions.touch(state.time, y, k, system.address, np.zeros(RESET_DATA))
        elif not value[k] > 0.0 and live.mode[k] == 1:
            functions.reset(state.time, y, k, system.address, np.zeros(RESET_DATA))
    clock = state.arrays["clock"].copy()
    clock["longest"], clock["prepared"], clock["first"], clock["last_event"] = answer[1], 0, 0.0, NO_EVENT
    clock["touching"], clock["reach"] = 0, np.inf
    return state.changed(clock=clock, y=y, mode=live.mode, memory=live.memory, mass=live.mass, reference=live.reference)


def run_cycles(
    mechanism: Mechanism,
    options: Options,
    *,
    cycles: int,
    keep: int | None = None,
    phase: float = 0.0,
    start: Snapshot | None = None,
    progress: Callable[[float], None] | None = None,
) -> Cycles:
    """Run the cycles of `cycle` and return arrays; without `start`, the options determine the initial state."""
    whole_number("cycles", cycles)
    keep = whole_number("keep", cycles if keep is None else keep)
    if not 0.0 <= phase < 1.0:
        raise InputError(f"phase = {phase!r}", "a fraction of the period, at least 0 and below 1")
    period = options.until
    driver, prepared, choice = make_driver(plan(mechanism), options)
    if start is not None:
        driver.restore(start)
    first = round(driver.time / period)
    check_tables(driver.plan, (first + cycles) * period)
    run = _run_cycles(driver, options, choice, range(first, first + cycles), keep, phase, progress)
    return run if start else replace(run, warnings=(*prepared.warnings, *run.warnings))


def _run_cycles(
    driver: Driver,
    options: Options,
    choice: Choice,
    numbers: range,
    keep: int,
    phase: float,
    progress: Callable[[float], None] | None,
) -> Cycles:
    period, first, cycles = options.until, numbers.start, len(numbers)
    contacts = len(driver.plan.contacts)
    driver.sample_at((first + np.arange(cycles) + phase) * period)
    rows: dict[str, np.ndarray] = {
        "impacts": np.zeros((cycles, contacts), np.int64),
        "contact_fraction": np.zeros((cycles, contacts)),
        "peak_force": np.zeros((cycles, contacts)),
        "drive_work": np.zeros(cycles),
        "dissipated_energy": np.zeros(cycles),
        "steps": np.zeros(cycles, np.int64),
    }
    guides = contacts_by_guide(driver.plan)
    if guides:
        rows["united_contact_fraction"] = np.zeros((cycles, contacts))
    losses = [name.endswith("loss") for name in ENERGY_TERMS]
    extremes = Extremes(driver.plan)
    done, events, cause, end = 0, 0, "", driver.snapshot()
    began, before = clocks.perf_counter(), count_steps(driver.state)
    driver.monitor(keep >= cycles)
    try:
        for stop in stops(driver, ((number + 1) * period for number in numbers), options.most_steps):
            if stop.number >= cycles - keep:
                extremes.add(current_trajectory(driver))
            if cause := stop.cause:
                break
            log, begin, mode = driver.log, (first + done) * period, stop.mode[:contacts]
            count_contacts(log, mode, begin, period, rows["impacts"][done], rows["contact_fraction"][done])
            for guide in guides:
                rows["united_contact_fraction"][done, guide] = united_contact_fraction(log, mode, guide, begin, period)
            rows["peak_force"][done] = _peak_forces(driver)
            booked = accounts(driver.plan, driver.state.total[None], log, np.array([math.inf]))[0]
            rows["drive_work"][done], rows["dissipated_energy"][done] = (
                booked[ENERGY_TERMS.index("drive_work")],
                booked[losses].sum(),
            )
            rows["steps"][done] = stop.steps
            driver.monitor(done + 1 >= cycles - keep)
            end = driver.snapshot()
            done, events = done + 1, events + log.shape[0]
            if progress is not None:
                progress(driver.time)
    except KeyboardInterrupt:
        cause = "interrupted"
    seconds = clocks.perf_counter() - began
    ended = "complete" if done == cycles else ("interrupted" if cause == "interrupted" else "failed")
    if ended != "complete":
        cause = f"stopped in cycle {first + done} at t = {driver.time:.9g} s, {driver.time / period:.6g} periods: {cause}"
    after, samples = count_steps(driver.state), Samples(*(part[:done] for part in driver.samples))
    return Cycles(
        plan=driver.plan,
        first=first,
        samples=samples,
        values=_record_samples(driver.plan, driver.system, samples) | {name: values[:done] for name, values in rows.items()},
        end=end,
        status=ended,
        cause=cause,
        statistics={
            "method": choice.method,
            "reason": choice.reason,
            **{name: after[name] - before[name] for name in after},
            "events": events,
            "seconds": seconds,
            "cycles_per_second": done / seconds if seconds > 0.0 else math.nan,
        },
        warnings=tuple(extremes.texts()),
    )


def _peak_forces(driver: Driver) -> np.ndarray:
    """Return the largest force of each contact since the driver's event log was cleared, shape (contacts,) [N]."""
    largest, log, model = driver.peak["largest"], driver.log, driver.system.content.model
    companion, guard = companions(model), log["guard"].astype(np.int64)
    last = np.where(companion >= 0, companion, np.arange(companion.size))
    highest = np.where(driver.state.mode == 1, largest[last], 0.0)
    np.maximum.at(highest, guard, np.where(companion[guard] >= 0, log["whole"], log["largest"]))
    forces = highest[: len(driver.plan.contacts)]
    forces[oiled_contacts(model)] = largest[driver.rows(JOINT_FORCE)]
    return forces


def _record_samples(plan: Plan, system: Handle, samples: Samples) -> dict[str, np.ndarray]:
    """Return the variables of the stroboscopic map at the samples, by name."""
    rows = record(plan.maps, system, samples)
    contacts = system.content.parameters.contact.size
    maps = [plan.eccentricity(j) for j in range(contacts)]
    nothing = np.zeros((samples.time.size, 0, 2))
    values = {
        "eccentricity": np.stack([journal.at(rows.X) for journal in maps], axis=1) if maps else nothing,
        "eccentricity_rate": np.stack([journal.at(rows.V) for journal in maps], axis=1) if maps else nothing,
        "in_contact": samples.mode[:, :contacts] == 1,
        "energy": rows.kinetic + rows.potential + rows.elastic + rows.stored,
    }
    guide = plan.mechanism.output_guide
    if guide is not None:
        guided = plan.coordinates.place(guide.follower)
        along = np.array([math.cos(guide.direction), math.sin(guide.direction)])
        values["slider_position"] = (guided.at(rows.X) - np.array(guide.through)) @ along
        values["slider_velocity"] = guided.at(rows.V) @ along
        values["slider_acceleration"] = guided.at(rows.A) @ along
    return values


def count_contacts(
    log: np.ndarray, mode: np.ndarray, begin: float, period: float, impacts: np.ndarray, fraction: np.ndarray
) -> None:
    """Count the contacts that start in a cycle and sum the time in contact.

    `mode` holds the contact modes at the start of the cycle; `impacts` and `fraction` receive the results per contact.
    """
    for j in range(mode.size):
        contacts = log[log["guard"] == j]
        time, rises = contacts["time"], contacts["mode"] == RISE
        impacts[j] = int(np.sum(rises))
        lasted = float(np.sum(time[~rises]) - np.sum(time[rises]))
        if mode[j] == 1:
            lasted -= begin
        if (contacts["mode"][-1] if contacts.size else mode[j]) == 1:
            lasted += begin + period
        fraction[j] = min(1.0, max(0.0, lasted / period))


def contacts_by_guide(plan: Plan) -> list[list[int]]:
    """Return the indices of the contacts of each clearance joint and clearance guide; an empty list without such a guide."""
    if not plan.mechanism.contact_points:
        return []
    names = [contact.name for contact in plan.contacts]
    return [list(map(names.index, group)) for group in plan.mechanism.contact_groups(names).values()]


def united_contact_fraction(log: np.ndarray, mode: np.ndarray, contacts: list[int], begin: float, period: float) -> float:
    """Return the fraction of a cycle in which at least one of some contacts is closed; `mode` as in `count_contacts`."""
    ours = log[np.isin(log["guard"], contacts)]
    closed = np.cumsum([np.sum(mode[contacts] == 1), *np.where(ours["mode"] == RISE, 1, -1)])
    lasted = np.diff([begin, *ours["time"], begin + period])[closed > 0]
    return min(1.0, float(np.sum(lasted)) / period)
