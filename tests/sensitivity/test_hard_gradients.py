"""Derivatives of runs with hard contacts: closed forms of impacts, and differences of a pendulum in a hole."""

import json

import numpy as np
import pytest

import scissordyn as sd
from scissordyn.laws.friction.coulomb import Coulomb
from scissordyn.model.parameter_path import changed
from scissordyn.plan.plan import plan
from scissordyn.run.advance.loop import advance
from scissordyn.run.trajectory import make_driver
from scissordyn.sensitivity.forward import forward
from scissordyn.sensitivity.seed import Start, derivatives, parameter_of

MASS, INERTIA, RADIUS = 1.0, 2e-3, 0.06  # Mass [kg], inertia [kg m^2] and radius [m] of a disc


def disc(clearance, restitution, friction, *, gravity=0.0, radius=RADIUS, **motion):
    """Return a disc in a round hole of the ground, with hard contact."""
    gap = sd.Clearance(
        clearance,
        journal_radius=radius,
        damping=sd.LankaraniNikravesh(restitution),
        friction=Coulomb(friction) if isinstance(friction, float) else friction,
        contact="hard",
    )
    body = sd.Body("disc", MASS, INERTIA, {"centre": (0.0, 0.0)}, **motion)
    hole = sd.Revolute("hole", ("disc", "centre"), ("ground", "middle"), gap)
    return sd.Mechanism((body,), (hole,), ground=(("middle", (0.0, 0.0)),), gravity=gravity)


def derivatives_at_end(found, name, axis):
    """Return the derivatives of a motion of the disc at the end of the run."""
    return found[f"{name}_derivative"].sel(body="disc", axis=axis).values[-1]


def test_a_ball_that_bounces_on_the_bottom_of_a_hole():
    """Closed form: height and instant of the impact, by height, speed, gravity and restitution."""
    depth = 3.0
    ball = disc(depth, 0.8, 0.1, gravity=10.0, radius=4.0, position=(0.0, 5.0 - depth), velocity=(0.0, -0.1))
    by = ["body.disc.position.y", "body.disc.velocity.y", "gravity", "hole.restitution"]
    found = sd.gradient(
        ball, of=["hole.first_contact"], by=by, until=1.9, step=1e-2, start="as-placed", trajectory=True, samples=2
    )
    # impulses are 1e-11 too small, the compliance of hard surfaces
    assert found["position"].sel(axis="y").values[-1, 0] + depth == pytest.approx(3.13991895702715, abs=1e-9)
    exact = [0.837828112891426, 0.101531721120973, -0.103906843531788, 9.09995497612619]
    assert derivatives_at_end(found, "position", "y") == pytest.approx(exact, rel=1e-9)
    # z0 + v0 t - g t^2 / 2 = 0
    time = found["value"].item()
    fall = 10.0 * time + 0.1
    assert found["derivative"].values[0] == pytest.approx([1 / fall, time / fall, -0.5 * time**2 / fall, 0.0], abs=1e-10)
    assert json.loads(found.attrs["statistics"])["misfit"] < 1e-13
    assert not json.loads(found.attrs["warnings"])


@pytest.mark.parametrize("share", [0.5, 1.0 - 1e-4, 1.0 + 1e-4, 2.0])
def test_a_disc_that_spins_against_a_wall(share):
    """Closed form: speed along the wall after an impact that sticks or slips; near the border the result says so."""
    speed, restitution, friction = 0.5, 0.6, 0.02
    # sticking takes the impulse r w / (1/m + r^2/J), and slipping friction times (1 + e) m v
    mobility = 1.0 / MASS + RADIUS**2 / INERTIA
    spin = share * friction * (1.0 + restitution) * MASS * speed * mobility / RADIUS
    wall = disc(0.05, restitution, friction, velocity=(speed, 0.0), angular_velocity=spin)
    by = ["hole.friction.kinetic", "hole.restitution", "body.disc.velocity.x", "body.disc.angular_velocity", "hole.clearance"]
    found = sd.gradient(wall, by=by, until=0.15, step=3.1e-4, start="as-placed", trajectory=True, samples=2)
    along = float(found["velocity"].sel(axis="y").values[-1, 0])
    slip = (1.0 + restitution) * speed, friction * speed, friction * (1.0 + restitution), 0.0, 0.0
    stick = 0.0, 0.0, 0.0, RADIUS / mobility / MASS, 0.0
    exact = np.array(stick if share < 1.0 else slip) * np.sign(along)
    assert derivatives_at_end(found, "velocity", "y") == pytest.approx(exact, rel=1e-9, abs=1e-11)
    near = 0.9 < share < 1.1
    assert found["limit"].values.tolist() == [*(["mode"] * 4 if near else [""] * 4), ""]
    assert found["valid_until"].values == pytest.approx([0.1 if near else 0.15] * 4 + [0.15])
    assert len([line for line in json.loads(found.attrs["warnings"]) if "stick or slip" in line]) == (4 if near else 0)


