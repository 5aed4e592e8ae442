"""Models of the three mechanisms in the package, with hard contact."""

from __future__ import annotations

import math

import numpy as np

import scissordyn as sd
from reference import woodpecker
from scissordyn.laws.damping.factors import LankaraniNikravesh
from scissordyn.laws.elastic.linear import Linear
from scissordyn.laws.friction.coulomb import Coulomb
from validation.case import mechanism

__all__ = ["four_bar", "slider_crank", "woodpecker_of_small_angles"]

SHARP = 1e-9  # Radius of the corners [m]

RIGID = Linear(1e15)
"""Stiffness of surfaces that do not yield, as in the records; edges this sharp would yield by more than a scaled gap."""


def slider_crank(*, rotation: float) -> sd.Mechanism:
    """Return the slider-crank with clearance guide, hard corners and Coulomb friction; `rotation` is the slider's [rad/s]."""
    one = mechanism("guide").replace("body.slider.angular_velocity", rotation)
    wide = one.guides[0].clearance
    assert wide is not None
    hard = sd.GuideClearance(
        1e-3,
        corners=wide.corners,
        corner_radius=SHARP,
        stiffness=RIGID,
        damping=sd.law("damping", "exact")(0.4),
        friction=Coulomb(0.01),
        contact="hard",
    )
    return one.with_clearance("guide", hard)


def four_bar() -> sd.Mechanism:
    """Return the controlled four-bar linkage with three hard clearance joints."""
    one = mechanism("controlled_four_bar")
    for joint in one.joints:
        if joint.clearance is not None:
            hard = sd.Clearance(
                joint.clearance.clearance,
                journal_radius=joint.clearance.journal_radius,
                stiffness=RIGID,
                damping=LankaraniNikravesh(0.0),
                friction=Coulomb(0.1),
                contact="hard",
            )
            one = one.with_clearance(joint.name, hard)
    return one


def woodpecker_of_small_angles(scale: float, velocities: np.ndarray) -> sd.Mechanism:
    """Return the woodpecker with gaps, gravity and velocities scaled down, so that angles become small.

    The sleeve is on the pole's axis and has edges on one side only, like the record's.

    Parameters
    ----------
    scale : float
        Factor of the angles and displacements of the record's model.
    velocities : ndarray, shape (3,)
        Velocity of the sleeve [m/s], and angular velocities of sleeve and bird [rad/s]; both start upright.
    """
    up, sleeve_turn, bird_turn = scale * velocities
    to_pin, to_bird = woodpecker.TO_SPRING, woodpecker.TO_BIRD
    far = to_pin + to_bird - woodpecker.BEAK_BACK
    at_pin = up + to_pin * sleeve_turn
    sleeve = sd.Body(
        "sleeve",
        woodpecker.MASS_SLEEVE,
        woodpecker.INERTIA_SLEEVE,
        {"middle": (0.0, 0.0), "spring": (to_pin, 0.0)},
        velocity=(0.0, up),
        angular_velocity=sleeve_turn,
    )
    bird = sd.Body(
        "bird",
        woodpecker.MASS_BIRD,
        woodpecker.INERTIA_BIRD,
        {"spring": (-to_bird, 0.0), "axis": (-to_pin - to_bird, 0.0)},
        position=(to_pin + to_bird, 0.0),
        velocity=(0.0, at_pin + to_bird * bird_turn),
        angular_velocity=bird_turn,
    )
    edge, high = woodpecker.SLEEVE + SHARP, woodpecker.HALF_HEIGHT
    one = sd.Mechanism(
        (sleeve, bird),
        joints=(sd.Revolute("spring pin", ("bird", "spring"), ("sleeve", "spring")),),
        guides=(
            sd.Guide("axis", ("sleeve", "middle"), direction=math.pi / 2),
            sd.Guide("pole", ("sleeve", "middle"), direction=math.pi / 2),
            sd.Guide("pole at the beak", ("bird", "axis"), direction=math.pi / 2),
        ),
        gravity=scale * woodpecker.GRAVITY,
        output_body="bird",
        components=(sd.TorsionSpring("spring", body="bird", base="sleeve", stiffness=woodpecker.STIFFNESS, free_angle=0.0),),
    )
    edges = _around(scale * (woodpecker.SLEEVE - woodpecker.POLE), ((-2.0 * edge, 0.0), (edge, -high), (edge, high)), 0.0)
    beak = (-woodpecker.BEAK_BACK + SHARP, woodpecker.BEAK_UP)
    other = (-to_pin - to_bird - 2.0 * far, 0.0)
    return one.with_clearance("pole", edges).with_clearance(
        "pole at the beak", _around(scale * (far - woodpecker.POLE), (beak, other), 0.5)
    )


def _around(gap: float, corners: tuple[tuple[float, float], ...], restitution: float) -> sd.GuideClearance:
    """Return the clearance of corners around a pole."""
    return sd.GuideClearance(
        gap,
        around=True,
        corners=corners,
        corner_radius=SHARP,
        stiffness=RIGID,
        damping=LankaraniNikravesh(restitution),
        friction=Coulomb(0.3),
        contact="hard",
    )
