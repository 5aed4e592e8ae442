"""From a mechanism to samples and events."""

from __future__ import annotations

import time as clocks
from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from scissordyn.equilibrium.cause import (
    describe_failed_latch,
    describe_jam,
    describe_singular_position,
    full_coordinates,
    immobile_joints,
)
from scissordyn.equilibrium.start import Prepared, prepare_start
from scissordyn.integrate import advance as loop
from scissordyn.integrate.integration import CROSSES, ENDS, IGNORES, Samples
from scissordyn.kernel import Handle
from scissordyn.laws.validity import contact_failure
from scissordyn.mechanics.monitored import INDENTATION
from scissordyn.mechanics.outputs import Record
from scissordyn.model.clearance import ContactPoint
from scissordyn.model.options import Options
from scissordyn.plan.plan import Plan
from scissordyn.plan.system import guard_values, make_system
from scissordyn.record.trajectory import Trajectory, unknown
from scissordyn.run.advance.change_point import recorded_across
from scissordyn.run.advance.checkpoint import Keeper
from scissordyn.run.advance.driver import Choice, Driver, counted
from scissordyn.run.advance.loop import advance
from scissordyn.run.advance.tolerance import error_weights
from scissordyn.run.instants import MOST_INSTANTS
from scissordyn.run.method import choose_method

if TYPE_CHECKING:
    from scissordyn.record.ideal_path import IdealPath

CROSSED_FROM = 6  # Number of clearance joints from which steps go across contacts that begin and end (docs/decisions)

HARD_CROSSED_FROM = 3
"""The same where contacts are hard: impacts that push other joints in follow each other ever faster when they are located."""

MOST_RECORDED = 2 * MOST_INSTANTS  # Rows of recorded steps from which on every other one is left out
UNSOLVED = 0.01  # Part of the steps with contacts whose impulses are not solved above which a run has failed
RUN = "run"  # What checkpoints call a run itself

FAILED = "the contact model has failed"

INTERRUPTED = "interrupted"  # Both how a run ended and why

CAUSES = {
    loop.STEP_TOO_SMALL: "the step size fell to round-off",
    loop.NOT_FINITE: "a law or a position became infinite or not a number",
    loop.STUCK: "contacts and separations followed each other without any progress in time",
}


def make_driver(
    plan: Plan,
    options: Options,
    system: Handle | None = None,
    driver: Driver | None = None,
    perturb: Callable[[np.ndarray], np.ndarray] = lambda y: y,
) -> tuple[Driver, Prepared, Choice]:
    """A driver at the start of a run: in the arrays of another one of the same system, if that has the same method."""
    system = make_system(plan) if system is None else system
    prepared = prepare_start(plan, system, options.start)
    y = perturb(prepared.y)
    tolerances = error_weights(plan, system, y, rtol=options.rtol, atol=options.atol)
    choice = choose_method(plan, system, y, options, tolerances)
    if driver is None or driver.method != choice.method:
        driver = Driver(plan, system, y.size, choice, tolerances)
    driver.begin(plan, y, choice, tolerances, crosses(plan, options), prepared.initial_events)
    return driver, prepared, choice


def crosses(plan: Plan, options: Options) -> int:
    """What steps do where contacts begin and end: `ENDS`, `CROSSES` or `IGNORES`."""
    if options.step is not None and not plan.hard_places:
        return IGNORES
    across = options.events == "crossed"
    if options.events == "auto" and plan.hard_places:
        loose = {contact.guide if isinstance(contact, ContactPoint) else contact.name for contact in plan.contacts}
        across = len(loose) >= HARD_CROSSED_FROM or any(part.declaration.gap is not None for part in plan.acting)
    elif options.events == "auto":
        across = len(plan.contacts) >= CROSSED_FROM
    return CROSSES if across else ENDS


def compute(
    plan: Plan,
    options: Options,
    progress: Callable[[float], None] | None = None,
    *,
    times: np.ndarray | None = None,
    record_steps: bool = False,
    curves: bool = False,
    monitor: bool = True,
    ideal: IdealPath | None = None,
    keeper: Keeper | None = None,
) -> Trajectory:
    """Simulate a mechanism; `curves` records what `instants.with_recorded` adds to the samples."""
    driver, prepared, choice = make_driver(plan, options)
    content = driver.system.content
    still = tuple(immobile_joints(plan, full_coordinates(plan, content, prepared.y, 0.0)))
    driver.sample_at(np.linspace(0.0, options.until, options.count) if times is None else times)
    driver.monitor(monitor)
    if record_steps or curves:
        driver.record_steps(inside=curves, most=np.inf if record_steps else MOST_RECORDED)
    if ideal is not None:
        driver.compare_with(ideal.table, ideal.step)
    cause, seconds = _advance(driver, options, progress, keeper)
    ended = {"": "complete", INTERRUPTED: INTERRUPTED}.get(cause, "failed")
    if cause:
        cause = f"stopped at t = {driver.time:.9g} s of {options.until:g} s: {cause}"
    statistics = {
        "method": choice.method,
        "reason": choice.reason,
        **counted(driver.state),
        **({} if driver.stepping is None else driver.stepping.statistics(driver.time)),
        "seconds": seconds,
    }
    return reached(driver, status=ended, cause=cause, statistics=statistics, immobile=still, warnings=prepared.warnings)


def reached(driver: Driver, **more: Any) -> Trajectory:
    """What a driver has come to, with further parts of a `Trajectory`."""
    return Trajectory(
        plan=driver.plan,
        system=driver.system,
        samples=driver.samples,
        log=driver.log.copy(),
        peak=driver.peak.copy(),
        end=driver.time,
        band=driver.band.copy(),
        change_points=tuple(driver.change_points),
        recorded=driver.recorded,
        **more,
    )


