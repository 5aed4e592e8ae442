"""Declare and find elements: contact laws, friction laws, components and controllers with compiled kernels.

A slot is a kind of element, such as "friction"; it defines the kernels of its elements and their arguments. Kernels are called
by pointers to machine code. Kernels of the package are in its library. A user-defined kernel is compiled at its first use, to
a library that stays loaded until the process ends.
"""

from __future__ import annotations

import ctypes
import importlib
import inspect
import math
import pkgutil
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from types import MappingProxyType, ModuleType
from typing import Annotated, Any, ClassVar, Protocol, TypeVar, cast, dataclass_transform, get_type_hints, overload

import numpy as np

from scissordyn.compiler.recipe import ANSWER, Recipe
from scissordyn.errors import InputError, did_you_mean
from scissordyn.kernel import CALLED, PYTHON, library
from scissordyn.plugin.user_file import class_in, note_origin
from scissordyn.units import Quantity, State, check_quantities, quantities

Kernel = Callable[..., Any]

RECIPES: dict[int, Recipe] = {}  # Kernel pointer -> Python function and memory layout from which the kernel was compiled


def check_names(what: str, key: str, kernel: Kernel, places: Mapping[str, str]) -> None:
    """Raise `InputError` if a kernel has an argument that is not in `places`, the arguments that its slot provides."""
    for argument in arguments_of(kernel):
        if argument not in places:
            raise InputError(
                f"{what}: its kernel '{key}' has the unknown argument '{argument}'{did_you_mean(argument, places)}",
                ", ".join(places),
            )


def arguments_of(kernel: Kernel) -> tuple[str, ...]:
    """Return the names of a kernel's arguments."""
    return tuple(inspect.signature(kernel).parameters)


@cache
def pointer_of(recipe: Recipe) -> int:
    """Return the pointer to the machine code of a kernel; compile a kernel that the library does not have."""
    if PYTHON:
        pointer = len(CALLED) + 1
        CALLED[pointer] = recipe.python()
    else:
        ours = str(recipe.function.__module__).startswith("scissordyn.")
        function = getattr(library(), recipe.symbol, None) if ours else None
        if function is None:
            function = _compiled(recipe)
        pointer = ctypes.cast(function, ctypes.c_void_p).value or 0
    RECIPES[pointer] = recipe
    return pointer


_LOADED: list[Any] = []
"""Compiled libraries and functions of user-defined elements, kept here so that kernel pointers, plain integers, stay valid."""

# Type of a kernel in C: a function of six arrays
_KERNEL_TYPE = ctypes.CFUNCTYPE(ctypes.c_double, *[ctypes.POINTER(ctypes.c_double)] * 6)


def _compiled(recipe: Recipe) -> Any:
    """Compile a user-defined function; a function without source text runs in Python, about a hundred times slower."""
    from scissordyn.compiler.c import load_source
    from scissordyn.compiler.kind import SourceError
    from scissordyn.compiler.unit import Unit

    unit = Unit()
    unit.kernel(recipe)
    try:
        text = unit.text()
    except SourceError:
        _LOADED.append(_KERNEL_TYPE(_in_python(recipe)))
        return _LOADED[-1]
    _LOADED.append(load_source(text))
    return getattr(_LOADED[-1], recipe.symbol)


def _in_python(recipe: Recipe) -> Callable[..., float]:
    """Return a Python function that compiled code can call by a pointer; it returns NaN after an exception."""
    called = recipe.python()

    def answer(*pointers: Any) -> float:
        try:
            return called(*pointers)
        except Exception:
            for target in recipe.targets:
                if target.startswith("out"):
                    pointers[5][int(target[4:-1])] = math.nan
            return math.nan

    return answer


ELEMENT_PARAMETERS_MAX = 16  # Largest number of parameters of an element: number of columns of the parameter tables
ABSENT_STATE = "-0.0"  # C text of the kernel argument for a state that an element lacks; adding -0.0 changes no sum


