"""Beam element: the elastic connection of two neighbouring cross-sections of a bending bar."""

from __future__ import annotations

import math
from typing import Annotated

from scissordyn.components import elastic
from scissordyn.components.declaration import component
from scissordyn.components.place import BodyPoint
from scissordyn.components.port import FRAME, Output
from scissordyn.components.time_function import Factor
from scissordyn.kernel import equals
from scissordyn.units import Quantity

# Gauss points and weights on 0 .. 1, exact to degree 7
_OUTER, _INNER = 0.5 * math.sqrt(3 / 7 + 2 / 7 * math.sqrt(6 / 5)), 0.5 * math.sqrt(3 / 7 - 2 / 7 * math.sqrt(6 / 5))
_WEIGHT_OUTER, _WEIGHT_INNER = (18.0 - math.sqrt(30.0)) / 72.0, (18.0 + math.sqrt(30.0)) / 72.0
_POINTS = (0.5 - _OUTER, 0.5 - _INNER, 0.5 + _INNER, 0.5 + _OUTER)  # Gauss points on 0 .. 1
_WEIGHTS = (_WEIGHT_OUTER, _WEIGHT_INNER, _WEIGHT_INNER, _WEIGHT_OUTER)  # Gauss weights on 0 .. 1


def force(
    x,
    y,
    angle,
    x_rate,
    y_rate,
    speed,
    factor,
    factor_rate,
    length,
    axial_stiffness,
    bending_stiffness,
    damping,
    thermal_strain,
    thermal_curvature,
    depth,
    modulus,
    strength,
):
    """Return force [N] and torque [N m] on the end, stored energy [J], dissipated and supplied power [W], then the outputs.

    `factor` is the value of the time function, which multiplies the thermal strain and curvature. The rotation of the
    cross-sections relative to the chord is psi(xi) = p1 b1 + p2 b2 + a b3. p1 and p2 are its end values; a follows from the end
    of the chord: int sin psi = 0.
    """
    chord, turn = math.hypot(x, y), math.atan2(y, x)
    p1, p2 = -turn, angle - turn
    a = 0.0
    cosines = slope = by_1 = by_2 = c1 = c2 = c3 = 0.0
    for attempt in range(3):  # Newton's method for a, which is of third order in p1 and p2
        sines = cosines = slope = by_1 = by_2 = c1 = c2 = c3 = 0.0
        for k in range(4):
            xi, weight = _POINTS[k], _WEIGHTS[k]
            b1, b2, b3 = 1.0 + xi * (3.0 * xi - 4.0), xi * (3.0 * xi - 2.0), 6.0 * xi * (1.0 - xi)
            psi = p1 * b1 + p2 * b2 + a * b3
            sine, cosine = weight * math.sin(psi), weight * math.cos(psi)
            sines += sine
            cosines += cosine
            slope += cosine * b3
            by_1 += cosine * b1
            by_2 += cosine * b2
            c1 += sine * b1
            c2 += sine * b2
            c3 += sine * b3
        if attempt < 2:
            a -= sines / slope
    a1, a2 = -by_1 / slope, -by_2 / slope
    # strain and bend at which the heated bar has no stress
    warm, bend = factor * thermal_strain, factor * thermal_curvature * length
    strain = chord / (length * cosines) - 1.0 - warm
    axial = axial_stiffness * strain
    rigidity, by_a = bending_stiffness / length, 12.0 * a - 6.0 * (p1 + p2)
    m1 = rigidity * (4.0 * p1 + 2.0 * p2 - 6.0 * a + by_a * a1 + bend)
    m2 = rigidity * (4.0 * p2 + 2.0 * p1 - 6.0 * a + by_a * a2 - bend)
    energy = 0.5 * axial * strain * length
    energy += rigidity * (2.0 * (p1 * p1 + p1 * p2 + p2 * p2) + 6.0 * a * (a - p1 - p2) - bend * (p2 - p1 - 0.5 * bend))
    supply = -factor_rate * length * (axial * thermal_strain + rigidity * (p2 - p1 - bend) * thermal_curvature)
    dissipation = 0.0
    if not equals(damping, 0.0):
        turning = (x * y_rate - y * x_rate) / (chord * chord)
        v1, v2 = -turning, speed - turning
        v3 = a1 * v1 + a2 * v2
        growing = (x * x_rate + y * y_rate) / chord + chord * (c1 * v1 + c2 * v2 + c3 * v3) / cosines
        strain_rate, by_v = growing / (length * cosines), 12.0 * v3 - 6.0 * (v1 + v2)
        viscous = damping * rigidity
        axial += damping * axial_stiffness * strain_rate
        m1 += viscous * (4.0 * v1 + 2.0 * v2 - 6.0 * v3 + by_v * a1)
        m2 += viscous * (4.0 * v2 + 2.0 * v1 - 6.0 * v3 + by_v * a2)
        dissipation = damping * axial_stiffness * length * strain_rate * strain_rate
        dissipation += viscous * (4.0 * (v1 * v1 + v1 * v2 + v2 * v2) + 12.0 * v3 * (v3 - v1 - v2))
    stretch = axial * chord / (cosines * cosines)
    m1 += stretch * (c1 + a1 * c3)
    m2 += stretch * (c2 + a2 * c3)
    along, across = axial / (cosines * chord), (m1 + m2) / (chord * chord)
    fibre = abs(strain) + 0.5 * depth * max(abs(m1), abs(m2)) / bending_stiffness
    use = modulus * fibre / strength if strength > 0.0 else 0.0
    fx, fy = -along * x - across * y, -along * y + across * x
    return fx, fy, -m2, energy, dissipation, supply, axial, -m1, m2, fibre, modulus * fibre, use


