"""``sd.study``: a study in one call, of plain values, of texts as in a study file, or of a study file."""

from __future__ import annotations

import os
import tempfile
import weakref
from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np

from scissordyn.config.case import Case
from scissordyn.config.file import read_case
from scissordyn.config.study import StudyText, described_study, own_measure, read_study, study_of
from scissordyn.errors import InputError
from scissordyn.model.mechanism import Mechanism
from scissordyn.run.engine import Engine
from scissordyn.run.options import Options
from scissordyn.study.accurate import Accurate
from scissordyn.study.description import OwnMeasure, Sampling, Study
from scissordyn.study.design import Design
from scissordyn.study.distribution import Interval, Levels, Variation
from scissordyn.study.execute import Progress
from scissordyn.study.requirement import Requirement, read_response
from scissordyn.study.result import StudyResult, computed
from scissordyn.study.store import Store

__all__ = ["open_study", "study"]

Address = str | os.PathLike[str]
Varied = Mapping[str, Any]

RANGES = "(1e-4, 4e-4), [50.0, 100.0, 200.0], sd.Normal(0.1, 0.02), or '0.1..0.4 mm'"


def study(
    case: Mechanism | Case | Address,
    factors: Varied | None = None,
    *,
    until: float | None = None,
    options: Options | None = None,
    measures: str | Sequence[Any] | Mapping[str, Callable[..., float]] = (),
    requirements: str | Sequence[str | Requirement] | Mapping[str, float | str] = (),
    uncertain: Varied | None = None,
    design: str = "",
    points: int = 0,
    seed: int = 0,
    samples: int = 1,
    sampling: str = "sobol",
    common: bool = True,
    members: int = 1,
    goals: str | Sequence[str] = (),
    risk: str = "mean",
    population: int = 0,
    generations: int = 20,
    screen: Mapping[str, Any] | Case | None = None,
    verify: int = Accurate.points,
    budget: float | None = None,
    store: Address | None = None,
    engine: Engine | int | None = None,
    block: int | None = None,
    progress: Callable[[Progress], None] | None = None,
    compute: bool = True,
) -> StudyResult:
    """Vary numbers of a case, keep every result in a store, and say where requirements are met.

    Parameters
    ----------
    case : Mechanism, Case or path
        A mechanism (with `until` or `options`), a case, a case file, or, without `factors` and `uncertain`, a study file.
    factors : mapping of str to values
        The numbers that are chosen, by address (`model.address`), in SI: a pair is a range, a list levels, a number one level;
        or one of `Interval`, `Levels`, `Uniform`, `Normal`, `LogNormal`, `Empirical`. Or a text as in a study file, with its
        unit: ``"0.05..0.4 mm, 20 values, log"``.
    until : float, optional
        End of the simulated time [s], in place of that of the case.
    options : Options, optional
        In place of those of the case.
    measures : sequence, or mapping of str to function
        Names of `run.measure.MEASURES`, ``"late [N] = mine.py:late"``, or functions of your own, which get the Dataset of a
        run; by name, with the unit in brackets: ``{"late [N]": late}``; ``"late [N] of accumulators"`` gets the batch's.
    requirements : sequence of str, or mapping of str to bound
        ``"peak_force < 500 N"``, or ``{"peak_force": 500.0}``, an upper bound in SI, or ``{"tip.error": "< 0.6 mm"}``.
    uncertain : mapping of str to values
        Numbers that nobody chooses, as `factors`.
    design : str
        "grid" (if no points are given), "zip", "one-at-a-time", "sobol" (if points are given), "random", "latin-hypercube",
        "saltelli", "morris".
    points, seed : int
        Of a sampled design.
    samples : int
        Of the uncertain numbers at each point.
    sampling : {"sobol", "random", "latin-hypercube"}
    common : bool
        Whether all points have the same samples.
    members : int
        Runs of each sample from starts that differ by round-off.
    goals : str or sequence of str
        ``"minimise peak_force"``: the points are then searched for, by CMA-ES, or with several goals by NSGA-II.
    risk, population, generations
        See `StudyResult.optimise`.
    screen : mapping of str to value, or Case, optional
        What makes runs cheap: other options, ``{"rtol": 1e-3, "atol": 1e-3}``, or another case with the same numbers at the
        addresses that vary. All points are then run so, and some of them accurately too: see `StudyResult.estimates`.
    verify : int
        Points that are run accurately too, the first ones; of an optimisation the best ones.
    budget : float, optional
        Time for the runs of both kinds [s]: decides how many there are of each, in place of `points` and `verify`.
    store : path, optional
        A folder, in which the results stay; what it holds of this study already is not computed again. A temporary one, which
        ends with the result, if not given.
    engine : Engine or int, optional
        `Processes(8)`, `Cluster("tls://host:8786")`, `Cluster("cluster.yaml")`, `Threads(4)`, or a number of threads; one
        thread per processor if not given.
    block : int, optional
        Cases of a block of a new store.
    progress : callable, optional
        Called after each block with a `study.execute.Progress`.
    compute : bool
        Without it what the store holds is only read.

    Returns
    -------
    StudyResult

    Raises
    ------
    InputError
        For whatever does not fit: an address, a unit, a range, a measure, a requirement, a store of another study.
    KeyboardInterrupt
        After Ctrl-C; what is complete is in the store, and the same call goes on.
    """
    if factors is None and uncertain is None and isinstance(case, (str, os.PathLike)):
        described = study_of(read_study(Path(case)))
    else:
        mechanism, chosen = _case(case, until, options)
        own = _measures(measures)
        asked = StudyText(
            case=Path("case"),
            vary=_varied(factors or {}),
            uncertain=_varied(uncertain or {}),
            measures=own,
            require=_requirements(requirements, {each.name: each.units for each in own if isinstance(each, OwnMeasure)}),
            design=Design(design or ("sobol" if points else "grid"), points, seed),
            sampling=Sampling(samples, sampling, seed, common),
            members=members,
            goals=(goals,) if isinstance(goals, str) else tuple(goals),
            optimise={"risk": risk, "population": population, "generations": generations, "seed": seed},
        )
        cheap, quick = (mechanism, chosen) if screen is None else _screen(screen, mechanism, chosen)
        described = described_study(cheap, quick, asked)
        if screen is not None:
            described = replace(described, accurate=Accurate(mechanism, chosen, verify))
    return _result(described, store, engine, block, progress, compute, budget)


