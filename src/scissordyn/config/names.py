"""What varies in a study by its case file, names and dimensions: each combination makes a mechanism of its own."""

from __future__ import annotations

import itertools
import math
import tomllib
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

from scissordyn.config.file import read_case
from scissordyn.config.quantity import unit_factor
from scissordyn.config.table import toml
from scissordyn.config.variation import read_variation, unit_of
from scissordyn.errors import InputError
from scissordyn.model.mechanism import Mechanism
from scissordyn.model.parameter_path import changed
from scissordyn.run.options import Options
from scissordyn.study.ask.distribution import Interval, Levels, Names, Variation
from scissordyn.study.ask.factor import Factor
from scissordyn.units import Quantity

OF_FILE = ("structure", "bending", "panels", "payload", "joint_friction")
"""Tables of a case file that make parts of a mechanism, which has their numbers no more."""

SI = ("m", "rad", "kg", "s", "N", "N m", "rad/s", "m/s", "m/s^2", "kg m^2", "kg/m", "K", "Pa", "N m^2", "N/m", "1/K")
"""Units of their numbers."""

NAMES_SAMPLE = '"structure.bars.material" = ["steel", "aluminium"]'

MOST = 64  # Combinations of names: each mechanism is read, kept in the store, and simulated in a batch of its own
Reader = Callable[[Mapping[str, str]], Mechanism]  # Makes the mechanism with some names, by parameter


def names_of(given: Sequence[Any], probabilities: Sequence[Any] = ()) -> Names:
    """Names of a list: texts, or other values as a case file has them."""
    try:
        shares = tuple(map(float, probabilities))
    except (TypeError, ValueError):
        raise InputError(f"probabilities = {toml(list(probabilities))}", "numbers", "probabilities = [0.3, 0.7]") from None
    return Names(tuple(value if isinstance(value, str) else toml(value) for value in given), shares)


def listed(text: str) -> Names | None:
    """Names of a text in brackets, ``[steel, aluminium]``; None for any other text."""
    inside = text.strip()
    if not (inside.startswith("[") and inside.endswith("]")):
        return None
    with suppress(ValueError):
        return names_of(tomllib.loads(f"names = {inside}")["names"])
    return names_of([name.strip() for name in inside[1:-1].split(",")])


def number_of_file(parameter: str, given: str | Variation, folder: Path) -> Factor:
    """A number that only the case file has, which takes the levels of a list or a range."""
    unit = unit_of(given) if isinstance(given, str) else ""
    fitting = (si for si in SI if not unit or _fits(unit, si))
    si = next(fitting, "") if unit else "1"
    if not si:
        raise InputError(f"'{parameter}' over '{given}': unit '{unit}'", f"one that fits one of {', '.join(SI)}")
    variation = read_variation(given, Quantity(si), parameter=parameter, folder=folder) if isinstance(given, str) else given
    if not isinstance(variation, Levels | Interval):
        what = f"'{parameter}' over a {variation.kind} distribution: each of its values makes a mechanism of its own"
        raise InputError(what, "a list, or a range of which the levels are taken", '"1..3 mm, 5 values"')
    levels = Levels(tuple(variation.levels().tolist()))
    return Factor(parameter, levels, unit, unit_factor(unit, si) if unit else 1.0, si=si)


def _fits(unit: str, si: str) -> bool:
    try:
        unit_factor(unit, si)
    except InputError:
        return False
    return True


def variants_of(factors: Sequence[Factor], read: Reader | None) -> tuple[Mechanism, ...]:
    """The mechanism with each combination of names and levels, those of the last factor fastest; none without such factors."""
    apart = [factor for factor in factors if factor.texts]
    if not apart:
        return ()
    if read is None:
        what = f"'{apart[0].path}' of a mechanism without a case file"
        raise InputError(what, "a case file, or what each name stands for", "{'A.friction': {'lugre': sd.LuGre(kinetic=0.1)}}")
    count = math.prod(len(factor.texts) for factor in apart)
    if count > MOST:
        what = f"{count} combinations of {' and '.join(factor.path for factor in apart)}"
        raise InputError(what, f"at most {MOST}; fewer names or levels, or a study for each of some", '"1..3 mm, 5 values"')
    return tuple(
        read(dict(zip((factor.path for factor in apart), texts, strict=True)))
        for texts in itertools.product(*(factor.texts for factor in apart))
    )


def by_change(
    case: Path, changes: Sequence[str], options: Options, values: Mapping[str, Mapping[str, Any]] | None = None
) -> Reader:
    """Reads a case with names as ``--set`` changes."""
    values = values or {}

    def read(names: Mapping[str, str]) -> Mechanism:
        which = ", ".join(f"'{parameter}' = '{name}'" for parameter, name in names.items())
        ordered = sorted(names, key=lambda parameter: parameter.count("."))  # a section before its wall
        written = [f"{parameter}={names[parameter]}" for parameter in ordered if parameter not in values]
        try:
            case_read = read_case(case, [*changes, *written])
        except InputError as error:
            raise InputError(f"{which}: {error.what}", error.allowed, error.type_this) from None
        if case_read.run != options:
            raise InputError(f"{which}: other options of the runs", "names of what the mechanism is made of", NAMES_SAMPLE)
        return by_object(case_read.mechanism, values)(
            {parameter: name for parameter, name in names.items() if parameter in values}
        )

    return read


def by_object(mechanism: Mechanism, values_of: Mapping[str, Mapping[str, Any]]) -> Reader:
    """Puts what names stand for into a mechanism: a value at their parameter path, or a mechanism in its place."""

    def read(names: Mapping[str, str]) -> Mechanism:
        unknown = next((parameter for parameter in names if parameter not in values_of), None)
        if unknown is not None:
            sample = f"{{'{unknown}': {{'{names[unknown]}': ...}}}}"
            raise InputError(
                f"'{unknown}' = '{names[unknown]}' of a mechanism without a case file", "what it stands for", sample
            )
        values = {parameter: values_of[parameter][name] for parameter, name in names.items()}
        mechanism_read = next((value for value in values.values() if isinstance(value, Mechanism)), mechanism)
        for parameter, value in values.items():
            mechanism_read = mechanism_read if isinstance(value, Mechanism) else changed(mechanism_read, parameter, value)
        return mechanism_read

    return read