@component(
    port=FRAME,
    force=force,
    outputs=(
        Output("axial_force", "N", "axial force, tension positive"),
        Output("start_moment", "N m", "bending moment at the start"),
        Output("end_moment", "N m", "bending moment at the end"),
        Output("fibre_strain", "1", "largest strain of an extreme fibre, of the axis alone if the depth is unknown"),
        Output("stress", "Pa", "stress in the extreme fibre, 0 if the material is unknown"),
        Output("utilisation", "1", "stress in the extreme fibre over the yield strength, 0 if the strength is unknown"),
    ),
    context=("factor", "factor_rate"),
    supplied=True,
    symbol="beam",
    example={
        "start": "crank.end",
        "end": "rod.end",
        "length": "0.5 m",
        "axial_stiffness": "75 MN",
        "bending_stiffness": "43 kN m^2",
        "mass_per_length": "2.84 kg/m",
        "time_function": {"cycloidal": {"start": 0, "end": 1, "duration": "60 s"}},
    },
    source="Crisfield 1991, Non-linear finite element analysis of solids and structures, chapter 7, with the exact chord",
)
class Beam:
    r"""Straight Euler-Bernoulli element between two cross-sections: large rotations, small strains.

    .. math:: U = \tfrac12 EA\,l\,\varepsilon^2 + \frac{EI}{2 l}\int_0^1 \psi'^2\,d\xi,\qquad
        \varepsilon = \frac{c}{l\int\cos\psi\,d\xi} - 1,\quad \int\sin\psi\,d\xi = 0

    c is the chord. psi is the rotation of the cross-sections relative to it: quadratic in xi, plus a term that meets the second
    condition. The axial force stiffens or softens bending. The mass is distributed with cubic (Hermite) shapes. A heated bar
    has no stress at the strain alpha Delta T and the curvature alpha Delta T_h/h. With damping, the stress is
    E (strain + tau strain rate). The x axes of both bodies are along the unbent bar.
    """

    name: str
    start: BodyPoint
    end: BodyPoint
    length: Annotated[float, Quantity("m", above=0.0, help="unstrained length l")]
    axial_stiffness: elastic.AxialStiffness
    bending_stiffness: elastic.BendingStiffness
    mass_per_length: Annotated[
        float,
        Quantity("kg/m", minimum=0.0, help="mass per length, shared by both bodies", tied=elastic.SECTION_OR_MATERIAL),
    ]
    depth: elastic.Depth = 0.0
    youngs_modulus: elastic.Modulus = 0.0
    yield_strength: elastic.YieldStrength = 0.0
    damping: elastic.Damping = 0.0
    thermal_expansion: elastic.Expansion = 0.0
    temperature_rise: elastic.Warmer = 0.0
    temperature_difference: elastic.Across = 0.0
    time_function: Factor = None

    def check(self) -> None:
        elastic.check_depth(self, f"beam '{self.name}'")

    def parameters(self, start: tuple[float, ...]) -> tuple[float, ...]:
        """Return the kernel's parameters."""
        stiffness = self.axial_stiffness, self.bending_stiffness, self.damping
        return self.length, *stiffness, *elastic.thermal_loads(self), self.depth, self.youngs_modulus, self.yield_strength
