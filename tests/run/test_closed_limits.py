"""Times and kinds of singular positions of random mechanisms, by closed forms, near-singular ones included."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import pytest
from tests.build import warnings_of

import scissordyn as sd
from scissordyn.kinematics.branching import drive_warnings
from scissordyn.kinematics.path import instants, path_of
from scissordyn.kinematics.singular import CHANGE_KIND, LOCKING_KIND, NEAR_KIND
from scissordyn.plan.plan import plan
from scissordyn.plot.stroke import SINGULAR_LINE_STYLES, kinematics

GAPS = (0.0, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3, -1e-7, -1e-6, -1e-5, -1e-4, -1e-3)
"""[m] Distances of a length from its value at a change point; with a negative one the input reaches a limit."""

Event = tuple[str, float, float]
"""Kind, angle of the crank [rad], and by how much the branches miss each other in units of the mechanism's size."""


@dataclass(frozen=True)
class Case:
    """Driven mechanism and the singular positions that its drive meets, in order, with near change points."""

    mechanism: sd.Mechanism
    until: float
    speed: float
    first: float
    expected: list[Event]


def _case(mechanism, first, rng, places):
    """Return a case with random speed and stroke, and the positions that it meets up to the first limit."""
    speed, turn = float(rng.choice([-1.0, 1.0]) * rng.uniform(0.5, 8.0)), float(rng.uniform(1.0, 6.2))
    met = [
        (kind, angle + 2.0 * math.pi * k, miss / mechanism.size)
        for kind, angle, miss in places
        for k in range(-4, 5)
        if 0.0 < math.copysign(1.0, speed) * (angle + 2.0 * math.pi * k - first) < turn
    ]
    met.sort(key=lambda each: abs(each[1] - first))
    locks = [k for k, (kind, *_) in enumerate(met) if kind == LOCKING_KIND]
    return Case(mechanism.driven(speed=speed), turn / abs(speed), speed, first, met[: locks[0] + 1] if locks else met)


