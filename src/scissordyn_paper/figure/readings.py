"""Figures of the readings: how often each statement is met, how many are met at once, and what that says of lost numbers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from scissordyn.plot.style import BLUE, GREEN, VERMILION, normal, panels
from scissordyn_paper.readings import Judged
from scissordyn_paper.statements import CLAUSES


def draw_statements(judged: Judged, default: np.ndarray, best: np.ndarray) -> Figure:
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
    return _finished(drawn, ("Each statement", "All statements of a reading"))


def draw_numbers(judged: Judged, told: Mapping[str, tuple[float, float]]) -> Figure:
    """How much the statements tell of each lost number, and how the largest number met grows with the readings."""
    left, right = drawn = panels(None, 1, 2, size=(11.0, 5.2), share=False)
    names = sorted(told, key=lambda name: -told[name][0])
    left.barh(names, [told[name][0] for name in names], color=BLUE, alpha=0.5, label="told by the statements")
    left.plot([told[name][1] for name in names], names, "|", color="0.3", ms=9.0, label="by chance alone")
    left.set(xlabel="information [bit]", ylim=(len(names) - 0.4, -0.6))
    count = 1 + np.arange(judged.met.size)
    right.plot(count, np.maximum.accumulate(judged.met), color=VERMILION, label="all readings")
    quasi = np.flatnonzero(judged.quasi)
    right.plot(count[quasi], np.maximum.accumulate(judged.met[quasi]), color=BLUE, label="quasi-random ones")
    right.set(xscale="log", xlabel="readings [1]", ylabel="largest number of statements met [1]")
    return _finished(drawn, ("Lost numbers", "Largest number so far"))


def _finished(drawn: Sequence[Axes], titles: Sequence[str]) -> Figure:
    for axes, title in zip(drawn, titles, strict=True):
        axes.set_title(title, loc="left", fontsize=normal())
        axes.legend(frameon=False, fontsize=normal() - 1.0, loc="center right" if axes is drawn[0] else "best")
    figure = drawn[0].get_figure(root=True)
    assert figure is not None
    return figure
