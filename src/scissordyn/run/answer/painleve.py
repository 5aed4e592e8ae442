"""Contacts in which friction turns the effect of the contact force round: Painlevé's paradox."""

from __future__ import annotations

import numpy as np

from scissordyn.laws.friction.none import NoFriction
from scissordyn.mechanics.outputs import Record, rates_without, sampled
from scissordyn.run.advance.trajectory import Trajectory
from scissordyn.warning import RunWarning, warning

MOST_SAMPLES, FEWEST = 600, 10
"""So many samples of a run are looked at, shared by its contacts and evenly spread over each, and no fewer of a contact."""


def painleve_warnings(path: Trajectory, run: Record) -> list[RunWarning]:
    """Contacts whose force, friction included, accelerates the surfaces into each other.

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
        # the solver of impulses of a hard contact warns of what it cannot solve
        if isinstance(joint.clearance.friction, NoFriction) or joint.clearance.contact == "hard":
            continue
        force, friction = run.contact["normal"][:, j], run.contact["tangential"][:, j]
        touching = np.flatnonzero((path.samples.mode[:, j] == 1) & (force > 0.0) & (friction != 0.0))
        samples = touching[:: -(-touching.size // share) or 1]
        paradox = _pressed_together(path, run, j, samples)
        if paradox.size:
            first = paradox[0]
            ratio, time = abs(friction[first]) / force[first], path.samples.time[first]
            numbers = {"count": paradox.size, "samples": samples.size, "time": time, "ratio": ratio}
            warnings.append(warning("painleve", joint.name, **numbers))
    return warnings


def _pressed_together(path: Trajectory, run: Record, contact: int, samples: np.ndarray) -> np.ndarray:
    """The samples at which the force of a contact accelerates its indentation: accelerations with it less those without."""
    vector, n = path.plan.eccentricity(contact), path.plan.coordinates.free
    free = vector.columns < n
    columns, rows = vector.columns[free], vector.rows[:, free]
    rates = np.zeros((samples.size, path.samples.state.shape[1]))
    rates_without(sampled(path.samples), np.ascontiguousarray(samples), contact, path.system.address, rates)
    apart = (run.A[samples][:, columns] - rates[:, n + columns]) @ rows.T
    row = run.contact[samples, contact]
    return np.asarray(samples[apart[:, 0] * row["nx"] + apart[:, 1] * row["ny"] > 0.0])
