"""Newton's law for each body at each sample, from the reported forces of joints, films, drives, components and bending bars."""

from itertools import pairwise

import numpy as np

import scissordyn as sd
from scissordyn.components.port import ACTUATOR, AXIS, FRAME, HINGE, LINE, POINT, TRAVEL

BESIDE = 1e-12  # [bar lengths] distance from a cross-section at which the force on either side of it is evaluated


def rotated(vector, angle):
    cos, sin = np.cos(angle), np.sin(angle)
    x, y = np.moveaxis(np.asarray(vector, float), -1, 0)
    return np.stack([cos * x - sin * y, sin * x + cos * y], axis=-1)


class Places:
    """Positions of the bodies of a run and of their points over time; the ground is a body at rest."""

    def __init__(self, run, mechanism):
        self.run, self.mechanism, self.count = run, mechanism, run.sizes["time"]
        self.place = {name: self.over("position", body=name) for name in run["body"].values}
        self.angle = {name: np.nan_to_num(run["angle"].sel(body=name).values) for name in run["body"].values}
        self.place["ground"], self.angle["ground"] = np.zeros((self.count, 2)), np.zeros(self.count)

    def over(self, name, **where):
        """Return a vector over time."""
        return self.run[name].sel(where).transpose("time", "axis").values

    def at(self, body, local):
        """Return the position of a point [m], given by name or by its coordinates in the body's frame."""
        if isinstance(local, str):
            local = dict(self.mechanism.ground)[local] if body == "ground" else self.mechanism.body(body).points[local]
        local = np.subtract(local, (0.0, 0.0) if body == "ground" else self.mechanism.body(body).centre)
        return self.place[body] + rotated(np.tile(local, (self.count, 1)), self.angle[body])

    def output(self, part, name):
        """Return a reported quantity of a component."""
        section = part.declaration.section
        values = self.run[f"{section}_{name}"].sel({section: part.name})
        return values.transpose("time", "axis").values if "axis" in values.dims else values.values


