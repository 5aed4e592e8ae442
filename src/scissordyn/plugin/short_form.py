"""A user's plain Python function in place of an element: ``f(inputs..., constants...)`` to one number."""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable, Iterable
from functools import cache
from types import MappingProxyType
from typing import Any, ClassVar

import numpy as np

from scissordyn.compiler.kind import TranslationError
from scissordyn.errors import InputError
from scissordyn.kernel import F1, F2, call_at, entry
from scissordyn.plugin.element import PARAMETERS, Element, Slot, addresses
from scissordyn.plugin.user_file import load_function, pinned

Function = Callable[..., float]


@cache
def _declared(slot: Slot, function: Function, count: int, leading: tuple[str, ...]) -> Element:
    names = tuple(f"constant_{k + 1}" for k in range(count))
    return Element(slot, MappingProxyType({next(iter(slot.kernels)): function}), numbers=names, leading=leading)


class ShortForm:
    """What the elements have in common that are one function with constants; each has the base of its slot."""

    function: Function | str
    constants: tuple[float, ...]
    digest: str
    slot: ClassVar[Slot]
    name: ClassVar[str] = "user"
    source: ClassVar[str] = "the user"

    def __post_init__(self) -> None:
        object.__setattr__(self, "digest", pinned(self.slot.title, self.function, self.digest))

    @property
    def leading(self) -> tuple[str, ...]:
        """Names of the arguments before the constants."""
        return self.slot.inputs

    @property
    def loaded(self) -> tuple[Function, str]:
        """The function itself, and what an error message calls it."""
        function = self.function
        loaded = load_function(self.slot.title, function, self.digest) if isinstance(function, str) else function
        if not callable(loaded):
            raise InputError(f"{function!r} as a {self.slot.title}", "a function or 'file.py:function'")
        return loaded, f"{self.slot.title} '{getattr(loaded, '__name__', loaded)}'"

    @property
    def declaration(self) -> Element:  # type: ignore[override, unused-ignore]
        """What the package knows of the function.

        Raises
        ------
        InputError
            If it cannot be called like this or cannot be compiled.
        """
        function, label = self.loaded
        constants, leading = self.constants, self.leading
        if len(constants) > PARAMETERS - 1 or not all(math.isfinite(value) for value in constants):
            raise InputError(f"{label}: constants = {constants!r}", f"at most {PARAMETERS - 1} finite numbers")
        try:
            inspect.signature(function).bind(*leading, *constants)
        except TypeError as error:
            wanted = ", ".join((*leading, *(f"constant_{k + 1}" for k in range(len(constants)))))
            raise InputError(f"{label} cannot be called: {error}", f"a function of ({wanted})") from None
        order = tuple("time" if name == "t" else name for name in leading)
        return _declared(self.slot, function, len(constants), order)

    def parameters(self, *_: Any) -> tuple[float, ...]:
        """The constants."""
        return tuple(float(value) for value in self.constants)

    def probe(
        self,
        points: Iterable[tuple[float, ...]],
        right: Callable[[tuple[float, ...], float], bool] | None = None,
        allowed: str = "a finite number there",
    ) -> np.ndarray:
        """Try the compiled function.

        Parameters
        ----------
        points : iterable of tuple of float
            Leading arguments.
        right : callable, optional
            Whether the finite answer at a point can be right.
        allowed : str
            What it may be, for the message.

        Returns
        -------
        ndarray, shape (points,)
            The answers.

        Raises
        ------
        InputError
            If it cannot be compiled, or at the first point where it is not a finite number or not right; says what the plain
            function does there.
        """
        function, label = self.loaded
        grid = np.array(list(points), float)
        results = answers(
            self._address(), grid, np.array([*self.constants, 0.0]), context=len(self.leading) - len(self.slot.inputs)
        )
        for point, value in zip(grid.tolist(), results.tolist(), strict=True):
            if not math.isfinite(value) or (right is not None and not right(tuple(point), value)):
                what = _answer(function, (*point, *self.constants))
                where = ", ".join(f"{name} = {number:g}" for name, number in zip(self.leading, point, strict=True))
                raise InputError(f"{label} {what} at {where}", allowed)
        return results

    def _address(self) -> int:
        (function, label), _ = self.loaded, self.declaration  # which says what is wrong with the constants
        try:
            return next(iter(addresses(self).values()))
        except TranslationError as error:
            # most often the function simply does not give a number
            answer = _answer(function, (*(1e-3 for _ in self.leading), *self.constants))
            number = "float64" in answer or answer.removeprefix("gives ").startswith(tuple("-0123456789"))
            cause = error.what if number else f"it {answer}"
            raise InputError(f"{label} cannot be compiled: {cause}", "numbers, math and numpy functions of numbers") from None


def answers(address: int, points: np.ndarray, numbers: np.ndarray, *, context: int = 0) -> np.ndarray:
    """What a kernel without states gives at some points: in each row so many numbers of its context, then its inputs."""
    results = np.empty(len(points))
    _answers(address, context, points, numbers, results)
    return results


@entry
def _answers(address: int, context: int, points: F2, numbers: F1, found: F1) -> None:
    for k in range(found.size):
        found[k] = call_at(address, points[k, context:], (), (), points[k, :context], numbers, ())


def _answer(function: Function, arguments: tuple[float, ...]) -> str:
    """What the function does without the compiler, in words."""
    try:
        return f"gives {function(*arguments)!r}"
    except Exception as error:
        return f"raises {type(error).__name__} ({error})"
