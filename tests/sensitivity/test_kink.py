"""Integrals over a kink, wherever in a step it is."""

import dataclasses

import numpy as np
import pytest
from benchmarks.random_cases import random_case
from numpy.polynomial import Polynomial

import scissordyn as sd

INERTIA = 2e-3  # Inertia of the rotor [kg m^2]


def rotor():
    """Return a rotor in a pin."""
    body = sd.Body("rotor", 1.0, INERTIA, points={"centre": (0.0, 0.0)}, position=(0.0, 0.0), angle=0.0)
    pin = sd.Revolute("pin", ("rotor", "centre"), ("ground", "O"))
    return sd.Mechanism(bodies=(body,), joints=(pin,), ground=(("O", (0.0, 0.0)),), gravity=0.0, input_body="rotor")


@pytest.mark.parametrize("method", ["dop853", "dopri5", "rodas5p"])
@pytest.mark.parametrize("limit", np.linspace(2.9, 3.1, 17).tolist())
def test_mean_torque_with_a_kink_anywhere_in_a_step(limit, method):
    """Closed form: a motor helps a drive with a constant torque up to an instant, and with a falling one after it."""
    stall, fastest, growth, acceleration, end = 5.0, 40.0, 20.0, 400.0, 0.06
    loads = (
        sd.Motor("motor", "rotor", stall, fastest, limit=limit),
        sd.Torque("load", "rotor", 1.0, time_function=sd.Polynomial((0.0, growth))),
    )
    motion = sd.Polynomial((0.0, 0.0, 0.5 * acceleration))
    driven = dataclasses.replace(rotor(), components=loads).driven(motion)
    found = sd.gradient(driven, of=["rms_drive_torque"], by=["load.torque", "motor.limit"], until=end, method=method)
    corner = (1.0 - limit / stall) * fastest / acceleration
    # torques over time as polynomials: while the motor has its limit, and after that
    rest = Polynomial([-INERTIA * acceleration, growth])
    torques = [rest + limit, rest + Polynomial([stall, -stall * acceleration / fastest])]

    def mean(products):
        parts = zip(products, [(0.0, corner), (corner, end)], strict=True)
        return sum(power.integ()(last) - power.integ()(first) for power, (first, last) in parts) / end

    size = mean([torque * torque for torque in torques]) ** 0.5
    slopes = mean([torque * Polynomial([0.0, growth]) for torque in torques]), mean([torques[0], Polynomial([0.0])])
    assert found["value"].item() == pytest.approx(size, rel=1e-5)
    np.testing.assert_allclose(found["derivative"][0], np.array(slopes) / size, rtol=1e-5 if method == "rodas5p" else 1e-6)


def test_a_kink_in_the_slopes_of_a_law():
    """Cross-check: a damping that would pull stops to act within a stiff step, whose slopes by differences contain the kink."""
    case, by = random_case(158), ["clearance joint 3.bearing_length", "gravity", "clearance joint 3.friction.kinetic"]
    of, end = ["clearance joint 3.impulse", "damping_loss"], 0.0051
    stiff, explicit = (
        sd.gradient(case.mechanism, of=of, by=by, until=end, start=case.start, method=method)["elasticity"].values
        for method in ("rodas5p", "dop853")
    )
    np.testing.assert_allclose(stiff, explicit, rtol=1e-5, atol=1e-6)
