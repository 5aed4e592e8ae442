"""Description of a study: factors, design, uncertain parameters, members, measures and requirements."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field, fields, is_dataclass, replace
from pathlib import Path
from types import MappingProxyType
from typing import Any, get_args, get_origin, get_type_hints

import numpy as np

from scissordyn.analysis.motor import MotorCurve
from scissordyn.annotation import MismatchError, accepted, members
from scissordyn.casefile.configuration import read_mechanism, write_configuration
from scissordyn.errors import InputError, command, did_you_mean, whole_number
from scissordyn.file.provenance import provenance
from scissordyn.lifetime.response import WearLife
from scissordyn.model.mechanism import Mechanism
from scissordyn.model.options import Options
from scissordyn.model.parameter_path import changed_all, check_distinct, number
from scissordyn.model.record import function_text
from scissordyn.model.wear import Wear
from scissordyn.plugin.user_file import file_digest, load_function, split_reference
from scissordyn.run.measure import MEASURES, parts_of
from scissordyn.run.response import Response, check_part
from scissordyn.studies.ask.design import POINTS_MIN, Design, Factor, Sampling, design_size, design_values
from scissordyn.studies.ask.distribution import Variation
from scissordyn.studies.ask.distribution import from_plain as read_variation
from scissordyn.studies.ask.requirement import Goal, Optimisation, Requirement, check_unit

# Subpackages without effect on the result of a run; the fingerprint of a study omits their sources
SUBPACKAGES_WITHOUT_RESULTS = ("cli", "plot", "config", "periodic", "analysis")

# [-] added to a study's seed for its uncertain parameters, so that they are independent of the design
UNCERTAIN_SEED_OFFSET = 2**32

Read = Mapping[Any, Callable[[Any], Any]]  # Functions that read values of some types


@dataclass(frozen=True)
class Accurate:
    """Accurate runs that check a study of cheap runs."""

    mechanism: Mechanism  # Mechanism of the accurate runs, with the same values at the parameter paths that vary
    options: Options
    points: int = 32  # Number of first points of the design, or largest number of points of a front, that are run accurately
    variants: tuple[Mechanism, ...] = ()  # Mechanism of the accurate runs for each combination of names, as `Study.variants`

    def __post_init__(self) -> None:
        whole_number("verify", self.points, POINTS_MIN)


@dataclass(frozen=True)
class OwnMeasure:
    """User-defined measure: a Python function."""

    name: str
    function: Callable[..., Any] | str  # Or ``"file.py:function"``. Returns a number
    # Argument of the function: the Dataset of `simulate` (each case is then simulated once more, with samples), or the `Ended`
    # of the batch
    of: str = "dataset"
    units: str = "1"
    digest: str = ""  # Digest of its file

    def __post_init__(self) -> None:
        if self.of not in ("dataset", "accumulators"):
            raise InputError(f"a measure of '{self.of}'", "dataset, accumulators")
        if not self.name.isidentifier() or self.name in MEASURES:
            raise InputError(f"'{self.name}' as the name of a user-defined measure", "an unused name of letters and digits")
        if isinstance(self.function, str):
            self._check_reference(self.function)
            path, name = split_reference("measure", self.function)
            object.__setattr__(self, "function", f"{path}:{name}")
            object.__setattr__(self, "digest", self.digest or file_digest(path))

    def _check_reference(self, reference: str) -> None:
        file, _, name = reference.rpartition(":")
        sample = f"'{self.name} = mine.py:{name if name.isidentifier() else 'late'}'"
        if not file.endswith(".py") or not name.isidentifier():
            raise InputError(f"measure '{self.name}' from '{reference}'", "a Python file and a function in it", sample)
        if not Path(file).expanduser().is_file():
            raise InputError(f"measure '{self.name}': no file '{file}'", "a Python file that exists", sample)

    def callable(self) -> Callable[..., Any]:
        """Return the function itself."""
        return load_function("measure", self.function, self.digest) if isinstance(self.function, str) else self.function

    @property
    def changes_objects(self) -> bool:
        """True for a function or an object of the calling program, which may change others of its process."""
        return not isinstance(self.function, str | MotorCurve | WearLife)

    def to_plain(self) -> dict[str, Any]:
        """Return plain data; a function that is not in a file is given by its source, for comparison."""
        function = self.function if isinstance(self.function, str) else ""
        plain = {"name": self.name, "function": function, "of": self.of, "units": self.units}
        if isinstance(self.function, str):
            return {**plain, "digest": self.digest}
        if isinstance(self.function, MotorCurve):
            return {**plain, "motor": asdict(self.function)}
        if isinstance(self.function, WearLife):
            return {**plain, "wear": asdict(self.function.settings)}
        return {**plain, "digest": hashlib.sha256(function_text(self.function).encode()).hexdigest()[:16]}


@dataclass(frozen=True)
class Study:
    """A study of a mechanism.

    Case number = (point x samples + sample) x members + member, so that a point's cases are neighbours.
    """

    mechanism: Mechanism  # Mechanism, or the text of its case file if the study is only read: nothing is executed
    options: Options
    factors: tuple[Factor, ...]
    design: Design = field(default_factory=Design)
    measures: tuple[str, ...] = ("peak_force", "peak_drive_torque")
    own_measures: tuple[OwnMeasure, ...] = ()
    uncertain: tuple[Factor, ...] = ()  # Numbers that are not chosen
    sampling: Sampling = field(default_factory=Sampling)
    members: int = 1  # Runs of each sample, from starts that differ by round-off
    perturbation: float = 1e-14  # Relative perturbation of the starts
    requirements: tuple[Requirement, ...] = ()
    optimisation: Optimisation | None = None  # Proposes the points of an adaptive design
    # Responses of single joints, drives, components or tracked points; by default the largest of all
    responses: tuple[Response, ...] = ()
    accurate: Accurate | None = None  # The runs that verify those of this study, which are cheap
    # Mechanism for each combination of values of `variant_factors`, the last factor varying fastest; empty if there are none
    variants: tuple[Mechanism, ...] = ()
    gradients: bool = False  # Whether the derivatives of the responses by the varied numbers are computed

    def __post_init__(self) -> None:
        if not self.factors and not self.uncertain:
            raise InputError(
                "a study in which nothing varies", "parameters and their values", "--vary A.clearance='0.1..0.4 mm'"
            )
        if self.sampling.samples > 1 and not self.uncertain:
            raise InputError(
                f"{self.sampling.samples} samples without an uncertain parameter",
                "an uncertain parameter and its distribution",
                "--uncertain A.damping.restitution='0.5..0.9', or the same in [uncertain]",
            )
        whole_number("members", self.members)
        for name in self.measures:
            if name not in MEASURES:
                raise InputError(f"unknown measure '{name}'{did_you_mean(name, MEASURES)}", ", ".join(MEASURES))
        names = self.measure_names
        twice = next((name for name in names if names.count(name) > 1), None)
        if twice is not None:
            raise InputError(f"two measures named '{twice}'", "a name for each measure", f"'{twice}2 = mine.py:function'")
        for requirement in self.requirements:
            if requirement.measure not in names:
                raise InputError(
                    f"'{requirement.label}': the study has no measure '{requirement.measure}'"
                    f"{did_you_mean(requirement.measure, names)}",
                    ", ".join(names),
                )
        if isinstance(self.mechanism, Mechanism):
            for mechanism in self.variants or (self.mechanism,):
                self._check_mechanism(mechanism)
            self._check_variants()
        self._check_size()
        self._check_gradients()

    def _check_gradients(self) -> None:
        """Raise `InputError` for gradients of a study whose cases have no derivatives of their own."""
        if not self.gradients:
            return
        if self.per_point > 1:
            raise InputError("gradients of several runs of each point", "one sample and one member", "members = 1")
        if self.optimisation is not None:
            raise InputError("gradients of a study with goals", "a search along derivatives", 'method = "gradient"')
        if differs := next((factor for factor in self.varied if factor.texts or factor.of), None):
            what = f"'{differs.path}', {'a deviation' if differs.of else 'a value that only the case file has'}"
            raise InputError(f"gradients of a study with {what}", "numbers of the mechanism, and their ranges")

    def _check_mechanism(self, mechanism: Mechanism) -> None:
        """Raise `InputError` if a mechanism lacks a varied parameter or a measured part, or does not admit a value."""
        chosen = {factor.path: factor.variation for factor in self.factors}
        slopes = self.gradients or bool(self.optimisation and self.optimisation.method == "gradient")
        check_distinct(mechanism, [factor.path for factor in self.varied if not factor.texts], disjoint=slopes)
        for factor in (varied for varied in self.varied if not varied.texts):
            quantity = number(mechanism, factor.path).quantity
            assert quantity is not None
            if factor.of and factor.of not in chosen:
                raise InputError(
                    f"'{factor.path}' deviates from a value that is not chosen",
                    "a range of the number under [vary], or a nominal value before the tolerance",
                    "'0.3 mm +- 0.02 mm'",
                )
            ends = factor.deviated_ends(chosen[factor.of]) if factor.of else factor.variation.ends
            for end in ends:
                if np.isfinite(end) and not quantity.admits(end):
                    raise InputError(f"'{factor.path}' can be {end:g} [{quantity.unit}]", quantity.expected)
            if self.factor_names.count(factor.name) > 1:
                raise InputError(
                    f"'{factor.path}' varies twice", "each parameter once, or a tolerance of the chosen value", "'+- 20 %'"
                )
        judged = [*(requirement.response for requirement in self.requirements), *(goal.response for goal in self.goals)]
        for response in (*judged, *self.responses):
            check_part(mechanism, response)
        for response in judged:
            check_unit(mechanism, response)

    def _check_variants(self) -> None:
        """Raise `InputError` if the design or a goal needs ordered names, or the variants differ in units or measured parts."""
        if not self.variant_factors:
            return
        named = [factor.path for factor in self.variant_factors if factor.labels]
        if named and self.design.kind == "morris":
            what = f"'{named[0]}': names, which have no order, in a Morris design"
            raise InputError(what, "a design for Sobol indices", 'kind = "saltelli"')
        if any(goal.measure in named for goal in self.goals):
            raise InputError(f"goal '{named[0]}': names have no order", "a measure or a number as goal", "'minimise mass'")
        if self.design.kind == "one-at-a-time" and self.mechanism not in self.variants:
            what = f"'{self.variant_factors[0].path}' in a one-at-a-time design, without the value of the case"
            raise InputError(what, "names and levels that include those of the case")
        for factor in (varied for varied in self.varied if not varied.texts):
            quantities = (number(variant, factor.path).quantity for variant in self.variants)
            units = {quantity.unit for quantity in quantities if quantity is not None}
            if len(units) > 1:
                raise InputError(f"'{factor.path}' in [{'] and ['.join(sorted(units))}], by name", "a number of one unit")
        dims = {dim for name in self.measures for dim in MEASURES[name].dims}
        first, *others = (parts_of(variant) for variant in self.variants)
        differs = next((dim for parts in others for dim in dims if parts[dim] != first[dim]), None)
        if differs is not None:
            what = f"measures of each {differs}, which differ between the mechanisms"
            raise InputError(what, f"names and dimensions that keep each {differs}, or other measures")

    def _check_size(self) -> None:
        """Raise `InputError` if the study has more cases than can be evaluated."""
        points, search = self.points, self.optimisation
        if search is not None:
            points = max(points, search.generations * search.size(len(self.factors)))
        whole_number("cases", points * self.sampling.samples * self.members)

    @property
    def measure_names(self) -> tuple[str, ...]:
        return (*self.measures, *(measure.name for measure in self.own_measures))

    @property
    def factor_names(self) -> tuple[str, ...]:
        """Names of all numbers that vary, chosen and uncertain: their parameter paths, or those of deviations."""
        return tuple(factor.name for factor in self.varied)

    @property
    def varied(self) -> tuple[Factor, ...]:
        """All numbers and names that vary, chosen and uncertain."""
        return (*self.factors, *self.uncertain)

    @property
    def goals(self) -> tuple[Goal, ...]:
        """Goals of the search; empty without a search."""
        return self.optimisation.goals if self.optimisation is not None else ()

    @property
    def paths(self) -> list[str]:
        """The parameter paths of the numbers and names that are chosen."""
        return [factor.path for factor in self.factors]

    @property
    def per_point(self) -> int:
        return self.sampling.samples * self.members

    @property
    def points(self) -> int:
        return design_size(self.design, [factor.variation for factor in self.factors]) if self.factors else 1

    @property
    def cases(self) -> int:
        return self.points * self.per_point

    @property
    def variant_factors(self) -> tuple[Factor, ...]:
        """Factors, chosen and uncertain, each of whose names or levels needs its own mechanism."""
        return tuple(factor for factor in self.varied if factor.texts)

    def cells(self, values: np.ndarray) -> np.ndarray:
        """Return values of cases in the shape (points, samples, members), without an incomplete last point."""
        return values[: len(values) // self.per_point * self.per_point].reshape(-1, self.sampling.samples, self.members)

    def base(self) -> np.ndarray:
        """Return the values of the factors in the mechanism and its case file; indices for names."""
        places = self.own_values()
        return np.array(
            [places[factor.name] if factor.texts else number(self.mechanism, factor.path).value for factor in self.factors],
            float,
        )

    def numbers(self, cases: np.ndarray, points: np.ndarray | None = None) -> dict[str, np.ndarray]:
        """Return the parameter values of some cases by parameter, in SI units; they depend only on the index of the case.

        `points` has the parameter values at each point of an adaptive design, shape (points, factors).
        """
        point, rest = np.divmod(cases, self.per_point)
        sample = rest // self.members
        values: dict[str, np.ndarray] = {}
        if self.factors:
            places, back = np.unique(point, return_inverse=True)
            if self.design.kind == "adaptive":
                assert points is not None
                chosen = points[places]
            else:
                base = self.base() if self.design.kind == "one-at-a-time" else np.zeros(len(self.factors))
                chosen = design_values(self.design, [factor.variation for factor in self.factors], base, places)
            values |= {factor.path: chosen[back, k] for k, factor in enumerate(self.factors)}
        if self.uncertain:
            size = self.sampling.samples if self.sampling.common else self.sampling.samples * self.points
            design = Design(self.sampling.kind, size, seed=self.sampling.seed + UNCERTAIN_SEED_OFFSET)
            at = sample if self.sampling.common else point * self.sampling.samples + sample
            places, back = np.unique(at, return_inverse=True)
            variations = [factor.variation for factor in self.uncertain]
            # the same dimension of two Sobol sequences is one number twice: those of the chosen numbers are left out
            taken = {"sobol": 1, "saltelli": 2}.get(self.design.kind, 0) * len(self.factors)
            left_out = [variations[0]] * (taken if self.sampling.kind == "sobol" and not self.sampling.common else 0)
            drawn = design_values(design, [*left_out, *variations], np.zeros(0), places)[:, len(left_out) :]
            values |= {factor.name: drawn[back, k] for k, factor in enumerate(self.uncertain)}
        return values

    def applied(self, values: Mapping[str, Any]) -> dict[str, Any]:
        """Return the values for a mechanism by parameter path: chosen values plus their deviations."""
        deviations = [factor for factor in self.uncertain if factor.of]
        left_out = {factor.name for factor in (*deviations, *self.variant_factors)} | {factor.of for factor in deviations}
        numbers = {name: value for name, value in values.items() if name not in left_out}
        for factor in deviations:
            chosen, deviation = values[factor.of], values[factor.name]
            numbers[factor.path] = chosen * (1.0 + deviation) if factor.relative else chosen + deviation
        return numbers

    def by_variant(self, values: Mapping[str, np.ndarray]) -> Iterator[tuple[Mechanism, np.ndarray]]:
        count = len(next(iter(values.values())))
        all_values: dict[str, Any] = {**self.own_values(), **values}
        chosen = [factor.places(np.broadcast_to(all_values[factor.name], count)) for factor in self.variant_factors]
        which = np.ravel_multi_index(chosen, self._counts) if chosen else np.zeros(count, int)
        for place in np.unique(which):
            yield self.variants[place] if chosen else self.mechanism, np.flatnonzero(which == place)

    def mechanism_of(self, values: Mapping[str, float], *, nominal: bool = False) -> Mechanism:
        ((mechanism, _),) = self.by_variant({name: np.array([value]) for name, value in values.items()})
        variant_names = {factor.name for factor in self.variant_factors}
        numbers = (
            {name: value for name, value in values.items() if name not in variant_names} if nominal else self.applied(values)
        )
        return changed_all(mechanism, numbers)

    def labelled(self, values: Mapping[str, float]) -> dict[str, float | str]:
        """Return values by parameter, with names instead of their indices."""
        labels = {factor.name: factor.labels for factor in self.variant_factors if factor.labels}
        return {name: labels[name][int(value)] if name in labels else value for name, value in values.items()}

    def own_values(self) -> dict[str, float]:
        """Return the values of the unchanged mechanism for the factors whose values need mechanisms of their own."""
        variant = self.variants.index(self.mechanism) if self.mechanism in self.variants else 0
        places = np.unravel_index(variant, self._counts)
        return {
            factor.name: float(factor.variation.levels()[place])
            for factor, place in zip(self.variant_factors, places, strict=True)
        }

    def with_places(self, places: Mapping[str, Sequence[int]]) -> Study:
        """Return the study with only those names and levels whose indices `places` gives by factor."""
        if not places:
            return self
        kept_places = np.ix_(*(places.get(factor.name, range(factor.variation.count)) for factor in self.variant_factors))

        def fewer(factor: Factor) -> Factor:
            if factor.name not in places:
                return factor
            variation: Any = factor.variation
            return replace(factor, variation=type(variation)(tuple(variation.values[place] for place in places[factor.name])))

        return replace(
            self,
            factors=tuple(map(fewer, self.factors)),
            uncertain=tuple(map(fewer, self.uncertain)),
            variants=tuple(self.variants[k] for k in np.arange(len(self.variants)).reshape(self._counts)[kept_places].ravel()),
        )

    @property
    def _counts(self) -> list[int]:
        return [factor.variation.count for factor in self.variant_factors]

    def to_plain(self) -> dict[str, Any]:
        """Return the study as plain data for JSON."""
        return {field.name: to_plain(getattr(self, field.name)) for field in fields(self)}

    @classmethod
    def from_plain(
        cls,
        plain: Mapping[str, Any],
        *,
        allow_code: Sequence[Path] = (),
        own_measures: Sequence[OwnMeasure] = (),
        reading: bool = False,
    ) -> Study:
        """Return the study that `to_plain` wrote.

        Functions of the user are in allowed files, which must not have changed, or given as measures. With `reading`, the
        mechanism stays the text of its case file, and no code of the user is executed.
        """
        functions = {measure.name: measure for measure in own_measures}

        def measure(entry: Mapping[str, Any]) -> OwnMeasure:
            return functions.get(entry["name"]) or _read_measure(entry, allow_code, reading)

        study: Study = from_plain(
            cls,
            plain,
            {
                Mechanism: (lambda text: text) if reading else (lambda text: read_mechanism(text, allow_code)),
                Options: lambda options: Options(**{name: value for name, value in options.items() if name != "kind"}),
                OwnMeasure: measure,
                Variation: read_variation,
            },
        )
        return study

    def fingerprint(self) -> dict[str, str]:
        """Return digests of everything that the results depend on, by subject; equal digests mean equal results."""
        plain = self.to_plain()
        for factor in (*plain["factors"], *plain["uncertain"]):
            del factor["unit"], factor["scale"]  # no number depends on them
        if self.design.extendable:
            plain["design"] = {**plain["design"], "points": 0}
        search = plain["optimisation"]
        if search is not None:  # these decide which points there are
            search["requirements"] = plain["requirements"]
        parts = {
            "mechanism": [plain["mechanism"], plain["variants"]] if self.variants else plain["mechanism"],
            "options": plain["options"],
            "design": [plain[key] for key in ("factors", "design", "uncertain", "sampling", "members", "perturbation")],
            "measures": [plain["measures"], plain["own_measures"], plain["gradients"]],
            "optimisation": None if search is None else {**search, "generations": 0},
            "program": provenance(SUBPACKAGES_WITHOUT_RESULTS),
        }
        return {
            name: hashlib.sha256(json.dumps(part, sort_keys=True).encode()).hexdigest()[:16] for name, part in parts.items()
        }


def _read_measure(entry: Mapping[str, Any], allow_code: Sequence[Path], reading: bool) -> OwnMeasure:
    if "motor" in entry:
        return OwnMeasure(entry["name"], MotorCurve(**entry["motor"]), entry["of"], entry["units"])
    if "wear" in entry:
        return OwnMeasure(entry["name"], WearLife(Wear(**entry["wear"])), entry["of"], entry["units"])
    if reading:
        return OwnMeasure(**{**entry, "function": _not_read})
    what = f"the study's measure '{entry['name']}'"
    if not entry["function"]:
        sample = f"sd.open_study('study.db', measures={{'{entry['name']}': function}})"
        raise InputError(f"{what} is a Python function that is not in a file", "the function, from Python", sample)
    path = Path(entry["function"].rpartition(":")[0])
    if path.resolve() not in {Path(file).resolve() for file in allow_code}:
        raise InputError(
            f"{what} is a user-defined function, which is not executed unless you allow it",
            "the name of its file",
            command("--allow-code", path),
        )
    if path.is_file() and file_digest(path) != entry["digest"]:
        raise InputError(f"'{path}' has changed since the study was begun", "the same file, or a new study", "-o another.db")
    return OwnMeasure(**entry)


def _not_read(_: Any) -> float:
    raise InputError("a user-defined measure of a study that is only read", "the name of its file", "--allow-code mine.py")


def to_plain(value: Any) -> Any:
    if isinstance(value, Mechanism):
        return write_configuration(value)
    if isinstance(value, Options):
        return value.keywords
    if hasattr(value, "to_plain"):
        return value.to_plain()
    if isinstance(value, Mapping):
        return {key: to_plain(entry) for key, entry in value.items()}
    if isinstance(value, tuple | list):
        return [to_plain(entry) for entry in value]
    if is_dataclass(value) and not isinstance(value, type):
        named = {field.name: to_plain(getattr(value, field.name)) for field in fields(value)}
        return {"kind": value.kind, **named} if hasattr(value, "kind") else named
    return value


def from_plain(hint: Any, plain: Any, read: Read = MappingProxyType({})) -> Any:
    """Return the value that `to_plain` wrote; raise `ValueError` if plain data do not fit the annotation."""
    kind: Any = next((member for member in members(hint) if member is not type(None)), Any)
    if kind in read:
        return None if plain is None else read[kind](plain)
    arguments = get_args(kind)
    if get_origin(kind) is tuple and plain is not None:
        if not isinstance(plain, list | tuple):
            raise MismatchError
        kinds = [arguments[0]] * len(plain) if arguments[-1] is ... else arguments
        return tuple(from_plain(inner, entry, read) for inner, entry in zip(kinds, plain, strict=True))
    if get_origin(kind) is dict:
        return {key: from_plain(arguments[1], entry, read) for key, entry in plain.items()}
    if is_dataclass(kind) and isinstance(plain, Mapping):
        hints = get_type_hints(kind)
        built: Any = kind
        return built(**{str(name): from_plain(hints[str(name)], entry, read) for name, entry in plain.items()})
    return accepted(plain, hint)
