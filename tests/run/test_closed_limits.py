"""Times and kinds of singular positions of random mechanisms against closed forms, near-singular ones included."""

from __future__ import annotations

import json
import math
from collections.abc import Callable

import numpy as np
import pytest
from closed_limits import GAPS, Case, four_bar, scissor, slider_crank

import scissordyn as sd
from scissordyn.kinematics.branching import drive_warnings
from scissordyn.kinematics.path import instants, path_of
from scissordyn.kinematics.singular import CHANGE, LOCKING, NEAR
from scissordyn.plan.plan import plan
from scissordyn.plot.stroke import MARKS, kinematics

LOCATED = 1e-6  # Asked of a time, as a fraction of the stroke's duration
REPORTED = 3e-4  # Near change points with a smaller miss must be named; those with a larger one may be

Generator = Callable[[np.random.Generator, float | None], Case]


def found(mechanism: sd.Mechanism, until: float) -> list[tuple[str, float]]:
    """Kinds and times of the singular positions."""
    path = path_of(plan(mechanism), until)
    assert path is not None
    times = [(each.kind, time) for each in path.singular for time in instants(path, until, each.place)]
    return sorted(times, key=lambda each: each[1])


def check(case: Case) -> None:
    """What is found is what the closed form says, and when."""
    expected = [(kind, (angle - case.first) / case.speed, miss) for kind, angle, miss in case.expected]
    wide = [time for kind, time, miss in expected if kind == NEAR and miss > REPORTED]
    asked = [(kind, time) for kind, time, miss in expected if kind != NEAR or miss <= REPORTED]
    error = LOCATED * case.until
    got = [
        (kind, time)
        for kind, time in found(case.mechanism, case.until)
        if not (kind == NEAR and any(abs(time - other) < error for other in wide))
    ]
    assert [kind for kind, _ in got] == [kind for kind, _ in asked], (got, expected)
    assert [time for _, time in got] == pytest.approx([time for _, time in asked], rel=0, abs=error)


KINDS = [*((make, gap) for make in (four_bar, slider_crank) for gap in (None, *GAPS)), (scissor, None)]


@pytest.mark.parametrize(("make", "gap"), KINDS, ids=lambda each: getattr(each, "__name__", str(each)))
def test_random_mechanisms(make: Generator, gap: float | None) -> None:
    """Closed form: limits of a crank, change points and near ones, in both directions, by gap to the change point."""
    for seed in range(10 if gap is None else 2):
        check(make(np.random.default_rng(seed), gap))


def test_change_point_in_the_last_step() -> None:
    """Closed form: an array that turns a little beyond its flat position, between the last two positions of the path."""
    for beyond in np.linspace(0.002, 0.06, 12).tolist():
        array = sd.scissor(units=5, angle=0.5).driven(speed=1.0)
        until = 0.5 * math.pi - 0.5 + beyond
        assert found(array, until) == [(CHANGE, pytest.approx(0.5 * math.pi - 0.5, abs=LOCATED * until))]


@pytest.mark.slow
@pytest.mark.parametrize("make", [four_bar, slider_crank, scissor], ids=lambda make: make.__name__)
def test_many_random_mechanisms(make: Generator) -> None:
    """Closed form: 600 mechanisms of a kind, a third of them at random and the rest near a change point."""
    gaps = (None,) * 6 + GAPS
    for seed in range(600):
        check(make(np.random.default_rng(1000 + seed), gaps[seed % len(gaps)]))


def test_every_kind_is_drawn() -> None:
    """Contract: the figure of the kinematics has a line style for each kind of singular position."""
    assert set(MARKS) == {CHANGE, LOCKING, NEAR}
    passing = sd.four_bar(ground=1.0, crank=0.4, coupler=0.9, rocker=0.5001, angle=1.0).driven(speed=3.0)
    ideal = sd.ideal_kinematics(passing, until=1.0, samples=51)
    assert ideal["singular_kind"].values.tolist() == [NEAR]
    assert any(NEAR in axis.get_legend_handles_labels()[1] for axis in kinematics(ideal))


def test_drive_that_stands_still() -> None:
    """Limit: without a stroke there is nothing to pass, whatever position the mechanism is held in."""
    assert found(sd.scissor(units=3, angle=0.6).driven(speed=0.0), 1.0) == []


