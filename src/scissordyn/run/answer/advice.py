"""Warnings as a user reads them: many equal ones in one line, what they mean in numbers, and what to change."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from scissordyn.laws.contact import Elastic, JointContact
from scissordyn.laws.elastic.liu import Liu
from scissordyn.laws.elastic.persson import Persson
from scissordyn.laws.evaluate import elastic_force
from scissordyn.model.mechanism import Mechanism
from scissordyn.plugin.element import addresses, row_of

OF_ONE = re.compile(r"(?P<what>joint|guide|actuator|latch) '(?P<name>[^']*)': (?P<said>.*)", re.DOTALL)
"""A warning about one part."""

NUMBER = re.compile(r"(?<![\w.'])-?\d+(?:\.\d+)?(?:e[+-]?\d+)?(?![\w'])")

FAST = re.compile(
    r"(?P<fast>\d+) of (?P<all>\d+) contacts start faster than (?P<limit>\S+) m/s \(up to (?P<speed>\S+) m/s\); above that"
)
DEEP = re.compile(r"indentation reaches (?P<percent>\d+)% of the clearance; '(?P<law>[^']*)' assumes a contact that is small")

MEANS = "that means: "
"""How a line begins that says what the warning before it means."""

NAMED = 3
"""Most names of parts in one line."""

POINTS = 400
"""Indentations over which a force is integrated."""

YIELDED = 1.0 / 3.0
"""Power of the approach speed over its limit by which an elastic force is larger than that of surfaces that yield at a constant
pressure p: with a = sqrt(2 R delta) and F = 2 p a L the energy is (2/3) p L a^3/R, so F grows as v^(2/3), while the force of an
elastic line contact grows as v (Johnson 1985, Contact Mechanics, section 11.5, there for a ball)."""


class _One(NamedTuple):
    what: str
    name: str
    said: str


def read_warnings(warnings: Sequence[str], mechanism: Mechanism | None = None) -> list[str]:
    """The warnings of a run as lines for a user."""
    return _in_order(warnings, _groups(warnings), mechanism)


def condensed(warnings: Sequence[str]) -> list[str]:
    """Equal warnings about several parts in one line, with the ranges of their numbers and the part with the worst."""
    return _in_order(warnings, _groups(warnings), None, meant=False)


def _groups(warnings: Sequence[str]) -> dict[tuple[str, str], list[_One]]:
    """Warnings about one part each by what they say without numbers."""
    found: dict[tuple[str, str], list[_One]] = {}
    for match in filter(None, map(OF_ONE.fullmatch, warnings)):
        found.setdefault(_key(match["what"], match["said"]), []).append(_One(match["what"], match["name"], match["said"]))
    return found


def _key(what: str, said: str) -> tuple[str, str]:
    return what, NUMBER.sub("#", said)


def _in_order(
    warnings: Sequence[str], parts: dict[tuple[str, str], list[_One]], mechanism: Mechanism | None, *, meant: bool = True
) -> list[str]:
    """Each group where its first warning was."""
    found, done = list[str](), set[tuple[str, str]]()
    for text in warnings:
        match = OF_ONE.fullmatch(text)
        if match is None:
            found.append(text)
            continue
        key = _key(match["what"], match["said"])
        if key not in done:
            done.add(key)
            found.append(_line(parts[key]))
            found += _meant(parts[key], mechanism) if meant else []
    return found


def _line(group: list[_One]) -> str:
    """One line for warnings that differ in their numbers."""
    if len(group) == 1:
        return f"{group[0].what} '{group[0].name}': {group[0].said}"
    numbers = np.array([[float(text) for text in NUMBER.findall(one.said)] for one in group])
    texts = [NUMBER.findall(one.said) for one in group]
    pieces, said = NUMBER.split(group[0].said), ""
    for k, piece in enumerate(pieces):
        said += piece
        if k < numbers.shape[1]:
            low, high = int(np.argmin(numbers[:, k])), int(np.argmax(numbers[:, k]))
            same = numbers[low, k] == numbers[high, k]
            said += texts[low][k] if same else f"{texts[low][k]} to {texts[high][k]}"
    names = [f"'{one.name}'" for one in group[:NAMED]] + ([f"{len(group) - NAMED} more"] if len(group) > NAMED else [])
    worst = ""
    varying = np.flatnonzero(np.ptp(numbers, axis=0) > 0.0) if numbers.size else np.empty(0, int)
    if varying.size:
        worst = f"; the worst is '{group[int(np.argmax(numbers[:, _ranked(group[0].said, varying)]))].name}'"
    return f"{len(group)} {group[0].what}s ({', '.join(names)}): {said}{worst}"


def _ranked(said: str, varying: np.ndarray) -> int:
    """Which number says how bad it is: the speed of contacts that start fast, otherwise the first that differs."""
    return 3 if FAST.match(said) and 3 in varying else int(varying[0])


def _meant(group: list[_One], mechanism: Mechanism | None) -> list[str]:
    """What a warning means for the forces, and what to change; nothing where that is not known."""
    fast = [(float(match["speed"]) / float(match["limit"]), one.name) for one in group if (match := FAST.match(one.said))]
    if fast:
        ratio, name = max(fast)
        over = ratio**YIELDED
        factor = f"{100.0 * (over - 1.0):.0f} %" if over < 1.5 else f"a factor of {over:.2g}"
        return [
            f"{MEANS}the computed force is an upper bound; where the surfaces yield it is too large by about {factor} in the "
            f"fastest contact, at '{name}'. To bound it, compare with a lower restitution; a smaller clearance or a slower "
            "drive lowers the approach speeds"
        ]
    deep = [(int(match["percent"]), one.name) for one in group if (match := DEEP.match(one.said))]
    if deep and mechanism is not None:
        percent, name = max(deep)
        return _other_laws(mechanism, name, 0.01 * percent)
    return []


def _other_laws(mechanism: Mechanism, name: str, part: float) -> list[str]:
    """The force of laws for contacts that are not small, at the same energy."""
    gap = next((joint.clearance for joint in mechanism.clearance_joints if joint.name == name), None)
    if gap is None or gap.surfaces.plane:
        return []
    ratios = {
        law.name: force_at_equal_energy(gap.stiffness, law, gap.surfaces, part * gap.clearance) for law in (Liu(), Persson())
    }
    said = " and ".join(f"{ratio:.2g} times the force by '{law}'" for law, ratio in ratios.items())
    return [
        f"{MEANS}an impact as strong as the deepest one at '{name}' has {said}, laws for contacts that are not small; "
        f'the computed force is as uncertain as these differ. To change: stiffness = "persson", or a larger clearance'
    ]


def force_at_equal_energy(law: Elastic, other: Elastic, contact: JointContact, indentation: float) -> float:
    """Force of another law over that of a law, at an indentation and at the one with the same elastic energy.

    An impact ends where its energy is stored: laws are compared at equal energy, not at equal indentation.
    """
    depth = indentation * np.linspace(0.0, 1.0, POINTS)
    own = _forces(law, contact, depth)
    energy = float(np.trapezoid(own, depth))
    reach = indentation
    for _ in range(60):
        depth = reach * np.linspace(0.0, 1.0, POINTS)
        theirs = _forces(other, contact, depth)
        stored = np.concatenate([[0.0], np.cumsum(0.5 * (theirs[1:] + theirs[:-1]) * np.diff(depth))])
        if stored[-1] >= energy:
            break
        reach *= 2.0
    return float(np.interp(energy, stored, theirs)) / float(own[-1])


def _forces(law: Elastic, contact: JointContact, depth: np.ndarray) -> np.ndarray:
    row, address = row_of(law, contact), addresses(law)["force"]
    return np.array([0.0, *(elastic_force(address, each, row) for each in depth[1:].tolist())])
