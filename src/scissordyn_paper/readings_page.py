"""The page of the readings: how many statements any of them meets, and what that says of lost numbers."""

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
from scissordyn_paper.readings import FACTORS, NEIGHBOURS, NUMBER, SEED, Judged, fetch_leading, fetch_readings, read
from scissordyn_paper.report import DOI, SOURCE
from scissordyn_paper.statements import CLAUSES

TITLE = "The paper, read best: parameters whose tables are lost"

ODDS = 3.0  # A reading that meets one statement more than another is taken as so many times as likely

SHOWN = 5


@dataclass(frozen=True)
class ReadingAnswers:
    """The result."""

    judged: Judged
    leading: Judged  # The best of them by many neighbours, best first
    report: Path  # The page in HTML


def answer_readings(
    folder: Path, number: int = NUMBER, *, engine: Engine = None, progress: Progress | None = None
) -> ReadingAnswers:
    """Judge what is missing, and write page, table and pictures."""
    folder.mkdir(parents=True, exist_ok=True)
    judged = fetch_readings(folder / "readings", number, engine=engine, progress=progress)
    leading = fetch_leading(judged, folder / "readings", engine=engine, progress=progress)
    default = agreeing(DEFAULT, range(NEIGHBOURS))
    figures = (
        ("statements", _draw_statements(judged, default, leading.agreeing[0])),
        ("numbers", _draw_numbers(judged, told(judged))),
    )
    pictures = [save_picture(drawn, folder / "figures", f"readings-{name}") for name, drawn in figures]
    write_file(folder / "readings.csv", _csv(judged).encode(), sample="-o paper")
    page = _page(judged, leading, default, pictures)
    return ReadingAnswers(judged, leading, write_file(folder / "readings.html", page.encode(), sample="-o paper"))


def weights(judged: Judged) -> np.ndarray:
    """Weights of the quasi-random readings, of sum one: `ODDS` to the power of the statements met."""
    weight = ODDS ** (judged.met[judged.quasi] - judged.met[judged.quasi].max())
    return np.asarray(weight / weight.sum())


def levels(judged: Judged, factor: int) -> dict[str, tuple[float, float]]:
    """Share of the quasi-random readings with each level of a factor, and their share of the weight."""
    names = np.array([FACTORS[factor].level(u) for u in judged.points[judged.quasi, factor]])
    weight = weights(judged)
    order = sorted(set(names.tolist()), key=lambda name: float(judged.points[judged.quasi, factor][names == name].min()))
    return {name: (float(np.mean(names == name)), float(weight[names == name].sum())) for name in order}


def told(judged: Judged) -> dict[str, tuple[float, float]]:
    """Information of the weights over the shares by factor, and what so few effective readings have by chance [bit]."""
    effective = 1.0 / float(np.sum(weights(judged) ** 2))
    information = {}
    for at, factor in enumerate(FACTORS):
        pairs = [pair for pair in levels(judged, at).values() if pair[1] > 0.0]
        bits = sum(weight * np.log2(weight / share) for share, weight in pairs)
        information[factor.name] = float(bits), (len(levels(judged, at)) - 1) / (2.0 * np.log(2.0) * effective)
    return information


def excluded(judged: Judged) -> dict[str, list[str]]:
    """Statements that no reading meets together, though five would if they were independent, by the first of each pair."""
    met = judged.agreeing >= 0.5
    together, alone = met.T.astype(float) @ met, met.mean(axis=0)
    expected = met.shape[0] * np.outer(alone, alone)
    keys = [clause.key for clause in CLAUSES]
    return {
        key: [keys[j] for j in range(len(keys)) if together[i, j] == 0.0 and expected[i, j] >= 5.0]
        for i, key in enumerate(keys)
    }


def _draw_statements(judged: Judged, default: np.ndarray, best: np.ndarray) -> Figure:
    """The share of readings that meet each statement, and how many each reading meets."""
    left, right = drawn = panels(None, 1, 2, size=(11.0, 6.2), share=False)
    places, keys = np.arange(len(CLAUSES)), [clause.key for clause in CLAUSES]
    left.barh(places, judged.agreeing[judged.quasi].mean(axis=0), color=BLUE, alpha=0.5, label="share of quasi-random readings")
    left.plot(default, places, "o", color=GREEN, ms=6.0, mfc="none", label="chosen before")
    left.plot(best, places, "x", color=VERMILION, ms=6.0, label="best, chosen afterwards")
    left.set(xlim=(-0.03, 1.03), ylim=(len(CLAUSES) - 0.4, -0.6), yticks=places, yticklabels=keys, xlabel="share [1]")
    bins = [count - 0.5 for count in range(len(CLAUSES) + 2)]
    for kind, colour, label in ((judged.quasi, BLUE, "quasi-random"), (~judged.quasi, VERMILION, "near the best so far")):
        right.hist(judged.met[kind], bins, histtype="stepfilled", alpha=0.5, color=colour, label=label)
    right.set(xlabel="statements met [1]", ylabel="readings [1]", xlim=(-0.5, len(CLAUSES) + 0.5))
    right.axvline(default.sum(), color=GREEN, lw=1.2, label="chosen before")
    return _titled(drawn, ("Each statement", "All statements of a reading"))


