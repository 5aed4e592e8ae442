"""Friction in ideal joints together with couplings and bending bars: closed forms, limits, and reactions by a second method."""

import dataclasses
import math

import numpy as np
import pytest

import scissordyn as sd

G = 9.81  # [m/s^2] gravitational acceleration
TIGHT = {"rtol": 1e-11, "atol": 1e-11}  # Options of `simulate` for accurate runs
ORIGIN = (("O", (0.0, 0.0)),)  # Ground with one point at the origin


LOAD = 400.0  # [N] weight on an axle


def rolling_cart(radius, axle, mu):
    """Return a cart on a light wheel that rolls on a road, with friction in the axle, pulled at a constant speed."""
    wheel = sd.Body("wheel", mass=1e-3, inertia=1e-5, points={"c": (0.0, 0.0)}, position=(0.0, radius), angle=0.0)
    cart = sd.point_mass("cart", mass=LOAD / G, position=(0.0, radius))
    return sd.Mechanism(
        (wheel, cart),
        joints=(sd.Revolute("axle", ("wheel", "c"), ("cart", "centre")),),
        guides=(sd.Guide("road", ("wheel", "c"), through=(0.0, radius)),),
        couplings=(sd.Coupling("tyre", sd.Slide(("wheel", "c")), sd.RelativeAngle("wheel"), -radius),),
        drives=(sd.CoordinateDrive("pull", sd.Slide(("cart", "centre")), sd.Polynomial((0.0, 0.5))),),
        components=(sd.PinFriction("friction", "wheel", axle, mu, base="cart", transition=1e-9),),
        gravity=G,
    )


@pytest.mark.parametrize("mu", [0.1, 0.5])
def test_rolling_cart(mu):
    """Closed form: a wheel with axle friction under a load W needs the pull W s / sqrt(1 - s^2), s = R sin(phi) / r."""
    run = sd.simulate(rolling_cart(0.15, 0.02, mu), until=0.1, samples=3)
    share = 0.02 * math.sin(math.atan(mu)) / 0.15
    np.testing.assert_allclose(run["coordinate_drive_force"], LOAD * share / math.sqrt(1.0 - share**2), rtol=1e-12)


def jack(screw, mu):
    """Return an arm with friction in its pin, raised by a rod of varying length or by a screw between the same points."""
    arm = sd.bar("arm", length=0.6, mass=3.0, position=(0.0, 0.0), angle=0.5)
    pin = sd.Revolute("A", ("arm", "start"), ("ground", "O"))
    ground = (*ORIGIN, ("P", (0.5, 0.0)))
    length = math.dist((0.5, 0.0), arm.place("end"))
    friction = sd.PinFriction("friction", "arm", 0.05, mu, transition=0.02)
    if not screw:
        rod = sd.Rod("rod", ("ground", "P"), ("arm", "end"), motion=sd.Harmonic(length, 0.06, 5.0))
        return sd.Mechanism((arm,), (pin,), rods=(rod,), components=(friction,), ground=ground, gravity=G)
    motor = sd.Body("motor", mass=1.0, inertia=1e-4, points={"c": (0.0, 0.0)}, position=(0.5, 0.0), angle=0.0)
    distance = sd.Distance(("ground", "P"), ("arm", "end"))
    return sd.Mechanism(
        (arm, motor),
        (pin, sd.Revolute("M", ("motor", "c"), ("ground", "P"))),
        drives=(sd.Drive("motor", sd.Harmonic(0.0, 30.0, 5.0)),),
        couplings=(sd.Coupling("screw", distance, sd.RelativeAngle("motor"), 0.002),),
        components=(friction,),
        ground=ground,
        gravity=G,
    )


def test_screw_jack_by_a_rod():
    """Cross-check: a screw with friction in the arm's pin carries the force of a rod of the same length; energy closes."""
    screw, rod = (sd.simulate(jack(kind, 0.4), until=0.6, **TIGHT) for kind in (True, False))
    np.testing.assert_allclose(screw["coupling_force"], -rod["rod_force"], atol=1e-9 * float(np.abs(rod["rod_force"]).max()))
    lost = float(screw["dissipated_energy"][-1])
    assert lost == pytest.approx(float(rod["dissipated_energy"][-1]), rel=1e-9)
    assert float(np.abs(screw["energy_residual"]).max()) < 1e-8 * lost


