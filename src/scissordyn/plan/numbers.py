"""Parameters of a case for the kernels."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from scissordyn.components.actuator import Actuator
from scissordyn.components.declaration import COMPONENT_PARAMETERS_MAX as COMPONENT_PARAMETERS
from scissordyn.components.declaration import LAW_KINDS
from scissordyn.control.signal import SIGNALS
from scissordyn.errors import InputError
from scissordyn.laws.foundation import pressure_table
from scissordyn.laws.trial import trial_forces
from scissordyn.mechanics.hard_contour import opened_contour
from scissordyn.mechanics.system import CONTACT, LAW, Parameters
from scissordyn.mechanics.time_function import PIECE_COLUMNS, breaks_of, function_rows
from scissordyn.model.clearance import HARD_STATES, Clearance, ContactPoint
from scissordyn.model.joint import Revolute
from scissordyn.model.mechanism import Mechanism
from scissordyn.plan.acting import acting, offsets, start_coordinates, time_functions
from scissordyn.plan.bending import beam_mass, bends, whole_masses
from scissordyn.plan.coordinates import Coordinates
from scissordyn.plugin.element import ELEMENT_PARAMETERS_MAX, is_built_in, pointers, row_of


def make_parameters(mechanism: Mechanism, coordinates: Coordinates, weight: np.ndarray) -> Parameters:
    """Return the parameters of a mechanism's laws, components, controllers, motions and loads; `weight` as of `find_weight`."""
    contacts, components = mechanism.contacts, acting(mechanism)
    listed = [(drive.motion, mechanism.body(drive.body).placed_angle) for drive in mechanism.drives]
    listed += time_functions(mechanism, 0)[2] if components else []
    listed += [(constraint.motion, constraint.start) for constraint in coordinates.constraints if constraint.motion]
    rows = [function_rows(motion, start) for motion, start in listed]

    surfaces, (contour, journal, foundation) = np.zeros(len(contacts), CONTACT), worn_contours(contacts)
    for j, contact in enumerate(contacts):
        clearance = contact.clearance
        assert clearance is not None
        joint = clearance.surfaces
        p = surfaces[j]
        p["clearance"], p["radius"] = clearance.clearance, joint.journal_radius
        p["spinless"] = getattr(clearance, "slip", "surfaces") == "contact-points"
        p["area"] = 2.0 * joint.journal_radius * joint.length
        if isinstance(clearance, Clearance) and clearance.is_worn:
            p["cells"], p["journal"] = contour.shape[1], bool(clearance.journal_contour)
            p["loads"] = 8 if p["journal"] else 2
            p["cell_area"] = 2.0 * math.pi * joint.bearing_radius * joint.length / p["cells"]
        if isinstance(contact, ContactPoint):
            p["plane"], p["level"] = 1, contact.distance - joint.journal_radius
            p["normal_x"], p["normal_y"] = contact.normal
        if clearance.contact == "hard" and isinstance(clearance, Clearance) and clearance.wears:
            p["loads"] = 2 if clearance.journal_wear is None else 8
    described: list[tuple[float, ...]] = [()] * len(components)
    control, torque = np.zeros((len(components), ELEMENT_PARAMETERS_MAX)), np.zeros(len(components), np.int64)
    actuator = np.zeros((len(components), 3))
    for i, component in enumerate(components):
        if isinstance(component, Actuator):
            controller = component.controller
            control[i], torque[i] = row_of(controller), pointers(controller)["torque"]
            recorded = SIGNALS.index(controller.recorded) if controller.recorded else 0
            actuator[i] = controller.delay, recorded, controller.recursion_gain
        else:
            described[i] = component.parameters(start_coordinates(mechanism, component))
    law, tables = _laws([contact.clearance for contact in contacts], [part for part in components if part.declaration.contact])
    numbers_of = np.zeros((len(components), max([COMPONENT_PARAMETERS, *map(len, described)])))
    for i, row in enumerate(described):
        numbers_of[i, : len(row)] = row
    breaks = sorted({instant for motion, _ in listed for instant in breaks_of(motion)})
    return Parameters(
        weight=weight,
        motion=np.concatenate(rows) if rows else np.zeros((0, PIECE_COLUMNS)),
        motion_start=offsets(map(len, rows)),
        breaks=np.array(breaks, float),
        value=np.array([constraint.value for constraint in coordinates.constraints], float),
        contact=surfaces,
        whole_mass=whole_masses(mechanism),
        law=law,
        contour=contour,
        journal=journal,
        foundation=foundation,
        elastic=tables[0],
        damping=tables[1],
        friction=tables[2],
        component=numbers_of,
        state_scale=np.array([*_contact_scales(contacts), *(s.size(part) for part in components for s in part.states)], float),
        controller=torque,
        control=control,
        actuator=actuator,
        ideal=np.zeros((0, 6 * len(mechanism.tracks))),
        ideal_step=np.zeros(1),
    )