def _result(
    described: Study,
    store: Address | None,
    engine: Engine | int | None,
    block: int | None,
    progress: Callable[[Progress], None] | None,
    compute: bool,
    budget: float | None,
) -> StudyResult:
    if not compute:
        if store is None:
            raise InputError("compute=False without a store", "the store of the study", "store='study.zarr'")
        held = Store(store)
        if not held.exists():
            raise InputError(f"no study at '{store}'", "the store of a study, or compute=True")
        held.check(described)
        return StudyResult(replace(described, design=held.design()), held)
    if store is not None:
        return computed(described, store, engine=engine, block=block, budget=budget, progress=progress)
    folder = tempfile.TemporaryDirectory(prefix="scissordyn-study-")
    try:
        inside = Path(folder.name) / "study.zarr"
        found = computed(described, inside, engine=engine, block=block, budget=budget, progress=progress)
    except BaseException:
        folder.cleanup()
        raise
    weakref.finalize(found, folder.cleanup)
    return found


def open_study(
    path: Address, *, allow_code: Address | Sequence[Address] = (), measures: Mapping[str, Callable[..., float]] | None = None
) -> StudyResult:
    """The study of a store; nothing of the user's is executed to read one.

    Parameters
    ----------
    path : path
        Of the store.
    allow_code : path or sequence of path
        Python files of yours that the study uses, which may be executed to resume, extend or replay it.
    measures : mapping of str to function, optional
        Functions that the study measures by and that are no file's, as for `study`.

    Returns
    -------
    StudyResult

    Raises
    ------
    InputError
        If there is no store of a study.
    """
    store = Store(path)
    if not store.exists():
        raise InputError(f"no study at '{path}'", "the store of a study")
    files = [Path(file) for file in ([allow_code] if isinstance(allow_code, (str, os.PathLike)) else allow_code)]
    own = [_own(name, function) for name, function in (measures or {}).items()]
    return StudyResult(store.study(reading=True), store, lambda: store.study(allow_code=files, own_measures=own))


