"""Search for parameter values: fit measured curves, or find the smallest value that meets requirements."""

from __future__ import annotations

import csv
import os
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from scissordyn.analysis.agreement import Measured
from scissordyn.casefile.case import Case
from scissordyn.casefile.quantity import unit_factor
from scissordyn.casefile.text import read_text
from scissordyn.config.file import read_case
from scissordyn.config.studies import study
from scissordyn.config.variation import read_variation
from scissordyn.errors import InputError, did_you_mean
from scissordyn.identification.fit import fit_parameters, units_by_heading
from scissordyn.identification.problem import Free, free_parameter
from scissordyn.model.mechanism import Mechanism
from scissordyn.model.options import Options
from scissordyn.model.parameter_path import number
from scissordyn.studies.ask.distribution import Distribution, Interval, Levels
from scissordyn.units import checked

if TYPE_CHECKING:
    import xarray as xr


HEADING_EXAMPLE = "time [s], angle of crank [deg]"  # correct first line of a file, which error texts show
HEADING = re.compile(r"\s*(?P<name>.*?)\s*(?:\[(?P<unit>[^\]]*)\])?\s*")  # pattern of a column heading


def read_measured(path: Path, known: Mapping[str, str]) -> Measured:
    """Read measured curves from a CSV file with a heading; `known` maps each quantity that a run has to its SI unit."""
    lines = [
        (number, line)
        for number, line in enumerate(read_text(path, f"a table that begins with {HEADING_EXAMPLE}").splitlines(), 1)
        if line.strip() and not line.lstrip().startswith("#")
    ]
    if len(lines) < 3:
        raise InputError(
            f"'{path}' has {max(0, len(lines) - 1)} rows", "a heading and at least two rows of numbers", HEADING_EXAMPLE
        )
    rows = list(csv.reader([line for _, line in lines], skipinitialspace=True))
    headings, units, factors = _heading(rows[0], path, known)
    values = np.array([_numbers(row, len(rows[0]), path, number) for (number, _), row in zip(lines[1:], rows[1:], strict=True)])
    values *= np.array(factors)
    _check_steps(values[:, 0], [number for number, _ in lines[1:]], path)
    return Measured(values[:, 0], headings, values[:, 1:], units, str(path))


def _heading(cells: list[str], path: Path, known: Mapping[str, str]) -> tuple[tuple[str, ...], tuple[str, ...], list[float]]:
    """Return column headings, SI units, and conversion factors; the first factor is that of the time column."""
    headings, units, factors = list[str](), list[str](), list[float]()
    for place, cell in enumerate(cells):
        match = HEADING.fullmatch(cell)
        assert match is not None, "it fits anything"
        name, unit = match["name"], match["unit"] or "1"
        if (place == 0) != (name == "time"):
            raise InputError(
                f"'{path}': column {place + 1} is '{cell.strip()}'", "the time in the first column alone", HEADING_EXAMPLE
            )
        if place and name not in known:
            raise InputError(
                f"'{path}': no quantity '{name}'{did_you_mean(name, known)}",
                "columns of a run of this case, as 'scissordyn export' writes them",
            )
        if name in headings:
            raise InputError(f"'{path}': two columns are named '{name}'", "each quantity once")
        target = known[name] if place else "s"
        try:
            factors.append(1.0 if unit == target else unit_factor(unit, target))
        except InputError as error:
            raise InputError(
                f"'{path}': unit of '{name}': {error.what}", f"a unit of [{target}]", f"{name} [{target}]"
            ) from None
        if place:
            headings.append(name)
            units.append(target)
    if not headings:
        raise InputError(f"'{path}' has only the time column", "at least one measured quantity", HEADING_EXAMPLE)
    return tuple(headings), tuple(units), factors


def _numbers(row: list[str], count: int, path: Path, line: int) -> list[float]:
    if len(row) != count or not all(cell.strip() for cell in row):
        empty = f"{len(row)} numbers" if len(row) != count else "an empty cell"
        raise InputError(
            f"'{path}' line {line}: {empty}", f"{count} numbers in each line; one file for each record without gaps"
        )
    try:
        numbers = [float(cell) for cell in row]
    except ValueError as error:
        raise InputError(f"'{path}' line {line}: {error}", "numbers with a decimal point") from None
    if not np.isfinite(numbers).all():
        raise InputError(f"'{path}' line {line}: a value is not finite", "finite numbers")
    return numbers


