"""Hard contact: impulses with restitution and Coulomb friction, between located impacts and by time stepping."""

import dataclasses
import math

import numpy as np
import pytest
from tests.build import counts_of, in_bearing, one_line_error

import scissordyn as sd
from scissordyn.laws.friction.coulomb import Coulomb

GRAVITY = 9.81  # [m/s^2] gravitational acceleration


def ball(restitution=0.5, friction=None, *, velocity=(0.0, 0.0)):
    """Return a point mass in a bearing of 1 m clearance, through which it falls."""
    laws = {"friction": friction} if friction is not None else {}
    gap = sd.Clearance(1.0, journal_radius=1.1, damping=sd.LankaraniNikravesh(restitution), contact="hard", **laws)
    return in_bearing(gap, velocity=velocity)


def block(*, velocity=(0.0, 0.0), tilt=0.0, angle=0.0, **laws):
    """Return a block of 0.1 m by 0.2 m and 1 kg in a wide, tilted channel; it starts on the lower surface."""
    half, side, gap, radius = 0.05, 0.1, 0.02, 1e-7
    inertia = (half**2 + side**2) / 3.0
    low = -side * math.cos(angle) - half * math.sin(abs(angle))
    place = (0.0, -(side + gap) - low)
    body = sd.Body("block", 1.0, inertia, {"middle": (0.0, 0.0)}, position=place, velocity=velocity, angle=angle)
    corners = ((-half, -side), (half, -side), (half, side), (-half, side))
    wide = sd.GuideClearance(gap, corners=corners, corner_radius=radius, **{"contact": "hard", **laws})
    direction = -0.5 * math.pi + tilt
    one = sd.Mechanism(
        (body,), guides=(sd.Guide("channel", ("block", "middle")),), output_body="block", gravity_direction=direction
    )
    return one.with_clearance("channel", wide)


def test_ball_comes_to_rest():
    """Closed form: with e = 1/2 a ball that falls 1 m hits the ground at sqrt(2/g) (1, 2, 2.5, ...) and rests at 3 sqrt(2/g).

    That is 1.35457092295719 s. The rule for infinitely many impacts ends them e/(1-e) times a thousandth of a step earlier.
    """
    run = sd.simulate(ball(), until=1.5, start="as-placed", step=1e-3)
    first = math.sqrt(2.0 / GRAVITY)
    starts, speeds = run["contact_start"].values, run["approach_speed"].values
    expected = first * np.concatenate([[1.0], 1.0 + 2.0 * np.cumsum(0.5 ** np.arange(1, 12))])
    np.testing.assert_allclose(starts[:12], expected, rtol=1e-10)
    np.testing.assert_allclose(speeds[:12], GRAVITY * first * 0.5 ** np.arange(12), rtol=1e-9)
    np.testing.assert_allclose(run["rebound_speed"][:12], -0.5 * speeds[:12], rtol=1e-10)
    np.testing.assert_allclose(run["impulse"][:12], 1.5 * speeds[:12], rtol=1e-10)
    np.testing.assert_allclose(run["contact_damping_loss"][:12], 0.5 * speeds[:12] ** 2 * 0.75, rtol=1e-10)
    assert starts[-1] == pytest.approx(1.35457092295719, abs=3e-6)
    assert run["reaction"].values[-1, 0, 1] == pytest.approx(GRAVITY, rel=1e-6)
    assert np.isnan(run["peak_force"]).all()


