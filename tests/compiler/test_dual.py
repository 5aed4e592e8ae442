"""Dual numbers: kernels translated with derivatives, against the doubles of the library and against arithmetic of 40 digits."""

from __future__ import annotations

import ctypes
import dataclasses
import math
import types
from collections.abc import Callable, Iterator, Mapping
from functools import cache
from typing import Any, get_args, get_type_hints

import mpmath
import numpy as np
import pytest
from tests.compiler.dual_system import compare, mechanism_of
from tests.compiler.test_c import KERNELS, component_parts, component_row, law_parts

import scissordyn as sd
from scissordyn.compiler.c import load_source
from scissordyn.compiler.kind import DUAL, FLOAT, Array
from scissordyn.compiler.recipe import ANSWER, Recipe
from scissordyn.compiler.unit import Unit, python_of
from scissordyn.components.declaration import kernels_of
from scissordyn.kernel import call_at, derivative, equals, value_of
from scissordyn.plugin.element import RECIPES, arguments_of, pointers, row_of
from scissordyn.units import Quantity

DERIVATIVES = 16  # Number of derivatives of a dual number in these tests
TRIALS = 12  # Number of random arguments of each kernel

PRECISE = mpmath.MPContext()  # Arithmetic with 40 digits
PRECISE.dps = 40
STEP = PRECISE.mpf(10) ** -20  # Step of differences in arithmetic with 40 digits; both errors are about 1e-20


PARAMETERS = 4  # Index of the parameters among a kernel's arrays: inputs, rates, states, context, parameters


class Dual(ctypes.Structure):
    """Number with its derivatives, which a kernel returns."""

    _fields_ = (("numbers", ctypes.c_double * (DERIVATIVES + 1)),)


def library_of(recipes: list[Recipe]) -> Mapping[Recipe, Callable[..., Dual]]:
    """Return the kernels with derivatives."""
    unit = Unit(derivatives=DERIVATIVES)
    for recipe in recipes:
        unit.kernel(recipe)
    compiled, functions = load_source(unit.text(), "-O0"), {}
    for recipe in recipes:
        functions[recipe] = getattr(compiled, recipe.symbol)
        functions[recipe].restype, functions[recipe].argtypes = Dual, [ctypes.c_void_p] * 6
    return functions


@cache
def elements() -> Mapping[Recipe, Callable[..., Dual]]:
    """Return the kernels of all elements with derivatives."""
    return library_of([RECIPES[pointer] for _, pointer, _ in KERNELS])


def inputs_of(recipe: Recipe) -> list[tuple[int, int]]:
    """Return the places of the inputs, rates, states and context that a kernel reads."""
    return [("qvzx".index(text[0]), int(text[2:-1])) for text in recipe.handed if text[0] in "qvzx"]


def with_derivatives(kernel: Callable[..., Dual], inputs: np.ndarray, row: np.ndarray, places: list[tuple[int, int]]):
    """Return the results of a kernel, the returned number last, and their derivatives."""
    numbers, parameters = np.zeros((4, 24, DERIVATIVES + 1)), np.zeros((row.size, DERIVATIVES + 1))
    numbers[..., -1], parameters[:, -1] = inputs, row
    for k, (kind, place) in enumerate(places):
        (parameters if kind == PARAMETERS else numbers[kind])[place, k] = 1.0
    out = np.zeros((25, DERIVATIVES + 1))
    out[24] = kernel(*(array.ctypes.data for array in (*numbers, parameters, out))).numbers[:]
    return out[:, -1], out[:, : len(places)]


def precise_math() -> types.SimpleNamespace:
    """Return the functions of `math` with 40 digits."""
    names = {name: getattr(PRECISE, name, value) for name, value in vars(math).items() if callable(value)}
    names["copysign"] = lambda x, y: abs(x) if y >= 0 else -abs(x)
    names["floor"] = lambda x: int(PRECISE.floor(x))
    names["sqrt"] = lambda x: PRECISE.sqrt(x) if x >= 0 else PRECISE.nan  # as in C: no complex numbers
    names["log2"], names["pow"] = lambda x: PRECISE.log(x) / PRECISE.log(2), PRECISE.power
    constants = {name: value for name, value in vars(math).items() if not callable(value)}
    return types.SimpleNamespace(**names, **constants)


