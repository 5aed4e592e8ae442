"""Error of worn depths: scatter of the wear from cycle to cycle, and loads that change during a step of many cycles."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.special import stdtrit

from scissordyn.tolerance import CONFIDENCE_LEVEL


class Scatter(NamedTuple):
    """Random variation of a value that is measured in some cycles, the members, of several simulated states."""

    single: float  # variance of one cycle
    mean: float  # variance of the mean over the members of a state
    factor: float  # half width of the 95 % interval over the standard deviation, by Student's t distribution


class DepthError(NamedTuple):
    """Error of the largest depth of worn bearings."""

    error: np.ndarray  # (states, joints) half the 95 % interval [m]
    scatter: np.ndarray  # (joints,) relative standard deviation of the depth that one cycle wears; NaN if it is not known
    drift: np.ndarray  # (joints,) relative change of the wear from the first member to the last; 0 if it is not significant


def scatter(cycles: np.ndarray, values: np.ndarray) -> Scatter:
    """Return the scatter of a value of shape (states, two or more members), pooled over the states at some `cycles`.

    Members that follow one another may be alike, and vary more from state to state than among themselves. The mean of a state
    therefore has the larger one of two variances: that of the members over their number, and that of the deviation from the
    line through both neighbours, which no linear trend increases.
    """
    states, members = values.shape
    within, between, degrees = float(values.var(axis=1, ddof=1).mean()), 0.0, 1.0
    if states > 2:
        share = (cycles[2:] - cycles[1:-1]) / (cycles[2:] - cycles[:-2])
        lines = np.zeros((states - 2, states))
        for s, part in enumerate(share.tolist()):
            lines[s, s : s + 3] = np.array([-part, 1.0, part - 1.0]) / np.sqrt(1.0 + part**2 + (1.0 - part) ** 2)
        between = float(np.mean((lines @ values.mean(axis=1)) ** 2))
        squares = lines.T @ lines
        degrees = float(np.trace(squares) ** 2 / np.sum(squares**2))  # Satterthwaite 1946
    if within / members >= between:
        return Scatter(within, within / members, _factor(states * (members - 1)))
    return Scatter(between * members, between, _factor(degrees))


def _factor(degrees: float) -> float:
    return float(stdtrit(max(degrees, 1.0), 0.5 + 0.5 * CONFIDENCE_LEVEL))


def mean_error(values: np.ndarray) -> np.ndarray:
    """Return half the 95 % interval of the mean of each state, NaN for one member; values have the shape (states, members)."""
    states, members = values.shape
    if members < 2:
        return np.full(states, np.nan)
    return np.full(states, _factor(states * (members - 1)) * np.sqrt(values.var(axis=1, ddof=1).mean() / members))


def significant_drift(energy: np.ndarray, joints: int) -> float:
    """Return the change from the first to the last of successive cycles, relative to their mean; 0 if it may be chance.

    `energy` has the shape (states, members). The level of confidence is that of all joints together (Bonferroni).
    """
    states = len(energy)
    if states < 3 or not energy.any():
        return 0.0
    change = (energy[:, -1] - energy[:, 0]) / energy.mean()
    limit = stdtrit(states - 1, 1.0 - 0.5 * (1.0 - CONFIDENCE_LEVEL) / joints) * change.std(ddof=1) / np.sqrt(states)
    return float(change.mean()) if abs(change.mean()) > limit else 0.0


def depth_errors(
    cycles: np.ndarray, depths: np.ndarray, rates: np.ndarray, energy: np.ndarray, corrections: np.ndarray
) -> DepthError:
    """Return the error of the largest depth of each joint after each state; NaN for a single member.

    Parameters
    ----------
    cycles : array, shape (states,)
    depths : array, shape (states, joints, angles)
        Contours [m].
    rates : array, shape (states, members, joints, angles)
        Depth that each simulated cycle wears [m].
    energy : array, shape (states, members, joints, directions)
        Loads of each simulated cycle [J].
    corrections : array, shape (states, joints, angles)
        Depths minus those of loads that are constant over each step [m].
    """
    joints = depths.shape[1]
    if rates.shape[1] < 2:
        return DepthError(np.full(depths.shape[:2], np.nan), np.full(joints, np.nan), np.zeros(joints))
    drift = np.array([significant_drift(energy[:, :, j].sum(axis=-1), joints) for j in range(joints)])
    largest, steps = depths.max(axis=-1), np.diff(cycles)[:, None]
    errors, scatters = np.take_along_axis(np.abs(corrections), depths.argmax(axis=-1)[..., None], axis=-1)[..., 0], []
    deepened = np.diff(largest, axis=0)  # (steps, joints)
    ends = np.pad(deepened, ((1, 1), (0, 0)))
    weights = 0.5 * (ends[1:] + ends[:-1])  # depth for which the loads of each state count
    for j in range(joints):
        total = energy[:, :, j].sum(axis=-1)
        local = rates[:, :, j, int(np.argmax(depths[-1, j]))]  # directions vary, so that it scatters more than the volume
        total_share, local_share = (
            np.divide(part, part.mean(), out=np.zeros_like(part), where=part > 0.0) for part in (total, local)
        )
        cycle_scatter, within = scatter(cycles, total_share), float(total_share.var(axis=1, ddof=1).mean())
        ratio = max(1.0, float(local_share.var(axis=1, ddof=1).mean()) / within) if within > 0.0 else 1.0
        cycle_scatter = cycle_scatter._replace(single=cycle_scatter.single * ratio, mean=cycle_scatter.mean * ratio)
        scatters.append(np.sqrt(cycle_scatter.single))
        for s in range(1, len(cycles)):
            inner = np.array([*weights[:s, j], 0.5 * deepened[s - 1, j]])
            variance = cycle_scatter.mean * np.sum(inner**2) + cycle_scatter.single * np.sum(
                deepened[:s, j] ** 2 / steps[:s, 0]
            )
            errors[s, j] += cycle_scatter.factor * np.sqrt(variance) + abs(drift[j]) * (largest[s, j] - largest[0, j])
    return DepthError(errors, np.array(scatters), drift)