def test_a_turned_channel_turns_the_motion():
    """Identity: a tumbling block with friction in a channel that is turned as a whole, with gravity, moves in the same way."""
    straight, turn = block(velocity=(1.0, -0.5), tilt=0.2, angle=0.05, friction=sd.LuGre(kinetic=0.3)), 0.6
    cos, sin = math.cos(turn), math.sin(turn)
    (body,), (guide,) = straight.bodies, straight.guides
    (x, y), (vx, vy) = body.position, body.velocity
    turned = dataclasses.replace(
        straight,
        bodies=(
            dataclasses.replace(
                body,
                position=(cos * x - sin * y, sin * x + cos * y),
                velocity=(cos * vx - sin * vy, sin * vx + cos * vy),
                angle=body.angle + turn,
            ),
        ),
        guides=(dataclasses.replace(guide, direction=turn),),
        gravity_direction=straight.gravity_direction + turn,
    )
    one, other = (sd.simulate(each, until=0.3, start="as-placed", step=1e-3, samples=31) for each in (straight, turned))
    place = one["position"].sel(body="block").values @ np.array([[cos, sin], [-sin, cos]])
    assert one.sizes["contact"] > 2
    np.testing.assert_allclose(other["position"].sel(body="block").values, place, atol=1e-9)
    np.testing.assert_allclose(other["angle"].sel(body="block").values, one["angle"].sel(body="block").values + turn, atol=1e-9)


def test_time_stepping_has_order_one():
    """Order of convergence: the end of a ball's impacts with steps across them, fitted over a decade of step sizes."""
    steps = [2e-3, 1e-3, 5e-4, 2.5e-4]
    errors = []
    for step in steps:
        run = sd.simulate(ball(), until=1.5, start="as-placed", step=step, events="crossed")
        assert not counts_of(run)["impacts_located"]
        errors.append(abs(float(run["contact_start"][-1]) - 1.35457092295719))
    assert np.polyfit(np.log(steps), np.log(errors), 1)[0] == pytest.approx(1.0, abs=0.35)


@pytest.mark.parametrize("events", ["located", "crossed"])
def test_sliding_block_stops(events):
    """Closed form: a block slides v^2/(2 mu g) in v/(mu g) and sticks, and friction dissipates its energy.

    Its corners are so stiff that it does not lean noticeably.
    """
    speed, mu = 0.5, 0.2
    laws = {"friction": Coulomb(mu), "damping": sd.LankaraniNikravesh(0.0), "stiffness": sd.law("stiffness", "linear")(1e12)}
    run = sd.simulate(block(velocity=(speed, 0.0), **laws), until=0.4, start="as-placed", step=1e-4, events=events)
    x = run["position"].sel(body="block", axis="x").values
    assert x[-1] == pytest.approx(0.5 * speed**2 / (mu * GRAVITY), rel=1e-3)
    stopped = float(run["time"][np.argmax(x > x[-1] - 1e-9)])
    assert stopped == pytest.approx(speed / (mu * GRAVITY), abs=5e-4)
    assert float(run["friction_loss"][-1]) == pytest.approx(0.5 * speed**2, rel=1e-5)
    assert np.ptp(x[-200:]) < 1e-12
    assert {name for name, part in counts_of(run)["sticking"].items() if part > 0.2} == {"channel/corner 1", "channel/corner 2"}


def test_block_on_an_incline():
    """Closed form: below the angle of static friction the block sticks, above it slides at g (sin - mu_k cos)."""
    laws = {"friction": sd.LuGre(kinetic=0.3, static=0.5), "damping": sd.LankaraniNikravesh(0.0)}
    held = sd.simulate(block(tilt=math.atan(0.45), **laws), until=0.3, start="as-placed", step=2e-4)
    assert float(np.abs(held["velocity"].sel(axis="x")).max()) < 1e-9
    tilt = math.atan(0.55)
    freed = sd.simulate(block(tilt=tilt, **laws), until=0.3, start="as-placed", step=2e-4)
    speed = float(freed["velocity"].sel(body="block", axis="x")[-1])
    assert speed == pytest.approx(0.3 * GRAVITY * (math.sin(tilt) - 0.3 * math.cos(tilt)), rel=1e-3)


