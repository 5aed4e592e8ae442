"""Springs, dampers, loads, motors, welds and time functions, by closed forms and energy balance."""

import math
from functools import partial

import numpy as np
import pytest
from tests.build import balanced, hanging

import scissordyn as sd
from scissordyn.mechanics.time_function import function_at, function_rows

TIGHT = {"rtol": 1e-11, "atol": 1e-11, "samples": 101}  # Options of `simulate` for accurate runs


FREQUENCY = math.sqrt(30.0 / 0.45)  # [rad/s] natural frequency of the bar on a spring of 30 N m/rad

balanced = partial(balanced, terms=("stored_energy", "potential_energy", "load_work"))


ON_A_PIN = {
    "spring": (
        sd.TorsionSpring("part", "rod", stiffness=30.0, free_angle=0.1),
        "angle",
        lambda t: 0.1 + 0.2 * np.cos(FREQUENCY * t),
    ),
    "damper": (sd.TorsionSpring("part", "rod", damping=0.9), "angular_velocity", lambda t: 5.0 * np.exp(-2.0 * t)),
    "torque": (sd.Torque("part", "rod", 0.9), "angular_velocity", lambda t: 2.0 * t),
    "growing torque": (
        sd.Torque("part", "rod", 0.9, time_function=sd.Polynomial((0.0, 1.0))),
        "angular_velocity",
        lambda t: t**2,
    ),
    "motor": (sd.Motor("part", "rod", 2.0, 10.0, inertia=0.05), "angular_velocity", lambda t: -10.0 * np.expm1(-0.4 * t)),
    "backwards": (sd.Motor("part", "rod", -2.0, 10.0), "angular_velocity", lambda t: 10.0 * np.expm1(-t / 2.25)),
    "at its limit": (sd.Motor("part", "rod", 9.0, 10.0, limit=0.45), "angular_velocity", lambda t: t),
}
"""Components on a bar with 0.45 kg m^2 about its pin, and the bar's angle over time; a damper slows it from 5 rad/s."""


@pytest.mark.parametrize("name", ON_A_PIN)
def test_bar_on_a_pin(name):
    """Closed form: a bar with a spring, a damper, a torque or a motor with a rotor; the energy balance closes."""
    part, variable, exact = ON_A_PIN[name]
    run = sd.simulate(hanging(part, spin=5.0 if name == "damper" else 0.0), until=1.0, **TIGHT)
    assert np.allclose(run[variable][:, 0], exact(run["time"].values), rtol=1e-8, atol=1e-8)
    assert balanced(run)


def test_point_spring_keeps_energy():
    """Identity: a spring with a damper between two points closes the energy balance; its energy follows from its length."""
    spring = sd.Spring("coil", ("rod", "end"), ("ground", "wall"), stiffness=200.0, free_length=0.4, damping=3.0)
    run = sd.simulate(hanging(spring, gravity=9.81), until=1.0, **TIGHT)
    assert balanced(run)
    tip = np.stack([np.cos(run["angle"][:, 0]), np.sin(run["angle"][:, 0])], axis=1)
    length = np.hypot(1.5 - tip[:, 0], 0.5 - tip[:, 1])
    assert np.allclose(run["stored_energy"], 100.0 * (length - 0.4) ** 2, rtol=1e-9)


def test_spring_between_free_masses():
    """Closed form: two masses on a spring oscillate with sqrt(k (1/m + 1/M)) about their fixed centre."""
    one, other = sd.point_mass("one", mass=2.0), sd.point_mass("other", mass=3.0, position=(1.2, 0.0))
    spring = sd.Spring("coil", ("one", "centre"), ("other", "centre"), stiffness=50.0, free_length=1.0)
    run = sd.simulate(sd.Mechanism((one, other), components=(spring,), gravity=0.0), until=2.0, **TIGHT)
    stretch = run["position"].sel(body="other", axis="x") - run["position"].sel(body="one", axis="x") - 1.0
    assert np.allclose(stretch, 0.2 * np.cos(math.sqrt(50.0 * (1 / 2 + 1 / 3)) * run["time"]), atol=1e-8)
    assert balanced(run)


