"""The paper's statements, check by check, each with a criterion that follows from the paper's words and not from results.

The criteria were written down before the first results, with three exceptions, none of which changed a verdict in the paper's
favour: ranges in 1a and 1b are those of both curves together, because the ideal speed of bar 2 is constant and has none; the
force in 4d is that at any time after 0.03 s, because lasting contacts have their peak before; and 1d was added, because 1c
compares levels and not the parts of the fluctuation before and after. The criteria for the periodic drive, which the paper does
not have, apply the terms to the asymptotic motion; when they were written, Lyapunov exponents at four clearances and one
friction coefficient were known.

Where the paper gives a number it is the criterion, with the rounding that its wording allows. Where it compares, the
comparison is the criterion. Where it describes a picture ("not discernible", "continuous", "regular"), the threshold is the
smallest visible difference, the same everywhere.
"""

from __future__ import annotations

import operator

from scissordyn_paper import criteria
from scissordyn_paper.cases import ARRAY_CLEARANCE, CLEARANCES, FRICTION, SIZES
from scissordyn_paper.criteria import (
    QUARTER_ARC_MAX,
    VISIBLE_FRACTION,
    clearances,
    criterion_for_motions,
    criterion_for_values,
    every,
    falls,
    frictions,
    grows,
    millimetres,
    only,
    percent,
)
from scissordyn_paper.measures import CONTINUOUS_FRACTION, LATE_TIME, SETTLING_TIME
from scissordyn_paper.verdict import Check, Periodically

_SETTLED, _LATE = f"{1e3 * SETTLING_TIME:g} ms", f"{1e3 * LATE_TIME:g} ms"
_CONTINUOUS, _INTERRUPTED = every(operator.ge, CONTINUOUS_FRACTION), every(operator.lt, CONTINUOUS_FRACTION)
_BY_SIZE, _BY_FRICTION = clearances(*SIZES), frictions(*FRICTION)
# Strokes with the three largest of six clearances, with the three smallest, and with all but the smallest
_LARGE, _SMALL, _BUT_SMALLEST = (clearances(*sizes) for sizes in (CLEARANCES[:3], CLEARANCES[3:], CLEARANCES[:5]))
# Strokes with the four clearances at which the paper reports frequent free flight
_FREE_FLIGHT = clearances(0.7e-3, 0.6e-3, 0.5e-3, 0.3e-3)
_SCATTER = (
    "a single stroke is not periodic, so period and quasi-period are not defined; the paper's picture of velocity and "
    "acceleration shows the scatter of the points about a line, here the ideal curve (root mean square, relative)"
)
_BY_SIGHT = f"a difference of {percent(VISIBLE_FRACTION)} of a curve's range is the width of a printed line"

