"""The mechanics as a problem for the integrators: functions of a `System`'s address, by the names the loop calls."""

from __future__ import annotations

from scissordyn.jit import kernel
from scissordyn.mechanics import equations, step_matrix
from scissordyn.mechanics.system import open_system

__all__ = ["FUNCTIONS"]

_accelerate, _linearise = equations.accelerate, equations.linearise
_factorize, _solve = step_matrix.factorize, step_matrix.solve
_project, _guards, _reset, _powers = equations.project, equations.guards, equations.reset, equations.powers
_record = equations.record_signals


@kernel()
def rate(t, y, address, dy):
    """See `equations.accelerate`."""
    _accelerate(t, y, open_system(address), dy)


@kernel()
def linearise(t, y, address, dy, dt):
    """See `equations.linearise`."""
    _linearise(t, y, open_system(address), dy, dt)


@kernel()
def factorize(hg, address):
    """See `step_matrix.factorize`."""
    return _factorize(hg, open_system(address))


@kernel()
def solve(r, address):
    """See `step_matrix.solve`."""
    _solve(r, open_system(address))


@kernel()
def project(t, y, address):
    """See `equations.project`."""
    return _project(t, y, open_system(address))


@kernel()
def guards(t, y, address, value, rate):
    """See `equations.guards`."""
    _guards(t, y, open_system(address), value, rate)


@kernel()
def reset(t, y, guard, address, record):
    """See `equations.reset`."""
    _reset(t, y, guard, open_system(address), record)


@kernel()
def powers(t, y, address, power, watched):
    """See `equations.powers`."""
    _powers(t, y, open_system(address), power, watched)


@kernel()
def record(t, y, address, signals):
    """See `equations.record_signals`."""
    _record(t, y, open_system(address), signals)


FUNCTIONS = {
    "rate": rate,
    "linearise": linearise,
    "factorize": factorize,
    "solve": solve,
    "project": project,
    "guards": guards,
    "reset": reset,
    "powers": powers,
    "record": record,
}
