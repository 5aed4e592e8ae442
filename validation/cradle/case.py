"""Newton's cradle: masses that touch through clearance joints in a row."""

from __future__ import annotations

import scissordyn as sd
from validation.case import Case, Check, mechanism

__all__ = ["CASE", "cradle"]

NAME = "cradle"
COUNT, GAP, SPEED = 5, 1e-3, 1.0  # Number of masses, radial clearance [m], speed of the first mass [m/s]


def cradle(restitution: float) -> sd.Mechanism:
    """Return the row of masses with a restitution coefficient."""
    found = mechanism(NAME)
    for k in range(1, COUNT):
        found = found.replace(f"pin {k}.damping.restitution", restitution)
    return found


def checks() -> list[Check]:
    """Check the approach speeds of the impacts in a row, and the final speeds."""
    made = []
    for restitution in (1.0, 0.5):
        share = 0.5 * (1.0 + restitution)
        # the last impact begins after all gaps have been crossed, each at the speed of its mass
        crossing = [GAP / (SPEED * share**k) for k in range(COUNT - 1)]
        found = sd.simulate(
            cradle(restitution), until=sum(crossing) + 0.3 * GAP, start="as-placed", samples=11, rtol=1e-11, atol=1e-11
        )
        for k in range(COUNT - 1):
            one = found.isel(contact=k)
            speed = SPEED * share**k
            label = f"e = {restitution:g}: contact {k + 1}"
            made.append(Check(f"{label}: approach speed [m/s]", speed, float(one["approach_speed"]), 1e-9, "closed form"))
            made.append(
                Check(f"{label}: rebound speed [m/s]", -restitution * speed, float(one["rebound_speed"]), 1e-9, "closed form")
            )
        for k in range(1, COUNT + 1):
            final = SPEED * (share ** (COUNT - 1) if k == COUNT else share ** (k - 1) * (1.0 - share))
            got = float(found["velocity"].sel(body=f"mass {k}", axis="x")[-1])
            made.append(
                Check(f"e = {restitution:g}: mass {k} at the end [m/s]", final, got, 1e-9, "closed form", relative=False)
            )
    return made


CASE = Case(NAME, "Newton's cradle of journals", checks)
