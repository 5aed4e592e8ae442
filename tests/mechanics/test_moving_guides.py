"""Guides on moving bodies: the reactions on follower and guide, and the positions at which a mechanism closes."""

import math

import numpy as np
import pytest

import scissordyn as sd

TIGHT = {"rtol": 1e-11, "atol": 1e-11, "samples": 61}  # Options of `simulate` for accurate runs
OFFSET = 0.12  # [m] distance of a slot from the pivot of its arm


def slotted(*, aligned, direction, spin=4.0):
    """Return a free arm on a pin with a slot parallel or oblique to its axis, and a follower in the slot."""
    arm = sd.bar("arm", length=1.0, mass=1.5, angle=0.3)
    arm = sd.Body(**{**arm.__dict__, "angular_velocity": spin})
    turn = np.array([[math.cos(0.3), -math.sin(0.3)], [math.sin(0.3), math.cos(0.3)]])
    place = turn @ (np.array([0.0, OFFSET]) + 0.4 * np.array([math.cos(direction), math.sin(direction)]))
    velocity = spin * np.array([-place[1], place[0]])
    block = sd.Body(
        *("block", 0.7, 0.02, {"centre": (0.0, 0.0)}),
        position=tuple(place),
        velocity=tuple(velocity),
        angle=0.3 if aligned else 0.0,
        angular_velocity=spin if aligned else 0.0,
    )
    pin = sd.Revolute("pin", ("arm", "start"), ("ground", "O"))
    slot = sd.Guide("slot", ("block", "centre"), through=(0.0, OFFSET), direction=direction, body="arm", aligned=aligned)
    return sd.Mechanism((arm, block), joints=(pin,), guides=(slot,), ground=(("O", (0.0, 0.0)),), gravity=9.81)


@pytest.mark.parametrize("method", ["dop853", "rodas5p"])
@pytest.mark.parametrize("direction", [0.0, 0.7])
@pytest.mark.parametrize("aligned", [False, True])
def test_reactions_on_both_bodies(aligned, direction, method):
    """Closed form: Newton and Euler for each body; the follower has the slot's force, the arm its opposite at the same point.

    The pin carries the rest of the momentum; about the pin, weight and the follower's force balance the arm's spin.
    """
    run = sd.simulate(slotted(aligned=aligned, direction=direction), until=0.4, method=method, **TIGHT)
    acceleration = run["acceleration"].values
    g = np.array([0.0, -9.81])
    arm, block = (list(run["body"].values).index(name) for name in ("arm", "block"))
    on_block = 0.7 * (acceleration[:, block] - g)
    assert np.allclose(run["reaction"].sel(joint="slot"), on_block, atol=1e-7)
    # across the slot: nothing pulls along it
    theta = run["angle"].values[:, arm] + direction
    along = np.stack([np.cos(theta), np.sin(theta)], axis=1)
    assert np.allclose(np.sum(on_block * along, axis=1), 0.0, atol=1e-7)
    assert np.max(np.abs(on_block)) > 1.0
    pin = 1.5 * (acceleration[:, arm] - g) + on_block
    assert np.allclose(run["reaction"].sel(joint="pin"), pin, atol=1e-7)
    # about the pin: I alpha = weight - moment of the follower's force - torque that keeps a block aligned
    place = run["position"].values[:, block]
    centre = run["position"].values[:, arm]
    alpha = run["angular_acceleration"].values[:, arm]
    moment = place[:, 0] * on_block[:, 1] - place[:, 1] * on_block[:, 0]
    torque = 0.02 * alpha if aligned else 0.0
    assert np.allclose(0.5 * alpha, -1.5 * 9.81 * centre[:, 0] - moment - torque, atol=1e-6)


def quick_return(turn, speed=2.0):
    """Return a crank whose pin slides in a slot of a lever that turns about a lower pivot."""
    r, d = 0.2, 0.5
    crank = sd.bar("crank", length=r, mass=1.0, angle=turn)
    lever = sd.bar("lever", length=1.0, mass=2.0, angle=lever_angle(turn), position=(0.0, -d))
    joints = (sd.Revolute("O", ("crank", "start"), ("ground", "O")), sd.Revolute("P", ("lever", "start"), ("ground", "P")))
    slot = sd.Guide("slot", ("crank", "end"), through=(0.0, OFFSET), body="lever")
    ground = (("O", (0.0, 0.0)), ("P", (0.0, -d)))
    made = sd.Mechanism((crank, lever), joints=joints, guides=(slot,), ground=ground)
    return made.driven(speed=speed, body="crank")


def lever_angle(turn):
    """Return the angle at which the slot's line passes through the crank's pin: atan2 - arcsin(offset/distance)."""
    x, y = 0.2 * math.cos(turn), 0.5 + 0.2 * math.sin(turn)
    return math.atan2(y, x) - math.asin(OFFSET / math.hypot(x, y))


def test_quick_return():
    """Closed form: the lever's angle over more than a turn of the crank."""
    run = sd.simulate(quick_return(0.3), until=4.0, samples=41)
    exact = [lever_angle(0.3 + 2.0 * t) for t in run["time"].values]
    assert np.allclose(run["angle"].sel(body="lever"), exact, atol=1e-9)