@cache
def precise(function: Any) -> Any:
    """Return a kernel in Python that calculates with 40 digits, also in the functions that it calls."""
    if isinstance(function, types.ModuleType):
        return precise_math() if function is math else function
    function = python_of(function)
    if not isinstance(function, types.FunctionType) or not function.__module__.startswith(("scissordyn.", __name__)):
        return function
    names = {name: function.__globals__[name] for name in function.__code__.co_names if name in function.__globals__}
    names = {
        name: precise(value) if callable(value) or isinstance(value, types.ModuleType) else value
        for name, value in names.items()
    }
    cells = tuple(
        types.CellType(precise(cell.cell_contents) if callable(cell.cell_contents) else cell.cell_contents)
        for cell in function.__closure__ or ()
    )
    return types.FunctionType(function.__code__, names, function.__name__, function.__defaults__, cells)


def precise_results(recipe: Recipe, inputs: Any, row: Any) -> np.ndarray:
    """Return the results of a kernel with 40 digits, the returned number last."""
    kernel = Recipe(precise(recipe.function), *recipe[1:3]).python()
    *numbers, parameters = [[PRECISE.mpf(number) for number in line] for line in (*inputs, row)]
    out = [PRECISE.mpf(0)] * 24
    answer = kernel(*numbers, np.array(parameters), out)
    return np.array([*out, answer if ANSWER in recipe.targets else PRECISE.mpf(0)])


def exact_slopes(recipe: Recipe, inputs: np.ndarray, row: np.ndarray, places: list[tuple[int, int]]) -> np.ndarray:
    """Return derivatives by differences with 40 digits, whose error is about 1e-20."""
    numbers = [[PRECISE.mpf(float(number)) for number in line] for line in (*inputs, row)]
    base, slopes = precise_results(recipe, numbers[:-1], numbers[-1]), np.zeros((25, len(places)))
    for k, (kind, place) in enumerate(places):
        number = numbers[kind][place]
        step = STEP * max(abs(number), 1e-9)
        numbers[kind][place] = number + step
        changed = precise_results(recipe, numbers[:-1], numbers[-1])
        numbers[kind][place] = number
        slopes[:, k] = [float((PRECISE.mpf(high) - low) / step) for high, low in zip(changed, base, strict=True)]
    return slopes


CANCELLING = ("gonthier-bristle force", "Cam force", "Cam gap")  # Kernels with a slope that is a difference of large numbers


@pytest.mark.parametrize(("name", "pointer", "row"), KERNELS, ids=[name for name, _, _ in KERNELS])
def test_the_derivatives_of_an_element_are_exact(name, pointer, row):
    """Cross-check: at random inputs, values bit for bit as in the library, derivatives as in 40 digits."""
    recipe, random = RECIPES[pointer], np.random.default_rng(1)
    places, worst, compared = inputs_of(recipe), 0.0, 0
    for _ in range(TRIALS):
        inputs = random.uniform(-1, 1, (4, 24)) * 10.0 ** random.uniform(-7, 1)
        inputs[0, 0] = abs(inputs[0, 0])
        compiled = np.zeros(25)
        compiled[24] = call_at(pointer, *inputs, row, compiled[:24])
        values, slopes = with_derivatives(elements()[recipe], inputs, row, places)
        assert np.array_equal(values, compiled, equal_nan=True)
        if not np.isfinite(values).all():
            continue
        compared += 1
        exact = exact_slopes(recipe, inputs, row, places)
        sizes = np.abs([inputs[place] for place in places])
        scale = np.abs(exact) + np.abs(values)[:, None] / np.maximum(sizes, 1e-300) + 1e-300
        worst = max(worst, float(np.max(np.abs(slopes - exact) / scale, initial=0.0)))
    assert compared > TRIALS // 3
    assert worst < (1e-11 if name in CANCELLING else 1e-12)


