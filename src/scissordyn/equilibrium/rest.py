"""Find the static equilibrium of a mechanism under gravity, springs and loads."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from scissordyn.components.beam import Beam
from scissordyn.components.flexible_bar import FlexibleBar
from scissordyn.components.guide_friction import GuideFriction
from scissordyn.components.pin_friction import PinFriction
from scissordyn.equilibrium.static_position import StaticPosition, element_block, small_motions
from scissordyn.errors import InputError
from scissordyn.kernel import Handle
from scissordyn.laws.evaluate import elastic_force, settled_states
from scissordyn.mechanics import functions
from scissordyn.mechanics.system import System
from scissordyn.plan.plan import Plan
from scissordyn.plan.system import guard_values

STEP_MAX = 1e4  # [s] largest step size of the descent to equilibrium; steps of this size are those of Newton's method
STEP_MIN = 1e-9  # [s] step size below which the descent to equilibrium has failed
STEPS_MAX = 5000  # Largest number of steps in a descent to equilibrium; if they are used up, the descent has failed
DISPLACEMENT_MAX = 100.0  # [mechanism sizes] a mechanism that moves farther in its descent to equilibrium is held by nothing
STEP_DISPLACEMENT_MAX = 0.3  # [mechanism sizes] largest displacement in one step of the descent to equilibrium

UNLOADED_ROUND_OFF_FACTOR = 100.0
"""Factor by which the estimated round-off of forces grows if no load acts; it covers that of angles and servo references."""


class StaticEquilibrium(NamedTuple):
    """Position that `equilibrium` found, and measures of its loads and stability."""

    position: np.ndarray  # (n,) Free coordinates
    load: float  # Size of the loads, to which the remaining unbalanced force was compared
    growth: float  # Rate at which the fastest motion away from the equilibrium grows [1/s]; 0 for a stable equilibrium


def equilibrium(
    plan: Plan, handle: Handle, position: np.ndarray, load: float = 0.0, expected: np.ndarray | None = None
) -> StaticEquilibrium:
    """Find a stable equilibrium by descent from a position, or near the `expected` position on the same branch.

    The method is pseudo-transient continuation: implicit Euler steps from rest, each solved by Newton's method. The step size
    grows while the steps converge, so that the iteration tends to Newton's method. Steps from rest reduce the potential energy
    and therefore lead to a stable equilibrium, except for long steps. From an unstable equilibrium the descent continues to
    the side from which it came; if it came from neither side, the unstable equilibrium is returned. A descent that fails is
    repeated with reduced axial stiffness of thin bars.

    References
    ----------
    Kelley and Keyes 1998, doi:10.1137/S0036142996304796
    """
    # friction in ideal joints exerts no force at rest but slows the descent; its coefficients are the first two values
    rows = handle.content.parameters.component
    rubbing = [i for i, part in enumerate(plan.acting) if isinstance(part, PinFriction | GuideFriction)]
    coefficients = rows[rubbing, :2].copy()
    rows[rubbing, :2] = 0.0
    try:
        continued = None if expected is None else _continue_branch(plan, handle, position, load, expected)
        return continued or _find_equilibrium(plan, handle, position, load)
    finally:
        rows[rubbing, :2] = coefficients


def _continue_branch(
    plan: Plan, handle: Handle, position: np.ndarray, load: float, expected: np.ndarray
) -> StaticEquilibrium | None:
    """Return the stable equilibrium that Newton's method finds near the `expected` position; None if it may be another branch.

    The branch is the same if no mode changes and Newton's method moves by less than expected from `position`.
    """
    state = handle.content.state
    reference, mode = state.reference.copy(), state.mode.copy()
    descent = _Descent(plan, handle, expected, load)
    outcome, before = descent.implicit_step(STEP_MAX), np.inf
    while outcome == "solved" and descent.force < before:
        before, outcome = descent.force, descent.implicit_step(STEP_MAX)
    if outcome == "rest":
        descent.polish(STEP_MAX)
        change = float(np.linalg.norm(descent.state[: descent.free] - expected))
        growth = _growth(plan, handle, descent.state)[0]
        functions.accept(0.0, descent.state, handle.address, np.zeros(2))
        near = change <= float(np.linalg.norm(expected - position))
        if near and growth == 0.0 and np.array_equal(state.mode, mode):
            return StaticEquilibrium(descent.state[: descent.free].copy(), descent.load, growth)
    state.reference[:], state.mode[:] = reference, mode
    return None


def _find_equilibrium(plan: Plan, handle: Handle, position: np.ndarray, load: float) -> StaticEquilibrium:
    reference, mode = handle.content.state.reference.copy(), handle.content.state.mode.copy()
    try:
        descent = _descend(plan, handle, position, load)
    except InputError:
        handle.content.state.reference[:], handle.content.state.mode[:] = reference, mode
        stretched = _descend_with_soft_bars(plan, handle, position, load)
        if stretched is None:
            raise
        descent = stretched
    # at most three times: displace along the unstable mode, to the side that the descent came from, if there is one
    for _ in range(3):
        growth, motion = _growth(plan, handle, descent.state)
        side = float(motion @ (position - descent.state[: descent.free]))
        if growth == 0.0 or abs(side) < 1e-6 * descent.size:
            break
        before, reference = descent, handle.content.state.reference.copy()
        displaced = descent.state[: descent.free] + math.copysign(1e-3 * descent.size, side) * motion
        try:
            descent = _descend(plan, handle, displaced, descent.load)
        except InputError:
            descent = before
            handle.content.state.reference[:] = reference
            break
    functions.accept(0.0, descent.state, handle.address, np.zeros(2))
    return StaticEquilibrium(descent.state[: descent.free].copy(), descent.load, _growth(plan, handle, descent.state)[0])


def _descend(plan: Plan, handle: Handle, position: np.ndarray, load: float) -> _Descent:
    """Take steps from a position to an equilibrium; raise `InputError` if none is found."""
    descent, step = _Descent(plan, handle, position, load), 1e-3
    for _ in range(STEPS_MAX):
        outcome = descent.implicit_step(step)
        if outcome == "rest":
            descent.polish(step)
            return descent
        step = min(STEP_MAX, 3.0 * step) if outcome == "solved" else 0.2 * step
        if step < STEP_MIN or descent.displacement > DISPLACEMENT_MAX:
            break
    raise InputError(
        f"start = 'static': {descent.describe_failure(step)}",
        "a mechanism that gravity, springs and drives keep in equilibrium",
        "start = 'concentric'",
    )


def _descend_with_soft_bars(plan: Plan, handle: Handle, position: np.ndarray, load: float) -> _Descent | None:
    """Descend repeatedly while the reduced axial stiffness of thin bars is raised to its value; None if no bar is thin."""
    rows = handle.content.parameters.component
    bars = [(i, part) for i, part in enumerate(plan.components) if isinstance(part, Beam | FlexibleBar)]
    thinness = np.array([part.bending_stiffness / (part.axial_stiffness * part.length**2) for _, part in bars])
    soft = np.minimum(1.0, thinness / 1e-4)  # bars with a larger EI/(EA L^2) converge well
    if not np.any(soft < 1.0):
        return None
    column = [0 if isinstance(part, FlexibleBar) else 1 for _, part in bars]
    decades = math.ceil(-math.log10(soft.min()))
    try:
        for k in range(decades + 1):
            for (i, part), axial, factor in zip(bars, column, soft ** (1.0 - k / decades), strict=True):
                rows[i, axial] = part.axial_stiffness * factor
            descent = _descend(plan, handle, position, load)
            position = descent.state[: descent.free].copy()
    finally:
        for (i, part), axial in zip(bars, column, strict=True):
            rows[i, axial] = part.axial_stiffness
    return descent


def _growth(plan: Plan, handle: Handle, state: np.ndarray) -> tuple[float, np.ndarray]:
    """Return the growth rate of the fastest motion away from equilibrium [1/s], 0 if stable, and the motion's unit vector."""
    squares, motions = small_motions(StaticPosition(plan, handle, state))
    if squares.size == 0:
        return 0.0, np.zeros(motions.shape[0])
    unstable = squares[0] < -1e-12 * np.max(np.abs(squares))  # smaller ones are round-off
    return math.sqrt(-squares[0]) if unstable else 0.0, motions[:, 0]


