"""Pictures of runs: draw on given Axes or on a new Figure, return the Axes, never show. No physics.

``sd.plot`` is this package: each of the names below draws one kind of picture of a run.
"""

from scissordyn.plot.comparison import comparison
from scissordyn.plot.energy import energy
from scissordyn.plot.force import force
from scissordyn.plot.orbit import orbit
from scissordyn.plot.pictures import Pictures
from scissordyn.plot.response import response
from scissordyn.plot.structure import structure
from scissordyn.plot.torque import torque

__all__ = ["Pictures", "comparison", "energy", "force", "orbit", "response", "structure", "torque"]
