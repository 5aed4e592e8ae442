"""Arrays of the kernels that follow from topology and lengths."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from scissordyn.components.actuator import Actuator
from scissordyn.components.catalogue import COMPONENTS
from scissordyn.components.declaration import Component, at_rest, kernels_of
from scissordyn.components.port import AXIS, TRAVEL, Attachment
from scissordyn.laws.friction.none import NoFriction
from scissordyn.mechanics.constraint_part import ANGLE, HALF_SQUARE
from scissordyn.mechanics.monitored import (
    COMPONENT_FORCE,
    COMPONENT_OUTPUT,
    CONTACT_FORCE,
    COUPLING_FORCE,
    DRIVE_TORQUE,
    FRICTION_RATIO,
    INDENTATION,
    JOINT_FORCE,
    PRESSURE_VELOCITY,
    TRACK_DEVIATION,
)
from scissordyn.mechanics.system import COMPONENT_RESULTS_MAX, Model
from scissordyn.model.clearance import HARD_STATES, STORED_ENERGY, ContactPoint
from scissordyn.model.joint import Revolute
from scissordyn.model.mechanism import Mechanism
from scissordyn.plan.acting import acting, offsets, start_coordinates, states_of, time_functions
from scissordyn.plan.bending import bar_table, flexible_maps, held_table, mode_columns
from scissordyn.plan.coordinates import Constraint, Coordinates, PointMap, joined, stacked
from scissordyn.plan.ordering import coupled, members, order_unknowns, pairs_of
from scissordyn.plan.rail import Rails, rail_tables


def _attached(coordinates: Coordinates, attachment: Attachment) -> PointMap:
    """Return the vector of an attachment as a linear map: a point, its component along a direction, or a body's direction."""
    if attachment.what == "frame":
        return coordinates.frame(attachment.body)
    if attachment.what == "direction":
        return coordinates.direction(attachment.body)
    vector = coordinates.at(attachment.body, attachment.point or (0.0, 0.0))
    if attachment.along is None:
        return vector
    along = np.array([[math.cos(attachment.along), math.sin(attachment.along)], [0.0, 0.0]])
    return PointMap(vector.columns, along @ vector.rows)


def _kernels(component: Component, start: tuple[float, ...]) -> dict[str, int]:
    """Return the kernel pointers of a component; user-defined ones are called once first."""
    if type(component) not in COMPONENTS.values():  # user-defined: called in Python before anything is compiled
        at_rest(component, start)
    return kernels_of(type(component))


def make_model(mechanism: Mechanism, coordinates: Coordinates) -> Model:
    """Return all arrays that follow from topology and lengths."""
    n = coordinates.free
    moving, driven = coordinates.matrix[:, :n], coordinates.matrix[:, n:]
    carried = coordinates.mass @ driven
    inertia, inertia_b = (
        part if isinstance(part, np.ndarray) else part.toarray() for part in (moving.T @ carried, driven.T @ carried)
    )
    contacts, components = mechanism.contacts, acting(mechanism)
    states = [len(states_of(contact)) for contact in contacts] + [len(part.states) for part in components]
    attachments = [contact.attachments for contact in contacts]
    attachments += [part.declaration.port.attachments(part) for part in components]
    # the six rows of each force element
    maps = [joined([(_attached(coordinates, part), part.row, part.sign) for part in parts]) for parts in attachments]
    bars = flexible_maps(coordinates)
    for at, (columns, _) in zip(_bars(components), bars, strict=True):
        maps[len(contacts) + at] = PointMap(columns, np.zeros((6, columns.size)))
    rails = rail_tables(coordinates, components, bars, maps[len(contacts) :])
    maps[len(contacts) :] = rails.maps
    elements = stacked(maps, 6, "element_")
    counts = np.diff(elements["element_start"])
    constraints = _constraints(mechanism, coordinates)
    read = [part.columns[part.columns < n] for part in maps]
    ordering = order_unknowns(n, coordinates.constraints, set(constraints["latch"][:, 0].tolist()), read, states)
    gram = int(np.max(-np.diff(constraints["overlap"], axis=1), initial=0))
    return Model(
        n=n,
        nb=coordinates.basis,
        inertia=np.ascontiguousarray(inertia),
        inertia_b=np.ascontiguousarray(inertia_b),
        coupled=np.flatnonzero(np.any(np.asarray(inertia)[:, 1:] != 0.0, axis=1)),
        state_start=offsets(states),
        elastic_state=_elastic_states(n, contacts, offsets(states)),
        monitor=_monitors(mechanism, coordinates.constraints),
        block_start=offsets(counts**2),
        force_state_start=offsets(counts * np.array(states, np.int64)),
        state_state_start=offsets(s * s for s in states),
        permutation=ordering.permutation,
        band_limits=_integers([ordering.reach, ordering.reach, gram, gram]),
        pair=ordering.pair,
        pair_of=ordering.pair_of,
        **elements,
        **stacked([family.maps[0] for family in coordinates.families], 2, "rotation_"),
        **stacked([coordinates.tracked(track) for track in mechanism.tracks], 2, "track_"),
        **constraints,
        **_components(mechanism, len(coordinates.families)),
        **_flexible(coordinates, components, bars, rails),
    )


