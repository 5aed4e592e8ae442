"""Couplings and driven coordinates: gears, tyres, screws, cylinders, elbows; racks and planetary gears are in the zoo."""

import dataclasses
import math
import tomllib

import numpy as np
import pytest
import xarray as xr
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from tests.build import ORIGIN, chain, gears, wheel

import scissordyn as sd
from scissordyn.casefile.code import Code
from scissordyn.casefile.configuration import read_configuration
from scissordyn.explore.case import open_case
from scissordyn.explore.field import fields_of
from scissordyn.kinematics.closure import Closure
from scissordyn.plan.plan import plan

TIGHT = {"rtol": 1e-10, "atol": 1e-12}  # Tolerances of accurate runs
ANGLE = sd.RelativeAngle  # Short name of the coordinate class
GROUND = (*ORIGIN, ("P", (0.5, 0.0)))  # Ground with the points "O" and "P"


def gear_pair(ratio=-1.7):
    """Return two coupled wheels on the ground, with a torque on the pinion."""
    return gears(ratio, sd.Torque("load", "pinion", torque=0.7), inertia=(0.02, 0.05), apart=0.5)


def coupled_arms(ratio=-0.6):
    """Return a double pendulum whose second arm turns against the first in a ratio to the angle of the first."""
    upper, lower = sd.bar("upper", length=0.3, mass=1.0, angle=0.4), sd.bar("lower", length=0.2, mass=0.7, angle=0.4)
    belt = sd.Coupling("belt", ANGLE("lower", "upper"), ANGLE("upper"), ratio, offset=-0.4 * ratio)
    return chain(upper, lower, ground={"P": (0.5, 0.0)}, couplings=(belt,))


class Arms:
    """The Lagrangian of `coupled_arms` with its only angle q; the lower arm is at s q + c."""

    def __init__(self, ratio=-0.6):
        self.s, self.c = 1.0 + ratio, -0.4 * ratio

    def mass(self, q):
        """M(q) of the kinetic energy M q'^2 / 2."""
        coupling = 0.7 * 0.3 * 0.1 * math.cos(q - self.s * q - self.c)
        return 0.3**2 / 3.0 + 0.7 * 0.3**2 + 0.7 * 0.2**2 / 3.0 * self.s**2 + 2.0 * self.s * coupling

    def mass_slope(self, q):
        """dM/dq."""
        return -2.0 * self.s * (1.0 - self.s) * 0.7 * 0.3 * 0.1 * math.sin(q - self.s * q - self.c)

    def weight(self, q):
        """dV/dq."""
        return 9.81 * (0.15 * math.cos(q) + 0.7 * (0.3 * math.cos(q) + 0.1 * self.s * math.cos(self.s * q + self.c)))

    def rate(self, _, y):
        """Return the derivatives of q and q'."""
        q, speed = y
        return [speed, -(0.5 * self.mass_slope(q) * speed**2 + self.weight(q)) / self.mass(q)]


def test_gear_pair():
    """Closed form: (J1 + i^2 J2) acceleration = torque; the mesh exerts i J2 a on one wheel and -i times that on the other."""
    run = sd.simulate(gear_pair(), until=3.0, **TIGHT)
    acceleration = 0.7 / (0.02 + 1.7**2 * 0.05)
    angle = 0.5 * acceleration * run["time"].values ** 2
    assert angle[-1] > 6.0 * math.pi  # turns are counted
    assert np.allclose(run["angle"].values, np.stack([angle, -1.7 * angle], axis=1), atol=1e-10)
    assert np.allclose(run["coupling_force"].values, -1.7 * 0.05 * acceleration, rtol=1e-12)
    assert np.allclose(run["coupling_input_force"].values, -(1.7**2) * 0.05 * acceleration, rtol=1e-12)
    assert np.allclose(run["coupling_power"].values[:, 0], 1.7**2 * 0.05 * acceleration**2 * run["time"].values, rtol=1e-9)
    assert np.allclose(run["peak_coupling_force"].values, 1.7 * 0.05 * acceleration)
    assert list(run["coupling_unit"].values) == ["rad"]
    assert np.max(np.abs(run["energy_residual"].values)) < 1e-8


