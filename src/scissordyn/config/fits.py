"""Numbers that are searched for: fits to measured curves, and the least values that meet requirements."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from scissordyn.analysis.measured import Measured
from scissordyn.config.case import Case
from scissordyn.config.file import read_case
from scissordyn.config.measured import read_measured
from scissordyn.config.variation import read_variation
from scissordyn.errors import InputError
from scissordyn.identification.fit import fitted, known_headings
from scissordyn.identification.problem import Free, free_parameter
from scissordyn.model.mechanism import Mechanism
from scissordyn.model.parameter_path import number
from scissordyn.run.options import Options
from scissordyn.study.ask.distribution import Interval, Normal

if TYPE_CHECKING:
    import xarray as xr

from dataclasses import dataclass

import numpy as np

from scissordyn.config.studies import study
from scissordyn.study.ask.distribution import Levels

Data = Measured | str | os.PathLike[str]


def fit(
    case: Case | Mechanism | str | os.PathLike[str],
    data: Data | Sequence[Data],
    free: Iterable[str] | Mapping[str, str | tuple[float, float] | None],
    *,
    segment: float | None = None,
    deviations: Mapping[str, float] | None = None,
    jump: float | None = None,
    most: int = 100,
    options: Options | None = None,
    progress: Callable[[str], None] | None = None,
) -> xr.Dataset:
    r"""Numbers of a mechanism from measured curves, by least squares over runs.

    The sum of the squares of (run - data) / standard deviation is made least, in a trust region with bounds
    (`scipy.optimize.least_squares`). Long or chaotic records are cut into segments, each of which starts anew
    where its data say (multiple shooting): errors then do not grow beyond a segment.

    Parameters
    ----------
    case : Case, Mechanism or path
        Its numbers are where the search starts.
    data : Measured or path, or several
        Unbroken records; see `config.measured.read_measured`.
    free : iterable of str, or mapping
        The numbers to fit. A mapping gives bounds in SI, ``(1e-4, 1e-3)``, or as text, ``"1e-4..1e-3 kg m^2"``, or
        what was measured otherwise, ``"normal(0.138, 0.001) kg"``.
    segment : float, optional
        Duration of a segment [s]; infinite for a start of its own for each record. If not given, records start as the case
        says, at its time zero; the numbers of that start may be free, as in ``"arm.angle"``.
    deviations : mapping of str to float, optional
        Standard deviation of each measured quantity by heading, in SI. If not given, they are the root mean squares of the
        residuals of each quantity, found with the numbers.
    jump : float, optional
        Standard deviation of the jumps of angles, places and velocities between segments, as a fraction of their range: a small
        one makes the segments one motion. If not given, segments are independent of each other.
    most : int
        Evaluations of the residuals in a round of weights.
    options : Options, optional
        Of the runs, in place of those of the case.
    progress : callable, optional
        Called with a line of text now and then.

    Returns
    -------
    Dataset
        Over "parameter": `value`, `standard_error`, `low` and `high` (the interval with a probability of 95 %), `correlation`,
        `covariance`; over "row" and "column": `measured`, `fitted`, `residual`. Its attribute "warnings" names numbers that the
        data cannot distinguish. The attribute "configuration" has the fitted mechanism.

    Raises
    ------
    InputError
        For unknown quantities or parameter paths, units of another dimension, times that run backwards, gaps.
    """
    if isinstance(case, str | os.PathLike):
        case = read_case(case)
    mechanism = case.mechanism if isinstance(case, Case) else case
    chosen = options or (case.run if isinstance(case, Case) else Options(1.0, "as-placed"))
    curves: list[Any] = [data] if isinstance(data, Measured | str | os.PathLike) else list(data)
    if not curves:
        raise InputError("a fit without data", "at least one file", "--data decay.csv")
    units = known_headings(mechanism, chosen) if any(not isinstance(record, Measured) for record in curves) else {}
    records = [record if isinstance(record, Measured) else read_measured(Path(record), units) for record in curves]
    wanted = dict(free) if isinstance(free, Mapping) else dict.fromkeys(free)
    numbers = [_free(mechanism, parameter, text) for parameter, text in wanted.items()]
    return fitted(
        mechanism, chosen, records, numbers, segment=segment, deviations=deviations, jump=jump, most=most, progress=progress
    )


def _free(mechanism: Mechanism, parameter: str, given: str | tuple[float, float] | None) -> Free:
    variation: Any = None
    if isinstance(given, tuple):
        variation = Interval(*given)
    elif given is not None:
        quantity = number(mechanism, parameter).quantity
        assert quantity is not None
        variation = read_variation(given, quantity, parameter=parameter)
        if isinstance(variation, Normal) and math.isfinite(variation.high):  # a tolerance: its limits are those of the design
            variation = Normal(variation.mean, variation.deviation)
    return free_parameter(mechanism, parameter, variation)


VALUES = 8  # Values that are tried at a time


@dataclass(frozen=True)
class LeastValue:
    """Between which values a case begins to meet its requirements."""

    path: str
    value: float  # The least value tried above which, itself included, all values tried meet the requirements, in SI
    fails_at: float  # The largest value tried that does not
    tried: dict[float, bool]  # Whether the requirements are met, by value


def least_value(
    case: Case,
    parameter: str,
    low: float,
    high: float,
    requirements: Sequence[str],
    *,
    tolerance: float = 0.01,
    engine: Any = None,
) -> LeastValue:
    """The least value of a number with which requirements are met.

    Eight values at a time are simulated between one that fails and one above which all that were tried do not; requirements
    that are met, not met and met again below the value are seen where a value was tried there.

    Parameters
    ----------
    case : Case
    parameter : str
        Of the number.
    low, high : float
        Values between which it is searched for, in SI.
    requirements : sequence of str
        Such as ``"tip.error < 5 mm"``.
    tolerance : float
        Width of the interval at the end, as a fraction of its value.
    engine : Executor or int, optional
        As for `study`.

    Returns
    -------
    LeastValue

    Raises
    ------
    InputError
        If the requirements are not met at the high end, or are at the low one.
    """
    if not low < high:
        raise InputError(f"'{parameter}' from {low:g} to {high:g}", "a smaller value, then a larger one", "--from 1 --to 2")
    if not 1e-6 <= tolerance < 1.0:
        raise InputError(f"a tolerance of {tolerance:g}", "a number >= 1e-6 and < 1", "0.01")
    quantity = number(case.mechanism, parameter).quantity
    unit = "" if quantity is None or quantity.unit == "1" else f" {quantity.unit}"
    tried: dict[float, bool] = {}
    while True:
        values = np.linspace(low, high, VALUES + 2) if not tried else np.linspace(low, high, VALUES + 2)[1:-1]
        result = study(case, {parameter: Levels(tuple(values.tolist()))}, requirements=list(requirements), engine=engine)
        met = result.points["met"].values == 1.0
        tried |= dict(zip(values.tolist(), met.tolist(), strict=True))
        order = sorted(tried)
        failing = [value for value in order if not tried[value]]
        if not tried[order[-1]]:
            what = ", ".join(requirements)
            raise InputError(f"{what}: not met at '{parameter}' = {order[-1]:g}{unit}, the largest value", "a larger --to")
        if not failing:
            raise InputError(f"all requirements are met at '{parameter}' = {order[0]:g}{unit} already", "a smaller --from")
        low = failing[-1]
        high = min(value for value in order if value > low)
        if high - low <= tolerance * max(abs(low), abs(high)):
            return LeastValue(parameter, high, low, {value: tried[value] for value in order})
