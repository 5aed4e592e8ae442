"""Classify a motion as periodic, quasi-periodic or irregular, from stroboscopic samples, a run or an ensemble of runs."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from scissordyn.analysis.contact import contact_groups, contact_statistics, flight_fractions, united_spans
from scissordyn.analysis.section import stroboscopic
from scissordyn.analysis.spectrum import spectrum
from scissordyn.analysis.variable import dataset_variable, finite_numbers
from scissordyn.analysis.zero_one import zero_one_test
from scissordyn.casefile.configuration import ATTRIBUTE, number_attribute, read_configuration
from scissordyn.errors import InputError
from scissordyn.record.joint_force import require_clearance_joints
from scissordyn.units import checked

Kind = Literal["continuous contact", "periodic", "quasi-periodic", "irregular", "transient only"]


REGULAR_K_MAX, IRREGULAR_K_MIN = 0.2, 0.8
"""Limits of the result K of the 0-1 test: regular motion below 0.2, irregular above 0.8; in between K does not decide."""


@dataclass(frozen=True)
class Verdict:
    """Class of a motion with its evidence.

    Parameters
    ----------
    kind : {"continuous contact", "periodic", "quasi-periodic", "irregular", "transient only"}
        Class; "transient only" means that the samples do not determine the asymptotic motion.
    period : int or None
        Number of drive periods after which the samples repeat.
    evidence : tuple of str
        Sentences with the decisive numbers and their limitations.
    measures : mapping of str to float
        The same numbers, by name.
    """

    kind: Kind
    period: int | None
    evidence: tuple[str, ...]
    measures: Mapping[str, float]

    @property
    def name(self) -> str:
        """Text of the kind and, if the motion has a period, of the period: "periodic, period 3"."""
        return f"{self.kind}, period {self.period}" if self.period is not None else self.kind


def classify_samples(
    samples: ArrayLike,
    *,
    scale: ArrayLike | None = None,
    tolerance: float = 1e-3,
    longest_period: int = 16,
    flight_fraction: float | None = None,
    times: ArrayLike | None = None,
    trusted_until: float = math.nan,
    seed: int = 0,
) -> Verdict:
    """Classify samples of a Poincare map as periodic, quasi-periodic or irregular motion.

    The first criterion that is met decides:

    1. period p: in the second half of the samples x_{k+p} = x_k within `tolerance` of the scale, for the smallest p;
    2. transient only: fewer than 200 samples, or a spread or mean that still changes from the first to the last quarter;
    3. for the quantity that varies most, irregular if K of the 0-1 test is above 0.8, quasi-periodic (or a period above
       `longest_period`) if it is below 0.2, transient only in between.

    A motion of period 1 without separation in the clearance joints is called continuous contact.

    Parameters
    ----------
    samples : array_like, shape (n,) or (n, quantities)
        One row per period of the drive.
    scale : array_like, shape (quantities,), optional
        Unit of differences, such as the clearance for eccentricities; by default the largest absolute value of each quantity.
    tolerance : float
        Largest difference of equal samples, as a fraction of the scale.
    longest_period : int
        Longest period searched for.
    flight_fraction : float, optional
        Largest fraction of the time that a clearance joint is in free flight, over the second half; 0 is continuous contact.
    times : array_like, shape (n,), optional
        Times of the samples [s].
    trusted_until : float
        Predictability horizon of the trajectory [s]; NaN if not computed.
    seed : int
        Seed of the random angles of the 0-1 test.

    Raises
    ------
    InputError
        If there are fewer than two samples, some are not finite, or a scale or tolerance is not positive.
    """
    table = finite_numbers(samples, least=2, dimensions=2)
    size = np.max(np.abs(table), axis=0) if scale is None else np.broadcast_to(np.asarray(scale, float), table.shape[1:])
    size = np.where(size == 0.0, 1.0, size) if scale is None else size
    if not (np.all(np.isfinite(size)) and np.all(size > 0.0) and tolerance > 0.0 and longest_period >= 1):
        raise InputError(
            f"scale = {size.tolist()}, tolerance = {tolerance!r}, longest_period = {longest_period!r}", "numbers > 0"
        )
    scaled = table / size
    evidence, measures = list[str](), {"samples": float(len(scaled))}
    if flight_fraction is not None:
        measures["flight_fraction"] = flight_fraction
        evidence.append(
            "No clearance joint separates in the second half."
            if flight_fraction <= 0.0
            else f"In the second half a clearance joint is in free flight for {100.0 * flight_fraction:.3g} % of the time."
        )
    period = _period(scaled, tolerance, longest_period, evidence, measures)
    kind: Kind
    if period is not None:
        kind = "continuous contact" if period == 1 and flight_fraction is not None and flight_fraction <= 0.0 else "periodic"
    else:
        kind = _classify_aperiodic(scaled, longest_period, seed, evidence, measures)
    if times is not None:
        count, beyond = len(scaled), int(np.sum(np.asarray(times, float) > trusted_until))
        _add_horizon(trusted_until, 1.0 - beyond / count, f"{beyond} of {count} samples lie beyond", evidence, measures)
    return Verdict(kind, period, tuple(evidence), measures)


def _period(
    scaled: np.ndarray, tolerance: float, longest: int, evidence: list[str], measures: dict[str, float], repetitions: int = 4
) -> int | None:
    """Return the smallest number of samples after which the second half repeats; None if it does not repeat.

    `repetitions`: smallest number of repetitions that prove a period.
    """
    tail = scaled[len(scaled) // 2 :]
    misses = [
        float(np.max(np.abs(tail[p:] - tail[:-p])))
        for p in range(1, min(longest, len(tail) // repetitions) + 1)
        if len(tail) > p
    ]
    if not misses:
        return None
    measures["repetition_error"] = min(misses)
    for p, miss in enumerate(misses, start=1):
        if miss <= tolerance:
            apart = np.max(np.abs(scaled[p:] - scaled[:-p]), axis=1) > tolerance
            settled = int(np.flatnonzero(apart)[-1]) + 1 if np.any(apart) else 0
            measures["repetition_error"], measures["settled_after"] = miss, float(settled)
            evidence.append(
                f"From sample {settled} to {len(scaled) - 1} the samples repeat after {p} to within {miss:.2g} of their scale "
                f"(allowed {tolerance:g})."
            )
            return p
    evidence.append(
        f"No period up to {len(misses)}: over the last {len(tail)} samples the best repetition misses by {min(misses):.2g} of "
        f"the scale (allowed {tolerance:g})."
    )
    return None


def _classify_aperiodic(
    scaled: np.ndarray,
    longest: int,
    seed: int,
    evidence: list[str],
    measures: dict[str, float],
    least_samples: int = 200,
    spread_ratio: float = 4.0,
) -> Literal["quasi-periodic", "irregular", "transient only"]:
    """Classify samples that do not repeat, by their drift and the 0-1 test; add the evidence and its numbers.

    `least_samples`: smallest number of samples for the 0-1 test; its largest lag is a tenth of that number.

    `spread_ratio`: largest factor by which the spread of the samples may differ between first and last quarter in a settled
    motion.
    """
    if len(scaled) < least_samples:
        evidence.append(
            f"{len(scaled)} samples are too few to distinguish quasi-periodic from irregular motion; "
            f"{least_samples} are needed."
        )
        return "transient only"
    quarter = len(scaled) // 4
    spread = [float(np.max(np.std(part, axis=0))) for part in (scaled[:quarter], scaled[-quarter:])]
    change = spread[1] / spread[0] if spread[0] > 0.0 else math.inf
    whole = np.std(scaled, axis=0)
    moved = np.abs(scaled[-quarter:].mean(axis=0) - scaled[:quarter].mean(axis=0))
    drift = float(np.max(np.divide(moved, whole, out=np.zeros_like(whole), where=whole > 0.0)))
    measures["spread_change"], measures["drift"] = change, drift
    if not 1.0 / spread_ratio < change < spread_ratio or drift > 1.0:
        evidence.append(
            f"From the first to the last quarter of the samples the spread changes by a factor of {change:.3g} and the mean by "
            f"{drift:.2g} standard deviations: the motion has not settled."
        )
        return "transient only"
    widest = scaled[:, int(np.argmax(whole))]
    test = zero_one_test(widest, seed=seed)
    growth, per_oscillation = float(test["K"]), float(test["samples_per_oscillation"])
    measures["K"], measures["samples_per_oscillation"] = growth, per_oscillation
    measures["flatness"] = float(spectrum(widest, spacing=1.0, peaks=0)["flatness"])
    evidence.append(
        f"0-1 test: K = {growth:.3f} with {len(scaled)} samples (regular < {REGULAR_K_MAX:g}, "
        f"irregular > {IRREGULAR_K_MIN:g}); spectral flatness {measures['flatness']:.2g}."
    )
    if per_oscillation > 10.0:
        evidence.append(f"An oscillation has {per_oscillation:.3g} samples; with so many K is too small.")
    if growth > IRREGULAR_K_MIN:
        return "irregular"
    if growth < REGULAR_K_MAX:
        evidence.append(f"A period above {longest} cannot be distinguished from quasi-periodic motion.")
        return "quasi-periodic"
    evidence.append(f"K is undecided: {test.attrs.get('undecided', 'a longer run is needed')}.")
    return "transient only"


def _add_horizon(horizon: float, trusted: float, beyond: str, evidence: list[str], measures: dict[str, float]) -> None:
    """Add `trusted` to the measures: the fraction of the motion before the predictability horizon [s].

    If `trusted` is below 1, add a sentence to the evidence; it begins with `beyond` and ends with the horizon.
    """
    if math.isnan(horizon):
        evidence.append("The reproducible part of the trajectory has not been determined: repeat the run with trust=True.")
        return
    measures["trusted_fraction"] = trusted
    if trusted < 1.0:
        evidence.append(f"{beyond} the predictability horizon of {horizon:.6g} s. Compare an ensemble beyond it.")


MAP_DIMENSIONS = ("strobe", "cycle")  # Dimensions with one sample per drive period: of `stroboscopic`, of a long periodic run


@checked
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
    """Classify the motion of a run, with evidence.

    With a periodic drive the eccentricities, in clearances, are sampled once per period (`classify_samples`). A single stroke
    has no asymptotic motion: it is either in continuous contact or transient only.

    Parameters
    ----------
    run : Dataset
        A run, a result of `stroboscopic`, or the cycles of a long periodic run.
    period : float, optional
        Period of the drive [s]; a run without it is a single stroke.
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
        Seed of the random angles of the 0-1 test.

    Raises
    ------
    InputError
        If no joint has clearance, no sample is left, or the samples of a run are not at the instants of the map.
    """
    trusted = float(run.attrs.get("trusted_until", math.nan))
    fraction: float | None = None
    if "time" in run.dims:
        if period is None:
            return _classify_stroke(run, after, trusted)
        strobe, fraction = _sampled_map(run, period, phase, skip)
    else:
        dim = next((name for name in MAP_DIMENSIONS if name in run.dims), None)
        if dim is None:
            raise InputError("the dataset has no dimension time, strobe or cycle", "a run, or a stroboscopic map of a run")
        strobe = run.isel({dim: slice(skip, None)})
        if "contact_fraction" in strobe and strobe.sizes[dim]:
            fraction = _flight_fraction_of_map(strobe.isel({dim: slice(strobe.sizes[dim] // 2, None)}))
    dim = next(name for name in MAP_DIMENSIONS if name in strobe.dims)
    if strobe.sizes[dim] < 2:
        raise InputError(f"{strobe.sizes[dim]} samples are left after skip = {skip}", "at least 2, and 200 for a verdict")
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


def _sampled_map(run: xr.Dataset, period: float, phase: float, skip: int) -> tuple[xr.Dataset, float | None]:
    """Return the samples of a run once per period, and the largest free-flight fraction of a joint in the second half."""
    strobe = stroboscopic(run, period=period, phase=phase, skip=skip)
    if strobe.attrs.get("source") != "samples":
        raise InputError(
            f"the samples of the run are not at the instants (k + {phase:g}) {period:g} s",
            "samples at each of them: until/(samples - 1) divides the period",
        )
    settled = float(strobe["time"].values[strobe.sizes["strobe"] // 2])
    if not settled < float(run["time"].values[-1]):
        return strobe, None
    return strobe, _exact_zero(max(flight_fractions(run, settled, float(run["time"].values[-1])).values()))


def _flight_fraction_of_map(strobe: xr.Dataset) -> float | None:
    """Return the largest free-flight fraction of a joint or guide in the cycles of a map; None if that of a guide is not known.

    The corners of a guide touch at different times, so that its fraction does not follow from theirs.
    """
    joints = list(map(str, strobe["joint"].values))
    united = strobe.get("united_contact_fraction")
    if united is None:
        if len(contact_groups(strobe, joints)) < len(joints):
            return None
        united = strobe["contact_fraction"]
    return _exact_zero(1.0 - float(united.transpose(..., "joint").values.mean(axis=0).min()))


def _exact_zero(fraction: float) -> float:
    """Return zero for a fraction below 1e-12, which is round-off in a sum of contact times; otherwise the fraction."""
    return 0.0 if fraction < 1e-12 else fraction


def _clearances(strobe: xr.Dataset) -> dict[str, float]:
    """Return the clearance of each clearance joint of a stroboscopic map [m], by name."""
    if "clearance" in strobe:
        return {name: float(strobe["clearance"].sel(joint=name)) for name in require_clearance_joints(strobe)}
    joints = read_configuration(strobe).mechanism.joints if ATTRIBUTE in strobe.attrs else ()
    clearances = {joint.name: float(joint.clearance.clearance) for joint in joints if joint.clearance is not None}
    if not clearances:
        raise InputError("the map has no clearances of its joints", "a variable 'clearance' along 'joint' [m]")
    return clearances


def _classify_stroke(run: xr.Dataset, after: float, trusted: float) -> Verdict:
    """Classify a single stroke: continuous contact if no joint separates, else transient only."""
    statistics = contact_statistics(run, after=after)
    start, end = number_attribute(statistics, "after"), number_attribute(statistics, "until")
    fraction = _exact_zero(max(flight_fractions(run, start, end).values()))
    last = -math.inf
    for joints in contact_groups(run, require_clearance_joints(run)).values():
        spans = united_spans(run, joints, 0.0, end)
        last = max(last, float(spans[-1, 0]) if spans.size and spans[-1, 1] >= end else math.inf)
    measures = {
        "flight_fraction": fraction,
        "impacts": float(statistics["impacts"].sum()),
        "impact_rate": float(statistics["impact_rate"].max()),
        "contact_fraction": 1.0 - fraction,
        "peak_force": float(statistics["peak_force"].max()),
        "contact_arc": float(np.nanmax(statistics["contact_arc"].values, initial=0.0)),
        "contact_since": last,
    }
    window = f"from {start:.6g} s to {end:.6g} s"
    evidence = [
        f"A single stroke {window} has no period: neither periodic nor chaotic motion can be shown.",
        f"{measures['impacts']:.0f} impacts; each joint or guide is in contact for at least "
        f"{100.0 * measures['contact_fraction']:.4g} % of the time.",
    ]
    if fraction > 0.0:
        evidence.append(
            "At the end a clearance joint is in free flight."
            if math.isinf(last)
            else f"All clearance joints are in contact from {last:.6g} s to the end."
        )
    _add_horizon(trusted, min(max(0.0, (trusted - start) / (end - start)), 1.0), "The end lies beyond", evidence, measures)
    return Verdict("continuous contact" if fraction == 0.0 else "transient only", None, tuple(evidence), measures)


@dataclass(frozen=True)
class Consensus:
    """Most frequent verdict of an ensemble of runs, with the counts of all verdicts and the spread of their numbers.

    Parameters
    ----------
    kind : str
        Kind of the most frequent `Verdict`.
    period : int or None
        Period of the most frequent `Verdict`.
    fraction : float
        Fraction of the members that have this kind and period.
    counts : mapping of str to int
        Number of members with each verdict, most frequent first.
    measures : Dataset
        `mean`, `deviation` (standard deviation), `least`, `largest` and `members` (number that have it) along `measure`.
    evidence : tuple of str
        Sentences with the numbers.
    """

    kind: Kind
    period: int | None
    fraction: float
    counts: Mapping[str, int]
    measures: xr.Dataset
    evidence: tuple[str, ...]


def _deviation(values: list[float]) -> float:
    """Return the standard deviation of a sample; NaN for one value."""
    return float(np.std(values, ddof=1)) if len(values) > 1 else math.nan


MEMBER_STATISTICS: dict[str, tuple[Callable[[list[float]], float], str, str]] = {  # Statistics: function, unit, meaning
    "mean": (np.mean, "of the measure", "mean over the members"),
    "deviation": (_deviation, "of the measure", "standard deviation over the members"),
    "least": (min, "of the measure", "smallest of the members"),
    "largest": (max, "of the measure", "largest of the members"),
    "members": (len, "1", "members with this measure"),
}


@checked
def consensus(verdicts: Sequence[Verdict]) -> Consensus:
    """Return the consensus of the verdicts on an ensemble.

    The members are runs of one case whose starts differ by round-off. After their trajectories diverge, common results are a
    property of the motion, and different results are random.

    Parameters
    ----------
    verdicts : sequence of Verdict
        At least two verdicts.

    Raises
    ------
    InputError
        If there are fewer than two verdicts.
    """
    if len(verdicts) < 2:
        raise InputError(
            f"an ensemble of {len(verdicts)} members", "at least two verdicts", "consensus([classify(run) for run in runs])"
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
        f"{name}: {np.mean(values):.4g} ± {_deviation(values):.2g}, from {min(values):.4g} to {max(values):.4g}."
        for name, values in measured.items()
        if len(values) > 1 and min(values) < max(values)
    ]
    return Consensus(
        kind=kind,
        period=period,
        fraction=most / count,
        counts={names[pair]: number for pair, number in counts},
        measures=xr.Dataset(
            {
                name: dataset_variable(("measure",), [statistic(values) for values in measured.values()], units, text)
                for name, (statistic, units, text) in MEMBER_STATISTICS.items()
            },
            coords={"measure": list(measured)},
        ),
        evidence=tuple(evidence),
    )