def test_limit_of_a_crossed_linkage() -> None:
    """Closed form: the crank of a crossed four-bar stops at 0.335789 s, by the law of cosines."""
    ground, crank, coupler, rocker = 0.928733221455456, 1.4086743568308764, 1.4037555938140915, 0.8597264873214747
    angle, speed = 1.4745982380091176, 3.4290116702167057
    linkage = sd.four_bar(ground=ground, crank=crank, coupler=coupler, rocker=rocker, angle=angle, branch="crossed")
    limit = math.acos((ground**2 + crank**2 - (coupler + rocker) ** 2) / (2.0 * ground * crank))
    ((kind, time),) = found(linkage.driven(speed=speed), 1.7319635)
    assert kind == LOCKING
    assert time == pytest.approx((limit - angle) / speed, abs=1e-9)


def test_either_side_of_a_change_point() -> None:
    """Closed form: a rocker longer by 1e-4 passes and is named as near, one shorter by 1e-5 locks before."""
    common = {"ground": 1.0, "crank": 0.4, "coupler": 0.9, "angle": 1.0}
    passing = sd.four_bar(**common, rocker=0.5001).driven(speed=3.0)
    assert found(passing, 1.5) == [(NEAR, pytest.approx((math.pi - 1.0) / 3.0, abs=1e-9))]
    run = sd.simulate(passing, until=1.0, samples=51)
    assert run.attrs["status"] == "complete"
    assert not [text for text in json.loads(run.attrs["warnings"]) if text.startswith((LOCKING, CHANGE))]
    limit = math.acos((1.0 + 0.16 - (0.9 + 0.49999) ** 2) / 0.8)
    assert found(sd.four_bar(**common, rocker=0.49999).driven(speed=3.0), 1.5) == [
        (LOCKING, pytest.approx((limit - 1.0) / 3.0, abs=1e-9))
    ]


def test_loose_linkage_forced_beyond_its_limit() -> None:
    """Contract: a linkage with clearance that is driven beyond its limit names position, time, and what the forces are of."""
    linkage = sd.four_bar(ground=1.0, crank=1.2, coupler=0.7, rocker=0.8).with_clearance("rocker pin", sd.Clearance(1e-3))
    limit = math.acos((1.0 + 1.44 - 2.25) / 2.4) - math.pi / 3
    run = sd.simulate(linkage.driven(speed=1.0), until=limit + 0.002, samples=101)
    warnings = json.loads(run.attrs["warnings"])
    assert any(text.startswith(f"{LOCKING} at t = {limit:.6g} s") for text in warnings), warnings
    assert any(text.startswith(f"the drive is forced beyond its locking position of t = {limit:.6g} s") for text in warnings)
    before = sd.simulate(linkage.driven(speed=1.0), until=limit - 0.005, samples=101)
    assert not [text for text in json.loads(before.attrs["warnings"]) if "locking" in text]


def test_drive_that_is_beyond_its_limit_between_two_samples() -> None:
    """Contract: a linkage with clearance whose drive turns back just beyond its limit, seen by no sample, is named with it."""
    linkage = sd.four_bar(ground=1.0, crank=1.2, coupler=0.7, rocker=0.8).with_clearance("rocker pin", sd.Clearance(1e-3))
    limit = math.acos((1.0 + 1.44 - 2.25) / 2.4)
    middle, turn = math.pi / 3, limit - math.pi / 3
    for beyond, expected in ((1e-5, True), (-0.01, False)):
        motion = sd.Harmonic(middle, turn + beyond, 2.0)
        run = sd.simulate(linkage.driven(motion), until=1.0, samples=42)
        driven = run["angle"].sel(body="crank").values
        assert (driven.max() < limit) or not expected
        said = [text for text in json.loads(run.attrs["warnings"]) if text.startswith(LOCKING)]
        assert bool(said) is expected, (said, run.attrs["warnings"])


def test_journal_pressed_in_far_from_any_limit() -> None:
    """Contract: runs whose journals are pressed far into a small clearance have the warnings of the drives."""
    for angle, until in ((0.5, 0.04), (1.2, 0.08)):
        linkage = sd.slider_crank(crank=0.3, rod=1.0, angle=angle).driven(speed=60.0)
        loose = linkage.with_clearance(linkage.joints[-1].name, sd.Clearance(1e-6))
        run = sd.simulate(loose, until=until, samples=201)
        depth, gap = (run[name].sel(joint=loose.clearance_joints[0].name).item() for name in ("peak_indentation", "clearance"))
        assert depth > 0.1 * gap
        assert drive_warnings(plan(linkage), until) == []
        assert not [text for text in json.loads(run.attrs["warnings"]) if "change point" in text or "locking" in text]
