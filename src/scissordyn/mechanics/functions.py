"""Entries of the mechanics that the time loop calls with the address of a `System`: rates, step matrices, guards, contacts."""

from __future__ import annotations

import math

from scissordyn.kernel import F1, F2, entry, kernel
from scissordyn.mechanics import constraint_solver, equations, hard_contact, hard_powers, monitored, reaction_slopes
from scissordyn.mechanics import guard as guards_of
from scissordyn.mechanics import hard_impact as impacts
from scissordyn.mechanics.hard_rows import open_hard
from scissordyn.mechanics.rotation import count_turns
from scissordyn.mechanics.system import open_system
from scissordyn.tolerance import ROUND_OFF_TOL, SHORT_STEP_FRACTION, SINGULAR_VALUE_MIN

STEP_ROTATION_MAX = 1.0  # [rad] largest rotation of a body in a time step; turns could not be counted for larger ones

DRIVEN_ROTATION_MAX = 0.02
"""Largest rotation of a body [rad] in a time step of a mechanism without degrees of freedom.

Such steps have no error estimate, but powers are integrated over them.
"""

CROSSED_DISTANCE_MAX = 4.0  # [step sizes] largest time to a singular position for which the next time step may cross it


@entry
def rate(t: float, y: F1, address: int, dy: F1) -> None:
    """Evaluate the right-hand side (`equations.accelerate`)."""
    equations.accelerate(t, y, open_system(address), dy)


@entry
def rates_by_state(y: F1, h: F1, address: int, moved: F1, rates: F2, matrix: F2) -> None:
    """Write the derivatives of the rates by the state at t = 0 to `matrix`, from central differences of the sizes h.

    Scratch: `moved` (ny,), `rates` (2, ny).
    """
    S = open_system(address)
    for k in range(y.size):
        rates[:, :] = 0.0
        for i in range(y.size):
            moved[i] = y[i]
        moved[k] = y[k] + h[k]
        equations.accelerate(0.0, moved, S, rates[0])
        for i in range(y.size):
            moved[i] = y[i]
        moved[k] = y[k] - h[k]
        equations.accelerate(0.0, moved, S, rates[1])
        for i in range(y.size):
            matrix[i, k] = (rates[0, i] - rates[1, i]) / (2.0 * h[k])


@entry
def linearise(t: float, y: F1, address: int, dy: F1, dt: F1) -> None:
    """Evaluate and linearise the right-hand side (`equations.linearise`)."""
    S = open_system(address)
    reactions = S.friction.rates.size > 0
    if reactions:
        reaction_slopes.write_slopes(t, y, S)
    equations.linearise(t, y, S, dy, dt)
    if reactions:
        reaction_slopes.add_time_slopes(S, dt)


@entry
def factorize(hg: float, address: int) -> int:
    """Factorize the step matrix (`step_matrix.factorize`, `reaction_slopes`)."""
    return reaction_slopes.factorize(hg, open_system(address))


@entry
def solve(r: F1, address: int) -> None:
    """Solve with the step matrix (`step_matrix.solve`, `reaction_slopes`)."""
    reaction_slopes.solve(r, open_system(address))


@entry
def accept(t: float, y: F1, address: int, answer: F1) -> None:
    """Project the state and count turns; write whether y changed, the longest next step [s] and the fastest rotation [rad/s].

    Near a singular position the longest step is minus the time to it, if the caller can step across it: W.near[3] is finite.
    """
    S = open_system(address)
    answer[0] = 1.0 if constraint_solver.project(t, y, S) else 0.0
    fastest = count_turns(S)
    turn = STEP_ROTATION_MAX if y.size > 0 else DRIVEN_ROTATION_MAX
    longest = turn / fastest if fastest > 0.0 else math.inf
    across = -1.0
    if t > S.work.near[3]:
        ahead = constraint_solver.singular_ahead(fastest, S)
        if ahead < math.inf:
            longest = min(longest, 0.5 * ahead)
            if S.work.near[1] < SINGULAR_VALUE_MIN and ahead <= CROSSED_DISTANCE_MAX * (t - S.work.near[2]):
                across = ahead
        S.work.near[2] = t
    breaks, reached, following = S.parameters.breaks, -math.inf, math.inf
    for k in range(breaks.size):
        if breaks[k] - t <= ROUND_OFF_TOL * breaks[k]:
            reached = breaks[k]
        else:
            following = breaks[k]
            longest = min(longest, breaks[k] - t)
            if y.size == 0 and k > 0 and abs(breaks[k - 1] - t) <= ROUND_OFF_TOL * breaks[k - 1]:
                longest = min(longest, SHORT_STEP_FRACTION * (breaks[k] - t))  # the motion may start from rest
            break
    if S.work.segment[0] != reached:
        answer[0] = 1.0  # the slope at the end of the step is not that at the start of the next one
        S.work.instant[0] = math.nan
    S.work.segment[0], S.work.segment[1] = reached, following
    answer[1] = longest if across < 0.0 else -across
    if answer.size > 2:
        answer[2] = fastest


