"""From a reduced model to the arrays of the kernels: model, parameters, state and workspace."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import reverse_cuthill_mckee

from scissordyn.component.actuator import Actuator
from scissordyn.component.catalogue import COMPONENTS
from scissordyn.component.compiled import Kernels, at_rest, kernels_of
from scissordyn.component.declaration import PARAMETERS as COMPONENT_PARAMETERS
from scissordyn.component.declaration import Component
from scissordyn.component.motor import Motor
from scissordyn.component.place import GROUND
from scissordyn.component.port import ACTUATOR, FRAME, HINGE, LINE, POINT, TRAVEL
from scissordyn.component.time_function import ConstantSpeed
from scissordyn.control.signal import SIGNALS
from scissordyn.laws.contact import PARAMETERS
from scissordyn.mechanics.band import width
from scissordyn.mechanics.monitored import COMPONENT_FORCE, DRIVE_TORQUE, PRESSURE_VELOCITY
from scissordyn.mechanics.point_map import PointMap, joined
from scissordyn.mechanics.reduce import natural_weight
from scissordyn.mechanics.reduced_model import ReducedModel
from scissordyn.mechanics.system import (
    APPROACH_FLOOR,
    CONTACT,
    CONTACT_RESULT,
    LAW,
    RESULTS,
    MechanismState,
    Model,
    Parameters,
    Workspace,
)
from scissordyn.mechanics.time_function import COLUMNS, breaks_of, function_rows
from scissordyn.model.guide_clearance import ContactPoint
from scissordyn.model.joint import Revolute
from scissordyn.model.mechanism import Mechanism

__all__ = ["acting", "build_model", "initial_state", "make_parameters", "make_workspace", "start_coordinates"]

FEW = 12
"""Up to so many unknowns the step matrix is taken as full."""


def acting(mechanism: Mechanism) -> tuple[Component, ...]:
    """The components that the kernels know, in their order: those that exert forces, then the latches."""
    latches: tuple[Any, ...] = mechanism.latches
    return (*mechanism.components, *latches)


def _offsets(counts: Any) -> np.ndarray:
    """Where each of some consecutive parts starts, and where the last one ends."""
    return np.cumsum([0, *counts], dtype=np.int64)


def _stacked(maps: list[PointMap], height: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Starts, columns and rows of some maps, one after the other."""
    start = _offsets(each.columns.size for each in maps)
    if not maps:
        return start, np.zeros(0, np.int64), np.zeros((height, 0))
    return start, np.concatenate([m.columns for m in maps]), np.ascontiguousarray(np.hstack([m.rows for m in maps]))


def _contact_map(reduced: ReducedModel, contact: Revolute | ContactPoint) -> PointMap:
    """The six rows of a clearance joint, or of a contact point at its guide surface."""
    if isinstance(contact, ContactPoint):
        ends = (reduced.at(contact.follower, contact.centre), 0, 1.0), (reduced.at(contact.body, contact.through), 0, -1.0)
        surface = reduced.frame(contact.body)
        return joined([*ends, (reduced.direction(contact.follower), 2, 1.0), (surface, 4, 1.0)])
    parts = [(reduced.place(contact.journal), 0, 1.0), (reduced.place(contact.bearing), 0, -1.0)]
    parts += [(reduced.direction(contact.journal[0]), 2, 1.0), (reduced.direction(contact.bearing[0]), 4, 1.0)]
    return joined(parts)


def _component_map(reduced: ReducedModel, component: Any) -> PointMap:
    """The six rows of a component."""
    port = component.declaration.port
    if port is LINE:
        return joined([(reduced.place(component.end), 0, 1.0), (reduced.place(component.start), 0, -1.0)])
    if port is TRAVEL:
        point = reduced.place(component.point)
        along = np.array([[math.cos(component.direction), math.sin(component.direction)], [0.0, 0.0]])
        return joined([(PointMap(point.columns, along @ point.rows), 0, 1.0)])
    if port is POINT:
        return joined([(reduced.place(component.point), 0, 1.0), (reduced.frame(component.point[0]), 2, 1.0)])
    if port is FRAME:
        parts = [(reduced.place(component.end), 0, 1.0), (reduced.place(component.start), 0, -1.0)]
        return joined([*parts, (reduced.frame(component.end[0]), 2, 1.0), (reduced.frame(component.start[0]), 4, 1.0)])
    parts = [(reduced.direction(component.body), 2, 1.0), (reduced.frame(component.base), 4, 1.0)]
    if isinstance(component, Actuator) and component.sensor is not None:
        parts.append((reduced.place(component.sensor), 0, 1.0))
        if component.sensor_origin is not None:
            parts.append((reduced.place(component.sensor_origin), 0, -1.0))
    return joined(parts)


