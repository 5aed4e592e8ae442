"""Linear buckling of bars that bend: closed forms, an independent frame program, and loads raised to the limit."""

import math

import pytest
from scipy.optimize import brentq
from tests.build import on_pin

import scissordyn as sd
from reference.frame import Frame

# Length [m], mass [kg], bending stiffness EI [N m^2] and axial stiffness EA [N] of a bar
LENGTH, MASS, RIGIDITY, AXIAL = 2.0, 5.68, 42743.0, 7.5e7
KINDS = {"modes": 8}, {"elements": 8}  # Arguments of `with_bending` for a bar by modes and for beam elements
# Rigid bar that the tests make flexible, and the guide of its end
BAR, END = sd.bar("bar", length=LENGTH, mass=MASS), sd.Guide("end", ("bar", "end"))


def column(angle, *parts, gravity=0.0, rigidity=RIGIDITY, **kind):
    """Return a bar clamped at its start, at an angle."""
    bar = on_pin(sd.bar("bar", length=LENGTH, mass=MASS, angle=angle), *parts, gravity=gravity)
    return sd.with_bending(bar, **{"bending_stiffness": rigidity, "axial_stiffness": AXIAL} | kind).driven(speed=0.0)


def portal(load, **kind):
    """Return two clamped columns of 2 m and a beam of 2 m welded to both, with a force down on each corner."""
    left = sd.bar("left", length=LENGTH, mass=MASS, angle=0.5 * math.pi)
    right = sd.bar("right", length=LENGTH, mass=MASS, angle=0.5 * math.pi, position=(LENGTH, 0.0))
    beam = sd.bar("beam", length=LENGTH, mass=MASS, position=(0.0, LENGTH))
    welds = (
        sd.Weld("foot 1", ("left", "start"), ("ground", "O")),
        sd.Weld("foot 2", ("right", "start"), ("ground", "E")),
        sd.Weld("corner 1", ("left", "end"), ("beam", "start")),
        sd.Weld("corner 2", ("right", "end"), ("beam", "end")),
    )
    pushes = tuple(sd.Force(f"push {name}", (name, "end"), (0.0, -load)) for name in ("left", "right"))
    ground = (("O", (0.0, 0.0)), ("E", (LENGTH, 0.0)))
    made = sd.Mechanism((left, right, beam), (), welds=welds, ground=ground, gravity=0.0, components=pushes)
    return sd.with_bending(made, bending_stiffness=RIGIDITY, axial_stiffness=AXIAL, **kind)


@pytest.mark.parametrize("stiffness", [1e4, 1.0])
def test_a_free_turn_is_no_buckling(stiffness):
    ratios = []
    for kind in KINDS:
        pendulum = on_pin(sd.bar("bar", length=1.0, mass=2.0, angle=0.3), gravity=9.81)
        run = sd.simulate(sd.with_bending(pendulum, bending_stiffness=stiffness, axial_stiffness=1e6, **kind), until=0.05)
        assert run.attrs["warnings"] == "[]"
        ratios.append(run["bar_largest_buckling_ratio"].item())
        # a force spread along a bar buckles it later than one at its end
        assert run["bar_buckling_load"] > math.pi**2 * stiffness
    assert ratios[0] == pytest.approx(ratios[1], rel=0.05)


@pytest.mark.parametrize("kind", KINDS)
def test_a_bar_that_turns_freely_buckles_without_momentum_of_the_turn(kind):
    """Closed form: EI w'''' + P w'' = m x, w = w'' = 0 at the pin, no moment and shear at the end, the integral of x w zero."""

    def condition(k):
        return math.sin(k) - k * math.cos(k) - k**2 * math.sin(k) / 3.0 - 2.0 / 15.0 * k**4 * math.sin(k)

    load, stiffness, angle = 100.0, 250.0, 0.3
    raised = sd.Cycloidal(0.0, 1.0, 0.1)
    push = sd.Force("P", ("bar", "end"), (-load * math.cos(angle), -load * math.sin(angle)), time_function=raised)
    turning = on_pin(sd.bar("bar", length=LENGTH, mass=2.0, angle=angle), push)
    turning = sd.with_bending(turning, bending_stiffness=stiffness, axial_stiffness=1e6, damping=1e-3, **kind)
    run = sd.simulate(turning, until=0.11, samples=31)
    critical = brentq(condition, 1.0, 3.1) ** 2 * stiffness / LENGTH**2
    assert run["bar_largest_buckling_ratio"].item() == pytest.approx(load / critical, rel=2e-3)


