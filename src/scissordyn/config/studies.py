"""``sd.study``: a study in one call, of plain values, of texts as in a study file, or of a study file."""

from __future__ import annotations

import os
import tempfile
import weakref
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any, Unpack

import numpy as np

from scissordyn.config.case import Case
from scissordyn.config.file import read_case
from scissordyn.config.names import Reader, by_change, by_object, names_of, variants_of
from scissordyn.config.study import StudyText, described_study, own_measure, read_study, study_of
from scissordyn.errors import InputError
from scissordyn.model.mechanism import Mechanism
from scissordyn.run.engine import Engine
from scissordyn.run.options import Options
from scissordyn.study.ask.description import Accurate, OwnMeasure, Sampling, Study
from scissordyn.study.ask.design import Design
from scissordyn.study.ask.distribution import Interval, Levels, Variation
from scissordyn.study.ask.requirement import Requirement, read_response
from scissordyn.study.compute.execute import How, Progress
from scissordyn.study.compute.store import Store
from scissordyn.study.result import StudyResult, computed

FilePath = str | os.PathLike[str]
Varied = Mapping[str, Any]

RANGES = "(1e-4, 4e-4), [50.0, 100.0, 200.0], sd.Normal(0.1, 0.02), '0.1..0.4 mm', or names, ['steel', 'aluminium']"


def study(
    case: Mechanism | Case | FilePath,
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
    store: FilePath | None = None,
    engine: Engine = None,
    block: int | None = None,
    progress: Callable[[Progress], None] | None = None,
    compute: bool = True,
) -> StudyResult:
    """Vary numbers and names of a case, keep every result in a store, and say where requirements are met."""
    if factors is None and uncertain is None and isinstance(case, (str, os.PathLike)):
        described = study_of(read_study(Path(case)))
    else:
        listed = _measures(measures)
        units = {measure.name: measure.units for measure in listed if isinstance(measure, OwnMeasure)}
        search = {"risk": risk, "population": population, "generations": generations, "seed": seed}
        text = StudyText(
            case="case",
            vary=_varied(factors or {}),
            uncertain=_varied(uncertain or {}),
            measures=listed,
            require=_requirements(requirements, units),
            design=Design(design or ("sobol" if points else "grid"), points, seed),
            sampling=Sampling(samples, sampling, seed, common),
            members=members,
            optimise={"goals": [goals] if isinstance(goals, str) else list(goals), **search},
        )
        described = _described(text, _case(case, until, options), screen, verify, _meant(factors, uncertain))
    return _result(described, store, compute, budget, engine=engine, block=block, progress=progress)


@dataclass(frozen=True)
class _Given:
    """A mechanism, the options of its runs, and the case file that it is from."""

    mechanism: Mechanism
    options: Options
    file: Path | None = None

    def reader(self, values: Mapping[str, Mapping[str, Any]]) -> Reader | None:
        """What makes it with other names; None where nobody knows what they stand for."""
        if self.file is None:
            return by_object(self.mechanism, values) if values else None
        return by_change(self.file, [], read_case(self.file).run, values)


def _described(text: StudyText, base: _Given, screen: Any, verify: int, values: Mapping[str, Mapping[str, Any]]) -> Study:
    """The study, with accurate runs beside its own where these are cheap."""
    read = base.reader(values)
    if screen is None:
        return described_study(base.mechanism, base.options, text, read)
    cheap = _screen(screen, base)
    study = described_study(cheap.mechanism, cheap.options, text, cheap.reader(values))
    return replace(study, accurate=Accurate(base.mechanism, base.options, verify, variants_of(study.apart, read)))


def _result(described: Study, store: FilePath | None, compute: bool, budget: float | None, **how: Unpack[How]) -> StudyResult:
    if not compute:
        if store is None:
            raise InputError("compute=False without a store", "the store of the study", "store='study.db'")
        kept = Store(store)
        if not kept.exists():
            raise InputError(f"no study at '{store}'", "the store of a study, or compute=True")
        kept.check(described)
        return StudyResult(replace(described, design=kept.design()), kept)
    if store is not None:
        return computed(described, store, budget=budget, **how)
    folder = tempfile.TemporaryDirectory(prefix="scissordyn-study-")
    try:
        inside = Path(folder.name) / "study.db"
        result = computed(described, inside, budget=budget, **how)
    except BaseException:
        folder.cleanup()
        raise
    weakref.finalize(result, folder.cleanup)
    return result


