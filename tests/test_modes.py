"""Natural frequencies along the motion of the drive: the same as those of a mechanism built there, and closed forms."""

import dataclasses
import json
import math

import numpy as np
import pytest
from tests.build import EXAMPLES, chain, on_pin, one_line_error

import scissordyn as sd
from reference.free_bodies import Scissor
from scissordyn.cli.main import status_of
from scissordyn.laws.elastic.linear import Linear


def array(angle):
    """Return two units of bars that bend, driven at 1 rad/s."""
    rigid = sd.scissor(units=2, angle=angle)
    return sd.with_bending(rigid, section="tube 60x60x1.56 mm", material="steel", elements=2).driven(speed=1.0)


@pytest.mark.parametrize("position", ["static", "concentric"])
def test_frequencies_at_a_later_position_are_those_of_an_array_built_there(position):
    """Second road: followed from 0.5 to 0.9 rad, and assembled at 0.9 rad."""
    followed = sd.modes(array(0.5), count=6, position=position, times=[0.0, 0.25, 0.4])
    built = sd.modes(array(0.9), count=6, position=position)
    assert followed["frequency"].dims == ("time", "mode")
    assert followed["input"].values.ravel() == pytest.approx([0.5, 0.75, 0.9], abs=1e-12)
    np.testing.assert_allclose(followed["frequency"][-1], built["frequency"], rtol=1e-7)
    np.testing.assert_allclose(followed["position"][-1], built["position"], atol=1e-8)
    first = sd.modes(array(0.5), count=6, position=position)
    np.testing.assert_allclose(followed["frequency"][0], first["frequency"], rtol=1e-9)


def test_a_rigid_pendulum_on_a_driven_crank_swings_alike_everywhere():
    """Closed form: omega^2 = 3 g/(2 L) of a uniform bar that hangs from the end of a crank, wherever the crank is held."""
    crank, rod = sd.bar("crank", length=0.3, mass=1.0), sd.bar("rod", length=0.5, mass=2.0, angle=-math.pi / 2.0)
    made = chain(crank, rod).driven(speed=2.0, body="crank")
    found = sd.modes(made, times=np.linspace(0.0, 3.0, 7))
    assert found["angular_frequency"].values.ravel() == pytest.approx(np.full(7, math.sqrt(1.5 * 9.81 / 0.5)), rel=1e-7)
    assert found["angle"].sel(body="rod").values == pytest.approx(np.full(7, -math.pi / 2.0), abs=1e-7)


@pytest.mark.parametrize("name", ["planetary-gear", "screw-driven-array", "jansen"])
def test_neutral_positions_have_no_frequency(name):
    """Limit: a mechanism at rest in every position, whose stiffnesses of forces and constraints cancel but for round-off."""
    assert sd.modes(sd.zoo[name].mechanism, drive="released")["frequency"].values.tolist() == [0.0]


def test_a_load_has_its_value_of_each_instant():
    """Closed form: a bar on a driven crank under a force that grows with time, omega^2 = F L/(m L^2/3)."""
    bars = [sd.bar(name, length=0.5, mass=1.5, angle=angle) for name, angle in (("crank", 0.3), ("bar", -0.5 * math.pi))]
    growing = sd.Force("pull", ("bar", "end"), force=(0.0, -10.0), time_function=sd.Polynomial((1.0, 2.0)))
    hung = dataclasses.replace(chain(*bars, gravity=0.0), components=(growing,)).driven(speed=0.5, body="crank")
    times = np.array([0.0, 0.5, 2.0])
    found = sd.modes(hung, times=times)["angular_frequency"].values[:, 0]
    np.testing.assert_allclose(found, np.sqrt(10.0 * (1.0 + 2.0 * times) / (1.5 * 0.5 / 3.0)), rtol=1e-9)


def test_what_has_no_stroke_is_refused():
    """Bad input: no drive, and times that go back."""
    free = sd.with_bending(sd.scissor(units=1), bending_stiffness=1e4, axial_stiffness=1e7, elements=1)
    with pytest.raises(sd.InputError, match="without a drive"):
        sd.modes(free, times=[0.0, 1.0])
    with pytest.raises(sd.InputError, match="not finite, increasing"):
        sd.modes(array(0.5), times=[0.1, 0.1])


