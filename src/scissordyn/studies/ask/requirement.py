"""Responses of the cases of a study, requirements on them such as ``peak_force < 500 N``, and goals of a search."""

from __future__ import annotations

import dataclasses
import math
import operator
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import xarray as xr

from scissordyn.errors import InputError, did_you_mean, whole_number
from scissordyn.model.mechanism import Mechanism
from scissordyn.plot.scale import engineering, scale_of
from scissordyn.run.measure import LOAD_UNIT, MEASURES, load_units
from scissordyn.run.response import LOAD_KINDS, Response, read_response
from scissordyn.studies.ask.design import Design
from scissordyn.studies.ask.distribution import Levels, Names, Variation

# Comparison function of NumPy arrays, by the sign in a requirement
SIGNS = {"<=": operator.le, ">=": operator.ge, "<": operator.lt, ">": operator.gt}

LOAD_MEASURES = frozenset(name for name, measure in MEASURES.items() if measure.units == LOAD_UNIT)
"""Measures of forces and torques, whose unit is that of the component, coupling or drive of a coordinate."""

SHORTFALL = {"settling_time": ("end_track_deviation", "not settled: off by {} at the end")}
"""Measures of events that may not happen, each with the measure and text that are printed instead."""


@dataclass(frozen=True)
class Requirement:
    """A bound on a response; without a part, all joints, drives or components have to meet it."""

    measure: str
    sign: str
    bound: float  # Bound in SI units
    part: str = ""  # Name of a joint, drive or component; empty for all
    text: str = ""  # Text as the user wrote it
    unit: str = ""  # Unit of a bound on component loads, "N" or "N m"; not needed if all have the same

    def __post_init__(self) -> None:
        if self.unit and self.unit not in LOAD_KINDS:
            raise InputError(f"unit '{self.unit}' of a requirement on what components exert", ", ".join(LOAD_KINDS))
        if self.sign not in SIGNS:
            raise InputError(f"sign '{self.sign}' of a requirement", ", ".join(SIGNS))

    @property
    def response(self) -> Response:
        """Response that is compared with the bound: the largest of all parts for an upper bound, else the smallest."""
        return Response(self.measure, self.part, self.sign.startswith(">"), self.unit)

    @property
    def label(self) -> str:
        if self.text:
            return self.text
        unit = self.unit or (MEASURES[self.measure].units if self.measure in MEASURES else "1")
        scale = engineering(unit if unit in LOAD_KINDS or self.measure not in LOAD_MEASURES else "1", self.bound)
        return f"{self.response.name} {self.sign} {scale.with_unit(self.bound, 6)}"

    def margin(self, values: np.ndarray) -> np.ndarray:
        """Return the margins of values to the bound as fractions of it; negative if violated or NaN."""
        distance = self.bound - values if self.sign.startswith("<") else values - self.bound
        return np.asarray(np.where(np.isnan(values), -np.inf, distance / (abs(self.bound) or 1.0)))

    def met(self, values: np.ndarray) -> np.ndarray:
        """Return a mask of the values that meet the requirement; False for NaN."""
        with np.errstate(invalid="ignore"):
            return np.asarray(SIGNS[self.sign](values, self.bound))

    def margin_in(self, results: xr.Dataset) -> np.ndarray:
        return self.margin(response_values(results, self.response))

    def met_in(self, results: xr.Dataset) -> np.ndarray:
        return self.met(response_values(results, self.response))


def response_values(results: xr.Dataset, response: Response) -> np.ndarray:
    """Return a response of all cases, shape (cases,)."""
    if response.measure not in results:
        names = [str(name) for name in results.data_vars if results[name].attrs.get("role") == "measure"]
        raise InputError(
            f"unknown measure '{response.measure}'{did_you_mean(response.measure, names)}", ", ".join(names) or "no measure"
        )
    variable = results[response.measure]
    if response.unit and not response.part:
        units = np.array(units_of_parts(results, response.measure))
        variable = variable.isel({variable.dims[1]: np.flatnonzero(units == response.unit)})
    dims, values = variable.dims[1:], np.asarray(variable.values, float)
    if response.part:
        parts = [str(part) for dim in dims for part in variable[dim].values]
        if response.part not in parts:
            raise InputError(
                f"no part '{response.part}' with a {response.measure}{did_you_mean(response.part, parts)}", ", ".join(parts)
            )
        return np.asarray(values[:, parts.index(response.part)])
    if not dims:
        return values
    if not values.size:  # no part has the measure, for example no joint has clearance
        return np.full(len(values), np.nan)
    # a measure that some parts do not have is NaN there
    return np.asarray((np.fmin if response.smallest else np.fmax).reduce(values, axis=1))


