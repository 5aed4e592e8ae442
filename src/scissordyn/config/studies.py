"""``sd.study``: a study of plain values, texts or a study file, one that is opened, and the one that follows it."""

from __future__ import annotations

import os
import tempfile
import weakref
from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields, replace
from pathlib import Path
from typing import Any, Unpack

import numpy as np

from scissordyn.casefile.case import Case
from scissordyn.config.file import read_case
from scissordyn.config.study import Given, StudyText, described_study, factors_of, own_measure, read_study, study_of
from scissordyn.config.variation import by_change, by_object, listed, names_of, read_variation
from scissordyn.errors import InputError, command, did_you_mean
from scissordyn.model.mechanism import Mechanism
from scissordyn.model.options import Options
from scissordyn.run.engine import Engine
from scissordyn.studies.ask.description import Accurate, OwnMeasure, Study
from scissordyn.studies.ask.design import SAMPLED, Design, Factor, Sampling
from scissordyn.studies.ask.distribution import Interval, Levels, Variation
from scissordyn.studies.ask.requirement import Requirement, read_response
from scissordyn.studies.compute.execute import How, Progress
from scissordyn.studies.compute.store import Store
from scissordyn.studies.result import StudyResult, computed, searching
from scissordyn.units import Quantity, checked

FilePath = str | os.PathLike[str]
Varied = Mapping[str, Any]
Meant = Mapping[str, Mapping[str, Any]]  # What each name stands for, by parameter

POINTS = 32  # Points of a study that follows a search, if no number is given
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
        kept = _measures(measures)
        units = {measure.name: measure.units for measure in kept if isinstance(measure, OwnMeasure)}
        search = {"risk": risk, "population": population, "generations": generations, "seed": seed}
        text = StudyText(
            case="case",
            vary=_varied(factors or {}),
            uncertain=_varied(uncertain or {}),
            measures=kept,
            require=_requirements(requirements, units),
            design=Design(design or ("sobol" if points else "grid"), points, seed),
            sampling=Sampling(samples, sampling, seed, common),
            members=members,
            optimise={"goals": [goals] if isinstance(goals, str) else list(goals), **search},
        )
        every = (pair for varied in (factors, uncertain) for pair in (varied or {}).items())
        values = {parameter: values for parameter, values in every if isinstance(values, Mapping)}
        base = _base(case, until, options, values)
        described = described_study(base, text, _cheap(screen, base, values), verify)
    return _result(described, store, compute, budget, engine=engine, block=block, progress=progress)


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


@checked
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
    functions = [_own_measure(name, function) for name, function in (measures or {}).items()]
    return StudyResult(store.study(reading=True), store, lambda: store.study(allow_code=files, own_measures=functions))


def _base(case: Mechanism | Case | FilePath, until: float | None, options: Options | None, values: Meant) -> Given:
    if isinstance(case, (str, os.PathLike)):
        file = read_case(Path(case))
        read = by_change(Path(case), [], file.run, values)
        base = Given(file.mechanism, options or Options(**file.run.keywords), read)
    elif isinstance(case, Case):
        base = _of_objects(case.mechanism, options or Options(**case.run.keywords), values)
    elif isinstance(case, Mechanism):
        if options is None and until is None:
            raise InputError("a study of a mechanism without an end of its runs", "until [s], or options", "until=0.5")
        base = _of_objects(case, options or Options(until or 0.0), values)
    else:
        raise InputError(
            f"a study of {case!r:.60}", "a mechanism, a case, a case file or a study file", "sd.study('study.toml')"
        )
    return base if until is None else replace(base, options=replace(base.options, until=until))


def _of_objects(mechanism: Mechanism, options: Options, values: Meant) -> Given:
    return Given(mechanism, options, by_object(mechanism, values) if values else None)


def _cheap(screen: Any, base: Given, values: Meant) -> Given | None:
    """The mechanism and the options of cheap runs."""
    if screen is None:
        return None
    if isinstance(screen, Case):
        return _of_objects(screen.mechanism, screen.run, values)
    names = [field.name for field in fields(Options)]
    if not isinstance(screen, Mapping) or not screen or not set(screen) <= set(names):
        raise InputError(f"screen = {screen!r:.60}", f"a case, or options of its runs: {', '.join(names)}", "{'rtol': 1e-3}")
    return replace(base, options=replace(base.options, **screen))


