"""Step across a change point, along the tangent and the curvature of the branch that the motion is on.

Branches of the assembly meet at a change point, and the constraints do not determine all accelerations there. The accelerations
along a smooth branch are smooth. A step from a position before the point to one beyond it follows position, velocity and
acceleration. The step is projected only beyond the point, where the branches are further apart than the error of the step.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from scissordyn.integrate.advance import HISTORY_FULL
from scissordyn.integrate.history import CHEBYSHEV_NODES, TRANSFORM
from scissordyn.integrate.integration import Samples
from scissordyn.kernel import Handle
from scissordyn.mechanics import functions
from scissordyn.mechanics.body_maps import BodyMaps
from scissordyn.mechanics.outputs import record
from scissordyn.mechanics.sample import Record
from scissordyn.plan.gradients import Gradients, least_change
from scissordyn.plan.system import guard_values, rates

if TYPE_CHECKING:
    from scissordyn.run.advance.driver import Driver

Passed = Sequence[tuple[float, float]]  # [s] time of each passed change point, and half the size of the step across it


def step_across(driver: Driver, until: float) -> bool:
    """Step across the singular position ahead; return True if the motion can continue."""
    state, near = driver.state, driver.system.content.work.near
    clock, time, ahead = state.clock, driver.time, -float(state.clock["longest"][0])
    # A velocity that changes by more than this fraction on the way to the point has no limit there: the mechanism locks.
    locking_change = 0.2
    # Smallest independence of the constraint gradients, relative to the largest gradient, at which a step is shortened further
    dependence_min = 1e-8
    n = driver.plan.coordinates.free
    before, references = state.y.copy(), state.reference.copy()
    slope, power = _project_and_differentiate(driver, time, before)
    clock["longest"], clock["prepared"] = 0.5 * ahead, 0
    model = driver.plan.model
    half_square, change = driver.system.content.work.value[:2, model.timed[model.timed_linear == 0]]  # l^2/2 and l l' of rods
    if np.any(2.0 * half_square + change * 2.0 * ahead < 0.0):  # a rod shrinks to zero length, and no motion follows the point
        near[3], clock["longest"] = np.inf, ahead
        return True
    if driver.stepping is not None and np.any(state.mode[: len(driver.plan.contacts)]):
        return _limit_step_size(driver, ahead, driver.stepping.size)
    h = min(2.0 * ahead, until - time, *driver.integration.content.work.delays.tolist())
    reached = _find_state_beyond(driver, time, h, before, slope)
    if reached is not None:
        after, longest = reached
        end_slope, end_power = _project_and_differentiate(driver, time + h, after)
    if reached is None or not _is_smooth(driver, (time, before, slope), (time + h, after, end_slope)):
        state.reference[:] = references
        if reached is None and np.max(np.abs(slope[n : 2 * n])) * ahead > locking_change * np.max(np.abs(slope[:n])):
            return False
        if near[1] > dependence_min:  # the step across is shorter nearer to the point
            return True
        if driver.stepping is not None:
            return _limit_step_size(driver, ahead, driver.stepping.size)
        near[3], clock["longest"] = time + 4.0 * ahead, ahead  # the integration method continues as it can
        return True
    ends = (before, slope), (after, end_slope)
    gain = 0.5 * h * (power + end_power)
    _write_samples(driver, time, h, ends, power, gain)
    if driver.integration.content.work.delays.size:
        _record_history(driver, time, h, ends)
    state.y[:] = after
    state.total[:] += gain
    driver.change_points.append((time + ahead, ahead))
    clock["time"], clock["longest"], clock["previous_error"] = time + h, longest, 0.0
    state.counts["steps"] += 1
    return True


def _limit_step_size(driver: Driver, ahead: float, size: float) -> bool:
    """Limit the step size of time stepping so that the singular position lies a quarter step before the end of a step.

    Impulses at closed contacts change the velocities, so no smooth step is possible. Time stepping evaluates the constraints at
    the middle and at the end of a step.
    """
    left = np.ceil(ahead / size + 0.25)
    driver.state.clock["longest"] = ahead / (left - 0.25)
    if left <= 1.0:
        driver.system.content.work.near[3] = driver.time + 4.0 * ahead
    return True


def replace_undefined(
    maps: BodyMaps, system: Handle, samples: Samples, state: np.ndarray, outputs: Record, passed: Passed
) -> None:
    """Replace the recorded values of samples on change points, where they are undefined, by their limits from both sides.

    `state` holds the samples' states before their projection. Means of two instants before and after have errors of second
    order; their difference leaves errors of fourth order.
    """
    offsets = np.array([-0.8, -0.4, 0.4, 0.8])  # [half steps] times before and after the point
    weights = np.array([-1.0, 4.0, 4.0, -1.0]) / 6.0  # weights of these times in the limit
    for instant, width in passed:
        for k in np.flatnonzero(np.abs(samples.time - instant) < 0.05 * width).tolist():
            here = Samples(*(np.repeat(part[k : k + 1], 4, axis=0) for part in samples))._replace(
                state=np.repeat(state[k : k + 1], 4, axis=0)
            )
            n = system.content.model.n
            here.time[:] += width * offsets
            here.state[:, :n] += width * offsets[:, None] * here.state[:, n : 2 * n]
            beside = record(maps, system, here)
            for name, part in outputs._asdict().items():
                if name != "length_error" and part.dtype == float:
                    part[k] = np.tensordot(weights, getattr(beside, name), 1)


def _project_and_differentiate(driver: Driver, time: float, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return rates and powers at a state, after the state is projected onto the constraints to round-off.

    Close to a change point, the error of the multipliers is that of the state divided by the square of the distance to it.
    """
    work, n = driver.system.content.work, driver.plan.coordinates.free
    constraints = [
        constraint for constraint, off in zip(driver.plan.coordinates.constraints, work.inactive, strict=True) if off == 0.0
    ]
    active = np.flatnonzero(work.inactive == 0.0)
    gradients = Gradients(n, driver.plan.coordinates.basis, constraints)
    gradients.count_turns(driver.state.reference)
    rates(driver.system, time, y)
    gradients.value[:] = work.value[0, active]
    for _ in range(2):
        full = np.append(y[:n], work.basis[0])
        rows = gradients.jacobian(full)[:, :n]
        y[:n] -= least_change(rows, gradients.residual(full))
    rows = gradients.jacobian(np.append(y[:n], work.basis[0]))
    for _ in range(2):
        y[n : 2 * n] -= least_change(rows[:, :n], rows @ np.append(y[n : 2 * n], work.basis[1]) - work.value[1, active])
    power, rows = np.zeros(driver.state.total.size), np.zeros_like(driver.state.monitored)
    slope = rates(driver.system, time, y)
    functions.monitor(time, y, driver.system.address, power, rows)
    return slope, power


