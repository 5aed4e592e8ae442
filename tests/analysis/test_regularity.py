"""The measures of regularity give the known answers of known motions."""

import math

import numpy as np
import pytest

import scissordyn as sd
from scissordyn.analysis.lyapunov import exponent_from_growth
from scissordyn.analysis.recurrence import recurrence

from .made_up import henon, logistic, rotation


def test_logistic_exponent():
    """Closed form: the logistic map at r = 4 has ln 2 (conjugate to the tent map)."""
    found = exponent_from_growth(np.log(np.abs(4.0 - 8.0 * logistic(4.0, 10_000))), 1.0, discard=100, unit="1")
    assert float(found["exponent"]) == pytest.approx(math.log(2.0), rel=0.01)
    assert float(found["running"][-1]) == float(found["exponent"])


def test_henon_exponent():
    """Known number: 0.41934 per step, within 1 %, from 100 starts; tables differ in the fourth digit."""
    x, y = np.random.default_rng(1).uniform(-0.1, 0.1, (2, 100))
    u, v = np.full((2, 100), math.sqrt(0.5))
    growth = []
    for _ in range(3000):
        u, v = -2.8 * x * u + v, 0.3 * u
        x, y = 1.0 - 1.4 * x**2 + y, 0.3 * x
        length = np.hypot(u, v)
        growth.append(np.log(length))
        u, v = u / length, v / length
    found = exponent_from_growth(growth, 1.0, discard=100, unit="1")
    assert float(found["exponent"]) == pytest.approx(0.41934, rel=0.01)
    assert float(found["standard_error"]) < 0.003
    assert found.sizes["member"] == 100


def test_exponent_from_growth():
    """Closed form: means weighted by time; the standard error of independent normal growth is sigma/sqrt(n) (to 4 sigma)."""
    found = exponent_from_growth([9.0, 1.0, 3.0], [1.0, 1.0, 3.0], discard=1, blocks=1)
    np.testing.assert_allclose(found["running"], [1.0, 1.0], rtol=1e-15)
    np.testing.assert_allclose(found["time"], [1.0, 4.0], rtol=1e-15)
    assert math.isnan(float(found["standard_error"]))
    # two blocks with rates 1.5 and 3.5 deviate by sqrt 2, their mean by 1
    assert float(exponent_from_growth([1.0, 2.0, 3.0, 4.0], 1.0, blocks=2)["standard_error"]) == pytest.approx(1.0, rel=1e-14)
    growth = np.random.default_rng(0).normal(0.5, 0.2, (4000, 5))
    many = exponent_from_growth(growth, 0.1, blocks=200)
    expected = 0.2 / 0.1 / math.sqrt(growth.size)
    assert float(many["standard_error"]) == pytest.approx(expected, rel=4.0 / math.sqrt(2.0 * 200))
    assert abs(float(many["exponent"]) - 5.0) < 4.0 * expected
    np.testing.assert_allclose(many["member_exponent"], growth.mean(axis=0) / 0.1, rtol=1e-12)
    for bad in ([math.nan, 1.0], []):
        with pytest.raises(sd.InputError):
            exponent_from_growth(bad, 1.0)
    with pytest.raises(sd.InputError, match="durations > 0"):
        exponent_from_growth([1.0, 1.0], [1.0, 0.0])


@pytest.mark.parametrize(
    ("values", "chaotic"),
    [
        (logistic(4.0, 2000), True),
        (henon(2000)[:, 0], True),
        (logistic(3.55, 2000), False),
        (rotation(2000)[:, 0], False),
        (5.0 + 1e-4 * rotation(2000)[:, 1], False),
        (1e6 + logistic(4.0, 2000), True),
        (np.full(200, 3.7), False),
    ],
    ids=["logistic", "henon", "period 8", "golden mean", "small on large", "chaos on large", "constant"],
)
def test_zero_one(values, chaotic):
    """Limit: K tends to 1 for chaotic maps and to 0 for regular ones (Gottwald and Melbourne 2009), at any size and offset."""
    growth = float(sd.zero_one_test(values)["K"])
    assert growth > 0.9 if chaotic else abs(growth) < 0.1


@pytest.mark.parametrize("error", [1e-11, 1e-9, 3e-8])
def test_zero_one_of_errors_alone(error):
    """Limit: an orbit of period 1 with the errors of a run is undecided, not chaotic; longer periods stay regular."""
    errors = error * np.random.default_rng(3).standard_normal(400)
    found = sd.zero_one_test(7.0 * (1.0 + errors))
    assert np.isnan(float(found["K"]))
    assert "vary by no more than their errors" in found.attrs["undecided"]
    assert float(sd.zero_one_test(1.0 + errors, noise=0.0)["K"]) > 0.9  # what is not known as an error is taken as a motion
    for period in (2, 3, 8):
        repeated = sd.zero_one_test(np.cos(2.0 * np.pi * np.arange(400) / period) + errors)
        assert abs(float(repeated["K"])) < 0.1
        assert "undecided" not in repeated.attrs
    with pytest.raises(sd.InputError, match="noise = -1"):
        sd.zero_one_test(errors, noise=-1.0)


