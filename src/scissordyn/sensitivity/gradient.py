"""Derivatives of the measures of a run by parameters of its mechanism."""

from __future__ import annotations

import json
import math
import re
import time as clocks
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from itertools import islice
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

import numpy as np

from scissordyn.casefile.configuration import write_configuration
from scissordyn.errors import InputError, ScissordynError
from scissordyn.kernel import PYTHON
from scissordyn.model.mechanism import Mechanism
from scissordyn.model.options import EndTime, Method, Options, StartKind
from scissordyn.model.parameter_path import every_number
from scissordyn.plan.plan import Plan, plan
from scissordyn.processor import processors
from scissordyn.record.results import Results
from scissordyn.record.xarray_dataset import as_dataset
from scissordyn.run.advance.driver import count_steps
from scissordyn.run.engine import outcomes
from scissordyn.run.ideal_path import ideal_path
from scissordyn.run.measure import IDEAL_JOINTS, MEASURES, Ended, unit_of
from scissordyn.run.predictability import agreement_end
from scissordyn.run.response import Response, check_part, read_response
from scissordyn.run.trajectory import current_trajectory, make_driver
from scissordyn.sensitivity.curve import curve_derivatives, curve_names, moved_results
from scissordyn.sensitivity.forward import Forward, forward
from scissordyn.sensitivity.library import DERIVATIVES
from scissordyn.sensitivity.limit import Limit, find_limit
from scissordyn.sensitivity.measure import INTEGRAL_MEASURES, check_measure, derivatives_of, value_of_response
from scissordyn.sensitivity.seed import Parameter, Start, parameter_of, sided_derivatives
from scissordyn.sensitivity.warning import gradient_warnings
from scissordyn.tolerance import DATA_TOL, REPORTED_FRACTION
from scissordyn.units import Meaning, Quantity, checked

if TYPE_CHECKING:
    import xarray as xr

TITLE = "scissordyn gradient"  # Attribute `title` of the Dataset of derivatives
EXACT_RTOL = 1e-11  # [-] relative tolerance of runs with derivatives, whose errors are larger than those of values


_Seeded = tuple[Parameter, dict[str, np.ndarray], str]  # a parameter, the derivatives of the start, and their limit

_Row = tuple[tuple[float, ...], tuple[bool, ...], Limit]  # derivatives, whether they are smooth, and their limit


class _Pass(NamedTuple):
    """Results of one pass: values of the responses, their derivatives, and the variables over time with theirs."""

    parameters: list[Parameter]
    values: list[float]
    rows: list[_Row]
    misfit: float
    path: Results | None
    curves: list[dict[str, np.ndarray]]
    rough: float  # Estimated relative error of the derivatives of integrals
    run: Forward | None  # Run of the first pass


class _Derived(NamedTuple):
    """Values of responses, and their derivatives by each parameter, which is divided by its scale."""

    parameters: list[Parameter]
    values: np.ndarray
    rows: list[_Row]
    misfit: float
    rough: float
    runs: int
    left_out: dict[str, str]
    one_sided: dict[str, tuple[str, str]]  # Values for which a derivative holds, and the reason, by parameter
    path: Results | None  # Variables over time, and their derivatives by each parameter
    curves: list[dict[str, np.ndarray]]

    @property
    def slopes(self) -> np.ndarray:
        """Derivatives, shape (responses, parameters)."""
        return np.array([row[0] for row in self.rows], float).T