def value_text(results: xr.Dataset, response: Response, case: int) -> str:
    """Return a response of a case with its unit; if it has no value, the reason and the distance to one."""
    value = float(response_values(results.isel(case=[case]), response)[0])
    if math.isfinite(value):
        return scale_of(xr.DataArray(value, attrs={"units": response_unit(results, response)})).cell(value)
    if beyond := beyond_text(results[response.measure]):
        return f"not reached within {beyond}"
    measure, words = SHORTFALL.get(response.measure, ("", ""))
    if measure not in results or not math.isinf(value):
        return "not reached" if math.isinf(value) else "no value"
    off = float(response_values(results.isel(case=[case]), Response(measure, response.part))[0])
    return words.format(engineering(MEASURES[measure].units, off).cell(off))


def beyond_text(variable: xr.DataArray) -> str:
    """Return the end of the range in which a response is computed, as "10000 cycles"; empty if it has no such end."""
    attributes = variable.attrs
    return f"{attributes['beyond']} {attributes['units']}" if "beyond" in attributes else ""


def meaning(results: xr.Dataset, requirement: Requirement) -> str:
    """Return the description of the user's function in a requirement; empty for a measure of the package."""
    if requirement.measure in MEASURES:
        return ""
    text = str(results[requirement.measure].attrs.get("long_name", ""))
    return "" if text.startswith("measure '") else text


def units_of_parts(results: xr.Dataset, measure: str) -> list[str]:
    """Return the units of a measure's parts, which differ only between loads."""
    variable = results[measure]
    if measure in LOAD_MEASURES:
        return [str(unit) for unit in variable[f"{variable.dims[1]}_unit"].values]
    return [str(variable.attrs.get("units", "1"))] * int(np.prod(variable.shape[1:], dtype=int))


def response_unit(results: xr.Dataset, response: Response) -> str:
    variable = results[response.measure]
    if response.part and response.measure in LOAD_MEASURES:
        return str(variable[f"{variable.dims[1]}_unit"].sel({variable.dims[1]: response.part}).item())
    units = set(units_of_parts(results, response.measure))
    return response.unit or (units.pop() if len(units) == 1 else str(variable.attrs.get("units", "1")))


def response_label(results: xr.Dataset, response: Response) -> str:
    """Return the label of a response in pictures, from the declaration of its measure: "A: largest indentation"."""
    measure, kind = response.measure, LOAD_KINDS.get(response_unit(results, response), "force or torque")
    text = MEASURES[measure].long_name if measure in MEASURES else str(results[measure].attrs.get("long_name") or measure)
    words = re.split("[:;,]", text)[0].replace("force [N] or torque [N m]", kind).replace("force or torque", kind)
    return f"{response.part}: {words}" if response.part else words


def check_unit(mechanism: Mechanism, response: Response) -> None:
    """Raise `InputError` for a load that no part has, or that would compare forces with torques."""
    if response.measure not in LOAD_MEASURES:
        return
    (dim,) = MEASURES[response.measure].dims
    part = dim.replace("_", " ")
    units = load_units(mechanism)[dim]
    possible = {units[response.part]} if response.part in units else set(units.values())
    allowed = ", ".join(f"{name}.{response.measure} [{unit}]" for name, unit in units.items()) or f"a case with a {part}"
    if response.unit and response.unit not in possible:
        raise InputError(f"'{response.name}' in {response.unit}: no such {part}", allowed)
    if not possible:
        raise InputError(f"'{response.name}': the case has no {part}", allowed)
    if not response.unit and len(possible) > 1:
        raise InputError(f"'{response.name}' of forces and of torques", allowed)


def whole_responses(results: xr.Dataset, measure: str) -> list[Response]:
    """Return the response of a measure over all parts, or two if some parts exert forces and others torques."""
    units = list(dict.fromkeys(units_of_parts(results, measure)))
    return [Response(measure, unit=unit) for unit in units] if len(units) > 1 else [Response(measure)]


# Pattern of the statistic of uncertain parameters that a search improves, such as "cvar 95 %"
RISK = re.compile(r"(mean|worst)|(quantile|cvar)\s+(\d+(?:\.\d+)?)\s*%")


@dataclass(frozen=True)
class Goal:
    """Response that a search minimises or maximises."""

    measure: str  # Or the parameter path of a number that is chosen
    part: str = ""
    maximise: bool = False

    @property
    def response(self) -> Response:
        """Response of the goal; of several parts the worst one counts."""
        return Response(self.measure, self.part, self.maximise)

    @property
    def sign(self) -> float:
        """Factor of the response in the minimised objective: 1 or -1."""
        return -1.0 if self.maximise else 1.0

    @property
    def label(self) -> str:
        """Text of the goal in a study file."""
        return f"{'maximise' if self.maximise else 'minimise'} {self.response.name}"


