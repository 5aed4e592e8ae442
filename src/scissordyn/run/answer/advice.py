"""Warnings as a user reads them: like ones in one line, what they mean in numbers, and what to change."""

from __future__ import annotations

import json

import numpy as np

from scissordyn.laws.contact import Elastic, JointContact
from scissordyn.laws.elastic.liu import Liu
from scissordyn.laws.elastic.persson import Persson
from scissordyn.laws.evaluate import elastic_force
from scissordyn.model.mechanism import Mechanism
from scissordyn.plugin.element import pointers, row_of
from scissordyn.run.results import Run
from scissordyn.warning import RunWarning, group, line, plain

MEANS = "that means: "  # How a line begins that says what the warning before it means
POINTS = 400  # Indentations over which a force is integrated

YIELDED = 1.0 / 3.0
"""Power of the approach speed over its limit by which an elastic force is larger than that of surfaces that yield at a constant
pressure p: with a = sqrt(2 R delta) and F = 2 p a L the energy is (2/3) p L a^3/R, so F grows as v^(2/3), while the force of an
elastic line contact grows as v (Johnson 1985, Contact Mechanics, section 11.5, there for a ball)."""


def warnings_of(run: Run) -> list[RunWarning]:
    """The warnings of a run; sentences without numbers of one that an earlier version has saved."""
    data = run.attrs.get("warning_data")
    return plain(json.loads(run.attrs["warnings"])) if data is None else [RunWarning(**item) for item in json.loads(data)]


def warning_lines(warnings: list[RunWarning], mechanism: Mechanism | None = None) -> list[str]:
    """Like warnings about several parts in one line each, followed by what they mean where that is known."""
    return [text for alike in group(warnings) for text in (line(alike), *_meaning(alike, mechanism))]


def _meaning(alike: list[RunWarning], mechanism: Mechanism | None) -> list[str]:
    """What a warning means for the forces, and what to change."""
    if alike[0].kind == "fast":
        ratio, name = max((item.numbers["speed"] / item.numbers["limit"], item.part) for item in alike)
        over = ratio**YIELDED
        factor = f"{100.0 * (over - 1.0):.0f} %" if over < 1.5 else f"a factor of {over:.2g}"
        return [
            f"{MEANS}the computed force is an upper bound; where the surfaces yield it is too large by about {factor} in the "
            f"fastest contact, at '{name}'. To bound it, compare with a lower restitution; a smaller clearance or a slower "
            "drive lowers the approach speeds"
        ]
    if alike[0].kind == "deep" and alike[0].numbers["size"] == "clearance" and mechanism is not None:
        part, name = max((item.numbers["fraction"], item.part) for item in alike)
        return _other_laws(mechanism, name, part)
    return []


def _other_laws(mechanism: Mechanism, name: str, part: float) -> list[str]:
    """The force of laws for contacts that are not small, at the same energy."""
    gap = next((joint.clearance for joint in mechanism.clearance_joints if joint.name == name), None)
    if gap is None:
        return []
    laws = Liu(), Persson()
    ratios = [force_at_equal_energy(gap.stiffness, law, gap.surfaces, part * gap.clearance) for law in laws]
    forces = " and ".join(f"{ratio:.2g} times the force by '{law.name}'" for ratio, law in zip(ratios, laws, strict=True))
    return [
        f"{MEANS}an impact as strong as the deepest one at '{name}' has {forces}, laws for contacts that are not small; "
        f'the computed force is as uncertain as these differ. To change: stiffness = "persson", or a larger clearance'
    ]


def force_at_equal_energy(law: Elastic, other: Elastic, contact: JointContact, indentation: float) -> float:
    """Force of another law over that of a law, at an indentation and at the one with the same elastic energy.

    An impact ends where its energy is stored: laws are compared at equal energy, not at equal indentation.
    """
    depth = indentation * np.linspace(0.0, 1.0, POINTS)
    forces = _forces(law, contact, depth)
    energy = float(np.trapezoid(forces, depth))
    reach = indentation
    for _ in range(60):
        depth = reach * np.linspace(0.0, 1.0, POINTS)
        others = _forces(other, contact, depth)
        stored = np.concatenate([[0.0], np.cumsum(0.5 * (others[1:] + others[:-1]) * np.diff(depth))])
        if stored[-1] >= energy:
            break
        reach *= 2.0
    return float(np.interp(energy, stored, others)) / float(forces[-1])


def _forces(law: Elastic, contact: JointContact, depth: np.ndarray) -> np.ndarray:
    row, pointer = row_of(law, contact), pointers(law)["force"]
    return np.array([0.0, *(elastic_force(pointer, d, row) for d in depth[1:].tolist())])
