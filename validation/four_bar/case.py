"""Four-bar linkage with three clearance joints, against Lagrange multipliers."""

from __future__ import annotations

from reference.marching import March
from reference.multipliers import Multipliers
from validation.case import Case, Check, mechanism, run

__all__ = ["CASE"]

NAME = "four_bar"
UNTIL, CONTACTS = 0.012, 6  # End of the run [s], number of contacts that are compared


def checks() -> list[Check]:
    """Check the first contacts of the three joints in order of time."""
    one = mechanism(NAME)
    found = run(NAME, until=UNTIL, samples=11, rtol=1e-12, atol=1e-12)
    march = March(Multipliers(one), rtol=1e-12, atol=1e-12).run(UNTIL, most_contacts=CONTACTS)
    names = [joint.name for joint in one.clearance_joints]
    made = []
    for k, contact in enumerate(march.contacts[:CONTACTS]):
        mine = found.isel(contact=k)
        joint = names[contact.joint]
        if str(mine["contact_joint"].values) != joint:
            raise RuntimeError(f"contact {k + 1} is at '{mine['contact_joint'].values}', by the reference at '{joint}'")
        for name, reference, unit in (
            ("contact_start", contact.start, "s"),
            ("approach_speed", contact.approach_speed, "m/s"),
            ("peak_force", contact.peak_force, "N"),
        ):
            label = f"contact {k + 1}, {joint}: {name.replace('_', ' ')} [{unit}]"
            made.append(Check(label, reference, float(mine[name]), 1e-7, "second formulation"))
    return made


CASE = Case(NAME, "Four-bar linkage with three clearance joints", checks)
