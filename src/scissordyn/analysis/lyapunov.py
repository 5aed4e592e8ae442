"""Largest Lyapunov exponent of maps and flows given as Python functions, from the growth of a perturbation."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike
from scipy.integrate import solve_ivp

from scissordyn.analysis.variable import described
from scissordyn.errors import InputError, ScissordynError, whole_number

START_DISTANCE = 1e-8
"""Distance of two trajectories after rescaling; the square root of round-off balances round-off and nonlinearity."""

Advance = Callable[[int, np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]
"""Function of interval, state and tangent (or offset) that returns state and tangent at the interval's end."""


def exponent_from_growth(
    log_growth: ArrayLike, durations: ArrayLike, *, discard: int = 0, blocks: int = 20, unit: str = "1/s"
) -> xr.Dataset:
    """Compute the exponent from the growth of a perturbation that is rescaled to its initial size after every interval.

        lambda = sum ln(d_k / d_0) / sum T_k

    The standard error is that of the mean rate of blocks, assumed independent. It is too large for blocks shorter than a
    rotation of the perturbation, because growth in one block and decay in the next compensate. It is too small for blocks
    shorter than the correlation time of the motion. It does not include rare events later in the motion.

    Parameters
    ----------
    log_growth : array_like, shape (intervals,) or (intervals, members)
        ln(d_k / d_0), for one trajectory or for each of an ensemble.
    durations : array_like, shape (intervals,) or ()
        T_k [s], or 1 for a map.
    discard : int
        Intervals at the start, in which the perturbation aligns with the most unstable direction.
    blocks : int
        Number of blocks; an ensemble has at least one per member.
    unit : str
        Unit of the exponent: "1/s", or "1" per step of a map.

    Returns
    -------
    Dataset
        `running`, the estimate after each interval, with `time` along `interval`; `exponent`; `standard_error` (NaN with fewer
        than two blocks); `member_exponent` along `member`.

    Raises
    ------
    InputError
        If shapes do not fit, a duration is not positive, a growth is NaN, or no interval is left.

    References
    ----------
    Benettin, Galgani, Giorgilli and Strelcyn 1980, doi:10.1007/BF02128236
    """
    growth = np.asarray(log_growth, float)
    growth = growth[:, None] if growth.ndim == 1 else growth
    duration = np.broadcast_to(np.asarray(durations, float), growth.shape[:1])
    if growth.ndim != 2 or np.any(np.isnan(growth)) or not np.all(duration > 0.0) or blocks < 1:
        raise InputError(
            f"log_growth of shape {growth.shape}, durations of shape {np.shape(durations)}, blocks = {blocks!r}",
            "numbers per interval, or per interval and member; durations > 0; blocks >= 1",
        )
    if not 0 <= discard < growth.shape[0]:
        raise InputError(
            f"discard = {discard!r} of {growth.shape[0]} intervals", "a whole number >= 0, less than the intervals"
        )
    growth, duration = growth[discard:], duration[discard:]
    elapsed = np.cumsum(duration)
    size = min(math.ceil(blocks / growth.shape[1]), growth.shape[0])
    cut = np.array_split(np.arange(growth.shape[0]), size)
    rates = np.concatenate([np.sum(growth[part], axis=0) / np.sum(duration[part]) for part in cut])
    error = float(np.std(rates, ddof=1) / math.sqrt(rates.size)) if rates.size > 1 else math.nan
    members = np.sum(growth, axis=0) / elapsed[-1]
    running = np.cumsum(np.mean(growth, axis=1)) / elapsed
    return xr.Dataset(
        {
            "running": described(("interval",), running, unit, "largest Lyapunov exponent so far"),
            "exponent": described((), running[-1], unit, "largest Lyapunov exponent"),
            "standard_error": described((), error, unit, "standard error of the exponent"),
            "member_exponent": described(("member",), members, unit, "largest Lyapunov exponent of one trajectory"),
        },
        coords={"time": described(("interval",), elapsed, "s" if unit == "1/s" else "1", "time since the discarded intervals")},
        attrs={"discard": discard, "blocks": rates.size},
    )


