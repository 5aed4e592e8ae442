"""Pinocchio: constrained accelerations of a tree whose loops are closed by point constraints; the steps are written here."""

import math
import sys

import numpy as np
import pinocchio as pin
from shared import read, run, start_of, tree

problem, setting = read()
if "hole" in problem:
    sys.exit("constraints stay closed: a contact that opens needs a solver that the user adds")
careful = setting == "careful"
model = pin.Model()
model.gravity.linear = np.array([*problem["gravity"], 0.0])
chain, loops = tree(problem)


def below(parent):
    """Return the part of the tree behind a body, depth first: other orders give wrong mass matrices without a word."""
    return [entry for link in chain if link[1] == parent for entry in (link, *below(link[0]))]


directions, joints, origins, angles, rates = dict(problem["slides"]), {-1: 0}, {-1: [0.0, 0.0]}, [], []
place_of = lambda k, place: pin.SE3(np.eye(3), np.array([*np.subtract(place, origins[k]), 0.0]))  # noqa: E731
for k, parent, mine, other in below(-1):
    turn = directions.get(k)
    kind = pin.JointModelRZ()
    if turn is not None:
        kind = pin.JointModelPrismaticUnaligned(np.array([math.cos(turn), math.sin(turn), 0.0]))
    joints[k] = model.addJoint(joints[parent], kind, place_of(parent, other), f"joint {k}")
    origins[k] = mine  # the frame of a joint is at its pin
    given = problem["bodies"][k]
    inertia = np.diag([0.6, 0.6, 1.0]) * (given["inertia"] or 1e-6)
    model.appendBodyToJoint(joints[k], pin.Inertia(given["mass"], np.zeros(3), inertia), place_of(k, [0.0, 0.0]))
    angle, rate = start_of(problem, k, parent) if turn is None else (0.0, 0.0)
    angles.append(angle)
    rates.append(rate)
closures = pin.StdVec_RigidConstraintModel()
for a, place, b, other in loops:
    ends = joints[a], place_of(a, place), joints[b], place_of(b, other)
    closures.append(pin.RigidConstraintModel(pin.ContactType.CONTACT_3D, model, *ends, pin.ReferenceFrame.LOCAL))
    if careful:  # critically damped, 1 ms
        closures[-1].setBaumgarteCorrectorParameters(pin.BaumgarteCorrectorParameters(1e6, 2e3))
data = model.createData()
numbers = pin.StdVec_RigidConstraintData()
numbers.extend(closure.createData() for closure in closures)
pin.initConstraintDynamics(model, data, closures, numbers)
settings = pin.ProximalSettings(1e-12, 1e-12, 100 if careful else 10)
none = np.zeros(model.nv)
q, v = np.array(angles), np.array(rates)


def rate_of(q, v):
    return v, pin.constraintDynamics(model, data, q, v, none, closures, numbers, settings).copy()


def advance(count, step):
    global q, v
    for _ in range(count):
        k1 = rate_of(q, v)
        if not careful:  # as in the examples: semi-implicit Euler
            v = v + step * k1[1]
            q = q + step * v
            continue
        k2 = rate_of(*(y + step / 2 * k for y, k in zip((q, v), k1, strict=True)))
        k3 = rate_of(*(y + step / 2 * k for y, k in zip((q, v), k2, strict=True)))
        k4 = rate_of(*(y + step * k for y, k in zip((q, v), k3, strict=True)))
        slopes = [(a + 2 * b + 2 * c + d) / 6 for a, b, c, d in zip(k1, k2, k3, k4, strict=True)]
        q, v = q + step * slopes[0], v + step * slopes[1]


def states():
    pin.forwardKinematics(model, data, q, v)
    rows = []
    for k in range(len(problem["bodies"])):
        place = data.oMi[joints[k]] * place_of(k, [0.0, 0.0])
        speed = place_of(k, [0.0, 0.0]).actInv(data.v[joints[k]])
        turn = place.rotation
        rows.append([*place.translation[:2], math.atan2(turn[1, 0], turn[0, 0]), *(turn @ speed.linear)[:2], speed.angular[2]])
    return rows


run(problem, 1e-4 if careful else 1e-3, advance, states)
