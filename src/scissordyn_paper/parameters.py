"""Table of parameters: those that the paper's text states, and two sets of those in its lost tables."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from scissordyn_paper.cases import CLEARANCES, CONTROLLED, DRIVEN_BAR_TEXTS, FRICTION, SPEEDS, Choice, PaperCase, three_digits
from scissordyn_paper.page import Cell, table

STATED_PARAMETERS = (
    ("length of a bar", "m", "2"),
    ("mass of a bar", "kg", "5.68"),
    ("mass of the slider", "kg", "5"),
    ("speed of the driven bar", "rpm", ", ".join(PaperCase(speed=speed).rpm for speed in SPEEDS)),
    ("radial clearance", "mm", ", ".join(f"{1e3 * size:g}" for size in sorted({*CLEARANCES, *CONTROLLED}))),
    ("kinetic friction coefficient", "1", ", ".join(f"{friction:g}" for friction in FRICTION)),
)
"""Parameters that the paper's text states: name, unit and value."""

STIFFNESS_TEXTS = {
    "liu": "Liu's elastic foundation",
    "bai-zhao-as-printed": "Bai and Zhao, as printed",
    "hertz": "Hertz",
}
DAMPING_TEXTS = {
    "flores": "Flores 2011",
    "lankarani-nikravesh": "Lankarani and Nikravesh 1990",
    "gonthier": "Gonthier 2004",
    "zhiying-qishao": "Qin and Lu 2006",
}


@dataclass(frozen=True)
class Parameter:
    """Row of the table: a parameter whose value the paper's text does not state."""

    name: str
    unit: str  # "" if the value is not a number
    value: Callable[[Choice], str]  # Function from a choice to the text of the value


def _materials(choice: Choice) -> str:
    return choice.material if not choice.bearing_material else f"{choice.material} in {choice.bearing_material}"


def _integrator(choice: Choice) -> str:
    step = f", fixed step of {three_digits(1e6 * choice.step)} µs" if choice.step else ", step size by error control"
    return f"{choice.method}, tolerance {choice.tolerance:g}{step}"


PARAMETERS = (
    Parameter("driven bar", "", lambda choice: DRIVEN_BAR_TEXTS[choice.driven_bar].removesuffix(" driven")),
    Parameter("motion of the driven bar", "", lambda choice: f"its angle is {choice.travel}"),
    Parameter("angle at the start", "deg", lambda choice: three_digits(math.degrees(choice.angle))),
    Parameter("gravity", "m/s²", lambda choice: three_digits(choice.gravity)),
    Parameter("start of the journal", "", lambda choice: choice.start),
    Parameter("journal radius", "mm", lambda choice: three_digits(1e3 * choice.journal_radius)),
    Parameter("bearing length", "mm", lambda choice: three_digits(1e3 * choice.bearing_length)),
    Parameter("materials", "", _materials),
    Parameter("contact stiffness", "", lambda choice: STIFFNESS_TEXTS[choice.stiffness]),
    Parameter("contact damping", "", lambda choice: DAMPING_TEXTS.get(choice.damping, choice.damping)),
    Parameter("restitution coefficient", "1", lambda choice: three_digits(choice.restitution)),
    Parameter("sliding speed taken at", "", lambda choice: choice.slip.replace("-", " ")),
    Parameter("static over kinetic friction", "1", lambda choice: three_digits(choice.static)),
    Parameter("Stribeck speed", "mm/s", lambda choice: three_digits(1e3 * choice.stribeck_speed)),
    Parameter("bristle stiffness over normal force", "1/m", lambda choice: three_digits(choice.bristle_stiffness)),
    Parameter("bristle damping over normal force", "s/m", lambda choice: three_digits(choice.bristle_damping)),
    Parameter("viscous friction over normal force", "s/m", lambda choice: three_digits(choice.viscous)),
    Parameter("integrator", "", _integrator),
)


def parameter_table(first: Choice, best: Choice) -> str:
    """Return the table of all parameters in HTML: name, unit, and values of two choices."""
    rows: list[Sequence[str | Cell] | str] = ["Stated in the paper's text"]
    rows += [(name, unit, Cell(value, "nowrap"), "the same") for name, unit, value in STATED_PARAMETERS]
    rows.append("In the lost tables, or ambiguous in the text")
    for one in PARAMETERS:
        values = [one.value(choice) for choice in (first, best)]
        rows.append((one.name, one.unit, values[0], "the same" if values[0] == values[1] else values[1]))
    return table(("parameter", "unit", "this report", "best-agreeing set"), rows)
