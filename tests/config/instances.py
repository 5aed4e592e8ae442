"""Instances of classes whose fields depend on each other, for the tests of case files."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import scissordyn as sd
from scissordyn.component.catalogue import COMPONENTS
from scissordyn.component.declaration import Component
from scissordyn.control.catalogue import CONTROLLERS
from scissordyn.control.controller import Controller
from scissordyn.laws.catalogue import BY_KIND
from scissordyn.laws.contact import Damping, Elastic, Friction

PLUGINS: Mapping[type, tuple[type, ...]] = {
    Elastic: tuple(BY_KIND["stiffness"].values()),
    Damping: tuple(BY_KIND["damping"].values()),
    Friction: tuple(BY_KIND["friction"].values()),
    Controller: tuple(CONTROLLERS.values()),
    Component: tuple(COMPONENTS.values()),
}
"""What stands for a declared protocol: the entries of its catalogue."""

TABLES = (((-0.3, -2.0), (0.1 / 3.0, 0.2), (0.4, 3.1)), ((-0.25, -0.1), (-0.01, -0.05), (0.02, 0.05), (0.3, 0.2)))
OTHERWISE: Mapping[type, tuple[Any, ...]] = {
    sd.Guide: (sd.Guide("guide", ("plate", "corner"), aligned=True),),
    sd.GuideClearance: (
        sd.GuideClearance(1e-4, length=0.04, width=0.02),
        sd.GuideClearance(1e-4, corners=((-0.019, -0.009), (0.019, -0.009), (0.0, 0.1 / 9.0))),
    ),
    sd.TapeSpring: (sd.TapeSpring("tape", "rod", straight=TABLES[0], folded=TABLES[1]),),
    sd.FeedForward: (sd.FeedForward(limit=10.0),),
    sd.PID: (sd.PID(3.0, limit=10.0),),
    sd.Oil: (sd.Oil("own", 5e-5, 7e-6),),
    sd.Lubrication: (
        sd.Lubrication(viscosity=0.05, bearing="short"),
        sd.Lubrication(oil=sd.Oil("own", 5e-5, 7e-6), temperature=350.0),
    ),
    sd.Actuator: (
        sd.Actuator("servo", "rod", sd.FeedForward(limit=10.0), reference=sd.ConstantSpeed(1.0), sensor=("rod", "end")),
    ),
    sd.Bushing: (
        sd.Bushing(
            "bushing", ("crank", "end"), ("rod", "start"), stiffness_x=1e7, stiffness_y=1e7, damping_x=1e7, damping_y=1e7
        ),
    ),
    sd.Beam: (
        sd.Beam(
            "beam",
            ("crank", "start"),
            ("rod", "start"),
            length=0.7,
            axial_stiffness=1e7,
            bending_stiffness=1e3,
            mass_per_length=0.3,
            depth=0.06,
            youngs_modulus=2.1e11,
            yield_strength=2.35e8,
        ),
    ),
    sd.FlexibleBar: (
        sd.FlexibleBar(
            "bar", ("crank", "rod"), (0.1, 0.1 + 1.0 / 3.0), axial_stiffness=1e7, bending_stiffness=1e3, mass_per_length=0.3
        ),
        sd.FlexibleBar(
            "bar",
            ("crank", "rod"),
            (0.0, 0.7),
            axial_stiffness=1e7,
            bending_stiffness=1e3,
            mass_per_length=0.3,
            modes=5,
            turned=(0.1, -0.2),
            depth=0.06,
        ),
    ),
    sd.Cam: (
        sd.Cam(
            "cam",
            ("crank", "start"),
            ("rod", "end"),
            tuple((k * math.pi / 4, 0.01 * (1.0 + 0.1 * math.cos(k * math.pi / 4) / 3.0)) for k in range(9)),
            1e-4 / 3.0,
        ),
    ),
    sd.Roller: (
        sd.Roller("wheel", ("rod", "end"), "crank"),
        sd.Roller("wheel", ("rod", "end"), "crank", stiffness=1e6 / 3.0, damping=7.0, clearance=1e-4, restitution=0.7),
    ),
    sd.Tabulated: (sd.Tabulated(tuple(k / 7.0 for k in range(9)), tuple(math.sin(k) for k in range(9))),),
    sd.Harmonic: (sd.Harmonic(0.1, 0.2, 3.3, 0.4),),
}
"""Instances of classes whose fields depend on each other."""