def test_a_rod_that_is_driven_has_its_length_in_metres():
    """Contract: what each drive holds has its own unit; a bar on a jack and a spring, at the lengths that the jack is given."""
    jack = sd.Rod("jack", ("lever", "end"), ("ground", "foot"), motion=sd.Polynomial((0.5, 0.1)))
    made = sd.Mechanism(
        (
            sd.bar("lever", length=0.5, mass=1.0, angle=0.3),
            sd.bar("rod", length=0.4, mass=1.0, position=(0.0, 0.0), angle=-1.5),
        ),
        (sd.Revolute("O", ("lever", "start"), ("ground", "O")), sd.Revolute("P", ("rod", "start"), ("lever", "start"))),
        rods=(jack,),
        ground=(("O", (0.0, 0.0)), ("foot", (0.5, -0.4))),
    )
    found = sd.modes(made, times=[0.0, 0.2], count=1)
    assert found["drive"].values.tolist() == ["jack"]
    assert found["unit"].values.tolist() == ["m"]
    assert found["input"].values.ravel() == pytest.approx([0.5, 0.52])


def journal(clearance, stiffness, mass=2.0):
    """Return a body that hangs in a clearance joint by its mass centre."""
    body = sd.Body("body", mass, 0.1, {"centre": (0.0, 0.0)})
    gap = sd.Clearance(clearance, stiffness=stiffness)
    joint = sd.Revolute("J", ("body", "centre"), ("ground", "O"), clearance=gap)
    return sd.Mechanism((body,), joints=(joint,), ground=(("O", (0.0, 0.0)),), gravity=9.81)


def test_a_journal_rests_on_the_stiffness_of_its_contact():
    """Closed form: across, k = 1.5 m g/delta of Hertz' law under the weight; along the surface, g over the eccentricity."""
    found = sd.modes(journal(1e-3, sd.Hertz()), joints="contact")
    weight = 2.0 * 9.81
    assert found["contact_force"].item() == pytest.approx(weight, rel=1e-8)
    depth = 1.5 * weight / found["contact_stiffness"].item()
    assert 0.0 < depth < 1e-6
    across, along = math.sqrt(1.5 * 9.81 / depth), math.sqrt(9.81 / (1e-3 + depth))
    assert found["angular_frequency"].values == pytest.approx([0.0, along, across], rel=1e-6)
    assert np.argmax(np.abs(found["shape"].sel(mode=2).values.ravel())) == 0
    soft = sd.modes(journal(1e-3, Linear(4e5)), joints="contact")
    assert soft["angular_frequency"].values[2] == pytest.approx(math.sqrt(4e5 / 2.0), rel=1e-9)


def test_tight_stiff_contacts_tend_to_ideal_joints():
    """Order of convergence: the difference falls as the clearance does."""
    ideal = sd.modes(array(0.5), count=5)["frequency"].values
    apart = []
    for clearance in (1e-5, 1e-6, 1e-7):
        gap = sd.Clearance(clearance, stiffness=Linear(1e11))
        found = sd.modes(array(0.5).with_clearance("A", gap), count=5, joints="contact")
        apart.append(float(np.max(np.abs(found["frequency"].values / ideal - 1.0))))
    assert np.diff(np.log10(apart)) == pytest.approx([-1.0, -1.0], abs=0.05)
    assert apart[2] < 1e-4


def test_a_journal_without_load_is_free():
    """Limit: without gravity nothing is carried, and two motions of the journal have no frequency."""
    gap = sd.Clearance(1e-4)
    weightless = dataclasses.replace(array(0.5), gravity=0.0)
    found = sd.modes(weightless.with_clearance("unit 2/pivot", gap), count=6, joints="contact")
    assert found["contact_force"].item() == 0.0
    assert np.sum(found["frequency"].values == 0.0) == 2


