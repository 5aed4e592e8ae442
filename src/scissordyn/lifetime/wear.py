"""Wear of joints over many cycles: simulate a cycle, wear the joints by its loads for some cycles, repeat."""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Callable, Iterator, Mapping
from types import MappingProxyType
from typing import Annotated, Any, NamedTuple

import numpy as np
import xarray as xr

from scissordyn.casefile.configuration import write_configuration
from scissordyn.errors import InputError, ScissordynError
from scissordyn.lifetime.error import depth_errors, mean_error
from scissordyn.lifetime.ideal import IdealRunner
from scissordyn.lifetime.life import add_lives, repetition
from scissordyn.lifetime.loads import CycleRunner, Loads, with_coefficients, worn_surfaces
from scissordyn.lifetime.step import Worn, WornJoint
from scissordyn.model.mechanism import Mechanism
from scissordyn.model.options import EndTime, Options, StartKind
from scissordyn.model.wear import Coefficients, CycleKind, LoadsKind, Wear
from scissordyn.record.warn import warnings_of
from scissordyn.run.stops import drive_period
from scissordyn.units import Meaning, checked, quantities, short
from scissordyn.warning import first_of_each, warning

TITLE = "scissordyn wear"


STEPS_MIN = 8
"""Smallest number of wear steps in a life.

Nine states widen the interval by less than a fifth, because the scatter of so few is not well known.
"""

TOLERANCE_FRACTION = 2e-3  # [clearances] default of the largest error of a step


class State(NamedTuple):
    """Contours of the worn surfaces after a number of cycles, and the loads of a cycle simulated with them."""

    cycle: int
    step: int  # number of cycles since the previous state
    depths: np.ndarray  # (surfaces, angles) [m]
    loads: Loads
    rates: np.ndarray  # (members, surfaces, angles) depth that each simulated cycle wears [m]
    correction: np.ndarray  # (surfaces, angles) depths minus those of constant loads over each step [m]
    simulations: int = 1  # number of simulations until the step that ends here had a small enough error


