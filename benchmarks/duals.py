"""Derivatives by dual numbers beside what the package has: the whole Jacobian by the step matrix, kernels by differences.

``python -m benchmarks.duals --write`` writes the page; ``--quick`` takes a few cases and kernels.
"""

from __future__ import annotations

import ctypes
import math
from collections.abc import Callable
from types import SimpleNamespace
from typing import Annotated, Any, get_origin, get_type_hints

import numpy as np

import scissordyn as sd
from benchmarks import bits
from benchmarks.measure import command, interleaved, paragraph, table
from scissordyn.compiler.c import loaded
from scissordyn.compiler.unit import Unit
from scissordyn.kernel import F1, Entry, call_at
from scissordyn.mechanics import functions
from scissordyn.mechanics.system import LAW_KERNELS
from scissordyn.plan.plan import plan
from scissordyn.plugin.element import RECIPES
from scissordyn.run.trajectory import make_driver

POINTERS = (("model", ("force_kernel", "gap_kernel", "switch_kernel")), ("parameters", ("law", "controller")))
"""Arrays of kernel pointers, by the part of a system that has them."""

DERIVATIVES = 8  # In one call of the right-hand side


def number_type(derivatives: int) -> Any:
    """A dual number as C hands it."""
    return type("Dual", (ctypes.Structure,), {"_fields_": [("numbers", ctypes.c_double * (derivatives + 1))]})


class DualSystem:
    """The right-hand side of a mechanism, translated with derivatives.

    Parameters
    ----------
    content : System
        As the package has it.
    *flags : str
        For the C compiler.
    """

    def __init__(self, content: Any, *flags: str) -> None:
        unit, entry = Unit(derivatives=DERIVATIVES), Entry(functions.rate.python)
        unit.entry(entry)
        pointers = {int(pointer) for owner, names in POINTERS for name in names for pointer in _integers(content, owner, name)}
        recipes = {pointer: RECIPES[pointer] for pointer in pointers if pointer}
        for recipe in recipes.values():
            unit.kernel(recipe)
        compiled = loaded(unit.text(), *flags)
        self.rate = getattr(compiled, entry.symbol)
        number, pointer, whole = number_type(DERIVATIVES), ctypes.c_void_p, ctypes.c_int64
        self.rate.argtypes, self.rate.restype = [number, pointer, whole, whole, pointer, whole], None
        self.number = number
        self.pointers = {
            pointer: ctypes.cast(getattr(compiled, recipe.symbol), ctypes.c_void_p).value for pointer, recipe in recipes.items()
        }

    def jacobian(self, t: float, y: np.ndarray, content: Any) -> tuple[np.ndarray, np.ndarray]:
        """The right-hand side and its derivatives by the state."""
        self.kept: list[np.ndarray] = []
        content.work.instant[0] = math.nan
        memory = np.array(self._words(content, type(content)), np.int64)
        jacobian, slope = np.zeros((y.size, y.size)), np.zeros(y.size)
        for first in range(0, y.size, DERIVATIVES):
            state, out = with_derivatives(y), with_derivatives(slope)
            count = min(DERIVATIVES, y.size - first)
            for k in range(count):
                state[first + k, 1 + k] = 1.0
            time = self.number((ctypes.c_double * (DERIVATIVES + 1))(t))
            self.rate(time, state.ctypes.data, y.size, memory.ctypes.data, out.ctypes.data, y.size)
            jacobian[:, first : first + count] = out[:, 1 : 1 + count]
        return out[:, 0], jacobian

    def _words(self, content: Any, described: Any) -> list[int]:
        """A named tuple in memory, with zero derivatives."""
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
                    array[key][..., 0] = part[key]
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
    """Numbers with derivatives that are zero."""
    numbers = np.zeros((*array.shape, DERIVATIVES + 1))
    numbers[..., 0] = array
    return numbers


class TakenError(Exception):
    """The mechanism of a case, in the place of its run."""


def mechanism_of(case: str) -> sd.Mechanism:
    """The mechanism that a case of `benchmarks.bits` runs."""

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
    """Size of the state, whether the right-hand side is bit for bit that of the package, largest error of the step matrix."""
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


def differences(address: int, turns: int, t: float, q: F1, v: F1, z: F1, x: F1, p: F1, up: F1, down: F1) -> float:
    """All derivatives of a kernel, and once more, by central differences as in the mechanics."""
    total = 0.0
    for _ in range(turns):
        for k in range(q.size + v.size + z.size):
            place = k if k < q.size else k - q.size if k < q.size + v.size else k - q.size - v.size
            argument = q if k < q.size else v if k < q.size + v.size else z
            here = argument[place]
            h = 1e-6 * abs(here) + 1e-9
            argument[place] = here + h
            high = call_at(address, q, v, z, x, p, up)
            argument[place] = here - h
            low = call_at(address, q, v, z, x, p, down)
            argument[place] = here
            total += (high - low + up[0] - down[0]) / (2.0 * h)
    return total + t


