"""Newton: bodies with revolute and prismatic joints, by its solver XPBD or Kamino; the hole is a ring of boxes."""

import math
import sys

import newton
import numpy as np
import warp as wp
from shared import boxes, read, run

wp.config.quiet = True
wp.set_device("cpu")
problem, setting = read()
careful, kamino = setting == "careful", "kamino" in sys.argv[3:]
builder = newton.ModelBuilder(up_axis=newton.Axis.Y, gravity=(*problem["gravity"], 0.0))
if kamino:
    newton.solvers.SolverKamino.register_custom_attributes(builder)
upright = wp.quat_identity()


def turned(angle):
    return wp.quat_from_axis_angle(wp.vec3(0.0, 0.0, 1.0), angle)


bodies = []
for given in problem["bodies"]:
    x, y, angle = given["pose"]
    inertia = wp.mat33(np.diag([0.6, 0.6, 1.0]) * (given["inertia"] or 1e-2))  # a slider does not rotate
    pose = wp.transform((x, y, 0.0), turned(angle))
    add = builder.add_body if "hole" in problem else builder.add_link
    bodies.append(add(xform=pose, mass=given["mass"], inertia=inertia, lock_inertia=True))
joints = []
for a, place, b, other in problem["pins"]:
    parent, child = ((a, place), (b, other)) if b >= 0 else ((b, other), (a, place))
    ends = {"parent_xform": wp.transform((*parent[1], 0.0), upright), "child_xform": wp.transform((*child[1], 0.0), upright)}
    pick = [bodies[parent[0]] if parent[0] >= 0 else -1, bodies[child[0]]]
    joints.append(builder.add_joint_revolute(*pick, **ends, axis=newton.Axis.Z))
for k, turn in problem["slides"]:
    start = wp.transform((*problem["bodies"][k]["pose"][:2], 0.0), upright)
    axis = (math.cos(turn), math.sin(turn), 0.0)
    joints.append(builder.add_joint_prismatic(-1, bodies[k], parent_xform=start, axis=axis))
if "hole" in problem:
    hole = problem["hole"]
    touch = newton.ModelBuilder.ShapeConfig(density=0.0, mu=0.0, restitution=hole["restitution"], margin=0.0, gap=1e-3)
    for place, turn, size in boxes(hole):
        builder.add_shape_box(bodies[0], xform=wp.transform(place, turned(turn)), hx=size[0], hy=size[1], hz=size[2], cfg=touch)
    builder.add_shape_sphere(-1, radius=hole["pin"], cfg=touch)
model = builder.finalize(skip_validation_joints=True)
step = 1e-3 if careful else (1 / 400 if kamino else 1 / 600)
if kamino:
    solver = newton.solvers.SolverKamino(model)
else:
    solver = newton.solvers.SolverXPBD(model, iterations=20 if careful else 2, enable_restitution="hole" in problem)
before, after, control = model.state(), model.state(), model.control()
rates = np.zeros((len(bodies), 6), np.float32)
rates[:, [0, 1, 5]] = [given["rate"] for given in problem["bodies"]]
before.body_qd.assign(rates)
contacts = model.contacts() if "hole" in problem else None


def advance(count, step):
    global before, after
    for _ in range(count):
        before.clear_forces()
        if contacts:
            model.collide(before, contacts)
        solver.step(before, after, control, contacts, step)
        before, after = after, before


def states():
    rows = []
    for pose, speed in zip(before.body_q.numpy(), before.body_qd.numpy(), strict=True):
        rows.append([*pose[:2], 2.0 * math.atan2(pose[5], pose[6]), *speed[:2], speed[5]])
    return [[float(value) for value in row] for row in rows]


run(problem, step, advance, states)
