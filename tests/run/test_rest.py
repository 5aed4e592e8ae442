"""Starts of runs: given positions and speeds, and static equilibrium as a minimum of the potential energy."""

import dataclasses
import math
from dataclasses import replace

import numpy as np
import pytest
from tests.build import on_pin

import scissordyn as sd
from reference.lagrange import Array

LENGTH, SLIDER, GRAVITY = 2.0, 5.0, 9.81  # Length of a bar [m], mass of the slider [kg] and gravity [m/s^2]
WEIGHTS = Array(joint=None, motion=None).weights()
"""Coefficients of the two families of bars in the potential energy [J]."""

PRESSURE = 1.5e-2 * 0.5 * math.pi * sd.STEEL.youngs_modulus / (2.0 * (1.0 - sd.STEEL.poisson_ratio**2))
"""[N/m] Factor p_0 of Liu's law F = p_0 d sqrt(d/(2 (c + d)))."""

BARS = ("unit 1/bar 1", "unit 1/bar 2")  # Names of the two bars of a scissor unit


def sprung(angle, clearance, stiffness, free, *, mirrored=False):
    """Return the paper's array with a loose joint A and a spring between the bars of its first unit; angles in degrees."""
    array = sd.scissor(units=2, angle=math.radians(angle)).with_clearance("A", sd.Clearance(clearance, stiffness=sd.Liu()))
    body, base = BARS[::-1] if mirrored else BARS
    spring = sd.TorsionSpring("spring", body, base, stiffness=stiffness, free_angle=math.radians(free))
    return dataclasses.replace(array, components=(spring,))


def resting(mechanism, until=1e-4):
    """Return a short run from equilibrium."""
    return sd.simulate(mechanism, until=until, samples=3, start="static")


def slopes(run, clearance, stiffness, turned):
    """Return gradient and Hessian of the potential energy in the minimal coordinates p, k, y at the start of a run.

    V = w_p sin p + w_k sin k + m_s g y + W(|e| - c) + K (p - k - turned)^2/2, with the eccentricity
    e = ((L/2)(cos p - cos k), (L/2)(sin p - sin k) - y).
    """
    p, k = (float(run["angle"].sel(body=bar)[0]) for bar in BARS)
    y = float(run["slider_position"][0])
    half = 0.5 * LENGTH
    e = np.array([half * (math.cos(p) - math.cos(k)), half * (math.sin(p) - math.sin(k)) - y])
    by = np.array([[-half * math.sin(p), half * math.sin(k), 0.0], [half * math.cos(p), -half * math.cos(k), -1.0]])
    bend = np.array([[-half * math.cos(p), half * math.cos(k), 0.0], [-half * math.sin(p), half * math.sin(k), 0.0]])
    far = math.hypot(*e)
    depth = max(far - clearance, 0.0)
    normal, along = e / far, np.array([-e[1], e[0]]) / far
    force = PRESSURE * depth * math.sqrt(depth / (2.0 * (clearance + depth)))
    rise = force * (1.5 / depth - 0.5 / (clearance + depth)) if depth > 0.0 else 0.0
    spring = stiffness * np.array([1.0, -1.0, 0.0])
    weight = np.array([WEIGHTS[0] * math.cos(p), WEIGHTS[1] * math.cos(k), SLIDER * GRAVITY])
    gradient = weight + force * normal @ by + spring * (p - k - turned)
    hessian = by.T @ (rise * np.outer(normal, normal) + force / far * np.outer(along, along)) @ by
    hessian += np.diag(force * normal @ bend - np.array([WEIGHTS[0] * math.sin(p), WEIGHTS[1] * math.sin(k), 0.0]))
    hessian += np.outer(spring, [1.0, -1.0, 0.0])
    return gradient, hessian


def assert_minimum(run, clearance, stiffness, turned):
    """Check that the potential energy is stationary, to 1e-7 of the weight, and has a minimum."""
    gradient, hessian = slopes(run, clearance, stiffness, turned)
    assert np.abs(gradient).max() < 1e-7 * WEIGHTS[0]
    assert np.linalg.eigvalsh(hessian)[0] > 0.0