def _screen(screen: Any, mechanism: Mechanism, options: Options) -> tuple[Mechanism, Options]:
    """The mechanism and the options of cheap runs."""
    if isinstance(screen, Case):
        return screen.mechanism, screen.run
    known = [each.name for each in fields(Options)]
    if not isinstance(screen, Mapping) or not screen or not set(screen) <= set(known):
        raise InputError(f"screen = {screen!r:.60}", f"a case, or options of its runs: {', '.join(known)}", "{'rtol': 1e-3}")
    return mechanism, replace(options, **screen)


def _case(case: Mechanism | Case | Address, until: float | None, options: Options | None) -> tuple[Mechanism, Options]:
    """The mechanism, and the options of its runs."""
    if isinstance(case, (str, os.PathLike)):
        case = read_case(Path(case))
    if isinstance(case, Case):
        given, mechanism = options or Options(**case.run.keywords), case.mechanism
    elif isinstance(case, Mechanism):
        mechanism = case
        if options is None and until is None:
            raise InputError("a study of a mechanism without an end of its runs", "until [s], or options", "until=0.5")
        given = options or Options(until or 0.0)
    else:
        raise InputError(
            f"a study of {case!r:.60}", "a mechanism, a case, a case file or a study file", "sd.study('study.toml')"
        )
    return mechanism, given if until is None else replace(given, until=until)


def _varied(given: Varied) -> dict[str, str | Variation]:
    """What numbers vary over, of plain values."""
    if not isinstance(given, Mapping):
        raise InputError(f"numbers that vary: {given!r:.60}", "values by address", "{'A.clearance': (1e-4, 4e-4)}")
    return {address: _variation(address, values) for address, values in given.items()}


def _variation(address: str, values: Any) -> str | Variation:
    if isinstance(values, (str, Variation)):
        return values
    try:
        numbers = tuple(float(value) for value in np.ravel(values))
    except (TypeError, ValueError):
        raise InputError(f"'{address}' over {values!r:.60}", RANGES) from None
    try:
        return Interval(*numbers) if isinstance(values, tuple) and len(numbers) == 2 else Levels(numbers)
    except InputError as error:
        raise InputError(f"'{address}' over {values!r:.60}: {error.what}", error.allowed or RANGES, error.type_this) from None


def _measures(given: Any) -> list[str | OwnMeasure]:
    """Names of measures, and measures of the user's."""
    if isinstance(given, Mapping):
        return [_own(name, function) for name, function in given.items()]
    listed = [given] if isinstance(given, str) or callable(given) else list(given)
    return [_own(getattr(each, "__name__", repr(each)), each) if callable(each) else each for each in listed]


def _own(name: str, function: Any) -> OwnMeasure:
    if not callable(function):
        raise InputError(f"measure '{name}' by {function!r:.60}", "a function by its name and unit", "{'late [N]': late}")
    return own_measure(name, function)


def _requirements(given: Any, own: Mapping[str, str]) -> list[str | Requirement]:
    """Requirements, of texts and bounds."""
    if not isinstance(given, Mapping):
        return [given] if isinstance(given, (str, Requirement)) else list(given)
    found: list[str | Requirement] = []
    for name, bound in given.items():
        if isinstance(bound, str):
            found.append(f"{name} {bound}")
            continue
        part, measure, unit = read_response(name, own)
        try:
            number = float(bound)
        except (TypeError, ValueError):
            sample = f"{{'{name}': 500.0}}, or {{'{name}': '< 500 {unit}'}}"
            raise InputError(f"requirement on '{name}': {bound!r:.60}", "an upper bound in SI, or a text", sample) from None
        found.append(Requirement(measure, "<", number, part))
    return found