def test_a_released_pendulum():
    """Closed form: held 60 deg below the horizontal, omega^2 = 3 g sin(60 deg)/(2 L); above it, unstable."""
    for angle in (-math.pi / 3.0, math.pi / 3.0):
        made = on_pin(sd.bar("bar", length=0.5, mass=2.0, angle=angle), gravity=9.81).driven(speed=1.0)
        square = 1.5 * 9.81 / 0.5 * math.sin(-angle)
        found = sd.modes(made, drive="released", times=[0.0, 0.2])["angular_frequency"].values.ravel()
        later = 1.5 * 9.81 / 0.5 * math.sin(-angle - 0.2)
        assert found == pytest.approx([math.copysign(math.sqrt(abs(s)), s) for s in (square, later)], rel=1e-9)
        with pytest.raises(sd.InputError, match="cannot move"):
            sd.modes(made)


def test_command_names_unstable_positions(tmp_path, capsys):
    """Contract: a table with a negative value says how many positions are unstable, and the largest growth rate."""
    made = on_pin(sd.bar("bar", length=0.5, mass=2.0, angle=sd.degrees(-20)), gravity=9.81).driven(speed=1.0)
    sd.write_case(made, tmp_path / "case.toml")
    arguments = ["modes", str(tmp_path / "case.toml"), "--drive", "released", "--points", "3", "--until"]
    assert status_of([*arguments, "0.1 s"]) == 0
    assert "Unstable" not in capsys.readouterr().out
    assert status_of([*arguments, "0.8 s"]) == 0
    last = capsys.readouterr().out.splitlines()[-1]
    assert last.startswith("Unstable at 2 of 3 positions: a negative value is minus the growth rate over 2 pi")
    assert float(last.split()[-2]) == pytest.approx(math.sqrt(1.5 * 9.81 / 0.5 * math.sin(0.8 - sd.degrees(20))), rel=1e-5)


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"joints": "contact", "position": "concentric"}, "no joint is in contact"),
        ({"joints": "contact"}, "without clearance joints"),
        ({"joints": "loose"}, "joints"),
        ({"drive": "free"}, "drive"),
    ],
)
def test_options_that_do_not_fit_are_refused(options, said):
    """Bad input: one line."""
    with one_line_error(match=said):
        sd.modes(array(0.5), **options)


def test_servo_on_its_reference_without_any_load():
    """Second formulation: nothing of an array in orbit is loaded; stiffness of its servo over the inertia of bars cut free."""
    modes = sd.modes(sd.read_case(EXAMPLES / "solar_array.toml").mechanism)
    inertia = Scissor(4, 0.6, 0.4, 0.5, 1.5, (0.0, 0.0)).inertia(math.radians(75.0))
    assert modes["angular_frequency"].values == pytest.approx([math.sqrt(400.0 / inertia)], rel=1e-11)


def ziegler_column(load):
    """Return two bars of 1 m and 1 kg in a line, on hinge springs of 10 N m/rad, under a force that turns with the last bar."""
    column = chain(*(sd.bar(name, length=1.0, mass=1.0, angle=0.0) for name in ("first", "last")), gravity=0.0)
    parts = (
        sd.TorsionSpring("foot", "first", stiffness=10.0),
        sd.TorsionSpring("knee", "last", base="first", stiffness=10.0),
        sd.Force("thrust", ("last", "end"), force=(-load, 0.0), follows=True),
    )
    return dataclasses.replace(column, components=parts)


@pytest.mark.parametrize("load", [0.0, 12.0, 20.0, 30.0, 45.0])
def test_a_force_that_turns_with_its_bar_can_cause_flutter(load):
    """Closed form: Ziegler's column with a stiffness matrix that is not symmetric; it flutters and does not buckle."""
    mass = np.array([[4.0 / 3.0, 1.0 / 2.0], [1.0 / 2.0, 1.0 / 3.0]])
    stiffness = 10.0 * np.array([[2.0, -1.0], [-1.0, 1.0]]) + load * np.array([[-1.0, 1.0], [0.0, 0.0]])
    half, product = 0.5 * np.trace(np.linalg.solve(mass, stiffness)), np.linalg.det(stiffness) / np.linalg.det(mass)
    root = np.sqrt(complex(half**2 - product))
    rates = [np.sqrt(half - root), np.sqrt(half + root)]
    wanted = [rate.real if load < 25.0 else -abs(rate.imag) for rate in rates]
    column = ziegler_column(load)
    np.testing.assert_allclose(sd.modes(column)["angular_frequency"], wanted, rtol=1e-9)
    grows = sd.simulate(column, until=0.01, start="static").attrs["warnings"]
    assert ("unstable" in grows) == (load > 25.0)
    if load:
        with pytest.raises(sd.InputError, match="buckling under 'thrust': forces that turn with a body have no potential"):
            sd.buckling(column)