@pytest.mark.parametrize("kind", KINDS)
def test_a_force_across_buckles_nothing(kind):
    """Closed form: a cantilever with a force across its tip has no factor, whatever EA."""
    for axial in (1e5, 1e9):
        push = sd.Force("push", ("bar", "end"), (0.0, 1.0))
        assert sd.buckling(column(0.0, push, axial_stiffness=axial, rigidity=100.0, **kind))["load_factor"].size == 0


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("leaning", [0.0, 5.0, 30.0, 60.0])
def test_a_leaning_column_buckles_by_the_part_of_the_load_along_it(kind, leaning):
    """Closed form: pi^2 EI/(4 L^2) over P cos(angle)."""
    push = sd.Force("push", ("bar", "end"), (0.0, -1000.0))
    found = sd.buckling(column(math.radians(90.0 - leaning), push, **kind), count=2)["load_factor"].values
    first = math.pi**2 * RIGIDITY / (4.0 * LENGTH**2) / (1000.0 * math.cos(math.radians(leaning)))
    assert found == pytest.approx([first, 9.0 * first], rel=2e-4)


@pytest.mark.parametrize("kind", KINDS)
def test_columns_between_pins_and_under_their_weight(kind):
    """Closed forms: pi^2 EI/L^2 and four times that; a clamped one under its weight, q L^3 = 7.83735 EI."""
    critical = math.pi**2 * RIGIDITY / LENGTH**2
    made = sd.with_bending(on_pin(BAR, guides=(END,)), bending_stiffness=RIGIDITY, axial_stiffness=1e9, **kind)
    with pytest.raises(sd.InputError, match="without loads"):
        sd.buckling(made)
    push = sd.Force("load", (made.bodies[-1].name, "end"), (-0.25 * critical, 0.0))
    found = sd.buckling(made.with_parts({"components": (*made.components, push)}), count=2)
    assert found["load_factor"].values == pytest.approx([4.0, 16.0], rel=1e-3)
    tall = column(0.5 * math.pi, gravity=9.81, rigidity=20.0, axial_stiffness=1e7, **kind)
    expected = 7.83735 * 20.0 / (MASS * 9.81 * LENGTH**2)
    assert float(sd.buckling(tall)["load_factor"][0]) == pytest.approx(expected, rel=1e-4)


@pytest.mark.parametrize("kind", KINDS)
def test_frames_agree_with_a_frame_program(kind):
    """Second formulation: a portal frame that sways, and an array of two units under its weight, clamped by its drive."""
    frame = Frame(AXIAL, RIGIDITY)
    corners = ("O", (0.0, 0.0)), ("A", (0.0, LENGTH)), ("B", (LENGTH, LENGTH)), ("E", (LENGTH, 0.0))
    for one, other in ((0, 1), (3, 2), (1, 2)):
        frame.member([corners[one], corners[other]])
    frame.fixed |= {*frame.nodes["O"], *frame.nodes["E"]}
    frame.loads |= {frame.nodes["A"][1]: -1e4, frame.nodes["B"][1]: -1e4}
    assert sd.buckling(portal(1e4, **kind), count=2)["load_factor"].values == pytest.approx(frame.factors(2), rel=1e-3)

    arm = sd.scissor(units=2, bar_length=LENGTH, bar_mass=MASS)
    made = sd.with_bending(arm, bending_stiffness=RIGIDITY, axial_stiffness=AXIAL, **kind).driven(speed=0.0)
    frame = Frame(AXIAL, RIGIDITY)
    for body in arm.bodies[:-1]:
        cos, sin, (x, y) = math.cos(body.placed_angle), math.sin(body.placed_angle), body.placed_position
        places = [(x + cos * at, y + sin * at) for at in (0.0, 0.5 * LENGTH, LENGTH)]
        rotations = frame.member([(f"{a:.6f} {b:.6f}", (a, b)) for a, b in places], pinned=True, weight=MASS / LENGTH * 9.81)
        if body is arm.bodies[0]:
            clamp = f"{x:.6f} {y:.6f}"
            frame.fixed |= {*frame.nodes[clamp][:2], rotations[clamp]}
    slider = arm.body("slider")
    across, along, _ = frame.nodes["{:.6f} {:.6f}".format(*slider.position)]
    frame.fixed.add(across)
    frame.loads[along] -= slider.mass * 9.81
    assert sd.buckling(made, count=2)["load_factor"].values == pytest.approx(frame.factors(2), rel=1e-3)


@pytest.mark.parametrize("kind", [KINDS[0], pytest.param(KINDS[1], marks=pytest.mark.slow)])
def test_the_static_start_loses_stability_at_the_load_of_buckling(kind):
    """Cross-check: a symmetric frame in equilibrium is straight and stable below its load of buckling, and not beyond it."""
    load = 1e4 * float(sd.buckling(portal(1e4, **kind))["load_factor"][0])
    square, sway = [], []
    for part in (0.99, 1.01):
        made = portal(part * load, **kind)
        square.append(float(sd.modes(made, count=1)["angular_frequency"][0]))
        run = sd.simulate(made, until=1e-6, samples=2, start="static")
        sway.append(abs(float(run["position"].sel(body="beam", axis="x")[0])))
    assert square[0] > 0.0
    assert sway[0] < 1e-6
    assert square[1] < 0.0 or sway[1] > 0.1  # unstable, or beside the straight position