def _bars(components: Iterable[Any]) -> list[int]:
    """Return the indices of the flexible bars among components."""
    return [i for i, part in enumerate(components) if part.declaration.port is AXIS]


def _flexible(
    coordinates: Coordinates, components: tuple[Component, ...], bars: list[tuple[np.ndarray, list[PointMap]]], rails: Rails
) -> dict[str, np.ndarray]:
    """Return the tables of flexible bars and of the components that run along them."""
    numbers = np.full(len(components), -1, np.int64)
    numbers[_bars(components)] = np.arange(len(bars))
    for i, bar in rails.bars.items():
        numbers[i] = bar
    vectors = [vector for _, maps in bars for vector in maps]
    tables, table_start = _shared([bar_table(axis) for axis in coordinates.natural.axes])
    first = offsets(len(maps) for _, maps in bars)
    rows = [
        [at, axis.shapes.count, axis.shapes.quadrature[0].size, table, *mode_columns(axis, vectors[at:])]
        for at, axis, table in zip(first.tolist(), coordinates.natural.axes, table_start, strict=False)
    ]
    fixed = [
        held_table(maps[: axis.shapes.interface_count]) for axis, (_, maps) in zip(coordinates.natural.axes, bars, strict=True)
    ]
    static = np.stack(
        [
            tables.size + offsets(table.size for _, table in fixed)[:-1],
            [columns.size for columns, _ in fixed],
            offsets(columns.size for columns, _ in fixed)[:-1],
        ],
        axis=1,
    )
    read = [columns for columns, maps in bars for _ in maps]
    places = [np.searchsorted(columns, vector.columns) for columns, vector in zip(read, vectors, strict=True)]
    return {
        "bar_of": numbers,
        "bar": np.hstack([np.array([row[:6] for row in rows], np.int64).reshape(-1, 6), static.astype(np.int64)]),
        "bar_scale": np.array([row[6] for row in rows], float),
        "bar_column": np.concatenate([np.zeros(0, np.int64), *(columns for columns, _ in fixed)]),
        "bar_table": np.concatenate([tables, *(table for _, table in fixed)]),
        **stacked(vectors, 2, "shape_"),
        "shape_place": np.concatenate([np.zeros(0, np.int64), *places]),
        "rail": rails.rows,
        "rail_table": rails.table,
        "rail_place": rails.places,
    }


def _shared(tables: list[np.ndarray]) -> tuple[np.ndarray, list[int]]:
    """Concatenate tables, equal ones only once so that they stay in the processor's cache; return also their starts."""
    distinct: dict[bytes, int] = {}
    parts, size, start = [np.zeros(0)], 0, []
    for table in tables:
        key = table.tobytes()
        if key not in distinct:
            distinct[key] = size
            parts.append(table)
            size += table.size
        start.append(distinct[key])
    return np.concatenate(parts), start


