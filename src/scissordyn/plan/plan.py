"""Plan of a mechanism: the tables that kernels read, and the names of their rows."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from typing import Any

import numpy as np

from scissordyn.components.actuator import Actuator
from scissordyn.components.declaration import Component
from scissordyn.components.flexible_bar import FlexibleBar
from scissordyn.components.rod import Rod
from scissordyn.components.time_function import TimeFunction
from scissordyn.kernel import Template
from scissordyn.laws.friction.none import NoFriction
from scissordyn.mechanics.balance import Balance
from scissordyn.mechanics.body_maps import BodyMaps
from scissordyn.mechanics.monitored import companions, monitored_rows
from scissordyn.mechanics.system import FrictionWorkspace, Model, Parameters
from scissordyn.model.body import Body
from scissordyn.model.clearance import Clearance, ContactKind, ContactPoint, GuideClearance, Lubrication, contact_states
from scissordyn.model.coupling import Drive
from scissordyn.model.joint import Revolute
from scissordyn.model.mechanism import Mechanism
from scissordyn.plan.acting import acting, start_coordinates
from scissordyn.plan.bodies import balance, body_maps
from scissordyn.plan.branches import Branches, every_branch
from scissordyn.plan.coordinates import Coordinates, PointMap, natural_coordinates
from scissordyn.plan.elimination import in_words
from scissordyn.plan.flexible import with_mode_counts
from scissordyn.plan.joint_friction import make_friction_workspace
from scissordyn.plan.linear_constraints import Reduction, make_reduction, reduced
from scissordyn.plan.model import make_model
from scissordyn.plan.numbers import find_weight, make_parameters
from scissordyn.tolerance import ASSEMBLY_TOL

TABLE_FIELDS = ("bodies", "ground", "welds", "guides", "rods", "latches", "couplings", "coordinate_drives")
"""Fields of a mechanism whose values all enter its tables: any change needs new tables."""

# Names of the fields of a body that the elimination of linear constraints does not use
MASS_FIELDS = ("mass", "inertia", "payloads")


@dataclass(frozen=True, eq=False)
class Plan:
    """Compiled mechanism: the tables that kernels read, which follow from its parts, and the names of their rows.

    Tables are never modified. Cases that differ only in parameters outside the tables share them (`fits`, `case`).
    """

    mechanism: Mechanism = field(repr=False)  # Mechanism with the parameters of the case
    coordinates: Coordinates  # Maps of points and directions, and the quadratic constraints
    model: Model = field(repr=False)  # Tables of topology and lengths for the kernels
    maps: BodyMaps = field(repr=False)  # Maps of the bodies, and where force elements, rods and latches act on them
    balance: Balance = field(repr=False)  # Balances of forces and moments, for the reactions of ideal joints
    # Angles from which turns are counted: of families of parallel bodies, components, then constraints [rad]
    angles: np.ndarray = field(repr=False)
    structure: tuple[Any, ...] = field(repr=False)  # Indices and shapes of all tables
    reduction: Reduction = field(repr=False)  # Elimination of the linear constraints
    # Last results with these tables, by key: the assembly at the start, singular positions
    answers: dict[str, Any] = field(default_factory=dict, repr=False)
    # Tables and templates of all plans with the same structure, by key
    structural: dict[str, Any] = field(default_factory=dict, repr=False)

    def fits(self, other: Mechanism) -> bool:
        """Return whether another mechanism has the same tables: it differs only in clearances, laws, motions and gravity."""
        return all(map(_is_same, _table_entries(self.mechanism), _table_entries(other)))

    def differs_in_mass(self, other: Mechanism) -> bool:
        """Return whether another mechanism differs only as in `fits`, and in masses and moments of inertia of its bodies.

        The inertia of a section of a flexible bar decides whether its direction is a coordinate.
        """
        (bodies, *entries), (other_bodies, *other_entries) = _table_entries(self.mechanism), _table_entries(other)
        placements = [*map(_placement, bodies)], [*map(_placement, other_bodies)]
        if not _is_same(*placements) or not all(map(_is_same, entries, other_entries)):
            return False
        return natural_coordinates(other).offsets == self.coordinates.natural.offsets

    def case(self, other: Mechanism) -> Plan:
        """Return the plan of another case that fits: the same tables with its own parts and parameters."""
        changed = replace(self, mechanism=other)
        if "branches" in self.__dict__:
            changed.__dict__["branches"] = self.branches
        return changed

    def table(self, name: str, make: Callable[[], Any]) -> Any:
        """Return an additional table that follows from the plan; `make` computes it once for all cases that share the plan."""
        return _computed_once(self.answers, name, make)

    def structure_table(self, name: str, make: Callable[[], Any]) -> Any:
        """Return an additional table of indices; `make` computes it once for all plans with the same structure."""
        return _computed_once(self.structural, name, make)

    @property
    def companions(self) -> np.ndarray:
        """Row of each guard's contact force including friction; -1 if that is the normal force (`monitored.companions`)."""
        return np.asarray(self.table("companions", lambda: companions(self.model)))

    def monitored_rows(self, kind: int) -> np.ndarray:
        """Return the rows of one kind of quantity, counted over guards and monitored quantities."""
        return np.asarray(self.table(f"monitored rows {kind}", lambda: monitored_rows(self.model, kind)))

    def template(self, name: str, make: Callable[[], Template]) -> Template | None:
        """Return a template, or None at the first request: a structure with one run needs no template."""
        if name not in self.structural:
            self.structural[name] = None
            return None
        return self.structure_table(name, make)  # type: ignore[no-any-return]

    def numbers(self) -> Parameters:
        """Return the parameters of the case in new arrays."""
        key = repr((self.mechanism.gravity, self.mechanism.gravity_direction))
        last = self.answers.get("weight")
        if last is None or last[0] != key:
            last = self.answers["weight"] = key, find_weight(self.mechanism, self.coordinates)
        return make_parameters(self.mechanism, self.coordinates, last[1].copy())

    def friction_workspace(self) -> FrictionWorkspace:
        """Return the tables of friction in ideal joints with new scratch arrays."""
        balance, maps, gravity = self.balance, self.maps, self.gravity_vector
        return make_friction_workspace(self.mechanism, self.coordinates, self.model, balance, maps, gravity)

    @cached_property
    def ideal(self) -> Plan:
        """Plan of the mechanism with ideal joints and guides; the plan itself if they are ideal."""
        ideal = self.mechanism.ideal()
        return self if ideal is self.mechanism else plan(ideal)

    @cached_property
    def branches(self) -> Branches:
        """Closure equations of the ideal mechanism on all branches of its assembly."""
        return every_branch(self.ideal.mechanism, self.ideal.coordinates)

    @property
    def bodies(self) -> tuple[Body, ...]:
        return self.mechanism.bodies

    @property
    def drives(self) -> tuple[Drive, ...]:
        return self.mechanism.drives

    @property
    def rods(self) -> tuple[Rod, ...]:
        """Rods; the kernels treat them after the components."""
        return self.mechanism.rods

    @cached_property
    def components(self) -> tuple[Component, ...]:
        """Components that exert forces."""
        return self.mechanism.exerting

    @cached_property
    def acting(self) -> tuple[Component, ...]:
        """Components that the kernels read: those that exert forces, then the latches."""
        return acting(self.mechanism)

    @cached_property
    def actuators(self) -> list[tuple[int, Actuator]]:
        """Actuators with their component indices."""
        return [(i, part) for i, part in enumerate(self.mechanism.components) if isinstance(part, Actuator)]

    @cached_property
    def contacts(self) -> tuple[Revolute | ContactPoint, ...]:
        """Possible contacts: clearance joints, then the contact points of clearance guides."""
        return self.mechanism.contacts

    @cached_property
    def clearances(self) -> tuple[Clearance | GuideClearance, ...]:
        """Clearance and laws of each possible contact."""
        return tuple(contact.clearance for contact in self.contacts if contact.clearance is not None)

    @cached_property
    def hard_places(self) -> list[int]:
        """Indices of hard contacts."""
        return self._places("hard")

    @cached_property
    def compliant_places(self) -> list[int]:
        """Indices of compliant contacts."""
        return self._places("compliant")

    def _places(self, kind: ContactKind) -> list[int]:
        return [j for j, clearance in enumerate(self.clearances) if clearance.contact == kind]

    @cached_property
    def lubricated(self) -> tuple[tuple[Revolute, Clearance, Lubrication], ...]:
        """Joints with an oil film, each with its clearance and its oil."""
        return self.mechanism.lubricated

    def places(self, names: Iterable[str]) -> np.ndarray:
        """Return the indices of joints, guides or contact points in the mechanism's `joint_names`."""
        return np.array([self._joint_place[name] for name in names], np.int64)

    @cached_property
    def _joint_place(self) -> dict[str, int]:
        return {name: k for k, name in enumerate(self.mechanism.joint_names)}

    @property
    def motions(self) -> list[tuple[str, TimeFunction]]:
        """Prescribed angles and distances, each with its description."""
        angles = [(f"the drive of '{drive.body}'", drive.motion) for drive in self.drives]
        angles += [(f"drive '{drive.name}'", drive.motion) for drive in self.mechanism.coordinate_drives]
        return angles + [(f"the length of rod '{rod.name}'", rod.motion) for rod in self.rods if rod.motion is not None]

    @property
    def gravity_vector(self) -> np.ndarray:
        """Acceleration of gravity, shape (2,) [m/s^2]."""
        angle = self.mechanism.gravity_direction
        return self.mechanism.gravity * np.array([math.cos(angle), math.sin(angle)])

    @property
    def rounded_lengths(self) -> list[str]:
        """Warning about parts whose rounded lengths contradict the others and are therefore ignored."""
        miss = self.coordinates.miss
        if miss <= ASSEMBLY_TOL:
            return []
        subjects = in_words(list(self.coordinates.redundant))
        return [
            f"the given lengths contradict each other by {miss:.1g}, as rounded numbers do: {subjects} keep"
            f"{'s' if len(self.coordinates.redundant) == 1 else ''} the length that the other parts determine"
        ]

    def eccentricity(self, contact: int) -> PointMap:
        """Return the eccentricity of a clearance joint, or the vector of a contact point, as a map."""
        part = slice(self.model.element_start[contact], self.model.element_start[contact + 1])
        return PointMap(self.model.element_column[part], self.model.element_row[:2, part])


