"""Warnings about laws used outside their range of validity."""

from __future__ import annotations

import math
from collections.abc import Sequence

from scissordyn.annotation import is_a
from scissordyn.laws.contact import Continued, Damping, Doubtful, Elastic, Friction, JointContact
from scissordyn.laws.damping.exact import returned_restitution
from scissordyn.laws.damping.proportional import DampingFactor
from scissordyn.laws.user import element_doubts
from scissordyn.plugin.element import is_ours

FASTEST = 1e-5
"""Approach speed over sqrt(E/rho) above which impacts are plastic (Love's rule; Johnson 1985, doi:10.1017/CBO9781139171731)."""

DEEPEST = 0.2
"""Indentation over clearance above which a contact is no longer small against the radii."""

OFF = 0.05
"""Difference between the given and the returned restitution coefficient from which on there is a warning."""


def contact_failure(joint: str, contact: JointContact, indentation: float) -> str:
    """Why the contact model of a joint has failed: no law describes a journal pressed in by more than its own radius."""
    if indentation <= contact.journal_radius:
        return ""
    what = "corner radius" if contact.plane else "journal radius"
    return (
        f"joint '{joint}': indentation {1e3 * indentation:.4g} mm exceeds the {what} of {1e3 * contact.journal_radius:g} mm: "
        "the contact is too soft for its load, or the time step jumped through it"
    )


def contact_warnings(
    joint: str,
    contact: JointContact,
    stiffness: Elastic,
    damping: Damping,
    friction: Friction | None = None,
    *,
    approach_speed: Sequence[float],
    indentation: float,
) -> list[str]:
    """Warnings about the laws of one joint after a run."""
    warnings = []
    where = f"joint '{joint}': "
    slowest_wave = min(math.sqrt(m.youngs_modulus / m.density) for m in (contact.journal, contact.bearing))
    limit = FASTEST * slowest_wave
    fast = [speed for speed in approach_speed if speed > limit]
    if fast:
        warnings.append(
            f"{where}{len(fast)} of {len(approach_speed)} contacts start faster than {limit:.2g} m/s "
            f"(up to {max(fast):.3g} m/s); above that impacts are not elastic and contact forces are estimates"
        )
    what, size = ("corner radius", contact.journal_radius) if contact.plane else ("clearance", contact.clearance)
    if stiffness.small_contact and indentation > DEEPEST * size:
        warnings.append(
            f"{where}indentation reaches {indentation / size:.0%} of the {what}; "
            f"'{stiffness.name}' assumes a contact that is small against the radii, up to {DEEPEST:.0%}"
        )
    if is_a(stiffness, Continued) and indentation > stiffness.deepest(contact):
        warnings.append(
            f"{where}indentation reaches {1e3 * indentation:.3g} mm; '{stiffness.name}' describes up to "
            f"{1e3 * stiffness.deepest(contact):.3g} mm and is continued along its tangent"
        )
    laws: dict[str, object] = {"stiffness": stiffness, "damping": damping, "friction": friction}
    for kind, law in laws.items():
        doubts: list[str] = []
        if is_a(law, Doubtful):
            doubts = law.doubts(contact)
        elif law is not None and not is_ours(law):
            doubts = element_doubts(law, contact)
        warnings += [f"{where}{kind} law: {doubt}" for doubt in doubts]
    if stiffness.caveat:
        warnings.append(f"{where}'{stiffness.name}': {stiffness.caveat}")
    if stiffness.materials == "same" and contact.journal.compliance != contact.bearing.compliance:
        warnings.append(f"{where}'{stiffness.name}' is for two surfaces of one material")
    if stiffness.materials == "steel" and not all("steel" in m.name for m in (contact.journal, contact.bearing)):
        warnings.append(f"{where}'{stiffness.name}' has the constants of steel built in")
    if isinstance(damping, DampingFactor):
        wanted, returned = damping.restitution, returned_restitution(damping.factor)
        claimed = damping.restitution_range
        if claimed is not None and not claimed[0] <= wanted <= claimed[1]:
            warnings.append(
                f"{where}'{damping.name}' is for restitution coefficients from {claimed[0]:g} to {claimed[1]:g}, not {wanted:g}"
            )
        if abs(returned - wanted) > OFF:
            warnings.append(
                f"{where}'{damping.name}' returns a restitution coefficient of {returned:.3f} for {wanted:g}; "
                "the damping law 'exact' returns the given one"
            )
    return warnings
