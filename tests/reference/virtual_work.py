"""The principle of virtual work along a stroke: work of drives and loads, from reported forces and positions."""

from __future__ import annotations

from functools import partial

import numpy as np
from scipy.interpolate import make_interp_spline

import scissordyn as sd
from reference.balance import Places, rotated
from scissordyn.components.port import AXIS, FRAME, HINGE, LINE, POINT, TRAVEL


class VirtualWork:
    """Cumulated work of all forces along a stroke; positions are splines of fifth degree over the instants."""

    def __init__(self, forces, mechanism):
        self.forces, self.mechanism, self.time = forces, mechanism, forces["time"].values
        self.places = Places(forces, mechanism)
        self.at, self.angle = self.places.at, self.places.angle
        self.work: dict[str, np.ndarray] = {}
        self._drives()
        for part in mechanism.components:
            if part.declaration.port is not AXIS:
                self.work[part.name] = self._component(part)
        down = mechanism.gravity * np.array([np.cos(mechanism.gravity_direction), np.sin(mechanism.gravity_direction)])
        masses = np.array([body.mass for body in mechanism.bodies])
        weight = np.einsum("b,tba,a->t", masses, forces["position"].transpose("time", "body", "axis").values, down)
        if "beam_energy" in forces:  # bars that bend have their mass between their ends
            weight = -forces["potential_energy"].values
            # work of the forces of beam elements is that of components
            elements = {part.name for part in mechanism.components if isinstance(part, sd.Beam)}
            pieces = [name for name in forces["beam"].values.tolist() if name not in elements]
            self.work["bars"] = self._of_energy(-forces["beam_energy"].sel(beam=pieces).sum("beam").values)
        self.work["weight"] = self._of_energy(weight)

    @property
    def largest(self):
        """Return the largest work of a single force [J]."""
        return max(float(np.abs(work).max()) for work in self.work.values())

    def imbalance(self):
        """Return the largest sum of all works, over the largest of them."""
        return float(np.abs(sum(self.work.values())).max()) / self.largest

    def _of_energy(self, energy):
        return energy - energy[0]

    def _along(self, force, place):
        """Return the work of a force or torque along a coordinate."""
        rate = make_interp_spline(self.time, place, k=5).derivative()(self.time)
        work: np.ndarray = make_interp_spline(self.time, force * rate, k=5).antiderivative()(self.time)
        return work - work[0]

    def _at_point(self, force, place):
        return self._along(force[:, 0], place[:, 0]) + self._along(force[:, 1], place[:, 1])

    def _drives(self):
        forces, mechanism = self.forces, self.mechanism
        held = dict(zip(forces["prescribed"].values.tolist(), forces["input"].values.T, strict=True))
        torques = forces["drive_torques"].values.T if "drive_torques" in forces else forces.get("drive_torque")
        for k, drive in enumerate(mechanism.drives):
            torque = torques[k] if "drive_torques" in forces else torques.values
            self.work[f"drive of {drive.body}"] = self._along(torque, held[drive.body])
        for rod in mechanism.rods:
            if rod.motion is not None:
                length = np.linalg.norm(self.at(*rod.end) - self.at(*rod.start), axis=1)
                self.work[rod.name] = self._along(-forces["rod_force"].sel(rod=rod.name).values, length)
        for drive in mechanism.coordinate_drives:
            force = forces["coordinate_drive_force"].sel(coordinate_drive=drive.name).values
            self.work[drive.name] = self._along(force, held[drive.name])

    def _component(self, part):
        port, output = part.declaration.port, partial(self.places.output, part)
        if port is LINE:
            return self._along(-output("force"), np.linalg.norm(self.at(*part.end) - self.at(*part.start), axis=1))
        if port is HINGE:
            return self._along(output("torque"), self.angle[part.body] - self.angle[part.base])
        if port is TRAVEL:
            along = np.array([np.cos(part.direction), np.sin(part.direction)])
            return self._along(output("force"), self.at(*part.point) @ along)
        if port is POINT:
            return self._at_point(output("force"), self.at(*part.point))
        assert port is FRAME, part
        base, end = part.start[0], self.at(*part.end)
        turned, origin = self.angle[base], self.at(*part.start)
        local = rotated(end - origin, -turned)  # as the base sees the end
        return self._at_point(output("force"), local) + self._along(output("torque"), self.angle[part.end[0]] - turned)
