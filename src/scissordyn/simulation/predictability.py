"""The predictability horizon: the time until which a run agrees with a much more accurate one.

Motion with impacts can be chaotic; beyond the horizon a trajectory is one sample of a distribution, not a prediction.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr

from scissordyn.mechanics.assembly import eccentricity_map
from scissordyn.mechanics.reduced_model import ReducedModel
from scissordyn.mechanics.system import System
from scissordyn.model.mechanism import Mechanism
from scissordyn.simulation.checkpoint import Keeper
from scissordyn.simulation.options import Options
from scissordyn.simulation.trajectory import Trajectory, compute

__all__ = ["DIVERGENCE", "DIVERGENCE_BODY", "Horizon", "predictability"]

DIVERGENCE = 0.1
"""Distance of the two positions of a journal, as a fraction of its clearance, from which on the runs have diverged."""

DIVERGENCE_BODY = 1e-2
"""Distance of the two positions of a body, as a fraction of the mechanism's size, in a mechanism without clearance."""

SMALLEST = 1e-14
"""Smallest tolerance of a second run, a few roundings."""

TIGHTER = {"dop853": 1e-3, "dopri5": 1e-2, "rodas5p": 1e-2, "rodas4p": 1e-2}
"""Tolerances of the second run as a fraction of the first, by method: together both take at most three times as long as one."""

TOO_NEAR = 0.2
"""Tolerances that differ by less than this factor say nothing."""


@dataclass(frozen=True)
class Horizon:
    """Until when a run can be predicted.

    Parameters
    ----------
    until : float
        Time until which both runs agree [s].
    contacts : int
        Contacts that began before it.
    found : str
        "to the end", "diverged" or "unknown".
    reason : str
        Why it is unknown.
    interrupted : bool
        Whether the second run was stopped by the user.
    """

    until: float
    contacts: int
    found: str
    reason: str = ""
    interrupted: bool = False

    @property
    def attributes(self) -> dict[str, Any]:
        """As attributes of a run; without a time where none can be given."""
        text = self.found + (f": {self.reason}" if self.reason else "")
        known = {"trusted_until": self.until, "trusted_contacts": self.contacts} if math.isfinite(self.until) else {}
        return {"predictability": text, **known}


def predictability(
    mechanism: Mechanism,
    options: Options,
    path: Trajectory,
    run: xr.Dataset,
    progress: Callable[[float], None] | None = None,
    keeper: Keeper | None = None,
) -> Horizon:
    """Compare a run with a second one at a much tighter tolerance, at the ends of all steps of the first.

    Runs have diverged when the positions of a journal differ by `DIVERGENCE` of its clearance, or, in a mechanism without
    clearance, those of a body by `DIVERGENCE_BODY` of the mechanism's size. As the second run is far more accurate, their
    difference is the error of the first.

    Parameters
    ----------
    mechanism : Mechanism
    options : Options
    path : Trajectory
        With the ends of its steps recorded.
    run : Dataset
        Made of it.
    progress : callable, optional
    keeper : Keeper, optional
        Writes checkpoints of the second run.

    Returns
    -------
    Horizon
    """
    method = str(path.statistics["method"])
    rtol, atol = (max(TIGHTER[method] * asked, SMALLEST) for asked in (options.rtol, options.atol))
    starts = run["contact_start"].values
    if rtol > TOO_NEAR * options.rtol:
        return Horizon(math.nan, 0, "unknown", f"no tighter tolerance than rtol = {options.rtol:g} can be computed")
    if path.status != "complete":
        return Horizon(math.nan, 0, "unknown", "the run is not complete")
    times, states, _ = path.steps
    chosen = np.flatnonzero(np.diff(times, prepend=-1.0) > 0.0)
    tight = dataclasses.replace(options, rtol=rtol, atol=atol, method=method)
    second = compute(mechanism, tight, progress, times=times[chosen], keeper=keeper, part="repetition")
    if second.status == "interrupted":
        return Horizon(math.nan, 0, "unknown", "interrupted while the run was repeated", interrupted=True)
    count = second.samples.time.size
    apart = _apart(path.reduced, path.system.content, times[chosen][:count], states[chosen][:count], second.samples.state)
    diverged = np.flatnonzero(~(apart < 1.0))
    if diverged.size:
        at = int(diverged[0])
        return Horizon(float(times[chosen][at]), int(np.sum(starts < times[chosen][at])), "diverged")
    if second.status != "complete":
        return Horizon(
            second.end, int(np.sum(starts < second.end)), "unknown", f"the more accurate run ended there ({second.cause})"
        )
    return Horizon(path.end, int(starts.size), "to the end")


def _apart(reduced: ReducedModel, system: System, times: np.ndarray, one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Largest distance of two trajectories at some instants, in units of what counts as divergence, shape (nt,)."""
    n, numbers = reduced.free, system.parameters
    difference = np.zeros((times.size, n + reduced.basis))  # the drives are the same in both
    difference[:, :n] = one[:, :n] - other[:, :n]
    contacts = numbers.contact.size
    if contacts:
        vectors = [eccentricity_map(system, j).at(difference) for j in range(contacts)]
        limits = DIVERGENCE * numbers.contact["clearance"]
    else:
        mechanism = reduced.mechanism
        vectors = [reduced.place((body.name, point)).at(difference) for body in mechanism.bodies for point in body.points]
        vectors += [reduced.at(body.name, body.centre).at(difference) for body in mechanism.bodies]
        limits = np.full(len(vectors), DIVERGENCE_BODY * reduced.size)
    apart = np.zeros(times.size)
    for vector, limit in zip(vectors, limits, strict=True):
        apart = np.maximum(apart, np.hypot(vector[:, 0], vector[:, 1]) / limit)
    return apart
