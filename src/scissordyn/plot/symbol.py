"""Symbols of components: lines in the fixed frame, the same in pictures and in films.

A component is drawn by the symbol that its class declares, whose strokes and place its port knows.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from scissordyn.component.port import AXIS
from scissordyn.component.port.stroke import Strokes
from scissordyn.model.mechanism import Mechanism
from scissordyn.plot.coupling_symbol import coupling_strokes, drive_strokes
from scissordyn.run.answer.placement import Placement

if TYPE_CHECKING:
    import xarray as xr

RING = 0.4
"""By how much of the first one's radius each further symbol at the same hinge is larger."""


@dataclass(frozen=True)
class Symbol:
    name: str
    kind: str  # The symbol
    strokes: Strokes  # (samples, points, 2) In the fixed frame [m]
    anchor: np.ndarray  # (samples, 2) Where its name belongs [m]

    @property
    def bar(self) -> str:
        """The bar that bends of which it is an element; "" if it is none."""
        bar, element, _ = self.name.rpartition("/beam")
        return bar if element and self.kind == "beam" else ""


@dataclass
class _Scene:
    """What ports ask of a picture (`component.port.stroke.Scene`)."""

    run: xr.Dataset
    mechanism: Mechanism
    placement: Placement
    samples: Any
    size: float
    symbols_at: dict[str, int] = field(default_factory=dict)

    def place(self, reference: tuple[str, Any]) -> np.ndarray:
        return self.placement.place(reference)

    def angle(self, body: str) -> np.ndarray:
        return self.placement.angle(body)

    def pivot(self, body: str, base: str) -> tuple[np.ndarray, float]:
        """At the joint between two bodies; at the mass centre of the first where no joint connects them."""
        where, anchor = f"body {body}", None
        for joint in self.mechanism.joints:
            if {joint.journal[0], joint.bearing[0]} == {body, base}:
                where, anchor = f"joint {joint.name}", self.place(joint.bearing)
                break
        rank = self.symbols_at[where] = self.symbols_at.get(where, -1) + 1
        return self.placement.centre(body) if anchor is None else anchor, 1.0 + RING * rank

    def force(self, component: Any) -> np.ndarray:
        section = component.declaration.section
        force = self.run[f"{section}_force"].sel({section: component.name}).transpose("time", "axis").values
        largest = float(np.max(np.linalg.norm(force, axis=-1))) or 1.0
        return self.placement.vectors(force[self.samples].reshape(-1, 2)) / largest


def cross_sections(mechanism: Mechanism) -> frozenset[str]:
    """The bodies that are cross-sections of bars that bend: the elements are drawn in their place."""
    beams: list[Any] = [part for part in mechanism.components if part.declaration.symbol == "beam"]
    bent = [part for part in beams if part.mass_per_length > 0.0]
    sections = [part.sections if part.declaration.port is AXIS else (part.start[0], part.end[0]) for part in bent]
    return frozenset(name for names in sections for name in names)


def symbols(run: xr.Dataset, mechanism: Mechanism, placement: Placement, samples: Any, size: float) -> list[Symbol]:
    scene = _Scene(run, mechanism, placement, samples, size)
    components: tuple[Any, ...] = (*mechanism.components, *mechanism.latches, *mechanism.rods)
    drawn: list[Symbol] = []
    for part in components:
        port, kind = part.declaration.port, part.declaration.symbol
        drawn.append(Symbol(part.name, kind, *port.drawn(part, port.symbols[kind], scene)))
    return drawn + coupling_symbols(mechanism, placement, size)


def coupling_symbols(mechanism: Mechanism, placement: Placement, size: float) -> list[Symbol]:
    drawn = [Symbol(part.name, "coupling", *coupling_strokes(part, placement, size)) for part in mechanism.couplings]
    return drawn + [
        Symbol(drive.name, "drive", *drive_strokes(drive.coordinate, placement, size)) for drive in mechanism.coordinate_drives
    ]
