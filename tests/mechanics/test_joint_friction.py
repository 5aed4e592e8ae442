"""Friction that follows the reaction of ideal pins and guides: closed forms, presliding, a second formulation, jams, energy."""

import dataclasses
import math
from functools import partial

import numpy as np
import pytest
from tests.build import on_pin

import scissordyn as sd

G = 9.81  # [m/s^2] gravitational acceleration
WEDGE = 1e-4  # [kg] mass of a wedge, so small that its weight and inertia hardly matter
WEIGHT, RADIUS = 3.0 * G, 0.02  # Weight of the disc [N] and radius of its pin [m]
TIGHT = {"rtol": 1e-11, "atol": 1e-11}  # Options of `simulate` for accurate runs
ORIGIN = (("O", (0.0, 0.0)),)  # Ground with one point at the origin


def journal(friction, *more, **start):
    """Return a disc of 3 kg on a pin with friction."""
    disc = sd.Body("disc", mass=3.0, inertia=0.02, points={"middle": (0.0, 0.0)}, **start)
    pin = sd.Revolute("pin", ("disc", "middle"), ("ground", "O"))
    return sd.Mechanism((disc,), joints=(pin,), components=(friction, *more), ground=ORIGIN, gravity=G)


def rubbing(mu, radius):
    """Return Coulomb friction in the pin of the disc."""
    return sd.PinFriction("friction", "disc", radius, mu, transition=1e-7)


def bristles(**friction):
    """Return bristle friction in the pin of the disc."""
    return sd.PinLuGre("friction", "disc", RADIUS, **friction)


LOAD = sd.Force("load", ("disc", "middle"), (40.0, -100.0))  # Force on the disc


@pytest.mark.parametrize("mu", [0.05, 0.3, 1.2])
def test_loaded_journal(mu):
    """Closed form: the reaction touches the friction circle, so that the torque is W R sin(phi)."""
    run = sd.simulate(journal(rubbing(mu, 0.02), LOAD).driven(speed=5.0, body="disc"), until=0.1, samples=3)
    load = math.hypot(40.0, 100.0 + 3.0 * G)
    np.testing.assert_allclose(run["drive_torque"], load * 0.02 * math.sin(math.atan(mu)), rtol=1e-14)
    np.testing.assert_allclose(run["pin_friction_reaction"][:, 0], load, rtol=1e-14)


def test_disc_runs_down():
    """Closed form: the deceleration is constant."""
    run = sd.simulate(journal(rubbing(0.2, 0.01), LOAD, angular_velocity=20.0), until=1.0, samples=11, **TIGHT)
    torque = math.hypot(40.0, 100.0 + 3.0 * G) * 0.01 * math.sin(math.atan(0.2))
    np.testing.assert_allclose(run["angular_velocity"][:, 0], 20.0 - torque / 0.02 * run["time"], rtol=1e-9)
    turnover = float(run["dissipated_energy"][-1])
    assert float(np.abs(run["energy_residual"]).max()) < 1e-8 * turnover


def wedge(alpha, mu, speed, surfaces=("floor", "wall", "incline")):
    """Return a wedge that a rod pushes under a load of 500 N, which a wall guides."""
    slider = sd.Body("wedge", mass=WEDGE, inertia=1e-4, points={"c": (0.0, 0.0)})
    load = sd.Body("load", mass=500.0 / G, inertia=None, points={"c": (0.0, 0.0)})
    guides = (
        sd.Guide("floor", ("wedge", "c"), aligned=True),
        sd.Guide("wall", ("load", "c"), direction=0.5 * math.pi),
        sd.Guide("incline", ("load", "c"), direction=-alpha, body="wedge"),
    )
    # the floor is long, so that its moment asks for no edges
    frictions = (
        sd.GuideFriction("floor", ("ground", "O"), ("wedge", "c"), 0.0, mu, transition=1e-7, length=100.0),
        sd.GuideFriction("wall", ("ground", "O"), ("load", "c"), 0.5 * math.pi, mu, transition=1e-7),
        sd.GuideFriction("incline", ("wedge", "c"), ("load", "c"), -alpha, mu, transition=1e-7),
    )
    rod = sd.Rod("push", ("ground", "far"), ("wedge", "c"), motion=sd.Polynomial((1.0, speed)))
    ground = (("O", (0.0, 0.0)), ("far", (-1.0, 0.0)))
    rubbing = tuple(part for part in frictions if part.name in surfaces)
    return sd.Mechanism((slider, load), guides=guides, rods=(rod,), components=rubbing, ground=ground, gravity=G)