def test_energy_of_each_impact():
    """Identity: restitution and friction dissipate the loss of kinetic energy, impact by impact, and the balance closes."""
    run = sd.simulate(ball(0.8, Coulomb(0.1), velocity=(0.7, 0.4)), until=2.0, start="as-placed", step=1e-3, samples=40_001)
    lost = (run["contact_damping_loss"] + run["contact_friction_loss"]).values
    mechanical = (run["kinetic_energy"] + run["potential_energy"]).values
    starts, time = run["contact_start"].values, run["time"].values
    for start, loss in list(zip(starts, lost, strict=True))[:3]:
        at = int(np.searchsorted(time, start))
        assert mechanical[at - 2] - mechanical[at + 2] == pytest.approx(loss, rel=1e-4)
    assert float(np.abs(run["energy_residual"]).max()) < 2e-5 * float(run["kinetic_energy"].max())


def test_compliant_contact_becomes_hard():
    """Limit: the first rebound of a compliant journal approaches that of a hard one with increasing stiffness."""
    hard = sd.simulate(ball(0.5), until=0.6, start="as-placed", step=1e-3)
    errors = []
    for stiffness in (1e7, 1e9, 1e11):
        joint = sd.Clearance(
            1.0, journal_radius=1.1, stiffness=sd.law("stiffness", "linear")(stiffness), damping=sd.law("damping", "exact")(0.5)
        )
        soft = ball().with_clearance("pin", joint)
        run = sd.simulate(soft, until=0.6, start="as-placed", samples=3)
        errors.append(abs(float(run["rebound_speed"][0]) - float(hard["rebound_speed"][0])))
        assert float(run["contact_start"][0]) == pytest.approx(float(hard["contact_start"][0]), rel=1e-8)
    assert errors[2] < 0.2 * errors[1] < 0.04 * errors[0] + 1e-9


def test_estimated_peak_force():
    """Closed form: with linear stiffness and no loss the peak is v sqrt(k m); with loss it is that of a compliant run."""
    from scissordyn.record.events import peak_forces

    linear, mass, speed = sd.law("stiffness", "linear")(1e8), np.array([2.0]), np.array([0.3])
    elastic = sd.Clearance(1e-3, stiffness=linear, damping=sd.LankaraniNikravesh(1.0))
    assert peak_forces(elastic, mass * speed**2)[0] == pytest.approx(0.3 * math.sqrt(2e8), rel=1e-4)
    joint = sd.Clearance(1e-3, damping=sd.Flores(0.6))
    one = dataclasses.replace(in_bearing(joint, mass=2.0, velocity=(0.3, 0.0)), gravity=0.0)
    run = sd.simulate(one, until=5e-3, start="as-placed", samples=3)
    assert peak_forces(joint, mass * speed**2)[0] == pytest.approx(float(run["peak_force"][0]), rel=1e-3)
    hard = one.with_clearance("pin", dataclasses.replace(joint, contact="hard"))
    found = sd.simulate(hard, until=5e-3, start="as-placed", samples=3)
    assert float(found["effective_mass"][0]) == pytest.approx(2.0, rel=1e-12)
    assert float(found["peak_force_estimate"][0]) == pytest.approx(float(run["peak_force"][0]), rel=1e-3)


def loose_array(units=2):
    """Return a driven array with hard contact at every joint."""
    arm = sd.scissor(units=units, bar_length=0.5, bar_mass=0.2, slider_mass=0.3, angle=sd.degrees(60), gravity=0.0)
    gap = sd.Clearance(1e-4, journal_radius=5e-3, damping=sd.Flores(0.7), friction=sd.LuGre(kinetic=0.1), contact="hard")
    return arm.with_clearance("all", gap).driven(speed=sd.rpm(20))


def test_energy_balance_of_an_array():
    """Order of convergence: with impacts, friction and a drive the error of the energy balance falls with the step."""
    residual = []
    for step in (4e-5, 1e-5):
        run = sd.simulate(loose_array(), until=0.1, step=step)
        assert counts_of(run)["steps_not_solved"] == 0
        residual.append(float(np.abs(run["energy_residual"]).max()) / float(run["kinetic_energy"].max()))
    assert residual[0] < 1e-3
    assert residual[1] < 0.5 * residual[0]


