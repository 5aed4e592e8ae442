"""Tape springs: two branches, located snaps, the hysteresis loop and its loss, in Python and from a case file."""

import math
from dataclasses import replace

import numpy as np
import pytest
from tests.build import on_pin

import scissordyn as sd

from .shared import METHODS, TIGHT, assert_balance, events_of, phases

# Stiffness [N m/rad], then peak and steady moment [N m] in opposite-sense and equal-sense folding
STIFFNESS, PEAK, STEADY, PEAK_EQUAL, STEADY_EQUAL = 20.0, 2.0, 0.3, 0.8, 0.2
# Tape spring given by its moments
TAPE = sd.TapeSpring("tape", "rod", "ground", STIFFNESS, PEAK, STEADY, PEAK_EQUAL, STEADY_EQUAL)
# Tape spring given by tables of moments
TABLES = sd.TapeSpring(
    "tape",
    "rod",
    straight=((-0.05, -0.7), (-0.02, -0.5), (0.03, 0.9), (0.1, 2.0)),
    folded=((-0.6, -0.35), (-0.02, -0.25), (0.02, 0.4), (0.3, 0.32), (0.9, 0.35)),
)


def hinged(tape, *, angle=0.0, speed=0.0, gravity=0.0):
    """Return a uniform bar of 1 m and 1.2 kg on a ground pin, with a tape spring in the hinge."""
    bar = sd.bar("rod", length=1.0, mass=1.2, angle=angle)
    return on_pin(replace(bar, angular_velocity=speed), tape, gravity=gravity)


def branches(tape):
    """Return angles and moments of the straight branch, and of the folds at negative and at positive angles."""
    if not tape.straight:
        k = tape.stiffness
        ends = (-tape.peak_moment_equal, tape.peak_moment)
        folds = (-tape.steady_moment_equal, tape.steady_moment)
        return tuple((np.array(m) / k, np.array(m)) for m in (ends, folds[:1], folds[1:]))
    tables = (tape.straight, [p for p in tape.folded if p[0] < 0], [p for p in tape.folded if p[0] >= 0])
    return tuple((np.array(table)[:, 0], np.array(table)[:, 1]) for table in tables)


def moment(tape, mode, angle):
    """Return the moment of a branch by its definition."""
    straight, negative, positive = branches(tape)
    table = (positive if angle > 0.0 else negative) if mode else straight
    return float(np.interp(angle, *table))


@pytest.mark.parametrize("tape", [TAPE, TABLES], ids=["moments", "tables"])
@pytest.mark.parametrize("method", METHODS)
def test_snaps_of_a_swinging_bar(method, tape):
    """Cross-check by a second formulation: a bar that folds its hinge to both sides, by scipy with the snaps as events."""
    straight, negative, positive = branches(tape)
    inertia, weight = 1.2 / 3.0, 0.5 * 1.2 * 0.2

    def rate(mode, t, y):
        return y[1], (-moment(tape, mode, y[0]) - weight * math.cos(y[0])) / inertia

    def within(t, y):
        return float(min(straight[0][-1] - y[0], y[0] - straight[0][0]))

    def folded(t, y):
        return float(y[0] - positive[0][0] if y[0] > 0.0 else negative[0][-1] - y[0])

    run = sd.simulate(hinged(tape, speed=1.2, gravity=0.2), until=12.0, method=method, samples=301, **TIGHT)
    instants, modes, at = phases(rate, (within, folded), (0.0, 1.2), 12.0)
    assert len(instants) >= 4
    np.testing.assert_allclose(run["event_time"], instants, atol=1e-8)
    assert [kind == "snapped" for kind in run["event_kind"].values] == [mode == 1 for mode in modes]
    np.testing.assert_allclose(run["angle"][:, 0], at(run["time"].values)[:, 0], atol=1e-8)
    assert_balance(run)
    lost = run["event_loss"].values
    assert np.all(lost[run["event_kind"].values == "snapped"] > 0.0)
    np.testing.assert_allclose(lost[run["event_kind"].values == "snapped back"], 0.0, atol=1e-10)
    # an event between two samples counts from the sample after it on
    counted = (run["time"].values[:, None] >= run["event_time"].values) @ lost
    np.testing.assert_allclose(run["switching_loss"], counted, rtol=1e-14)


