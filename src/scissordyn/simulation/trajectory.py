"""From a mechanism to samples and events: tolerances, and the loop in slices."""

from __future__ import annotations

import math
import time as clocks
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np

from scissordyn.integrate import advance as loop
from scissordyn.integrate.books import RATES
from scissordyn.integrate.history import make_history
from scissordyn.integrate.problem import Problem, Samples, Work, make_problem, make_samples, make_work
from scissordyn.integrate.tableau import Tableau, tableau
from scissordyn.jit import Handle
from scissordyn.mechanics import functions
from scissordyn.mechanics.layout import Layout, lay_out
from scissordyn.mechanics.system import System, build_system, sliding_states
from scissordyn.model.body import Body
from scissordyn.model.element import Actuator
from scissordyn.model.mechanism import Mechanism
from scissordyn.simulation.cause import failed_latch, immovable_joints, singular_position
from scissordyn.simulation.options import Options
from scissordyn.simulation.start import prepare_start

__all__ = ["Trajectory", "automatic_method", "broken_off", "compute", "counts_of", "mechanics_problem", "work_arrays"]

SLICE = 2000
"""Steps between two looks at the keyboard and the progress bar; the steps themselves do not depend on it."""

HIDDEN_STATES = 100.0
"""Hidden states are weighed this much more loosely: they relax within microseconds, so that their errors do not add up.
Measured: the events keep their digits, the steps become 16 to 28 % fewer (docs/decisions)."""

ROUNDINGS = 4.0
"""Roundings of positions that a velocity may be wrong by in a step of a linearly implicit method (decision 0010)."""

CAUSES = {
    loop.STEP_TOO_SMALL: "the step size fell to round-off",
    loop.NOT_FINITE: "a law or a position became infinite or not a number",
    loop.STUCK: "contacts and separations followed each other without any progress in time",
}


@dataclass(frozen=True)
class Trajectory:
    """What a run leaves: samples, events and how it ended.

    Parameters
    ----------
    layout : Layout
    system : Handle
        Of the mechanics' `System`.
    samples : Samples
        Trimmed to what was reached.
    log : ndarray, shape (events, LOG_COLUMNS)
        Time, joint, new mode, delta', angle of n; of the contact that ended the largest normal force, when, impulse, losses.
    peak : ndarray, shape (guards, 5)
        The same five of the contact still going on at the end.
    end : float
        Time reached [s].
    status : str
        "complete", "interrupted" or "failed".
    cause : str
        Why it is not complete.
    statistics : dict
        Method, steps, rejected, rates, jacobians, events, seconds.
    still : tuple of str
        Loose joints that cannot move.
    """

    layout: Layout
    system: Handle
    samples: Samples
    log: np.ndarray
    peak: np.ndarray
    end: float
    status: str
    cause: str
    statistics: dict[str, str | int | float]
    still: tuple[str, ...] = ()


def compute(mechanism: Mechanism, options: Options, progress: Callable[[float], None] | None = None) -> Trajectory:
    """Simulate a mechanism.

    Parameters
    ----------
    mechanism : Mechanism
    options : Options
    progress : callable, optional
        Called now and then with the simulated time [s].

    Returns
    -------
    Trajectory
    """
    layout = lay_out(mechanism)
    system = build_system(layout)
    state, opening = prepare_start(layout, system, options)
    still = tuple(immovable_joints(layout, system, state))
    method = options.method if options.method != "auto" else automatic_method(mechanism, options)
    coefficients = tableau(method)
    work = work_arrays(layout, system, state, coefficients, options)
    handle = Handle(system)
    if system.past.size:
        handle.exchange(history=work.history)
        _fill_past(handle, state)
    samples = make_samples(np.linspace(0.0, options.until, options.samples), work)
    clock = np.array([0.0, 1e-4 * options.until, options.until, options.until, options.until])
    count = np.zeros(8, np.int64)
    log = np.zeros((256 + len(opening), loop.LOG_COLUMNS))
    for row, event in enumerate(opening):
        log[row] = event
    count[loop.EVENTS] = len(opening)

    began = clocks.perf_counter()
    status, cause = loop.ADVANCING, ""
    try:
        while status == loop.ADVANCING:
            slice_ = int(min(SLICE, options.most_steps - count[loop.STEPS] - count[loop.REJECTED]))
            if slice_ <= 0:
                cause = f"{options.most_steps} steps did not suffice"
                break
            status = loop.advance(mechanics_problem(), coefficients, handle.address, clock, count, work, samples, log, slice_)
            if status == loop.LOG_FULL:
                log = np.vstack([log, np.zeros_like(log)])
                status = loop.ADVANCING
            elif status == loop.HISTORY_FULL:
                work = work._replace(history=np.vstack([work.history, np.zeros_like(work.history)]))
                handle.exchange(history=work.history)
                status = loop.ADVANCING
            if progress is not None:
                progress(float(clock[loop.TIME]))
    except KeyboardInterrupt:
        cause = "interrupted"
    seconds = clocks.perf_counter() - began
    cause = cause or broken_off(status, layout, handle, work, float(clock[loop.TIME]))
    reached = int(count[loop.SAMPLED])
    ended = "complete" if status == loop.FINISHED else ("interrupted" if cause == "interrupted" else "failed")
    if ended != "complete":
        cause = f"stopped at t = {clock[loop.TIME]:.9g} s of {options.until:g} s: {cause}"
    return Trajectory(
        layout=layout,
        system=handle,
        samples=Samples(*(part[:reached] for part in samples)),
        log=log[: count[loop.EVENTS]].copy(),
        peak=work.peak.copy(),
        end=float(clock[loop.TIME]),
        status=ended,
        cause=cause,
        statistics={"method": method, **counts_of(count), "seconds": seconds},
        still=still,
    )


