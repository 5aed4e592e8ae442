"""Feedback of the filtered rate: its kernel, and a loop whose linear equations are known."""

import numpy as np
import pytest
from scipy.linalg import expm
from tests.build import on_pin, wheel

import scissordyn as sd
from scissordyn.control.tracking.filtered_pd import FilteredPD

# Inertia [kg m^2], proportional gain [N m/rad], derivative gain [N m s/rad] and filter time [s]
INERTIA, PROPORTIONAL, DERIVATIVE, TIME = 0.4, 30.0, 4.0, 0.05


def held(controller, angle):
    """Return a balanced rotor that a controller turns to zero from the angle `angle`."""
    free = on_pin(wheel("rotor", INERTIA, angle=angle))
    return free.controlled(controller, reference=sd.Polynomial((0.0,)), start_on_reference=False)


@pytest.mark.parametrize("method", ["dop853", "rodas5p"])
def test_a_linear_loop(method):
    """Closed form: angle, speed and filtered rate are the exponential of a 3 x 3 matrix."""
    run = sd.simulate(
        held(FilteredPD(PROPORTIONAL, DERIVATIVE, TIME), 0.2), until=1.0, method=method, samples=41, rtol=1e-10, atol=1e-12
    )
    A = np.array([[0.0, 1.0, 0.0], [-PROPORTIONAL / INERTIA, 0.0, DERIVATIVE / INERTIA], [0.0, -1.0 / TIME, -1.0 / TIME]])
    exact = np.array([expm(A * t) @ [0.2, 0.0, 0.0] for t in run["time"].values])
    np.testing.assert_allclose(run["angle"].sel(body="rotor"), exact[:, 0], atol=1e-8)
    np.testing.assert_allclose(run["filtered_rate"][:, 0], exact[:, 2], atol=1e-7)
    torque = -PROPORTIONAL * exact[:, 0] + DERIVATIVE * exact[:, 2]
    np.testing.assert_allclose(run["control_torque"][:, 0], torque, atol=1e-6)


def test_its_limit():
    """Contract: the torque is cut off either way, while the filter goes on."""
    run = sd.simulate(held(FilteredPD(PROPORTIONAL, DERIVATIVE, TIME, limit=3.0), 0.2), until=1.0, samples=201)
    wanted = PROPORTIONAL * run["control_error"] + DERIVATIVE * run["filtered_rate"]
    np.testing.assert_allclose(run["control_torque"], np.clip(wanted, -3.0, 3.0), rtol=1e-12)
    assert float(abs(wanted).max()) > 5.0
