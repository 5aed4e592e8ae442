"""Synchronisation of the units of an array: how far each is from the deployment of the first."""

from __future__ import annotations

import re

import numpy as np

from scissordyn.mechanics.outputs import Record
from scissordyn.plan.plan import Plan
from scissordyn.run.results import Variables, described, labels

BAR = re.compile(r"(unit \d+)/bar ([12])")


def units_of(plan: Plan) -> dict[str, tuple[int, int]]:
    """The scissor units of a mechanism: for each the places of its bars 1 and 2 among the bodies."""
    bars: dict[str, dict[str, int]] = {}
    for place, body in enumerate(plan.bodies):
        match = BAR.fullmatch(body.name)
        if match and body.rotates:
            bars.setdefault(match[1], {})[match[2]] = place
    return {unit: (pair["1"], pair["2"]) for unit, pair in bars.items() if len(pair) == 2}


def synchronisation_variables(plan: Plan, record: Record) -> Variables:
    """The synchronisation error of each unit, along `unit`; nothing for fewer than two units.

    With phi_1 and phi_2 the angles of its bars, the deployment angle of a unit is half of the angle between them,
    th = (phi_1 - phi_2)/2; in a straight array that is the inclination of the bars. In an ideal array of equal units all units
    have the same deployment angle at every instant. The synchronisation error of unit k is the difference

        e_k = th_k - th_1
    """
    units = units_of(plan)
    if len(units) < 2:
        return {}
    first, second = np.array(list(units.values())).T
    opening = 0.5 * (record.angle[:, first] - record.angle[:, second])
    error = opening - opening[:, :1]
    error -= np.pi * np.round(error[:1] / np.pi)  # a full turn more or less in the angle that a bar was given
    largest = np.max(np.abs(error), axis=0, initial=0.0)
    about = "deployment angle of the unit less that of the first one"
    return {
        "unit": labels("unit", list(units)),
        "synchronisation_error": described(("time", "unit"), error, "rad", about),
        "peak_synchronisation_error": described("unit", largest, "rad", "largest sampled size of the synchronisation error"),
    }
