"""Any planar mechanism with clearance joints: (x, y, angle) per body, Lagrange multipliers for its ideal joints.

Of the package only the description of a mechanism is used: names, numbers, and points that are pinned together.
"""

import math

import numpy as np

from reference.laws import LuGre, flores, hertz, lankarani_nikravesh, liu
from reference.marching import ClearanceJoint, Relative

GROUND = "ground"  # Name of the fixed frame


def clearance_joint(clearance):
    """Return the laws of a described clearance, by their names."""
    c, radius, length = clearance.clearance, clearance.journal_radius, clearance.bearing_length
    faces = clearance.material, clearance.bearing_material or clearance.material
    modulus = 1.0 / sum((1.0 - face.poisson_ratio**2) / face.youngs_modulus for face in faces)
    elastic = {"liu": liu(c, length, modulus), "hertz": hertz(c, radius, modulus)}[clearance.stiffness.name]
    factor = {"flores": flores, "lankarani-nikravesh": lankarani_nikravesh}[clearance.damping.name]
    friction = {"none": None, "lugre": LuGre(getattr(clearance.friction, "kinetic", 0.0))}[clearance.friction.name]
    return ClearanceJoint(c, radius, elastic, factor(clearance.damping.restitution), friction)


class Multipliers:
    """Dense equations [M P^T; P 0][a; -f] = [Q; g] with the accelerations of the ideal joints, guides and drives in g.

    Coordinates are displacements of mass centres and rotations of bodies since the start, so that tolerances and rounding are
    small compared with a clearance. Constraint drift is removed whenever a contact begins or ends.

    Parameters
    ----------
    mechanism : scissordyn Mechanism
        Drives of constant speed or harmonic ones.
    """

    def __init__(self, mechanism):
        self.mechanism = mechanism
        self.bodies = mechanism.bodies
        self.index = {body.name: i for i, body in enumerate(self.bodies)}
        count = len(self.bodies)
        self.clearance_joints = [joint for joint in mechanism.joints if joint.clearance is not None]
        self.joints = tuple(clearance_joint(joint.clearance) for joint in self.clearance_joints)
        # three columns for every body and for the ground; the ground and angles that cannot change are not unknowns
        active = [3 * i + k for i, body in enumerate(self.bodies) for k in range(3 if body.inertia is not None else 2)]
        self.active = np.array(active)
        self.size = len(active)
        self.mass = np.array([m for body in self.bodies for m in (body.mass, body.mass, body.inertia or 0.0)] + [0.0] * 3)
        self.angle = np.array([body.placed_angle for body in self.bodies] + [0.0])
        self.centre = np.zeros((count + 1, 2))
        for i, body in enumerate(self.bodies):
            c, s = math.cos(body.placed_angle), math.sin(body.placed_angle)
            self.centre[i] = np.array(body.placed_position) + np.array([[c, -s], [s, c]]) @ body.centre
        ideal = [joint for joint in mechanism.joints if joint.clearance is None]
        self.pins = self.ends(ideal)
        self.clearance_pins = self.ends(self.clearance_joints)
        self.all_pins = self.ends([*ideal, *self.clearance_joints])
        self.guided = self.point_list([guide.follower for guide in mechanism.guides])
        self.lines = [
            ((-math.sin(guide.direction), math.cos(guide.direction)), np.array(guide.through)) for guide in mechanism.guides
        ]
        self.driven = [self.index[drive.body] for drive in mechanism.drives]
        direction = mechanism.gravity_direction
        self.weight = mechanism.gravity * np.array([math.cos(direction), math.sin(direction), 0.0])

    def further_loads(self, t, moved, rates):
        """Return forces and moments of further parts on all bodies and the ground, shape (bodies + 1, 3), for subclasses."""
        return 0.0

    def further_conditions(self, moved, rates):
        """Return residuals, gradients and g of further constraints that do not depend on time, for subclasses."""
        return np.zeros(0), np.zeros((0, moved.size)), np.zeros(0)

    def point_list(self, references):
        """Return body numbers and points in the bodies' frames, relative to their mass centres."""
        numbers, places = [], []
        for name, point in references:
            if name == GROUND:
                numbers.append(len(self.bodies))
                places.append(np.array(dict(self.mechanism.ground)[point]))
            else:
                body = self.bodies[self.index[name]]
                numbers.append(self.index[name])
                places.append(np.array(body.points[point]) - np.array(body.centre))
        return np.array(numbers, int), np.array(places).reshape(-1, 2)

    def ends(self, joints):
        """Return the journal points and the bearing points of joints."""
        return self.point_list([joint.journal for joint in joints]), self.point_list([joint.bearing for joint in joints])

    def spread(self, q):
        """Return three columns per body from the unknowns, shape (bodies + 1, 3)."""
        full = np.zeros(3 * len(self.bodies) + 3)
        full[self.active] = q
        return full.reshape(-1, 3)

    def arms(self, moved, points):
        """Return vectors from the mass centres to the points, in the fixed frame."""
        numbers, places = points
        angle = self.angle[numbers] + moved[numbers, 2]
        c, s = np.cos(angle), np.sin(angle)
        return np.stack([c * places[:, 0] - s * places[:, 1], s * places[:, 0] + c * places[:, 1]], axis=1)

    def motion(self, k, t):
        """Return angle, angular velocity and angular acceleration of drive k."""
        described = self.mechanism.drives[k].motion
        if type(described).__name__ == "ConstantSpeed":
            return float(self.angle[self.driven[k]]) + described.speed * t, described.speed, 0.0
        if type(described).__name__ != "Harmonic":
            raise TypeError(f"no reference motion for {type(described).__name__}")
        phase = described.angular_frequency * t + described.phase
        oscillation, turn = (
            described.amplitude * math.sin(phase),
            described.amplitude * described.angular_frequency * math.cos(phase),
        )
        return described.mean + oscillation, turn, -(described.angular_frequency**2) * oscillation

    def conditions(self, t, q, v, pins):
        """Return residuals of position and rate, gradients, and g, for some pins, guides and drives."""
        moved, rates = self.spread(q), self.spread(v)
        journal, bearing = pins
        rows = 2 * len(journal[0]) + len(self.lines) + len(self.driven)
        gradient = np.zeros((rows, 3 * len(self.bodies) + 3))
        position, g, prescribed = np.zeros(rows), np.zeros(rows), np.zeros(rows)
        pair = np.arange(len(journal[0]))
        for sign, points in ((1.0, journal), (-1.0, bearing)):
            numbers, arm = points[0], self.arms(moved, points)
            gradient[2 * pair, 3 * numbers] = sign
            gradient[2 * pair + 1, 3 * numbers + 1] = sign
            gradient[2 * pair, 3 * numbers + 2] = -sign * arm[:, 1]
            gradient[2 * pair + 1, 3 * numbers + 2] = sign * arm[:, 0]
            where = self.centre[numbers] + moved[numbers, :2] + arm
            inward = rates[numbers, 2] ** 2
            for axis in range(2):
                position[2 * pair + axis] += sign * where[:, axis]
                g[2 * pair + axis] += sign * inward * arm[:, axis]
        row = 2 * len(journal[0])
        arm = self.arms(moved, self.guided)
        for k, (normal, through) in enumerate(self.lines):
            i = self.guided[0][k]
            gradient[row, 3 * i : 3 * i + 3] = *normal, normal[1] * arm[k, 0] - normal[0] * arm[k, 1]
            position[row] = np.dot(normal, self.centre[i] + moved[i, :2] + arm[k] - through)
            g[row] = rates[i, 2] ** 2 * np.dot(normal, arm[k])
            row += 1
        for k, i in enumerate(self.driven):
            angle, speed, acceleration = self.motion(k, t)
            gradient[row, 3 * i + 2] = 1.0
            position[row], prescribed[row], g[row] = self.angle[i] + moved[i, 2] - angle, speed, acceleration
            row += 1
        more = self.further_conditions(moved, rates)
        position, gradient, g = (np.concatenate(pair) for pair in zip(more, (position, gradient, g), strict=True))
        prescribed = np.concatenate([np.zeros(more[0].size), prescribed])
        return position, gradient @ rates.ravel() - prescribed, gradient[:, self.active], g

    def close(self, t, q, v, pins):
        """Return the nearest state that satisfies the constraints: positions by Newton's method, then rates."""
        for _ in range(30):
            position, _, gradient, _ = self.conditions(t, q, v, pins)
            if np.max(np.abs(position), initial=0.0) < 1e-14:
                break
            step = np.linalg.lstsq(gradient, position, rcond=None)[0]
            q = q - step
            if np.max(np.abs(step)) < 1e-15:
                break
        _, rate, gradient, _ = self.conditions(t, q, v, pins)
        return q, v - np.linalg.lstsq(gradient, rate, rcond=None)[0]

    def start(self):
        """Return the start of the ideal mechanism with concentric journals."""
        return self.close(0.0, np.zeros(self.size), np.zeros(self.size), self.all_pins)

    def settle(self, t, q, v):
        """Remove drift."""
        return self.close(t, q, v, self.pins)

    def relative(self, t, q, v):
        """Return the positions of the journals in their bearings."""
        moved, rates = self.spread(q), self.spread(v)
        (j, _), (b, _) = self.clearance_pins
        arm_j, arm_b = self.arms(moved, self.clearance_pins[0]), self.arms(moved, self.clearance_pins[1])
        # where both are at the start cancels but for rounding of the order of 1e-16 m per metre of size
        e = (self.centre[j] - self.centre[b]) + arm_j - arm_b + (moved[j, :2] - moved[b, :2])
        w_j, w_b = rates[j, 2], rates[b, 2]
        turn = np.stack([w_b * arm_b[:, 1] - w_j * arm_j[:, 1], w_j * arm_j[:, 0] - w_b * arm_b[:, 0]], axis=1)
        u = rates[j, :2] - rates[b, :2] + turn
        return [Relative(*row) for row in np.column_stack([e, u, w_j, w_b]).tolist()]

    def accelerate(self, t, q, v, loads):
        """Return accelerations, the first drive's torque and the power of all drives."""
        a, forces = self.solve(t, q, v, loads)
        torques = forces[forces.size - len(self.driven) :]
        power = sum(torque * self.motion(k, t)[1] for k, torque in enumerate(torques.tolist()))
        return a, float(torques[0]) if torques.size else 0.0, power

    def solve(self, t, q, v, loads):
        """Return accelerations, and forces of further constraints, ideal joints (on the journal, x and y), guides, drives."""
        moved = self.spread(q)
        applied = self.mass.reshape(-1, 3) * self.weight + self.further_loads(t, moved, self.spread(v))
        for points, sign, spin in ((self.clearance_pins[0], 1.0, 2), (self.clearance_pins[1], -1.0, 3)):
            arm = self.arms(moved, points)
            for k, load in enumerate(loads):
                fx, fy = sign * load.fx, sign * load.fy
                applied[points[0][k]] += fx, fy, arm[k, 0] * fy - arm[k, 1] * fx + load[spin]
        _, _, gradient, g = self.conditions(t, q, v, self.pins)
        n, rows = self.size, g.size
        matrix, right = np.zeros((n + rows, n + rows)), np.empty(n + rows)
        matrix[:n, :n] = np.diag(self.mass[self.active])
        matrix[:n, n:], matrix[n:, :n] = gradient.T, gradient
        right[:n], right[n:] = applied.ravel()[self.active], g
        found = np.linalg.solve(matrix, right)
        return found[:n], -found[n:]

    def energy(self, t, q, v):
        moved, rates, mass = self.spread(q), self.spread(v), self.mass.reshape(-1, 3)
        height = (self.centre + moved[:, :2]) @ self.weight[:2]
        return float(0.5 * np.sum(mass * rates**2) - mass[:, 0] @ height)