@dataclass(frozen=True, eq=False)
class Slot:
    """Kind of element, for example friction laws: its name, and the kernels and arguments that its elements may have."""

    name: str  # Name of the slot in a case file
    inputs: tuple[str, ...]  # Names of the arguments that vary with the motion, in the order of the array `q`
    # Kernels that an element may have, main kernel first. Each has the number of inputs that it may use, and its results:
    # "force" (a force and the rates of the states), "states" (one value per state) or "number"
    kernels: Mapping[str, tuple[int, str]]
    context: tuple[str, ...] = ()  # Names of further arguments, in the order of the array `x`
    defaults: Mapping[str, Any] = field(default_factory=dict)  # Default values of attributes that an element may set
    stateful: bool = False  # True if elements may have internal states
    title: str = ""  # Name of an element in messages


@dataclass(frozen=True, eq=False)
class Element:
    """Declaration of an element class: slot, kernels, internal states and parameters."""

    slot: Slot
    kernels: Mapping[str, Kernel]
    states: tuple[State, ...] = ()
    numbers: tuple[str, ...] = ()  # Names of the parameters, in the order of the array `p`


class Part:
    """Common base class of user-defined elements; each slot has a subclass of it, whose attributes an element may set."""

    slot: ClassVar[Slot]
    declaration: ClassVar[Any]
    name: ClassVar[str]
    source: ClassVar[str]
    kernels: ClassVar[Mapping[str, Kernel]] = {}
    """Kernels that all elements of a base share."""

    def parameters(self, *_: Any) -> tuple[float, ...]:
        """Return the values of the parameters that the kernels read, in the order of `Element.numbers`."""
        return numbers(self)


SLOTS: dict[str, type[Part]] = {}  # Base class of the elements of each slot, by the name of the slot

Class = TypeVar("Class")


class _Declare(Protocol):
    @overload
    def __call__(self, described: type[Class]) -> type[Class]: ...
    @overload
    def __call__(self, described: Kernel) -> Callable[..., Any]: ...


@dataclass_transform(frozen_default=True)
def element(
    *, slot: str = "", name: str = "", source: str = "the user", states: tuple[State, ...] = (), **declared: Any
) -> _Declare:
    """Declare a class or a function as a contact law, a friction law, a component or a controller.

    A class becomes a frozen dataclass, and its kernels refer to its fields by name. A function becomes such a class with the
    function as main kernel. Arguments that are not inputs, context or states of the slot become its fields with their defaults.

    Parameters
    ----------
    slot : str, optional
        Kind of element: "stiffness", "damping", "friction" or "controller"; not needed if the class inherits from the
        slot's base class.
    name : str, optional
        Name of the element; by default the class name in lower case with hyphens.
    source : str
        Citation.
    states : tuple of State
        Internal states, each an argument of the kernels; they start at zero unless there is a `start` kernel.
    **declared
        Kernels and attributes of the slot. The arguments of a kernel are inputs of the slot, states, and parameters.
        Parameters are the fields with a `Quantity`. If the class has a method `parameters`, they are its results, named by
        the last arguments of the first kernel.

    Raises
    ------
    InputError
        If the slot has no such kernel or attribute, the slot does not exist, or a kernel has an unknown argument.
    """

    def declare(described: Any) -> Any:
        bases = getattr(described, "__mro__", ())
        base: Any = next((base_class for base_class in bases if base_class in SLOTS.values()), SLOTS.get(slot))
        if base is None:
            raise InputError(f"unknown slot {slot!r} of an element{did_you_mean(slot, SLOTS)}", ", ".join(SLOTS))
        kinds, declarations = base.slot.kernels, {**getattr(described, "kernels", {}), **declared}
        taken = {*base.slot.inputs, *base.slot.context, *(getattr(state, "name", "") for state in states)}
        if inspect.isfunction(described):
            declarations = {next(iter(kinds)): described, **declared}
            described = _class_of(described, taken)
        if not issubclass(described, base):
            inherited = tuple(base_class for base_class in described.__bases__ if base_class is not object)
            content = {key: value for key, value in vars(described).items() if key not in ("__dict__", "__weakref__")}
            content["__qualname__"] = described.__qualname__
            described = type(described)(described.__name__, (*inherited, base), content)
        facts = {key: value for key, value in vars(base).items() if key in base.__annotations__ and key != "states"}
        facts |= base.slot.defaults
        for key in declarations:
            if key not in (*kinds, *facts):
                raise InputError(
                    f"unknown keyword '{key}' of a {base.slot.title}{did_you_mean(key, (*kinds, *facts))}",
                    ", ".join((*kinds, *facts)),
                )
        if not hasattr(described, "__post_init__"):
            described.__post_init__ = check_quantities
        cls: Any = dataclass(frozen=True)(described)
        kernels = {key: declarations[key] for key in kinds if declarations.get(key) is not None}
        main = kernels.get(next(iter(kinds)))
        named = tuple(quantities(cls))
        if cls.parameters is not Part.parameters:  # the class computes the kernel's parameters
            named = () if main is None else tuple(argument for argument in arguments_of(main) if argument not in taken)
        spelled = re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "-", cls.__name__).lower()
        chosen = {key: declarations[key] for key in facts if key in declarations}
        fields = cls.__dataclass_fields__
        chosen = {key: value for key, value in base.slot.defaults.items() if key not in fields} | chosen
        for key, value in {"name": name or spelled, "source": source, **chosen}.items():
            setattr(cls, key, value)
        if states and not isinstance(getattr(cls, "states", ()), property):
            cls.states = states
        cls.declaration = Element(base.slot, MappingProxyType(kernels), states, named)
        _check(cls)
        note_origin(cls, described)
        return cls

    return declare


