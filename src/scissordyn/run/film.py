"""What the films of lubricated joints have come to: thickness, shares of time, and where their model ends."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
import xarray as xr

from scissordyn.plan.plan import Plan
from scissordyn.run.spacing import time_mean

__all__ = ["film_variables", "film_warnings"]

MIXED = 3.0
"""Film thickness in roughnesses below which peaks touch (a lambda ratio of 3)."""

THICKENS = 1e8
"""Pressure [Pa] from which on the viscosity of mineral oils is several times higher and steel yields to the film."""

TURBULENT = 41.2
"""Taylor's number for vortices: Reynolds' number rho U c/mu over the root of R/c."""


def film_variables(plan: Plan, time: np.ndarray, variables: Mapping[str, xr.Variable]) -> dict[str, xr.Variable]:
    """Least thickness, when, largest pressure, and shares of time, from the samples.

    Parameters
    ----------
    plan : Plan
    time : ndarray, shape (samples,)
        [s]
    variables : mapping of str to Variable
        With those of the films.

    Returns
    -------
    dict
        Empty without films.
    """
    joints = plan.lubricated
    if not joints:
        return {}
    thickness, pressure = (variables[name].values for name in ("film_thickness", "film_pressure"))
    rough = np.array([oil.roughness for _, _, oil in joints])
    dry, mixed = thickness <= 0.0, (thickness > 0.0) & (thickness < MIXED * rough)
    dry, mixed = (time_mean(each, time) if len(time) else np.full(len(joints), math.nan) for each in (dry, mixed))
    at = np.argmin(thickness, axis=0) if len(time) else np.zeros(len(joints), int)
    least = thickness[at, np.arange(len(joints))] if len(time) else np.full(len(joints), math.nan)
    when = time[at] if len(time) else np.full(len(joints), math.nan)

    def described(values: np.ndarray, unit: str, text: str) -> xr.Variable:
        return xr.Variable(("film",), values, {"units": unit, "long_name": text})

    largest = np.max(pressure, axis=0, initial=0.0)
    return {
        "film_least_thickness": described(least, "m", "least film thickness among the samples, negative in contact"),
        "film_least_thickness_time": described(when, "s", "instant of the least film thickness"),
        "film_peak_pressure": described(largest, "Pa", "largest pressure of the film among the samples"),
        "film_dry_share": described(dry, "1", "part of the time in which the surfaces touch"),
        "film_mixed_share": described(mixed, "1", "part of the time with a film below three roughnesses"),
        "film_full_share": described(1.0 - dry - mixed, "1", "part of the time with a full film"),
    }


def film_warnings(plan: Plan, run: xr.Dataset) -> list[str]:
    """Where films left the range of their model: too thin, too high a pressure, vortices.

    Parameters
    ----------
    plan : Plan
    run : Dataset

    Returns
    -------
    list of str
    """
    found = []
    for k, (joint, clearance, oil) in enumerate(plan.lubricated):
        label = f"joint '{joint.name}'"
        least, when = (float(run.variables[name].values[k]) for name in ("film_least_thickness", "film_least_thickness_time"))
        if least < MIXED * oil.roughness:
            part = float(run.variables["film_dry_share"].values[k] + run.variables["film_mixed_share"].values[k])
            found.append(
                f"{label}: the film is thinner than three roughnesses of {oil.roughness:.3g} m for {part:.2g} of the run, "
                f"least {least:.3g} m at t = {when:.6g} s; peaks carry there, which the film's force does not know"
            )
        pressure = float(run.variables["film_peak_pressure"].values[k])
        if pressure > THICKENS:
            found.append(
                f"{label}: film pressures reach {pressure:.2g} Pa; above {THICKENS:.0e} Pa oil thickens and surfaces yield: "
                "its forces are those of rigid surfaces"
            )
        if oil.oil is not None:
            turn = run.variables["film_angle"].values[:, k]
            speed = float(np.max(np.abs(np.gradient(turn, run["time"].values)), initial=0.0)) if turn.size > 1 else 0.0
            number = oil.oil.density * speed * clearance.journal_radius * clearance.clearance / oil.dynamic_viscosity
            limit = TURBULENT * math.sqrt(clearance.journal_radius / clearance.clearance)
            if number > limit:
                found.append(f"{label}: Reynolds' number {number:.3g} exceeds {limit:.3g}, above which the film has vortices")
    return found
