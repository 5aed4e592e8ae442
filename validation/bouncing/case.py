"""Bouncing in a bearing: the restitution coefficient of every damping factor."""

from __future__ import annotations

import math

from scipy.optimize import brentq

import scissordyn as sd
from scissordyn.laws.catalogue import BY_KIND
from validation.case import Case, Check, mechanism

__all__ = ["CASE"]

NAME = "bouncing"
NOMINAL, SPEED, GAP = 0.5, 0.5, 1e-3  # Nominal restitution coefficient, first approach speed [m/s], radial clearance [m]
FACTORS = {
    "carvalho-martins": lambda e: 1.5 * (1 - e) * (11 - e) / (1 + 9 * e),
    "flores": lambda e: 8 * (1 - e) / (5 * e),
    "herbert-mcwhannell": lambda e: 6 * (1 - e) / ((2 * e - 1) ** 2 + 3),
    "hu-guo": lambda e: 1.5 * (1 - e) / e,
    "hunt-crossley": lambda e: 1.5 * (1 - e),
    "lankarani-nikravesh": lambda e: 0.75 * (1 - e**2),
    "lee-wang": lambda e: 0.75 * (1 - e),
    "safaeifar-farshidianfar": lambda e: 5 * (1 - e) / (4 * e),
    "zhiying-qishao": lambda e: 0.75 * (1 - e**2) * math.exp(2 * (1 - e)),
}
"""Damping factors xi of the restitution coefficient, copied from their sources independently of the package."""


def returned(xi: float) -> float:
    """Return the restitution coefficient of an impact with the damping factor `xi`."""
    return brentq(lambda e: math.log((1 + xi) / (1 - xi * e)) - xi * (1 + e), 1e-6, min(1.0, (1 - 1e-12) / xi), xtol=1e-15)


def journal(law: str) -> sd.Mechanism:
    """Return the journal in its bearing with a damping law."""
    return mechanism(NAME).replace("pin.damping", BY_KIND["damping"][law](restitution=NOMINAL))


def checks() -> list[Check]:
    """Check the rebound speeds of the first two bounces."""
    made = []
    for law in (*FACTORS, "exact"):
        e = NOMINAL if law == "exact" else returned(FACTORS[law](NOMINAL))
        found = sd.simulate(
            journal(law), until=GAP / SPEED * (1.05 + 2.2 / e), start="as-placed", samples=3, rtol=1e-11, atol=1e-11
        )
        for k in range(2):
            back = float(found["rebound_speed"][k])
            made.append(Check(f"{law}: rebound speed {k + 1} [m/s]", -SPEED * e ** (k + 1), back, 1e-8, "closed form"))
    return made


CASE = Case(NAME, "Bouncing with known restitution", checks)
