"""Tape-spring hinge, which is stiff while straight and snaps into a fold with a nearly constant moment."""

from __future__ import annotations

import math
from typing import Annotated

import numpy as np

from scissordyn.components.declaration import COMPONENT_PARAMETERS_MAX, component
from scissordyn.components.place import GROUND, Point
from scissordyn.components.port import HINGE, Output
from scissordyn.errors import InputError
from scissordyn.kernel import kernel
from scissordyn.units import Pairs, Quantity

SCALARS = ("free_angle", "straight", "negative", "positive")  # names of the kernel's parameters before its tables
FIRST_PAIR = len(SCALARS)  # Index of the first pair of values in the kernel's parameters


@kernel
def moment_at(angle, table, first, count):
    """Return the piecewise linear moment [N m] through `count` pairs of angle and moment, constant beyond them."""
    if angle <= table[first]:
        return table[first + 1]
    for k in range(count - 1):
        a, b = table[first + 2 * k], table[first + 2 * k + 2]
        if angle <= b:
            part = (angle - a) / (b - a)
            return (1.0 - part) * table[first + 2 * k + 1] + part * table[first + 2 * k + 3]
    return table[first + 2 * count - 1]


@kernel
def work_to(angle, table, first, count):
    """Return the work [J] to turn from the first angle of a table to `angle`."""
    work, place = 0.0, table[first]
    moment = table[first + 1]
    if angle <= place:
        return (angle - place) * moment
    for k in range(1, count):
        b = min(angle, table[first + 2 * k])
        if b > place:
            after = moment_at(b, table, first, count)
            work += 0.5 * (b - place) * (moment + after)
            place, moment = b, after
    return work + max(0.0, angle - place) * moment


@kernel
def branch(twist, mode, straight, negative, positive, table):
    """Return the moment [N m] and the stored energy [J] on the straight branch (mode 0) or on a folded one."""
    count, first = int(straight), FIRST_PAIR
    zero = work_to(0.0, table, first, count)
    if mode == 0.0:
        return moment_at(twist, table, first, count), work_to(twist, table, first, count) - zero
    if twist < 0.0:
        first += 2 * count
        count = int(negative)
        back = table[first + 2 * count - 2]
    else:
        first += 2 * (count + int(negative))
        count = int(positive)
        back = table[first]
    # both branches store the same energy where the fold snaps back
    stored = work_to(back, table, FIRST_PAIR, int(straight)) - zero
    return moment_at(twist, table, first, count), stored + work_to(twist, table, first, count) - work_to(
        back, table, first, count
    )


@kernel
def gap(angle, speed, mode, free_angle, straight, negative, positive, table):
    """Return the angle beyond the snap (straight), or until snap-back (folded) [rad], and its rate."""
    twist = angle - free_angle
    if mode == 0.0:
        low, high = table[FIRST_PAIR], table[FIRST_PAIR + 2 * int(straight) - 2]
        return (twist - high, speed) if twist - high > low - twist else (low - twist, -speed)
    first = FIRST_PAIR + 2 * int(straight)
    if twist < 0.0:
        return table[first + 2 * int(negative) - 2] - twist, -speed
    return twist - table[first + 2 * int(negative)], speed


@kernel
def force(angle, speed, mode, free_angle, straight, negative, positive, table):
    """Return torque [N m], stored energy [J], dissipated power [W], and 1 while the hinge is folded."""
    moment, energy = branch(angle - free_angle, mode, straight, negative, positive, table)
    return -moment, energy, 0.0, mode


@kernel
def switch(angle, speed, mode, free_angle, straight, negative, positive, table):
    """Return the energy [J] that is lost when the hinge snaps from one branch to the other."""
    twist = angle - free_angle
    _, before = branch(twist, mode, straight, negative, positive, table)
    _, after = branch(twist, 1.0 - mode, straight, negative, positive, table)
    return before - after


def _work(table: tuple[Point, ...], start: float, end: float) -> float:
    """Return the work [J] to bend a branch from one angle to another."""
    angles, moments = np.array(table).T
    between = angles[(angles > min(start, end)) & (angles < max(start, end))]
    at = np.sort([start, end, *between])
    work = float(np.trapezoid(np.interp(at, angles, moments), at))
    return work if end > start else -work


