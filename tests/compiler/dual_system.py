"""Right-hand side of a mechanism in dual numbers, and its comparison with the package's right-hand side and step matrix."""

from __future__ import annotations

import ctypes
import math
from functools import cache
from types import SimpleNamespace
from typing import Annotated, Any, get_origin, get_type_hints

import numpy as np
from benchmarks import bits

import scissordyn as sd
from scissordyn.compiler.c import load_source
from scissordyn.compiler.unit import Unit
from scissordyn.components.recipes import catalogue_recipes
from scissordyn.kernel import Entry
from scissordyn.mechanics import functions
from scissordyn.mechanics.system import LAW_KERNELS
from scissordyn.plan.plan import plan
from scissordyn.plugin.element import RECIPES
from scissordyn.run.trajectory import make_driver

POINTERS = (("model", ("force_kernel", "gap_kernel", "switch_kernel")), ("parameters", ("law", "controller")))
"""Fields with kernel pointers, by the part of a system that has them."""

DERIVATIVES = 8  # Number of derivatives that one call of the right-hand side computes


def number_type(derivatives: int) -> Any:
    """Return the C type of a dual number."""
    return type("Dual", (ctypes.Structure,), {"_fields_": [("numbers", ctypes.c_double * (derivatives + 1))]})


@cache
def library_of(flags: tuple[str, ...]) -> tuple[ctypes.CDLL, Any]:
    """Return the library of the kernels of all elements of the catalogues, and its right-hand side."""
    unit, entry = Unit(derivatives=DERIVATIVES), Entry(functions.rate.python)
    unit.entry(entry)
    for recipe in catalogue_recipes():
        unit.kernel(recipe)
    compiled = load_source(unit.text(), *flags)
    return compiled, getattr(compiled, entry.symbol)


class DualSystem:
    """Right-hand side of a mechanism, compiled with derivatives.

    Parameters
    ----------
    content : System
        System of the package.
    *flags : str
        Flags of the C compiler.
    """

    def __init__(self, content: Any, *flags: str) -> None:
        pointers = {int(pointer) for owner, names in POINTERS for name in names for pointer in _integers(content, owner, name)}
        compiled, self.rate = library_of(flags)
        number, pointer, whole = number_type(DERIVATIVES), ctypes.c_void_p, ctypes.c_int64
        self.rate.argtypes, self.rate.restype = [number, pointer, whole, whole, pointer, whole], None
        self.number = number
        self.pointers = {
            pointer: ctypes.cast(getattr(compiled, RECIPES[pointer].symbol), ctypes.c_void_p).value
            for pointer in pointers
            if pointer
        }

    def jacobian(self, t: float, y: np.ndarray, content: Any) -> tuple[np.ndarray, np.ndarray]:
        """Return the right-hand side and its derivatives by the state."""
        self.kept: list[np.ndarray] = []
        content.work.instant[0] = math.nan
        memory = np.array(self._words(content, type(content)), np.int64)
        jacobian, slope = np.zeros((y.size, y.size)), np.zeros(y.size)
        for first in range(0, y.size, DERIVATIVES):
            state, out = with_derivatives(y), with_derivatives(slope)
            count = min(DERIVATIVES, y.size - first)
            for k in range(count):
                state[first + k, k] = 1.0
            time = self.number((ctypes.c_double * (DERIVATIVES + 1))(*[0.0] * DERIVATIVES, t))
            self.rate(time, state.ctypes.data, y.size, memory.ctypes.data, out.ctypes.data, y.size)
            jacobian[:, first : first + count] = out[:, :count]
        return out[:, -1], jacobian

    def _words(self, content: Any, described: Any) -> list[int]:
        """Return the memory of a named tuple with zero derivatives."""
        hints = get_type_hints(described, include_extras=True)
        words: list[int] = []
        for (name, hint), part in zip(hints.items(), content, strict=True):
            if get_origin(hint) is Annotated:
                array = self._numbers(name, part)
                self.kept.append(array)
                words += [array.ctypes.data, *part.shape, *([part.shape[1]] if part.ndim == 2 else [])]
            elif get_origin(hint) is tuple:
                words += [int(entry) for entry in part]
            elif isinstance(part, tuple):
                words += self._words(part, hint)
            else:
                words.append(int(part))
        return words

    def _numbers(self, name: str, part: np.ndarray) -> np.ndarray:
        if part.dtype.names:
            kinds = [(key, part.dtype[key], (DERIVATIVES + 1,) * (part.dtype[key].kind == "f")) for key in part.dtype.names]
            array = np.zeros(part.shape, kinds)
            for key in part.dtype.names:
                if part.dtype[key].kind == "f":
                    array[key][..., -1] = part[key]
                else:
                    array[key] = [self.pointers.get(int(word), word) for word in part[key]] if name == "law" else part[key]
            return array
        if part.dtype.kind == "f":
            return with_derivatives(part)
        changed = name.endswith("_kernel") or name == "controller"
        return np.array([self.pointers.get(int(word), word) for word in part], np.int64) if changed else part.copy()


