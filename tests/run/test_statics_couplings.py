"""Forces without inertia in gears, racks, screws and driven coordinates, against closed forms and slow runs."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

import scissordyn as sd

ANGLE = sd.RelativeAngle
GROUND = (("O", (0.0, 0.0)), ("P", (0.5, 0.0)))
G = 9.81


def wheel(name: str, position: tuple[float, float] = (0.0, 0.0), mass: float = 1.0) -> sd.Body:
    """A wheel about its centre."""
    return sd.Body(name, mass=mass, inertia=0.01, points={"c": (0.0, 0.0)}, position=position, angle=0.3)


def pinned(name: str, wheel: str, place: str = "O") -> sd.Revolute:
    """A wheel's pin on the ground."""
    return sd.Revolute(name, (wheel, "c"), ("ground", place))


@pytest.mark.parametrize("ratio", [-1.7, 40.0])
def test_gear_pair(ratio: float) -> None:
    """Closed form: torque of the drive is minus the ratio times the load, over several turns; the mesh carries the load."""
    load = 3.0
    gears = sd.Mechanism(
        bodies=(wheel("first"), wheel("second", (0.5, 0.0))),
        joints=(pinned("A", "first"), pinned("B", "second", "P")),
        ground=GROUND,
        drives=(sd.Drive("first", sd.Cycloidal(0.3, 20.0, 1.0)),),
        components=(sd.Torque("load", "second", torque=load),),
        couplings=(sd.Coupling("mesh", ANGLE("second"), ANGLE("first"), ratio),),
    )
    forces = sd.statics(gears, until=1.0, points=7)
    np.testing.assert_allclose(forces["drive_torque"], -ratio * load, rtol=1e-13)
    np.testing.assert_allclose(forces["coupling_force"], -load, rtol=1e-13)
    np.testing.assert_allclose(forces["coupling_input_force"], ratio * load, rtol=1e-13)
    np.testing.assert_allclose(forces["angle"].sel(body="second"), 0.3 + ratio * (forces["input"].values[:, 0] - 0.3))
    row = forces.sel(quantity="coupling input torque mesh")
    assert (str(row["quantity_unit"].values), float(row["largest"])) == ("N m", pytest.approx(ratio * load))


def test_planetary_gear() -> None:
    """Closed form: Willis' ratio from arm to sun, and the torques of both meshes on the planet."""
    sun, planet, ring, radius, load = 20, 17, 54, 0.037, -0.1
    arm = sd.Body("arm", mass=0.2, inertia=2e-4, points={"c": (0.0, 0.0), "p": (radius, 0.0)}, angle=0.0)
    gear = sd.Mechanism(
        bodies=(wheel("sun"), arm, wheel("planet", (radius, 0.0))),
        joints=(pinned("S", "sun"), pinned("A", "arm"), sd.Revolute("P", ("planet", "c"), ("arm", "p"))),
        ground=GROUND,
        gravity=0.0,
        drives=(sd.Drive("sun", sd.ConstantSpeed(1.0)),),
        components=(sd.Torque("load", "arm", torque=load),),
        couplings=(
            sd.Coupling("sun and planet", ANGLE("planet", "arm"), ANGLE("sun", "arm"), -sun / planet),
            sd.Coupling("planet and ring", ANGLE("planet", "arm"), ANGLE("ground", "arm"), ring / planet),
        ),
    )
    forces = sd.statics(gear, until=9.0, points=10)
    torque = -load / (1.0 + ring / sun)
    np.testing.assert_allclose(forces["drive_torque"], torque, rtol=1e-13)
    np.testing.assert_allclose(forces["coupling_force"], np.tile([-planet / sun * torque, planet / sun * torque], (10, 1)))
    np.testing.assert_allclose(forces["angle"].sel(body="arm"), forces["time"] / (1.0 + ring / sun), atol=1e-12)
    # pins carry round-off only, and have no panel
    labels = [axes.get_ylabel() for axes in sd.plot.statics(forces)]
    assert [label.split()[0] for label in labels] == ["drive", "component", "coupling"]


def test_rack_on_an_incline() -> None:
    """Closed form: the teeth carry m g sin(slope), the pinion m g r sin(slope), the bed m g cos(slope)."""
    slope, radius, weight = math.radians(35.0), 0.04, 2.0 * G
    rack = sd.Mechanism(
        bodies=(wheel("pinion"), sd.point_mass("rack", mass=2.0, position=(0.1, -0.05))),
        joints=(pinned("A", "pinion"),),
        guides=(sd.Guide("bed", ("rack", "centre"), through=(0.1, -0.05), direction=slope),),
        ground=GROUND,
        gravity=G,
        drives=(sd.Drive("pinion", sd.Polynomial((0.3, 8.0))),),
        couplings=(sd.Coupling("teeth", sd.Slide(("rack", "centre"), slope), ANGLE("pinion"), radius),),
    )
    forces = sd.statics(rack, until=1.0, points=5)
    np.testing.assert_allclose(forces["coupling_force"], weight * math.sin(slope), rtol=1e-13)
    np.testing.assert_allclose(forces["drive_torque"], weight * radius * math.sin(slope), rtol=1e-13)
    bed = np.linalg.norm(forces["reaction"].sel(joint="bed"), axis=-1)
    np.testing.assert_allclose(bed, weight * math.cos(slope), rtol=1e-13)
    assert forces["quantity_unit"].sel(quantity="coupling force teeth") == "N"
    assert forces["quantity_unit"].sel(quantity="coupling input torque teeth") == "N m"


