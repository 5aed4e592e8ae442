"""Evaluation of the clauses on clearance and friction for the periodic drive, from the asymptotic motion."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping, Sequence

from scissordyn_paper.cases import PaperCase
from scissordyn_paper.measures import CONTINUOUS
from scissordyn_paper.periodic import BY_CLEARANCE, BY_FRICTION, Regularity
from scissordyn_paper.verdict import Finding, Settled


def _label(case: PaperCase) -> str:
    return f"{1e3 * (case.clearance or 0.0):g} mm" if case.friction is None else f"{case.friction:g}"


def _at(sizes: Sequence[float]) -> tuple[PaperCase, ...]:
    return tuple(case for case in BY_CLEARANCE if case.clearance in sizes)


def _told(
    settled: Settled, cases: Sequence[PaperCase], title: str, words: Callable[[Regularity], str], **numbers: str
) -> tuple[str, dict[str, float]]:
    """A sentence over cases, and the named fields of each as numbers."""
    said = ", ".join(f"{words(settled[case])} at {_label(case)}" for case in cases)
    found = {
        f"{name}_{_label(case).replace(' ', '_')}_{unit}": float(getattr(settled[case], name))
        for name, unit in numbers.items()
        for case in cases
    }
    return f"{title}: {said}" if title else said, found


def _fractions(settled: Settled, cases: Sequence[PaperCase]) -> tuple[str, dict[str, float]]:
    return _told(
        settled, cases, "fraction of time in contact", lambda one: f"{100.0 * one.contact_fraction:.4g} %", contact_fraction="1"
    )


def _impacts(settled: Settled, cases: Sequence[PaperCase]) -> tuple[str, dict[str, float]]:
    return _told(settled, cases, "contacts per period", lambda one: f"{one.impacts:.3g}", impacts="1")


def _verdicts(settled: Settled, cases: Sequence[PaperCase]) -> tuple[str, dict[str, float]]:
    return _told(settled, cases, "", lambda one: one.words, exponent="per_s", exponent_error="per_s")


def _grow(values: Sequence[float]) -> bool:
    return all(low < high for low, high in itertools.pairwise(values))


def continuous_04(settled: Settled) -> Finding:
    """5a: fraction of contact at 0.4 mm."""
    cases = _at([0.4e-3])
    return Finding(settled[cases[0]].contact_fraction >= CONTINUOUS, *_fractions(settled, cases))


def flying(settled: Settled) -> Finding:
    """5b: fraction of contact at the clearances that the paper calls irregular."""
    cases = _at([0.7e-3, 0.6e-3, 0.5e-3, 0.3e-3])
    return Finding(all(settled[case].contact_fraction < CONTINUOUS for case in cases), *_fractions(settled, cases))


def more_often(settled: Settled) -> Finding:
    """5c: contacts per period at the larger clearances."""
    cases = _at([0.7e-3, 0.6e-3, 0.5e-3])
    return Finding(_grow([settled[case].impacts for case in cases]), *_impacts(settled, cases))


def again_more(settled: Settled) -> Finding:
    """5d: contacts per period at the smaller clearances."""
    cases = _at([0.4e-3, 0.3e-3, 0.2e-3])
    fewest = settled[cases[0]].impacts
    return Finding(all(settled[case].impacts > fewest for case in cases[1:]), *_impacts(settled, cases))


def regular(settled: Settled) -> Finding:
    """5e: verdicts by clearance."""
    cases = _at([0.7e-3, 0.6e-3, 0.5e-3, 0.4e-3, 0.3e-3])
    expected: Mapping[PaperCase, bool] = {case: case.clearance == 0.4e-3 for case in cases}
    return Finding(all(settled[case].regular is expected[case] for case in cases), *_verdicts(settled, cases))


def quasi_periodic(settled: Settled) -> Finding:
    """5f: the verdict at 0.2 mm."""
    cases = _at([0.2e-3])
    return Finding(settled[cases[0]].kind == "quasi-periodic", *_verdicts(settled, cases))


def fewer_rebounds(settled: Settled) -> Finding:
    """6a: contacts per period by friction coefficient."""
    return Finding(_grow([-settled[case].impacts for case in BY_FRICTION]), *_impacts(settled, BY_FRICTION))


def rebounding(settled: Settled) -> Finding:
    """6b: fraction of contact at the least friction."""
    cases = BY_FRICTION[:1]
    return Finding(settled[cases[0]].contact_fraction < CONTINUOUS, *_fractions(settled, cases))


def eventually(settled: Settled) -> Finding:
    """6c: fraction of contact with more friction."""
    cases = BY_FRICTION[1:]
    return Finding(all(settled[case].contact_fraction >= CONTINUOUS for case in cases), *_fractions(settled, cases))


def calmer(settled: Settled) -> Finding:
    """6e: exponents by friction coefficient."""
    falls = [
        settled[more].exponent + settled[more].exponent_error < settled[less].exponent - settled[less].exponent_error
        for less, more in itertools.pairwise(BY_FRICTION)
    ]
    return Finding(all(falls), *_verdicts(settled, BY_FRICTION))
