"""Pictures of runs: draw on given Axes or on a new Figure, return the Axes, never show. No physics.

``sd.plot`` is this package: each of the names below draws one kind of picture of a run. They are loaded when first used: the
scenes of films and other parts of this room need no matplotlib.
"""

from __future__ import annotations

import sys
from importlib import import_module
from types import ModuleType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from scissordyn.plot.bending import bending
    from scissordyn.plot.comparison import comparison
    from scissordyn.plot.energy import energy
    from scissordyn.plot.film import film
    from scissordyn.plot.force import force
    from scissordyn.plot.orbit import orbit
    from scissordyn.plot.pictures import Pictures
    from scissordyn.plot.response import response
    from scissordyn.plot.statics import statics
    from scissordyn.plot.structure import structure
    from scissordyn.plot.torque import torque
    from scissordyn.plot.track import track

__all__ = [
    "Pictures",
    "bending",
    "comparison",
    "energy",
    "film",
    "force",
    "orbit",
    "response",
    "statics",
    "structure",
    "torque",
    "track",
]

_HOMES = {name: "pictures" if name == "Pictures" else name for name in __all__}


class _Room(ModuleType):
    """The package. Its functions have the names of their modules, which Python would put in their place when it loads one."""

    def __dir__(self) -> list[str]:
        return sorted(__all__)


def _function(name: str) -> property:
    def load(room: ModuleType) -> Any:
        from scissordyn.keyword import suggesting

        home = import_module(f"{__name__}.{_HOMES[name]}")
        value = suggesting(getattr(home, name))
        setattr(home, name, value)
        return value

    def loaded(room: ModuleType, module: ModuleType) -> None:
        """Called by Python with the module that it has loaded, which stays out of sight."""

    return property(load, loaded)


for _name in __all__:
    setattr(_Room, _name, _function(_name))
sys.modules[__name__].__class__ = _Room
