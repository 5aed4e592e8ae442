"""Impossible mechanisms are refused in one line that names their bodies and joints; possible ones run."""

import math
from itertools import combinations

import numpy as np
import pytest
from energy_balance import closure_error

import scissordyn as sd

PIN = sd.Clearance(1e-3)  # Clearance of the joints
GROUND = (("O", (0.0, 0.0)), ("P", (1.0, 0.0)), ("Q", (2.0, 0.0)))  # Ground with the points "O", "P" and "Q"


def part(name, *, x=0.0, length=1.0, **changed):
    """Return a bar with points "a", "c" (its middle) and "b"."""
    points = {"a": (0.0, 0.0), "b": (length, 0.0), "c": (0.5 * length, 0.0)}
    facts = {"mass": 1.0, "inertia": 0.1, "points": points, "centre": (0.5 * length, 0.0), "position": (x, 0.0)}
    return sd.Body(name, **{**facts, **changed})


def pin(name, journal, bearing, clearance=None):
    """Return a joint between points written as "body.point"."""
    (one, here), (other, there) = journal.split("."), bearing.split(".")
    return sd.Revolute(name, (one, here), (other, there), clearance)


HUNG = pin("hook", "u.a", "ground.O")  # Pin of body "u" at the ground
PENDULUM = part("bob")
"""Body that can always move, so that no mechanism is rejected because nothing in it can move."""


def mechanism(*bodies, **parts):
    """Return bodies with a free pendulum and the ground's points."""
    return sd.Mechanism(bodies=(*bodies, PENDULUM), **{"ground": GROUND, **parts})


def alone(**parts):
    """Return body "u" next to the free pendulum."""
    return mechanism(part("u"), **parts)


def hung(**parts):
    """Return body "u" on its pin next to the free pendulum."""
    return alone(joints=(HUNG,), **parts)


def welded(**parts):
    """Return two bars welded end to end, pinned to the ground at one end."""
    weld = sd.Weld("seam", ("u", "b"), ("v", "a"))
    return mechanism(part("u"), part("v", x=1.0), joints=(HUNG, *parts.pop("joints", ())), welds=(weld,), **parts)


def spoke(name, x, stretch=1.0):
    """Return a bar from (x, 0) to (0.5, 1)."""
    return part(name, x=x, length=stretch * math.hypot(0.5 - x, 1.0), angle=math.atan2(1.0, 0.5 - x))


def tripod(stretch):
    """Return three bars from the ground to one pin, one of them redundant, with a bar that hangs there."""
    joints = [pin(f"foot {n}", f"{n}.a", f"ground.{p}") for n, p in zip("uvw", "OPQ", strict=True)]
    joints += [pin("head v", "v.b", "u.b"), pin("head w", "w.b", "u.b"), pin("hinge", "x.a", "u.b")]
    hanging = part("x", position=(0.5, 1.0))
    return mechanism(spoke("u", 0.0), spoke("v", 1.0), spoke("w", 2.0, stretch), hanging, joints=tuple(joints))


def braced_frame(spin):
    """Return four corners joined by six bars, one of them redundant, rotating about the origin."""
    corners = ((0.0, 0.0), (1.0, 0.0), (1.1, 1.2), (-0.1, 0.9))
    bodies, joints, first = [], [], dict[int, str]()
    for i, j in combinations(range(4), 2):
        (x, y), end = corners[i], corners[j]
        name = f"bar {i}{j}"
        length, angle = math.dist((x, y), end), math.atan2(end[1] - y, end[0] - x)
        turning = {"velocity": (-spin * y, spin * x), "angular_velocity": spin}
        bodies.append(part(name, length=length, position=(x, y), angle=angle, **turning))
        for corner, point in ((i, "a"), (j, "b")):
            if corner in first:
                joints.append(pin(f"pin {name} {point}", first[corner], f"{name}.{point}"))
            first.setdefault(corner, f"{name}.{point}")
    return sd.Mechanism(bodies=tuple(bodies), joints=tuple(joints), gravity=0.0)


def driven_twice(array, first, second, ratio):
    """Return an array with drives of two bodies, and a free pendulum."""
    twice = array.driven(speed=1.0, body=first).driven(speed=ratio, body=second)
    return twice.replace("bodies", (*twice.bodies, PENDULUM))


