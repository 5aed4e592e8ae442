"""Dynamics of deployable scissor structures, and of any planar mechanism, with joints as they really are."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from scissordyn.errors import InputError, ScissordynError
    from scissordyn.laws.catalogue import law
    from scissordyn.laws.damping.flores import Flores
    from scissordyn.laws.damping.lankarani_nikravesh import LankaraniNikravesh
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
    from scissordyn.model.element import AngleStop, Force, Motor, Spring, Torque, TorsionSpring, TravelStop
    from scissordyn.model.joint import Guide, Revolute
    from scissordyn.model.linkage import common_pin, four_bar, n_four_bar, slider_crank
    from scissordyn.model.mechanism import Mechanism
    from scissordyn.model.payload import with_panels, with_payload
    from scissordyn.model.scissor import scissor
    from scissordyn.simulation.hold import hold_contact
    from scissordyn.simulation.run import replay, simulate
    from scissordyn.simulation.store import load, save
    from scissordyn.units import degrees, rpm

__all__ = [
    "STEEL",
    "Ambrosio",
    "AngleStop",
    "Body",
    "Clearance",
    "ConstantSpeed",
    "Cycloidal",
    "Drive",
    "Flores",
    "Force",
    "Guide",
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
    "NoFriction",
    "Polynomial",
    "Revolute",
    "ScissordynError",
    "Spring",
    "TableMotion",
    "Torque",
    "TorsionSpring",
    "Trapezoidal",
    "TravelStop",
    "UserDamping",
    "UserElastic",
    "UserFriction",
    "Weld",
    "angulated_bar",
    "bar",
    "common_pin",
    "degrees",
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
    "save",
    "scissor",
    "simulate",
    "slider_crank",
    "tabulated",
    "with_panels",
    "with_payload",
]

# where each public name lives; it is imported when first used, so that `import scissordyn` costs nothing
_HOMES = {
    "errors": (
        "InputError",
        "ScissordynError",
    ),
    "laws.catalogue": ("law",),
    "laws.damping.flores": ("Flores",),
    "laws.damping.lankarani_nikravesh": ("LankaraniNikravesh",),
    "laws.elastic.hertz": ("Hertz",),
    "laws.elastic.liu": ("Liu",),
    "laws.friction.ambrosio": ("Ambrosio",),
    "laws.friction.lugre": ("LuGre",),
    "laws.friction.none": ("NoFriction",),
    "laws.material": (
        "STEEL",
        "Material",
    ),
    "laws.user": (
        "UserDamping",
        "UserElastic",
        "UserFriction",
    ),
    "model.array": (
        "hoberman_ring",
        "mast",
        "polar_scissor",
    ),
    "model.bar": ("angulated_bar",),
    "model.body": (
        "Body",
        "bar",
        "point_mass",
    ),
    "model.clearance": ("Clearance",),
    "model.drive": (
        "ConstantSpeed",
        "Cycloidal",
        "Drive",
        "Harmonic",
        "Polynomial",
        "TableMotion",
        "Trapezoidal",
        "tabulated",
    ),
    "model.connection": (
        "Latch",
        "Link",
        "Weld",
    ),
    "model.element": (
        "AngleStop",
        "Force",
        "Motor",
        "Spring",
        "Torque",
        "TorsionSpring",
        "TravelStop",
    ),
    "model.joint": (
        "Guide",
        "Revolute",
    ),
    "model.linkage": (
        "common_pin",
        "four_bar",
        "n_four_bar",
        "slider_crank",
    ),
    "model.mechanism": ("Mechanism",),
    "model.payload": (
        "with_panels",
        "with_payload",
    ),
    "model.scissor": ("scissor",),
    "simulation.hold": ("hold_contact",),
    "simulation.run": (
        "replay",
        "simulate",
    ),
    "simulation.store": (
        "load",
        "save",
    ),
    "units": (
        "degrees",
        "rpm",
    ),
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
