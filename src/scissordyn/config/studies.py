"""Functions ``sd.study`` and ``sd.open_study``: define, compute, open and refine studies from Python values or a study file."""

from __future__ import annotations

import os
import tempfile
import weakref
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import fields, replace
from pathlib import Path
from typing import Any, Unpack

import numpy as np

from scissordyn.casefile.case import Case
from scissordyn.config.file import read_case
from scissordyn.config.study import BaseCase, StudyText, factors_of, make_measure, make_study, read_study, study_of
from scissordyn.config.variation import make_names, read_listed, read_variation, reader_by_change, reader_by_object
from scissordyn.errors import InputError, command, did_you_mean
from scissordyn.model.mechanism import Mechanism
from scissordyn.model.options import Options
from scissordyn.model.wear import Wear
from scissordyn.run.engine import Engine
from scissordyn.run.response import read_response
from scissordyn.studies.ask.description import Accurate, OwnMeasure, Study
from scissordyn.studies.ask.design import POINTS_MIN, SAMPLED, Design, Factor, Sampling
from scissordyn.studies.ask.distribution import Interval, Levels, Variation, from_scipy
from scissordyn.studies.ask.requirement import Requirement
from scissordyn.studies.compute.execute import How, Progress
from scissordyn.studies.compute.store import Store
from scissordyn.studies.result import StudyResult, computed, searching
from scissordyn.units import Quantity, checked

FilePath = str | os.PathLike[str]
Varied = Mapping[str, Any]
NamedValues = Mapping[str, Mapping[str, Any]]  # by parameter path: the object for each name

# Correct values of a parameter of a study, which error texts show
RANGE_EXAMPLES = (
    "(1e-4, 4e-4), [50.0, 100.0, 200.0], scipy.stats.norm(0.1, 0.02), '0.1..0.4 mm', or names, ['steel', 'aluminium']"
)


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
    gradients: bool = False,
    goals: str | Sequence[str] = (),
    risk: str = "mean",
    population: int = 0,
    generations: int = 20,
    search: str = "evolution",
    screen: Mapping[str, Any] | Case | None = None,
    verify: int = Accurate.points,
    budget: float | None = None,
    store: FilePath | None = None,
    engine: Engine = None,
    block: int | None = None,
    progress: Callable[[Progress], None] | None = None,
    compute: bool = True,
) -> StudyResult:
    """Vary parameters of a case, store all results, and report where the requirements are met.

    Parameters
    ----------
    case : Mechanism, Case or path
        Mechanism or case that is varied, or a case file. A study file alone describes the whole study.
    factors : mapping of str to values, optional
        Design parameters, in SI, by parameter path: a range ``(1e-4, 4e-4)``, levels ``[50.0, 100.0]``, a text such as
        ``"0.1..0.4 mm"``, a distribution ``scipy.stats.norm(0.1, 0.02)``, or names.
    until : float, optional
        End of the simulated time [s]; by default that of the case.
    options : Options, optional
        Options of the runs; by default those of the case.
    measures : sequence of str or function, or mapping of str to function, optional
        Measures that are stored for each run: names, or user-defined functions by name and unit, ``{"late [N]": late}``.
    requirements : sequence of str, or mapping of str to bound, optional
        For example ``"peak_force < 500 N"``.
    uncertain : mapping of str to values, optional
        Uncertain parameters, like `factors`.
    design : str
        "grid", "zip", "random", "latin-hypercube", "sobol", "one-at-a-time", "saltelli" or "morris"; by default "sobol" if
        `points` is given and "grid" otherwise.
    points, seed : int
        Number of points of the design, and seed of all random numbers.
    samples, sampling, common
        Number of samples of the uncertain parameters at each point; their design; True for the same samples at all points.
    members : int
        Number of runs of each sample, with starts that differ by round-off.
    gradients : bool
        Compute exact derivatives of the responses at each point. Trends and surfaces use them and need fewer points.
    goals : str or sequence of str, optional
        Goals of a search, for example ``"minimise peak_force"``.
    risk, population, generations
        Statistic of a goal over samples and members, candidates per generation, and number of generations.
    search : str
        "evolution", or "gradient": along exact derivatives to the next optimum, for one goal; a generation is then one point.
    screen : mapping of options or Case, optional
        Options of cheap runs; some of them are verified by runs of the case.
    verify : int
        Number of points to verify.
    budget : float, optional
        Time for cheap and accurate runs [s].
    store : path, optional
        File of the study's store, which a later call continues; by default a temporary file.
    engine : Executor or int, optional
        Engine that computes the cases; an int is a number of threads; by default one thread per processor.
    block : int, optional
        Number of cases in a block of a new store; by default it depends on the computing time of a case.
    progress : callable, optional
        Called after each block.
    compute : bool
        If False, open an existing store of this study and compute nothing.

    Raises
    ------
    InputError
        If a parameter, measure, requirement or option cannot be used, or the store belongs to another study.

    Examples
    --------
    >>> import scissordyn as sd
    >>> crank = sd.slider_crank(crank=0.05, rod=0.12).with_clearance("slider pin", sd.Clearance(2e-4))
    >>> factors = {"slider pin.clearance": (1e-4, 5e-4)}
    >>> found = sd.study(crank.driven(speed=sd.rpm(600)), until=0.02, factors=factors, measures="peak_force", points=4)
    >>> print(f"{found.table['slider pin.peak_force [N]'].max():.0f} N at worst of {len(found.table)} points")
    3348 N at worst of 4 points
    """
    if factors is None and uncertain is None and isinstance(case, (str, os.PathLike)):
        described = study_of(read_study(Path(case)))
    else:
        kept = _measures(measures)
        units = {measure.name: measure.units for measure in kept if isinstance(measure, OwnMeasure)}
        how = {"risk": risk, "population": population, "generations": generations, "seed": seed, "method": search}
        text = StudyText(
            case="case",
            vary=_read_factors(factors or {}),
            uncertain=_read_factors(uncertain or {}),
            measures=kept,
            require=_requirements(requirements, units),
            design=Design(design or ("sobol" if points else "grid"), points, seed),
            sampling=Sampling(samples, sampling, seed, common),
            members=members,
            gradients=gradients,
            optimise={"goals": _listed("goals", goals, str), **how},
        )
        every = (pair for varied in (factors, uncertain) for pair in (varied or {}).items())
        values = {parameter: values for parameter, values in every if isinstance(values, Mapping)}
        base = _base(case, until, options, values)
        described = make_study(base, text, _make_cheap(screen, base, values), verify)
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
    """Open a stored study; user-defined code is not executed.

    Parameters
    ----------
    path : path
        Path of the store.
    allow_code : path or sequence of path
        User-defined Python files of the study that may be executed, to resume, extend or replay it.
    measures : mapping of str to function, optional
        User-defined measures of the study that are not in a file, as for `study`.

    Raises
    ------
    InputError
        If the file is not the store of a study.
    """
    store = Store(path)
    if not store.exists():
        raise InputError(f"no study at '{path}'", "the store of a study")
    files = [Path(file) for file in ([allow_code] if isinstance(allow_code, (str, os.PathLike)) else allow_code)]
    functions = [_own_measure(name, function) for name, function in (measures or {}).items()]
    return StudyResult(store.study(reading=True), store, lambda: store.study(allow_code=files, own_measures=functions))