def _advance(
    driver: Driver, options: Options, progress: Callable[[float], None] | None, keeper: Keeper | None
) -> tuple[str, float]:
    """Go on to the end: why it was not reached, or what is wrong there, empty if nothing is; and the seconds that it took."""
    began = clocks.perf_counter()
    if keeper is not None:
        began, progress = keeper.take_up(RUN, driver, progress)
    try:
        cause = reach(driver, options.until, options.most_steps, progress)
    except KeyboardInterrupt:
        cause = INTERRUPTED
    seconds = clocks.perf_counter() - began
    if keeper is not None and cause in ("", INTERRUPTED):
        keeper.write(RUN, driver, seconds)
    return cause or model_failure(driver), seconds


def reach(
    driver: Driver, until: float, most_steps: int, progress: Callable[[float], None] | None = None, *, since: int = 0
) -> str:
    """Go on to a time; returns why it was not reached, empty if it was. `since` steps do not count."""
    status = advance(driver, until, most_steps=most_steps - (driver.tried - since), progress=progress)
    return f"{most_steps} steps are not enough" if status == loop.ADVANCING else broken_off(status, driver)


def model_failure(driver: Driver) -> str:
    """Why the contact model of a run that has reached its end has failed; empty if it has not.

    A journal was pressed in by more than its radius, hard surfaces overlap by more than their clearance, or impulses of many
    steps are not solved.
    """
    plan, depth = driver.plan, driver.peak["largest"][driver.rows(INDENTATION)]
    for j in plan.compliant_places:
        failure = contact_failure(plan.contacts[j].name, plan.clearances[j].surfaces, float(depth[j]))
        if failure:
            return f"{FAILED}: {failure}"
    if driver.stepping is None:
        return ""
    counts = driver.stepping.counted()
    if counts["steps_not_solved"] > UNSOLVED * counts["contact_steps"]:
        return f"the impulses of {counts['steps_not_solved']} of {counts['contact_steps']} steps with contacts are not solved"
    return _overlap(driver)


def _overlap(driver: Driver) -> str:
    """Which hard surfaces overlap by more than their clearance: the step was too long; empty if none do."""
    plan = driver.plan
    assert driver.stepping is not None
    clearance = driver.system.content.parameters.contact["clearance"]
    crossed = 'events = "crossed", or ' if driver.stepping.content.parameters.locate[0] else ""
    for j, overlap in zip(plan.hard_places, driver.stepping.content.state.overlap.tolist(), strict=False):
        if not overlap <= clearance[j]:
            return (
                f"the hard surfaces of joint '{plan.contacts[j].name}' overlap by {1e3 * overlap:.3g} mm at a clearance of "
                f"{1e3 * clearance[j]:g} mm: the step of {driver.stepping.size:.3g} s is too long; type: {crossed}step = "
                f'"{0.25 * driver.stepping.size:.2g} s"'
            )
    return ""


def broken_off(status: int, driver: Driver) -> str:
    """Why the loop broke off, with the parts that are at fault; empty if it did not."""
    if status not in CAUSES:
        return ""
    plan, state = driver.plan, driver.state
    named = (
        describe_jam(plan, driver.system)
        or describe_failed_latch(plan, driver.system)
        or describe_singular_position(plan, driver.system, state.y, driver.time)
    )
    return named or f"{CAUSES[status]}{_culprit(driver)}"


def _culprit(driver: Driver) -> str:
    """Which contact is in the worst state, for the message of a failed run."""
    plan, state = driver.plan, driver.state
    if not plan.contacts:
        return ""
    clearance = driver.system.content.parameters.contact["clearance"]
    gap = guard_values(driver.system, driver.time, state.y)[: clearance.size]
    j = int(np.argmax(np.where(np.isnan(gap), np.inf, gap / clearance)))
    return f"; joint '{plan.contacts[j].name}': indentation {gap[j] * 1e3:.4g} mm at a clearance of {clearance[j] * 1e3:g} mm"


def recorded(
    plan: Plan,
    options: Options,
    path: Trajectory,
    progress: Callable[[float], None] | None = None,
    *,
    ideal: IdealPath | None = None,
) -> tuple[Trajectory, Record]:
    """A trajectory up to the first sample at which the accelerations are not defined, and what is recorded of it.

    If there is one, the run counts as failed there and is computed again up to the last sample before: events, peaks,
    deviations and integrals of what is still going on hold until there.
    """
    samples = path.samples
    state = samples.state.copy() if path.change_points else samples.state
    outputs = path.record()
    recorded_across(path.plan.maps, path.system, samples, state, outputs, path.change_points)
    undefined = np.flatnonzero(~np.all(np.isfinite(outputs.A), axis=1))
    if not undefined.size:
        return path, outputs
    first, time = int(undefined[0]), float(samples.time[undefined[0]])
    why = describe_singular_position(path.plan, path.system, samples.state[first], time) or "accelerations are not defined"
    kept = Samples(*(part[:first] for part in samples))
    last = float(kept.time[-1]) if first else 0.0
    if last > 0.0:
        cut = compute(plan, replace(options, until=last, samples=2), progress, times=kept.time, ideal=ideal)
        if cut.status == "interrupted":
            return cut, cut.record()
    else:
        cut = replace(path, samples=kept, log=path.log[:0], peak=unknown(path.peak), band=unknown(path.band))
    cut = replace(cut, end=last, status="failed", cause=f"stopped at t = {time:.9g} s: {why}")
    return cut, cut.record()