@entry
def activate(address: int) -> None:
    """Activate or deactivate the constraints of latches according to their modes."""
    constraint_solver.engage(open_system(address))


@entry
def guards(t: float, y: F1, address: int, value: F1, rate: F1) -> None:
    """Write values and rates of all guards (`guard.guards`)."""
    guards_of.guards(t, y, open_system(address), value, rate)


@entry
def guard(t: float, y: F1, k: int, address: int, value: F1, rate: F1) -> None:
    """Write value and rate of one guard (`guard.guard`)."""
    guards_of.guard(t, y, k, open_system(address), value, rate)


@entry
def reset(t: float, y: F1, guard: int, address: int, data: F1) -> bool:
    """Handle a guard crossing; return whether its mode changed (`guard.reset`)."""
    return guards_of.reset(t, y, guard, open_system(address), data)


@entry
def touch(t: float, y: F1, guard: int, address: int, data: F1) -> None:
    """Activate a guard at the start (`guard.touch`)."""
    guards_of.touch(t, y, guard, open_system(address), data)


@entry
def monitor(t: float, y: F1, address: int, power: F1, rows: F2) -> None:
    """Write powers and monitored quantities (`monitored.monitor`)."""
    monitored.monitor(t, y, open_system(address), power, rows)


@entry
def probe(t: float, y: F1, row: int, address: int, dy: F1, out: F1) -> None:
    """Write one monitored quantity for a trial state (`monitored.probe`)."""
    monitored.probe(t, y, row, open_system(address), dy, out)


@entry
def record(t: float, y: F1, address: int, signals: F1) -> None:
    """Write the signals that controllers record (`equations.record_signals`)."""
    equations.record_signals(t, y, open_system(address), signals)


FUNCTIONS = {
    "rate": rate,
    "linearise": linearise,
    "factorize": factorize,
    "solve": solve,
    "accept": accept,
    "guards": guards,
    "guard": guard,
    "reset": reset,
    "monitor": monitor,
    "probe": probe,
    "record": record,
}
"""Mechanics functions for time integration with error control, by the names that `integrate` uses."""


@kernel
def hard_step(t, h, y, new, address, hard):
    """Make one step with hard contacts (`hard_contact.hard_step`)."""
    hard_contact.hard_step(t, h, y, new, open_system(address), open_hard(hard))


@kernel
def hard_restore(hard):
    """Restore the contact state before the last step (`hard_contact.restore`)."""
    hard_contact.restore(open_hard(hard))


@kernel
def hard_guards_ahead(t, y, address, hard, value, rate):
    """Write the guards at the end of a step (`hard_contact.guards_ahead`)."""
    hard_contact.guards_ahead(t, y, value, rate, open_system(address), open_hard(hard))


@kernel
def hard_impact(t, h, y, address, hard, gain):
    """Compute impacts at an instant (`hard_impact.hard_impact`)."""
    impacts.hard_impact(t, h, y, open_system(address), open_hard(hard), gain)


@kernel
def hard_monitor(t, h, y, address, hard, power, rows):
    """Write powers and monitored quantities of a step (`hard_powers.hard_monitor`)."""
    hard_powers.hard_monitor(t, h, y, open_system(address), open_hard(hard), power, rows)


HARD_FUNCTIONS = {
    "step": hard_step,
    "restore": hard_restore,
    "guards_ahead": hard_guards_ahead,
    "impact": hard_impact,
    "monitor": hard_monitor,
}
"""Mechanics functions for time stepping with hard contacts, by the names that the time loop uses."""