@checked
def gradient(
    mechanism: Annotated[Mechanism, Meaning("a mechanism", "read_case('case.toml').mechanism")],
    *,
    of: Sequence[str] = (),
    by: Sequence[str] | None = None,
    until: EndTime,
    start: StartKind = Options.start,
    rtol: float = EXACT_RTOL,
    atol: float | None = None,
    method: Method = Options.method,
    most_steps: int = Options.most_steps,
    step: float | None = None,
    change: float = 1e-3,
    trajectory: bool = False,
    samples: Annotated[int, Quantity("1", minimum=2, maximum=1_000_000, help="instants of the trajectory")] = 201,
    progress: Callable[[float], None] | None = None,
) -> xr.Dataset:
    """Compute exact derivatives of measures of a run by parameters, through all contacts.

    The run is repeated in dual numbers, step by step. Instants of contacts, approach speeds and velocity jumps move with the
    parameters, so that no term is missing at an event.

    Parameters
    ----------
    mechanism : Mechanism
    of : sequence of str
        Measures, as in requirements: "A.peak_force" of joint A, "peak_force" for the largest of all contacts, without ideal
        joints. May be empty with `trajectory`.
    by : sequence of str, optional
        Parameter paths ("A.clearance", "drive.speed"). By default all parameters that affect the run. Each run computes
        the derivatives by up to eight of them.
    until : float
        End of the simulated time [s].
    start, rtol, atol, method, most_steps
        As for `simulate`. Contacts are located.
    step : float, optional
        Step of time stepping with hard contacts [s], as for `simulate`.
    change : float
        Relative change of a parameter for which the gradient will be used. From the instant `valid_until` on, this change is
        not small: it moves a journal by a tenth of its clearance, adds or removes a contact, or changes the mode of a hard one.
        A limit for any change is the instant at which a second run, at another tolerance or half the step, diverges.
    trajectory : bool
        Also return all variables over time that `simulate` has, and their derivatives.
    samples : int
        Number of equally spaced instants of the trajectory.
    progress : callable, optional
        Called repeatedly with the simulated time [s], from another thread if there are more than eight parameters.

    Returns
    -------
    Dataset
        Along `measure` and `parameter`: `value` and `parameter_value` in SI units, `derivative`, `elasticity` (relative
        change per relative change, NaN if one of both values is zero), `valid_until` [s], and `smooth`, which is False if
        another part has the same largest value, now or after a change by `change`. With `trajectory` also the variables over
        time, such as `normal_force`, and their derivatives in SI units, such as `normal_force_derivative`, with the dimension
        `parameter` at the end.

    Raises
    ------
    InputError
        If a parameter does not affect the run or changes the structure of the mechanism, if a measure is a count or a verdict,
        or if all contacts of the run only graze.
    ScissordynError
        If the run fails.

    Examples
    --------
    >>> import scissordyn as sd
    >>> case = sd.read_case("examples/paper.toml")
    >>> found = sd.gradient(case.mechanism, of=["A.peak_force"], by=["A.clearance"], until=5e-3)  # doctest: +SKIP
    """
    if not 0.0 < change < 1.0:
        raise InputError(f"change = {change!r}", "a relative change between 0 and 1", "change=1e-3")
    for name, texts in (("of", of), ("by", by or ())):
        for text in texts:
            if list(texts).count(text) > 1:
                raise InputError(f"{name}: '{text}' is given twice", "different names", f"{name}=['{text}']")
    if not of and not trajectory:
        raise InputError("no measure is given", "one or more measures", "of=['peak_force']")
    options = Options(until, start, 2, rtol, atol, method, most_steps, "located", step=step)
    times = np.linspace(0.0, until, samples) if trajectory else np.zeros(0)
    chosen = every_number(mechanism) if by is None else by
    threads = processors()
    return compute_gradient(mechanism, of, chosen, options, change, times, progress, omits=by is None, threads=threads)


def compute_gradient(
    mechanism: Mechanism,
    of: Sequence[str],
    by: Sequence[str | Parameter],
    options: Options,
    change: float,
    times: np.ndarray,
    progress: Callable[[float], None] | None = None,
    *,
    omits: bool = True,
    threads: int = 1,
) -> xr.Dataset:
    """Return the Dataset of `gradient`, with the variables at given instants [s].

    With `omits`, parameters without derivatives are left out instead of raising `InputError`.
    """
    began, tables = clocks.perf_counter(), plan(mechanism)
    check_derivable(tables)
    responses = [_response(mechanism, text) for text in of]
    derived = _derive(tables, options, responses, by, change, progress, times, omits=omits, threads=threads)
    _check_contacts(derived.parameters, [row[2].change for row in derived.rows], change)
    gradient = _dataset(mechanism, responses, derived)
    if derived.path is not None:
        gradient = gradient.merge(_curves(derived))
    seconds = clocks.perf_counter() - began
    gradient.attrs = {
        "title": TITLE,
        "configuration": write_configuration(mechanism, options),
        "left_out": json.dumps(derived.left_out),
        "warnings": json.dumps(gradient_warnings(gradient, change, derived.rough, derived.one_sided)),
        "statistics": json.dumps({"runs": derived.runs, "seconds": seconds, "misfit": derived.misfit}),
    }
    return gradient


