"""What makes a class a component: its port, its kernels, what they return, and what they are compiled to."""

from __future__ import annotations

import dataclasses
import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from types import MappingProxyType
from typing import Any, ClassVar, Protocol, TypeVar, dataclass_transform, runtime_checkable

import numpy as np

from scissordyn.compiler.recipe import Recipe
from scissordyn.components.place import GROUND
from scissordyn.components.port import PORTS, TRAVEL, Output, Port
from scissordyn.errors import InputError, did_you_mean
from scissordyn.plugin.element import Kernel as Kernel
from scissordyn.plugin.element import arguments_of, check_names, pointer_of
from scissordyn.plugin.user_file import note_origin
from scissordyn.units import State, check_quantities, documented, quantities

PARAMETERS = 64  # Most parameters of a component, the numbers of its table included

CONTEXT = ("time", "factor", "mode", "approach_speed", "factor_rate", "differences", "reaction", "effective_mass")
"""What a kernel may ask for beside coordinates, rates and states: the time [s], the component's time function, the mode of its
guard (1 after a rise, 0 after a fall), the rate of the guard's value at the last rise, that of the time function [1/s], and
whether differences of its forces are taken (1, else 0), for which outputs beyond them are not read, the reaction [N] of the
ideal joint whose friction it is, in which its forces are linear, and the effective mass [kg] or moment of inertia [kg m^2]
along the gap at the last rise."""

ENERGY = ("energy", "dissipation")
"""What the kernel of a passive component returns after its forces: stored energy [J] and dissipated power [W]."""

TEXTBOOK = "García de Jalón and Bayo 1994, Kinematic and Dynamic Simulation of Multibody Systems, doi:10.1007/978-1-4612-2600-0"

POINT = 'a point, as "BODY.POINT" or "ground.POINT"'
MEANINGS: Mapping[str, str] = {
    "name": "name, unique among its kind",
    **dict.fromkeys(("start", "end", "point", "sensor", "sensor_origin"), POINT),
    "body": "the body that it acts on",
    "base": "the body that it acts against",
    "controller": "scissordyn controllers lists them",
    "time_function": "a factor over time, 1 without it",
}
"""What fields mean that several components have, unless an annotation says more."""

SUPPLY = ("supply",)  # What follows them where a component is supplied: the power [W] that its time function gives it


@dataclass(frozen=True)
class Declaration:
    """What the package knows of a component class; mechanics, datasets, case files and pictures go by it."""

    # Name of its dimension in a run, with which the names of its variables begin; of the package's own also the name of the
    # table in a case file
    section: str
    label: str  # What messages call it
    port: Port
    # Of what it names of coordinates, rates, states, context and numbers to the port's forces, then for a passive component
    # energy and dissipation, then the outputs, then the rates of the states. An argument named `table` gets all numbers as an
    # array. None for a constraint
    force: Kernel | None
    gap: Kernel | None  # To the value of a guard, 0 where the mode changes, and its rate over time
    switch: Kernel | None  # To the energy [J] that is dissipated when the mode changes
    outputs: tuple[Output, ...]  # Beyond those of the port
    states: tuple[State, ...]  # Internal states, which start at zero, each with its unit and the scale of its errors
    context: tuple[str, ...]  # From `CONTEXT`
    passive: bool  # Whether it stores and dissipates energy; otherwise all its power counts as the work of a load
    symbol: str  # How pictures draw it; one of the port's symbols
    example: Mapping[str, Any]  # What a case file may say for its keys
    events: tuple[str, str]  # What a fall and a rise of its guard are called
    # Whether its power counts as that of a motor, whose rotor turns with the body of a hinge: a field `inertia` [kg m^2]
    motor: bool = False
    # Whether it is passive but for its time function, which changes the stored energy at a given position: the kernel then
    # returns this power [W] after the dissipated one, and it counts as the work of a load
    supplied: bool = False
    numbers: tuple[str, ...] = ()  # Names of what `parameters` of a component gives, but for tables

    @property
    def places(self) -> dict[str, str]:
        """Where a kernel has what it may name."""
        states = tuple(state.name for state in self.states)
        rows = {"q": self.port.coordinates, "v": self.port.rates, "z": states, "p": self.numbers}
        places = {name: f"{row}[{k}]" for row, names in rows.items() for k, name in enumerate(names)}
        return places | {name: f"x[{CONTEXT.index(name)}]" for name in self.context} | {"table": "p"}

    @property
    def kernels(self) -> Mapping[str, Kernel]:
        named = {"force": self.force, "gap": self.gap, "switch": self.switch}
        return {name: kernel for name, kernel in named.items() if kernel is not None}

    @property
    def results(self) -> tuple[str, ...]:
        """Names of what the force kernel returns."""
        return (
            *self.port.forces,
            *self.accounts,
            *(output.name for output in self.outputs),
            *(f"{s.name}_rate" for s in self.states),
        )

    @property
    def accounts(self) -> tuple[str, ...]:
        """Names of the energy and the powers that follow the forces."""
        return (*(ENERGY if self.passive else ()), *(SUPPLY if self.supplied else ()))

    @property
    def reported(self) -> tuple[Output, ...]:
        """All outputs, each where it stands among the results."""
        first = len(self.port.forces)
        energy = (Output("energy", "J", "stored energy", first),) if self.passive else ()
        first += len(self.accounts)
        outputs = tuple(dataclasses.replace(output, first=first + k) for k, output in enumerate(self.outputs))
        return (*self.port.outputs, *energy, *outputs)

    @property
    def outputs_monitored(self) -> tuple[Output, ...]:
        """Those whose largest values are looked for within the steps."""
        return tuple(output for output in self.reported if output.monitored)