def _integers(values: Iterable[int]) -> np.ndarray:
    return np.array(list(values), np.int64)


def _part_references(constraints: tuple[Constraint, ...], first: int) -> np.ndarray:
    """Return the kind of each part; angles are numbered consecutively from `first`."""
    references = list[int]()
    for constraint in constraints:
        for kind in constraint.kinds or (HALF_SQUARE,) * len(constraint.parts):
            references.append(first if kind == ANGLE else kind)
            first += kind == ANGLE
    return _integers(references)


def _constraints(mechanism: Mechanism, coordinates: Coordinates) -> dict[str, np.ndarray]:
    """Return the tables of the quadratic constraints."""
    constraints = coordinates.constraints
    parts = [(k, weight, part) for k, constraint in enumerate(constraints) for weight, part in constraint.parts]
    maps = stacked([part for _, _, part in parts], 2, "part_")
    timed = [k for k, constraint in enumerate(constraints) if constraint.motion]
    first = len(mechanism.drives) + len(time_functions(mechanism, 0)[2])
    free = [constraint.columns[constraint.columns < coordinates.free] for constraint in constraints]
    references = len(coordinates.families) + sum(part.declaration.port.angle for part in acting(mechanism))
    return {
        "part_start": maps["part_start"],
        "part_constraint": _integers(k for k, _, _ in parts),
        "part_full": np.array([weight for _, weight, _ in parts], float),
        "part_reference": _part_references(constraints, references),
        "timed": _integers(timed),
        "timed_function": _integers(first + k for k in range(len(timed))),
        "timed_unit": np.array([1.0 / constraints[k].scale for k in timed], float),
        "timed_linear": _integers(constraints[k].linear for k in timed),
        "latch": _latches(mechanism, constraints),
        "constraint_start": offsets(constraint.columns.size for constraint in constraints),
        "constraint_column": maps["part_column"],
        "constraint_row": maps["part_row"],
        # pairs k >= l of quadratic constraints with common free coordinates, by k, shape (pairs, 2)
        "overlap": pairs_of(coupled(members(free, coordinates.free), len(free))),
    }


def _components(mechanism: Mechanism, rotations: int) -> dict[str, np.ndarray]:
    """Return the tables of the components; their angles are numbered after those of the rotations."""
    contacts, components = len(mechanism.contacts), acting(mechanism)
    declared = [component.declaration for component in components]
    kernels = [_kernels(part, start_coordinates(mechanism, part)) for part in components]
    function, feed_forward, _ = time_functions(mechanism, len(mechanism.drives))
    guarded = [i for i, kind in enumerate(declared) if kind.gap is not None]
    lawful = [i for i, kind in enumerate(declared) if kind.contact]
    angular = [i for i, kind in enumerate(declared) if kind.port.angle]
    recorded = [i for i, part in enumerate(components) if isinstance(part, Actuator) and part.controller.delay > 0.0]

    def numbered(chosen: list[int], first: int) -> np.ndarray:
        numbers = np.full(len(components), -1, np.int64)
        numbers[chosen] = first + np.arange(len(chosen))
        return numbers

    return {
        "component_port": _integers(kind.port.code for kind in declared),
        "component_sense": np.array([kind.port.sense for kind in declared], float),
        "component_coordinates": _integers(len(kind.port.coordinates) for kind in declared),
        "component_forces": _integers(len(kind.port.forces) for kind in declared),
        "component_passive": _integers(kind.passive for kind in declared),
        "component_supplied": _integers(kind.supplied for kind in declared),
        "component_motor": _integers(kind.motor for kind in declared),
        "component_timed": _integers("time" in kind.context or at >= 0 for kind, at in zip(declared, function, strict=True)),
        "component_guard": numbered(guarded, contacts),
        "component_law": numbered(lawful, contacts),
        "travel_direction": np.array([_travel(part) for part in components], float).reshape(-1, 2),
        "first_rate": _integers(len(kind.results) - len(kind.states) for kind in declared),
        "force_kernel": _integers(kernel["force"] for kernel in kernels),
        "gap_kernel": _integers(kernel["gap"] for kernel in kernels),
        "switch_kernel": _integers(kernel["switch"] for kernel in kernels),
        "reference_of": numbered(angular, rotations),
        "function": function,
        "feed_forward": feed_forward,
        "recorder": numbered(recorded, 0),
        "guard_component": _integers([*(-1 for _ in range(contacts)), *guarded]),
    }


