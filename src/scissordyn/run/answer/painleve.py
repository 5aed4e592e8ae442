"""Contacts in which friction turns the effect of the contact force round: Painlevé's paradox."""

from __future__ import annotations

import numpy as np

from scissordyn.laws.friction.none import NoFriction
from scissordyn.mechanics.outputs import Record, rates_without, sampled
from scissordyn.run.advance.trajectory import Trajectory

MOST_SAMPLES, FEWEST = 600, 10
"""So many samples of a run are looked at, shared by its contacts and evenly spread over each, and no fewer of a contact."""


def painleve_warnings(path: Trajectory, found: Record) -> list[str]:
    """Contacts whose force, friction included, accelerates the surfaces into each other, in words.

    With f the normal force, mu the friction over it and n, t the normal and the tangent, the indentation accelerates by
    -f (n M n - mu n M t), M the inverse of the mass that the joints leave. Where the bracket is negative a rigid contact has no
    solution or several (Painlevé's paradox), and the motion depends on the stiffness and damping of the contact.

    References
    ----------
    Champneys and Varkonyi 2016, arXiv:1601.03545
    """
    warnings, contacts = [], path.plan.contacts
    share = max(FEWEST, MOST_SAMPLES // max(1, len(contacts)))
    for j, joint in enumerate(contacts):
        assert joint.clearance is not None
        # the solver of impulses of a hard contact says what it cannot solve
        if isinstance(joint.clearance.friction, NoFriction) or joint.clearance.contact == "hard":
            continue
        force, friction = found.contact["normal"][:, j], found.contact["tangential"][:, j]
        held = np.flatnonzero((path.samples.mode[:, j] == 1) & (force > 0.0) & (friction != 0.0))
        looked_at = held[:: -(-held.size // share) or 1]
        turned = _pressed_together(path, found, j, looked_at)
        if turned.size:
            first, ratio = turned[0], abs(friction[turned[0]]) / force[turned[0]]
            warnings.append(
                f"joint '{joint.name}': Painlevé's paradox at {turned.size} of {looked_at.size} samples in contact, first at "
                f"t = {path.samples.time[first]:.6g} s: with friction of {ratio:.3g} of the normal force the contact force "
                "presses the surfaces together; a rigid contact has no or several solutions there, and the motion depends on "
                "stiffness and damping of the contact"
            )
    return warnings


def _pressed_together(path: Trajectory, found: Record, contact: int, looked_at: np.ndarray) -> np.ndarray:
    """The samples at which the force of a contact accelerates its indentation: accelerations with it less those without."""
    vector, n = path.plan.eccentricity(contact), path.plan.coordinates.free
    free = vector.columns < n
    columns, rows = vector.columns[free], vector.rows[:, free]
    rates = np.zeros((looked_at.size, path.samples.state.shape[1]))
    rates_without(sampled(path.samples), np.ascontiguousarray(looked_at), contact, path.system.address, rates)
    apart = (found.A[looked_at][:, columns] - rates[:, n + columns]) @ rows.T
    row = found.contact[looked_at, contact]
    return np.asarray(looked_at[apart[:, 0] * row["nx"] + apart[:, 1] * row["ny"] > 0.0])
