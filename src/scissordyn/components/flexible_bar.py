"""Straight flexible bar as one component: cross-sections at chosen positions, and bending modes between them."""

from __future__ import annotations

from typing import Annotated

from scissordyn.components import elastic
from scissordyn.components.declaration import component
from scissordyn.components.port.axis import AXIS
from scissordyn.components.time_function import Factor
from scissordyn.errors import InputError
from scissordyn.units import Meaning, Quantity

# Unit, bounds and help text of the number of bending modes
MODES = Quantity(
    "1",
    minimum=0,
    maximum=40,
    help="number of bending modes with all attached points held; by default those up to the frequency of contacts",
)


@component(
    port=AXIS,
    context=("factor", "factor_rate"),
    supplied=True,
    symbol="beam",
    example={
        "sections": ["crank", "rod"],
        "places": "0, 0.5 m",
        "modes": 4,
        "axial_stiffness": "75 MN",
        "bending_stiffness": "43 kN m^2",
        "mass_per_length": "2.84 kg/m",
        "time_function": {"cycloidal": {"start": 0, "end": 1, "duration": "60 s"}},
    },
    source="Gerstmayr and Irschik 2008, doi:10.1016/j.jsv.2008.04.019 (absolute coordinates of a bar); "
    "Craig and Bampton 1968, doi:10.2514/3.4741 (modes with the attached points held)",
)
class FlexibleBar:
    r"""Straight Euler-Bernoulli bar between cross-sections: large rotations and deflections, small strains.

    .. math:: r(s) = \sum_i N_i(s)\,p_i + \sum_k \varphi_k(s)\,a_k,\qquad
        U = \tfrac12 \int EI\,(|r''|^2 - \varepsilon'^2) + EA\,\varepsilon^2\,ds,\quad \varepsilon = |r'| - 1

    p are the points of the cross-sections, and the directions of clamped ones; a are the vector amplitudes of the lowest
    bending modes with these held. The mass matrix is constant. The bracket is the squared curvature if the strain is neglected.
    A heated bar has no stress at the strain alpha Delta T and the curvature alpha Delta T_h/h. With damping, the stress is
    E (strain + tau strain rate).
    """

    name: str
    sections: Annotated[tuple[str, ...], Meaning("bodies with their origins on its axis, from one end to the other")]
    places: Annotated[tuple[float, ...], Quantity("m", help="positions of the cross-sections along the bar")]
    axial_stiffness: elastic.AxialStiffness
    bending_stiffness: elastic.BendingStiffness
    mass_per_length: Annotated[
        float,
        Quantity("kg/m", above=0.0, help="mass per length, part of the cross-sections'", tied=elastic.SECTION_OR_MATERIAL),
    ]
    modes: Annotated[int | None, MODES] = None
    turned: Annotated[tuple[float, ...], Quantity("rad", help="angle of the bar against the x axis of each cross-section")] = ()
    depth: elastic.Depth = 0.0
    youngs_modulus: elastic.Modulus = 0.0
    yield_strength: elastic.YieldStrength = 0.0
    damping: elastic.Damping = 0.0
    thermal_expansion: elastic.Expansion = 0.0
    temperature_rise: elastic.Warmer = 0.0
    temperature_difference: elastic.Across = 0.0
    time_function: Factor = None

    def check(self) -> None:
        count = len(self.sections)
        if count < 2 or len(set(self.sections)) != count or len(self.places) != count:
            raise InputError(
                f"flexible bar '{self.name}' has {count} sections and {len(self.places)} places", "at least two of both"
            )
        if any(b <= a for a, b in zip(self.places, self.places[1:], strict=False)):
            raise InputError(
                f"flexible bar '{self.name}': the places of its cross-sections do not increase",
                "positions along the bar from one end to the other",
            )
        if self.turned and len(self.turned) != count:
            raise InputError(f"flexible bar '{self.name}' has {len(self.turned)} angles", f"none, or {count}")
        elastic.check_depth(self, f"flexible bar '{self.name}'")

    @property
    def length(self) -> float:
        """Unstrained length from end to end [m]."""
        return self.places[-1] - self.places[0]

    @property
    def angles(self) -> tuple[float, ...]:
        """Angles of the bar relative to its cross-sections [rad]."""
        return self.turned or (0.0,) * len(self.sections)

    def parameters(self, start: tuple[float, ...]) -> tuple[float, ...]:
        """Return the kernel's parameters."""
        stiffness = self.axial_stiffness, self.bending_stiffness, self.damping
        return (*stiffness, *elastic.thermal_loads(self), self.length)
