"""Effective masses at contact onset, compared with dense equations of all bodies and with gradients of the gaps."""

import math

import numpy as np
import pytest

import scissordyn as sd
from reference.kernels import at_start, touching
from scissordyn.equilibrium.static_position import StaticPosition, constraint_slopes, free_directions
from scissordyn.integrate.integration import RESET_DATA
from scissordyn.mechanics import functions
from scissordyn.plan.plan import plan
from test_rollers import beam

FIRST, SECOND = (0.5, 2.0, 0.07), (0.8, 1.2, 0.09)  # Length [m], mass [kg] and moment of inertia [kg m^2] of two bars
ANGLES = 0.2, 1.1  # [rad] angles of the two bars of a chain


def chain(angles=ANGLES):
    """Return two bars with a clearance between them, the first one on a ground pin."""
    (a, mass_a, moment_a), (b, mass_b, moment_b) = FIRST, SECOND
    first = sd.bar("first", length=a, mass=mass_a, inertia=moment_a, angle=angles[0])
    end = (a * math.cos(angles[0]), a * math.sin(angles[0]))
    second = sd.bar("second", length=b, mass=mass_b, inertia=moment_b, angle=angles[1], position=end)
    joints = (sd.Revolute("O", ("first", "start"), ("ground", "O")), sd.Revolute("A", ("second", "start"), ("first", "end")))
    made = sd.Mechanism((first, second), joints=joints, ground=(("O", (0.0, 0.0)), ("end", (1.0, 0.6))), input_body="first")
    return made.with_clearance("A", sd.Clearance(2e-4))


def closed(angles=ANGLES):
    """Return the chain with the end of the second bar on a guide."""
    guide = sd.Guide("guide", ("second", "end"), direction=0.3, through=tuple(tips(angles)[1]))
    return chain(angles).with_parts({"guides": (guide,)})


def driven(angles=ANGLES):
    """Return the closed chain with a drive of the first bar."""
    return closed(angles).driven(sd.ConstantSpeed(3.0))


def pushed(angles=ANGLES):
    """Return the open chain with a drive of the first bar."""
    return chain(angles).driven(sd.ConstantSpeed(3.0))


def tips(angles):
    """Return the ends of both bars [m]."""
    steps = [length * np.array([math.cos(a), math.sin(a)]) for (length, _, _), a in zip((FIRST, SECOND), angles, strict=True)]
    return np.cumsum(steps, axis=0)


def dense_mass(kind, normal, clearance):
    """Return 1/(J M^-1 J^T) from the augmented equations of both bars, x, y and angle each about their mass centres."""
    halves = [
        0.5 * length * np.array([math.cos(a), math.sin(a)]) for (length, _, _), a in zip((FIRST, SECOND), ANGLES, strict=True)
    ]
    inertia = np.diag([FIRST[1], FIRST[1], FIRST[2], SECOND[1], SECOND[1], SECOND[2]])

    def row(body, arm, along):
        """Return the gradient of a bar point's speed along a direction by all coordinate rates."""
        found = np.zeros(6)
        found[3 * body : 3 * body + 2], found[3 * body + 2] = along, arm[0] * along[1] - arm[1] * along[0]
        return found

    rows = [row(0, -halves[0], axis) for axis in np.eye(2)]
    if kind is not chain:
        rows.append(row(1, halves[1], np.array([-math.sin(0.3), math.cos(0.3)])))
    if kind is driven:
        rows.append(np.eye(6)[2])
    # the journal at the start of the second bar presses outwards, the bearing at the end of the first one is pushed there
    touch = row(1, -halves[1], normal) - row(0, halves[0] + clearance * normal, normal)
    count = len(rows)
    matrix = np.block([[inertia, np.transpose(rows)], [np.array(rows), np.zeros((count, count))]])
    acceleration = np.linalg.solve(matrix, np.append(touch, np.zeros(count)))[:6]
    return 1.0 / float(touch @ acceleration)


def onset(handle, state, guard):
    """Return the effective mass that a guard keeps as its contact begins in a state."""
    functions.touch(0.0, state, guard, handle.address, np.zeros(RESET_DATA))
    return float(handle.content.state.mass[guard])


def allowed(mechanism, handle, state):
    """Return an orthonormal basis of the motions that the constraints allow."""
    functions.rate(0.0, state, handle.address, np.zeros(state.size))
    gradients, _ = constraint_slopes(StaticPosition(plan(mechanism), handle, state), handle.content.work.multiplier)
    return free_directions(gradients) if gradients.size else np.eye(handle.content.model.n)


