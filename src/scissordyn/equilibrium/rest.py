"""Static equilibrium of a mechanism under gravity, springs and loads, its stiffness and the motions its constraints allow."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from scissordyn.components.beam import Beam
from scissordyn.components.flexible_bar import FlexibleBar
from scissordyn.components.guide_friction import GuideFriction
from scissordyn.components.pin_friction import PinFriction
from scissordyn.components.place import GROUND
from scissordyn.errors import InputError
from scissordyn.integrate.integration import Samples
from scissordyn.kernel import Handle
from scissordyn.kinematics.assembly import Start, natural_state
from scissordyn.laws.evaluate import elastic_force, settled_states
from scissordyn.mechanics import functions
from scissordyn.mechanics.constraint_part import part_curvature
from scissordyn.mechanics.outputs import Record, record
from scissordyn.mechanics.system import System
from scissordyn.plan.plan import Plan
from scissordyn.plan.system import guard_values

INDEPENDENT = 1e-9  # Singular values of the constraints' gradients below this part of the largest count as zero

AT_REST = 1e-9
"""Unbalanced force, relative to the load, below which a mechanism is in equilibrium: the round-off of a stiff contact."""

STILL = 1e-14  # A step of the coordinates, relative to the mechanism's size, below which they are equilibrium to round-off
LONGEST = 1e4  # Step [s] from which the iteration is Newton's method

MOST_STEPS = 5000
MOST_CORRECTIONS = 40

SOLVED = 0.01  # An implicit step has converged when a correction is this fraction of the step

MOST_POLISHING, POLISHING, POLISHED = 10, 3, 0.5
"""At rest, so many steps more at most, of so many corrections, as long as each reduces the unbalanced force to this part."""

AWAY = 100.0  # Sizes of the mechanism: nothing restrains what has moved farther

ASIDE, NO_SIDE, MOST_SIDES = 1e-3, 1e-6, 3
"""From unstable equilibrium a descent goes on so far aside, in sizes of the mechanism, unless it came from no side."""

ROUND_OFF = 1e-12  # Negative stiffnesses below this part of the largest are round-off
EASY = 1e-4  # EI/(EA L^2) from which bars bend far without trouble
ROUNDING = 2e-16  # Of a coordinate, relative to it
UNLOADED = 100.0  # So many of these where nothing weighs: angles and references are rounded, too
FIRST_STEP, SHORTEST = 1e-3, 1e-9  # Step [s] to begin with, and below which the iteration is given up

FARTHEST, MOST_TURN = 0.3, 1.0
"""A step moves the mechanism by less than this fraction of its size, and turns no body farther than this [rad]: turns are
counted from one step to the next."""

AGAINST = 1e-3  # A step against the forces that it starts from, by more than this cosine, is rejected
MOST_GROWTH = 10.0  # An implicit step that increases the force by more than this factor is rejected


class At(NamedTuple):
    """A mechanism at rest at a position, evaluated there."""

    plan: Plan
    system: Handle
    state: np.ndarray

    @property
    def natural(self) -> np.ndarray:
        n = self.plan.coordinates.free
        return natural_state(self.plan, self.system.content, Start(self.state[:n], 0.0 * self.state[:n]))[0]

    @property
    def turned(self) -> dict[str, float]:
        """By how much each body has turned [rad]."""
        return turns(self.plan, self.system.content)

    def record(self) -> Record:
        """Everything there."""
        state = self.system.content.state
        rows = (part[None].copy() for part in (state.mode, state.memory, state.reference))
        return record(self.plan.maps, self.system, Samples(np.zeros(1), self.state[None], np.zeros((1, 0)), *rows))


def stiffness(at: At) -> tuple[np.ndarray, np.ndarray]:
    """Stiffness in the free coordinates, shape (n, n), and an orthonormal basis of the motions that the constraints allow."""
    matrix = force_slopes(at)
    gradients, curved = constraint_slopes(at, at.system.content.work.multiplier)
    matrix += curved
    return 0.5 * (matrix + matrix.T), free_directions(gradients)


def free_directions(gradients: np.ndarray) -> np.ndarray:
    """Orthonormal basis, in columns, of what constraints with these gradients, in rows, leave."""
    _, sizes, basis = np.linalg.svd(gradients)
    rank = int(np.sum(sizes > INDEPENDENT * max(sizes.max(initial=0.0), 1.0)))
    return basis[rank:].T


def force_slopes(at: At, time: float = 0.0) -> np.ndarray:
    """Minus the derivatives of the forces by the free coordinates; evaluates everything at the position."""
    content = at.system.content
    n, contacts = content.model.n, content.parameters.contact.size
    y = at.state.copy()
    y[n : 2 * n] = 0.0
    rate, by_time = np.zeros(y.size), np.zeros(y.size)
    functions.activate(at.system.address)
    functions.linearise(time, y, at.system.address, rate, by_time)
    matrix = np.zeros((n, n))
    for e in range(content.model.element_start.size - 1):
        if e < contacts and content.state.mode[e] != 1:
            continue
        columns, block = element_block(content, e)
        free = columns < n
        matrix[np.ix_(columns[free], columns[free])] -= block[np.ix_(free, free)]
    return matrix


def element_block(content: System, e: int) -> tuple[np.ndarray, np.ndarray]:
    """The coordinates that an element acts on, and the derivatives of its forces by them; contacts come first."""
    model, start = content.model, content.model.block_start[e]
    columns = model.element_column[model.element_start[e] : model.element_start[e + 1]]
    return columns, content.work.block_x[start : start + columns.size**2].reshape(columns.size, columns.size)


def component_maps(content: System, i: int) -> tuple[np.ndarray, np.ndarray]:
    """The maps of component i, shape (6,), and their derivatives by the free coordinates, shape (6, n)."""
    model, X = content.model, content.work.X
    e = content.parameters.contact.size + i
    first, last = model.element_start[e], model.element_start[e + 1]
    rows = np.zeros((6, X.size))
    rows[:, model.element_column[first:last]] = model.element_row[:, first:last]
    return rows @ X, rows[:, : model.n]


def constraint_slopes(at: At, multiplier: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Gradients of the constraints at a position that has been evaluated, and the stiffness of some multipliers of theirs."""
    model, work, n = at.system.content.model, at.system.content.work, at.system.content.model.n
    gradients, curved = np.zeros((multiplier.size, n)), np.zeros((n, n))
    for p in range(model.part_constraint.size):
        first, last = model.part_start[p], model.part_start[p + 1]
        k, columns = model.part_constraint[p], model.constraint_column[first:last]
        free = columns < n
        rows = model.constraint_row[:, first:last][:, free]
        bent = np.stack(part_curvature(model.part_reference[p], *work.direction[p], *rows))
        curved[np.ix_(columns[free], columns[free])] += multiplier[k] * work.part_weight[p] * rows.T @ bent
        gradients[k, columns[free]] += work.gradient[first:last][free]
    return gradients, curved