def _draw_numbers(judged: Judged, information: Mapping[str, tuple[float, float]]) -> Figure:
    """Draw the information of the statements on each lost number, and the largest count met over the number of readings."""
    left, right = drawn = panels(None, 1, 2, size=(11.0, 5.2), share=False)
    names = sorted(information, key=lambda name: -information[name][0])
    left.barh(names, [information[name][0] for name in names], color=BLUE, alpha=0.5, label="told by the statements")
    left.plot([information[name][1] for name in names], names, "|", color="0.3", ms=9.0, label="by chance alone")
    left.set(xlabel="information [bit]", ylim=(len(names) - 0.4, -0.6))
    count = 1 + np.arange(judged.met.size)
    right.plot(count, np.maximum.accumulate(judged.met), color=VERMILION, label="all readings")
    quasi = np.flatnonzero(judged.quasi)
    right.plot(count[quasi], np.maximum.accumulate(judged.met[quasi]), color=BLUE, label="quasi-random ones")
    right.set(xscale="log", xlabel="readings [1]", ylabel="largest number of statements met [1]")
    return _titled(drawn, ("Lost numbers", "Largest number so far"))


def _titled(drawn: Sequence[Axes], titles: Sequence[str]) -> Figure:
    for axes, title in zip(drawn, titles, strict=True):
        axes.set_title(title, loc="left", fontsize=normal())
        axes.legend(frameon=False, fontsize=normal() - 1.0, loc="center right" if axes is drawn[0] else "best")
    figure = drawn[0].get_figure(root=True)
    assert figure is not None
    return figure


def _page(judged: Judged, leading: Judged, default: np.ndarray, pictures: Sequence[Sequence[Path]]) -> str:
    half = judged.part(judged.met.size // 2)
    effective = 1.0 / float(np.sum(weights(judged) ** 2))
    counts = [
        (f"{leading.met[0]:.3g} of {len(CLAUSES)}", f"statements are met by the best reading, over {NEIGHBOURS} neighbours"),
        (f"{default.sum():.3g} of {len(CLAUSES)}", "by the one chosen before looking"),
        (f"{judged.met.size}", f"readings, {judged.seconds.mean():.2g} s of one processor each, seed {SEED}"),
    ]
    parts = [
        cited(TITLE, f"Of: {SOURCE}", DOI),
        tally(counts),
        section("Statements", "statements", [picture(pictures[0], "", ""), _statements(judged, half, leading, default)]),
        section("Best readings", "best", [_best(leading)]),
        section(
            "Lost numbers",
            "numbers",
            [
                paragraph(
                    f"Each statement that a reading meets makes it {ODDS:g} times as likely. {judged.quasi.sum()} quasi-random "
                    f"readings count as {effective:.0f} of equal weight then. The statements say less than one bit of a factor "
                    "where its levels stay nearly as likely as they were drawn."
                ),
                picture(pictures[1], "", ""),
                _numbers(judged, half),
            ],
        ),
    ]
    whole: str = document(TITLE, parts)
    return whole


def _statements(judged: Judged, half: Judged, leading: Judged, default: np.ndarray) -> str:
    others = excluded(judged)
    rows: list[Sequence[str | Cell]] = []
    for at, clause in enumerate(CLAUSES):
        shares = (readings.agreeing[readings.quasi, at].mean() for readings in (judged, half))
        numbers = (*shares, judged.agreeing[~judged.quasi, at].mean(), default[at], leading.agreeing[0, at])
        cells = [Cell(f"{100.0 * share:.1f}", "tint", float(share)) for share in numbers]
        rows.append((clause.key, clause.says, *cells, ", ".join(others[clause.key]) or "–"))
    head = ("", "The paper says", "readings [%]", "first half", "near the best", "chosen before", "best", "never together with")
    return table(head, rows, tinted=True)


def _best(leading: Judged) -> str:
    rows: list[Sequence[str | Cell]] = [
        (
            Cell(f"{met:.2f}", "number"),
            read(u).words,
            ", ".join(clause.key for clause, share in zip(CLAUSES, shares, strict=True) if share < 0.5),
        )
        for met, u, shares in list(zip(leading.met, leading.points, leading.agreeing, strict=True))[:SHOWN]
    ]
    return table(("met", "reading", "not met by most neighbours"), rows)


def _numbers(judged: Judged, half: Judged) -> str:
    rows: list[Sequence[str | Cell] | str] = []
    for at, factor in enumerate(FACTORS):
        bits, chance = told(judged)[factor.name]
        rows.append(f"{factor.name}: {bits:.2f} bit, {chance:.2f} by chance; {factor.because}")
        first = levels(half, at)
        for name, (share, weight) in levels(judged, at).items():
            numbers = share, weight, first.get(name, (0.0, 0.0))[1]
            rows.append((name, *(Cell(f"{100.0 * number:.0f}", "number") for number in numbers)))
    return table(("", "drawn [%]", "given the statements [%]", "by the first half [%]"), rows)


def _csv(judged: Judged) -> str:
    """Every reading."""
    rows: list[tuple[object, ...]] = [
        ("reading", "quasi_random", "met", "seconds", *(clause.key for clause in CLAUSES), "words")
    ]
    for at, u in enumerate(judged.points):
        shares = [f"{share:g}" for share in judged.agreeing[at]]
        rows.append((at, int(judged.quasi[at]), f"{judged.met[at]:g}", f"{judged.seconds[at]:.3f}", *shares, read(u).words))
    return csv_text(rows)