APART = ("GasSpring", "TapeSpring", "Cam")
"""Elements without derivatives by all parameters: some are counts, and a gas spring has another formula at exponent 1."""

# Kernels whose derivatives by parameters are compared
DIFFERENTIABLE_BY_PARAMETERS = [
    kernel for kernel in KERNELS if kernel[0].endswith(("force", "torque")) and not kernel[0].startswith(APART)
]


@pytest.mark.parametrize(
    ("name", "pointer", "row"), DIFFERENTIABLE_BY_PARAMETERS, ids=[name for name, _, _ in DIFFERENTIABLE_BY_PARAMETERS]
)
def test_the_derivatives_by_parameters_are_exact(name, pointer, row):
    """Cross-check: forces by up to 16 parameters as in 40 digits, also where a default value has a formula of its own."""
    recipe, random = RECIPES[pointer], np.random.default_rng(1)
    named = dict(zip(recipe.handed, arguments_of(recipe.function), strict=True))
    numbers = [k for k in range(min(row.size, DERIVATIVES)) if named.get(f"p[{k}]", "acts") != "acts"]  # `acts` is an index
    places = [(PARAMETERS, k) for k in numbers if row[k] != 0.0]
    places += [(PARAMETERS, k) for k in ZERO_PARAMETERS.get(name, ())]
    for _ in range(3):
        inputs = random.uniform(-1, 1, (4, 24)) * 10.0 ** random.uniform(-6, -1)
        inputs[0, 0] = abs(inputs[0, 0])
        values, slopes = with_derivatives(elements()[recipe], inputs, row, places)
        exact = exact_slopes(recipe, inputs, row, places)
        sizes = np.array([max(abs(row[place]), 1e-9) for _, place in places])
        scale = np.abs(exact) + np.abs(values)[:, None] / sizes + 1e-300
        assert np.isfinite(values).all()
        assert np.max(np.abs(slopes - exact) / scale, initial=0.0) < (1e-6 if name in CANCELLING else 1e-12)


ZERO_PARAMETERS = {"Beam force": (3,), "feed-forward torque": (6,)}
"""Indices of parameters that are zero in the compared kernels, by kernel; the kernel then skips a part of its formula."""


def zero_parameters() -> Iterator[tuple[str, str, Callable[[float], dict[str, tuple[int, np.ndarray]]]]]:
    """Name and parameter of each element that may be zero, and a function to the kernels and their parameters at a value."""
    for name, part, handed in law_parts():
        for field in fields_with_zero(part):

            def of_law(value: float, part: Any = part, field: str = field, handed: Any = handed) -> Any:
                there = dataclasses.replace(part, **{field: value})
                return {key: (address, row_of(there, *handed)) for key, address in pointers(there).items() if address}

            yield name, field, of_law
    for part in component_parts():
        for field in fields_with_zero(part):

            def of_component(value: float, part: Any = part, field: str = field) -> Any:
                there = dataclasses.replace(part, **{field: value})
                found, row = kernels_of(type(there)), component_row(there)
                return {key: (found[key], row) for key in ("force", "gap", "switch") if found[key]}

            yield type(part).__name__, field, of_component


def fields_with_zero(part: Any) -> Iterator[str]:
    """Names of the numbers of an element that may be zero, where zero does not mean something else."""
    for field in dataclasses.fields(part):
        hint = get_type_hints(type(part), include_extras=True)[field.name]
        declared = [each for each in get_args(hint) if isinstance(each, Quantity)]
        if isinstance(getattr(part, field.name), float) and declared and declared[0].admits(0.0) and not declared[0].zero:
            yield field.name


OTHERWISE = {
    ("feed-forward", "integral"): "another kernel without an integral",
    ("pid", "integral"): "another kernel without an integral",
    ("TapeSpring", "stiffness"): "refused",
    ("TapeSpring", "peak_moment"): "refused",
    ("TapeSpring", "peak_moment_equal"): "refused",
    ("Drag", "drag_coefficient"): "refused",
    ("Drag", "area"): "refused",
    ("Bushing", "damping_xy"): "refused",
    ("Beam", "temperature_difference"): "refused",
    ("Motor", "stall_torque"): "its size counts, which has a kink",
    ("Cam", "roller"): "changes more parameters than one dual number has derivatives",
}
"""Parameters without a derivative at zero, with the reason."""