WEIGHTS = {1: 4 / 5, 2: -1 / 5, 3: 4 / 105, 4: -1 / 280}  # Central differences of eighth order, by place


def motion(mechanism, options):
    """Return coordinates and rates at the end of a run, and the instants of its contacts."""
    driver, _, _ = make_driver(plan(mechanism), options)
    advance(driver, options.until)
    return np.concatenate([driver.state.y[: 2 * driver.plan.coordinates.free], driver.log["time"]])


@pytest.mark.parametrize(("restitution", "until"), [(0.0, 0.05), (0.5, 0.0199)])
def test_a_pendulum_in_a_hole(restitution, until):
    """Cross-check: a pendulum that falls into its hole, slides or bounces there, by differences of eighth order."""
    swinging = {"centre": (0.0, -0.2), "angle": 1.0, "angular_velocity": 0.5}
    bob = disc(1e-3, restitution, 0.05, gravity=9.81, **swinging)
    options = sd.Options(until, "as-placed", 2, events="located", step=1e-4)
    begin = Start(bob, options.start)
    parameters = [
        parameter_of(bob, path, 1.0)
        for path in ("hole.clearance", "gravity", "body.disc.angular_velocity", "hole.friction.kinetic")
    ]
    run = forward(plan(bob), options, [derivatives(begin, parameter) for parameter in parameters], change=1e-3)
    size = 2 * run.driver.plan.coordinates.free
    assert run.driver.log["time"].size >= 3
    assert run.misfit < 1e-13
    for k, parameter in enumerate(parameters):
        step, total = 1e-5, 0.0
        for place, weight in WEIGHTS.items():
            for sign in (1, -1):
                moved = changed(bob, parameter.path, parameter.value + sign * place * step * parameter.scale)
                total = total + sign * weight / step * motion(moved, options)
        found = np.concatenate([run.state[:size, k], run.log[:, 0, k]])
        # rates have round-off of 2e-13 m/s, since positions are differences of nearby points
        assert found == pytest.approx(total, abs=1e-6 * np.max(np.abs(total)) + 2e-13 / step)


@pytest.mark.parametrize(("static", "limit"), [(0.05, ""), (0.3, "mode")])
def test_a_contact_that_breaks_away(static, limit):
    """Contract: a friction force that jumps, from static to kinetic friction, ends the time in which the gradient is valid."""
    friction = sd.LuGre(kinetic=0.05, static=static)
    bob = disc(1e-3, 0.0, friction, gravity=9.81, centre=(0.0, -0.2), angle=0.3)
    found = sd.gradient(bob, by=["gravity"], until=0.1, step=2e-4, start="as-placed", trajectory=True, samples=2)
    assert found["limit"].item() == limit
    assert (found["valid_until"].item() < 0.1) == bool(limit)


