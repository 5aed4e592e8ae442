"""Energy, momentum and closure of a run, from the motion of its bodies and the description of its mechanism alone."""

import numpy as np

import scissordyn as sd
from reference.balance import Places


def masses(mechanism):
    """Return masses [kg] and moments of inertia [kg m^2] of the bodies."""
    bodies = mechanism.bodies
    return np.array([body.mass for body in bodies]), np.array([body.inertia or 0.0 for body in bodies])


def kinetic_energy(run, mechanism):
    """Return the sum of m v^2/2 + I w^2/2 over the bodies, shape (nt,) [J]."""
    mass, inertia = masses(mechanism)
    return 0.5 * np.sum(run["velocity"].values ** 2, axis=2) @ mass + 0.5 * run["angular_velocity"].values ** 2 @ inertia


def stored_energy(run, mechanism):
    """Return the energy of weight and springs, relative to the start, and of contacts, shape (nt,) [J]."""
    mass, _ = masses(mechanism)
    pull = mechanism.gravity * np.array([np.cos(mechanism.gravity_direction), np.sin(mechanism.gravity_direction)])
    moved, places = run["position"].values - run["position"].values[0], Places(run, mechanism)
    energy = -np.tensordot(moved, pull, 1) @ mass + run["elastic_energy"].values
    for element in mechanism.components:
        if isinstance(element, sd.Spring):
            along = places.at(*element.end) - places.at(*element.start)
            stretch = np.hypot(*along.T) - element.free_length
        elif isinstance(element, sd.TorsionSpring):
            stretch = places.angle[element.body] - places.angle[element.base] - element.free_angle
        else:
            raise TypeError(f"no energy is kept by {element!r}")
        energy = energy + 0.5 * element.stiffness * stretch**2
    return energy


def energy_drift(run, mechanism):
    """Return the largest change of the total energy, over the largest of its parts."""
    kinetic, stored = kinetic_energy(run, mechanism), stored_energy(run, mechanism)
    return float(np.max(np.abs(kinetic + stored - kinetic[0] - stored[0])) / _largest_part(run, mechanism))


def height_over_drift(run, mechanism):
    """Return weights times distances from the origin, to which positions round, over the largest part of the energy."""
    reach = np.max(np.hypot(*np.moveaxis(run["position"].values, -1, 0)), axis=0)
    return float(mechanism.gravity * reach @ masses(mechanism)[0] / _largest_part(run, mechanism))


def _largest_part(run, mechanism):
    return max(float(np.max(kinetic_energy(run, mechanism))), float(np.max(np.abs(stored_energy(run, mechanism)))))


def momentum_drift(run, mechanism):
    """Return the largest changes of linear and angular momentum (about the origin), over the sums of their parts.

    The parts are the momenta of the bodies and, for the linear one, the impulses of the contacts on both bodies.
    """
    mass, inertia = masses(mechanism)
    linear = run["velocity"].values * mass[:, None]
    position, spin = run["position"].values, run["angular_velocity"].values * inertia
    angular = position[..., 0] * linear[..., 1] - position[..., 1] * linear[..., 0] + spin
    contributions = np.max(np.sum(np.hypot(linear[..., 0], linear[..., 1]), axis=1))
    if run.sizes.get("contact"):
        contributions += 2.0 * float(run["impulse"].sum())
    turning = np.sum(np.abs(angular), axis=1)
    change = np.sum(linear, axis=1) - np.sum(linear[0], axis=0)
    turn = np.sum(angular, axis=1) - np.sum(angular[0])
    return float(np.max(np.hypot(*change.T)) / contributions), float(np.max(np.abs(turn)) / np.max(turning))


def closure_error(run, mechanism):
    """Return the largest error of an ideal joint, guide or weld [m or rad]."""
    places = Places(run, mechanism)
    apart = [places.at(*joint.journal) - places.at(*joint.bearing) for joint in mechanism.ideal_joints]
    for guide in mechanism.guides:
        along = places.angle[guide.body] + guide.direction
        x, y = (places.at(*guide.follower) - places.at(guide.body, guide.through)).T
        apart.append(np.cos(along) * y - np.sin(along) * x)
    for weld in mechanism.welds:
        turn = places.angle[weld.start[0]] - places.angle[weld.end[0]]
        apart += [places.at(*weld.start) - places.at(*weld.end), turn - turn[0]]
    return max((float(np.max(np.abs(error))) for error in apart), default=0.0)
