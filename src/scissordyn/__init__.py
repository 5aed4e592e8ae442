"""Dynamics of deployable scissor structures, and of any planar mechanism, with clearance, contact and friction in joints."""

from __future__ import annotations

import sys
from importlib import import_module
from types import ModuleType
from typing import TYPE_CHECKING, Any

from scissordyn.offer import hand_down

__version__ = "0.1.0"

if TYPE_CHECKING:
    from collections.abc import Callable

    from scissordyn.analysis.classify import classify
    from scissordyn.analysis.consensus import consensus
    from scissordyn.analysis.contact import contact_statistics
    from scissordyn.analysis.measured import Measured
    from scissordyn.analysis.merit import figures_of_merit
    from scissordyn.analysis.motor import MotorCurve, torque_over_speed
    from scissordyn.analysis.section import section
    from scissordyn.analysis.spectrum import spectrum
    from scissordyn.analysis.stroboscope import stroboscopic
    from scissordyn.analysis.zero_one import zero_one_test
    from scissordyn.collection.catalogue import zoo
    from scissordyn.component.actuator import Actuator
    from scissordyn.component.angle_stop import AngleStop
    from scissordyn.component.beam import Beam
    from scissordyn.component.bushing import Bushing
    from scissordyn.component.cable import Cable
    from scissordyn.component.clutch import Clutch
    from scissordyn.component.constant_force_spring import ConstantForceSpring
    from scissordyn.component.declaration import component
    from scissordyn.component.element import element
    from scissordyn.component.flexible_bar import FlexibleBar
    from scissordyn.component.force import Force
    from scissordyn.component.latch import Latch
    from scissordyn.component.motor import Motor
    from scissordyn.component.port import Output
    from scissordyn.component.rod import Rod
    from scissordyn.component.roller import Roller
    from scissordyn.component.spring import Spring
    from scissordyn.component.tape_spring import TapeSpring
    from scissordyn.component.time_function import (
        ConstantSpeed,
        Cycloidal,
        Harmonic,
        Polynomial,
        Tabulated,
        Trapezoidal,
        tabulated,
    )
    from scissordyn.component.torque import Torque
    from scissordyn.component.torsion_spring import TorsionSpring
    from scissordyn.component.travel_stop import TravelStop
    from scissordyn.config.case import Case
    from scissordyn.config.file import read_case, write_case
    from scissordyn.config.fits import fit
    from scissordyn.config.least import least_value
    from scissordyn.config.studies import open_study, study
    from scissordyn.control.catalogue import controller
    from scissordyn.control.delayed.extended import ExtendedDelayedFeedback
    from scissordyn.control.delayed.pyragas import Pyragas
    from scissordyn.control.tracking.feed_forward import FeedForward
    from scissordyn.control.tracking.none import NoControl
    from scissordyn.control.tracking.pid import PID
    from scissordyn.control.user import UserController
    from scissordyn.errors import InputError, ScissordynError
    from scissordyn.exchange.dxf import read_dxf
    from scissordyn.exchange.export import export
    from scissordyn.exchange.forces import pin_forces
    from scissordyn.exchange.mjcf import read_mjcf
    from scissordyn.exchange.pmks import read_pmks
    from scissordyn.exchange.read import read_drawing
    from scissordyn.identification.prediction import prediction
    from scissordyn.laws.catalogue import law
    from scissordyn.laws.damping.factors import Flores, LankaraniNikravesh
    from scissordyn.laws.elastic.hertz import Hertz
    from scissordyn.laws.elastic.liu import Liu
    from scissordyn.laws.friction.ambrosio import Ambrosio
    from scissordyn.laws.friction.lugre import LuGre
    from scissordyn.laws.friction.none import NoFriction
    from scissordyn.laws.material import STEEL, Material
    from scissordyn.laws.oil import Oil
    from scissordyn.laws.user import UserDamping, UserElastic, UserFriction
    from scissordyn.model.array import hoberman_ring, mast, polar_scissor
    from scissordyn.model.bar import angulated_bar
    from scissordyn.model.bending import with_bending
    from scissordyn.model.body import Body, bar, point_mass
    from scissordyn.model.clearance import Clearance
    from scissordyn.model.connection import Weld
    from scissordyn.model.drive import Drive
    from scissordyn.model.guide_clearance import GuideClearance
    from scissordyn.model.joint import Guide, Revolute
    from scissordyn.model.linkage import common_pin, four_bar, n_four_bar, slider_crank
    from scissordyn.model.lubrication import Lubrication
    from scissordyn.model.mechanism import Mechanism
    from scissordyn.model.payload import with_panels, with_payload
    from scissordyn.model.scissor import scissor
    from scissordyn.model.section import Section, StructuralMaterial
    from scissordyn.model.track import Track
    from scissordyn.periodic.bifurcation import bifurcation
    from scissordyn.periodic.cycles import cycle
    from scissordyn.periodic.ensemble import ensemble
    from scissordyn.periodic.lyapunov import separation_exponent, variational_exponent
    from scissordyn.run.batch import simulate_many
    from scissordyn.run.buckling import buckling
    from scissordyn.run.checkpoint import Checkpoint
    from scissordyn.run.constrained_contact import constrain_contact
    from scissordyn.run.engine import Threads
    from scissordyn.run.feed_forward import feed_forward
    from scissordyn.run.ideal import ideal_kinematics
    from scissordyn.run.internal_forces import internal_forces
    from scissordyn.run.modes import modes
    from scissordyn.run.options import Options
    from scissordyn.run.simulate import replay, simulate
    from scissordyn.run.store import load, save
    from scissordyn.study.convergence import convergence
    from scissordyn.study.distribution import (
        Beta,
        Empirical,
        Interval,
        Levels,
        LogNormal,
        Names,
        Normal,
        Trapezoid,
        Triangular,
        Uniform,
        Weibull,
    )
    from scissordyn.study.engine import Cluster
    from scissordyn.study.fit import Fit
    from scissordyn.study.processes import Processes
    from scissordyn.units import Pairs, Quantity, State, degrees, rpm

    # named without an import: pictures enter no number, and what imports the package for its numbers does not depend on them
    preview: Callable[..., Any]
    animate: Callable[..., Any]
    view: Callable[..., Any]
    style: Callable[..., Any]
    plot: Any

