"""A mechanism compiled: tables for the kernels, and the names of what is in them."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from scissordyn.components.actuator import Actuator
from scissordyn.components.declaration import Component
from scissordyn.components.rod import Rod
from scissordyn.components.time_function import TimeFunction
from scissordyn.laws.friction.none import NoFriction
from scissordyn.mechanics.body_maps import BodyMaps
from scissordyn.mechanics.reactions import Balance
from scissordyn.mechanics.system import FrictionWorkspace, Model, Parameters
from scissordyn.model.body import Body
from scissordyn.model.clearance import Clearance, ContactKind, ContactPoint, GuideClearance, Lubrication, contact_states
from scissordyn.model.coupling import Drive
from scissordyn.model.joint import Revolute
from scissordyn.model.mechanism import Mechanism
from scissordyn.plan.acting import acting, start_coordinates
from scissordyn.plan.bodies import balance, body_maps
from scissordyn.plan.branches import Branches, every_branch
from scissordyn.plan.coordinates import Coordinates, PointMap
from scissordyn.plan.elimination import in_words
from scissordyn.plan.flexible import with_mode_counts
from scissordyn.plan.joint_friction import make_friction_workspace
from scissordyn.plan.linear_constraints import reduced
from scissordyn.plan.model import make_model
from scissordyn.plan.numbers import make_parameters
from scissordyn.plan.rest import frictionless, still_at

ENTIRE = ("bodies", "ground", "welds", "guides", "rods", "latches", "couplings", "coordinate_drives")
"""Fields of a mechanism that all enter the tables."""

SAID_MISS = 1e-8  # Lengths that contradict each other by more than this fraction are said to do so


@dataclass(frozen=True, eq=False)
class Plan:
    """What everything below works on in place of a mechanism: tables that follow from its parts, and their names.

    The tables are never written; cases that differ only in numbers which do not enter them share them (`fits`, `case`).
    """

    mechanism: Mechanism = field(repr=False)  # With the numbers of the case
    coordinates: Coordinates  # Maps of points and directions, and the quadratic constraints
    model: Model = field(repr=False)  # What the kernels read of topology and lengths
    maps: BodyMaps = field(repr=False)  # Where the bodies are, and where force elements, rods and latches act on them
    balance: Balance = field(repr=False)  # Of forces and moments, for the reactions of ideal joints
    # That turns are counted from: of families of parallel bodies, then of components and in constraints [rad]
    angles: np.ndarray = field(repr=False)
    # What was last found with these tables, by what it was asked for: the assembly at the start, singular positions
    answers: dict[str, Any] = field(default_factory=dict, repr=False)

    def fits(self, other: Mechanism) -> bool:
        """Whether another mechanism has the same tables: it differs only in clearances, laws, motions of drives and gravity."""
        return all(map(_is_same, _entering(self.mechanism), _entering(other)))

    def case(self, other: Mechanism) -> Plan:
        """The plan of another case that fits: the same tables, its own parts and numbers."""
        changed = replace(self, mechanism=other)
        if "branches" in self.__dict__:
            changed.__dict__["branches"] = self.branches
        return changed

    def numbers(self) -> Parameters:
        """The numbers of the case, in arrays of their own."""
        return make_parameters(self.mechanism, self.coordinates)

    def friction_workspace(self) -> FrictionWorkspace:
        """What friction in ideal joints reads, with scratch of its own."""
        balance, maps, gravity = self.balance, self.maps, self.gravity_vector
        return make_friction_workspace(self.mechanism, self.coordinates, self.model, balance, maps, gravity)

    @cached_property
    def ideal(self) -> Plan:
        """The plan of the mechanism with ideal joints and guides; itself if they are."""
        ideal = self.mechanism.ideal()
        return self if ideal is self.mechanism else plan(ideal)

    @property
    def at_rest(self) -> Plan:
        """The plan of the mechanism without friction, its drives and prescribed distances constant at their values of t = 0."""
        mechanism = frictionless(self.mechanism)
        return still_at(self if mechanism is self.mechanism else plan(mechanism), 0.0)

    @cached_property
    def branches(self) -> Branches:
        """The closure equations of the ideal mechanism on every branch of its assembly."""
        return every_branch(self.ideal.mechanism, self.ideal.coordinates)

    @property
    def bodies(self) -> tuple[Body, ...]:
        return self.mechanism.bodies

    @property
    def drives(self) -> tuple[Drive, ...]:
        return self.mechanism.drives

    @property
    def rods(self) -> tuple[Rod, ...]:
        """The rods, which act behind the components."""
        return self.mechanism.rods

    @property
    def components(self) -> tuple[Component, ...]:
        return self.mechanism.exerting

    @property
    def acting(self) -> tuple[Component, ...]:
        """The components that the kernels know: those that exert forces, then the latches."""
        return acting(self.mechanism)

    @property
    def actuators(self) -> list[tuple[int, Actuator]]:
        """The actuators, each with its number among the components."""
        return [(i, part) for i, part in enumerate(self.mechanism.components) if isinstance(part, Actuator)]

    @property
    def contacts(self) -> tuple[Revolute | ContactPoint, ...]:
        """The possible contacts: clearance joints, then the contact points of clearance guides."""
        return self.mechanism.contacts

    @cached_property
    def clearances(self) -> tuple[Clearance | GuideClearance, ...]:
        """Size and laws of each of the possible contacts."""
        return tuple(contact.clearance for contact in self.contacts if contact.clearance is not None)

    @property
    def hard_places(self) -> list[int]:
        return self._places("hard")

    @property
    def compliant_places(self) -> list[int]:
        return self._places("compliant")

    def _places(self, kind: ContactKind) -> list[int]:
        return [j for j, clearance in enumerate(self.clearances) if clearance.contact == kind]

    @property
    def lubricated(self) -> tuple[tuple[Revolute, Clearance, Lubrication], ...]:
        """The joints with a film of oil, each with its clearance and its oil."""
        return self.mechanism.lubricated

    def places(self, names: Iterable[str]) -> np.ndarray:
        """Where some joints, guides or contact points stand among `joint_names`."""
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
        """With its direction, shape (2,) [m/s^2]."""
        angle = self.mechanism.gravity_direction
        return self.mechanism.gravity * np.array([math.cos(angle), math.sin(angle)])

    @property
    def rounded_lengths(self) -> list[str]:
        """What contradicts the other parts by the rounding of its numbers, and is left to them, in words."""
        miss = self.coordinates.miss
        if miss <= SAID_MISS:
            return []
        subjects = in_words(list(self.coordinates.redundant))
        return [
            f"the lengths given contradict each other by {miss:.1g}, as rounded numbers do: {subjects} keep"
            f"{'s' if len(self.coordinates.redundant) == 1 else ''} the length that the other parts leave"
        ]

    def eccentricity(self, contact: int) -> PointMap:
        """The eccentricity of a clearance joint, or the vector of a contact point, as a map."""
        part = slice(self.model.element_start[contact], self.model.element_start[contact + 1])
        return PointMap(self.model.element_column[part], self.model.element_row[:2, part])


def plan(mechanism: Mechanism) -> Plan:
    """The plan of a mechanism.

    Compiling it takes a fifth of the time of a short run. The last plans are kept: a mechanism that differs from one of
    theirs in numbers of the case alone shares its tables.
    """
    kept = list(RECENT)
    for known, made in kept:
        if known is mechanism:
            return made
    whole = with_mode_counts(mechanism)
    shared = next((made for _, made in kept if made.fits(whole)), None)
    made = compiled(whole) if shared is None else shared.case(whole)
    RECENT.appendleft((mechanism, made))
    return made


RECENT: deque[tuple[Mechanism, Plan]] = deque(maxlen=8)
"""The mechanisms that were compiled last and their plans: a run has up to five, with ideal joints, rigid bars and so on."""


def compiled(mechanism: Mechanism) -> Plan:
    """The plan of a mechanism with tables of its own."""
    coordinates = reduced(mechanism)
    model = make_model(mechanism, coordinates)
    return Plan(
        mechanism,
        coordinates,
        model,
        body_maps(mechanism, coordinates),
        balance(mechanism),
        _angles(mechanism, coordinates, model),
    )


def _angles(mechanism: Mechanism, coordinates: Coordinates, model: Model) -> np.ndarray:
    """Angles of families of parallel bodies, then of components and in constraints, as placed."""
    angles = [mechanism.body(family.bodies[0]).placed_angle for family in coordinates.families]
    for i, component in enumerate(acting(mechanism)):
        if model.reference_of[i] >= 0:
            angles.append(start_coordinates(mechanism, component)[-1])
    angles += [angle for constraint in coordinates.constraints for _, angle in constraint.turning]
    return np.array(angles, float)


def _entering(mechanism: Mechanism) -> list[Any]:
    """What of a mechanism enters its tables.

    Whatever could, as a length or a mass, has them made anew: that costs time only.
    """
    entire = [getattr(mechanism, name) for name in ENTIRE]
    driven, tracked = [drive.body for drive in mechanism.drives], [(track.body, track.point) for track in mechanism.tracks]
    joints = [(joint.name, joint.journal, joint.bearing, _of_gap(joint.clearance)) for joint in mechanism.joints]
    components = [_of_component(part) for part in mechanism.components]
    return [*entire, driven, tracked, joints, components, mechanism.clearances_closed]


def _is_same(one: Any, other: Any) -> bool:
    """Whether two values are equal to the last bit: 0.0 and -0.0 are equal and compile to other tables."""
    return one is other or (one == other and repr(one) == repr(other))


def _of_gap(gap: Clearance | None) -> Any:
    """Contact kind, internal states, and the parts whose presence adds rows to the tables."""
    return gap and (gap.contact, contact_states(gap), gap.lubrication is None, isinstance(gap.friction, NoFriction))


def _of_component(part: Any) -> tuple[Any, ...]:
    """Return the class and attachment of a component, and whether it has a time function.

    A motor is returned whole: the inertia of its rotor is part of the mass matrix.
    """
    port = part.declaration.port
    if part.declaration.motor:
        return type(part), part
    timed = getattr(part, "time_function", None) is not None
    return type(part), timed, *(getattr(part, name) for name in (*port.points, *port.turning, *port.numbers))
