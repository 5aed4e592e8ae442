"""Consensus of the verdicts on an ensemble of runs."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import xarray as xr

from scissordyn.analysis.variable import described
from scissordyn.analysis.verdict import Kind, Verdict
from scissordyn.errors import InputError


@dataclass(frozen=True)
class Consensus:
    """The most frequent verdict of an ensemble, and the differences of the others.

    Parameters
    ----------
    kind : str
        As of `Verdict`.
    period : int or None
        As of `Verdict`.
    fraction : float
        Of the members that have this kind and period.
    counts : mapping of str to int
        Number of members with each verdict, most frequent first.
    measures : Dataset
        `mean`, `deviation` (standard deviation), `least`, `largest` and `members` (how many have it) along `measure`.
    evidence : tuple of str
        Sentences with the numbers.
    """

    kind: Kind
    period: int | None
    fraction: float
    counts: Mapping[str, int]
    measures: xr.Dataset
    evidence: tuple[str, ...]


def consensus(verdicts: Sequence[Verdict]) -> Consensus:
    """Consensus of the verdicts on an ensemble.

    The members are runs of one case whose starts differ by round-off. After their trajectories diverge, common results are a
    property of the motion, and different results are random.

    Parameters
    ----------
    verdicts : sequence of Verdict
        At least two.

    Returns
    -------
    Consensus

    Raises
    ------
    InputError
        If there are fewer than two.
    """
    if len(verdicts) < 2:
        raise InputError(
            f"an ensemble of {len(verdicts)}", "at least two verdicts", "consensus([classify(run) for run in runs])"
        )
    counts = Counter((verdict.kind, verdict.period) for verdict in verdicts).most_common()
    (kind, period), most = counts[0]
    names = {pair: next(v.name for v in verdicts if (v.kind, v.period) == pair) for pair, _ in counts}
    measured: dict[str, list[float]] = {}
    for verdict in verdicts:
        for name, value in verdict.measures.items():
            if np.isfinite(value):
                measured.setdefault(name, []).append(value)
    count = len(verdicts)
    evidence = ["; ".join(f"{number} of {count} members: {names[pair]}" for pair, number in counts) + "."]
    if len(counts) > 1 and counts[1][1] == most:
        evidence.append("The most frequent verdicts are equally frequent: the ensemble is undecided.")
    evidence += [
        f"{name}: {np.mean(values):.4g} ± {np.std(values, ddof=1):.2g}, from {min(values):.4g} to {max(values):.4g}."
        for name, values in measured.items()
        if len(values) > 1 and min(values) < max(values)
    ]
    table: dict[str, list[float]] = {
        "mean": [float(np.mean(values)) for values in measured.values()],
        "deviation": [float(np.std(values, ddof=1)) if len(values) > 1 else np.nan for values in measured.values()],
        "least": [min(values) for values in measured.values()],
        "largest": [max(values) for values in measured.values()],
        "members": [len(values) for values in measured.values()],
    }
    texts = {
        "mean": "mean over the members",
        "deviation": "standard deviation over the members",
        "least": "least of the members",
        "largest": "largest of the members",
        "members": "members with this measure",
    }
    return Consensus(
        kind=kind,
        period=period,
        fraction=most / count,
        counts={names[pair]: number for pair, number in counts},
        measures=xr.Dataset(
            {
                name: described(("measure",), values, "1" if name == "members" else "of the measure", texts[name])
                for name, values in table.items()
            },
            coords={"measure": list(measured)},
        ),
        evidence=tuple(evidence),
    )
