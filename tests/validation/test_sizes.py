"""Mechanisms of very many bodies, and very small ones."""

import math
import tracemalloc

import numpy as np
import pytest
from tests.build import one_line_error, warnings_of

import scissordyn as sd
from scissordyn.kinematics.branching import SEARCHED_EQUATIONS_MAX, passing_warnings
from scissordyn.plan.elimination import Elimination
from scissordyn.plan.linear_constraints import reduced
from scissordyn.plan.model import make_model
from scissordyn.plan.plan import plan


def chain(count):
    """Return an open chain of bars that hangs on the ground."""
    bodies, joints, end = [], [], (0.0, 0.0)
    for k in range(count):
        angle = 0.3 * math.sin(k)
        bodies.append(sd.bar(f"bar {k}", length=1.0, mass=1.0, position=end, angle=angle))
        joints.append(sd.Revolute(f"pin {k}", (f"bar {k}", "start"), (f"bar {k - 1}", "end") if k else ("ground", "O")))
        end = end[0] + math.cos(angle), end[1] + math.sin(angle)
    return sd.Mechanism(bodies=tuple(bodies), joints=tuple(joints), ground=(("O", (0.0, 0.0)),), gravity=9.81)


@pytest.mark.parametrize("make", [sd.scissor, sd.n_four_bar, sd.hoberman_ring, sd.polar_scissor, sd.mast])
def test_too_many_units_are_refused_at_once(make):
    """Contract: 1e9 units are refused in one line with the largest number."""
    with one_line_error("a whole number from ", " to 10000"):
        make(units=10**9)


def test_memory_of_an_open_chain():
    """Limit: a model of 100 bars with coupled coordinates takes megabytes, not the cube of their number."""
    mechanism = chain(100)
    coordinates = reduced(mechanism)
    tracemalloc.start()
    make_model(mechanism, coordinates)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    # maps of the directions take 100 x 200 x 2 numbers, 0.3 MB; a list of common entries of pairs took 160 MB
    assert peak < 20e6


def turned(count, excess):
    """Return directions around a ring, each rotated relative to the previous one, in all by a whole turn and an excess."""
    elimination = Elimination([False] * (2 * count), 1)
    for k in range(count):
        angle = 2.0 * math.pi / count + (excess if k == count - 1 else 0.0)
        a, b = 2 * k, 2 * ((k + 1) % count)
        cos, sin = math.cos(angle), math.sin(angle)
        elimination.impose({b: 1.0, a: -cos, a + 1: sin}, f"angle {k}")
        elimination.impose({b + 1: 1.0, a: -sin, a + 1: -cos}, f"angle {k}")
    elimination.rows()
    return elimination


def test_roundings_along_a_ring_are_no_constraint():
    """Limit: the sum of 5000 roundings does not fix the first direction; a thousandth does."""
    assert np.sum(turned(5000, 3e-12).solved_at[:10_000] < 0) == 2
    assert np.sum(turned(5000, 1e-3).solved_at[:10_000] < 0) == 0


@pytest.mark.slow
def test_ring_of_a_thousand_units():
    """Contract: a ring of 1000 units has the freedoms of one of 12."""
    few, many = (reduced(sd.hoberman_ring(units=units)) for units in (12, 1000))
    assert (many.free, len(many.constraints)) == (few.free, len(few.constraints))


@pytest.mark.slow
def test_array_of_two_thousand_units():
    """Contract: an array of 2000 units with a clearance joint runs, and reports the omitted search."""
    array = sd.scissor(units=2000).with_clearance("A", sd.Clearance(2e-4)).driven(speed=1.0)
    run = sd.simulate(array, until=0.01, samples=11)
    assert run.attrs["status"] == "complete"
    assert any("singular positions were not searched" in text for text in warnings_of(run))


def test_warning_of_an_omitted_search():
    """Contract: with too many closure equations a run warns that singular positions were not searched."""
    limit = SEARCHED_EQUATIONS_MAX
    array = sd.scissor(units=limit // 2 + 1).driven(speed=1.0)
    assert passing_warnings(plan(array), sd.simulate(sd.scissor(), until=1e-3, samples=3), 1e-3) == [
        f"singular positions were not searched: {limit + 2} closure equations exceed the limit of {limit}"
    ]


@pytest.mark.parametrize("rounding", [0.0, 3e-17, 1e-15])
def test_common_pin_with_rounded_coordinates(rounding):
    """Closed form: bodies on one pin whose coordinates differ by rounding are accepted; the mass centre falls freely."""
    hub = sd.Body("hub", 1.0, 0.1, {"one": (0.2, 0.1), "other": (0.2 + rounding, 0.1)})
    arms = tuple(
        sd.Body(name, 1.0, 0.1, {"end": (x, 0.1)}, position=(0.2 - x, 0.0)) for name, x in (("one", -0.3), ("other", 0.4))
    )
    pins = tuple(sd.Revolute(arm.name, (arm.name, "end"), ("hub", arm.name)) for arm in arms)
    run = sd.simulate(sd.Mechanism((hub, *arms), pins), until=0.1, samples=3)
    start, end = run["position"].mean("body").isel(time=[0, -1]).transpose("time", "axis").values
    assert end - start == pytest.approx([0.0, -0.5 * 9.81 * 0.1**2], abs=1e-12)


@pytest.mark.parametrize("size", [1e-6, 1e-7])
@pytest.mark.parametrize("clearance", [False, True])
def test_small_mechanisms_have_the_reactions_of_large_ones(size, clearance):
    """Identity: at a fixed Froude number all forces scale with the weight, also below 10 micrometres."""

    def run(size, mass):
        array = sd.scissor(bar_length=2.0 * size, bar_mass=5.0 * mass, slider_mass=4.0 * mass).driven(speed=3.0 / size**0.5)
        if clearance:
            play = sd.Clearance(5e-4 * size, journal_radius=1e-2 * size, bearing_length=1.5e-2 * size)
            array = array.with_clearance("A", play)
        return sd.simulate(array, until=0.01 * size**0.5, samples=5)

    large, small = run(1.0, 1.0), run(size, 1e-9)
    assert not [text for text in warnings_of(small) if "redundant" in text]
    assert np.allclose(
        1e9 * small["reaction"], large["reaction"], rtol=1e-6, atol=1e-6 * float(np.abs(large["reaction"]).max())
    )
    assert np.allclose(1e9 / size * small["drive_torque"], large["drive_torque"], rtol=1e-6)
