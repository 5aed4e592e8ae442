"""What friction in ideal pins and guides reads, and its scratch: see `mechanics.joint_friction`."""

from __future__ import annotations

from typing import NamedTuple

from scissordyn.kernel import F1, F2, F3, I1, I2
from scissordyn.mechanics.bending_loads import BendingLoads
from scissordyn.mechanics.body_maps import BodyMaps
from scissordyn.mechanics.reactions import Balance


class FrictionWorkspace(NamedTuple):
    """The f components of friction in ideal joints, and the balances from which the reactions of these follow.

    Lane 0 of the equations is the mechanism without friction, lane 1 + k the response to friction k at a reaction of one.
    """

    component: I1  # (f,)
    place: I1  # (components,) among those, or -1
    guide: I1  # (f,) 1 for a guide, 0 for a pin
    unknown: (
        I2  # (f, 2) rows of the ordered reactions: x and y of a pin; force and moment of a guide, the moment -1 if it has none
    )
    moment: F1  # (f,) force that a unit of the moment makes at the edges of a guide
    gravity: F1  # (2,) [m/s^2]
    balance: Balance
    maps: BodyMaps
    bending: BendingLoads
    size: F1  # (f,) reaction that friction follows [N]
    fault: I1  # (1,) of `joint_friction`, or 0
    direction: F3  # (f + 1, bodies, 2), each the same
    position: F3
    acceleration: F3
    angular_acceleration: F2  # (f + 1, bodies)
    load: F3  # (f + 1, bodies, 3)
    matrix: F3  # (unknowns, 2 band + 1, 1)
    rows: F3  # (3, widest body, 1)
    right: F2  # (3, f + 1)
    reaction: F2  # (unknowns, f + 1)
    force: F1  # (n + nb,)
    change: F1  # (n + nb,)
    multiplier: F1  # (m,)
    slope: F2  # (f, width) a full matrix as a band
    pivots: I1  # (2 f,)
    step: F1  # (f,)
    # Of implicit steps, see `reaction_slopes`; empty where there are too many states for that
    by_state: F2  # (f, states) derivatives of the reactions by the state
    by_time: F1  # (f,)
    response: F2  # (f, n) what a reaction of one changes of the accelerations, as last evaluated
    frozen: F2  # (f, n) the same where the step matrix was linearised
    solved: F2  # (f, states) that, as rates, through the inverse of the matrix for constant reactions
    share: F2  # (f, width)
    share_pivots: I1  # (2 f,)
    rates: F1  # (states,)
    upper: F1  # (f,)
