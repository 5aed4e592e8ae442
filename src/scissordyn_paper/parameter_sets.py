"""Draw thousands of parameter sets, which are values of what the paper leaves open, and judge each by the checks."""

from __future__ import annotations

import time as clocks
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from scissordyn.errors import ScissordynError
from scissordyn.run.engine import Engine
from scissordyn.studies.ask.design import sobol_numbers, uniform_numbers
from scissordyn.units import degrees
from scissordyn_paper.cache import Progress, fetch
from scissordyn_paper.cases import Choice
from scissordyn_paper.judge import findings
from scissordyn_paper.statements import CHECKS
from scissordyn_paper.verdict import Finding

SAMPLING_SEED = 46  # Seed of the random numbers that draw parameter sets

ANGLES = {"rising": tuple(range(5, 80, 5)), "falling": tuple(range(60, 90, 5))}
"""Angles at the start [deg]: a rising stroke ends before the array folds over, a falling one after 0.03 s at 250 rpm."""

CONVERGED, PRESET, RESTING = 1e-6, 1e-3, 1e-4
"""Tolerances of integrators: errors change answers less than neighbours do; default of common programs; contact that lasts
from the start, whose motion is smooth."""


LOST_TABLE = "in a lost table"  # Reason why a factor is open


@dataclass(frozen=True)
class Factor:
    """Parameter or modelling decision that the paper leaves open, with the values that are tried."""

    name: str
    # Texts of the values with the fields of `Choice` that they set; values that occur twice are drawn twice as often
    levels: tuple[tuple[str, dict[str, Any]], ...] = ()
    because: str = LOST_TABLE  # Reason why the factor is open
    # If there are no levels: field of `Choice`, lower and upper end of its range, and True for a logarithmic range
    within: tuple[str, float, float, bool] = ("", 0.0, 0.0, True)
    unit: tuple[str, float] = ("", 1.0)  # Unit of the range in texts, and the size of this unit in SI units

    def fields_at(self, u: float) -> dict[str, Any]:
        """Return the field values of `Choice` for a random number u between 0 and 1."""
        return self.levels[int(u * len(self.levels))][1] if self.levels else {self.within[0]: self._at(u)}

    def level(self, u: float) -> str:
        """Return the text of the level for a random number u between 0 and 1; for a range, of the quarter that contains it."""
        if self.levels:
            return self.levels[int(u * len(self.levels))][0]
        low, high = (self._at(0.25 * part) / self.unit[1] for part in (int(4.0 * u), int(4.0 * u) + 1))
        return f"{low:.3g} to {high:.3g} {self.unit[0]}"

    def _at(self, u: float) -> float:
        _, low, high, logarithmic = self.within
        return float(low * (high / low) ** u if logarithmic else low + (high - low) * u)


def _field(name: str, *values: Any, words: str = "{}") -> tuple[tuple[str, dict[str, Any]], ...]:
    return tuple((words.format(value), {name: value}) for value in values)


_FIXED = {"tolerance": CONVERGED, "method": "dopri5"}

FACTORS = (
    Factor(
        "driven bar",
        (("bar 1 pinned, A joins bar 2", {"driven_bar": "pinned"}), ("A joins driven bar 1", {"driven_bar": "slider"})),
        "the text connects joint A to bar 1, which is driven, in two places and to bar 2 in one",
    ),
    Factor("travel", _field("travel", "rising", "falling"), "deployment is not said to raise or to lower the angle"),
    Factor("first angle", (), "its sentence breaks off", within=("angle", 0.0, 1.0, False), unit=("of the range", 1.0)),
    Factor("gravity", _field("gravity", 9.81, 0.0, words="{:g} m/s2"), "there is a potential energy, but its equation is lost"),
    Factor("journal radius", within=("journal_radius", 5e-3, 30e-3, True), unit=("mm", 1e-3)),
    Factor(
        "bearing length",
        _field("bearing_length", 5e-3, 10e-3, 15e-3, 20e-3, 30e-3, 50e-3, 1.0, 1.0, words="{:g} m"),
        "in a table that is not public; related papers print the formula with and without a length, which then is 1 m",
    ),
    Factor(
        "materials",
        (*[("steel", {})] * 2, ("aluminium", {"material": "aluminium"}), ("steel in bronze", {"bearing_material": "bronze"})),
    ),
    Factor("restitution", within=("restitution", 0.3, 0.95, False)),
    Factor(
        "stiffness",
        _field("stiffness", "liu", "liu", "bai-zhao-as-printed", "hertz"),
        "equation lost: the improved elastic foundation, its slope with the exponent 3/2 as later printed, or a constant one",
    ),
    Factor(
        "damping",
        _field("damping", "flores", "lankarani-nikravesh", "gonthier", "zhiying-qishao"),
        "equation lost: the text cites a model of 2004 under a name that a model of 2011 has",
    ),
    Factor("slip speed", _field("slip", "surfaces", "contact-points"), "two definitions are printed in this literature"),
    Factor("static friction", _field("static", 1.0, 1.2, 1.5, 2.0, words="{:g} times kinetic")),
    Factor("Stribeck speed", within=("stribeck_speed", 1e-4, 1e-1, True), unit=("m/s", 1.0)),
    Factor("bristle stiffness", within=("bristle_stiffness", 1e3, 1e6, True), unit=("1/m", 1.0)),
    Factor("bristle damping", within=("bristle_damping", 10.0, 1e3, True), unit=("s/m", 1.0)),
    Factor(
        "bristle damping at speed",
        (("fades", {"damping_speed": 0.0}), ("constant", {"damping_speed": 1e6})),
        "both forms are printed",
    ),
    Factor("viscous friction", _field("viscous", 0.0, 0.0, 0.1, 0.4, words="{:g} s/m")),
    Factor(
        "start",
        (*[("concentric", {})] * 9, ("in contact", {"start": "in-contact"})),
        "joint A is said to be in contact at first for the control alone",
    ),
    Factor(
        "integrator",
        (
            *[("converged", {"tolerance": CONVERGED})] * 3,
            *[("order 5, tolerance 1e-3", {"tolerance": PRESET, "method": "dopri5"})] * 2,
            *((f"steps of {1e6 * step:g} us", {**_FIXED, "step": step}) for step in (2e-5, 5e-5, 1e-4)),
        ),
        "not said: one that locates contacts, or steps of one size that notice them late",
    ),
    Factor(
        "samples",
        (*[("the motion itself", {})] * 2, ("201 points", {"samples": 201}), ("501 points", {"samples": 501})),
        "numbers may be those of curves with so many points",
    ),
)