def start_coordinates(mechanism: Mechanism, component: Any) -> tuple[float, ...]:
    """Coordinates of a component's port where the bodies are placed."""

    def angle(body: str) -> float:
        return 0.0 if body == GROUND else mechanism.body(body).angle

    port = component.declaration.port
    if port is POINT:
        turned = angle(component.point[0])
        return (*mechanism.place(component.point), math.cos(turned), math.sin(turned))
    if port is TRAVEL:
        x, y = mechanism.place(component.point)
        return (x * math.cos(component.direction) + y * math.sin(component.direction),)
    if port in (HINGE, ACTUATOR):
        return (angle(component.body) - angle(component.base),)
    (ax, ay), (bx, by) = mechanism.place(component.start), mechanism.place(component.end)
    if port is LINE:
        return (math.dist((ax, ay), (bx, by)),)
    base = angle(component.start[0])
    cos, sin = math.cos(base), math.sin(base)
    x, y = bx - ax, by - ay
    return cos * x + sin * y, cos * y - sin * x, angle(component.end[0]) - base


def _kernels(component: Component, start: tuple[float, ...]) -> Kernels:
    if isinstance(component, Actuator):
        return Kernels(0, 0, 0)
    if type(component) not in COMPONENTS.values():  # of the user's own: tried before anything is compiled
        at_rest(component, start)
    return kernels_of(type(component), len(component.parameters(start)))


def build_model(reduced: ReducedModel) -> Model:
    """Everything that follows from topology and lengths.

    Parameters
    ----------
    reduced : ReducedModel

    Returns
    -------
    Model
    """
    mechanism, n, nb = reduced.mechanism, reduced.free, reduced.basis
    moving, known = reduced.coordinates[:, :n], reduced.coordinates[:, n:]
    carried = reduced.mass @ known
    inertia, inertia_b = (
        each if isinstance(each, np.ndarray) else each.toarray() for each in (moving.T @ carried, known.T @ carried)
    )
    contacts, components = mechanism.contacts, acting(mechanism)
    declared = [component.declaration for component in components]
    states = [len(_friction_states(contact)) for contact in contacts] + [len(_states(component)) for component in components]
    constraints = reduced.constraints
    parts = [(k, weight, each) for k, constraint in enumerate(constraints) for weight, each in constraint.parts]
    part_start, constraint_column, constraint_row = _stacked([each for _, _, each in parts], 2)
    overlap = _overlaps(reduced)
    maps = [_contact_map(reduced, contact) for contact in contacts]
    maps += [_component_map(reduced, component) for component in components]
    element_start, element_column, element_row = _stacked(maps, 6)
    counts = np.diff(element_start)
    rotation_start, rotation_column, rotation_row = _stacked([family.maps[0] for family in reduced.families], 2)
    rotations = rotation_start.size - 1

    timed = [k for k, constraint in enumerate(constraints) if constraint.motion]
    function, feed_forward, listed = _functions(mechanism, len(mechanism.drives))
    guarded = [i for i, each in enumerate(declared) if each.gap is not None]
    guard = np.full(len(components), -1, np.int64)
    guard[guarded] = len(contacts) + np.arange(len(guarded))
    angular = [i for i, each in enumerate(declared) if each.port in (HINGE, FRAME, ACTUATOR)]
    reference = np.full(len(components), -1, np.int64)
    reference[angular] = rotations + np.arange(len(angular))
    recorded = [i for i, each in enumerate(components) if isinstance(each, Actuator) and each.controller.delay > 0.0]
    recorder = np.full(len(components), -1, np.int64)
    recorder[recorded] = np.arange(len(recorded))
    kernels = [_kernels(each, start_coordinates(mechanism, each)) for each in components]
    permutation, reach = _ordering(reduced, element_start, element_column, states)
    gram = int(np.max(overlap[:, 0] - overlap[:, 1], initial=0))

    def integers(values: Any) -> np.ndarray:
        return np.array(list(values), np.int64)

    return Model(
        n=n,
        nb=nb,
        inertia=np.ascontiguousarray(inertia),
        inertia_b=np.ascontiguousarray(inertia_b),
        part_start=part_start,
        part_constraint=integers(k for k, _, _ in parts),
        part_full=np.array([weight for _, weight, _ in parts], float),
        timed=integers(timed),
        timed_function=integers(len(mechanism.drives) + len(listed) + k for k in range(len(timed))),
        timed_unit=np.array([1.0 / constraints[k].scale for k in timed], float),
        latch=_latches(reduced, part_start, len(mechanism.components)),
        constraint_start=_offsets(constraint.columns.size for constraint in constraints),
        constraint_column=constraint_column,
        constraint_row=constraint_row,
        overlap=overlap,
        element_start=element_start,
        element_column=element_column,
        element_row=element_row,
        rotation_start=rotation_start,
        rotation_column=rotation_column,
        rotation_row=rotation_row,
        state_start=_offsets(states),
        component_port=integers(each.port.code for each in declared),
        component_coordinates=integers(len(each.port.coordinates) for each in declared),
        component_forces=integers(len(each.port.forces) for each in declared),
        component_passive=integers(each.passive for each in declared),
        component_motor=integers(isinstance(each, Actuator | Motor) for each in components),
        component_timed=integers(bool({"time", "factor"} & set(each.context)) for each in declared),
        component_guard=guard,
        travel_direction=np.array([_travel(each) for each in components], float).reshape(-1, 2),
        first_rate=integers(len(each.results) - len(each.states) for each in declared),
        force_kernel=integers(each.force for each in kernels),
        gap_kernel=integers(each.gap for each in kernels),
        switch_kernel=integers(each.switch for each in kernels),
        reference_of=reference,
        function=function,
        feed_forward=feed_forward,
        recorder=recorder,
        monitor=_monitors(mechanism),
        guard_component=integers([*(-1 for _ in contacts), *guarded]),
        block_start=_offsets(counts**2),
        force_state_start=_offsets(counts * np.array(states, np.int64)),
        state_state_start=_offsets(s * s for s in states),
        permutation=permutation,
        band_limits=integers([reach, reach, gram, gram]),
    )