@pytest.mark.parametrize("method", METHODS)
def test_hysteresis_loop(method):
    """Closed form: driven through one cycle, the loop's area is (M_p - M_s)^2/2k on each side, and is the switching loss."""
    arm = hinged(TAPE).driven(sd.Harmonic(0.0, 0.5, 2.0 * math.pi), body="rod")
    run = sd.simulate(arm, until=1.0, method=method, samples=20001, **TIGHT)
    area = [0.5 * (peak - steady) ** 2 / STIFFNESS for peak, steady in ((PEAK, STEADY), (PEAK_EQUAL, STEADY_EQUAL))]
    snapped = run["event_kind"].values == "snapped"
    assert run["event_loss"].values[snapped] == pytest.approx(area, rel=1e-9)
    assert float(run["switching_loss"][-1]) == pytest.approx(sum(area), rel=1e-9)
    assert float(run["drive_work"][-1]) == pytest.approx(sum(area), rel=1e-7)
    angles = [PEAK / STIFFNESS, STEADY / STIFFNESS, -PEAK_EQUAL / STIFFNESS, -STEADY_EQUAL / STIFFNESS]
    first, last = math.asin(angles[0] / 0.5), math.pi - math.asin(angles[1] / 0.5)
    third, fourth = math.pi - math.asin(angles[2] / 0.5), 2.0 * math.pi + math.asin(angles[3] / 0.5)
    instants = np.array([first, last, third, fourth]) / (2.0 * math.pi)
    np.testing.assert_allclose(run["event_time"], instants, atol=1e-8)
    # the sampled loop: the trapezium rule misses half a sample's width at each of the two jumps
    turned, torque = run["tape_spring_angle"].values[:, 0], -run["tape_spring_torque"].values[:, 0]
    loop = float(np.trapezoid(torque, turned))
    step = float(np.max(np.abs(np.diff(turned))))
    assert loop == pytest.approx(sum(area), abs=step * (PEAK + PEAK_EQUAL))
    # without freedom no error controls the steps; inside those of a stiff method the work of a drive is a cubic
    assert_balance(run, 1e-8 if method == "dop853" else 1e-6)


def test_a_folded_start_deploys():
    """Closed form: a fold pushes with its steady moment, so the bar starts evenly and snaps back at M_s/k."""
    run = sd.simulate(hinged(TAPE, angle=1.2), until=2.5, **TIGHT)
    assert run["tape_spring_folded"].values[0, 0] == 1.0
    back = math.sqrt(2.0 * (1.2 - STEADY / STIFFNESS) * 0.4 / STEADY)
    assert events_of(run, "snapped back")[0] == pytest.approx(back, abs=1e-8)
    assert_balance(run)


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"stiffness": 20.0, "peak_moment": 2.0}, "has no stiffness or no peak moment"),
        (
            {"stiffness": 20.0, "peak_moment": 0.2, "steady_moment": 0.3, "peak_moment_equal": 0.8, "steady_moment_equal": 0.2},
            "steady moments below the peak moments",
        ),
        ({"straight": ((-0.1, -1.0), (0.1, 1.0)), "folded": ((-0.05, -0.2),)}, "in increasing order"),
        ({"straight": ((0.1, 1.0), (-0.1, -1.0)), "folded": ((-0.05, -0.2), (0.05, 0.2))}, "in increasing order"),
        (
            {"straight": ((-0.1, -1.0), (0.1, 1.0)), "folded": ((-0.05, -0.2), (0.05, 1.5))},
            r"takes 0\.0375 J more than the straight tape.*otherwise the snap generates energy",
        ),
        (
            {"straight": ((-0.1, -1.0), (0.1, 1.0)), "folded": ((-0.1, -2.0), (-0.05, -1.5), (0.05, 0.2))},
            "otherwise the snap generates energy",
        ),
    ],
)
def test_what_it_cannot_be(fields, message):
    """Identity: a tape without its moments, one that would not snap back, and one that would give energy are refused."""
    with pytest.raises(sd.InputError, match=message):
        sd.TapeSpring("tape", "rod", **fields)
