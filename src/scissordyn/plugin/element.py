"""What makes a class an element: its slot, its kernels with named arguments, its states and facts, said once."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cache
from types import MappingProxyType
from typing import Any, TypeVar, dataclass_transform

import numba
import numpy as np

from scissordyn.errors import InputError, did_you_mean
from scissordyn.plugin.address import ANSWER, Kernel, address_of, arguments_of
from scissordyn.units import State, check_quantities, quantities

__all__ = ["PARAMETERS", "Element", "Slot", "addresses", "element", "is_ours", "numbers", "row_of"]

PARAMETERS = 16
"""Width of one row of numbers, a law's or a controller's, in the parameter tables that kernels read."""

ABSENT = "-0.0"
"""What a kernel is handed for a state that a part does not have: it changes no sum."""


@dataclass(frozen=True, eq=False)
class Slot:
    """Where elements of one kind act.

    Parameters
    ----------
    name : str
        What the slot is called in a case file.
    inputs : tuple of str
        What a kernel may name, in the order of their row.
    kernels : mapping of str to (int, str)
        The kernels that an element may have, the one it acts through first: how many of the inputs each may name, and its
        results: "force", one number and the rates of the states; "states"; or "number".
    facts : mapping of str to value
        What else an element declares, with the defaults.
    context : tuple of str
        What a kernel may name beside, in the order of their row.
    """

    name: str
    inputs: tuple[str, ...]
    kernels: Mapping[str, tuple[int, str]]
    facts: Mapping[str, Any] = field(default_factory=dict)
    context: tuple[str, ...] = ()


SLOTS: dict[str, Slot] = {}
"""Slots by name."""


@dataclass(frozen=True, eq=False)
class Element:
    """What the package knows of a class of elements.

    Parameters
    ----------
    slot : Slot
    kernels : mapping of str to callable
    states : tuple of State
    numbers : tuple of str
        Names of the parameters, in the order of their row.
    leading : tuple of str
        Inputs in the order of a plain function of the user's, which has its constants after them; empty for kernels that name
        what they use.
    """

    slot: Slot
    kernels: Mapping[str, Kernel]
    states: tuple[State, ...] = ()
    numbers: tuple[str, ...] = ()
    leading: tuple[str, ...] = ()


Class = TypeVar("Class", bound=type)


@dataclass_transform(frozen_default=True)
def element(
    *, slot: Slot | str, name: str = "", source: str = "the user", states: tuple[State, ...] = (), **declared: Any
) -> Callable[[Class], Class]:
    """Make a class a contact law, a friction law or a controller: a frozen dataclass whose numbers its kernels name.

    Parameters
    ----------
    slot : Slot or str
        What it is: "stiffness", "damping", "friction" or "controller".
    name : str, optional
        By default the name of the class in lower case with hyphens.
    source : str
        A citation.
    states : tuple of State
        Internal states, each an argument of the kernels; without a `start` kernel they start at zero.
    **declared
        Kernels and facts of the slot. A kernel gets by name what it names: inputs of the slot, states and the numbers of the
        class, which are its fields with a `Quantity`, or, where the class has a method `parameters`, what that returns, named
        by the last arguments of the first kernel.

    Returns
    -------
    decorator

    Raises
    ------
    InputError
        If there is no such slot, kernel or fact, or a kernel names something else.
    """
    if isinstance(slot, str) and slot not in SLOTS:
        raise InputError(f"slot = {slot!r}{did_you_mean(slot, SLOTS)}", ", ".join(SLOTS))
    chosen = SLOTS[slot] if isinstance(slot, str) else slot
    for key in declared:
        known = (*chosen.kernels, *chosen.facts)
        if key not in known:
            raise InputError(f"{key} of a {chosen.name} element{did_you_mean(key, known)}", ", ".join(known))

    def declare(described: Class) -> Class:
        if not hasattr(described, "__post_init__"):
            described.__post_init__ = check_quantities  # type: ignore[attr-defined]
        made: Any = dataclass(frozen=True)(described)
        kernels = {key: declared[key] for key in chosen.kernels if declared.get(key) is not None}
        main = kernels.get(next(iter(chosen.kernels)))
        given = {*chosen.inputs, *chosen.context, *(state.name for state in states)}
        if hasattr(made, "parameters"):
            named = () if main is None else tuple(each for each in arguments_of(main) if each not in given)
        else:
            named = tuple(quantities(made))
            made.parameters = _own_parameters
        facts = {**chosen.facts, **{key: declared[key] for key in chosen.facts if key in declared}}
        spelled = re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "-", made.__name__).lower()
        for key, value in {"name": name or spelled, "source": source, "states": states, **facts}.items():
            if key not in vars(made) and key not in made.__dataclass_fields__:
                setattr(made, key, value)
        made.declaration = Element(chosen, MappingProxyType(kernels), states, named)
        _check(made)
        return made  # type: ignore[no-any-return]

    return declare


def numbers(part: Any, **derived: float) -> tuple[float, ...]:
    """The numbers that the kernels of an element read, in order: those derived, and otherwise its fields."""
    return tuple(float(derived[name] if name in derived else getattr(part, name)) for name in part.declaration.numbers)


def _own_parameters(self: Any, *_: Any) -> tuple[float, ...]:
    return numbers(self)


def _check(made: Any) -> None:
    declared: Element = made.declaration
    what = f"{declared.slot.name} element '{made.__name__}'"
    if len(declared.numbers) > PARAMETERS:
        raise InputError(f"{what} with {len(declared.numbers)} parameters", f"at most {PARAMETERS}")
    for state in declared.states:
        if not isinstance(state, State) or (state.scale is None and "start" not in declared.kernels):
            called = getattr(state, "name", state)
            raise InputError(
                f"{what}: state {called!r} has no unit or no scale of its errors",
                "State(NAME, UNIT, scale=SIZE)",
                f'states=(sd.State("{called}", "m", scale=1e-6),)',
            )
    for key, kernel in declared.kernels.items():
        places = _places(declared, key, tuple(state.name for state in declared.states))
        for argument in arguments_of(kernel):
            if argument not in places:
                raise InputError(
                    f"{what}: its kernel '{key}' names '{argument}'{did_you_mean(argument, places)}", ", ".join(places)
                )


def _places(declared: Element, key: str, present: tuple[str, ...]) -> dict[str, str]:
    """Where a kernel finds what it may name, for a part with some of the declared states."""
    count, results = declared.slot.kernels[key]
    places = {name: f"q[{k}]" for k, name in enumerate(declared.slot.inputs[:count])}
    places |= {name: f"x[{k}]" for k, name in enumerate(declared.slot.context)}
    if results == "force":
        places |= {
            state.name: f"z[{present.index(state.name)}]" if state.name in present else ABSENT for state in declared.states
        }
    return places | {name: f"p[{k}]" for k, name in enumerate(declared.numbers)}


def _targets(declared: Element, key: str, present: tuple[str, ...]) -> tuple[str, ...]:
    """Where the results of a kernel go."""
    kind = declared.slot.kernels[key][1]
    written = tuple(
        f"out[{present.index(state.name)}]" if state.name in present else "_" for state in declared.states if kind != "number"
    )
    return written if kind == "states" else (ANSWER, *written)


def addresses(part: Any) -> Mapping[str, int]:
    """Addresses of the kernels of an element, by name; 0 for one that it does not have.

    Parameters
    ----------
    part : element
        Or a class of elements.

    Raises
    ------
    InputError
        If a kernel cannot be compiled.
    """
    states = part.states if isinstance(part.states, tuple) else part.declaration.states
    return _addresses(part.declaration, tuple(state.name for state in states))


@cache
def _addresses(declared: Element, present: tuple[str, ...]) -> Mapping[str, int]:
    found = dict.fromkeys(declared.slot.kernels, 0)
    for key, kernel in declared.kernels.items():
        places = _places(declared, key, present)
        names = (*declared.leading, *declared.numbers) if declared.leading else arguments_of(kernel)
        targets = _targets(declared, key, present)
        try:
            found[key] = address_of(kernel, tuple(places[name] for name in names), targets, guarded=bool(declared.leading))
        except numba.core.errors.NumbaError as error:
            if declared.leading:
                raise
            cause = next((line.strip() for line in str(error).splitlines() if line.strip()), type(error).__name__)
            raise InputError(
                f"kernel '{kernel.__name__}' of a {declared.slot.name} element cannot be compiled: {cause}",
                f"numbers, math and numpy functions of numbers; {len(targets)} numbers as the result",
            ) from None
    return MappingProxyType(found)


def row_of(part: Any, *joint: Any) -> np.ndarray:
    """The numbers of an element as its kernels read them, shape (PARAMETERS,).

    Parameters
    ----------
    part : element
    *joint
        The surfaces, for a law.
    """
    numbers, row = part.parameters(*joint), np.zeros(PARAMETERS)
    if len(numbers) != len(part.declaration.numbers):
        raise InputError(
            f"{part.declaration.slot.name} element '{part.name}' with {len(numbers)} parameters",
            f"{len(part.declaration.numbers)}: {', '.join(part.declaration.numbers)}",
        )
    row[: len(numbers)] = numbers
    return row


def is_ours(part: Any) -> bool:
    """Whether an element is the package's own, and not a user's."""
    return type(part).__module__.startswith("scissordyn.") and not part.declaration.leading