def _laws(clearances: Sequence[Any], parts: Sequence[Any]) -> tuple[np.ndarray, np.ndarray]:
    """Return the laws of contacts and components, and their parameters by kind, shape (3, laws, parameters)."""
    law, tables = (
        np.zeros(len(clearances) + len(parts), LAW),
        np.zeros((3, len(clearances) + len(parts), ELEMENT_PARAMETERS_MAX)),
    )
    for j, part in enumerate((*clearances, *parts)):
        if getattr(part, "contact", "") == "hard":
            continue  # `plan.hard_contact` holds its tables
        law[j]["bristles"], law[j]["loaded"] = len(part.friction.states), getattr(part, "reference", "loaded") == "loaded"
        for which, kind in enumerate(LAW_KINDS):
            chosen: Any = getattr(part, kind)
            if not is_built_in(chosen) and not getattr(chosen, "states", None):
                trial_forces(chosen, part.surfaces)
            tables[which, j] = row_of(chosen, part.surfaces)
            for name, pointer in pointers(chosen).items():
                if name != "steady":
                    law[j][kind if name == "force" else name] = pointer
    return law, tables


def contour_table(depths: Sequence[float]) -> np.ndarray:
    """Return the depths of a worn contour with cosine and sine of their angles, shape (angles, 3)."""
    angle = 2.0 * math.pi * np.arange(len(depths)) / len(depths)
    return np.stack([np.array(depths, float), np.cos(angle), np.sin(angle)], axis=1)


def worn_contours(contacts: Sequence[Revolute | ContactPoint]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the contours of bearings and of journals, and the pressures of the laws; empty where nothing is worn."""
    worn = {
        j: part.clearance for j, part in enumerate(contacts) if isinstance(part.clearance, Clearance) and part.clearance.is_worn
    }
    if not worn:
        return np.zeros((len(contacts), 0, 3)), np.zeros((len(contacts), 0)), np.zeros((len(contacts), 0, 6))
    contours = [depths for clearance in worn.values() for depths in (clearance.contour, clearance.journal_contour) if depths]
    counts = {len(depths) for depths in contours}
    if len(counts) > 1:
        raise InputError(f"contours of {' and '.join(map(str, sorted(counts)))} depths", "as many depths for each worn surface")
    hard = [part.name for part in contacts if part.clearance is not None and part.clearance.contact == "hard"]
    if hard and any(part.contact == "compliant" for part in worn.values()):
        raise InputError(
            f"a mechanism with a worn bearing of compliant contact has hard contact at '{hard[0]}'",
            "one kind of contact in worn bearings and in the other joints",
            'contact = "compliant"',
        )
    count, pressures = counts.pop(), {j: pressure_table(part.stiffness, part.surfaces) for j, part in worn.items()}
    contour = np.zeros((len(contacts), count, 3))
    journal = np.zeros((len(contacts), count if any(part.journal_contour for part in worn.values()) else 0))
    foundation = np.zeros((len(contacts), *next(iter(pressures.values())).shape))
    for j, clearance in worn.items():
        contour[j], foundation[j] = contour_table(clearance.contour or (0.0,) * count), pressures[j]
        if clearance.journal_contour:
            journal[j] = clearance.journal_contour
        elif clearance.contact == "hard":  # with a worn journal, the sum of both contours is opened in each position
            opened_contour(contour[j], np.zeros(0), clearance.clearance, np.zeros(count))
    return contour, journal, foundation


def find_weight(mechanism: Mechanism, coordinates: Coordinates) -> np.ndarray:
    """Return the generalised forces of gravity on the free coordinates and the drive directions, shape (n + nb,)."""
    placed, natural = coordinates.natural, np.zeros(coordinates.natural.total)
    gx = mechanism.gravity * math.cos(mechanism.gravity_direction)
    gy = mechanism.gravity * math.sin(mechanism.gravity_direction)
    for name, body in placed.bodies.items():
        p, m, (x, y) = placed.offsets[name], body.mass, body.centre
        natural[p : p + 2] = m * gx, m * gy
        if placed.rotates(name):
            natural[p + 2 : p + 4] = m * (x * gx + y * gy), m * (x * gy - y * gx)
    if bends(mechanism):
        natural += beam_mass(mechanism, placed) @ placed.translation(np.array([gx, gy]))
    return np.asarray(coordinates.matrix.T @ natural)


def _contact_scales(contacts: Sequence[Revolute | ContactPoint]) -> list[float]:
    """Return the declared scale of each internal state of the contact laws; 0 for a state without a declared scale."""
    scales: list[float] = []
    for contact in contacts:
        gap: Any = contact.clearance
        laws = [(law, law.states) for law in (gap.friction, gap.damping)] if gap.contact != "hard" else [(gap, HARD_STATES)]
        scales += [0.0 if state.scale is None else state.size(law) for law, states in laws for state in states]
    return scales