def _elastic_states(free: int, contacts: Sequence[Revolute | ContactPoint], start: np.ndarray) -> np.ndarray:
    """Return the index of each hard contact's elastic energy in the state y; -1 for a compliant contact."""
    hard = [part.clearance is not None and part.clearance.contact == "hard" for part in contacts]
    return np.where(hard, 2 * free + start[: len(hard)] + HARD_STATES.index(STORED_ENERGY), -1).astype(np.int64)


def _travel(component: Any) -> tuple[float, float]:
    """Return the unit vector along which a component travels; zero if it does not."""
    along = component.declaration.port is TRAVEL
    return (math.cos(component.direction), math.sin(component.direction)) if along else (0.0, 0.0)


def _monitors(mechanism: Mechanism, constraints: tuple[Constraint, ...]) -> np.ndarray:
    """Return kind and index of all monitored quantities.

    They are: torques of drives, forces of components, pressure times velocity in clearance joints, indentations, ratios of
    friction to its limit for laws with internal states, deviations of tracked points, outputs declared as monitored, and
    forces of oiled joints, of contacts with friction and of couplings.
    """
    contacts, films, total = mechanism.contacts, len(mechanism.components), len(acting(mechanism))
    laws: list[Any] = [contact.clearance for contact in contacts]
    compliant = [(j, gap.friction) for j, gap in enumerate(laws) if gap.contact != "hard"]
    monitored: dict[int, Iterable[int]] = {
        DRIVE_TORQUE: range(len(mechanism.drives)),
        COMPONENT_FORCE: range(len(mechanism.exerting)),
        PRESSURE_VELOCITY: range(len(mechanism.clearance_joints)),
        INDENTATION: range(len(contacts)),
        FRICTION_RATIO: [j for j, friction in compliant if friction.states],
        TRACK_DEVIATION: range(len(mechanism.tracks)),
        COMPONENT_OUTPUT: [
            i * COMPONENT_RESULTS_MAX + output.first
            for i, part in enumerate(mechanism.exerting)
            for output in part.declaration.outputs_monitored
        ],
        JOINT_FORCE: [
            mechanism.clearance_joints.index(joint) * total + films + f for f, (joint, _, _) in enumerate(mechanism.lubricated)
        ],
        CONTACT_FORCE: [j for j, friction in compliant if not isinstance(friction, NoFriction)],
        COUPLING_FORCE: [k for k, constraint in enumerate(constraints) if constraint.linear],
    }
    rows = [(kind, index) for kind, indices in monitored.items() for index in indices]
    return np.array(rows, np.int64).reshape(-1, 2)


def _latches(mechanism: Mechanism, constraints: tuple[Constraint, ...]) -> np.ndarray:
    """Return constraint, first part and component of each latch."""
    parts = np.cumsum([0, *(len(constraint.parts) for constraint in constraints)])
    names = [constraint.name for constraint in constraints]
    first = len(mechanism.exerting)
    latches = [(names.index(latch.name), parts[names.index(latch.name)]) for latch in mechanism.latches]
    return np.array([(k, p, first + i) for i, (k, p) in enumerate(latches)], np.int64).reshape(-1, 3)