def plan(mechanism: Mechanism) -> Plan:
    """Return the plan of a mechanism: the mechanism with the tables that its simulation needs.

    Compilation takes a fifth of the time of a short run. The last plans are kept; a mechanism that differs from one of them
    only in parameters of the case shares its tables.
    """
    recent = list(RECENT_PLANS)
    for compiled_mechanism, recent_plan in recent:
        if compiled_mechanism is mechanism:
            return recent_plan
    whole = with_mode_counts(mechanism)
    plans = [recent_plan for _, recent_plan in recent]
    shared = next((other for other in plans if other.fits(whole)), None)
    if shared is None:
        new_plan = compiled(whole, next((other for other in plans if other.differs_in_mass(whole)), None))
        same = (other for other in plans if other.structure == new_plan.structure)
        new_plan = next((replace(new_plan, structural=other.structural) for other in same), new_plan)
    else:
        new_plan = shared.case(whole)
    RECENT_PLANS.appendleft((mechanism, new_plan))
    return new_plan


RECENT_PLANS: deque[tuple[Mechanism, Plan]] = deque(maxlen=8)
"""Last compiled mechanisms and their plans; one run needs up to five, for example with ideal joints or rigid bars."""


def compiled(mechanism: Mechanism, lighter: Plan | None = None) -> Plan:
    """Return the plan of a mechanism with newly computed tables; `lighter` is that of a mechanism with other masses."""
    reduction = make_reduction(mechanism) if lighter is None else lighter.reduction
    coordinates = reduced(mechanism, reduction)
    model = make_model(mechanism, coordinates)
    maps = body_maps(mechanism, coordinates)
    balances = balance(mechanism, None if lighter is None else lighter.balance)
    return Plan(
        mechanism,
        coordinates,
        model,
        maps,
        balances,
        _angles(mechanism, coordinates, model),
        _structure(mechanism, (model, maps, balances)),
        reduction,
    )


