"""A consistent state at t = 0: bodies that close the mechanism, and velocities that its drives demand."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from scissordyn.components.beam import Beam
from scissordyn.components.flexible_bar import FlexibleBar
from scissordyn.components.place import GROUND, Point
from scissordyn.errors import InputError
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

CLOSED = 1e-12
ROUNDINGS = 8.0
"""Constraints are met to `CLOSED`, or to so many roundings of the coordinates, where short rods are far from the origin."""

MOST_STEPS = 50

MOST_VELOCITIES = 200
"""So many of the velocities at one position are kept: those of long chains take some hundred kilobytes each."""

NEARER = 0.9
"""Places and speeds are changed if that brings what is given of them nearer by a factor below this: else they are rounded."""

FAR = 0.01  # Errors above this fraction of the largest are named when a mechanism cannot be assembled


@dataclass(frozen=True)
class Start:
    """A consistent state of a mechanism at t = 0."""

    position: np.ndarray  # (n,) Free coordinates and their rates
    velocity: np.ndarray  # (n,)


@dataclass(frozen=True)
class Held:
    """Vectors that are to have given values at the start."""

    names: list[str] = field(default_factory=list)  # Joints or rods whose vectors they are, for messages
    maps: list[PointMap] = field(default_factory=list)
    values: list[tuple[float, float]] = field(default_factory=list)
    rates: list[tuple[float, float]] = field(default_factory=list)
    # Lengths that are kept at the start alone: bars that bend, straight
    constraints: list[Constraint] = field(default_factory=list)
    # Whether what the description gives of positions and of speeds is kept as far as all these admit it
    places: bool = False
    speeds: bool = False

    def add(
        self, name: str, vector: PointMap, value: tuple[float, float], rate: tuple[float, float], scale: float = 1.0
    ) -> None:
        """Hold one more vector; `scale` is the length by which it is of the order of one [m]."""
        self.names.append(name)
        self.maps.append(PointMap(vector.columns, vector.rows / scale))
        self.values.append((value[0] / scale, value[1] / scale))
        self.rates.append((rate[0] / scale, rate[1] / scale))


def basis_at_start(system: System, time: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """The basis b and its rate at t = 0, or at another time [s]."""
    work, numbers = system.work, system.parameters
    basis = np.empty_like(work.basis)
    prescribe(time, 0.0, numbers.motion, numbers.motion_start, basis, work.function_value)
    return basis[0], basis[1]


def whole_state(system: System, position: np.ndarray, velocity: np.ndarray | None = None) -> np.ndarray:
    """Free coordinates, their rates, at rest if not given, and internal states, which are zero at the start, shape (ny,)."""
    moving = np.zeros(position.size) if velocity is None else velocity
    return np.concatenate([position, moving, np.zeros(int(system.model.state_start[-1]))])


def placed_start(plan: Plan, system: System) -> Start:
    """The free coordinates nearest to where the user placed the bodies, and to how they move there."""
    b, rate = basis_at_start(system)
    position, velocity = plan.coordinates.placed
    return Start(plan.coordinates.nearest(b, position), plan.coordinates.nearest(rate, velocity))


def natural_state(plan: Plan, system: System, start: Start) -> tuple[np.ndarray, np.ndarray]:
    b, rate = basis_at_start(system)
    matrix = plan.coordinates.matrix
    return matrix @ np.append(start.position, b), matrix @ np.append(start.velocity, rate)


def held_rods(plan: Plan, system: System, *, places: bool = False, speeds: bool = False) -> Held:
    """Rods whose direction at the start is given are held there."""
    holds = Held(places=places, speeds=speeds)
    rates = value_rates(system)
    constraints = plan.coordinates.constraints
    for rod, k in zip(plan.rods, plan.maps.rod.tolist(), strict=True):
        if rod.direction is not None:
            length = math.sqrt(2.0 * constraints[k].value)
            cos, sin = math.cos(rod.direction), math.sin(rod.direction)
            speed = rates[k] / length
            holds.add(rod.name, constraints[k].parts[0][1], (length * cos, length * sin), (speed * cos, speed * sin))
    return holds


def assemble_as_placed(plan: Plan, system: System) -> Start:
    """The state nearest to the bodies as they are placed, on the drives and rods, with what is given of places and speeds."""
    return assemble(plan, system, placed_start(plan, system), held_rods(plan, system, places=True, speeds=True))


def value_rates(system: System) -> np.ndarray:
    """Rates of the values of all constraints at t = 0."""
    model, numbers, work = system.model, system.parameters, system.work
    rates = np.zeros(work.value.shape[1])
    for k, which, unit, linear in zip(model.timed, model.timed_function, model.timed_unit, model.timed_linear, strict=True):
        function_at(0.0, numbers.motion[numbers.motion_start[which] : numbers.motion_start[which + 1]], work.function_value)
        rates[k] = unit * work.function_value[1]
        if not linear:
            rates[k] *= unit * work.function_value[0]
    return rates


def assemble(plan: Plan, system: System, guess: Start, held: Held) -> Start:
    """The state nearest to a guess in which all constraints are met and some vectors have given values."""
    b, b_rate = basis_at_start(system)
    values, rates = (np.array(numbers, float).ravel() for numbers in (held.values, held.rates))
    # cases of a batch often differ in how fast the mechanism moves, not in where it is, or in neither
    places = given_places(plan) if held.places else None
    question = guess.position.tobytes(), b.tobytes(), values.tobytes(), tuple(held.names), places and places.target.tobytes()
    last = plan.answers.get("assembly")  # which another thread may replace
    if last is None or last[0] != question:
        velocities: dict[tuple[bytes | None, ...], np.ndarray] = {}
        last = plan.answers["assembly"] = question, *_closed(plan, b, guess.position, held, values, places), velocities
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
            if np.linalg.norm(speeds.misses(rates_of_all)) < NEARER * np.linalg.norm(missed):
                velocity = velocity + change
        if len(velocities) < MOST_VELOCITIES:
            velocities[moving] = velocity
    return Start(x.copy(), velocity.copy())


def _closed(
    plan: Plan, b: np.ndarray, guess: np.ndarray, held: Held, values: np.ndarray, places: Given | None
) -> tuple[np.ndarray, Any]:
    """The position nearest to a guess, or where places are given, in which all constraints are met, and the gradients there."""
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
    raise InputError(
        f"the mechanism as placed cannot be assembled: {_worst(plan, constraints, worst, held.names)}",
        "positions and angles at the start that are near a closed configuration",
    )


def _close(gradients: Gradients, x: np.ndarray, b: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, Any, np.ndarray]:
    """The position near x in which all constraints are met, the gradients there, None if there is none, and the residual."""
    for _ in range(MOST_STEPS):
        full = np.append(x, b)
        residual = np.concatenate([gradients.residual(full), gradients.held @ full - values])
        jacobian = gradients.jacobian(full)
        if np.all(np.abs(residual) < np.maximum(CLOSED, ROUNDINGS * gradients.rounding(full))):
            return x, jacobian, residual
        x = x - least_change(jacobian[:, : x.size], residual)
    return x, None, residual


def _close_to(
    places: Given, gradients: Gradients, start: np.ndarray, b: np.ndarray, values: np.ndarray
) -> tuple[np.ndarray, Any] | None:
    """The position in which the constraints are met that misses given places least, from one near; None if none is nearer."""
    x, best, jacobian = start, start, None
    least = np.linalg.norm(places.misses(np.append(start, b)))
    for _ in range(MOST_STEPS):
        full = np.append(x, b)
        met, rows = places.is_met(full), gradients.jacobian(full)[:, : x.size]
        moved, closed, _ = _close(gradients, x + change_towards(places, places.misses(full), rows, x.size), b, values)
        if closed is None:
            break
        missed = np.linalg.norm(places.misses(np.append(moved, b)))
        if missed < NEARER * least:
            best, jacobian, least = moved, closed, missed
        if met or np.max(np.abs(moved - x), initial=0.0) <= CLOSED * np.max(np.abs(x), initial=0.0):
            break
        x = moved
    return None if jacobian is None else (best, jacobian)


def _worst(plan: Plan, constraints: list[Any], residual: np.ndarray, held: list[str]) -> str:
    """What is furthest from being kept, and what holds it: where the search ends, the errors are the contradiction."""
    count = len(constraints)
    errors = np.abs(residual)
    if np.argmax(errors) >= count:
        return f"joint '{held[(int(np.argmax(errors)) - count) // 2]}' cannot be held where it should start"
    far = [constraints[k] for k in np.argsort(-errors[:count], kind="stable") if errors[k] > FAR * np.max(errors)]
    rods = [constraint for constraint in far if constraint.name]  # bodies are rigid: a rod is what can be changed
    subjects = [constraint.subject for constraint in rods or far]
    bodies = sorted({body for constraint in far for body in constraint.bodies if body != GROUND})
    at = " at " + in_words([f"body '{body}'" for body in bodies]) if rods else ""
    around = _holding(plan, set(bodies))
    by = f", held by {in_words(around)}" if around else ""
    return f"{in_words(subjects)} cannot keep the length{'s' if len(subjects) > 1 else ''} given{at}{by}"


def _holding(plan: Plan, bodies: set[str]) -> list[str]:
    """The joints, guides, welds and drives at some bodies."""
    names = [f"joint '{joint.name}'" for joint in plan.mechanism.joints if bodies & set(joint.bodies)]
    names += [f"guide '{guide.name}'" for guide in plan.mechanism.guides if bodies & {guide.follower[0], guide.body}]
    names += [f"weld '{weld.name}'" for weld in plan.mechanism.welds if bodies & {weld.start[0], weld.end[0]}]
    return names + [f"the drive of body '{drive.body}'" for drive in plan.drives if drive.body in bodies]


def assembled_places(mechanism: Mechanism) -> dict[str, tuple[Point, float]]:
    """Position [m] and angle [rad] of each body with ideal joints; none if it cannot be assembled, which a run says."""
    ideal = mechanism.ideal()
    # what exerts forces holds no place, and a roller may run along a bar that is not yet there
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
