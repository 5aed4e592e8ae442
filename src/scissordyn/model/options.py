"""Options of a simulation."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Annotated, Any, Final, Literal

from scissordyn.errors import InputError, did_you_mean
from scissordyn.integrate.method import METHODS
from scissordyn.units import Meaning, Quantity, check_quantities

TIME_STEPPING = "moreau-jean"  # Name of the time-stepping method, the only method for hard contacts
AUTO: Final = "auto"  # Value of the option `samples` that adds samples during contacts to equally spaced ones
DEFAULT_SAMPLES = 2001  # Default number of equally spaced samples of a run

StartKind = Annotated[
    Literal["concentric", "in-contact", "static", "as-placed"],
    Meaning("journals concentric and moving as in the ideal mechanism, resting in contact, in equilibrium, or as placed"),
]

EventKind = Annotated[
    Literal["auto", "located", "crossed"],
    Meaning("whether each step ends where a contact begins or ends, or may cross that instant if its error allows"),
]

Method = Annotated[str, Meaning('"auto", chosen by an estimate of stiffness, or dop853, dopri5, rodas5p, rodas4p, moreau-jean')]

SampleCount = Annotated[
    int | Literal["auto"],
    Quantity("1", minimum=2, maximum=10_000_000, help='recorded instants, or "auto": those of contacts too'),
]


EndTime = Annotated[float, Quantity("s", minimum=1e-12, maximum=1e9, help="end of the simulated time")]


@dataclass(frozen=True)
class Options:
    """End time, start, accuracy and sampling of a simulation.

    Parameters
    ----------
    until, start, samples, rtol, atol, method, most_steps, events, trust, step
        Same as in `simulate`.
    """

    until: EndTime
    start: StartKind = "concentric"
    samples: SampleCount = DEFAULT_SAMPLES
    rtol: Annotated[float, Quantity("1", minimum=1e-14, maximum=1e-2, help="relative tolerance")] = 1e-8
    atol: Annotated[
        float | None,
        Quantity("1", minimum=1e-14, maximum=1e-2, help="tolerance of positions over the clearance, by default that of `rtol`"),
    ] = None
    method: Method = "auto"
    most_steps: Annotated[int, Quantity("1", minimum=1, maximum=10**15, help="most steps")] = 50_000_000
    events: EventKind = "auto"
    trust: Annotated[bool, Meaning("repeat the run at a much tighter tolerance and report the predictability horizon")] = False
    step: Annotated[
        float | None,
        Quantity("s", minimum=1e-12, maximum=1e6, help="step of time stepping with hard contacts, or of every step"),
    ] = None

    def __post_init__(self) -> None:
        check_quantities(self)
        if self.method not in ("auto", TIME_STEPPING, *METHODS):
            raise InputError(
                f"method = {self.method!r}{did_you_mean(str(self.method), (TIME_STEPPING, *METHODS))}",
                ", ".join(("auto", TIME_STEPPING, *METHODS)),
            )

    @property
    def count(self) -> int:
        """Number of equally spaced samples."""
        return DEFAULT_SAMPLES if isinstance(self.samples, str) else self.samples

    @property
    def position_tolerance(self) -> float:
        """Error in positions allowed in a step, as a fraction of the smallest clearance."""
        return self.rtol if self.atol is None else self.atol

    @property
    def equally_spaced(self) -> Options:
        """Options without samples at the instants of contacts."""
        return dataclasses.replace(self, samples=self.count)

    @property
    def keywords(self) -> dict[str, Any]:
        """Options as keyword arguments of `simulate`."""
        return {field.name: getattr(self, field.name) for field in dataclasses.fields(self)}
