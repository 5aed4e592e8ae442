"""Derivatives of runs whose controllers have a delay: the method of steps, and differences of runs."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
from tests.build import hanging

import scissordyn as sd
from scissordyn.model.parameter_path import changed
from scissordyn.plan.plan import plan
from scissordyn.run.advance.loop import advance
from scissordyn.run.trajectory import make_driver
from scissordyn.sensitivity import forward as pass_
from scissordyn.sensitivity.forward import Forward, forward
from scissordyn.sensitivity.part_error import PARTS_MAX
from scissordyn.sensitivity.seed import Start, derivatives, parameter_of

TORQUE = 0.45  # Torque of `lagging` divided by the delayed angular velocity [N m s]
INERTIA = 0.45  # Moment of inertia of the bar about its pin [kg m^2]


@sd.element(slot="controller", delay=1.0, recorded="speed")
def lagging(delayed):
    """Return a torque against the angular velocity one second ago."""
    return -0.45 * delayed


def slope_by_inertia(t: float) -> float:
    """Return dw/dI of I w' = -k w(t - 1), w = 1 up to t = 0, with w the sum of (-k/I)^n (t - n + 1)^n/n! over n <= t + 1."""
    rate = TORQUE / INERTIA
    return sum(-n / INERTIA * (-rate) ** n * (t - n + 1.0) ** n / math.factorial(n) for n in range(1, math.floor(t) + 2))


def run_of(mechanism: sd.Mechanism, options: sd.Options, paths: list[str]) -> Forward:
    begin = Start(mechanism, options.start)
    return forward(plan(mechanism), options, [derivatives(begin, parameter_of(mechanism, path, 1.0)) for path in paths])


@pytest.mark.parametrize("method", ["dop853", "dopri5", "rodas5p"])
def test_delay_equation(method):
    """Closed form: the method of steps; the torque follows the angular velocity of one second ago."""
    mechanism = hanging(spin=1.0).controlled(lagging())
    options = sd.Options(4.7, "as-placed", 2, 1e-12, 1e-12, method)
    run = run_of(mechanism, options, ["body.rod.inertia"])
    (x, y, vx, vy), (dx, dy, dvx, dvy) = run.driver.state.y, run.state[:, 0]
    size, turning = x * x + y * y, x * vy - y * vx  # a direction times the root of the inertia, and its rate
    by_scale = (dx * vy + x * dvy - dy * vx - y * dvx) / size - 2.0 * turning * (x * dx + y * dy) / size**2
    assert by_scale / mechanism.bodies[0].inertia == pytest.approx(slope_by_inertia(4.7), rel=1e-9)


@pytest.mark.parametrize("method", ["dop853", "rodas5p"])
def test_delay_and_gain(method):
    """Cross-check: derivatives by delay, gain and initial speed beside differences of eighth order; the onset is one delay."""
    spring = sd.TorsionSpring("spring", "rod", stiffness=3.0, damping=0.02)
    mechanism = hanging(spring, spin=1.0).controlled(sd.Pyragas(0.6, 0.31, recorded="speed", ramp=0.2))
    options = sd.Options(2.0, "as-placed", 2, 1e-12, 1e-12, method)
    name = mechanism.components[-1].name
    paths = [f"{name}.controller.delay", f"{name}.controller.gain", "body.rod.angular_velocity"]
    run = run_of(mechanism, options, paths)
    weights = {1: 4 / 5, 2: -1 / 5, 3: 4 / 105, 4: -1 / 280}
    for k, path in enumerate(paths):
        parameter, ends = parameter_of(mechanism, path, 1.0), np.zeros(4)
        for place, weight in weights.items():
            for sign in (1.0, -1.0):
                moved = changed(mechanism, path, parameter.value + sign * place * 1e-2 * parameter.scale)
                driver, _, _ = make_driver(plan(moved), options)
                advance(driver, options.until)
                ends += sign * weight / 1e-2 * driver.state.y
        assert run.state[:, k] == pytest.approx(ends, abs=1e-8 * np.max(np.abs(ends)))


