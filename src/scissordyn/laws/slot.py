"""The slots of a contact: elastic part, damping and friction."""

from __future__ import annotations

from types import MappingProxyType

from scissordyn.plugin.element import SLOTS, Slot

__all__ = ["DAMPING", "ELASTIC", "FRICTION"]

ELASTIC = Slot(
    "stiffness",
    ("indentation",),
    MappingProxyType({"force": (1, "force"), "energy": (1, "number")}),
    MappingProxyType({"small_contact": False, "materials": "any", "caveat": ""}),
)
"""Force [N] of an indentation above 0 [m], and the energy [J] that it stores; without that it is found by quadrature."""

DAMPING = Slot(
    "damping",
    ("elastic", "indentation", "rate", "approach"),
    MappingProxyType({"force": (4, "force")}),
    MappingProxyType({"restitution_range": None}),
)
"""Normal force [N], not yet clipped, of the elastic part [N], delta [m], delta' [m/s] and delta'(-) [m/s]."""

FRICTION = Slot(
    "friction",
    ("slip_speed", "normal_force"),
    MappingProxyType({"force": (2, "force"), "start": (1, "states"), "steady": (1, "states"), "limit": (2, "number")}),
    MappingProxyType({"stiff": True}),
)
"""Tangential force [N] of slip speed [m/s] and normal force [N], and the rates of the states; the states at the start of a
contact, and in steady sliding; the largest |F_t| [N] that the law itself allows."""

SLOTS.update({slot.name: slot for slot in (ELASTIC, DAMPING, FRICTION)})
