"""Exact derivatives of the runs of all examples beside extrapolated differences of runs, by every parameter of each.

In the largest example most parameters are compared in groups along two directions, which takes a third of the time or less.
``python -m benchmarks.gradient_differences --write`` writes the page, in hours, one process for two processors; ``--quick``
takes two examples. First come some parameters of each example, then the others. Ctrl-C ends it with a page of what is
complete; it continues there the next time.
"""

from __future__ import annotations

import os
import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path

import numpy as np

import scissordyn as sd
from benchmarks.kept import Kept
from benchmarks.measure import command, paragraph, table
from scissordyn.errors import InputError, ScissordynError
from scissordyn.integrate.integration import LARGEST, TIME
from scissordyn.kinematics.assembly import refined_assemblies
from scissordyn.mechanics.monitored import COMPONENT_FORCE, COUPLING_FORCE, DRIVE_TORQUE, INDENTATION
from scissordyn.model.parameter_path import changed, every_number
from scissordyn.plan.plan import Plan, plan
from scissordyn.run.advance.driver import Driver
from scissordyn.run.advance.loop import advance
from scissordyn.run.trajectory import make_driver
from scissordyn.sensitivity.forward import Forward, forward
from scissordyn.sensitivity.gradient import check_derivable
from scissordyn.sensitivity.library import DERIVATIVES
from scissordyn.sensitivity.seed import Parameter, Start, derivatives, parameter_of

EXAMPLES = Path(__file__).parent.parent / "examples"

ENDS: Mapping[str, float] = {
    "clearance_guide": 0.003,
    "controlled": 0.05,
    "four_bar": 0.01,
    "lift": 0.09,
    "lift_table": 0.1,
    "long": 0.09,
    "mast": 0.006,
    "paper": 0.01,
    "periodic": 0.01,
    "press": 0.02,
    "ring": 0.01,
    "self_deploying": 0.02,
    "slider_crank": 0.0015,
    "solar_array": 0.018,
    "worn_crank": 0.002,
    "mast_twenty": 0.15,
}
"""End of the run of each example [s]: several contacts, and derivatives that differences can still follow."""

QUICK = ("paper", "slider_crank")

