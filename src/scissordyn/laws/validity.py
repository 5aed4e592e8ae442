"""Warnings about laws used outside their range of validity."""

from __future__ import annotations

import math
from collections.abc import Sequence

from scissordyn.laws.contact import Damping, Elastic, JointContact, Proportional
from scissordyn.laws.damping.exact import returned_restitution

__all__ = ["DEEPEST", "FASTEST", "OFF", "contact_warnings"]

FASTEST = 1e-5
"""Approach speed over sqrt(E/rho) above which impacts are plastic (Love's rule; Johnson 1985, doi:10.1017/CBO9781139171731)."""

DEEPEST = 0.2
"""Indentation over clearance above which a contact is no longer small against the radii."""

OFF = 0.05
"""Difference between the given and the returned restitution coefficient from which on there is a warning."""


def contact_warnings(
    joint: str,
    contact: JointContact,
    stiffness: Elastic,
    damping: Damping,
    *,
    approach_speed: Sequence[float],
    indentation: float,
) -> list[str]:
    """Warnings about the laws of one joint after a run.

    Parameters
    ----------
    joint : str
        Name of the joint.
    contact : JointContact
        Its surfaces.
    stiffness, damping
        Its laws.
    approach_speed : sequence of float
        delta'(-) of the recorded contacts [m/s].
    indentation : float
        Deepest indentation of the run [m].

    Returns
    -------
    list of str
        One sentence each; empty for none.
    """
    found = []
    where = f"joint '{joint}': "
    slowest_wave = min(math.sqrt(m.youngs_modulus / m.density) for m in (contact.journal, contact.bearing))
    limit = FASTEST * slowest_wave
    fast = [speed for speed in approach_speed if speed > limit]
    if fast:
        found.append(
            f"{where}{len(fast)} of {len(approach_speed)} contacts start faster than {limit:.2g} m/s "
            f"(up to {max(fast):.3g} m/s); above that impacts are not elastic and contact forces are estimates"
        )
    what, size = ("corner radius", contact.journal_radius) if contact.plane else ("clearance", contact.clearance)
    if stiffness.small_contact and indentation > DEEPEST * size:
        found.append(
            f"{where}indentation reaches {indentation / size:.0%} of the {what}; "
            f"'{stiffness.name}' assumes a contact that is small against the radii, up to {DEEPEST:.0%}"
        )
    if stiffness.caveat:
        found.append(f"{where}'{stiffness.name}': {stiffness.caveat}")
    if stiffness.materials == "same" and contact.journal.compliance != contact.bearing.compliance:
        found.append(f"{where}'{stiffness.name}' is for two surfaces of one material")
    if stiffness.materials == "steel" and not all("steel" in m.name for m in (contact.journal, contact.bearing)):
        found.append(f"{where}'{stiffness.name}' has the constants of steel built in")
    if isinstance(damping, Proportional):
        asked, returned = damping.restitution, returned_restitution(damping.factor)
        claimed = damping.restitution_range
        if claimed is not None and not claimed[0] <= asked <= claimed[1]:
            found.append(
                f"{where}'{damping.name}' is for restitution coefficients from {claimed[0]:g} to {claimed[1]:g}, not {asked:g}"
            )
        if abs(returned - asked) > OFF:
            found.append(
                f"{where}'{damping.name}' returns a restitution coefficient of {returned:.3f} for {asked:g}; "
                "the damping law 'exact' returns the given one"
            )
    return found
