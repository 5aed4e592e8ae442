"""Each check agrees with measures as the paper describes them, and differs for the opposite."""

import dataclasses
import math

import pytest

from scissordyn_paper.cases import CLEARANCES, CONTROLLED, FRICTION, SPEEDS, Choice, PaperCase
from scissordyn_paper.criteria import OSCILLATING
from scissordyn_paper.measures import Deviation, Measures
from scissordyn_paper.periodic import BY_CLEARANCE, BY_FRICTION, PERIODIC, Regularity
from scissordyn_paper.statements import CHECKS
from scissordyn_paper.verdict import answer

CHOICE = Choice()  # Default choice of parameters that the paper does not give

# Measures of a made-up run, which each test changes
TYPICAL_MEASURES = Measures(
    peak_force=1000.0,
    late_peak_force=100.0,
    smallest_force=0.0,
    ideal_force=50.0,
    peak_torque=500.0,
    ideal_torque=100.0,
    impacts=20,
    early_impacts=15,
    late_impacts=5,
    settled_impacts=15,
    whole_fraction=0.5,
    settled_fraction=0.5,
    final_fraction=1.0,
    late_rate=250.0,
    settled_rate=300.0,
    deviations={name: Deviation(0.1, 2.0, 1.0, 0.8) for name in OSCILLATING},
    position_deviation=0.002,
    angle_deviation=0.002,
    irregularity=1.0,
    arc=math.radians(80.0),
    trusted_until=0.05,
    end=0.05,
)


def as_the_paper_says():
    """Return made-up measures that agree with every sentence of the paper."""
    rank = {c: k for k, c in enumerate(CLEARANCES)}  # 0 at 0.7 mm
    scatter = {0.7e-3: 3.0, 0.6e-3: 2.9, 0.5e-3: 2.8, 0.4e-3: 0.1, 0.3e-3: 1.0, 0.2e-3: 0.5}
    found = {}
    for c in CLEARANCES:
        found[PaperCase(c)] = dataclasses.replace(
            TYPICAL_MEASURES,
            peak_force=1000.0 - 50.0 * rank[c],
            peak_torque=500.0 - 50.0 * rank[c],
            early_impacts=10 + rank[c],
            impacts={0.4e-3: 15}.get(c, 20 + rank[c]),
            late_peak_force=300.0 if c == 0.2e-3 else 100.0,
            late_rate=400.0 if c == 0.2e-3 else 200.0,
            settled_fraction=1.0 if c == 0.4e-3 else 0.5,
            irregularity=scatter[c],
        )
    standard = found[PaperCase()]
    for speed, factor in zip(SPEEDS, (0.5, 1.0, 2.5), strict=True):
        found[PaperCase(speed=speed)] = dataclasses.replace(
            standard, peak_force=factor * standard.peak_force, peak_torque=factor * standard.peak_torque, ideal_torque=50.0
        )
    for k, friction in enumerate(FRICTION):
        found[PaperCase(friction=friction)] = dataclasses.replace(
            TYPICAL_MEASURES, impacts=30 - k, irregularity=3.0 - k, final_fraction=0.4 if k == 0 else 1.0
        )
    for c in CONTROLLED:
        found.setdefault(PaperCase(c), TYPICAL_MEASURES)
        found[PaperCase(c, constrained=True)] = dataclasses.replace(TYPICAL_MEASURES, smallest_force=1.0, peak_torque=1e4)
    return found


def deviating(**changes):
    return {name: dataclasses.replace(TYPICAL_MEASURES.deviations[name], **changes) for name in OSCILLATING}


SPOILED = {
    "1a": (PaperCase(), {"angle_deviation": 0.011}),
    "1b": (PaperCase(), {"deviations": deviating(largest=0.009)}),
    "1c": (PaperCase(), {"deviations": deviating(after=2.1)}),
    "1d": (PaperCase(), {"deviations": deviating(early=0.49)}),
    "2a": (PaperCase(), {"ideal_force": 91.0}),
    "3a": (PaperCase(speed=SPEEDS[0]), {"peak_force": 2250.0 / 5.6}),
    "3b": (PaperCase(speed=SPEEDS[0]), {"peak_torque": 1e6}),
    "3c": (PaperCase(speed=SPEEDS[2]), {"ideal_torque": 1e6}),
    "4a": (PaperCase(0.4e-3), {"peak_force": 1e4}),
    "4b": (PaperCase(0.4e-3), {"peak_torque": 1e4}),
    "4c": (PaperCase(0.2e-3), {"early_impacts": 13}),
    "4d": (PaperCase(0.6e-3), {"late_peak_force": 300.0}),
    "4e": (PaperCase(0.4e-3), {"late_rate": 400.0}),
    "5a": (PaperCase(0.4e-3), {"settled_fraction": 0.98}),
    "5b": (PaperCase(0.3e-3), {"settled_fraction": 0.995}),
    "5c": (PaperCase(0.6e-3), {"impacts": 22}),
    "5d": (PaperCase(0.2e-3), {"impacts": 15}),
    "5e": (PaperCase(0.3e-3), {"irregularity": 0.05}),
    "5f": (PaperCase(0.2e-3), {"irregularity": 1.1}),
    "6a": (PaperCase(friction=0.03), {"impacts": 31}),
    "6b": (PaperCase(friction=0.01), {"final_fraction": 1.0}),
    "6c": (PaperCase(friction=0.1), {"final_fraction": 0.9}),
    "6d": (PaperCase(friction=0.05), {"arc": math.radians(100.0)}),
    "6e": (PaperCase(friction=0.1), {"irregularity": 1.5}),
    "7a": (PaperCase(0.3e-3, constrained=True), {"smallest_force": -1.0}),
    "7b": (PaperCase(0.1e-3, constrained=True), {"peak_torque": 400.0}),
}
"""Change of one measure of one run that contradicts the paper, for each statement."""