def refused(build, *names):
    """Check that building or running raises an `InputError` of one line with these names ("this|or that")."""

    def build_and_run():
        sd.simulate(build(), until=1e-3, samples=2, most_steps=100)

    with pytest.raises(sd.InputError) as caught:
        build_and_run()
    message = str(caught.value)
    assert "\n" not in message
    assert [name for name in names if not any(choice in message for choice in name.split("|"))] == []


# Functions that build an impossible mechanism, and names in its error, by fault
REFUSED = {
    # joints and drives that contradict each other
    "two pins at different distances": (
        lambda: mechanism(
            part("u"), part("v", length=1.1), joints=(HUNG, pin("left", "u.a", "v.a"), pin("right", "u.b", "v.b"))
        ),
        ("'left'|'right'", "'u'|'v'"),
    ),
    "two clearance joints at different distances": (
        lambda: mechanism(
            part("u"), part("v", length=1.1), joints=(HUNG, pin("left", "u.a", "v.a", PIN), pin("right", "u.b", "v.b", PIN))
        ),
        ("'left'|'right'", "'u'|'v'"),
    ),
    "ground pins too far apart": (lambda: alone(joints=(HUNG, pin("far", "u.b", "ground.Q"))), ("'hook'|'far'", "'u'")),
    "one point on two ground pins": (lambda: alone(joints=(HUNG, pin("other", "u.a", "ground.P"))), ("'hook'|'other'", "'u'")),
    "weld and pin": (lambda: welded(joints=(pin("peg", "u.c", "v.b"),)), ("'seam'|'peg'", "'u'|'v'")),
    "ground pin and ground weld": (
        lambda: alone(joints=(pin("peg", "u.a", "ground.P"),), welds=(sd.Weld("foot", ("u", "a"), ("ground", "O")),)),
        ("'foot'|'peg'", "'u'"),
    ),
    "loop that does not close": (
        lambda: mechanism(
            part("u"),
            part("v", x=1.0),
            joints=(HUNG, pin("knee", "u.b", "v.a"), pin("far", "v.b", "ground.F")),
            ground=(("O", (0.0, 0.0)), ("F", (3.0, 0.0))),
        ),
        ("'hook'|'knee'|'far'", "'u'|'v'"),
    ),
    "third bar too long": (lambda: tripod(1.01), ("'foot w'|'head w'", "'w'")),
    "guide beside a ground pin": (lambda: hung(guides=(sd.Guide("rail", ("u", "a"), through=(0.0, 1.0)),)), ("'rail'", "'u'")),
    "guide out of reach": (lambda: hung(guides=(sd.Guide("rail", ("u", "b"), through=(0.0, 3.0)),)), ("'rail'", "'u'")),
    "moving guide out of reach": (
        lambda: mechanism(
            part("u"),
            part("v", x=2.0),
            joints=(HUNG, pin("post", "v.a", "ground.Q")),
            guides=(sd.Guide("rail", ("v", "b"), through=(0.0, 9.0), body="u"),),
        ),
        ("'rail'", "'u'|'v'"),
    ),
    "drives of welded bodies": (
        lambda: welded().driven(speed=1.0, body="u").driven(speed=2.0, body="v"),
        ("'seam'", "'u'|'v'"),
    ),
    "drive of a body welded to the ground": (
        lambda: alone(welds=(sd.Weld("foot", ("u", "a"), ("ground", "O")),)).driven(speed=1.0, body="u"),
        ("'foot'", "'u'"),
    ),
    "drives of parallel cranks": (
        lambda: driven_twice(sd.n_four_bar(1), "crank 0", "crank 1", 2.0),
        ("'crank 0'", "'crank 1'"),
    ),
    "drive of a coupler that cannot turn": (lambda: sd.n_four_bar(1).driven(speed=1.0, body="coupler 1"), ("'coupler 1'",)),
    "drives of crank and rocker": (
        lambda: driven_twice(sd.four_bar(), "crank", "rocker", 2.0),
        ("'crank'|'rocker'|'coupler'", "drive"),
    ),
    "drives of crank and rod": (lambda: driven_twice(sd.slider_crank(), "crank", "rod", 1.0), ("'crank'|'rod'", "drive")),
    "drives of both bars of a unit": (
        lambda: driven_twice(sd.scissor(units=1), "unit 1/bar 1", "unit 1/bar 2", 1.0),
        ("'unit 1/bar 1'|'unit 1/bar 2'", "drive"),
    ),
    "drives of two units": (
        lambda: driven_twice(sd.scissor(units=2), "unit 1/bar 1", "unit 2/bar 1", 1.5),
        ("'unit 1/bar 1'", "'unit 2/bar 1'"),
    ),
    # parts that cannot be, and names that are not there
    "clearance joint inside a body": (lambda: pin("play", "u.a", "u.b", PIN), ("'play'", "'u'")),
    "clearance joint inside a rigid pair": (lambda: welded(joints=(pin("play", "u.b", "v.a", PIN),)), ("'play'", "'u'", "'v'")),
    "clearance joint beside an ideal one": (
        lambda: alone(joints=(HUNG, pin("play", "u.a", "ground.O", PIN))),
        ("'play'", "'hook'"),
    ),
    "clearance joint between points of the ground": (lambda: pin("play", "ground.O", "ground.P", PIN), ("'play'", "'ground'")),
    "bar without length": (lambda: sd.bar("u", length=0.0, mass=1.0), ("'u'",)),
    "spring without length that pushes": (
        lambda: hung(components=(sd.Spring("coil", ("u", "b"), ("ground", "P"), 10.0, 0.3),)),
        ("'coil'",),
    ),
    "rod between points at one place, but for rounding": (
        lambda: mechanism(
            part("u", length=0.05 + 0.12),
            joints=(HUNG,),
            ground=(*GROUND, ("R", (0.17, 0.0))),
            rods=(sd.Rod("stay", ("u", "b"), ("ground", "R")),),
        ),
        ("'stay'", "different positions"),
    ),
    "negative inertia": (lambda: part("u", inertia=-0.1), ("'u'",)),
    "no inertia": (lambda: part("u", inertia=0.0), ("'u'",)),
    "negative mass": (lambda: part("u", mass=-1.0), ("'u'",)),
    "negative inertia of a bar": (lambda: sd.bar("u", length=1.0, mass=1.0, inertia=-1.0), ("'u'",)),
    "inertia lost beside the mass centre's distance": (
        lambda: mechanism(part("u", inertia=1e-12, centre=(1e3, 0.0))),
        ("'u'",),
    ),
    "mass centre that is no number": (lambda: part("u", centre=(math.nan, 0.0)), ("'u'",)),
    "ground point that is no number": (lambda: hung(ground=(("O", (math.nan, 5.0)),)), ("'O'", "ground")),
    "guide through no number": (lambda: alone(guides=(sd.Guide("rail", ("u", "a"), through=(math.nan, 0.0)),)), ("'rail'",)),
    "two ground points of one name": (lambda: hung(ground=(("O", (0.0, 0.0)), ("O", (1.0, 0.0)))), ("'O'",)),
    "two bodies of one name": (lambda: mechanism(part("u"), part("u")), ("'u'",)),
    "two joints of one name": (lambda: alone(joints=(HUNG, HUNG)), ("'hook'",)),
    "unknown body of a joint": (lambda: alone(joints=(pin("knee", "w.a", "u.b"),)), ("'knee'", "'w'")),
    "unknown point of a joint": (lambda: alone(joints=(pin("knee", "u.z", "bob.a"),)), ("'knee'", "'u'", "'z'")),
    "unknown point of the ground": (lambda: alone(joints=(pin("knee", "u.a", "ground.Z"),)), ("'knee'", "'ground'", "'Z'")),
    "unknown follower of a guide": (lambda: alone(guides=(sd.Guide("rail", ("w", "a")),)), ("'rail'", "'w'")),
    "unknown carrier of a guide": (lambda: alone(guides=(sd.Guide("rail", ("u", "a"), body="w"),)), ("'rail'", "'w'")),
    "guided point of the ground": (
        lambda: alone(guides=(sd.Guide("rail", ("ground", "O"), body="u"),)),
        ("'rail'", "'ground'"),
    ),
    "guide on a body that does not turn": (
        lambda: mechanism(part("u"), part("v", inertia=None), guides=(sd.Guide("rail", ("u", "a"), body="v"),)),
        ("'rail'", "'v'"),
    ),
    "pin beside the mass centre of a body without inertia": (
        lambda: mechanism(part("u", inertia=None), joints=(HUNG,)),
        ("'hook'", "'u'", "no inertia", "mass centre"),
    ),
    "spring beside the mass centre of a body without inertia": (
        lambda: mechanism(
            part("u", inertia=None, centre=(0.0, 0.0)),
            joints=(HUNG,),
            components=(sd.Spring("coil", ("u", "b"), ("ground", "O"), 1.0),),
        ),
        ("'coil'", "'u'", "no inertia"),
    ),
    "unknown body of a weld": (lambda: alone(welds=(sd.Weld("seam", ("u", "a"), ("w", "a")),)), ("'seam'", "'w'")),
    "unknown body of a spring": (
        lambda: alone(components=(sd.Spring("coil", ("u", "a"), ("w", "a"), 1.0),)),
        ("'coil'", "'w'"),
    ),
    "unknown body of a torsion spring": (
        lambda: alone(components=(sd.TorsionSpring("coil", "w", stiffness=1.0),)),
        ("'coil'", "'w'"),
    ),
    "unknown body of a motor": (lambda: alone(components=(sd.Motor("fan", "w", 1.0, 1.0),)), ("'fan'", "'w'")),
    "unknown body of a force": (lambda: alone(components=(sd.Force("push", ("w", "a"), (1.0, 0.0)),)), ("'push'", "'w'")),
    "unknown driven body": (lambda: mechanism(part("u")).driven(speed=1.0, body="w"), ("'w'", "drive")),
    "unknown input body": (lambda: alone(input_body="w"), ("'w'", "input")),
    "unknown joint to give clearance": (lambda: sd.scissor().with_clearance("B", PIN), ("'B'", "unit 1/pivot")),
    "unknown joint to make ideal": (lambda: sd.scissor().ideal("B"), ("'B'", "unit 1/pivot")),
    "unknown joint to change": (lambda: sd.scissor().replace("B.clearance", 1e-3), ("'B'", "unit 1/pivot")),
}


