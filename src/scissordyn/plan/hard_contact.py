"""Tables of hard contacts for the kernels, and the stiffness laws of contacts."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np

from scissordyn.errors import InputError
from scissordyn.mechanics.band import width
from scissordyn.mechanics.hard_elastic import TOUCHING_DEPTH_MAX
from scissordyn.mechanics.hard_result import STRUCK
from scissordyn.mechanics.hard_rows import HardContacts, HardModel, HardParameters, HardState, HardWork
from scissordyn.mechanics.impulse_solver import DEPENDENT
from scissordyn.mechanics.pivoting import table_shape
from scissordyn.model.clearance import Clearance, GuideClearance, hard_numbers
from scissordyn.plan.acting import scratch
from scissordyn.plan.ordering import members, narrow, pairs_of, reach
from scissordyn.plan.plan import Plan
from scissordyn.plugin.element import ELEMENT_PARAMETERS_MAX, pointers, row_of

SPEED_INDEPENDENT = ("beam", "force", "torque", "constant_force_spring")
"""Kinds of components without damping rows in the step equations of hard contacts.

Their force does not depend on a speed, or their damping is weak (beams).
"""

ROW_FIELDS = ("acts", "free", "before", "impulse", "velocity", "shift", "right")
"""Names of the fields of `HardWork` with one entry for each row of the step equations."""
STATE_FIELDS = ("kept_slope", "slope", "middle", "scratch")
"""Names of the fields of `HardState` and `HardWork` with one entry for each entry of the state y."""
ELEMENT_ROWS_MAX = 3  # Largest number of rows of a component in the step equations: damping along x, along y, and of rotation


class ElasticLaw(NamedTuple):
    """Elastic force of a contact as a function of its indentation: compiled functions and their parameters."""

    force: int  # Pointer to the force
    energy: int  # Pointer to the energy; 0 for an energy by quadrature
    row: np.ndarray  # (ELEMENT_PARAMETERS_MAX,) Parameters of the law


def elastic_law(clearance: Clearance | GuideClearance) -> ElasticLaw:
    kernels = pointers(clearance.stiffness)
    return ElasticLaw(kernels["force"], kernels["energy"], row_of(clearance.stiffness, clearance.surfaces))


def damped_components(plan: Plan) -> list[tuple[int, int]]:
    """Return the component index and the direction index of each row with a velocity-dependent force."""
    kinds = [part.declaration for part in plan.components]
    damped = [
        (i, min(len(kind.port.forces), ELEMENT_ROWS_MAX))
        for i, kind in enumerate(kinds)
        if kind.section not in SPEED_INDEPENDENT
    ]
    return [(i, axis) for i, rows in damped for axis in range(rows)]


HARD_START: Mapping[str, Any] = MappingProxyType(
    {
        **dict.fromkeys(HardState._fields, 0),
        "ahead": (-np.inf, np.inf, -np.inf),
        "longest": np.inf,
    }
)
"""Values of the fields of `HardState` at the start of a run."""


def hard_contacts(plan: Plan) -> HardContacts:
    """Return the tables of a plan's hard contacts, without the parameters of a case, which `put_hard_numbers` writes."""
    model = plan.model
    hard_model: HardModel = plan.structure_table("hard contacts", lambda: _hard_model(plan))
    count, rows, states = hard_model.which.size, hard_model.place.size, 2 * model.n + int(model.state_start[-1])
    band = int(hard_model.reach[0])
    value = np.zeros(ELEMENT_ROWS_MAX * model.element_column.size + model.constraint_column.size)
    shapes: dict[str, Any] = {
        **dict.fromkeys((*HardParameters._fields, *HardState._fields, *HardWork._fields), count),
        **dict.fromkeys(ROW_FIELDS, rows),
        **dict.fromkeys(STATE_FIELDS, states),
        **dict.fromkeys(("size", "since", "locate", "longest", "drive_work"), 1),
        "ahead": 3,
        "elastic": (count, ELEMENT_PARAMETERS_MAX),
        "bristle": int(np.max(np.diff(model.state_start), initial=0)),
        "damping": hard_model.damped.size,
        "impact": 3,
        "gram": (rows, 2 * band + 1),
        "band": (rows, width(band, band)),
        "pivots": 2 * rows,
        "mass_row": model.constraint_start.size - 1,
        "result": (count, STRUCK + 1),
        "units": (2 * count + 1, rows),
        "table": table_shape(count),
        "basic": 3 * count,
        "beside": 3 * count + 1,
        "counts": DEPENDENT + 1,
    }

    def zeros(described: Any) -> Any:
        return described(**scratch(described, {name: shapes[name] for name in described._fields}))

    return HardContacts(
        model=hard_model,
        parameters=zeros(HardParameters),
        state=zeros(HardState),
        work=zeros(HardWork)._replace(
            value=value, normal=value[: ELEMENT_ROWS_MAX * model.element_column.size].reshape(ELEMENT_ROWS_MAX, -1)
        ),
    )