def _check_steps(time: np.ndarray, lines: list[int], path: Path) -> None:
    steps = np.diff(time)
    if np.any(steps <= 0.0):
        k = int(np.argmax(steps <= 0.0))
        ends = f"from {time[k]:.9g} s to {time[k + 1]:.9g} s"
        raise InputError(f"'{path}' line {lines[k + 1]}: the time does not increase {ends}", "increasing instants")
    usual, gap_steps = float(np.median(steps)), 10.0  # a step longer than 10 usual steps is a gap in the record
    if np.max(steps) > gap_steps * usual:
        k = int(np.argmax(steps))
        raise InputError(
            f"'{path}' line {lines[k + 1]}: a gap of {steps[k]:.4g} s in the time, after {time[k]:.9g} s",
            f"steps of at most {gap_steps:g} times the usual {usual:.4g} s; one file for each record without gaps",
        )


Data = Measured | str | os.PathLike[str]


@checked
def fit(
    case: Case | Mechanism | str | os.PathLike[str],
    data: Data | Sequence[Data],
    free: Iterable[str] | Mapping[str, str | tuple[float, float] | None],
    *,
    segment: float | None = None,
    deviations: Mapping[str, float] | None = None,
    jump: float | None = None,
    most: int = 100,
    starts: int = 1,
    options: Options | None = None,
    progress: Callable[[str], None] | None = None,
) -> xr.Dataset:
    """Fit parameters of a mechanism to measured curves, by least squares over runs.

    The sum of the squares of (run - data) / standard deviation is minimised in a trust region with bounds
    (`scipy.optimize.least_squares`). Long or chaotic records are divided into segments; each segment starts from its own data
    (multiple shooting), so that errors do not grow beyond a segment.

    Parameters
    ----------
    case : Case, Mechanism or path
        Case whose parameter values are the start of the search.
    data : Measured or path, or several
        Records without gaps, as `Measured` or CSV files with a heading.
    free : iterable of str, or mapping
        Parameters to fit. A mapping gives bounds in SI, ``(1e-4, 1e-3)``, or as text, ``"1e-4..1e-3 kg m^2"``, or an
        independent measurement, ``"norm(loc=0.138, scale=0.001) kg"``.
    segment : float, optional
        Duration of a segment [s]; infinite for one start for each record. By default records start at time zero of the case;
        the values of that start may be free, for example ``"arm.angle"``.
    deviations : mapping of str to float, optional
        Standard deviation of each measured quantity by heading, in SI. By default the root mean squares of the residuals, which
        are found with the parameters.
    jump : float, optional
        Standard deviation of the jumps of angles, positions and velocities between segments, as a fraction of their range. A
        small value joins the segments to one motion. By default segments are independent.
    most : int
        Largest number of residual evaluations in a round of weights.
    starts : int
        Number of points in the ranges of the parameters, with that of the case, at which a run is compared with the data. The
        search starts from the best one. Records with impacts have many local minima: use 50 or more.
    options : Options, optional
        Options of the runs; by default those of the case.
    progress : callable, optional
        Called repeatedly with a line of text.

    Returns
    -------
    Dataset
        Along "parameter": `value`, `standard_error`, `low` and `high` (95 % confidence interval), `correlation`, `covariance`.
        Along "row" and "column": `measured`, `fitted`, `residual`. The attribute "warnings" names parameters that the data
        cannot distinguish. The attribute "configuration" has the fitted mechanism.

    Raises
    ------
    InputError
        If a quantity or parameter path is unknown, a unit has another dimension, times decrease, or a record has gaps.

    Examples
    --------
    The inertia of a pendulum is found from a record of its angle, here the record of a run:

    >>> import scissordyn as sd
    >>> body = sd.Body("arm", 0.15, 6e-4, {"pin": (0.0, 0.0)}, centre=(0.15, 0.0), angle=-0.5)
    >>> pin = sd.Revolute("A", ("arm", "pin"), ("ground", "O"))
    >>> arm = sd.Mechanism(bodies=(body,), joints=(pin,), ground=(("O", (0.0, 0.0)),), gravity=9.81)
    >>> run = sd.simulate(arm.replace("arm.inertia", 9e-4), until=1.0, samples=101)
    >>> record = sd.Measured(run["time"].values, ("angle of arm",), run["angle"].values, ("rad",))
    >>> found = sd.fit(arm, record, ["arm.inertia"], segment=float("inf"))
    >>> print(f"{float(found['value'][0]):.2e} kg m^2")
    9.00e-04 kg m^2
    """
    if isinstance(case, str | os.PathLike):
        case = read_case(case)
    mechanism = case.mechanism if isinstance(case, Case) else case
    chosen = options or (case.run if isinstance(case, Case) else Options(1.0, "as-placed"))
    records = _records(data, mechanism, chosen)
    wanted = dict(free) if isinstance(free, Mapping) else dict.fromkeys(free)
    numbers = [_free(mechanism, parameter, text) for parameter, text in wanted.items()]
    without = next((parameter for parameter, text in wanted.items() if text is None), None)
    if starts < 1 or (starts > 1 and without is not None):
        raise InputError(
            f"starts = {starts}" + (f", but '{without}' has no range" if starts > 1 else ""),
            "1, or more with a range of each free parameter",
            "--starts 64 --free 'A.damping.restitution=0.5..0.95'",
        )
    how: dict[str, Any] = {"segment": segment, "deviations": deviations, "jump": jump, "most": most, "starts": starts}
    return fit_parameters(mechanism, chosen, records, numbers, **how, progress=progress)


