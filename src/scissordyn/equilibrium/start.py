"""Initial state of a run: journals concentric, in contact or as placed, or the whole mechanism in static equilibrium."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from scissordyn.components.force import Force
from scissordyn.components.place import GROUND
from scissordyn.components.torque import Torque
from scissordyn.equilibrium.cause import check_zero_lengths, full_coordinates
from scissordyn.equilibrium.rest import StaticEquilibrium, equilibrium, keep_modes
from scissordyn.equilibrium.static_position import StaticPosition, count_turns, turns
from scissordyn.errors import InputError
from scissordyn.integrate.integration import LOG_COLUMNS, RESET_DATA, RISE
from scissordyn.kernel import Handle
from scissordyn.kinematics.assembly import (
    Held,
    Start,
    assemble,
    assemble_as_placed,
    basis_at_start,
    held_rods,
    natural_state,
    placed_start,
    whole_state,
)
from scissordyn.kinematics.given import prescribed_bodies
from scissordyn.laws.damping.proportional import DampingFactor
from scissordyn.laws.evaluate import elastic_energy, elastic_force
from scissordyn.mechanics import functions
from scissordyn.mechanics.contour import place_under, turned_contours
from scissordyn.mechanics.hard_contour import opened_contour, place_on
from scissordyn.mechanics.reactions import solve_reactions
from scissordyn.mechanics.system import APPROACH_FLOOR, System
from scissordyn.mechanics.time_function import function_at
from scissordyn.model.check import body_proportions, motionless, proportion_warnings
from scissordyn.model.options import StartKind
from scissordyn.plan.acting import start_coordinates
from scissordyn.plan.bending import beams_of, is_straight, straight_bar, straight_maps
from scissordyn.plan.coordinates import combined
from scissordyn.plan.elimination import in_words
from scissordyn.plan.hard_contact import elastic_law
from scissordyn.plan.plan import Plan
from scissordyn.plan.rest import plan_at_rest
from scissordyn.plan.system import guard_values, make_system
from scissordyn.record.bars import with_distributed_mass
from scissordyn.tolerance import REPORTED_FRACTION, ROUND_OFF_TOL


@dataclass(frozen=True)
class Prepared:
    """Initial state of a run with its events and warnings."""

    y: np.ndarray  # (ny,)
    initial_events: tuple[list[float], ...]  # Onsets of contacts and components that act from the start
    warnings: tuple[str, ...]


def prepare_start(plan: Plan, system: Handle, kind: StartKind) -> Prepared:
    """Compute the initial state of a run."""
    content = system.content
    guess, holds = placed_start(plan, content), held_rods(plan, content, places=True, speeds=True)
    _hold_references(plan, content, holds)
    warnings: list[str] = []
    if kind != "static":
        _hold_straight(plan, holds, moving=kind == "as-placed")
    match kind:
        case "as-placed":
            start = assembled = assemble(plan, content, guess, holds)
        case "in-contact" if plan.contacts:
            assembled = _assemble_concentric(plan, content, guess, holds)
            start = _assemble_in_contact(plan, content, assembled)
        case "static":
            place, turned, growth = _static_position(plan)
            if growth > 0.0:
                warnings.append(
                    f"start = 'static' is an unstable equilibrium: a small displacement grows by e in {1.0 / growth:.3g} s"
                )
            count_turns(plan, content, turned)
            assembled = _assemble_concentric(plan, content, guess, holds)
            resting, full = Held(), np.append(place, basis_at_start(content)[0])
            journals = [plan.eccentricity(j).at(full) for j in range(len(plan.mechanism.clearance_joints))]
            _hold_journals(plan, resting, np.array(journals).reshape(-1, 2))
            start = assemble(plan, content, Start(place, guess.velocity * 0.0), resting)
        case _:
            start = assembled = _assemble_concentric(plan, content, guess, holds)
    natural = natural_state(plan, content, start)
    placed = natural if assembled is start else natural_state(plan, content, assembled)
    warnings += _describe_moved(plan, placed[0])
    warnings += _describe_changed_speeds(plan, content, start, natural[1], kind)
    warnings += _describe_sudden_loads(plan, kind)
    bodies = plan.table("proportions", lambda: body_proportions(plan.mechanism))
    warnings += [*motionless(plan.mechanism), *proportion_warnings(plan.mechanism, bodies), *plan.rounded_lengths]
    y = whole_state(content, start.position, start.velocity)
    if plan.components:
        check_zero_lengths(plan, full_coordinates(plan, content, y, 0.0))
    events = _activate_closed(plan, system, y, kind)
    _store_energy(plan, system, y)
    return Prepared(y, tuple(events), tuple(warnings))


def _describe_sudden_loads(plan: Plan, kind: StartKind) -> list[str]:
    """Return a warning if bars start straight although loads would bend them, so that the loads act suddenly."""
    coordinates = plan.coordinates
    loads = ["their weight"] if np.any(plan.gravity_vector) else []
    loads += [
        f"{part.declaration.label} '{part.name}'"
        for part in plan.components
        if isinstance(part, Force | Torque) and part.time_function is None and np.any(part.parameters((0.0,)))
    ]
    straight = any(is_straight(axis, coordinates.placed[0]) for axis in coordinates.natural.axes)
    if kind == "static" or not loads or not (straight or any(beams_of(plan.mechanism))) or not _is_held(plan):
        return []
    return [
        f"start = '{kind}' begins with bars that are not bent by {in_words(loads)}: the load acts on them suddenly, they swing "
        "about their equilibrium, and the largest deflections, stresses and forces may belong to this start; start = 'static' "
        "begins in equilibrium"
    ]


def _is_held(plan: Plan) -> bool:
    """Return True if the mechanism could not move with rigid bars, because drives, servos or joints hold it."""
    axes = plan.coordinates.natural.axes
    # a bar has two coordinates for each shape, a chain three for each node; three of them move it as a rigid body
    bends = sum(2 * axis.shapes.count - 3 for axis in axes) + 3 * len(beams_of(plan.mechanism))
    moves = plan.coordinates.free - len(plan.coordinates.constraints)
    return bool(plan.motions or plan.actuators) or moves <= bends


def _assemble_concentric(plan: Plan, system: System, guess: Start, holds: Held) -> Start:
    """Return the start state with every journal at the centre of its bearing."""
    if plan.mechanism.contact_points:  # an ideal guide keeps its follower on a line, its contact points do not
        ideal = plan.ideal
        handle = make_system(ideal)
        holds = held_rods(ideal, handle.content, places=True, speeds=True)
        _hold_straight(ideal, holds)
        _hold_references(ideal, handle.content, holds)
        start = assemble(ideal, handle.content, placed_start(ideal, handle.content), holds)
        return _nearest(plan, system, natural_state(ideal, handle.content, start))
    _hold_journals(plan, holds, np.zeros((len(plan.mechanism.clearance_joints), 2)))
    return assemble(plan, system, guess, holds)


def _nearest(plan: Plan, system: System, natural: tuple[np.ndarray, np.ndarray]) -> Start:
    """Return the free coordinates and rates nearest to natural coordinates and their rates."""
    (b, rate), (position, velocity) = basis_at_start(system), natural
    return Start(plan.coordinates.nearest(b, position), plan.coordinates.nearest(rate, velocity))


def _hold_journals(plan: Plan, holds: Held, eccentricities: np.ndarray) -> None:
    """Hold each journal at rest at an eccentricity, shape (nj, 2) [m]."""
    for j, joint in enumerate(plan.mechanism.clearance_joints):
        holds.add(joint.name, plan.eccentricity(j), tuple(eccentricities[j]), (0.0, 0.0), plan.coordinates.size)


def _assemble_in_contact(plan: Plan, system: System, start: Start) -> Start:
    """Return the state in which the journals rest in contact in the direction of the ideal reactions."""
    if plan.mechanism.contact_points:
        guide = plan.mechanism.contact_points[0].guide
        raise InputError(
            f"start = 'in-contact' does not support clearance guide '{guide}': its contact points may rest in several ways",
            "start = 'static', or 'concentric', from which they settle",
        )
    offsets = _resting_offsets(plan, system, ideal_reactions(plan))
    resting = held_rods(plan, system, speeds=True)
    _hold_straight(plan, resting)
    _hold_references(plan, system, resting)
    _hold_journals(plan, resting, offsets)
    return assemble(plan, system, start, resting)


def _static_position(plan: Plan) -> tuple[np.ndarray, dict[str, float], float]:
    """Return the static equilibrium at the start: free coordinates, angles turned by body [rad], and growth rate [rad/s].

    The equilibrium with ideal joints is found first.
    """
    locked = plan_at_rest(plan)
    ideal = locked.ideal
    system = make_system(ideal)
    first = assemble(ideal, system.content, placed_start(ideal, system.content), Held(places=True))
    rest = equilibrium(ideal, system, first.position)
    if not plan.contacts:
        return rest.position, turns(ideal, system.content), rest.growth
    handle, rest = rest_with_clearances(locked, system, rest.position, rest.load)
    return rest.position, turns(locked, handle.content), rest.growth


def rest_with_clearances(
    locked: Plan, system: Handle, place: np.ndarray, load: float = 0.0
) -> tuple[Handle, StaticEquilibrium]:
    """Return the static equilibrium with clearances, near that of the mechanism with ideal joints."""
    ideal, rest = locked.ideal, Start(place, np.zeros_like(place))
    handle = make_system(locked)
    count_turns(locked, handle.content, turns(ideal, system.content))
    keep_modes(system.content, handle.content)
    start = _nearest(locked, handle.content, natural_state(ideal, system.content, rest))
    forces = ideal_reactions(locked, rest.position, system.content.state.reference)
    with_clearance = [joint.clearance is not None for joint in locked.mechanism.joints]
    if np.all(np.isfinite(forces[with_clearance])):
        holds = Held()
        _hold_journals(locked, holds, _resting_offsets(locked, handle.content, forces))
        start = assemble(locked, handle.content, start, holds)
    return handle, equilibrium(locked, handle, start.position, load)


def ideal_reactions(plan: Plan, position: np.ndarray | None = None, reference: np.ndarray | None = None) -> np.ndarray:
    """Return the forces on the journals of all revolute joints, taken as ideal, at t = 0, shape (joints, 2) [N]."""
    plan = plan.ideal
    system = make_system(plan)
    if reference is not None:
        system.content.state.reference[:] = reference
    start = assemble_as_placed(plan, system.content) if position is None else Start(position, np.zeros_like(position))
    outputs = StaticPosition(plan, system, whole_state(system.content, start.position, start.velocity)).record()
    reactions = solve_reactions(plan.balance, plan.gravity_vector, with_distributed_mass(plan, outputs, np.zeros(1)))
    return np.asarray(reactions.joints[0])


def _resting_offsets(plan: Plan, system: System, force: np.ndarray) -> np.ndarray:
    """Return the eccentricities at which elastic contact forces equal the ideal reactions, shape (nj, 2) [m]."""
    offsets = np.zeros((len(plan.mechanism.clearance_joints), 2))
    names = [other.name for other in plan.mechanism.joints]
    for j, joint in enumerate(plan.mechanism.clearance_joints):
        reaction = force[names.index(joint.name)]
        if not np.all(np.isfinite(reaction)):
            raise InputError(
                f"start = 'in-contact': the ideal reaction of clearance joint '{joint.name}' is not determined (redundant "
                "joints, or a singular position)",
                "start = 'concentric'",
            )
        size = float(np.hypot(*reaction))
        if system.parameters.contact["cells"][j] and size > 0.0:
            offsets[j] = _eccentricity_in_worn_bearing(plan, system, j, -reaction)
            continue
        depth = _indentation(system, j, size)
        reach = system.parameters.contact["clearance"][j] + depth
        offsets[j] = -reach * reaction / size if size > 0.0 else 0.0
    return offsets


def _eccentricity_in_worn_bearing(plan: Plan, system: System, j: int, force: np.ndarray) -> np.ndarray:
    """Return the eccentricity at which the journal of contact j presses on its worn bearing with a force, shape (2,) [m]."""
    numbers, joint = system.parameters, plan.mechanism.clearance_joints[j]
    angle, journal_angle = (
        plan.mechanism.body(body).placed_angle if plan.coordinates.natural.rotates(body) else 0.0
        for body in (joint.bearing[0], joint.journal[0])
    )
    turn = np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])
    row, out, contour = numbers.contact[j], np.zeros(3), numbers.contour[j].copy()
    if row["journal"]:
        relative = math.remainder(journal_angle - angle, 2.0 * math.pi)
        turned_contours(numbers.contour[j], numbers.journal[j], relative, contour, np.zeros(len(contour)))
    (x, y), gap = (turn.T @ force).tolist(), float(row["clearance"])
    if plan.clearances[j].contact == "hard":
        opened_contour(contour, np.zeros(0), gap, np.zeros(len(contour)))
        place_on(x / math.hypot(x, y), y / math.hypot(x, y), contour, gap, out)
    else:
        place_under(x, y, contour, numbers.foundation[j], gap, float(row["cell_area"]), out)
    return np.asarray(turn @ out[:2])


def _indentation(system: System, j: int, force: float) -> float:
    """Return the indentation at which the elastic force of contact j equals `force`, by bisection [m]; 0 for hard contact."""
    numbers = system.parameters
    if force == 0.0 or numbers.law["stiffness"][j] == 0:  # a hard contact
        return 0.0
    kind, row = numbers.law["stiffness"][j], numbers.elastic[j]
    low, high = 0.0, float(numbers.contact["clearance"][j])
    while elastic_force(kind, high, row) < force and high < numbers.contact["radius"][j]:
        high *= 2.0
    for _ in range(200):
        middle = 0.5 * (low + high)
        if elastic_force(kind, middle, row) < force:
            low = middle
        else:
            high = middle
    return high


def _activate_closed(plan: Plan, system: Handle, y: np.ndarray, kind: StartKind) -> list[list[float]]:
    """Activate contacts and components whose gap is closed at the start; return the rows of the event log.

    A concentric start has no contacts, whatever the round-off, and a start in contact has every loaded hard one; stops and
    cables may act.
    """
    content: System = system.content
    contacts, rows = content.parameters.contact.size, []
    value = guard_values(system, 0.0, y)
    if kind == "in-contact":
        hard = np.array(plan.hard_places, np.int64)
        value[hard] += ROUND_OFF_TOL * plan.coordinates.size
    latches = {int(content.model.component_guard[component]) for _, _, component in content.model.latch.tolist()}
    for guard in np.flatnonzero(value > 0.0).tolist():
        if guard in latches or (guard < contacts and kind == "concentric"):
            continue
        data = np.zeros(RESET_DATA)
        functions.touch(0.0, y, guard, system.address, data)
        row = [0.0, float(guard), float(RISE), *data.tolist()]
        rows.append(row + [0.0] * (LOG_COLUMNS - len(row)))
        # `rate_in_range` bounds the rate by the speed at contact onset
        clearance = plan.clearances[guard] if guard in plan.compliant_places else None
        if clearance is None or clearance.reference != "onset" or not isinstance(clearance.damping, DampingFactor):
            continue
        if data[0] <= APPROACH_FLOOR:
            content.state.memory[guard] = -APPROACH_FLOOR
    return rows


def _store_energy(plan: Plan, system: Handle, y: np.ndarray) -> None:
    """Set the state "stored energy" of hard contacts that are closed at the start to their elastic energy."""
    content: System = system.content
    depth = guard_values(system, 0.0, y) if plan.hard_places else y
    for j in plan.hard_places:
        if content.state.mode[j] == 1:
            law = elastic_law(plan.clearances[j])
            y[content.model.elastic_state[j]] = elastic_energy(law.energy, law.force, depth[j], law.row)


def _hold_references(plan: Plan, system: System, holds: Held) -> None:
    """Hold the bodies of actuators with `start_on_reference` at the initial angle and speed of their references.

    Their turns are counted from these angles.
    """
    numbers, model, work = system.parameters, system.model, system.work
    for i, component in plan.actuators:
        if component.start_on_reference:
            first = model.function[i]
            rows = numbers.motion[numbers.motion_start[first] : numbers.motion_start[first + 1]]
            function_at(0.0, rows, work.function_value)
            angle, speed = work.function_value[:2].tolist()
            cos, sin = math.cos(angle), math.sin(angle)
            name = f"the reference of actuator '{component.name}'"
            holds.add(name, plan.coordinates.direction(component.body), (cos, sin), (-speed * sin, speed * cos))
            system.state.reference[model.reference_of[i]] = angle


def assembled_near(plan: Plan, system: System, natural: np.ndarray, *, straight: bool) -> Start:
    """Return the assembled start at rest that is nearest to given natural coordinates; rods keep their given directions.

    If `straight`, flexible bars are straight and undeformed.
    """
    guess = plan.coordinates.nearest(basis_at_start(system)[0], natural)
    holds = held_rods(plan, system)
    if straight:
        _hold_straight(plan, holds)
    return assemble(plan, system, Start(guess, np.zeros_like(guess)), holds)


def _hold_straight(plan: Plan, holds: Held, *, moving: bool = False) -> None:
    """Hold flexible bars straight at the start, undeformed and moving as rigid bars.

    With `moving`, hold only bars for which some but not all cross-sections have a given velocity.
    """
    coordinates, beams = plan.coordinates, list(beams_of(plan.mechanism))
    has_velocity = {body.name for body in plan.bodies if body.velocity is not None}

    def is_free(sections: Iterable[str]) -> bool:
        return moving and len({section in has_velocity for section in sections if section != GROUND}) < 2

    if is_free(end[0] for beam in beams for end in (beam.start, beam.end)):
        beams = []
    for beam in beams:
        x, y, angle = start_coordinates(plan.mechanism, beam)
        if max(abs(x - beam.length), abs(y), abs(angle) * beam.length) > 1e-6 * beam.length:
            continue  # the element is placed bent
        ends = combined((coordinates.place(beam.end), 1.0), (coordinates.place(beam.start), -1.0))
        directions = coordinates.frame(beam.start[0]), coordinates.frame(beam.end[0])
        for vector, scale in straight_maps(beam, ends, *directions):
            holds.add(beam.name, vector, (0.0, 0.0), (0.0, 0.0), scale)
    for axis in coordinates.natural.axes:
        if is_straight(axis, coordinates.placed[0]) and not is_free(axis.bar.sections):
            vectors, length = plan.table(f"straight {axis.bar.name}", partial(straight_bar, coordinates, axis))
            for vector, scale in vectors:
                holds.add(axis.bar.name, vector, (0.0, 0.0), (0.0, 0.0), scale)
            holds.constraints.append(length)


def _describe_moved(plan: Plan, position: np.ndarray) -> list[str]:
    """Return a warning with the given positions and angles that the assembly changed, largest change first.

    `position` has the natural coordinates.
    """
    placed = plan.coordinates.placed[0]
    size = plan.coordinates.size
    # a position changes by up to sqrt(2) times its larger component, so half of the limit is enough
    if np.abs(position - placed).max(initial=0.0) < 0.5 * REPORTED_FRACTION * min(size, 1.0):
        return []
    prescribed = prescribed_bodies(plan)
    changes: list[tuple[float, str]] = []
    for body in plan.bodies:
        p = plan.coordinates.natural.offsets[body.name]
        far = math.dist(position[p : p + 2], placed[p : p + 2])
        if body.position is not None and far > REPORTED_FRACTION * size:
            here, there = _format_vectors(position[p : p + 2].tolist(), body.position)
            text = f"body '{body.name}' is moved by {far * 1e3:.4g} mm: its origin starts at {here} m instead of {there} m"
            changes.append((far, text))
        if body.angle is not None and plan.coordinates.natural.rotates(body.name) and body.name not in prescribed:
            (cos, sin), (x, y) = placed[p + 2 : p + 4], position[p + 2 : p + 4]
            angle = math.atan2(cos * y - sin * x, cos * x + sin * y)
            if abs(angle) > REPORTED_FRACTION:
                turn = math.degrees(angle)
                here, there = _format_pair(math.degrees(body.angle) + turn, math.degrees(body.angle))
                text = f"body '{body.name}' is rotated by {abs(turn):.4g} deg: it starts at {here} deg instead of {there} deg"
                changes.append((abs(angle) * size, text))
    changes.sort(key=lambda change: -change[0])
    return [f"to assemble the mechanism at the start, {in_words([text for _, text in changes], 3)}"] if changes else []


def _describe_changed_speeds(plan: Plan, system: System, start: Start, velocity: np.ndarray, kind: StartKind) -> list[str]:
    """Return a warning with the given speeds that the start does not have, and the speeds that it has.

    `velocity` has the rates of the natural coordinates.
    """
    if all(body.velocity is None and body.angular_velocity is None for body in plan.bodies):
        return []
    b, rate = basis_at_start(system)
    full, rates = np.append(start.position, b), np.append(start.velocity, rate)
    size, changes = plan.coordinates.size, list[str]()
    given_speeds = [abs(body.angular_velocity or 0.0) * size + math.hypot(*body.velocity or (0.0, 0.0)) for body in plan.bodies]
    allowed = 1e-6 * max([*given_speeds, float(np.max(np.abs(velocity), initial=0.0))])
    for body in plan.bodies:
        p = plan.coordinates.natural.offsets[body.name]
        now = [speed if abs(speed) > allowed else 0.0 for speed in velocity[p : p + 2].tolist()]
        if body.velocity is not None and math.dist(body.velocity, now) > allowed:
            here, there = _format_vectors(now, body.velocity)
            changes.append(f"the origin of body '{body.name}' starts at {here} m/s instead of {there} m/s")
        if body.angular_velocity is not None and body.rotates:
            direction = plan.coordinates.direction(body.name)
            (x, y), (x_rate, y_rate) = direction.at(full), direction.at(rates)
            turning = float((x * y_rate - y * x_rate) / (x * x + y * y))
            if abs(turning - body.angular_velocity) * size > allowed:
                here, there = _format_pair(turning if abs(turning) * size > allowed else 0.0, body.angular_velocity)
                changes.append(f"body '{body.name}' starts at {here} rad/s instead of {there} rad/s")
    if not changes:
        return []
    if kind == "static":
        return [f"start = 'static' begins at rest except for drives: {in_words(changes, 3)}"]
    advice = "" if kind == "as-placed" or not plan.contacts else "; start = 'as-placed' keeps what clearance joints allow"
    return [f"joints and drives do not allow all given speeds together: {in_words(changes, 3)}{advice}"]


def _format_pair(first: float, second: float) -> tuple[str, str]:
    """Format two numbers with as many digits as distinguish them, at least four."""
    for digits in range(4, 17):
        shown = f"{first:.{digits}g}", f"{second:.{digits}g}"
        if shown[0] != shown[1]:
            break
    return shown


def _format_vectors(first: Sequence[float], second: Sequence[float]) -> tuple[str, str]:
    """Format two vectors with as many digits as distinguish them."""
    near = 1e-9 * math.dist(first, second)
    columns = [_format_pair(a, b) if abs(a - b) > near else (f"{b:.4g}",) * 2 for a, b in zip(first, second, strict=True)]
    return ", ".join(column[0] for column in columns), ", ".join(column[1] for column in columns)
