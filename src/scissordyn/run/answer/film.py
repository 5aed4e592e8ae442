"""What the films of lubricated joints have come to: thickness, pressures, shares of time, Reynolds numbers."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from scissordyn.plan.plan import Plan
from scissordyn.run.advance.instants import time_mean
from scissordyn.run.results import Variable, Variables

MIXED = 3.0
"""Film thickness in roughnesses below which peaks touch (a lambda ratio of 3)."""

HEAT_CAPACITY = 2000.0
"""Of mineral oils, typical [J/(kg K)]."""


def film_variables(plan: Plan, time: np.ndarray, variables: Mapping[str, Variable]) -> Variables:
    """Least thickness, when and where, shares of time, Reynolds numbers and warming.

    Shapes: `time` (samples,) [s].
    """
    joints = plan.lubricated
    if not joints:
        return {}
    values = {
        name: variables[f"film_{name}"].values
        for name in (
            "thickness",
            "displacement",
            "tension",
            "squeeze_speed",
            "sliding_speed",
            "power_lost",
            "peak_eccentricity",
            "peak_eccentricity_time",
        )
    }
    clear = np.array([gap.clearance for _, gap, _ in joints])
    rough = np.array([oil.roughness for _, _, oil in joints])
    bears = np.array([oil.ambient_pressure - oil.vapour_pressure for _, _, oil in joints])
    inverse = np.array([oil.mass_density / oil.dynamic_viscosity for _, _, oil in joints])
    content = np.array([2.0 * math.pi * gap.journal_radius * gap.clearance * gap.bearing_length for _, gap, _ in joints])
    capacity = HEAT_CAPACITY * content * np.array([oil.mass_density for _, _, oil in joints])
    thickness, when = values["thickness"], values["peak_eccentricity_time"]
    dry, mixed = thickness <= 0.0, (thickness > 0.0) & (thickness < MIXED * rough)
    missing = np.full(len(joints), math.nan)
    dry, mixed, torn = (
        time_mean(share, time) if len(time) else missing for share in (dry, mixed, values["tension"] > np.maximum(bears, 0.0))
    )
    heat = np.trapezoid(values["power_lost"], time, axis=0) if len(time) else missing
    direction = missing
    if len(time):
        at = np.argmin(np.abs(time[:, None] - when), axis=0)
        direction = np.arctan2(*values["displacement"][at, np.arange(len(joints))].T[::-1])
    sliding, squeezing = (np.max(np.abs(values[f"{name}_speed"]), axis=0, initial=0.0) for name in ("sliding", "squeeze"))

    def described(values: np.ndarray, unit: str, text: str) -> Variable:
        return Variable(("film",), values, {"units": unit, "long_name": text})

    return {
        "film_least_thickness": described(
            clear - values["peak_eccentricity"], "m", "least film thickness, negative in contact"
        ),
        "film_least_thickness_time": described(when, "s", "instant of the least film thickness"),
        "film_least_thickness_angle": described(
            direction, "rad", "where the film is thinnest then: direction in the bearing's body, of the sample nearest to it"
        ),
        "film_dry_share": described(dry, "1", "part of the time in which the surfaces touch"),
        "film_mixed_share": described(mixed, "1", "part of the time with a film below three roughnesses"),
        "film_full_share": described(1.0 - dry - mixed, "1", "part of the time with a full film"),
        "film_torn_share": described(torn, "1", "part of the time in which the journal leaves faster than oil can follow"),
        "film_reynolds_number": described(
            inverse * clear * sliding, "1", "largest rho U c/mu of the sliding surfaces, among the samples"
        ),
        "film_squeeze_reynolds_number": described(
            inverse * clear * squeezing, "1", "largest rho c |e'|/mu of the journal's approach and leave, among the samples"
        ),
        "film_heating": described(heat / capacity, "K", "how much the power lost would warm the oil in the joint"),
    }
