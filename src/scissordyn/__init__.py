"""Dynamics of deployable scissor structures, and of any planar mechanism, with joints as they really are."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from scissordyn.analysis.classify import classify
    from scissordyn.analysis.consensus import consensus
    from scissordyn.analysis.contact import contact_statistics
    from scissordyn.analysis.merit import figures_of_merit
    from scissordyn.analysis.section import section
    from scissordyn.analysis.spectrum import spectrum
    from scissordyn.analysis.stroboscope import stroboscopic
    from scissordyn.analysis.zero_one import zero_one_test
    from scissordyn.control.catalogue import controller
    from scissordyn.control.delayed.extended import ExtendedDelayedFeedback
    from scissordyn.control.delayed.pyragas import Pyragas
    from scissordyn.control.tracking.feed_forward import FeedForward
    from scissordyn.control.tracking.none import NoControl
    from scissordyn.control.tracking.pid import PID
    from scissordyn.control.user import UserController
    from scissordyn.errors import InputError, ScissordynError
    from scissordyn.laws.catalogue import law
    from scissordyn.laws.damping.factors import Flores, LankaraniNikravesh
    from scissordyn.laws.elastic.hertz import Hertz
    from scissordyn.laws.elastic.liu import Liu
    from scissordyn.laws.friction.ambrosio import Ambrosio
    from scissordyn.laws.friction.lugre import LuGre
    from scissordyn.laws.friction.none import NoFriction
    from scissordyn.laws.material import STEEL, Material
    from scissordyn.laws.user import UserDamping, UserElastic, UserFriction
    from scissordyn.model.array import hoberman_ring, mast, polar_scissor
    from scissordyn.model.bar import angulated_bar
    from scissordyn.model.body import Body, bar, point_mass
    from scissordyn.model.clearance import Clearance
    from scissordyn.model.connection import Latch, Link, Weld
    from scissordyn.model.drive import (
        ConstantSpeed,
        Cycloidal,
        Drive,
        Harmonic,
        Polynomial,
        TableMotion,
        Trapezoidal,
        tabulated,
    )
    from scissordyn.model.element import Actuator, AngleStop, Force, Motor, Spring, Torque, TorsionSpring, TravelStop
    from scissordyn.model.guide_clearance import GuideClearance
    from scissordyn.model.joint import Guide, Revolute
    from scissordyn.model.linkage import common_pin, four_bar, n_four_bar, slider_crank
    from scissordyn.model.mechanism import Mechanism
    from scissordyn.model.payload import with_panels, with_payload
    from scissordyn.model.scissor import scissor
    from scissordyn.simulation.cycles import cycle
    from scissordyn.simulation.feed_forward import feed_forward
    from scissordyn.simulation.hold import hold_contact
    from scissordyn.simulation.run import replay, simulate
    from scissordyn.simulation.store import load, save
    from scissordyn.study.bifurcation import bifurcation
    from scissordyn.study.ensemble import ensemble
    from scissordyn.study.lyapunov import separation_exponent, variational_exponent
    from scissordyn.study.runner import run_cases
    from scissordyn.units import degrees, rpm

__all__ = [
    "PID",
    "STEEL",
    "Actuator",
    "Ambrosio",
    "AngleStop",
    "Body",
    "Clearance",
    "ConstantSpeed",
    "Cycloidal",
    "Drive",
    "ExtendedDelayedFeedback",
    "FeedForward",
    "Flores",
    "Force",
    "Guide",
    "GuideClearance",
    "Harmonic",
    "Hertz",
    "InputError",
    "LankaraniNikravesh",
    "Latch",
    "Link",
    "Liu",
    "LuGre",
    "Material",
    "Mechanism",
    "Motor",
    "NoControl",
    "NoFriction",
    "Polynomial",
    "Pyragas",
    "Revolute",
    "ScissordynError",
    "Spring",
    "TableMotion",
    "Torque",
    "TorsionSpring",
    "Trapezoidal",
    "TravelStop",
    "UserController",
    "UserDamping",
    "UserElastic",
    "UserFriction",
    "Weld",
    "angulated_bar",
    "bar",
    "bifurcation",
    "classify",
    "common_pin",
    "consensus",
    "contact_statistics",
    "controller",
    "cycle",
    "degrees",
    "ensemble",
    "feed_forward",
    "figures_of_merit",
    "four_bar",
    "hoberman_ring",
    "hold_contact",
    "law",
    "load",
    "mast",
    "n_four_bar",
    "point_mass",
    "polar_scissor",
    "replay",
    "rpm",
    "run_cases",
    "save",
    "scissor",
    "section",
    "separation_exponent",
    "simulate",
    "slider_crank",
    "spectrum",
    "stroboscopic",
    "tabulated",
    "variational_exponent",
    "with_panels",
    "with_payload",
    "zero_one_test",
]

# where each public name lives; it is imported when first used, so that `import scissordyn` costs nothing
_HOMES = {
    "analysis.classify": ("classify",),
    "analysis.consensus": ("consensus",),
    "analysis.contact": ("contact_statistics",),
    "analysis.merit": ("figures_of_merit",),
    "analysis.section": ("section",),
    "analysis.spectrum": ("spectrum",),
    "analysis.stroboscope": ("stroboscopic",),
    "analysis.zero_one": ("zero_one_test",),
    "control.catalogue": ("controller",),
    "control.delayed.extended": ("ExtendedDelayedFeedback",),
    "control.delayed.pyragas": ("Pyragas",),
    "control.tracking.feed_forward": ("FeedForward",),
    "control.tracking.none": ("NoControl",),
    "control.tracking.pid": ("PID",),
    "control.user": ("UserController",),
    "errors": ("InputError", "ScissordynError"),
    "laws.catalogue": ("law",),
    "laws.damping.factors": ("Flores", "LankaraniNikravesh"),
    "laws.elastic.hertz": ("Hertz",),
    "laws.elastic.liu": ("Liu",),
    "laws.friction.ambrosio": ("Ambrosio",),
    "laws.friction.lugre": ("LuGre",),
    "laws.friction.none": ("NoFriction",),
    "laws.material": ("STEEL", "Material"),
    "laws.user": ("UserDamping", "UserElastic", "UserFriction"),
    "model.array": ("hoberman_ring", "mast", "polar_scissor"),
    "model.bar": ("angulated_bar",),
    "model.body": ("Body", "bar", "point_mass"),
    "model.clearance": ("Clearance",),
    "model.connection": ("Latch", "Link", "Weld"),
    "model.drive": ("ConstantSpeed", "Cycloidal", "Drive", "Harmonic", "Polynomial", "TableMotion", "Trapezoidal", "tabulated"),
    "model.element": ("Actuator", "AngleStop", "Force", "Motor", "Spring", "Torque", "TorsionSpring", "TravelStop"),
    "model.guide_clearance": ("GuideClearance",),
    "model.joint": ("Guide", "Revolute"),
    "model.linkage": ("common_pin", "four_bar", "n_four_bar", "slider_crank"),
    "model.mechanism": ("Mechanism",),
    "model.payload": ("with_panels", "with_payload"),
    "model.scissor": ("scissor",),
    "simulation.cycles": ("cycle",),
    "simulation.feed_forward": ("feed_forward",),
    "simulation.hold": ("hold_contact",),
    "simulation.run": ("replay", "simulate"),
    "simulation.store": ("load", "save"),
    "study.bifurcation": ("bifurcation",),
    "study.ensemble": ("ensemble",),
    "study.lyapunov": ("separation_exponent", "variational_exponent"),
    "study.runner": ("run_cases",),
    "units": ("degrees", "rpm"),
}
_HOME = {name: home for home, names in _HOMES.items() for name in names}


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module 'scissordyn' has no attribute '{name}'")
    value = getattr(import_module(f"scissordyn.{_HOME[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
