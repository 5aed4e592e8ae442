"""Other codes on the slider-crank: scipy and numbalsoda on the equations derived by hand.

Each returns seconds and the eccentricities at the same instants, which are computed outside the measured time.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
from numba import njit
from scipy.integrate import solve_ivp

from validation.slider_crank.equations import (
    CLEARANCE,
    ROD,
    SAMPLES,
    TIMES,
    UNTIL,
    eccentricity,
    gap_rate,
    rates,
    start,
)

__all__ = ["Found", "numbalsodas", "scipys"]

Found = tuple[float, np.ndarray]  # Seconds, and eccentricities (samples, 2)
AHEAD = 20  # Samples that numbalsoda computes at a time: the fastest of 4, 10, 20, 40 and 200
ROUND_OFF = 1e-12  # Gap, in clearances, at which a contact begins or ends


def orbit(states: np.ndarray) -> np.ndarray:
    """Return eccentricities of states (samples, 4)."""
    return np.array([eccentricity(when, *state)[:2] for when, state in zip(TIMES, states, strict=True)])


def scipys(method: str, tolerance: float) -> Found:
    """Run scipy on the compiled equations from contact to contact, with the short steps that find all contacts."""
    began = time.perf_counter()
    states, y = np.empty((SAMPLES, 4)), start()
    t, done, touching, approach = 0.0, 0, False, 1.0
    atol = tolerance * np.array([CLEARANCE, CLEARANCE, 100.0, 10.0])

    def slope(when: float, state: np.ndarray, *contact: float) -> np.ndarray:
        return np.array(rates(when, *state, *contact))

    def gap(when: float, state: np.ndarray, *_: float) -> float:
        return float(gap_rate(when, *state)[0])

    gap.terminal = True  # type: ignore[attr-defined]
    while t < UNTIL:
        gap.direction = -1.0 if touching else 1.0  # type: ignore[attr-defined]
        found = solve_ivp(
            slope,
            (t, UNTIL),
            y,
            method=method,
            t_eval=TIMES[done:],
            args=(touching, approach),
            events=gap,
            rtol=tolerance,
            atol=atol,
            max_step=UNTIL / 400.0,
        )
        if not found.success:
            raise RuntimeError(found.message)
        states[done : done + found.t.size] = found.y.T
        done += found.t.size
        if not found.t_events[0].size:
            break
        t, y = float(found.t_events[0][0]), found.y_events[0][0]
        touching = not touching
        if touching:
            approach = gap_rate(t, *y)[1]
    return time.perf_counter() - began, orbit(states)


def _scales(unit: float) -> tuple[float, float, float, float]:
    """Return units of the four unknowns: lengths in clearances, times in `unit` [s]."""
    return CLEARANCE / ROD, CLEARANCE, CLEARANCE / ROD / unit, CLEARANCE / unit


@cache
def _scaled(unit: float) -> Any:
    """Return the equations in scaled unknowns for numbalsoda; parameters are a contact flag and the approach speed."""
    from numba import carray, cfunc
    from numbalsoda import lsoda_sig

    of_angle, of_place, of_spin, of_speed = _scales(unit)

    @cfunc(lsoda_sig)
    def scaled(t, u, du, p):
        y, contact = carray(u, (4,)), carray(p, (2,))
        spin, speed, angular, linear = rates(
            t * unit, y[0] * of_angle, y[1] * of_place, y[2] * of_spin, y[3] * of_speed, contact[0] == 1.0, contact[1]
        )
        du[0], du[1] = spin * unit / of_angle, speed * unit / of_place
        du[2], du[3] = angular * unit / of_spin, linear * unit / of_speed

    return scaled


@cache
def _scaled_gap(unit: float) -> Any:
    """Return the compiled gap and its rate in scaled unknowns."""
    of_angle, of_place, of_spin, of_speed = _scales(unit)

    @njit
    def gap(t, y):
        found, rate = gap_rate(t * unit, y[0] * of_angle, y[1] * of_place, y[2] * of_spin, y[3] * of_speed)
        return found / CLEARANCE, rate * unit / CLEARANCE

    return gap


@cache
def _crossing(unit: float) -> Any:
    """Return a compiled search for the instant at which the gap changes sign."""
    from numbalsoda import dop853

    address, gap = _scaled(unit).address, _scaled_gap(unit)

    @njit
    def crossing(t, y, end, beyond, side, contact, relative, absolute):
        """Apply Newton's method between (t, y) and end; each value is an integration from the last state before the root."""
        low, high = t, end
        here, there = side * gap(t, y)[0], side * gap(end, beyond)[0]
        root = low + (high - low) * here / (here - there) if here > 1e-9 else 0.5 * (low + high)
        state, good = beyond, True
        for _ in range(60):
            ends, good = dop853(address, y.copy(), np.array([low, root]), contact, relative, absolute)
            state = ends[1].copy()
            value, rate = gap(root, state)
            if not good or abs(value) < ROUND_OFF or high - low < 1e-13 * high:
                break
            if side * value > 0.0:
                low, y = root, state
            else:
                high = root
            newton = root - value / rate
            root = newton if low < newton < high else 0.5 * (low + high)
        return root, state, good

    return crossing


@cache
def _locating(unit: float) -> Callable[..., tuple[np.ndarray, bool]]:
    """Return a compiled loop around numbalsoda's DOP853 that stops where the gap changes sign and then continues.

    Lengths are in clearances and times in a unit near the duration of a contact: numbalsoda has only one absolute tolerance,
    which then suits all unknowns.

    Parameters
    ----------
    unit : float
        Unit of time [s].
    """
    from numbalsoda import dop853

    address, gap, crossing, scales = _scaled(unit).address, _scaled_gap(unit), _crossing(unit), np.array(_scales(unit))

    @njit
    def march(times, y, relative, absolute):
        states = np.empty((times.size, 4))
        states[0] = y
        contact = np.array([0.0, 1.0])  # contact flag, and approach speed [m/s]
        t, done, good = times[0], 1, True
        while done < times.size and good:
            grid = np.empty(min(AHEAD, times.size - done) + 1)
            grid[0], grid[1:] = t, times[done : done + grid.size - 1]
            found, good = dop853(address, y.copy(), grid, contact, relative, absolute)
            side = 1.0 if contact[0] == 1.0 else -1.0
            k = 1
            while k < grid.size and side * gap(grid[k], found[k])[0] > 0.0:
                states[done] = found[k]
                done += 1
                k += 1
            if k == grid.size:
                t, y = grid[-1], found[-1].copy()
                continue
            last = found[k - 1].copy()
            t, y, good = crossing(grid[k - 1], last, grid[k], found[k].copy(), side, contact, relative, absolute)
            contact[0] = 1.0 - contact[0]
            contact[1] = max(gap(t, y)[1] * CLEARANCE / unit, 1e-6)
        for k in range(times.size):
            states[k] *= scales
        return states, good

    return march


def numbalsodas(tolerance: float, unit: float) -> Found:
    """Run numbalsoda's DOP853 from contact to contact, in a loop that it lacks."""
    march = _locating(unit)
    began = time.perf_counter()
    states, success = march(TIMES / unit, start() / np.array(_scales(unit)), 1e-3 * tolerance, tolerance)
    seconds = time.perf_counter() - began
    if not success:
        raise RuntimeError("numbalsoda's dop853 failed")
    return seconds, orbit(states)