@component(
    port=HINGE,
    force=force,
    gap=gap,
    switch=switch,
    outputs=(Output("folded", "1", "1 on the folded branch, 0 on the straight one"),),
    context=("mode",),
    symbol="tape",
    events=("snapped back", "snapped"),
    example={
        "body": "rod",
        "stiffness": "20 N m/rad",
        "peak_moment": "2 N m",
        "steady_moment": "0.3 N m",
        "peak_moment_equal": "0.8 N m",
        "steady_moment_equal": "0.2 N m",
    },
    source="Seffen and Pellegrino 1999, Deployment dynamics of tape springs",
)
class TapeSpring:
    r"""Hinge made of a tape spring, with snap-through and hysteresis.

    The straight tape is elastic up to a peak moment, at which it snaps into a fold of nearly constant moment. The fold snaps
    back where its moment equals that of the straight tape. Bending that puts the edges into tension (opposite sense) is
    positive, and its moments differ from those of the other sense.

    .. math:: M^*_+ = (1+\nu) D \alpha,\quad M^*_- = (1-\nu) D \alpha,\quad D = \frac{E t^3}{12(1-\nu^2)}

    are the usual estimates of the steady moments of a tape of thickness t that subtends the angle alpha.

    Tables of the straight and the folded branch can replace these parameters; their angles are relative to the free angle.


    Raises
    ------
    InputError
        If a branch is missing, a table does not increase, the fold snaps back beyond the snap, or the fold takes more work than
        the straight tape between them, so that a snap would give energy.
    """

    name: str
    body: str
    base: str = GROUND
    stiffness: Annotated[float, Quantity("N m/rad", minimum=0.0, maximum=1e9, help="stiffness of the straight tape")] = 0.0
    peak_moment: Annotated[float, Quantity("N m", minimum=0.0, maximum=1e6, help="positive moment of the snap")] = 0.0
    steady_moment: Annotated[float, Quantity("N m", minimum=0.0, maximum=1e6, help="positive moment of the fold")] = 0.0
    peak_moment_equal: Annotated[float, Quantity("N m", minimum=0.0, maximum=1e6, help="negative moment of the snap")] = 0.0
    steady_moment_equal: Annotated[float, Quantity("N m", minimum=0.0, maximum=1e6, help="negative moment of the fold")] = 0.0
    free_angle: Annotated[float, Quantity("rad", minimum=-1e4, maximum=1e4, help="angle of the straight tape")] = 0.0
    straight: Annotated[
        tuple[Point, ...],
        Pairs(("angles", "moments"), ("rad", "N m"), help="the straight branch, from one snap to the other"),
    ] = ()
    folded: Annotated[
        tuple[Point, ...],
        Pairs(("angles", "moments"), ("rad", "N m"), help="the fold, which snaps back at the angles next to zero"),
    ] = ()

    def check(self) -> None:
        straight, negative, positive = self._tables()
        label = f"tape spring '{self.name}'"
        for table in (straight, negative, positive):
            angles = [angle for angle, _ in table]
            if not table or angles != sorted(set(angles)) or not all(math.isfinite(x) for pair in table for x in pair):
                raise InputError(f"{label}: table {table!r}", "angles [rad] and moments [N m] in increasing order of angles")
        if not straight[0][0] < negative[-1][0] <= 0.0 <= positive[0][0] < straight[-1][0]:
            raise InputError(
                f"{label} snaps back at {negative[-1][0]:g} and {positive[0][0]:g} rad, and snaps at {straight[0][0]:g} and "
                f"{straight[-1][0]:g} rad",
                "steady moments below the peak moments, so that it snaps back nearer to zero than it snaps",
            )
        for sense, fold in (("positive", positive), ("negative", negative)):
            snap, back = (straight[-1][0], fold[0][0]) if sense == "positive" else (straight[0][0], fold[-1][0])
            lost = _work(straight, back, snap) - _work(fold, back, snap)
            if lost < 0.0:
                raise InputError(
                    f"{label}: the fold takes {-lost:g} J more than the straight tape up to the snap at {snap:g} rad",
                    "moments of the fold below those of the straight tape, because otherwise the snap generates energy",
                )
        if FIRST_PAIR + 2 * (len(straight) + len(negative) + len(positive)) > COMPONENT_PARAMETERS_MAX:
            raise InputError(
                f"{label} has {len(straight) + len(self.folded)} pairs",
                f"at most {(COMPONENT_PARAMETERS_MAX - FIRST_PAIR) // 2}",
            )

    def _tables(self) -> tuple[tuple[Point, ...], tuple[Point, ...], tuple[Point, ...]]:
        """Return the pairs of the straight branch, and of the folds at negative and positive angles."""
        if self.straight or self.folded:
            return (
                self.straight,
                tuple(pair for pair in self.folded if pair[0] < 0.0),
                tuple(pair for pair in self.folded if pair[0] >= 0.0),
            )
        if not (self.stiffness > 0.0 and self.peak_moment > 0.0 and self.peak_moment_equal > 0.0):
            raise InputError(
                f"tape spring '{self.name}' has no stiffness or no peak moment",
                "stiffness, peak_moment and peak_moment_equal, or tables of the straight and the folded branch",
            )
        k = self.stiffness
        straight = ((-self.peak_moment_equal / k, -self.peak_moment_equal), (self.peak_moment / k, self.peak_moment))
        negative = ((-self.steady_moment_equal / k, -self.steady_moment_equal),)
        return straight, negative, ((self.steady_moment / k, self.steady_moment),)

    def parameters(self, start: tuple[float, ...]) -> tuple[float, ...]:
        """Return the free angle, the number of pairs of each branch, and the pairs."""
        tables = self._tables()
        numbers = [number for table in tables for pair in table for number in pair]
        return self.free_angle, *(float(len(table)) for table in tables), *numbers
