"""Compare the predictability horizon of 330 runs with the true one, found by two references that agree."""

from __future__ import annotations

import dataclasses
import json
import math
import textwrap

import numpy as np
import xarray as xr

import scissordyn as sd
from benchmarks import horizon_cases
from benchmarks.horizon_cases import KINDS, Case, horizon_case
from benchmarks.kept import Kept
from benchmarks.measure import command, table

__all__ = ["Judged", "judge", "measure"]

CASES = 30  # Number of cases of each kind
SAMPLES = 20_001  # Instants at which runs are compared with references, at most 5e-5 of the run apart
REFERENCES = (1e-13, 1e-12)  # Tolerances of the two references, at most 1e-4 of the tolerance of a run
AGREE = 0.01  # Allowed difference of the two references, as a fraction of the true horizon
LATE, EARLY = 0.05, 0.1  # Allowed errors of a horizon, as fractions of the true one


@dataclasses.dataclass(frozen=True)
class Judged:
    """Reported and true horizon of a run.

    Parameters
    ----------
    kind : str
    number : int
    found : str
        "diverged", "to the end" or "unknown".
    said, true : float
        Reported and true horizon [s]; the end of the run without divergence, NaN if unknown.
    end : float
        End of the run [s].
    cost : float
        Steps of both runs divided by those of one.
    rtol : float
    method : str
    reason : str
        Reason for an unknown horizon.
    """

    kind: str
    number: int
    found: str
    said: float
    true: float
    end: float
    cost: float
    rtol: float
    method: str
    reason: str = ""

    @property
    def late(self) -> float:
        """Return the lateness of the horizon as a fraction of the true one; negative if early."""
        return self.said / self.true - 1.0

    @property
    def has_horizon(self) -> bool:
        """Return whether the reported or true horizon is before the end."""
        return min(self.said, self.true) < self.end


def judge(kind: str, number: int, samples: int = SAMPLES) -> Judged:
    """Run a case with its horizon, and compute the true horizon from the variables of two references at equal instants."""
    case = horizon_case(kind, number)
    run = simulated(case, case.rtol, "auto", samples, trust=True)
    attributes, method = run.attrs, json.loads(run.attrs["statistics"])["method"]
    found, _, reason = attributes["predictability"].partition(": ")
    said = attributes.get("trusted_until", math.nan) if found != "unknown" else math.nan
    true = math.nan
    if attributes["status"] != "complete":
        reason = attributes["cause"]
    else:
        first, second = (simulated(case, rtol, method, samples) for rtol in REFERENCES)
        true, again = (first_apart(case.mechanism, run, each) for each in (first, second))
        if first.attrs["status"] != "complete" or not abs(again - true) <= AGREE * true:
            true, reason = math.nan, f"by the references {true:.4g} s and {again:.4g} s"
    cost = attributes.get("predictability_cost", math.nan)
    return Judged(kind, number, found, said, true, case.until, cost, case.rtol, method, reason)


def simulated(case: Case, rtol: float, method: str, samples: int = SAMPLES, *, trust: bool = False) -> xr.Dataset:
    return sd.simulate(case.mechanism, until=case.until, samples=samples, rtol=rtol, atol=rtol, method=method, trust=trust)


def first_apart(mechanism: sd.Mechanism, one: xr.Dataset, other: xr.Dataset) -> float:
    """Return the first instant at which two runs diverge, or the last instant [s]."""
    count = min(one.sizes["time"], other.sizes["time"])
    one, other = one.isel(time=slice(count)), other.isel(time=slice(count))
    apart = np.max([_distance(one, other, body) for body in mechanism.bodies], axis=0) / (0.01 * mechanism.size)
    for joint in mechanism.contacts:
        assert joint.clearance is not None
        difference = (one["eccentricity"] - other["eccentricity"]).sel(joint=joint.name).values
        apart = np.maximum(apart, np.hypot(difference[:, 0], difference[:, 1]) / (0.1 * joint.clearance.clearance))
    beyond = np.flatnonzero(~(apart < 1.0))
    return float(one["time"][beyond[0] if beyond.size else -1])