def test_equilibrium_of_the_ideal_array():
    """Closed form: g L (2 m + m_s) cos th = 2 k (phi - 2 th), which holds at 39.9210 degrees for this spring."""
    mechanism = sprung(35.0, 0.3e-3, 458.3, 95.23).ideal()
    angle = float(resting(mechanism)["angle"].sel(body=BARS[0])[0])
    load = GRAVITY * LENGTH * (2.0 * 5.68 + SLIDER)
    assert load * math.cos(angle) == pytest.approx(2.0 * 458.3 * (math.radians(95.23) - 2.0 * angle), rel=1e-9)
    assert math.degrees(angle) == pytest.approx(39.9210, abs=5e-5)


@pytest.mark.parametrize("mirrored", [False, True])
def test_random_springs_and_clearances(mirrored):
    """Second formulation: sixty arrays rest at a minimum of the energy in minimal coordinates.

    Mirrored springs pull the array through its flat position, most of them until the bars have changed sides.
    """
    random = np.random.default_rng(0)
    for _ in range(60):
        angle, clearance = random.uniform(20.0, 70.0), random.uniform(0.05e-3, 0.5e-3)
        stiffness, free = random.uniform(50.0, 2000.0), random.uniform(20.0, 160.0)
        run = resting(sprung(angle, clearance, stiffness, free, mirrored=mirrored))
        assert_minimum(run, clearance, stiffness, math.radians(-free if mirrored else free))


def test_rest_is_kept():
    """Contract: the run stays at its start, also with bars that have turned by more than half a turn relative to each other."""
    mechanism = sprung(50.77, 0.2227e-3, 1994.6, 220.0, mirrored=True)
    run = resting(mechanism, until=0.05)
    angle = run["angle"].sel(body=list(BARS)).values
    assert abs(math.degrees(angle[0, 0] - angle[0, 1])) > 180.0
    assert np.ptp(angle, axis=0).max() < 1e-9
    assert float(abs(run["angular_acceleration"]).max()) < 1e-5


def test_unloaded_rest_is_exact():
    """Contract: without gravity the unbalanced force is small compared with the spring's."""
    crank = sd.slider_crank(crank=0.3, rod=0.7, angle=1.7, gravity=0.0)
    for joint, clearance in (("ground pin", 0.234e-3), ("crank pin", 0.07e-3)):
        crank = crank.with_clearance(joint, sd.Clearance(clearance))
    spring = sd.TorsionSpring("spring", "rod", stiffness=38.57, free_angle=-0.39)
    run = resting(dataclasses.replace(crank, components=(spring,)))
    inertia = 0.21 * 0.7**2 / 12.0
    assert float(abs(run["angular_acceleration"].sel(body="rod")).max()) * inertia < 1e-8 * 38.57


def test_equilibrium_of_a_free_mass_is_refused():
    """Contract: a mass under its weight alone has no equilibrium, and the error says so."""
    free = sd.Mechanism((sd.point_mass("ball", mass=2.0, position=(0.5, 0.0)),), ground=(("O", (0.0, 0.0)),))
    with pytest.raises(sd.InputError, match="no equilibrium: nothing holds the mechanism"):
        resting(free)


def test_gain_of_a_rate_does_not_count_at_rest():
    """Identity: the derivative gain of a servo does not change the static equilibrium of loose tubes."""
    tubes = sd.scissor(units=2, bar_length=0.9, bar_mass=0.733).with_clearance("all", sd.Clearance(1e-5))
    tubes = sd.with_bending(tubes, section="tube 50x2 mm", material="aluminium")
    servos = [sd.FeedForward(2e4, derivative, limit=2e3) for derivative in (0.0, 3500.0)]
    runs = [resting(tubes.controlled(servo, reference=sd.ConstantSpeed(0.0))) for servo in servos]
    np.testing.assert_allclose(runs[1]["position"].values[0], runs[0]["position"].values[0], rtol=0.0, atol=1e-10)
    torque = float(runs[1]["control_torque"].values[0, 0])
    assert torque == pytest.approx(2e4 * float(runs[1]["control_error"].values[0, 0]), rel=1e-9)


def test_servo_that_cannot_hold_is_named():
    """Contract: the error about a missing equilibrium names the servo at its limit."""
    crank = sd.slider_crank(crank=0.3, rod=0.7, angle=1.0, gravity=0.0).with_clearance("crank pin", sd.Clearance(1e-4))
    crank = crank.controlled(sd.FeedForward(2e4, 300.0, limit=20.0), reference=sd.ConstantSpeed(0.0), name="servo")
    load = sd.Torque("load", crank.input_body, torque=50.0)
    with pytest.raises(sd.InputError, match=r"no equilibrium.*actuator 'servo' is at its limit of 20 N m"):
        resting(dataclasses.replace(crank, components=(*crank.components, load)))


