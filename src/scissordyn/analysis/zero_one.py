"""0-1 test of Gottwald and Melbourne: K near 0 for regular, near 1 for chaotic motion."""

from __future__ import annotations

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike
from scipy import fft

from scissordyn.analysis.variable import dataset_variable, finite_numbers
from scissordyn.errors import InputError, whole_number
from scissordyn.tolerance import ROUND_OFF_TOL
from scissordyn.units import checked

# Reason why K is NaN, the attribute `undecided` of a result
UNDECIDED = "the values vary by no more than their errors, and the test cannot distinguish errors from chaos"


@checked
def zero_one_test(values: ArrayLike, *, angles: int = 100, seed: int = 0, noise: float = 1e-7) -> xr.Dataset:
    """Compute the 0-1 test for chaos by the correlation method.

    For angles c in [pi/5, 4 pi/5] the samples phi_j drive the translation

        p(n) = sum_{j<=n} phi_j cos(j c),    q(n) = sum_{j<=n} phi_j sin(j c)

    which is bounded for regular motion and diffuses like Brownian motion for chaotic motion. K_c is the correlation of 1, ...,
    n_cut with the modified mean square displacement

        D_c(n) = mean_j [ (p(j+n) - p(j))^2 + (q(j+n) - q(j))^2 ] - (E phi)^2 (1 - cos n c) / (1 - cos c)

    and K is the median over the angles, which is insensitive to the few resonant ones. The mean of the samples is subtracted
    first, so that the last term and its cross terms vanish.

    The samples must come from a map (`stroboscopic`, `section`, contact by contact). A finely sampled flow changes little from
    one sample to the next, and K tends to 0 for any motion: `samples_per_oscillation` should not exceed about 10. A few hundred
    samples are enough for clear cases; weak chaos and slow transients need thousands. For K between 0.2 and 0.8 a longer run is
    needed. Errors diffuse like chaos: K is undetermined if the values vary only by their errors, as on an orbit of period 1.

    Parameters
    ----------
    values : array_like, shape (n,)
        At least 50 values.
    angles : int
        Number of angles c.
    seed : int
        Seed of the random angles.
    noise : float
        Error of the values, as a fraction of the largest. If they vary by no more, K is NaN and the attribute `undecided` gives
        the reason; 0 is for values without error. Values that are equal up to round-off have K = 0.

    Returns
    -------
    Dataset
        `K`; `correlation` along `angle`; for the angle with the median K_c (`shown_angle`), `p` and `q` along `step`
        and `mean_square_displacement` along `lag`; `samples_per_oscillation`, with two crossings of the mean per oscillation.

    Raises
    ------
    InputError
        If there are too few values or no angles, or if the error is negative.

    References
    ----------
    Gottwald and Melbourne 2009, doi:10.1137/080718851; 2016, doi:10.1007/978-3-662-48410-4_7
    """
    numbers, angles = finite_numbers(values, least=50), whole_number("angles", angles, 1)
    if not 0.0 <= noise < 1.0:
        raise InputError(f"noise = {noise!r}", "a fraction of the largest value, from 0 to 1", "noise=1e-7")
    chosen = np.sort(np.random.default_rng(seed).uniform(0.2 * np.pi, 0.8 * np.pi, angles))
    centred, unknown = _centred(numbers, noise)
    wheel = np.exp(1j * chosen[:, None] * np.arange(1, numbers.size + 1))
    path = np.cumsum(centred * wheel, axis=1)
    # lags: at most a tenth of the number of samples (Gottwald and Melbourne 2009, section 3)
    lags = np.arange(1, max(int(0.1 * numbers.size), 5) + 1)
    displacement = _mean_square_displacement(path, lags)
    correlation = np.array([_correlation(lags, row) for row in displacement])
    shown = int(np.argsort(correlation, kind="stable")[(angles - 1) // 2])
    crossings = int(np.sum(np.diff(np.signbit(centred).astype(np.int8)) != 0))
    return xr.Dataset(
        {
            "K": dataset_variable(
                (), np.nan if unknown else float(np.median(correlation)), "1", "growth of the 0-1 test, median"
            ),
            "correlation": dataset_variable(("angle",), correlation, "1", "growth of the 0-1 test at one angle"),
            "p": dataset_variable(("step",), path[shown].real, "1", "translation p"),
            "q": dataset_variable(("step",), path[shown].imag, "1", "translation q"),
            "mean_square_displacement": dataset_variable(
                ("lag",), displacement[shown], "1", "modified mean square displacement"
            ),
            "samples_per_oscillation": dataset_variable(
                (), 2.0 * numbers.size / crossings if crossings else np.inf, "1", "samples per oscillation"
            ),
        },
        coords={
            "angle": dataset_variable(("angle",), chosen, "rad", "angle c"),
            "step": dataset_variable(("step",), np.arange(1, numbers.size + 1), "1", "sample"),
            "lag": dataset_variable(("lag",), lags, "1", "lag"),
        },
        attrs={"seed": seed, "shown_angle": float(chosen[shown]), **({"undecided": UNDECIDED} if unknown else {})},
    )


def _centred(values: np.ndarray, noise: float) -> tuple[np.ndarray, bool]:
    """Return the values minus their mean, and True if they vary by at most `noise` times the largest value.

    Variations by round-off are set to zero.
    """
    centred = values - np.mean(values)
    varying, size = float(np.max(np.abs(centred))), float(np.max(np.abs(values)))
    if varying <= ROUND_OFF_TOL * size:
        return np.zeros_like(centred), False
    return centred, varying <= noise * size


def _mean_square_displacement(path: np.ndarray, lags: np.ndarray) -> np.ndarray:
    """Return the mean of |z(j + n) - z(j)|^2 over j for each lag n by FFT, shape (angles, lags); z is the complex path."""
    samples, most = path.shape[1], int(lags[-1])
    kept = samples - most
    # differences do not depend on the mean, and sums of squares lose fewer digits without it
    z = path - path.mean(axis=1, keepdims=True)
    size = fft.next_fast_len(samples + most)
    head = fft.fft(z[:, :kept], size)
    cross = fft.ifft(fft.fft(z, size) * head.conj(), axis=1)[:, lags].real
    squares = np.concatenate([np.zeros((len(z), 1)), np.cumsum(np.abs(z) ** 2, axis=1)], axis=1)
    ahead, here = squares[:, lags + kept] - squares[:, lags], squares[:, kept : kept + 1]
    mean: np.ndarray = (ahead + here - 2.0 * cross) / kept
    return mean


def _correlation(lags: np.ndarray, displacement: np.ndarray) -> float:
    """Return Pearson's correlation; 0 for a constant displacement."""
    if np.ptp(displacement) == 0.0:
        return 0.0
    return float(np.corrcoef(lags, displacement)[0, 1])
