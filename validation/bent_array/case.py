"""The paper's array with bars that bend, by two formulations."""

from __future__ import annotations

from validation.bent_array.reference import BentArray
from validation.case import Case, Check, run

__all__ = ["CASE"]

NAME = "bent_array"
BARS = {"tube": (42743.0, 7.5e7, 3.4e-3), "solid bar": (2252.0, 7.6e7, 6e-3)}
"""EI [N m^2], EA [N], end [s]."""

ELEMENTS = 16


def checks() -> list[Check]:
    """Instant, approach speed and force of the first contact, and the work of the drive until after it."""
    found = []
    for name, (bending, axial, until) in BARS.items():
        impacts, work = BentArray(ELEMENTS, bending, axial).run(until)
        ours = run(
            NAME,
            f"bending.0.bending_stiffness={bending:g} N m^2",
            f"bending.0.axial_stiffness={axial:g} N",
            f"bending.0.elements={ELEMENTS}",
            f"run.until={until:g} s",
        )
        first, kind = impacts[0], "second formulation"
        said = f"{name}, {ELEMENTS} elements: first contact"
        found += [
            Check(f"{said} [s]", first.instant, float(ours["contact_start"][0]), 1e-4, kind),
            Check(f"{said}: approach speed [m/s]", first.speed, float(ours["approach_speed"][0]), 1e-3, kind),
            Check(f"{said}: peak force [N]", first.force, float(ours["peak_force"][0]), 1e-2, kind),
            Check(f"{name}: work of the drive until {1e3 * until:g} ms [J]", work, float(ours["drive_work"][-1]), 1e-2, kind),
        ]
    return [*found, *_stroke()]


def _stroke() -> list[Check]:
    """Largest force and work of the drive over the whole stroke."""
    bending, axial, _ = BARS["tube"]
    impacts, work = BentArray(8, bending, axial).run(50e-3)
    ours = run(NAME, "run.until=50 ms")
    largest, kind = max(impact.force for impact in impacts), "second formulation"
    said = "tube, 8 elements, stroke of 50 ms"
    return [
        Check(f"{said}: work of the drive [J]", work, float(ours["drive_work"][-1]), 1e-3, kind),
        Check(f"{said}: largest force [N]", largest, float(ours["peak_force"].max()), 5e-2, kind),
    ]


CASE = Case(NAME, "Scissor array of bars that bend", checks, quick=False)