def _base(case: Mechanism | Case | FilePath, until: float | None, options: Options | None, values: NamedValues) -> BaseCase:
    if isinstance(case, (str, os.PathLike)):
        file = read_case(Path(case))
        read = reader_by_change(Path(case), [], file.run, values)
        base = BaseCase(file.mechanism, options or Options(**file.run.keywords), read, file.wear or Wear())
    elif isinstance(case, Case):
        base = _make_given(case.mechanism, options or Options(**case.run.keywords), values)
        base = replace(base, wear=case.wear or base.wear)
    elif isinstance(case, Mechanism):
        if options is None and until is None:
            raise InputError("study: the end time of the runs is missing", "until [s], or options", "until=0.5")
        base = _make_given(case, options or Options(until or 0.0), values)
    else:
        raise InputError(
            f"study: case = {case!r:.60}", "a mechanism, a case, a case file or a study file", "sd.study('study.toml')"
        )
    return base if until is None else replace(base, options=replace(base.options, until=until))


def _make_given(mechanism: Mechanism, options: Options, values: NamedValues) -> BaseCase:
    return BaseCase(mechanism, options, reader_by_object(mechanism, values) if values else None)


def _make_cheap(screen: Any, base: BaseCase, values: NamedValues) -> BaseCase | None:
    """Return mechanism and options of the cheap runs; None without cheap runs."""
    if screen is None:
        return None
    if isinstance(screen, Case):
        return _make_given(screen.mechanism, screen.run, values)
    names = [field.name for field in fields(Options)]
    if not isinstance(screen, Mapping) or not screen or not set(screen) <= set(names):
        raise InputError(f"screen = {screen!r:.60}", f"a case, or options of its runs: {', '.join(names)}", "{'rtol': 1e-3}")
    return replace(base, options=replace(base.options, **screen))


