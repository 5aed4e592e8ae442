"""Classification of the motion of a run."""

from __future__ import annotations

import math

import numpy as np
import xarray as xr

from scissordyn.analysis.contact import contact_spans, contact_statistics
from scissordyn.analysis.stroboscope import stroboscopic
from scissordyn.analysis.verdict import Verdict, classify_samples
from scissordyn.errors import InputError
from scissordyn.run.answer.joint_force import some_clearance_joints
from scissordyn.run.configuration import ATTRIBUTE, number_attribute, read_configuration

MAPS = ("strobe", "cycle")  # Dimensions of stroboscopic maps: of `stroboscopic`, and of long periodic runs


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
    """Classify the motion of a run, with the evidence.

    With a periodic drive the eccentricities, in clearances, are sampled once a period (`classify_samples`). A single stroke has
    no asymptotic motion: it is either in continuous contact or transient only.

    Parameters
    ----------
    run : Dataset
        A run, a result of `stroboscopic`, or the cycles of a long periodic run.
    period : float, optional
        Of the drive [s]; a run without it is a single stroke.
    phase : float
        Phase of the samples, as a fraction of the period [1].
    skip : int
        Number of periods at the start that are left out.
    after : float
        Start of the evaluation of a single stroke [s].
    tolerance : float
        Largest difference of equal samples, as a fraction of the clearance.
    longest_period : int
        Longest period searched for.
    seed : int
        Of the random angles of the 0-1 test.

    Returns
    -------
    Verdict

    Raises
    ------
    InputError
        If no joint has clearance, no sample is left, or the samples of a run are not at the instants of the map.
    """
    trusted = float(run.attrs.get("trusted_until", math.nan))
    fraction: float | None = None
    if "time" in run.dims:
        if period is None:
            return _stroke(run, after, trusted)
        strobe, fraction = _map_of(run, period, phase, skip)
    else:
        dim = next((name for name in MAPS if name in run.dims), None)
        if dim is None:
            raise InputError("a dataset without time, strobe or cycle", "a run, or a map of one")
        strobe = run.isel({dim: slice(skip, None)})
        if "contact_fraction" in strobe and strobe.sizes[dim]:
            fraction = _exact_zero(
                float(1.0 - strobe["contact_fraction"].isel({dim: slice(strobe.sizes[dim] // 2, None)}).min())
            )
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
        flight_fraction=fraction,
        times=strobe["time"].values,
        trusted_until=trusted,
        seed=seed,
    )


def _map_of(run: xr.Dataset, period: float, phase: float, skip: int) -> tuple[xr.Dataset, float | None]:
    """The samples of a run once a period, and the largest fraction of free flight over their second half."""
    strobe = stroboscopic(run, period=period, phase=phase, skip=skip)
    if strobe.attrs.get("source") != "samples":
        raise InputError(
            f"a run whose samples are not at the instants (k + {phase:g}) {period:g} s",
            "samples at each of them: until/(samples - 1) divides the period",
        )
    settled = float(strobe["time"].values[strobe.sizes["strobe"] // 2])
    if not settled < float(run["time"].values[-1]):
        return strobe, None
    return strobe, _exact_zero(float(contact_statistics(run, after=settled)["flight_fraction"].max()))


def _exact_zero(fraction: float) -> float:
    """Zero where only round-off of the sum of contact times is left."""
    return 0.0 if fraction < 1e-12 else fraction


def _clearances(strobe: xr.Dataset) -> dict[str, float]:
    """The clearance of every clearance joint of a map [m]."""
    if "clearance" in strobe:
        return {name: float(strobe["clearance"].sel(joint=name)) for name in some_clearance_joints(strobe)}
    joints = read_configuration(strobe).mechanism.joints if ATTRIBUTE in strobe.attrs else ()
    clearances = {joint.name: float(joint.clearance.clearance) for joint in joints if joint.clearance is not None}
    if not clearances:
        raise InputError("a map without the clearances of its joints", "a variable 'clearance' along 'joint' [m]")
    return clearances


def _stroke(run: xr.Dataset, after: float, trusted: float) -> Verdict:
    statistics = contact_statistics(run, after=after)
    start, end = number_attribute(statistics, "after"), number_attribute(statistics, "until")
    fraction = _exact_zero(float(statistics["flight_fraction"].max()))
    last = -math.inf
    for joint in some_clearance_joints(run):
        spans = contact_spans(run, joint)
        touching = spans[spans[:, 1] >= end] if spans.size else spans
        last = max(last, float(touching[0, 0]) if len(touching) else math.inf)
    measures = {
        "flight_fraction": fraction,
        "impacts": float(statistics["impacts"].sum()),
        "impact_rate": float(statistics["impact_rate"].max()),
        "contact_fraction": float(statistics["contact_fraction"].min()),
        "peak_force": float(statistics["peak_force"].max()),
        "contact_arc": float(np.nanmax(statistics["contact_arc"].values, initial=0.0)),
        "contact_since": last,
    }
    window = f"from {start:.6g} s to {end:.6g} s"
    evidence = [
        f"A single stroke {window}: there is no period, so neither periodic nor chaotic motion can be shown.",
        f"{measures['impacts']:.0f} impacts; no joint is in contact for less than {100.0 * measures['contact_fraction']:.4g} % "
        "of the time.",
    ]
    if fraction > 0.0:
        evidence.append(
            "At the end a clearance joint is in free flight."
            if math.isinf(last)
            else f"All clearance joints are in contact from {last:.6g} s to the end."
        )
    if math.isnan(trusted):
        evidence.append("How long the trajectory is reproducible has not been checked: repeat the run with trust=True.")
    elif trusted < end:
        measures["trusted_fraction"] = max(0.0, (trusted - start) / (end - start))
        evidence.append(
            f"Beyond the predictability horizon of {trusted:.6g} s one trajectory is no evidence: compare an ensemble."
        )
    else:
        measures["trusted_fraction"] = 1.0
    return Verdict("continuous contact" if fraction == 0.0 else "transient only", None, tuple(evidence), measures)
