"""What a study answers, section by section in the order in which it is read: in the terminal, in a report, in a notebook."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING

from scissordyn.errors import command
from scissordyn.study.answer.conclusion import conclude, margin_text, numbers_text, trend_table
from scissordyn.study.answer.fidelity import fidelity
from scissordyn.study.answer.indices import sensitivity
from scissordyn.study.answer.ranking import rankings
from scissordyn.study.answer.summary import (
    Section,
    agreement,
    best_points,
    design_size,
    requirement_fractions,
    response_ranges,
    sensitivities,
    varied_numbers,
)

if TYPE_CHECKING:
    from scissordyn.study.result import StudyResult


def page(result: StudyResult, store: str, most: int) -> Iterator[Section]:
    """All sections that say something, of which lists end after so many rows; commands name the store so."""
    return (part for part in _sections(result, store, most) if part.lines or part.rows)


def _sections(result: StudyResult, store: str, most: int) -> Iterator[Section]:
    study, results, points = result.study, result.dataset, result.points
    yield damage_section(result, store)
    if (verified := result.verified) is not None:
        yield from fidelity(study, results, verified.dataset, (result.store, verified.store))
    conclusion = result.conclusion if store == result.store.path else conclude(study, results, store)
    yield Section(lines=conclusion.verdict)
    if conclusion.margins is not None:
        yield conclusion.margins
    yield Section(title="What the responses go with", lines=conclusion.trends)
    yield Section(("", "command"), [(str(why), what) for why, what in conclusion.next], "What to try next")
    cases = "{complete} cases complete, {failed} failed, {pending} pending".format(**result.counts)
    lines = (f"{design_size(study)}: {cases}.", *filter(None, [agreement(study, points)]))
    yield replace(varied_numbers(study, results), title="What was computed", lines=lines)
    yield response_ranges(study, results, points)
    if study.requirements:
        yield requirement_fractions(study, results)
    if study.optimisation is not None:
        yield best_points(study, results, most)
    if (exponents := trend_table(study, conclusion.fitted)) is not None:
        yield exponents
    indices, left_out = sensitivity(study, results)
    yield from (*sensitivities(indices), *rankings(study, results, conclusion.fitted))
    yield Section(title="Responses without indices", lines=[f"{name}: {why}." for name, why in left_out.items()])
    worst = [
        (case.requirement, case.text, margin_text(case.margin), numbers_text(study, results, case.numbers), case.case)
        for case in (result.worst() if study.requirements else ())
    ]
    notes = ("The margin is a fraction of the bound, negative where the requirement is not met.",)
    head = ("requirement", "value", "margin", "numbers", "command")
    yield Section(head, [(*cells, replay_command(store, case)) for *cells, case in worst], "Worst cases", notes)
    yield from cause_sections(result, store, most)


def cause_sections(result: StudyResult, store: str, most: int) -> Iterator[Section]:
    """Failed cases by cause and complete ones by warning, with a command that replays one of each."""
    for title, what, groups in (("Failed cases", "cause", result.causes), ("Warnings", "warning", result.warnings)):
        rows = [(str(len(cases)), text, replay_command(store, cases[0])) for text, cases in groups.items()]
        notes = ("In the words of the first case.", *([f"{len(rows) - most} more."] if len(rows) > most else []))
        if rows:
            yield Section(("cases", what, "command"), rows[:most], title, notes)


def damage_section(result: StudyResult, store: str) -> Section:
    """Rows that were written and are not whole, and the command that computes them anew."""
    if not result.damage:
        return Section()
    return Section(("", "command"), [(result.damage, command("scissordyn", "study", "resume", store))])


def replay_command(store: str, case: int) -> str:
    """What to type to simulate a case again, with its histories."""
    return command("scissordyn", "study", "replay", store, case)