__all__ = [
    "PID",
    "STEEL",
    "Actuator",
    "Ambrosio",
    "AngleStop",
    "Beam",
    "Beta",
    "Body",
    "Bushing",
    "Cable",
    "Case",
    "Checkpoint",
    "Clearance",
    "Cluster",
    "Clutch",
    "ConstantForceSpring",
    "ConstantSpeed",
    "Cycloidal",
    "Drive",
    "Empirical",
    "ExtendedDelayedFeedback",
    "FeedForward",
    "Fit",
    "FlexibleBar",
    "Flores",
    "Force",
    "Guide",
    "GuideClearance",
    "Harmonic",
    "Hertz",
    "InputError",
    "Interval",
    "LankaraniNikravesh",
    "Latch",
    "Levels",
    "Liu",
    "LogNormal",
    "LuGre",
    "Lubrication",
    "Material",
    "Measured",
    "Mechanism",
    "Motor",
    "MotorCurve",
    "Names",
    "NoControl",
    "NoFriction",
    "Normal",
    "Oil",
    "Options",
    "Output",
    "Pairs",
    "Polynomial",
    "Processes",
    "Pyragas",
    "Quantity",
    "Revolute",
    "Rod",
    "Roller",
    "ScissordynError",
    "Section",
    "Spring",
    "State",
    "StructuralMaterial",
    "Tabulated",
    "TapeSpring",
    "Threads",
    "Torque",
    "TorsionSpring",
    "Track",
    "Trapezoid",
    "Trapezoidal",
    "TravelStop",
    "Triangular",
    "Uniform",
    "UserController",
    "UserDamping",
    "UserElastic",
    "UserFriction",
    "Weibull",
    "Weld",
    "angulated_bar",
    "animate",
    "bar",
    "bifurcation",
    "buckling",
    "classify",
    "common_pin",
    "component",
    "consensus",
    "constrain_contact",
    "contact_statistics",
    "controller",
    "convergence",
    "cycle",
    "degrees",
    "element",
    "ensemble",
    "export",
    "feed_forward",
    "figures_of_merit",
    "fit",
    "four_bar",
    "hoberman_ring",
    "ideal_kinematics",
    "internal_forces",
    "law",
    "least_value",
    "load",
    "mast",
    "modes",
    "n_four_bar",
    "open_study",
    "pin_forces",
    "plot",
    "point_mass",
    "polar_scissor",
    "prediction",
    "preview",
    "read_case",
    "read_drawing",
    "read_dxf",
    "read_mjcf",
    "read_pmks",
    "replay",
    "rpm",
    "save",
    "scissor",
    "section",
    "separation_exponent",
    "simulate",
    "simulate_many",
    "slider_crank",
    "spectrum",
    "stroboscopic",
    "study",
    "style",
    "tabulated",
    "torque_over_speed",
    "variational_exponent",
    "view",
    "with_bending",
    "with_panels",
    "with_payload",
    "write_case",
    "zero_one_test",
    "zoo",
]

