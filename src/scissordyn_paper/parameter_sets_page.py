"""Page on parameter sets: how many checks agree for each set, and which parameter values the agreement suggests."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from scissordyn.file.output_file import csv_text, write_file
from scissordyn.plot.style import BLUE, GREEN, VERMILION, normal, panels
from scissordyn.run.engine import Engine
from scissordyn_paper.cache import Progress
from scissordyn_paper.cases import DEFAULT
from scissordyn_paper.judge import agreeing
from scissordyn_paper.page import Cell, cited, document, paragraph, picture, save_picture, section, table, tally
from scissordyn_paper.parameter_sets import (
    FACTORS,
    NEIGHBOURS,
    SAMPLING_SEED,
    SETS_COUNT,
    Judged,
    choice_at,
    fetch_leading,
    fetch_parameter_sets,
)
from scissordyn_paper.report import DOI, SOURCE
from scissordyn_paper.statements import CHECKS

TITLE = "The paper with other parameters"  # Title of the page

STATEMENT_ODDS = 3.0  # Factor on the likelihood of a parameter set for each check that agrees

CAPTIONS = {
    "checks": "Left: fraction of the quasi-random sets for which each check agrees; the circle is the set chosen before, the "
    "cross the best one. Right: number of checks that agree for a set.",
    "parameters": "Left: information that the checks give about each open parameter; the tick is what chance shows. Right: "
    "largest number of agreeing checks as sets were added.",
}
"""Captions of the pictures by name."""

SHOWN_SETS = 5  # Number of parameter sets in the table: those with which most checks agree


@dataclass(frozen=True)
class ParameterSetAnswers:
    """Result of judging parameter sets."""

    judged: Judged  # All parameter sets
    leading: Judged  # Best parameter sets, judged by many neighbours, best first
    report: Path  # Report in HTML


def answer_parameter_sets(
    folder: Path, number: int = SETS_COUNT, *, engine: Engine = None, progress: Progress | None = None
) -> ParameterSetAnswers:
    """Judge the parameter sets that are not stored yet, and write page, table and pictures."""
    folder.mkdir(parents=True, exist_ok=True)
    judged = fetch_parameter_sets(folder / "parameter_sets", number, engine=engine, progress=progress)
    leading = fetch_leading(judged, folder / "parameter_sets", engine=engine, progress=progress)
    default = agreeing(DEFAULT, range(NEIGHBOURS))
    figures = (
        ("checks", _draw_checks(judged, default, leading.agreeing[0])),
        ("parameters", _draw_parameters(judged, information_by_factor(judged))),
    )
    pictures = [save_picture(drawn, folder / "figures", f"parameter_sets-{name}") for name, drawn in figures]
    write_file(folder / "parameter_sets.csv", _csv(judged).encode(), sample="-o paper")
    page = _page(judged, leading, default, pictures)
    return ParameterSetAnswers(judged, leading, write_file(folder / "parameter_sets.html", page.encode(), sample="-o paper"))


def weights(judged: Judged) -> np.ndarray:
    """Return weights of the quasi-random sets with the sum 1, proportional to `STATEMENT_ODDS` ** number of agreeing checks."""
    weight = STATEMENT_ODDS ** (judged.agreeing_count[judged.quasi] - judged.agreeing_count[judged.quasi].max())
    return np.asarray(weight / weight.sum())


def level_shares(judged: Judged, factor: int) -> dict[str, tuple[float, float]]:
    """Return for each level of a factor the share of quasi-random sets that have it, and their share of the weight."""
    names = np.array([FACTORS[factor].level(u) for u in judged.points[judged.quasi, factor]])
    weight = weights(judged)
    order = sorted(set(names.tolist()), key=lambda name: float(judged.points[judged.quasi, factor][names == name].min()))
    return {name: (float(np.mean(names == name)), float(weight[names == name].sum())) for name in order}


def information_by_factor(judged: Judged) -> dict[str, tuple[float, float]]:
    """Return the information [bit] of the weights about each factor, and that which the same number of sets has by chance."""
    effective = 1.0 / float(np.sum(weights(judged) ** 2))
    information = {}
    for at, factor in enumerate(FACTORS):
        pairs = [pair for pair in level_shares(judged, at).values() if pair[1] > 0.0]
        bits = sum(weight * np.log2(weight / share) for share, weight in pairs)
        information[factor.name] = float(bits), (len(level_shares(judged, at)) - 1) / (2.0 * np.log(2.0) * effective)
    return information


def never_together(judged: Judged) -> dict[str, list[str]]:
    """Return for each check the checks that never agree together with it, although five sets would if they were independent."""
    met = judged.agreeing >= 0.5
    together, alone = met.T.astype(float) @ met, met.mean(axis=0)
    expected = met.shape[0] * np.outer(alone, alone)
    keys = [check.key for check in CHECKS]
    return {
        key: [keys[j] for j in range(len(keys)) if together[i, j] == 0.0 and expected[i, j] >= 5.0]
        for i, key in enumerate(keys)
    }


def _draw_checks(judged: Judged, default: np.ndarray, best: np.ndarray) -> Figure:
    """Draw the share of parameter sets for which each check agrees, and how many checks agree for each set."""
    left, right = drawn = panels(None, 1, 2, size=(11.0, 6.2), share=False)
    places, keys = np.arange(len(CHECKS)), [check.key for check in CHECKS]
    left.barh(places, judged.agreeing[judged.quasi].mean(axis=0), color=BLUE, alpha=0.5, label="quasi-random parameter sets")
    left.plot(default, places, "o", color=GREEN, ms=6.0, mfc="none", label="chosen before")
    left.plot(best, places, "x", color=VERMILION, ms=6.0, label="best, chosen afterwards")
    left.set(
        xlim=(-0.03, 1.03),
        ylim=(len(CHECKS) - 0.4, -0.6),
        yticks=places,
        yticklabels=keys,
        xlabel="fraction of the sets",
    )
    bins = [count - 0.5 for count in range(len(CHECKS) + 2)]
    for kind, colour, label in ((judged.quasi, BLUE, "quasi-random"), (~judged.quasi, VERMILION, "near the best so far")):
        right.hist(judged.agreeing_count[kind], bins, histtype="stepfilled", alpha=0.5, color=colour, label=label)
    right.set(xlabel="checks that agree", ylabel="parameter sets", xlim=(-0.5, len(CHECKS) + 0.5))
    right.axvline(default.sum(), color=GREEN, lw=1.2, label="chosen before")
    return _titled(drawn, ("Each check", "All checks of a parameter set"))


def _draw_parameters(judged: Judged, information: Mapping[str, tuple[float, float]]) -> Figure:
    """Draw the information of the checks on each open parameter, and the largest number of agreeing checks so far."""
    left, right = drawn = panels(None, 1, 2, size=(11.0, 5.2), share=False)
    names = sorted(information, key=lambda name: -information[name][0])
    left.barh(names, [information[name][0] for name in names], color=BLUE, alpha=0.5, label="from the checks")
    left.plot([information[name][1] for name in names], names, "|", color="0.3", ms=9.0, label="by chance alone")
    left.set(xlabel="information [bit]", ylim=(len(names) - 0.4, -0.6))
    count = 1 + np.arange(judged.agreeing_count.size)
    right.plot(count, np.maximum.accumulate(judged.agreeing_count), color=VERMILION, label="all parameter sets")
    quasi = np.flatnonzero(judged.quasi)
    right.plot(count[quasi], np.maximum.accumulate(judged.agreeing_count[quasi]), color=BLUE, label="quasi-random ones")
    right.set(xscale="log", xlabel="parameter sets", ylabel="largest number of agreeing checks")
    return _titled(drawn, ("Open parameters", "Largest number so far"))


def _titled(drawn: Sequence[Axes], titles: Sequence[str]) -> Figure:
    for axes, title in zip(drawn, titles, strict=True):
        axes.set_title(title, loc="left", fontsize=normal())
        # in the left panel between short bars, and left of the marks at 1
        place = {"loc": "center right", "bbox_to_anchor": (0.95, 0.56)} if axes is drawn[0] else {"loc": "best"}
        axes.legend(frameon=False, fontsize=normal() - 1.0, **place)
    figure = drawn[0].get_figure(root=True)
    assert figure is not None
    return figure


def _page(judged: Judged, leading: Judged, default: np.ndarray, pictures: Sequence[Sequence[Path]]) -> str:
    half = judged.first(judged.agreeing_count.size // 2)
    effective = 1.0 / float(np.sum(weights(judged) ** 2))
    counts = [
        (
            f"{leading.agreeing_count[0]:.3g} of {len(CHECKS)}",
            f"checks agree for the best parameter set, over {NEIGHBOURS} neighbours",
        ),
        (f"{default.sum():.3g} of {len(CHECKS)}", "for the one chosen before any result"),
        (
            f"{judged.agreeing_count.size}",
            f"parameter sets, {judged.seconds.mean():.2g} s of one processor each, seed {SAMPLING_SEED}",
        ),
    ]
    parts = [
        cited(TITLE, SOURCE, DOI),
        paragraph(
            "The paper's tables of parameters are not public. Every value and every choice that its text leaves open was drawn "
            "anew for each set. A check is one part of a statement of the paper that can be answered by yes or no; each set of "
            "parameters is judged by all checks."
        ),
        tally(counts),
        section(
            "Checks",
            "checks",
            [picture(pictures[0], "Agreement", CAPTIONS["checks"]), _checks(judged, half, leading, default)],
        ),
        section("Best parameter sets", "best", [_best(leading)]),
        section(
            "Open parameters",
            "parameters",
            [
                paragraph(
                    f"Each check that agrees makes a parameter set {STATEMENT_ODDS:g} times as likely. "
                    f"{judged.quasi.sum()} quasi-random sets then count as {effective:.0f} of equal weight. "
                    "The checks say less than one bit of a factor "
                    "where its levels stay nearly as likely as they were drawn."
                ),
                picture(pictures[1], "Open parameters", CAPTIONS["parameters"]),
                _parameters(judged, half),
            ],
        ),
    ]
    whole: str = document(TITLE, parts)
    return whole


def _checks(judged: Judged, half: Judged, leading: Judged, default: np.ndarray) -> str:
    others = never_together(judged)
    rows: list[Sequence[str | Cell]] = []
    for at, check in enumerate(CHECKS):
        shares = (sets.agreeing[sets.quasi, at].mean() for sets in (judged, half))
        numbers = (*shares, judged.agreeing[~judged.quasi, at].mean(), default[at], leading.agreeing[0, at])
        cells = [Cell(f"{100.0 * share:.1f}", "tint", float(share)) for share in numbers]
        rows.append((check.key, check.says, *cells, ", ".join(others[check.key]) or "–"))
    head = (
        "",
        "The paper says",
        "all sets [%]",
        "first half",
        "near the best",
        "chosen before",
        "best",
        "never agrees together with",
    )
    return table(head, rows, tinted=True)


def _best(leading: Judged) -> str:
    rows: list[Sequence[str | Cell]] = [
        (
            Cell(f"{met:.2f}", "number"),
            choice_at(u).words,
            ", ".join(check.key for check, share in zip(CHECKS, shares, strict=True) if share < 0.5),
        )
        for met, u, shares in list(zip(leading.agreeing_count, leading.points, leading.agreeing, strict=True))[:SHOWN_SETS]
    ]
    return table(("checks that agree", "parameter set", "differs for most neighbours"), rows)


def _parameters(judged: Judged, half: Judged) -> str:
    rows: list[Sequence[str | Cell] | str] = []
    for at, factor in enumerate(FACTORS):
        bits, chance = information_by_factor(judged)[factor.name]
        rows.append(f"{factor.name}: {bits:.2f} bit, {chance:.2f} by chance; {factor.because}")
        first = level_shares(half, at)
        for name, (share, weight) in level_shares(judged, at).items():
            numbers = share, weight, first.get(name, (0.0, 0.0))[1]
            rows.append((name, *(Cell(f"{100.0 * number:.0f}", "number") for number in numbers)))
    return table(("", "drawn [%]", "given the checks [%]", "by the first half [%]"), rows)


def _csv(judged: Judged) -> str:
    """Return a CSV table with a row for each parameter set."""
    rows: list[tuple[object, ...]] = [
        ("parameter_set", "quasi_random", "agreeing", "seconds", *(check.key for check in CHECKS), "words")
    ]
    for at, u in enumerate(judged.points):
        shares = [f"{share:g}" for share in judged.agreeing[at]]
        rows.append(
            (
                at,
                int(judged.quasi[at]),
                f"{judged.agreeing_count[at]:g}",
                f"{judged.seconds[at]:.3f}",
                *shares,
                choice_at(u).words,
            )
        )
    return csv_text(rows)
