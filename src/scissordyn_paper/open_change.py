"""Effect of bars that bend, or of oil, on one measure: the pairs of runs that differ in nothing else."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from scissordyn_paper.open_question import Manoeuvre

CLEAR_SHARE_MIN = 0.95  # Smallest share of pairs with a lower measure for the answer "yes", or of the other pairs for "no"
NOTICED_FRACTION = 0.01  # Relative difference below which a value does not count as lower


@dataclass(frozen=True)
class Change:
    """Effect on one measure if bars are flexible, the joint has oil, or both."""

    manoeuvre: Manoeuvre
    what: str  # The change in words
    measure: str  # A key of `COMPARED`
    # The measure with the change and without it, for each pair of runs that have all else in common
    pairs: tuple[tuple[float, float], ...]

    @property
    def ratios(self) -> tuple[float, ...]:
        """Ratios of the measure with the change to that without it, for pairs in which the latter is positive."""
        return tuple(changed / before for changed, before in self.pairs if before > 0.0)

    @property
    def lower(self) -> float:
        """Fraction of the pairs in which the change reduces the measure by more than `NOTICED_FRACTION`."""
        return float(np.mean([before - changed > NOTICED_FRACTION * abs(before) for changed, before in self.pairs]))

    @property
    def answer(self) -> str:
        """Answer whether the change reduces the measure: "yes", "no" or "depends"."""
        return "yes" if self.lower >= CLEAR_SHARE_MIN else "no" if self.lower <= 1.0 - CLEAR_SHARE_MIN else "depends"

    @property
    def words(self) -> str:
        """Text with median and range of the ratios, and the number of pairs with a lower measure."""
        if not self.ratios:
            return "no ratio"
        low, high, middle = min(self.ratios), max(self.ratios), float(np.median(self.ratios))
        fewer = round(self.lower * len(self.pairs))
        return f"{middle:.3g} ({low:.3g} to {high:.3g}), lower in {fewer} of {len(self.pairs)}"