def test_rigid_parts_springs_and_rollers_buckle():
    """Closed forms: m g h/2 = c with a torsion spring c, P = k L with a spring across the tip, F^2 = c k of a point that rolls.

    The force on a bar that turns by an angle has the part F angle along the motion of the point, whose shift has the arm F.
    """
    upright = sd.bar("bar", length=LENGTH, mass=MASS, angle=0.5 * math.pi)
    pin = sd.Revolute("O", ("bar", "start"), ("ground", "O"))
    ground = ("O", (0.0, 0.0)), ("far", (-50.0, LENGTH)), ("level", (-50.0, 0.0))
    made = sd.Mechanism((upright,), (pin,), ground=ground, gravity=9.81)
    held = made.with_parts({"components": (sd.TorsionSpring("c", "bar", stiffness=1e3, free_angle=0.5 * math.pi),)})
    assert sd.buckling(held)["load_factor"].values == pytest.approx([1e3 / (MASS * 9.81 * 0.5 * LENGTH)])
    parts = (
        sd.Spring("k", ("bar", "end"), ("ground", "far"), stiffness=1e3, free_length=50.0),
        sd.Force("P", ("bar", "end"), (0.0, -1e3)),
    )
    tied = sd.Mechanism((upright,), (pin,), ground=ground, gravity=0.0, components=parts)
    assert sd.buckling(tied)["load_factor"].values == pytest.approx([1e3 * LENGTH / 1e3])
    car = sd.point_mass("car", mass=1.0, position=(1.0, 0.0))
    parts = (
        sd.Roller("wheel", ("car", "centre"), "bar", stiffness=1e7),
        sd.TorsionSpring("c", "bar", stiffness=400.0, free_angle=0.0),
        sd.Spring("k", ("car", "centre"), ("ground", "level"), stiffness=1e3, free_length=51.0),
        sd.Force("F", ("car", "centre"), (0.0, -10.0)),
    )
    rolling = sd.Mechanism((BAR, car), (pin,), ground=ground, gravity=0.0, components=parts)
    stiff = sd.with_bending(rolling, "bar", bending_stiffness=1e9, axial_stiffness=1e9, modes=2)
    assert float(sd.buckling(stiff)["load_factor"][0]) == pytest.approx(math.sqrt(400.0 * 1e3) / 10.0, rel=1e-3)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(("part", "across"), [(1.05, 1e-4), (1.2, 1e-3), (0.95, 1e-3)])
def test_a_static_start_is_stable_and_on_the_side_of_the_load(kind, part, across):
    """Contract: a strut beyond Euler's load, pushed down a little, bends down; frequencies about the start are real."""
    critical = math.pi**2 * RIGIDITY / LENGTH**2
    loads = (
        sd.Force("P", ("bar", "end"), (-part * critical, 0.0)),
        sd.Force("q", ("bar", "middle"), (0.0, -across * part * critical)),
    )
    made = sd.with_bending(on_pin(BAR, *loads, guides=(END,)), bending_stiffness=RIGIDITY, axial_stiffness=AXIAL, **kind)
    run = sd.simulate(made, until=1e-6, samples=2, start="static")
    middle = next(body.name for body in made.bodies if "middle" in body.points)
    down = -float(run["position"].sel(body=middle, axis="y")[0])
    # of second order in the deflection: a^2 = 8 (L/pi)^2 (P/P_E - 1) beyond Euler's load, q L^3/(48 EI (1 - P/P_E)) before it
    expected = (
        math.sqrt(8.0 * (part - 1.0)) * LENGTH / math.pi
        if part > 1.0
        else across * part * math.pi**2 * LENGTH / 48.0 / (1.0 - part)
    )
    assert down == pytest.approx(expected, rel=0.2)
    assert float(sd.modes(made, count=1)["angular_frequency"][0]) > 0.0
    assert "unstable" not in run.attrs["warnings"]


def test_a_static_start_that_is_not_stable_is_said():
    """Contract: nothing decides for a side of a straight strut beyond Euler's load, which stays straight."""
    run = sd.simulate(portal(2e5, modes=4), until=1e-6, samples=2, start="static")
    assert "unstable equilibrium" in run.attrs["warnings"]


def test_thin_strips_are_bent_by_a_moment():
    """Closed form: half a circle under the moment pi EI/L, its end 2 L/pi above the clamp."""
    strip = on_pin(sd.bar("bar", length=1.0, mass=1.0))
    bent = sd.with_bending(strip, bending_stiffness=1.0, axial_stiffness=1e8, modes=6)
    bent = bent.with_parts({"components": (*bent.components, sd.Torque("M", "bar/2", torque=math.pi))}).driven(speed=0.0)
    run = sd.simulate(bent, until=1e-8, samples=2, start="static")
    assert run["position"].sel(body="bar/2")[0].values == pytest.approx([0.0, 2.0 / math.pi], abs=5e-4)
    assert float(run["angle"].sel(body="bar/2")[0]) == pytest.approx(math.pi, rel=5e-4)