@pytest.mark.parametrize(("alpha", "mu"), [(20.0, 0.1), (35.0, 0.2)])
@pytest.mark.parametrize("sense", [1.0, -1.0])
def test_wedge(alpha, mu, sense):
    """Closed form: W tan(alpha + 2 phi) raises and W tan(alpha - 2 phi) lowers a load on three rough surfaces."""
    run = sd.simulate(wedge(math.radians(alpha), mu, 0.01 * sense), until=0.1, samples=3)
    exact = 500.0 * math.tan(math.radians(alpha) + 2.0 * sense * math.atan(mu)) + sense * mu * WEDGE * G
    np.testing.assert_allclose(-run["rod_force"][:, 0], exact, rtol=2e-9)


@pytest.mark.parametrize("sense", [1.0, -1.0])
def test_screw_jack(sense):
    """Closed form: an unrolled thread needs W tan(lead + phi) to raise and W tan(phi - lead) to lower a self-locking screw."""
    lead, mu = math.radians(4.0), 0.12
    run = sd.simulate(wedge(lead, mu, 0.01 * sense, ("incline",)), until=0.1, samples=3)
    np.testing.assert_allclose(-run["rod_force"][:, 0], 500.0 * math.tan(lead + sense * math.atan(mu)), rtol=2e-9)


def test_wedge_that_jams():
    """Limit: at alpha + 2 phi = 90 deg the force is infinite; beyond it the cause names the jam."""
    alpha = math.radians(40.0)
    nearly, beyond = (math.tan(math.radians(25.0 + more)) for more in (-0.01, 0.01))
    run = sd.simulate(wedge(alpha, nearly, 0.01), until=0.1, samples=3)
    np.testing.assert_allclose(-run["rod_force"][:, 0], 500.0 * math.tan(math.radians(89.98)), rtol=1e-5)
    failed = sd.simulate(wedge(alpha, beyond, 0.01), until=0.1, samples=3)
    assert failed.attrs["status"] == "failed"
    assert (
        "the mechanism jams: no reactions are in balance with friction 'floor', 'wall' and 'incline'" in failed.attrs["cause"]
    )
    lowered = sd.simulate(wedge(alpha, beyond, -0.01), until=0.1, samples=3)
    assert lowered.attrs["status"] == "complete"


def sideways(mu, friction):
    """Return a drawer of 0.4 m that is pulled 0.2 m off its guide."""
    box = sd.Body("box", mass=2.0, inertia=0.05, points={"c": (0.0, 0.0), "pull": (0.0, 0.2)})
    rod = sd.Rod("hand", ("ground", "far"), ("box", "pull"), motion=sd.Polynomial((2.0, 0.1)))
    rails = friction("friction", ("ground", "O"), ("box", "c"), 0.0, mu, length=0.4)
    return sd.Mechanism(
        (box,),
        guides=(sd.Guide("rails", ("box", "c"), aligned=True),),
        rods=(rod,),
        components=(rails, sd.Force("side", ("box", "c"), (-30.0, 0.0))),
        ground=(*ORIGIN, ("far", (-2.0, 0.2))),
        gravity=0.0,
    )


@pytest.mark.parametrize(("friction", "since"), [(partial(sd.GuideFriction, transition=1e-7), 0), (sd.GuideLuGre, 1)])
def test_drawer(friction, since):
    """Closed form: F = P/(1 - 2 mu a/l) when pulled off its rails, once bristles are bent; it jams from 2 mu a = l on."""
    run = sd.simulate(sideways(0.3, friction), until=0.1, samples=3)
    np.testing.assert_allclose(-run["rod_force"][since:, 0], 30.0 / (1.0 - 2.0 * 0.3 * 0.2 / 0.4), rtol=1e-9)
    jammed = sd.simulate(sideways(1.1, friction), until=0.1, samples=3)
    assert "the mechanism jams: no reactions are in balance with friction 'friction'" in jammed.attrs["cause"]


# Name and both bodies of each pin of a slider-crank
PINS = (("ground pin", "crank", "ground"), ("crank pin", "rod", "crank"), ("slider pin", "rod", "slider"))


def rubbing_crank(mu, transition=1e-3):
    """Return a slider-crank with friction in its pins and its guide."""
    crank = sd.slider_crank(crank=0.1, rod=0.3, gravity=G)
    pins = [sd.PinFriction(joint, body, 0.012, mu, base=base, transition=transition) for joint, body, base in PINS]
    guide = sd.GuideFriction("guide", ("ground", "origin"), ("slider", "centre"), 0.0, mu, transition=transition)
    return dataclasses.replace(crank, components=(*pins, guide))


