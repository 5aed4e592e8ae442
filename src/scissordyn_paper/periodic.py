"""Regularity of the motion under a periodic drive.

The paper's drive is a single stroke at constant speed, which is not periodic; regular, quasi-periodic and irregular are
properties of the motion under a periodic drive. The paper does not state such a drive. Here the driven bar oscillates by 15 deg
about 45 deg, over the first part of the stroke; its largest speed is that of the stroke.
"""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import xarray as xr

from scissordyn.analysis.verdict import classify, consensus
from scissordyn.errors import ScissordynError
from scissordyn.file.output_file import check_target
from scissordyn.periodic.bifurcation import OtherDiagramError, bifurcation
from scissordyn.periodic.cycles import cycle
from scissordyn.periodic.ensemble import ensemble
from scissordyn.periodic.lyapunov import separation_exponent
from scissordyn.run.advance.interrupt import raise_if_interrupted
from scissordyn.run.engine import Engine
from scissordyn.units import degrees
from scissordyn_paper.cache import Progress
from scissordyn_paper.cases import CLEARANCES, FRICTION, Choice, PaperCase
from scissordyn_paper.measures import JOINT

PERIODIC = Choice(angle=degrees(45), travel="oscillating")  # The default choice with the periodic drive

BY_CLEARANCE = tuple(PaperCase(clearance, choice=PERIODIC) for clearance in CLEARANCES)
BY_FRICTION = tuple(PaperCase(friction=friction, choice=PERIODIC) for friction in FRICTION)
ALL_CASES = tuple(dict.fromkeys((*BY_CLEARANCE, *BY_FRICTION)))
LONGEST_FIRST = tuple(dict.fromkeys((*BY_FRICTION, *BY_CLEARANCE)))
"""Cases in the order of computing time: with friction, a motion takes five times as long, because steps are shorter."""

CYCLES, SKIP = 320, 80
"""Number of periods of a run, and of periods at its start that the verdict leaves out: 240 remain, and it needs 200."""

ENSEMBLE_MEMBERS = 4  # Number of starts that differ by round-off, for motions that one trajectory cannot characterise
PAIR_MEMBERS = 2  # Number of starts that differ by round-off, for motions whose samples repeat; simulated for `SKIP` periods

GROWTH_CYCLES, GROWTH_SKIP = 120, 80
CYCLE_INTERVALS = 4
"""For the Lyapunov exponent: number of periods, number of periods at the start that are left out, because some motions have
long transients, and number of rescalings of the small difference in each period."""

DIAGRAM_VALUES, DIAGRAM_CYCLES, DIAGRAM_KEPT = 60, 160, 100
"""Numbers of clearances, of periods at each clearance, and of drawn periods of the bifurcation diagram."""


@dataclass(frozen=True)
class Regularity:
    """Regularity of a motion under the periodic drive, with the evidence."""

    kind: str  # "continuous contact", "periodic", "quasi-periodic", "irregular" or "transient only", see `analysis.verdict`
    name: str  # The kind, with the period where there is one
    members: int  # Number of evaluated trajectories
    agreeing: int  # Number of trajectories with this verdict
    growth: float  # K of the 0-1 test; NaN where the samples repeat, as the test would evaluate round-off
    exponent: float  # Largest Lyapunov exponent [1/s]
    exponent_error: float  # Standard error of the exponent [1/s]
    contact_fraction: float  # Fraction of the counted periods in contact
    impacts: float  # Mean number of contacts that start in a period
    trusted_cycles: int  # Number of periods after which starts that differ by round-off diverge
    followed_cycles: int  # Number of periods for which such starts were simulated
    evidence: tuple[str, ...]  # Sentences that support the verdict

    @property
    def regular(self) -> bool | None:
        """True if the motion is periodic or quasi-periodic, False if it is irregular, None if undecided."""
        return None if self.kind == "transient only" else self.kind != "irregular"

    @property
    def words(self) -> str:
        """Text of the verdict with K and the Lyapunov exponent."""
        growth = "" if math.isnan(self.growth) else f"K = {self.growth:.2f}, "
        exponent = f"{self.exponent:z.1f}".replace("-", "−")
        return f"{self.name} ({growth}λ = {exponent} ± {self.exponent_error:.1f} 1/s)"


