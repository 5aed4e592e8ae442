"""Tables of friction in ideal joints: the reactions it depends on and the loads of flexible bars."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from scissordyn.components.guide_friction import GuideFriction
from scissordyn.components.lugre import GuideLuGre
from scissordyn.errors import InputError
from scissordyn.mechanics.balance import Balance
from scissordyn.mechanics.band import width
from scissordyn.mechanics.bending_loads import BendingLoads
from scissordyn.mechanics.body_maps import BodyMaps
from scissordyn.mechanics.system import FrictionWorkspace, Model
from scissordyn.model.mechanism import Mechanism
from scissordyn.plan.acting import acting, scratch
from scissordyn.plan.bending import beam_mass, bends
from scissordyn.plan.bodies import guides_with_moment
from scissordyn.plan.coordinates import Coordinates, PointMap, stacked

COUPLED_STATES_MAX = 40
"""Largest number of states for which implicit steps include the derivatives of joint reactions by the states.

These derivatives cost two evaluations of the equations of motion for each state.
"""


def make_friction_workspace(
    mechanism: Mechanism, coordinates: Coordinates, model: Model, balance: Balance, maps: BodyMaps, gravity: np.ndarray
) -> FrictionWorkspace:
    """Return the tables and scratch arrays of friction in the ideal joints of a mechanism."""
    parts = acting(mechanism)
    chosen = [i for i, part in enumerate(parts) if "reaction" in part.declaration.context]
    place = np.full(len(parts), -1, np.int64)
    place[chosen] = np.arange(len(chosen))
    rows = [_reactions_of(mechanism, parts[i], balance) for i in chosen]
    f, bodies, unknowns = len(chosen), len(mechanism.bodies) if chosen else 0, balance.order.size if chosen else 0
    states = 2 * model.n + int(model.state_start[-1])
    states = states if chosen and states <= COUPLED_STATES_MAX else 0
    pressures = maps.pressure.shape[0] if chosen else 0
    lanes, widest = 1 + f + pressures, int(np.max(np.diff(balance.start), initial=0))
    return FrictionWorkspace(
        component=np.array(chosen, np.int64),
        place=place,
        guide=np.array([guide for guide, _, _ in rows], np.int64),
        unknown=np.array([unknown for _, unknown, _ in rows], np.int64).reshape(-1, 2),
        moment=np.array([moment for _, _, moment in rows], float),
        gravity=gravity,
        balance=balance,
        maps=maps,
        bending=_bending_loads(mechanism, coordinates, gravity, acting=bool(chosen) and bends(mechanism)),
        **scratch(
            FrictionWorkspace,
            {
                **dict.fromkeys(("size", "step", "by_time", "upper"), f),
                **dict.fromkeys(("pivots", "share_pivots"), 2 * f),
                **dict.fromkeys(("direction", "position", "acceleration"), (lanes, bodies, 2)),
                **dict.fromkeys(("by_state", "solved"), (f, states)),
                **dict.fromkeys(("response", "frozen"), (f, model.n)),
                **dict.fromkeys(("force", "change"), model.n + model.nb),
                "fault": 1,
                "pressing": (pressures, f + 1),
                "pressure": (pressures, 2),
                "angular_acceleration": (lanes, bodies),
                "load": (lanes, bodies, 3),
                "matrix": (unknowns, 2 * balance.band + 1, 1),
                "rows": (3, widest, 1),
                "right": (3, lanes),
                "reaction": (unknowns, lanes),
                "multiplier": model.constraint_start.size - 1,
                "slope": (f, width(f, f)),
                "share": (f if states else 0, width(f, f)),
                "rates": states,
            },
        ),
    )


def _reactions_of(mechanism: Mechanism, part: Any, balance: Balance) -> tuple[int, tuple[int, int], float]:
    """Return 1 for a guide or 0 for a pin, the unknown reactions that friction depends on, and its force per unit moment."""
    label = f"{part.declaration.label} '{part.name}'"
    if any(contact.clearance and contact.clearance.contact == "hard" for contact in mechanism.contacts):
        raise InputError(f"{label} together with hard contact", "contact = 'compliant'")
    if isinstance(part, GuideFriction | GuideLuGre):
        return 1, *_reactions_of_guide(mechanism, part, balance, label)
    pair = {part.body, part.base}
    pins = [k for k, joint in enumerate(mechanism.ideal_joints) if set(joint.bodies) == pair]
    if len(pins) != 1:
        names = ", ".join(f"'{a}' and '{b}'" for a, b in (joint.bodies for joint in mechanism.ideal_joints))
        raise InputError(
            f"{label}: {len(pins) or 'no'} ideal pins join '{part.body}' and '{part.base}'",
            f"bodies that one ideal pin joins: {names or 'none'}",
        )
    first = balance.joints[0] + 2 * pins[0]
    return 0, (int(balance.order[first]), int(balance.order[first + 1])), 0.0


def _reactions_of_guide(
    mechanism: Mechanism, part: GuideFriction | GuideLuGre, balance: Balance, label: str
) -> tuple[tuple[int, int], float]:
    """Return the unknowns (force, moment) of the guide that friction acts in, and the sum of normal forces per unit moment.

    They are indices; that of the moment is -1 if the guide has none.
    """
    guides = mechanism.ideal_guides
    for g, guide in enumerate(guides):
        turned = math.remainder(guide.direction - part.direction, math.pi)
        if guide.follower == part.end and guide.body == part.start[0] and abs(turned) < 1e-9:  # [rad]
            force = int(balance.order[balance.guides[0] + g])
            if not guide.aligned:
                return (force, -1), 0.0
            if not part.length > 0.0:
                raise InputError(
                    f"{label} has no length, but guide '{guide.name}' keeps its follower aligned by a moment",
                    "length, the distance between the edges at which the guide presses on its follower",
                )
            moment = [other.name for other in guides_with_moment(mechanism)].index(guide.name)
            # the unknown moment is in units of the balance's length
            return (force, int(balance.order[balance.guide_moments[0] + moment])), 2.0 * balance.length / part.length
    listed = "; ".join(
        f"start on '{guide.body}', end = '{'.'.join(guide.follower)}', direction = {math.degrees(guide.direction):.6g} deg"
        for guide in guides
    )
    raise InputError(f"{label}: no ideal guide matches it", listed or "a mechanism with ideal guides")


def _bending_loads(mechanism: Mechanism, coordinates: Coordinates, gravity: np.ndarray, *, acting: bool) -> BendingLoads:
    """Return the tables of the loads of flexible bars on their cross-sections; empty tables if friction does not act."""
    natural, bodies = coordinates.natural, mechanism.bodies if acting else ()
    axes, tangents = (natural.axes, natural.tangents) if acting else ((), {})
    maps, weights = [], np.zeros((len(bodies), 4))
    if acting:
        mass = beam_mass(mechanism, natural)
        rows, weight = (mass @ coordinates.matrix), mass @ natural.translation(gravity)
        rows = rows if isinstance(rows, np.ndarray) else rows.toarray()
    for b, body in enumerate(bodies):
        p, count = natural.offsets[body.name], 4 if natural.rotates(body.name) else 2
        table = np.zeros((4, rows.shape[1]))
        table[:count], weights[b, :count] = rows[p : p + count], weight[p : p + count]
        columns = np.flatnonzero(np.any(table != 0.0, axis=0))
        maps.append(PointMap(columns, table[:, columns]))
    index = {body.name: b for b, body in enumerate(bodies)}
    vectors, first, bars = list[tuple[int, int, int, float]](), 0, {}
    for axis in axes:
        sections = axis.bar.sections
        bars[id(axis)] = first
        vectors += [(first + k, index[name], 0, 0.0) for k, name in enumerate(sections)]
        for row, k in enumerate(axis.shapes.clamped, len(sections)):
            if k in axis.directed:
                vectors.append((first + row, index[sections[k]], 1, axis.bar.angles[k]))
        first += axis.shapes.count
    couples, turned, slopes = list[tuple[int, ...]](), list[float](), [np.zeros(0)]
    parts = len(mechanism.contacts) + len(mechanism.components)
    joints = enumerate(mechanism.clearance_joints)
    for e, joint in (*joints, *((parts + f, joint) for f, (joint, _, _) in enumerate(mechanism.lubricated))):
        for side, (name, _) in enumerate((joint.journal, joint.bearing)):
            if name in tangents:
                axis, k = tangents[name]
                # the force of an oil film acts on the bearing at the journal's centre
                couples.append((e, side, bars[id(axis)], int(side == 1 and e >= parts), sum(map(len, slopes))))
                turned.append(axis.bar.angles[k])
                slopes.append(axis.shapes.at(np.array([axis.shapes.places[k]]), 1)[0])
    return BendingLoads(
        **stacked(maps, 4) | ({} if acting else {"start": np.zeros(0, np.int64)}),
        weight=weights,
        origin=-np.array([body.centre for body in bodies]).reshape(-1, 2),
        shape=np.zeros((first, 2)),
        vector=np.array([row[:3] for row in vectors], np.int64).reshape(-1, 3),
        turned=_cosines_sines([angle for *_, angle in vectors]),
        couple=np.array(couples, np.int64).reshape(-1, 5),
        couple_turned=_cosines_sines(turned),
        couple_weight=np.concatenate(slopes),
        couple_shapes=np.array(list(map(len, slopes[1:])), np.int64),
    )


def _cosines_sines(angles: list[float]) -> np.ndarray:
    """Return cosines and sines of angles, shape (angles, 2)."""
    return np.array([(math.cos(angle), math.sin(angle)) for angle in angles], float).reshape(-1, 2)