def test_rolling_wheel():
    """Closed form: a disc rolls down the slope of a wedge by g sin a / (1 + J/(m R^2)), with the friction J a / R^2."""
    radius, slope, inertia = 0.1, 0.4, 0.012
    up = (-radius * math.sin(slope), radius * math.cos(slope))
    wedge = sd.Body("wedge", mass=5.0, inertia=0.1, points={"o": (0.0, 0.0)}, position=(0.0, 0.0), angle=slope)
    disc = sd.Body("disc", mass=2.0, inertia=inertia, points={"c": (0.0, 0.0)}, position=up, angle=0.0)
    mechanism = sd.Mechanism(
        bodies=(wedge, disc),
        guides=(sd.Guide("road", ("disc", "c"), through=(0.0, radius), body="wedge"),),
        welds=(sd.Weld("held", ("wedge", "o"), ("ground", "O")),),
        ground=GROUND,
        couplings=(sd.Coupling("tyre", sd.Slide(("disc", "c"), 0.0, "wedge"), ANGLE("disc", "wedge"), -radius),),
    )
    run = sd.simulate(mechanism, until=0.5, **TIGHT)
    acceleration = -9.81 * math.sin(slope) / (1.0 + inertia / (2.0 * radius**2))
    assert np.allclose(run["coupling_output"].values[:, 0], 0.5 * acceleration * run["time"].values ** 2, atol=1e-10)
    assert np.allclose(run["coupling_force"].values, -inertia / radius**2 * acceleration, rtol=1e-9)
    normal = np.linalg.norm(run["reaction"].sel(joint="road").values, axis=1)
    assert np.allclose(normal, 2.0 * 9.81 * math.cos(slope), rtol=1e-9)


@pytest.mark.parametrize("method", ["dop853", "rodas5p"])
def test_coupled_arms(method):
    """Second formulation: the Lagrangian of the one angle that is left; implicit steps need the slopes of the coupling."""
    run, arms = sd.simulate(coupled_arms(), until=2.0, method=method, **TIGHT), Arms()
    exact = solve_ivp(arms.rate, (0.0, 2.0), [0.4, 0.0], "DOP853", run["time"].values, rtol=1e-12, atol=1e-13).y[0]
    assert np.max(np.abs(run["angle"].values[:, 0] - exact)) < 1e-9
    assert np.max(np.abs(run["energy_residual"].values)) < 1e-8


def test_order_of_implicit_steps():
    """Order of convergence: the error of rodas5p falls in step with the tolerance, which wrong slopes would end."""
    arms, errors = Arms(), []
    for rtol in (1e-5, 1e-7, 1e-9):
        run = sd.simulate(coupled_arms(), until=1.0, method="rodas5p", rtol=rtol, atol=1e-2 * rtol)
        exact = solve_ivp(arms.rate, (0.0, 1.0), [0.4, 0.0], "DOP853", run["time"].values, rtol=1e-12, atol=1e-13).y[0]
        errors.append(float(np.max(np.abs(run["angle"].values[:, 0] - exact))) / rtol)
    assert max(errors) < 3.0 * min(errors)


def test_vibration_and_rest():
    """Closed form: frequency about rest, sqrt(V''/M); the stiffness of the coupling's curvature is in it."""
    arms = Arms()
    rest = brentq(arms.weight, -2.5, -0.7)
    stiffness = (arms.weight(rest + 1e-5) - arms.weight(rest - 1e-5)) / 2e-5
    found = sd.modes(coupled_arms())["frequency"].values
    assert np.allclose(found, math.sqrt(stiffness / arms.mass(rest)) / (2.0 * math.pi), rtol=1e-8)
    run = sd.simulate(coupled_arms(), until=0.2, start="static")
    assert np.allclose(run["angle"].values[:, 0], rest, atol=1e-9)


