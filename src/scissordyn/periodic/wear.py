"""Wear of bearings over many cycles: simulate a cycle, wear the bearings by its loads for some cycles, repeat."""

from __future__ import annotations

import dataclasses
import json
import math
import re
from collections.abc import Callable, Iterator, Mapping
from typing import Annotated, Any, NamedTuple

import numpy as np
import xarray as xr

from scissordyn.casefile.configuration import write_configuration
from scissordyn.errors import InputError, ScissordynError
from scissordyn.model.mechanism import Mechanism
from scissordyn.model.options import EndTime, Options, StartKind
from scissordyn.model.wear import CycleKind, Wear
from scissordyn.periodic.life import add_lives
from scissordyn.periodic.stroboscope import drive_period
from scissordyn.periodic.wear_loads import CONFIDENCE_FACTOR, CycleRunner, Loads, worn_joints
from scissordyn.periodic.wear_step import Bearing, Worn
from scissordyn.units import Meaning, checked, quantities

TITLE = "scissordyn wear"


NUMBER = re.compile(r"[\d.]+")  # number in a warning; warnings that differ only in numbers are reported once


NO_LOADS = Loads(*np.zeros((4, 0)))  # placeholder for the loads of a state whose cycle is not simulated yet


class State(NamedTuple):
    """Contours of the bearings after a number of cycles, and the loads of a cycle simulated with them."""

    cycle: int
    step: int  # number of cycles since the previous state
    depths: np.ndarray  # (joints, angles) [m]
    loads: Loads
    variance: np.ndarray  # (joints,) variance of the largest depth, from the spread of members and between states [m^2]
    bias: np.ndarray  # (joints,) error of the largest depth because loads are held constant over a step [m]

    @property
    def error(self) -> np.ndarray:
        """Half width of the 95 % confidence interval of each joint's largest wear depth, shape (joints,) [m]."""
        return np.asarray(CONFIDENCE_FACTOR * np.sqrt(self.variance) + np.abs(self.bias))


