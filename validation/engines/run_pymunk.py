"""Pymunk: rigid bodies and pivot joints; the hole is a ring of segments."""

from math import cos, sin

import pymunk
from shared import read, ring, run

problem, setting = read()
careful = setting == "careful"
space = pymunk.Space()
space.gravity = tuple(problem["gravity"])
if careful:
    space.iterations, space.collision_slop = 50, 1e-6
bodies = []
for given in problem["bodies"]:
    body = pymunk.Body(given["mass"], given["inertia"] or float("inf"))
    body.position, body.angle = tuple(given["pose"][:2]), given["pose"][2]
    body.velocity, body.angular_velocity = tuple(given["rate"][:2]), given["rate"][2]
    space.add(body)
    bodies.append(body)
pick = [*bodies, space.static_body]  # index -1 is the ground
for a, place, b, other in problem["pins"]:
    space.add(pymunk.PivotJoint(pick[a], pick[b], tuple(place), tuple(other)))
for k, turn in problem["slides"]:
    x, y = problem["bodies"][k]["pose"][:2]
    ends = (x - 50 * cos(turn), y - 50 * sin(turn)), (x + 50 * cos(turn), y + 50 * sin(turn))
    space.add(pymunk.GrooveJoint(space.static_body, bodies[k], *ends, (0, 0)))
for joint in space.constraints:
    joint.collide_bodies = False
if "hole" in problem:
    hole = problem["hole"]
    corners = ring(hole)
    shapes = [pymunk.Segment(bodies[0], a, b, 0.0) for a, b in zip(corners, corners[1:] + corners[:1], strict=True)]
    shapes.append(pymunk.Circle(space.static_body, hole["pin"]))
    for shape in shapes:
        shape.elasticity = hole["restitution"] ** 0.5  # the engine multiplies both
    space.add(*shapes)


def advance(count, step):
    for _ in range(count):
        space.step(step)


run(
    problem,
    1e-4 if careful else 1 / 60,
    advance,
    lambda: [[*b.position, b.angle, *b.velocity, b.angular_velocity] for b in bodies],
)