PROCESSES = max(1, (os.cpu_count() or 1) // 2)  # Number of parts of examples at once

FIRST_PARAMETERS = 16  # Number of parameters of an example that are compared before all others: two runs with derivatives
PARAMETERS = 24  # Number of further parameters that are compared, and kept, at once: three runs with derivatives
TOGETHER = ("mast_twenty",)  # Examples whose further parameters are compared along directions

TOLERANCE = 1e-13
LOOSER = {"lift": 1e-11, "solar_array": 1e-11, "lift_table": 1e-11, "mast": 1e-12}
"""Tolerances with bristles that hardly move, or bars that bend: round-off makes ten to a hundred times more steps at 1e-13."""
PRECISION_FACTOR = 1e-4  # [precisions of located events] Precision in these runs; it limits the differences of instants
STEP_MAX = 1e-2  # [parameter scales] Step of the differences
JOURNAL_STEP = 0.02  # [clearances] Largest displacement of a journal at an event by a step
STEP_FACTORS = tuple(0.25**k for k in range(8))  # Further steps are tried while they reduce an estimated error above the goal
MOST_STEPS_FACTOR = 10  # [steps of the unchanged run] Number that ends a run with a changed parameter, as damping that is stiff
PLACES = ((-4, -3, -2, -1, 1, 2, 3, 4), (0, 1, 2, 3, 4, 5, 6, 7), (0, -1, -2, -3, -4, -5, -6, -7))
"""Places of the runs [steps]; those on one side for a parameter at its bound."""

ACCURATE = 1e-7  # Error of an accurate reference
USELESS = 1e-3  # Estimated error above which all steps are tried, and after central differences those on one side
GOAL = 1e-8  # Error relative to the largest derivative or value of the same kind of result
MARGIN = 3.0
"""Margin of the estimated error of a difference: its distance from a lower order, and the deviation of the noise of runs."""

DIRECTIONS = ("cosines of ", "sines of ")  # Beginnings of the names of two directions along which several parameters change

KINDS = {"torques": DRIVE_TORQUE, "components": COMPONENT_FORCE, "penetrations": INDENTATION, "couplings": COUPLING_FORCE}
"""Kinds of largest values, by their names on the page."""

Results = dict[str, np.ndarray]


@dataclass
class Row:
    """Difference of both derivatives by a parameter for a kind of result, relative to the size of the kind.

    `reference` is the distance of differences of two orders, `noise` the deviation of a run's results, `gain` the factor of
    this noise in the difference.
    """

    example: str
    parameter: str
    kind: str
    error: float
    reference: float
    noise: float
    gain: float


@dataclass
class Found:
    """Comparison of parameters of an example, their number, and the reason for each parameter that is left out.

    `scalars` is the number of all parameters of the example, `together` that of those compared along directions alone.
    """

    rows: list[Row] = field(default_factory=list)
    left_out: dict[str, str] = field(default_factory=dict)
    parameters: int = 0
    events: int = 0
    refused: str = ""
    scalars: int = 0
    together: int = 0

    def __post_init__(self) -> None:
        self.rows = [row if isinstance(row, Row) else Row(**row) for row in self.rows]

    def add(self, other: Found) -> None:
        """Add the comparison of further parameters."""
        self.rows += other.rows
        self.left_out |= other.left_out
        self.parameters += other.parameters
        self.together += other.together
        self.events = other.events
        self.refused = self.refused or other.refused
        self.scalars = other.scalars


def scheme(places: Sequence[int]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return weights of the first derivative, of one of a lower order, and of the highest difference, whose norm is 1."""
    at = np.array(places, float)
    powers = np.vander(at, increasing=True).T
    first = np.eye(at.size)[1]
    best, inner = np.linalg.solve(powers, first), np.argsort(np.abs(at), kind="stable")[: at.size - 2]
    lower = np.zeros(at.size)
    lower[inner] = np.linalg.solve(np.vander(at[inner], increasing=True).T, first[: inner.size])
    highest = np.linalg.svd(powers[:-1])[2][-1]
    return best, lower, highest


def results(driver: Driver) -> Results:
    """Return the results of a run by kind."""
    n, state = driver.plan.coordinates.free, driver.state
    rows = {name: state.peak[driver.rows(kind), LARGEST] for name, kind in KINDS.items()}
    return {"coordinates": state.y[:n].copy(), "rates": state.y[n : 2 * n].copy(), "instants": driver.log["time"], **rows}


def exact(run: Forward, parameter: int) -> Results:
    """Return the derivatives of the results of a run by one parameter."""
    driver, state = run.driver, run.state[..., parameter]
    n = driver.plan.coordinates.free
    rows = {name: run.peak[driver.rows(kind), LARGEST, parameter] for name, kind in KINDS.items()}
    return {"coordinates": state[:n], "rates": state[n : 2 * n], "instants": run.log[:, TIME, parameter], **rows}


def precise_run(tables: Plan, options: sd.Options) -> tuple[Results, np.ndarray, int]:
    """Run with a start without round-off and precisely located events; return its results, guards of events and steps."""
    with refined_assemblies():
        driver, _, _ = make_driver(tables, options)
    driver.integration.content.work.precision[:] *= PRECISION_FACTOR
    advance(driver, options.until, most_steps=options.most_steps)
    if driver.time < options.until:
        raise ScissordynError("runs with a changed parameter need many more steps, or end early")
    return results(driver), driver.log["guard"].copy(), driver.steps_tried


def step_of(driver: Driver, slope: np.ndarray) -> float:
    """Return the step of the differences [parameter scales] from the derivatives of all instants of events."""
    log, clearance = driver.log, driver.system.content.parameters.contact["clearance"]
    moved = 0.0
    for row, by in zip(log, slope.tolist(), strict=True):
        if row["guard"] < clearance.size:
            moved = max(moved, abs(row["rate"] * by) / clearance[int(row["guard"])])
    return min(STEP_MAX, JOURNAL_STEP / moved) if moved else STEP_MAX


def size_of(slopes: Results, values: Results, kind: str) -> float:
    """Return the largest derivative of a kind of result, by parameter / scale, or the largest value if that is larger."""
    sizes = (np.max(np.abs(a[np.isfinite(a)]), initial=0.0) for a in (slopes[kind], values[kind]))
    return max(float(size) for size in sizes) or 1.0


class Comparison:
    """Runs of an example whose parameters change, beside its exact derivatives, by the parameters of a part."""

    def __init__(self, name: str, part: int) -> None:
        case = sd.read_case(EXAMPLES / f"{name}.toml")
        self.name, self.mechanism, self.start = name, case.mechanism, case.run.start
        tolerance = LOOSER.get(name, TOLERANCE)
        parts = parts_of(case.mechanism)
        self.paths, scalars = parts[part], sum(map(len, parts))
        self.together = part > 0 and name in TOGETHER
        self.tables, self.found = plan(case.mechanism), Found(parameters=len(self.paths), scalars=scalars)
        hard = bool(self.tables.hard_places)
        self.options = sd.Options(
            ENDS[name],
            self.start,
            2,
            tolerance,
            tolerance,
            "auto" if hard else "dop853",
            events="located",
            step=case.run.step if hard else None,
        )

    def compare(self) -> Found:
        """Compare both kinds of derivatives by each parameter."""
        try:
            check_derivable(self.tables)
        except InputError as refused:
            self.found.refused = refused.what
            return self.found
        parameters, seeds = self._seeds()
        self.values, self.guards, steps = precise_run(self.tables, self.options)
        self.options = replace(self.options, most_steps=MOST_STEPS_FACTOR * steps)
        self.found.events = self.guards.size
        for first in range(0, len(parameters), DERIVATIVES):
            run, chosen = forward(self.tables, self.options, seeds[first:][:DERIVATIVES]), parameters[first:][:DERIVATIVES]
            several = [exact(run, k) for k in range(len(chosen))]
            if self.together and self._agree_together(run.driver, several, chosen):
                continue
            for slopes, parameter in zip(several, chosen, strict=True):
                try:
                    self._compare_with(slopes, parameter, step_of(run.driver, slopes["instants"]))
                except ScissordynError as refused:
                    self.found.left_out[parameter.path] = f"no differences: {getattr(refused, 'what', refused)}"
        return self.found

    def _seeds(self) -> tuple[list[Parameter], list[Results]]:
        """Return the parameters with derivatives, and the derivatives of the start by each."""
        begin, parameters, seeds = Start(self.mechanism, self.start), list[Parameter](), list[Results]()
        for path in self.paths:
            try:
                parameter = parameter_of(self.mechanism, path, self.tables.coordinates.size)
                seed = derivatives(begin, parameter)
            except InputError as refused:
                self.found.left_out[path] = refused.what
                continue
            if seed:
                parameters.append(parameter)
                seeds.append(seed)
        return parameters, seeds

    def _agree_together(self, driver: Driver, several: Sequence[Results], parameters: Sequence[Parameter]) -> bool:
        """Compare the derivatives along two directions that change all parameters; False if each has to be compared alone.

        A parameter's weight is the reciprocal of its largest derivative relative to the largest value of the same kind,
        at most one, times the cosine or sine of an angle of its own: two errors cannot cancel in both directions.
        """
        first, begin = several[0], len(self.found.rows)
        if any(np.any(np.isnan(slopes[kind]) != np.isnan(first[kind])) for slopes in several for kind in first):
            return False
        none = dict.fromkeys(first, np.zeros(0))
        sizes = [max(size_of(slopes, none, kind) / size_of(none, self.values, kind) for kind in first) for slopes in several]
        angles = np.pi * (np.arange(len(several)) + 0.5) / len(several)
        try:
            for name, factors in zip(DIRECTIONS, (np.cos(angles), np.sin(angles)), strict=True):
                weights = factors / np.maximum(sizes, 1.0)
                sums = {kind: np.tensordot(weights, [slopes[kind] for slopes in several], 1) for kind in first}
                path, moved = f"{name}{len(several)} from {parameters[0].path}", partial(self._moved, parameters, weights)
                self._compare_with(sums, Parameter(path, 0.0, 1.0, "", moved), step_of(driver, sums["instants"]))
            if any(_estimate(row) > ACCURATE or row.error > max(GOAL, _estimate(row)) for row in self.found.rows[begin:]):
                raise ScissordynError("the derivatives along the direction differ, or their reference is inaccurate")
        except ScissordynError:
            del self.found.rows[begin:]
            return False
        self.found.together += len(several)
        return True

    def _moved(self, parameters: Sequence[Parameter], weights: np.ndarray, part: float) -> sd.Mechanism:
        mechanism = self.mechanism
        for parameter, weight in zip(parameters, weights.tolist(), strict=True):
            mechanism = changed(mechanism, parameter.path, parameter.value + part * weight * parameter.scale)
        return mechanism

    def _compare_with(self, slopes: Results, parameter: Parameter, step: float) -> None:
        """Append a row for each kind of result, with the step whose differences have the smallest estimated error."""
        rows, runs, cause = dict[str, Row](), dict[float, Results](), ScissordynError("")
        for places in PLACES:
            for factor in STEP_FACTORS:
                try:
                    tried = self._rows(slopes, parameter, places, factor * step, runs)
                except ScissordynError as refused:
                    cause = refused
                    continue
                useful = False  # for a result that is not yet at the goal; yet shorter steps have more noise
                for row in tried:
                    before = rows.get(row.kind)
                    if before is None or _estimate(row) < _estimate(before):
                        rows[row.kind] = row
                        useful = useful or before is None or _estimate(before) > GOAL
                largest = max(map(_estimate, rows.values()))
                if largest < GOAL or (not useful and largest < USELESS):
                    break
            # where the assembly or the law jumps at the parameter's value, one side is smooth
            if rows and max(map(_estimate, rows.values())) < USELESS:
                break
        if not rows:
            raise cause
        self.found.rows += rows.values()

    def _rows(
        self, slopes: Results, parameter: Parameter, places: Sequence[int], step: float, known_runs: dict[float, Results]
    ) -> list[Row]:
        best, lower, highest = scheme(places)
        runs = []
        for place in places:
            part = place * step
            if part not in known_runs:
                found, events, _ = precise_run(plan(parameter.moved(part)), self.options)
                if not np.array_equal(events, self.guards):
                    raise ScissordynError("runs with a changed parameter have other events")
                known_runs[part] = found
            runs.append(known_runs[part])
        rows = []
        for kind, slope in slopes.items():
            values = np.array([run[kind] for run in runs])
            known = np.isfinite(slope) & np.isfinite(values).all(axis=0)
            if not known.any():
                continue
            values, slope = values[:, known], slope[known]
            difference = best @ values / step
            size = size_of({kind: difference}, self.values, kind)
            apart, truncation = (float(np.max(np.abs(other - difference))) for other in (slope, lower @ values / step))
            noise = float(np.max(np.abs(highest @ values)))
            gain = float(np.linalg.norm(best)) / step
            rows.append(Row(self.name, parameter.path, kind, apart / size, truncation / size, noise / size, gain))
        return rows


def _estimate(row: Row) -> float:
    return MARGIN * (row.reference + row.gain * row.noise)


def measure(quick: bool) -> str:
    """Differences of both kinds of derivatives: a table of examples, one of the worst, and what is left out."""
    names, kept = QUICK if quick else tuple(ENDS), Kept("gradient_differences", Found, __file__)
    keys = {name: list(keys_of(name)) for name in names}
    # the first part of each example, then the others, examples with few parameters first
    ordered = sorted((key for part in keys.values() for key in part), key=lambda key: (key[1] > 0, len(keys[key[0]])))
    with ProcessPoolExecutor(PROCESSES) as pool:
        try:
            for done in as_completed([pool.submit(compare, *key) for key in ordered if key not in kept.done]):
                kept.add(*done.result())
        except KeyboardInterrupt:
            pool.shutdown(cancel_futures=True)
    done = {name: [kept.done[key] for key in keys[name] if key in kept.done] for name in names}
    return page({name: combined(found) for name, found in done.items() if found})


def parts_of(mechanism: sd.Mechanism) -> list[list[str]]:
    """Return the paths of all parameters of an example in parts; the first part is an even selection."""
    paths = every_number(mechanism)
    first = paths[:: -(-len(paths) // FIRST_PARAMETERS)]
    others = [path for path in paths if path not in first]
    return [first, *(others[at : at + PARAMETERS] for at in range(0, len(others), PARAMETERS))]


def keys_of(name: str) -> Iterator[tuple[str, int]]:
    """Yield the arguments of `compare` for all parameters of an example."""
    yield from ((name, part) for part in range(len(parts_of(sd.read_case(EXAMPLES / f"{name}.toml").mechanism))))


def compare(name: str, part: int) -> tuple[tuple[str, int], Found]:
    """Return the key and the comparison of some parameters of an example, or the reason why they have none."""
    try:
        return (name, part), Comparison(name, part).compare()
    except ScissordynError as refused:
        return (name, part), Found(refused=str(refused))


def combined(parts: Sequence[Found]) -> Found:
    """Return the comparison of all parameters of an example; `reference` is the error of each reference then."""
    found = Found()
    for part in parts:
        found.add(part)
    for kind in ("coordinates", "rates", "instants", *KINDS):
        rows = [row for row in found.rows if row.kind == kind]
        noise = float(np.median([row.noise for row in rows])) if rows else 0.0
        for row in rows:
            row.reference = MARGIN * (row.reference + row.gain * max(noise, row.noise))
    return found


def page(comparisons: Mapping[str, Found]) -> str:
    """Return the tables of some comparisons by example."""
    heads, rows, refused, lists, reasons = [], list[Row](), [], list[str](), Counter[str]()
    for name, found in comparisons.items():
        if found.refused:
            refused.append(f"* {name}: {found.refused}")
            continue
        rows += found.rows
        reasons.update(_reason(text) for text in found.left_out.values())
        errors = np.array([(row.error, row.reference) for row in found.rows])
        accurate = errors[errors[:, 1] <= ACCURATE, 0]
        numbers = [float(np.median(errors[:, 0])), float(np.max(accurate, initial=0.0)), float(np.max(errors[:, 0]))]
        alone = sorted({row.parameter for row in found.rows if not row.parameter.startswith(DIRECTIONS)})
        if found.together:
            lists.append(paragraph(f"* {name}: {', '.join(alone)}"))
        tried = "all" if found.parameters == found.scalars else found.parameters
        counts = (found.events, found.scalars, tried, len(alone), found.together)
        beyond = sum(map(_is_beyond, found.rows))
        heads.append([name, f"{ENDS[name]:g}", *map(str, counts), *(f"{n:.0e}" for n in numbers), str(beyond)])
    rows.sort(key=lambda row: -row.error)
    text = paragraph(
        f"Runs with dop853 at rtol = atol = {TOLERANCE:g},",
        f"{', '.join(f'of {name} at {tolerance:g}' for name, tolerance in LOOSER.items())}; with hard",
        "contact time steps of the case, with located impacts.",
        "Derivatives of coordinates and rates at the end, of all instants of events and of largest values, by every",
        "parameter that acts, exact and by differences of eighth order with events located to",
        f"{PRECISION_FACTOR:g} of their usual precision. The table has the number of scalars of each example, how many of them",
        "were tried, and how many were compared alone and together: scalars that do not affect the run, or have no",
        f"derivatives, are left out. In {' and '.join(TOGETHER)} most are compared together: up to eight change at once, along",
        "two directions. The exact derivative along a direction is the sum of those by its parameters times their weights,",
        "the reciprocal of a parameter's largest effect times the cosine or the sine of an angle of its own between 0 and 180",
        "degrees. An error therefore shows in one of both, and two errors cannot cancel in both. Where a derivative differs",
        f"by more than the error of the reference, or this error is above {ACCURATE:g}, each parameter is compared alone.",
        "Differences between both are relative to the largest derivative or value of the same kind of result. The error",
        "of the reference is three times its distance from differences of sixth order and the deviation of the noise of",
        f"runs, which follows from their seventh differences. The last column counts results that differ by more than {GOAL:g}",
        "and by more than the error of the reference.",
    )
    head = (
        "example",
        "end [s]",
        "events",
        "scalars",
        "tried",
        "alone",
        "together",
        "median",
        f"largest by references to {ACCURATE:g}",
        "largest",
        "beyond",
    )
    parts = [text, "\n" + table(head, heads)]
    for title, chosen in (
        (f"The largest of {len(rows)} differences", rows[:15]),
        ("The largest beyond the error of the reference", [row for row in rows if _is_beyond(row)][:15]),
    ):
        cells = [[r.parameter, r.example, r.kind, f"{r.error:.1e}", f"{r.reference:.1e}"] for r in chosen]
        parts.append(f"{title}:\n\n" + table(("parameter", "example", "result", "difference", "error of the reference"), cells))
    if lists:
        parts.append("Compared alone in examples whose other parameters are compared together:\n\n" + "\n".join(lists) + "\n")
    if missing := [name for name in ENDS if name not in comparisons]:
        parts.append(f"Not compared: {', '.join(missing)}.\n")
    left = [f"* {count}: {reason}" for reason, count in reasons.most_common()]
    if refused:
        refused = ["\nExamples that cannot be compared:\n", *refused]
    return "\n".join([*parts, "Parameters that are left out:\n", *left, *refused, ""])


def _is_beyond(row: Row) -> bool:
    return row.error > max(GOAL, row.reference)


def _reason(text: str) -> str:
    """Return a reason without the name and the value of its parameter."""
    if text.startswith("no differences"):
        return text.partition(" = ")[0]
    if "cannot be assembled" in text:
        return "cannot change alone: the mechanism as placed cannot be assembled"
    return re.sub(r"'[^']*'( = [^:]*)?:? ?", "", text, count=1).strip()


if __name__ == "__main__":
    command("gradient_differences", measure)
