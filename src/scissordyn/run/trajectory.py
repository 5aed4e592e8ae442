"""Trajectories: samples and events of a mechanism, from its start to its end."""

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
from scissordyn.mechanics.sample import Record
from scissordyn.model.clearance import ContactPoint
from scissordyn.model.options import Options
from scissordyn.plan.plan import Plan
from scissordyn.plan.system import guard_values, make_system
from scissordyn.record.trajectory import Trajectory, nan_like
from scissordyn.run.advance.change_point import replace_undefined
from scissordyn.run.advance.checkpoint import Keeper
from scissordyn.run.advance.driver import Choice, Driver, count_steps
from scissordyn.run.advance.loop import advance
from scissordyn.run.advance.tolerance import error_weights
from scissordyn.run.instants import SAMPLES_MAX
from scissordyn.run.method import choose_method

if TYPE_CHECKING:
    from scissordyn.record.ideal_path import IdealPath


RECORDED_STEPS_MAX = 2 * SAMPLES_MAX  # largest number of recorded time steps; at this number, every second one is dropped
RUN_PART = "run"  # name, in a checkpoint, of the run itself

MODEL_FAILED = "the contact model has failed"  # first words of the cause of a failed run whose contact model failed

INTERRUPTED = "interrupted"  # status of an interrupted run, and the cause of its end

# causes of a failed run, by the final status of the time loop
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
    *,
    loads: bool = False,
) -> tuple[Driver, Prepared, Choice]:
    """Return a driver at the start of a run; it uses the arrays of `driver` if that has the same method."""
    system = make_system(plan) if system is None else system
    prepared = prepare_start(plan, system, options.start)
    y = perturb(prepared.y)
    tolerances = error_weights(plan, system, y, rtol=options.rtol, atol=options.position_tolerance)
    choice = choose_method(plan, system, y, options, tolerances)
    if driver is None or driver.method != choice.method:
        driver = Driver(plan, system, y.size, choice, tolerances, loads=loads)
    driver.begin(plan, y, choice, tolerances, choose_crossing(plan, options), prepared.initial_events)
    return driver, prepared, choice


def choose_crossing(plan: Plan, options: Options, joints: int = 6, hard_joints: int = 3) -> int:
    """Return how steps treat the onset and release of contacts: end there (`ENDS`), or one of `CROSSES` and `IGNORES`.

    `joints`: [clearance joints] smallest number for which steps cross onsets and releases.

    `hard_joints`: [clearance joints] smallest number with hard contacts for which steps cross onsets and releases. Located
    impacts would follow each other ever faster, since each one pushes other joints into contact.
    """
    if options.step is not None and not plan.hard_places:
        return IGNORES
    across = options.events == "crossed"
    if options.events == "auto" and plan.hard_places:
        loose = {contact.guide if isinstance(contact, ContactPoint) else contact.name for contact in plan.contacts}
        across = len(loose) >= hard_joints or any(part.declaration.gap is not None for part in plan.acting)
    elif options.events == "auto":
        across = len(plan.contacts) >= joints
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
    """Simulate a mechanism; `curves` records the instants that `instants.add_recorded_samples` adds."""
    driver, prepared, choice = make_driver(plan, options)
    driver.sample_at(np.linspace(0.0, options.until, options.count) if times is None else times)
    driver.monitor(monitor)
    if record_steps or curves:
        driver.record_steps(inside=curves, most=np.inf if record_steps else RECORDED_STEPS_MAX)
    if ideal is not None:
        driver.compare_with(ideal.table, ideal.step)
    cause, seconds = _advance(driver, options, progress, keeper)
    ended = {"": "complete", INTERRUPTED: INTERRUPTED}.get(cause, "failed")
    if cause:
        cause = f"stopped at t = {driver.time:.9g} s of {options.until:g} s: {cause}"
    statistics = {
        "method": choice.method,
        "reason": choice.reason,
        **count_steps(driver.state),
        **({} if driver.stepping is None else driver.stepping.statistics(driver.time)),
        "seconds": seconds,
    }
    return current_trajectory(
        driver, status=ended, cause=cause, statistics=statistics, start=prepared.y, warnings=prepared.warnings
    )


def immobile_at_start(path: Trajectory) -> list[str]:
    """Return the names of clearance joints that cannot move at the start of a run."""
    assert path.start is not None
    return immobile_joints(path.plan, full_coordinates(path.plan, path.system.content, path.start, 0.0))


def current_trajectory(driver: Driver, **more: Any) -> Trajectory:
    """Return the trajectory that a driver has computed so far; `more` are further fields of `Trajectory`."""
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
    """Advance to the end; return the cause of a failure or interruption ("" if none) and the computing time [s]."""
    began = clocks.perf_counter()
    if keeper is not None:
        began, progress = keeper.restore(RUN_PART, driver, progress)
    try:
        cause = advance_to(driver, options.until, options.most_steps, progress)
    except KeyboardInterrupt:
        cause = INTERRUPTED
    seconds = clocks.perf_counter() - began
    if keeper is not None and cause in ("", INTERRUPTED):
        keeper.write(RUN_PART, driver, seconds)
    return cause or model_failure(driver), seconds


