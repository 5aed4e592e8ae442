"""Springs, gears, belts, delayed feedback and tables beside a clearance joint, against (x, y, angle) and multipliers."""

import dataclasses
import math

import numpy as np
import pytest
from scipy.interpolate import BSpline
from tests.build import ORIGIN, wheel

import scissordyn as sd
from reference.marching import NO_LOAD, March
from reference.multipliers import Multipliers

ANGLE, TIGHT = sd.RelativeAngle, {"rtol": 1e-12, "atol": 1e-12}  # Short name, tolerances of the runs


def loose(clearance, radius=0.01):
    """Return a clearance joint whose damping refers to the approach speed, as that of the reference model."""
    laws = {"stiffness": sd.Hertz(), "damping": sd.LankaraniNikravesh(0.8), "friction": sd.NoFriction()}
    return sd.Clearance(clearance, journal_radius=radius, reference="onset", **laws)


def assert_same(run, march, joint, *, contacts):
    """Check contacts, angles, the journal's path, forces and energies; return the forces of constraints and of the pin."""
    model = march.model
    assert run.attrs["status"] == "complete"
    assert run.sizes["contact"] == len(march.contacts) == contacts
    for name, field in (("contact_start", "start"), ("approach_speed", "approach_speed"), ("contact_angle", "angle")):
        assert run[name].values == pytest.approx([getattr(one, field) for one in march.contacts], rel=1e-8)
    ended = [one for one in march.contacts if not math.isnan(one.duration)]
    for name, field in (
        ("peak_normal_force", "peak_force"),
        ("contact_duration", "duration"),
        ("rebound_speed", "rebound_speed"),
    ):
        assert run[name].values[: len(ended)] == pytest.approx([getattr(one, field) for one in ended], rel=1e-7)
    at = march.at(run["time"].values)
    turned = np.array([model.spread(q)[:-1, 2] for q in at.coordinates])
    assert run["angle"].values == pytest.approx(model.angle[:-1] + turned, abs=1e-10)
    clearance = model.joints[0].clearance
    assert run["eccentricity"].sel(joint=[joint]).values == pytest.approx(at.eccentricity, abs=1e-7 * clearance)
    normal = np.max(at.normal)
    assert run["normal_force"].sel(joint=joint).values == pytest.approx(at.normal[:, 0], abs=1e-6 * normal)
    energy = (run["kinetic_energy"] + run["potential_energy"]).values
    assert energy - energy[0] == pytest.approx(at.energy - at.energy[0], abs=1e-8 * np.max(np.abs(energy)))
    assert run["damping_loss"].values == pytest.approx(at.damping_loss, abs=1e-7 * np.max(at.damping_loss))
    rows = []
    for t in run["time"].values.tolist():
        piece = next(piece for piece in march.pieces if t <= piece.end)
        y = piece.solution(t)
        loads = [NO_LOAD if one is None else one.load for one in march.touches(t, y, piece.open)]
        rows.append([*model.solve(t, *march.parts(y)[:2], loads)[1], *loads[0][:2]])
    return np.array(rows)


def assert_reactions(run, forces, named):
    """Check forces of ideal joints, by their names."""
    for name, expected in named.items():
        assert run["reaction"].sel(joint=name).values == pytest.approx(expected, abs=1e-6 * np.max(np.abs(forces))), name


def circles(a, r, b, s):
    """Return the point at the distances r from a and s from b, to the right of the line from a to b."""
    line = b - a
    d = math.hypot(*line)
    along = (r * r - s * s + d * d) / (2.0 * d)
    return a + (along * line + math.sqrt(r * r - along * along) * np.array([line[1], -line[0]])) / d


