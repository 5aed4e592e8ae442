"""Simulate thousands of random valid mechanisms: each balances its energy or ends with a named cause."""

from __future__ import annotations

import collections
import dataclasses
import json
import math
import time
import warnings
from collections.abc import Iterable

import numpy as np
import xarray as xr

import scissordyn as sd
from benchmarks import random_cases
from benchmarks.kept import Kept
from benchmarks.measure import command, table
from benchmarks.random_cases import Case, random_case

__all__ = ["Outcome", "judge", "measure"]

CASES = 3000

MOST_STEPS = 100_000  # Step limit of a run; a rattling contact may need more, which is a named cause

BALANCED = 1e-6
"""Allowed residual of the energy balance, as a fraction of the energy that changes or is carried."""

CORRIDOR = 1e-3  # Residual above which a run must warn


@dataclasses.dataclass(frozen=True)
class Outcome:
    """Outcome of the run of a random mechanism.

    Parameters
    ----------
    seed : int
    verdict : str
        "balances", "warned", "refused", "failed" with a cause, or "FAULT".
    residual : float
        Residual of the energy balance, as a fraction of the largest energy; NaN without a run.
    reason : str
        Cause, refusal or fault.
    seconds : float
    contents : tuple of str
    """

    seed: int
    verdict: str
    residual: float
    reason: str
    seconds: float
    contents: tuple[str, ...]


def judge(seed: int) -> Outcome:
    """Make a random mechanism, simulate it and judge the result."""
    case, began = random_case(seed), time.perf_counter()
    verdict, residual, reason = _judged(case)
    return Outcome(seed, verdict, residual, reason, time.perf_counter() - began, case.contents)


def _judged(case: Case) -> tuple[str, float, str]:
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            run = sd.simulate(
                case.mechanism,
                until=case.until,
                start=case.start,
                samples=51,
                most_steps=MOST_STEPS,  # type: ignore[arg-type]
            )
    except sd.InputError as error:
        return "refused", math.nan, str(error)
    except Exception as error:  # every unexpected exception is a fault
        return "FAULT", math.nan, f"{type(error).__name__}: {error}"
    said = json.loads(run.attrs["warnings"])
    residual = _residual(run)
    missing = _not_finite(case.mechanism, run)
    if missing:
        return "FAULT", residual, f"not finite: {', '.join(missing)}"
    if run.attrs["status"] != "complete":
        cause = run.attrs["cause"]
        return ("failed", residual, cause) if cause else ("FAULT", residual, "failed without a cause")
    if residual <= BALANCED:
        return "balances", residual, ""
    if residual <= CORRIDOR or any("energy balance" in each for each in said):
        return "warned" if residual > CORRIDOR else "coarse", residual, ""
    return "FAULT", residual, "the energy balance does not close, without a warning"


ENERGIES = ("kinetic_energy", "potential_energy", "stored_energy", "elastic_energy", "drive_work", "motor_work", "load_work")


def _residual(run: xr.Dataset) -> float:
    names = [name for name in (*ENERGIES, "dissipated_energy") if name in run]
    largest = max(float(np.max(np.abs(run[name].values), initial=0.0)) for name in names)
    return float(np.max(np.abs(run["energy_residual"].values), initial=0.0)) / largest if largest > 0.0 else 0.0


ALWAYS = ("eccentricity", "indentation", "normal_force", "friction_force", "slip_speed")
"""Variables of clearance joints that are finite at all times; others are finite in contact only."""