class _Descent:
    """Descent of a mechanism from a first position to static equilibrium."""

    def __init__(self, plan: Plan, handle: Handle, position: np.ndarray, load: float) -> None:
        self.handle, self.free, self.first = handle, plan.coordinates.free, position
        self.system: System = handle.content
        self.internal = int(self.system.model.state_start[-1])
        self.state = np.concatenate([position, np.zeros(self.free + self.internal)])
        # the weight borne by ideal guides counts too: its component along them may be round-off
        inertia = math.sqrt(sum(body.mass for body in plan.bodies))
        self.load = load or plan.mechanism.gravity * inertia
        self.size = inertia * plan.coordinates.size
        self.force, self.scale = np.inf, self.load
        first = self.system.parameters.contact.size
        self.actuators = plan.actuators
        self.bars = [first + i for i, part in enumerate(plan.components) if isinstance(part, Beam | FlexibleBar)]
        # without weight the load may be zero, as for a servo on its reference; unbalanced forces are then round-off
        self.stiff = self.bars if self.load else list(range(first, first + len(plan.components)))
        self.roundings = 1.0 if self.load else UNLOADED_ROUND_OFF_FACTOR
        functions.accept(0.0, self.state, handle.address, np.zeros(2))  # turns are counted from the first position

    def implicit_step(self, step: float, max_corrections: int = 40) -> str:
        """Take an implicit Euler step from rest; return "rest" at equilibrium, "solved", or "rejected" if it was undone."""
        n, state = self.free, self.state
        base, turns, before, solved = state[:n].copy(), self.system.state.reference.copy(), self.force, False
        downhill: np.ndarray | None = None
        for _ in range(max_corrections):
            left = self.residual(base, step)
            downhill = left if downhill is None else downhill
            moved = float(np.linalg.norm(state[:n] - base))
            turned = float(np.abs(self.system.state.reference - turns).max(initial=0.0))
            # turns are counted from step to step: no body may turn by more than 1 rad
            if not (math.isfinite(self.force) and moved <= STEP_DISPLACEMENT_MAX * self.size and turned <= 1.0):
                break
            applied = float(np.linalg.norm(self.system.work.force[:n]))
            if not self.load:  # without weight the load is that of springs and forces at the first position
                self.load = applied
                if applied > self.force_round_off():
                    self.stiff, self.roundings = self.bars, 1.0
            self.scale = self.load + applied
            resting = self.force <= max(1e-9 * self.scale, self.force_round_off())  # tolerance: round-off of a stiff contact
            if (resting or solved) and float(downhill @ (state[:n] - base)) < -1e-3 * float(np.linalg.norm(downhill)) * moved:
                break  # a step against its initial forces, towards an unstable equilibrium
            if resting:
                return "rest"
            if solved and self.force <= 10.0 * before:
                return "solved"
            change = self.correction(left, step)
            if change is None:
                continue
            state[:n] += change
            # the residual normal to the constraints does not vanish, but the correction does
            moved = float(np.linalg.norm(state[:n] - base))
            if step >= STEP_MAX and moved <= 1e-14 * self.size:
                return "rest"
            solved = bool(np.linalg.norm(change) <= 0.01 * moved)
        state[:n], self.force = base, before
        self.system.state.reference[:] = turns
        return "rejected"

    def residual(self, base: np.ndarray, step: float) -> np.ndarray:
        """Move the state onto the constraints and return the residual of an implicit Euler step from coordinates `base`."""
        n, state, answer = self.free, self.state, np.zeros(2)
        rate, by_time = np.zeros(state.size), np.zeros(state.size)
        functions.accept(0.0, state, self.handle.address, answer)
        activate_closed_gaps(self.handle, state)
        functions.linearise(0.0, state, self.handle.address, rate, by_time)
        # no derivative gains: at rest they do not act, and would shorten Newton's corrections of a light cross-section
        blocks = self.system.model.block_start
        for i, _ in self.actuators:
            e = self.system.parameters.contact.size + i
            self.system.work.block_v[blocks[e] : blocks[e + 1]] = 0.0
        self.force = float(np.linalg.norm(rate[n : 2 * n]))
        # tangential part only: a correction across the constraints would be undone and spoil the convergence
        state[n : 2 * n] = (state[:n] - base) / step**2
        functions.accept(0.0, state, self.handle.address, answer)
        left = rate[n : 2 * n] - state[n : 2 * n]
        state[n : 2 * n] = 0.0
        return np.asarray(left)

    def correction(self, residual: np.ndarray, step: float) -> np.ndarray | None:
        """Return Newton's correction of the free coordinates for a residual; None if the matrix is singular."""
        change = np.concatenate([np.zeros(self.free), residual, np.zeros(self.internal)])
        # The step matrix keeps the second time derivatives of the constraints, and a long step would magnify the accelerations
        # of the unbalanced force and the round-off of the residual across the constraints. At rest gradients alone are kept.
        work = self.system.work
        work.direction_acceleration[:] = 0.0
        if functions.factorize(step, self.handle.address) >= 0:
            return None
        work.frozen_gradient[:] = 0.0
        functions.solve(change, self.handle.address)
        return change[: self.free]

    def polish(self, step: float, max_steps: int = 10, corrections: int = 3) -> None:
        """Refine the equilibrium by longer steps, until one neither halves the unbalanced force nor has vanishing corrections.

        The unbalanced force of thin bars is the round-off of their axial forces while bending is still far from equilibrium.
        """
        state, place = self.state, self.state[: self.free]
        for _ in range(max_steps):
            before, force, turns = place.copy(), self.force, self.system.state.reference.copy()
            step = min(STEP_MAX, 3.0 * step)
            left, moves = self.residual(before, step), list[float]()
            for _ in range(corrections):
                change = self.correction(left, step)
                if change is None or not np.linalg.norm(change) <= STEP_DISPLACEMENT_MAX * self.size:
                    break
                place += change
                left = self.residual(before, step)
                moves.append(float(np.linalg.norm(change)))
            converged = len(moves) == corrections and moves[-1] <= 0.01 * moves[0] and self.force <= self.force_round_off()
            if not (self.force < 0.5 * force or converged):
                place[:], self.force = before, force
                self.system.state.reference[:] = turns
                functions.accept(0.0, state, self.handle.address, np.zeros(2))
                return

    def force_round_off(self) -> float:
        """Return the round-off of the element forces [N]: with loads, of bars only, which are by far the stiffest."""
        X = self.system.work.X
        error = np.zeros(X.size)
        for e in self.stiff:
            columns, block = element_block(self.system, e)
            error[columns] += np.abs(block) @ np.abs(X[columns])
        return self.roundings * 2e-16 * float(np.linalg.norm(error))

    @property
    def displacement(self) -> float:
        """Distance from the first position, in mechanism sizes."""
        return float(np.linalg.norm(self.state[: self.free] - self.first)) / self.size

    def describe_failure(self, step: float) -> str:
        """Describe why no equilibrium was found."""
        if self.displacement > DISPLACEMENT_MAX:
            return (
                f"no equilibrium: nothing holds the mechanism, it moves away by more than {DISPLACEMENT_MAX:g} times its size"
            )
        left = "the first step cannot be solved"
        if math.isfinite(self.force):
            left = f"{self.force / self.scale:.2g} of the load is unbalanced"
        torques = self.system.work.result[:, 0]
        for i, part in self.actuators:
            limit = getattr(part.controller, "limit", None)
            if limit is not None and abs(torques[i]) >= limit:
                left += f"; actuator '{part.name}' is at its limit of {limit:g} N m"
        if step < STEP_MIN:
            return f"no equilibrium was found: the descent stops where forces jump or the position is singular ({left})"
        return (
            f"no equilibrium was found: after {STEPS_MAX} steps downhill, over {self.displacement:.2g} of its size, "
            f"the mechanism still moves ({left})"
        )


