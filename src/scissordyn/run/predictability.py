"""Predictability horizon: the time until which a run agrees with a second run at a much tighter tolerance.

Motion with impacts can be chaotic. Beyond the horizon a trajectory is one sample of a distribution, not a prediction.
"""

from __future__ import annotations

import dataclasses
import math
import time as clocks
from collections.abc import Callable
from typing import Any

import numpy as np

from scissordyn.model.options import Options
from scissordyn.plan.plan import Plan
from scissordyn.plan.system import guard_values
from scissordyn.record.ideal_path import IdealPath
from scissordyn.record.results import Run
from scissordyn.record.trajectory import Trajectory
from scissordyn.run.advance.checkpoint import Keeper
from scissordyn.run.instants import sample_times, select_samples
from scissordyn.run.stops import stops
from scissordyn.run.trajectory import INTERRUPTED, compute, make_driver

JOURNAL_DIVERGENCE = 0.1
"""Distance between the journals of two runs from which the runs count as diverged [clearances].

In a guide, the distance is that of a block's corner across the guide.
"""

BODY_DIVERGENCE = 1e-2
"""Distance between a body's points in two runs from which the runs count as diverged [mechanism sizes]."""
REPETITION = "repetition"  # name, in a checkpoint, of the second run, which shows the predictability horizon

COMPARED_INSTANTS = 10_001
"""Number of equally spaced instants at which a run and its repetition are compared, in addition to the ends of the steps.

A journal can move away and back within a long step. The number does not depend on the requested samples.
"""


Comparable = tuple[np.ndarray, np.ndarray]
"""Increasing times [s] and the states at these times, shapes (nt,) and (nt, ny)."""


def compute_comparable(
    plan: Plan,
    options: Options,
    progress: Callable[[float], None] | None = None,
    *,
    ideal: IdealPath | None = None,
    keeper: Keeper | None = None,
    curves: bool = False,
) -> tuple[Trajectory, Comparable]:
    """Compute a run and its states at all times at which it can be compared with another run."""
    requested_times = sample_times(options, curves=curves)
    all_times = np.union1d(requested_times, np.linspace(0.0, options.until, COMPARED_INSTANTS))
    path = compute(plan, options, progress, times=all_times, record_steps=True, curves=True, ideal=ideal, keeper=keeper)
    samples, (step_ends, end_states, _) = path.samples, path.steps
    is_compared = np.isin(samples.time, np.linspace(0.0, options.until, COMPARED_INSTANTS))
    times, index = np.unique(np.concatenate([step_ends, samples.time[is_compared]]), return_index=True)
    states = np.concatenate([end_states, samples.state[is_compared]])[index]
    return select_samples(path, requested_times), (times, states)


def predictability(
    options: Options,
    path: Trajectory,
    compared: Comparable,
    run: Run,
    progress: Callable[[float], None] | None = None,
    keeper: Keeper | None = None,
    factor: float = 1e-3,
) -> dict[str, Any]:
    """Compare a run with a second run at a tighter tolerance, at the ends of the first run's steps and between them.

    Runs have diverged if the positions of a journal relative to its bearing differ by `JOURNAL_DIVERGENCE` of its clearance, or
    the positions of a point of a body by `BODY_DIVERGENCE` of the mechanism's size. The second run is far more accurate, so
    their difference is the error of the first. Return attributes of the run; no time is given if the horizon is unknown.

    `factor`: tolerances of the second run divided by those of the first run.  With 0.01, which costs a fifth less, a quarter of
    20 stiff runs with a loose guide and friction diverged up to 5 % late or 7 % early, since both runs passed a contact in the
    same way.
    """
    # at least a few roundings; two runs whose tolerances differ by less than a factor of five cannot be compared
    rtol, atol = (max(factor * tolerance, 1e-14) for tolerance in (options.rtol, options.position_tolerance))
    if rtol > 0.2 * options.rtol or atol > 0.2 * options.position_tolerance:
        return {"predictability": f"unknown: no tighter tolerance than rtol = {options.rtol:g} can be computed"}
    if run.attrs["status"] != "complete":
        return {"predictability": "unknown: the run is not complete"}
    tighter = dataclasses.replace(options, rtol=rtol, atol=atol, method=str(path.statistics["method"]))
    if (step := path.statistics.get("step", options.step)) is not None:
        tighter = dataclasses.replace(options, step=0.5 * float(step))
    agreement, until, steps = _repeat_run(tighter, path, compared, progress, keeper)
    if agreement == INTERRUPTED:
        cause = "interrupted while the run was repeated; the run itself is complete, and its horizon is unknown"
        return {"predictability": "unknown: interrupted while the run was repeated", "status": INTERRUPTED, "cause": cause}
    return {
        "predictability": agreement,
        "trusted_until": min(until, path.end),
        "trusted_contacts": int(np.sum(run["contact_start"].values < until)),
        # steps of both runs divided by those of the first run, rejected steps included
        "predictability_cost": 1.0 + steps / max(int(path.statistics["steps"]) + int(path.statistics["rejected"]), 1),
    }