SEARCHES = ("evolution", "gradient")  # Names of the methods that search for an optimum


@dataclass(frozen=True)
class Optimisation:
    """Search for the best point: CMA-ES for one goal, NSGA-II for several, all combinations if names are chosen."""

    goals: tuple[Goal, ...]
    # Statistic of a goal over uncertain parameters and members: "mean", "worst", "quantile 95 %" or "cvar 95 %", the mean
    # of the worst 5 %
    risk: str = "mean"
    population: int = 0  # Candidates of a generation; 0 for the method's own choice
    generations: int = 20
    seed: int = 0
    every: bool = False  # True if all combinations of the listed values are tried, as one generation
    method: str = "evolution"  # "evolution", or "gradient": SLSQP for one goal, each generation of which is one point

    def __post_init__(self) -> None:
        if not self.goals:
            raise InputError("an optimisation without a goal", "at least one", "'minimise peak_force'")
        if self.method not in SEARCHES:
            near = did_you_mean(self.method, SEARCHES)
            raise InputError(f"method '{self.method}' of an optimisation{near}", " or ".join(SEARCHES), 'method = "gradient"')
        if self.method == "gradient" and (len(self.goals) > 1 or self.population or self.every):
            what = "names" if self.every else "a population" if self.population else f"{len(self.goals)} goals"
            raise InputError(f"an optimisation with {what} by gradients", "one goal and numbers", 'method = "evolution"')
        risk_value(np.zeros((1, 1)), self.risk)
        for name, least in (("population", 0), ("generations", 1), ("seed", 0)):
            whole_number(name, getattr(self, name), least)
        if self.every and self.generations > 1:
            raise InputError(
                f"generations = {self.generations} for a search that tries all combinations at once", "generations = 1"
            )

    def over(self, variations: Sequence[Variation]) -> Optimisation:
        """Return the same search, or the one that tries all combinations if names are chosen."""
        if not any(isinstance(variation, Names) for variation in variations):
            return self
        if not all(isinstance(variation, Names | Levels) for variation in variations):
            what = "a search over names, which tries all combinations, and over a range"
            raise InputError(what, "lists of all that is chosen", '"A.clearance" = "0.1, 0.2, 0.3 mm"')
        return dataclasses.replace(
            self, population=math.prod(variation.count for variation in variations), generations=1, every=True
        )

    def size(self, factors: int) -> int:
        """Return the number of candidates of a generation: by default 4 + 3 ln n (Hansen 2016), or 40 with several goals."""
        if self.every:
            return self.population
        if self.method == "gradient":
            return 1
        if self.population:
            return max(self.population, 4)
        return 4 + int(3 * np.log(max(factors, 2))) if len(self.goals) == 1 else 40

    def design(self, generations: int, factors: int) -> Design:
        return Design("adaptive", generations * self.size(factors))


def read_goal(text: str, units: Mapping[str, str] | None = None, parameters: Sequence[str] = ()) -> Goal:
    """Read a goal such as ``minimise peak_force``."""
    direction, _, rest = text.strip().partition(" ")
    if direction not in ("minimise", "maximise") or not rest:
        raise InputError(f"goal '{text}'", "minimise or maximise, and a measure", "'minimise peak_force'")
    if rest.strip() in parameters:
        return Goal(rest.strip(), "", direction == "maximise")
    part, measure, _ = read_response(rest.strip(), units)
    return Goal(measure, part, direction == "maximise")


def risk_value(values: np.ndarray, risk: str) -> np.ndarray:
    """Return a measure of risk (points,) of `values` (points, cases); large values are bad."""
    match = RISK.fullmatch(risk.strip())
    if match is None or (match[3] and not 0.0 < float(match[3]) < 100.0):
        raise InputError(f"risk '{risk}'", "mean, worst, quantile 95 %, cvar 95 %", "'cvar 95 %'")
    if match[1] == "mean":
        return np.asarray(np.mean(values, axis=1))
    if match[1] == "worst":
        return np.asarray(np.max(values, axis=1))
    fraction = float(match[3]) / 100.0
    threshold = np.asarray(np.quantile(values, fraction, axis=1, method="inverted_cdf"))
    if match[2] == "quantile":
        return threshold
    beyond = np.maximum(values - threshold[:, None], 0.0)
    return np.asarray(threshold + np.mean(beyond, axis=1) / (1.0 - fraction))