def test_a_wheel_that_turns_about_its_mass_centre_has_a_rotation_of_one():
    """Contract: a mode without displacements is scaled by its rotation, also where pin and mass centre differ by round-off."""
    wheel = sd.Body("wheel", 2.0, 0.3, {"pin": (0.1 + 0.2, 0.0)}, centre=(0.3, 0.0), position=(0.0, 0.0), angle=0.0)
    pin = sd.Revolute("pin", ("wheel", "pin"), ("ground", "O"))
    spring = sd.TorsionSpring("spring", "wheel", stiffness=7.0)
    found = sd.modes(sd.Mechanism((wheel,), (pin,), ground=(("O", (0.3, 0.0)),), components=(spring,)))
    assert found["angular_frequency"].item() == pytest.approx(math.sqrt(7.0 / 0.3), rel=1e-12)
    assert abs(found["rotation"].item()) == pytest.approx(1.0, rel=1e-12)
    assert float(np.abs(found["shape"]).max()) < 1e-15


def test_the_body_that_a_mode_without_displacements_turns_is_named(tmp_path, capsys):
    """Contract: the command names the wheel that turns, although no mass centre moves."""
    wheels = [
        sd.Body(name, 2.0, 0.3, {"pin": (0.0, 0.0)}, position=(place, 0.0), angle=0.0)
        for name, place in (("left", 0.0), ("right", 1.0))
    ]
    pins = tuple(sd.Revolute(f"{wheel.name} pin", (wheel.name, "pin"), ("ground", wheel.name)) for wheel in wheels)
    springs = tuple(
        sd.TorsionSpring(wheel.name, wheel.name, stiffness=of) for wheel, of in zip(wheels, (50.0, 7.0), strict=True)
    )
    ground = (("left", (0.0, 0.0)), ("right", (1.0, 0.0)))
    sd.write_case(sd.Mechanism(tuple(wheels), pins, ground=ground, components=springs), tmp_path / "wheels.toml")
    assert status_of(["modes", str(tmp_path / "wheels.toml")]) == 0
    first, second = capsys.readouterr().out.splitlines()[:2]
    assert "0.768791 Hz   moves 'right' most" in first
    assert "2.05468 Hz   moves 'left' most" in second


@pytest.mark.parametrize(("units", "angle", "stiffness"), [(1, 55.0, 700.0), (2, 40.0, 500.0), (3, 45.0, 900.0)])
def test_a_small_free_motion_has_the_first_frequency(units, angle, stiffness):
    """Cross-check: the mean period of a small swing about equilibrium, by its zero crossings; it grows with the amplitude."""
    placed = math.radians(angle)
    arm = sd.scissor(units=units, bar_length=1.0, bar_mass=1.0, slider_mass=1.0, angle=placed, gravity=2.0)
    spring = sd.TorsionSpring("spring", "unit 1/bar 1", "unit 1/bar 2", stiffness=stiffness, free_angle=2.0 * placed)
    held = dataclasses.replace(arm, components=(spring,))
    omega = float(sd.modes(held)["angular_frequency"][0])
    run = sd.simulate(held, until=20.0 * 2.0 * math.pi / omega, samples=2001)
    swing, time = run["angle"].values[:, 0], run["time"].values
    swing = swing - 0.5 * (swing.max() + swing.min())
    up = np.flatnonzero((swing[:-1] < 0.0) & (swing[1:] >= 0.0))
    crossing = time[up] - swing[up] * (time[up + 1] - time[up]) / (swing[up + 1] - swing[up])
    amplitude = float(swing.max())
    assert 1e-4 < amplitude < 2e-2
    assert 2.0 * math.pi / float(np.mean(np.diff(crossing))) == pytest.approx(omega, rel=1e-6 + amplitude**2)