@pytest.mark.parametrize(
    ("load", "rigidity", "angle", "error"),
    [(1.0, 1e3, 0.46135194971188, 1e-6), (1.0, 1e2, 0.46135194971188, 1e-7), (10.0, 1e3, 1.4302855388039, 2e-6)],
)
def test_elastica_of_a_cantilever(load, rigidity, angle, error):
    """Closed form: the elastica of a cantilever with P L^2 = EI and ten times as much, by elliptic integrals."""
    bar = sd.bar("bar", length=1.0, mass=1.0, position=(0.0, 0.0), angle=0.0)
    clamped = sd.with_bending(on_pin(bar), bending_stiffness=rigidity, axial_stiffness=1e9, elements=16)
    push = sd.Force("push", (clamped.bodies[-1].name, "end"), (0.0, rigidity * load))
    loaded = clamped.with_parts({"components": (*clamped.components, push)}).driven(speed=0.0)
    run = sd.simulate(loaded, until=1e-5, samples=2, start="static")
    assert float(run["angle"][0, -1]) == pytest.approx(angle, rel=error)


@pytest.mark.parametrize("kind", [{"modes": 4}, {"elements": 4}])
def test_velocity_of_a_bending_bar(kind):
    """Contract: the given velocity of a bar is that of all its cross-sections."""
    bar = dataclasses.replace(sd.bar("bar", length=1.0, mass=1.0, position=(0.0, 0.0), angle=0.3), velocity=(1.0, -2.0))
    bent = sd.with_bending(sd.Mechanism((bar,), (), gravity=0.0), bending_stiffness=1e3, axial_stiffness=1e6, **kind)
    run = sd.simulate(bent, until=1e-3, samples=3, start="as-placed")
    np.testing.assert_allclose(run["velocity"], np.broadcast_to([1.0, -2.0], run["velocity"].shape), atol=1e-5)


LENGTHS = {"crank": 1.0, "coupler": 3.0, "rocker": 2.0}  # Lengths of the bars of a four-bar linkage [m], by name


def four_bar(**changes):
    """Return crank, coupler and rocker of 1, 3 and 2 m on a ground of 4 m, roughly placed, with `changes` per bar."""
    places = {"crank": {"angle": math.radians(60.0)}, "coupler": {}, "rocker": {"position": (4.0, 0.0)}}
    bodies = [sd.bar(name, length=length, mass=2.0) for name, length in LENGTHS.items()]
    bodies = [replace(body, **(places[body.name] | changes.get(body.name, {}))) for body in bodies]
    pins = [
        ("crank.start", "ground.O"),
        ("coupler.start", "crank.end"),
        ("coupler.end", "rocker.end"),
        ("rocker.start", "ground.C"),
    ]
    joints = [
        sd.Revolute(name, tuple(one.split(".")), tuple(other.split(".")))
        for name, (one, other) in zip("ABDC", pins, strict=True)
    ]
    return sd.Mechanism(tuple(bodies), tuple(joints), ground=(("O", (0.0, 0.0)), ("C", (4.0, 0.0))))


def angles_at(crank):
    """Return the angles of coupler and rocker, on the branch with the coupler's end above the ground [rad]."""
    end = 4.0 - np.exp(1j * crank)  # from the crank's end to C
    distance = abs(end)
    opening = math.acos((distance**2 + 9.0 - 4.0) / (6.0 * distance))
    coupler = float(np.angle(end)) + opening
    return coupler, float(np.angle(np.exp(1j * crank) + 3.0 * np.exp(1j * coupler) - 4.0))


def speeds_at(crank, speed):
    """Return the loop's angular velocities for that of the crank: a e^(ia) wa + b e^(ib) wb = c e^(ic) wc."""
    coupler, rocker = angles_at(crank)
    rows = np.array([[3.0 * np.exp(1j * coupler)], [-2.0 * np.exp(1j * rocker)]])[:, 0]
    b, c = np.linalg.solve(np.array([rows.real, rows.imag]), -speed * np.array([math.cos(crank), math.sin(crank)]))
    return {"crank": speed, "coupler": float(b), "rocker": float(c)}