def duals(address: int, turns: int, t: float, q: F1, v: F1, z: F1, x: F1, p: F1, up: F1, down: F1) -> float:
    """The same by dual numbers."""
    total = t
    for _ in range(turns):
        total += call_at(address, q, v, z, x, p, up) + up[0]
    return total


def loops(pointer: int, row: np.ndarray, turns: int) -> dict[str, Callable[[], None]]:
    """One call for each of the two ways."""
    recipe = RECIPES[pointer]
    counts = [1 + max((int(text[2:-1]) for text in recipe.handed if text[0] == name), default=-1) for name in "qvz"]
    random, candidates = np.random.default_rng(1), {}
    # slips of millimetres per second, bristles of micrometres
    inputs = [random.uniform(0.1, 1.0, count) * size for count, size in zip(counts, (1e-3, 1e-3, 1e-6), strict=True)]
    for name, function, size in (("differences", differences, 0), ("duals", duals, 2 * ((sum(counts) + 1) // 2))):
        unit, entry = Unit(derivatives=size), Entry(function)
        unit.entry(entry)
        unit.kernel(recipe)
        compiled = loaded(unit.text())
        address = ctypes.cast(getattr(compiled, recipe.symbol), ctypes.c_void_p).value
        arrays = [np.zeros((*part.shape, size + 1)) for part in (*inputs, np.zeros(24), row, np.zeros(24), np.zeros(24))]
        for array, part in zip(arrays, (*inputs, np.zeros(24), row), strict=False):
            array[..., 0] = part
        for k, place in enumerate((a, b) for a in range(3) for b in range(counts[a])):
            if size:
                arrays[place[0]][place[1], 1 + k] = 1.0
        run, number = getattr(compiled, entry.symbol), number_type(size)
        run.argtypes = [ctypes.c_int64] * 2 + [number] + [ctypes.c_void_p, ctypes.c_int64] * 7
        run.restype = number
        words = [word for array in arrays for word in (array.ctypes.data, array.shape[0])]
        candidates[name] = lambda run=run, address=address, number=number, words=words, kept=(arrays, compiled): (
            run(address, turns, number(), *words) and None
        )
    return candidates


def kernels_of(content: Any) -> dict[int, np.ndarray]:
    """The force and torque kernels of a system, with the numbers that they read."""
    p, found = content.parameters, {}
    for name, rows in (("stiffness", p.elastic), ("damping", p.damping), ("friction", p.friction)):
        found |= {int(pointer): row for pointer, row in zip(p.law[name], rows, strict=True)}
    for pointers, rows in ((content.model.force_kernel, p.component), (p.controller, p.control)):
        found |= {int(pointer): row for pointer, row in zip(pointers, rows, strict=True)}
    return {pointer: np.array(row) for pointer, row in found.items() if pointer in RECIPES}


TURNS = 20_000
SHORT = ("random ideal joints", "example paper", "pid", "components")


def measure(quick: bool) -> str:
    """Errors of step matrices of all cases, and times of kernels by both ways."""
    errors, times, seen = [], [], set()
    for case in SHORT if quick else bits.CASES:
        mechanism = mechanism_of(case)
        size, same, error = compare(mechanism, 4, "-O0")
        errors.append([case, str(size), "same" if same else "OTHER", f"{error:.1e}"])
        content = make_driver(plan(mechanism), sd.Options(until=0.1))[0].system.content
        for pointer, row in kernels_of(content).items():
            symbol = RECIPES[pointer].symbol
            if symbol in seen:
                continue
            seen.add(symbol)
            name = f"{RECIPES[pointer].function.__module__.removeprefix('scissordyn.')} {symbol[-4:]}"
            apart, dual = (found.least / TURNS * 1e9 for found in interleaved(loops(pointer, row, TURNS), 5).values())
            times.append([name, f"{apart:.0f}", f"{dual:.0f}", f"{dual / apart:.2f}"])
    ratios = [float(row[3]) for row in times]
    middle = math.exp(float(np.mean(np.log(ratios))))
    return "\n".join(
        (
            paragraph(
                "The right-hand side of each case in dual numbers at four states (the start, and three random ones on the",
                "constraints with contacts open and closed): whether its values are those of the library bit for bit, and the",
                "largest |(W - (1/hg - J)) k|, relative to the terms that it is the sum of, of the step matrix W at hg = 1e-6,",
                "1e-4 and 1e-2 s, with J by duals.",
            ),
            "\n" + table(("case", "states", "values", "step matrix"), errors),
            paragraph(
                "All derivatives of a force or torque by inputs, rates and states, by central differences and by one call in",
                f"dual numbers, least of five interleaved loops [ns]; geometric mean of the ratios {middle:.2f}.",
            ),
            "\n" + table(("kernel", "differences", "duals", "ratio"), times),
        )
    )


if __name__ == "__main__":
    command("duals", measure)
