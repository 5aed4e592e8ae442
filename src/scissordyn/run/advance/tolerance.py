"""Error weights that mean the same for any mechanism, at any scale, for any length of a run."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from scissordyn.integrate.tableau import EXPLICIT
from scissordyn.kernel import Handle
from scissordyn.laws.evaluate import friction_states
from scissordyn.mechanics.system import System
from scissordyn.plan.plan import Plan
from scissordyn.plan.system import rates
from scissordyn.tolerance import ROUND_OFF_TOL

FRICTION_STATE_FACTOR = 100.0
"""Error weight of friction states divided by the requested tolerance.

The states relax within microseconds, so that their errors do not add up. Measured: the events keep their digits, and the steps
become 16 to 28 % fewer.
"""

BENDING_FACTOR = 100.0
"""Error weight of bending coordinates divided by that of other coordinates, in mechanisms with contacts.

The clearances are a thousandth of the bars. The steps resolve axial waves, which are far faster than all else.
Errors in vibrations do not grow with time. Measured: half as many steps; contact forces change by 2e-5.
"""

POSITION_RTOL = 1e-15  # [-] relative tolerance of coordinates, at round-off: their absolute tolerance decides


@dataclass(frozen=True)
class Tolerances:
    """Weights of errors, and precision of located events."""

    absolute: np.ndarray  # (ny,)
    relative: np.ndarray  # (ny,)
    rounding: np.ndarray  # (ny,) step size times the velocity error of a linearly implicit step due to rounded positions
    group: np.ndarray  # boundaries of the groups whose root mean squares the relative weights refer to
    precision: np.ndarray  # (guards,) precision of located events, in the guard's unit
    crossable: np.ndarray  # (guards,) 1 for a guard that may start to act within a step
    delays: tuple[float, ...]  # delays of controllers [s]
    vibration: np.ndarray  # (ny,) factors that multiply the weights: `BENDING_FACTOR` or 1
    time_scale: float  # time in which the mechanism moves by its reference length from rest [s]
    integral: float  # relative tolerance of integrals where the drives alone determine the motion, else 0
    inertia: float  # mass of all bodies times the mechanism's size squared [kg m^2]

    def weights(self, kind: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return absolute and relative error weights, and weights of round-off over the step size, for a kind of method.

        The kind is `EXPLICIT` or `ROSENBROCK`; the shapes are (ny,).
        """
        rounding = np.zeros(self.rounding.size) if kind == EXPLICIT else self.rounding
        return self.absolute * self.vibration, self.relative * self.vibration, rounding