# where each public name lives; it is imported when first used, so that `import scissordyn` costs nothing
_HOMES = {
    "analysis.classify": ("classify",),
    "analysis.consensus": ("consensus",),
    "analysis.contact": ("contact_statistics",),
    "analysis.measured": ("Measured",),
    "analysis.merit": ("figures_of_merit",),
    "analysis.motor": ("MotorCurve", "torque_over_speed"),
    "analysis.section": ("section",),
    "analysis.spectrum": ("spectrum",),
    "analysis.stroboscope": ("stroboscopic",),
    "analysis.zero_one": ("zero_one_test",),
    "collection.catalogue": ("zoo",),
    "config.case": ("Case",),
    "config.case_text": ("case_text",),
    "config.file": ("read_case", "write_case"),
    "control.catalogue": ("controller",),
    "control.delayed.extended": ("ExtendedDelayedFeedback",),
    "control.delayed.pyragas": ("Pyragas",),
    "control.tracking.feed_forward": ("FeedForward",),
    "control.tracking.none": ("NoControl",),
    "control.tracking.pid": ("PID",),
    "control.user": ("UserController",),
    "exchange.dxf": ("read_dxf",),
    "exchange.export": ("export",),
    "exchange.forces": ("pin_forces",),
    "exchange.mjcf": ("read_mjcf",),
    "exchange.pmks": ("read_pmks",),
    "exchange.read": ("read_drawing",),
    "explore.notebook": ("view",),
    "errors": ("InputError", "ScissordynError"),
    "identification.prediction": ("prediction",),
    "laws.catalogue": ("law",),
    "laws.damping.factors": ("Flores", "LankaraniNikravesh"),
    "laws.elastic.hertz": ("Hertz",),
    "laws.elastic.liu": ("Liu",),
    "laws.friction.ambrosio": ("Ambrosio",),
    "laws.friction.lugre": ("LuGre",),
    "laws.friction.none": ("NoFriction",),
    "laws.material": ("STEEL", "Material"),
    "laws.oil": ("Oil",),
    "laws.user": ("UserDamping", "UserElastic", "UserFriction"),
    "component.actuator": ("Actuator",),
    "component.angle_stop": ("AngleStop",),
    "component.beam": ("Beam",),
    "component.bushing": ("Bushing",),
    "component.cable": ("Cable",),
    "component.clutch": ("Clutch",),
    "component.constant_force_spring": ("ConstantForceSpring",),
    "component.declaration": ("component",),
    "component.element": ("element",),
    "component.flexible_bar": ("FlexibleBar",),
    "component.force": ("Force",),
    "component.latch": ("Latch",),
    "component.motor": ("Motor",),
    "component.port": ("Output",),
    "component.rod": ("Rod",),
    "component.roller": ("Roller",),
    "component.spring": ("Spring",),
    "component.tape_spring": ("TapeSpring",),
    "component.time_function": (
        "ConstantSpeed",
        "Cycloidal",
        "Harmonic",
        "Polynomial",
        "Tabulated",
        "Trapezoidal",
        "tabulated",
    ),
    "component.torque": ("Torque",),
    "component.torsion_spring": ("TorsionSpring",),
    "component.travel_stop": ("TravelStop",),
    "model.connection": ("Weld",),
    "model.drive": ("Drive",),
    "model.array": ("hoberman_ring", "mast", "polar_scissor"),
    "model.bar": ("angulated_bar",),
    "model.bending": ("with_bending",),
    "model.body": ("Body", "bar", "point_mass"),
    "model.clearance": ("Clearance",),
    "model.guide_clearance": ("GuideClearance",),
    "model.joint": ("Guide", "Revolute"),
    "model.lubrication": ("Lubrication",),
    "model.linkage": ("common_pin", "four_bar", "n_four_bar", "slider_crank"),
    "model.mechanism": ("Mechanism",),
    "model.payload": ("with_panels", "with_payload"),
    "plot.animation": ("animate",),
    "plot.preview": ("preview", "preview_svg"),
    "plot.publication": ("style",),
    "model.scissor": ("scissor",),
    "model.section": ("Section", "StructuralMaterial"),
    "model.track": ("Track",),
    "config.fits": ("fit",),
    "config.least": ("least_value",),
    "config.studies": ("open_study", "study"),
    "study.distribution": (
        "Beta",
        "Empirical",
        "Interval",
        "Levels",
        "LogNormal",
        "Names",
        "Normal",
        "Trapezoid",
        "Triangular",
        "Uniform",
        "Weibull",
    ),
    "study.convergence": ("convergence",),
    "study.fit": ("Fit",),
    "study.engine": ("Cluster",),
    "study.processes": ("Processes",),
    "run.batch": ("simulate_many",),
    "run.buckling": ("buckling",),
    "run.engine": ("Threads",),
    "run.checkpoint": ("Checkpoint",),
    "periodic.cycles": ("cycle",),
    "run.feed_forward": ("feed_forward",),
    "run.constrained_contact": ("constrain_contact",),
    "run.ideal": ("ideal_kinematics",),
    "run.internal_forces": ("internal_forces",),
    "run.modes": ("modes",),
    "run.options": ("Options",),
    "run.simulate": ("replay", "simulate"),
    "run.store": ("load", "save"),
    "periodic.bifurcation": ("bifurcation",),
    "periodic.ensemble": ("ensemble",),
    "periodic.lyapunov": ("separation_exponent", "variational_exponent"),
    "units": ("Pairs", "Quantity", "State", "degrees", "rpm"),
}
_HOME = {name: home for home, names in _HOMES.items() for name in names}


