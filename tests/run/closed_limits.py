"""Random four-bars, slider-cranks and arrays with their singular positions by closed forms."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

import scissordyn as sd
from scissordyn.kinematics.singular import CHANGE, LOCKING, NEAR

GAPS = (0.0, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3, -1e-7, -1e-6, -1e-5, -1e-4, -1e-3)
"""By how much lengths miss the change point; negative: the input is at a limit before it."""

Event = tuple[str, float, float]
"""Kind, angle of the crank [rad], and by how much the branches miss each other in units of the mechanism's size."""


@dataclass(frozen=True)
class Case:
    """A driven mechanism and what its drive meets, in that order, near change points included whatever they miss by."""

    mechanism: sd.Mechanism
    until: float
    speed: float
    first: float
    expected: list[Event]


def _case(mechanism: sd.Mechanism, first: float, rng: np.random.Generator, places: list[Event]) -> Case:
    """A case with a random speed and stroke, and the places that the crank meets on it up to the first limit."""
    speed, turn = float(rng.choice([-1.0, 1.0]) * rng.uniform(0.5, 8.0)), float(rng.uniform(1.0, 6.2))
    met = [
        (kind, angle + 2.0 * math.pi * k, miss / mechanism.size)
        for kind, angle, miss in places
        for k in range(-4, 5)
        if 0.0 < math.copysign(1.0, speed) * (angle + 2.0 * math.pi * k - first) < turn
    ]
    met.sort(key=lambda each: abs(each[1] - first))
    locks = [k for k, (kind, *_) in enumerate(met) if kind == LOCKING]
    return Case(mechanism.driven(speed=speed), turn / abs(speed), speed, first, met[: locks[0] + 1] if locks else met)


def four_bar(rng: np.random.Generator, gap: float | None) -> Case:
    """A four-bar: it closes where the distance d of crank pin and rocker pivot is between |b - c| and b + c.

    At 180 deg d = g + a, at 0 deg d = |g - a|; sin(th/2)^2 = (d^2 - (g - a)^2) / (4 g a). If a limit of d is missed by nothing,
    coupler and rocker fall on one line with ground and crank there.
    """
    while True:
        ground, crank, coupler, rocker = rng.uniform(0.3, 1.5, 4).tolist()
        if gap is not None and rng.random() < 0.5:
            rocker = ground + crank + gap - coupler  # at 180 deg
        elif gap is not None:
            rocker = coupler + math.copysign(abs(ground - crank) - gap, rng.normal())  # at 0 deg
        first = float(rng.uniform(-math.pi, math.pi))
        if rocker < 0.1 or abs(ground - crank) < 0.1 or abs(coupler - rocker) < 0.05:
            continue
        distance = math.sqrt(ground**2 + crank**2 - 2.0 * ground * crank * math.cos(first))
        if abs(coupler - rocker) + 0.05 < distance < coupler + rocker - 0.05:
            break
    places: list[Event] = []
    misses = {
        math.pi: (coupler + rocker) - (ground + crank),
        0.0: abs(ground - crank) - abs(coupler - rocker),
    }
    for at, miss in misses.items():
        if abs(miss) < 1e-14:
            places.append((CHANGE, at, 0.0))
        elif miss > 0.0:
            places.append((NEAR, at, miss))
        else:
            limit = coupler + rocker if at else abs(coupler - rocker)
            square = (limit - (ground - crank)) * (limit + (ground - crank)) / (4.0 * ground * crank)
            # of the complement where the angle is near 180 deg
            other = ((ground + crank) - limit) * ((ground + crank) + limit) / (4.0 * ground * crank)
            half = math.atan2(math.sqrt(square), math.sqrt(other))
            places += [(LOCKING, 2.0 * half, 0.0), (LOCKING, -2.0 * half, 0.0)]
    branch = str(rng.choice(["open", "crossed"]))
    linkage = sd.four_bar(ground=ground, crank=crank, coupler=coupler, rocker=rocker, angle=first, branch=branch)
    return _case(linkage, first, rng, places)


def slider_crank(rng: np.random.Generator, gap: float | None) -> Case:
    """A slider-crank: it closes where crank |sin(th)| is at most the rod; at equal lengths slider and pin meet at 90 deg."""
    while True:
        crank = float(rng.uniform(0.05, 0.3))
        ratio = float(rng.uniform(0.4, 2.5)) if gap is None else 1.0 + gap
        first = float(rng.uniform(-1.4, 1.4))
        if abs(math.sin(first)) < ratio - 0.05:
            break
    rod = ratio * crank
    places: list[Event] = []
    if rod >= crank:
        places += [(NEAR if rod > crank else CHANGE, at, rod - crank) for at in (0.5 * math.pi, -0.5 * math.pi)]
    else:
        limit = math.atan2(rod, math.sqrt((crank - rod) * (crank + rod)))
        places += [(LOCKING, at, 0.0) for at in (limit, -limit)]
    return _case(sd.slider_crank(crank=crank, rod=rod, angle=first), first, rng, places)


def scissor(rng: np.random.Generator, _gap: float | None) -> Case:
    """An array: its rhombi are flat at each multiple of 90 deg; without a rhombus it can branch at those of 180 deg."""
    units, first = int(rng.integers(1, 7)), float(rng.uniform(0.1, 1.47))
    every = [0.0, math.pi] + ([0.5 * math.pi, -0.5 * math.pi] if units > 1 else [])
    return _case(sd.scissor(units=units, angle=first), first, rng, [(CHANGE, at, 0.0) for at in every])