def lifted(coupling):
    """Return an arm raised by a screw or cylinder from the ground to its end: by a motor's angle, or by the distance itself."""
    arm = sd.bar("arm", length=0.6, mass=3.0, position=(0.0, 0.0), angle=0.5)
    pin = sd.Revolute("A", ("arm", "start"), ("ground", "O"))
    distance, length = sd.Distance(("ground", "P"), ("arm", "end")), math.dist((0.5, 0.0), arm.place("end"))
    if not coupling:
        drive = sd.CoordinateDrive("cylinder", distance, sd.Harmonic(length, 0.06, 5.0))
        return sd.Mechanism((arm,), (pin,), drives=(drive,), ground=GROUND)
    motor = wheel("motor", 1e-4, (0.5, 0.0))
    return sd.Mechanism(
        bodies=(arm, motor),
        joints=(pin, sd.Revolute("M", ("motor", "c"), ("ground", "P"))),
        drives=(sd.Drive("motor", sd.Harmonic(0.0, 30.0, 5.0)),),
        ground=GROUND,
        couplings=(sd.Coupling("screw", distance, ANGLE("motor"), 0.002),),
    )


def test_cylinder_and_screw():
    """Second formulation: the same distance prescribed by a rod."""
    cylinder = lifted(coupling=False)
    drive = cylinder.coordinate_drives[0]
    rod = sd.Rod("rod", ("ground", "P"), ("arm", "end"), motion=drive.motion)
    reference = sd.simulate(dataclasses.replace(cylinder, coordinate_drives=(), rods=(rod,)), until=1.0, **TIGHT)
    driven, screw = (sd.simulate(lifted(kind), until=1.0, **TIGHT) for kind in (False, True))
    tension = reference["rod_force"].values
    for run, name in ((driven, "coordinate_drive_force"), (screw, "coupling_force")):
        assert np.allclose(run["angle"].sel(body="arm"), reference["angle"].sel(body="arm"), atol=1e-11)
        assert np.allclose(run[name].values, -tension, atol=1e-9)
        assert np.allclose(run["reaction"].sel(joint="A"), reference["reaction"].sel(joint="A"), atol=1e-9)
        assert np.max(np.abs(run["energy_residual"].values)) < 1e-8
    acceleration = screw["angular_acceleration"].sel(body="motor").values
    assert np.allclose(screw["drive_torque"].values, -0.002 * tension[:, 0] + 1e-4 * acceleration, atol=1e-9)
    assert np.allclose(driven["coordinate_drive_value"].values, screw["coupling_output"].values, atol=1e-11)


def test_geared_slider_crank():
    """Second formulation: the crank itself driven at the speed that the gear gives it."""
    direct = sd.slider_crank(angle=1.0)
    geared = dataclasses.replace(
        direct,
        bodies=(*direct.bodies, wheel("motor", 1e-5, (0.2, 0.2))),
        ground=(*direct.ground, ("M", (0.2, 0.2))),
        joints=(*direct.joints, sd.Revolute("M", ("motor", "c"), ("ground", "M"))),
        couplings=(sd.Coupling("gear", ANGLE("crank"), ANGLE("motor"), -0.37),),
    ).driven(speed=20.0, body="motor")
    run, reference = sd.simulate(geared, until=1.0), sd.simulate(direct.driven(speed=-7.4), until=1.0)
    assert np.allclose(run["drive_torque"], -0.37 * reference["drive_torque"], atol=1e-12)
    assert np.allclose(run["coupling_force"].values[:, 0], reference["drive_torque"], atol=1e-12)
    assert np.allclose(run["reaction"].sel(joint="crank pin"), reference["reaction"].sel(joint="crank pin"), atol=1e-10)


def test_range_of_a_driven_slide():
    """Closed form: a slider that is pushed locks where crank and rod are in line, at l - r and l + r."""
    crank = sd.slider_crank(angle=1.0)
    first = crank.place(("slider", "centre"))[0]
    push = sd.CoordinateDrive("push", sd.Slide(("slider", "centre")), sd.Polynomial((first, -0.3)))
    found = sd.ideal_kinematics(dataclasses.replace(crank, drives=(push,)), until=0.1)
    assert (found.attrs["range_low"], found.attrs["range_high"], found.attrs["range_unit"]) == (
        pytest.approx(0.07, abs=1e-9),
        pytest.approx(0.17, abs=1e-9),
        "m",
    )