@runtime_checkable
class Component(Protocol):
    """An instance of a class that `component` has declared."""

    declaration: ClassVar[Declaration]

    @property
    def name(self) -> str:
        """Name, unique among the components of a mechanism."""

    @property
    def states(self) -> tuple[State, ...]:
        """Its internal states."""

    def parameters(self, start: tuple[float, ...]) -> tuple[float, ...]:
        """The numbers that its kernels read; `start` are the coordinates of its port as placed."""


Class = TypeVar("Class", bound=type)


def _own_parameters(self: Any, start: tuple[float, ...]) -> tuple[float, ...]:
    """All numbers with a declared quantity, in order."""
    return tuple(float(getattr(self, name)) for name in quantities(self.__class__))


def _own_check(self: Any) -> None:
    check_quantities(self, f"{self.declaration.label} '{self.name}'")
    _check_attachment(self)
    if hasattr(self, "check"):
        self.check()


def _check_attachment(described: Any) -> None:
    """Raise `InputError` for a component between a body and itself, or on the ground alone."""
    port, label = described.declaration.port, f"{described.declaration.label} '{described.name}'"
    ends = [getattr(described, field)[0] for field in port.points] + [getattr(described, field) for field in port.turning]
    if len(ends) == 2 and ends[0] == ends[1]:
        raise InputError(f"{label} acts between body '{ends[0]}' and itself", "two different bodies")
    if len(ends) == 1 and ends[0] == GROUND:
        raise InputError(f"{label} acts on the ground", "a point of a body")


@dataclass_transform(frozen_default=True)
def component(
    *,
    port: Port | str,
    force: Kernel | None = None,
    gap: Kernel | None = None,
    switch: Kernel | None = None,
    section: str = "",
    label: str = "",
    outputs: tuple[Output, ...] = (),
    states: tuple[State, ...] = (),
    context: tuple[str, ...] = (),
    passive: bool = True,
    symbol: str = "",
    example: Mapping[str, Any] = MappingProxyType({}),
    events: tuple[str, str] = ("left", "reached"),
    motor: bool = False,
    supplied: bool = False,
    source: str = "",
) -> Callable[[Class], Class]:
    """Make a class a component: a frozen dataclass whose annotated numbers its kernels name.

    A method `check(self)` raises `InputError` for numbers that do not fit each other, a method `parameters(self, start)` gives
    the numbers in place of the fields, by the names that the first kernel has beside coordinates, rates, states and context.

    Parameters
    ----------
    port : str
        "line", "hinge", "travel", "point" or "frame".
    force, gap, switch : function, optional
        Kernels; each gets by name what it names, `force` returns what `Declaration` says, `gap` the value of a guard and its
        rate, `switch` the energy [J] that is dissipated when the mode changes.
    section, label : str, optional
        Of its table and variables, and in messages; from the name of the class if not given.
    outputs : tuple of Output
    states : tuple of State
        Internal states, which start at zero.
    context : tuple of str
        What the kernels name of `CONTEXT`: time, factor, mode, approach_speed, effective_mass and so on.
    passive : bool
        Whether it stores and dissipates energy; else its power is the work of a load.
    symbol : str, optional
        How pictures draw it, one of the port's symbols.
    example : mapping
        What a case file may say for its keys.
    events : (str, str)
        Names of a fall and of a rise of its guard.
    motor, supplied : bool
        Whether its power is that of a motor, with a field `inertia`; whether its time function gives it power.
    source : str
        Who describes it, several apart by semicolons.

    Returns
    -------
    decorator
    """
    if isinstance(port, str) and port not in PORTS:
        raise InputError(f"port = {port!r}{did_you_mean(port, PORTS)}", ", ".join(PORTS))
    chosen = PORTS[port] if isinstance(port, str) else port

    def declare(described: Class) -> Class:
        own = section or re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", described.__name__).lower()
        what, drawn = label or own.replace("_", " "), symbol or next(iter(chosen.symbols))
        declaration = Declaration(
            own, what, chosen, force, gap, switch, outputs, states, context, passive, drawn, example, events, motor, supplied
        )
        return _declared(described, declaration, source)

    return declare