def test_jam_of_a_rolling_wheel():
    """Limit: the wheel's axle jams where R sin(phi) reaches r, and the cause names the friction."""
    run = sd.simulate(rolling_cart(0.1, 0.2, 0.7), until=0.1, samples=3)
    assert "the mechanism jams: no reactions are in balance with friction 'friction'" in run.attrs["cause"]


def hinged(mu, sense, **bent):
    """Return a horizontal bar that bends, on a pin with friction; a long rope slowly lifts or lowers its end."""
    bar = sd.bar("bar", length=1.0, mass=4.0, position=(0.0, 0.0), angle=0.0)
    rope = sd.Rod("rope", ("ground", "top"), ("bar", "end"), motion=sd.Polynomial((50.0, -0.01 * sense)))
    mechanism = sd.Mechanism(
        (bar,),
        (sd.Revolute("O", ("bar", "start"), ("ground", "O")),),
        rods=(rope,),
        components=(sd.PinFriction("friction", "bar", 0.02, mu, transition=1e-5),),
        ground=(*ORIGIN, ("top", (1.0, 50.0))),
        gravity=G,
    )
    return sd.with_bending(mechanism, bending_stiffness=2e3, axial_stiffness=2e5, damping=3e-3, **bent)


@pytest.mark.parametrize("bent", [{}, {"elements": 2}])
@pytest.mark.parametrize("sense", [1.0, -1.0])
def test_bar_that_bends_on_a_pin(bent, sense):
    """Closed form: the rope carries W (1/2 + s) / (1 + s), s = R sin(phi) / L, and W/2 without friction.

    The sag shortens the bar by 3e-6 of its length in both cases.
    """
    force = [
        float(sd.simulate(hinged(mu, sense, **bent), until=0.5, samples=2, start="static")["rod_force"][-1, 0])
        for mu in (0.0, 0.8)
    ]
    share = sense * 0.02 * math.sin(math.atan(0.8))
    assert force[1] / force[0] == pytest.approx((1.0 + 2.0 * share) / (1.0 + share), rel=1e-6)


def test_bar_that_bends_and_jams():
    """Contract: a friction circle of 4 % of a bar's length jams with 8 modes, not with one, and the cause says so."""
    wide = hinged(0.8, 1.0, modes=8).replace("friction.radius", 0.065)
    cause = sd.simulate(wide, until=1e-3, samples=2, start="static").attrs["cause"]
    assert "no reactions are in balance with friction 'friction'; pins of a flexible bar jam if" in cause
    one = sd.simulate(hinged(0.8, 1.0, modes=1).replace("friction.radius", 0.065), until=1e-3, samples=2, start="static")
    assert one.attrs["status"] == "complete"


# Name and both bodies of each pin of a slider-crank
PINS = (("ground pin", "crank", "ground"), ("crank pin", "rod", "crank"), ("slider pin", "rod", "slider"))
# Stiffnesses [N m^2, N] and damping [s] of flexible bars
BENT = {"bending_stiffness": 50.0, "axial_stiffness": 5e4, "damping": 1e-4}


def crank_with_friction(*joints, mu=0.3):
    """Return a slider-crank of uniform bars with friction in some pins."""
    crank = sd.slider_crank(crank=0.1, rod=0.3, gravity=G)
    rod = crank.body("rod")
    bodies = tuple(dataclasses.replace(b, inertia=rod.mass * 0.09 / 12.0) if b is rod else b for b in crank.bodies)
    pins = [sd.PinFriction(joint, body, 0.012, mu, base=base, transition=0.05) for joint, body, base in PINS if joint in joints]
    return dataclasses.replace(crank, bodies=bodies, components=tuple(pins))


def loaded(mechanism):
    """Return the mechanism with a payload next to the end of the crank."""
    at = mechanism.body("crank/2")
    heavy = dataclasses.replace(at, mass=at.mass + 0.5, centre=(0.02, 0.03), inertia=(at.inertia or 0.0) + 1e-3)
    return dataclasses.replace(mechanism, bodies=tuple(heavy if body is at else body for body in mechanism.bodies))


