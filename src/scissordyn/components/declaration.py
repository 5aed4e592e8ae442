"""Make a class a component: its port, its kernels, their results, and the compiled functions."""

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
from scissordyn.laws.evaluate import friction_states
from scissordyn.plugin.element import Kernel as Kernel
from scissordyn.plugin.element import arguments_of, check_names, pointer_of, pointers, row_of
from scissordyn.plugin.user_file import note_origin
from scissordyn.units import State, check_quantities, documented, quantities

COMPONENT_PARAMETERS_MAX = 64  # Largest number of parameters of a component's kernel, including entries of its table

CONTEXT = (
    *("time", "factor", "mode", "approach_speed", "factor_rate", "differences", "reaction", "effective_mass"),
    *("normal", "tangential"),
)
"""Arguments that a kernel may have in addition to coordinates, rates and states.

time [s]; factor: the component's time function; mode: that of its guard (1 after a rise, 0 after a fall); approach_speed: rate
of the guard's value at the last rise; factor_rate: rate of the time function [1/s]; differences: 1 while forces are differenced
(outputs are not read then), else 0; reaction [N]: that of the ideal joint, in which friction is linear; effective_mass [kg] or
moment of inertia [kg m^2] along the gap at the last rise; normal and tangential [N]: the forces by the laws of a contact.
"""

CONTACT_OUTPUTS = (
    Output("normal", "N", "normal force"),
    Output("friction", "N", "friction force, of the sign of the slip speed"),
    Output("indentation", "m", "depth by which the surfaces overlap, 0 without contact", monitored=True),
)
"""Outputs of a contact with laws, which follow its energies."""

LAW_KINDS = ("stiffness", "damping", "friction")  # Parameters of a contact component whose values are laws

ENERGY = ("energy", "dissipation")
"""Names of the results of a passive component's kernel after its forces: stored energy [J] and dissipated power [W]."""

# Source of components that follow from the equations of motion alone, such as springs and rods
TEXTBOOK = "García de Jalón and Bayo 1994, Kinematic and Dynamic Simulation of Multibody Systems, doi:10.1007/978-1-4612-2600-0"

POINT = 'a point, as "BODY.POINT" or "ground.POINT"'  # Help text of component parameters that name a point
MEANINGS: Mapping[str, str] = {
    "name": "name, unique among its kind",
    **dict.fromkeys(("start", "end", "point", "sensor", "sensor_origin"), POINT),
    "body": "the body that it acts on",
    "base": "the body that it acts against",
    "controller": "scissordyn controllers lists them",
    "time_function": "a factor over time, 1 without it",
}
"""Help texts of parameters that several components have, by name; an annotation of a component has priority."""

SUPPLY = ("supply",)
"""Name of the result of a powered component's kernel after `ENERGY`: the power supplied to the component [W]."""


@dataclass(frozen=True)
class Declaration:
    """Declaration of a component class, used by mechanics, datasets, case files and pictures."""

    # Name of the component's dimension in a run, and prefix of its variables. For components of the package, also the name of
    # their table in a case file
    section: str
    label: str  # Name in messages
    port: Port
    # Kernel of the forces. Its arguments are coordinates, rates, states, context and parameters; `table` gets all parameters as
    # an array. Its results are the port's forces, energy and dissipation (if passive), outputs, and rates of the states. None
    # for a constraint
    force: Kernel | None
    gap: Kernel | None  # Kernel of the guard's value, 0 where the mode changes, and its rate
    switch: Kernel | None  # Kernel of the energy [J] dissipated when the mode changes
    outputs: tuple[Output, ...]  # Outputs in addition to those of the port
    states: tuple[State, ...]  # Internal states, which start at zero, with units and error scales
    context: tuple[str, ...]  # Names from `CONTEXT`
    passive: bool  # True if it stores and dissipates energy; otherwise all its power is the work of a load
    symbol: str  # Symbol in pictures; one of the port's symbols
    example: Mapping[str, Any]  # Example values of its keys in a case file
    events: tuple[str, str]  # Names of a fall and a rise of its guard
    # True if its power is that of a motor, whose rotor turns with the body of a hinge; requires a field `inertia` [kg m^2]
    motor: bool = False
    # True if it is passive except for a power that it is given, as by a time function or the flow of a fluid. The kernel then
    # returns this power [W] after the dissipated power, and it counts as the work of a load
    supplied: bool = False
    # True for a contact whose fields stiffness, damping and friction are laws, for its property `surfaces`. `gap` then returns
    # indentation, its rate and the slip speed; `force` returns the port's forces for a normal and a tangential force
    contact: bool = False
    numbers: tuple[str, ...] = ()  # Names of the values of `parameters`, except tables

    @property
    def places(self) -> dict[str, str]:
        """Expression in C of each possible kernel argument: an entry of the arrays of `compiler.recipe.SIGNATURE`."""
        states = tuple(state.name for state in self.states)
        rows = {"q": self.port.coordinates, "v": self.port.rates, "z": states, "p": self.numbers}
        places = {name: f"{row}[{k}]" for row, names in rows.items() for k, name in enumerate(names)}
        return places | {name: f"x[{CONTEXT.index(name)}]" for name in self.context} | {"table": "p"}

    @property
    def kernels(self) -> Mapping[str, Kernel]:
        named = {"force": self.force, "gap": self.gap, "switch": self.switch}
        return {name: kernel for name, kernel in named.items() if kernel is not None}

    @property
    def returned(self) -> tuple[str, ...]:
        """Names of the values that the force kernel returns."""
        return self.port.forces if self.contact else self.results

    @property
    def results(self) -> tuple[str, ...]:
        """Names of the results of the force kernel, for a contact with those of its laws."""
        return (
            *self.port.forces,
            *self.accounts,
            *(output.name for output in self.outputs),
            *(f"{s.name}_rate" for s in self.states),
        )

    @property
    def accounts(self) -> tuple[str, ...]:
        """Names of the results that an element returns after its forces: stored energy and supplied power, if it has them."""
        return (*(ENERGY if self.passive else ()), *(SUPPLY if self.supplied else ()))

    @property
    def reported(self) -> tuple[Output, ...]:
        """All outputs with their positions among the results."""
        first = len(self.port.forces)
        energy = (Output("energy", "J", "stored energy", first),) if self.passive else ()
        first += len(self.accounts)
        outputs = tuple(dataclasses.replace(output, first=first + k) for k, output in enumerate(self.outputs))
        return (*self.port.outputs, *energy, *outputs)

    @property
    def outputs_monitored(self) -> tuple[Output, ...]:
        """Outputs whose largest values are located within steps."""
        return tuple(output for output in self.reported if output.monitored)


