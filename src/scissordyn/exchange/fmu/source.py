"""Generate the C source of an FMU, and the list of its variables."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from importlib.resources import files
from itertools import accumulate, count
from typing import Any

import numpy as np

from scissordyn.compiler.kind import FLOAT, INT, Array, Functions, Struct, Tuple, kind_of, written
from scissordyn.compiler.unit import Unit
from scissordyn.components.actuator import Actuator
from scissordyn.components.port.declaration import Port
from scissordyn.integrate import advance as loop
from scissordyn.integrate.integration import make_samples
from scissordyn.mechanics import functions, outputs
from scissordyn.mechanics.outputs import record
from scissordyn.mechanics.sample import Record
from scissordyn.mechanics.system import LAW_KERNELS, System
from scissordyn.mechanics.time_function import function_at
from scissordyn.plan.plan import Plan
from scissordyn.plan.system import make_system
from scissordyn.plugin.element import RECIPES
from scissordyn.run.advance.driver import Driver
from scissordyn.run.advance.system import MECHANICS

STATUSES = (
    *("ADVANCING", "FINISHED", "LOG_FULL", "STEP_TOO_SMALL", "NOT_FINITE", "STUCK", "HISTORY_FULL", "RECORD_FULL"),
    "CHANGE_POINT",
)
"""Names of the return values of `advance` in the loop of time steps; they are equal in Python and C."""

# Names of C files that are appended to the generated C code of an FMU
C_FILES = ("fmi3", "absent", "fmu_state", "model_exchange", "co_simulation")

KERNEL_ARRAYS = (("model", ("force_kernel", "gap_kernel", "switch_kernel")), ("parameters", ("law", "controller")))
"""Names of the arrays with kernel pointers, by the named tuple that contains them."""


@dataclass(frozen=True)
class Variable:
    """Variable of an FMU."""

    reference: int  # FMI value reference
    name: str
    unit: str = ""
    description: str = ""
    start: float | bool | None = None
    place: str = ""  # C expression for the address of an output
    factor: float = 1.0  # Value of the output divided by the number at its address


CONTACT_OUTPUTS = {
    "normal": ("N", "normal force"),
    "tangential": ("N", "friction force"),
    "depth": ("m", "indentation; the gap with a minus sign"),
    "slip": ("m/s", "slip speed of the surfaces"),
}
"""Outputs of an FMU for each contact: unit and description, by name."""

UNREPORTED = {
    "x": ("m", "x of the point"),
    "y": ("m", "y of the point"),
    "angle": ("rad", "angle of the body against its base"),
    "cosine": ("", "cosine of the angle of the body"),
    "sine": ("", "sine of the angle of the body"),
}
"""Unit and description of component coordinates that runs do not report, by name."""

VALUE_NAMES = {"rad": "angle", "m": "length"}  # Name of the quantity that a drive prescribes, by its SI unit


@dataclass(frozen=True)
class Prescribed:
    """Prescribed motion of an angle or length, which inputs of the FMU can replace."""

    name: str
    function: int  # Index of the time function
    start: tuple[float, float, float]  # Value, speed and acceleration at t = 0
    unit: str  # Unit of the value


@dataclass(frozen=True)
class Variables:
    """Variables of an FMU in the order of their value references, by group."""

    states: tuple[Variable, ...]
    rates: tuple[Variable, ...]
    guards: tuple[Variable, ...]
    flags: tuple[Variable, ...]
    inputs: tuple[Variable, ...]
    outputs: tuple[Variable, ...]


def prescribed_motions(plan: Plan, driver: Driver) -> tuple[Prescribed, ...]:
    """Return the motions that inputs can replace: of drives, references of actuators, driven coordinates and rods."""
    model, parameters = driver.system.content.model, driver.system.content.parameters
    motions = [(f"drives.{drive.body}", k, "rad") for k, drive in enumerate(plan.drives)]
    for i, component in enumerate(plan.acting):
        if isinstance(component, Actuator) and model.function[i] >= 0:
            motions.append((f"references.{component.name}", int(model.function[i]), "rad"))
    units = {drive.name: drive.coordinate.unit for drive in plan.mechanism.coordinate_drives}
    for k, function in zip(model.timed.tolist(), model.timed_function.tolist(), strict=True):
        name = plan.coordinates.constraints[k].name
        motions.append((f"{'drives' if name in units else 'rods'}.{name}", function, units.get(name, "m")))
    rows = []
    for name, function, unit in motions:
        value = np.zeros(4)
        start, stop = parameters.motion_start[function : function + 2].tolist()
        function_at(0.0, np.ascontiguousarray(parameters.motion[start:stop]), value)
        rows.append(Prescribed(name, function, (float(value[0]), float(value[1]), float(value[2])), unit))
    return tuple(rows)


def variables(plan: Plan, driver: Driver, record: Record) -> Variables:
    """Return the variables of the FMU of a mechanism."""
    references, motions = count(1), prescribed_motions(plan, driver)
    states = range(driver.state.y.size)
    guards = [getattr(contact, "name", str(k)) for k, contact in enumerate(plan.contacts)]
    guards += [f"component {k + 1}" for k in range(driver.state.mode.size - len(guards))]

    def group(rows: Iterable[tuple[Any, ...]]) -> tuple[Variable, ...]:
        return tuple(Variable(next(references), *row) for row in rows)

    return Variables(
        states=group((f"states.{k + 1}", "", "state of the equations") for k in states),
        rates=group((f"der(states.{k + 1})", "", "rate of the state") for k in states),
        guards=group((f"guards.{k + 1}", "", f"changes its sign at an event of {name}") for k, name in enumerate(guards)),
        flags=group((f"{motion.name}.external", "", "true if inputs prescribe the motion", False) for motion in motions),
        inputs=group(
            (f"{motion.name}.{order}", motion.unit + per, f"prescribed {order}", start)
            for motion in motions
            for order, per, start in zip(
                (VALUE_NAMES[motion.unit], "speed", "acceleration"), ("", "/s", "/s2"), motion.start, strict=True
            )
        ),
        outputs=group(_outputs(plan, record)),
    )


def _outputs(plan: Plan, record: Record) -> list[tuple[Any, ...]]:
    rows: list[tuple[Any, ...]] = []

    def add(name: str, unit: str, what: str, array: str, *at: int, factor: float = 1.0) -> None:
        shape = getattr(record, array.partition(".")[0]).shape[1:]
        index = int(np.ravel_multi_index(at, shape)) if shape else 0
        head, _, tail = array.partition(".")
        place = f"&m->record.{head}.p[{index}]" + (f".{tail}" if tail else "")
        rows.append((name, unit, what, None, place, factor))

    for b, body in enumerate(plan.bodies):
        for variable, prefix, unit in (("position", "", "m"), ("velocity", "velocity_", "m/s")):
            for axis, letter in enumerate("xy"):
                add(f"bodies.{body.name}.{prefix}{letter}", unit, f"{variable} of the mass centre", variable, b, axis)
        if body.rotates:
            add(f"bodies.{body.name}.angle", "rad", "angle", "angle", b)
            add(f"bodies.{body.name}.angular_velocity", "rad/s", "angular velocity", "angular_velocity", b)
    for d, drive in enumerate(plan.drives):
        add(f"drives.{drive.body}.torque", "N.m", "torque of the drive", "torque", d)
    coordinates = {part.name: part.terms[0][1] for part in plan.mechanism.coupling_parts}
    coupled = {part.name for part in plan.mechanism.couplings}
    for k, constraint in enumerate(plan.coordinates.constraints):
        if constraint.linear and constraint.name in coordinates:
            name, turns = constraint.name, coordinates[constraint.name].unit == "rad"
            label = f"{'couplings' if name in coupled else 'drives'}.{name}.{'torque' if turns else 'force'}"
            owner = "on the output of the coupling" if name in coupled else "of the drive"
            unit, what = ("N.m", f"torque {owner}") if turns else ("N", f"force {owner}")
            add(label, unit, what, "multiplier", k, factor=-1.0 / constraint.scale)
    for j, contact in enumerate(plan.contacts):
        for axis, letter in enumerate("xy"):
            add(f"joints.{contact.name}.force_{letter}", "N", "force on the journal", "wrench", j, axis)
        for name, (unit, what) in CONTACT_OUTPUTS.items():
            add(f"joints.{contact.name}.{name}", unit, what, f"contact.{name}", j)
    for i, component in enumerate(plan.acting):
        port = component.declaration.port
        for array, names in (("result", port.forces), ("coordinate", port.coordinates)):
            for k, name in enumerate(names):
                add(f"components.{component.name}.{name}", *_unit_and_meaning(port, name, array, k), array, i, k)
    return rows


def _unit_and_meaning(port: Port, name: str, array: str, index: int) -> tuple[str, str]:
    """Return unit and description of a result or coordinate of a port."""
    for output in port.outputs:
        if output.coordinate == (array == "coordinate") and 0 <= index - output.first < output.components:
            meaning = f"{name} {output.help}" if output.help.startswith("of ") else output.help
            return output.unit.replace(" ", "."), meaning
    return UNREPORTED.get(name, ("", "coordinate that the component acts along"))


class Source:
    """C source of the FMU of a mechanism, with the numbers of its start state."""

    def __init__(self, plan: Plan, driver: Driver, *, tolerance: float, token: str) -> None:
        system = driver.system.content
        self.delayed_signals = system.state.initial_history.size  # number of delayed signals that controllers use
        self.types: dict[Any, Any] = {}
        self.unit = Unit(self.types, table=True)
        driver.monitor(False)
        samples = make_samples(np.zeros(1), driver.state)
        samples.state[0] = driver.state.y
        for name in ("mode", "memory", "mass", "reference"):
            getattr(samples, name)[0] = getattr(driver.state, name)
        samples.total[:] = 0.0
        written_record = record(plan.maps, make_system(plan), samples)
        self.variables: Variables = variables(plan, driver, written_record)
        system = self._with_numbers(system)
        roots = {
            "system": system,
            "observer": _observer(system),
            "integration": driver.integration.content,
            "maps": plan.maps,
            "record": written_record,
            "samples": samples,
            "counted": np.zeros(system.model.rotation_start.size - 1),
        }
        block = _Block(roots, self.types)
        for root in roots.values():
            self.unit.use(kind_of(root, "", self.types))
        self._functions(roots)
        data = block.text()
        parts = (
            "/* Generated by scissordyn for one mechanism. */\n",
            INCLUDES,
            self.unit.text(),
            self._instance(plan, driver, tolerance, token),
            data,
            self._places(),
            *(files("scissordyn.exchange.fmu").joinpath(f"{name}.c").read_text(encoding="utf-8") for name in C_FILES),
        )
        self.text = "\n".join(parts)

    def _with_numbers(self, system: Any) -> Any:
        """Return the system with kernel indices instead of kernel addresses."""
        changed = {}
        for owner, names in KERNEL_ARRAYS:
            part = getattr(system, owner)
            arrays = {}
            for name in names:
                array = np.array(getattr(part, name))
                for field in LAW_KERNELS if array.dtype.names else (None,):
                    view = array if field is None else array[field]
                    view[...] = [self.unit.kernel(RECIPES[int(address)]) if address else 0 for address in view]
                arrays[name] = array
            changed[owner] = part._replace(**arrays)
        return system._replace(**changed)

    def _functions(self, roots: dict[str, Any]) -> None:
        """Translate to C the functions that the C files of the FMU call."""
        kinds = {name: kind_of(root, name, self.types) for name, root in roots.items()}
        system, vector = kinds["system"], Array(FLOAT, 1)
        named = functions.FUNCTIONS
        call = self.unit.function
        call(named["rate"], (FLOAT, vector, system, vector), "root_rate")
        call(named["accept"], (FLOAT, vector, system, vector), "root_accept")
        call(named["guards"], (FLOAT, vector, system, vector, vector), "root_guards")
        call(named["reset"], (FLOAT, vector, INT, system, vector), "root_reset")
        call(named["record"], (FLOAT, vector, system, vector), "root_record")
        call(functions.activate, (system,), "root_activate")
        call(outputs.fill, (kinds["samples"], system, kinds["maps"], kinds["record"], kinds["counted"]), "root_fill")
        call(loop.advance, (Functions(MECHANICS), system, kinds["integration"], INT), "root_advance")

    def _instance(self, plan: Plan, driver: Driver, tolerance: float, token: str) -> str:
        """Return C code of constants of the mechanism and of the struct type of an FMU instance.

        `token` is the instantiation token of the FMU.
        """
        groups, motions, weights = vars(self.variables), prescribed_motions(plan, driver), driver.integration.content.work
        pairs = zip(driver.state.y, weights.atol, weights.rtol, strict=True)
        nominal = [max(abs(float(y)), float(atol / rtol)) for y, atol, rtol in pairs]
        start = [number for motion in motions for number in motion.start]
        sizes = {"STATES": len(groups["states"]), "GUARDS": len(groups["guards"]), "INPUTS": len(motions)}
        firsts = zip(groups, accumulate(map(len, groups.values()), initial=1), strict=False)
        enumerated = (
            {name: getattr(loop, name) for name in STATUSES},
            sizes | {"SIGNALS": self.delayed_signals},
            {f"FIRST_{name.removesuffix('s').upper()}": first for name, first in firsts},
        )
        return "\n".join(
            (
                *(f"enum {{ {', '.join(f'{name} = {value}' for name, value in values.items())} }};" for values in enumerated),
                f'static const char TOKEN[] = "{token}";',
                f"static const double TOLERANCE = {written(tolerance)};",
                f"static const double NOMINAL[STATES + 1] = {{{', '.join(map(written, [*nominal, 1.0]))}}};",
                f"static const int FUNCTION[INPUTS + 1] = {{{', '.join(str(motion.function) for motion in motions) or '0'}}};",
                f"static const double START[3 * INPUTS + 1] = {{{', '.join(map(written, [*start, 0.0]))}}};",
                INSTANCE_TYPE,
            )
        )

    def _places(self) -> str:
        outputs = self.variables.outputs
        places = [f"        case {output.reference}: return {output.place};" for output in outputs]
        factors = [f"        case {row.reference}: return {written(row.factor)};" for row in outputs if row.factor != 1.0]
        return "\n".join(
            (PLACE_FUNCTION, *places, DEFAULT_CASE.format("NULL"), FACTOR_FUNCTION, *factors, DEFAULT_CASE.format("1.0"), "")
        )


def _observer(system: Any) -> System:
    """Return a system with copied state and work arrays, with which outputs are computed; the history is not copied."""
    once = ("history", "history_length", "initial_history")
    state = {name: part if name in once else np.array(part) for name, part in system.state._asdict().items()}
    work = type(system.work)(*(np.array(part) for part in system.work))
    return System(system.model, system.parameters, type(system.state)(**state), work, system.friction)


class _Block:
    """Block of memory with the numbers of all arrays in some named tuples; an array that occurs repeatedly is stored once."""

    def __init__(self, roots: Mapping[str, Any], types: dict[Any, Any]) -> None:
        self.types = types
        self.words: list[Any] = []
        self.places: dict[tuple[int, int], int] = {}
        self.lines: list[str] = []
        for name, root in roots.items():
            self._connect(f"m->{name}", root)

    def _connect(self, name: str, content: Any) -> None:
        kind = kind_of(content, name.rpartition(".")[2], self.types)
        if isinstance(kind, Struct):
            for part, value in content._asdict().items():
                self._connect(f"{name}.{part}", value)
        elif isinstance(kind, Tuple):
            for k, number in enumerate(content):
                self._connect(f"{name}.v[{k}]", number)
        elif isinstance(kind, Array):
            shape = [str(size) for size in content.shape] + ([str(content.shape[1])] if content.ndim == 2 else [])
            pointer = f"({kind.element.c} *)(m->w + {self._place(content)})"
            self.lines.append(f"    {name} = ({kind.c}){{{', '.join([pointer, *shape])}}};")
        else:
            self.lines.append(f"    {name} = {written(content)};")

    def _place(self, array: np.ndarray) -> int:
        """Return the index of the first number of an array in the block; append the array if it is new."""
        key = (array.ctypes.data, array.size)
        if array.size and key in self.places:
            return self.places[key]
        place = len(self.words)
        self.words += [
            number for entry in array.ravel().tolist() for number in (entry if isinstance(entry, tuple) else (entry,))
        ]
        self.places[key] = place
        return place

    def text(self) -> str:
        """Return C code with the nonzero start values, and with the function `connect` that copies them to an instance."""
        zero_gap = 6  # this number of consecutive zeros separates two stored sequences of numbers
        runs: list[tuple[int, list[Any]]] = []
        for place, number in enumerate(self.words):
            if number == 0 and not (isinstance(number, float) and np.signbit(number)):
                continue
            if runs and place - (runs[-1][0] + len(runs[-1][1])) < zero_gap:
                start, numbers = runs[-1]
                numbers += [0] * (place - start - len(numbers)) + [number]
            else:
                runs.append((place, [number]))
        flat = [number for _, numbers in runs for number in numbers]
        texts = [f"{{.{'f' if isinstance(number, float) else 'i'} = {written(number)}}}" for number in flat]
        rows = [", ".join(texts[k : k + 6]) for k in range(0, len(texts), 6)]
        table = ", ".join(f"{{{start}, {len(numbers)}}}" for start, numbers in runs)
        return "\n".join(
            (
                f"enum {{ WORDS = {len(self.words)}, RUNS = {len(runs)} }};",
                "static const word NUMBERS[] = {\n    " + ",\n    ".join(rows or ["{0}"]) + "};",
                f"static const int RUN[][2] = {{{table or '{0, 0}'}}};",
                "",
                "static void connect(Fmu *m) {",
                "    const word *from = NUMBERS;",
                "    for (int run = 0; run < RUNS; run++) {",
                "        memcpy(m->w + RUN[run][0], from, (size_t)RUN[run][1] * sizeof(word));",
                "        from += RUN[run][1];",
                "    }",
                *self.lines,
                "}",
                "",
            )
        )


# C text at the beginning of the source of an FMU
INCLUDES = """\
#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