def choice_at(u: Sequence[float]) -> Choice:
    """Return the choice of parameters for a point of the unit cube, with one coordinate per factor."""
    chosen: dict[str, Any] = {}
    for factor, number in zip(FACTORS, u, strict=True):
        chosen |= factor.fields_at(number)
    angles = ANGLES[chosen["travel"]]
    chosen["angle"] = degrees(angles[int(chosen["angle"] * len(angles))])
    if chosen.get("start") == "in-contact":  # the damping of a contact at rest is stiff
        chosen |= {"tolerance": RESTING, "method": "auto", "step": 0.0}
    return Choice(**chosen)


SETS_COUNT = 20_000  # Default number of parameter sets
BLOCK_SIZE, QUASI_BLOCKS, NEAR_BLOCKS = 100, 12, 8
"""Number of parameter sets in a block, of quasi-random blocks in a round, and of blocks near the best sets in a round."""

NEIGHBOUR_RUNS = 1
"""Number of neighbours by which a drawn parameter set is judged; more give the same average over all sets."""

LEADING_SETS, NEIGHBOURS, LEADING_FROM = 60, 16, 9000
"""Number of best parameter sets that are judged again, number of neighbours that judge each, number of their first block."""

PARENT_SETS, MUTATION_PROBABILITY = 40, 0.1
"""Number of best parameter sets near which others are drawn, and probability that a value is drawn again."""


@dataclass(frozen=True)
class Block:
    """Parameter sets that are judged by one job."""

    number: int
    points: tuple[tuple[float, ...], ...] = field(repr=False)  # Points of the unit cube, one for each parameter set
    members: int = NEIGHBOUR_RUNS  # Number of neighbours by which each set is judged

    @property
    def name(self) -> str:
        """Name of the file with the result."""
        return f"{self.number:04d}"

    @property
    def toml(self) -> str:
        """Text of all inputs of the result, by which a changed block is recognised."""
        return f"members = {self.members}\nchecks = {[check.criterion for check in CHECKS]!r}\npoints = {self.points!r}\n"


def judge(block: Block) -> xr.Dataset:
    """Answer all checks for each parameter set of a block; return the answers with their numbers and computing times."""
    agreeing, seconds, causes = np.zeros((len(block.points), len(CHECKS))), [], []
    numbers: list[Mapping[str, float]] = []
    for at, u in enumerate(block.points):
        began, cause, first = clocks.process_time(), "", {}
        try:
            answers = [findings(choice_at(u), member) for member in range(block.members)]
            agreeing[at] = np.mean([[finding.holds for finding in answer] for answer in answers], axis=0)
            first = _numbers(answers[0])
            cause = next((finding.words for finding in answers[0] if not finding.numbers), "")
        except ScissordynError as error:
            cause = str(error)
        numbers.append(first)
        causes.append(cause)
        seconds.append(clocks.process_time() - began)
    names = sorted({name for measured in numbers for name in measured})
    both = "parameter_set", "check"
    return xr.Dataset(
        {
            "point": (("parameter_set", "factor"), np.array(block.points)),
            "agreeing": (both, agreeing, {"units": "1", "long_name": "share of neighbours for which the check holds"}),
            "number": (
                ("parameter_set", "quantity"),
                np.array([[measured.get(name, np.nan) for name in names] for measured in numbers]),
            ),
            "seconds": ("parameter_set", np.array(seconds), {"units": "s", "long_name": "processor time"}),
            "cause": ("parameter_set", np.array(causes, dtype=object)),
        },
        coords={"check": [check.key for check in CHECKS], "quantity": names},
    )