SMALL = 1e-8  # Change of a parameter that is zero [its unit]


def acts(at: Callable[[float], dict[str, tuple[int, np.ndarray]]]) -> bool:
    """Return whether a parameter changes those of a kernel."""
    return any(not np.array_equal(row, at(SMALL)[key][1]) for key, (_, row) in at(0.0).items())


ZEROS = [each for each in zero_parameters() if each[:2] not in OTHERWISE and acts(each[2])]


@pytest.mark.parametrize(("name", "field", "at"), ZEROS, ids=[f"{name} {field}" for name, field, _ in ZEROS])
def test_the_derivative_at_zero_is_a_limit(name, field, at):
    """Identity: no kernel leaves out a part of its formula because a parameter is zero, though it has derivatives."""
    random, compared = np.random.default_rng(3), 0
    for (pointer, row), (other, near) in zip(at(0.0).values(), at(SMALL).values(), strict=True):
        recipe, changed = RECIPES[pointer], np.flatnonzero(near != row)
        assert other == pointer
        for _ in range(3 if changed.size else 0):
            inputs = random.uniform(-1, 1, (4, 24)) * 10.0 ** random.uniform(-4, 1)
            inputs[0, 0] = abs(inputs[0, 0])
            values, slopes = with_derivatives(elements()[recipe], inputs, row, [(PARAMETERS, int(k)) for k in changed])
            if not np.isfinite(values).all():
                continue
            change = precise_results(recipe, inputs, near) - precise_results(recipe, inputs, row)
            size = 1e-9 * float(np.max(np.abs(change)))
            assert slopes @ (near[changed] - row[changed]) == pytest.approx(change.astype(float), rel=1e-5, abs=size)
            compared += 1
    assert compared


def all_functions(x, y):
    """Return values of functions and operators that have derivatives by two numbers between 0 and 1."""
    a = math.sqrt(x) + math.cbrt(y) * math.cos(x) - math.sin(y) / math.tan(x + y)
    b = math.acos(x) + math.asin(y) * math.atan(x) + math.atan2(x, -y) + math.hypot(x, y)
    c = math.cosh(x) + math.sinh(y) * math.tanh(x) + math.acosh(1.0 + x) + math.asinh(y) + math.atanh(x * y)
    d = math.exp(x) + math.expm1(y) * math.log(x) + math.log2(y) + math.log10(x) + math.log1p(y)
    e = math.erf(x) * math.erfc(y) + math.copysign(x, -y) + math.degrees(x) + math.radians(y) + math.fabs(-x)
    f = x**y + math.pow(y, x) + x**3 + 2.0**x + y**0.5 + x**0 + abs(-x) + (3.7 + x) % (0.5 + y)
    g = min(x, y, 0.4) + max(x, 0.3, y) + int(10.0 * x) + math.floor(7.0 * y) + (y if x < y else x * y)
    pair = (0.0, 1.0) if x > y else (x, y)
    turned = 0.0
    for k in range(3):
        turned += pair[k % 2] * x
    x -= 1.0 - y
    return a, b, c, d, e, f, g, turned, -x / 3 - 2 * y + +x


# Kernel that calls every function for which dual numbers have a derivative
FUNCTIONS = Recipe(all_functions, ("q[0]", "q[1]"), tuple(f"out[{k}]" for k in range(9)))


def test_the_derivatives_of_functions_are_exact():
    """Cross-check: all functions and operators, numbers with and without derivatives in one variable."""
    kernel, random, places = library_of([FUNCTIONS])[FUNCTIONS], np.random.default_rng(2), [(0, 0), (0, 1)]
    for _ in range(TRIALS):
        inputs = np.zeros((4, 24))
        inputs[0, :2] = random.uniform(0.02, 0.98, 2)
        values, slopes = with_derivatives(kernel, inputs, np.zeros(1), places)
        assert values[:9] == pytest.approx(all_functions(*inputs[0, :2].tolist()), rel=4e-16)
        assert slopes == pytest.approx(exact_slopes(FUNCTIONS, inputs, np.zeros(1), places), rel=1e-13, abs=1e-13)


