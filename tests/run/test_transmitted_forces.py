"""What joints transmit is what bodies need: Newton's law on each body at each sample, from the numbers of the Dataset alone."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest
import xarray as xr

import scissordyn as sd
from scissordyn.run.summary import joint_summaries, summary_of

OIL = sd.Clearance(4e-4, friction=sd.NoFriction(), lubrication=sd.Lubrication(viscosity=0.1))
RUBBED = sd.Clearance(4e-4, friction=sd.LuGre(0.1), lubrication=sd.Lubrication(viscosity=0.02))
DRY = sd.Clearance(4e-4, friction=sd.LuGre(0.1))


def rotated(vector: Any, angle: Any) -> np.ndarray:
    cos, sin = np.cos(angle), np.sin(angle)
    x, y = np.moveaxis(np.asarray(vector, float), -1, 0)
    return np.stack([cos * x - sin * y, sin * x + cos * y], axis=-1)


class Balance:
    """Forces and moments about the mass centres that the Dataset reports, added body by body."""

    def __init__(self, run: xr.Dataset, mechanism: sd.Mechanism) -> None:
        self.run, self.mechanism = run, mechanism
        self.place = {name: run["position"].sel(body=name).transpose("time", "axis").values for name in run["body"].values}
        self.angle = {name: np.nan_to_num(run["angle"].sel(body=name).values) for name in run["body"].values}
        count = run.sizes["time"]
        down = mechanism.gravity * np.array([np.cos(mechanism.gravity_direction), np.sin(mechanism.gravity_direction)])
        self.force = {body.name: np.tile(body.mass * down, (count, 1)) for body in mechanism.bodies}
        self.moment = {body.name: np.zeros(count) for body in mechanism.bodies}
        self._joints()

    def at(self, end: tuple[str, str]) -> np.ndarray:
        """Where a point of a body is [m]."""
        body, point = end
        if body == "ground":
            return np.tile(self.mechanism.place(end), (self.run.sizes["time"], 1))
        part = self.mechanism.body(body)
        local = np.subtract(part.points[point], part.centre)
        return self.place[body] + rotated(np.tile(local, (self.run.sizes["time"], 1)), self.angle[body])

    def push(self, body: str, where: np.ndarray, force: np.ndarray) -> None:
        """Add a force at a place [m]."""
        if body != "ground":
            arm = where - self.place[body]
            self.force[body] += force
            self.moment[body] += arm[:, 0] * force[:, 1] - arm[:, 1] * force[:, 0]

    def turn(self, body: str, torque: np.ndarray) -> None:
        """Add a torque."""
        if body != "ground":
            self.moment[body] += torque

    def _joints(self) -> None:
        run = self.run
        for joint in self.mechanism.joints:
            force = run["reaction"].sel(joint=joint.name).transpose("time", "axis").values
            where = self.at(joint.journal)
            self.push(joint.journal[0], where, force)
            self.push(joint.bearing[0], where, -force)
            if joint.clearance is None:
                continue
            friction = joint.clearance.journal_radius * run["friction_force"].sel(joint=joint.name).values
            self.turn(joint.journal[0], -friction)
            self.turn(joint.bearing[0], friction)
            if joint.clearance.lubrication is not None:
                torque = run["film_torque"].sel(film=joint.name).values
                self.turn(joint.journal[0], torque)
                self.turn(joint.bearing[0], -torque)
        for guide in self.mechanism.guides:
            force = run["reaction"].sel(joint=guide.name).transpose("time", "axis").values
            self.push(guide.follower[0], self.at(guide.follower), force)
        for drive in self.mechanism.drives:
            self.turn(drive.body, run["drive_torque"].values.reshape(run.sizes["time"], -1)[:, 0])
        for part in self.mechanism.components:
            if isinstance(part, sd.Spring):
                line = self.at(part.end) - self.at(part.start)
                pull = run["spring_force"].sel(spring=part.name).values[:, None] * line / np.linalg.norm(line, axis=1)[:, None]
                self.push(part.start[0], self.at(part.start), pull)
                self.push(part.end[0], self.at(part.end), -pull)
            else:
                assert isinstance(part, sd.Bushing)
                own = run["bushing_force"].sel(bushing=part.name).transpose("time", "axis").values
                force = own if part.start[0] == "ground" else rotated(own, self.angle[part.start[0]])
                torque = run["bushing_torque"].sel(bushing=part.name).values
                for body, sign in ((part.end[0], 1.0), (part.start[0], -1.0)):
                    self.push(body, self.at(part.end), sign * force)
                    self.turn(body, sign * torque)

    def residual(self) -> tuple[float, float]:
        """Largest part of m a and of J alpha that nothing reported explains, over the largest force and its moment arm."""
        force = moment = 0.0
        for body in self.mechanism.bodies:
            acceleration = self.run["acceleration"].sel(body=body.name).transpose("time", "axis").values
            force = max(force, float(np.abs(body.mass * acceleration - self.force[body.name]).max()))
            if body.rotates:
                turning = (body.inertia or 0.0) * self.run["angular_acceleration"].sel(body=body.name).values
                moment = max(moment, float(np.abs(turning - self.moment[body.name]).max()))
        scale = float(np.nanmax(np.abs(self.run["reaction"].values)))
        return force / scale, moment / scale


def array(units: int = 2, **clearances: sd.Clearance) -> sd.Mechanism:
    made = sd.scissor(units=units)
    for name, clearance in clearances.items():
        made = made.with_clearance(name, clearance)
    return made.driven(speed=sd.rpm(150))


def sprung(clearance: sd.Clearance) -> sd.Mechanism:
    """A crank and slider with a spring and a bushing beside its loose pin."""
    made = sd.slider_crank(gravity=9.81).with_clearance("slider pin", clearance)
    parts = (
        sd.Spring("spring", ("ground", "origin"), ("rod", "end"), stiffness=400.0, free_length=0.1, damping=2.0),
        sd.Bushing(
            "mount",
            ("rod", "end"),
            ("slider", "centre"),
            stiffness_x=1e4,
            stiffness_y=2e4,
            torsional_damping=1e-3,
            damping_x=5.0,
        ),
    )
    return dataclasses.replace(made, components=parts).driven(speed=50.0)


CASES = {
    "dry": (lambda: array(A=DRY), 0.01),
    "oiled": (lambda: array(A=OIL), 0.05),
    "oiled, rubbing": (lambda: array(A=RUBBED), 0.02),
    "springs": (lambda: sprung(DRY), 0.05),
    "springs and oil": (lambda: sprung(RUBBED), 0.05),
    "hard contact": (lambda: array(A=sd.Clearance(4e-4, contact="hard")), 0.01),
}


@pytest.mark.parametrize("name", CASES)
def test_what_joints_transmit_is_what_bodies_need(name: str) -> None:
    """Identity: m a and J alpha of each body are the sum of the reported forces and moments, to rounding."""
    make, until = CASES[name]
    mechanism = make()
    run = sd.simulate(mechanism, until=until, samples=201)
    force, moment = Balance(run, mechanism).residual()
    assert force < 1e-8
    assert moment < 1e-8


@pytest.fixture(scope="module")
def stroke() -> tuple[sd.Mechanism, xr.Dataset]:
    mechanism = array(A=OIL)
    return mechanism, sd.simulate(mechanism, until=0.05, samples="auto")


def test_the_largest_force_of_an_oiled_joint_has_its_film(stroke: Any) -> None:
    """Cross-check: the peak within the steps is the size of metal and film together at its own instant, a recorded sample."""
    mechanism, run = stroke
    film = rotated(run["film_force"].sel(film="A").values, run["angle"].sel(body=mechanism.joint("A").bearing[0]).values)
    normal, (ex, ey) = run["normal_force"].sel(joint="A").values, run["eccentricity"].sel(joint="A").values.T
    away = np.hypot(ex, ey)
    size = np.hypot(*(film - (normal / np.where(away > 0.0, away, 1.0))[:, None] * np.stack([ex, ey], axis=1)).T)
    peak, metal = float(run["joint_peak_force"].sel(joint="A")), float(run["peak_force"].max())
    assert peak == pytest.approx(float(size.max()), rel=1e-6)
    assert peak > 20.0 * metal
    assert float(run["film_peak_force"].max()) == pytest.approx(peak, rel=0.05)
    answer = summary_of(run).force
    assert answer is not None
    assert (answer.force, answer.metal) == (peak, metal)
    assert "its film alone" in str(answer)


def test_every_answer_about_an_oiled_joint_has_the_same_force(stroke: Any) -> None:
    """Contract: measures of batches, the table of joints, envelopes and the order of joints agree with the run."""
    mechanism, run = stroke
    peak = float(run["joint_peak_force"].sel(joint="A"))
    batch = sd.simulate_many(mechanism, {"A.clearance": [4e-4]}, until=0.05, measures=("peak_force",))
    assert float(batch["peak_force"].max()) == pytest.approx(peak, rel=1e-12)
    assert [joint.largest for joint in joint_summaries(run)] == [peak]
    forces = sd.pin_forces(run, mechanism)
    at_joint = forces["end_joint"].values == "A"
    size = np.linalg.norm(forces["force"].values[:, at_joint], axis=2)
    assert size.max() == pytest.approx(peak, rel=1e-6)
    assert np.all(forces["located_peak"].values[at_joint] == peak)
    assert np.abs(forces["other_force"].values).max() < 1e-8 * peak


def test_a_film_that_keeps_the_metal_apart_has_a_largest_force() -> None:
    """Limit: a joint that never touches is in the answers, with the force of its film and none of metal."""
    run = sd.simulate(array(A=OIL), until=2e-4, samples=21)
    assert run.sizes["contact"] == 0
    answer = summary_of(run).force
    assert answer is not None
    assert answer.force == pytest.approx(float(run["film_peak_force"].max()), rel=1e-12)
    assert answer.metal == 0.0
    assert not answer.estimated


@pytest.mark.parametrize("method", ["dop853", "rodas5p"])
def test_the_largest_force_of_a_dry_joint_has_its_friction(method: str) -> None:
    """Cross-check: the peak within the steps is the size of the reaction at its own instant, in all answers."""
    mechanism = array(A=DRY)
    run = sd.simulate(mechanism, until=0.01, samples="auto", method=method)
    size = np.hypot(*run["reaction"].sel(joint="A").values.T)
    peak, normal = run["peak_force"].values, run["peak_normal_force"].values
    for start, when, force in zip(run["contact_start"].values, run["peak_time"].values, peak, strict=True):
        assert force == pytest.approx(size[np.argmin(np.abs(run["time"].values - start - when))], rel=1e-6)
    assert np.all(peak >= normal)
    assert peak.max() > 1.004 * normal.max()
    assert peak.max() == pytest.approx(size.max(), rel=1e-9)
    summary = summary_of(run).force
    assert summary is not None
    assert summary.force == peak.max()
    batch = sd.simulate_many(mechanism, {"A.clearance": [4e-4]}, until=0.01, measures=("peak_force",), method=method)
    assert float(batch["peak_force"].max()) == peak.max()
    assert sd.pin_forces(run, mechanism)["located_peak"].max() == peak.max()
