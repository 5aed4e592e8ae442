"""Where oil films leave the range of their model: warnings with place and time."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from scissordyn.laws.oil import RANGE
from scissordyn.model.clearance import Clearance
from scissordyn.model.lubrication import Lubrication
from scissordyn.plan.plan import Plan
from scissordyn.run.answer.film import MIXED
from scissordyn.run.results import Run
from scissordyn.warning import RunWarning, warning

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


NUMBERS = (
    *("least_thickness", "least_thickness_time", "least_thickness_angle", "dry_share", "mixed_share", "torn_share", "heating"),
    *("peak_pressure", "peak_pressure_time", "peak_tension", "peak_tension_time"),
    *("reynolds_number", "squeeze_reynolds_number"),
)
"""What the warnings read of a film."""


def film_warnings(plan: Plan, run: Run) -> list[RunWarning]:
    """Films that were too thin, torn, boiling, too hot or turbulent, or under too high a pressure."""
    warnings = list[RunWarning]()
    for k, (joint, gap, oil) in enumerate(plan.lubricated):
        film = {name: float(run.variables[f"film_{name}"].values[k]) for name in NUMBERS}
        name, pressure = joint.name, film["peak_pressure"]
        if film["least_thickness"] < MIXED * oil.roughness:
            numbers = {
                "roughness": oil.roughness,
                "fraction": film["dry_share"] + film["mixed_share"],
                "least": film["least_thickness"],
                "time": film["least_thickness_time"],
                "angle": math.degrees(film["least_thickness_angle"]),
            }
            warnings.append(warning("thin film", name, **numbers))
        if pressure > THICKENS:
            time = film["peak_pressure_time"]
            warnings.append(warning("film pressure", name, pressure=pressure, time=time, limit=THICKENS))
        warnings += _torn(name, oil, film) + _around(name, oil) + _inertia(name, gap, film) + _hot(name, oil, film["heating"])
    return warnings


def film_peak_warnings(name: str, oil: Lubrication, gap: Clearance, largest: dict[str, float]) -> list[RunWarning]:
    """Of a run without samples: by the largest eccentricity [m] and pressure [Pa] of a joint's film."""
    warnings, least, pressure = list[RunWarning](), gap.clearance - largest["eccentricity"], largest["pressure"]
    if least < MIXED * oil.roughness:
        warnings.append(warning("thin film in a case", name, roughness=oil.roughness, least=least))
    if pressure > THICKENS:
        warnings.append(warning("film pressure in a case", name, pressure=pressure, limit=THICKENS))
    return warnings + _around(name, oil)


def _torn(name: str, oil: Lubrication, film: Mapping[str, float]) -> list[RunWarning]:
    """Pressures below those that the oil can follow."""
    tension, time, bears = film["peak_tension"], film["peak_tension_time"], oil.ambient_pressure - oil.vapour_pressure
    if not tension > max(bears, 0.0):
        return []
    if oil.full:
        return [warning("full film pulls", name, tension=tension, time=time, bears=bears)]
    return [warning("cavitation", name, tension=tension, time=time, fraction=film["torn_share"], bears=max(bears, 0.0))]


def _around(name: str, oil: Lubrication) -> list[RunWarning]:
    """Oil that boils or evaporates in its surroundings."""
    if 0.0 < oil.vapour_pressure >= oil.ambient_pressure:
        return [warning("boiling", name, ambient=oil.ambient_pressure, vapour=oil.vapour_pressure)]
    if oil.ambient_pressure < VACUUM and oil.vapour_pressure == 0.0:
        return [warning("vacuum", name, ambient=oil.ambient_pressure)]
    return []


def _inertia(name: str, gap: Clearance, film: Mapping[str, float]) -> list[RunWarning]:
    """Flows that are not laminar, or whose inertia counts."""
    number, limit = film["reynolds_number"], TURBULENT * math.sqrt(gap.journal_radius / gap.clearance)
    squeeze = film["squeeze_reynolds_number"]
    warnings = [warning("vortices", name, number=number, limit=limit)] if number > limit else []
    return warnings + ([warning("squeeze", name, number=squeeze, limit=INERT)] if squeeze > INERT else [])


def _hot(name: str, oil: Lubrication, rise: float) -> list[RunWarning]:
    """Oil that the power lost warms out of its state."""
    if not np.isfinite(rise):
        return []
    temperature = oil.temperature + rise
    if temperature > RANGE[1]:
        return [warning("oil boils off", name, rise=rise, limit=RANGE[1] - 273.15)]
    if oil.oil is None:
        return []
    before, after = oil.dynamic_viscosity, oil.oil.viscosity(temperature)
    return [warning("oil warms", name, rise=rise, before=before, after=after)] if after < WARMED * before else []
