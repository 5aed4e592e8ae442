"""Sentences of mechanics that explain the answers to the checks, and the words of the report's first screen."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from scissordyn_paper.verdict import Verdict


@dataclass(frozen=True)
class Statement:
    """Summary of a statement of the paper for the beginning of the report."""

    title: str
    agreeing: str  # Keys of the checks that agree, separated by spaces, for which `words` are true
    words: str  # Text with agreements and differences, and their causes


STATEMENTS = {
    1: Statement(
        "Clearance hardly changes positions; velocities and accelerations fluctuate",
        "1a 1b 1c",
        "Agrees: a gap of 0.5 mm shifts the slider by 1 mm only, while impacts change velocities at once. Differs: the "
        "fluctuation does not end in 5 ms, because an impact at a restitution coefficient of 0.9 keeps 81 % of its energy.",
    ),
    2: Statement(
        "The contact force exceeds the ideal reaction ten times",
        "2a",
        "Agrees: an impact stops the relative motion in less than a millisecond; an ideal joint has none to stop.",
    ),
    3: Statement(
        "Force and torque grow with the speed",
        "3b 3c",
        "Agrees, but not five times: approach speeds grow as the speed, and the force of a Hertzian contact as their power "
        "1.2 to 1.33, which is 3 to 3.4 times from 100 to 250 rpm.",
    ),
    4: Statement(
        "A smaller clearance gives smaller forces and torques, and more impacts",
        "4a 4b",
        "Agrees: a smaller gap leaves less way to gain speed, so forces and torques fall. Differs: rebounds across a smaller "
        "gap end sooner, and after 30 ms contact lasts at every clearance.",
    ),
    5: Statement(
        "The motion is regular at 0.4 mm, and irregular at other clearances",
        "5b 5c",
        "Agrees: free flight is frequent at the other clearances. Differs: all measures change steadily with the clearance, "
        "and nothing in the mechanics singles out 0.4 mm. The journal rebounds at each clearance before it stays in contact.",
    ),
    6: Statement(
        "Friction makes contact continuous and the motion regular",
        "6c 6d 6e",
        "Agrees: friction takes energy at each contact. Differs at the smallest coefficients: the damping of the impacts alone "
        "ends the rebounds, so contact is continuous at 0.01 as well.",
    ),
    7: Statement(
        "Control keeps contact and needs a higher torque",
        "7a",
        "Agrees: the ideal reaction presses the journal to one side. Differs: with a constant eccentricity the bars move as "
        "with ideal joints, so the motor needs the ideal torque and is spared the impacts.",
    ),
}
"""Summaries of the paper's statements, by number."""

EXPLANATIONS: dict[str, tuple[bool, str]] = {
    "1a": (True, "The gap shifts the slider by about twice the clearance: 1 mm in a travel of 0.93 m."),
    "1b": (True, "An impact lasts less than a millisecond and changes velocities at once, which needs a large acceleration."),
    "1c": (True, "The first impact is the fastest, 0.74 m/s; each impact takes energy from those that follow."),
    "1d": (
        False,
        "At a restitution coefficient of 0.9 an impact keeps 81 % of its energy, so rebounds last much longer than 5 ms.",
    ),
    "2a": (True, "An impact stops the relative motion in less than a millisecond; an ideal joint has none to stop."),
    "3a": (
        False,
        "Approach speeds grow as the drive's speed. The force of a Hertzian contact grows as their power 1.2 to 1.33: 3 to 3.4 "
        "times for 2.5 times the speed.",
    ),
    "3b": (True, "Approach speeds grow as the speed, and inertia forces as its square."),
    "3c": (True, "The motor balances the contact forces, which exceed the ideal reaction about tenfold."),
    "4a": (True, "A smaller gap leaves the journal less way to gain speed before it hits."),
    "4b": (True, "The torque balances the contact force and follows it."),
    "4c": (
        False,
        "Flights across a smaller gap are shorter, but the journal also settles sooner: fewer impacts are left to count.",
    ),
    "4d": (
        False,
        "After 30 ms contact lasts. Its force still vibrates from the last impacts, and most where these were strong and "
        "late, at 0.6 mm.",
    ),
    "4e": (False, "After 30 ms contact lasts at all three clearances; no impact begins."),
    "5a": (False, "A journal that falls across a gap rebounds several times at a restitution coefficient of 0.9."),
    "5b": (True, "The journal rebounds for a large part of the stroke before it stays in contact."),
    "5c": (True, "Flights across a smaller gap are shorter; down to 0.5 mm this outweighs the earlier end of the rebounds."),
    "5d": (False, "Below 0.5 mm the rebounds end so early that the number of impacts falls."),
    "5e": (False, "The disturbance of the acceleration falls steadily with the clearance; nothing singles out 0.4 mm."),
    "5f": (False, "In the same steady order 0.2 mm is below 0.3 mm and 0.4 mm, not between them."),
    "6a": (
        False,
        "Friction acts along the surfaces and hardly changes the rebound: from 0.01 to 0.03 the number of impacts stays equal.",
    ),
    "6b": (False, "The damping of the impacts alone ends the rebounds before the last fifth of the stroke."),
    "6c": (True, "Damping and friction have taken the energy of the relative motion by the last fifth of the stroke."),
    "6d": (True, "The ideal reaction turns by less than 40 deg during the stroke; it presses the journal to that side."),
    "6e": (True, "A larger coefficient takes more energy from the relative motion at each contact."),
    "7a": (True, "The ideal reaction stays above 3 kN, so it presses the journal against the bearing during the whole stroke."),
    "7b": (
        False,
        "With a constant eccentricity the bars move as with ideal joints, to within c/L = 3e-4. The motor needs the ideal "
        "torque and is spared the impacts.",
    ),
}
"""Explanations by check: the answer that the sentence explains (True for "agrees"), and the sentence."""


def explanation(verdict: Verdict) -> str:
    """Return the sentence that explains an answer, or a sentence that no explanation of this answer exists."""
    agrees, words = EXPLANATIONS[verdict.check.key]
    return words if agrees is verdict.finding.holds else "This answer has no explanation here: it has changed."


def summary(number: int, verdicts: Sequence[Verdict]) -> str:
    """Return the summary of a statement, or a sentence that the answers have changed since the summary was written."""
    agreeing = " ".join(verdict.check.key for verdict in verdicts if verdict.finding.holds)
    statement = STATEMENTS[number]
    return statement.words if agreeing == statement.agreeing else "These answers have no explanation here: they have changed."