CHECKS = (
    Check(
        "1a",
        "Displacement of the slider and angle of bar 2 do not discernibly differ from the ideal ones "
        f"({millimetres(ARRAY_CLEARANCE)}).",
        f"largest difference below {percent(VISIBLE_FRACTION)} of the range that both curves cover",
        _BY_SIGHT,
        criteria.position,
    ),
    Check(
        "1b",
        "Velocities and accelerations fluctuate about the ideal ones in the first 5 ms.",
        f"largest difference before {_SETTLED} above {percent(VISIBLE_FRACTION)} of the range that both curves cover, "
        "for all four",
        _BY_SIGHT,
        criteria.oscillation,
    ),
    Check(
        "1c",
        "The fluctuation is strongest in the first 5 ms.",
        f"root mean square difference larger before {_SETTLED} than after it, in all four curves",
        "the text places the fluctuation within 0.005 s",
        criteria.early,
    ),
    Check(
        "1d",
        "The fluctuation belongs mostly to the first 5 ms.",
        f"more than half of the integrated squared difference lies before {_SETTLED}, in all four curves",
        '"mostly" is more than half',
        criteria.within,
    ),
    Check(
        "2a",
        "Clearance raises the reaction more than 10 times.",
        "largest contact force above 10 times the largest reaction of the ideal joint",
        "the number is the paper's, which quotes it from earlier work",
        criteria.tenfold,
    ),
    Check(
        "3a",
        "The largest contact force grows five times from 100 to 250 rpm.",
        "ratio between 4.5 and 5.5",
        "what rounds to five",
        criteria.fivefold,
    ),
    Check(
        "3b",
        "Force and torque grow with the speed.",
        "largest force and largest torque both grow from 100 over 150 to 250 rpm",
        "the comparison is the paper's",
        criteria.faster,
    ),
    Check(
        "3c",
        "With clearance a larger motor is needed.",
        "largest torque above that of the ideal mechanism, at each speed",
        "the size of a motor follows from the largest torque",
        criteria.larger_motor,
    ),
    Check(
        "4a",
        "The force falls with the clearance (0.6, 0.4, 0.2 mm).",
        "largest contact force falls in that order",
        "the comparison is the paper's",
        criterion_for_values(_BY_SIZE, criteria.PEAK_FORCE, falls),
    ),
    Check(
        "4b",
        "The driving torque falls with the clearance.",
        "largest torque falls in that order",
        "the comparison is the paper's",
        criterion_for_values(_BY_SIZE, criteria.PEAK_TORQUE, falls),
    ),
    Check(
        "4c",
        "Impacts become more frequent as the clearance falls, at first.",
        f"more contacts begin before {_LATE} at each smaller clearance",
        "the paper counts collisions, and names 0.03 s as the end of this order",
        criterion_for_values(_BY_SIZE, criteria.EARLY_IMPACTS, grows),
    ),
    Check(
        "4d",
        "After 0.03 s the force is largest at 0.2 mm.",
        f"largest force after {_LATE} is that of 0.2 mm",
        "the comparison is the paper's",
        criterion_for_values(_BY_SIZE, criteria.LATE_FORCE, only(operator.gt, -1)),
    ),
    Check(
        "4e",
        "After 0.03 s impacts are most frequent at 0.2 mm.",
        f"most contacts begin after {_LATE} at 0.2 mm",
        "the comparison is the paper's",
        criterion_for_values(_BY_SIZE, criteria.LATE_RATE, only(operator.gt, -1)),
    ),
    Check(
        "5a",
        "At 0.4 mm journal and bearing stay in contact, without free flight or impact.",
        f"in contact at least {percent(CONTINUOUS_FRACTION)} of the time after {_SETTLED}",
        "the start is concentric, so the run starts in free flight; none may follow",
        criterion_for_values(clearances(0.4e-3), criteria.SETTLED_ALONE, _CONTINUOUS),
        Periodically(
            f"in contact at least {percent(CONTINUOUS_FRACTION)} of the time",
            criterion_for_values(clearances(0.4e-3), criteria.PERIODIC_FRACTION, _CONTINUOUS),
        ),
    ),
    Check(
        "5b",
        "At 0.7, 0.6, 0.5 and 0.3 mm free flight is frequent.",
        f"in contact less than {percent(CONTINUOUS_FRACTION)} of the time after {_SETTLED}, at each of them",
        "the opposite of continuous contact by the same threshold",
        criterion_for_values(_FREE_FLIGHT, criteria.SETTLED, _INTERRUPTED),
        Periodically(
            f"in contact less than {percent(CONTINUOUS_FRACTION)} of the time, at each of them",
            criterion_for_values(_FREE_FLIGHT, criteria.PERIODIC_FRACTION, _INTERRUPTED),
        ),
    ),
    Check(
        "5c",
        "Collisions become more frequent as the clearance falls from 0.7 to 0.5 mm.",
        "more contacts at each smaller clearance",
        "the paper says it of all clearances and then excepts those from 0.4 mm on",
        criterion_for_values(_LARGE, criteria.IMPACTS, grows),
        Periodically(
            "more contacts per period at each smaller clearance", criterion_for_values(_LARGE, criteria.PERIODIC_IMPACTS, grows)
        ),
    ),
    Check(
        "5d",
        "Collisions are more frequent at 0.3 and 0.2 mm than at 0.4 mm.",
        "more contacts at both",
        "the comparison is the paper's",
        criterion_for_values(_SMALL, criteria.IMPACTS, only(operator.lt, 0)),
        Periodically(
            "more contacts per period at both", criterion_for_values(_SMALL, criteria.PERIODIC_IMPACTS, only(operator.lt, 0))
        ),
    ),
    Check(
        "5e",
        "The motion is regular at 0.4 mm, irregular at 0.7, 0.6, 0.5 and 0.3 mm.",
        "scatter of the slider acceleration smallest at 0.4 mm",
        _SCATTER,
        criterion_for_values(_BUT_SMALLEST, criteria.SCATTER, only(operator.lt, 3)),
        Periodically(
            "the samples repeat at 0.4 mm, or are quasi-periodic, and are irregular at the other four",
            criterion_for_motions(_BUT_SMALLEST, criteria.regular_at_04),
        ),
    ),
    Check(
        "5f",
        "At 0.2 mm the motion is quasi-periodic: between the regular one at 0.4 mm and the irregular one at 0.3 mm.",
        "scatter of the slider acceleration grows from 0.4 over 0.2 to 0.3 mm",
        _SCATTER,
        criterion_for_values(_SMALL, criteria.SCATTER, criteria.last_between),
        Periodically(
            "the samples at 0.2 mm are quasi-periodic", criterion_for_motions(clearances(0.2e-3), criteria.quasi_periodic)
        ),
    ),
    Check(
        "6a",
        "Rebounds diminish as the friction coefficient grows (0.01, 0.03, 0.05, 0.1).",
        "fewer contacts at each larger coefficient",
        "a rebound ends a contact, and the next impact starts another",
        criterion_for_values(_BY_FRICTION, criteria.IMPACTS, falls),
        Periodically(
            "fewer contacts per period at each larger coefficient",
            criterion_for_values(_BY_FRICTION, criteria.PERIODIC_IMPACTS, falls),
        ),
    ),
    Check(
        "6b",
        "At 0.01 rebounds follow impacts, without continuous contact.",
        f"in contact less than {percent(CONTINUOUS_FRACTION)} of the last fifth of the run",
        "contact that never becomes continuous is not continuous at the end",
        criterion_for_values(frictions(*FRICTION[:1]), criteria.FINAL_ALONE, _INTERRUPTED),
        Periodically(
            f"in contact less than {percent(CONTINUOUS_FRACTION)} of the time",
            criterion_for_values(frictions(*FRICTION[:1]), criteria.PERIODIC_FRACTION, _INTERRUPTED),
        ),
    ),
    Check(
        "6c",
        "From 0.03 on contact eventually becomes continuous.",
        f"in contact at least {percent(CONTINUOUS_FRACTION)} of the last fifth of the run, at 0.03, 0.05 and 0.1",
        '"eventually" is the end of the run',
        criterion_for_values(frictions(*FRICTION[1:]), criteria.FINAL, _CONTINUOUS),
        Periodically(
            f"in contact at least {percent(CONTINUOUS_FRACTION)} of the time, at 0.03, 0.05 and 0.1",
            criterion_for_values(frictions(*FRICTION[1:]), criteria.PERIODIC_FRACTION, _CONTINUOUS),
        ),
    ),
    Check(
        "6d",
        "Contact is concentrated in about a quarter of the bearing.",
        f"an arc of at most {QUARTER_ARC_MAX:g} deg has 95 % of the contact time, at each coefficient",
        '"about" is taken as a tenth, "mainly" as 95 %',
        criterion_for_values(_BY_FRICTION, criteria.ARC, every(operator.le, QUARTER_ARC_MAX)),
    ),
    Check(
        "6e",
        "The motion becomes more regular as the friction coefficient grows.",
        "scatter of the slider acceleration falls at each larger coefficient",
        _SCATTER,
        criterion_for_values(_BY_FRICTION, criteria.SCATTER, falls),
        Periodically(
            "the largest Lyapunov exponent falls at each larger coefficient, by more than both standard errors",
            criterion_for_motions(_BY_FRICTION, criteria.exponents_fall),
        ),
    ),
    Check(
        "7a",
        "With control journal and bearing stay in contact at 0.7, 0.5, 0.3 and 0.1 mm.",
        "the normal force is positive during the whole run, at each of them",
        "the control is a bilateral constraint, but a contact is unilateral",
        criterion_for_values(criteria.CONSTRAINED, criteria.SMALLEST_FORCE, every(operator.gt, 0.0)),
    ),
    Check(
        "7b",
        "Control needs a higher torque.",
        "largest torque with control above that without, at each clearance",
        "the paper compares with and without control; without it, the start is concentric as in its other figures",
        criteria.control_raises_torque,
    ),
)
"""All checks, in the order of the paper's statements."""