def largest_exponent_map(
    step: Callable[[np.ndarray], np.ndarray],
    jacobian: Callable[[np.ndarray], np.ndarray] | None,
    start: ArrayLike,
    *,
    steps: int,
    discard: int = 100,
    offset: float = START_DISTANCE,
    blocks: int = 20,
) -> xr.Dataset:
    """Compute the largest Lyapunov exponent of a map x -> f(x), per step.

    With a Jacobian the tangent map v -> f'(x) v is iterated. Without one, a second trajectory is rescaled to the distance
    `offset` from the first after every step (Benettin et al. 1980).

    Parameters
    ----------
    step : callable
        Function f, from an array of the shape of `start` to another one.
    jacobian : callable or None
        Function f', which returns shape (n, n) or (n, n, members).
    start : array_like, shape (n,) or (n, members)
        Initial state, or columns for several initial states.
    steps : int
        Number of steps, including discarded ones.
    discard : int
        Number of steps at the start that are left out.
    offset : float
        Distance of the second trajectory, in the unit of the state.
    blocks : int
        Number of blocks for the standard error.

    Returns
    -------
    Dataset
        Same variables as `exponent_from_growth`.

    Raises
    ------
    InputError
        If an option is out of bounds.
    """

    def forward(_: int, x: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        if jacobian is not None:
            return np.asarray(step(x), float), _apply(jacobian(x), v)
        after = np.asarray(step(x), float)
        return after, np.asarray(step(x + v), float) - after

    size = 1.0 if jacobian is not None else offset
    growth = _log_growth(forward, _initial_state(start), size, steps)
    return exponent_from_growth(growth, 1.0, discard=discard, blocks=blocks, unit="1")


def largest_exponent(
    rate: Callable[[float, np.ndarray], np.ndarray],
    start: ArrayLike,
    *,
    interval: float,
    intervals: int,
    jacobian: Callable[[float, np.ndarray], np.ndarray] | None = None,
    discard: int = 10,
    offset: float = START_DISTANCE,
    blocks: int = 20,
    rtol: float = 1e-9,
    atol: float = 1e-12,
) -> xr.Dataset:
    """Compute the largest Lyapunov exponent of a flow x' = f(t, x) [1/s].

    With a Jacobian the variational equation v' = f'(t, x) v is integrated together with the motion. Without one, a second
    trajectory is rescaled to the distance `offset` from the first after every interval (Benettin et al. 1980). Both are
    integrated together, the second one as v = (y - x)/offset: they share their steps, and the tolerance holds for their
    difference.

    Parameters
    ----------
    rate : callable
        Function f(t, x), from an array of the shape of `start` to another one.
    start : array_like, shape (n,) or (n, members)
        Initial state, or columns for several initial states.
    interval : float
        Time between two renormalisations [s]; the perturbation must stay small during it.
    intervals : int
        Number of intervals, including discarded ones.
    jacobian : callable, optional
        Function f'(t, x), which returns shape (n, n) or (n, n, members).
    discard : int
        Number of intervals at the start that are left out.
    offset : float
        Distance of the second trajectory, in the unit of the state.
    blocks : int
        Number of blocks for the standard error.
    rtol, atol : float
        Tolerances of scipy's DOP853 for the state and the perturbation, which has length 1 at the start of an interval.

    Returns
    -------
    Dataset
        Same variables as `exponent_from_growth`.

    Raises
    ------
    InputError
        If an option is out of bounds.
    ScissordynError
        If the integration fails.
    """
    if not (math.isfinite(interval) and interval > 0.0):
        raise InputError(f"interval = {interval!r}", "a number > 0 [s]")
    first = _initial_state(start)

    def together(time: float, packed: np.ndarray) -> np.ndarray:
        x, v = packed.reshape(2, *first.shape)
        slope = np.asarray(rate(time, x), float)
        turned = _apply(jacobian(time, x), v) if jacobian is not None else (rate(time, x + offset * v) - slope) / offset
        return np.concatenate([slope.ravel(), turned.ravel()])

    def forward(k: int, x: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        span = k * interval, (k + 1) * interval
        solution = solve_ivp(together, span, np.concatenate([x.ravel(), v.ravel()]), method="DOP853", rtol=rtol, atol=atol)
        if not solution.success:
            raise ScissordynError(f"no step possible at t = {solution.t[-1]:g} s: {solution.message}")
        return tuple(solution.y[:, -1].reshape(2, *first.shape))

    growth = _log_growth(forward, first, 1.0, intervals)
    return exponent_from_growth(growth, interval, discard=discard, blocks=blocks)


def _initial_state(start: ArrayLike) -> np.ndarray:
    """Return a checked initial state as an array."""
    state = np.asarray(start, float)
    if state.ndim not in (1, 2) or state.size == 0 or not np.all(np.isfinite(state)):
        raise InputError(f"start of shape {state.shape}", "finite numbers of shape (n,) or (n, members)")
    return state


def _log_growth(forward: Advance, start: np.ndarray, size: float, intervals: int) -> np.ndarray:
    """Return the logarithm of the growth in every interval and member; the perturbation is rescaled to `size` each time."""
    whole_number("intervals", intervals)
    if not size > 0.0:
        raise InputError(f"offset = {size:g}", "a number > 0")
    x, v = start, np.full(start.shape, size / math.sqrt(start.shape[0]))
    growth = np.empty((intervals, *start.shape[1:]))
    for k in range(intervals):
        x, v = forward(k, x, v)
        length = np.sqrt(np.sum(v * v, axis=0))
        if not np.all(np.isfinite(length)) or np.any(length == 0.0):
            raise ScissordynError(f"the perturbation became {float(np.min(length)):g} in interval {k}: it cannot be rescaled")
        growth[k] = np.log(length / size)
        v = v * (size / length)
    return growth


def _apply(matrix: ArrayLike, v: np.ndarray) -> np.ndarray:
    """Multiply one or several matrices and vectors."""
    turned: np.ndarray = np.einsum("ij...,j...->i...", np.asarray(matrix, float), v)
    return turned