def _structure(mechanism: Mechanism, tables: Iterable[Any]) -> tuple[Any, ...]:
    """Return the indices in tables and the shapes of their arrays of floats, and the kinds of components and contacts."""
    kinds = (
        tuple(type(part) for part in acting(mechanism)),
        tuple(part.clearance.contact for part in mechanism.contacts if part.clearance),
    )
    parts = (part for table in tables for part in table if not isinstance(part, float))
    return *kinds, *(_structure_of(part) for part in parts)


def _structure_of(part: Any) -> Any:
    if not isinstance(part, np.ndarray):
        return part
    return part.shape if part.dtype.kind == "f" else (part.shape, part.tobytes())


def _computed_once(tables: dict[str, Any], name: str, make: Callable[[], Any]) -> Any:
    table = tables.get(name)
    if table is None:
        table = tables[name] = make()
    return table


def _angles(mechanism: Mechanism, coordinates: Coordinates, model: Model) -> np.ndarray:
    """Return the placed angles of families of parallel bodies, then of components and constraints."""
    angles = [mechanism.body(family.bodies[0]).placed_angle for family in coordinates.families]
    for i, component in enumerate(acting(mechanism)):
        if model.reference_of[i] >= 0:
            angles.append(start_coordinates(mechanism, component)[-1])
    angles += [angle for constraint in coordinates.constraints for _, angle in constraint.turning]
    return np.array(angles, float)