def crank_with_bristles():
    """Return a slider-crank with bristle friction in its pins."""
    crank = sd.slider_crank(crank=0.1, rod=0.3, gravity=G)
    pins = tuple(sd.PinLuGre(joint, body, 0.012, 0.2, base=base, static=0.3) for joint, body, base in PINS)
    return dataclasses.replace(crank, components=pins)


def spinning(crank):
    """Return the mechanism with an initial crank speed of 30 rad/s."""
    bodies = (dataclasses.replace(b, angular_velocity=30.0) if b.name == "crank" else b for b in crank.bodies)
    return dataclasses.replace(crank, bodies=tuple(bodies))


def assert_reactions(run, part, rtol):
    """Compare the reactions that friction follows with those of the result."""
    size, joints = np.linalg.norm(run["reaction"].values, axis=2), run["joint"].values.tolist()
    for k, joint in enumerate(run[part].values.tolist()):
        np.testing.assert_allclose(run[f"{part}_reaction"][:, k], size[:, joints.index(joint)], rtol=rtol)


def torque_by_hand(crank, angle, speed, mu, radius, transition):
    """Solve Newton's and Euler's equations of each body for the crank torque, with friction by successive substitution."""
    a, l = 0.1, 0.3
    m1, m2, m3 = (crank.body(name).mass for name in ("crank", "rod", "slider"))
    j2 = crank.body("rod").inertia
    beta = math.asin(-a * math.sin(angle) / l)
    rate = -a * math.cos(angle) * speed / (l * math.cos(beta))
    bend = (a * math.sin(angle) * speed**2 + l * math.sin(beta) * rate**2) / (l * math.cos(beta))
    pin = a * np.array([math.cos(angle), math.sin(angle)])
    along = np.array([math.cos(beta), math.sin(beta)])
    across = np.array([-along[1], along[0]])
    tip = pin + l * along
    accelerations = -0.5 * pin * speed**2, -pin * speed**2 + 0.5 * l * (bend * across - rate**2 * along)
    slide = (-pin * speed**2 + l * (bend * across - rate**2 * along))[0]
    slider_rate = (speed * np.array([-pin[1], pin[0]]) + l * rate * across)[0]
    ratio = [mu * math.tanh(radius * v / transition) for v in (speed, rate - speed, rate)]
    slip = mu * math.tanh(slider_rate / transition)
    friction = np.zeros(4)
    for _ in range(200):
        # unknowns: O x, O y on the crank, A x, A y on the rod, B x, B y on the slider, N on the slider, torque
        A, b = np.zeros((8, 8)), np.zeros(8)
        A[0, 0], A[0, 2], b[0] = 1, -1, m1 * accelerations[0][0]
        A[1, 1], A[1, 3], b[1] = 1, -1, m1 * (accelerations[0][1] + G)
        A[2, 2:4], A[2, 7] = (pin[1], -pin[0]), 1
        b[2] = -friction[0] + friction[1] + m1 * G * 0.5 * pin[0]
        A[3, 2], A[3, 4], b[3] = 1, -1, m2 * accelerations[1][0]
        A[4, 3], A[4, 5], b[4] = 1, -1, m2 * (accelerations[1][1] + G)
        h = 0.5 * l * along
        A[5, 2:6] = h[1], -h[0], h[1], -h[0]
        b[5] = j2 * bend - friction[1] - friction[2]
        A[6, 4], b[6] = 1, m3 * slide - friction[3]
        A[7, 5], A[7, 6], b[7] = 1, 1, m3 * G
        r = np.linalg.solve(A, b)
        sizes = np.hypot(r[0], r[1]), np.hypot(r[2], r[3]), np.hypot(r[4], r[5])
        friction = np.array(
            [-radius * f / math.sqrt(1 + f * f) * size for f, size in zip(ratio, sizes, strict=True)] + [-slip * abs(r[6])]
        )
    assert tip[1] == pytest.approx(0.0, abs=1e-12)
    return float(r[7])


