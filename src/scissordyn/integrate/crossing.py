"""Step across the rises and falls of guards under error control.

A fall needs no preparation, because the guard's force vanishes beyond it. For a rise inside the step, the guard is put into
mode 1 with the result of its reset at the rise, and the step is repeated from its start. If the error is small enough, the
events take their instants and data from the dense output. Otherwise the step ends on its first event.
"""

from __future__ import annotations

import math

from scissordyn.integrate.dense import dense_value
from scissordyn.integrate.event import find_crossings
from scissordyn.integrate.integration import DATA, ENDED, FALL, GUARD, MODE, RISE, TIME
from scissordyn.integrate.monitor import begin_peak, end_peak
from scissordyn.integrate.step import NOTHING, attempt, error_norm, fraction, prepare
from scissordyn.kernel import kernel


@kernel
def can_cross(s, w):
    """Return whether all crossings of the list can be stepped across.

    A guard that is crossed twice cannot: all stages may lie outside its contact, so that no force would act.
    """
    if w.crossing_count[0] >= w.crossing_guard.size:
        return False
    for c in range(w.crossing_count[0]):
        k = w.crossing_guard[c]
        if w.crossable[k] == 0:
            return False
        for later in range(c + 1, w.crossing_count[0]):
            if w.crossing_guard[later] == k:
                return False
    return True


@kernel
def step_across(problem, T, t, h, error, s, w, S):
    """Repeat the step with its rising guards in mode 1 (acting); return its error, or -1 if the step must end on an event."""
    w.rise_count[0] = 0
    if not can_cross(s, w):
        return -1.0
    for c in range(w.crossing_count[0]):
        if s.mode[w.crossing_guard[c]] == 0:
            note_rise(w.crossing_guard[c], w.crossing_place[c], w)
    if w.rise_count[0] == 0:
        return error
    save_state(s, w)
    s.clock[0].prepared = NOTHING
    if not raise_guards(problem, T, t, h, s, w, S):
        restore_state(s, w)
        return -1.0
    prepare(problem, T, t, s, w, S)
    again = error_norm(T, h, s, w) if attempt(problem, T, t, h, s, w, S) else math.inf
    fits = again <= 1.0 and find_crossings(problem, T, t, h, s, w, S, True)
    if fits:
        for c in range(w.crossing_count[0]):  # the prepared contacts must not cause another rise
            if s.mode[w.crossing_guard[c]] == 0:
                fits = False
    if fits and can_cross(s, w):
        return again
    restore_state(s, w)
    prepare(problem, T, t, s, w, S)
    attempt(problem, T, t, h, s, w, S)
    return -1.0


@kernel
def note_rise(k, theta, w):
    """Add a rise to the list, unless the list contains the guard."""
    for c in range(w.rise_count[0]):
        if w.rise_guard[c] == k:
            return
    w.rise_guard[w.rise_count[0]], w.rise_place[w.rise_count[0]] = k, theta
    w.rise_count[0] += 1


@kernel
def raise_guards(problem, T, t, h, s, w, S):
    """Put the guards of the list into mode 1 from the start of the step; return whether all of them rise in it."""
    for c in range(w.rise_count[0]):
        theta = w.rise_place[c]
        dense_value(theta, T.pattern, w.saved, w.dense, w.inside)
        for i in range(s.y.size):
            w.new[i] = w.inside[i]
        begun = problem.reset(t + fraction(w.scaling[0], theta) * h, w.inside, w.rise_guard[c], S, w.rise_data[c])
        if not begun:
            return False
        for i in range(s.y.size):  # states of the guard, which are not read before the rise
            if w.inside[i] != w.new[i]:
                s.y[i] = w.inside[i]
    return True


@kernel
def save_state(s, w):
    """Save the state and modes for `restore_state`."""
    for i in range(s.y.size):
        w.saved[i] = s.y[i]
    for k in range(s.mode.size):
        w.trial_mode[k], w.trial_memory[k], w.trial_mass[k] = s.mode[k], s.memory[k], s.mass[k]


@kernel
def restore_state(s, w):
    """Restore the state and modes before the guards were prepared; values at the step's start become invalid."""
    s.clock[0].prepared = NOTHING
    for i in range(s.y.size):
        s.y[i] = w.saved[i]
    for k in range(s.mode.size):
        s.mode[k], s.memory[k], s.mass[k] = w.trial_mode[k], w.trial_memory[k], w.trial_mass[k]
    w.rise_count[0] = 0


@kernel
def log_crossings(problem, T, t, h, s, w, S, log, rises):
    """Log the rises, or the falls, inside the step; a fall ends the guard's contact."""
    counts = s.counts[0]
    count = w.rise_count[0] if rises else w.crossing_count[0]
    for c in range(count):
        k, theta = (w.rise_guard[c], w.rise_place[c]) if rises else (w.crossing_guard[c], w.crossing_place[c])
        now = t + fraction(w.scaling[0], theta) * h
        row = log[counts.events]
        row[TIME], row[GUARD] = now, k
        if rises:
            row[MODE] = RISE
            for q in range(DATA, row.size):
                row[q] = w.rise_data[c, q - DATA] if q < ENDED else 0.0
            begin_peak(now, k, s, w)
        else:
            row[MODE] = FALL
            dense_value(theta, T.pattern, s.y, w.dense, w.inside)
            problem.reset(now, w.inside, k, S, row[DATA:ENDED])
            end_peak(k, s, w, row)
        counts.events += 1


@kernel
def end_inactive(problem, t, s, w, S):
    """Set prepared guards that do not rise within the step back to mode 0."""
    if w.rise_count[0] == 0:
        return
    problem.guards(t, w.new, S, w.value, w.rate)
    for c in range(w.rise_count[0]):
        k = w.rise_guard[c]
        if s.mode[k] == 1 and w.value[k] < -w.precision[k] and not has_fall(k, w):
            s.mode[k] = 0


@kernel
def has_fall(k, w):
    """Return whether the list contains a fall of the guard."""
    for c in range(w.crossing_count[0]):  # noqa: SIM110 -- kernels have no generator expressions
        if w.crossing_guard[c] == k:
            return True
    return False