def test_derivatives_of_the_closure():
    """Cross-check: gradients and second derivatives of the closure equations of angles and lengths by differences."""
    random, h = np.random.default_rng(3), 1e-5
    for mechanism in (coupled_arms(), lifted(coupling=True)):
        closure = Closure(plan(mechanism))
        z = closure.placed() + 0.05 * random.normal(size=closure.total)
        one, other = (np.append(random.normal(size=closure.natural.total), 0.0 * closure.placed_turns) for _ in range(2))
        by_differences = (closure.left_sides(z + h * one) - closure.left_sides(z - h * one)) / (2.0 * h)
        assert np.allclose(closure.derivative(z, one), by_differences, atol=1e-8)
        by_other = (closure.derivative(z + h * other, one) - closure.derivative(z - h * other, one)) / (2.0 * h)
        assert np.allclose(closure.second_derivative(z, one, other), by_other, atol=1e-8)


def test_free_floating_joint_drive():
    """Closed form: two free bodies turned against each other keep their angular momentum, over many turns."""
    mechanism = sd.Mechanism(
        bodies=(wheel("hub", 0.03, mass=2.0), wheel("rotor", 0.01)),
        joints=(sd.Revolute("J", ("rotor", "c"), ("hub", "c")),),
        gravity=0.0,
        drives=(sd.CoordinateDrive("d", ANGLE("rotor", "hub"), sd.Cycloidal(0.0, 40.0, 2.0)),),
    )
    run = sd.simulate(mechanism, until=2.5, **TIGHT)
    value = run["coordinate_drive_value"].values[:, 0]
    assert value[-1] == pytest.approx(40.0, abs=1e-10)
    assert np.allclose(run["angle"].sel(body="hub"), -0.25 * value, atol=1e-9)
    late = dataclasses.replace(mechanism.coordinate_drives[0], motion=sd.Cycloidal(30.0, 70.0, 2.0))
    again = sd.simulate(dataclasses.replace(mechanism, coordinate_drives=(late,)), until=2.5, **TIGHT)
    assert np.allclose(again["coordinate_drive_force"], run["coordinate_drive_force"], atol=1e-10)


def test_servo_between_moving_bodies():
    """Closed form: a stiff servo of the elbow gives the torque that the prescribed angle takes; its limit holds."""
    arms = dataclasses.replace(coupled_arms(), couplings=()).driven(sd.Cycloidal(0.4, 1.0, 1.0), body="upper")
    bend = sd.Cycloidal(0.0, 1.0, 1.0)
    drive = sd.CoordinateDrive("elbow", ANGLE("lower", "upper"), bend)
    prescribed = sd.simulate(arms.with_parts({"coordinate_drives": (drive,)}), until=1.0, **TIGHT)
    servo = arms.controlled(sd.PID(2e4, derivative=60.0), reference=bend, body="lower", base="upper")
    run = sd.simulate(servo, until=1.0)
    torque = prescribed["coordinate_drive_force"].values[:, 0]
    assert np.max(np.abs(run["control_torque"].values[:, 0] - torque)[100:]) < 2e-3 * np.max(np.abs(torque))
    limited = arms.controlled(sd.PID(2e4, derivative=60.0, limit=0.5), reference=bend, body="lower", base="upper")
    assert sd.simulate(limited, until=1.0)["peak_control_torque"].values[0] == 0.5


def test_slide_on_a_moving_body():
    """Closed form: a bead driven along a turning tube, m (x'' - w^2 x) along it and 2 m x x' w about the pivot."""
    start = (0.2 * math.cos(0.3), 0.2 * math.sin(0.3))
    slide = sd.CoordinateDrive("push", sd.Slide(("bead", "centre"), 0.0, "tube"), sd.Harmonic(0.2, 0.1, 7.0))
    mechanism = sd.Mechanism(
        bodies=(
            sd.bar("tube", length=0.5, mass=1.0, position=(0.0, 0.0), angle=0.3),
            sd.point_mass("bead", mass=0.4, position=start),
        ),
        joints=(sd.Revolute("A", ("tube", "start"), ("ground", "O")),),
        guides=(sd.Guide("bore", ("bead", "centre"), through=(0.0, 0.0), body="tube"),),
        ground=GROUND,
        gravity=0.0,
        drives=(sd.Drive("tube", sd.ConstantSpeed(4.0)), slide),
    )
    run = sd.simulate(mechanism, until=1.0, **TIGHT)
    t = run["time"].values
    x, speed, acceleration = 0.2 + 0.1 * np.sin(7.0 * t), 0.7 * np.cos(7.0 * t), -4.9 * np.sin(7.0 * t)
    assert np.allclose(run["coordinate_drive_force"].values[:, 0], 0.4 * (acceleration - 16.0 * x), atol=1e-9)
    assert np.allclose(run["coordinate_drive_power"].values[:, 0], 0.4 * (acceleration - 16.0 * x) * speed, atol=1e-9)
    assert np.allclose(run["drive_torque"].values, 0.8 * speed * 4.0 * x, atol=1e-9)
    assert np.max(np.abs(run["energy_residual"].values)) < 1e-8


