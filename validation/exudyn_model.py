"""Exudyn model of a mechanism with ideal joints: rigid bodies in x, y and angle, joints as constraints."""

from __future__ import annotations

import importlib
import sys
import time
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

import scissordyn as sd

__all__ = ["Settings", "library", "limit", "positions"]


def library() -> tuple[Any, Any]:
    """Return Exudyn and its items; its variant without range checks is loaded, which needs AVX2."""
    sys.exudynFast = True  # type: ignore[attr-defined]  # Exudyn reads this on its first import
    return importlib.import_module("exudyn"), importlib.import_module("exudyn.itemInterface")


@dataclass(frozen=True)
class Settings:
    """Settings of Exudyn's integration.

    Parameters
    ----------
    step : float
        Fixed step of the implicit solvers [s].
    newton : float
        Relative tolerance of Newton's method.
    radius : float
        Spectral radius of the generalised alpha method at infinity; 1 is the trapezoidal rule of index 2.
    index2 : bool
        Whether constraints are solved on the level of velocities.
    """

    step: float
    newton: float = 1e-9
    radius: float = 0.9
    index2: bool = False


def positions(mechanism: sd.Mechanism, until: float, settings: Settings, body: str) -> tuple[np.ndarray, np.ndarray, float]:
    """Return times, mass centre and angle of a body (samples, 3), and seconds of the solver.

    Ground pins, pins, constant torques, linear springs and massless rods from the ground to a mass are translated.
    """
    system, sensor = _translated(mechanism, body)
    simulation = _simulation(until, settings, sparse=len(mechanism.bodies) > 20)
    began = time.perf_counter()
    system.SolveDynamic(simulation, showHints=False, showCausingItems=False)
    seconds = time.perf_counter() - began
    stored = system.GetSensorStoredData(sensor)
    one = mechanism.body(body)
    return (
        stored[:, 0],
        stored[:, 1:4] + np.array([*(one.placed_position + _rotation(one) @ one.centre), one.placed_angle]),
        seconds,
    )


def limit(mechanism: sd.Mechanism, until: float, settings: Settings, body: str) -> np.ndarray:
    """Return position and angle of a body at the end, extrapolated to short steps: the error of a wrong model remains.

    Richardson's extrapolation of order 2, the order of both solvers, uses the step of the settings and half of it.
    """
    coarse, fine = (
        positions(mechanism, until, replace(settings, step=step), body)[1][-1] for step in (settings.step, 0.5 * settings.step)
    )
    return fine + (fine - coarse) / 3.0


def _rotation(body: sd.Body) -> np.ndarray:
    """Return the rotation from the body's axes to the global axes at the start."""
    cosine, sine = np.cos(body.placed_angle), np.sin(body.placed_angle)
    return np.array([[cosine, -sine], [sine, cosine]])


def _translated(mechanism: sd.Mechanism, body: str) -> tuple[Any, Any]:
    """Return the mechanism as a system of Exudyn, and the sensor of a body's coordinates."""
    exu, items = library()

    system = exu.SystemContainer().AddSystem()
    ground = system.AddObject(items.ObjectGround())
    pull = mechanism.gravity * np.array([np.cos(mechanism.gravity_direction), np.sin(mechanism.gravity_direction), 0.0])
    nodes, objects = {}, {}
    for one in mechanism.bodies:
        arm = _rotation(one) @ one.centre
        turning = one.angular_velocity or 0.0
        speed = np.array(one.velocity or (0.0, 0.0)) + turning * np.array([-arm[1], arm[0]])
        nodes[one.name] = system.AddNode(
            items.NodeRigidBody2D(
                referenceCoordinates=[*(one.placed_position + arm), one.placed_angle], initialVelocities=[*speed, turning]
            )
        )
        objects[one.name] = system.AddObject(
            items.ObjectRigidBody2D(mass=one.mass, inertia=one.inertia or one.mass, nodeNumber=nodes[one.name])
        )
        marker = system.AddMarker(items.MarkerBodyPosition(bodyNumber=objects[one.name]))
        system.AddLoad(items.Force(markerNumber=marker, loadVector=one.mass * pull))

    def at(reference: tuple[str, str]) -> int:
        name, point = reference
        if name == "ground":
            number, place = ground, np.array(dict(mechanism.ground)[point])
        else:
            one = mechanism.body(name)
            number, place = objects[name], np.array(one.points[point]) - np.array(one.centre)
        return system.AddMarker(items.MarkerBodyPosition(bodyNumber=number, localPosition=[*place, 0.0]))

    for joint in mechanism.joints:
        system.AddObject(items.ObjectJointRevolute2D(markerNumbers=[at(joint.bearing), at(joint.journal)]))
    for rod in mechanism.rods:
        start, end = np.array(mechanism.place(rod.start)), np.array(mechanism.place(rod.end))
        length = rod.length or float(np.hypot(*(end - start)))
        system.AddObject(items.ObjectConnectorDistance(markerNumbers=[at(rod.start), at(rod.end)], distance=length))
    for part in mechanism.components:
        if isinstance(part, sd.Spring):
            system.AddObject(
                items.ObjectConnectorSpringDamper(
                    markerNumbers=[at(part.start), at(part.end)], referenceLength=part.free_length, stiffness=part.stiffness
                )
            )
        elif isinstance(part, sd.Torque):
            marker = system.AddMarker(items.MarkerBodyRigid(bodyNumber=objects[part.body]))
            system.AddLoad(items.Torque(markerNumber=marker, loadVector=[0.0, 0.0, part.torque]))
        else:
            raise NotImplementedError(type(part).__name__)
    sensor = system.AddSensor(
        items.SensorNode(nodeNumber=nodes[body], storeInternal=True, outputVariableType=exu.OutputVariableType.Coordinates)
    )
    system.Assemble()
    return system, sensor


def _simulation(until: float, settings: Settings, *, sparse: bool) -> Any:
    """Return Exudyn's settings of an integration."""
    exu, _ = library()
    simulation = exu.SimulationSettings()
    integration = simulation.timeIntegration
    integration.endTime, integration.numberOfSteps = until, round(until / settings.step)
    integration.automaticStepSize = False  # at singular positions it repeats steps endlessly
    integration.newton.relativeTolerance = settings.newton
    integration.newton.absoluteTolerance = 1e-12
    integration.newton.useModifiedNewton = True
    integration.newton.modifiedNewtonJacUpdatePerStep = True  # saves a fifth to a half of the time at the same error
    integration.generalizedAlpha.spectralRadius = settings.radius
    integration.generalizedAlpha.useIndex2Constraints = settings.index2
    integration.generalizedAlpha.useNewmark = settings.index2
    integration.generalizedAlpha.computeInitialAccelerations = True
    integration.verboseMode = 0
    simulation.linearSolver.ignoreSingularJacobian = True
    if sparse:
        simulation.linearSolver.solverType = exu.LinearSolverType.EigenSparse
    simulation.solution.file.write = False
    simulation.solution.sensors.writePeriod = max(settings.step, until / 2000)
    return simulation