class _Study(ModuleType):
    """The room of studies, which can be called: ``sd.study(...)``."""

    def __call__(self, *given: Any, **named: Any) -> Any:
        return _study()(*given, **named)

    def __dir__(self) -> list[str]:
        return []

    __doc__ = property(lambda _: _study().__doc__)
    __signature__ = property(lambda _: import_module("inspect").signature(_study()))


def _study() -> Any:
    return _public("config.studies", "study")


class _Package(ModuleType):
    """The package. Its function `study` has the name of a room, which Python would put in its place when it loads that."""

    @property
    def study(self) -> Any:
        return import_module("scissordyn.study")

    @study.setter
    def study(self, room: ModuleType) -> None:
        room.__class__ = _Study


def __getattr__(name: str) -> Any:
    if name == "plot":  # a room with names of its own
        return import_module("scissordyn.plot")
    if name not in _HOME:
        from scissordyn.errors import did_you_mean

        raise AttributeError(f"module 'scissordyn' has no attribute '{name}'{did_you_mean(name, _HOME)}")
    value = globals()[name] = _public(_HOME[name], name)
    return value


def _public(home: str, name: str) -> Any:
    """What has a public name: a keyword that it does not know is answered with the nearest one."""
    from scissordyn.keyword import suggesting

    room = import_module(f"scissordyn.{home}")
    found = getattr(room, name)
    value = suggesting(found)
    if value is not found:
        setattr(room, name, value)  # where others find it by its name, as pickle does
    return value


hand_down(__getattr__)


def __dir__() -> list[str]:
    return ["__version__", *__all__]


sys.modules[__name__].__class__ = _Package