def _distance(one: xr.Dataset, other: xr.Dataset, body: sd.Body) -> np.ndarray:
    """Return the largest distance of a body's points and mass centre in two runs, shape (nt,) [m]."""

    def places(run: xr.Dataset) -> np.ndarray:
        own = run.sel(body=body.name)
        arms = np.array([(0.0, 0.0), *(np.subtract(point, body.centre) for point in body.points.values())])
        cos, sin = np.cos(own["angle"].values)[:, None], np.sin(own["angle"].values)[:, None]
        turned = np.stack([cos * arms[:, 0] - sin * arms[:, 1], sin * arms[:, 0] + cos * arms[:, 1]], axis=-1)
        return np.asarray(own["position"].values[:, None, :] + turned)

    return np.asarray(np.max(np.linalg.norm(places(one) - places(other), axis=-1), axis=1))


def measure(quick: bool = False) -> str:
    """Return the page of all kinds; an interrupted measurement continues."""
    kept, numbers = Kept("horizon", Judged, __file__, horizon_cases.__file__), range(2 if quick else CASES)
    return _page(kept.complete(((kind, number) for number in numbers for kind in KINDS), lambda key: judge(*key)))


def _page(judged: list[Judged]) -> str:
    rows = [_row(kind, [each for each in judged if each.kind == kind]) for kind in KINDS]
    rows.append(_row("all", judged))
    head = ["kind", "cases", "known", "with a horizon", "latest", "earliest", "median", "cost, median", "cost, largest"]
    worst = sorted((each for each in judged if _known(each) and each.has_horizon), key=lambda each: -abs(each.late))[:5]
    lines = [
        f"- {each.kind}, number {each.number} at {each.rtol:g}: says {each.said:.6g} s, true {each.true:.6g} s"
        for each in worst
    ]
    unknown = [
        f"- {each.kind}, number {each.number}: {each.found}; {textwrap.shorten(each.reason, 90)}"
        for each in judged
        if not _known(each)
    ]
    late = sum(_known(each) and each.late > LATE for each in judged)
    early = sum(_known(each) and each.late < -EARLY for each in judged)
    text = f"""{len(judged)} runs of eleven kinds (`benchmarks/horizon_cases.py`), half of them at the default tolerance of
1e-8, the others at 1e-6. True horizon: the first of {SAMPLES} instants at which the run differs by the same criterion
(a journal by 0.1 of its clearance, a point of a body by 0.01 of the mechanism's size) from a reference at
{REFERENCES[0]:g}, if one at {REFERENCES[1]:g} gives the same within {AGREE:g} of it. Errors are those of the horizon that a run
reports, relative to the true one; the end of the run stands for none. Cost: steps of both runs over those of one.

More than {100 * LATE:g} % late: {late}. More than {100 * EARLY:g} % early: {early}.

"""
    return (
        text
        + table(head, rows)
        + "\nLargest errors:\n\n"
        + "\n".join(lines)
        + ("\n\nNot known:\n\n" + "\n".join(unknown) if unknown else "")
        + "\n"
    )


def _known(each: Judged) -> bool:
    return math.isfinite(each.said) and math.isfinite(each.true)


def _row(name: str, judged: list[Judged]) -> list[str]:
    known = [each for each in judged if _known(each)]
    late = [100.0 * each.late for each in known if each.has_horizon]
    cost = [each.cost for each in known]
    figures = [f"{max(late):+.2f} %", f"{min(late):+.2f} %", f"{np.median(late):+.3f} %"] if late else ["-"] * 3
    costs = [f"{np.median(cost):.2f}", f"{max(cost):.2f}"] if cost else ["-"] * 2
    return [name, str(len(judged)), str(len(known)), str(len(late)), *figures, *costs]


if __name__ == "__main__":
    command("horizon", measure)