def kinked_array():
    """Return two units of four different kinked bars, loose where the first pair is pinned above, with a sprung hinge."""
    sizes = {
        "a": (0.30, 0.24, 0.25, 1.1),
        "b": (0.26, 0.27, -0.20, 0.9),
        "c": (0.22, 0.25, 0.18, 0.8),
        "d": (0.25, 0.20, -0.15, 0.7),
    }
    made = lambda name, place, angle: sd.angulated_bar(  # noqa: E731
        name, **dict(zip(("first", "second", "kink", "mass"), sizes[name], strict=True)), position=tuple(place), angle=angle
    )
    first = made("a", (0.0, 0.0), 0.75)
    x, y = first.place("pivot")
    lower = -math.acos(x / 0.26)
    second = made("b", (0.0, y - 0.26 * math.sin(lower)), lower)
    ends = np.array(second.place("end")), np.array(first.place("end"))
    pivot = circles(ends[0], 0.22, ends[1], 0.25)
    further = [made(n, e, math.atan2(*(pivot - e)[::-1])) for n, e in zip("cd", ends, strict=True)]
    pins = (("O", "a", "start", "ground", "O"), ("P", "a", "pivot", "b", "pivot"), ("U", "a", "end", "d", "start"))
    more = (("L", "b", "end", "c", "start"), ("Q", "c", "pivot", "d", "pivot"))
    return sd.Mechanism(
        bodies=(first, second, *further),
        joints=tuple(
            sd.Revolute(name, (i, p), (j, q), loose(4e-4, 0.008) if name == "U" else None)
            for name, i, p, j, q in (*pins, *more)
        ),
        guides=(sd.Guide("wall", ("b", "start"), direction=0.5 * math.pi),),
        ground=ORIGIN,
        components=(sd.TorsionSpring("hinge", "a", "b", stiffness=9.0, free_angle=2.1, damping=0.02),),
    )


class Sprung(Multipliers):
    """The array with its hinge spring between the first two bars."""

    def further_loads(self, t, moved, rates):
        """Return the torques of the spring and its damper."""
        loads = np.zeros(moved.shape)
        loads[0, 2] = -9.0 * (self.angle[0] - self.angle[1] + moved[0, 2] - moved[1, 2] - 2.1) - 0.02 * (
            rates[0, 2] - rates[1, 2]
        )
        loads[1, 2] = -loads[0, 2]
        return loads


def test_array_of_unequal_kinked_bars():
    """Second formulation: gravity and a preloaded hinge unfold it over two contacts; ideal pins and the guide carry as much."""
    mechanism = kinked_array()
    march = March(Sprung(mechanism), max_step=4e-4).run(0.0088)
    run = sd.simulate(mechanism, until=0.0088, samples=12, **TIGHT)
    forces = assert_same(run, march, "U", contacts=2)
    pins = {name: forces[:, 2 * k : 2 * k + 2] for k, name in enumerate(("O", "P", "L", "Q"))}
    assert_reactions(run, forces, {**pins, "U": forces[:, -2:], "wall": np.stack([-forces[:, 8], 0.0 * forces[:, 8]], axis=1)})
    twist = run["angle"].sel(body="a").values - run["angle"].sel(body="b").values - 2.1
    assert run["stored_energy"].values == pytest.approx(4.5 * twist**2, rel=1e-10)


APART, PRESSURE = 0.15, math.tan(math.radians(20.0))  # Distance of the centres of two gears [m], slope of their flank