def _hard_model(plan: Plan) -> HardModel:
    """Return the structure of the equations for the impulses of a plan's hard contacts."""
    which = [*plan.hard_places, *plan.compliant_places]
    damped = damped_components(plan)
    rows = plan.model.constraint_start.size - 1 + 2 * len(which) + len(damped)
    entries = _entries(plan, which, damped)
    near, place = narrow(members((columns for columns, _ in entries), plan.model.n), rows)
    pairs = pairs_of(near)
    product_start, products = _products(entries, pairs)
    return HardModel(
        which=np.array(which, np.int64),
        compliant=np.repeat([0, 1], [len(plan.hard_places), len(plan.compliant_places)]).astype(np.int64),
        damped=np.array([i for i, _ in damped], np.int64),
        damped_axis=np.array([axis for _, axis in damped], np.int64),
        place=place,
        pairs=pairs,
        reach=np.array([reach(near, place)], np.int64),
        products=products,
        product_start=product_start,
    )


def put_hard_numbers(contacts: HardContacts, plan: Plan) -> None:
    """Write the parameters of a case into the tables of hard contacts, and reset their state to that of the start."""
    parameters = contacts.parameters
    for i, j in enumerate(contacts.model.which.tolist()):
        clearance = plan.contacts[j].clearance
        assert clearance is not None
        if contacts.model.compliant[i] == 0:
            parameters.restitution[i], parameters.kinetic[i], parameters.static[i] = hard_numbers(clearance)
        elif clearance.damping.states:
            what = f"damping law '{clearance.damping.name}' of '{plan.contacts[j].name}' has states, but a contact is hard"
            raise InputError(what, "a damping law without states", 'contact = "compliant" in all joints')
        parameters.law[i], parameters.energy[i], parameters.elastic[i] = elastic_law(clearance)
        parameters.floor[i] = TOUCHING_DEPTH_MAX * clearance.clearance
    reset_hard_state(contacts.state)


def reset_hard_state(state: HardState) -> None:
    """Set the state of hard contacts to that at the start of a run."""
    for name, start in HARD_START.items():
        getattr(state, name)[:] = start


Entries = list[tuple[np.ndarray, np.ndarray]]
"""Free columns with entries of each row, in order, and the indices of these entries in `HardWork.value`."""


def _entries(plan: Plan, which: list[int], damped: list[tuple[int, int]]) -> Entries:
    """Return the entries of all rows: constraints, N and T of each contact, and velocity-dependent forces of components."""
    model = plan.model
    size = model.element_column.size
    entries = [
        (model.constraint_column, model.constraint_start[k], model.constraint_start[k + 1], ELEMENT_ROWS_MAX * size)
        for k in range(model.constraint_start.size - 1)
    ]
    acting = [(j, axis) for j in which for axis in range(2)] + [(len(plan.contacts) + j, axis) for j, axis in damped]
    entries += [(model.element_column, model.element_start[e], model.element_start[e + 1], axis * size) for e, axis in acting]
    rows = []
    for columns, start, end, shift in entries:
        at = np.arange(start, end)[columns[start:end] < model.n]
        at = at[np.argsort(columns[at], kind="stable")]
        rows.append((columns[at], at + shift))
    return rows


def _products(entries: Entries, pairs: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the pairs of entries whose products add up to the scalar product of each pair of rows."""
    counts = np.array([columns.size for columns, _ in entries], np.int64)
    columns, values = (np.concatenate([np.zeros(0, np.int64), *parts]) for parts in zip(*entries, strict=True))
    row_of_entry = np.repeat(np.arange(counts.size), counts)
    (a, b), stride = pairs.T, 1 + int(np.max(columns, initial=0))
    order = row_of_entry * stride + columns  # increases, as the columns of each row do
    pair = np.repeat(np.arange(len(pairs)), counts[a])
    first_entries = _ranges(np.cumsum(counts)[a] - counts[a], counts[a])
    first, last = (np.searchsorted(order, b[pair] * stride + columns[first_entries], side) for side in ("left", "right"))
    match_counts = last - first
    starts = np.concatenate([[0], np.cumsum(np.bincount(pair, match_counts, len(pairs)).astype(np.int64))])
    return starts, np.stack([values[np.repeat(first_entries, match_counts)], values[_ranges(first, match_counts)]], axis=1)


def _ranges(first: np.ndarray, counts: np.ndarray) -> np.ndarray:
    """Return ranges of integers one after another, each from its first integer."""
    return np.repeat(first - np.cumsum(counts) + counts, counts) + np.arange(counts.sum())
