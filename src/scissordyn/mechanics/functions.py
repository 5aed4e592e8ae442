"""The mechanics as a problem for the integrators: functions of a `System`'s address, by the names that the loop calls."""

from __future__ import annotations

import math

from scissordyn.kernel import F1, F2, entry, kernel
from scissordyn.mechanics import constraint_solver, equations, hard_contact, hard_powers, monitored, reaction_slopes
from scissordyn.mechanics import guard as guards_of
from scissordyn.mechanics import hard_impact as impacts
from scissordyn.mechanics.hard_rows import open_hard
from scissordyn.mechanics.rotation import count_turns
from scissordyn.mechanics.system import open_system

LARGEST_TURN = 1.0
"""A step ends before the fastest body has turned by this [rad] at its present speed, so that turns are counted rightly."""

ROUND_OFF = 1e-12  # A break nearer than this fraction of its instant has been reached

LARGEST_DRIVEN_TURN = 0.02
"""The same for a mechanism without freedom, whose steps have no error to go by: the powers are integrated over them."""

SINGULAR = 1e-3
"""A step across a singular position begins where the gradients' dependence is below this fraction of the largest one, and..."""

LOOK = 4.0  # ...where the position is no more steps ahead than this

AFTER_BREAK = 1e-3
"""For these also: the first step after a break is this part of the way to the next one, as the motion may start from rest."""


@entry
def rate(t: float, y: F1, address: int, dy: F1) -> None:
    """See `equations.accelerate`."""
    equations.accelerate(t, y, open_system(address), dy)


@entry
def linearise(t: float, y: F1, address: int, dy: F1, dt: F1) -> None:
    """See `equations.linearise`."""
    S = open_system(address)
    reactions = S.friction.rates.size > 0
    if reactions:
        reaction_slopes.write_slopes(t, y, S)
    equations.linearise(t, y, S, dy, dt)
    if reactions:
        reaction_slopes.add_time_slopes(S, dt)


@entry
def factorize(hg: float, address: int) -> int:
    """See `step_matrix.factorize` and `reaction_slopes`."""
    return reaction_slopes.factorize(hg, open_system(address))


@entry
def solve(r: F1, address: int) -> None:
    """See `step_matrix.solve` and `reaction_slopes`."""
    reaction_slopes.solve(r, open_system(address))


@entry
def accept(t: float, y: F1, address: int, answer: F1) -> None:
    """Project the state, count turns; writes whether y changed, how long the next step may be, and the fastest rotation.

    Close to a singular position it writes minus the time to it, for a caller that can step across it: W.near[3] is finite.
    """
    S = open_system(address)
    answer[0] = 1.0 if constraint_solver.project(t, y, S) else 0.0
    fastest = count_turns(S)
    turn = LARGEST_TURN if y.size > 0 else LARGEST_DRIVEN_TURN
    longest = turn / fastest if fastest > 0.0 else math.inf
    across = -1.0
    if t > S.work.near[3]:
        ahead = constraint_solver.singular_ahead(fastest, S)
        if ahead < math.inf:
            longest = min(longest, 0.5 * ahead)
            if S.work.near[1] < SINGULAR and ahead <= LOOK * (t - S.work.near[2]):
                across = ahead
        S.work.near[2] = t
    breaks, reached, following = S.parameters.breaks, -math.inf, math.inf
    for k in range(breaks.size):
        if breaks[k] - t <= ROUND_OFF * breaks[k]:
            reached = breaks[k]
        else:
            following = breaks[k]
            longest = min(longest, breaks[k] - t)
            if y.size == 0 and k > 0 and abs(breaks[k - 1] - t) <= ROUND_OFF * breaks[k - 1]:
                longest = min(longest, AFTER_BREAK * (breaks[k] - t))
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
    """Let the constraints of latches be active as their modes say."""
    constraint_solver.engage(open_system(address))


@entry
def guards(t: float, y: F1, address: int, value: F1, rate: F1) -> None:
    """See `guard.guards`."""
    guards_of.guards(t, y, open_system(address), value, rate)


@entry
def guard(t: float, y: F1, k: int, address: int, value: F1, rate: F1) -> None:
    """See `guard.guard`."""
    guards_of.guard(t, y, k, open_system(address), value, rate)


@entry
def reset(t: float, y: F1, guard: int, address: int, data: F1) -> bool:
    """See `guard.reset`."""
    return guards_of.reset(t, y, guard, open_system(address), data)


@entry
def touch(t: float, y: F1, guard: int, address: int, data: F1) -> None:
    """See `guard.touch`."""
    guards_of.touch(t, y, guard, open_system(address), data)


@entry
def monitor(t: float, y: F1, address: int, power: F1, rows: F2) -> None:
    """See `monitored.monitor`."""
    monitored.monitor(t, y, open_system(address), power, rows)


@entry
def probe(t: float, y: F1, row: int, address: int, dy: F1, out: F1) -> None:
    """See `monitored.probe`."""
    monitored.probe(t, y, row, open_system(address), dy, out)


@entry
def record(t: float, y: F1, address: int, signals: F1) -> None:
    """See `equations.record_signals`."""
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


@kernel
def hard_step(t, h, y, new, address, hard):
    """See `hard_contact.hard_step`."""
    hard_contact.hard_step(t, h, y, new, open_system(address), open_hard(hard))


@kernel
def hard_restore(hard):
    """See `hard_contact.restore`."""
    hard_contact.restore(open_hard(hard))


@kernel
def hard_guards_ahead(t, y, address, hard, value, rate):
    """See `hard_contact.guards_ahead`."""
    hard_contact.guards_ahead(t, y, value, rate, open_system(address), open_hard(hard))


@kernel
def hard_impact(t, h, y, address, hard):
    """See `hard_impact.hard_impact`."""
    impacts.hard_impact(t, h, y, open_system(address), open_hard(hard))


@kernel
def hard_monitor(t, h, y, address, hard, power, rows):
    """See `hard_powers.hard_monitor`."""
    hard_powers.hard_monitor(t, h, y, open_system(address), open_hard(hard), power, rows)


HARD_FUNCTIONS = {
    "step": hard_step,
    "restore": hard_restore,
    "guards_ahead": hard_guards_ahead,
    "impact": hard_impact,
    "monitor": hard_monitor,
}
"""Of time stepping with hard contacts, by the names that its loop calls."""