@pytest.mark.parametrize("mu", [0.0, 0.15, 0.4])
def test_slider_crank_by_newton_and_euler(mu):
    """Second formulation: balances of each body, friction by successive substitution."""
    crank = rubbing_crank(mu)
    run = sd.simulate(crank.driven(speed=12.0), until=0.5, samples=41, **TIGHT)
    by_hand = [torque_by_hand(crank, angle, 12.0, mu, 0.012, 1e-3) for angle in run["angle"].sel(body="crank").values.tolist()]
    np.testing.assert_allclose(run["drive_torque"], by_hand, atol=1e-10 * np.abs(by_hand).max())


@pytest.mark.parametrize(
    ("crank", "until", "within", "least", "part"),
    [
        (rubbing_crank(0.15, transition=0.02), 0.3, 1e-7, 0.1, "pin_friction"),
        (crank_with_bristles(), 0.05, 1e-8, 0.07, "pin_lugre"),
    ],
    ids=["rubbing", "bristles"],
)
def test_free_motion_of_explicit_and_implicit_steps(crank, until, within, least, part):
    """Cross-check: two methods agree, the energy balance closes, and friction follows the reactions of the result."""
    explicit, implicit = (
        sd.simulate(spinning(crank), until=until, samples=31, method=method, rtol=1e-10, atol=1e-12)
        for method in ("dop853", "rodas5p")
    )
    np.testing.assert_allclose(explicit["angle"], implicit["angle"], atol=within)
    lost = float(explicit["dissipated_energy"][-1])
    assert lost > least
    assert float(np.abs(explicit["energy_residual"]).max()) < 1e-8 * lost
    assert_reactions(explicit, part, 1e-9)


def test_balance_of_reactions():
    """Identity: in a driven crank friction follows the reactions of the result."""
    run = sd.simulate(rubbing_crank(0.3).driven(speed=12.0), until=0.5, samples=21, **TIGHT)
    assert_reactions(run, "pin_friction", 1e-10)


def test_friction_next_to_an_open_contact():
    """Identity: an open contact exerts no force on a pin, independent of earlier evaluations."""
    crank = rubbing_crank(0.3, transition=0.05).with_clearance("slider pin", sd.Clearance(2e-5))
    loose = dataclasses.replace(crank, components=tuple(part for part in crank.components if part.name != "slider pin"))
    run = sd.simulate(loose.driven(speed=12.0), until=0.05, samples=41)
    assert 0 < int(run["in_contact"].sel(joint="slider pin").sum()) < 41
    exact = np.linalg.norm(run["reaction"].sel(joint="crank pin").values, axis=1)
    np.testing.assert_allclose(run["pin_friction_reaction"].sel(pin_friction="crank pin"), exact, atol=1e-9 * exact.max())


@pytest.mark.parametrize(
    ("part", "text"),
    [
        (
            sd.PinFriction("f", "rod", 0.01, 0.1),
            "pin friction 'f': no ideal pins join 'rod' and 'ground'; expected bodies that one ideal pin joins: 'crank' and "
            "'ground', 'crank' and 'rod', 'rod' and 'slider'",
        ),
        (
            sd.GuideFriction("g", ("ground", "origin"), ("slider", "centre"), 0.3, 0.1),
            r"guide friction 'g': no ideal guide matches it; expected start on 'ground', end = 'slider.centre'",
        ),
    ],
)
def test_refused(part, text):
    """Contract: friction where no ideal joint is refused, and the error lists the joints."""
    crank = dataclasses.replace(sd.slider_crank(crank=0.1, rod=0.3), components=(part,))
    with pytest.raises(sd.InputError, match=text):
        sd.simulate(crank, until=0.1)


def test_hard_contact_with_friction_is_refused():
    """Contract: friction in joints together with hard contact is refused by name."""
    crank = rubbing_crank(0.1)
    hard = crank.with_clearance("slider pin", sd.Clearance(1e-4, contact="hard"))
    frictions = tuple(part for part in hard.components if part.name != "slider pin")
    with pytest.raises(
        sd.InputError, match=r"pin friction 'ground pin' together with hard contact; expected contact = 'compliant'"
    ):
        sd.simulate(dataclasses.replace(hard, components=frictions), until=0.01)


def test_is_the_limit_of_a_small_clearance():
    """Second formulation: a journal with friction in a bearing of small clearance."""
    bar, friction = (
        sd.bar("bar", length=1.0, mass=2.0, angle=-0.3),
        sd.PinFriction("friction", "bar", 0.01, 0.3, transition=1e-4),
    )
    ideal = sd.simulate(on_pin(bar, friction, gravity=G), until=1.0)
    apart = []
    for clearance in (8e-6, 2e-6):
        joint = sd.Clearance(clearance, journal_radius=0.01, friction=sd.Ambrosio(0.3, 0.0, 1e-4))
        run = sd.simulate(on_pin(bar, gravity=G).with_clearance("O", joint), until=1.0)
        assert float(run["friction_loss"][-1]) == pytest.approx(float(ideal["dissipated_energy"][-1]), rel=500.0 * clearance)
        apart.append(float(np.abs(run["angle"] - ideal["angle"]).max()))
    assert apart[1] < 6e-5
    assert apart[1] < 0.5 * apart[0]