def exact_options(options: Options) -> Options:
    """Return options of runs with derivatives: located events, and a tolerance of at most `EXACT_RTOL`."""
    rtol, atol = (min(tolerance, EXACT_RTOL) for tolerance in (options.rtol, options.position_tolerance))
    return replace(options, events="located", rtol=rtol, atol=atol, trust=False)


def ignores_step(mechanism: Mechanism, options: Options) -> bool:
    """Return whether runs with derivatives leave out the step of the options, because no contact is hard."""
    hard = any(contact.clearance and contact.clearance.contact == "hard" for contact in mechanism.contacts)
    return options.step is not None and not hard


def slopes_of(
    mechanism: Mechanism, options: Options, responses: Sequence[Response], by: Sequence[str], expected: Sequence[float]
) -> np.ndarray:
    """Return the derivatives of responses by parameters, shape (responses, parameters).

    Raise `ScissordynError` if one of them does not exist, or if its value is not the expected one.
    """
    tables = plan(mechanism)
    check_derivable(tables)
    for response in responses:
        check_measure(response)
    # without a change: the instants until which the gradient is valid are not used
    derived = _derive(tables, options, responses, by, 0.0, None, np.zeros(0), omits=False)
    slopes = derived.slopes / [parameter.scale for parameter in derived.parameters]
    for response, row, value, expected_value in zip(responses, slopes, derived.values.tolist(), expected, strict=True):
        if differs := difference_text(value, expected_value):
            raise ScissordynError(f"'{response.name}' {differs}")
        if not np.isfinite(row).all():
            raise ScissordynError(f"'{response.name}' has its largest value at a kink")
    return np.asarray(slopes)


def difference_text(value: float, expected: float) -> str:
    """Return how a value of a run with derivatives differs from that of the usual run; empty if both agree."""
    if abs(value - expected) <= REPORTED_FRACTION * abs(expected):
        return ""
    return f"is {expected:.4g}, and {value:.4g} in contacts alone: forces of ideal joints have no derivatives"


