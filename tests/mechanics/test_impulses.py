"""Latches that lock in a driven mechanism: the plastic loss, and the impulsive work of the drives."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from tests.build import warnings_of
from tests.reference.impulse import Chain, plastic_impact

import scissordyn as sd

TIGHT = {"rtol": 1e-11, "atol": 1e-11}  # Options of `simulate` for accurate runs
METHODS = ("dop853", "rodas5p")  # An explicit method and a stiff one
GROUND = (("O", (0.0, 0.0)),)  # Ground with one point at the origin


def chain(length, mass, angle, **parts):
    """Return bars in a row from a pin on the ground."""
    bodies, joints, place = [], [], np.zeros(2)
    for k, name in enumerate(("crank", "rod", "blade")[: len(length)]):
        bodies.append(sd.bar(name, length=length[k], mass=mass[k], angle=angle[k], position=tuple(place)))
        joints.append(sd.Revolute(f"pin {k}", (name, "start"), (bodies[k - 1].name, "end") if k else ("ground", "O")))
        place = place + length[k] * np.array([math.cos(angle[k]), math.sin(angle[k])])
    return sd.Mechanism(tuple(bodies), joints=tuple(joints), ground=GROUND, **parts)


def folding(speed=6.0):
    """Return a crank at constant speed with a rod, which a latch locks to it."""
    catch = sd.Latch("catch", "rod", base="crank", angle=-0.6)
    two = chain(np.array([0.5, 0.4]), np.array([1.0, 1.0]), np.array([0.0, 0.3]), latches=(catch,))
    return two.driven(body="crank", speed=speed)


@pytest.mark.parametrize("method", METHODS)
def test_latch_on_a_driven_crank(method):
    """Closed form: the rod's angular momentum about the pin, and the crank's about its bearing at a prescribed speed W.

    A jump w of the rod's angular velocity means an angular impulse m l^2 w/3 in the latch and an impulse m l w/2 in the pin,
    across the rod. The drive takes up both: its work is W w (m l^2/3 + m a l cos(phi)/2). Scipy solves the rod's equation
    of motion before the impact.
    """
    run = sd.simulate(folding(), until=0.2, method=method, samples=101, **TIGHT)
    speed, a, l = 6.0, 0.5, 0.4

    def rate(t, y):
        return y[1], -1.5 / l * (a * speed**2 * math.sin(y[0] - speed * t) + 9.81 * math.cos(y[0]))

    def reached(t, y):
        return float(y[0] - speed * t + 0.6)

    reached.terminal = True
    start = float(run["angular_velocity"].sel(body="rod").values[0])
    free = solve_ivp(rate, (0.0, 0.2), (0.3, start), method="DOP853", rtol=1e-13, atol=1e-13, events=reached)
    jump = speed - free.y[1, -1]
    assert run["event_time"].values == pytest.approx([free.t[-1]], rel=1e-9)
    assert run["event_loss"].values == pytest.approx([0.5 * l * l / 3.0 * jump**2], rel=1e-8)
    work = speed * jump * (l * l / 3.0 + 0.5 * a * l * math.cos(0.6))
    assert work == pytest.approx(14.7678, abs=1e-4)
    assert run["event_drive_work"].values == pytest.approx([work], rel=1e-8)
    assert float(run["switching_loss"][-1]) == float(run["event_loss"][0])
    assert float(np.max(np.abs(run["energy_residual"]))) < 1e-8
    (said,) = warnings_of(run)
    assert said.startswith("latch 'catch' locks at t = 0.0509008 s; the drives do 14.8 J of work")


@pytest.mark.parametrize("speed", [1.5, -2.0])
def test_latch_on_a_base_moved_by_a_jack(speed):
    """Closed form: a bar under a cart on a jack locks against the ground; the jack takes the pin's impulse along its direction.

    A jump w of the bar's angular velocity changes its mass centre's velocity by l w/2, so the pin carries m l w/2.
    """
    cart = sd.point_mass("cart", mass=3.0, position=(1.0, 0.0))
    bar = sd.bar("rod", length=0.8, mass=2.0, angle=-0.4, position=(1.0, 0.0))
    mechanism = sd.Mechanism(
        (cart, bar),
        joints=(sd.Revolute("pin", ("rod", "start"), ("cart", "centre")),),
        guides=(sd.Guide("rail", ("cart", "centre")),),
        rods=(sd.Rod("jack", ("ground", "O"), ("cart", "centre"), motion=sd.Polynomial((1.0, speed))),),
        latches=(sd.Latch("catch", "rod", angle=-1.1),),
        ground=GROUND,
    )
    run = sd.simulate(mechanism, until=0.4, samples=101, **TIGHT)
    (fall,) = run["event_speed"].values
    jump = fall  # the rod falls towards negative angles and is stopped
    assert run["event_loss"].values == pytest.approx([0.5 * 2.0 * 0.8**2 / 3.0 * jump**2], rel=1e-9)
    across = 2.0 * 0.4 * jump * -math.sin(-1.1)
    assert run["event_drive_work"].values == pytest.approx([speed * across], rel=1e-9)
    assert float(np.max(np.abs(run["energy_residual"]))) < 1e-8


@pytest.mark.parametrize("seed", range(6))
def test_latches_in_random_driven_chains(seed):
    """Second formulation: momentum balance in coordinates of mass centres, with one or two driven bars."""
    random = np.random.default_rng(seed)
    length, mass = random.uniform(0.2, 0.6, 3), random.uniform(0.5, 3.0, 3)
    angle, drives = random.uniform(-1.0, 1.0, 3), {0: float(random.uniform(-6.0, 6.0))}
    if seed % 2:
        drives[1] = float(random.uniform(-6.0, 6.0))
    side = -1.0 if seed % 3 else 1.0
    catch = sd.Latch("catch", "blade", base="rod", angle=angle[2] - angle[1] + 0.2 * side)
    arm = chain(length, mass, angle, latches=(catch,))
    for bar, speed in drives.items():
        arm = arm.driven(body=("crank", "rod")[bar], speed=speed)
    arm = arm.with_parts({"components": (sd.Torque("spin", "blade", base="rod", torque=8.0 * side),)})
    found = sd.simulate(arm, until=1.0, samples=3, **TIGHT)
    (when,) = found["event_time"].values
    run = sd.simulate(arm, until=when * (1.0 - 1e-10), samples=2, **TIGHT).isel(time=-1)
    before = np.concatenate([run["velocity"].values, run["angular_velocity"].values[:, None]], axis=1).ravel()
    loss, work = plastic_impact(Chain(length, mass, run["angle"].values), before, drives, (2, 1))
    assert loss > 0.0
    assert found["event_loss"].values == pytest.approx([loss], rel=1e-7)
    assert found["event_drive_work"].values == pytest.approx([work], rel=1e-7, abs=1e-7 * loss)
    assert float(np.max(np.abs(found["energy_residual"]))) < 1e-7 * float(np.max(found["kinetic_energy"]))


def test_measures_contain_the_impulses():
    """Identity: the drive work of a batch and of a cycle includes the impulses, as that of the run."""
    run = sd.simulate(folding(), until=0.2)
    many = sd.simulate_many(folding(), {"gravity": [9.81]}, until=0.2, measures=("drive_work",))
    assert float(many["drive_work"][0]) == pytest.approx(float(run["drive_work"][-1]), rel=1e-6)
    once = sd.cycle(folding(), cycles=1, period=0.2, rtol=1e-8, atol=1e-8)
    assert float(once["drive_work"][0]) == pytest.approx(float(run["drive_work"][-1]), rel=1e-6)
    assert float(once["dissipated_energy"][0]) == pytest.approx(float(run["dissipated_energy"][-1]), rel=1e-6)
