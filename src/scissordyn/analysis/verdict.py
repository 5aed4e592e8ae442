"""Classification of stroboscopic samples, with the evidence."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from scissordyn.analysis.spectrum import spectrum
from scissordyn.analysis.variable import as_table
from scissordyn.analysis.zero_one import zero_one_test
from scissordyn.errors import InputError

Kind = Literal["continuous contact", "periodic", "quasi-periodic", "irregular", "transient only"]

ENOUGH = 200  # Smallest number of samples for the 0-1 test, whose displacements extend over a tenth of them only

REGULAR, CHAOTIC = 0.2, 0.8
"""K of the 0-1 test below which the motion is regular and above which it is irregular. Between, a longer run is needed."""

REPEATS = 4  # Smallest number of repetitions of a period

SETTLING = 4.0
"""The spread of a settled motion does not change by this factor from the first to the last quarter of the samples."""


@dataclass(frozen=True)
class Verdict:
    """A class of motion with its evidence.

    Parameters
    ----------
    kind : {"continuous contact", "periodic", "quasi-periodic", "irregular", "transient only"}
        "transient only": the samples do not determine the asymptotic motion.
    period : int or None
        In periods of the drive, where the samples repeat.
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
        """The kind, with the period where there is one."""
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

    The first of these criteria that is met:

    1. period p: over the second half of the samples x_{k+p} = x_k within `tolerance` of the scale, for the least p;
    2. transient only: fewer than 200 samples, or a spread or mean that still changes from the first to the last quarter;
    3. irregular if K of the 0-1 test is above 0.8, quasi-periodic (or a period above `longest_period`) if it is below 0.2,
       for the quantity that varies most; transient only in between.

    A motion of period 1 without separation in the clearance joints is called continuous contact.

    Parameters
    ----------
    samples : array_like, shape (n,) or (n, quantities)
        One row per period of the drive.
    scale : array_like, shape (quantities,), optional
        Unit of differences, such as the clearance for eccentricities; the largest absolute value of each quantity
        if not given.
    tolerance : float
        Largest difference of equal samples, as a fraction of the scale.
    longest_period : int
        Longest period searched for.
    flight_fraction : float, optional
        Largest fraction of the time that a clearance joint is in free flight, over the second half; 0 is continuous contact.
    times : array_like, shape (n,), optional
        Of the samples [s].
    trusted_until : float
        Predictability horizon of the trajectory [s]; NaN if not computed.
    seed : int
        Of the random angles of the 0-1 test.

    Returns
    -------
    Verdict

    Raises
    ------
    InputError
        If there are fewer than two samples, some are not finite, or a scale or tolerance is not positive.
    """
    table = as_table(samples, least=2)
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
        kind = _aperiodic(scaled, longest_period, seed, evidence, measures)
    if times is not None:
        _judge_trust(np.asarray(times, float), trusted_until, evidence, measures)
    return Verdict(kind, period, tuple(evidence), measures)


def _period(scaled: np.ndarray, tolerance: float, longest: int, evidence: list[str], measures: dict[str, float]) -> int | None:
    """The least period of the second half of the samples, or None."""
    tail = scaled[len(scaled) // 2 :]
    misses = [
        float(np.max(np.abs(tail[p:] - tail[:-p]))) for p in range(1, min(longest, len(tail) // REPEATS) + 1) if len(tail) > p
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


def _aperiodic(
    scaled: np.ndarray, longest: int, seed: int, evidence: list[str], measures: dict[str, float]
) -> Literal["quasi-periodic", "irregular", "transient only"]:
    if len(scaled) < ENOUGH:
        evidence.append(
            f"{len(scaled)} samples are too few to distinguish quasi-periodic from irregular motion; {ENOUGH} are needed."
        )
        return "transient only"
    quarter = len(scaled) // 4
    spread = [float(np.max(np.std(part, axis=0))) for part in (scaled[:quarter], scaled[-quarter:])]
    change = spread[1] / spread[0] if spread[0] > 0.0 else math.inf
    whole = np.std(scaled, axis=0)
    moved = np.abs(scaled[-quarter:].mean(axis=0) - scaled[:quarter].mean(axis=0))
    drift = float(np.max(np.divide(moved, whole, out=np.zeros_like(whole), where=whole > 0.0)))
    measures["spread_change"], measures["drift"] = change, drift
    if not 1.0 / SETTLING < change < SETTLING or drift > 1.0:
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
        f"0-1 test: K = {growth:.3f} with {len(scaled)} samples (regular < {REGULAR:g}, irregular > {CHAOTIC:g}); "
        f"spectral flatness {measures['flatness']:.2g}."
    )
    if per_oscillation > 10.0:
        evidence.append(f"An oscillation has {per_oscillation:.3g} samples; with so many K is too small.")
    if growth > CHAOTIC:
        return "irregular"
    if growth < REGULAR:
        evidence.append(f"A period above {longest} cannot be distinguished from quasi-periodic motion.")
        return "quasi-periodic"
    evidence.append(f"K is undecided: {test.attrs.get('undecided', 'a longer run is needed')}.")
    return "transient only"


def _judge_trust(times: np.ndarray, trusted_until: float, evidence: list[str], measures: dict[str, float]) -> None:
    """State which of the samples are reproducible."""
    if math.isnan(trusted_until):
        evidence.append("How long the trajectory is reproducible has not been checked: repeat the run with trust=True.")
        return
    beyond = int(np.sum(times > trusted_until))
    measures["trusted_fraction"] = 1.0 - beyond / times.size
    if beyond:
        evidence.append(
            f"{beyond} of {times.size} samples lie beyond the predictability horizon of {trusted_until:.6g} s. There one "
            "trajectory is no evidence: compare an ensemble."
        )
