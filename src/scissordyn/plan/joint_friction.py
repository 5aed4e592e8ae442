"""Friction in ideal joints: which reaction each follows, and the room to solve for both."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from scissordyn.component.guide_friction import GuideFriction
from scissordyn.component.lugre import GuideLuGre
from scissordyn.errors import InputError
from scissordyn.mechanics.band import width
from scissordyn.mechanics.body_maps import BodyMaps
from scissordyn.mechanics.reactions import Balance
from scissordyn.mechanics.system import FrictionWorkspace, Model
from scissordyn.model.mechanism import Mechanism
from scissordyn.plan.acting import acting, scratch
from scissordyn.plan.bending import bends
from scissordyn.plan.bending_loads import bending_loads, no_bending_loads
from scissordyn.plan.coordinates import Coordinates

MOST_STATES = 40
"""Beyond so many numbers of the state implicit steps leave out how reactions depend on them: it takes two evaluations each."""

ALIKE = 1e-9  # Directions that differ by less are the same [rad]


def make_friction_workspace(
    mechanism: Mechanism, coordinates: Coordinates, model: Model, balance: Balance, maps: BodyMaps, gravity: np.ndarray
) -> FrictionWorkspace:
    """What friction in the ideal joints of a mechanism reads, and scratch of its own."""
    parts = acting(mechanism)
    chosen = [i for i, part in enumerate(parts) if "reaction" in part.declaration.context]
    place = np.full(len(parts), -1, np.int64)
    place[chosen] = np.arange(len(chosen))
    rows = [_followed(mechanism, parts[i], balance) for i in chosen]
    f, bodies, unknowns = len(chosen), len(mechanism.bodies) if chosen else 0, balance.order.size if chosen else 0
    states = 2 * model.n + int(model.state_start[-1])
    states = states if chosen and states <= MOST_STATES else 0
    lanes, widest = f + 1, int(np.max(np.diff(balance.start), initial=0))
    return FrictionWorkspace(
        component=np.array(chosen, np.int64),
        place=place,
        guide=np.array([guide for guide, _, _ in rows], np.int64),
        unknown=np.array([unknown for _, unknown, _ in rows], np.int64).reshape(-1, 2),
        moment=np.array([moment for _, _, moment in rows], float),
        gravity=gravity,
        balance=balance,
        maps=maps,
        bending=bending_loads(mechanism, coordinates, gravity) if chosen and bends(mechanism) else no_bending_loads(),
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


def _followed(mechanism: Mechanism, part: Any, balance: Balance) -> tuple[int, tuple[int, int], float]:
    """Whether friction is that of a guide, the unknowns that it follows, and the force that a unit of a moment makes."""
    label = f"{part.declaration.label} '{part.name}'"
    if any(contact.clearance and contact.clearance.contact == "hard" for contact in mechanism.contacts):
        raise InputError(f"{label} beside hard contact", "contact = 'compliant'")
    if isinstance(part, GuideFriction | GuideLuGre):
        return 1, *_guide(mechanism, part, balance, label)
    pair = {part.body, part.base}
    pins = [k for k, joint in enumerate(mechanism.ideal_joints) if set(joint.bodies) == pair]
    if len(pins) != 1:
        names = ", ".join(f"'{a}' and '{b}'" for a, b in (joint.bodies for joint in mechanism.ideal_joints))
        raise InputError(
            f"{label}: {len(pins) or 'no'} ideal pin{'s' if len(pins) > 1 else ''} between '{part.body}' and '{part.base}'",
            f"bodies that one ideal pin joins: {names or 'none'}",
        )
    first = balance.joints[0] + 2 * pins[0]
    return 0, (int(balance.order[first]), int(balance.order[first + 1])), 0.0


def _guide(
    mechanism: Mechanism, part: GuideFriction | GuideLuGre, balance: Balance, label: str
) -> tuple[tuple[int, int], float]:
    guides = mechanism.ideal_guides
    for g, guide in enumerate(guides):
        turned = math.remainder(guide.direction - part.direction, math.pi)
        if guide.follower == part.end and guide.body == part.start[0] and abs(turned) < ALIKE:
            force = int(balance.order[balance.guides[0] + g])
            if not guide.aligned:
                return (force, -1), 0.0
            if not part.length > 0.0:
                raise InputError(f"{label} without the length of its follower, which '{guide.name}' keeps aligned", "a length")
            aligned = sum(other.aligned for other in guides[:g])
            # the unknown moment is in units of the balance's length
            return (force, int(balance.order[balance.guides[1] + aligned])), 2.0 * balance.length / part.length
    listed = "; ".join(
        f"start on '{guide.body}', end = '{'.'.join(guide.follower)}', direction = {math.degrees(guide.direction):.6g} deg"
        for guide in guides
    )
    raise InputError(f"{label}: no ideal guide there", listed or "a mechanism with ideal guides")
