"""Convergence of a measure over tolerance, step or number of bending modes, from coarse to fine."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from scissordyn.errors import InputError, whole_number
from scissordyn.model.mechanism import Mechanism
from scissordyn.model.options import TIME_STEPPING, Options
from scissordyn.plan.flexible import flexible_bars, with_mode_counts
from scissordyn.plan.plan import plan
from scissordyn.run.advance.interrupt import raise_if_interrupted
from scissordyn.run.batch import Perturbed, simulate_cases
from scissordyn.run.measure import MEASURES
from scissordyn.run.response import Response, check_part, read_response
from scissordyn.run.trajectory import make_driver
from scissordyn.studies.ask.requirement import response_values
from scissordyn.tolerance import CONVERGENCE_TOL, STANDARD_ERRORS_MAX
from scissordyn.units import checked

# Tolerances of a convergence study, coarse to fine; each is compared with the next two
TOLERANCES = (1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9)

STEPS = tuple(2.0**k for k in range(4, -4, -1))
"""Step sizes of a convergence study of time stepping, coarse to fine, as multiples of the automatic one.

If the user requested a shorter step, they are multiples of that.
"""

MODES = (2, 4, 6, 8, 12, 16, 20, 24, 32)  # Mode counts of each flexible bar in a convergence study, coarse to fine
AGREEING_LEVELS = 2  # Number of finer levels that a converged level agrees with: two wrong values may agree by chance

# Pattern of a measure with the accuracy that a convergence study looks for, "A.peak_force within 2 %"
ACCURACY_TEXT = re.compile(r"\s*((?:[^\s.](?:(?!\swithin\s)[^.])*\.)?\S+)(?:\s+within\s+(\d+(?:\.\d*)?(?:[eE]-?\d+)?)\s*%)?\s*")


@dataclass(frozen=True)
class Level:
    """Runs at one tolerance, with one step or with one number of modes."""

    setting: float  # Value of rtol and atol [1], of the step [s], or modes of each bar [1]
    value: float  # Mean over the members; NaN if one failed
    spread: float  # Largest less smallest member, as a fraction of the value
    error: float  # Standard error of the mean
    seconds: float  # Time of a run [s]
    cause: str = ""  # Why a member failed


@dataclass(frozen=True)
class Convergence:
    """Coarsest tolerance, step or number of modes from which on a measure stays the same."""

    response: str  # Name of the measure
    units: str
    within: float  # Requested accuracy as a fraction
    levels: tuple[Level, ...]  # Levels from coarse to fine
    varied: str  # Setting that is varied: "tolerance", "step" (with hard contacts) or "modes"
    setting: float  # Coarsest setting whose value agrees with the values of the next two; NaN if none does
    # True if runs that start with a difference of round-off spread by more than `within`: then the means of the runs are
    # compared, within their standard errors
    chaotic: bool

    @property
    def options(self) -> dict[str, float]:
        """Options of a run to change; empty if modes are varied."""
        if math.isnan(self.setting) or self.varied == "modes":
            return {}
        return {"step": self.setting} if self.varied == "step" else {"rtol": self.setting, "atol": self.setting}

    @property
    def value(self) -> float:
        """Measure at the finest level."""
        return self.levels[-1].value


def read_wanted(text: str) -> tuple[str, float]:
    """Read a response and its required accuracy: ``tip.error within 1 %``."""
    match = ACCURACY_TEXT.fullmatch(text)
    if match is None or (match[2] and not 0.0 < float(match[2]) < 100.0):
        raise InputError(f"wrong form of '{text}'", "a measure and its accuracy in percent", "'tip.error within 1 %'")
    return match[1], float(match[2] or 1.0) / 100.0


@checked
def convergence(
    mechanism: Mechanism,
    options: Options,
    response: str,
    *,
    within: float = 0.01,
    members: int = 2,
    threads: int | None = None,
    over: Literal["accuracy", "modes"] = "accuracy",
) -> Convergence:
    """Find the tolerance, step of hard contacts or number of bending modes that is enough for a measure of a run.

    Parameters
    ----------
    mechanism : Mechanism
    options : Options
        Options of the runs; rtol and atol, or with hard contacts the step, are varied.
    response : str
        A measure of `simulate_many`, or that of a part: ``peak_force``, ``tip.error``.
    within : float
        Required accuracy, as a fraction of the measure.
    members : int
        Runs at each level from starts that differ by round-off.
    threads : int, optional
    over : {"accuracy", "modes"}
        Setting that is varied: tolerance or step, or the number of modes of all bars that bend.

    Raises
    ------
    InputError
        If the measure or part does not exist or has no value, or no bar bends by modes.
    """
    if not 0.0 < within < 1.0:
        raise InputError(f"within = {within!r}", "a fraction above 0 and below 1", "within=0.01")
    whole_number("members", members, 2)
    part, measure, _ = read_response(response)
    selected = Response(measure, part)
    check_part(mechanism, selected)
    varied, tried = _settings_to_try(mechanism, options, over)
    levels, sufficient = list[Level](), math.nan
    for setting, variant, changed in tried:
        levels.append(_level(variant, changed, setting, selected, members, threads))
        if math.isnan(levels[-1].value) and not levels[-1].cause:
            raise InputError(f"'{selected.name}' has no value in this run", "a measure of a part that the mechanism has")
        at = len(levels) - 1 - AGREEING_LEVELS
        if at >= 0 and _agrees(levels[at], levels[at + 1 :], within):
            sufficient = levels[at].setting
            break
    chaotic = any(not level.cause and level.spread > within for level in levels[-AGREEING_LEVELS:])
    return Convergence(selected.name, MEASURES[measure].units, within, tuple(levels), varied, sufficient, chaotic)


def _settings_to_try(mechanism: Mechanism, options: Options, over: str) -> tuple[str, list[tuple[float, Mechanism, Options]]]:
    """Return the varied setting and its values from coarse to fine, each with mechanism and options."""
    once = replace(options, trust=False)
    if over == "modes":
        if not flexible_bars(mechanism):
            allowed = "sd.with_bending(mechanism, ...)"
            raise InputError("over = 'modes' with no bar that bends by modes", allowed, "over='accuracy'")
        return "modes", [(float(count), with_mode_counts(mechanism, count), once) for count in MODES]
    _, _, choice = make_driver(plan(mechanism), replace(once, step=None))
    if choice.method == TIME_STEPPING:
        steps = [factor * min(choice.step, options.step or math.inf) for factor in STEPS]
        return "step", [(step, mechanism, replace(once, step=step)) for step in steps]
    return "tolerance", [(tolerance, mechanism, replace(once, rtol=tolerance, atol=None)) for tolerance in TOLERANCES]


def _level(
    mechanism: Mechanism, options: Options, setting: float, wanted: Response, members: int, threads: int | None
) -> Level:
    starts = Perturbed(np.arange(members), CONVERGENCE_TOL)
    runs = raise_if_interrupted(simulate_cases(mechanism, {}, options, [wanted.measure], starts, threads=threads))
    values = response_values(runs, wanted)
    failed = runs["status"].values != "complete"
    cause = str(runs["cause"].values[np.argmax(failed)]) if failed.any() else ""
    equal = bool(np.all(values == values[0]))  # also of runs without the event, whose values are infinite
    if not cause and not equal and np.isinf(values).any():
        cause = "the event occurs in some of the repeated runs only"
    mean = math.nan if cause else float(values.mean())
    spread = 0.0 if equal else float(np.ptp(values)) / (abs(mean) or 1.0)
    error = 0.0 if equal or cause else float(np.std(values, ddof=1)) / math.sqrt(members)
    return Level(setting, mean, spread, error, float(runs.attrs["integration_seconds"]) / members, cause)


def _agrees(coarse: Level, finer: Sequence[Level], within: float) -> bool:
    """Return True if a level agrees with finer ones, within the requested fraction or the scatter of members."""
    if any(level.cause for level in (coarse, *finer)):
        return False
    reference = finer[-1]
    return all(
        coarse.value == level.value
        or abs(coarse.value - level.value)
        <= max(within * abs(reference.value), STANDARD_ERRORS_MAX * math.hypot(coarse.error, level.error))
        for level in finer
    )