def _records(data: Data | Sequence[Data], mechanism: Mechanism, options: Options) -> list[Measured]:
    """Return the measured records of a fit, read from their files."""
    curves: list[Any] = [data] if isinstance(data, Measured | str | os.PathLike) else list(data)
    if not curves:
        raise InputError("no measured curves are given", "at least one file", "--data decay.csv")
    units = units_by_heading(mechanism, options) if any(not isinstance(record, Measured) for record in curves) else {}
    return [record if isinstance(record, Measured) else read_measured(Path(record), units) for record in curves]


def _free(mechanism: Mechanism, parameter: str, given: str | tuple[float, float] | None) -> Free:
    variation: Any = None
    if isinstance(given, tuple):
        variation = Interval(*given)
    elif given is not None:
        quantity = number(mechanism, parameter).quantity
        assert quantity is not None
        variation = read_variation(given, quantity, parameter=parameter)
        if isinstance(variation, Distribution) and variation.name == "truncnorm":  # limits of the design
            middle, deviation = (dict(variation.arguments)[name] for name in ("loc", "scale"))
            variation = Distribution("norm", {"loc": middle, "scale": deviation})
    return free_parameter(mechanism, parameter, variation)


@dataclass(frozen=True)
class LeastValue:
    """Smallest value of a parameter with which a case meets its requirements."""

    path: str
    value: float  # this value and all larger tried values meet the requirements, in SI units
    fails_at: float  # largest tried value that does not meet the requirements
    tried: dict[float, bool]  # tried value -> True if the requirements are met


@checked
def least_value(
    case: Case,
    parameter: str,
    low: float,
    high: float,
    requirements: Sequence[str],
    *,
    tolerance: float = 0.01,
    engine: Any = None,
    progress: Callable[[int, float, float], None] | None = None,
) -> LeastValue:
    """Find the smallest value of a parameter with which the requirements are met.

    Both ends of the range are simulated first, then eight values at a time between the largest failing value and the next
    larger one. If the requirements are also met in a lower range, that range is found only if a tried value lies in it.

    Parameters
    ----------
    case : Case
    parameter : str
        Path of the parameter.
    low, high : float
        Range of the search, in SI.
    requirements : sequence of str
        For example ``"tip.error < 5 mm"``.
    tolerance : float
        Width of the final interval, as a fraction of its value.
    engine : Executor or int, optional
        As for `study`.
    progress : callable, optional
        Called with the number of tried values and the range that is left, in SI.

    Raises
    ------
    InputError
        If the requirements are not met at `high`, or are met at `low`.
    """
    if not low < high:
        raise InputError(f"'{parameter}' from {low:g} to {high:g}: the range is empty", "--from below --to", "--from 1 --to 2")
    if not 1e-6 <= tolerance < 1.0:
        raise InputError(f"a tolerance of {tolerance:g}", "a number >= 1e-6 and < 1", "0.01")
    quantity = number(case.mechanism, parameter).quantity
    unit = "" if quantity is None or quantity.unit == "1" else f" {quantity.unit}"
    tried: dict[float, bool] = {}
    while True:
        values = np.linspace(low, high, 10)[1:-1] if tried else np.array([low, high])
        result = study(case, {parameter: Levels(tuple(values.tolist()))}, requirements=list(requirements), engine=engine)
        met = result.points["met"].values == 1.0
        tried |= dict(zip(values.tolist(), met.tolist(), strict=True))
        order = sorted(tried)
        failing = [value for value in order if not tried[value]]
        if not tried[order[-1]]:
            what = ", ".join(requirements)
            raise InputError(f"{what}: not met at the largest value, '{parameter}' = {order[-1]:g}{unit}", "a larger --to")
        if not failing:
            raise InputError(
                f"all requirements are met at the smallest value, '{parameter}' = {order[0]:g}{unit}", "a smaller --from"
            )
        low = failing[-1]
        high = min(value for value in order if value > low)
        if progress is not None:
            progress(len(tried), low, high)
        if high - low <= tolerance * max(abs(low), abs(high)):
            return LeastValue(parameter, high, low, {value: tried[value] for value in order})
