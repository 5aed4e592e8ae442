"""Warnings about laws used outside their range of validity."""

from __future__ import annotations

import math
from collections.abc import Sequence

from scissordyn.laws.contact import Continued, Damping, Elastic, Friction, JointContact
from scissordyn.laws.damping.exact import returned_restitution
from scissordyn.laws.damping.proportional import DampingFactor
from scissordyn.laws.trial import doubts
from scissordyn.plugin.element import is_ours
from scissordyn.warning import RunWarning, warning

FASTEST = 1e-5
"""Approach speed over sqrt(E/rho) above which impacts are plastic (Love's rule; Johnson 1985, doi:10.1017/CBO9781139171731)."""

DEEPEST = 0.2  # Indentation over clearance above which a contact is no longer small against the radii
OFF = 0.05  # Difference between the given and the returned restitution coefficient from which on there is a warning


def contact_failure(joint: str, contact: JointContact, indentation: float) -> str:
    """Why the contact model of a joint has failed.

    No law describes a journal pressed in by more than its own radius, or a corner by more than its radius and the gap.
    """
    deepest = max(contact.journal_radius, contact.gap)
    if indentation <= deepest:
        return ""
    what = "gap" if contact.gap == deepest else "corner radius" if contact.plane else "journal radius"
    return (
        f"joint '{joint}': indentation {1e3 * indentation:.4g} mm exceeds the {what} of {1e3 * deepest:g} mm: "
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
) -> list[RunWarning]:
    """Warnings about the laws of one joint after a run."""
    slowest_wave = min(math.sqrt(m.youngs_modulus / m.density) for m in (contact.journal, contact.bearing))
    limit = FASTEST * slowest_wave
    fast = [speed for speed in approach_speed if speed > limit]
    what, size = ("corner radius", contact.journal_radius) if contact.plane else ("clearance", contact.clearance)
    name, warnings = stiffness.name, list[RunWarning]()
    if fast:
        warnings.append(warning("fast", joint, fast=len(fast), contacts=len(approach_speed), limit=limit, speed=max(fast)))
    if stiffness.small_contact and indentation > DEEPEST * size:
        warnings.append(warning("deep", joint, fraction=indentation / size, size=what, law=name, most=DEEPEST))
    if isinstance(stiffness, Continued) and indentation > stiffness.deepest(contact):
        deepest = 1e3 * stiffness.deepest(contact)
        warnings.append(warning("continued", joint, depth=1e3 * indentation, law=name, deepest=deepest))
    laws: dict[str, object] = {"stiffness": stiffness, "damping": damping, "friction": friction}
    for slot, law in laws.items():
        if law is not None and not is_ours(law):
            warnings += [warning("doubt", joint, slot=slot, doubt=doubt) for doubt in doubts(law, contact)]
    if stiffness.caveat:
        warnings.append(warning("caveat", joint, law=name, caveat=stiffness.caveat))
    if stiffness.materials == "same" and contact.journal.compliance != contact.bearing.compliance:
        warnings.append(warning("one material", joint, law=name))
    if stiffness.materials == "steel" and not all("steel" in m.name for m in (contact.journal, contact.bearing)):
        warnings.append(warning("steel", joint, law=name))
    if isinstance(damping, DampingFactor):
        wanted, returned, claimed = damping.restitution, returned_restitution(damping.factor), damping.restitution_range
        if claimed is not None and not claimed[0] <= wanted <= claimed[1]:
            low, high = claimed
            warnings.append(warning("restitution range", joint, law=damping.name, low=low, high=high, restitution=wanted))
        if abs(returned - wanted) > OFF:
            warnings.append(warning("restitution", joint, law=damping.name, returned=returned, restitution=wanted))
    return warnings