def _varied(given: Varied) -> dict[str, str | Variation]:
    """What numbers vary over, of plain values."""
    if not isinstance(given, Mapping):
        raise InputError(f"numbers that vary: {given!r:.60}", "values by parameter", "{'A.clearance': (1e-4, 4e-4)}")
    return {parameter: _variation(parameter, values) for parameter, values in given.items()}


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
        return [_own_measure(name, function) for name, function in given.items()]
    every = [given] if isinstance(given, str) or callable(given) else list(given)
    return [
        _own_measure(getattr(measure, "__name__", repr(measure)), measure) if callable(measure) else measure
        for measure in every
    ]


def _own_measure(name: str, function: Any) -> OwnMeasure:
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


def refined(
    study: Study,
    *,
    vary: Mapping[str, str] | None = None,
    uncertain: Mapping[str, str] | None = None,
    points: int | None = None,
    samples: int | None = None,
    seed: int | None = None,
    goals: Sequence[str] = (),
) -> Study:
    """The study with some things changed."""
    apart = {factor.name: factor for factor in study.apart}
    vary, uncertain = dict(vary or {}), dict(uncertain or {})
    places = {name: _places(factor, vary.pop(name)) for name, factor in apart.items() if name in vary}
    study = study.with_places(places)
    if clash := apart.keys() & uncertain.keys():
        raise InputError(f"'{min(clash)}' as an uncertain number", "some of its values", command("--vary", f"{min(clash)}=..."))
    chosen = {factor.path: factor for factor in study.factors}
    chosen |= {factor.path: factor for factor in factors_of(study.mechanism, vary, Path())}
    drawn = factors_of(study.mechanism, uncertain, Path())
    taken = {factor.path for factor in drawn if not factor.of}
    factors = tuple(factor for parameter, factor in chosen.items() if parameter not in taken)
    rest = tuple(
        factor for factor in study.uncertain if factor.name not in {factor.name for factor in drawn} and factor.path not in vary
    )
    seeds: dict[str, Any] = {} if seed is None else {"seed": seed}
    sampling = replace(study.sampling, samples=samples or study.sampling.samples, **seeds)
    return replace(
        study,
        factors=factors,
        uncertain=(*rest, *drawn),
        sampling=sampling if (*rest, *drawn) else replace(sampling, samples=1),
        **(
            searching(study, factors, goals, seed=seeds.get("seed", study.design.seed))
            if goals
            else {"optimisation": None, "design": _design(study, factors, points, seeds.get("seed", study.design.seed))}
        ),
    )


def _places(factor: Factor, text: str) -> list[int]:
    """Places of some names or levels of a study."""
    every: Any = factor.variation
    names = listed(text)
    if factor.labels:
        values: Sequence[Any] = (text,) if names is None else names.values
        other = next((value for value in values if value not in factor.labels), None)
        near = did_you_mean(str(other), factor.labels)
    else:
        values = read_variation(text, Quantity(factor.si), parameter=factor.path).levels().tolist()
        other = next((value for value in values if not np.isclose(every.values, value, rtol=1e-5, atol=0.0).any()), None)
        near = ""
    if other is not None:
        raise InputError(f"'{factor.path}' = '{text}'{near}", f"values of the study: {', '.join(factor.texts)}")
    return [factor.labels.index(value) if factor.labels else int(factor.places(value)) for value in values]


def _design(study: Study, factors: Sequence[Factor], points: int | None, seed: int) -> Design:
    """The design of the study; all combinations where each number has one value, a Sobol design after a search."""
    if all(factor.variation.count == 1 for factor in factors):
        return Design()
    kind = study.design.kind if study.design.kind in SAMPLED else "sobol" if points or study.optimisation else study.design.kind
    if kind not in SAMPLED:
        return Design(kind)
    if points is not None and points < 1:
        raise InputError(f"{points} points", "a whole number >= 1", "--points 32")
    return Design(kind, points or (study.design.points if study.design.kind == kind else POINTS), seed)
