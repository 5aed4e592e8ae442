"""No friction."""

from __future__ import annotations

from scissordyn.laws.contact import Friction
from scissordyn.plugin.element import element


def static_limit():
    """Return the largest |F_t| [N]."""
    return 0.0


@element(name="none", limit=static_limit, stiff=False, source="definition")
class NoFriction(Friction):
    """Two surfaces that slide freely: F_t = 0."""
