"""Dependence of the statements on the parameters of the paper whose tables are lost."""

from __future__ import annotations

import dataclasses
import itertools
import json
from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache
from pathlib import Path

import numpy as np
import xarray as xr

from scissordyn.errors import InputError
from scissordyn.run.engine import Engine
from scissordyn.run.store import load, save
from scissordyn.units import degrees
from scissordyn_paper.cache import Progress, computed, provenance
from scissordyn_paper.cases import DRIVEN, Choice, PaperCase, every_case
from scissordyn_paper.measures import IdealMotion, Measures, ideal_motion, measure
from scissordyn_paper.periodic import PERIODIC
from scissordyn_paper.runs import compute
from scissordyn_paper.statements import CLAUSES
from scissordyn_paper.verdict import Finding, answer

DEFAULT = Choice()

STROKES = (
    *((degrees(angle), "rising") for angle in (15, 30, 45, 60)),
    *((degrees(angle), "falling") for angle in (60, 75)),
)
"""Angle at the start and travel. At 150 rpm a stroke is 45 deg: the falling ones are the reverse of the first two rising ones;
the others would start at 90 deg or beyond, where the array cannot be assembled."""

LENGTHS = (10e-3, 15e-3, 30e-3)
RESTITUTIONS = (0.5, 0.7, 0.9)

MEMBERS = 8
PAIR = 2

FACTORS: dict[str, Callable[[Choice], str]] = {
    "driven bar": lambda choice: DRIVEN[choice.driven_bar],
    "stroke": lambda choice: (
        f"{choice.travel} {'about' if choice.travel == 'oscillating' else 'from'} {np.degrees(choice.angle):.0f} deg"
    ),
    "restitution": lambda choice: f"c_e = {choice.restitution:g}",
    "joint": lambda choice: (
        "as printed" if choice.stiffness == "bai-zhao-as-printed" else f"Liu, L_b = {1e3 * choice.bearing_length:g} mm"
    ),
}
"""Name of a factor, and its level in a choice."""


def one_at_a_time() -> tuple[Choice, ...]:
    """The default choice, and those that differ from it in one parameter."""
    changed = [
        DEFAULT,
        dataclasses.replace(DEFAULT, driven_bar="slider"),
        *(dataclasses.replace(DEFAULT, angle=angle, travel=travel) for angle, travel in STROKES),  # type: ignore[arg-type]
        PERIODIC,
        *(dataclasses.replace(DEFAULT, restitution=value) for value in RESTITUTIONS),
        *(dataclasses.replace(DEFAULT, bearing_length=value) for value in LENGTHS),
        dataclasses.replace(DEFAULT, stiffness="bai-zhao-as-printed"),
    ]
    return tuple(dict.fromkeys(changed))


def full_factorial() -> tuple[Choice, ...]:
    """Every combination, single strokes only; the bearing's length does not enter the stiffness as printed."""
    joints = [{"bearing_length": length} for length in LENGTHS] + [{"stiffness": "bai-zhao-as-printed"}]
    return tuple(
        Choice(driven_bar=driven, angle=angle, travel=travel, restitution=restitution, **joint)  # type: ignore[arg-type]
        for driven, (angle, travel), restitution, joint in itertools.product(DRIVEN, STROKES, RESTITUTIONS, joints)
    )


@dataclasses.dataclass(frozen=True)
class Holds:
    """The answers to the clauses under one choice."""

    agreeing: tuple[float, ...]  # By clause, in the order of `CLAUSES`: fraction of the ensemble for which it holds
    words: tuple[str, ...]  # By clause: measured values of the first member
    spread: float  # Largest relative spread of a peak force within the ensemble: zero while the members agree


def survey(choice: Choice, members: int = PAIR) -> Holds:
    """Answer every clause for a choice, from an ensemble of neighbours."""
    cases = [case for case in every_case(choice) if case.clearance is not None]
    words: tuple[str, ...] = ()
    holds, peaks = [], []
    measured: dict[PaperCase, Measures] = {}
    for member in range(members):
        for case in cases:
            if not case.constrained:
                run = compute(case, trust=False, member=member)
                measured[case] = measure(run, _ideal_motion(case.ideal.without_contact_laws))
            elif not member:  # a constrained contact has no impact, so that neighbouring runs do not diverge
                measured[case] = _constrained(case.without_contact_laws)
        verdicts = [answer(clause, choice, measured) for clause in CLAUSES]
        holds.append([verdict.finding.holds for verdict in verdicts])
        words = words or tuple(verdict.finding.words for verdict in verdicts)
        peaks.append([found.peak_force for found in measured.values()])
    spread = np.ptp(peaks, axis=0) / np.max(peaks, axis=0)
    return Holds(tuple(np.mean(holds, axis=0).tolist()), words, float(np.max(spread)))


@lru_cache(16)
def _ideal_motion(case: PaperCase) -> IdealMotion:
    """The ideal motion on a drive, once for all choices of contact laws."""
    return ideal_motion(compute(case, trust=False))


