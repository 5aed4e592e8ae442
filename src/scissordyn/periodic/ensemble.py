"""Ensembles: runs of one case whose starts differ by round-off, to measure how long a periodic run is predictable."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable
from typing import Annotated

import numpy as np
import xarray as xr

from scissordyn.casefile.configuration import write_configuration
from scissordyn.errors import InputError, whole_number
from scissordyn.kinematics.branching import drive_warnings
from scissordyn.model.mechanism import Mechanism
from scissordyn.model.options import Options, StartKind
from scissordyn.periodic.rows import CYCLE_COLUMNS, CycleCase, empty_rows, run_case, store_cycles
from scissordyn.periodic.stroboscope import CYCLE_VARIABLES, make_consistent, start_state
from scissordyn.plan.plan import plan
from scissordyn.plan.system import make_system
from scissordyn.run.advance.driver import Snapshot
from scissordyn.run.engine import ENGINES, Engine, outcomes
from scissordyn.run.stops import drive_period
from scissordyn.studies.answer.grouped import grouped_lines
from scissordyn.units import Meaning, checked


@checked
def ensemble(
    mechanism: Mechanism,
    *,
    members: int,
    cycles: int,
    period: float | None = None,
    phase: float = 0.0,
    perturbation: float = 1e-14,
    seed: int = 0,
    skip: int = 0,
    agreement: float = 1e-3,
    start: StartKind = "concentric",
    rtol: float = 1e-6,
    atol: float | None = None,
    method: str = "auto",
    most_steps: int = 1_000_000,
    engine: Annotated[Engine, Meaning(ENGINES, "engine=2")] = None,
    progress: Callable[[int, int], None] | None = None,
) -> xr.Dataset:
    """Run a mechanism many times, from starts that differ by round-off.

    Every entry y of a member's state starts as y (1 + p g), with g from a normal distribution; member 0 is not perturbed. Two
    members agree in a cycle if their journals are within a fraction of the clearance of each other at all clearance joints. The
    fraction must be small: if the reaction presses the journal to the same side in every cycle, even unrelated members are
    close.

    Parameters
    ----------
    mechanism : Mechanism
        Mechanism with a clearance joint.
    members, cycles : int
        Number of members, at least 2, and number of cycles.
    period : float, optional
        Period [s]; by default the period of the drive.
    phase : float
        Phase of the samples in the cycle, in [0, 1).
    perturbation : float
        p, the relative size of the perturbation, from 1e-16 to 1e-6.
    seed : int
        Seed of the perturbations; the same seed gives the same ensemble with any engine.
    skip : int
        Number of cycles at the start that are left out of means.
    agreement : float
        Largest distance of agreeing members, as a fraction of the clearance.
    start, rtol, atol, method, most_steps
        As for `cycle`.
    engine : Executor or int, optional
        As for `bifurcation`.
    progress : callable, optional
        Called after each member with the number of finished members and the total.

    Returns
    -------
    Dataset
        Every variable of `cycle` along (member, cycle), NaN after a member has failed. For each numeric variable: `mean_...`
        along member, the mean over its counted cycles, and `spread_...`, the standard deviation of these means.
        `agreeing(cycle)` is the fraction of members that agree with member 0. `divergence_cycle(member)` is the first cycle in
        which a member differs from member 0, or the number of cycles. `status(member)` and `cause(member)`. Attributes:
        trusted_cycles and trusted_until [s], before which all members agree, and warnings.
    """
    _check(mechanism, members, cycles, skip, perturbation, agreement)
    period = drive_period(mechanism) if period is None else period
    options = Options(period, start, 2, rtol, atol, method, most_steps)
    starts = enumerate(_make_starts(mechanism, start, members, perturbation, seed))
    cases = [CycleCase(at, mechanism, options, cycles, cycles, phase, begin) for at, begin in starts]
    run, lines = _compute_members(cases, engine, progress)
    _add_agreement(run, mechanism, agreement, period, phase)
    _add_means(run, skip)
    run.attrs |= {
        "title": "scissordyn ensemble",
        "status": "complete" if set(run["status"].values) == {"complete"} else "failed",
        "period": period,
        "phase": phase,
        "perturbation": perturbation,
        "seed": seed,
        "agreement": agreement,
        "configuration": write_configuration(mechanism, options),
        "warnings": json.dumps([*lines, *drive_warnings(plan(mechanism), period)]),
    }
    return run


def _check(mechanism: Mechanism, members: int, cycles: int, skip: int, perturbation: float, agreement: float) -> None:
    for name, count, least in (("members", members, 2), ("cycles", cycles, 1), ("skip", skip, 0)):
        whole_number(name, count, least)
    if skip >= cycles:
        raise InputError(f"skip = {skip} of {cycles} cycles", f"fewer than {cycles} skipped cycles")
    if not 1e-16 <= perturbation <= 1e-6:
        raise InputError(f"perturbation = {perturbation!r}", "a relative change of the start from 1e-16 to 1e-06")
    if not 0.0 < agreement < 1.0:
        raise InputError(f"agreement = {agreement!r}", "a distance as a fraction of the clearance, above 0 and below 1")
    if not mechanism.contacts:
        raise InputError("ensemble: the mechanism has no clearance joints", "a mechanism with a clearance")
    whole_number("cycles of all members", members * cycles)


def _compute_members(
    cases: list[CycleCase], engine: Engine, progress: Callable[[int, int], None] | None
) -> tuple[xr.Dataset, Iterable[str]]:
    """Return the cycles of all members as one Dataset, and the warnings about them."""
    members = len(cases)
    run = empty_rows(cases, "member", {"member": np.arange(members)})
    for outcome in outcomes(engine, run_case, cases, total=members, progress=progress):
        store_cycles(run, "member", outcome)
    lines = grouped_lines(run["warnings"].values)
    run = run.drop_vars([name for name in run.data_vars if name in CYCLE_COLUMNS and name not in ("status", "cause")])
    if "energy" not in run:
        raise InputError(f"ensemble: every member failed: {run['cause'].values[0]}", "a mechanism that runs")
    return run, lines


def _make_starts(mechanism: Mechanism, start: StartKind, members: int, perturbation: float, seed: int) -> list[Snapshot]:
    """Return the perturbed initial states of all members, projected onto the constraints."""
    first = start_state(mechanism, start)
    system = make_system(plan(mechanism))
    numbers = np.random.default_rng(seed)
    starts = [first]
    for _ in range(members - 1):
        factor = 1.0 + perturbation * numbers.standard_normal(first.y.size)
        starts.append(make_consistent(system, first.changed(y=first.y * factor)))
    return starts


def _add_agreement(run: xr.Dataset, mechanism: Mechanism, agreement: float, period: float, phase: float) -> None:
    """Add the fraction of agreeing members, the divergence cycle of each member, and the trusted cycles."""
    clearance = np.array([joint.clearance.clearance for joint in mechanism.contacts if joint.clearance])
    place = run["eccentricity"].values
    difference = place - place[:1]
    apart = np.max(np.hypot(difference[..., 0], difference[..., 1]) / clearance, axis=2)
    # a failed member has NaN and agrees with no other member
    agrees = apart <= agreement
    cycles = run.sizes["cycle"]
    diverged = np.where(np.all(agrees, axis=1), cycles, np.argmin(agrees, axis=1))
    fraction = np.mean(agrees[1:], axis=0)
    run["agreeing"] = ("cycle", fraction, {"units": "1", "long_name": "fraction of the members that agree with member 0"})
    run["divergence_cycle"] = (
        "member",
        diverged,
        {"units": "1", "long_name": "first cycle that differs from that of member 0"},
    )
    trusted = int(np.min(diverged[1:]))
    run.attrs |= {"trusted_cycles": trusted, "trusted_until": max(0.0, (trusted - 1 + phase) * period)}


def _add_means(run: xr.Dataset, skip: int) -> None:
    """Add to the ensemble the mean of each variable over the cycles after `skip`, per member, and its spread over members."""
    for name in CYCLE_VARIABLES:
        if name not in run or name == "in_contact":
            continue
        about = run[name].attrs
        mean = run[name].isel(cycle=slice(skip, None)).mean("cycle", skipna=False)
        run[f"mean_{name}"] = mean.assign_attrs(units=about["units"], long_name=f"mean of: {about['long_name']}")
        spread = run[f"mean_{name}"].std("member", ddof=1, skipna=False)
        run[f"spread_{name}"] = spread.assign_attrs(
            units=about["units"], long_name=f"spread of the mean of: {about['long_name']}"
        )