def _class_of(function: Kernel, taken: set[str]) -> type:
    """Make a class from a function: its fields are the arguments that are not in `taken`, with their defaults."""
    content: dict[str, Any] = {key: getattr(function, key) or "" for key in ("__module__", "__qualname__", "__doc__")}
    hints = get_type_hints(function, include_extras=True)
    numbers = {key: argument for key, argument in inspect.signature(function).parameters.items() if key not in taken}
    content |= {key: number.default for key, number in numbers.items() if number.default is not number.empty}
    plain = Annotated[float, Quantity("1", help="a number in SI units")]
    content["__annotations__"] = {key: hints[key] if hasattr(hints.get(key), "__metadata__") else plain for key in numbers}
    return type(function.__name__, (), content)


def element_class(slot: str, reference: str, folder: Path) -> Any:
    """Execute a user's file and return the element class that ``"file.py:name"`` names."""
    base = SLOTS[slot]
    cls, name = class_in(base.slot.title, reference, folder)
    if cls is None or not (issubclass(cls, base) and "declaration" in vars(cls)):
        sample = f'@sd.element(slot="{slot}") above it'
        raise InputError(f"'{name}' is not a {base.slot.title}", "a class or a function decorated with sd.element", sample)
    return cls


def numbers(part: Any, **derived: float) -> tuple[float, ...]:
    """Return the parameters that an element's kernels read, in order: values from `derived`, the others from its fields."""
    return tuple(float(derived[name] if name in derived else getattr(part, name)) for name in part.declaration.numbers)


def _check(cls: Any) -> None:
    declared: Element = cls.declaration
    what = f"{declared.slot.title} '{cls.__name__}'"
    if len(declared.numbers) > ELEMENT_PARAMETERS_MAX:
        raise InputError(f"{what} has {len(declared.numbers)} parameters", f"at most {ELEMENT_PARAMETERS_MAX} parameters")
    if declared.states and not declared.slot.stateful:
        able = ", ".join(f'slot="{name}"' for name, base in SLOTS.items() if base.slot.stateful)
        raise InputError(f"{what} cannot have internal states", able)
    for state in declared.states:
        if not isinstance(state, State) or (state.scale is None and "start" not in declared.kernels):
            called = getattr(state, "name", state)
            raise InputError(
                f"{what}: state {called!r} has no unit or no error scale",
                "State(NAME, UNIT, scale=SIZE)",
                f'states=(sd.State("{called}", "m", scale=1e-6),)',
            )
    for key, kernel in declared.kernels.items():
        check_names(what, key, kernel, _places(declared, key, tuple(state.name for state in declared.states)))