def test_hard_and_compliant_journals_in_series():
    """Closed form: a hard and a compliant journal in series carry the static load."""
    hard = sd.Clearance(1e-3, contact="hard", damping=sd.LankaraniNikravesh(0.0))
    soft = sd.Clearance(1e-3, stiffness=sd.law("stiffness", "linear")(1e5), damping=sd.law("damping", "kelvin-voigt")(100.0))
    bodies = (sd.Body("upper", 1.0, None, {"c": (0.0, 0.0)}), sd.Body("lower", 1.0, None, {"c": (0.0, 0.0)}))
    joints = (sd.Revolute("A", ("upper", "c"), ("ground", "o"), hard), sd.Revolute("B", ("lower", "c"), ("upper", "c"), soft))
    run = sd.simulate(sd.Mechanism(bodies, joints=joints, ground=(("o", (0.0, 0.0)),)), until=0.5, start="as-placed", step=1e-5)
    assert run["normal_force"].values[-1].tolist() == pytest.approx([2.0 * GRAVITY, GRAVITY], rel=1e-3)


def test_loads_act_at_the_middle_of_each_step():
    """Closed form: the speed that a harmonic force gives a free mass is the midpoint sum of its impulses."""
    rate, step, count = 9.0, 0.01, 20
    push = sd.Force("push", ("ball", "centre"), (1.0, 0.0), time_function=sd.Harmonic(0.0, 1.0, rate))
    one = dataclasses.replace(ball(), components=(push,), gravity=0.0)
    run = sd.simulate(one, until=count * step, start="as-placed", step=step)
    middles = step * (np.arange(count) + 0.5)
    assert float(run["velocity"].sel(body="ball", axis="x")[-1]) == pytest.approx(
        step * np.sum(np.sin(rate * middles)), rel=1e-12
    )


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"friction": sd.LuGre(kinetic=0.1, bristle_stiffness=2e5)}, "bristle_stiffness"),
        ({"damping": sd.law("damping", "kelvin-voigt")()}, "kelvin-voigt"),
        ({"lubrication": sd.Lubrication(viscosity=0.05)}, "lubrication"),
    ],
)
def test_refused_fields_of_a_hard_contact(changes, words):
    """Contract: a field without meaning for a hard contact is refused by name."""
    with one_line_error(words):
        sd.Clearance(1e-4, contact="hard", **changes)


def test_method_and_contact_have_to_fit():
    """Contract: time stepping without hard contact, and error-controlled methods with it, are refused."""
    with pytest.raises(sd.InputError, match="no hard contact"):
        sd.simulate(ball().with_clearance("pin", sd.Clearance(1.0, journal_radius=1.1)), until=0.1, method="moreau-jean")
    with pytest.raises(sd.InputError, match="hard contact in joint 'pin'"):
        sd.simulate(ball(), until=0.1, method="rodas5p")


def test_number_of_steps_with_round_off_in_time():
    """Contract: round-off in the sum of steps adds no extra step."""
    until, found = 0.02, 0
    joint = sd.Clearance(1e-4, damping=sd.Flores(0.5), contact="hard")
    arm = sd.scissor(units=1, angle=sd.degrees(60)).with_clearance("A", joint).driven(speed=sd.rpm(20))
    for count in range(9000, 9040):
        step = until / count
        reached = 0.0
        for _ in range(count):
            reached += step
        if not 1e-9 * step < until - reached < 1e-6 * step or found == 3:
            continue
        found += 1
        run = sd.simulate(arm, until=until, step=step, events="crossed", samples=3)
        assert counts_of(run)["steps"] == count
    assert found == 3