@pytest.mark.parametrize("case", REFUSED)
def test_impossible_mechanisms(case):
    """Contract: the error has one line and names the parts, or the part and its body."""
    build, names = REFUSED[case]
    refused(build, *names)


# Functions that build an unusual mechanism, and whether its reactions are determined
ALLOWED = {
    "free body": (lambda: mechanism(part("u")), True),
    "bodies that nothing joins": (lambda: mechanism(part("u"), part("v"), joints=(HUNG,)), True),
    "two joints at one point": (lambda: mechanism(part("u"), part("v"), joints=(HUNG, pin("knee", "u.a", "v.a"))), True),
    "joint given twice": (lambda: alone(joints=(HUNG, pin("again", "u.a", "ground.O"))), False),
    "structure without freedom": (lambda: alone(joints=(HUNG, pin("other", "u.b", "ground.P"))), False),
    "one bar more than needed": (lambda: tripod(1.0), False),
    "turning frame with a bar more than needed": (lambda: braced_frame(1.0), False),
    "beam in two clearance joints": (
        lambda: sd.Mechanism(
            bodies=(part("u"),),
            joints=(pin("left", "u.a", "ground.O", PIN), pin("right", "u.b", "ground.P", PIN)),
            ground=GROUND,
        ),
        True,
    ),
    "crank that is driven and nothing else": (
        lambda: sd.Mechanism(bodies=(part("u"),), joints=(HUNG,), ground=GROUND).driven(speed=1.0, body="u"),
        True,
    ),
    "driven parallelogram": (lambda: sd.n_four_bar(1, speed=0.0).driven(speed=-1.0), True),
}


@pytest.mark.parametrize("case", ALLOWED)
def test_possible_mechanisms(case):
    """Identity: under-constrained, disconnected and consistently over-constrained mechanisms run.

    Energy balances to 1e-8 J and joints stay closed; only undetermined reactions are NaN, with a warning.
    """
    build, determined = ALLOWED[case]
    allowed = build()
    run = sd.simulate(allowed, until=0.05, samples=11, rtol=1e-10, atol=1e-10)
    assert run.attrs["status"] == "complete"
    assert closure_error(run, allowed) < 1e-12
    for name in ("position", "angle", "velocity", "acceleration", "kinetic_energy", "energy_residual"):
        assert np.all(np.isfinite(run[name].values)), name
    assert float(np.max(np.abs(run["energy_residual"]))) < 1e-8
    assert bool(np.all(np.isfinite(run["reaction"].values))) is determined
    assert ("not determined" in run.attrs["warnings"]) is not determined