class Geared(Multipliers):
    """Wheels whose flanks touch: the second turns about its centre with the first, as the line of centres turns and extends."""

    def __init__(self, mechanism, ratio, sense):
        super().__init__(mechanism)
        self.ratio, self.slope = ratio, sense * math.copysign(PRESSURE, -ratio) * abs(1.0 - ratio) / APART
        self.hubs = self.point_list([("pinion", "c"), ("wheel", "c")])

    def further_loads(self, t, moved, rates):
        """Return the torques on both wheels."""
        loads = np.zeros(moved.shape)
        loads[:2, 2] = 2.0, -1.0
        return loads

    def further_conditions(self, moved, rates):
        """Return the condition of the flanks."""
        arm, spin, gradient = self.arms(moved, self.hubs), rates[:2, 2], np.zeros((1, moved.size))
        line = self.centre[1] - self.centre[0] + moved[1, :2] - moved[0, :2] + arm[1] - arm[0]
        speeds = rates[:2, :2] + spin[:, None] * np.stack([-arm[:, 1], arm[:, 0]], axis=1)
        d, speed, inward = math.hypot(*line), speeds[1] - speeds[0], spin[0] ** 2 * arm[0] - spin[1] ** 2 * arm[1]
        along, across = line / d, np.array([-line[1], line[0]]) / d
        pull = self.slope * along - (1.0 - self.ratio) / d * across
        for k, sign in ((0, -1.0), (1, 1.0)):
            gradient[0, 3 * k : 3 * k + 2] = sign * pull
            gradient[0, 3 * k + 2] = sign * (pull[1] * arm[k, 0] - pull[0] * arm[k, 1]) + (1.0 if k else -self.ratio)
        bent = pull @ inward + self.slope * (across @ speed) ** 2 / d
        bent += (1.0 - self.ratio) * 2.0 * (along @ speed) * (across @ speed) / d**2
        residual = moved[1, 2] - self.ratio * moved[0, 2] - (1.0 - self.ratio) * math.atan2(line[1], line[0])
        return np.array([residual + self.slope * (d - APART)]), gradient, np.array([-bent])


@pytest.mark.parametrize(("ratio", "flank", "until", "contacts"), [(-0.6, "backward", 0.0355, 2), (0.6, "forward", 0.0158, 2)])
def test_gears_in_a_loose_bearing(ratio, flank, until, contacts):
    """Second formulation: an unbalanced wheel in a loose bearing turns with its pinion; teeth push at the pitch point."""
    wheels = (
        wheel("pinion", 0.004, mass=0.8, centre=(0.0, 0.002)),
        wheel("wheel", 0.011, (APART, 0.0), mass=1.7, centre=(0.004, 0.006)),
    )
    teeth = sd.Coupling("mesh", ANGLE("wheel"), ANGLE("pinion"), ratio, transmission=sd.Teeth(math.atan(PRESSURE), flank=flank))
    mechanism = sd.Mechanism(
        bodies=wheels,
        joints=(
            sd.Revolute("A", ("pinion", "c"), ("ground", "O")),
            sd.Revolute("B", ("wheel", "c"), ("ground", "P"), loose(2e-4)),
        ),
        ground=(*ORIGIN, ("P", (APART, 0.0))),
        components=(sd.Torque("first", "pinion", torque=2.0), sd.Torque("second", "wheel", torque=-1.0)),
        couplings=(teeth,),
    )
    model = Geared(mechanism, ratio, 1.0 if flank == "forward" else -1.0)
    march = March(model, max_step=2e-4).run(until)
    run = sd.simulate(mechanism, until=until, samples=21, **TIGHT)
    forces = assert_same(run, march, "B", contacts=contacts)
    assert_reactions(run, forces, {"A": forces[:, 1:3], "B": forces[:, -2:]})
    torque = forces[:, 0]
    assert run["coupling_force"].values[:, 0] == pytest.approx(torque, abs=1e-6 * np.max(np.abs(torque)))
    # Newton's and Euler's laws of the wheel
    mass, spin = 1.7, run["angular_acceleration"].sel(body="wheel").values
    force = mass * (run["acceleration"].sel(body="wheel").values + np.array([0.0, 9.81])) - forces[:, -2:]
    pushed, point = (run[f"coupling_transmitted_{name}"].values[:, 0] for name in ("force", "point"))
    assert pushed == pytest.approx(force, abs=1e-6 * np.max(np.abs(force)))
    cross = lambda a, b: a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]  # noqa: E731
    hub = np.array([APART, 0.0]) + run["eccentricity"].sel(joint="B").values
    assert point == pytest.approx(hub * -ratio / (1.0 - ratio), abs=1e-12)
    moment = cross(point - run["position"].sel(body="wheel").values, pushed)
    moment += cross(hub - run["position"].sel(body="wheel").values, forces[:, -2:])
    assert moment - 1.0 == pytest.approx(0.011 * spin, abs=1e-6 * np.max(np.abs(moment)))


