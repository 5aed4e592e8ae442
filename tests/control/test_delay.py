"""Equations with delays on the real loop, and what delayed feedback can and cannot do."""

import cmath
import dataclasses
import math

import numpy as np
import pint
import pytest
from tests.build import counts_of, hanging

import scissordyn as sd
from scissordyn.integrate.method import METHODS

INERTIA = 0.45  # Moment of inertia of the bar about its pin [kg m^2]


@sd.element(slot="controller", delay=1.0, recorded="speed")
def lagging(delayed):
    """Return the torque -I w(t - T) for the delayed angular velocity w, so that w' = -w(t - T)."""
    return -0.45 * delayed


def by_steps(t):
    """Return x(t) of x' = -x(t - 1), x = 1 up to t = 0: the sum of (-1)^k (t - k + 1)^k/k! over k <= t + 1."""
    total = np.ones_like(t)
    for k in range(1, 80):
        total += (-1.0) ** k * np.clip(t - k + 1.0, 0.0, None) ** k / math.factorial(k)
    return total


def lagged(method, tolerance, until=5.0, **options):
    """Simulate the delay equation by a mechanism; return the run, its largest error at the samples, and its steps."""
    controlled = hanging(spin=1.0).controlled(lagging())
    run = sd.simulate(controlled, until=until, samples=101, rtol=tolerance, atol=tolerance, method=method, **options)
    error = float(np.max(np.abs(run["angular_velocity"][:, 0].values - by_steps(run["time"].values))))
    return run, error, counts_of(run)["steps"]


@pytest.mark.parametrize(("method", "order"), [("dopri5", 5), ("rodas5p", 5), ("rodas4p", 4)])
def test_order_with_a_delay(method, order):
    """Order of convergence: fitted from errors against steps; the delayed value costs the method nothing of its order."""
    found = [lagged(method, tolerance)[1:] for tolerance in (1e-8, 1e-9, 1e-10, 1e-11)]
    fitted = -np.polyfit(np.log([steps for _, steps in found]), np.log([error for error, _ in found]), 1)[0]
    assert order - 0.5 < fitted < order + 0.5


@pytest.mark.parametrize("method", METHODS)
def test_delay_equation(method):
    """Closed form: the method of steps; the torque at the samples uses the same history."""
    run, error, _ = lagged(method, 1e-11)
    assert error < 1e-8
    assert np.allclose(run["control_torque"][:, 0], -INERTIA * by_steps(run["time"].values - 1.0), atol=1e-8)
    assert float(np.max(np.abs(run["energy_residual"]))) < 1e-9


def test_history_grows():
    """Closed form: a run of more steps than the initial length of the history is correct."""
    _, error, steps = lagged("rodas4p", 1e-13, until=15.0)
    assert steps > 4096
    assert error < 1e-10


def test_nothing_is_kept_without_a_delay():
    """Limit: steps are not limited and nothing is recorded where no controller has a delay."""
    run = sd.simulate(hanging(spin=1.0).controlled(sd.PID(1.0)), until=1.0, samples=3)
    assert not [name for name in run if str(name).startswith("recorded")]


def decay_rate(gain, delay, recursion_gain, stiffness, excitation, guess):
    """Return the root near `guess` of I s^2 - d s + k + K s (1 - E)/(1 - R E) with E = exp(-s T), by Newton's method."""

    def value(s):
        past = cmath.exp(-s * delay)
        return INERTIA * s * s - excitation * s + stiffness + gain * s * (1.0 - past) / (1.0 - recursion_gain * past)

    s = guess
    for _ in range(60):
        slope = (value(s + 1e-6) - value(s - 1e-6)) / 2e-6
        s -= value(s) / slope
    assert abs(value(s)) < 1e-9
    return s


@sd.element(slot="controller")
def excited(error, speed):
    """Return the torque of a spring and a damper with negative coefficient: an oscillator that excites itself."""
    return 18.0 * error + 0.2 * speed


@pytest.mark.parametrize("recursion_gain", [0.0, 0.4])
def test_delayed_feedback_stabilises_an_oscillator(recursion_gain):
    """Closed form: a self-excited oscillator (a complex pair of multipliers) decays at the root of its quasi-polynomial."""
    delay = math.pi / math.sqrt(18.0 / INERTIA)
    law = (
        sd.ExtendedDelayedFeedback(0.5, delay, recursion_gain, onset=0.0)
        if recursion_gain
        else sd.Pyragas(0.5, delay, onset=0.0)
    )
    free = hanging().controlled(excited(), reference=sd.Polynomial((0.0,)), start_on_reference=False)
    options = {"rtol": 1e-10, "atol": 1e-10, "samples": 4001, "method": "dop853"}
    assert np.abs(sd.simulate(free, until=6.0, **options)["angle"][:, 0].values[-500:]).max() > 0.6
    run = sd.simulate(free.controlled(law), until=20.0, **options)
    root = decay_rate(0.5, delay, recursion_gain, 18.0, 0.2, complex(-0.3, math.sqrt(18.0 / INERTIA)))
    assert root.real < -0.1
    # the slowest mode alone is left: fit its real and imaginary part to the second half
    part = (run["time"].values > 8.0) & (run["time"].values < 16.0)
    t, angle = run["time"].values[part], run["angle"][:, 0].values[part]
    basis = np.exp(root.real * t)[:, None] * np.stack([np.cos(root.imag * t), np.sin(root.imag * t)], axis=1)
    left = angle - basis @ np.linalg.lstsq(basis, angle, rcond=None)[0]
    assert np.max(np.abs(left)) < 1e-4 * np.max(np.abs(angle))
    assert np.abs(run["control_torque"][:, 1].values[-100:]).max() < 0.1 * np.abs(run["control_torque"][:, 1].values).max()


