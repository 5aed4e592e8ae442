"""Exudyn model of the slider-crank with a rod that bends: ANCF cables, a rigid crank of high inertia, a sliding mass.

The pin between crank and rod is the only constraint. The solvers are implicit: explicit ones do not take constraints.
"""

from __future__ import annotations

import itertools
import math
import time
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.interpolate import CubicHermiteSpline

from validation.exudyn_model import library

__all__ = ["CLEARANCE", "TIMES", "UNTIL", "Settings", "orbit", "vibration"]

CRANK, ROD, ROD_MASS, SLIDER_MASS, SPEED = 0.05, 0.3, 0.0942, 0.5, 10.0 * math.pi
BENDING, AXIAL = 11.2, 8.4e6
CLEARANCE, JOURNAL, STIFFNESS, RESTITUTION = 5e-4, 9.5e-3, 5e6, 0.9
LOSS = 0.75 * (1.0 - RESTITUTION**2)  # Lankarani and Nikravesh: F = K delta (1 + loss delta'/approach)

UNTIL = 0.015
TIMES = np.linspace(0.0, UNTIL, 1501)
KEPT = 1e10  # Mass and inertia of the crank [kg, kg m^2], which keep its position and its speed


@dataclass(frozen=True)
class Settings:
    """Settings of Exudyn's discretisation and integration.

    Parameters
    ----------
    elements : int
    reduced : int
        `useReducedOrderIntegration`: 0 is full quadrature, 1 and 2 fewer points of the axial strain.
    radius : float
        Spectral radius of the generalised alpha method; 1 is the trapezoidal rule.
    index2 : bool
        Constraints on the level of velocities, with Newmark's method.
    modified : bool
        Whether Newton's matrix is kept for several steps.
    newton : float
        Absolute tolerance of Newton's method [N]; the relative one is 1e-8.
    located : bool
        Whether steps are shortened where a contact begins or ends.
    """

    elements: int = 8
    reduced: int = 0
    radius: float = 0.9
    index2: bool = False
    modified: bool = True
    newton: float = 1e-5
    located: bool = False


def orbit(step: float, chosen: Settings, *, contact: bool = True) -> tuple[np.ndarray, float]:
    """Return the eccentricity of the journal at `TIMES` (samples, 2) [m], and processor seconds of the solver."""
    exu, items = library()
    mbs = exu.SystemContainer().AddSystem()
    crank = mbs.AddNode(items.NodeRigidBody2D(referenceCoordinates=[0.0, 0.0, 0.0], initialVelocities=[0.0, 0.0, SPEED]))
    body = mbs.AddObject(items.ObjectRigidBody2D(mass=KEPT, inertia=KEPT, nodeNumber=crank))
    tip = mbs.AddMarker(items.MarkerBodyPosition(bodyNumber=body, localPosition=[CRANK, 0.0, 0.0]))
    nodes = rod(mbs, chosen, start=CRANK, rate=lambda s: (CRANK * SPEED * (1.0 - s / ROD), -CRANK * SPEED / ROD))
    first, last = (mbs.AddMarker(items.MarkerNodePosition(nodeNumber=node)) for node in (nodes[0], nodes[-1]))
    mbs.AddObject(items.ObjectJointRevolute2D(markerNumbers=[tip, first]))
    place = mbs.AddNode(items.Node1D(referenceCoordinates=[CRANK + ROD]))
    slider = mbs.AddMarker(
        items.MarkerBodyRigid(bodyNumber=mbs.AddObject(items.ObjectMass1D(mass=SLIDER_MASS, nodeNumber=place)))
    )
    if contact:
        data = mbs.AddNode(items.NodeGenericData(initialCoordinates=[CLEARANCE, 0.0, 0.0, 0.0], numberOfDataCoordinates=4))
        mbs.AddObject(
            items.ObjectContactSphereSphere(
                markerNumbers=[last, slider],
                nodeNumber=data,
                spheresRadii=[JOURNAL, JOURNAL + CLEARANCE],
                isHollowSphere1=True,
                contactStiffness=STIFFNESS,
                contactStiffnessExponent=1.0,
                restitutionCoefficient=1.0 - LOSS / 1.5,
                minimumImpactVelocity=1e-6,
                impactModel=1,
            )
        )
    stored, seconds = solved(mbs, [last, slider], UNTIL, step, chosen)
    (t, a, va), (_, b, vb) = stored
    return CubicHermiteSpline(t, (a - b)[:, :2], (va - vb)[:, :2])(TIMES), seconds


