"""Which statements hold for which of the choices that the paper's lost tables leave open."""

from __future__ import annotations

import dataclasses
import itertools
import json
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path

import numpy as np
import xarray as xr

from scissordyn.errors import InputError, ScissordynError
from scissordyn.paper.cases import Choice, PaperCase, every_case
from scissordyn.paper.kept import Progress, provenance
from scissordyn.paper.measures import Measures, measure
from scissordyn.paper.periodic import PERIODIC
from scissordyn.paper.runs import compute
from scissordyn.paper.statements import CLAUSES
from scissordyn.paper.verdict import Finding, answer
from scissordyn.simulation.store import load, save
from scissordyn.study.runner import run_cases
from scissordyn.units import degrees

__all__ = ["DEFAULT", "FACTORS", "Holds", "fetch_sensitivity", "full_factorial", "one_at_a_time", "survey"]

DEFAULT = Choice()

STROKES = (
    *((degrees(angle), "rising") for angle in (15, 30, 45, 60)),
    *((degrees(angle), "falling") for angle in (60, 75)),
)
"""Angle at the start and travel. At 150 rpm a stroke turns 45 deg: the falling ones go back over the first two rising ones,
the others would begin at a right angle or beyond, where the array cannot be assembled."""

LENGTHS = (10e-3, 15e-3, 30e-3)
RESTITUTIONS = (0.5, 0.7, 0.9)

MEMBERS = 8
PAIR = 2

FACTORS: dict[str, Callable[[Choice], str]] = {
    "reading": lambda choice: f"reading {choice.reading}",
    "stroke": lambda choice: (
        f"{choice.travel} {'about' if choice.travel == 'swing' else 'from'} {np.degrees(choice.angle):.0f} deg"
    ),
    "restitution": lambda choice: f"c_e = {choice.restitution:g}",
    "joint": lambda choice: (
        "as printed" if choice.stiffness == "bai-zhao-as-printed" else f"Liu, L_b = {1e3 * choice.bearing_length:g} mm"
    ),
}
"""Name of a factor, and the level that a choice has of it."""


def one_at_a_time() -> tuple[Choice, ...]:
    """The default choice, and those that differ from it in one thing."""
    changed = [
        DEFAULT,
        dataclasses.replace(DEFAULT, reading="B"),
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
        Choice(reading=reading, angle=angle, travel=travel, restitution=restitution, **joint)  # type: ignore[arg-type]
        for reading, (angle, travel), restitution, joint in itertools.product("AB", STROKES, RESTITUTIONS, joints)
    )


@dataclasses.dataclass(frozen=True)
class Holds:
    """How the clauses fare under one choice.

    Parameters
    ----------
    agreeing : tuple of float
        By clause, in the order of `CLAUSES`: share of the ensemble for which it holds.
    words : tuple of str
        By clause: what was measured on the first member.
    parted : float
        Largest relative spread of a peak force within the ensemble: zero as long as the members tell the same story.
    """

    agreeing: tuple[float, ...]
    words: tuple[str, ...]
    parted: float


def survey(choice: Choice, members: int = PAIR) -> Holds:
    """Answer every clause for a choice, on an ensemble of neighbours.

    Parameters
    ----------
    choice : Choice
    members : int
        Runs of each case, with clearances that differ by 1e-12 of themselves.

    Returns
    -------
    Holds
    """
    cases = every_case(choice)
    ideal = {case: compute(case, trust=False) for case in cases if case.clearance is None}
    words: tuple[str, ...] = ()
    holds, peaks = [], []
    measured: dict[PaperCase, Measures] = {}
    for member in range(members):
        for case in cases:
            # a held joint meets no impact that could part two neighbours
            if case.clearance is not None and not (case.held and member):
                measured[case] = measure(compute(case, trust=False, member=member), ideal[case.ideal])
        verdicts = [answer(clause, choice, measured) for clause in CLAUSES]
        holds.append([verdict.finding.holds for verdict in verdicts])
        words = words or tuple(verdict.finding.words for verdict in verdicts)
        peaks.append([found.peak_force for found in measured.values()])
    spread = np.ptp(peaks, axis=0) / np.max(peaks, axis=0)
    return Holds(tuple(np.mean(holds, axis=0).tolist()), words, float(np.max(spread)))


def fetch_sensitivity(
    choices: Sequence[Choice],
    path: Path,
    *,
    settled: Mapping[str, Finding] | None = None,
    members: int = PAIR,
    workers: int | None = None,
    progress: Progress | None = None,
) -> xr.Dataset:
    """Survey many choices, or read the survey from its file if the same has been done by the same version.

    Parameters
    ----------
    choices : sequence of Choice
    path : Path
        NetCDF file, written whole or not at all.
    settled : mapping of str to Finding, optional
        Answers by clause that take the place of those from two swings, for the periodic drive.
    members : int
    workers : int, optional
    progress : callable, optional

    Returns
    -------
    Dataset
        `agreeing` (choice, clause), `words` (choice, clause), `spread` (choice), and the fields of the choices.
    """
    asked = json.dumps([dataclasses.asdict(choice) for choice in choices])
    instead = {key: dataclasses.asdict(finding) for key, finding in (settled or {}).items()}
    made = {
        "choices": asked,
        "members": members,
        "provenance": provenance(),
        "clauses": _clauses(),
        "settled": json.dumps(instead),
    }
    try:
        stored = load(path)
        if all(stored.attrs.get(key) == value for key, value in made.items()):
            return stored
    except InputError:
        pass  # not there yet, or broken off: it is made now
    told = None if progress is None else partial(progress, f"choices, {members} members each")
    found: list[Holds] = []
    for result in run_cases(partial(survey, members=members), choices, workers=workers, progress=told):
        if result.value is None:
            raise ScissordynError(f"{choices[result.index].words}: {result.error}")
        found.append(_settled(choices[result.index], result.value, settled or {}))
    return load(save(_dataset(choices, found, made), path, replace_broken=True))


def _settled(choice: Choice, found: Holds, settled: Mapping[str, Finding]) -> Holds:
    """Two swings are no evidence of what a periodic drive leads to: those answers come from hundreds of them."""
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
                {"units": "1", "long_name": "share of the ensemble for which the clause holds"},
            ),
            "words": (both, np.array([one.words for one in found], dtype=object), {"long_name": "what was measured"}),
            "spread": (
                "choice",
                np.array([one.parted for one in found]),
                {"units": "1", "long_name": "largest relative spread of a peak force within the ensemble"},
            ),
            **fields,
        },
        coords={"clause": [clause.key for clause in CLAUSES], "summary": ("choice", [choice.words for choice in choices])},
        attrs={"title": "scissordyn survey of the paper's open choices", **made},
    )
