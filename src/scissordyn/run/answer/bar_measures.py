"""Measures of bars that bend, which no loop accumulates: they are those of equally spaced samples."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from scissordyn.errors import InputError, ScissordynError
from scissordyn.mechanics.outputs import record
from scissordyn.model.mechanism import Mechanism
from scissordyn.run.advance.driver import Driver
from scissordyn.run.advance.trajectory import reached
from scissordyn.run.answer.dataset import largest_along_bars
from scissordyn.run.answer.internal_forces import bars_of

if TYPE_CHECKING:
    from scissordyn.run.answer.measure import Measure

NEEDED = {"peak_bar_stress": "youngs_modulus", "peak_utilisation": "yield_strength"}
"""What bars have to know for a measure."""


def check_bars(mechanism: Mechanism, measures: Mapping[str, Measure]) -> None:
    """Raise `InputError` for a measure of bars that bend where none does, or where one lacks a number."""
    bars = bars_of(mechanism)
    for name in (name for name, measure in measures.items() if measure.dims == ("bar",)):
        if not bars:
            raise InputError(f"measure '{name}' of a mechanism without bars that bend", "bars that bend", "with_bending(...)")
        needed = NEEDED.get(name, "")
        lacking = [bar.name for bar in bars if needed and not all(getattr(part, needed) for part in bar.parts)]
        if lacking:
            raise InputError(
                f"measure '{name}': bar '{lacking[0]}' has no {needed}", f"a {needed} of every bar", f"{needed} = ..."
            )


def along_bars(driver: Driver) -> dict[str, np.ndarray]:
    """Sizes of the largest values along bars that bend, among the samples of a driver, each of shape (bars,)."""
    state = driver.system.content.state
    before = [part.copy() for part in state]
    path = reached(driver)
    found = record(path.plan.maps, path.system, path.samples)
    for part, kept in zip(state, before, strict=True):
        part[...] = kept
    undefined = np.flatnonzero(~np.all(np.isfinite(found.A), axis=1))
    if undefined.size:
        raise ScissordynError(f"stopped at t = {path.samples.time[undefined[0]]:.9g} s: accelerations are not defined")
    return {name: np.abs(each.values) for name, each in largest_along_bars(path, found).items() if name != "bar"}