@pytest.mark.parametrize("gain", [-20.0, 3.0, 10.0, 40.0])
def test_odd_number_limitation(gain):
    """Limit: an upright bar has one real multiplier above 1; delayed feedback stabilises it at no gain, plain feedback does."""
    upright = hanging(angle=0.5 * math.pi + 1e-3, gravity=9.81)
    reference = sd.Polynomial((0.5 * math.pi,))
    delayed = upright.controlled(sd.Pyragas(gain, 0.2, "error", onset=0.0), reference=reference, start_on_reference=False)
    # on the error y = r - th the torque K [y(t-T) - y] is that on the angle with the gain -K
    left = sd.simulate(delayed, until=8.0, samples=4001, most_steps=3000)  # the angle grows without bound
    assert float(np.abs(left["control_error"]).max()) > 0.3
    controlled = sd.simulate(
        upright.controlled(sd.PID(10.0, 2.0), reference=reference, start_on_reference=False), until=4.0, samples=401
    )
    assert float(np.abs(controlled["control_error"]).max()) < 2e-3


def test_extended_without_memory_is_pyragas():
    """Contract: with R = 0 the extended feedback is Pyragas's, to the last bit."""
    pair = sd.Pyragas(0.5, 0.2, onset=0.0), sd.ExtendedDelayedFeedback(0.5, 0.2, 0.0, onset=0.0)
    runs = [sd.simulate(hanging(spin=1.0).controlled(sd.PID(18.0)).controlled(law), until=1.0, samples=101) for law in pair]
    assert np.array_equal(runs[0]["angle"].values, runs[1]["angle"].values)


def extended(limit):
    """Return the run of a bar on a servo with extended feedback, R = 0.5, T = 0.25 s, from 0.5 s on; 100 samples a second."""
    controlled = hanging(spin=1.0).controlled(sd.PID(18.0), reference=sd.Polynomial((0.3,)), start_on_reference=False)
    law = sd.ExtendedDelayedFeedback(5.0, 0.25, 0.5, onset=0.5, limit=limit)
    return sd.simulate(controlled.controlled(law), until=2.0, samples=201, rtol=1e-10, atol=1e-10)


def recursion_error(limit):
    """Return the largest error of the recorded S(t) = y(t) + R S(t - T) at the samples [rad/s]."""
    run = extended(limit)
    signal, speed = run["recorded_speed"][:, 1].values, run["angular_velocity"][:, 0].values
    return float(np.max(np.abs(signal[25:] - speed[25:] - 0.5 * signal[:-25])))


def test_onset_limit_and_record():
    """Contract: no torque before the onset, none beyond the limit, and S = y + R S(t - T) in what is recorded."""
    run = extended(0.4)
    torque, t = run["control_torque"][:, 1].values, run["time"].values
    assert np.all(torque[t < 0.5 - 1e-9] == 0.0)
    assert np.max(np.abs(torque)) == 0.4
    assert recursion_error(None) < 1e-9
    assert extended(None)["recorded_speed"].attrs["units"] == "rad/s"
    assert extended(None)["recorded_speed"][0, 1] == pytest.approx(1.0 / (1.0 - 0.5), rel=1e-12)


def test_every_recorded_signal_has_its_unit():
    """Contract: signals of different kinds are variables of their own with units that pint reads, NaN at the other actuator."""
    law = sd.Pyragas(0.5, 0.2, onset=0.0)
    both = hanging(spin=1.0).controlled(law).controlled(dataclasses.replace(law, recorded="error"), name="second")
    run = sd.simulate(both, until=0.1, samples=3)
    for name, unit in {"recorded_speed": "rad/s", "recorded_error": "rad"}.items():
        assert run[name].attrs["units"] == unit
    assert np.isfinite(run["recorded_speed"]).values.all(axis=0).tolist() == [True, False]
    assert np.isfinite(run["recorded_error"]).values.all(axis=0).tolist() == [False, True]
    for values in run.variables.values():
        pint.application_registry.parse_units(values.attrs.get("units", "1"))