def advance_to(
    driver: Driver, until: float, most_steps: int, progress: Callable[[float], None] | None = None, *, since: int = 0
) -> str:
    """Advance to a time; return the cause if it is not reached, else "". The first `since` steps do not count."""
    status = advance(driver, until, most_steps=most_steps - (driver.steps_tried - since), progress=progress)
    return f"{most_steps} steps are not enough" if status == loop.ADVANCING else describe_stop(status, driver)


def model_failure(driver: Driver) -> str:
    """Return why the contact model of a completed run has failed, or "" if it has not.

    It has failed if a journal was pressed in by more than its radius, hard surfaces overlap by more than their clearance, or
    the impulses of many steps are not solved.
    """
    plan, depth = driver.plan, driver.peak["largest"][driver.rows(INDENTATION)]
    for j in plan.compliant_places:
        failure = contact_failure(plan.contacts[j].name, plan.clearances[j].surfaces, float(depth[j]))
        if failure:
            return f"{MODEL_FAILED}: {failure}"
    if driver.stepping is None:
        return ""
    counts = driver.stepping.counters()
    if counts["steps_not_solved"] > 0.01 * counts["contact_steps"]:
        return f"the impulses of {counts['steps_not_solved']} of {counts['contact_steps']} steps with contacts are not solved"
    return _describe_overlap(driver)


def _describe_overlap(driver: Driver) -> str:
    """Return a message about hard surfaces that overlap by more than their clearance because the step is too long, or ""."""
    plan = driver.plan
    assert driver.stepping is not None
    clearance = driver.system.content.parameters.contact["clearance"]
    crossed = 'events = "crossed", or ' if driver.stepping.content.parameters.locate[0] else ""
    for j, overlap in zip(plan.hard_places, driver.stepping.content.state.overlap.tolist(), strict=False):
        if not overlap <= clearance[j]:
            return (
                f"the hard surfaces of joint '{plan.contacts[j].name}' overlap by {1e3 * overlap:.3g} mm at a clearance of "
                f"{1e3 * clearance[j]:g} mm: the step of {driver.stepping.size:.3g} s is too long; for example {crossed}step = "
                f'"{0.25 * driver.stepping.size:.2g} s"'
            )
    return ""


def describe_stop(status: int, driver: Driver) -> str:
    """Return why the time loop stopped early, with the parts at fault, or "" if it did not."""
    if status not in CAUSES:
        return ""
    plan, state = driver.plan, driver.state
    named = (
        describe_jam(plan, driver.system)
        or describe_failed_latch(plan, driver.system)
        or describe_singular_position(plan, driver.system, state.y, driver.time)
    )
    return named or f"{CAUSES[status]}{_describe_worst_contact(driver)}"


def _describe_worst_contact(driver: Driver) -> str:
    """Name the contact with the largest indentation relative to its clearance, for the message of a failed run."""
    plan, state = driver.plan, driver.state
    if not plan.contacts:
        return ""
    clearance = driver.system.content.parameters.contact["clearance"]
    gap = guard_values(driver.system, driver.time, state.y)[: clearance.size]
    j = int(np.argmax(np.where(np.isnan(gap), np.inf, gap / clearance)))
    return f"; joint '{plan.contacts[j].name}': indentation {gap[j] * 1e3:.4g} mm at a clearance of {clearance[j] * 1e3:g} mm"


def record_trajectory(
    plan: Plan,
    options: Options,
    path: Trajectory,
    progress: Callable[[float], None] | None = None,
    *,
    ideal: IdealPath | None = None,
) -> tuple[Trajectory, Record]:
    """Return a trajectory up to the first sample with undefined accelerations, and its record.

    If there is such a sample, the run has failed there. It is computed again up to the sample before, so that events, peaks,
    deviations and integrals end there.
    """
    samples = path.samples
    state = samples.state.copy() if path.change_points else samples.state
    outputs = path.record()
    replace_undefined(path.plan.maps, path.system, samples, state, outputs, path.change_points)
    finite = np.isfinite(outputs.A)
    if finite.all():
        return path, outputs
    first = int(np.argmin(finite.all(axis=1)))
    time = float(samples.time[first])
    reason = describe_singular_position(path.plan, path.system, samples.state[first], time) or "accelerations are not defined"
    valid = Samples(*(part[:first] for part in samples))
    last = float(valid.time[-1]) if first else 0.0
    if last > 0.0:
        cut = compute(plan, replace(options, until=last, samples=2), progress, times=valid.time, ideal=ideal)
        if cut.status == "interrupted":
            return cut, cut.record()
    else:
        cut = replace(path, samples=valid, log=path.log[:0], peak=nan_like(path.peak), band=nan_like(path.band))
    cut = replace(cut, end=last, status="failed", cause=f"stopped at t = {time:.9g} s: {reason}")
    return cut, cut.record()