def test_steps_that_no_delay_reaches_are_dropped(monkeypatch):
    """Cross-check: with a history that is full again and again the derivatives are the same."""
    mechanism = hanging(spin=1.0).controlled(lagging())
    options = sd.Options(12.0, "as-placed", 2, 1e-11, 1e-11, "rodas4p")
    long = run_of(mechanism, options, ["body.rod.inertia"])
    monkeypatch.setattr(pass_, "HISTORY_STEPS", 0)
    assert int(long.driver.state.counts["steps"][0]) > PARTS_MAX
    assert run_of(mechanism, options, ["body.rod.inertia"]).state == pytest.approx(long.state, rel=1e-13)


def test_curves_need_the_whole_history(monkeypatch):
    """Cross-check: signals over time that contain delayed ones are those of the run, from a history that was full before."""
    monkeypatch.setattr(pass_, "HISTORY_STEPS", 0)
    spring = sd.TorsionSpring("spring", "rod", stiffness=3e4)
    feedback = sd.ExtendedDelayedFeedback(0.6, 0.02, 0.5, recorded="speed", ramp=0.01)
    mechanism, options = (
        hanging(spring, spin=1.0).controlled(feedback),
        {"start": "as-placed", "method": "dopri5", "samples": 9},
    )
    found = sd.gradient(mechanism, by=["spring.stiffness"], until=0.4, rtol=1e-13, atol=1e-13, trajectory=True, **options)
    run = sd.simulate(mechanism, until=0.4, rtol=1e-13, atol=1e-13, **options)
    assert json.loads(run.attrs["statistics"])["steps"] > 4096
    assert found["recorded_speed"].values == pytest.approx(run["recorded_speed"].values, abs=1e-9)


def test_a_controller_that_begins_abruptly():
    """Contract: the derivative by the delay is refused if the torque jumps after it; that by the gain exists."""
    spring = sd.TorsionSpring("spring", "rod", stiffness=3.0)
    mechanism = hanging(spring, spin=1.0).controlled(sd.Pyragas(0.6, 0.31, recorded="speed"))
    options = sd.Options(0.6, "as-placed", 2, 1e-9, 1e-9, "dop853")
    name = mechanism.components[-1].name
    run_of(mechanism, options, [f"{name}.controller.gain"])
    with pytest.raises(sd.ScissordynError, match=r"abruptly after its delay; expected a ramp, for example ramp = 0\.01"):
        run_of(mechanism, options, [f"{name}.controller.delay"])


def test_largest_torque_at_an_abrupt_onset_has_no_derivative():
    """Contract: a largest value beside a jump, which the repetition sees from its other side, is NaN, and a warning says so."""
    motor = sd.Motor("motor", "disc", 3.0, 2.0)  # reaches its final speed within the delay
    disc = sd.Mechanism((sd.Body("disc", 0.1, 0.008, {"c": (0.0, 0.0)}),), components=(motor,), gravity=0.0, input_body="disc")
    controlled = disc.controlled(sd.Pyragas(0.04, 0.125), reference=sd.ConstantSpeed(2.3))
    name = f"{controlled.components[1].name}.peak_component_force"
    found = sd.gradient(controlled, of=[name], by=["motor.no_load_speed"], until=0.15)
    assert found["value"].values[0] > 0.0
    assert np.isnan(found["derivative"].values).all()
    assert json.loads(found.attrs["warnings"]) == [
        f"'{name}': no derivative by 1 parameter: its largest value is at a kink or a jump"
    ]


def test_a_ramp_that_is_zero_is_refused():
    """Contract: the derivative by a ramp at zero would be that of a jump."""
    controlled = hanging(gravity=9.81).controlled(sd.Pyragas(0.04, 0.125), reference=sd.ConstantSpeed(2.3))
    path = f"{controlled.components[0].name}.controller.ramp"
    with pytest.raises(sd.InputError, match=r"controller.ramp' = 0 means a jump"):
        sd.gradient(controlled, of=["peak_component_force"], by=[path], until=0.15)