def test_a_crank_that_reaches_a_compliant_contact_and_a_stop():
    """Closed form: a bearing at a crank's end meets a disc, 2 l sin(omega t / 2) = c, and a stop, omega t = angle.

    Another disc has hard contact.
    """
    length, speed, gap, angle = 0.5, 2.0, 0.01, 0.0213
    hard = disc(0.05, 0.5, 0.1, velocity=(0.3, 0.0))
    other = sd.Body("other", MASS, INERTIA, {"centre": (0.0, 0.0)}, position=(length, 0.0))
    crank = sd.Body("crank", 1.0, 0.1, {"start": (0.0, 0.0), "end": (length, 0.0)})
    soft = sd.Clearance(gap, journal_radius=RADIUS, friction=sd.NoFriction())
    joints = (
        *hard.joints,
        sd.Revolute("O", ("crank", "start"), ("ground", "middle")),
        sd.Revolute("pin", ("other", "centre"), ("crank", "end"), soft),
    )
    stop = sd.AngleStop("stop", "crank", angle, base="disc")
    made = sd.Mechanism((*hard.bodies, other, crank), joints, ground=hard.ground, components=(stop,), gravity=0.0)
    made = made.driven(speed=speed, body="crank")
    options, begin = sd.Options(0.0108, "as-placed", 2, events="located", step=1e-4), Start(made, "as-placed")
    parameters = [parameter_of(made, path, 1.0) for path in ("pin.clearance", "stop.angle", "drive.crank.speed")]
    run = forward(plan(made), options, [derivatives(begin, parameter) for parameter in parameters])
    rises = run.driver.log["mode"] == 1
    # the compliant contact, then the stop
    times = np.array([2.0 * np.arcsin(gap / (2.0 * length)), angle]) / speed
    assert run.driver.log["time"][rises] == pytest.approx(times, rel=1e-9)
    slopes = run.log[rises, 0] / [parameter.scale for parameter in parameters]
    fast = 1.0 / (length * speed * np.cos(0.5 * speed * times[0]))
    exact = [[fast, 0.0, -times[0] / speed], [0.0, 1.0 / speed, -times[1] / speed]]
    assert slopes == pytest.approx(np.array(exact), rel=1e-9, abs=1e-12)


def test_a_beam_between_a_hard_and_a_compliant_bearing():
    """Second road: instants, impulses and the largest force by differences, with friction in both contacts."""

    def beam(**changes):
        number = {"gap": 1e-3, "gravity": 9.81, "restitution": 0.8, **changes}
        kinds = {"soft": ("compliant", number["restitution"]), "hard": ("hard", 0.5)}
        gaps = {
            name: sd.Clearance(
                number["gap"],
                journal_radius=0.01,
                damping=sd.LankaraniNikravesh(restitution),
                friction=Coulomb(0.05),
                contact=contact,
            )
            for name, (contact, restitution) in kinds.items()
        }
        ends = {"soft": (-0.4, 0.0), "hard": (0.4, 0.0)}
        body = sd.Body("beam", 1.0, 0.05, ends, velocity=(0.1, -0.05), angular_velocity=0.4)
        joints = tuple(sd.Revolute(name, ("beam", name), ("ground", name), gaps[name]) for name in ends)
        return sd.Mechanism((body,), joints, ground=tuple(ends.items()), gravity=number["gravity"])

    of = [
        "soft.first_contact",
        "hard.first_contact",
        "soft.impulse",
        "hard.impulse",
        "soft.peak_force",
        "soft.peak_indentation",
    ]
    how = {"of": of, "until": 0.01, "step": 2e-6, "start": "as-placed"}  # two thirds of the steps that the contact allows
    by = {"restitution": ["soft.restitution"], "gravity": ["gravity"], "gap": ["soft.clearance", "hard.clearance"]}
    found = sd.gradient(beam(), by=[path for paths in by.values() for path in paths], **how)
    assert not json.loads(found.attrs["warnings"])
    for name, paths in by.items():
        value = found["parameter_value"].sel(parameter=paths[0]).item()
        more, less = (sd.gradient(beam(**{name: value * (1.0 + h)}), by=["gravity"], **how)["value"] for h in (1e-4, -1e-4))
        slope = found["derivative"].sel(parameter=paths).sum("parameter")
        assert slope.values == pytest.approx((more - less).values / (2e-4 * value), rel=3e-6, abs=1e-9)