def _derive(
    made: Plan,
    options: Options,
    responses: Sequence[Response],
    by: Sequence[str | Parameter],
    change: float,
    progress: Callable[[float], None] | None,
    times: np.ndarray,
    *,
    omits: bool,
    threads: int = 1,
) -> _Derived:
    """Simulate with derivatives of responses, and of variables at given instants, by parameters, eight in each pass.

    Passes are computed by several threads, while this thread prepares the next ones. They do not depend on each other.
    """
    compared = any(MEASURES[response.measure].compares for response in responses)
    ideal = ideal_path(made, options) if compared else None
    integrals = times.size > 0 or any(response.measure in INTEGRAL_MEASURES for response in responses)
    passes = -(-len(by) // DERIVATIVES)
    if passes > 1:  # choose the method once
        options = replace(options, method=make_driver(made, options)[0].method)

    def finish_pass(task: tuple[int, list[_Seeded]]) -> _Pass:
        first, seeded = task[0] == 0, task[1]
        run = forward(
            made, options, [seed for _, seed, _ in seeded], times=times, integrals=integrals, ideal=ideal, change=change,
            progress=progress if first else None,
        )  # fmt: skip
        parameters, ended = [parameter for parameter, _, _ in seeded], Ended(run.driver)
        values = [value_of_response(ended, response) for response in responses]
        path = moved_results(run, 0, 0.0, made.mechanism) if times.size else None
        curves = [] if path is None else [curve_derivatives(run, k, path, moving.moved) for k, moving in enumerate(parameters)]
        rows = _rows(run, seeded, responses, values, change)
        return _Pass(parameters, values, rows, run.misfit, path, curves, run.rough, run if first else None)

    left_out, one_sided, finished = dict[str, str](), dict[str, tuple[str, str]](), dict[int, _Pass]()
    seeds = _seeded(made, options, by, change, left_out, one_sided, compared=compared, curves=times.size > 0, omits=omits)
    tasks = enumerate(iter(lambda: list(islice(seeds, DERIVATIVES)), []))
    for outcome in outcomes(min(threads, passes) or 1, finish_pass, tasks, in_process=True):
        if outcome.error is not None:
            raise outcome.error
        assert outcome.value is not None
        finished[outcome.task[0]] = outcome.value
    if not finished:
        reason = next(iter(left_out.values()), "no parameter is given")
        raise InputError(reason, "one or more parameters that affect the run", "by=['A.clearance']")
    ordered = [finished[number] for number in sorted(finished)]
    run, values, path = ordered[0].run, np.array(ordered[0].values), ordered[0].path
    rows, misfit = [row for part in ordered for row in part.rows], max(part.misfit for part in ordered)
    if change:
        assert run is not None
        rows = _within_horizon(run, replace(options, method=run.driver.method), rows)
    _check_known(responses, values)
    check_repetition(misfit)
    parameters = [parameter for part in ordered for parameter in part.parameters]
    curves = [curve for part in ordered for curve in part.curves]
    rough = max(part.rough for part in ordered)
    return _Derived(parameters, values, rows, misfit, rough, len(ordered), left_out, one_sided, path, curves)


def _rows(
    run: Forward, seeded: Sequence[_Seeded], responses: Sequence[Response], values: Sequence[float], change: float
) -> list[_Row]:
    """Return the derivatives of the responses by each parameter of a run, whether they are smooth, and their limit."""
    rows = list[_Row]()
    for k, (parameter, _, start) in enumerate(seeded):
        size = change if parameter.has_size else 0.0
        pairs = derivatives_of(run, k, responses, values, parameter.moved, size)
        slopes, smooth = tuple(slope for slope, _ in pairs), tuple(both for _, both in pairs)
        rows.append((slopes, smooth, find_limit(run, k, size, start)))
    return rows


def _within_horizon(run: Forward, options: Options, rows: Sequence[_Row]) -> list[_Row]:
    """Return the rows with limits no later than the horizon; a second run goes on only until the latest limit."""
    times, states = run.passed
    if not any(row[2].time for row in rows):
        return list(rows)
    kept = int(np.searchsorted(times, max(row[2].time for row in rows))) + 1
    statistics: dict[str, Any] = count_steps(run.driver.state)
    if run.driver.stepping is not None:
        statistics |= run.driver.stepping.statistics(run.driver.time)
    path = current_trajectory(run.driver, statistics=statistics)
    horizon = agreement_end(options, path, (times[:kept], states[:kept]))
    return [
        (slopes, smooth, limit._replace(time=horizon, reason="horizon") if horizon < limit.time else limit)
        for slopes, smooth, limit in rows
    ]


def check_derivable(made: Plan) -> None:
    """Raise `InputError` if a part of the mechanism has no derivatives yet."""
    if PYTHON:
        raise InputError("gradients need compiled kernels", "the environment variable SCISSORDYN_ENGINE not set to python")


def check_repetition(misfit: float) -> None:
    """Raise `ScissordynError` if a step and its repetition in dual numbers differ by more than round-off."""
    if misfit > DATA_TOL:  # round-off is below 1e-10, another mode above 1e-3
        raise ScissordynError(f"a step and its repetition in dual numbers differ by {misfit:.1g}")


def _response(mechanism: Mechanism, text: str) -> Response:
    if verdict := re.match(r"\s*([^<>]+?)\s*[<>]", text):
        raise InputError(f"'{text}' is a requirement, whose verdict has no derivatives", "its measure", f"of=['{verdict[1]}']")
    part, measure, _ = read_response(text)
    response = Response(measure, part)
    check_measure(response)
    check_part(mechanism, response)
    if part == IDEAL_JOINTS:
        raise InputError(f"'{text}' has no derivatives", "forces of joints with clearance, for example of=['peak_force']")
    return response


def _seeded(
    made: Plan,
    options: Options,
    by: Sequence[str | Parameter],
    change: float,
    left_out: dict[str, str],
    one_sided: dict[str, tuple[str, str]],
    *,
    compared: bool,
    curves: bool,
    omits: bool,
) -> Iterator[_Seeded]:
    """Yield each parameter with the derivatives of the start by it, and the reason why they are not valid for a change there.

    Write reasons into `left_out` and `one_sided`.
    """
    mechanism, size = made.mechanism, made.coordinates.size
    begin = Start(mechanism, options.start, options if compared else None, curves)
    if not omits:  # before the first pass
        by = [parameter_of(mechanism, named, size) if isinstance(named, str) else named for named in by]
    for named in by:
        path = named if isinstance(named, str) else named.path
        try:
            parameter = parameter_of(mechanism, named, size) if isinstance(named, str) else named
            sided = sided_derivatives(begin, parameter)
            if not sided.slopes:
                raise InputError(f"'{path}' does not affect this run", "a parameter that affects the run")
        except InputError as error:
            if not omits:
                raise
            left_out[path] = error.what
            continue
        if sided.side is not None:
            one_sided[parameter.path] = sided.side
        limit = sided.start_limit(begin, parameter, change) if change and parameter.has_size else ""
        yield parameter, sided.slopes, limit


def _check_known(responses: Sequence[Response], values: np.ndarray) -> None:
    """Raise `InputError` for a measure that is not defined in this run, such as the peak force without a contact."""
    for response, value in zip(responses, values.tolist(), strict=True):
        if not math.isfinite(value):
            raise InputError(
                f"'{response.name}' has no value in this run", "a measure of a part that exists and of an event that occurs"
            )


def _check_contacts(parameters: Sequence[Parameter], changes: Sequence[float], change: float) -> None:
    """Raise `InputError` if every contact of the run may be removed by a change of any parameter."""
    if largest := max(changes) if max(changes) < change else 0.0:
        path = parameters[changes.index(largest)].path
        raise InputError(
            f"every contact of this run only grazes: a change of '{path}' by {100.0 * change:g} % may remove it",
            "faster contacts, or a smaller change",
            f"change={0.5 * largest:.1g}",
        )


def _dataset(mechanism: Mechanism, responses: Sequence[Response], derived: _Derived) -> xr.Dataset:
    import xarray as xr

    parameters, values, limits = derived.parameters, derived.values, [row[2] for row in derived.rows]
    smooth = np.array([row[1] for row in derived.rows], bool).T
    numbers = np.array([parameter.value for parameter in parameters])
    derivative = derived.slopes / np.array([parameter.scale for parameter in parameters])
    with np.errstate(divide="ignore", invalid="ignore"):
        elasticity = derivative * numbers / values[:, None]
    elasticity[:, numbers == 0.0], elasticity[values == 0.0] = np.nan, np.nan  # no change is a fraction of zero
    both = ("measure", "parameter")
    return xr.Dataset(
        {
            "value": ("measure", values, {"long_name": "value, in the unit of the measure"}),
            "unit": ("measure", [unit_of(mechanism, response.measure, response.part) for response in responses]),
            "parameter_value": ("parameter", numbers, {"long_name": "value, in the unit of the parameter"}),
            "parameter_unit": ("parameter", [parameter.unit for parameter in parameters]),
            "derivative": (both, derivative, {"long_name": "derivative, in the unit of the measure per unit of the parameter"}),
            "elasticity": (both, elasticity, {"units": "1", "long_name": "relative change per relative change"}),
            "smooth": (
                both,
                smooth,
                {"long_name": "False if another part has the same largest value, now or changed"},
            ),
            "valid_until": (
                "parameter",
                [limit.time for limit in limits],
                {"units": "s", "long_name": "instant until which the gradient is valid"},
            ),
            "limit": ("parameter", [limit.reason for limit in limits], {"long_name": "reason of the limit, or empty"}),
        },
        coords={
            "measure": [response.name for response in responses],
            "parameter": [parameter.path for parameter in parameters],
        },
    )


def _curves(derived: _Derived) -> xr.Dataset:
    """Return the variables over time, and their derivatives along `parameter`, in SI units."""
    assert derived.path is not None
    path = as_dataset(derived.path)
    names, scales = list(curve_names(derived.path)), [parameter.scale for parameter in derived.parameters]
    selected = path[names]
    selected.attrs = {}
    for name in names:
        slopes = np.stack([part[name] / scale for part, scale in zip(derived.curves, scales, strict=True)], axis=-1)
        text = f"derivative of '{name}', in its unit per unit of the parameter"
        selected[f"{name}_derivative"] = ((*path[name].dims, "parameter"), slopes, {"long_name": text})
    return selected.rename(unit="scissor_unit") if "unit" in selected.dims else selected  # `unit` is that of a measure
