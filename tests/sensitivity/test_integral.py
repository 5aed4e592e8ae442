"""Derivatives of integrals whose integrands have kinks within steps, against closed forms."""

import math
from dataclasses import replace

import pytest

import scissordyn as sd
from scissordyn.mechanics.monitored import POWERS
from scissordyn.plan.plan import plan
from scissordyn.sensitivity.forward import forward
from scissordyn.sensitivity.seed import Parameter, Start, derivatives

STIFFNESS, DAMPING, SPEED = 1e8, 3e3, 0.4  # of a wall and a ball of 1 kg, in SI units


def loss(damping):
    """Return the loss of a ball at a wall with a dashpot that does not pull (Schwager and Poeschel 2007)."""
    decay = 0.5 * damping
    frequency = math.sqrt(STIFFNESS - decay**2)
    ratio = math.exp(-decay / frequency * (math.pi - math.atan2(2.0 * decay * frequency, frequency**2 - decay**2)))
    return 0.5 * SPEED**2 * (1.0 - ratio**2)


def mechanism(damping):
    """Return a ball that strikes a wall without friction, and whose spin is proportional to the damping."""
    ball = sd.Body(
        "ball", 1.0, 1e-4, {"c": (0.0, 0.0)}, (0.0, 0.0), velocity=(SPEED, 0.0), angular_velocity=1e3 * damping / DAMPING
    )
    gap = sd.Clearance(
        1e-3,
        journal_radius=0.01,
        stiffness=sd.law("stiffness", "linear")(STIFFNESS),
        damping=sd.law("damping", "kelvin-voigt")(damping),
        friction=sd.NoFriction(),
    )
    hole = sd.Revolute("hole", ("ball", "c"), ("ground", "o"), clearance=gap)
    return sd.Mechanism(bodies=(ball,), joints=(hole,), ground=(("o", (0.0, 0.0)),), gravity=0.0)


@pytest.mark.parametrize("method", ["dop853", "rodas5p"])
def test_loss_of_a_dashpot_that_does_not_pull(method):
    """Cross-check by the closed form: the damping force has a kink where the contact would begin to pull.

    The spin has so large derivatives that the errors of the motion do not show the kink.
    """
    made, options = mechanism(DAMPING), sd.Options(4e-3, "as-placed", 2, 1e-11, 1e-11, method, events="located")
    seed = derivatives(Start(made, "as-placed"), Parameter("damping", DAMPING, DAMPING, "N s/m", mechanism))
    run = forward(plan(made), options, [seed], integrals=True)
    step, weights = 1e-2 * DAMPING, {1: 0.75, 2: -0.15, 3: 1.0 / 60.0}
    slope = sum(weight * (loss(DAMPING + at * step) - loss(DAMPING - at * step)) / 1e-2 for at, weight in weights.items())
    assert run.driver.state.total[POWERS.index("damping_loss")] == pytest.approx(loss(DAMPING), rel=1e-6)
    assert run.total[POWERS.index("damping_loss"), 0] == pytest.approx(slope, rel=2e-7)


def test_warning_of_integrals_that_need_too_many_parts(monkeypatch):
    """A pass whose integrals keep an error says so."""

    def rough_forward(*arguments, **options):
        return replace(forward(*arguments, **options), rough=2e-5)

    monkeypatch.setattr("scissordyn.sensitivity.gradient.forward", rough_forward)
    found = sd.gradient(mechanism(DAMPING), of=["damping_loss"], by=["hole.clearance"], until=4e-3, start="as-placed")
    assert "errors of about 2e-05 of their size" in found.attrs["warnings"]