@lru_cache(16)
def _constrained(case: PaperCase) -> Measures:
    """The measures of a run with constrained contact, once for all choices of contact laws."""
    return measure(compute(case, trust=False), _ideal_motion(case.ideal.without_contact_laws))


@dataclasses.dataclass(frozen=True)
class Survey:
    """What is asked of some choices."""

    choices: Sequence[Choice]
    path: Path  # NetCDF file, complete or missing
    # Answers by clause that replace those from two oscillations, for the periodic drive
    settled: Mapping[str, Finding] = dataclasses.field(default_factory=dict)
    members: int = PAIR  # See `survey`

    @property
    def tasks(self) -> tuple[tuple[Choice, int], ...]:
        """Each choice once, and the members."""
        return tuple((choice, self.members) for choice in dict.fromkeys(self.choices))

    @property
    def made(self) -> dict[str, object]:
        """What a file of it says about itself."""
        instead = {key: dataclasses.asdict(finding) for key, finding in self.settled.items()}
        return {
            "choices": json.dumps([dataclasses.asdict(choice) for choice in self.choices]),
            "members": self.members,
            "provenance": provenance(),
            "clauses": _clauses(),
            "settled": json.dumps(instead),
        }

    def stored(self) -> xr.Dataset | None:
        """What its file has, if that is of the same choices and version."""
        try:
            found = load(self.path)
        except InputError:  # missing or incomplete
            return None
        return found if all(found.attrs.get(key) == value for key, value in self.made.items()) else None

    def saved(self, results: Mapping[tuple[Choice, int], Holds]) -> xr.Dataset:
        """Write the file from the results of all its tasks."""
        found = [_settled(choice, results[choice, self.members], self.settled) for choice in self.choices]
        return load(save(_dataset(self.choices, found, self.made), self.path, replace_broken=True))


def fetch_sensitivity(
    choices: Sequence[Choice],
    path: Path,
    *,
    settled: Mapping[str, Finding] | None = None,
    members: int = PAIR,
    engine: Engine = None,
    progress: Progress | None = None,
) -> xr.Dataset:
    """Survey many choices, or read the survey from its file if it is of the same choices and version."""
    (found,) = fetch_surveys(Survey(choices, path, settled or {}, members), engine=engine, progress=progress)
    return found


def fetch_surveys(*asked: Survey, engine: Engine = None, progress: Progress | None = None) -> tuple[xr.Dataset, ...]:
    """Several surveys as of `fetch_sensitivity`; no worker waits for the end of one before it begins with the next."""
    stored = {each.path: found for each in asked if (found := each.stored()) is not None}
    results: dict[tuple[Choice, int], Holds] = {}
    for task, holds in computed(
        _surveyed,
        [task for each in asked if each.path not in stored for task in each.tasks],
        what=lambda task: f"choices, {task[1]} members each",
        engine=engine,
        progress=progress,
        named=lambda task: f"{task[0].words}: ",
    ):
        results[task] = holds
        for each in asked:
            if each.path not in stored and results.keys() >= set(each.tasks):
                stored[each.path] = each.saved(results)
    return tuple(stored[each.path] for each in asked)


def _surveyed(task: tuple[Choice, int]) -> Holds:
    return survey(task[0], task[1])


def _settled(choice: Choice, found: Holds, settled: Mapping[str, Finding]) -> Holds:
    """Two oscillations are no evidence of the asymptotic motion: those answers come from hundreds of them."""
    if choice != PERIODIC:
        return found
    agreeing, words = list(found.agreeing), list(found.words)
    for k, clause in enumerate(CLAUSES):
        if clause.key in settled:
            agreeing[k], words[k] = float(settled[clause.key].holds), settled[clause.key].words
    return dataclasses.replace(found, agreeing=tuple(agreeing), words=tuple(words))


def _clauses() -> str:
    """The criteria that were applied; a survey by other ones is out of date."""
    return json.dumps([(clause.key, clause.criterion) for clause in CLAUSES])


def _dataset(choices: Sequence[Choice], found: Sequence[Holds], made: dict[str, object]) -> xr.Dataset:
    units = {"angle": "rad", "restitution": "1", "bearing_length": "m"}
    both = ("choice", "clause")
    fields = {
        field.name: (
            "choice",
            np.array([getattr(choice, field.name) for choice in choices]),
            {"units": units.get(field.name, ""), "long_name": field.name.replace("_", " ")},
        )
        for field in dataclasses.fields(Choice)
    }
    return xr.Dataset(
        {
            "agreeing": (
                both,
                np.array([one.agreeing for one in found]),
                {"units": "1", "long_name": "fraction of the ensemble for which the clause holds"},
            ),
            "words": (both, np.array([one.words for one in found], dtype=object), {"long_name": "measured values"}),
            "spread": (
                "choice",
                np.array([one.spread for one in found]),
                {"units": "1", "long_name": "largest relative spread of a peak force within the ensemble"},
            ),
            **fields,
        },
        coords={"clause": [clause.key for clause in CLAUSES], "summary": ("choice", [choice.words for choice in choices])},
        attrs={"title": "scissordyn survey of the paper's open choices", **made},
    )
