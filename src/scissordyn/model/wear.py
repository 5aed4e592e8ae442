"""Options of wear over many cycles."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Literal

from scissordyn.errors import InputError
from scissordyn.model.clearance import ANGLES_MIN
from scissordyn.units import Meaning, Quantity, check_quantities, documented

CycleKind = Annotated[
    Literal["auto", "period", "run"],
    Meaning("a cycle: a period of the drive, or the whole run; auto: the period if the drives have one"),
]

LoadsKind = Annotated[
    Literal["simulated", "ideal"],
    Meaning("loads of simulated cycles; ideal: an estimate from the forces of ideal joints, in about a second"),
]

Coefficients = Annotated[
    Mapping[str, float],
    Quantity(
        "m^2/N", above=0.0, maximum=1e-6, help="coefficient by 'journal/bearing' material, for joints without one (Archard)"
    ),
]


@documented
@dataclass(frozen=True)
class Wear:
    """Number of cycles over which joints wear, and how cycles are chosen, averaged and extrapolated.

    A joint has its own coefficient of wear, see `Clearance`, or that of its pair of materials in `coefficients`.
    """

    cycles: Annotated[int, Quantity("1", minimum=1, maximum=10**9, help="number of cycles")] = 10_000
    cycle: CycleKind = "auto"
    settle: Annotated[int, Quantity("1", minimum=0, maximum=1000, help="periods at the start that are not counted")] = 2
    members: Annotated[
        int,
        Quantity("1", minimum=1, maximum=1000, help="averaged periods, or runs from starts that differ by round-off"),
    ] = 2
    tolerance: Annotated[
        float | None,
        Quantity("m", above=0.0, help="largest error of a step of n cycles; by default 0.2 % of each clearance"),
    ] = None
    angles: Annotated[int, Quantity("1", minimum=ANGLES_MIN, maximum=7200, help="angles of a contour")] = 360
    most_clearance: Annotated[
        float | None, Quantity("m", above=0.0, help="largest radial clearance that a worn joint may have")
    ] = None

    coefficients: Coefficients = field(default_factory=dict)
    loads: LoadsKind = "simulated"

    def __post_init__(self) -> None:
        check_quantities(self)
        for pair in self.coefficients:
            if pair.count("/") != 1:
                raise InputError(f"coefficients: '{pair}'", "the materials of journal and bearing", "'steel/bronze'")