def automatic_method(mechanism: Mechanism, options: Options) -> str:
    """The stiff method where friction, or the damping of a contact that starts at rest, makes the equations stiff."""
    stiff = any(joint.clearance.friction.stiff for joint in mechanism.contacts if joint.clearance)
    resting = bool(mechanism.contacts) and options.start != "concentric"
    return "rodas5p" if stiff or resting else "dop853"


@cache
def mechanics_problem() -> Problem:
    """Typed pointers to the mechanics."""
    return make_problem(functions.FUNCTIONS)


def work_arrays(layout: Layout, system: System, state: np.ndarray, coefficients: Tableau, options: Options) -> Work:
    """Work arrays with error weights that mean the same for any mechanism.

    A free coordinate counts by how far it moves the points of the bodies; positions are weighed against the smallest clearance,
    speeds against the speed of the whole mechanism, hidden states against their size in steady sliding.
    """
    n, mechanism = layout.free, layout.mechanism
    extent = {body.name: _extent(body) for body in mechanism.bodies}
    moved = np.ones(layout.coordinates.shape[0])
    for body in mechanism.bodies:
        if body.rotates:
            moved[layout.offsets[body.name] + 2 :][:2] = extent[body.name]
    entries = layout.coordinates.tocoo()
    reach = np.zeros(n + layout.basis)
    np.maximum.at(reach, entries.col, moved[entries.row] * np.abs(entries.data))
    scale = float(np.min(system.radius[:, 0])) if mechanism.contacts else (max(extent.values()) or 1.0)
    position = options.atol * scale / reach[:n]
    farthest = max(math.hypot(*body.position) + extent[body.name] for body in mechanism.bodies)
    rounding = np.zeros(state.size)
    if coefficients.kind != 0:
        rounding[n : 2 * n] = ROUNDINGS * np.finfo(float).eps * farthest / reach[:n]
    sliding = sliding_states(system)
    friction = int(system.state_start[len(mechanism.contacts)])
    # a bristle's error fades, an integrator's does not; the torque of an integrator is weighed in N m
    hidden = np.where(np.arange(sliding.size) < friction, HIDDEN_STATES, 1.0) * options.rtol
    delays = [element.controller.delay for element in mechanism.elements if isinstance(element, Actuator)]
    return make_work(
        state,
        coefficients,
        atol=np.concatenate([position, position / options.until, hidden * np.where(sliding > 0.0, sliding, 1.0)]),
        rtol=np.concatenate([np.full(n, 1e-15), np.full(n, options.rtol), hidden]),
        group=np.array([0, n, 2 * n, 2 * n + friction, state.size], np.int64),
        mode=system.mode,
        memory=system.approach,
        precision=np.concatenate([1e-9 * system.radius[:, 0], np.full(system.mode.size - len(mechanism.contacts), 1e-10)]),
        quadratures=5,
        history=make_history(system.past.size) if system.past.size else None,
        kept=system.kept,
        delays=tuple({delay for delay in delays if delay > 0.0}),
        rounding=rounding,
    )


def _fill_past(system: Handle, state: np.ndarray) -> None:
    """Before the start every recorded signal is constant: S = y + R S, found from the recorder's answer to S = 0 and S = 1."""
    past = system.content.past
    answers = np.zeros((2, past.size))
    for value, answer in enumerate(answers):
        past[:] = float(value)
        functions.record(0.0, state, system.address, answer)
    past[:] = answers[0] / (1.0 - (answers[1] - answers[0]))


def _extent(body: Body) -> float:
    """How far from its origin a body reaches, its radius of gyration counted for a body without points [m]."""
    gyration = math.sqrt((body.inertia or 0.0) / body.mass)
    return max([math.hypot(*point) for point in (body.centre, *body.points.values())] + [gyration])


def counts_of(count: np.ndarray) -> dict[str, str | int | float]:
    """The counters of the loop by name."""
    rows = {"steps": loop.STEPS, "rejected": loop.REJECTED, "rates": RATES, "jacobians": loop.JACOBIANS, "events": loop.EVENTS}
    return {name: int(count[row]) for name, row in rows.items()}


def broken_off(status: int, layout: Layout, system: Handle, work: Work, time: float) -> str:
    """Why the loop broke off, with the parts that are at fault; empty if it did not."""
    if status not in CAUSES:
        return ""
    named = failed_latch(layout, system) or singular_position(layout, system, work.y, time)
    return named or f"{CAUSES[status]}{_culprit(layout.mechanism, system, work, time)}"


def _culprit(mechanism: Mechanism, system: Handle, work: Work, time: float) -> str:
    """Which loose joint is in the worst state, for the message of a failed run."""
    if not mechanism.contacts:
        return ""
    values, rates = np.zeros(work.mode.size), np.zeros(work.mode.size)
    functions.guards(time, work.y, system.address, values, rates)
    clearance = system.content.radius[:, 0]
    gap = values[: clearance.size]
    j = int(np.argmax(np.where(np.isnan(gap), np.inf, gap / clearance)))
    return (
        f"; joint '{mechanism.contacts[j].name}': indentation {gap[j] * 1e3:.4g} mm at a clearance of {clearance[j] * 1e3:g} mm"
    )