def test_block_in_a_moving_channel_keeps_the_momentum():
    """Identity: a block that tumbles with friction in the channel of a free body: both keep their angular momentum."""
    turn, place = 0.3, 0.3
    inside = (place * math.cos(turn), place * math.sin(turn))
    channel = dataclasses.replace(block(friction=sd.LuGre(kinetic=0.3)).guides[0], body="carrier")
    tumbling = dataclasses.replace(
        block().bodies[0], position=inside, velocity=(0.4, -0.8), angle=turn + 0.05, angular_velocity=1.5
    )
    carrier = sd.Body("carrier", 2.0, 0.05, {"o": (0.0, 0.0), "e": (1.0, 0.0)}, angle=turn, angular_velocity=-0.7)
    both = sd.Mechanism((carrier, tumbling), guides=(channel,), gravity=0.0, output_body="block")
    run = sd.simulate(both, until=0.6, start="as-placed", step=1e-3, samples=61)
    impulse = run["velocity"].values * np.array([carrier.mass, tumbling.mass])[:, None]
    orbit = run["position"].values[..., 0] * impulse[..., 1] - run["position"].values[..., 1] * impulse[..., 0]
    momentum = np.sum(orbit + run["angular_velocity"].values * [carrier.inertia, tumbling.inertia], axis=1)
    assert run.sizes["contact"] > 5
    assert float(np.ptp(run["angular_velocity"].sel(body="carrier").values)) > 1.0
    np.testing.assert_allclose(momentum, momentum[0], atol=1e-6)


def test_compliant_block_slides_beside_a_hard_contact():
    """Closed form: v = v_0 - mu g t on linear surfaces with steep friction, in a mechanism with a hard contact elsewhere."""
    stiffness, kinetic, speed = 5e4, 0.3, 0.1
    soft = {
        "stiffness": sd.law("stiffness", "linear")(stiffness),
        "damping": sd.law("damping", "kelvin-voigt")(200.0),
        "friction": sd.law("friction", "threlfall")(kinetic, 1e-6),
        "contact": "compliant",
    }
    one = block(velocity=(speed, 0.0), **soft)
    (body,) = one.bodies
    sunk = dataclasses.replace(body, position=(0.0, body.position[1] - body.mass * GRAVITY / (2.0 * stiffness)))
    two = dataclasses.replace(one, bodies=(sunk, *ball().bodies), joints=ball().joints, ground=ball().ground)
    run = sd.simulate(two, until=0.03, start="as-placed", step=1e-3, samples=4)
    assert counts_of(run)["method"] == "moreau-jean"
    expected = speed - kinetic * GRAVITY * run["time"].values
    np.testing.assert_allclose(run["velocity"].sel(body="block", axis="x").values, expected, atol=1e-5)


@pytest.mark.parametrize("step", [0.0101, 0.01, 0.005, 0.003, 1e-3, 0.1 / 13.0])
@pytest.mark.parametrize("start", [0.0, 0.05])
def test_a_central_impact_at_an_end_of_a_step(step, start):
    """A journal in a straight line can end a step, or start the run, at a gap of round-off from its bearing."""
    gap = sd.Clearance(0.05, journal_radius=0.1, damping=sd.LankaraniNikravesh(0.6), contact="hard")
    free = dataclasses.replace(in_bearing(gap, velocity=(0.5, 0.0), position=(start, 0.0)), gravity=0.0)
    run = sd.simulate(free, until=0.2 - 2.0 * start, start="as-placed", step=step)
    assert run["approach_speed"].values.tolist() == pytest.approx([0.5], rel=1e-12)
    assert run["velocity"].values[-1, 0].tolist() == pytest.approx([-0.3, 0.0], rel=1e-9, abs=1e-12)
    assert run["position"].values[-1, 0, 0] == pytest.approx(0.05 - 0.3 * 0.1, rel=1e-9)


@pytest.mark.parametrize("late", np.linspace(-3e-9, 3e-9, 7))
def test_impact_next_to_the_end_of_a_step(late):
    """Closed form: an impact a few nanoseconds before or after the end of a step is at the time of flight."""
    clearance = 0.4 * (0.003 + late)
    ball = in_bearing(sd.Clearance(clearance, contact="hard"), velocity=(0.4, 0.0)).with_parts({"gravity": 0.0})
    run = sd.simulate(ball, until=3.5e-3, step=1e-5, samples=2, start="as-placed")
    assert float(run["contact_start"][0]) == pytest.approx(clearance / 0.4, rel=1e-13)
