"""Change lengths and angles of a case so that a dragged joint moves to the pointer."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass

import numpy as np

from scissordyn.casefile.quantity import unit_factor
from scissordyn.errors import InputError
from scissordyn.explore.case import Case
from scissordyn.explore.field import Field
from scissordyn.model.mechanism import Mechanism
from scissordyn.model.options import Options
from scissordyn.plot.animation_scene import outline, upright_turns
from scissordyn.record.placement import Placement, turned
from scissordyn.record.results import Run
from scissordyn.run.simulate import compute_results
from scissordyn.tolerance import DIFFERENCE_FRACTION

# Tables of a case file whose lengths and angles a drag with the mouse may change
GEOMETRY_TABLES = ("structure", "body", "ground", "guide", "rod")
EXCLUDED_KEYS = ("gravity_direction", "corner_radius", "thickness", "journal_radius", "bearing_length", "phase")
"""Keys in `GEOMETRY_TABLES` with lengths and angles that a drag with the mouse does not change."""


def assembled(mechanism: Mechanism) -> tuple[Run, Mechanism]:
    """Return the assembled mechanism with ideal joints: a run of two samples at its start, and the ideal mechanism."""
    instant = 1e-9  # duration of the run that computes the assembled position [s]
    ideal = mechanism.ideal()
    return compute_results(ideal, Options(until=instant, samples=2)), ideal


@dataclass(frozen=True)
class _Parameter:
    """Scalar parameter that a drag may change: the value of a field, or one coordinate of a point."""

    field: Field
    part: int

    @property
    def value(self) -> float:
        return self.field.value[self.part]


class Drag:
    """Drag of a joint, or of the length of a bar.

    A drag changes two parameters for a joint and one for a length. Among all candidates, those that move the target with the
    smallest changes are chosen.
    """

    def __init__(self, case: Case, kind: str, name: str) -> None:
        self.start = self.case = case
        self.kind, self.name = kind, name
        self.size = case.mechanism.size
        run, ideal = assembled(case.mechanism)
        self.origin = self._target(run, ideal)
        self.run, self.ideal = run, ideal
        self.present = self.origin
        self.numbers = self._numbers()
        self.values = np.array([number.value for number in self.numbers])
        self.chosen, self.inverse = self._choice()
        self.texts: dict[str, str] = {}

    def _target(self, run: Run, ideal: Mechanism) -> np.ndarray:
        placement = Placement.at(ideal, run, [0])
        if self.kind == "pin":
            return np.asarray(placement.place(ideal.joint(self.name).bearing)[0])
        ends = outline(ideal.body(self.name))
        if len(ends) < 2:  # a cross-section of a bending bar
            raise InputError(f"'{self.name}' has no length to drag", "a rigid bar, a joint, or the fields of the form")
        return np.array([math.dist(ends[0], ends[-1])])

    def _numbers(self) -> list[_Parameter]:
        return [
            _Parameter(field, part)
            for field in self.start.fields.values()
            if str(field.place[0]) in GEOMETRY_TABLES
            and field.quantity.unit in ("m", "rad")
            and field.name not in EXCLUDED_KEYS
            and not {"clearance", "contact", "motion"} & set(field.place)
            for part in range(len(field.value))
        ]

    def _slopes(self) -> np.ndarray:
        """Return the derivatives of the target by finite differences; zero if the changed mechanism cannot be assembled."""
        slopes = np.zeros((self.origin.size, len(self.numbers)))
        for k, number in enumerate(self.numbers):
            step = DIFFERENCE_FRACTION * (1.0 if number.field.quantity.unit == "rad" else self.size)
            try:
                changed = self.start.changed(self._texts({k: number.value + step}, exact=True))
                slopes[:, k] = (self._target(*assembled(changed.mechanism)) - self.origin) / step
            except (InputError, ValueError):
                continue
        return slopes

    def _choice(self) -> tuple[tuple[int, ...], np.ndarray]:
        """Return the indices of the parameters to change, and the pseudo-inverse of their derivatives."""
        one_point = 1.5  # factor by which both coordinates of one point are preferred to parameters of different parts
        least = 1e-3  # parameters with a smaller effect than this fraction of the largest are ignored
        slopes = self._slopes()
        # multiply angles by a radius, to compare them with lengths
        scale = np.array([1.0 if number.field.quantity.unit == "m" else 1.0 / self.size for number in self.numbers])
        effect = slopes * scale
        strength = np.linalg.norm(effect, axis=0)
        moving = np.flatnonzero(strength > least * max(1e-9, float(strength.max(initial=0.0))))
        if moving.size == 0 or strength.max(initial=0.0) < least:
            what = f"joint '{self.name}'" if self.kind == "pin" else f"the length of '{self.name}'"
            raise InputError(f"no length or angle of the case moves {what}", "another joint, or the fields of the form")
        most = min(self.origin.size, moving.size)
        best: tuple[float, tuple[int, ...]] = (0.0, ())
        for count in range(most, 0, -1):
            for chosen in itertools.combinations(moving.tolist(), count):
                weakest = float(np.linalg.svd(effect[:, chosen], compute_uv=False)[-1])
                if len({self.numbers[k].field.key for k in chosen}) < count:  # both coordinates of one point
                    weakest *= one_point
                if weakest > best[0] * (1.0 + 1e-9):
                    best = weakest, chosen
            if best[0] > 0.05:
                break
        return best[1], np.linalg.pinv(slopes[:, best[1]])

    def _texts(self, values: dict[int, float], *, exact: bool = False) -> dict[str, str]:
        """Return the texts of the fields with changed values, in the fields' own units."""
        fields: dict[str, tuple[Field, list[float]]] = {}
        for k, value in values.items():
            number = self.numbers[k]
            _, parts = fields.setdefault(number.field.key, (number.field, list(number.field.value)))
            parts[number.part] = value
        digits = 17 if exact else 6
        texts = {}
        for key, (field, parts) in fields.items():
            unit = field.unit or field.quantity.unit
            factor = unit_factor(unit, field.quantity.unit)
            texts[key] = ", ".join(f"{part / factor:.{digits}g}" for part in parts) + f" {unit}"
        return texts

    def move_target(self, dx: float, dy: float, *, steps: int = 2) -> None:
        """Change the parameters so that the target moves to (dx, dy) from its original position [m], by Newton steps."""
        close = 1e-4  # the target is reached at this distance, as a fraction of the mechanism's size
        destination = self._wanted(dx, dy)
        for _ in range(steps):
            remaining = destination - self.present
            if np.linalg.norm(remaining) < close * self.size:
                return
            change = self.inverse @ remaining
            values = self.values.copy()
            values[list(self.chosen)] += change
            texts = self._texts({k: float(values[k]) for k in self.chosen})
            case = self.start.changed(texts)
            run, ideal = assembled(case.mechanism)
            self.present = self._target(run, ideal)
            self.values, self.case, self.run, self.ideal, self.texts = values, case, run, ideal, texts

    def _wanted(self, dx: float, dy: float) -> np.ndarray:
        shortest = 0.02  # smallest length of a dragged bar as a fraction of its original length
        moved = turned(np.array([dx, dy]), -upright_turns(self.ideal))
        if self.kind == "pin":
            return np.asarray(self.origin + moved)
        placement = Placement.at(self.ideal, self.run, [0])
        ends = placement.points(self.name, outline(self.ideal.body(self.name))[[0, -1]])[0]
        along = (ends[1] - ends[0]) / max(1e-12, float(np.linalg.norm(ends[1] - ends[0])))
        longer = float(along @ moved)
        length: np.ndarray = np.maximum(self.origin + longer, shortest * self.origin)
        return length

    @property
    def note(self) -> str:
        """Changed values as text."""
        return ", ".join(f"{self.start.field(key).label} {text}" for key, text in self.texts.items())
