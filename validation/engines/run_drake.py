"""Drake: a tree of revolute and prismatic joints with ball constraints for its loops; the hole is a ring of boxes."""

import math

import numpy as np
from pydrake.geometry import AddContactMaterial, Box, ProximityProperties, Sphere
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.multibody.plant import AddMultibodyPlant, CoulombFriction, MultibodyPlantConfig
from pydrake.multibody.tree import FixedOffsetFrame, PlanarJoint, PrismaticJoint, RevoluteJoint, SpatialInertia, UnitInertia
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from shared import boxes, read, run, start_of, tree

problem, setting = read()
careful = setting == "careful"
config = MultibodyPlantConfig()  # 1 ms
if careful:
    config.time_step = 1e-4 if problem["pins"] else 1e-5
    config.sap_near_rigid_threshold = 0.0
    config.discrete_contact_approximation = "sap"
builder = DiagramBuilder()
plant, _ = AddMultibodyPlant(config, builder)
plant.mutable_gravity_field().set_gravity_vector([*problem["gravity"], 0.0])
bodies = []
for k, given in enumerate(problem["bodies"]):
    moment = (given["inertia"] or 1e-6) / given["mass"]
    inertia = SpatialInertia(given["mass"], np.zeros(3), UnitInertia(0.6 * moment, 0.6 * moment, moment))
    bodies.append(plant.AddRigidBody(f"body {k}", inertia))
ground = plant.world_body()
pick = [*bodies, ground]


def frame(name, k, place):
    return plant.AddFrame(FixedOffsetFrame(name, pick[k].body_frame(), RigidTransform([*place, 0.0])))


chain, loops = tree(problem)
directions, joints = dict(problem["slides"]), []
for k, parent, mine, other in chain:
    ends = frame(f"before {k}", parent, other), frame(f"on {k}", k, mine)
    if k in directions:
        joint = PrismaticJoint(f"joint {k}", *ends, [math.cos(directions[k]), math.sin(directions[k]), 0.0])
    else:
        joint = RevoluteJoint(f"joint {k}", *ends, [0.0, 0.0, 1.0])
    joints.append((plant.AddJoint(joint), start_of(problem, k, parent)))
for a, place, b, other in loops:
    plant.AddBallConstraint(pick[a], [*place, 0.0], pick[b], [*other, 0.0])
if "hole" in problem:
    free = plant.AddJoint(PlanarJoint("free", ground.body_frame(), bodies[0].body_frame()))
    material = ProximityProperties()
    AddContactMaterial(friction=CoulombFriction(0.0, 0.0), properties=material)
    for n, (place, turn, size) in enumerate(boxes(problem["hole"])):
        pose = RigidTransform(RollPitchYaw(0.0, 0.0, turn), place)
        plant.RegisterCollisionGeometry(bodies[0], pose, Box(*(2.0 * value for value in size)), f"box {n}", material)
    plant.RegisterCollisionGeometry(ground, RigidTransform(), Sphere(problem["hole"]["pin"]), "pin", material)
plant.Finalize()
diagram = builder.Build()
simulator = Simulator(diagram)
context = plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())
for joint, (angle, rate) in joints:
    if isinstance(joint, RevoluteJoint):
        joint.set_angle(context, angle)
        joint.set_angular_rate(context, rate)
if "hole" in problem:
    free.set_pose(context, problem["bodies"][0]["pose"][:2], problem["bodies"][0]["pose"][2])
simulator.Initialize()
done = 0


def advance(count, step):
    global done
    done += count
    simulator.AdvanceTo((done - 0.5) * step)  # between two updates: round-off does not add one


def states():
    rows = []
    for body in bodies:
        pose, speed = plant.EvalBodyPoseInWorld(context, body), plant.EvalBodySpatialVelocityInWorld(context, body)
        (x, y), turn = pose.translation()[:2], pose.rotation().matrix()
        rows.append([x, y, math.atan2(turn[1, 0], turn[0, 0]), *speed.translational()[:2], speed.rotational()[2]])
    return rows


run(problem, config.time_step, advance, states)
