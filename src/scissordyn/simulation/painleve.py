"""Contacts in which friction turns the effect of the contact force round: Painlevé's paradox."""

from __future__ import annotations

import numpy as np

from scissordyn.laws.friction.none import NoFriction
from scissordyn.mechanics import functions
from scissordyn.mechanics.assembly import eccentricity_map
from scissordyn.mechanics.outputs import Record
from scissordyn.model.mechanism import Mechanism
from scissordyn.simulation.trajectory import Trajectory

__all__ = ["painleve_warnings"]

MOST_SAMPLES = 2000
"""Of those of a contact so many are looked at, evenly spread."""


def painleve_warnings(mechanism: Mechanism, path: Trajectory, found: Record) -> list[str]:
    """Contacts whose force, friction included, accelerates the surfaces into each other, in words.

    With f the normal force, mu the friction over it and n, t the normal and the tangent, the indentation accelerates by
    -f (n M n - mu n M t), M the inverse of the mass that the joints leave. Where the bracket is negative a rigid contact has no
    solution or several (Painlevé's paradox), and the motion depends on the stiffness and damping of the contact.

    Parameters
    ----------
    mechanism : Mechanism
    path : Trajectory
    found : Record
        Of its samples.

    Returns
    -------
    list of str
        One a contact.

    References
    ----------
    Champneys and Varkonyi 2016, doi:10.1093/imamat/hxw027
    """
    warnings = []
    for j, joint in enumerate(mechanism.contacts):
        assert joint.clearance is not None
        if isinstance(joint.clearance.friction, NoFriction):
            continue
        force = found.contact["normal"][:, j]
        held = np.flatnonzero((path.samples.mode[:, j] == 1) & (force > 0.0) & (found.contact["tangential"][:, j] != 0.0))
        looked_at = held[:: max(1, held.size // MOST_SAMPLES)]
        turned = [at for at in looked_at.tolist() if _pressed_together(path, found, j, at)]
        if turned:
            first = turned[0]
            ratio = abs(found.contact["tangential"][first, j]) / force[first]
            warnings.append(
                f"joint '{joint.name}': Painlevé's paradox at {len(turned)} of {looked_at.size} samples in contact, first at "
                f"t = {path.samples.time[first]:.6g} s: with friction of {ratio:.3g} of the normal force the contact force "
                "presses the surfaces together; a rigid contact has no or several solutions there, and the motion depends on stiffness "
                "and damping of the contact"
            )
    return warnings


def _pressed_together(path: Trajectory, found: Record, contact: int, at: int) -> bool:
    """Whether the force of a contact accelerates its indentation: accelerations with it less those without."""
    samples, address, state = path.samples, path.system.address, path.system.content.state
    n = path.reduced.free
    state.mode[:], state.memory[:], state.reference[:] = samples.mode[at], samples.memory[at], samples.reference[at]
    functions.activate(address)
    y, rates = samples.state[at].copy(), np.zeros((2, samples.state.shape[1]))
    functions.rate(samples.time[at], y, address, rates[0])
    state.mode[contact] = 0
    functions.rate(samples.time[at], y, address, rates[1])
    change = rates[0, n : 2 * n] - rates[1, n : 2 * n]
    vector = eccentricity_map(path.system.content, contact)
    free = vector.columns < n
    apart = vector.rows[:, free] @ change[vector.columns[free]]
    row = found.contact[at, contact]
    return bool(apart[0] * row["nx"] + apart[1] * row["ny"] > 0.0)