@pytest.mark.parametrize("method", ["dop853", "rodas5p"])
def test_forces_that_follow_a_body_or_keep_their_direction(method):
    """Closed form: a following force across the bar acts as a constant torque; a fixed force accelerates a free mass."""
    across = sd.Force("jet", ("rod", "end"), (0.0, 0.45), follows=True)
    run = sd.simulate(hanging(across), until=1.0, method=method, **TIGHT)
    assert np.allclose(run["angular_velocity"][:, 0], run["time"], atol=1e-8)
    ball = sd.point_mass("ball", mass=2.0)
    pull = sd.Force("pull", ("ball", "centre"), (4.0, 0.0), time_function=sd.Harmonic(0.0, 1.0, 3.0))
    thrown = sd.simulate(sd.Mechanism((ball,), components=(pull,), gravity=9.81), until=1.0, method=method, **TIGHT)
    exact = (2.0 / 3.0) * (1.0 - np.cos(3.0 * thrown["time"]))
    assert np.allclose(thrown["velocity"][:, 0, 0], exact, atol=1e-8)
    assert np.allclose(thrown["velocity"][:, 0, 1], -9.81 * thrown["time"], atol=1e-8)
    assert balanced(run)
    assert balanced(thrown)


def test_weld_is_rigid():
    """Identity: two welded bars move as one body with their common inertia."""
    one = sd.bar("one", length=1.0, mass=1.0, angle=0.2)
    other = sd.bar("other", length=0.5, mass=2.0, angle=1.2, position=(math.cos(0.2), math.sin(0.2)))
    pin = sd.Revolute("pin", ("one", "start"), ("ground", "origin"))
    weld = sd.Weld("weld", ("one", "end"), ("other", "start"))
    welded = sd.Mechanism((one, other), joints=(pin,), welds=(weld,), ground=(("origin", (0.0, 0.0)),))
    run = sd.simulate(welded, until=1.0, **TIGHT)
    assert np.allclose(run["angle"][:, 1] - run["angle"][:, 0], 1.0, atol=1e-12)
    centre = (np.array([0.5, 0.0]) + 2.0 * (np.array([1.0, 0.0]) + 0.25 * np.array([math.cos(1.0), math.sin(1.0)]))) / 3.0
    inertia = (
        1 / 12
        + 1 * 0.25
        + 2 * 0.25 / 12
        + 2 * np.sum((np.array([1.0, 0.0]) + 0.25 * np.array([math.cos(1), math.sin(1)])) ** 2)
    )
    about_centre = inertia - 3.0 * float(np.sum(centre**2))
    single = sd.Body("one", 3.0, about_centre, {"start": (0.0, 0.0)}, centre=tuple(centre.tolist()), angle=0.2)
    lone = sd.simulate(sd.Mechanism((single,), joints=(pin,), ground=(("origin", (0.0, 0.0)),)), until=1.0, **TIGHT)
    assert np.allclose(run["angle"][:, 0], lone["angle"][:, 0], atol=1e-9)


# One time function of each class
MOTIONS = [
    sd.ConstantSpeed(3.0),
    sd.Harmonic(0.1, 0.4, 7.0, 0.3),
    sd.Polynomial((0.1, -0.2, 0.3, 0.4, -0.5, 0.6)),
    sd.Cycloidal(0.2, 1.4, 0.8),
    sd.Trapezoidal(0.2, 1.4, 0.8, 0.3),
    sd.Trapezoidal(0.2, 1.4, 0.25, 0.3, 3),
    sd.Tabulated(tuple(np.linspace(0, 1, 31)), tuple(np.sin(3 * np.linspace(0, 1, 31)))),
]


@pytest.mark.parametrize("motion", MOTIONS, ids=lambda motion: type(motion).__name__)
def test_time_functions_and_their_derivatives(motion):
    """Cross-check: each derivative of a time function is the central difference of the previous one."""
    rows, here, up, down = function_rows(motion, 0.7), np.zeros(4), np.zeros(4), np.zeros(4)
    for t in (0.05, 0.31, 0.43, 0.77, 0.93):
        function_at(t, rows, here)
        function_at(t + 1e-5, rows, up)
        function_at(t - 1e-5, rows, down)
        assert np.allclose(here[1:], (up[:3] - down[:3]) / 2e-5, rtol=1e-6, atol=1e-6 * (1 + np.max(np.abs(here))))


