"""What kind of motion a run shows."""

from __future__ import annotations

import math

import numpy as np
import xarray as xr

from scissordyn.analysis.contact import contact_spans, contact_statistics, loose_joints
from scissordyn.analysis.stroboscope import stroboscopic
from scissordyn.analysis.verdict import Verdict, classify_samples
from scissordyn.errors import InputError
from scissordyn.simulation.configuration import ATTRIBUTE, read_configuration

__all__ = ["classify"]

MAPS = ("strobe", "cycle")
"""Dimensions of stroboscopic maps: of `stroboscopic`, and of long periodic runs."""


def classify(
    run: xr.Dataset,
    *,
    period: float | None = None,
    phase: float = 0.0,
    skip: int = 0,
    after: float = 0.0,
    tolerance: float = 1e-3,
    longest_period: int = 16,
    seed: int = 0,
) -> Verdict:
    """Say what kind of motion a run shows, and why.

    With a periodic drive the journals are looked at once a period (`classify_samples`; their eccentricities count in
    clearances). A single stroke settles to nothing: it is in continuous contact or it is transient only, whatever its pictures
    look like.

    Parameters
    ----------
    run : Dataset
        A run, a result of `stroboscopic`, or the cycles of a long periodic run.
    period : float, optional
        Of the drive [s]; a run without it is a single stroke.
    phase : float
        When in the period a run is looked at, as a share of it [1].
    skip : int
        Periods at the start that do not count.
    after : float
        Time at the start of a single stroke that does not count [s].
    tolerance : float
        How near counts as the same, as a fraction of the clearance.
    longest_period : int
        Longest period that is looked for.
    seed : int
        Of the angles of the 0-1 test.

    Returns
    -------
    Verdict

    Raises
    ------
    InputError
        If no joint is loose, nothing is left to look at, or the samples of a run miss the instants of the map.
    """
    trusted = float(run.attrs.get("trusted_until", math.nan))
    share: float | None = None
    if "time" in run.dims:
        if period is None:
            return _stroke(run, after, trusted)
        strobe = stroboscopic(run, period=period, phase=phase, skip=skip)
        if strobe.attrs["source"] != "samples":
            raise InputError(
                f"a run whose samples miss the instants (k + {phase:g}) {period:g} s",
                "samples of which one falls on each: until/(samples - 1) divides the period",
            )
        settled = float(strobe["time"].values[strobe.sizes["strobe"] // 2])
        if settled < float(run["time"].values[-1]):
            statistics = contact_statistics(run, after=settled)
            share = _exact_zero(float(statistics["flight_share"].max()))
    else:
        dim = next((name for name in MAPS if name in run.dims), None)
        if dim is None:
            raise InputError("a dataset without time, strobe or cycle", "a run, or a map of one")
        strobe = run.isel({dim: slice(skip, None)})
        if "contact_share" in strobe and strobe.sizes[dim]:
            share = _exact_zero(float(1.0 - strobe["contact_share"].isel({dim: slice(strobe.sizes[dim] // 2, None)}).min()))
    dim = next(name for name in MAPS if name in strobe.dims)
    if strobe.sizes[dim] < 2:
        raise InputError(f"{strobe.sizes[dim]} samples left after skip = {skip}", "at least 2, and 200 for a verdict")
    clearance = _clearances(strobe)
    place = strobe["eccentricity"].sel(joint=list(clearance)).transpose(dim, "joint", "axis").values
    return classify_samples(
        place.reshape(len(place), -1),
        scale=np.repeat(list(clearance.values()), 2),
        tolerance=tolerance,
        longest_period=longest_period,
        flight_share=share,
        times=strobe["time"].values,
        trusted_until=trusted,
        seed=seed,
    )


def _exact_zero(share: float) -> float:
    """Free of the round-off that is left when contacts that fill the time are added up."""
    return 0.0 if share < 1e-12 else share


def _clearances(strobe: xr.Dataset) -> dict[str, float]:
    """The clearance of every loose joint of a map [m]."""
    if "clearance" in strobe:
        return {name: float(strobe["clearance"].sel(joint=name)) for name in loose_joints(strobe)}
    joints = read_configuration(strobe).mechanism.joints if ATTRIBUTE in strobe.attrs else ()
    found = {joint.name: float(joint.clearance.clearance) for joint in joints if joint.clearance is not None}
    if not found:
        raise InputError("a map that does not say how loose its joints are", "a variable 'clearance' along 'joint' [m]")
    return found


def _stroke(run: xr.Dataset, after: float, trusted: float) -> Verdict:
    statistics = contact_statistics(run, after=after)
    start, end = statistics.attrs["after"], statistics.attrs["until"]
    share = _exact_zero(float(statistics["flight_share"].max()))
    last = -math.inf
    for joint in loose_joints(run):
        spans = contact_spans(run, joint)
        touching = spans[spans[:, 1] >= end] if spans.size else spans
        last = max(last, float(touching[0, 0]) if len(touching) else math.inf)
    measures = {
        "flight_share": share,
        "impacts": float(statistics["impacts"].sum()),
        "impact_rate": float(statistics["impact_rate"].max()),
        "contact_share": float(statistics["contact_share"].min()),
        "peak_force": float(statistics["peak_force"].max()),
        "contact_arc": float(np.nanmax(statistics["contact_arc"].values, initial=0.0)),
        "contact_since": last,
    }
    window = f"from {start:.6g} s to {end:.6g} s"
    evidence = [
        f"A single stroke {window}: there is no period, so neither periodic nor chaotic motion can be shown.",
        f"{measures['impacts']:.0f} impacts; no joint is in contact for less than {100.0 * measures['contact_share']:.4g} % "
        "of the time.",
    ]
    if share > 0.0:
        evidence.append(
            "At the end a loose joint is in free flight."
            if math.isinf(last)
            else f"All loose joints are in contact from {last:.6g} s to the end."
        )
    if math.isnan(trusted):
        evidence.append("How long the trajectory is reproducible has not been checked: repeat the run with trust=True.")
    elif trusted < end:
        measures["trusted_share"] = max(0.0, (trusted - start) / (end - start))
        evidence.append(
            f"Beyond the trust horizon of {trusted:.6g} s these are statistics of what may happen; one trajectory is no "
            "evidence: compare an ensemble."
        )
    else:
        measures["trusted_share"] = 1.0
    return Verdict("continuous contact" if share == 0.0 else "transient only", None, tuple(evidence), measures)