def examine(case: PaperCase) -> xr.Dataset:
    """Simulate a case over hundreds of periods; return its run with the regularity of the motion as an attribute.

    Where the samples do not repeat, or starts that differ by round-off diverge, the verdict is that of most members of an
    ensemble.
    """
    mechanism = case.build().mechanism
    run = cycle(mechanism, cycles=CYCLES)
    _check(run, case)
    together = followed = 0
    if classify(run, skip=SKIP).period is not None:
        # for a periodic motion a few periods are enough to see whether neighbours converge to it
        pair = ensemble(mechanism, members=PAIR_MEMBERS, cycles=SKIP, engine=1)
        _check(pair, case)
        together = followed = int(pair.attrs["trusted_cycles"])
    growth = math.nan
    if followed == SKIP:
        verdict = classify(run.assign_attrs(trusted_until=math.inf), skip=SKIP)
        kind, name, evidence, judged, agreeing = verdict.kind, verdict.name, verdict.evidence, 1, 1
        fraction, impacts = (float(run[what].isel(cycle=slice(SKIP, None)).mean()) for what in ("contact_fraction", "impacts"))
    else:
        many = ensemble(mechanism, members=ENSEMBLE_MEMBERS, cycles=CYCLES, skip=SKIP, engine=1)
        _check(many, case)
        together, followed = int(many.attrs["trusted_cycles"]), CYCLES
        at = ("cycle", many.attrs["period"] * np.arange(CYCLES))
        each = [classify(many.isel(member=k).assign_coords(time=at), skip=SKIP) for k in range(ENSEMBLE_MEMBERS)]
        common = consensus(each)
        name = next(iter(common.counts))
        evidence, judged, agreeing = (*common.evidence, *each[0].evidence), ENSEMBLE_MEMBERS, common.counts[name]
        kind = common.kind
        if 2 * agreeing <= ENSEMBLE_MEMBERS:  # undecided without a majority
            kind, name = "transient only", "undecided"
        fraction, impacts = (float(many[f"mean_{what}"].mean()) for what in ("contact_fraction", "impacts"))
        # too few samples have none; where most members are periodic, that of the others is not used
        if common.period is None and "K" in common.measures["measure"].values:
            growth = float(common.measures["mean"].sel(measure="K"))
    apart = separation_exponent(mechanism, cycles=GROWTH_CYCLES, skip=GROWTH_SKIP, intervals=CYCLE_INTERVALS, rtol=1e-9)
    _check(apart, case)
    found = Regularity(
        kind=kind,
        name=name,
        members=judged,
        agreeing=agreeing,
        growth=growth,
        exponent=float(apart["exponent"]),
        exponent_error=float(apart["standard_error"]),
        contact_fraction=fraction,
        impacts=impacts,
        trusted_cycles=together,
        followed_cycles=followed,
        evidence=evidence,
    )
    return run.isel(cycle=slice(SKIP, None)).assign_attrs(regularity=json.dumps(vars(found)))


def regularity_of(run: xr.Dataset) -> Regularity:
    """Return the regularity of the motion from the attributes of a run that `examine` returned."""
    kept = json.loads(run.attrs["regularity"])
    return Regularity(**{**kept, "evidence": tuple(kept["evidence"])})


def fetch_diagram(path: Path, *, engine: Engine = None, progress: Progress | None = None) -> xr.Dataset:
    """Return the bifurcation diagram for clearances from 0.2 to 0.7 mm; compute missing parts of the file `path`."""
    values = np.linspace(CLEARANCES[-1], CLEARANCES[0], DIAGRAM_VALUES)

    def announce(done: int, of: int) -> None:
        if progress is not None:
            progress("bifurcation", done, of)

    def made() -> xr.Dataset:
        return bifurcation(
            PaperCase(choice=PERIODIC).build().mechanism,
            over=f"{JOINT}.clearance",
            values=values,
            cycles=DIAGRAM_CYCLES,
            keep=DIAGRAM_KEPT,
            engine=engine,
            store=path,
            progress=announce,
        )

    try:
        diagram = raise_if_interrupted(made())
    except OtherDiagramError:
        # a file that is cut, or of another diagram; any other is left alone
        check_target(path, sample="-o paper", replace_broken=True)
        path.unlink(missing_ok=True)
        diagram = raise_if_interrupted(made())
    failed = diagram["value"].values[diagram["status"].values != "complete"]
    if failed.size:
        raise ScissordynError(f"the bifurcation diagram failed at {JOINT}.clearance = {failed[0]:g} m")
    return diagram


def _check(run: xr.Dataset, case: PaperCase) -> None:
    if raise_if_interrupted(run).attrs["status"] != "complete":
        causes = [str(run.attrs.get("cause", ""))] if "cause" not in run else run["cause"].values.astype(str).tolist()
        raise ScissordynError(f"'{case.name}' under the periodic drive failed: {'; '.join(filter(None, causes))}")