def test_steps_that_start_at_a_surface_after_many_impacts() -> None:
    """Second road: differences over the first 20 ms of a slider-crank, in which a step starts on a surface."""

    def crank(clearance: float) -> sd.Mechanism:
        gap = sd.Clearance(clearance, contact="hard")
        return sd.slider_crank().with_clearance("slider pin", gap).driven(speed=100.0)

    found = sd.gradient(crank(2e-4), of=["drive_work"], by=["slider pin.clearance"], until=0.02)
    more, less = (float(sd.simulate(crank(2e-4 + h), until=0.02)["drive_work"].values[-1]) for h in (1e-10, -1e-10))
    assert found["derivative"].item() == pytest.approx((more - less) / 2e-10, rel=1e-2)


def test_steps_that_the_vibration_of_a_compliant_contact_limits():
    """Second road: differences of runs in which such steps follow a located impact, and the invariance of a free impact."""

    def bob(**changes: float) -> sd.Mechanism:
        value = {"clearance": 1e-3, "stiffness": 1e8, **changes}
        hard = disc(0.05, 0.5, 0.1, velocity=(0.3, 0.0))
        soft = sd.Clearance(
            value["clearance"],
            journal_radius=RADIUS,
            stiffness=sd.law("stiffness", "linear")(value["stiffness"]),
            damping=sd.LankaraniNikravesh(0.7),
            friction=Coulomb(0.1),
        )
        body = sd.Body(
            "bob", MASS, INERTIA, {"centre": (0.0, 0.0)}, position=(0.5, 0.0), velocity=(0.4, 0.0), angular_velocity=3.0
        )
        joint = sd.Revolute("pin", ("bob", "centre"), ("ground", "side"), soft)
        ground = (*hard.ground, ("side", (0.5, 0.0)))
        return sd.Mechanism((*hard.bodies, body), (*hard.joints, joint), ground=ground, gravity=0.0)

    of = ["pin.peak_force", "pin.peak_indentation", "pin.impulse", "pin.contact_fraction"]
    how = {"of": of, "until": 0.01, "step": 1e-4, "start": "as-placed"}
    found = sd.gradient(bob(), by=["pin.stiffness.stiffness", "pin.clearance"], **how)
    for name, path in (("stiffness", "pin.stiffness.stiffness"), ("clearance", "pin.clearance")):
        value = found["parameter_value"].sel(parameter=path).item()
        more, less = (
            sd.gradient(bob(**{name: value * (1.0 + h)}), by=["pin.clearance"], **how)["value"] for h in (1e-5, -1e-5)
        )
        slope = (more - less).values / (2e-5 * found["value"].values)
        assert found["elasticity"].sel(parameter=path).values == pytest.approx(slope, abs=1e-5)
    # an impact of a free body returns a share of its speed that does not depend on the stiffness
    stiffer = found["elasticity"].sel(parameter="pin.stiffness.stiffness")
    assert stiffer.sel(measure="pin.impulse").item() == pytest.approx(0.0, abs=5e-4)
    assert stiffer.sel(measure="pin.peak_force").item() == pytest.approx(0.5, abs=5e-4)


@pytest.mark.parametrize("angle", np.linspace(0.1, 1.3, 7).tolist())
def test_a_start_in_contact(angle):
    """Contract: a loaded contact is closed from the start whatever the round-off, and no change of a parameter opens it."""
    bob = disc(1e-3, 0.5, 0.1, gravity=9.81, centre=(0.0, -0.2), angle=angle)
    found = sd.gradient(
        bob,
        of=["hole.first_contact", "hole.impulse"],
        by=["gravity", "hole.clearance"],
        until=1e-3,
        step=1e-4,
        start="in-contact",
    )
    assert found["value"].sel(measure="hole.first_contact").item() == 0.0
    assert found["derivative"].sel(measure="hole.first_contact").values.tolist() == [0.0, 0.0]
    assert found["limit"].values.tolist() == ["", ""]
    # a pendulum that starts at rest is pressed on its bearing in proportion to gravity
    assert found["elasticity"].sel(measure="hole.impulse", parameter="gravity").item() == pytest.approx(1.0, abs=5e-3)