def test_loose_and_hard_joints():
    """Limit: with a clearance of 1 um the geared crank moves as without, in compliant and in hard contact."""
    mechanism = coupled_arms()
    ideal = sd.simulate(mechanism, until=0.2)
    for contact in ("compliant", "hard"):
        gap = sd.Clearance(1e-6, contact=contact)
        run = sd.simulate(mechanism.with_clearance("B", gap), until=0.2)
        assert run.attrs["status"] == "complete"
        exact = np.interp(run["time"], ideal["time"], ideal["angle"].values[:, 0])
        assert np.max(np.abs(run["angle"].values[:, 0] - exact)) < 1e-4


def test_bars_that_bend():
    """Limit: a stiff bar that bends between a screw and a pin moves as a rigid one, and a geared pair of them too."""
    stiff = {"bending_stiffness": 1e4, "axial_stiffness": 1e6}
    for mechanism, bar in ((lifted(coupling=True), "arm"), (coupled_arms(), "lower")):
        bent = sd.with_bending(mechanism, bar, **stiff)
        run, rigid = sd.simulate(bent, until=0.2, **TIGHT), sd.simulate(mechanism, until=0.2)
        assert np.max(np.abs(run["angle"].sel(body=bar).values - rigid["angle"].sel(body=bar).values)) < 1e-3
        # what rounding of the strains leaves is there without a coupling, too
        without = sd.simulate(dataclasses.replace(bent, couplings=()), until=0.2, **TIGHT)["energy_residual"]
        assert np.max(np.abs(run["energy_residual"].values)) < 2.0 * np.max(np.abs(without.values))


def test_reactions_of_a_coupled_bar_that_bends():
    """Limit: the torque of a belt on a stiff bar that bends presses on its pins as on those of a rigid one."""
    rigid = sd.simulate(coupled_arms(), until=0.3, samples=7)["reaction"]
    bent = sd.with_bending(coupled_arms(), "lower", bending_stiffness=2e3, axial_stiffness=2e6, damping=1e-4, modes=4)
    reaction = sd.simulate(bent, until=0.3, samples=7)["reaction"]
    assert np.max(np.abs(reaction.values[-2:] - rigid.values[-2:])) < 1e-3


def test_batch_checkpoint_and_paths(tmp_path):
    """Contract: cases of a batch are single runs, a resumed run is a whole one, and ratios are parameters."""
    arms = coupled_arms()
    assert arms.replace("belt.ratio", -0.3).couplings[0].ratio == -0.3
    smaller = lifted(coupling=False).replace("coordinate_drive.cylinder.amplitude", 0.01)
    assert smaller.coordinate_drives[0].motion.amplitude == 0.01
    many = sd.simulate_many(arms, {"belt.ratio": np.array([-0.6, -0.3])}, until=0.5, measures=("peak_coupling_force",))
    each = [
        sd.simulate(arms.replace("belt.ratio", ratio), until=0.5)["peak_coupling_force"].values[0] for ratio in (-0.6, -0.3)
    ]
    assert many["peak_coupling_force"].values.ravel().tolist() == each
    whole = sd.simulate(gear_pair(), until=3.0)
    sd.simulate(gear_pair(), until=1.5, checkpoint=sd.Checkpoint(tmp_path / "c"))
    again = sd.simulate(gear_pair(), until=3.0, checkpoint=sd.Checkpoint(tmp_path / "c"))
    assert np.allclose(again["angle"].values, whole["angle"].values, atol=1e-6)


@pytest.mark.parametrize("coupling", [True, False])
def test_saved_run(coupling, tmp_path):
    """Contract: a run with couplings or driven coordinates is loaded as it was saved, with the units of the coordinates."""
    run = sd.simulate(lifted(coupling=coupling), until=0.1)
    units = [name for name in run.variables if str(name).endswith("_unit")]
    assert units
    xr.testing.assert_identical(sd.load(sd.save(run, tmp_path / "run.nc")), run)


