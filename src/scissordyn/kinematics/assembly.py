"""Assembly of a mechanism at t = 0: positions that close its loops and velocities that follow its drives."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from scissordyn.components.beam import Beam
from scissordyn.components.flexible_bar import FlexibleBar
from scissordyn.components.place import GROUND, Point
from scissordyn.errors import AssemblyError, InputError
from scissordyn.kinematics.given import Given, change_towards, given_places, given_speeds
from scissordyn.mechanics.system import System
from scissordyn.mechanics.time_function import function_at, prescribe
from scissordyn.model.mechanism import Mechanism
from scissordyn.plan.coordinates import Constraint, PointMap
from scissordyn.plan.elimination import in_words
from scissordyn.plan.gradients import Gradients, guesses, least_change
from scissordyn.plan.plan import Plan
from scissordyn.plan.plan import plan as make_plan
from scissordyn.plan.system import make_system
from scissordyn.tolerance import ROUND_OFF_TOL

IMPROVEMENT_FRACTION = 0.9  # Largest ratio of new to old position error at which the correction of an assembly continues


@dataclass(frozen=True)
class Start:
    """State of a mechanism at t = 0 that meets its constraints."""

    position: np.ndarray  # (n,) Free coordinates
    velocity: np.ndarray  # (n,) Rates of the free coordinates
    basis: tuple[np.ndarray, np.ndarray] | None = None  # `basis_at_start` if it is known


@dataclass(frozen=True)
class Held:
    """Vectors that have given values and rates during an assembly, in addition to the constraints of the mechanism."""

    names: list[str] = field(default_factory=list)  # Joints or rods of the vectors, for messages
    maps: list[PointMap] = field(default_factory=list)
    values: list[tuple[float, float]] = field(default_factory=list)
    rates: list[tuple[float, float]] = field(default_factory=list)
    # Lengths that are held during the assembly only: bars that bend start straight
    constraints: list[Constraint] = field(default_factory=list)
    # True if the assembly minimises the errors of the initial positions (places) or velocities (speeds) that bodies are given
    places: bool = False
    speeds: bool = False

    def add(
        self, name: str, vector: PointMap, value: tuple[float, float], rate: tuple[float, float], scale: float = 1.0
    ) -> None:
        """Hold one more vector; `scale` is its typical length [m]."""
        self.names.append(name)
        self.maps.append(PointMap(vector.columns, vector.rows / scale))
        self.values.append((value[0] / scale, value[1] / scale))
        self.rates.append((rate[0] / scale, rate[1] / scale))


_REFINED: ContextVar[bool] = ContextVar("refined", default=False)  # True if each assembly ends with one more Newton step


@contextmanager
def refined_assemblies() -> Iterator[None]:
    """Within the block, assemble to round-off, so that positions are smooth functions of the lengths of bars.

    Otherwise the number of Newton steps makes them jump by up to 1e-12.
    """
    before = _REFINED.set(True)
    try:
        yield
    finally:
        _REFINED.reset(before)


def basis_at_start(system: System, time: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Return the basis b(t) = (1, cos th_1, sin th_1, ...) of the drives and its rate at a time [s]."""
    work, numbers = system.work, system.parameters
    basis = np.empty_like(work.basis)
    prescribe(time, 0.0, numbers.motion, numbers.motion_start, basis, work.function_value)
    return basis[0], basis[1]


def whole_state(system: System, position: np.ndarray, velocity: np.ndarray | None = None) -> np.ndarray:
    """Return the state y, shape (ny,): free coordinates, their rates (0 if not given), and internal states of 0."""
    moving = np.zeros(position.size) if velocity is None else velocity
    return np.concatenate([position, moving, np.zeros(int(system.model.state_start[-1]))])


def placed_start(plan: Plan, system: System) -> Start:
    """Return the free coordinates and rates nearest to the placement and velocities of the bodies."""
    b, rate = basis_at_start(system)
    position, velocity = plan.coordinates.placed
    return Start(plan.coordinates.nearest(b, position), plan.coordinates.nearest(rate, velocity), (b, rate))


def natural_state(plan: Plan, system: System, start: Start) -> tuple[np.ndarray, np.ndarray]:
    """Return the natural coordinates and their rates for a start."""
    b, rate = start.basis or basis_at_start(system)
    matrix = plan.coordinates.matrix
    return matrix @ np.append(start.position, b), matrix @ np.append(start.velocity, rate)


