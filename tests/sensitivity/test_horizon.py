"""Gradients end at the predictability horizon of their run."""

import json
import math
from pathlib import Path

import pytest

import scissordyn as sd


def crank(speed):
    """Return a slider-crank with clearance, whose motion is chaotic at 3000 rpm."""
    pin = sd.Clearance(0.5e-3, journal_radius=9.5e-3, stiffness=sd.Hertz(), damping=sd.LankaraniNikravesh(0.9))
    return sd.slider_crank().driven(speed=sd.rpm(speed)).with_clearance("slider pin", pin)


def pendulum(angle):
    """Return a double pendulum of two equal bars in line, `angle` [rad] above the horizontal."""
    points = {"near end": (0.0, 0.0), "far end": (1.0, 0.0)}
    places = {"upper": (0.0, 0.0), "lower": (math.cos(angle), math.sin(angle))}
    bodies = tuple(
        sd.Body(name, mass=1.0, inertia=1.0 / 12.0, points=points, centre=(0.5, 0.0), position=place, angle=angle)
        for name, place in places.items()
    )
    joints = (
        sd.Revolute("A", ("upper", "near end"), ("ground", "pivot")),
        sd.Revolute("B", ("lower", "near end"), ("upper", "far end")),
    )
    return sd.Mechanism(bodies=bodies, joints=joints, ground=(("pivot", (0.0, 0.0)),), gravity=9.81)


PAPER = Path(__file__).parent.parent.parent / "examples/paper.toml"

# Mechanism, parameter, options of the run, and whether it diverges
CASES = {
    "crank at 3000 rpm": (lambda: crank(3000.0), "drive.speed", {"until": 0.1, "rtol": 1e-9}, True),
    "crank at 300 rpm": (lambda: crank(300.0), "drive.speed", {"until": 0.1, "rtol": 1e-9}, False),
    "paper's array": (lambda: sd.read_case(PAPER).mechanism, "A.clearance", {"until": 0.05, "rtol": 1e-9}, False),
    "high pendulum": (lambda: pendulum(2.5), "body.lower.mass", {"until": 20.0, "rtol": 1e-6, "start": "as-placed"}, True),
    "low pendulum": (lambda: pendulum(-1.2), "body.lower.mass", {"until": 20.0, "rtol": 1e-6, "start": "as-placed"}, False),
}


@pytest.mark.parametrize("case", CASES)
def test_gradient_ends_before_the_horizon_of_a_tighter_run(case):
    """Cross-check: a run at a thousandth of the tolerance diverges later, and does not diverge in regular motion."""
    make, path, options, chaotic = CASES[case]
    mechanism = make()
    trusted = sd.simulate(mechanism, samples=2, events="located", trust=True, **options).attrs["trusted_until"]
    found = sd.gradient(mechanism, by=[path], trajectory=True, samples=2, change=1e-9, **options)
    if chaotic:
        assert found["limit"].item() == "horizon"
        assert 0.5 * trusted < found["valid_until"].item() <= trusted < options["until"]
        assert "another tolerance or step diverges" in json.loads(found.attrs["warnings"])[0]
    else:
        assert found["limit"].item() == ""
        assert found["valid_until"].item() == trusted == options["until"]


def test_an_earlier_limit_keeps_its_reason():
    """Contract: a change that moves a journal far before the horizon is still the reason."""
    found = sd.gradient(crank(3000.0), of=["peak_force"], by=["drive.speed"], until=0.1, rtol=1e-9)
    assert found["limit"].item() == "far"
    assert found["valid_until"].item() == pytest.approx(0.02512, rel=1e-3)