def _not_finite(mechanism: sd.Mechanism, run: xr.Dataset) -> list[str]:
    """Return the variables with a value that is not finite where it should be."""
    found, undetermined = [], "not determined" in run.attrs["warnings"]
    loose = np.isin(run["joint"].values, [contact.name for contact in mechanism.contacts])
    for name, variable in run.data_vars.items():
        values = variable.values
        if values.dtype.kind != "f" or (name == "reaction" and undetermined):
            continue
        if name == "weld_peak_force_after_start":  # NaN in runs that do not start from concentric journals
            values = values[~np.isnan(values)]
        if "joint" in variable.dims and name != "reaction":
            if "time" not in variable.dims:  # a peak that some joints do not have
                values = values[loose & ~np.isnan(values)]
            elif name in ALWAYS or "in_contact" not in run:
                values = values[:, loose]
            else:
                touching = loose & run["in_contact"].values
                values = values[touching & ~np.all(np.isnan(values), axis=0)]
        if variable.dims[0] == "contact":  # a contact that has not ended
            values = values[~np.isnan(values)]
        if not np.all(np.isfinite(values)):
            found.append(str(name))
    return found


def measure(quick: bool = False) -> str:
    """Return the outcomes of the first mechanisms; an interrupted measurement continues."""
    kept = Kept("random_mechanisms", Outcome, __file__, random_cases.__file__)
    return _page(kept.complete(range(60 if quick else CASES), judge))


def _page(outcomes: list[Outcome]) -> str:
    count = len(outcomes)
    verdicts = collections.Counter(each.verdict for each in outcomes)
    residuals = np.array([each.residual for each in outcomes if each.verdict in ("balances", "coarse", "warned")])
    quantiles = ", ".join(f"{100 * q:g} %: {np.quantile(residuals, q):.1e}" for q in (0.5, 0.9, 0.99, 1.0)) if count else ""
    text = f"""{count} random mechanisms (`benchmarks/random_cases.py`): one to four bodies from 1 mm to 10 m and from 0.2 g to
5 t, with every law, component, time function and controller, simulated at the default tolerances with at most {MOST_STEPS}
steps.

| outcome | runs |
| --- | ---: |
| the energy balance closes within {BALANCED:g} of the largest energy | {verdicts["balances"]} |
| within {CORRIDOR:g} | {verdicts["coarse"]} |
| beyond, with a warning | {verdicts["warned"]} |
| refused, with the reason | {verdicts["refused"]} |
| ended early, with a named cause | {verdicts["failed"]} |
| faults: an exception, a value that is not finite, a silent imbalance | {verdicts["FAULT"]} |

Residual over the largest energy, quantiles: {quantiles}.

"""
    return (
        text
        + _list("Causes", _alike(outcomes, ("refused", "failed")))
        + _list("Faults", _faults(outcomes))
        + _contents(outcomes)
    )


def _alike(outcomes: list[Outcome], verdicts: tuple[str, ...]) -> list[str]:
    """Return reasons without names and numbers, the most frequent first."""
    found: collections.Counter[str] = collections.Counter()
    first: dict[str, int] = {}
    for each in outcomes:
        if each.verdict in verdicts:
            reason = " ".join("..." if any(c.isdigit() or c == "'" for c in word) else word for word in each.reason.split())
            short = f"{each.verdict}: {reason:.150}"
            found[short] += 1
            first.setdefault(short, each.seed)
    return [f"{number} x {reason} (first: {first[reason]})" for reason, number in found.most_common(25)]


def _faults(outcomes: list[Outcome]) -> list[str]:
    return [f"number {each.seed}: {each.reason:.200}" for each in outcomes if each.verdict == "FAULT"]


def _list(title: str, lines: Iterable[str]) -> str:
    listed = [f"- {line}" for line in lines]
    return f"{title}:\n\n" + "\n".join(listed) + "\n\n" if listed else ""


def _contents(outcomes: list[Outcome]) -> str:
    """Return how often each law, component, drive and controller was in a run that balanced."""
    total: collections.Counter[str] = collections.Counter()
    good: collections.Counter[str] = collections.Counter()
    for each in outcomes:
        total.update(set(each.contents))
        if each.verdict == "balances":
            good.update(set(each.contents))
    rows = [[name, str(number), str(good[name])] for name, number in sorted(total.items())]
    return "Contents:\n\n" + table(["part", "mechanisms", "that balance"], rows)


if __name__ == "__main__":
    command("random_mechanisms", measure)
