"""Measures of bars that bend, which no loop accumulates: each case is simulated once more, for its samples."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np

from scissordyn.errors import InputError
from scissordyn.model.mechanism import Mechanism
from scissordyn.run.internal_forces import bars_of
from scissordyn.run.interrupt import look, pass_on
from scissordyn.run.measure import Measure
from scissordyn.run.options import Options
from scissordyn.run.simulate import simulate

__all__ = ["check_bars", "of_samples"]

NEEDED = {"bar_largest_stress": "youngs_modulus", "bar_largest_utilisation": "yield_strength"}
"""What bars have to know for a variable of a run."""


def check_bars(mechanism: Mechanism, measures: Mapping[str, Measure], *, several: bool) -> None:
    """Raise `InputError` for a measure of bars that bend where none does, where one lacks a number, or of several members."""
    bars = bars_of(mechanism)
    for name, measure in measures.items():
        if not measure.samples:
            continue
        if several:
            raise InputError(f"measure '{name}' of several members", "a measure of the loop, or members = 0 alone")
        if not bars:
            raise InputError(f"measure '{name}' of a mechanism without bars that bend", "bars that bend", "with_bending(...)")
        needed = NEEDED.get(measure.samples, "")
        lacking = [bar.name for bar in bars if needed and not all(getattr(part, needed) for part in bar.parts)]
        if lacking:
            raise InputError(
                f"measure '{name}': bar '{lacking[0]}' has no {needed}", f"a {needed} of every bar", f"{needed} = ..."
            )


def of_samples(mechanism: Mechanism, options: Options, variables: Iterable[str]) -> dict[str, np.ndarray]:
    """Sizes of variables of a run, each of shape (bars,).

    Parameters
    ----------
    mechanism : Mechanism
    options : Options
    variables : iterable of str
    """
    look()
    run = pass_on(simulate(mechanism, **{**options.keywords, "trust": False}))
    return {name: np.abs(run[name].values) for name in variables}