def rod(mbs: Any, chosen: Settings, *, start: float, rate: Any) -> list[int]:
    """Add cables along x and return their nodes; `rate` gives velocity and angular velocity by distance from the first node."""
    _, items = library()
    nodes = []
    for k in range(chosen.elements + 1):
        s = ROD * k / chosen.elements
        across, turning = rate(s)
        nodes.append(
            mbs.AddNode(
                items.NodePoint2DSlope1(
                    referenceCoordinates=[start + s, 0.0, 1.0, 0.0], initialVelocities=[0.0, across, 0.0, turning]
                )
            )
        )
    for pair in itertools.pairwise(nodes):
        mbs.AddObject(
            items.ObjectANCFCable2D(
                length=ROD / chosen.elements,
                massPerLength=ROD_MASS / ROD,
                bendingStiffness=BENDING,
                axialStiffness=AXIAL,
                nodeNumbers=list(pair),
                useReducedOrderIntegration=chosen.reduced,
            )
        )
    return nodes


def solved(
    mbs: Any, markers: list[int], until: float, step: float, chosen: Settings
) -> tuple[list[tuple[np.ndarray, np.ndarray, np.ndarray]], float]:
    """Return times, positions and velocities of markers, and seconds."""
    exu, items = library()
    kinds = exu.OutputVariableType.Position, exu.OutputVariableType.Velocity
    sensors = [
        [mbs.AddSensor(items.SensorMarker(markerNumber=one, storeInternal=True, outputVariableType=kind)) for kind in kinds]
        for one in markers
    ]
    mbs.Assemble()
    settings = exu.SimulationSettings()
    integration = settings.timeIntegration
    integration.endTime, integration.numberOfSteps = until, round(until / step)
    integration.automaticStepSize = chosen.located
    integration.adaptiveStep = chosen.located
    integration.newton.relativeTolerance, integration.newton.absoluteTolerance = 1e-8, chosen.newton
    integration.newton.useModifiedNewton = chosen.modified
    integration.generalizedAlpha.spectralRadius = chosen.radius
    integration.generalizedAlpha.useIndex2Constraints = chosen.index2
    integration.generalizedAlpha.useNewmark = chosen.index2
    integration.generalizedAlpha.computeInitialAccelerations = True
    integration.verboseMode = 0
    settings.solution.file.write = False
    settings.solution.sensors.writePeriod = 0.0 if chosen.located else step
    began = time.process_time()
    mbs.SolveDynamic(settings, showHints=False, showCausingItems=False)
    seconds = time.process_time() - began
    found = []
    for pair in sensors:
        place, velocity = (mbs.GetSensorStoredData(one) for one in pair)
        kept = np.r_[True, np.diff(place[:, 0]) > 0.0]
        found.append((place[kept, 0], place[kept, 1:4], velocity[kept, 1:4]))
    return found, seconds


def vibration(step: float, chosen: Settings, periods: int = 3) -> float:
    """Return the relative error of the first mode of the rod on two pins: A sin(w t), w = (pi/L)^2 sqrt(EI/mu)."""
    exu, items = library()
    mbs = exu.SystemContainer().AddSystem()
    natural = (math.pi / ROD) ** 2 * math.sqrt(BENDING * ROD / ROD_MASS)
    amplitude = 1e-4 * ROD
    speed = amplitude * natural
    nodes = rod(
        mbs,
        chosen,
        start=0.0,
        rate=lambda s: (speed * math.sin(math.pi * s / ROD), speed * math.pi / ROD * math.cos(math.pi * s / ROD)),
    )
    for node, coordinates in ((nodes[0], (0, 1)), (nodes[-1], (1,))):
        for k in coordinates:
            marker = mbs.AddMarker(items.MarkerNodeCoordinate(nodeNumber=node, coordinate=k))
            ground = mbs.AddNode(items.NodePointGround())
            still = mbs.AddMarker(items.MarkerNodeCoordinate(nodeNumber=ground, coordinate=k))
            mbs.AddObject(items.ObjectConnectorCoordinate(markerNumbers=[still, marker]))
    middle = mbs.AddMarker(items.MarkerNodePosition(nodeNumber=nodes[chosen.elements // 2]))
    until = periods * 2.0 * math.pi / natural
    ((t, place, _),), _ = solved(mbs, [middle], until, until / round(until / step), chosen)
    return float(np.max(np.abs(place[:, 1] - amplitude * np.sin(natural * t)))) / amplitude
