"""Contact and friction laws in plain Python."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

STEEL_MODULUS = 207e9 / (2.0 * (1.0 - 0.3**2))  # [Pa] contact modulus E* of steel on steel, E = 207 GPa and nu = 0.3

Elastic = Callable[[float], float]


def liu(clearance, length, modulus=STEEL_MODULUS):
    """Return the improved elastic foundation (Liu, Zhang, Yang 2007): force [N] of an indentation [m]."""
    return lambda depth: 0.5 * math.pi * length * modulus * depth**1.5 / math.sqrt(2.0 * (clearance + depth))


def hertz(clearance, journal_radius, modulus=STEEL_MODULUS):
    """Return the force of a sphere in a spherical socket (Hertz)."""
    stiffness = 4.0 / 3.0 * modulus * math.sqrt((journal_radius + clearance) * journal_radius / clearance)
    return lambda depth: stiffness * depth**1.5


def flores(restitution):
    """Return the damping factor xi (doi:10.1007/s11044-010-9237-4)."""
    return 1.6 * (1.0 / restitution - 1.0)


def lankarani_nikravesh(restitution):
    """Return the damping factor xi (doi:10.1115/1.2912617)."""
    return 0.75 * (1.0 - restitution) * (1.0 + restitution)


@dataclass(frozen=True)
class LuGre:
    """Bristle friction (doi:10.1109/9.376053) in coefficient form; static coefficient 1.5 times the kinetic one.

    The bristle damping fades with the slip speed, within sqrt(2 e) mu_k/sigma_1.
    """

    kinetic: float  # mu_k [1]
    stiffness: float = 1e5  # sigma_0 [1/m]
    damping: float = 316.0  # sigma_1 [s/m]; there is no viscous part
    stribeck: float = 1e-3  # v_s [m/s]

    def sliding(self, slip: float) -> float:
        """Return the coefficient of steady sliding, with Stribeck's exponent 2."""
        return self.kinetic * (1.0 + 0.5 * math.exp(-((slip / self.stribeck) ** 2)))

    def evaluate(self, slip: float, bristle: float) -> tuple[float, float]:
        """Return F_t/F_n and the rate of the bristle deflection [m/s]."""
        rate = slip - self.stiffness * abs(slip) * bristle / self.sliding(slip)
        fading = 2.0 * math.e * (self.kinetic / self.damping) ** 2
        return self.stiffness * bristle + self.damping * math.exp(-slip * slip / fading) * rate, rate

    def begin(self, slip: float) -> float:
        """Return the bristle deflection at a contact's start [m]: zero at rest, that of steady sliding at high speed."""
        return math.tanh(slip / self.stribeck) * self.sliding(slip) / self.stiffness