def _integers(content: Any, owner: str, name: str) -> np.ndarray:
    array = getattr(getattr(content, owner), name)
    return np.array([array[kernel] for kernel in LAW_KERNELS] if array.dtype.names else array, np.int64).ravel()


def with_derivatives(array: np.ndarray) -> np.ndarray:
    """Return numbers with zero derivatives."""
    numbers = np.zeros((*array.shape, DERIVATIVES + 1))
    numbers[..., -1] = array
    return numbers


class TakenError(Exception):
    """Signal that carries the mechanism of a case instead of running it."""


def mechanism_of(case: str) -> sd.Mechanism:
    """Return the mechanism that a case of `benchmarks.bits` runs."""

    def take(mechanism: sd.Mechanism, *_: Any, **__: Any) -> None:
        raise TakenError(mechanism)

    names = {name: getattr(sd, name) for name in dir(sd)}
    kept, bits.sd = bits.sd, SimpleNamespace(**names | dict.fromkeys(("simulate", "simulate_many", "cycle"), take))
    try:
        bits.CASES[case]()
    except TakenError as taken:
        mechanism: sd.Mechanism = taken.args[0]
        return mechanism
    finally:
        bits.sd = kept
    raise ValueError(case)


def compare(mechanism: sd.Mechanism, states: int, *flags: str) -> tuple[int, bool, float]:
    """Return the size of the state, whether the right-hand side is the package's bit for bit, and the step matrix's error."""
    driver, _, _ = make_driver(plan(mechanism), sd.Options(until=0.1))
    content, random, same, worst = driver.system.content, np.random.default_rng(1), True, 0.0
    start, size, contacts = np.array(driver.state.y), driver.state.y.size, content.parameters.contact.size
    n = content.model.n
    dual = DualSystem(content, *flags)
    for state in range(states):
        y, t = start.copy(), 0.0 if state == 0 else float(random.uniform(0.0, 0.1))
        if state:
            y[:n] += 1e-4 * random.normal(size=n)
            y[n : 2 * n] += 1e-1 * random.normal(size=n)
            y[2 * n :] += 1e-6 * random.normal(size=size - 2 * n)
            functions.accept(t, y, driver.system.address, np.zeros(3))
            if np.all(content.model.elastic_state < 0):  # the step matrix is not for hard contact
                content.state.mode[:contacts] = random.integers(0, 2, contacts)
            content.state.memory[:contacts] = 0.5
        slope, by_time = np.zeros(size), np.zeros(size)
        content.work.instant[0] = math.nan
        functions.linearise(t, y, driver.system.address, slope, by_time)
        values, jacobian = dual.jacobian(t, y, content)
        same = same and np.array_equal(values, slope, equal_nan=True)
        for step in (1e-6, 1e-4, 1e-2):
            if functions.factorize(step, driver.system.address) != -1:
                continue
            right = random.normal(size=size)
            solved = right.copy()
            functions.solve(solved, driver.system.address)
            missing = solved / step - jacobian @ solved - right
            scale = np.abs(solved) / step + np.abs(jacobian) @ np.abs(solved) + np.abs(right)
            worst = max(worst, float(np.max(np.abs(missing) / scale, initial=0.0)))
    return size, same, worst