def _friction_states(contact: Revolute | ContactPoint) -> tuple[str, ...]:
    assert contact.clearance is not None
    return contact.clearance.friction.states


def _states(component: Component) -> tuple[str, ...]:
    return component.controller.states if isinstance(component, Actuator) else component.declaration.states


def _travel(component: Any) -> tuple[float, float]:
    """Unit vector along which a component travels, if it does."""
    along = component.declaration.port is TRAVEL
    return (math.cos(component.direction), math.sin(component.direction)) if along else (0.0, 0.0)


def _functions(mechanism: Mechanism, first: int) -> tuple[np.ndarray, np.ndarray, list[tuple[Any, float]]]:
    """For each component its time function, counted from `first` on, or -1, and its feed-forward torque; then these functions.

    Each with the value at t = 0 of one that only has a speed.
    """
    components = acting(mechanism)
    index, feed = np.full((2, len(components)), -1, np.int64)
    listed: list[tuple[Any, float]] = []
    for i, component in enumerate(components):
        if isinstance(component, Actuator):
            index[i] = first + len(listed)
            listed.append((component.reference or ConstantSpeed(0.0), start_coordinates(mechanism, component)[0]))
            if component.feed_forward is not None:
                feed[i] = first + len(listed)
                listed.append((component.feed_forward, 0.0))
        elif "factor" in component.declaration.context and component.time_function is not None:  # type: ignore[attr-defined]
            index[i] = first + len(listed)
            listed.append((component.time_function, 0.0))  # type: ignore[attr-defined]
    return index, feed, listed


def _monitors(mechanism: Mechanism) -> np.ndarray:
    """What is monitored throughout: torques of drives, forces of components, pressure times velocity in clearance joints."""
    rows = [(DRIVE_TORQUE, d) for d in range(len(mechanism.drives))]
    rows += [(COMPONENT_FORCE, i) for i in range(len(mechanism.components))]
    rows += [(PRESSURE_VELOCITY, j) for j in range(len(mechanism.clearance_joints))]
    return np.array(rows, np.int64).reshape(-1, 2)


def _latches(reduced: ReducedModel, part_start: np.ndarray, first: int) -> np.ndarray:
    """Constraint, first part and component of each latch."""
    parts = np.cumsum([0, *(len(constraint.parts) for constraint in reduced.constraints)])
    names = [constraint.name for constraint in reduced.constraints]
    found = [(names.index(latch.name), parts[names.index(latch.name)]) for latch in reduced.mechanism.latches]
    return np.array([(k, p, first + i) for i, (k, p) in enumerate(found)], np.int64).reshape(-1, 3)


def _overlaps(reduced: ReducedModel) -> np.ndarray:
    """Pairs k >= l of quadratic constraints on common free coordinates, by k, shape (pairs, 2)."""
    own = _incidence([each.columns[each.columns < reduced.free] for each in reduced.constraints], reduced.free)
    k, l = (own @ own.T).nonzero()
    pairs = np.stack([k, l], axis=1)[k >= l].astype(np.int64)
    return np.ascontiguousarray(pairs[np.lexsort((pairs[:, 1], pairs[:, 0]))])