@runtime_checkable
class Component(Protocol):
    """Instance of a class that `component` has declared."""

    declaration: ClassVar[Declaration]

    @property
    def name(self) -> str:
        """Name, unique among the components of a mechanism."""

    @property
    def states(self) -> tuple[State, ...]:
        """Internal states."""

    def parameters(self, start: tuple[float, ...]) -> tuple[float, ...]:
        """Return the parameters of the kernels; `start` holds the initial coordinates of the port."""


Class = TypeVar("Class", bound=type)


def _own_parameters(self: Any, start: tuple[float, ...]) -> tuple[float, ...]:
    """Return all fields with a declared quantity, in order."""
    return tuple(float(getattr(self, name)) for name in quantities(self.__class__))


def _own_check(self: Any) -> None:
    check_quantities(self, f"{self.declaration.label} '{self.name}'")
    _check_attachment(self)
    if hasattr(self, "check"):
        self.check()


def _law_states(part: Any) -> tuple[State, ...]:
    """Return the states of a contact's friction, then of its damping; without a declared size that of sliding at 1 m/s."""
    sliding = np.zeros(len(part.friction.states))
    if sliding.size:
        friction_states(pointers(part.friction)["start"], 1.0, sliding, row_of(part.friction, part.surfaces))
    sized = zip(part.friction.states, np.abs(sliding).tolist(), strict=True)
    rubbing = (dataclasses.replace(s, scale=size if s.scale is None else s.size(part.friction)) for s, size in sized)
    return *rubbing, *(dataclasses.replace(s, scale=s.size(part.damping)) for s in part.damping.states)


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
    contact: bool = False,
    source: str = "",
) -> Callable[[Class], Class]:
    """Make a class a component: a frozen dataclass whose annotated fields are parameters of its kernels.

    A method `check(self)` may raise `InputError` for inconsistent fields. A method `parameters(self, start)` may replace the
    fields. Its values are named by the first kernel's arguments that are not coordinates, rates, states or context.

    Parameters
    ----------
    port : str
        "line", "hinge", "travel", "point" or "frame".
    force, gap, switch : function, optional
        Kernels with arguments passed by name. `force` returns the results in `Declaration`, `gap` the value of a guard and
        its rate, `switch` the energy [J] that is dissipated when the mode changes.
    section, label : str, optional
        Name of its table and variables, and name in messages; by default from the class name.
    outputs : tuple of Output
    states : tuple of State
        Internal states, which start at zero.
    context : tuple of str
        Names from `CONTEXT` that the kernels have as arguments: time, factor, mode, approach_speed, effective_mass and so on.
    passive : bool
        True if it stores and dissipates energy; otherwise its power is the work of a load.
    symbol : str, optional
        Symbol in pictures, one of the port's symbols.
    example : mapping
        Example values of its keys in a case file.
    events : (str, str)
        Names of a fall and a rise of its guard.
    motor, supplied : bool
        True if its power is that of a motor (with a field `inertia`); True if a time function or a flow supplies power.
    contact : bool
        True if fields `stiffness`, `damping` and `friction` are laws, for the surfaces of its property `surfaces`. `gap` then
        returns indentation, its rate and the slip speed, and `force` the port's forces for the arguments `normal` and
        `tangential`.
    source : str
        Citations, separated by semicolons.
    """
    if isinstance(port, str) and port not in PORTS:
        raise InputError(f"unknown port = {port!r}{did_you_mean(port, PORTS)}", ", ".join(PORTS))
    chosen = PORTS[port] if isinstance(port, str) else port

    def declare(described: Class) -> Class:
        table_name = section or re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", described.__name__).lower()
        what, drawn = label or table_name.replace("_", " "), symbol or next(iter(chosen.symbols))
        reported = (*CONTACT_OUTPUTS, *outputs) if contact else outputs
        kernels, traits = (force, gap, switch), (motor, supplied, contact)
        declaration = Declaration(
            table_name, what, chosen, *kernels, reported, states, context, passive, drawn, example, events, *traits
        )
        return _declared(described, declaration, source)

    return declare