def started(mechanism, **options):
    """Return the first sample and the warnings of a run."""
    run = sd.simulate(mechanism, until=1e-4, samples=2, **options)
    return run.isel(time=0), run.attrs["warnings"]


CRANK_ANGLE = math.radians(60.0)  # [rad] angle of the crank at the start
COUPLER_ANGLE, ROCKER = angles_at(CRANK_ANGLE)  # [rad] angles of coupler and rocker at which the four-bar linkage closes
# Start values with which the four-bar linkage closes, by body
EXACT = {
    "coupler": {"angle": COUPLER_ANGLE, "position": (math.cos(CRANK_ANGLE), math.sin(CRANK_ANGLE))},
    "rocker": {"angle": ROCKER},
}
# [rad/s] angular velocities with which the four-bar linkage stays closed at a crank speed of 5 rad/s
CLOSED_SPEEDS = speeds_at(CRANK_ANGLE, 5.0)


@pytest.mark.parametrize("name", LENGTHS)
@pytest.mark.parametrize("placed", [EXACT, {"coupler": {"angle": 0.3}}], ids=["closed", "nearly"])
def test_speed_of_any_bar_is_kept(name, placed):
    """Closed form: the other angular velocities follow from the loop, for exact and rough positions."""
    changes = {body: dict(placed.get(body, {})) for body in LENGTHS}
    changes[name]["angular_velocity"] = CLOSED_SPEEDS[name]
    first, warnings = started(four_bar(**changes))
    angle = {body: float(first["angle"].sel(body=body)) for body in LENGTHS}
    if placed is EXACT:
        assert angle == pytest.approx({"crank": CRANK_ANGLE, "coupler": COUPLER_ANGLE, "rocker": ROCKER}, abs=1e-12)
    wanted = speeds_at(angle["crank"], 1.0)
    found = {body: float(first["angular_velocity"].sel(body=body)) for body in LENGTHS}
    assert found == pytest.approx(
        {body: CLOSED_SPEEDS[name] / wanted[name] * speed for body, speed in wanted.items()}, rel=1e-9
    )
    assert "speeds" not in warnings


@pytest.mark.parametrize("angle", [20.0, 60.0, 100.0, -40.0])
def test_given_angle_is_kept(angle):
    """Closed form: the crank keeps its angle to round-off; coupler and rocker close the loop by the law of cosines."""
    crank = math.radians(angle)
    first, warnings = started(four_bar(crank={"angle": crank}))
    assert float(first["angle"].sel(body="crank")) == pytest.approx(crank, abs=1e-11)
    branches = [angles_at(crank), tuple(-other for other in angles_at(-crank))]
    found = [float(first["angle"].sel(body=body)) for body in ("coupler", "rocker")]
    assert min(np.max(np.abs(np.exp(1j * np.array(found)) - np.exp(1j * np.array(branch)))) for branch in branches) < 1e-9
    assert warnings == "[]"


@pytest.mark.parametrize("digits", [17, 12, 4, 1])
def test_all_speeds_given(digits):
    """Limit: consistent speeds are kept, rounded ones are matched to their digits, larger differences give a warning."""
    rounded = {name: float(f"{speed:.{digits}g}") for name, speed in CLOSED_SPEEDS.items()}
    changes = {name: EXACT.get(name, {}) | {"angular_velocity": speed} for name, speed in rounded.items()}
    first, warnings = started(four_bar(**changes))
    for name, speed in rounded.items():
        assert float(first["angular_velocity"].sel(body=name)) == pytest.approx(speed, rel=4.0 * 10.0**-digits + 1e-11)
    assert ("speeds" in warnings) == (digits < 6)


def test_warnings_of_contradicting_speeds():
    """Contract: contradicting speeds of bodies and drives give warnings with both values."""
    changes = {"crank": {"angular_velocity": 5.0}, "rocker": EXACT["rocker"] | {"angular_velocity": 0.0}}
    first, warnings = started(four_bar(coupler=EXACT["coupler"], **changes))
    speeds = first["angular_velocity"]
    assert 0.0 < float(speeds.sel(body="crank")) < 5.0
    assert f"body 'crank' starts at {float(speeds.sel(body='crank')):.4g} rad/s instead of 5 rad/s" in warnings
    assert f"body 'rocker' starts at {float(speeds.sel(body='rocker')):.4g} rad/s instead of 0 rad/s" in warnings
    driven = four_bar(crank={"angular_velocity": 5.0}).driven(speed=2.0, body="crank")
    assert "body 'crank' starts at 2 rad/s instead of 5 rad/s" in started(driven)[1]
    assert "starts at 0 rad/s instead of 5 rad/s" in started(four_bar(crank={"angular_velocity": 5.0}), start="static")[1]
    with pytest.raises(sd.InputError, match="but the body does not rotate"):
        sd.Body("stone", 1.0, None, angular_velocity=1.0)