def _read_factors(given: Varied) -> dict[str, str | Variation]:
    """Convert Python values, such as a tuple or a list, to variations, by parameter path."""
    if not isinstance(given, Mapping):
        raise InputError(
            f"factors = {given!r:.60}", "a mapping from parameter paths to values", "{'A.clearance': (1e-4, 4e-4)}"
        )
    return {parameter: _variation(parameter, values) for parameter, values in given.items()}


def _variation(parameter: str, values: Any) -> str | Variation:
    if isinstance(values, (str, Variation)):
        return values
    if isinstance(values, Mapping):
        return make_names(list(values))
    if isinstance(values, (list, tuple)) and any(isinstance(value, str) for value in values):
        return make_names(values)
    if hasattr(values, "dist"):  # a frozen distribution of scipy.stats
        return from_scipy(values)
    try:
        numbers = tuple(float(value) for value in np.ravel(values))
    except (TypeError, ValueError):
        raise InputError(f"'{parameter}' = {values!r:.60}", RANGE_EXAMPLES) from None
    try:
        return Interval(*numbers) if isinstance(values, tuple) and len(numbers) == 2 else Levels(numbers)
    except InputError as error:
        raise InputError(
            f"'{parameter}' = {values!r:.60}: {error.what}", error.expected or RANGE_EXAMPLES, error.example
        ) from None


def _measures(given: Any) -> list[str | OwnMeasure]:
    """Convert the argument `measures` of `study` to a list of names and user-defined measures."""
    if isinstance(given, Mapping):
        return [_own_measure(name, function) for name, function in given.items()]
    every = [given] if callable(given) else _listed("measures", given, str)
    return [
        _own_measure(getattr(measure, "__name__", repr(measure)), measure) if callable(measure) else measure
        for measure in every
    ]


def _listed(name: str, given: Any, single: type | tuple[type, ...]) -> list[Any]:
    """Return an argument that is one text or several as a list."""
    if isinstance(given, single):
        return [given]
    if not isinstance(given, Iterable):
        raise InputError(f"study: {name} = {given!r:.60}", "a text, or a list of texts")
    return list(given)


def _own_measure(name: str, function: Any) -> OwnMeasure:
    if not callable(function):
        raise InputError(
            f"measure '{name}': {function!r:.60}", "a function, by name and unit of the measure", "{'late [N]': late}"
        )
    return make_measure(name, function)


def _requirements(given: Any, own: Mapping[str, str]) -> list[str | Requirement]:
    """Convert the argument `requirements` of `study` to a list of texts and requirements."""
    if not isinstance(given, Mapping):
        return _listed("requirements", given, (str, Requirement))
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


def refine_study(
    study: Study,
    *,
    vary: Mapping[str, str] | None = None,
    uncertain: Mapping[str, str] | None = None,
    points: int | None = None,
    samples: int | None = None,
    seed: int | None = None,
    goals: Sequence[str] = (),
) -> Study:
    """Return a study with changed factors, uncertain parameters, samples or goals."""
    apart = {factor.name: factor for factor in study.variant_factors}
    vary, uncertain = dict(vary or {}), dict(uncertain or {})
    places = {name: _value_indices(factor, vary.pop(name)) for name, factor in apart.items() if name in vary}
    study = study.with_places(places)
    if clash := apart.keys() & uncertain.keys():
        raise InputError(
            f"the factor '{min(clash)}' cannot be uncertain", "some of its values", command("--vary", f"{min(clash)}=...")
        )
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


def _value_indices(factor: Factor, text: str) -> list[int]:
    """Return the indices, in a factor's names or levels, of the names or levels that `text` lists."""
    every: Any = factor.variation
    names = read_listed(text)
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
    """Return the design of a refined study: a grid if each factor has one value, a Sobol design if the study was a search."""
    if all(factor.variation.count == 1 for factor in factors):
        return Design()
    kind = study.design.kind if study.design.kind in SAMPLED else "sobol" if points or study.optimisation else study.design.kind
    if kind not in SAMPLED:
        return Design(kind)
    if points is not None and points < 1:
        raise InputError(f"a design of {points} points", "a whole number >= 1", "--points 32")
    return Design(kind, points or (study.design.points if study.design.kind == kind else 4 * POINTS_MIN), seed)