def on_rollers():
    """Return a heavy block on two rollers along an arm that bends, with friction in the pin of the arm."""
    car = sd.Body("car", 2.0, 0.05, {"front": (0.1, 0.0), "rear": (-0.1, 0.0)}, position=(0.6, 0.0), velocity=(1.0, 0.0))
    rollers = tuple(sd.Roller(end, ("car", end), "arm", stiffness=1e4, damping=10.0) for end in ("front", "rear"))
    arm = sd.bar("arm", length=1.0, mass=3.0, angle=0.0)
    pin = sd.Revolute("ground pin", ("arm", "start"), ("ground", "O"))
    friction = sd.PinFriction("ground pin", "arm", 0.02, 0.3, transition=0.05)
    mechanism = sd.Mechanism((arm, car), (pin,), components=(*rollers, friction), ground=ORIGIN, gravity=G)
    return sd.with_bending(mechanism, "arm", bending_stiffness=500.0, axial_stiffness=5e4)


def loose():
    """Return a crank of bending bars with friction in two pins and clearance in the third."""
    bent = sd.with_bending(crank_with_friction("ground pin", "crank pin"), ["crank", "rod"], **BENT)
    return bent.with_clearance("slider pin", sd.Clearance(2e-4)).driven(speed=12.0)


ALL = tuple(joint for joint, _, _ in PINS)  # Names of all pins of a slider-crank
# Functions that build a mechanism with friction next to other parts, by name
MECHANISMS = {
    "modes": lambda: sd.with_bending(crank_with_friction(*ALL), ["crank", "rod"], **BENT).driven(speed=12.0),
    "elements": lambda: sd.with_bending(crank_with_friction(*ALL), "rod", elements=2, **BENT).driven(speed=12.0),
    "payload": lambda: loaded(sd.with_bending(crank_with_friction(*ALL), "crank", **BENT)).driven(speed=12.0),
    "clearance": loose,
    "rollers": on_rollers,
}


@pytest.mark.parametrize("kind", MECHANISMS)
def test_reactions_of_bars_that_bend(kind):
    """Cross-check: the reactions that friction follows are those of the result, which numpy computes from the bars' shapes."""
    run = sd.simulate(MECHANISMS[kind](), until=0.01, samples=9)
    assert run.attrs["status"] == "complete"
    size, joints = np.linalg.norm(run["reaction"].values, axis=2), run["joint"].values.tolist()
    for k, joint in enumerate(run["pin_friction"].values.tolist()):
        exact = size[:, joints.index(joint)]
        np.testing.assert_allclose(run["pin_friction_reaction"][:, k], exact, atol=1e-8 * exact.max())


def test_payload_on_a_bar_that_bends():
    """Identity: without friction the crank pin provides the momentum of rod and slider along the guide."""
    bent = loaded(sd.with_bending(crank_with_friction(), "crank", **BENT)).driven(speed=12.0)
    run = sd.simulate(bent, until=0.01, samples=9)
    momentum = sum(bent.body(name).mass * run["acceleration"].sel(body=name, axis="x") for name in ("rod", "slider"))
    exact = np.abs(np.asarray(momentum))
    np.testing.assert_allclose(np.abs(run["reaction"].sel(joint="crank pin", axis="x")), exact, atol=1e-8 * exact.max())


def test_stiff_bars():
    """Order of convergence: the friction loss with bending bars approaches that of rigid bars as 1/EI."""
    crank, move = crank_with_friction(*ALL), sd.Cycloidal(0.5, 2.0, 0.2)
    options = {"until": 0.2, "samples": 2, "rtol": 1e-8, "atol": 1e-9}
    rigid, beyond = float(sd.simulate(crank.driven(move), **options)["dissipated_energy"][-1]), []
    for stiffness in (12.5, 50.0):
        bars = {**BENT, "bending_stiffness": stiffness, "axial_stiffness": 1e3 * stiffness, "modes": 1}
        bent = sd.with_bending(crank, ["crank", "rod"], **bars)
        beyond.append(float(sd.simulate(bent.driven(move), **options)["dissipated_energy"][-1]) / rigid - 1.0)
    assert abs(beyond[1]) < 1e-2
    assert beyond[0] / beyond[1] == pytest.approx(4.0, rel=0.15)