class Rest(NamedTuple):
    position: np.ndarray  # (n,) Free coordinates
    load: float  # That unbalanced forces were compared with
    growth: float  # Rate at which the smallest motion away from it grows [rad/s]; 0 where it is stable


def equilibrium(plan: Plan, handle: Handle, position: np.ndarray, load: float = 0.0) -> Rest:
    """A stable equilibrium, by descent from a given position; an unstable one only where nothing decides for a side.

    Pseudo-transient continuation: implicit Euler steps from rest, each solved by Newton's method, with a step size that grows
    as long as it converges, so that the iteration tends to Newton's method. Steps from rest reduce the potential energy, and so
    lead to stable equilibrium, but for long ones. From unstable equilibrium the descent goes on, to the side that it came
    from. Where it fails, thin bars are first taken as ones that stretch more easily.

    References
    ----------
    Kelley and Keyes 1998, doi:10.1137/S0036142996304796
    """
    # friction in ideal joints exerts nothing at rest, and would slow the descent down: its coefficients come first
    rows = handle.content.parameters.component
    rubbing = [i for i, part in enumerate(plan.acting) if isinstance(part, PinFriction | GuideFriction)]
    coefficients = rows[rubbing, :2].copy()
    rows[rubbing, :2] = 0.0
    try:
        return _equilibrium(plan, handle, position, load)
    finally:
        rows[rubbing, :2] = coefficients