@pytest.mark.parametrize("kind", [chain, closed, driven])
@pytest.mark.parametrize("direction", [-2.0, 0.1, 0.9, 2.3])
def test_journal_against_dense_equations(kind, direction):
    """Second formulation: the augmented equations of all bodies; the gap is small compared with the bars."""
    mechanism, normal = kind(), np.array([math.cos(direction), math.sin(direction)])
    handle, state = at_start(mechanism)
    contact = handle.content.parameters.contact
    e = plan(mechanism).eccentricity(0)
    n = handle.content.model.n
    # the journal moves against the bearing by much less than the bars turn
    step, rows = 1e-9 * normal, np.stack([e.at(np.eye(n + handle.content.model.nb)[k]) for k in range(n)], axis=1)
    free = allowed(mechanism, handle, state)
    state[:n] += free @ np.linalg.lstsq(rows @ free, step, rcond=None)[0]
    contact["clearance"][0] = 0.0
    assert onset(handle, state, 0) == pytest.approx(dense_mass(kind, normal, 1e-9), rel=1e-6)


# Components at which a contact mass is compared, by name
PARTS = {
    "travel stop": sd.TravelStop("stop", ("second", "end"), direction=0.7, limit=5.0),
    "angle stop": sd.AngleStop("stop", "second", 4.0, "first"),
    "cable": sd.Cable("stop", ("second", "middle"), ("ground", "end"), free_length=3.0, stiffness=1e4),
    "cam": sd.Cam(
        "stop",
        ("first", "start"),
        ("second", "end"),
        tuple((0.5 * math.pi * k, 0.2 + 0.01 * (k % 4)) for k in range(5)),
        stiffness=1e6,
    ),
    "edge": sd.EdgeContact("stop", ("first", "start"), ("second", "end"), 0.3, 0.5, 0.02, 0.05),
}


def check_gap(mechanism, handle, state, guard):
    """Compare 1/m with the squared gradient of the gap, by differences, projected on the allowed motions."""
    found, n = onset(handle, state, guard), handle.content.model.n
    gradient, value, rate = np.zeros(n), np.zeros(handle.content.state.mode.size), np.zeros(handle.content.state.mode.size)
    for k in range(n):
        for sign in (1.0, -1.0):
            moved = state.copy()
            moved[k] += 1e-6 * sign
            functions.guards(0.0, moved, handle.address, value, rate)
            gradient[k] += sign * value[guard] / 2e-6
    free = allowed(mechanism, handle, state)
    assert found == pytest.approx(1.0 / float(np.sum((free.T @ gradient) ** 2)), rel=1e-6)


def ideal(kind, part):
    """Return a chain with ideal joints and a component."""
    made = kind().with_parts({"components": (part,)})
    return made.with_parts({"joints": tuple(sd.Revolute(joint.name, joint.journal, joint.bearing) for joint in made.joints)})


@pytest.mark.parametrize("part", PARTS)
@pytest.mark.parametrize("kind", [chain, closed, pushed])
def test_gap_of_a_component(part, kind):
    """Second formulation: the gradient of a component's gap, by differences."""
    mechanism = ideal(kind, PARTS[part])
    handle, state = at_start(mechanism)
    check_gap(mechanism, handle, state, 0)


def test_effective_mass_along_constrained_directions():
    """Limit: a closed loop lowers the effective mass along the gap; a prescribed direction has none."""
    with_open_loop = onset(*at_start(ideal(pushed, PARTS["travel stop"])), 0)
    assert 0.1 * with_open_loop < onset(*at_start(ideal(driven, PARTS["travel stop"])), 0) < with_open_loop
    assert 0.0 < onset(*at_start(ideal(pushed, sd.AngleStop("stop", "first", 4.0))), 0) < 1e-200


def test_gap_of_a_roller_on_a_bar_that_bends():
    """Second formulation: the gradient of a roller's gap, by differences, includes the modes of the bar."""
    car = sd.point_mass("car", mass=3.0, position=(0.7, 0.003))
    mechanism = beam(car, stiffness=1e6, clearance=1e-3)
    handle, state = at_start(mechanism)
    check_gap(mechanism, handle, state, 0)


def test_corner_of_a_block():
    """Second formulation: the gradient of a corner's gap, by differences, for a corner off the middle of its guide."""
    clearance = sd.GuideClearance(5e-4, length=0.06, width=0.03, corner_radius=3e-3)
    mechanism = sd.slider_crank(angle=0.5, slider_inertia=2e-5).with_clearance("guide", clearance)
    handle, state = touching(mechanism, 3, chosen=[0, 2], surface="level")
    check_gap(mechanism, handle, state, 0)
    check_gap(mechanism, handle, state, 2)


def test_corner_of_a_free_block():
    """Closed form: 1/m + r^2/J for a corner at a distance r from the mass centre of a free block."""
    block = sd.Body("block", 2.0, 4e-3, {"centre": (0.0, 0.0)}, position=(0.0, 0.0))
    guide = sd.Guide("channel", ("block", "centre"))
    clearance = sd.GuideClearance(5e-4, length=0.06, width=0.03, corner_radius=3e-3)
    mechanism = sd.Mechanism((block,), guides=(guide,)).with_clearance("channel", clearance)
    handle, state = at_start(mechanism)
    assert onset(handle, state, 0) == pytest.approx(1.0 / (1.0 / 2.0 + 0.027**2 / 4e-3), rel=1e-12)