def test_zero_one_displacement():
    """Cross-check: the displacement by FFT against its sum, written out; K does not depend on scale."""
    values = logistic(3.9, 300)
    found = sd.zero_one_test(values, angles=7, seed=2)
    z = found["p"].values + 1j * found["q"].values
    most = int(found["lag"][-1])
    direct = [np.mean(np.abs(z[n : n + 300 - most] - z[: 300 - most]) ** 2) for n in found["lag"].values]
    np.testing.assert_allclose(found["mean_square_displacement"], direct, rtol=1e-10)
    assert float(found["K"]) == pytest.approx(float(sd.zero_one_test(-1e3 * values, angles=7, seed=2)["K"]), rel=1e-9)
    assert found["angle"].values.min() > 0.2 * np.pi
    assert found["angle"].values.max() < 0.8 * np.pi


def test_zero_one_oversampled():
    """Limit: a finely sampled chaotic signal looks regular, and the test says how finely it is sampled."""
    fine = np.interp(np.arange(0.0, 60.0, 0.03), np.arange(61), logistic(4.0, 61))
    found = sd.zero_one_test(fine)
    assert float(found["samples_per_oscillation"]) > 50.0
    assert float(found["K"]) < float(sd.zero_one_test(logistic(4.0, 2000))["K"]) - 0.2
    with pytest.raises(sd.InputError, match="at least 50"):
        sd.zero_one_test(np.arange(20.0))


def test_spectrum_of_two_tones():
    """Closed form: both frequencies to a twentieth of the resolution, strongest first; the integral is the variance (1 %)."""
    spacing, count = 1e-3, 8000
    time = spacing * np.arange(count)
    noise = 1e-3 * np.random.default_rng(0).normal(size=count)
    values = 2.0 * np.sin(2.0 * np.pi * 50.3 * time) + 0.5 * np.sin(2.0 * np.pi * 123.4 * time) + noise + 7.0
    found = sd.spectrum(values, spacing=spacing, unit="m/s")
    resolution = 4.0 / (count * spacing)
    np.testing.assert_allclose(found["dominant_frequency"], [50.3, 123.4], atol=resolution / 20.0)
    power = float(found["power_density"].sum()) * float(found["frequency"][1])
    assert power == pytest.approx(2.0 + 0.125, rel=0.01)
    assert found["power_density"].attrs["units"] == "(m/s)^2 s"
    assert float(found["flatness"]) < 0.01


def test_spectrum_of_noise():
    """Closed form: white noise of variance s^2 has density 2 s^2 dt; one periodogram of it is e^-gamma flat."""
    noise = np.random.default_rng(5).normal(0.0, 3.0, 2**15)
    found = sd.spectrum(noise, spacing=0.5, segments=1, window="boxcar")
    assert float(found["power_density"][1:].mean()) == pytest.approx(2.0 * 9.0 * 0.5, rel=0.04)
    assert float(found["flatness"]) == pytest.approx(math.exp(-np.euler_gamma), abs=0.03)
    with pytest.raises(sd.InputError, match="spacing > 0"):
        sd.spectrum(noise, spacing=0.0)


def test_recurrence_of_a_period():
    """Closed form: period 4 recurs at multiples of 4 and nowhere else, on lines; a constant always."""
    found = recurrence(np.tile([0.0, 1.0, 3.0, 7.0], 25), threshold=0.5)
    pairs = sum(100 - 4 * k for k in range(1, 25))
    assert float(found["recurrence_rate"]) == pytest.approx(pairs / (100 * 99 / 2), rel=1e-14)
    assert float(found["determinism"]) == 1.0
    assert int(found["longest_line"]) == 96
    np.testing.assert_array_equal(found["recurrent"].values[0], np.arange(100) % 4 == 0)
    for apart in (1, 5):
        still = recurrence(np.zeros(20), threshold=0.0, apart=apart)
        assert (float(still["recurrence_rate"]), int(still["longest_line"])) == (1.0, 20 - apart)


def test_determinism_of_noise_and_rotation():
    """Closed form: noise has 2 RR - RR^2 (2 %); a rotation keeps all distances; a projection does not, embedding mends it."""
    found = recurrence(np.random.default_rng(0).uniform(size=2000), threshold=0.05)
    rate = float(found["recurrence_rate"])
    assert rate == pytest.approx(0.1 - 0.05**2, rel=0.02)
    assert float(found["determinism"]) == pytest.approx(2.0 * rate - rate**2, rel=0.02)
    whole, projected = (float(recurrence(part)["determinism"]) for part in (rotation(600), rotation(600)[:, 0]))
    embedded = float(recurrence(rotation(601)[:, 0], dimension=2)["determinism"])
    assert whole == 1.0
    assert embedded > projected + 0.2
    with pytest.raises(sd.InputError, match="apart = 20 for 20 embedded states; expected an index difference of at most 19"):
        recurrence(np.arange(20.0), apart=20)
    assert float(recurrence(np.arange(20.0), apart=19)["recurrence_rate"]) == 0.0
    with pytest.raises(sd.InputError, match="at most 5000"):
        recurrence(np.zeros(6000))