def error_weights(plan: Plan, system: Handle, y: np.ndarray, *, rtol: float, atol: float) -> Tolerances:
    """Return error weights from the distance by which free coordinates move the points of the bodies.

    Positions are compared with the smallest clearance, or the largest body if there is no clearance. Speeds are compared with
    the speed of the whole mechanism, and with that length divided by the time in which the mechanism moves by it from rest.
    Friction states are compared with their size in steady sliding, component states with their declared scale. Torques of
    integrators are compared with themselves and with 1 N m, or with the mechanism's own torques if these are smaller.
    """
    n = plan.coordinates.free
    content: System = system.content
    parameters = content.parameters
    reach = plan.coordinates.reach
    contacts = parameters.contact.size
    if contacts:
        scale = float(np.min(parameters.contact["clearance"]))
    else:
        scale = max((body.extent for body in plan.bodies), default=1.0) or 1.0
    rates(system, 0.0, y.copy())
    fastest = float(np.max(reach * np.abs(content.work.A[:n]), initial=plan.mechanism.gravity if n else 0.0))
    # an acceleration that moves no point by this length within a million seconds is round-off of a mechanism at rest
    duration = math.sqrt(scale / fastest) if ROUND_OFF_TOL * scale < fastest < math.inf else 1.0
    size, mass = plan.coordinates.size, sum(body.mass for body in plan.bodies)
    internal = _internal_weights(plan, content, rtol=rtol, atol=atol, torque=scale / duration**2 * size * mass)
    position = atol * scale / reach
    rounding = np.zeros(y.size)  # times 1/h: error of a velocity in a linearly implicit step by a quarter rounding of positions
    rounding[n : 2 * n] = 0.25 * np.finfo(float).eps * plan.coordinates.farthest / reach
    vibration, bent = np.ones(y.size), content.model.shape_column[content.model.shape_column < n]
    if contacts and not plan.lubricated:  # a film turns errors of rates into forces
        vibration[bent] = vibration[n + bent] = BENDING_FACTOR
    start = content.model.state_start
    # ends of the groups of internal states: all friction laws, then each component and controller
    ends = range(2 * n + int(start[contacts]), 2 * n + int(start[-1]) + 1)
    crossable, precision = [1] * contacts, (1e-9 * parameters.contact["clearance"]).tolist()
    for part in plan.acting:
        if part.declaration.gap is not None:
            crossable.append(int(part.declaration.force is not None and part.declaration.switch is None))
            precision.append(1e-10 * (1.0 if part.declaration.port.turning else size))
    return Tolerances(
        absolute=np.concatenate([position, position / duration, internal[0]]),
        relative=np.concatenate([np.full(n, POSITION_RTOL), np.full(n, rtol), internal[1]]),
        rounding=rounding,
        group=np.array([0, n, 2 * n, *ends], np.int64),
        precision=np.array(precision, float),
        crossable=np.array(crossable, np.int64),
        delays=controller_delays(plan),
        vibration=vibration,
        time_scale=duration,
        integral=rtol if plan.coordinates.mobility == 0 else 0.0,
        inertia=mass * size**2,
    )


def controller_delays(plan: Plan) -> tuple[float, ...]:
    """Return the different delays of controllers, shortest first [s]."""
    return tuple(sorted({part.controller.delay for _, part in plan.actuators if part.controller.delay > 0.0}))


def state_tolerance(rtol: float, atol: float) -> float:
    """Return the error allowed in a state of a component in one step, as a fraction of the state's declared scale."""
    return min(rtol, atol)


def _internal_weights(plan: Plan, system: System, *, rtol: float, atol: float, torque: float) -> tuple[np.ndarray, np.ndarray]:
    """Return absolute and relative error weights of the internal states, in their order in y."""
    declared = system.parameters.state_scale
    friction = int(system.model.state_start[system.parameters.contact.size])
    sliding, absolute, relative = _sliding_states(system), np.empty(declared.size), np.empty(declared.size)
    # the error of a bristle decays, the error of an integrator does not
    size = np.where(declared > 0.0, declared, np.where(sliding > 0.0, sliding, 1.0))
    absolute[:friction] = relative[:friction] = FRICTION_STATE_FACTOR * rtol
    absolute[:friction] *= size[:friction]
    k = friction
    controlled = dict(plan.actuators)
    for i, component in enumerate(plan.acting):
        for _ in component.states:
            if i in controlled:
                absolute[k], relative[k] = rtol * min(declared[k], torque), rtol
            elif component.declaration.contact:
                absolute[k], relative[k] = FRICTION_STATE_FACTOR * rtol * declared[k], FRICTION_STATE_FACTOR * rtol
            else:  # a small difference of a large state may act, as in a spring
                absolute[k], relative[k] = state_tolerance(rtol, atol) * declared[k], POSITION_RTOL
            k += 1
    return absolute, relative


def _sliding_states(system: System) -> np.ndarray:
    """Return the size of each internal state in steady sliding at 1 m/s, the natural scale of its error."""
    model, parameters = system.model, system.parameters
    scale = np.zeros(int(model.state_start[-1]))
    for j in range(parameters.contact.size):
        part = slice(model.state_start[j], model.state_start[j] + parameters.law["bristles"][j])
        if part.stop > part.start:
            state = np.zeros(part.stop - part.start)
            friction_states(parameters.law["start"][j], 1.0, state, parameters.friction[j])
            scale[part] = np.abs(state)
    return scale