def bounded(x, y):
    """Return functions at places where slopes are infinite or jump."""
    return (
        math.sqrt(y) + x,
        math.hypot(y, y) * x,
        abs(y),
        y * math.log(x),
        np.clip(x, -0.5, 0.5),
        np.where(x > y, x, 1.0),
        7.0 // x,
    )


# Kernel with a minimum, a maximum and other functions with kinks
BOUNDED = Recipe(bounded, ("q[0]", "p[0]"), tuple(f"out[{k}]" for k in range(7)))


def test_what_does_not_change_has_no_derivative():
    """Identity: parts without derivatives at places without slopes."""
    inputs = np.zeros((4, 24))
    inputs[0, 0] = 2.0
    values, slopes = with_derivatives(library_of([BOUNDED])[BOUNDED], inputs, np.zeros(1), [(0, 0)])
    assert values[:7].tolist() == [2.0, 0.0, 0.0, 0.0, 0.5, 2.0, 3.0]
    assert slopes[:7, 0].tolist() == [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0]


def shortened(x, y):
    return (0.0 if equals(x, 0.0) else x * y), (1.0 if x == 0.0 else 2.0)


def test_a_zero_with_derivatives_does_not_vanish():
    """Contract: a product with a zero may be left out only where the zero does not change; comparisons are by value."""
    recipe = Recipe(shortened, ("q[0]", "p[0]"), ("out[0]", "out[1]"))
    values, slopes = with_derivatives(library_of([recipe])[recipe], np.zeros((4, 24)), np.full(1, 3.0), [(0, 0)])
    assert (values[:2].tolist(), slopes[:2, 0].tolist()) == ([0.0, 1.0], [3.0, 0.0])


def by_value(x, y):
    return value_of(x) * y, value_of(x * y), x - value_of(x), derivative(x * x, 0), derivative(2.0, 0), value_of(3.0)


def test_a_value_has_no_derivatives():
    """Identity: the value of a number is a constant, its derivatives are values."""
    recipe = Recipe(by_value, ("q[0]", "p[0]"), tuple(f"out[{k}]" for k in range(6)))
    inputs = np.zeros((4, 24))
    inputs[0, 0] = 5.0
    values, slopes = with_derivatives(library_of([recipe])[recipe], inputs, np.full(1, 3.0), [(0, 0)])
    assert (values[:6].tolist(), slopes[:6, 0].tolist()) == ([15.0, 15.0, 0.0, 10.0, 0.0, 3.0], [0.0, 0.0, 1.0, 0.0, 0.0, 0.0])


BOUNDS = {
    "random ideal joints": 1e-14,
    "rod": 1e-14,
    "laws persson lankarani-nikravesh threlfall": 1e-11,
    "laws hertz gonthier dahl": 1e-9,
    "example periodic": 1e-10,
    "example clearance_guide": 1e-9,
    "bushing": 1e-8,
    "pid": 1e-7,
    "components": 1e-6,
}
"""Largest relative error of the step matrix, by mechanism; some kernels have derivatives by central differences."""


@pytest.mark.parametrize("case", BOUNDS)
def test_the_step_matrix_is_the_jacobian_of_the_right_hand_side(case):
    """Cross-check: the right-hand side bit for bit, its derivatives by the state against W = 1/hg - J."""
    _, same, error = compare(mechanism_of(case), 4, "-O0")
    assert same
    assert error < BOUNDS[case]


def test_a_derivative_is_not_dropped():
    """Identity: a number with derivatives does not go where there is no place for them."""
    with pytest.raises(sd.InputError, match="cannot hold a number with derivatives"):
        Unit(derivatives=1).function(stored, (DUAL, Array(FLOAT, 1)))


def stored(x, out):
    out[0] = x