def agreement_end(options: Options, path: Trajectory, compared: Comparable, factor: float = 100.0) -> float:
    """Return the last compared time before a run and a run at a looser tolerance diverge, or infinity [s].

    Their difference is about the error of the looser run, so that the horizon of the first run is usually later. The second run
    ends at the divergence or at the last compared time. Its step of time stepping is half that of the first run. It has a
    tighter tolerance instead of a looser one that exceeds the bounds of `Options`.

    `factor`: tolerances of the second run divided by those of the first run. With 100, horizons of chaotic cranks are seldom
    later than that of `predictability` (docs/decisions/measured/gradient_horizon.md).
    """
    times = compared[0]
    if factor * max(options.rtol, options.position_tolerance) > 1e-2:
        factor = 1.0 / factor
    rtol, atol = (max(factor * tolerance, 1e-14) for tolerance in (options.rtol, options.position_tolerance))
    other = dataclasses.replace(options, until=float(times[-1]), rtol=rtol, atol=atol)
    if (step := path.statistics.get("step", options.step)) is not None:
        other = dataclasses.replace(other, step=0.5 * float(step))
    agreement, until, _ = _repeat_run(other, path, compared, None, None)
    if agreement == INTERRUPTED:
        raise KeyboardInterrupt
    return until if until == math.inf else float(times[max(int(np.searchsorted(times, until)) - 1, 0)])


def _repeat_run(
    options: Options,
    path: Trajectory,
    compared: Comparable,
    progress: Callable[[float], None] | None,
    keeper: Keeper | None,
) -> tuple[str, float, int]:
    """Repeat a run at another tolerance, piece by piece, until both differ by more than the limits of divergence.

    Return how far both agree ("diverged", "to the end", ...), the time of divergence [s], and the number of steps tried.
    """
    times, states = compared
    driver, _, _ = make_driver(path.plan, options)
    driver.monitor(False)
    driver.sample_at(times)
    start = clocks.perf_counter()
    if keeper is not None:
        start, progress = keeper.restore(REPETITION, driver, progress)
    # at most 20 pieces of at least 20 steps, since each piece ends a step of the second run
    compared_count, pieces = 0, max(1, min(20, int(path.statistics["steps"]) // 20))
    try:
        ends = np.linspace(0.0, options.until, pieces + 1)[1:].tolist()
        for stop in stops(driver, ends, options.most_steps, resets=False, progress=progress):
            repeated_states = driver.samples.state
            new = slice(compared_count, len(repeated_states))
            diverged = np.flatnonzero(~(_relative_distance(path, times[new], states[new], repeated_states[new]) < 1.0))
            if diverged.size:
                return "diverged", float(times[new][diverged[0]]), driver.steps_tried
            if stop.cause:
                return f"unknown: the more accurate run ended early ({stop.cause})", driver.time, driver.steps_tried
            compared_count = len(repeated_states)
    except KeyboardInterrupt:
        if keeper is not None:
            keeper.write(REPETITION, driver, clocks.perf_counter() - start)
        return INTERRUPTED, driver.time, driver.steps_tried
    return "to the end", math.inf, driver.steps_tried


def _relative_distance(path: Trajectory, times: np.ndarray, first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Return the distance between two trajectories at each time, shape (nt,), as a multiple of the limits of divergence.

    The limits are `JOURNAL_DIVERGENCE` for journals in their bearings, `BODY_DIVERGENCE` for points of bodies.
    """
    plan, system, n = path.plan, path.system.content, path.plan.coordinates.free
    difference = np.zeros((times.size, n + plan.coordinates.basis))  # both runs have the same drives
    difference[:, :n] = first[:, :n] - second[:, :n]
    vectors = [plan.coordinates.place((body.name, point)) for body in plan.bodies for point in body.points]
    vectors += [plan.coordinates.at(body.name, body.centre) for body in plan.bodies]
    limits = np.full(len(vectors), BODY_DIVERGENCE * plan.coordinates.size)
    clearance, journals = system.parameters.contact["clearance"], len(plan.mechanism.clearance_joints)
    vectors += [plan.eccentricity(j) for j in range(journals)]
    limits = np.append(limits, JOURNAL_DIVERGENCE * clearance[:journals])
    distance = np.zeros(times.size)
    for vector, limit in zip(vectors, limits, strict=True):
        moved = vector.at(difference)
        distance = np.maximum(distance, np.hypot(moved[:, 0], moved[:, 1]) / limit)
    if plan.mechanism.contact_points:
        points = slice(journals, clearance.size)
        for k, time in enumerate(times.tolist()):
            ours, theirs = (guard_values(path.system, time, states[k])[points] for states in (first, second))
            distance[k] = max(distance[k], np.max(np.abs(ours - theirs) / (JOURNAL_DIVERGENCE * clearance[points])))
    return distance
