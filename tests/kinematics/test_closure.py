"""Closure equations against closed forms of linkages: guides on moving bodies, rods, every assembly."""

import dataclasses
import math

import numpy as np
import pytest
from tests.mechanics.test_moving_guides import lever_angle, quick_return
from tests.test_couplings import coupled_arms

import scissordyn as sd
from scissordyn.kinematics.branching import _closed_along, _passed
from scissordyn.kinematics.closure import Closure
from scissordyn.plan.plan import plan


def closed(mechanism):
    """Return the closure equations of a mechanism."""
    return Closure(plan(mechanism))


def angle_of(closure, z, body):
    """Return the angle of a body in the solution z."""
    d = closure.first[body] + 2
    return math.atan2(z[d + 1], z[d])


@pytest.mark.parametrize("turn", [0.3, 1.7, 3.9])
def test_a_slot_beside_a_lever(turn):
    """Closed form: the slot passes its offset to the left of the lever's pivot; the mechanism closes as it is placed there.

    From a guess that is a little off, and a crank turned further, the lever is at atan2 - arcsin(offset/distance) again.
    """
    closure = closed(quick_return(turn))
    placed, inputs = closure.placed(), np.array([turn])
    assert np.max(np.abs(closure.residual(placed, inputs))) < 1e-14
    for further in (0.0, 0.1, -0.15):
        z = closure.close(placed + 1e-3, inputs + further)
        assert angle_of(closure, z, "lever") == pytest.approx(lever_angle(turn + further), abs=1e-11)
        assert angle_of(closure, z, "crank") == pytest.approx(math.remainder(turn + further, 2.0 * math.pi), abs=1e-12)


def four_bar(**rod):
    """Return a crank and a rocker with a massless rod between their ends."""
    crank = sd.bar("crank", length=0.3, mass=1.0, angle=0.8)
    rocker = sd.bar("rocker", length=0.6, mass=1.0, angle=1.9, position=(0.9, 0.0))
    joints = (sd.Revolute("O", ("crank", "start"), ("ground", "O")), sd.Revolute("P", ("rocker", "start"), ("ground", "P")))
    link = sd.Rod("link", ("crank", "end"), ("rocker", "end"), **rod)
    ground = (("O", (0.0, 0.0)), ("P", (0.9, 0.0)))
    return sd.Mechanism((crank, rocker), joints=joints, rods=(link,), ground=ground).driven(speed=1.0, body="crank")


def rocker_angle(turn, length):
    """Return both possible angles of the rocker, by the law of cosines in the triangle of rod, rocker and diagonal."""
    x, y = 0.3 * math.cos(turn) - 0.9, 0.3 * math.sin(turn)
    diagonal = math.hypot(x, y)
    between = math.acos((0.36 + diagonal**2 - length**2) / (1.2 * diagonal))
    return math.atan2(y, x) - between, math.atan2(y, x) + between


@pytest.mark.parametrize("turn", [0.8, 1.4, 2.5])
def test_a_four_bar_linkage(turn):
    """Closed form: both assemblies of a four-bar linkage are closed; Newton's method finds that near its guess."""
    mechanism = four_bar()
    length = math.dist(mechanism.place(("crank", "end")), mechanism.place(("rocker", "end")))
    closure = closed(mechanism)
    for angle in rocker_angle(turn, length):
        guess = closure.placed()
        for body, at in (("crank", turn), ("rocker", angle + 0.05)):
            d = closure.first[body] + 2
            guess[d], guess[d + 1] = math.cos(at), math.sin(at)
        z = closure.close(guess, np.array([turn]))
        assert math.remainder(angle_of(closure, z, "rocker") - angle, 2.0 * math.pi) == pytest.approx(0.0, abs=1e-11)


def test_a_rod_that_changes_its_length():
    """Closed form: the same with a rod of 0.7 m + 0.1 m/s t: its length is an input beside the crank's angle."""
    closure = closed(four_bar(motion=sd.Polynomial((0.7, 0.1))))
    assert np.allclose(closure.inputs.at(0.5), [0.8 + 0.5, 0.75])
    assert np.allclose(closure.inputs.over(np.array([0.0, 2.0])), [[0.8, 0.7], [2.8, 0.9]])
    near = rocker_angle(1.3, 0.75)
    guess = closure.placed()
    z = closure.close(guess, closure.inputs.at(0.5))
    assert min(abs(math.remainder(angle_of(closure, z, "rocker") - one, 2.0 * math.pi)) for one in near) < 1e-11


@pytest.mark.parametrize("mechanism", [quick_return(0.3), four_bar(), coupled_arms()], ids=["slot", "rod", "belt"])
def test_derivatives(mechanism):
    """Cross-check: gradients, directional and second derivatives of the equations by differences."""
    closure = closed(mechanism)
    random = np.random.default_rng(3)
    z = closure.placed() + 0.05 * random.normal(size=closure.total)
    one, other = random.normal(size=(2, closure.total))
    h = 1e-5
    by_differences = (closure.left_sides(z + h * one) - closure.left_sides(z - h * one)) / (2 * h)
    assert np.allclose(closure.derivative(z, one), by_differences, atol=1e-9)
    by_one = (closure.derivative(z + h * other, one) - closure.derivative(z - h * other, one)) / (2 * h)
    assert np.allclose(closure.second_derivative(z, one, other), by_one, atol=1e-9)
    change = random.normal(size=closure.free.shape[1])
    assert np.allclose(closure.jacobian(z) @ change, closure.derivative(z, closure.free @ change), atol=1e-12)


def test_nothing_near():
    """Limit: a linkage whose links are too short to meet has no closed position."""
    closure = closed(four_bar(motion=sd.Polynomial((0.7, 0.0, 1.0))))
    assert closure.close(closure.placed(), np.array([0.8, 1.9])) is None


def test_mobility():
    """Closed form: a four-bar linkage has none left with its crank given; a lever without its slot has one."""
    closure = closed(four_bar())
    closure.choose(closure.placed())
    assert closure.mobility == 0
    loose = closed(dataclasses.replace(quick_return(0.3), guides=()))
    loose.choose(loose.placed())
    assert loose.mobility == 1


def test_an_ideal_motion_far_from_a_run_does_not_stand_for_it():
    """Contract: the positions of a four-bar close along its own motion; with one of them elsewhere, they are not its own."""
    closure = closed(four_bar())
    time = np.linspace(0.0, 0.5, 6)
    z = [closure.placed()]
    for inputs in closure.inputs.over(time):
        found = closure.close(z[-1], inputs)
        z.append(found)
    motion = np.array(z[1:])
    assert _closed_along(closure, time, motion)
    motion[3, closure.first["rocker"]] += 0.25
    assert not _closed_along(closure, time, motion)


def test_samples_on_both_sides_of_a_passage_decide_about_it():
    """Closed form: between 1 and -1.5 the gradient falls to 0.5, not below a tenth of both; 50 before counts not."""

    class Line:
        def jacobian(self, z):
            return np.interp(z, [0.0, 1.0, 1.4, 2.0, 3.0], [50.0, 1.0, 0.5, -1.5, -3.0])[..., None]

    z = np.arange(4.0)[:, None]
    assert _passed(Line(), z[:, 0], z, np.zeros(4)) == []
