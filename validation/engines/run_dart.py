"""DART: a tree of revolute and prismatic joints with ball joint constraints for its loops; the hole is a ring of boxes."""

import math

import dartpy as dart
import numpy as np
from shared import boxes, read, run, start_of, tree

problem, setting = read()
careful = setting == "careful"
world = dart.simulation.World()
world.setGravity([*problem["gravity"], 0.0])
skeleton = dart.dynamics.Skeleton()
chain, loops = tree(problem)
directions, bodies, starts = dict(problem["slides"]), {-1: None}, []


def shift(place):
    pose = dart.math.Isometry3()
    pose.set_translation([*place, 0.0])
    return pose


for k, parent, mine, other in chain or [(0, -1, [0.0, 0.0], [0.0, 0.0])]:
    if "hole" in problem:
        joint, body = skeleton.createPlanarJointAndBodyNodePair()
        starts += list(zip(*(problem["bodies"][0][key] for key in ("pose", "rate")), strict=True))
    elif k in directions:
        joint, body = skeleton.createPrismaticJointAndBodyNodePair(bodies[parent])
        joint.setAxis([math.cos(directions[k]), math.sin(directions[k]), 0.0])
        starts.append((0.0, 0.0))
    else:
        joint, body = skeleton.createRevoluteJointAndBodyNodePair(bodies[parent])
        joint.setAxis([0.0, 0.0, 1.0])
        starts.append(start_of(problem, k, parent))
    joint.setTransformFromParentBodyNode(shift(other))
    joint.setTransformFromChildBodyNode(shift(mine))
    bodies[k] = body
    given = problem["bodies"][k]
    moment = given["inertia"] or 1e-6
    body.setInertia(dart.dynamics.Inertia(given["mass"], np.zeros(3), np.diag([0.6, 0.6, 1.0]) * moment))
skeleton.setPositions([place for place, _ in starts])
skeleton.setVelocities([rate for _, rate in starts])
world.addSkeleton(skeleton)
solver = world.getConstraintSolver()
for a, place, b, other in loops:
    ends = (bodies[a], place, bodies[b]) if a >= 0 else (bodies[b], other, None)
    at = ends[0].getTransform().multiply([*ends[1], 0.0])
    closure = dart.constraint.BallJointConstraint(*[end for end in (ends[0], ends[2]) if end], at)
    if careful:
        closure.setErrorReductionParameter(0.2)  # of a step; default: 0.01
    solver.addConstraint(closure)
if "hole" in problem:
    pin = dart.dynamics.Skeleton()
    _, fixed = pin.createWeldJointAndBodyNodePair()
    pieces = [(fixed, dart.dynamics.SphereShape(problem["hole"]["pin"]), dart.math.Isometry3())]
    for place, turn, size in boxes(problem["hole"]):
        pose = dart.math.Isometry3()
        pose.set_translation(place)
        pose.set_rotation([[math.cos(turn), -math.sin(turn), 0.0], [math.sin(turn), math.cos(turn), 0.0], [0.0, 0.0, 1.0]])
        pieces.append((bodies[0], dart.dynamics.BoxShape([2.0 * value for value in size]), pose))
    for body, shape, pose in pieces:
        node = body.createShapeNode(shape)
        node.createCollisionAspect()
        touch = node.createDynamicsAspect()
        touch.setFrictionCoeff(0.0)
        touch.setRestitutionCoeff(problem["hole"]["restitution"] ** 0.5)  # the engine multiplies both
        node.setRelativeTransform(pose)
    world.addSkeleton(pin)


def advance(count, step):
    world.setTimeStep(step)
    for _ in range(count):
        world.step()


def states():
    rows = []
    for k in range(len(problem["bodies"])):
        pose, speed, spin = bodies[k].getTransform(), bodies[k].getLinearVelocity(), bodies[k].getAngularVelocity()
        turn = pose.rotation()
        rows.append([*pose.translation()[:2], math.atan2(turn[1, 0], turn[0, 0]), *speed[:2], spin[2]])
    return rows


run(problem, 1e-4 if careful else world.getTimeStep(), advance, states)
