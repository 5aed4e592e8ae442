"""Box2D (Python): rigid bodies, revolute and prismatic joints; the hole is a loop of edges."""

from math import cos, sin

import Box2D
from shared import read, ring, run

problem, setting = read()
careful = setting == "careful"
world = Box2D.b2World(gravity=tuple(problem["gravity"]))
bodies = []
for given in problem["bodies"]:
    body = world.CreateDynamicBody(position=tuple(given["pose"][:2]), angle=given["pose"][2], allowSleep=False, bullet=careful)
    body.CreateCircleFixture(radius=0.01, density=1.0, filter=Box2D.b2Filter(maskBits=0))
    body.massData = Box2D.b2MassData(mass=given["mass"], center=(0, 0), I=given["inertia"] or 1.0)
    body.linearVelocity, body.angularVelocity = tuple(given["rate"][:2]), given["rate"][2]
    bodies.append(body)
ground = world.CreateStaticBody()
pick = [*bodies, ground]
for a, place, b, other in problem["pins"]:
    world.CreateJoint(
        Box2D.b2RevoluteJointDef(
            bodyA=pick[a],
            bodyB=pick[b],
            localAnchorA=tuple(place),
            localAnchorB=tuple(other),
            collideConnected=False,
            referenceAngle=pick[b].angle - pick[a].angle,
        )
    )
for k, turn in problem["slides"]:
    x, y, angle = problem["bodies"][k]["pose"]
    world.CreatePrismaticJoint(bodyA=ground, bodyB=bodies[k], anchor=(x, y), axis=(cos(turn), sin(turn)))
if "hole" in problem:
    hole = problem["hole"]
    chain = Box2D.b2LoopShape(vertices=ring(hole))
    bodies[0].CreateFixture(shape=chain, density=0.0, friction=0.0, restitution=hole["restitution"])
    bodies[0].massData = Box2D.b2MassData(mass=1.0, center=(0, 0), I=1 / 12)
    ground.CreateCircleFixture(radius=hole["pin"], friction=0.0, restitution=hole["restitution"])


def advance(count, step):
    for _ in range(count):
        world.Step(step, *((200, 50) if careful else (8, 3)))


run(
    problem,
    1e-4 if careful else 1 / 60,
    advance,
    lambda: [[*b.position, b.angle, *b.linearVelocity, b.angularVelocity] for b in bodies],
)