def test_start_from_the_speed_of_the_slider():
    """Closed form: x = r cos a + l cos b with r sin a + l sin b = 0; a unit of bars L has the height L sin(a)."""
    crank = sd.slider_crank(angle=0.7, gravity=0.0)
    slider = crank.body("slider")
    r, rod = (math.dist(*(crank.body(name).points[end] for end in ("start", "end"))) for name in ("crank", "rod"))
    first, warnings = started(crank.replace("slider.velocity", (0.3, 0.0)))
    tilt = -math.asin(r * math.sin(0.7) / rod)
    speed = 0.3 / (-r * math.sin(0.7) + r * math.cos(0.7) * math.tan(tilt))
    assert slider.velocity is None
    assert float(first["angular_velocity"].sel(body="crank")) == pytest.approx(speed, rel=1e-9)
    assert float(first["velocity"].sel(body="slider", axis="x")) == pytest.approx(0.3, rel=1e-11)
    assert warnings == "[]"
    unit = sd.scissor(units=1, bar_length=2.0, angle=0.5, gravity=0.0)
    bars = [body.name for body in unit.bodies if body.rotates]
    first, _ = started(unit.replace(f"{unit.output_body}.velocity", (0.0, 0.4)))
    rate = 0.4 / (2.0 * math.cos(0.5))
    assert first["angular_velocity"].sel(body=bars).values == pytest.approx([rate, -rate], rel=1e-9)


def rows_of(mechanism, first):
    """Return joints as rows of velocities (x, y, angle) of mass centres, and the masses, from a sample."""
    names = [body.name for body in mechanism.bodies]
    rows = np.zeros((2 * len(mechanism.joints), 3 * len(names)))
    for k, joint in enumerate(mechanism.joints):
        for sign, (body, point) in ((1.0, joint.journal), (-1.0, joint.bearing)):
            if body == "ground":
                continue
            at, angle = 3 * names.index(body), float(first["angle"].sel(body=body))
            arm = np.array(mechanism.body(body).points[point]) - mechanism.body(body).centre
            cos, sin = math.cos(angle), math.sin(angle)
            rows[2 * k : 2 * k + 2, at : at + 2] += sign * np.eye(2)
            rows[2 * k : 2 * k + 2, at + 2] += sign * np.array([-sin * arm[0] - cos * arm[1], cos * arm[0] - sin * arm[1]])
    return rows, np.array([[body.mass, body.mass, body.inertia or 0.0] for body in mechanism.bodies]).ravel()