def four_bar(rng, gap):
    """Return a four-bar, which closes while the distance d of crank pin and rocker pivot is between |b - c| and b + c.

    At 180 deg d = g + a, at 0 deg d = |g - a|; sin(th/2)^2 = (d^2 - (g - a)^2) / (4 g a). If d just reaches a limit there,
    coupler and rocker fall on one line with ground and crank.
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
    places = []
    misses = {math.pi: (coupler + rocker) - (ground + crank), 0.0: abs(ground - crank) - abs(coupler - rocker)}
    for at, miss in misses.items():
        if abs(miss) < 1e-14:
            places.append((CHANGE_KIND, at, 0.0))
        elif miss > 0.0:
            places.append((NEAR_KIND, at, miss))
        else:
            limit = coupler + rocker if at else abs(coupler - rocker)
            square = (limit - (ground - crank)) * (limit + (ground - crank)) / (4.0 * ground * crank)
            # of the complement where the angle is near 180 deg
            other = ((ground + crank) - limit) * ((ground + crank) + limit) / (4.0 * ground * crank)
            half = math.atan2(math.sqrt(square), math.sqrt(other))
            places += [(LOCKING_KIND, 2.0 * half, 0.0), (LOCKING_KIND, -2.0 * half, 0.0)]
    branch = str(rng.choice(["open", "crossed"]))
    linkage = sd.four_bar(ground=ground, crank=crank, coupler=coupler, rocker=rocker, angle=first, branch=branch)
    return _case(linkage, first, rng, places)


def slider_crank(rng, gap):
    """Return a slider-crank: it closes for crank |sin(th)| <= rod; at equal lengths slider and pin meet at 90 deg."""
    while True:
        crank = float(rng.uniform(0.05, 0.3))
        ratio = float(rng.uniform(0.4, 2.5)) if gap is None else 1.0 + gap
        first = float(rng.uniform(-1.4, 1.4))
        if abs(math.sin(first)) < ratio - 0.05:
            break
    rod = ratio * crank
    places = []
    if rod >= crank:
        places += [(NEAR_KIND if rod > crank else CHANGE_KIND, at, rod - crank) for at in (0.5 * math.pi, -0.5 * math.pi)]
    else:
        limit = math.atan2(rod, math.sqrt((crank - rod) * (crank + rod)))
        places += [(LOCKING_KIND, at, 0.0) for at in (limit, -limit)]
    return _case(sd.slider_crank(crank=crank, rod=rod, angle=first), first, rng, places)


def scissor(rng, _gap):
    """Return an array: its rhombi are flat at each multiple of 90 deg; a single unit can branch at those of 180 deg."""
    units, first = int(rng.integers(1, 7)), float(rng.uniform(0.1, 1.47))
    every = [0.0, math.pi] + ([0.5 * math.pi, -0.5 * math.pi] if units > 1 else [])
    return _case(sd.scissor(units=units, angle=first), first, rng, [(CHANGE_KIND, at, 0.0) for at in every])


LOCATED = 1e-6  # Allowed error of a located time, as a fraction of the stroke's duration
WARNED_MISS = 3e-4  # [mechanism sizes] a change point that is missed by no more than this must be in a warning

Generator = Callable[[np.random.Generator, float | None], Case]


def found(mechanism, until):
    """Return kinds and times of the singular positions."""
    path = path_of(plan(mechanism), until)
    times = [(each.kind, time) for each in path.singular for time in instants(path, until, each.place)]
    return sorted(times, key=lambda each: each[1])


def check(case):
    """Compare kinds and times found with the closed form."""
    expected = [(kind, (angle - case.first) / case.speed, miss) for kind, angle, miss in case.expected]
    wide = [time for kind, time, miss in expected if kind == NEAR_KIND and miss > WARNED_MISS]
    asked = [(kind, time) for kind, time, miss in expected if kind != NEAR_KIND or miss <= WARNED_MISS]
    error = LOCATED * case.until
    got = [
        (kind, time)
        for kind, time in found(case.mechanism, case.until)
        if not (kind == NEAR_KIND and any(abs(time - other) < error for other in wide))
    ]
    assert [kind for kind, _ in got] == [kind for kind, _ in asked], (got, expected)
    assert [time for _, time in got] == pytest.approx([time for _, time in asked], rel=0, abs=error)


# Function that builds a mechanism, and the gap by which it misses a change point
KINDS = [*((make, gap) for make in (four_bar, slider_crank) for gap in (None, *GAPS)), (scissor, None)]


@pytest.mark.parametrize(("make", "gap"), KINDS, ids=lambda each: getattr(each, "__name__", str(each)))
def test_random_mechanisms(make, gap):
    """Closed form: limits of a crank, change points and near ones, in both directions, by gap to the change point."""
    for seed in range(10 if gap is None else 2):
        check(make(np.random.default_rng(seed), gap))


def test_change_point_in_the_last_step():
    """Closed form: an array that passes its flat position between the last two positions of the path."""
    for beyond in np.linspace(0.002, 0.06, 12).tolist():
        array = sd.scissor(units=5, angle=0.5).driven(speed=1.0)
        until = 0.5 * math.pi - 0.5 + beyond
        assert found(array, until) == [(CHANGE_KIND, pytest.approx(0.5 * math.pi - 0.5, abs=LOCATED * until))]


@pytest.mark.slow
@pytest.mark.parametrize("make", [four_bar, slider_crank, scissor], ids=lambda make: make.__name__)
def test_many_random_mechanisms(make):
    """Closed form: 600 mechanisms of a kind, a third of them random and the rest near a change point."""
    gaps = (None,) * 6 + GAPS
    for seed in range(600):
        check(make(np.random.default_rng(1000 + seed), gaps[seed % len(gaps)]))


def test_every_kind_is_drawn():
    """Contract: the figure of the kinematics has a line style for each kind of singular position."""
    assert set(SINGULAR_LINE_STYLES) == {CHANGE_KIND, LOCKING_KIND, NEAR_KIND}
    passing = sd.four_bar(ground=1.0, crank=0.4, coupler=0.9, rocker=0.5001, angle=1.0).driven(speed=3.0)
    ideal = sd.ideal_kinematics(passing, until=1.0, samples=51)
    assert ideal["singular_kind"].values.tolist() == [NEAR_KIND]
    assert any(NEAR_KIND in axis.get_legend_handles_labels()[1] for axis in kinematics(ideal))


def test_drive_that_stands_still():
    """Limit: without a stroke there is no singular position, with one drive or two."""
    assert found(sd.scissor(units=3, angle=0.6).driven(speed=0.0), 1.0) == []
    apart = math.acos(0.25)  # two cranks of 1 m at right angles to the ground of 1 m, and bars of 2 m between their ends
    bars = (
        replace(sd.bar("left", length=1.0, mass=1.0), position=(0.0, 0.0), angle=0.5 * math.pi),
        replace(sd.bar("up", length=2.0, mass=1.0), position=(0.0, 1.0), angle=apart),
        replace(sd.bar("down", length=2.0, mass=1.0), position=(1.0, 1.0), angle=math.pi - apart),
        replace(sd.bar("right", length=1.0, mass=1.0), position=(1.0, 0.0), angle=0.5 * math.pi),
    )
    pins = (
        sd.Revolute("O", ("left", "start"), ("ground", "O")),
        sd.Revolute("P", ("up", "start"), ("left", "end")),
        sd.Revolute("Q", ("up", "end"), ("down", "end")),
        sd.Revolute("R", ("down", "start"), ("right", "end")),
        sd.Revolute("E", ("right", "start"), ("ground", "E")),
    )
    both = sd.Mechanism(bars, joints=pins, ground=(("O", (0.0, 0.0)), ("E", (1.0, 0.0))))
    assert found(both.driven(speed=0.0, body="left").driven(speed=0.0, body="right"), 1.0) == []


def test_limit_of_a_crossed_linkage():
    """Closed form: the crank of a crossed four-bar stops at 0.335789 s, by the law of cosines."""
    ground, crank, coupler, rocker = 0.928733221455456, 1.4086743568308764, 1.4037555938140915, 0.8597264873214747
    angle, speed = 1.4745982380091176, 3.4290116702167057
    linkage = sd.four_bar(ground=ground, crank=crank, coupler=coupler, rocker=rocker, angle=angle, branch="crossed")
    limit = math.acos((ground**2 + crank**2 - (coupler + rocker) ** 2) / (2.0 * ground * crank))
    ((kind, time),) = found(linkage.driven(speed=speed), 1.7319635)
    assert kind == LOCKING_KIND
    assert time == pytest.approx((limit - angle) / speed, abs=1e-9)


def test_either_side_of_a_change_point():
    """Closed form: a rocker longer by 1e-4 passes and is reported as near; one shorter by 1e-5 locks before."""
    common = {"ground": 1.0, "crank": 0.4, "coupler": 0.9, "angle": 1.0}
    passing = sd.four_bar(**common, rocker=0.5001).driven(speed=3.0)
    assert found(passing, 1.5) == [(NEAR_KIND, pytest.approx((math.pi - 1.0) / 3.0, abs=1e-9))]
    run = sd.simulate(passing, until=1.0, samples=51)
    assert run.attrs["status"] == "complete"
    assert not [text for text in warnings_of(run) if text.startswith((LOCKING_KIND, CHANGE_KIND))]
    limit = math.acos((1.0 + 0.16 - (0.9 + 0.49999) ** 2) / 0.8)
    assert found(sd.four_bar(**common, rocker=0.49999).driven(speed=3.0), 1.5) == [
        (LOCKING_KIND, pytest.approx((limit - 1.0) / 3.0, abs=1e-9))
    ]


def test_loose_linkage_forced_beyond_its_limit():
    """Contract: a linkage with clearance driven beyond its limit gives a warning with position and time."""
    linkage = sd.four_bar(ground=1.0, crank=1.2, coupler=0.7, rocker=0.8).with_clearance("rocker pin", sd.Clearance(1e-3))
    limit = math.acos((1.0 + 1.44 - 2.25) / 2.4) - math.pi / 3
    run = sd.simulate(linkage.driven(speed=1.0), until=limit + 0.002, samples=101)
    warnings = warnings_of(run)
    assert any(text.startswith(f"{LOCKING_KIND} at t = {limit:.6g} s") for text in warnings), warnings
    assert any(text.startswith(f"the drive is forced beyond its locking position of t = {limit:.6g} s") for text in warnings)
    before = sd.simulate(linkage.driven(speed=1.0), until=limit - 0.005, samples=101)
    assert not [text for text in warnings_of(before) if "locking" in text]


def test_drive_that_is_beyond_its_limit_between_two_samples():
    """Contract: a drive that exceeds the limit between two samples only is warned of."""
    linkage = sd.four_bar(ground=1.0, crank=1.2, coupler=0.7, rocker=0.8).with_clearance("rocker pin", sd.Clearance(1e-3))
    limit = math.acos((1.0 + 1.44 - 2.25) / 2.4)
    middle, turn = math.pi / 3, limit - math.pi / 3
    for beyond, expected in ((1e-5, True), (-0.01, False)):
        motion = sd.Harmonic(middle, turn + beyond, 2.0)
        run = sd.simulate(linkage.driven(motion), until=1.0, samples=42)
        driven = run["angle"].sel(body="crank").values
        assert (driven.max() < limit) or not expected
        said = [text for text in warnings_of(run) if text.startswith(LOCKING_KIND)]
        assert bool(said) is expected, (said, run.attrs["warnings"])


def test_journal_pressed_in_far_from_any_limit():
    """Contract: journals pressed deep into a small clearance give no warning of a singular position."""
    for angle, until in ((0.5, 0.04), (1.2, 0.08)):
        linkage = sd.slider_crank(crank=0.3, rod=1.0, angle=angle).driven(speed=60.0)
        loose = linkage.with_clearance(linkage.joints[-1].name, sd.Clearance(1e-6))
        run = sd.simulate(loose, until=until, samples=201)
        depth, gap = (run[name].sel(joint=loose.clearance_joints[0].name).item() for name in ("peak_indentation", "clearance"))
        assert depth > 0.1 * gap
        assert drive_warnings(plan(linkage), until) == []
        assert not [text for text in warnings_of(run) if "change point" in text or "locking" in text]
