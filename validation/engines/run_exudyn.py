"""Exudyn: rigid bodies in x, y and angle with revolute and prismatic joints."""

import json
import math
import sys
import time

import exudyn as exu
import numpy as np
from exudyn import itemInterface
from shared import read

problem, setting = read()
if "hole" in problem:
    sys.exit("the objects used here have no contact of a circle inside a circle")
careful = setting == "careful"
system = exu.SystemContainer()
mbs = system.AddSystem()
bodies = []
for given in problem["bodies"]:
    node = mbs.AddNode(itemInterface.NodeRigidBody2D(referenceCoordinates=given["pose"], initialVelocities=given["rate"]))
    body = itemInterface.ObjectRigidBody2D(physicsMass=given["mass"], physicsInertia=given["inertia"] or 1.0, nodeNumber=node)
    bodies.append(mbs.AddObject(body))
    mass = mbs.AddMarker(itemInterface.MarkerBodyPosition(bodyNumber=bodies[-1]))
    weight = [given["mass"] * g for g in problem["gravity"]]
    mbs.AddLoad(itemInterface.LoadForceVector(markerNumber=mass, loadVector=[*weight, 0]))
pick = [*bodies, mbs.AddObject(itemInterface.ObjectGround())]


def marker(k, place):
    return mbs.AddMarker(itemInterface.MarkerBodyRigid(bodyNumber=pick[k], localPosition=[*place, 0]))


for a, place, b, other in problem["pins"]:
    mbs.AddObject(itemInterface.ObjectJointRevolute2D(markerNumbers=[marker(a, place), marker(b, other)]))
for k, turn in problem["slides"]:
    ends = [marker(-1, problem["bodies"][k]["pose"][:2]), marker(k, [0, 0])]
    along, across = [math.cos(turn), math.sin(turn), 0], [-math.sin(turn), math.cos(turn), 0]
    mbs.AddObject(itemInterface.ObjectJointPrismatic2D(markerNumbers=ends, axisMarker0=along, normalMarker1=across))
kinds = [getattr(exu.OutputVariableType, name) for name in ("Position", "Rotation", "Velocity", "AngularVelocity")]
sensors = [
    mbs.AddSensor(itemInterface.SensorBody(bodyNumber=body, storeInternal=True, outputVariableType=kind))
    for body in bodies
    for kind in kinds
]
mbs.Assemble()
settings, samples = exu.SimulationSettings(), len(problem["reference"])
settings.timeIntegration.endTime = problem["until"]
settings.timeIntegration.numberOfSteps = round(problem["until"] / 1e-4) if careful else 100
settings.solutionSettings.writeSolutionToFile = False
settings.solutionSettings.sensorsWritePeriod = problem["until"] / (samples - 1)
if careful:
    settings.timeIntegration.newton.relativeTolerance = 1e-10
began = time.perf_counter()
mbs.SolveDynamic(settings)
seconds = time.perf_counter() - began
tables = [mbs.GetSensorStoredData(sensor) for sensor in sensors]
states = []
for at in np.linspace(0.0, problem["until"], samples):
    k = int(np.argmin(abs(tables[0][:, 0] - at)))
    rows = [[table[k] for table in tables[first : first + 4]] for first in range(0, len(tables), 4)]
    starts = [given["pose"][2] for given in problem["bodies"]]  # the angles are relative to these
    states.append([[*p[1:3], start + a[-1], *v[1:3], w[-1]] for start, (p, a, v, w) in zip(starts, rows, strict=True)])
print("\n" + json.dumps({"states": states, "seconds": seconds}))