def held_rods(plan: Plan, system: System, *, places: bool = False, speeds: bool = False) -> Held:
    """Return the vectors that the assembly holds for rods: the span of each rod whose initial direction is given."""
    holds = Held(places=places, speeds=speeds)
    rates = value_rates(system) if plan.rods else np.zeros(0)
    constraints = plan.coordinates.constraints
    for rod, k in zip(plan.rods, plan.maps.rod.tolist(), strict=True):
        if rod.direction is not None:
            length = math.sqrt(2.0 * constraints[k].value)
            cos, sin = math.cos(rod.direction), math.sin(rod.direction)
            speed = rates[k] / length
            holds.add(rod.name, constraints[k].parts[0][1], (length * cos, length * sin), (speed * cos, speed * sin))
    return holds


def assemble_as_placed(plan: Plan, system: System) -> Start:
    """Assemble the mechanism as near as possible to the placement of its bodies and to the given positions and speeds."""
    return assemble(plan, system, placed_start(plan, system), held_rods(plan, system, places=True, speeds=True))


def value_rates(system: System) -> np.ndarray:
    """Return the rates of all constraint values at t = 0."""
    model, numbers, work = system.model, system.parameters, system.work
    rates = np.zeros(work.value.shape[1])
    for k, which, unit, linear in zip(model.timed, model.timed_function, model.timed_unit, model.timed_linear, strict=True):
        function_at(0.0, numbers.motion[numbers.motion_start[which] : numbers.motion_start[which + 1]], work.function_value)
        rates[k] = unit * work.function_value[1]
        if not linear:
            rates[k] *= unit * work.function_value[0]
    return rates


def assemble(plan: Plan, system: System, guess: Start, held: Held) -> Start:
    """Return the state nearest to a guess that meets all constraints and the held vectors."""
    b, b_rate = guess.basis or basis_at_start(system)
    values, rates = (np.array(numbers, float).ravel() for numbers in (held.values, held.rates))
    # cases of a batch often differ in their speeds only, or in neither positions nor speeds
    places = given_places(plan) if held.places else None
    target = places and places.target.tobytes()
    key = guess.position.tobytes(), b.tobytes(), values.tobytes(), tuple(held.names), target, _REFINED.get()
    last = plan.answers.get("assembly")  # another thread may replace this entry
    if last is None or last[0] != key:
        velocities: dict[tuple[bytes | None, ...], np.ndarray] = {}
        last = plan.answers["assembly"] = key, *_closed_position(plan, b, guess.position, held, values, places), velocities
    _, x, jacobian, velocities = last
    active = [not constraint.latch for constraint in plan.coordinates.constraints]
    wanted = np.concatenate([value_rates(system)[active], rates]) if active else rates
    if held.constraints:
        wanted = np.concatenate([wanted[: wanted.size - rates.size], np.zeros(len(held.constraints)), rates])
    speeds = given_speeds(plan, np.append(x, b)) if held.speeds else None
    moving = guess.velocity.tobytes(), b_rate.tobytes(), wanted.tobytes(), speeds and speeds.target.tobytes()
    velocity = velocities.get(moving)
    if velocity is None:
        rows = jacobian[:, : plan.coordinates.free]
        velocity = guess.velocity - least_change(rows, jacobian @ np.append(guess.velocity, b_rate) - wanted)
        rates_of_all = np.append(velocity, b_rate)
        if speeds is not None and not speeds.is_met(rates_of_all):
            missed = speeds.misses(rates_of_all)
            change = change_towards(speeds, missed, rows, velocity.size)
            rates_of_all[: change.size] += change
            if np.linalg.norm(speeds.misses(rates_of_all)) < IMPROVEMENT_FRACTION * np.linalg.norm(missed):
                velocity = velocity + change
        if len(velocities) < 200:  # the velocities of a long chain take some hundred kilobytes
            velocities[moving] = velocity
    return Start(x.copy(), velocity.copy(), (b, b_rate))


def _closed_position(
    plan: Plan, b: np.ndarray, guess: np.ndarray, held: Held, values: np.ndarray, places: Given | None
) -> tuple[np.ndarray, Any]:
    """Return the closed position nearest to a guess or to given positions, and the gradients there."""
    constraints = [constraint for constraint in plan.coordinates.constraints if not constraint.latch] + held.constraints
    gradients = Gradients(plan.coordinates.free, plan.coordinates.basis, constraints, held.maps)
    worst: np.ndarray | None = None
    for first in guesses(plan.coordinates, b, guess):
        x, jacobian, residual = _close(gradients, first, b, values)
        if jacobian is None:
            worst = residual if worst is None else worst
        elif places is None or places.is_met(np.append(x, b)):
            return x, jacobian
        else:
            return _close_to(places, gradients, x, b, values) or (x, jacobian)
    assert worst is not None
    raise AssemblyError(
        f"the mechanism as placed cannot be assembled: {_describe_errors(plan, constraints, worst, held.names)}",
        "positions and angles at the start that are near a closed configuration",
    )