class Belted(Multipliers):
    """Two pulleys on a belt, the first with a torque of 0.3 N m."""

    def further_loads(self, t, moved, rates):
        """Return the torque."""
        loads = np.zeros(moved.shape)
        loads[0, 2] = 0.3
        return loads

    def further_conditions(self, moved, rates):
        """Return the condition of the belt."""
        gradient = np.zeros((1, moved.size))
        gradient[0, [2, 5]] = -0.6, 1.0
        return gradient @ moved.ravel(), gradient, np.zeros(1)


def belted(pretension):
    """Return two pulleys on a belt and a bar that hangs loosely on the second one."""
    rim = 0.2 + 0.04 * math.cos(0.7), 0.04 * math.sin(0.7)
    second = sd.Body("second", 1.2, 0.002, {"c": (0.0, 0.0), "r": (0.04, 0.0)}, position=(0.2, 0.0), angle=0.7)
    pins = ("A", ("first", "c"), ("ground", "O")), ("B", ("second", "c"), ("ground", "P"))
    return sd.Mechanism(
        bodies=(wheel("first", 9e-4, mass=0.8), second, sd.bar("bar", length=0.12, mass=0.4, position=rim, angle=-1.2)),
        joints=(*(sd.Revolute(*pin) for pin in pins), sd.Revolute("R", ("bar", "start"), ("second", "r"), loose(2e-4, 0.005))),
        ground=(*ORIGIN, ("P", (0.2, 0.0))),
        components=(sd.Torque("torque", "first", torque=0.3),),
        couplings=(sd.Coupling("belt", ANGLE("second"), ANGLE("first"), 0.6, transmission=sd.Belt(0.05, pretension)),),
    )


def test_belt_beside_a_loose_pin():
    """Second formulation: both spans pull at the bearings, along their tangents, with and without pretension."""
    march = March(Belted(belted(0.0)), max_step=2e-4).run(0.0103)
    sine = 0.05 * (1.0 - 0.6) / 0.2
    for pretension in (0.0, 15.0):
        run = sd.simulate(belted(pretension), until=0.0103, samples=21, **TIGHT)
        forces = assert_same(run, march, "R", contacts=2)
        difference = forces[:, 0] / 0.05
        both = np.maximum(2.0 * pretension, np.abs(difference))
        pull = np.stack([-both * math.sqrt(1.0 - sine * sine), -difference * sine], axis=1)
        assert_reactions(run, forces, {"A": forces[:, 1:3] + pull, "B": forces[:, 3:5] - pull, "R": forces[:, -2:]})
        for name, sign in (("tight", 0.5), ("slack", -0.5)):
            expected = 0.5 * both + sign * np.abs(difference)
            assert run[f"coupling_{name}_tension"].values[:, 0] == pytest.approx(expected, abs=1e-6 * np.max(both))


GAIN, DELAY, RAMP, SPEED = (
    0.05,
    3.7e-3,
    1.3e-3,
    25.0,
)  # Delayed feedback [N m s/rad], [s], [s], crank's speed at the start [rad/s]


class Delayed(Multipliers):
    """A slider-crank whose crank has the torque K (w(t - T) - w(t)), which rises from zero after one delay."""

    def start(self):
        """Return the start at the given speed of the crank."""
        q, v = self.close(0.0, np.zeros(self.size), np.ones(self.size), self.all_pins)
        return q, v * SPEED / v[2]

    def speed(self, t):
        """Return the speed of the crank at a time that the march has passed."""
        return next(piece for piece in self.march.pieces if t <= piece.end).solution(t)[self.size + 2]

    def further_loads(self, t, moved, rates):
        """Return the torque."""
        loads = np.zeros(moved.shape)
        if t > DELAY:
            loads[0, 2] = GAIN * min((t - DELAY) / RAMP, 1.0) * (self.speed(t - DELAY) - rates[0, 2])
        return loads