class Balance(Places):
    """Sums of the reported forces and moments about the mass centres, body by body.

    Moments of bodies without inertia count only where a guide keeps their angle.
    """

    def __init__(self, run, mechanism):
        super().__init__(run, mechanism)
        down = mechanism.gravity * np.array([np.cos(mechanism.gravity_direction), np.sin(mechanism.gravity_direction)])
        self.force, self.moment = {}, {}
        self.bars = [part for part in mechanism.components if part.declaration.port is AXIS]
        self.sections = {section for bar in self.bars for section in bar.sections}
        inside = dict.fromkeys(self.sections, 0.0)  # mass of bars that bend, which is between their cross-sections
        for bar in self.bars:
            for (one, start), (other, end) in pairwise(zip(bar.sections, bar.places, strict=True)):
                for name in (one, other):
                    inside[name] += 0.5 * bar.mass_per_length * (end - start)
        for body in mechanism.bodies:
            acceleration = self.over("acceleration", body=body.name)
            self.force[body.name] = (body.mass - inside.get(body.name, 0.0)) * (down - acceleration)
            turning = np.nan_to_num(run["angular_acceleration"].sel(body=body.name).values)
            self.moment[body.name] = -(body.inertia or 0.0) * turning if body.name not in inside else 0.0 * turning
        self.scale = self.largest_moment = 0.0
        guided = {guide.follower[0] for guide in mechanism.guides}
        self.free_of_moments = {body.name for body in mechanism.bodies if not body.rotates and body.name not in guided}
        self._joints()
        self._guides()
        for number, drive in enumerate(mechanism.drives):
            torques = run["drive_torques"].values if "drive_torques" in run else run["drive_torque"].values[:, None]
            self.turn(drive.body, torques[:, number])
        for part in (*mechanism.components, *mechanism.rods, *mechanism.latches):
            if part.declaration.port is not AXIS:
                self._component(part)
        for coupling in mechanism.couplings:
            if coupling.transmission is not None:
                self._transmission(coupling)
                continue
            for end in ("output", "input"):
                of = "coupling_force" if end == "output" else "coupling_input_force"
                if coupling.name in run["coupling"]:
                    self._coordinate(getattr(coupling, end), run[of].sel(coupling=coupling.name).values)
        for drive in mechanism.coordinate_drives:
            self._coordinate(drive.coordinate, run["coordinate_drive_force"].sel(coordinate_drive=drive.name).values)
        for bar in self.bars:
            self._bar(bar)

    def _transmission(self, coupling):
        """Add the reported force at its point to the bodies of output and input, and the torque of a screw."""
        first, second = (
            end.point[0] if isinstance(end, sd.Slide) else end.body if isinstance(end, sd.RelativeAngle) else None
            for end in (coupling.output, coupling.input)
        )
        if isinstance(coupling.output, sd.Distance):
            first = next(body for body, _ in (coupling.output.end, coupling.output.start) if body not in ("ground", second))
        force, where = (self.over(f"coupling_transmitted_{name}", coupling=coupling.name) for name in ("force", "point"))
        self.pair(first, second, where, force)
        if isinstance(coupling.transmission, sd.Screw):
            torque = self.run["coupling_input_force"].sel(coupling=coupling.name).values
            self.turn(coupling.input.body, torque, coupling.input.base)

    def _coordinate(self, coordinate, force):
        if isinstance(coordinate, sd.RelativeAngle):
            self.turn(coordinate.body, force, coordinate.base)
        elif isinstance(coordinate, sd.Slide):
            base = coordinate.direction + self.angle[coordinate.base]
            unit = np.stack([np.cos(base), np.sin(base)], axis=-1)
            self.pair(coordinate.point[0], coordinate.base, self.at(*coordinate.point), force[:, None] * unit)
        else:
            start, end = self.at(*coordinate.start), self.at(*coordinate.end)
            along = force[:, None] * (end - start) / np.linalg.norm(end - start, axis=1)[:, None]
            self.push(coordinate.end[0], end, along)
            self.push(coordinate.start[0], start, -along)

    def push(self, body, where, force):
        """Add a force at a position [m]."""
        self.scale = max(self.scale, float(np.nanmax(np.abs(force), initial=0.0)))
        if body != "ground":
            arm = where - self.place[body]
            self.force[body] = self.force[body] + force
            self.turn(body, arm[:, 0] * force[:, 1] - arm[:, 1] * force[:, 0])

    def pair(self, first, second, where, force):
        """Add a force and its reaction at a position."""
        self.push(first, where, force)
        self.push(second, where, -force)

    def turn(self, body, torque, against="ground"):
        """Add a torque and its reaction."""
        self.largest_moment = max(self.largest_moment, float(np.nanmax(np.abs(torque), initial=0.0)))
        for name, sign in ((body, 1.0), (against, -1.0)):
            if name != "ground":
                self.moment[name] = self.moment[name] + sign * torque

    def _joints(self):
        for joint in self.mechanism.joints:
            journal, bearing = joint.journal[0], joint.bearing[0]
            self.pair(journal, bearing, self.at(*joint.journal), self.over("reaction", joint=joint.name))
            self.turn(journal, self.run["reaction_moment"].sel(joint=joint.name).values, bearing)

    def _guides(self):
        for guide in self.mechanism.guides:
            follower, where = guide.follower[0], self.at(*guide.follower)
            self.pair(follower, guide.body, where, self.over("reaction", joint=guide.name))
            self.turn(follower, self.run["reaction_moment"].sel(joint=guide.name).values, guide.body)
        for weld in self.mechanism.welds:
            self.pair(weld.start[0], weld.end[0], self.at(*weld.start), self.over("weld_force", weld=weld.name))
            self.turn(weld.start[0], self.run["weld_moment"].sel(weld=weld.name).values, weld.end[0])

    def _component(self, part):
        port = part.declaration.port
        if port is LINE:
            start, end = self.at(*part.start), self.at(*part.end)
            along = (end - start) / np.linalg.norm(end - start, axis=1)[:, None]
            tension = self.output(part, "force")[:, None]
            self.push(part.start[0], start, tension * along)
            self.push(part.end[0], end, -tension * along)
        elif port is ACTUATOR:
            self.turn(part.body, self.run["control_torque"].sel(actuator=part.name).values, part.base)
        elif port is HINGE:
            self.turn(part.body, self.output(part, "torque"), part.base)
            if isinstance(part, sd.Motor):
                self.turn(part.body, -part.inertia * self.run["angular_acceleration"].sel(body=part.body).values)
        elif port is TRAVEL:
            along = np.array([np.cos(part.direction), np.sin(part.direction)])
            self.push(part.point[0], self.at(*part.point), self.output(part, "force")[:, None] * along)
        elif port is POINT:
            self.push(part.point[0], self.at(*part.point), self.output(part, "force"))
        else:
            assert port is FRAME, part
            start = part.start[0]
            force = rotated(self.output(part, "force"), self.angle[start])
            self.pair(part.end[0], start, self.at(*part.end), force)
            self.turn(part.end[0], self.output(part, "torque"), start)

    def _bar(self, bar):
        """Add the internal forces on both sides of each cross-section of a bending bar."""
        along = (np.array(bar.places) - bar.places[0]) / bar.length
        for place, section in zip(along, bar.sections, strict=True):
            for at, side in ((place - BESIDE, -1.0), (place + BESIDE, 1.0)):
                if not 0.0 <= at <= 1.0:
                    continue
                forces = sd.internal_forces(self.run, self.mechanism, bars=bar.name.removesuffix("/beam"), places=[at])
                normal, shear, moment = (
                    forces[name].values[:, 0, 0] for name in ("axial_force", "shear_force", "bending_moment")
                )
                force = side * rotated(np.stack([normal, shear], axis=1), self.angle[section])
                self.push(section, self.place[section], force)
                self.turn(section, side * moment)

    def residual(self):
        """Return the largest residuals of m a and of J alpha of a body, relative to the largest force and moment.

        NaN marks a reaction that is not determined.
        """
        force = max(float(np.nanmax(np.abs(values), initial=0.0)) for values in self.force.values())
        turned = [values for name, values in self.moment.items() if name not in self.free_of_moments]
        moment = max((float(np.nanmax(np.abs(values), initial=0.0)) for values in turned), default=0.0)
        weights = max(body.mass for body in self.mechanism.bodies) * self.mechanism.gravity
        scale = max(self.scale, weights, 1e-12)
        return force / scale, moment / max(self.largest_moment, scale * self.mechanism.size)