def test_redundant_only_where_joints_are_ideal():
    """Contract: what follows from ideal joints is an error; with clearance it is a coupling, whose ideal mechanism drops it."""
    lengths = {"ground": 0.5, "crank": 0.1, "coupler": 0.5, "rocker": 0.1}
    belt = sd.Coupling("belt", ANGLE("rocker"), ANGLE("crank"), 1.0)
    four = dataclasses.replace(sd.four_bar(**lengths, angle=1.0), couplings=(belt,))
    with pytest.raises(
        sd.InputError,
        match="coupling 'belt' is redundant: it follows from other couplings and parts; expected a mechanism without it",
    ):
        sd.simulate(four, until=0.1)
    run = sd.simulate(four.with_clearance("rocker pin", sd.Clearance(1e-4)), until=0.05)
    assert run.attrs["status"] == "complete"
    assert np.allclose(run["angle"].sel(body="rocker"), run["angle"].sel(body="crank"), atol=1e-9)


@pytest.mark.parametrize("driven", [False, True])
@pytest.mark.parametrize(
    "changed",
    [
        lambda loose: loose.ideal(),
        lambda loose: loose.ideal("rocker pin"),
        lambda loose: loose.ideal().replace("gravity", 0.0),
        lambda loose: loose.track("end", "rocker", "end"),
    ],
    ids=["ideal", "named", "replaced", "tracked"],
)
def test_coupling_that_closed_clearances_make_redundant(driven, changed):
    """Contract: however a clearance is closed, and whatever is changed then, a coupling that follows from joints is dropped."""
    arms = sd.four_bar(ground=0.5, crank=0.1, coupler=0.5, rocker=0.1, angle=1.0)
    arms = arms.driven(speed=1.0) if driven else arms
    loose = dataclasses.replace(arms, couplings=(sd.Coupling("belt", ANGLE("rocker"), ANGLE("crank"), 1.0),))
    run = sd.simulate(changed(loose.with_clearance("rocker pin", sd.Clearance(1e-4))), until=0.05)
    assert run.attrs["status"] == "complete"
    assert np.allclose(run["angle"].sel(body="rocker"), run["angle"].sel(body="crank"), atol=1e-9)


@pytest.mark.parametrize("driven", [False, True])
def test_saved_ideal_run_with_a_redundant_coupling(driven, tmp_path):
    """Contract: a saved run of a mechanism whose clearances were closed keeps that, so that its mechanism can run again."""
    arms = sd.four_bar(ground=0.5, crank=0.1, coupler=0.5, rocker=0.1, angle=1.0)
    arms = arms.driven(speed=1.0) if driven else arms
    loose = dataclasses.replace(arms, couplings=(sd.Coupling("belt", ANGLE("rocker"), ANGLE("crank"), 1.0),))
    run = sd.simulate(loose.with_clearance("rocker pin", sd.Clearance(1e-4)).ideal(), until=0.05)
    path = sd.save(run, tmp_path / "ideal.nc")
    built = read_configuration(sd.load(path)).build_mechanism()
    assert sd.simulate(built, until=0.05)["angle"].equals(run["angle"])
    opened = open_case(path)
    assert sd.simulate(opened.mechanism, until=0.05)["angle"].equals(run["angle"])
    (tmp_path / "case.toml").write_text(opened.text())
    assert sd.read_case(tmp_path / "case.toml").mechanism == built


@pytest.mark.parametrize(("loose", "line"), [(False, "coordinates cannot move"), (True, "contradicts the drives and joints")])
def test_coupling_of_prescribed_coordinates(loose, line):
    """Contract: a coupling of coordinates that a drive prescribes is an error, after a clearance is closed if it is not met."""
    arms = sd.four_bar(ground=0.5, crank=0.1, coupler=0.5, rocker=0.1, angle=1.0).driven(speed=1.0)
    arms = dataclasses.replace(arms, couplings=(sd.Coupling("belt", ANGLE("rocker"), ANGLE("crank"), 2.0),))
    with pytest.raises(sd.InputError, match=f"coupling 'belt'.* {line}"):
        sd.simulate(arms.with_clearance("rocker pin", sd.Clearance(1e-4)).ideal() if loose else arms, until=0.05)


