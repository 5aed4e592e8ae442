"""Pendula as mechanisms, with the parameters of their authors."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import scissordyn as sd
from scissordyn.model.mechanism import Mechanism
from validation.measured.drag import AirDrag

__all__ = ["Numbers", "numbers", "pendulum"]


@dataclass(frozen=True)
class Numbers:
    """Masses [kg], distances of mass centres [m], lengths [m], inertias [kg m^2], damping [N m s/rad], gravity [m/s^2]."""

    mass: Sequence[float]
    centre: Sequence[float]
    length: Sequence[float]
    inertia: Sequence[float]
    damping: Sequence[float]
    gravity: float


def numbers(estimated: Sequence[float]) -> Numbers:
    """Return the parameters of the authors by name."""
    match [float(value) for value in estimated]:
        case [a, m, inertia, damping, g]:
            return Numbers([m], [a], [], [inertia], [damping], g)
        case [m1, m2, a1, a2, length, i1, i2, d1, d2, g]:
            return Numbers([m1, m2], [a1, a2], [length], [i1, i2], [d1, d2], g)
        case [m1, m2, m3, a1, a2, a3, l1, l2, i1, i2, i3, d1, d2, d3, g]:
            return Numbers([m1, m2, m3], [a1, a2, a3], [l1, l2], [i1, i2, i3], [d1, d2, d3], g)
    raise ValueError(len(estimated))


def pendulum(given: Numbers, *, coulomb: float = 0.0, drag: float = 0.0) -> Mechanism:
    """Return a chain of arms that hangs at an angle of pi.

    Gravity acts along the negative x axis, so that the authors' angles are ours. Their angles are clockwise from the upward
    vertical; the mirror image of the chain has the same motion.

    Parameters
    ----------
    given : Numbers
    coulomb : float
        Dry friction at the first pin [N m]; none if zero.
    drag : float
        Drag coefficient of the first arm [N m s^2]; none if zero.
    """
    count, bodies, joints, springs = len(given.mass), [], [], []
    place, names = 0.0, [f"arm {k + 1}" for k in range(count)]
    for k, name in enumerate(names):
        points = {"pin": (0.0, 0.0)} | ({"end": (given.length[k], 0.0)} if k + 1 < count else {})
        position = (-place, 0.0)
        bodies.append(
            sd.Body(name, given.mass[k], given.inertia[k], points, (given.centre[k], 0.0), position=position, angle=math.pi)
        )
        joints.append(sd.Revolute("ABC"[k], (name, "pin"), ("ground", "O") if k == 0 else (names[k - 1], "end")))
        base = "ground" if k == 0 else names[k - 1]
        springs.append(sd.TorsionSpring(f"friction {'ABC'[k]}", name, base, damping=given.damping[k]))
        place += given.length[k] if k + 1 < count else 0.0
    components = [*springs]
    if coulomb:
        components.append(sd.Clutch("dry friction", "arm 1", coulomb, yield_angle=1e-3))
    if drag:
        components.append(AirDrag("air", "arm 1", factor=drag))
    return Mechanism(
        bodies=tuple(bodies),
        joints=tuple(joints),
        components=tuple(components),
        ground=(("O", (0.0, 0.0)),),
        gravity=given.gravity,
        gravity_direction=math.pi,
    )