typedef union { double f; int64_t i; } word;
"""

# C text of the structure with all data of an FMU instance, and of the function that sets its inputs to their start values
INSTANCE_TYPE = """\

typedef struct {
    word *w; /* all numbers of the instance */
    System system, observer;
    Integration integration;
    BodyMaps maps;
    Record record;
    Samples samples;
    F1_array counted;
    void *environment, *say;
    bool exchange, early, warnings; /* warnings: whether they are logged */
    bool external[INPUTS + 1], idle[INPUTS + 1]; /* idle: an input was set that has no effect */
    double time, input[3 * INPUTS + 1];
    double stop, completed, earliest; /* earliest: time before which an importer must not go back in model exchange */
    int mode, fresh, outputs; /* mode: the state of the standard's state machine */
} Fmu;

static void begin(Fmu *m) { memcpy(m->input, START, sizeof START); }
"""

# Start of the C function that returns the address of a variable by its value reference; cases of a switch follow
PLACE_FUNCTION = """\
static const double *place(Fmu *m, uint32_t reference) {
    int64_t r = reference;
    if (r >= FIRST_STATE && r < FIRST_STATE + STATES) return m->integration.state.y.p + (r - FIRST_STATE);
    if (r >= FIRST_RATE && r < FIRST_RATE + STATES) return m->integration.work.slope.p + (r - FIRST_RATE);
    if (r >= FIRST_GUARD && r < FIRST_GUARD + GUARDS) return m->integration.work.value.p + (r - FIRST_GUARD);
    if (r >= FIRST_INPUT && r < FIRST_INPUT + 3 * INPUTS) return m->input + (r - FIRST_INPUT);
    switch (reference) {"""

# End of a C function that is one switch; {} is the result for other value references
DEFAULT_CASE = """\
        default: return {};
    }}
}}"""

# Start of the C function that returns the factor of an output by its value reference; cases of a switch follow
FACTOR_FUNCTION = """\
static double factor(uint32_t reference) {
    switch (reference) {"""