def _places(declared: Element, key: str, present: tuple[str, ...]) -> dict[str, str]:
    """Return the generated expression, such as "q[0]", of each argument that a kernel may have, by its name.

    A declared state that is not in `present`, the states of the part, has the expression `ABSENT_STATE`.
    """
    count, results = declared.slot.kernels[key]
    places = {name: f"q[{k}]" for k, name in enumerate(declared.slot.inputs[:count])}
    places |= {name: f"x[{k}]" for k, name in enumerate(declared.slot.context)}
    if results == "force":
        places |= {
            state.name: f"z[{present.index(state.name)}]" if state.name in present else ABSENT_STATE
            for state in declared.states
        }
    return places | {name: f"p[{k}]" for k, name in enumerate(declared.numbers)}


def _targets(declared: Element, key: str, present: tuple[str, ...]) -> tuple[str, ...]:
    """Return the source text of each target of a kernel's results, such as "out[0]", for a part with the states `present`."""
    kind = declared.slot.kernels[key][1]
    written = tuple(
        f"out[{present.index(state.name)}]" if state.name in present else "_" for state in declared.states if kind != "number"
    )
    return written if kind == "states" else (ANSWER, *written)


def pointers(part: Any) -> Mapping[str, int]:
    """Return the pointers to an element's kernels by name; the pointer of a missing kernel is 0."""
    states = getattr(part, "states", ())
    if not isinstance(states, tuple):  # `states` is a property of instances
        states = part.declaration.states
    return _pointers(part.declaration, tuple(state.name for state in states))


def recipes(declared: Element, present: tuple[str, ...]) -> dict[str, Recipe]:
    """Return the recipes of an element's kernels by name, for a part with the states `present`."""
    table = {}
    for key, kernel in declared.kernels.items():
        places = _places(declared, key, present)
        table[key] = Recipe(kernel, tuple(places[name] for name in arguments_of(kernel)), _targets(declared, key, present))
    return table


@cache
def _pointers(declared: Element, present: tuple[str, ...]) -> Mapping[str, int]:
    pointers = {key: pointer_of(recipe) for key, recipe in recipes(declared, present).items()}
    return MappingProxyType(dict.fromkeys(declared.slot.kernels, 0) | pointers)


def row_of(part: Any, *joint: Any) -> np.ndarray:
    """Return the parameters of an element as a row of a parameter table, padded with zeros to ELEMENT_PARAMETERS_MAX."""
    numbers, row = part.parameters(*joint), np.zeros(ELEMENT_PARAMETERS_MAX)
    if len(numbers) != len(part.declaration.numbers):
        raise InputError(
            f"{part.declaration.slot.title} '{part.name}' has {len(numbers)} parameters",
            f"{len(part.declaration.numbers)}: {', '.join(part.declaration.numbers)}",
        )
    row[: len(numbers)] = numbers
    return row


def is_built_in(part: Any) -> bool:
    """Return True if an element belongs to the package, False if it is user-defined."""
    return type(part).__module__.startswith("scissordyn.")


def declared_in(module: ModuleType) -> list[type[Any]]:
    """Return the classes with a declaration that a module defines, in order."""
    classes = [thing for thing in vars(module).values() if isinstance(thing, type) and thing.__module__ == module.__name__]
    return [thing for thing in classes if "declaration" in vars(thing)]


def elements_in(*folders: ModuleType) -> Mapping[str, type[Any]]:
    """Return the element classes that the modules of some packages define, by element name."""
    elements: dict[str, type[Any]] = {}
    for folder in folders:
        for entry in pkgutil.iter_modules(folder.__path__):
            module = importlib.import_module(f"{folder.__name__}.{entry.name}")
            for thing in declared_in(module):
                name: str = vars(thing)["name"]
                if name in elements:
                    raise TypeError(f"two elements have the name '{name}': {elements[name].__module__} and {module.__name__}")
                elements[name] = thing
    return MappingProxyType(dict(sorted(elements.items())))


def element_named(slot: str, what: str, name: str, elements: Mapping[str, type[Any]]) -> type[Any]:
    """Return the element class of a name: one of `elements`, or one of a user's file ("file.py:NAME"), which is executed.

    `what` is the kind of element in the error message, for example "friction law".
    """
    if ".py:" in name:
        return cast(type[Any], element_class(slot, name, Path.cwd()))
    if name not in elements:
        raise InputError(f"unknown {what} '{name}'{did_you_mean(name, elements)}", ", ".join(elements) + ", or 'file.py:NAME'")
    return elements[name]
