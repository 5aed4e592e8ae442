"""Options of a simulation."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal, get_args

from scissordyn.errors import InputError, did_you_mean
from scissordyn.integrate.tableau import METHODS
from scissordyn.units import Quantity, check_quantities

__all__ = ["Options", "StartKind"]

StartKind = Literal["concentric", "in-contact", "static"]


@dataclass(frozen=True)
class Options:
    """End, start, accuracy and sampling of a simulation.

    Parameters
    ----------
    until : float
        End of the simulated time [s].
    start : {"concentric", "in-contact", "static"}
        Journals concentric with their bearings and moving as in the ideal mechanism; resting in contact along the line
        of the ideal reaction; or in static equilibrium under gravity, springs and loads, the drives fixed at t = 0.
    samples : int
        Number of recorded instants, equally spaced; steps and events do not depend on it.
    rtol : float
        Error allowed in a step, relative to the speeds and to the internal states of friction laws.
    atol : float
        Error in positions allowed in a step, as a fraction of the smallest clearance (of the largest body if there is none).
    method : str
        "auto", or the name of an integrator.
    most_steps : int
        Largest number of steps; with more the run fails.
    """

    until: Annotated[float, Quantity("s", above=0.0, help="end of the simulated time")]
    start: StartKind = "concentric"
    samples: Annotated[int, Quantity("1", minimum=2, maximum=10_000_000, help="recorded instants")] = 2001
    rtol: Annotated[float, Quantity("1", minimum=1e-14, maximum=1e-2, help="relative tolerance")] = 1e-8
    atol: Annotated[float, Quantity("1", minimum=1e-14, maximum=1e-2, help="tolerance as a fraction of the clearance")] = 1e-8
    method: str = "auto"
    most_steps: Annotated[int, Quantity("1", minimum=1, help="most steps")] = 50_000_000

    def __post_init__(self) -> None:
        check_quantities(self)
        if self.start not in get_args(StartKind):
            raise InputError(
                f"start = {self.start!r}{did_you_mean(str(self.start), get_args(StartKind))}",
                '"concentric", "in-contact" or "static"',
            )
        if self.method not in ("auto", *METHODS):
            raise InputError(f"method = {self.method!r}{did_you_mean(self.method, METHODS)}", "auto, " + ", ".join(METHODS))
