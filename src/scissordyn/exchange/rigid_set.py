"""Find the rigid bodies that lengths and directions between points form."""

from __future__ import annotations

import cmath
import math
from collections.abc import Hashable, Iterable, Iterator, Mapping
from itertools import combinations, permutations
from typing import NamedTuple

from scissordyn.components.place import GROUND
from scissordyn.model.disjoint_sets import DisjointSets
from scissordyn.tolerance import DATA_TOL

Pair = frozenset[int]  # Two pins


class Slide(NamedTuple):
    """Condition that a pin stays on a line, which is attached to any of some pins and turns with a direction."""

    pin: int
    anchors: tuple[int, ...]
    turn: Hashable  # Member of the classes of directions
    angle: float  # [rad]
    label: str


class RigidSets:
    """Sets of pins that form the ground and the bodies of a sketch.

    `lengths` has classes of lengths that fix each other: pairs of pins, "fixed", and other keys. `turns` has classes of
    directions that turn together: pairs of pins and the ground.
    """

    def __init__(self, places: Mapping[int, complex]) -> None:
        self.places = places  # Positions of the pins [m]
        self.pins, self.lengths, self.turns = DisjointSets(), DisjointSets(), DisjointSets()
        self.bodies: list[set[int]] = [set()]  # Pins of the ground, then those of each body
        self.slides: list[Slide] = []
        self.middles: list[tuple[str, int, Pair]] = []  # Pins in the middle of pairs
        self.relations: list[tuple[str, Hashable, Hashable]] = []  # Directions that turn together, by constraint
        self.rest: list[tuple[str, set[int]]] = []  # Constraints that have no effect, and their pins
        self.images: list[dict[int, int]] = []  # Copies of pins by their originals

    def angle(self, pair: Pair) -> float:
        """Return the direction from one pin to the other [rad]."""
        return cmath.phase(self.places[max(pair)] - self.places[min(pair)])

    def relate(self, label: str, first: Hashable, second: Hashable) -> None:
        """Let two directions turn together; each pin of a pair then slides on a body at the other pin."""
        self.turns.join(first, second)
        self.relations.append((label, first, second))
        for pair in (turn for turn in (first, second) if isinstance(turn, frozenset)):
            for pin, anchor in permutations(sorted(pair)):
                self.slides.append(Slide(pin, (anchor,), pair, self.angle(pair), label))

    def find_bodies(self, pairs: Iterable[Pair] = ()) -> None:
        """Add bodies for pairs of fixed length, and unite the bodies that constraints hold together."""
        fixed = self.lengths.find("fixed")
        for pair in dict.fromkeys((*pairs, *self.lengths.above)):
            is_bar = isinstance(pair, frozenset) and len(pair) == 2 and self.lengths.find(pair) == fixed
            if is_bar and not any(pair <= body for body in self.bodies):
                self.bodies.append({*pair})
        while self._grow():
            pass

    def _turn_of(self, body: int) -> Hashable:
        return frozenset(sorted(self.bodies[body])[:2]) if body else GROUND

    def slides_by_body(self) -> dict[tuple[int, int], list[Slide]]:
        """Return the slides of each pin on each body that holds their lines, by body and pin."""
        for index, body in enumerate(self.bodies):
            for pair in [pair for pair in self.turns.above if isinstance(pair, frozenset) and pair <= body]:
                self.turns.join(self._turn_of(index), pair)
        slides: dict[tuple[int, int], list[Slide]] = {}
        for slide in self.slides:
            for index, body in enumerate(self.bodies):
                turns = self.turns.find(slide.turn) == self.turns.find(self._turn_of(index))
                if turns and slide.pin not in body and not body.isdisjoint(slide.anchors):
                    slides.setdefault((index, slide.pin), []).append(slide)
        return slides

    def _grow(self) -> bool:
        """Unite two bodies, or add a pin to a body, where constraints hold them together; return False if there are none."""
        slides_by_body = self.slides_by_body()
        for (index, pin), slides in slides_by_body.items():
            if any(abs(math.sin(a.angle - b.angle)) > DATA_TOL for a, b in combinations(slides, 2)):
                self.bodies[index].add(pin)
                return True
        for _, pin, pair in self.middles:
            for body in self.bodies:
                if pair <= body and pin not in body:
                    body.add(pin)
                    return True
        bodies_at: dict[int, list[int]] = {}
        for index, body in enumerate(self.bodies):
            for pin in body:
                bodies_at.setdefault(pin, []).append(index)
        touching = {pair for indices in bodies_at.values() for pair in permutations(indices, 2)}
        for first, second in sorted(touching):
            shared = self.bodies[first] & self.bodies[second]
            same = self.turns.find(self._turn_of(first)) == self.turns.find(self._turn_of(second))
            if len(shared) > 1 or same or any((first, pin) in slides_by_body for pin in self.bodies[second] - shared):
                return self._unite(first, second)
        for first, second in sorted(touching):
            for third in {index for pin in self.bodies[second] for index in bodies_at[pin] if (index, first) in touching}:
                if first < second < third and not self.bodies[first] & self.bodies[second] & self.bodies[third]:
                    return self._unite(first, second, third)
        return self._copy()

    def _unite(self, *indices: int) -> bool:
        first, *others = sorted(indices)
        for index in reversed(others):
            self.turns.join(self._turn_of(first), self._turn_of(index))
            self.bodies[first] |= self.bodies.pop(index)
        return True

    def _copy(self) -> bool:
        """Add the copies of bodies and of pins on the ground."""
        for image in self.images:
            for index, body in enumerate(list(self.bodies)):
                copied = {image[pin] for pin in body if pin in image}
                if index == 0 and not copied <= body:
                    body |= copied
                    return True
                if index and len(copied) > 1 and not any(copied <= other for other in self.bodies):
                    self.bodies.append(copied)
                    return True
        return False

    def _body_of(self, turn: Hashable) -> int | None:
        return next((k for k, body in enumerate(self.bodies) if isinstance(turn, frozenset) and turn <= body), None)

    def couplings(self) -> list[tuple[str, int, int]]:
        """Return each pair of bodies that turn together but move apart, by index, with the label of its constraint."""
        ground, couplings, linked = self.turns.find(GROUND), list[tuple[str, int, int]](), DisjointSets()
        for label, *turns in self.relations:
            a, b = (self._body_of(turn) for turn in turns)
            if a and b and self.turns.find(turns[0]) != ground and linked.find(a) != linked.find(b):
                linked.join(a, b)
                couplings.append((label, b, a))
        return couplings

    def unused_constraints(self) -> Iterator[str]:
        """Yield the constraints that the bodies, their guides and their couplings do not keep."""
        ground = self.turns.find(GROUND)
        kept_labels = {slide.label for slides in self.slides_by_body().values() for slide in slides}
        for label, *turns in self.relations:
            a, b = (0 if turn == GROUND else self._body_of(turn) for turn in turns)
            coupled = a != b and self.turns.find(turns[0]) != ground
            if label not in kept_labels and (a is None or b is None or not (a == b or coupled)):
                yield label
        related = {label for label, *_ in self.relations}
        rest = [
            (slide.label, {slide.pin, *slide.anchors}) for slide in self.slides if slide.label not in {*kept_labels, *related}
        ]
        for label, pins in (*rest, *((label, {pin, *pair}) for label, pin, pair in self.middles), *self.rest):
            if not any(pins <= body for body in self.bodies):
                yield label
