"""Table of the unknown reactions in the balances of force and moment of all bodies."""

from __future__ import annotations

from typing import NamedTuple

from scissordyn.kernel import F1, F2, I1


class Balance(NamedTuple):
    """Balances of force and moment of all bodies: the unknown reactions and their coefficients, body by body."""

    start: I1  # (bodies + 1,) Entries of each body
    unknown: I1  # Row of the ordered unknowns for each entry
    # (entries, 3) Force (x, y) and torque per unit of the unknown, in the frame of a body or the ground; unknown torques
    # are in units of `length`, so that their weight does not depend on the mechanism's size
    direction: F2
    arm: F2  # (entries, 2) Point of application relative to the mass centre of its anchor, in that body's frame [m]
    anchor: I1  # (entries,) Body that carries the point of application
    frame: I1  # (entries,)
    mass: F1  # (bodies,)
    inertia: F1  # (bodies,) Zero for a body that does not rotate
    moments: I1  # (bodies,) 1 if the balance of moments is an equation, 0 for a body without rotation
    length: float  # Scale of the moment equations [m]
    # Position of each unknown (joints x, y; welds x, y, moment; guides; guide moments; drives) among the ordered ones
    order: I1
    band: int  # Half bandwidth of the normal equations
    # Ranges of the unknowns of ideal joints, welds, ideal guides (forces, then moments) and drives
    joints: tuple[int, int]
    welds: tuple[int, int]
    guides: tuple[int, int]
    guide_moments: tuple[int, int]
    drives: tuple[int, int]
