"""What a validation case consists of, and the scan of settings that finds the fastest one that reaches a goal."""

from __future__ import annotations

import importlib.util
import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import xarray as xr

import scissordyn as sd
from scissordyn.config.file import read_case

__all__ = [
    "Case",
    "Check",
    "Code",
    "Measured",
    "Model",
    "Printed",
    "Scan",
    "best",
    "case_file",
    "installed",
    "mechanism",
    "run",
    "scan",
    "timed",
]

HERE = Path(__file__).parent

Measured = tuple[float, float]
"""Error and seconds."""


@dataclass(frozen=True)
class Check:
    """A quantity against its reference.

    Parameters
    ----------
    quantity : str
        With its unit.
    reference, found : float
    allowed : float
        Largest error.
    relative : bool
        Whether errors are relative to the reference.
    kind : str
        "closed form", "second formulation" or "published".
    """

    quantity: str
    reference: float
    found: float
    allowed: float
    kind: str
    relative: bool = True

    @property
    def error(self) -> float:
        """The error as it is compared with the allowed one."""
        return abs(self.found - self.reference) / (abs(self.reference) if self.relative else 1.0)

    @property
    def met(self) -> bool:
        """Whether the error is allowed."""
        return self.error <= self.allowed


@dataclass(frozen=True)
class Printed:
    """A result of somebody else's computation or experiment, which ours need not agree with.

    Parameters
    ----------
    quantity : str
        With its unit.
    printed, found : float
    within : float
        Relative difference up to which they are said to agree.
    """

    quantity: str
    printed: float
    found: float
    within: float

    @property
    def difference(self) -> float:
        """Relative to the printed number."""
        return self.found / self.printed - 1.0

    @property
    def answer(self) -> str:
        """Whether they agree."""
        return "agrees" if abs(self.difference) <= self.within else "differs"


@dataclass(frozen=True)
class Model:
    """Another code's model, alone against an exact solution, before its time and error are compared with anything.

    A model that is wrong, or that its solver cannot integrate, has an error that no tolerance removes: a comparison of settings
    then compares nothing. The settings are tight ones, and the motion is one in which errors do not grow.

    Parameters
    ----------
    name : str
        Code and model.
    solution : str
        The exact solution, and the settings.
    measure : callable
        To the error.
    allowed : float
        Largest error, small against the goal of the comparison.
    package : str
        That has to be installed, if any.
    """

    name: str
    solution: str
    measure: Callable[[], float]
    allowed: float
    package: str = ""


@dataclass(frozen=True)
class Code:
    """A code and the settings that are scanned.

    Parameters
    ----------
    name : str
    run : callable
        From a setting to error and seconds; raises an exception if the code fails.
    settings : sequence of float
        Tolerances or step sizes.
    meaning : str
        What a setting is.
    repeats : int
        Runs of each setting; the shortest counts.
    package : str
        That has to be installed, if any; a code that is not installed is named as such, and does not fail.
    """

    name: str
    run: Callable[[float], Measured]
    settings: Sequence[float]
    meaning: str = "tolerance"
    repeats: int = 3
    package: str = ""


@dataclass(frozen=True)
class Scan:
    """All settings of one code: setting, error and seconds, infinite errors for failures; none if it is not installed."""

    code: Code
    points: tuple[tuple[float, float, float], ...]


@dataclass(frozen=True)
class Case:
    """A validation case.

    Parameters
    ----------
    name : str
        Of its folder.
    title : str
    checks : callable
        To the list of checks.
    error : str
        What the error of the work-precision table is.
    goal : float
        Error that every code has to reach.
    codes : callable, optional
        To the codes to compare, the package first.
    quick : bool
        Whether its checks take a few seconds at most.
    notes : sequence of str
        Paragraphs below the tables.
    published : callable, optional
        To the printed results that are compared, with agreement or not.
    models : callable, optional
        To the models of other codes, each with its exact solution.
    """

    name: str
    title: str
    checks: Callable[[], list[Check]]
    error: str = ""
    goal: float = math.nan
    codes: Callable[[], list[Code]] | None = None
    quick: bool = True
    notes: Sequence[str] = field(default=())
    published: Callable[[], list[Printed]] | None = None
    models: Callable[[], list[Model]] | None = None


ZOO = {
    "pendulum": "a01-pendulum",
    "n_four_bar": "a02-n-four-bar",
    "slider_crank": "flores-slider-crank",
    "squeezer": "a03-squeezer",
    "records": "woodpecker",
    "hard_limit": "solar-array",
    "mixed_contact": "solar-array",
}
"""Cases whose mechanism is in the zoo, by its name there."""


def case_file(name: str, file: str = "case.toml") -> Path:
    """The case file of a case: in its folder, or in the zoo."""
    return sd.zoo[ZOO[name]].case_file if name in ZOO else HERE / name / file


def mechanism(name: str, *changes: str, file: str = "case.toml") -> sd.Mechanism:
    """The mechanism of a case file."""
    return read_case(case_file(name, file), changes).mechanism


def run(name: str, *changes: str, file: str = "case.toml", **options: object) -> xr.Dataset:
    """A run of a case file, with other options of `simulate` if they are given."""
    case = read_case(case_file(name, file), changes)
    found = sd.simulate(case.mechanism, **{**case.run.keywords, **options})  # type: ignore[arg-type]
    if found.attrs["status"] != "complete":
        raise RuntimeError(f"{name}: {found.attrs.get('cause', found.attrs['status'])}")
    return found


def timed(name: str, error: Callable[[xr.Dataset], float], **fixed: object) -> Callable[[float], Measured]:
    """The package at a tolerance: error of the run, seconds of `simulate`."""
    case = read_case(case_file(name))

    def measured(tolerance: float) -> Measured:
        options = {**case.run.keywords, **fixed, "rtol": tolerance, "atol": tolerance}
        began = time.perf_counter()
        found = sd.simulate(case.mechanism, **options)  # type: ignore[arg-type]
        seconds = time.perf_counter() - began
        if found.attrs["status"] != "complete":
            raise RuntimeError(found.attrs["cause"])
        return error(found), seconds

    return measured


def installed(package: str) -> bool:
    """Whether a package can be found; no package is always there."""
    return not package or importlib.util.find_spec(package) is not None


def scan(code: Code) -> Scan:
    """Run every setting; one run before the first is not counted, as codes compile or load."""
    if not installed(code.package):
        return Scan(code, ())
    points = []
    warm = False
    for setting in code.settings:
        try:
            if not warm:
                code.run(setting)
                warm = True
            made = [code.run(setting) for _ in range(code.repeats)]
            points.append((setting, made[0][0], min(seconds for _, seconds in made)))
        except Exception as failure:  # another code's failure is a result
            print(f"  {code.name} at {setting:g}: {type(failure).__name__}: {str(failure).splitlines()[0][:100]}")
            points.append((setting, math.inf, math.inf))
    return Scan(code, tuple(points))


def best(scanned: Scan, goal: float) -> tuple[float, float, float]:
    """Setting, error and seconds of the fastest run that reaches the goal, or else of the most accurate one."""
    reached = [point for point in scanned.points if point[1] <= goal]
    return min(reached, key=lambda point: point[2]) if reached else min(scanned.points, key=lambda point: point[1])
