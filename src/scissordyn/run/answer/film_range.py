"""Where oil films leave the range of their model: each a line with place and time."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from scissordyn.laws.oil import RANGE
from scissordyn.model.clearance import Clearance
from scissordyn.model.lubrication import Lubrication
from scissordyn.plan.plan import Plan
from scissordyn.run.answer.film import MIXED
from scissordyn.run.results import Run

THICKENS = 1e8
"""Pressure [Pa] from which on the viscosity of mineral oils is several times higher and steel yields to the film."""

TURBULENT = 41.2
"""Taylor's number for vortices: Reynolds' number rho U c/mu over the root of R/c."""

INERT = 1.0
"""Reynolds number of a squeeze film, rho c |e'|/mu, from which on the inertia of the oil is no small part of its pressure."""

VACUUM = 1.0
"""Pressure [Pa] below which an oil of unknown vapour pressure is said to evaporate."""

WARMED = 0.8
"""Viscosity after heating over that before, below which the given temperature is no longer meant."""


def film_warnings(plan: Plan, run: Run) -> list[str]:
    """Films that were too thin, torn, boiling, too hot or turbulent, or under too high a pressure."""
    found = list[str]()
    for k, (joint, gap, oil) in enumerate(plan.lubricated):

        def of(name: str, k: int = k) -> float:
            return float(run.variables[f"film_{name}"].values[k])

        label = f"joint '{joint.name}'"
        found += _thin(label, oil, of)
        found += _pressed(label, of("peak_pressure"), of("peak_pressure_time"))
        found += _torn(label, oil, of)
        found += _around(label, oil)
        found += _inertia(label, gap, of)
        found += _hot(label, oil, of("heating"))
    return found


def film_peak_warnings(name: str, oil: Lubrication, gap: Clearance, largest: dict[str, float]) -> list[str]:
    """Of a run without samples: by the largest eccentricity [m] and pressure [Pa] of a joint's film."""
    label, found = f"joint '{name}'", list[str]()
    least = gap.clearance - largest["eccentricity"]
    if least < MIXED * oil.roughness:
        found.append(f"{label}: the film is thinner than three roughnesses of {oil.roughness:.3g} m, least {least:.3g} m")
    return found + _pressed(label, largest["pressure"]) + _around(label, oil)


def _thin(label: str, oil: Lubrication, of: Any) -> list[str]:
    least = of("least_thickness")
    if not least < MIXED * oil.roughness:
        return []
    part = of("dry_share") + of("mixed_share")
    return [
        f"{label}: the film is thinner than three roughnesses of {oil.roughness:.3g} m for {part:.2g} of the run, "
        f"least {least:.3g} m at t = {of('least_thickness_time'):.6g} s in the direction "
        f"{math.degrees(of('least_thickness_angle')):.3g} deg; peaks carry there, which the film's force does not know"
    ]


def _pressed(label: str, pressure: float, when: float | None = None) -> list[str]:
    if not pressure > THICKENS:
        return []
    at = "" if when is None else f" (t = {when:.6g} s)"
    return [
        f"{label}: film pressures reach {pressure:.2g} Pa{at}; above {THICKENS:.0e} Pa oil thickens and surfaces yield: "
        "its forces are those of rigid surfaces"
    ]


def _torn(label: str, oil: Lubrication, of: Any) -> list[str]:
    """Pressures below those that the oil can follow."""
    tension, bears = of("peak_tension"), oil.ambient_pressure - oil.vapour_pressure
    if not tension > max(bears, 0.0):
        return []
    where = f"{tension:.2g} Pa below the surroundings at t = {of('peak_tension_time'):.6g} s"
    if oil.full:
        return [
            f"{label}: the full film pulls with pressures down to {where}; oil boils {bears:.2g} Pa below them: "
            "full = true is not possible there"
        ]
    return [
        f"{label}: the film cavitates beyond the model: to follow the journal its oil would have to go to {where}, and for "
        f"{of('torn_share'):.2g} of the run to more than the {max(bears, 0.0):.2g} Pa that drive oil back; the model fills the "
        "clearance at any time, so films after that can be too strong"
    ]


def _around(label: str, oil: Lubrication) -> list[str]:
    """Oil that boils or evaporates in its surroundings."""
    around = f"at the {oil.ambient_pressure:.3g} Pa around it"
    if 0.0 < oil.vapour_pressure >= oil.ambient_pressure:
        return [f"{label}: the oil boils {around}: its vapour pressure is {oil.vapour_pressure:.3g} Pa"]
    if oil.ambient_pressure < VACUUM and oil.vapour_pressure == 0.0:
        return [
            f"{label}: oil evaporates in a vacuum, {around}; the film stays in the model: give the vapour_pressure of an oil "
            "that is made for a vacuum, or leave the joint dry"
        ]
    return []


def _inertia(label: str, gap: Clearance, of: Any) -> list[str]:
    """Flows that are not laminar, or whose inertia counts."""
    found = list[str]()
    number, limit = of("reynolds_number"), TURBULENT * math.sqrt(gap.journal_radius / gap.clearance)
    if number > limit:
        found.append(f"{label}: Reynolds' number {number:.3g} exceeds {limit:.3g}, above which the film has vortices")
    squeeze = of("squeeze_reynolds_number")
    if squeeze > INERT:
        found.append(
            f"{label}: the squeeze Reynolds number rho c |e'|/mu reaches {squeeze:.3g}; above {INERT:g} the inertia of the "
            "oil, which the film does not have, is no small part of its pressure"
        )
    return found


def _hot(label: str, oil: Lubrication, rise: float) -> list[str]:
    """Oil that the power lost warms out of its state."""
    if not np.isfinite(rise):
        return []
    temperature = oil.temperature + rise
    warmed = f"{label}: the power lost would warm the oil by {rise:.3g} K if nothing cooled it"
    if temperature > RANGE[1]:
        return [f"{warmed}, beyond {RANGE[1] - 273.15:g} deg C, where oils evaporate and boil; in the model it stays as it is"]
    if oil.oil is None:
        return []
    before, after = oil.dynamic_viscosity, oil.oil.viscosity(temperature)
    if after < WARMED * before:
        return [f"{warmed}, and its viscosity fall from {before:.3g} to {after:.3g} Pa s; both are fixed in the model"]
    return []
