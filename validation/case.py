"""Parts of a validation case, and the scan of settings for the fastest one that reaches a goal."""

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
"""Error of a run and its time [s]."""


@dataclass(frozen=True)
class Check:
    """Computed quantity that is compared with a reference value.

    Parameters
    ----------
    quantity : str
        Name with its unit.
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
        """Return the error that is compared with the allowed one."""
        return abs(self.found - self.reference) / (abs(self.reference) if self.relative else 1.0)

    @property
    def met(self) -> bool:
        """Return whether the error is allowed."""
        return self.error <= self.allowed


@dataclass(frozen=True)
class Printed:
    """Published result of another computation or experiment, which may differ from ours.

    Parameters
    ----------
    quantity : str
        Name with its unit.
    printed, found : float
    within : float
        Relative difference up to which both agree.
    """

    quantity: str
    printed: float
    found: float
    within: float

    @property
    def difference(self) -> float:
        """Return the difference relative to the printed number."""
        return self.found / self.printed - 1.0

    @property
    def answer(self) -> str:
        """Return whether both agree, in words."""
        return "agrees" if abs(self.difference) <= self.within else "differs"


@dataclass(frozen=True)
class Model:
    """Model of another code, checked alone against an exact solution before its time and error are compared.

    A wrong model, or one that its solver cannot integrate, has an error that no tolerance removes: a comparison of settings
    is then meaningless. The settings are tight, and errors do not grow in the motion.

    Parameters
    ----------
    name : str
        Code and model.
    solution : str
        The exact solution, and the settings.
    measure : callable
        Function that returns the error.
    allowed : float
        Largest error, small compared with the goal of the comparison.
    package : str
        Package that must be installed, if any.
    """

    name: str
    solution: str
    measure: Callable[[], float]
    allowed: float
    package: str = ""


@dataclass(frozen=True)
class Code:
    """Code and the settings that are scanned.

    Parameters
    ----------
    name : str
    run : callable
        Function from a setting to error and seconds; raises an exception if the code fails.
    settings : sequence of float
        Tolerances or step sizes.
    meaning : str
        Meaning of a setting.
    repeats : int
        Runs of each setting; the shortest counts.
    package : str
        Package that must be installed, if any; the page names a code that is not installed.
    """

    name: str
    run: Callable[[float], Measured]
    settings: Sequence[float]
    meaning: str = "tolerance"
    repeats: int = 3
    package: str = ""


@dataclass(frozen=True)
class Scan:
    """Settings of one code with error and seconds: infinite errors for failures, no settings if it is not installed."""

    code: Code
    points: tuple[tuple[float, float, float], ...]


@dataclass(frozen=True)
class Case:
    """Validation case.

    Parameters
    ----------
    name : str
        Name of its folder.
    title : str
    checks : callable
        Function that returns the checks.
    error : str
        Meaning of the error in the work-precision table.
    goal : float
        Error that every code has to reach.
    codes : callable, optional
        Function that returns the codes to compare, the package first.
    quick : bool
        Whether its checks take a few seconds at most.
    notes : sequence of str
        Paragraphs below the tables.
    published : callable, optional
        Function that returns the published results that are compared.
    models : callable, optional
        Function that returns the models of other codes, each with its exact solution.
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
"""Zoo names of cases whose mechanism is in the zoo."""


def case_file(name: str, file: str = "case.toml") -> Path:
    """Return the path of a case file, in the folder of the case or in the zoo."""
    return sd.zoo[ZOO[name]].case_file if name in ZOO else HERE / name / file


def mechanism(name: str, *changes: str, file: str = "case.toml") -> sd.Mechanism:
    """Return the mechanism of a case file."""
    return read_case(case_file(name, file), changes).mechanism


def run(name: str, *changes: str, file: str = "case.toml", **options: object) -> xr.Dataset:
    """Run a case file; `options` replace its options of `simulate`."""
    case = read_case(case_file(name, file), changes)
    found = sd.simulate(case.mechanism, **{**case.run.keywords, **options})  # type: ignore[arg-type]
    if found.attrs["status"] != "complete":
        raise RuntimeError(f"{name}: {found.attrs.get('cause', found.attrs['status'])}")
    return found


def timed(name: str, error: Callable[[xr.Dataset], float], **fixed: object) -> Callable[[float], Measured]:
    """Return a function from a tolerance to the error of a run and the seconds of `simulate`."""
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
    """Return whether a package can be found; an empty name is always found."""
    return not package or importlib.util.find_spec(package) is not None


def scan(code: Code) -> Scan:
    """Run every setting after one run that is not counted, since codes compile or load."""
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
    """Return setting, error and seconds of the fastest run that reaches the goal, or else of the most accurate one."""
    reached = [point for point in scanned.points if point[1] <= goal]
    return min(reached, key=lambda point: point[2]) if reached else min(scanned.points, key=lambda point: point[1])