def _table_entries(mechanism: Mechanism) -> list[Any]:
    """Return the parts of a mechanism that its tables depend on; a change in them needs new tables."""
    entire = [getattr(mechanism, name) for name in TABLE_FIELDS]
    driven, tracked = [drive.body for drive in mechanism.drives], [(track.body, track.point) for track in mechanism.tracks]
    joints = [(joint.name, joint.journal, joint.bearing, _gap_entries(joint.clearance)) for joint in mechanism.joints]
    components = [_component_entries(part) for part in mechanism.components]
    return [*entire, driven, tracked, joints, components, mechanism.clearances_closed]


def _is_same(first: Any, second: Any) -> bool:
    """Return whether two values are equal to the last bit; 0.0 and -0.0 compile to different tables."""
    return first is second or (first == second and repr(first) == repr(second))


def _placement(body: Body) -> tuple[Any, ...]:
    """Return the properties of a body other than its masses and moment of inertia."""
    return body.rotates, *(getattr(body, part.name) for part in fields(body) if part.name not in MASS_FIELDS)


def _gap_entries(gap: Clearance | None) -> Any:
    """Return the properties of a clearance that decide the rows of the tables: contact kind, internal states, oil, friction."""
    return gap and (gap.contact, contact_states(gap), gap.lubrication is None, isinstance(gap.friction, NoFriction))


def _component_entries(part: Any) -> tuple[Any, ...]:
    """Return the class, attachment and internal states of a component, and whether it has a time function.

    A motor is returned whole, as its rotor is part of the mass matrix, and so is a bar by modes, which the coordinates hold.
    """
    port = part.declaration.port
    if part.declaration.motor or isinstance(part, FlexibleBar):
        return type(part), part
    timed = getattr(part, "time_function", None) is not None
    states = tuple(state.name for state in part.states)
    return type(part), timed, states, *(getattr(part, name) for name in (*port.points, *port.turning, *port.numbers))