def keep_modes(before: System, system: System) -> None:
    """Start a search with the modes of the components at an earlier position: a folded tape spring stays folded."""
    first, earlier = system.parameters.contact.size, before.parameters.contact.size
    system.state.mode[first:] = before.state.mode[earlier:]


def activate_closed_gaps(handle: Handle, state: np.ndarray) -> None:
    """Set every contact and component whose gap is closed to active, at rest; latches stay inactive."""
    system: System = handle.content
    value = guard_values(handle, 0.0, state)
    system.state.mode[:] = value > 0.0
    system.state.mode[system.model.component_guard[system.model.latch[:, 2]]] = 0
    system.state.memory[:], system.state.mass[:] = 1.0, 0.0
    model, laws, contacts = system.model, system.parameters.law, system.parameters.contact.size
    lawful = np.flatnonzero(model.component_law >= 0)
    elements = np.append(np.arange(contacts), contacts + lawful)
    depths = np.append(value[:contacts], value[model.component_guard[lawful]])
    for j in np.flatnonzero(laws["settled"] * (depths > 0.0)):
        first, last = model.state_start[elements[j] : elements[j] + 2]
        states = state[2 * model.n :][first + laws["bristles"][j] : last]
        elastic = elastic_force(laws["stiffness"][j], depths[j], system.parameters.elastic[j])
        settled_states(laws["settled"][j], elastic, depths[j], states, system.parameters.damping[j])