def test_batch_is_the_runs():
    """Identity: cases of a batch equal single runs bit for bit, independent of earlier evaluations."""
    crank, values = spinning(rubbing_crank(0.15, transition=0.02)), [0.1, 0.3]
    batch = sd.simulate_many(crank, {"ground pin.kinetic": values}, until=0.1, measures=["damper_loss", "steps"])
    runs = [sd.simulate(crank.replace("ground pin.kinetic", mu), until=0.1) for mu in values]
    np.testing.assert_array_equal(batch["damper_loss"], [float(run["damper_loss"][-1]) for run in runs])


FINE = {"rtol": 1e-10, "atol": 1e-12}  # Tolerances of accurate runs with bristles


@pytest.mark.parametrize("speed", [0.3, 5.0])
def test_steady_sliding(speed):
    """Closed form: the Stribeck curve and the viscous part, on the friction circle."""
    friction = bristles(kinetic=0.2, static=0.3, viscous=0.05)
    run = sd.simulate(journal(friction).driven(speed=speed, body="disc"), until=0.05, samples=3, **FINE)
    slip = RADIUS * speed
    ratio = 0.2 + 0.1 * math.exp(-((slip / 0.01) ** 2)) + 0.05 * slip
    assert float(run["drive_torque"][-1]) == pytest.approx(WEIGHT * RADIUS * math.sin(math.atan(ratio)), rel=1e-13)


def test_soft_bristles():
    """Closed form: at constant speed from rest friction grows as g (1 - exp(-sigma_0 x / g))."""
    friction = bristles(kinetic=0.3, bristle_stiffness=50.0, bristle_damping=0.0)
    run = sd.simulate(journal(friction).driven(speed=5.0, body="disc"), until=0.2, samples=9, **FINE)
    ratio = 0.3 * (1.0 - np.exp(-50.0 * RADIUS * 5.0 * run["time"].values / 0.3))
    np.testing.assert_allclose(run["drive_torque"], WEIGHT * RADIUS * np.sin(np.arctan(ratio)), rtol=1e-8, atol=1e-12)


@pytest.mark.parametrize("share", [0.1, 0.5, 0.95])
def test_presliding(share):
    """Closed form: a slow torque below breakaway turns the pin by -mu_s/(sigma_0 R) ln(1 - tan(phi)/mu_s), where it stays."""
    torque = share * WEIGHT * RADIUS * math.sin(math.atan(0.3))
    load = sd.Torque("load", "disc", torque, time_function=sd.Cycloidal(0.0, 1.0, 2.0))
    run = sd.simulate(journal(bristles(kinetic=0.2, static=0.3), load), until=3.0, samples=4)
    ratio = math.tan(math.asin(torque / (WEIGHT * RADIUS)))
    exact = -0.3 / (1e5 * RADIUS) * math.log(1.0 - ratio / 0.3)
    turned = run["angle"].values[:, 0] - run["angle"].values[0, 0]
    assert turned[-1] == pytest.approx(exact, rel=1e-3 if share > 0.9 else 1e-5)
    assert abs(float(run["angular_velocity"][-1, 0])) < 1e-9
    if share == 0.1:  # sigma_0 R^2 W is the stiffness of small angles
        assert turned[-1] == pytest.approx(torque / (1e5 * RADIUS**2 * WEIGHT), rel=0.06)


def test_breakaway():
    """Limit: 5 % more than R W sin(arctan(mu_s)) breaks the pin away."""
    torque = 1.05 * WEIGHT * RADIUS * math.sin(math.atan(0.3))
    load = sd.Torque("load", "disc", torque, time_function=sd.Cycloidal(0.0, 1.0, 2.0))
    run = sd.simulate(journal(bristles(kinetic=0.2, static=0.3), load), until=3.0, samples=4)
    assert float(run["angle"][-1, 0]) > 1.0