BELT = coupled_arms().couplings[0]  # Coupling of two arms
ELBOW = sd.CoordinateDrive("elbow", ANGLE("lower", "upper"), sd.ConstantSpeed(1.0))  # Drive of the relative angle of two arms


PAIR = ANGLE("a"), ANGLE("b")  # Two coordinates
AGAIN = dataclasses.replace(BELT, name="again")  # Second coupling of the arms
LOST = sd.Coupling("x", ANGLE("lover"), ANGLE("upper"), 2.0)  # Coupling of a body that is not there
UPPER = dataclasses.replace(ELBOW, coordinate=ANGLE("upper"))  # Drive of the angle of the upper arm
WELD = sd.Weld("w", ("upper", "end"), ("lower", "start"))  # Weld of both arms
NO_MOTION = "other couplings, drives and joints: no motion remains"  # End of an error
WITHOUT = "expected a mechanism without it"  # End of an error


def arms_with(**parts):
    """Return a run of the arms with other parts."""
    return lambda: sd.simulate(dataclasses.replace(coupled_arms(), **parts), until=0.1)


@pytest.mark.parametrize(
    ("wrong", "line"),
    [
        (lambda: sd.Coupling("x", ANGLE("a"), ANGLE("b"), 0.0), "coupling 'x': ratio = 0; expected a ratio that is not zero"),
        (lambda: sd.Coupling("x", ANGLE("a"), ANGLE("a"), 2.0), "coupling 'x' relates a coordinate to itself"),
        (lambda: sd.FurtherInput(ANGLE("a"), 0.0), "a further input with ratio = 0; expected a ratio that is not zero"),
        (lambda: sd.Coupling("x", *PAIR, 2.0, further=(sd.FurtherInput(PAIR[0], 1.0),)), "'x' relates a coordinate to itself"),
        (lambda: sd.RelativeAngle("a", "a"), "the angle of 'a' relative to itself"),
        (lambda: sd.Slide(("a", "end"), base="a"), "the slide of a point of 'a' relative to its own body"),
        (lambda: sd.Distance(("a", "end"), ("a", "start")), "the distance between two points of body 'a'"),
        (
            lambda: sd.CoordinateDrive("d", sd.Slide(("a", "end")), sd.ConstantSpeed(1.0)),
            "drive 'd': a ConstantSpeed is an angular velocity and cannot prescribe a length; expected another time function",
        ),
        (arms_with(couplings=(LOST,)), r"coupling 'x' refers to body 'lover' \(did you mean 'lower'\?\)"),
        (
            arms_with(couplings=(BELT, AGAIN)),
            f"coupling 'again' is redundant: it follows from other couplings and parts; {WITHOUT}",
        ),
        (
            arms_with(couplings=(BELT, dataclasses.replace(AGAIN, ratio=0.5, offset=0.0))),
            "coupling 'belt' and coupling 'again' leave no motion; expected one coupling fewer",
        ),
        (arms_with(drives=(ELBOW, sd.Drive("upper", sd.ConstantSpeed(1.0)))), f"drive 'elbow' contradicts {NO_MOTION}"),
        (
            arms_with(couplings=(), joints=coupled_arms().joints[:1], welds=(WELD,), drives=(ELBOW,)),
            f"drive 'elbow' contradicts {NO_MOTION}",
        ),
        (
            arms_with(couplings=(), drives=(sd.Drive("upper", ELBOW.motion), UPPER)),
            "drive 'elbow': the coordinate cannot move, or drives prescribe it already",
        ),
    ],
)
def test_bad_input(wrong, line):
    """Contract: one line that says what came."""
    with pytest.raises(sd.InputError, match=line):
        wrong()


def test_fields_of_the_explorer():
    """Contract: ratios and the motions of driven coordinates can be changed in the explorer."""
    fields = {field.place: field for field in fields_of(tomllib.loads(sd.zoo["counter-rotating-wheels"].text), Code(None))}
    for path, number in ((("coupling", 0, "ratio"), -1.0), (("coordinate_drive", 0, "motion", "speed"), 10.0 * math.pi)):
        assert fields[path].value == pytest.approx((number,))
