"""Largest values that last, as at the limit of a controller, and mean values beside largest values without derivatives."""

from types import SimpleNamespace

import numpy as np
import pytest

import scissordyn as sd
from scissordyn.record.trajectory import Trajectory

LIMIT, INERTIA, END = 0.8, 2e-3, 0.02  # Limit of the torque [N m], inertia of the rotor [kg m^2], end of the run [s]


def servo():
    """Return a rotor whose controller rises to the limit of its torque and stays there."""
    rotor = sd.Body("rotor", 1.0, INERTIA, points={"centre": (0.0, 0.0)}, position=(0.0, 0.0), angle=0.0)
    pin = sd.Revolute("pin", ("rotor", "centre"), ("ground", "O"))
    free = sd.Mechanism(bodies=(rotor,), joints=(pin,), ground=(("O", (0.0, 0.0)),), gravity=0.0, input_body="rotor")
    control = sd.PID(40.0, 0.0, limit=LIMIT)
    return free.controlled(control, speed=20.0, body="rotor", start_on_reference=False, name="servo")


@pytest.mark.parametrize("method", ["dop853", "rodas5p"])
def test_torque_at_the_limit_of_a_controller(method):
    """Identity: the largest torque is the limit, whatever the gain."""
    by = ["servo.controller.limit", "servo.controller.proportional"]
    found = sd.gradient(servo(), of=["peak_component_force"], by=by, until=END, method=method)
    assert found["value"].item() == pytest.approx(LIMIT, rel=1e-12)
    np.testing.assert_allclose(found["derivative"][0], [1.0, 0.0], atol=1e-12)


def test_mean_value_beside_a_largest_value_without_derivatives():
    """Limit: a largest value that is not a number, as one with unknown derivatives, does not limit the mean value."""
    run = SimpleNamespace(peaks=lambda kind: {"largest": np.array([np.nan, 1.0]), "square": np.array([4.0, 4.0])}, end=1.0)
    assert Trajectory.root_mean_squares(run, 0).tolist() == [2.0, 1.0]
