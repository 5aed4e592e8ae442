"""The predictability horizon: the time until which a run agrees with a much more accurate one.

Motion with impacts can be chaotic; beyond the horizon a trajectory is one sample of a distribution, not a prediction.
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
from scissordyn.run.instants import sample_times, sampled_at
from scissordyn.run.trajectory import INTERRUPTED, compute, make_driver, reach

DIVERGENCE = 0.1
"""Distance of the two positions of a journal in its bearing, as a fraction of its clearance, from which on the runs have
diverged; likewise of the corner of a block across its guide."""

DIVERGENCE_BODY = 1e-2  # Distance of the two positions of a point of a body, as a fraction of the mechanism's size
REPETITION = "repetition"  # What checkpoints call the second run
SMALLEST = 1e-14  # Smallest tolerance of a second run, a few roundings

TIGHTER = 1e-3
"""Tolerances of the second run as a fraction of the first. With 0.01, which costs a fifth less, stiff runs with a loose guide
and friction parted from the second run up to 5 % late and 7 % early in a quarter of 20 cases, since a touch was passed in the
same way by both."""

PIECES = 20
"""The second run is compared after each of so many parts of the time, or fewer, and ends with that in which both have
diverged."""

STEPS_OF_A_PIECE = 20  # Steps of the first run in a part of the time at least: each part ends a step of the second

INSTANTS = 10_001
"""Instants, equally spaced, at which both runs are compared besides the ends of the steps: within a long step a journal can be
elsewhere for a while. They are the same whatever samples are asked for."""

TOO_NEAR = 0.2  # Tolerances that differ by less than this factor say nothing


Comparable = tuple[np.ndarray, np.ndarray]
"""Increasing instants [s] and the states there, shapes (nt,) and (nt, ny)."""


def compared(
    plan: Plan,
    options: Options,
    progress: Callable[[float], None] | None = None,
    *,
    ideal: IdealPath | None = None,
    keeper: Keeper | None = None,
    curves: bool = False,
) -> tuple[Trajectory, Comparable]:
    """A run, and its state at all instants at which it can be compared with another."""
    wanted = sample_times(options, curves=curves)
    every = np.union1d(wanted, np.linspace(0.0, options.until, INSTANTS))
    path = compute(plan, options, progress, times=every, record_steps=True, curves=True, ideal=ideal, keeper=keeper)
    samples, (step_ends, end_states, _) = path.samples, path.steps
    here = np.isin(samples.time, np.linspace(0.0, options.until, INSTANTS))
    times, index = np.unique(np.concatenate([step_ends, samples.time[here]]), return_index=True)
    states = np.concatenate([end_states, samples.state[here]])[index]
    return sampled_at(path, wanted), (times, states)


def predictability(
    options: Options,
    path: Trajectory,
    compared: Comparable,
    run: Run,
    progress: Callable[[float], None] | None = None,
    keeper: Keeper | None = None,
) -> dict[str, Any]:
    """Compare a run with a second one at a tighter tolerance, at the ends of the first run's steps and between them.

    Runs have diverged when the positions of a journal in its bearing differ by `DIVERGENCE` of its clearance, or those of a
    point of a body by `DIVERGENCE_BODY` of the mechanism's size. As the second run is far more accurate, their difference is
    the error of the first. Returns attributes of the run, without a time where none can be given.
    """
    rtol, atol = (max(TIGHTER * tolerance, SMALLEST) for tolerance in (options.rtol, options.atol))
    if rtol > TOO_NEAR * options.rtol or atol > TOO_NEAR * options.atol:
        return {"predictability": f"unknown: no tighter tolerance than rtol = {options.rtol:g} can be computed"}
    if run.attrs["status"] != "complete":
        return {"predictability": "unknown: the run is not complete"}
    tighter = dataclasses.replace(options, rtol=rtol, atol=atol, method=str(path.statistics["method"]))
    if (step := path.statistics.get("step", options.step)) is not None:
        tighter = dataclasses.replace(options, step=0.5 * float(step))
    agreement, until, steps = _repeated(tighter, path, compared, progress, keeper)
    if agreement == INTERRUPTED:
        cause = "interrupted while the run was repeated; the run itself is complete, and its horizon is unknown"
        return {"predictability": "unknown: interrupted while the run was repeated", "status": INTERRUPTED, "cause": cause}
    return {
        "predictability": agreement,
        "trusted_until": min(until, path.end),
        "trusted_contacts": int(np.sum(run["contact_start"].values < until)),
        # steps of both runs over those of the first, rejected ones counted
        "predictability_cost": 1.0 + steps / max(int(path.statistics["steps"]) + int(path.statistics["rejected"]), 1),
    }


def _repeated(
    options: Options,
    path: Trajectory,
    compared: Comparable,
    progress: Callable[[float], None] | None,
    keeper: Keeper | None,
) -> tuple[str, float, int]:
    """Run again piece by piece, as long as both runs agree: how far they do, until when at least, and tried steps."""
    times, states = compared
    driver, _, _ = make_driver(path.plan, options)
    driver.monitor(False)
    driver.sample_at(times)
    began = clocks.perf_counter()
    if keeper is not None:
        began, progress = keeper.take_up(REPETITION, driver, progress)
    seen, pieces = 0, max(1, min(PIECES, int(path.statistics["steps"]) // STEPS_OF_A_PIECE))
    try:
        for until in np.linspace(0.0, options.until, pieces + 1)[1:].tolist():
            # one from a checkpoint may be beyond already
            cause = reach(driver, until, options.most_steps, progress) if until > driver.time else ""
            again = driver.samples.state
            new = slice(seen, len(again))
            beyond = np.flatnonzero(~(_apart(path, times[new], states[new], again[new]) < 1.0))
            if beyond.size:
                return "diverged", float(times[new][beyond[0]]), driver.tried
            if cause:
                return f"unknown: the more accurate run ended there ({cause})", driver.time, driver.tried
            seen = len(again)
    except KeyboardInterrupt:
        if keeper is not None:
            keeper.write(REPETITION, driver, clocks.perf_counter() - began)
        return INTERRUPTED, driver.time, driver.tried
    return "to the end", math.inf, driver.tried


def _apart(path: Trajectory, times: np.ndarray, first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Largest distance of two trajectories at some instants, in units of what counts as divergence, shape (nt,)."""
    plan, system, n = path.plan, path.system.content, path.plan.coordinates.free
    difference = np.zeros((times.size, n + plan.coordinates.basis))  # the drives are the same in both
    difference[:, :n] = first[:, :n] - second[:, :n]
    vectors = [plan.coordinates.place((body.name, point)) for body in plan.bodies for point in body.points]
    vectors += [plan.coordinates.at(body.name, body.centre) for body in plan.bodies]
    limits = np.full(len(vectors), DIVERGENCE_BODY * plan.coordinates.size)
    clearance, journals = system.parameters.contact["clearance"], len(plan.mechanism.clearance_joints)
    vectors += [plan.eccentricity(j) for j in range(journals)]
    limits = np.append(limits, DIVERGENCE * clearance[:journals])
    apart = np.zeros(times.size)
    for vector, limit in zip(vectors, limits, strict=True):
        moved = vector.at(difference)
        apart = np.maximum(apart, np.hypot(moved[:, 0], moved[:, 1]) / limit)
    if plan.mechanism.contact_points:
        points = slice(journals, clearance.size)
        for k, time in enumerate(times.tolist()):
            ours, theirs = (guard_values(path.system, time, states[k])[points] for states in (first, second))
            apart[k] = max(apart[k], np.max(np.abs(ours - theirs) / (DIVERGENCE * clearance[points])))
    return apart