def wheels(*dampings, stiffness=(50.0, 30.0), inertias=(2.0, 0.5)):
    """Return wheels in a row, each on a spring and a damper to the one before it; the first to the ground."""
    bodies = tuple(
        sd.Body(f"wheel {k}", 1.0, inertia, {"pin": (0.0, 0.0)}, position=(float(k), 0.0), angle=0.0)
        for k, inertia in enumerate(inertias)
    )
    pins = tuple(sd.Revolute(f"pin {k}", (body.name, "pin"), ("ground", body.name)) for k, body in enumerate(bodies))
    bases = ["ground", *(body.name for body in bodies[:-1])]
    springs = tuple(
        sd.TorsionSpring(f"spring {k}", body.name, base, stiffness=k_spring, damping=damping)
        for k, (body, base, k_spring, damping) in enumerate(zip(bodies, bases, stiffness, dampings, strict=False))
    )
    ground = tuple((body.name, (float(k), 0.0)) for k, body in enumerate(bodies))
    return sd.Mechanism(bodies, pins, ground=ground, components=springs)


@pytest.mark.parametrize("ratio", [0.0, 0.02, 0.7, 0.99, 1.5, 20.0])
def test_damping_of_one_wheel(ratio):
    """Closed form: c/(2 sqrt(k J)) and sqrt(1 - ratio^2) of the natural frequency, below and above critical damping."""
    damping, omega = 2.0 * ratio * math.sqrt(50.0 * 2.0), math.sqrt(50.0 / 2.0)
    found = sd.modes(wheels(damping, inertias=(2.0,)))
    assert found["damping_ratio"].item() == pytest.approx(ratio, rel=1e-7, abs=1e-15)
    assert 2.0 * math.pi * found["damped_frequency"].item() == pytest.approx(
        omega * math.sqrt(max(0.0, 1.0 - ratio**2)), rel=1e-6
    )
    assert found["damping_match"].item() == pytest.approx(1.0, rel=1e-12)


@pytest.mark.parametrize("dampings", [(0.2, 0.3), (4.0, 0.0), (0.0, 5.0)])
def test_damping_of_two_wheels(dampings):
    """Closed form: roots of the characteristic polynomial of two wheels, also if the damping is not proportional."""
    found = sd.modes(wheels(*dampings))
    c, k = np.array(dampings), np.array([50.0, 30.0])
    first = np.array([2.0, c[0] + c[1], k[0] + k[1]])
    second, between = np.array([0.5, c[1], k[1]]), np.array([c[1], k[1]])
    roots = np.roots(np.polysub(np.polymul(first, second), np.polymul(between, between)))
    oscillating = sorted(roots[roots.imag > 0.0], key=abs)
    real = roots.real[roots.imag == 0.0]
    for mode, root in enumerate(oscillating):
        assert found["damping_ratio"].values[mode] == pytest.approx(-root.real / abs(root), rel=1e-6)
        assert 2.0 * math.pi * found["damped_frequency"].values[mode] == pytest.approx(root.imag, rel=1e-6)
    if real.size:
        assert found["damping_ratio"].values[1] == pytest.approx(-0.5 * sum(real) / math.sqrt(np.prod(real)), rel=1e-6)
        assert found["damped_frequency"].values[1] == 0.0


def test_a_damper_that_nearly_locks_a_wheel_mixes_the_modes(tmp_path, capsys):
    """Limit: the damper holds the first wheel, the other one swings alone; the modes with poor shapes are named."""
    made = wheels(100.0, 0.0, stiffness=(50.0, 50.0), inertias=(1.0, 1.0))
    found = sd.modes(made)
    assert 2.0 * math.pi * found["damped_frequency"].values == pytest.approx([math.sqrt(50.0), 0.0], rel=1e-2)
    assert found["damping_match"].values[1] < 0.5 < found["damping_match"].values[0]
    sd.write_case(made, tmp_path / "case.toml")
    assert status_of(["modes", str(tmp_path / "case.toml")]) == 0
    first, second, last = capsys.readouterr().out.splitlines()[:3]
    assert first.endswith("moves 'wheel 1' most   damping ratio 0.03553 at 1.12468 Hz")
    assert second.endswith("most   damping ratio 7.036")
    assert last.startswith("Warning: damping changes the shape of mode 2 so much")


