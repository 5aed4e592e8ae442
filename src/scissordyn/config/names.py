"""Names that vary in a study, such as materials and laws: each combination of them makes a mechanism of its own."""

from __future__ import annotations

import itertools
import math
import tomllib
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

from scissordyn.config.file import read_case
from scissordyn.config.table import toml
from scissordyn.errors import InputError
from scissordyn.model.address import changed
from scissordyn.model.mechanism import Mechanism
from scissordyn.run.options import Options
from scissordyn.study.distribution import Names
from scissordyn.study.factor import Factor

__all__ = ["NAMES_SAMPLE", "Reader", "by_change", "by_object", "listed", "names_of", "variants_of"]

NAMES_SAMPLE = '"structure.bars.material" = ["steel", "aluminium"]'

MOST = 64
"""Combinations of names: each mechanism is read, kept in the store, and simulated in a batch of its own."""

Reader = Callable[[Mapping[str, str]], Mechanism]
"""Makes the mechanism with some names, by address."""


def names_of(given: Sequence[Any], probabilities: Sequence[Any] = ()) -> Names:
    """Names of a list: texts, or other values as a case file has them.

    Parameters
    ----------
    given : sequence
    probabilities : sequence of float
        Of each; all the same if empty.
    """
    try:
        shares = tuple(map(float, probabilities))
    except (TypeError, ValueError):
        raise InputError(f"probabilities = {toml(list(probabilities))}", "numbers", "probabilities = [0.3, 0.7]") from None
    return Names(tuple(each if isinstance(each, str) else toml(each) for each in given), shares)


def listed(text: str) -> Names | None:
    """Names of a text in brackets, ``[steel, aluminium]``; None for any other text."""
    inside = text.strip()
    if not (inside.startswith("[") and inside.endswith("]")):
        return None
    with suppress(ValueError):
        return names_of(tomllib.loads(f"names = {inside}")["names"])
    return names_of([each.strip() for each in inside[1:-1].split(",")])


def variants_of(factors: Sequence[Factor], read: Reader | None) -> tuple[Mechanism, ...]:
    """The mechanism with each combination of names, those of the last factor fastest; none where only numbers vary.

    Parameters
    ----------
    factors : sequence of Factor
    read : callable, optional
        Not given where there is no case file and no value to a name.

    Raises
    ------
    InputError
        For a name that the case does not take, or too many combinations.
    """
    named = [factor for factor in factors if factor.labels]
    if not named:
        return ()
    if read is None:
        what = f"'{named[0].address}' over names, of a mechanism without a case file"
        raise InputError(what, "a case file, or what each name stands for", "{'A.friction': {'lugre': sd.LuGre(kinetic=0.1)}}")
    count = math.prod(len(factor.labels) for factor in named)
    if count > MOST:
        raise InputError(f"{count} combinations of names", f"at most {MOST}; a study for each of some names")
    return tuple(
        read(dict(zip((factor.address for factor in named), names, strict=True)))
        for names in itertools.product(*(factor.labels for factor in named))
    )


def by_change(
    case: Path, changes: Sequence[str], options: Options, meant: Mapping[str, Mapping[str, Any]] | None = None
) -> Reader:
    """Reads a case with names as ``--set`` changes.

    Parameters
    ----------
    case : Path
    changes : sequence of str
        Made before.
    options : Options
        Of the runs, which no name may change.
    meant : mapping of str to mapping of str to value, optional
        What names stand for that are none of the case file's, by address.
    """
    meant = meant or {}

    def read(names: Mapping[str, str]) -> Mechanism:
        said = ", ".join(f"'{address}' = '{name}'" for address, name in names.items())
        written = [f"{address}={name}" for address, name in names.items() if address not in meant]
        try:
            found = read_case(case, [*changes, *written])
        except InputError as error:
            raise InputError(f"{said}: {error.what}", error.allowed, error.type_this) from None
        if found.run != options:
            raise InputError(f"{said}: other options of the runs", "names of what the mechanism is made of", NAMES_SAMPLE)
        return by_object(found.mechanism, meant)({address: name for address, name in names.items() if address in meant})

    return read


def by_object(mechanism: Mechanism, meant: Mapping[str, Mapping[str, Any]]) -> Reader:
    """Puts what names stand for into a mechanism: a value at their address, or a mechanism in its place.

    Parameters
    ----------
    mechanism : Mechanism
    meant : mapping of str to mapping of str to value
        By address.
    """

    def read(names: Mapping[str, str]) -> Mechanism:
        unknown = next((address for address in names if address not in meant), None)
        if unknown is not None:
            sample = f"{{'{unknown}': {{'{names[unknown]}': ...}}}}"
            raise InputError(
                f"'{unknown}' = '{names[unknown]}' of a mechanism without a case file", "what it stands for", sample
            )
        values = {address: meant[address][name] for address, name in names.items()}
        found = next((value for value in values.values() if isinstance(value, Mechanism)), mechanism)
        for address, value in values.items():
            found = found if isinstance(value, Mechanism) else changed(found, address, value)
        return found

    return read