def _close(
    gradients: Gradients, x: np.ndarray, b: np.ndarray, values: np.ndarray, max_steps: int = 50
) -> tuple[np.ndarray, Any, np.ndarray]:
    """Close the mechanism from x by Newton's method; return position, gradients (None if it fails) and residual."""
    for _ in range(max_steps):
        full = np.append(x, b)
        residual = np.concatenate([gradients.residual(full), gradients.held @ full - values])
        jacobian = gradients.jacobian(full)
        # eight times round-off: short rods far from the origin cannot meet the tolerance
        if np.all(np.abs(residual) < np.maximum(ROUND_OFF_TOL, 8.0 * gradients.rounding(full))):
            if not _REFINED.get():
                return x, jacobian, residual
            x = x - least_change(jacobian[:, : x.size], residual)
            return x, gradients.jacobian(np.append(x, b)), residual
        x = x - least_change(jacobian[:, : x.size], residual)
    return x, None, residual


def _close_to(
    places: Given, gradients: Gradients, start: np.ndarray, b: np.ndarray, values: np.ndarray, max_steps: int = 50
) -> tuple[np.ndarray, Any] | None:
    """Move a closed position towards the given positions; return None if this brings it no nearer to them."""
    x, best, jacobian = start, start, None
    least = np.linalg.norm(places.misses(np.append(start, b)))
    for _ in range(max_steps):
        full = np.append(x, b)
        met, rows = places.is_met(full), gradients.jacobian(full)[:, : x.size]
        moved, closed, _ = _close(gradients, x + change_towards(places, places.misses(full), rows, x.size), b, values)
        if closed is None:
            break
        missed = np.linalg.norm(places.misses(np.append(moved, b)))
        if missed < IMPROVEMENT_FRACTION * least:
            best, jacobian, least = moved, closed, missed
        if met or np.max(np.abs(moved - x), initial=0.0) <= ROUND_OFF_TOL * np.max(np.abs(x), initial=0.0):
            break
        x = moved
    return None if jacobian is None else (best, jacobian)


def _describe_errors(plan: Plan, constraints: list[Any], residual: np.ndarray, held: list[str]) -> str:
    """Describe the constraints with the largest errors and the parts that hold their bodies."""
    count = len(constraints)
    errors = np.abs(residual)
    if np.argmax(errors) >= count:
        return f"joint '{held[(int(np.argmax(errors)) - count) // 2]}' cannot start at the required position"
    far = [constraints[k] for k in np.argsort(-errors[:count], kind="stable") if errors[k] > 0.01 * np.max(errors)]
    # name rods if there are any: their lengths can be changed, bodies are rigid
    rods = [constraint for constraint in far if constraint.name]
    subjects = [constraint.subject for constraint in rods or far]
    bodies = sorted({body for constraint in far for body in constraint.bodies if body != GROUND})
    at = " at " + in_words([f"body '{body}'" for body in bodies]) if rods else ""
    around = _names_of_holders(plan, set(bodies))
    by = f", held by {in_words(around)}" if around else ""
    return f"{in_words(subjects)} cannot keep the length{'s' if len(subjects) > 1 else ''} given{at}{by}"


def _names_of_holders(plan: Plan, bodies: set[str]) -> list[str]:
    """Return the names of the joints, guides, welds and drives of some bodies."""
    names = [f"joint '{joint.name}'" for joint in plan.mechanism.joints if bodies & set(joint.bodies)]
    names += [f"guide '{guide.name}'" for guide in plan.mechanism.guides if bodies & {guide.follower[0], guide.body}]
    names += [f"weld '{weld.name}'" for weld in plan.mechanism.welds if bodies & {weld.start[0], weld.end[0]}]
    return names + [f"the drive of body '{drive.body}'" for drive in plan.drives if drive.body in bodies]


def assembled_places(mechanism: Mechanism) -> dict[str, tuple[Point, float]]:
    """Return position [m] and angle [rad] of each body with ideal joints; empty if the mechanism cannot be assembled."""
    ideal = mechanism.ideal()
    # only bars that bend hold bodies in place; other components merely exert forces
    bent = tuple(part for part in ideal.components if isinstance(part, Beam | FlexibleBar))
    try:
        tables = make_plan(ideal.with_parts({"components": bent}))
        system = make_system(tables).content
        start = assemble_as_placed(tables, system)
    except InputError:
        return {}
    natural, _ = natural_state(tables, system, start)
    coordinates, places = tables.coordinates.natural, dict[str, tuple[Point, float]]()
    for body in mechanism.bodies:
        x, y = natural[coordinates.offsets[body.name] :][:2].tolist()
        places[body.name] = (x, y), coordinates.angle_of(body.name, natural)
    return places