def _declared(described: Class, declaration: Declaration, source: str) -> Class:
    if "__post_init__" not in vars(described):
        described.__post_init__ = _own_check  # type: ignore[attr-defined]
    cls: Any = dataclass(frozen=True)(described)
    if not hasattr(cls, "parameters"):
        cls.parameters = _own_parameters
    cls.declaration = declaration
    if not hasattr(cls, "states"):  # of the class, unless its instances decide
        cls.states = property(_law_states) if declaration.contact else declaration.states
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
    needed += (*LAW_KINDS, "surfaces") if declaration.contact else ()
    missing = [name for name in needed if name not in names and not (name == "surfaces" and hasattr(described, name))]
    if missing:
        raise InputError(
            f"component '{described.__name__}' with the port '{port.name}' has no field '{missing[0]}'",
            "the fields " + ", ".join(needed),
        )
    if declaration.contact and declaration.gap is None:
        raise InputError(f"component '{described.__name__}' with laws has no kernel 'gap'", "indentation, its rate, slip speed")
    if not declaration.section.isidentifier():
        raise InputError(f"component '{described.__name__}': section = {declaration.section!r}", "letters, digits, underscores")
    symbols = declaration.port.symbols
    if declaration.symbol not in symbols:
        raise InputError(
            f"component '{described.__name__}': symbol = {declaration.symbol!r}{did_you_mean(declaration.symbol, symbols)}",
            ", ".join(symbols),
        )
    if declaration.port is TRAVEL and declaration.symbol == "stop" and "limit" not in names:
        raise InputError(
            f"component '{described.__name__}' with symbol = 'stop' has no field 'limit'",
            "a field 'limit', the position of the stop [m]",
        )
    for state in declaration.states:
        if not isinstance(state, State) or state.scale is None:
            named = getattr(state, "name", state)
            raise InputError(
                f"component '{described.__name__}': state {named!r} has no unit or no error scale",
                "State(NAME, UNIT, scale=SIZE)",
                f'states=(sd.State("{named}", "m", scale=1e-3),)',
            )
    unknown = [name for name in declaration.context if name not in CONTEXT]
    if unknown:
        raise InputError(f"unknown context {unknown[0]!r}{did_you_mean(unknown[0], CONTEXT)}", ", ".join(CONTEXT))


def _numbers_of(described: Any) -> tuple[str, ...]:
    """Return the kernel arguments of a component class that are parameters."""
    if described.parameters is _own_parameters:
        return tuple(quantities(described))
    kernel = next(iter(described.declaration.kernels.values()), None)  # of a class with its own method `parameters`
    places = described.declaration.places
    return () if kernel is None else tuple(name for name in arguments_of(kernel) if name not in places)


@cache
def kernels_of(described: type[Component]) -> dict[str, int]:
    """Return the pointers to the kernels force, gap and switch of a component class; 0 for a missing one."""
    return dict.fromkeys(("force", "gap", "switch"), 0) | {
        key: pointer_of(recipe) for key, recipe in recipes_of(described).items()
    }


def recipes_of(described: type[Component]) -> dict[str, Recipe]:
    """Return the recipes of a component class's kernels, by their names."""
    declaration = described.declaration
    places, gaps, recipes = declaration.places, 3 if declaration.contact else 2, {}
    counts = {"force": len(declaration.returned), "gap": gaps, "switch": 1}
    for key, kernel in declaration.kernels.items():
        handed = tuple(places[name] for name in arguments_of(kernel))
        recipes[key] = Recipe(kernel, handed, tuple(f"out[{k}]" for k in range(counts[key])))
    return recipes


def at_rest(component: Component, start: tuple[float, ...], at: tuple[float, ...] | None = None) -> tuple[float, ...]:
    """Return the results of a component's force kernel at rest, evaluated in Python."""
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
            f"{declaration.label} '{component.name}': its kernel raises {type(error).__name__} ({error}) at the start",
            f"{len(declaration.returned)} numbers: {', '.join(declaration.returned)}",
        ) from None
    results = result if isinstance(result, tuple) else (result,)
    if len(results) != len(declaration.returned) or not all(math.isfinite(number) for number in results):
        raise InputError(
            f"{declaration.label} '{component.name}': its kernel returns {result!r} at the start",
            f"{len(declaration.returned)} finite numbers: {', '.join(declaration.returned)}",
        )
    return results