@checked
def wear(
    mechanism: Mechanism,
    *,
    until: EndTime,
    cycles: Annotated[int, quantities(Wear)["cycles"]] = Wear.cycles,
    cycle: CycleKind = "auto",
    settle: Annotated[int, quantities(Wear)["settle"]] = Wear.settle,
    members: Annotated[int, quantities(Wear)["members"]] = Wear.members,
    tolerance: Annotated[float | None, quantities(Wear)["tolerance"]] = None,
    angles: Annotated[int, quantities(Wear)["angles"]] = Wear.angles,
    most_clearance: Annotated[float | None, quantities(Wear)["most_clearance"]] = None,
    coefficients: Coefficients = MappingProxyType({}),
    loads: LoadsKind = "simulated",
    start: StartKind = "concentric",
    rtol: float = 1e-6,
    atol: float | None = None,
    method: str = "auto",
    most_steps: int = Options.most_steps,
    earlier: Annotated[
        xr.Dataset | None, Meaning("an unfinished result of the same wear computation, which is continued")
    ] = None,
    each: Annotated[Callable[[xr.Dataset], None] | None, Meaning("called with the current result after each step")] = None,
    progress: Callable[[int, int], None] | None = None,
) -> xr.Dataset:
    r"""Wear the joints of a mechanism over many cycles by Archard's law.

    Some cycles are simulated, and the loads on each joint are collected by angle. Under these loads the joint wears for n
    cycles; then cycles are simulated again with the worn joint. A step of n cycles whose error exceeds the tolerance is
    repeated with fewer.

    .. math:: \frac{\mathrm{d}V}{\mathrm{d}t} = k F_n |v_t|, \qquad \mathrm{d}h = k\, p\, |v_t|\, \mathrm{d}t

    The wear depth h follows the pressure p that the contact law has on the worn contours. The bearing wears, and the journal
    if it has a coefficient.

    Parameters
    ----------
    mechanism : Mechanism
        Mechanism with a wear coefficient at one or several clearance joints, ``Clearance(wear=..., journal_wear=...)``.
    until : float
        End of the run that is a cycle [s]; not used where a cycle is a period of the drive.
    cycles : int
        Number of cycles.
    cycle : {"auto", "period", "run"}
        "period": a cycle is a period of the drive. "run": it is the whole run, for example a deployment and its return,
        which starts again in each cycle. "auto": the period if the drives have one.
    settle : int
        Periods at the start of each simulation that are not counted.
    members : int
        Number of averaged cycles: periods one after another, or runs from starts that differ by round-off. Their spread
        gives the interval of the life; one member gives no interval.
    tolerance : float, optional
        Largest error of a contour in one step of n cycles [m]: its difference from the contour that loads as at the start of
        the step would give. By default 0.2 % of the clearance of each joint.
    angles : int
        Number of angles of a contour.
    most_clearance : float, optional
        Largest radial clearance [m] that a worn joint may have.
    coefficients : mapping of str to float
        Wear coefficients [m^2/N] by the materials 'journal/bearing', for clearance joints without their own.
    loads : {"simulated", "ideal"}
        "ideal": estimate the loads from the forces of ideal joints instead of simulating contacts, in about a second.
    start, rtol, atol, method, most_steps
        As for `simulate`.
    earlier : Dataset, optional
        Result that was interrupted, or has fewer cycles. The result is that of one run, bit for bit.
    each : callable, optional
        Called after each simulated state with the current result.
    progress : callable, optional
        Called with the number of cycles and the total.

    Returns
    -------
    Dataset
        Along `state`, with the coordinate `cycle(state)`: `depth(state, joint, angle)`, `depth_largest`,
        `depth_error`, `worn_volume`, `worn_clearance` and `peak_force(state, joint)`, and
        `track_deviation(state, track)`. `life(requirement)` with `life_low` and `life_high` is the number of cycles
        until a requirement fails: tolerances of tracks, `most_clearance` and bushes; NaN if it does not. Attributes: status,
        cause, the simulated cycles and warnings.

    Raises
    ------
    InputError
        If no joint wears, or an option is wrong.
    """
    settings = Wear(cycles, cycle, settle, members, tolerance, angles, most_clearance, dict(coefficients), loads)
    options = Options(until, start, 2, rtol, atol, method, most_steps)
    return wear_out(mechanism, options, settings, earlier=earlier, each=each, progress=progress)


