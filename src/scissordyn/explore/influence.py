"""Compute in the background how much the answers and curves of a run change with the numbers of its case."""

from __future__ import annotations

import logging
import math
import threading
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from scissordyn.casefile.quantity import unit_factor
from scissordyn.errors import InputError, ScissordynError
from scissordyn.explore.answers import Tangent
from scissordyn.run.advance.interrupt import check_interrupt, interrupted_by
from scissordyn.units import short

if TYPE_CHECKING:
    import xarray as xr

    from scissordyn.explore.case import Case
    from scissordyn.explore.session import Outcome
    from scissordyn.model.mechanism import Mechanism
    from scissordyn.record.results import Run
    from scissordyn.record.summary import Summary
    from scissordyn.sensitivity.seed import Parameter

log = logging.getLogger(__name__)

# Note next to derivatives of a case with a given step size
STEP_NOTE = "the run of the derivatives has error control, without the step of the case"

# Reason why a parameter is left out of the list of influences
ZERO_REASON = "it is zero, and no change is a percentage of zero"


def measures(summary: Summary, mechanism: Mechanism) -> dict[str, str]:
    """Return the measures of the answers that have derivatives, with their labels."""
    labels = dict[str, str]()
    parts: dict[str, set[str]] = {
        "peak_drive_torque": {drive.body for drive in mechanism.drives},
        "peak_coordinate_drive_force": {drive.name for drive in mechanism.coordinate_drives},
        "peak_coupling_force": {coupling.name for coupling in mechanism.couplings},
        "peak_component_force": {component.name for component in mechanism.components},
    }
    force = summary.force and (summary.force.loose or summary.force)
    located = {joint.name for joint in mechanism.contacts}
    if force is not None and force.joint in located and not force.estimated and math.isnan(force.film):
        labels[f"{force.joint}.peak_force"] = f"largest force at {force.joint}"
    labels |= {f"{point.name}.peak_track_deviation": f"deviation of {point.name}" for point in summary.points}
    for actuator in summary.actuators:
        measure = next((measure for measure, names in parts.items() if actuator.name in names), "")
        if measure and math.isfinite(actuator.torque):
            quantity = "force" if actuator.unit == "N" else "torque"
            labels[f"{actuator.name}.{measure}"] = f"largest {quantity} of {actuator.name}"
    return labels


@dataclass(frozen=True, eq=False)
class Order:
    """Numbers of a run whose influence is wanted, by their keys in the form, and the one whose tangents are wanted, or ""."""

    outcome: Outcome
    keys: Sequence[str]
    drawn: str
    change: float = 0.01  # Relative change of a number for which the derivatives are used


@dataclass(frozen=True, eq=False)
class Influence:
    """Derivatives of a run by numbers of its case: of its answers by all of them, of its curves by the one that is drawn."""

    order: Order
    error: str = ""  # Reason for missing derivatives
    answers: xr.Dataset | None = None
    left_out: dict[str, str] = field(default_factory=dict)  # Reason by key of each number without derivatives
    curves: xr.Dataset | None = None

    def plain(self) -> dict[str, Any]:
        """Return the influence on the answers as a dictionary for the page; elasticities in the order of the measures."""
        rows: dict[str, dict[str, Any]] = {key: {"why": why} for key, why in self.left_out.items()}
        for key in [] if self.answers is None else self.answers["parameter"].values.tolist():
            assert self.answers is not None
            row = self.answers.sel(parameter=key)
            until = short(float(row["valid_until"]), "s") if str(row["limit"].values) else ""
            rows[key] = {"elasticity": row["elasticity"].values.copy(), "until": until}
        names = [] if self.answers is None else self.answers["measure"].values.tolist()
        return {
            "run": self.order.outcome.number,
            "reason": self.error,
            "note": STEP_NOTE if _has_ignored_step(self.order.outcome.case) else "",
            "change": self.order.change,
            "measures": names,
            "rows": rows,
        }

    def tangent(self, run: Run, widening: float = 5.0) -> Tangent | None:
        """Return the drawn curves of the run to first order after the change of the number that is drawn.

        They end where a change of this size is no longer small.
        """
        if self.curves is None:
            return None
        from scissordyn.record.xarray_dataset import as_dataset  # the derivatives have imported xarray already

        drawn, row = as_dataset(run), self.curves.isel(parameter=0)
        step = self.order.change * float(row["parameter_value"])
        kept = drawn["time"].values <= float(row["valid_until"])
        moved = {
            name: (row[name].dims, drawn[name].values[kept] + step * row[f"{name}_derivative"].values[kept])
            for name in (str(name) for name in drawn)
            if f"{name}_derivative" in row and row[name].dims == drawn[name].dims
        }
        # located values between samples are not moved
        located = [str(name) for name in drawn.variables if "contact" in drawn[name].dims or str(name).endswith("_time")]
        label = f"±{100.0 * self.order.change:g} % of {self.order.outcome.case.field(self.order.drawn).label}"
        end = f", valid until {short(float(row['valid_until']), 's')}" if str(row["limit"].values) else ""
        text = f"change of the curves by {label}, drawn {widening:g} times as wide{end}"
        return Tangent(text, drawn.isel(time=kept).drop_vars(located).assign(moved), widening)


