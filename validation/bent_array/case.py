"""Paper's array with bars that bend, by two formulations."""

from __future__ import annotations

from validation.bent_array.reference import BentArray
from validation.case import Case, Check, run

__all__ = ["CASE"]

NAME = "bent_array"
BARS = {"tube": (42743.0, 7.5e7, 3.4e-3), "solid bar": (2252.0, 7.6e7, 6e-3)}  # EI [N m^2], EA [N], end [s]

ELEMENTS, FINER, MODES = 16, 32, 24
"""Elements of our chains; elements of the second formulation against modes, where both have converged; and modes."""

ONE_UNIT = "tube", 3.0e-3  # Bar and end [s] of the run with one unit


def checks() -> list[Check]:
    """Check time, approach speed and force of the first contact, and the work of the drive until shortly after it."""
    found = []
    for name, (bending, axial, until) in BARS.items():
        found += _first_contact(name, bending, axial, until, ELEMENTS, f"elements={ELEMENTS}")
        found += _first_contact(name, bending, axial, until, FINER, f"modes={MODES}")
    name, until = ONE_UNIT
    bending, axial, _ = BARS[name]
    return [*found, *_first_contact(name, bending, axial, until, FINER, f"modes={MODES}", units=1), *_stroke()]


def _first_contact(
    name: str, bending: float, axial: float, until: float, elements: int, ours: str, units: int = 2
) -> list[Check]:
    """Compare both formulations: `elements` of the second one, and `ours` for a bar of the package."""
    impacts, work = BentArray(elements, bending, axial, units).run(until)
    run_ours = run(
        NAME,
        f"structure.units={units}",
        f"bending.0.bending_stiffness={bending:g} N m^2",
        f"bending.0.axial_stiffness={axial:g} N",
        f"bending.0.{ours}",
        f"run.until={until:g} s",
    )
    first, kind, chain = impacts[0], "second formulation", ours.startswith("elements")
    speed = 1e-3 if units == 2 else 1e-2  # the clamp has no strain with modes, which matters more for one unit
    which = f"{name}, {ours.replace('=', ' ')}" + (", one unit" if units == 1 else "")
    said = f"{which}: first contact"
    return [
        Check(f"{said} [s]", first.instant, float(run_ours["contact_start"][0]), 1e-4 if chain else 1e-3, kind),
        Check(f"{said}: approach speed [m/s]", first.speed, float(run_ours["approach_speed"][0]), speed, kind),
        Check(f"{said}: peak force [N]", first.force, float(run_ours["peak_force"][0]), 1e-2, kind),
        Check(f"{which}: work of the drive until {1e3 * until:g} ms [J]", work, float(run_ours["drive_work"][-1]), 1e-2, kind),
    ]


def _stroke() -> list[Check]:
    """Check the largest force and the work of the drive over the whole stroke."""
    bending, axial, _ = BARS["tube"]
    impacts, work = BentArray(8, bending, axial).run(50e-3)
    ours = run(NAME, "bending.0.elements=8", "run.until=50 ms")
    largest, kind = max(impact.force for impact in impacts), "second formulation"
    said = "tube, 8 elements, stroke of 50 ms"
    return [
        Check(f"{said}: work of the drive [J]", work, float(ours["drive_work"][-1]), 1e-3, kind),
        Check(f"{said}: largest force [N]", largest, float(ours["peak_force"].max()), 5e-2, kind),
    ]


CASE = Case(NAME, "Scissor array of bars that bend", checks, quick=False)