def _incidence(groups: list[np.ndarray], columns: int) -> csr_array:
    """A matrix with a one wherever a group, its row, has a column."""
    rows = np.repeat(np.arange(len(groups)), [group.size for group in groups])
    held = np.concatenate(groups) if groups else np.zeros(0, np.int64)
    return csr_array((np.ones(rows.size), (rows, held)), shape=(len(groups), columns))


def _ordering(
    reduced: ReducedModel, element_start: np.ndarray, element_column: np.ndarray, states: list[int]
) -> tuple[np.ndarray, int]:
    """Rows of the step matrix for accelerations, multipliers and internal states, so that its band is narrow, and its reach."""
    n, m = reduced.free, len(reduced.constraints)
    size = n + m + sum(states)
    if size <= FEW:
        return np.arange(size, dtype=np.int64), max(0, size - 1)
    groups = [np.append(each.columns[each.columns < n], n + k) for k, each in enumerate(reduced.constraints)]
    first_state = n + m
    for e, count in enumerate(states):
        columns = element_column[element_start[e] : element_start[e + 1]]
        groups.append(np.concatenate([columns[columns < n], np.arange(first_state, first_state + count)]))
        first_state += count
    own = _incidence([*groups, *np.arange(size)[:, None]], size)
    graph = csr_array(own.T @ own)
    graph.sort_indices()
    rows, beside = graph.nonzero()
    place = np.empty(size, np.int64)
    place[reverse_cuthill_mckee(graph, symmetric_mode=True)] = np.arange(size)
    return place, int(np.max(np.abs(place[rows] - place[beside]), initial=0))


def make_parameters(reduced: ReducedModel) -> Parameters:
    """The numbers of a case.

    Parameters
    ----------
    reduced : ReducedModel
        Of the case's mechanism, or of one that differs in numbers that do not enter the reduction only.

    Returns
    -------
    system.Parameters
    """
    mechanism = reduced.mechanism
    contacts, components = mechanism.contacts, acting(mechanism)
    listed = [(drive.motion, mechanism.body(drive.body).angle) for drive in mechanism.drives]
    listed += _functions(mechanism, 0)[2]
    listed += [(constraint.motion, 0.0) for constraint in reduced.constraints if constraint.motion]
    rows = [function_rows(motion, start) for motion, start in listed]

    surfaces, law = np.zeros(len(contacts), CONTACT), np.zeros(len(contacts), LAW)
    tables = np.zeros((3, len(contacts), PARAMETERS))
    for j, contact in enumerate(contacts):
        clearance = contact.clearance
        assert clearance is not None
        joint = clearance.contact
        p = surfaces[j]
        p["clearance"], p["radius"] = clearance.clearance, joint.journal_radius
        p["area"] = 2.0 * joint.journal_radius * joint.length
        if isinstance(contact, ContactPoint):
            p["plane"], p["level"] = 1, contact.distance - joint.journal_radius
            p["normal_x"], p["normal_y"] = contact.normal
        for which, kind in enumerate(("stiffness", "damping", "friction")):
            chosen: Any = getattr(clearance, kind)
            numbers = chosen.parameters(joint)
            law[j][kind] = chosen.kernel_kind
            tables[which, j, : len(numbers)] = numbers

    numbers_of = np.zeros((len(components), COMPONENT_PARAMETERS))
    control, kind_of, actuator = np.zeros((len(components), PARAMETERS)), np.zeros(len(components), np.int64), None
    actuator = np.zeros((len(components), 3))
    for i, component in enumerate(components):
        if isinstance(component, Actuator):
            controller = component.controller
            chosen_numbers = controller.parameters()
            control[i, : len(chosen_numbers)] = chosen_numbers
            kind_of[i] = controller.kernel_kind
            recorded = SIGNALS.index(controller.recorded) if controller.recorded else 0
            actuator[i] = controller.delay, recorded, controller.recursion_gain
        else:
            described = component.parameters(start_coordinates(mechanism, component))
            numbers_of[i, : len(described)] = described
    weight = natural_weight(mechanism, reduced.offsets, reduced.coordinates.shape[0])
    return Parameters(
        weight=np.asarray(reduced.coordinates.T @ weight),
        motion=np.vstack(rows) if rows else np.zeros((0, COLUMNS)),
        motion_start=_offsets(map(len, rows)),
        breaks=np.unique(np.array([instant for motion, _ in listed for instant in breaks_of(motion)], float)),
        value=np.array([constraint.value for constraint in reduced.constraints], float),
        contact=surfaces,
        law=law,
        elastic=tables[0],
        damping=tables[1],
        friction=tables[2],
        component=numbers_of,
        controller=kind_of,
        control=control,
        actuator=actuator,
    )