class Influences:
    """Background computation of the newest order; `done` is called with its result unless it is cancelled."""

    def __init__(self, done: Callable[[Influence], None]) -> None:
        self._done = done
        self.newest: Order | None = None
        self._stop = threading.Event()
        self._turn = threading.Lock()  # an interrupted computation ends before the next one begins

    def order(self, order: Order, earlier: Influence | None) -> None:
        """Compute an order instead of the previous one; the derivatives of `earlier` are not computed again."""
        self.cancel()
        self.newest, self._stop = order, (stop := threading.Event())
        threading.Thread(target=self._work, args=(order, earlier, stop), name="scissordyn influence", daemon=True).start()

    def cancel(self) -> None:
        """End the current computation."""
        self._stop.set()

    def _work(self, order: Order, earlier: Influence | None, stop: threading.Event) -> None:
        try:
            with self._turn, interrupted_by(stop):
                for influence in influences(order, earlier):
                    if not stop.is_set():
                        self._done(influence)
        except KeyboardInterrupt:
            return


def influences(order: Order, earlier: Influence | None = None) -> Iterator[Influence]:
    """Yield the influence on the answers, then also that on the curves if a parameter is drawn.

    The answers of `earlier` are used again if it has the same run and parameters.
    """
    case = order.outcome.case
    try:
        check_interrupt()
        if earlier is None or earlier.order.outcome is not order.outcome or earlier.order.keys != order.keys:
            earlier = _influence(order)
            yield earlier
        influence = replace(earlier, order=order, curves=None)
        curves = order.outcome.curves
        if order.drawn in case.fields and not influence.error and order.drawn not in influence.left_out and curves is not None:
            influence = replace(influence, curves=_derived(order, (), [order.drawn], curves["time"].values))
        yield influence
    except ScissordynError as error:
        yield Influence(order, f"{error.what}; expected {error.expected}" if isinstance(error, InputError) else str(error))
    except Exception:  # the run is usable without its derivatives
        log.exception("no derivatives of a run")
        yield Influence(order, "internal error: see the terminal of the explorer")


def _influence(order: Order) -> Influence:
    import json

    if order.outcome.run is None or order.outcome.run.attrs["status"] != "complete":
        raise InputError("the run is not complete", "a run that reaches its end")
    case = order.outcome.case
    names = list(measures(order.outcome.summary, case.mechanism))
    zeros = dict.fromkeys((key for key in order.keys if case.field(key).value == (0.0,)), ZERO_REASON)
    if len(zeros) == len(order.keys):
        raise InputError(f"each number is left out: {ZERO_REASON}", "a number that is not zero")
    derivatives = _derived(order, names, [key for key in order.keys if key not in zeros], np.zeros(0))
    return Influence(order, answers=derivatives, left_out=zeros | json.loads(derivatives.attrs["left_out"]))


def _has_ignored_step(case: Case) -> bool:
    from scissordyn.sensitivity.gradient import ignores_step

    return ignores_step(case.mechanism, case.options)


def _derived(order: Order, of: Sequence[str], keys: Sequence[str], times: np.ndarray) -> xr.Dataset:
    from scissordyn.model.options import Options
    from scissordyn.sensitivity.gradient import compute_gradient

    case, run, tight = order.outcome.case, order.outcome.case.options, 1e-11
    step = None if _has_ignored_step(case) else run.step
    options = Options(run.until, run.start, 2, tight, None, run.method, run.most_steps, "located", step=step)
    by = [parameter_of_field(case, key) for key in keys if case.field(key).range is not None]
    return compute_gradient(case.mechanism, of, by, options, order.change, times)


def parameter_of_field(case: Case, key: str) -> Parameter:
    """Return the number of a form field as a parameter; it may change many parts of the mechanism together."""
    from scissordyn.sensitivity.seed import Parameter

    number = case.field(key)
    factor = unit_factor(number.unit, number.quantity.unit) if number.unit else 1.0

    def mechanism(value: float) -> Mechanism:
        check_interrupt()
        if number.is_integer:
            raise InputError("it is an integer", "a number that can change by any small amount")
        return case.changed({key: f"{value / factor!r} {number.unit}".strip()}).mechanism

    return Parameter(key, number.value[0], abs(number.value[0]) or 1.0, number.quantity.unit, mechanism)
