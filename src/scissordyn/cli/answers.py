"""What a study says, in the terminal."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import xarray as xr
from rich import box
from rich.table import Table

from scissordyn.cli.show import console
from scissordyn.errors import printable

if TYPE_CHECKING:
    from collections.abc import Sequence

    from scissordyn.study.answer import Share
    from scissordyn.study.description import Study

__all__ = ["show_answers", "show_causes", "show_warnings"]

ROWS = 12
"""Points of a front or of a table that are shown."""


def show_answers(study: Study, results: xr.Dataset, address: str) -> None:
    """Print counts, shares, sensitivity, the best points and the worst cases.

    Parameters
    ----------
    study : Study
    results : Dataset
        From `Store.results`.
    address : str
        Of the store.
    """
    from scissordyn.study.answer import by_point, counts, feasible_share

    complete, failed, pending = counts(results)
    print(f"{complete} cases complete, {failed} failed, {pending} pending; {study.points} points")
    points = by_point(study, results)
    if study.requirements:
        _shares(feasible_share(study, results), study)
    _responses(points)
    if study.members > 1:
        share, undecided = float(points["disagrees"].mean()), float(points["undecided"].mean())
        print(f"Members disagree at {share:.1%} of the points (chaotic motion); whether all requirements are met depends on")
        print(f"round-off at {undecided:.1%} of them.")
    _indices(study, results)
    _front(study, results)
    _worst(study, results, address)
    show_causes(results, address)
    show_warnings(results, address)


def _shares(shares: Sequence[Share], study: Study) -> None:
    table = Table("requirement", "met by", "95 % interval", "trials", box=box.SIMPLE)
    for one in shares:
        low, high = one.low, one.high
        interval = "no sample" if np.isnan(low) else f"{low:.1%} to {high:.1%}"
        table.add_row(one.label, f"{one.share:.1%}", interval, str(one.trials))
    console().print(table)


def _responses(points: xr.Dataset) -> None:
    table = Table("response", "smallest", "median", "largest", "unit", box=box.SIMPLE)
    for name, variable in points.data_vars.items():
        if variable.attrs.get("role") == "response" and bool(np.isfinite(variable.values).any()):
            low, middle, high = np.nanquantile(variable.values, [0.0, 0.5, 1.0])
            table.add_row(str(name), f"{low:.4g}", f"{middle:.4g}", f"{high:.4g}", variable.attrs["units"])
    console().print(table)


def _indices(study: Study, results: xr.Dataset) -> None:
    from scissordyn.study.indices import sensitivity

    found, left_out = sensitivity(study, results)
    for name, indices in found.items():
        morris = indices.attrs["method"] == "morris"
        heads = ("mean effect", "deviation") if morris else ("first order", "total")
        table = Table(f"{name} depends on", *heads, box=box.SIMPLE)
        for factor in indices["factor"].values:
            row = indices.sel(factor=factor)
            if morris:
                texts = [f"{float(row['effect']):.3g} ± {float(row['effect_interval']):.2g}", f"{float(row['deviation']):.3g}"]
            else:
                texts = [f"{float(row[key]):.3f} ± {float(row[key + '_interval']):.3f}" for key in ("first", "total")]
            table.add_row(str(factor), *texts)
        console().print(table)
        if indices.attrs["left_out"]:
            print(f"{indices.attrs['left_out']} base points with failed cases are left out")
    for name, why in left_out.items():
        print(f"No indices of {name}: {printable(why)}")


def _front(study: Study, results: xr.Dataset) -> None:
    if study.optimisation is None:
        return
    from scissordyn.study.optimise import candidates

    found = candidates(study, results)
    rows = np.flatnonzero(found.points["front"].values) if found.best < 0 else np.array([found.best])
    names = [factor.address for factor in study.factors] + [goal.label for goal in study.optimisation.goals]
    table = Table("point", *(f"{name} [{found.points[name].attrs.get('units', '1')}]" for name in names), box=box.SIMPLE)
    goals = {goal.label: -1.0 if goal.maximise else 1.0 for goal in study.optimisation.goals}
    for row in rows[:ROWS]:
        table.add_row(str(row), *(f"{goals.get(name, 1.0) * float(found.points[name][row]):.6g}" for name in names))
    what = "Pareto front" if found.best < 0 else "Best point"
    print(f"{what} ({study.optimisation.risk}), {found.points.sizes['point']} points tried")
    console().print(table)
    if len(rows) > ROWS:
        print(f"{len(rows) - ROWS} more points of the front are in the store")
    if found.best >= 0 and float(found.points["violation"][found.best]) > 0.0:
        print("No point meets all requirements; this is the one that violates them least")


def _worst(study: Study, results: xr.Dataset, address: str) -> None:
    from scissordyn.study.answer import replay_command, worst_cases

    for one in worst_cases(study, results, 3):
        what, place = ("Worst", "beyond") if one.margin < 0.0 else ("Nearest", "from")
        print(f"{what} for {one.requirement}: {one.value:.4g} ({abs(one.margin):.1%} {place} the bound)")
        print(f"  {replay_command(address, one.case)}")


def show_warnings(results: xr.Dataset, address: str) -> None:
    """Print the warnings, each with the number of its cases and a command that shows one.

    Parameters
    ----------
    results : Dataset
    address : str
        Of the store.
    """
    from scissordyn.study.answer import replay_command, warned

    for text, cases in list(warned(results).items())[:ROWS]:
        print(f"Warning in {len(cases)} {'case' if len(cases) == 1 else 'cases'}, as in: {printable(text)}")
        print(f"  {replay_command(address, cases[0])}")


def show_causes(results: xr.Dataset, address: str) -> None:
    """Print the failed cases by cause, each with a command that shows one.

    Parameters
    ----------
    results : Dataset
    address : str
        Of the store.
    """
    from scissordyn.study.answer import causes, replay_command

    for cause, cases in list(causes(results).items())[:ROWS]:
        print(f"{len(cases)} failed: {printable(cause)}")
        print(f"  {replay_command(address, cases[0])}")