@pytest.mark.parametrize("check", CHECKS, ids=lambda check: check.key)
def test_each_check_can_agree_and_differ(check):
    """Contract: a check agrees with measures as the paper describes them, and differs once a single run contradicts it."""
    measured = as_the_paper_says()
    yes = answer(check, CHOICE, measured)
    assert (yes.answer, yes.trusted) == ("agrees", True)
    case, changes = SPOILED[check.key]
    no = answer(check, CHOICE, measured | {case: dataclasses.replace(measured[case], **changes)})
    assert no.answer == "differs"
    assert all(math.isfinite(value) for value in no.finding.numbers.values())
    assert no.finding.words != yes.finding.words


def test_verdict_depends_on_its_own_runs():
    """Contract: a run beyond its predictability horizon affects only the checks about it."""
    measured = as_the_paper_says()
    measured[PaperCase(friction=0.03)] = dataclasses.replace(measured[PaperCase(friction=0.03)], trusted_until=0.01)
    doubtful = {check.key for check in CHECKS if not answer(check, CHOICE, measured).trusted}
    assert doubtful == {"6a", "6c", "6d", "6e"}


# Measures of a made-up irregular motion, which each test changes
IRREGULAR_MOTION = Regularity("irregular", "irregular", 4, 4, 0.99, 20.0, 1.0, 0.9, 8.0, 5, 320, ("Words.",))


def settled_as_the_paper_says():
    """Return made-up motions under the periodic drive that agree with every sentence of the paper."""
    impacts = {0.7e-3: 6.0, 0.6e-3: 7.0, 0.5e-3: 8.0, 0.4e-3: 1.0, 0.3e-3: 5.0, 0.2e-3: 3.0}
    found = {case: dataclasses.replace(IRREGULAR_MOTION, impacts=impacts[case.clearance]) for case in BY_CLEARANCE}
    calm, between = PaperCase(0.4e-3, choice=PERIODIC), PaperCase(0.2e-3, choice=PERIODIC)
    found[calm] = dataclasses.replace(found[calm], kind="continuous contact", contact_fraction=1.0)
    found[between] = dataclasses.replace(found[between], kind="quasi-periodic", exponent=0.0)
    for k, case in enumerate(BY_FRICTION):
        fraction = 0.9 if k == 0 else 1.0
        found[case] = dataclasses.replace(IRREGULAR_MOTION, exponent=20.0 - 3.0 * k, impacts=8.0 - k, contact_fraction=fraction)
    return found


UNSETTLED = {
    "5a": (0.4e-3, None, {"contact_fraction": 0.98}),
    "5b": (0.3e-3, None, {"contact_fraction": 1.0}),
    "5c": (0.6e-3, None, {"impacts": 9.0}),
    "5d": (0.2e-3, None, {"impacts": 0.5}),
    "5e": (0.6e-3, None, {"kind": "transient only", "name": "transient only"}),
    "5f": (0.2e-3, None, {"kind": "periodic", "name": "periodic, period 1"}),
    "6a": (0.5e-3, 0.05, {"impacts": 7.5}),
    "6b": (0.5e-3, 0.01, {"contact_fraction": 1.0}),
    "6c": (0.5e-3, 0.1, {"contact_fraction": 0.98}),
    "6e": (0.5e-3, 0.03, {"exponent_error": 3.0}),
}
"""Clearance, friction and measures that contradict the paper, for each statement that applies to a periodic drive."""


def test_table_of_clauses_under_the_periodic_drive():
    """Contract: `UNSETTLED` has every check with a meaning under a periodic drive."""
    assert set(UNSETTLED) == {check.key for check in CHECKS if check.periodically is not None}


@pytest.mark.parametrize("check", [check for check in CHECKS if check.key in UNSETTLED], ids=lambda check: check.key)
def test_each_check_under_the_periodic_drive(check):
    """Contract: a check agrees with motions as the paper describes them, and differs once one contradicts it."""
    measured, settled = as_the_paper_says(), settled_as_the_paper_says()
    yes = answer(check, CHOICE, measured, settled)
    clearance, friction, changes = UNSETTLED[check.key]
    case = PaperCase(clearance, friction=friction, choice=PERIODIC)
    no = answer(check, CHOICE, measured, settled | {case: dataclasses.replace(settled[case], **changes)})
    assert (yes.periodic.answer, no.periodic.answer) == ("agrees", "differs")
    assert no.periodic.words != yes.periodic.words
    assert no.finding == yes.finding
    assert answer(check, CHOICE, measured).periodic is None