def _numbers(answer: Sequence[Finding]) -> dict[str, float]:
    """Return the values of all findings; a name is the key of the check and the name of the value, "1a NAME"."""
    return {
        f"{check.key} {name}": float(value)
        for check, finding in zip(CHECKS, answer, strict=True)
        for name, value in finding.numbers.items()
    }


def fetch_parameter_sets(
    folder: Path, number: int = SETS_COUNT, *, engine: Engine = None, progress: Progress | None = None
) -> Judged:
    """Return `number` judged parameter sets; those stored in the folder are not computed again.

    Rounds of quasi-random sets and of sets near the best ones alternate.
    """
    results: list[xr.Dataset] = []

    def add(points: np.ndarray) -> None:
        blocks = [
            Block(len(results) + k, tuple(map(tuple, part.tolist())))
            for k, part in enumerate(np.array_split(points, max(1, len(points) // BLOCK_SIZE)))
        ]
        of = max(1, -(-number // BLOCK_SIZE))

        def show(what: str, done: int, _: int) -> None:
            if progress is not None:
                progress(what, len(results) + done, of)

        results.extend(fetch(blocks, judge, folder, what="blocks of parameter sets", engine=engine, progress=show).values())

    quasi = 0
    while (left := number - BLOCK_SIZE * len(results)) > 0:
        count = min(left, QUASI_BLOCKS * BLOCK_SIZE)
        add(sobol_numbers(SAMPLING_SEED, len(FACTORS), np.arange(quasi, quasi + count)))
        quasi += count
        if (left := number - BLOCK_SIZE * len(results)) > 0:
            add(_near(results, min(left, NEAR_BLOCKS * BLOCK_SIZE)))
    return Judged.of(results)


def fetch_leading(judged: Judged, folder: Path, *, engine: Engine = None, progress: Progress | None = None) -> Judged:
    """Judge the best parameter sets again by many neighbours; return them in the order of agreeing checks, best first."""
    order = np.argsort(-judged.agreeing_count, kind="stable")[:LEADING_SETS]
    blocks = [
        Block(LEADING_FROM + k, tuple(map(tuple, judged.points[part].tolist())), NEIGHBOURS)
        for k, part in enumerate(np.array_split(order, max(1, len(order) // 10)))
    ]
    results = fetch(blocks, judge, folder, what="blocks of leading parameter sets", engine=engine, progress=progress)
    leading = Judged.of(list(results.values()))
    best = np.argsort(-leading.agreeing_count, kind="stable")
    return Judged(*(getattr(leading, name)[best] for name in leading.__dataclass_fields__))


def _near(results: Sequence[xr.Dataset], count: int) -> np.ndarray:
    """Return points near the best so far: each mixes coordinates of two of the best; some coordinates are drawn again."""
    points = np.concatenate([block["point"].values for block in results])
    met = np.concatenate([block["agreeing"].values.sum(axis=1) for block in results])
    best = points[np.argsort(-met, kind="stable")[:PARENT_SETS]]
    size = len(FACTORS)
    drawn = uniform_numbers(SAMPLING_SEED, 1, 2 + 3 * size, len(points) + np.arange(count))
    first, second = (best[(drawn[:, k] * len(best)).astype(int)] for k in (0, 1))
    mixed, anew, value = (drawn[:, 2 + k * size : 2 + (k + 1) * size] for k in range(3))
    return np.where(anew < MUTATION_PROBABILITY, value, np.where(mixed < 0.5, first, second))


@dataclass(frozen=True)
class Judged:
    """Parameter sets with their answers, in the order in which they were drawn."""

    points: np.ndarray  # (n, factors) Points of the unit cube
    agreeing: np.ndarray  # (n, checks) Fraction of neighbours for which each check holds
    seconds: np.ndarray  # (n,) Computing time [s]
    causes: np.ndarray  # (n,) Reasons why runs failed; "" if none failed
    quasi: np.ndarray  # (n,) True for quasi-random parameter sets

    @staticmethod
    def of(blocks: Sequence[xr.Dataset]) -> Judged:
        """Join the results of blocks."""
        whole = xr.concat(blocks, "parameter_set", join="outer")
        at = np.concatenate([np.full(block.sizes["parameter_set"], k) for k, block in enumerate(blocks)])
        return Judged(
            *(whole["point"].values, whole["agreeing"].values, whole["seconds"].values),
            causes=whole["cause"].values.astype(str),
            quasi=at % (QUASI_BLOCKS + NEAR_BLOCKS) < QUASI_BLOCKS,
        )

    def first(self, count: int) -> Judged:
        """Return the first `count` parameter sets."""
        return Judged(*(getattr(self, name)[:count] for name in self.__dataclass_fields__))

    @cached_property
    def agreeing_count(self) -> np.ndarray:
        """Number of agreeing checks of each parameter set; a check counts by the fraction of agreeing neighbours."""
        return np.asarray(self.agreeing.sum(axis=1))