def _declared(described: Class, declaration: Declaration, source: str) -> Class:
    """The component class with a declaration."""
    if "__post_init__" not in vars(described):
        described.__post_init__ = _own_check  # type: ignore[attr-defined]
    cls: Any = dataclass(frozen=True)(described)
    if not hasattr(cls, "parameters"):
        cls.parameters = _own_parameters
    cls.declaration = declaration
    if not hasattr(cls, "states"):  # of the class, unless its instances decide
        cls.states = declaration.states
    _check_fields(cls)
    cls.declaration = dataclasses.replace(declaration, numbers=_numbers_of(cls))
    for key, kernel in declaration.kernels.items():
        check_names(f"component '{cls.__name__}'", key, kernel, cls.declaration.places)
    if "\n    Parameters\n" not in (cls.__doc__ or "") and (source or cls.__module__.startswith("scissordyn.")):
        documented(cls, MEANINGS, source)
    note_origin(cls, described)
    return cls


def _check_fields(described: Any) -> None:
    declaration, names = described.declaration, [field.name for field in dataclasses.fields(described)]
    port = declaration.port
    needed = ("name", *port.points, *port.turning, *port.numbers, *(("inertia",) if declaration.motor and port.turning else ()))
    missing = [name for name in needed if name not in names]
    if missing:
        raise InputError(
            f"component '{described.__name__}' with the port '{port.name}' has no field '{missing[0]}'",
            "the fields " + ", ".join(needed),
        )
    if not declaration.section.isidentifier():
        raise InputError(f"component '{described.__name__}': section = {declaration.section!r}", "letters, digits, underscores")
    symbols = declaration.port.symbols
    if declaration.symbol not in symbols:
        raise InputError(
            f"component '{described.__name__}': symbol = {declaration.symbol!r}{did_you_mean(declaration.symbol, symbols)}",
            ", ".join(symbols),
        )
    if declaration.port is TRAVEL and declaration.symbol == "stop" and "limit" not in names:
        raise InputError(f"component '{described.__name__}', drawn as a stop, has no field 'limit'", "where the stop is [m]")
    for state in declaration.states:
        if not isinstance(state, State) or state.scale is None:
            named = getattr(state, "name", state)
            raise InputError(
                f"component '{described.__name__}': state {named!r} has no unit or no scale of its errors",
                "State(NAME, UNIT, scale=SIZE)",
                f'states=(sd.State("{named}", "m", scale=1e-3),)',
            )
    unknown = [name for name in declaration.context if name not in CONTEXT]
    if unknown:
        raise InputError(f"context {unknown[0]!r}{did_you_mean(unknown[0], CONTEXT)}", ", ".join(CONTEXT))


def _numbers_of(described: Any) -> tuple[str, ...]:
    """What the kernels of a component class name beside coordinates, rates, states and context."""
    if described.parameters is _own_parameters:
        return tuple(quantities(described))
    kernel = next(iter(described.declaration.kernels.values()), None)  # of a class that says itself what its kernels read
    places = described.declaration.places
    return () if kernel is None else tuple(name for name in arguments_of(kernel) if name not in places)


@cache
def kernels_of(described: type[Component]) -> dict[str, int]:
    """Pointers to the compiled kernels of a component class: force, gap and switch, 0 for one that it does not have."""
    return dict.fromkeys(("force", "gap", "switch"), 0) | {
        key: pointer_of(recipe) for key, recipe in recipes_of(described).items()
    }


def recipes_of(described: type[Component]) -> dict[str, Recipe]:
    """What the kernels of a component class are made into, by their names."""
    declaration = described.declaration
    places, counts, recipes = declaration.places, {"force": len(declaration.results), "gap": 2, "switch": 1}, {}
    for key, kernel in declaration.kernels.items():
        handed = tuple(places[name] for name in arguments_of(kernel))
        recipes[key] = Recipe(kernel, handed, tuple(f"out[{k}]" for k in range(counts[key])))
    return recipes


def at_rest(component: Component, start: tuple[float, ...], at: tuple[float, ...] | None = None) -> tuple[float, ...]:
    """What the force kernel of a component gives at rest, in plain Python."""
    declaration = component.declaration
    if declaration.force is None:
        return ()
    arguments, names = arguments_of(declaration.force), declaration.numbers
    values: dict[str, Any] = dict.fromkeys(declaration.places, 0.0) | {"factor": 1.0}
    values |= zip(declaration.port.coordinates, start if at is None else at, strict=True)
    try:
        numbers = component.parameters(start)
        if not len(names) <= len(numbers) <= (len(numbers) if "table" in arguments else len(names)):
            raise TypeError(f"{len(numbers)} numbers for {', '.join(names)}")
        values |= {**dict(zip(names, numbers, strict=False)), "table": np.array(numbers)}
        result = declaration.force(*map(values.__getitem__, arguments))
    except Exception as error:
        raise InputError(
            f"{declaration.label} '{component.name}': its kernel raises {type(error).__name__} ({error}) where it starts",
            f"{len(declaration.results)} numbers: {', '.join(declaration.results)}",
        ) from None
    results = result if isinstance(result, tuple) else (result,)
    if len(results) != len(declaration.results) or not all(math.isfinite(number) for number in results):
        raise InputError(
            f"{declaration.label} '{component.name}': its kernel gives {result!r} where it starts",
            f"{len(declaration.results)} finite numbers: {', '.join(declaration.results)}",
        )
    return results