def test_delayed_feedback_beside_a_loose_pin():
    """Second formulation: a crank on its loose pin with feedback of its speed one delay ago, integrated delay by delay."""
    plain = sd.slider_crank(gravity=9.81, angle=0.4).with_clearance("crank pin", loose(3e-4, 0.006))
    crank = dataclasses.replace(plain.bodies[0], angular_velocity=SPEED)
    servo = sd.Actuator("servo", "crank", sd.Pyragas(GAIN, DELAY, ramp=RAMP))
    mechanism = dataclasses.replace(plain, bodies=(crank, *plain.bodies[1:]), components=(*plain.components, servo))
    model = Delayed(mechanism)
    model.march = March(
        model, rtol=1e-11, atol=1e-11, max_step=1e-4, stops=(DELAY, DELAY + RAMP, *(k * DELAY for k in range(2, 5)))
    )
    run = sd.simulate(mechanism, until=0.0118, samples=24, **TIGHT)
    assert_same(run, model.march.run(0.0118), "crank pin", contacts=2)
    time, torque = run["time"].values, run["control_torque"].values[:, 0]
    expected = [
        GAIN * min(max((t - DELAY) / RAMP, 0.0), 1.0) * (model.speed(max(t - DELAY, 0.0)) - model.speed(t)) for t in time
    ]
    assert torque == pytest.approx(expected, abs=1e-7 * np.max(np.abs(expected)))


class Tabled(Multipliers):
    """A slider-crank whose crank follows a spline of fifth degree through a table."""

    def __init__(self, mechanism, times, angles):
        super().__init__(mechanism)
        knots = np.concatenate([np.full(6, times[0]), times[3:-3], np.full(6, times[-1])])
        line = BSpline(knots, np.linalg.solve(BSpline.design_matrix(times, knots, 5).toarray(), angles), 5)
        self.orders = line, line.derivative(), line.derivative(2)

    def motion(self, k, t):
        """Return angle, angular velocity and angular acceleration."""
        return tuple(float(order(t)) for order in self.orders)


def test_drive_by_a_table_beside_a_loose_pin():
    """Second formulation: torque, work and power of a drive along an uneven table, by collocation on the spline's knots."""
    times = np.array([0.0, 0.0006, 0.0011, 0.0016, 0.0022, 0.003, 0.0037, 0.0045, 0.006, 0.008])
    angles = 0.4 + np.array([0.0, 0.005, 0.01, 0.016, 0.025, 0.036, 0.044, 0.05, 0.07, 0.1])
    drive = sd.Tabulated(tuple(times.tolist()), tuple(angles.tolist()))
    mechanism = sd.slider_crank(gravity=9.81, angle=0.4).driven(drive).with_clearance("slider pin", loose(3e-4, 0.006))
    march = March(Tabled(mechanism, times, angles), max_step=2e-4, stops=tuple(times[3:-3].tolist())).run(0.0042)
    run = sd.simulate(mechanism, until=0.0042, samples=15, **TIGHT)
    forces = assert_same(run, march, "slider pin", contacts=2)
    torque, at = forces[:, 5], march.at(run["time"].values)
    assert run["drive_torque"].values == pytest.approx(torque, abs=1e-6 * np.max(np.abs(torque)))
    assert run["drive_work"].values == pytest.approx(at.work, abs=1e-8 * np.max(np.abs(at.work)))
    assert_reactions(run, forces, {"ground pin": forces[:, :2], "crank pin": forces[:, 2:4], "slider pin": forces[:, -2:]})