def _equilibrium(plan: Plan, handle: Handle, position: np.ndarray, load: float) -> Rest:
    reference = handle.content.state.reference.copy()
    try:
        descent = _descended(plan, handle, position, load)
    except InputError:
        handle.content.state.reference[:] = reference
        stretched = _stretched(plan, handle, position, load)
        if stretched is None:
            raise
        descent = stretched
    for _ in range(MOST_SIDES):
        growth, motion = _growth(plan, handle, descent.state)
        side = float(motion @ (position - descent.state[: descent.free]))
        if growth == 0.0 or abs(side) < NO_SIDE * descent.size:
            break
        before, reference = descent, handle.content.state.reference.copy()
        displaced = descent.state[: descent.free] + math.copysign(ASIDE * descent.size, side) * motion
        try:
            descent = _descended(plan, handle, displaced, descent.load)
        except InputError:
            descent = before
            handle.content.state.reference[:] = reference
            break
    functions.accept(0.0, descent.state, handle.address, np.zeros(2))
    return Rest(descent.state[: descent.free].copy(), descent.load, _growth(plan, handle, descent.state)[0])


def _descended(plan: Plan, handle: Handle, position: np.ndarray, load: float) -> _Descent:
    descent, step = _Descent(plan, handle, position, load), FIRST_STEP
    for _ in range(MOST_STEPS):
        outcome = descent.implicit_step(step)
        if outcome == "rest":
            descent.polish(step)
            return descent
        step = min(LONGEST, 3.0 * step) if outcome == "solved" else 0.2 * step
        if step < SHORTEST or descent.gone > AWAY:
            break
    raise InputError(
        f"start = 'static': {descent.failure(step)}",
        "a mechanism that gravity, springs and drives keep in equilibrium",
        "start = 'concentric'",
    )


def _stretched(plan: Plan, handle: Handle, position: np.ndarray, load: float) -> _Descent | None:
    """A descent with thin bars of less axial stiffness, which then grows to its value; None without thin bars."""
    rows = handle.content.parameters.component
    bars = [(i, part) for i, part in enumerate(plan.components) if isinstance(part, Beam | FlexibleBar)]
    thinness = np.array([part.bending_stiffness / (part.axial_stiffness * part.length**2) for _, part in bars])
    soft = np.minimum(1.0, thinness / EASY)
    if not np.any(soft < 1.0):
        return None
    column = [0 if isinstance(part, FlexibleBar) else 1 for _, part in bars]
    decades = math.ceil(-math.log10(soft.min()))
    try:
        for k in range(decades + 1):
            for (i, part), axial, factor in zip(bars, column, soft ** (1.0 - k / decades), strict=True):
                rows[i, axial] = part.axial_stiffness * factor
            descent = _descended(plan, handle, position, load)
            position = descent.state[: descent.free].copy()
    finally:
        for (i, part), axial in zip(bars, column, strict=True):
            rows[i, axial] = part.axial_stiffness
    return descent


def _growth(plan: Plan, handle: Handle, state: np.ndarray) -> tuple[float, np.ndarray]:
    """Rate at which the fastest motion away from equilibrium grows [rad/s], 0 if none does, and that motion, of length one."""
    at = At(plan, handle, state)
    matrix, allowed = stiffness(at)
    if allowed.shape[1] == 0:
        return 0.0, np.zeros(state.size)[: allowed.shape[0]]
    values, vectors = np.linalg.eigh(allowed.T @ matrix @ allowed)
    unstable = values[0] < -ROUND_OFF * np.max(np.abs(values))
    return math.sqrt(-values[0]) if unstable else 0.0, allowed @ vectors[:, 0]


