"""Exudyn model of the slider-crank: a kinematic tree and a mass in minimal coordinates, without constraints, and a contact.

The solver is explicit. The model has no constraints: with the slider as a rigid body of three coordinates, two of them
constrained, the same solver has an error of 12 % of the clearance after one revolution at every tolerance down to 1e-10
(`tests/validation/test_peers.py` has that model).
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.interpolate import CubicHermiteSpline

from validation.exudyn_model import library
from validation.slider_crank.codes import Found
from validation.slider_crank.equations import (
    CLEARANCE,
    CRANK,
    JOURNAL,
    LOSS,
    ROD,
    ROD_INERTIA,
    ROD_MASS,
    SLIDER_MASS,
    SPEED,
    STIFFNESS,
    TIMES,
    UNTIL,
)

__all__ = ["Settings", "contact_free", "exudyns", "sliding_mass"]


@dataclass(frozen=True)
class Settings:
    """Settings of Exudyn's integration with DOPRI5.

    Parameters
    ----------
    longest : float
        Longest step [s].
    force_error : float
        Error of a contact force beyond which a step is shortened to end where the contact begins [N];
        `discontinuous.iterationTolerance`.
    increase : float
        Largest ratio of a step to the one before; `stepSizeMaxIncrease`, Exudyn's default is 2.
    scale : float
        Ratio of absolute to relative tolerance [m].
    """

    longest: float = 1e-4
    force_error: float = 10.0
    increase: float = 5.0
    scale: float = CLEARANCE


def exudyns(tolerance: float, settings: Settings, slider: Callable[[Any], int] | None = None) -> Found:
    """Run one revolution; positions and velocities of all steps are stored and interpolated with cubics.

    Parameters
    ----------
    tolerance : float
        Relative tolerance.
    settings : Settings
    slider : callable, optional
        Function that adds another slider to the system and returns the marker of its pin.
    """
    mbs = library()[0].SystemContainer().AddSystem()
    journal, bearing = _links(mbs), (slider or sliding_mass)(mbs)
    _pin(mbs, journal, bearing)
    return _solved(mbs, (journal, bearing), tolerance, settings)


def contact_free(tolerance: float) -> np.ndarray:
    """Return the orbit of the journal without the pin; steps are short, as they are interpolated."""
    mbs = library()[0].SystemContainer().AddSystem()
    return _solved(mbs, (_links(mbs), sliding_mass(mbs)), tolerance, Settings(longest=6e-6))[1]


def sliding_mass(mbs: Any) -> int:
    """Add the slider as a mass with one coordinate, and return its marker."""
    _, items = library()
    place = mbs.AddNode(items.Node1D(referenceCoordinates=[CRANK + ROD]))
    slider = mbs.AddObject(items.ObjectMass1D(mass=SLIDER_MASS, nodeNumber=place))
    return int(mbs.AddMarker(items.MarkerBodyRigid(bodyNumber=slider)))


def _solved(mbs: Any, markers: tuple[int, int], tolerance: float, chosen: Settings) -> Found:
    """Integrate with step control."""
    exu, items = library()
    kinds = exu.OutputVariableType.Position, exu.OutputVariableType.Velocity
    sensors = [
        mbs.AddSensor(items.SensorMarker(markerNumber=marker, storeInternal=True, outputVariableType=kind))
        for kind in kinds
        for marker in markers
    ]
    mbs.Assemble()
    settings = exu.SimulationSettings()
    integration = settings.timeIntegration
    integration.endTime, integration.numberOfSteps = UNTIL, math.ceil(UNTIL / chosen.longest)
    integration.absoluteTolerance, integration.relativeTolerance = tolerance * chosen.scale, tolerance
    integration.minimumStepSize = 1e-14
    integration.initialStepSize = 1e-7
    integration.stepSizeMaxIncrease = chosen.increase
    integration.explicit.computeEndOfStepAccelerations = False
    integration.discontinuous.iterationTolerance = chosen.force_error
    settings.solution.file.write = False
    settings.solution.sensors.writePeriod = 0.0
    began = time.perf_counter()
    mbs.SolveDynamic(settings, solverType=exu.DynamicSolverType.DOPRI5, showHints=False, showCausingItems=False)
    seconds = time.perf_counter() - began
    first, second, first_rate, second_rate = (mbs.GetSensorStoredData(sensor) for sensor in sensors)
    kept = np.r_[True, np.diff(first[:, 0]) > 0.0]
    path = CubicHermiteSpline(first[kept, 0], (first - second)[kept, 1:3], (first_rate - second_rate)[kept, 1:3])
    return seconds, path(TIMES)


def _links(mbs: Any) -> int:
    """Add crank and rod and return the marker of the journal; an inertia of 1e10 kg m^2 keeps the crank's speed."""
    exu, items = library()
    mbs.AddObject(items.ObjectGround())
    tree = mbs.AddNode(
        items.NodeGenericODE2(
            referenceCoordinates=[0.0, 0.0],
            initialCoordinates=[0.0, 0.0],
            initialCoordinates_t=[SPEED, -CRANK * SPEED / ROD - SPEED],
            numberOfODE2Coordinates=2,
        )
    )
    offsets, centres = exu.Vector3DList(), exu.Vector3DList()
    inertias, rotations = exu.Matrix3DList(), exu.Matrix3DList()
    for offset, centre, inertia in ((0.0, 0.0, 1e10), (CRANK, 0.5 * ROD, ROD_INERTIA)):
        offsets.Append([offset, 0.0, 0.0])
        centres.Append([centre, 0.0, 0.0])
        inertias.Append(np.diag([1.0, 1.0, inertia]))
        rotations.Append(np.eye(3))
    links = mbs.AddObject(
        items.ObjectKinematicTree(
            nodeNumber=tree,
            jointTypes=[exu.JointType.RevoluteZ, exu.JointType.RevoluteZ],
            linkParents=[-1, 0],
            jointTransformations=rotations,
            jointOffsets=offsets,
            linkInertiasCOM=inertias,
            linkCOMs=centres,
            linkMasses=[1.0, ROD_MASS],
            gravity=[0.0, 0.0, 0.0],
        )
    )
    return int(mbs.AddMarker(items.MarkerKinematicTreeRigid(objectNumber=links, linkNumber=1, localPosition=[ROD, 0.0, 0.0])))


def _pin(mbs: Any, journal: int, bearing: int) -> None:
    """Add the clearance joint, a sphere in a hollow sphere.

    Hunt and Crossley's 3/2 (1 - e) equals Lankarani and Nikravesh's 3/4 (1 - e^2) at another e.
    """
    _, items = library()
    data = mbs.AddNode(items.NodeGenericData(initialCoordinates=[CLEARANCE, 0.0, 0.0, 0.0], numberOfDataCoordinates=4))
    mbs.AddObject(
        items.ObjectContactSphereSphere(
            markerNumbers=[journal, bearing],
            nodeNumber=data,
            spheresRadii=[JOURNAL, JOURNAL + CLEARANCE],
            isHollowSphere1=True,
            contactStiffness=STIFFNESS,
            contactStiffnessExponent=1.5,
            restitutionCoefficient=1.0 - LOSS / 1.5,
            minimumImpactVelocity=1e-6,
            impactModel=1,
        )
    )