@pytest.mark.parametrize("seed", range(12))
def test_random_loops_with_one_speed(seed):
    """Second formulation: joints as rows in coordinates of mass centres.

    Loops of 3 to 6 bars between two ground pins have 1 to 4 degrees of freedom. Of all motions with the given speed, the start
    is nearest (in kinetic energy) to one in which the given bar rotates about its origin and the others rest.
    """
    random = np.random.default_rng(seed)
    count = 3 + seed % 4
    steps = random.uniform(0.4, 1.0, count) * np.exp(1j * np.linspace(1.4, -1.4, count) + 1j * random.uniform(-0.2, 0.2, count))
    corners = np.concatenate([[0.0], np.cumsum(steps)])
    number, speed = int(random.integers(count)), float(random.uniform(-4.0, 4.0))
    bodies = tuple(
        sd.bar(
            f"bar {k}",
            length=abs(step),
            mass=float(random.uniform(0.5, 2.0)),
            position=(corners[k].real, corners[k].imag),
            angle=float(np.angle(step)),
        )
        for k, step in enumerate(steps)
    )
    bodies = tuple(replace(body, angular_velocity=speed) if k == number else body for k, body in enumerate(bodies))
    ends = [("ground", "O"), *((f"bar {k}", "end") for k in range(count))]
    joints = [sd.Revolute(f"pin {k}", (f"bar {k}", "start"), ends[k]) for k in range(count)]
    joints.append(sd.Revolute("last", ends[-1], ("ground", "P")))
    ground = (("O", (0.0, 0.0)), ("P", (float(corners[-1].real), float(corners[-1].imag))))
    loop = sd.Mechanism(bodies, tuple(joints), ground=ground)
    first, warnings = started(loop)
    rows, weight = rows_of(loop, first)
    pick = np.zeros((1, rows.shape[1]))
    pick[0, 3 * number + 2] = 1.0
    guess = np.zeros(rows.shape[1])
    step = steps[number]
    guess[3 * number : 3 * number + 3] = -0.5 * speed * step.imag, 0.5 * speed * step.real, speed
    tall, root = np.vstack([rows, pick]), np.sqrt(weight)
    right = np.append(np.zeros(rows.shape[0]), speed) - tall @ guess
    wanted = guess + np.linalg.lstsq(tall / root, right, rcond=1e-12)[0] / root
    found = np.column_stack([first["velocity"].values, first["angular_velocity"].values]).ravel()
    assert found == pytest.approx(wanted, rel=1e-9, abs=1e-9 * np.max(np.abs(wanted)))
    assert warnings == "[]"


def test_given_zero_is_written():
    """Contract: a given 0 differs from a missing value, also in the text of a case."""
    given = four_bar(rocker={"angular_velocity": 0.0}, coupler={"velocity": (0.0, 0.0)})
    text = sd.case_text(given)
    assert text.count("angular_velocity") == 1
    assert text.count("\nvelocity") == 1
    assert "velocity" not in sd.case_text(four_bar())


def test_restart_from_a_sample():
    """Identity: the complete state of a run is the start of the next one, to round-off."""
    run = sd.simulate(four_bar(crank={"angular_velocity": 5.0}), until=0.1, samples=3, rtol=1e-10, atol=1e-10)
    last, bodies = run.isel(time=-1), []
    mechanism = four_bar()
    for body in mechanism.bodies:
        part = last.sel(body=body.name)
        angle, speed = float(part["angle"]), float(part["angular_velocity"])
        x, y = body.centre[0] * math.cos(angle), body.centre[0] * math.sin(angle)
        place, velocity = part["position"].values, part["velocity"].values
        origin = float(place[0] - x), float(place[1] - y)
        rate = float(velocity[0] + speed * y), float(velocity[1] - speed * x)
        bodies.append(replace(body, position=origin, angle=angle, velocity=rate, angular_velocity=speed))
    first, warnings = started(replace(mechanism, bodies=tuple(bodies)))
    for name in ("position", "angle", "velocity", "angular_velocity"):
        assert first[name].values == pytest.approx(last[name].values, abs=1e-11)
    assert warnings == "[]"


@pytest.mark.parametrize(("units", "angle", "stiffness"), [(1, 50.0, 60.0), (3, 40.0, 150.0)])
def test_a_damped_motion_ends_in_static_equilibrium(units, angle, stiffness):
    """Cross-check: the end of a damped motion from aside has the positions and reactions of the static equilibrium."""
    arm = sd.scissor(units=units, bar_length=1.0, bar_mass=1.0, slider_mass=1.0, angle=math.radians(angle), gravity=4.0)
    between = {"body": "unit 1/bar 1", "base": "unit 1/bar 2", "free_angle": math.radians(2.0 * angle)}
    spring = sd.TorsionSpring("spring", stiffness=stiffness, damping=40.0, **between)
    load = sd.Force("load", (f"unit {units}/bar 1", "end"), (6.0, -8.0))
    loaded = dataclasses.replace(arm, components=(spring, load))
    moved = sd.simulate(loaded, until=60.0, samples=3)
    still = sd.simulate(loaded, until=1e-6, samples=2, start="static")
    assert float(np.ptp(moved["angle"].values[:, 0])) > 1e-3
    np.testing.assert_allclose(moved["angle"].values[-1], still["angle"].values[0], rtol=0.0, atol=1e-8)
    reaction = still["reaction"].values[0]
    largest = float(np.max(np.abs(reaction)))
    np.testing.assert_allclose(moved["reaction"].values[-1], reaction, rtol=0.0, atol=1e-6 * largest)