def lifted(screw: bool) -> sd.Mechanism:
    """An arm raised from the ground to its end by a screw of 2 mm/rad, or by a cylinder of the same length."""
    arm = sd.bar("arm", length=0.6, mass=3.0, position=(0.0, 0.0), angle=0.5)
    distance, length = sd.Distance(("ground", "P"), ("arm", "end")), math.dist((0.5, 0.0), arm.place("end"))
    lift = sd.Mechanism((arm,), (sd.Revolute("A", ("arm", "start"), ("ground", "O")),), ground=GROUND, gravity=G)
    if not screw:
        cylinder = sd.CoordinateDrive("cylinder", distance, sd.Polynomial((length, 0.1)))
        return dataclasses.replace(lift, drives=(cylinder,))  # type: ignore[arg-type]
    return dataclasses.replace(
        lift,
        bodies=(arm, wheel("motor", (0.5, 0.0))),
        joints=(*lift.joints, pinned("M", "motor", "P")),
        drives=(sd.Drive("motor", sd.Polynomial((0.3, 50.0))),),
        couplings=(sd.Coupling("screw", distance, ANGLE("motor"), 0.002),),
    )


def test_screw_and_cylinder() -> None:
    """Closed form: moment of the weight over the arm of the cylinder's force, by the lead the torque of the screw."""
    screw, cylinder = (sd.statics(lifted(kind), until=1.0, points=11) for kind in (True, False))
    angle = cylinder["angle"].sel(body="arm").values
    length = np.hypot(0.6 * np.cos(angle) - 0.5, 0.6 * np.sin(angle))
    push = 3.0 * G * 0.3 * np.cos(angle) * length / (0.5 * 0.6 * np.sin(angle))
    np.testing.assert_allclose(cylinder["coordinate_drive_force"].values[:, 0], push, rtol=1e-12)
    np.testing.assert_allclose(screw["coupling_force"].values[:, 0], push, rtol=1e-12)
    np.testing.assert_allclose(screw["drive_torque"], 0.002 * push, rtol=1e-12)
    np.testing.assert_allclose(screw["angle"].sel(body="arm"), angle, rtol=1e-13)


def test_slow_motion_tends_to_statics() -> None:
    """Order of convergence: the forces of a geared run differ from those at rest with the square of its speed."""
    upper = sd.bar("upper", length=0.3, mass=1.0, position=(0.0, 0.0), angle=0.4)
    lower = sd.bar("lower", length=0.2, mass=0.7, position=upper.place("end"), angle=0.4)
    arms = sd.Mechanism(
        bodies=(upper, lower),
        joints=(sd.Revolute("A", ("upper", "start"), ("ground", "O")), sd.Revolute("B", ("lower", "start"), ("upper", "end"))),
        ground=GROUND,
        gravity=G,
        couplings=(sd.Coupling("belt", ANGLE("lower", "upper"), ANGLE("upper"), -0.6),),
    )
    still, differences = sd.statics(arms.driven(speed=1.0, body="upper"), until=8.0, points=25), []
    for speed in (0.2, 0.1):
        run = sd.simulate(arms.driven(speed=speed, body="upper"), until=8.0 / speed, samples=25)
        names = ("reaction", "coupling_force", "coupling_input_force", "drive_torque")
        differences.append([np.abs(run[name].values - still[name].values).max() for name in names])
    orders = np.log2(np.divide(*differences))
    np.testing.assert_allclose(orders, 2.0, atol=0.02)


def test_modes_along_the_motion() -> None:
    """Closed form: a wheel on a spring behind a gear that is driven over several turns oscillates as at the start."""
    gears = sd.Mechanism(
        bodies=(wheel("first"), wheel("second", (0.5, 0.0)), wheel("third", (0.5, 0.0))),
        joints=(pinned("A", "first"), pinned("B", "second", "P"), pinned("C", "third", "P")),
        ground=GROUND,
        drives=(sd.Drive("first", sd.ConstantSpeed(1.0)),),
        components=(sd.TorsionSpring("shaft", "third", base="second", stiffness=4.0),),
        couplings=(sd.Coupling("mesh", ANGLE("second"), ANGLE("first"), -3.0),),
    )
    modes = sd.modes(gears, times=[2.0, 5.0])
    np.testing.assert_allclose(modes["angular_frequency"].values[:, 0], math.sqrt(4.0 / 0.01), rtol=1e-12)
    np.testing.assert_allclose(modes["angle"].sel(body="third"), [0.3 - 6.0, 0.3 - 15.0], atol=1e-9)
