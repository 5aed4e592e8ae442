"""Draw pictures of runs on given Axes or on a new Figure. Each function returns its Axes and never shows them.

``sd.plot`` is this package: each public function draws one kind of picture. A function is loaded when it is first used, so that
scenes of films need no matplotlib.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from scissordyn.plot.joint import film, force, orbit
    from scissordyn.plot.over_time import comparison, energy, response, torque, track
    from scissordyn.plot.still import bending, structure
    from scissordyn.plot.stroke import statics

__all__ = [
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

# Module that defines each public plot function, by name of the function
_HOMES = {
    **dict.fromkeys(("film", "force", "orbit"), "joint"),
    **dict.fromkeys(("comparison", "energy", "response", "torque", "track"), "over_time"),
    **dict.fromkeys(("bending", "structure"), "still"),
    "statics": "stroke",
}


def __getattr__(name: str) -> Any:
    from scissordyn.lookup import public

    value = globals()[name] = public(__name__, name, _HOMES)
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
