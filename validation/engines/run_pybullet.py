"""PyBullet: each body slides in x and y and turns; pins are point-to-point constraints between bodies."""

import math
import sys

import pybullet as pb
from shared import read, run

problem, setting = read()
if "hole" in problem:
    sys.exit("a hole needs a mesh that is split into convex parts")
careful = setting == "careful"
pb.connect(pb.DIRECT)
pb.setGravity(*problem["gravity"], 0)
step = 1e-4 if careful else 1 / 240
pb.setTimeStep(step)
if careful:
    pb.setPhysicsEngineParameter(numSolverIterations=500, erp=1.0, solverResidualThreshold=0.0)


def planar(given):
    """Return a body on massless links that slide along x and y and turn about z."""
    kinds, axes = [pb.JOINT_PRISMATIC, pb.JOINT_PRISMATIC, pb.JOINT_REVOLUTE], [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
    zero, turn = [[0, 0, 0]] * 3, [[0, 0, 0, 1]] * 3
    body = pb.createMultiBody(
        0,
        linkMasses=[0, 0, given["mass"]],
        linkCollisionShapeIndices=[-1] * 3,
        linkVisualShapeIndices=[-1] * 3,
        linkPositions=zero,
        linkOrientations=turn,
        linkInertialFramePositions=zero,
        linkInertialFrameOrientations=turn,
        linkParentIndices=[0, 1, 2],
        linkJointTypes=kinds,
        linkJointAxis=axes,
    )
    inertia = given["inertia"] or 1.0
    pb.changeDynamics(body, 2, localInertiaDiagonal=[inertia] * 3)
    for k in range(3):
        pb.changeDynamics(body, k, linearDamping=0, angularDamping=0, jointDamping=0, maxJointVelocity=1e3)
        pb.resetJointState(body, k, given["pose"][k], given["rate"][k])
        pb.setJointMotorControl2(body, k, pb.VELOCITY_CONTROL, force=0)
    return body


bodies = [planar(given) for given in problem["bodies"]]
for a, place, b, other in problem["pins"]:
    ends = sorted([(a, place), (b, other)], reverse=True)  # the ground is the second body
    (first, here), (second, there) = ends
    target = (bodies[second], 2) if second >= 0 else (-1, -1)
    joint = pb.createConstraint(bodies[first], 2, *target, pb.JOINT_POINT2POINT, [0, 0, 0], [*here, 0], [*there, 0])
    pb.changeConstraint(joint, maxForce=1e7)
for k, turn in problem["slides"]:
    held = 1 if abs(math.sin(turn)) < 0.5 else 0  # along x or y: the other coordinate and the angle are held
    for coordinate in (held, 2):
        at = problem["bodies"][k]["pose"][coordinate]
        pb.setJointMotorControl2(bodies[k], coordinate, pb.POSITION_CONTROL, at, 0, force=1e6, positionGain=1.0)


def advance(count, step):
    pb.setTimeStep(step)
    for _ in range(count):
        pb.stepSimulation()


def states():
    pairs = [[pb.getJointState(body, k)[:2] for k in range(3)] for body in bodies]
    return [[value for value, _ in pair] + [rate for _, rate in pair] for pair in pairs]


run(problem, step, advance, states)