def wear_out(
    mechanism: Mechanism,
    options: Options,
    settings: Wear,
    *,
    earlier: xr.Dataset | None = None,
    each: Callable[[xr.Dataset], None] | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> xr.Dataset:
    """Return the result of `wear` for options of a case file."""
    life = _Life(mechanism, options, settings)
    if earlier is not None:
        life.continue_from(earlier)
    try:
        for _ in life.steps():
            if progress is not None:
                progress(life.cycle, settings.cycles)
            if each is not None:
                each(life.dataset("interrupted", "interrupted"))
    except KeyboardInterrupt:
        if not life.states:
            raise
        return life.dataset("interrupted", "interrupted")
    except ScissordynError as error:
        if not life.states:
            raise
        return life.dataset("failed", f"stopped after {life.cycle} cycles: {error}")
    return life.dataset("failed" if life.cause else "complete", life.cause)


class _Life:
    """Wear computation: states of the worn surfaces over the cycles, and the next state to simulate."""

    def __init__(self, mechanism: Mechanism, options: Options, settings: Wear) -> None:
        mechanism, self.warnings = with_coefficients(mechanism, settings.coefficients)
        self.mechanism, self.options, self.settings = mechanism, options, settings
        self.surfaces = worn_surfaces(mechanism)
        self.names, period = [surface.label for surface in self.surfaces], _period(mechanism, settings)
        self.runner: CycleRunner | IdealRunner = (
            CycleRunner(mechanism, options, settings, self.surfaces, period)
            if settings.loads == "simulated"
            else IdealRunner(mechanism, self.surfaces, options.until if period is None else period)
        )
        rows: dict[str, list[int]] = {}
        for row, surface in enumerate(self.surfaces):
            rows.setdefault(surface.joint, []).append(row)
        self.joints = [WornJoint(mechanism, self.surfaces, part, settings.angles) for part in rows.values()]
        self.clearance = np.array([joint.clearance for joint in self.joints for _ in joint.rows])
        self.tolerance = TOLERANCE_FRACTION * self.clearance
        if settings.tolerance is not None:
            self.tolerance[:] = settings.tolerance
        self.cause = ""
        self.states: list[State] = []

    @property
    def cycle(self) -> int:
        """Number of cycles of the last simulated state."""
        return self.states[-1].cycle if self.states else 0

    def steps(self) -> Iterator[None]:
        """Simulate a cycle and wear the bearings, alternately, until all cycles are done; yield after each step."""
        if not self.states:
            depths = np.concatenate([joint.depths for joint in self.joints])
            self._add(State(0, 0, depths, *self._simulated(depths), np.zeros(depths.shape)))
            yield
        while self.cycle < self.settings.cycles and not self.cause:
            self._add(self._next())
            yield

    def _simulated(self, depths: np.ndarray) -> tuple[Loads, np.ndarray]:
        """Return the loads of simulated cycles with given contours, and the depth that each of them wears."""
        loads = self.runner.loads(depths)
        rates = [
            np.concatenate([joint.rate(depths, loads.member(m)) for joint in self.joints]) for m in range(len(loads.energy))
        ]
        return loads, np.array(rates)

    def _next(self) -> State:
        """Return the state after the next step, whose number of cycles is reduced until its error is within the tolerance.

        A step is Heun's method: cycles are simulated with the contours at its end, and the step is repeated with the mean loads
        of both its ends. The loads at the end stay those of the first contours, with an error of second order.
        """
        last, simulations = self.states[-1], 0
        most = min(self.settings.cycles - last.cycle, math.ceil(self.settings.cycles / STEPS_MIN))
        n = max(1, min(most, self._proposed_step(last)))
        while True:
            n, predicted = self._predicted(last, n)
            loads, rates = self._simulated(predicted)
            depths = self._depths(self._worn(last.depths, Loads.joined((last.loads, loads)), n))
            correction, simulations = depths - predicted, simulations + 1
            error = self._error(correction)
            if n == 1 or error <= 1.0:
                break
            n = min(n - 1, max(1, int(n * _factor(error))))
        if error > 1.0:
            worst = int(np.argmax(np.abs(correction).max(axis=1) / self.tolerance))
            self.warnings.append(warning("cycle error", self.names[worst], tolerance=short(float(self.tolerance[worst]), "m")))
        return State(last.cycle + n, n, depths, loads, rates, last.correction + correction, simulations)

    def _proposed_step(self, last: State, growth: float = 4.0) -> int:
        """Return the number of cycles of the next step that the error of the last one suggests.

        The first step is within the tolerance even if the loads double.

        `growth`: largest ratio of the cycle counts of two successive wear steps.
        """
        if last.step:
            return int(last.step * min(growth, _factor(self._error(last.correction - self.states[-2].correction))))
        rate = np.array([part.deepened for part in self._worn(last.depths, last.loads, 1)])
        first = [joint.rows[0] for joint in self.joints]
        return int(min(self.settings.cycles, np.min(2.0 * self.tolerance[first] / np.maximum(rate, np.finfo(float).tiny))))

    def _error(self, correction: np.ndarray) -> float:
        """Return the largest correction of a step, as a multiple of the tolerance."""
        return float(np.max(np.abs(correction).max(axis=1) / self.tolerance))

    def _predicted(self, last: State, n: int) -> tuple[int, np.ndarray]:
        """Return the contours after n cycles with the last loads, and n, reduced until the kernel can compute them."""
        while True:
            worn = self._worn(last.depths, last.loads, n)
            if n == 1 or all(part.depths is not None for part in worn):
                return n, self._depths(worn)
            n //= 2

    def _add(self, state: State) -> None:
        """Keep a state; note a bush that has worn through."""
        self.states.append(state)
        self.warnings = first_of_each([*self.warnings, *state.loads.warnings])
        for joint in self.joints:
            row = joint.rows[0]
            if joint.bush is not None and state.depths[row].max() >= joint.bush and not self.cause:
                text = f"joint '{self.names[row]}' has worn through its bush of {1e3 * joint.bush:g} mm by cycle {state.cycle}"
                self.cause = text

    def _worn(self, depths: np.ndarray, loads: Loads, cycles: int) -> list[Worn]:
        """Return the joints after some cycles with given loads, from contours of shape (surfaces, angles) [m]."""
        return [joint.worn(depths, loads, cycles) for joint in self.joints]

    def _depths(self, worn: list[Worn]) -> np.ndarray:
        """Return the contours after a step, shape (surfaces, angles); raise `ScissordynError` if one has worn too much."""
        for joint, part in zip(self.joints, worn, strict=True):
            if part.depths is None:
                raise ScissordynError(
                    f"a single cycle wears joint '{self.names[joint.rows[0]]}' by far more than its elastic indentation; "
                    "check its coefficient of wear"
                )
        return np.concatenate([part.depths for part in worn if part.depths is not None])

    def continue_from(self, earlier: xr.Dataset) -> None:
        """Load the states of an earlier result of the same wear computation, so that it continues from its last state."""
        self._check_same(earlier)
        repeated = repetition(earlier)
        self.warnings = [item for item in warnings_of(earlier) if item not in repeated]
        for k in range(earlier.sizes["state"]):
            row = earlier.isel(state=k)
            depths, rates, correction = (row[name].values.copy() for name in ("depth", "member_rate", "depth_correction"))
            loads = Loads.from_row(row, self.warnings)
            counts = int(row["cycle"]), int(row["step"])
            self.states.append(State(*counts, depths, loads, rates, correction, int(row["simulations"])))

    def _check_same(self, earlier: xr.Dataset) -> None:
        """Raise `InputError` if an earlier result belongs to another wear computation."""
        if earlier.attrs.get("title") != TITLE:
            raise InputError(f"earlier is a '{earlier.attrs.get('title')}'", "a result of wear()", "load('life.nc')")
        settings = json.loads(earlier.attrs["settings"]) | {"cycles": self.settings.cycles}
        if earlier.attrs["configuration"] != self._configuration() or settings != self._settings():
            raise InputError(
                "the earlier result has another case or other options", "the same case with at least as many cycles"
            )
        reached = int(earlier["cycle"].values[-1])
        if reached > self.settings.cycles:
            raise InputError(f"the earlier result has {reached} cycles already", f"at least {reached} cycles")

    def _configuration(self) -> str:
        return write_configuration(self.mechanism, self.options)

    def _settings(self) -> dict[str, Any]:
        return dataclasses.asdict(self.settings)

    def dataset(self, status: str, cause: str) -> xr.Dataset:
        """Return the result so far."""
        states, tracks = self.states, [track.name for track in self.mechanism.tracks]
        variables: dict[str, Any] = {
            name: (dims, values, {"units": units, "long_name": text})
            for name, (dims, values, units, text) in self._columns().items()
        }
        variables |= Loads.columns([state.loads for state in states])
        run = xr.Dataset(
            variables,
            coords={
                "cycle": ("state", np.array([state.cycle for state in states]), {"units": "1", "long_name": "cycle"}),
                "joint": ("joint", np.array(self.names, dtype=object)),
                "side": ("joint", np.array([surface.side for surface in self.surfaces], dtype=object)),
                "track": ("track", np.array(tracks, dtype=object)),
                "angle": (
                    "angle",
                    2.0 * np.pi * np.arange(self.settings.angles) / self.settings.angles,
                    {"units": "rad", "long_name": "angle in the frame of the body of the worn surface"},
                ),
            },
            attrs={
                "title": TITLE,
                "status": status,
                "cause": cause,
                "cycles": self.settings.cycles,
                "simulated_cycles": sum(state.simulations for state in states) * self.runner.cycles_each,
                "cycle_time": self.runner.cycle_time,
                "settings": json.dumps(self._settings()),
                "configuration": self._configuration(),
            },
        )
        warnings = [*self.warnings, *repetition(run)]
        run.attrs |= {
            "warnings": json.dumps([str(item) for item in warnings]),
            "warning_data": json.dumps([item.data for item in warnings]),
        }
        return add_lives(run, self.mechanism, self.settings)

    def _of_both(self, values: np.ndarray) -> np.ndarray:
        """Return the sums over the surfaces of each joint, for each of its surfaces; shape (states, surfaces)."""
        return np.stack([values[:, joint.rows].sum(axis=-1) for joint in self.joints for _ in joint.rows], axis=-1)

    def _columns(self) -> Mapping[str, tuple[tuple[str, ...], Any, str, str]]:
        """Return dimensions, values, unit and meaning of the result's variables, by name."""
        states = self.states
        depths = np.array([state.depths for state in states])
        area, largest = np.concatenate([joint.areas for joint in self.joints]), depths.max(axis=-1)
        loads = [state.loads for state in states]
        rates, corrections = np.array([state.rates for state in states]), np.array([state.correction for state in states])
        depth_error = depth_errors(
            np.array([state.cycle for state in states]), depths, rates, np.array([part.energy for part in loads]), corrections
        )
        deviation = np.array([part.deviation for part in loads])
        return {
            "depth": (("state", "joint", "angle"), depths, "m", "depth of the worn surface, by angle in the frame of its body"),
            "depth_largest": (("state", "joint"), largest, "m", "largest depth of the worn surface"),
            "depth_error": (
                ("state", "joint"),
                depth_error.error,
                "m",
                "half the 95 % interval of the largest depth",
            ),
            "worn_volume": (("state", "joint"), depths.sum(axis=-1) * area, "m^3", "worn volume"),
            "worn_clearance": (
                ("state", "joint"),
                self.clearance + self._of_both(largest),
                "m",
                "largest radial clearance of the worn joint",
            ),
            "clearance_error": (
                ("state", "joint"),
                self._of_both(depth_error.error),
                "m",
                "half the 95 % interval of this clearance",
            ),
            "peak_force": (
                ("state", "joint"),
                np.array([part.peak.mean(axis=0) for part in loads]),
                "N",
                "largest force of the joint in a cycle, mean over the members",
            ),
            "track_deviation": (
                ("state", "track"),
                deviation.mean(axis=1),
                "m",
                "largest deviation of the tracked point in a cycle, mean over the members",
            ),
            "track_deviation_error": (
                ("state", "track"),
                np.stack([mean_error(deviation[..., k]) for k in range(deviation.shape[2])], axis=-1)
                if deviation.shape[2]
                else np.zeros((len(states), 0)),
                "m",
                "half the 95 % interval of the mean largest deviation of the tracked point",
            ),
            "cycle_scatter": (
                ("joint",),
                depth_error.scatter,
                "1",
                "relative standard deviation of the wear of single cycles, at the deepest angle",
            ),
            "cycle_drift": (
                ("joint",),
                depth_error.drift,
                "1",
                "relative change of the wear from the first averaged cycle to the last; 0 if it may be chance",
            ),
            "member_rate": (("state", "member", "joint", "angle"), rates, "m", "depth that each simulated cycle wears"),
            "depth_correction": (
                ("state", "joint", "angle"),
                corrections,
                "m",
                "depth minus that of loads that are constant over each step",
            ),
            "step": (("state",), np.array([state.step for state in states]), "1", "cycles since the last state"),
            "simulations": (
                ("state",),
                np.array([state.simulations for state in states]),
                "1",
                "simulations until the error of the step was within the tolerance",
            ),
            "clearance": (("joint",), self.clearance, "m", "radial clearance of the round joint"),
            "radius": (("joint",), np.concatenate([joint.radii for joint in self.joints]), "m", "radius of the round surface"),
        }


def _factor(error: float) -> float:
    """Return the ratio of the next number of cycles to that of a step with this error, which is of second order."""
    return 0.9 / math.sqrt(error) if error > 0.0 else math.inf


def _period(mechanism: Mechanism, settings: Wear) -> float | None:
    """Return the period of the drive [s] if a cycle is a period; None if a cycle is a whole run."""
    if settings.cycle == "run":
        return None
    try:
        return drive_period(mechanism)
    except InputError:
        if settings.cycle == "period":
            raise
        return None