def initial_state(reduced: ReducedModel, model: Model) -> MechanismState:
    """Everything open, and angles as placed."""
    mechanism = reduced.mechanism
    guards, signals = model.guard_component.size, int(np.max(model.recorder, initial=-1)) + 1
    angles = [mechanism.body(family.bodies[0]).angle for family in reduced.families]
    for i, component in enumerate(acting(mechanism)):
        if model.reference_of[i] >= 0:
            angles.append(start_coordinates(mechanism, component)[-1])
    return MechanismState(
        mode=np.zeros(guards, np.int64),
        memory=np.full(guards, APPROACH_FLOOR),
        reference=np.array(angles, float),
        history=np.zeros((0, 2)),
        history_length=np.zeros(1, np.int64),
        initial_history=np.zeros(signals),
    )


def make_workspace(model: Model, parameters: Parameters) -> Workspace:
    """Scratch for a thread that works on a model."""
    n, nb, m = model.n, model.nb, parameters.value.size
    contacts, components = parameters.contact.size, model.component_port.size
    counts, states = np.diff(model.element_start), np.diff(model.state_start)
    entries, parts = model.constraint_column.size, model.part_constraint.size
    size, most = model.permutation.size, int(np.max(states, initial=0))
    signals = len(SIGNALS)
    inactive = np.zeros(m)
    inactive[model.latch[:, 0]] = 1.0
    values = np.zeros((4, m))
    values[0] = parameters.value
    blocks, pairs = int(model.block_start[-1]), int(model.force_state_start[-1])
    return Workspace(
        part_weight=model.part_full * (1.0 - inactive[model.part_constraint]),
        inactive=inactive,
        value=values,
        basis=np.zeros((4, nb)),
        function_value=np.zeros(4),
        X=np.zeros(n + nb),
        V=np.zeros(n + nb),
        A=np.zeros(n + nb),
        force=np.zeros(n + nb),
        direction=np.zeros((parts, 2)),
        direction_rate=np.zeros((parts, 2)),
        direction_acceleration=np.zeros((parts, 2)),
        gradient=np.zeros(entries),
        multiplier=np.zeros(m),
        frozen_direction=np.zeros((parts, 2)),
        frozen_rate=np.zeros((parts, 2)),
        frozen_gradient=np.zeros(entries),
        frozen_multiplier=np.zeros(m),
        band=np.zeros((size, width(int(model.band_limits[0]), int(model.band_limits[1])))),
        pivots=np.zeros(size, np.int64),
        gram=np.zeros((m, width(int(model.band_limits[2]), int(model.band_limits[3])))),
        gram_pivots=np.zeros(m, np.int64),
        gram_row=np.zeros(n),
        gamma=np.zeros(1),
        contact=np.zeros(contacts, CONTACT_RESULT),
        wrench=np.zeros((contacts + components, 4)),
        block_x=np.zeros(blocks),
        block_v=np.zeros(blocks),
        force_by_state=np.zeros(pairs),
        rate_by_x=np.zeros(pairs),
        rate_by_v=np.zeros(pairs),
        rate_by_state=np.zeros(int(model.state_state_start[-1])),
        local=np.zeros((8, int(np.max(counts, initial=0)))),
        state_work=np.zeros((2, most)),
        state_jacobian=np.zeros((most + 3, most)),
        coordinates=np.zeros((components, 4)),
        coordinate_rates=np.zeros((components, 4)),
        context=np.zeros(4),
        answer=np.zeros(RESULTS),
        other_answer=np.zeros(RESULTS),
        result=np.zeros((components, RESULTS)),
        stored_energy=np.zeros(components),
        dissipation=np.zeros(components),
        power_in=np.zeros(components),
        slope=np.zeros((4 + most, signals + most + 1)),
        gradient_q=np.zeros((4, 6)),
        gradient_v=np.zeros((4, 6)),
        by_map=np.zeros((6, 6)),
        by_map_rate=np.zeros((6, 6)),
        signal=np.zeros(signals),
        signal_rate=np.zeros(signals),
        control_work=np.zeros((2, most)),
        observed=np.zeros((components, 2)),
        work=np.zeros(size),
        scratch=np.zeros(2 * n + int(model.state_start[-1])),
        work_b=np.zeros(nb),
    )