class _Descent:
    """A mechanism at rest on its way to equilibrium."""

    def __init__(self, plan: Plan, handle: Handle, position: np.ndarray, load: float) -> None:
        self.handle, self.free, self.first = handle, plan.coordinates.free, position
        self.system: System = handle.content
        self.internal = int(self.system.model.state_start[-1])
        self.state = np.concatenate([position, np.zeros(self.free + self.internal)])
        # the weight that ideal guides bear counts, too: the part along them may be round-off only
        inertia = math.sqrt(sum(body.mass for body in plan.bodies))
        self.load = load or plan.mechanism.gravity * inertia
        self.size = inertia * plan.coordinates.size
        self.force, self.scale = np.inf, self.load
        first = self.system.parameters.contact.size
        self.actuators = plan.actuators
        self.bars = [first + i for i, part in enumerate(plan.components) if isinstance(part, Beam | FlexibleBar)]
        # without weight there may be no load at all, as of a servo on its reference: what is left of all forces is round-off
        self.stiff = self.bars if self.load else list(range(first, first + len(plan.components)))
        self.roundings = 1.0 if self.load else UNLOADED
        functions.accept(0.0, self.state, handle.address, np.zeros(2))  # turns are counted from where it begins

    def implicit_step(self, step: float) -> str:
        """A step of implicit Euler from rest: "rest" found, "solved", or "left", back where it began."""
        n, state = self.free, self.state
        base, turns, before, solved = state[:n].copy(), self.system.state.reference.copy(), self.force, False
        downhill: np.ndarray | None = None
        for _ in range(MOST_CORRECTIONS):
            left = self.unbalanced(base, step)
            downhill = left if downhill is None else downhill
            moved = float(np.linalg.norm(state[:n] - base))
            turned = float(np.abs(self.system.state.reference - turns).max(initial=0.0))
            if not (math.isfinite(self.force) and moved <= FARTHEST * self.size and turned <= MOST_TURN):
                break
            applied = float(np.linalg.norm(self.system.work.force[:n]))
            if not self.load:  # without weight, what springs and forces exert where it begins
                self.load = applied
                if applied > self.rounding():
                    self.stiff, self.roundings = self.bars, 1.0
            self.scale = self.load + applied
            resting = self.force <= max(AT_REST * self.scale, self.rounding())
            if (resting or solved) and float(downhill @ (state[:n] - base)) < -AGAINST * float(
                np.linalg.norm(downhill)
            ) * moved:
                break  # uphill, to an equilibrium that is not stable
            if resting:
                return "rest"
            if solved and self.force <= MOST_GROWTH * before:
                return "solved"
            change = self.correction(left, step)
            if change is None:
                continue
            state[:n] += change
            # the residual normal to the constraints does not vanish, the correction does
            moved = float(np.linalg.norm(state[:n] - base))
            if step >= LONGEST and moved <= STILL * self.size:
                return "rest"
            solved = bool(np.linalg.norm(change) <= SOLVED * moved)
        state[:n], self.force = base, before
        self.system.state.reference[:] = turns
        return "left"

    def unbalanced(self, base: np.ndarray, step: float) -> np.ndarray:
        """What is left of the equations of a step from `base`, where it is brought back to its constraints."""
        n, state, answer = self.free, self.state, np.zeros(2)
        rate, by_time = np.zeros(state.size), np.zeros(state.size)
        functions.accept(0.0, state, self.handle.address, answer)
        touch_closed(self.handle, state)
        functions.linearise(0.0, state, self.handle.address, rate, by_time)
        # forces are those at rest: a derivative gain would keep Newton's corrections of a light cross-section short
        blocks = self.system.model.block_start
        for i, _ in self.actuators:
            e = self.system.parameters.contact.size + i
            self.system.work.block_v[blocks[e] : blocks[e + 1]] = 0.0
        self.force = float(np.linalg.norm(rate[n : 2 * n]))
        # only what is tangent to the constraints: a correction across them would be undone, and spoil convergence
        state[n : 2 * n] = (state[:n] - base) / step**2
        functions.accept(0.0, state, self.handle.address, answer)
        left = rate[n : 2 * n] - state[n : 2 * n]
        state[n : 2 * n] = 0.0
        return np.asarray(left)

    def correction(self, left: np.ndarray, step: float) -> np.ndarray | None:
        """Newton's correction of the coordinates, None from a singular matrix."""
        change = np.concatenate([np.zeros(self.free), left, np.zeros(self.internal)])
        if functions.factorize(step, self.handle.address) >= 0:
            return None
        functions.solve(change, self.handle.address)
        return change[: self.free]

    def polish(self, step: float) -> None:
        """Go on with longer steps as long as they reduce the unbalanced force."""
        state, place = self.state, self.state[: self.free]
        for _ in range(MOST_POLISHING):
            before, force, turns = place.copy(), self.force, self.system.state.reference.copy()
            step = min(LONGEST, 3.0 * step)
            left = self.unbalanced(before, step)
            for _ in range(POLISHING):
                change = self.correction(left, step)
                if change is None or not np.linalg.norm(change) <= FARTHEST * self.size:
                    break
                place += change
                left = self.unbalanced(before, step)
            if not self.force < POLISHED * force:
                place[:], self.force = before, force
                self.system.state.reference[:] = turns
                functions.accept(0.0, state, self.handle.address, np.zeros(2))
                return

    def rounding(self) -> float:
        """What the rounding of coordinates makes of the forces of elements; with a load only of bars, the stiffest by far."""
        X = self.system.work.X
        error = np.zeros(X.size)
        for e in self.stiff:
            columns, block = element_block(self.system, e)
            error[columns] += np.abs(block) @ np.abs(X[columns])
        return self.roundings * ROUNDING * float(np.linalg.norm(error))

    @property
    def gone(self) -> float:
        """How far it is from where it began, in sizes of the mechanism."""
        return float(np.linalg.norm(self.state[: self.free] - self.first)) / self.size

    def failure(self, step: float) -> str:
        if self.gone > AWAY:
            return f"no equilibrium: nothing holds the mechanism, which moves away by {AWAY:g} times its size and farther"
        left = "the first step cannot be solved"
        if math.isfinite(self.force):
            left = f"{self.force / self.scale:.2g} of the load is unbalanced"
        torques = self.system.work.result[:, 0]
        for i, part in self.actuators:
            limit = getattr(part.controller, "limit", None)
            if limit is not None and abs(torques[i]) >= limit:
                left += f"; actuator '{part.name}' is at its limit of {limit:g} N m"
        if step < SHORTEST:
            return f"no equilibrium was found: the descent ends where forces jump or the position is singular ({left})"
        return (
            f"no equilibrium was found: after {MOST_STEPS} steps downhill, over {self.gone:.2g} of its size, the mechanism "
            f"still moves ({left})"
        )


