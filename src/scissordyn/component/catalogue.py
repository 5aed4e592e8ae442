"""The components of the package, by the names of their tables in a case file. A new component is one more line."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

from scissordyn.component.actuator import Actuator
from scissordyn.component.angle_load import AngleLoad
from scissordyn.component.angle_stop import AngleStop
from scissordyn.component.beam import Beam
from scissordyn.component.bushing import Bushing
from scissordyn.component.cable import Cable
from scissordyn.component.clutch import Clutch
from scissordyn.component.constant_force_spring import ConstantForceSpring
from scissordyn.component.declaration import Component
from scissordyn.component.flexible_bar import FlexibleBar
from scissordyn.component.force import Force
from scissordyn.component.gas_spring import GasSpring
from scissordyn.component.guide_friction import GuideFriction
from scissordyn.component.latch import Latch
from scissordyn.component.linear_motor import LinearMotor
from scissordyn.component.lugre import GuideLuGre, PinLuGre
from scissordyn.component.motor import Motor
from scissordyn.component.nonlinear_spring import NonlinearSpring
from scissordyn.component.pin_friction import PinFriction
from scissordyn.component.rod import Rod
from scissordyn.component.roller import Roller
from scissordyn.component.spring import Spring
from scissordyn.component.stroke_load import StrokeLoad
from scissordyn.component.tabulated_motor import TabulatedMotor
from scissordyn.component.tape_spring import TapeSpring
from scissordyn.component.torque import Torque
from scissordyn.component.torsion_spring import TorsionSpring
from scissordyn.component.travel_stop import TravelStop

# type checkers do not see what the decorator adds to these classes
_CLASSES: tuple[Any, ...] = (
    Spring,
    ConstantForceSpring,
    NonlinearSpring,
    GasSpring,
    Cable,
    TorsionSpring,
    TapeSpring,
    Clutch,
    PinFriction,
    GuideFriction,
    PinLuGre,
    GuideLuGre,
    Bushing,
    Beam,
    FlexibleBar,
    Roller,
    Force,
    Torque,
    StrokeLoad,
    AngleLoad,
    Motor,
    TabulatedMotor,
    LinearMotor,
    Actuator,
    AngleStop,
    TravelStop,
    Rod,
    Latch,
)

COMPONENTS: Mapping[str, type[Component]] = MappingProxyType({cls.declaration.section: cls for cls in _CLASSES})
"""Component classes by section."""