@checked
def wear(
    mechanism: Mechanism,
    *,
    until: EndTime,
    cycles: Annotated[int, quantities(Wear)["cycles"]] = Wear.cycles,
    cycle: CycleKind = "auto",
    settle: Annotated[int, quantities(Wear)["settle"]] = Wear.settle,
    members: Annotated[int, quantities(Wear)["members"]] = Wear.members,
    change: Annotated[float, quantities(Wear)["change"]] = Wear.change,
    angles: Annotated[int, quantities(Wear)["angles"]] = Wear.angles,
    most_clearance: Annotated[float | None, quantities(Wear)["most_clearance"]] = None,
    start: StartKind = "concentric",
    rtol: float = 1e-6,
    atol: float = 1e-6,
    method: str = "auto",
    most_steps: int = Options.most_steps,
    earlier: Annotated[
        xr.Dataset | None, Meaning("an unfinished result of the same wear computation, which is continued")
    ] = None,
    each: Annotated[Callable[[xr.Dataset], None] | None, Meaning("called with the current result after each step")] = None,
    progress: Callable[[int, int], None] | None = None,
) -> xr.Dataset:
    r"""Wear the bearings of a mechanism over many cycles by Archard's law.

    Some cycles are simulated, and the loads on each bearing are collected by angle. Under these loads the bearing wears for n
    cycles, until its contour has changed by a fraction of the clearance; then cycles are simulated again with the worn
    bearing.

    .. math:: \frac{\mathrm{d}V}{\mathrm{d}t} = k F_n |v_t|, \qquad \mathrm{d}h = k\, p\, |v_t|\, \mathrm{d}t

    The wear depth h follows the pressure p that the contact law has on the worn contour. The journal stays round.

    Parameters
    ----------
    mechanism : Mechanism
        Mechanism with a wear coefficient at one or several clearance joints, ``Clearance(wear=...)``.
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
    change : float
        Largest change of a contour between two simulations, as a fraction of the clearance.
    angles : int
        Number of angles of a contour.
    most_clearance : float, optional
        Largest radial clearance [m] that a worn joint may have.
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
    settings = Wear(cycles, cycle, settle, members, change, angles, most_clearance)
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
        life.take(earlier)
    try:
        for _ in life.steps():
            if progress is not None:
                progress(life.cycle, settings.cycles)
            if each is not None:
                each(life.dataset("interrupted", "interrupted"))
    except KeyboardInterrupt:
        return life.dataset("interrupted", "interrupted")
    except ScissordynError as error:
        if not life.states:
            raise
        return life.dataset("failed", f"stopped after {life.cycle} cycles: {error}")
    return life.dataset("failed" if life.cause else "complete", life.cause)


class _Life:
    """Wear computation: states of the bearings over the cycles, and the next state to simulate."""

    def __init__(self, mechanism: Mechanism, options: Options, settings: Wear) -> None:
        self.mechanism, self.options, self.settings = mechanism, options, settings
        self.names = worn_joints(mechanism)
        period = _period(mechanism, settings)
        self.runner = CycleRunner(mechanism, options, settings, self.names, period)
        self.bearings = [Bearing(mechanism.joint(name), settings.angles) for name in self.names]
        joints = len(self.names)
        self.next = State(0, 0, np.stack([bearing.depths for bearing in self.bearings]), NO_LOADS, *np.zeros((2, joints)))
        self.deepened = np.zeros(joints)  # [m] increase of the largest depth in the last step
        self.cause = ""
        self.states: list[State] = []
        self.warnings: list[str] = []

    @property
    def cycle(self) -> int:
        """Number of cycles of the last simulated state."""
        return self.states[-1].cycle if self.states else 0

    def steps(self) -> Iterator[None]:
        """Simulate a cycle and wear the bearings, alternately, until all cycles are done; yield after each simulation."""
        while True:
            if not self.states or self.states[-1].cycle < self.next.cycle:
                self._simulate()
                yield
            if self.next.cycle >= self.settings.cycles or self.cause:
                return
            self._wear()

    def _simulate(self) -> None:
        state, loads = self.next, self.runner.loads(self.next.depths)
        variance, bias = state.variance, state.bias
        if self.states and state.step > 1:
            # the step assumes constant loads; the loads simulated at its end show the error of this assumption
            before, after = (np.mean(part.energy, axis=0).sum(axis=-1) for part in (self.states[-1].loads, loads))
            part = np.divide(after - before, before, out=np.zeros_like(before), where=before > 0.0)
            bias = bias + 0.5 * (state.step - 1) / state.step * part * self.deepened
            variance = variance + (0.5 * part * self.deepened) ** 2  # the change of the loads may be random
        self.states.append(state._replace(loads=loads, variance=variance, bias=bias))
        self._warn(loads)

    def _warn(self, loads: Loads, largest_spread: float = 0.2) -> None:
        """Add the warnings of a simulated state, except those that differ from earlier ones only in their numbers.

        `largest_spread`: a warning is given if the relative standard deviation of the wear between cycles exceeds this.
        """
        found = list(loads.warnings)
        if self.settings.members > 1:
            for name, spread in zip(self.names, loads.spread, strict=True):
                if spread > largest_spread:
                    found.append(
                        f"cycles do not repeat: the wear of joint '{name}' differs between cycles; "
                        "average more of them (members)"
                    )
        told = {NUMBER.sub("", text) for text in self.warnings}
        self.warnings += [text for text in found if NUMBER.sub("", text) not in told]

    def _wear(self) -> None:
        """Make one wear step: wear all bearings by the last loads, for as many cycles as the option `change` permits."""
        last, left = self.states[-1], self.settings.cycles - self.states[-1].cycle
        n, worn = self._chosen_step(last, left)
        deepened = np.array([part.deepened for part in worn])
        depths = np.stack([part.depths for part in worn if part.depths is not None])
        variance = last.variance + deepened**2 * last.loads.spread**2 / self.settings.members
        self.deepened = deepened
        self.next = State(last.cycle + n, n, depths, NO_LOADS, variance, last.bias)
        for name, bearing, depth in zip(self.names, self.bearings, depths.max(axis=-1).tolist(), strict=True):
            if bearing.bush is not None and depth >= bearing.bush and not self.cause:
                self.cause = f"joint '{name}' has worn through its bush of {1e3 * bearing.bush:g} mm by cycle {self.next.cycle}"

    def _chosen_step(self, last: State, left: int, growth: float = 4.0, trials: int = 12) -> tuple[int, list[Worn]]:
        """Return the number of cycles of the next step, at most `left`, and the bearings after it.

        `growth`: largest ratio of the cycle counts of two successive wear steps.

        `trials`: largest number of reductions of a wear step that changes the contour too much.
        """
        limit = self.settings.change
        n = min(left, max(1, int(growth * last.step))) if last.step else self._first_step(last, left)
        for _ in range(trials):
            worn = [bearing.worn(last.depths[j], last.loads, j, n) for j, bearing in enumerate(self.bearings)]
            changes = [part.deepened / bearing.clearance for part, bearing in zip(worn, self.bearings, strict=True)]
            largest = math.inf if any(part.depths is None for part in worn) else max(changes)
            if largest <= limit or n == 1:
                break
            n = max(1, int(n * min(0.9 * limit / largest, 0.9)))
        if largest > limit:
            worst = self.names[int(np.argmax(changes))]
            text = f"a single cycle changes the contour of joint '{worst}' by more than {limit:g} of its clearance"
            if not math.isfinite(largest):
                raise ScissordynError(f"{text}, and by far more than its elastic indentation; check its coefficient of wear")
            self.warnings += [text] if text not in self.warnings else []
        return n, worn

    def _first_step(self, last: State, left: int) -> int:
        """Return the cycle count of the first step, extrapolated from the depth that a single cycle wears."""
        worn = [bearing.worn(last.depths[j], last.loads, j, 1).deepened for j, bearing in enumerate(self.bearings)]
        largest = max(depth / bearing.clearance for depth, bearing in zip(worn, self.bearings, strict=True))
        return left if largest == 0.0 else max(1, min(left, int(2.0 * self.settings.change / largest)))

    def take(self, earlier: xr.Dataset) -> None:
        """Continue from an earlier result of the same wear."""
        self._check_same(earlier)
        self.warnings = list(json.loads(earlier.attrs["warnings"]))
        for k in range(earlier.sizes["state"]):
            row = earlier.isel(state=k)
            variance, bias = (row[name].values.copy() for name in ("depth_variance", "depth_bias"))
            loads = Loads.from_row(row, self.warnings)
            self.states.append(State(int(row["cycle"]), int(row["step"]), row["depth"].values.copy(), loads, variance, bias))
        self.next = self.states[-1]

    def _check_same(self, earlier: xr.Dataset) -> None:
        """Raise `InputError` if an earlier result belongs to another wear computation."""
        if earlier.attrs.get("title") != TITLE:
            raise InputError(f"earlier: a '{earlier.attrs.get('title')}'", "a result of wear()", "load('life.nc')")
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
                "track": ("track", np.array(tracks, dtype=object)),
                "angle": (
                    "angle",
                    2.0 * np.pi * np.arange(self.settings.angles) / self.settings.angles,
                    {"units": "rad", "long_name": "angle in the frame of the bearing's body"},
                ),
            },
            attrs={
                "title": TITLE,
                "status": status,
                "cause": cause,
                "cycles": self.settings.cycles,
                "simulated_cycles": len(states) * self.runner.cycles_each,
                "cycle_time": self.runner.cycle_time,
                "settings": json.dumps(self._settings()),
                "configuration": self._configuration(),
                "warnings": json.dumps(self.warnings),
            },
        )
        return add_lives(run, self.mechanism, self.settings)

    def _columns(self) -> Mapping[str, tuple[tuple[str, ...], Any, str, str]]:
        """Return dimensions, values, unit and meaning of the variables of a wear by state."""
        states = self.states
        depths = np.array([state.depths for state in states])
        clearance = np.array([bearing.clearance for bearing in self.bearings])
        area = np.array([bearing.area for bearing in self.bearings])
        largest = depths.max(axis=-1)
        loads = [state.loads for state in states]
        return {
            "depth": (("state", "joint", "angle"), depths, "m", "depth of the worn bearing, by angle in the frame of its body"),
            "depth_largest": (("state", "joint"), largest, "m", "largest depth of the worn bearing"),
            "depth_error": (
                ("state", "joint"),
                np.array([state.error for state in states]),
                "m",
                "half the 95 % interval of the largest depth",
            ),
            "worn_volume": (("state", "joint"), depths.sum(axis=-1) * area, "m^3", "worn volume"),
            "worn_clearance": (("state", "joint"), clearance + largest, "m", "largest radial clearance of the worn joint"),
            "peak_force": (
                ("state", "joint"),
                np.array([part.peak.mean(axis=0) for part in loads]),
                "N",
                "largest force of the joint in a cycle, mean over the members",
            ),
            "track_deviation": (
                ("state", "track"),
                np.array([part.deviation.mean(axis=0) for part in loads]),
                "m",
                "largest deviation of the tracked point in a cycle, mean over the members",
            ),
            "track_deviation_error": (
                ("state", "track"),
                np.array([part.deviation_error for part in loads]),
                "m",
                "half the 95 % interval of that mean",
            ),
            "depth_variance": (
                ("state", "joint"),
                np.array([state.variance for state in states]),
                "m^2",
                "variance of the largest depth from the spread of members and states",
            ),
            "depth_bias": (
                ("state", "joint"),
                np.array([state.bias for state in states]),
                "m",
                "estimated error of the largest depth from the steps of cycles",
            ),
            "step": (("state",), np.array([state.step for state in states]), "1", "cycles since the last state"),
            "clearance": (("joint",), clearance, "m", "radial clearance of the round bearing"),
            "bearing_radius": (("joint",), np.array([bearing.radius for bearing in self.bearings]), "m", "bearing radius"),
        }


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