def turns(plan: Plan, system: System) -> dict[str, float]:
    """By how much each body has turned from where it was placed, full turns included [rad]."""
    maps, placed = plan.maps, plan.angles
    change = np.append(system.state.reference - placed, 0.0)[: len(plan.coordinates.families)]
    angles = dict.fromkeys((GROUND, *(body.name for body in plan.bodies)), 0.0)
    for b, body in enumerate(plan.bodies):
        if maps.rotation[b] >= 0:
            angles[body.name] = float(maps.sense[b] * change[maps.rotation[b]])
    return angles


def count_turns(plan: Plan, system: System, turned: Mapping[str, float]) -> None:
    """Let a system count turns from where its bodies have turned to, as `turns` tells for another one.

    Angles are known up to full turns, and an angular spring that is taken for one a turn off pulls the wrong way.
    """
    state, model = system.state, system.model
    state.reference[:] = plan.angles
    for k, family in enumerate(plan.coordinates.families):
        state.reference[k] += turned[family.bodies[0]]
    for i, component in enumerate(plan.acting):
        if model.reference_of[i] >= 0:
            (body, _), (base, _) = component.declaration.port.ends(component)
            state.reference[model.reference_of[i]] += turned[body] - turned[base]
    turning = [body for constraint in plan.coordinates.constraints for body, _ in constraint.turning]
    for k, body in enumerate(turning, state.reference.size - len(turning)):
        state.reference[k] += turned.get(body, 0.0)


def touch_closed(handle: Handle, state: np.ndarray) -> None:
    """Let every contact and component whose gap is closed at rest act, but for latches."""
    system: System = handle.content
    value = guard_values(handle, 0.0, state)
    system.state.mode[:] = value > 0.0
    system.state.mode[system.model.component_guard[system.model.latch[:, 2]]] = 0
    system.state.memory[:] = 1.0
    model, laws = system.model, system.parameters.law
    for j in np.flatnonzero(laws["settled"] * (value[: laws.size] > 0.0)):
        states = state[2 * model.n :][model.state_start[j] + laws["bristles"][j] : model.state_start[j + 1]]
        elastic = elastic_force(laws["stiffness"][j], value[j], system.parameters.elastic[j])
        settled_states(laws["settled"][j], elastic, value[j], states, system.parameters.damping[j])