def _is_smooth(driver: Driver, start: tuple[float, np.ndarray, np.ndarray], end: tuple[float, np.ndarray, np.ndarray]) -> bool:
    """Report whether accelerations hardly change over the step and no contact or end stop begins or ends in it."""
    if not driver.state.mode.size:
        return True
    n, h = driver.plan.coordinates.free, end[0] - start[0]
    change = h * np.max(np.abs(end[2][n : 2 * n] - start[2][n : 2 * n]))
    if change > 1e-4 * np.max(np.abs(start[2][:n])):
        return False
    before, after = (guard_values(driver.system, time, y) > 0.0 for time, y, _ in (start, end))
    return bool(np.all(before == after))


def _find_state_beyond(
    driver: Driver, time: float, h: float, before: np.ndarray, slope: np.ndarray
) -> tuple[np.ndarray, float] | None:
    """Return the state beyond the change point and the longest step that may follow; None if the step leaves the branch."""
    n, answer = driver.plan.coordinates.free, np.zeros(2)
    v, a = before[n : 2 * n], slope[n : 2 * n]
    after_a, after_slope = a, slope
    # a projection that moves the state further has found another branch, or none
    allowed = 0.05 * h * float(np.max(np.abs(v)))
    for _ in range(3):  # corrections of the acceleration beyond the point
        y = before + 0.5 * h * (slope + after_slope)
        y[:n] = before[:n] + h * v + h * h * (a / 3.0 + after_a / 6.0)
        predicted = y[:n].copy()
        functions.accept(time + h, y, driver.system.address, answer)
        again = y.copy()
        functions.accept(time + h, again, driver.system.address, answer)
        if not np.max(np.abs(y[:n] - predicted)) <= allowed or not np.max(np.abs(again[:n] - y[:n])) <= 1e-3 * allowed:
            return None
        y = again
        after_slope, _ = _project_and_differentiate(driver, time + h, y)
        after_a = after_slope[n : 2 * n]
        if not np.all(np.isfinite(after_slope)):
            return None
    return y, abs(float(answer[1]))


def _interpolate(u: float, h: float, start: tuple[np.ndarray, np.ndarray], end: tuple[np.ndarray, np.ndarray]) -> np.ndarray:
    """Return the state at a fraction of the step, by cubic interpolation."""
    rise = u * u * (3.0 - 2.0 * u)
    inner = u * (1.0 - u) ** 2 * h * start[1] - u * u * (1.0 - u) * h * end[1]
    return np.asarray((1.0 - rise) * start[0] + rise * end[0] + inner)


def _record_history(driver: Driver, time: float, h: float, ends: tuple[Any, Any]) -> None:
    """Record the signals over the step for delayed feedback, in the format of `integrate.history`."""
    if driver.state.history_length[0] == driver.state.history.shape[0]:
        driver.grow(HISTORY_FULL)
    signals = np.zeros_like(driver.integration.content.work.signals)
    for node, row in zip(CHEBYSHEV_NODES, signals, strict=True):
        u = 0.5 * (1.0 + float(node))
        functions.record(time + u * h, _interpolate(u, h, *ends), driver.system.address, row)
    place = int(driver.state.history_length[0])
    driver.state.history[place] = np.concatenate([[time, h], (TRANSFORM @ signals).T.ravel()])
    driver.state.history_length[0] += 1


def _write_samples(
    driver: Driver,
    time: float,
    h: float,
    ends: tuple[Any, Any],
    power: np.ndarray,
    gain: np.ndarray,
) -> None:
    state, samples, counts = driver.state, driver.integration.content.samples, driver.state.counts
    while counts["samples"][0] < samples.time.size and samples.time[counts["samples"][0]] <= time + h:
        at = int(counts["samples"][0])
        u = (samples.time[at] - time) / h
        samples.state[at] = _interpolate(u, h, *ends)
        samples.total[at] = state.total + u * h * power + u * u * (gain - h * power)
        samples.mode[at], samples.memory[at], samples.mass[at] = state.mode, state.memory, state.mass
        samples.reference[at] = state.reference
        counts["samples"] += 1
