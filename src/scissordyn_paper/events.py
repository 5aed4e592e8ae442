"""The first contacts at 0.5 mm without friction, compared with a second program."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import xarray as xr

DEGREE = 180.0 / math.pi


@dataclass(frozen=True)
class Column:
    """A column of the table of contacts."""

    variable: str  # In the run
    title: str
    unit: str
    factor: float  # Shown number per number in SI units
    reference: tuple[str, ...]  # One per contact, with the digits that are equal for tolerances of 2e-13 and 3e-14


REFERENCE = (
    Column("contact_start", "starts", "s", 1.0, ("0.0013651259130", "0.0031639798805", "0.0053665921273")),
    Column("approach_speed", "approach speed", "m/s", 1.0, ("0.73514298384", "0.34484394745", "0.62238044736")),
    Column("contact_angle", "direction of the normal", "deg", DEGREE, ("-107.816990465", "179.866471441", "-123.959802923")),
    Column("peak_normal_force", "peak force", "N", 1.0, ("42701.9244", "82944.8947", "40856.8058")),
    Column("peak_normal_time", "time to peak", "s", 1.0, ("0.00011997917", "0.00040370370", "0.00013061164")),
    Column("contact_duration", "duration", "s", 1.0, ("0.00027482661706", "0.00099355989906", "0.00029513987981")),
    Column("rebound_speed", "rebound", "m/s", 1.0, ("-0.6236406636", "-0.2974059743", "-0.5760923414")),
)
"""Liu stiffness, Flores damping, default choice, 0.5 mm, 150 rpm, no friction, integrated in minimal coordinates with
Lagrange's equations (tests/reference/marching.py)."""


def event_table(run: xr.Dataset) -> list[tuple[str, str, str, str]]:
    """Quantity and contact, the reference, the value of the run, and the relative difference."""
    rows = []
    for contact in range(len(REFERENCE[0].reference)):
        for column in REFERENCE:
            expected = column.reference[contact]
            found = float(run[column.variable].values[contact]) * column.factor
            difference = abs(found / float(expected) - 1.0)
            shown = np.format_float_positional(found, precision=11, unique=False, fractional=False, trim="-")
            rows.append((f"contact {contact + 1}: {column.title} [{column.unit}]", expected, shown, f"{difference:.0e}"))
    return rows
