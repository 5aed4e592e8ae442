"""Warn about laws that are used outside their range of validity."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from scissordyn.laws.contact import Damping, Elastic, Friction, JointContact, TangentElastic
from scissordyn.laws.damping.exact import returned_restitution
from scissordyn.laws.damping.proportional import DampingFactor
from scissordyn.laws.evaluate import elastic_forces
from scissordyn.laws.trial import doubts
from scissordyn.plugin.element import is_built_in, pointers, row_of
from scissordyn.warning import RunWarning, warning

LAW_SAMPLES = 400  # Number of indentations at which a contact law is evaluated; values between them are interpolated


def contact_failure(joint: str, contact: JointContact, indentation: float, kind: str = "joint", *, margin: float = 0.0) -> str:
    """Return the reason why the contact model of a joint or a component has failed; "" if it has not.

    No law describes an indentation above the journal's radius, or above a corner's radius and gap.
    """
    deepest = max(contact.journal_radius, contact.gap)
    if indentation <= (1.0 - margin) * deepest:
        return ""
    radius = "corner radius" if kind == "joint" else "radius"
    what = "gap" if contact.gap == deepest else radius if contact.plane else "journal radius"
    reached = "reaches" if margin else "exceeds"
    return (
        f"{kind} '{joint}': indentation {1e3 * indentation:.4g} mm {reached} the {what} of {1e3 * deepest:g} mm: "
        "the contact is too soft for its load, or the time step jumped through it"
    )


def loading_warnings(
    joint: str,
    contact: JointContact,
    stiffness: Elastic,
    damping: Damping,
    reference: str,
    *,
    speed: np.ndarray,
    mass: np.ndarray,
    force: np.ndarray,
) -> list[RunWarning]:
    """Return a warning about the contact of a joint whose load exceeds that of an impact at its approach speed the most.

    The elastic energy of the contact corresponds to the speed sqrt(F_el delta/m). In an impact F_el is at least F/(1 + xi), and
    that speed is below twice the approach speed. There is no warning if no contact exceeds it. Only a damping factor describes
    an impact; `reference` is "loaded" or "onset", the speed that damping refers to.

    Shapes: approach speed [m/s], effective mass at the onset [kg] and largest normal force [N] (contacts,).
    """
    if not isinstance(damping, DampingFactor) or not damping.factor > 0.0 or not force.size:
        return []
    elastic = force / (1.0 + damping.factor)
    # at the indentation where the speed sqrt(F_el delta/m) is twice the approach speed the law has a larger force: no table
    deepest = 0.99 * 4.0 * mass * speed**2 / np.maximum(elastic, 1e-300)
    if np.all(deepest <= 2.0 * contact.journal_radius):
        at, row = pointers(stiffness)["force"], row_of(stiffness, contact)
        if np.all(elastic_forces(at, deepest, row) > elastic):
            return []
    loaded_speed = 0.5 * np.sqrt(elastic * _depths(contact, stiffness, elastic) / mass)
    beyond = loaded_speed - speed
    worst = int(np.nanargmax(np.append(beyond, 0.0)))
    if worst == force.size:
        return []
    kind = "loaded" if reference == "loaded" else "loaded at onset"
    numbers = {"speed": speed[worst], "force": force[worst], "reference": loaded_speed[worst]}
    return [warning(kind, joint, **numbers)]


def _depths(contact: JointContact, stiffness: Elastic, forces: np.ndarray) -> np.ndarray:
    """Return the indentations [m] at which an elastic law has given forces [N]; 0 for none."""
    return np.exp(np.interp(np.log(np.maximum(forces, 1e-300)), *_logarithms(contact, stiffness)))


@lru_cache(64)  # joints of one mechanism often have equal contacts
def _logarithms(contact: JointContact, stiffness: Elastic) -> tuple[np.ndarray, np.ndarray]:
    """Return the logarithms of forces [N] and indentations [m] of an elastic law, at samples with a positive force."""
    at, row = pointers(stiffness)["force"], row_of(stiffness, contact)
    depths = np.geomspace(1e-12, 2.0, LAW_SAMPLES) * contact.journal_radius
    table = elastic_forces(at, depths, row)
    positive = np.isfinite(table) & (table > 0.0)
    return np.log(table[positive]), np.log(depths[positive])


def contact_warnings(
    joint: str,
    contact: JointContact,
    stiffness: Elastic,
    damping: Damping,
    friction: Friction | None = None,
    *,
    approach_speed: Sequence[float],
    indentation: float,
    kind: str = "joint",
    plastic: float = 1e-5,
    deep: float = 0.2,
    restitution_error: float = 0.05,
) -> list[RunWarning]:
    """Return warnings about the laws of one joint, or of another kind of part, after a run.

    `plastic`: largest approach speed over the wave speed sqrt(E/rho) of an elastic impact; faster ones are plastic (Love's
    rule; Johnson 1985, doi:10.1017/CBO9781139171731).

    `deep`: [-] indentation over clearance above which a contact is not small compared with the radii.

    `restitution_error`: [-] difference of the given and the obtained restitution coefficient above which there is a warning.
    """
    slowest_wave = min(math.sqrt(m.youngs_modulus / m.density) for m in (contact.journal, contact.bearing))
    limit = plastic * slowest_wave
    fast = [speed for speed in approach_speed if speed > limit]
    (size, what), name, warnings = contact.size, stiffness.name, list[RunWarning]()
    if fast:
        warnings.append(
            warning("fast", joint, kind, fast=len(fast), contacts=len(approach_speed), limit=limit, speed=max(fast))
        )
    if stiffness.small_contact and indentation > deep * size:
        warnings.append(warning("deep", joint, kind, fraction=indentation / size, size=what, law=name, most=deep))
    if isinstance(stiffness, TangentElastic) and indentation > stiffness.deepest(contact):
        deepest = 1e3 * stiffness.deepest(contact)
        warnings.append(warning("continued", joint, kind, depth=1e3 * indentation, law=name, deepest=deepest))
    laws: dict[str, object] = {"stiffness": stiffness, "damping": damping, "friction": friction}
    for slot, law in laws.items():
        if law is not None and not is_built_in(law):
            warnings += [warning("doubt", joint, kind, slot=slot, doubt=doubt) for doubt in doubts(law, contact)]
    if stiffness.caveat:
        warnings.append(warning("caveat", joint, kind, law=name, caveat=stiffness.caveat))
    if stiffness.materials == "same" and contact.journal.compliance != contact.bearing.compliance:
        warnings.append(warning("one material", joint, kind, law=name))
    if stiffness.materials == "steel" and not all("steel" in m.name for m in (contact.journal, contact.bearing)):
        warnings.append(warning("steel", joint, kind, law=name))
    if isinstance(damping, DampingFactor):
        wanted, returned, claimed = damping.restitution, returned_restitution(damping.factor), damping.restitution_range
        if claimed is not None and not claimed[0] <= wanted <= claimed[1]:
            low, high = claimed
            warnings.append(warning("restitution range", joint, kind, law=damping.name, low=low, high=high, restitution=wanted))
        if abs(returned - wanted) > restitution_error:
            warnings.append(warning("restitution", joint, kind, law=damping.name, returned=returned, restitution=wanted))
    return warnings