def test_stiff_bristles():
    """Order of convergence: a disc runs down as with Coulomb friction, up to an error of 1/sigma_0; energy closes."""
    torque, errors = WEIGHT * RADIUS * math.sin(math.atan(0.2)), []
    for stiffness in (1e4, 1e5):
        friction = bristles(kinetic=0.2, bristle_stiffness=stiffness, bristle_damping=0.0)
        run = sd.simulate(journal(friction, angular_velocity=20.0), until=0.5, samples=3, **FINE)
        errors.append(float(run["angular_velocity"][-1, 0]) - (20.0 - torque / 0.02 * 0.5))
        lost = float(run["dissipated_energy"][-1])
        assert float(np.abs(run["energy_residual"]).max()) < 1e-9 * lost
    assert errors[0] / errors[1] == pytest.approx(10.0, rel=1e-3)


def pulled(**friction):
    """Return a block of 1 kg on a floor, pulled by a spring of 1 N/mm whose end moves at 2 mm/s."""
    block, hand = sd.point_mass("block", mass=1.0, position=(0.0, 0.0)), sd.point_mass("hand", mass=1.0, position=(1.0, 0.0))
    guides = (sd.Guide("floor", ("block", "centre")), sd.Guide("rail", ("hand", "centre")))
    pull = sd.CoordinateDrive("pull", sd.Slide(("hand", "centre")), sd.Polynomial((1.0, 2e-3)))
    spring = sd.Spring("spring", ("block", "centre"), ("hand", "centre"), stiffness=1e3, free_length=1.0)
    floor = sd.GuideLuGre("floor", ("ground", "O"), ("block", "centre"), 0.0, **friction)
    return sd.Mechanism((block, hand), guides=guides, drives=(pull,), components=(spring, floor), ground=ORIGIN, gravity=G)


def test_stick_slip():
    """Closed form: slip is half an oscillation about mu_k N, from F to 2 mu_k N - F; F approaches mu_s N with sigma_0."""
    breakaway = []
    for stiffness in (1e5, 1e6):
        bristles = {"bristle_stiffness": stiffness, "bristle_damping": math.sqrt(stiffness)}
        run = sd.simulate(pulled(kinetic=0.2, static=0.4, stribeck_speed=1e-4, **bristles), until=6.0, samples=6001)
        force = run["spring_force"].values[:, 0] / G
        breakaway.append(float(force.max()))
        assert breakaway[-1] + float(force[force.argmax() :].min()) == pytest.approx(2.0 * 0.2, rel=1e-3)
        fastest = (breakaway[-1] - 0.2) * G * math.sqrt(1.0 / 1e3) + 2e-3
        velocity = run["velocity"].sel(body="block", axis="x").values
        assert float(velocity.max()) == pytest.approx(fastest, rel=0.02)
        assert float(np.mean(np.abs(velocity) < 1e-4)) > 0.9
    assert 0.36 < breakaway[0] < breakaway[1] < 0.4
    assert breakaway[1] == pytest.approx(0.4, rel=0.02)


@pytest.mark.parametrize(("slope", "holds"), [(0.28, True), (0.32, False)])
def test_block_on_an_incline(slope, holds):
    """Closed form: mu_s = 0.3 holds a block up to tan(alpha) = mu_s, without creep."""
    angle = math.atan(slope)
    block = sd.point_mass("block", mass=2.0, position=(0.0, 0.0))
    friction = sd.GuideLuGre("friction", ("ground", "O"), ("block", "centre"), angle, 0.2, 0.3)
    guide = sd.Guide("incline", ("block", "centre"), direction=angle)
    run = sd.simulate(
        sd.Mechanism((block,), guides=(guide,), components=(friction,), ground=ORIGIN, gravity=G), until=2.0, samples=3
    )
    assert (math.hypot(*run["position"].values[-1, 0]) < 1e-4) is holds
    if holds:
        assert float(np.linalg.norm(run["velocity"].values[-1, 0])) < 1e-9


def test_rest_and_statics():
    """Contract: statics treats bristles as Coulomb friction; from static equilibrium a crank with bristles stays at rest."""
    crank = crank_with_bristles()
    coulomb = dataclasses.replace(crank, components=tuple(part.without_bristles() for part in crank.components))
    drive = sd.Cycloidal(0.5, 2.0, 1.0)
    torques = [
        sd.statics(part.driven(drive), until=1.0, points=5, friction="forward")["drive_torque"] for part in (crank, coulomb)
    ]
    np.testing.assert_array_equal(*torques)
    run = sd.simulate(crank, until=0.01, start="static")
    assert float(np.abs(run["angular_velocity"]).max()) < 1e-6