def open_study(
    path: FilePath,
    *,
    allow_code: FilePath | Sequence[FilePath] = (),
    measures: Mapping[str, Callable[..., float]] | None = None,
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
    functions = [_own(name, function) for name, function in (measures or {}).items()]
    return StudyResult(store.study(reading=True), store, lambda: store.study(allow_code=files, own_measures=functions))


def _screen(screen: Any, base: _Given) -> _Given:
    """The mechanism and the options of cheap runs."""
    if isinstance(screen, Case):
        return _Given(screen.mechanism, screen.run)
    names = [field.name for field in fields(Options)]
    if not isinstance(screen, Mapping) or not screen or not set(screen) <= set(names):
        raise InputError(f"screen = {screen!r:.60}", f"a case, or options of its runs: {', '.join(names)}", "{'rtol': 1e-3}")
    return replace(base, options=replace(base.options, **screen))


def _case(case: Mechanism | Case | FilePath, until: float | None, options: Options | None) -> _Given:
    file = Path(case) if isinstance(case, (str, os.PathLike)) else None
    if file is not None:
        case = read_case(file)
    if isinstance(case, Case):
        chosen, mechanism = options or Options(**case.run.keywords), case.mechanism
    elif isinstance(case, Mechanism):
        mechanism = case
        if options is None and until is None:
            raise InputError("a study of a mechanism without an end of its runs", "until [s], or options", "until=0.5")
        chosen = options or Options(until or 0.0)
    else:
        raise InputError(
            f"a study of {case!r:.60}", "a mechanism, a case, a case file or a study file", "sd.study('study.toml')"
        )
    return _Given(mechanism, chosen if until is None else replace(chosen, until=until), file)


def _varied(given: Varied) -> dict[str, str | Variation]:
    """What numbers vary over, of plain values."""
    if not isinstance(given, Mapping):
        raise InputError(f"numbers that vary: {given!r:.60}", "values by parameter", "{'A.clearance': (1e-4, 4e-4)}")
    return {parameter: _variation(parameter, values) for parameter, values in given.items()}


def _meant(*given: Varied | None) -> dict[str, Mapping[str, Any]]:
    """What each name stands for, by parameter, where that is given."""
    every = (pair for varied in given for pair in (varied or {}).items())
    return {parameter: values for parameter, values in every if isinstance(values, Mapping)}


def _variation(parameter: str, values: Any) -> str | Variation:
    if isinstance(values, (str, Variation)):
        return values
    if isinstance(values, Mapping):
        return names_of(list(values))
    if isinstance(values, (list, tuple)) and any(isinstance(value, str) for value in values):
        return names_of(values)
    try:
        numbers = tuple(float(value) for value in np.ravel(values))
    except (TypeError, ValueError):
        raise InputError(f"'{parameter}' over {values!r:.60}", RANGES) from None
    try:
        return Interval(*numbers) if isinstance(values, tuple) and len(numbers) == 2 else Levels(numbers)
    except InputError as error:
        raise InputError(f"'{parameter}' over {values!r:.60}: {error.what}", error.allowed or RANGES, error.type_this) from None


def _measures(given: Any) -> list[str | OwnMeasure]:
    """Names of measures, and measures of the user's."""
    if isinstance(given, Mapping):
        return [_own(name, function) for name, function in given.items()]
    listed = [given] if isinstance(given, str) or callable(given) else list(given)
    return [_own(getattr(measure, "__name__", repr(measure)), measure) if callable(measure) else measure for measure in listed]


def _own(name: str, function: Any) -> OwnMeasure:
    if not callable(function):
        raise InputError(f"measure '{name}' by {function!r:.60}", "a function by its name and unit", "{'late [N]': late}")
    return own_measure(name, function)


def _requirements(given: Any, own: Mapping[str, str]) -> list[str | Requirement]:
    """Requirements, of texts and bounds."""
    if not isinstance(given, Mapping):
        return [given] if isinstance(given, (str, Requirement)) else list(given)
    requirements: list[str | Requirement] = []
    for name, bound in given.items():
        if isinstance(bound, str):
            requirements.append(f"{name} {bound}")
            continue
        part, measure, unit = read_response(name, own)
        try:
            number = float(bound)
        except (TypeError, ValueError):
            sample = f"{{'{name}': 500.0}}, or {{'{name}': '< 500 {unit}'}}"
            raise InputError(f"requirement on '{name}': {bound!r:.60}", "an upper bound in SI, or a text", sample) from None
        requirements.append(Requirement(measure, "<", number, part))
    return requirements
