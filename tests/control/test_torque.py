"""The kernels of the controllers at single instants, against plain Python; they run without the compiler."""

import math

import numpy as np
import pytest

import scissordyn as sd
from scissordyn.control.signal import SIGNALS, control_torque
from scissordyn.plugin.element import pointers, row_of


def torque(controller, signals, *, t=1.0, integral=0.3):
    """Return torque and rate of the integral for signals by name; other signals have values that would change the result."""
    q = np.array([signals.get(name, 1e3 + k) for k, name in enumerate(SIGNALS)])
    recorded = q[SIGNALS.index(controller.recorded)] if controller.recorded else 0.0
    z, dz = np.full(len(controller.states), integral), np.full(len(controller.states), np.nan)
    return control_torque(pointers(controller)["torque"], t, recorded, q, z, dz, row_of(controller)), dz


# Signals of a controller that tracks a reference, in SI units
TRACKING = {"reference_speed": 2.0, "error": 0.03, "speed": 1.7, "feed_forward": 0.0}
# Signals of the sensor of a controller, in SI units
BRAKING = {"sensor_x": 3e-5, "sensor_y": -4e-5, "sensor_rate_x": 0.2, "sensor_rate_y": 0.1}


def test_pid():
    """Closed form: k_p e + k_d (speed error) + z, and z' = k_i e while nothing is cut off."""
    found, rate = torque(sd.PID(40.0, 3.0, 7.0), TRACKING)
    assert found == pytest.approx(40.0 * 0.03 + 3.0 * 0.3 + 0.3, rel=1e-14)
    assert rate[0] == pytest.approx(7.0 * 0.03, rel=1e-14)
    assert torque(sd.PID(40.0), TRACKING)[0] == pytest.approx(1.2, rel=1e-14)
    assert torque(sd.PID(40.0), TRACKING)[1].size == 0


@pytest.mark.parametrize(("tracking", "time"), [(None, 40.0 / 7.0), (0.2, 0.2)])
def test_limit(tracking, time):
    """Closed form: cut off at the limit either way, the integral led back in T_t, which is k_p/k_i unless it is given."""
    wanted = 40.0 * 0.03 + 3.0 * 0.3 + 0.3
    pid = sd.PID(40.0, 3.0, 7.0, limit=2.0, tracking_time=tracking)
    found, rate = torque(pid, TRACKING)
    assert found == 2.0
    assert rate[0] == pytest.approx(7.0 * 0.03 + (2.0 - wanted) / time, rel=1e-13)
    opposite = {"reference_speed": 1.7, "error": -0.03, "speed": 2.0, "feed_forward": 0.0}
    assert torque(pid, opposite, integral=-0.3)[0] == -2.0


def test_integral_alone():
    """Closed form: without k_p the tracking time is one second."""
    _, rate = torque(sd.PID(0.0, 0.0, 7.0, limit=0.1), TRACKING)
    assert rate[0] == pytest.approx(7.0 * 0.03 + (0.1 - 0.3) / 1.0, rel=1e-14)


@pytest.mark.parametrize(("t", "share"), [(-0.1, 0.0), (0.0, 0.0), (0.5, 0.25), (2.0, 1.0), (3.0, 1.0)])
def test_ramp(t, share):
    """Closed form: the limit rises from zero in proportion to time."""
    assert torque(sd.PID(1e4, limit=8.0, ramp=2.0), TRACKING, t=t)[0] == pytest.approx(8.0 * share, rel=1e-14)


def test_feed_forward():
    """Closed form: the torque given, with feedback and with the sensor's brake k_s s.s'/sqrt(s^2 + s_0^2)."""
    signals = {**TRACKING, **BRAKING, "feed_forward": 11.0}
    plain = 11.0 + 40.0 * 0.03 + 3.0 * 0.3
    assert torque(sd.FeedForward(40.0, 3.0), signals)[0] == pytest.approx(plain, rel=1e-14)
    brake = 5.0 * (3e-5 * 0.2 - 4e-5 * 0.1) / math.sqrt(25e-10 + 4e-10)
    found = torque(sd.FeedForward(40.0, 3.0, eccentricity_rate_damping=5.0, regularisation_length=2e-5), signals)[0]
    assert found == pytest.approx(plain - brake, rel=1e-14)


@pytest.mark.parametrize("signal", ["error", "speed", "sensor_x", "sensor_rate_y"])
def test_delayed_feedback(signal):
    """Closed form: K [(1 - R) S(t - T) - y(t)] of the recorded signal; pyragas has R = 0."""
    signals = {signal: 0.7, "delayed": 1.9}
    assert torque(sd.Pyragas(4.0, 0.5, signal), signals)[0] == pytest.approx(4.0 * (1.9 - 0.7), rel=1e-14)
    extended = sd.ExtendedDelayedFeedback(4.0, 0.5, 0.3, signal)
    assert torque(extended, signals)[0] == pytest.approx(4.0 * (0.7 * 1.9 - 0.7), rel=1e-13)


@pytest.mark.parametrize("law", [sd.Pyragas, sd.ExtendedDelayedFeedback])
def test_onset_of_delayed_feedback(law):
    """Closed form: nothing before the onset, which is one delay unless it is given; a ramp and a limit after it."""
    signals = {"speed": 0.7, "delayed": 1.9}
    gain = getattr(law(1.0, 1.0), "recursion_gain", 0.0)
    full = 4.0 * ((1.0 - gain) * 1.9 - 0.7)
    for t, expected in ((0.499, 0.0), (0.5, full), (9.0, full)):
        assert torque(law(4.0, 0.5), signals, t=t)[0] == pytest.approx(expected, rel=1e-13)
    for t, share in ((1.999, 0.0), (2.0, 0.0), (2.6, 0.2), (5.0, 1.0), (6.0, 1.0)):
        assert torque(law(4.0, 0.5, onset=2.0, ramp=3.0), signals, t=t)[0] == pytest.approx(share * full, rel=1e-12)
    for gain in (400.0, -400.0):
        assert torque(law(gain, 0.5, limit=3.5), signals)[0] == math.copysign(3.5, gain * full)


def test_none_and_unknown():
    """Limit: no control is no torque."""
    assert torque(sd.NoControl(), TRACKING)[0] == 0.0