@pytest.mark.parametrize("integral", [0.0, 40.0, 150.0])
def test_a_controller_with_an_integral_can_be_unstable(integral):
    """Closed form: J s^3 + k_d s^2 + k_p s + k_i = 0 of a wheel on a servo; above k_i = 100 the oscillation grows."""
    held = dataclasses.replace(wheels(inertias=(2.0,)), components=()).controlled(sd.PID(50.0, 4.0, integral), body="wheel 0")
    roots = np.roots([2.0, 4.0, 50.0, integral])
    root = roots[np.argmax(roots.imag)]
    found = sd.modes(held)
    assert found["damping_ratio"].item() == pytest.approx(-root.real / abs(root), rel=1e-6)
    assert 2.0 * math.pi * found["damped_frequency"].item() == pytest.approx(root.imag, rel=1e-6)
    assert (found["damping_ratio"].item() < 0.0) == (integral > 100.0)


def test_the_limit_of_a_servo_has_risen():
    """Contract: a limit that rises from zero over a ramp leaves the servo its stiffness, at the start and along a motion."""
    arm = sd.scissor(units=2, angle=0.7)
    steady, rising = (arm.controlled(sd.PID(2e4, 100.0, limit=700.0, ramp=ramp)) for ramp in (0.0, 0.1))
    for name in ("frequency", "damping_ratio"):
        assert sd.modes(rising)[name].item() == sd.modes(steady)[name].item()


def test_delayed_feedback_is_named():
    """Contract: a warning names the actuator whose delayed signal is constant."""
    held = dataclasses.replace(wheels(inertias=(2.0,)), components=()).controlled(sd.PID(50.0, 4.0), body="wheel 0")
    assert json.loads(sd.modes(held).attrs["warnings"]) == []
    delayed = held.controlled(sd.Pyragas(3.0, 0.2), body="wheel 0")
    (line,) = json.loads(sd.modes(delayed).attrs["warnings"])
    assert line.startswith(f"actuator '{delayed.components[-1].name}': its delayed signal is constant")


def test_friction_of_a_seal_is_left_out():
    """Contract: a gas spring's friction, which is steep about rest, has no part in the damping; its damper has.

    The derivative of a force of 300 N by differences of 1e-9 m/s has a round-off of 2e-5 N s/m.
    """
    body = sd.Body("mass", 2.0, 1.0, {"centre": (0.0, 0.0)}, position=(0.5, 0.0), angle=0.0)
    guide = sd.Guide("guide", ("mass", "centre"), aligned=True)
    ends = (("mass", "centre"), ("ground", "O"))
    gas = sd.GasSpring("gas", *ends, force=300.0, extended_length=0.6, stroke=0.3, friction=20.0, damping=50.0)
    spring = sd.Spring("spring", *ends, stiffness=2e3, free_length=0.35)
    found = sd.modes(sd.Mechanism((body,), guides=(guide,), ground=(("O", (0.0, 0.0)),), components=(gas, spring), gravity=0.0))
    omega = found["angular_frequency"].item()
    assert found["damping_ratio"].item() == pytest.approx(50.0 / (2.0 * 2.0 * omega), rel=2e-5 / 50.0)


@pytest.mark.parametrize("units", [1, 2])
def test_a_small_free_motion_decays_with_the_damping_ratio(units):
    """Cross-check: the logarithmic decrement and the period of a small swing, by least squares over its extremes."""
    placed = math.radians(50.0)
    arm = sd.scissor(units=units, bar_length=1.0, bar_mass=1.0, slider_mass=1.0, angle=placed, gravity=2.0)
    spring = sd.TorsionSpring("spring", "unit 1/bar 1", "unit 1/bar 2", stiffness=5e4, damping=40.0, free_angle=2.0 * placed)
    held = dataclasses.replace(arm, components=(spring,))
    found = sd.modes(held).isel(mode=0)
    ratio, period = found["damping_ratio"].item(), 1.0 / found["damped_frequency"].item()
    run = sd.simulate(held, until=6.0 * period, samples=6001, rtol=1e-11)
    rest = sd.modes(held)["angle"].values[0]
    swing = run["angle"].values[::500, 0] - rest
    decrement = np.diff(np.log(np.abs(swing)))
    assert 1e-5 < abs(swing[0]) < 1e-3
    wanted = math.pi * ratio / math.sqrt(1.0 - ratio**2)
    assert wanted > 0.01
    assert decrement == pytest.approx(np.full(decrement.size, -wanted), rel=abs(swing[0]) * 10)
