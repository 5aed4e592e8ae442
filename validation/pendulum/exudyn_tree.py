"""Exudyn model of the simple pendulum in one coordinate: a kinematic tree of one link, an explicit solver."""

from __future__ import annotations

import math
import time

import numpy as np

from validation.exudyn_model import library

__all__ = ["pendulum"]


def pendulum(tolerance: float, until: float) -> tuple[np.ndarray, np.ndarray, float]:
    """Return times of all steps, angles from the x axis, and seconds of the solver.

    Parameters
    ----------
    tolerance : float
        Relative tolerance, and absolute tolerance in radians and radians per second.
    until : float
        End [s].
    """
    exu, items = library()

    mbs = exu.SystemContainer().AddSystem()
    angle = mbs.AddNode(
        items.NodeGenericODE2(
            referenceCoordinates=[0.0], initialCoordinates=[math.pi], initialCoordinates_t=[0.0], numberOfODE2Coordinates=1
        )
    )
    offsets, centres = exu.Vector3DList(), exu.Vector3DList()
    inertias, rotations = exu.Matrix3DList(), exu.Matrix3DList()
    offsets.Append([0.0, 0.0, 0.0])
    centres.Append([1.0, 0.0, 0.0])
    inertias.Append(np.zeros((3, 3)))
    rotations.Append(np.eye(3))
    mbs.AddObject(
        items.ObjectKinematicTree(
            nodeNumber=angle,
            jointTypes=[exu.JointType.RevoluteZ],
            linkParents=[-1],
            jointTransformations=rotations,
            jointOffsets=offsets,
            linkInertiasCOM=inertias,
            linkCOMs=centres,
            linkMasses=[1.0],
            gravity=[0.0, -9.81, 0.0],
        )
    )
    sensor = mbs.AddSensor(
        items.SensorNode(nodeNumber=angle, storeInternal=True, outputVariableType=exu.OutputVariableType.Coordinates)
    )
    mbs.Assemble()
    settings = exu.SimulationSettings()
    integration = settings.timeIntegration
    integration.endTime, integration.numberOfSteps = until, 10
    integration.absoluteTolerance = integration.relativeTolerance = tolerance
    integration.minimumStepSize = 1e-12
    integration.initialStepSize = 1e-3
    integration.explicit.computeEndOfStepAccelerations = False
    settings.solution.file.write = False
    settings.solution.sensors.writePeriod = 0.0
    began = time.perf_counter()
    mbs.SolveDynamic(settings, solverType=exu.DynamicSolverType.DOPRI5, showHints=False, showCausingItems=False)
    seconds = time.perf_counter() - began
    stored = mbs.GetSensorStoredData(sensor)
    return stored[:, 0], stored[:, 1], seconds
