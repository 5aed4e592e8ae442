"""Continuous contact as a constraint, and the drive torque that it requires (inverse dynamics)."""

from __future__ import annotations

import dataclasses
import math

import numpy as np

from scissordyn.component.rod import Rod
from scissordyn.errors import InputError
from scissordyn.model.mechanism import Mechanism
from scissordyn.plan.plan import plan
from scissordyn.run.start.reaction import ideal_reactions
from scissordyn.units import checked


@checked
def constrain_contact(mechanism: Mechanism, *, indentation: float = 0.0, direction: float | None = None) -> Mechanism:
    """The mechanism with its clearance joints constrained to contact, at a constant eccentricity e = c + indentation.

    Each clearance joint becomes a rod of that length from the bearing centre to the journal centre, so that e' and e'' are
    zero. In a run with a prescribed drive, `drive_torque` is the torque that this motion requires, and the tension `rod_force`
    of the joint's rod is the normal force N. The constraint is bilateral and the contact unilateral: a run has a warning when N
    is negative.

    Parameters
    ----------
    mechanism : Mechanism
        With clearance joints.
    indentation : float
        delta [m], the same at every joint.
    direction : float, optional
        Direction of the contact normal at t = 0 [rad]; that of the ideal reaction if not given.

    Returns
    -------
    Mechanism

    Raises
    ------
    InputError
        If no joint has clearance, or if no direction is given and the ideal reactions are not determined.

    References
    ----------
    Yaqubi, Dardel, Daniali and Ghasemi 2016, doi:10.1007/s11044-015-9486-3
    """
    if not mechanism.clearance_joints:
        raise InputError(
            "constrain_contact() on a mechanism without clearance joints",
            "a mechanism with clearance joints",
            "mechanism.with_clearance(JOINT, CLEARANCE)",
        )
    angles = {joint.name: direction for joint in mechanism.clearance_joints}
    if direction is None:
        for joint, force in zip(mechanism.joints, ideal_reactions(plan(mechanism)), strict=True):
            if joint.clearance is None:
                continue
            if not np.all(np.isfinite(force)) or not np.any(force):
                raise InputError(f"the ideal reaction of joint '{joint.name}' has no direction at the start", "direction=ANGLE")
            angles[joint.name] = math.atan2(-float(force[1]), -float(force[0]))
    rods = tuple(
        Rod(
            joint.name,
            start=joint.bearing,
            end=joint.journal,
            length=joint.clearance.clearance + indentation,
            direction=angles[joint.name],
            tension_only=True,
        )
        for joint in mechanism.clearance_joints
        if joint.clearance is not None
    )
    return dataclasses.replace(mechanism, joints=mechanism.ideal_joints, rods=(*mechanism.rods, *rods))