@pytest.mark.parametrize("motion", [sd.Cycloidal(0.2, 1.4, 0.8), sd.Trapezoidal(0.2, 1.4, 0.8, 0.3)])
def test_moves_start_and_end(motion):
    """Closed form: moves begin at their start, end at their end, stay there, and have a continuous speed."""
    rows, value = function_rows(motion, 0.0), np.zeros(4)
    for t, expected in ((-1.0, 0.2), (0.0, 0.2), (0.4, 0.8), (0.8, 1.4), (5.0, 1.4)):
        function_at(t, rows, value)
        assert value[0] == pytest.approx(expected, abs=1e-12)
    speeds = []
    for t in np.linspace(-0.01, 0.81, 4001):
        function_at(t, rows, value)
        speeds.append(value[1])
    assert np.max(np.abs(np.diff(speeds))) < 0.01


def test_motor_driven_array_with_clearance_joint():
    """Identity: a motor, a hinge spring and a clearance joint with friction together close the energy balance."""
    arm = sd.scissor(units=2).with_clearance("A", sd.Clearance(5e-4, friction=sd.LuGre(0.05)))
    elements = (
        sd.Motor("motor", "unit 1/bar 1", 3000.0, 20.0, inertia=1.0),
        sd.TorsionSpring("hinge", "unit 1/bar 2", "unit 1/bar 1", stiffness=100.0, free_angle=-2.0, damping=1.0),
    )
    run = sd.simulate(arm.replace("components", elements), until=0.05, samples=501)
    assert run.attrs["status"] == "complete"
    assert run.sizes["contact"] > 0
    assert balanced(run, 1e-6)


def test_slot_on_a_rotating_arm():
    """Closed form: a bead in a frictionless radial slot of an arm at constant speed moves outwards as cosh(w t)."""
    arm = sd.bar("arm", length=1.0, mass=1.0)
    bead = sd.point_mass("bead", mass=0.2, position=(0.3, 0.0))
    bead = sd.Body(**{**bead.__dict__, "velocity": (0.0, 0.3 * 4.0)})
    pin = sd.Revolute("pin", ("arm", "start"), ("ground", "origin"))
    slot = sd.Guide("slot", ("bead", "centre"), body="arm")
    slotted = sd.Mechanism((arm, bead), joints=(pin,), guides=(slot,), ground=(("origin", (0.0, 0.0)),), gravity=0.0)
    run = sd.simulate(slotted.driven(speed=4.0, body="arm"), until=0.4, **TIGHT)
    radius = np.hypot(*run["position"].sel(body="bead").values.T)
    exact = 0.3 * np.cosh(4.0 * run["time"].values)
    assert np.allclose(radius, exact, rtol=1e-9)
    side = 0.2 * 2.0 * 4.0 * 1.2 * np.sinh(4.0 * run["time"].values)
    assert np.allclose(run["drive_torque"], side * exact, rtol=1e-8, atol=1e-9)
    across = np.stack([-np.sin(4.0 * run["time"].values), np.cos(4.0 * run["time"].values)], axis=1)
    assert np.allclose(run["reaction"].sel(joint="slot"), side[:, None] * across, atol=1e-8)
    assert balanced(run)


@pytest.mark.parametrize("method", ["dop853", "rodas5p"])
def test_prescribed_motion_from_rest_and_back(method):
    """Identity: the work of a drive that starts from rest, stops or returns equals the gain of kinetic and stored energy.

    A mechanism without freedom has no step error, so that steps must not skip the motion after rest or at a reversal.
    """
    spring = sd.TorsionSpring("hinge", "rod", stiffness=3.0)
    for motion in (
        sd.Harmonic(0.3, 0.5, 2.0 * math.pi, 0.5 * math.pi),
        sd.Polynomial((0.3, 0.0, 0.0, 0.8)),
        sd.Cycloidal(0.3, 1.3, 0.4),
    ):
        run = sd.simulate(hanging(spring).driven(motion, body="rod"), until=1.5, method=method, rtol=1e-9, atol=1e-9)
        energy = run["kinetic_energy"] + run["stored_energy"]
        gained = float(energy.max() - energy.min())
        assert float(np.max(np.abs(run["drive_work"] - energy + energy[0]))) < 1e-6 * gained
