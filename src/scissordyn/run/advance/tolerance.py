"""Error weights that mean the same for any mechanism, at any scale, whatever the length of the run."""

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

INTERNAL_STATES = 100.0
"""Internal states of friction laws are weighed this much more loosely: they relax within microseconds, so that their errors do
not add up. Measured: the events keep their digits, the steps become 16 to 28 % fewer (docs/decisions)."""

VIBRATIONS = 100.0
"""What moves bars that bend is weighed this much more loosely beside contacts, whose clearances are a thousandth of the bars.
Steps resolve axial waves, far faster than all else, and errors in vibrations do not grow with time. Measured:
steps become half as many, forces of contacts change by 2e-5 (docs/decisions)."""

ROUNDINGS = 0.25
"""Of positions, in units of 1/h: what velocities may be wrong by in a step of a linearly implicit method (decision 0010)."""

ROUND_OFF = 1e-15  # Relative weight of positions: what they are rounded to
LOCATED = 1e-9  # A contact's beginning is located to this fraction of its clearance
GUARD = 1e-10  # The guard of a component is located to this angle [rad], or to this fraction of the mechanism's size


@dataclass(frozen=True)
class Tolerances:
    """Weights of errors, and how precisely events are located."""

    absolute: np.ndarray  # (ny,)
    relative: np.ndarray  # (ny,)
    rounding: np.ndarray  # (ny,) Times 1/h: what a linearly implicit step moves a velocity by because positions are rounded
    group: np.ndarray  # Boundaries of the groups whose root mean square the relative weights refer to
    precision: np.ndarray  # (guards,)
    crossable: np.ndarray  # (guards,) 1 for guards that may act from within a step on
    delays: tuple[float, ...]  # Of controllers [s]
    vibration: np.ndarray  # (ny,) By how much the weights are multiplied
    time_scale: float  # Time in which the mechanism moves by its reference length from rest [s]

    def weights(self, kind: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Absolute and relative weights and those of rounding for a kind of method, shape (ny,)."""
        rounding = np.zeros(self.rounding.size) if kind == EXPLICIT else self.rounding
        return self.absolute * self.vibration, self.relative * self.vibration, rounding


def error_weights(plan: Plan, system: Handle, y: np.ndarray, *, rtol: float, atol: float) -> Tolerances:
    """Weights from how far free coordinates move the points of the bodies.

    Positions are weighed against the smallest clearance, or the largest body where there is none; speeds against the speed of
    the whole mechanism, and against what moves by that length in the time that it takes from rest; states of friction laws
    against their size in steady sliding; those of components against the scale that each declares; torques of integrators
    against themselves and 1 N m, or against the mechanism's own torques where these are smaller.
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
    duration = math.sqrt(scale / fastest) if 0.0 < fastest < math.inf else 1.0
    internal = _internal_weights(plan, content, rtol=rtol, atol=atol, acceleration=scale / duration**2)
    position = atol * scale / reach
    rounding = np.zeros(y.size)
    rounding[n : 2 * n] = ROUNDINGS * np.finfo(float).eps * plan.coordinates.farthest / reach
    vibration, bent = np.ones(y.size), content.model.shape_column[content.model.shape_column < n]
    if contacts and not plan.lubricated:  # a film turns errors of rates into forces
        vibration[bent] = vibration[n + bent] = VIBRATIONS
    start = content.model.state_start
    # where groups of internal states end: those of all friction laws, then those of each component and controller
    ends = range(2 * n + int(start[contacts]), 2 * n + int(start[-1]) + 1)
    delays = [part.controller.delay for _, part in plan.actuators]
    crossable, precision = [1] * contacts, (LOCATED * parameters.contact["clearance"]).tolist()
    for part in plan.acting:
        if part.declaration.gap is not None:
            crossable.append(int(part.declaration.force is not None and part.declaration.switch is None))
            precision.append(GUARD * (1.0 if part.declaration.port.turning else plan.coordinates.size))
    return Tolerances(
        absolute=np.concatenate([position, position / duration, internal[0]]),
        relative=np.concatenate([np.full(n, ROUND_OFF), np.full(n, rtol), internal[1]]),
        rounding=rounding,
        group=np.array([0, n, 2 * n, *ends], np.int64),
        precision=np.array(precision, float),
        crossable=np.array(crossable, np.int64),
        delays=tuple(sorted({delay for delay in delays if delay > 0.0})),
        vibration=vibration,
        time_scale=duration,
    )


def state_tolerance(rtol: float, atol: float) -> float:
    """Error allowed in a step in the state of a component, as a part of its scale."""
    return min(rtol, atol)


def _internal_weights(
    plan: Plan, system: System, *, rtol: float, atol: float, acceleration: float
) -> tuple[np.ndarray, np.ndarray]:
    """Absolute and relative weights of the internal states, in their order in y."""
    declared = system.parameters.state_scale
    friction = int(system.model.state_start[system.parameters.contact.size])
    sliding, absolute, relative = _sliding_states(system), np.empty(declared.size), np.empty(declared.size)
    # a bristle's error fades, an integrator's does not
    size = np.where(declared > 0.0, declared, np.where(sliding > 0.0, sliding, 1.0))
    absolute[:friction] = relative[:friction] = INTERNAL_STATES * rtol
    absolute[:friction] *= size[:friction]
    torque = acceleration * plan.coordinates.size * sum(body.mass for body in plan.bodies)
    k = friction
    controlled = dict(plan.actuators)
    for i, component in enumerate(plan.acting):
        for _ in component.states:
            if i in controlled:
                absolute[k], relative[k] = rtol * min(declared[k], torque), rtol
            else:  # a large state may act by a small difference, as a spring's does
                absolute[k], relative[k] = state_tolerance(rtol, atol) * declared[k], ROUND_OFF
            k += 1
    return absolute, relative


def _sliding_states(system: System) -> np.ndarray:
    """Size of each internal state in steady sliding at 1 m/s, the natural scale of its error."""
    model, parameters = system.model, system.parameters
    scale = np.zeros(int(model.state_start[-1]))
    for j in range(parameters.contact.size):
        part = slice(model.state_start[j], model.state_start[j] + parameters.law["bristles"][j])
        if part.stop > part.start:
            state = np.zeros(part.stop - part.start)
            friction_states(parameters.law["start"][j], 1.0, state, parameters.friction[j])
            scale[part] = np.abs(state)
    return scale
