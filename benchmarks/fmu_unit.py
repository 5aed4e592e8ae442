"""A functional mock-up unit, called through its C functions with any arguments."""

from __future__ import annotations

import ctypes as ct
import platform
import xml.etree.ElementTree as ET
from pathlib import Path
from typing import Any

__all__ = ["ERROR", "NAMES", "OK", "STEP", "STOP", "WARNING", "Unit", "unit_in", "valid_arguments"]

OK, WARNING, DISCARD, ERROR = range(4)
NAMES = ("fmi3OK", "fmi3Warning", "fmi3Discard", "fmi3Error")
STEP, STOP = 1e-3, 0.02  # [s]

LIBRARY_ENDINGS = {"Linux": "linux/*.so", "Darwin": "darwin/*.dylib", "Windows": "windows/*.dll"}

MESSAGE = ct.CFUNCTYPE(None, ct.c_void_p, ct.c_int, ct.c_char_p, ct.c_char_p)


class Unit:
    """An instance of a unit, called through its C functions.

    Parameters
    ----------
    folder : Path
        The unit, unpacked.
    exchange : bool
        Whether it is instantiated for model exchange.
    """

    def __init__(self, folder: Path, exchange: bool = False, **changes: Any) -> None:
        about = ET.parse(folder / "modelDescription.xml").getroot()
        (file,) = (folder / "binaries").glob(f"*-{LIBRARY_ENDINGS[platform.system()]}")
        self.library, self.exchange, self.said = ct.CDLL(str(file)), exchange, list[str]()
        variables = [(element.attrib, element.tag) for element in about.findall("ModelVariables/*")]
        self.references = {row["name"]: int(row["valueReference"]) for row, _ in variables}
        self.inputs = [int(row["valueReference"]) for row, _ in variables if row["causality"] == "input"]
        self.flags = [int(row["valueReference"]) for row, tag in variables if tag == "Boolean"]
        self.outputs = [int(row["valueReference"]) for row, _ in variables if row["causality"] == "output"]
        self.states = len(about.findall("ModelStructure/ContinuousStateDerivative"))
        self.guards = len(about.findall("ModelStructure/EventIndicator"))
        self.logger = MESSAGE(lambda _, status, category, text: self.said.append((text or b"").decode()))
        given = {"name": b"unit", "token": about.attrib["instantiationToken"].encode(), "events": False, "early": False, "n": 0}
        given |= changes
        references = (ct.c_uint32 * 1)(self.outputs[0])
        start = [given["name"], given["token"], None, False, False]
        if exchange:
            made = self._function("InstantiateModelExchange", ct.c_void_p)
            self.instance = made(*start, None, self.logger)
        else:
            made = self._function("InstantiateCoSimulation", ct.c_void_p)
            more = [given["events"], given["early"], references if given["n"] else None, ct.c_size_t(given["n"])]
            self.instance = made(*start, *more, None, self.logger, None)

    def _function(self, name: str, result: Any = ct.c_int) -> Any:
        function = getattr(self.library, f"fmi3{name}")
        function.restype = result
        return function

    def call(self, name: str, *arguments: Any) -> int:
        """Call a function of the instance and return its status.

        Parameters
        ----------
        name : str
            Without "fmi3".
        arguments
            A float is a Float64, a bool a Boolean, None a null pointer; others are values of ctypes.
        """
        typed = [ct.c_double(value) if isinstance(value, float) else value for value in arguments]
        return int(self._function(name)(ct.c_void_p(self.instance), *typed))

    def get(self, *references: int) -> list[float]:
        """Return values of Float64 variables."""
        n = len(references)
        values = (ct.c_double * n)()
        self.call("GetFloat64", (ct.c_uint32 * n)(*references), ct.c_size_t(n), values, ct.c_size_t(n))
        return list(values)

    def step(self, start: float, size: float = STEP) -> int:
        """Make a step."""
        return self.call("DoStep", start, size, True, *(ct.byref(ct.c_bool()) for _ in range(3)), ct.byref(ct.c_double()))

    def enter(self, state: str) -> None:
        """Go from the start to a state of the standard's state machine; "failed" is the state after an error."""
        path = {
            "instantiated": (),
            "initialization": ("EnterInitializationMode",),
            "step": ("EnterInitializationMode", "ExitInitializationMode"),
            "event": ("EnterInitializationMode", "ExitInitializationMode"),
            "continuous": (
                "EnterInitializationMode",
                "ExitInitializationMode",
                "UpdateDiscreteStates",
                "EnterContinuousTimeMode",
            ),
        }
        path["terminated"] = (*path["step"], "Terminate")
        path["failed"] = (*path["step"], "EnterStepMode")
        for name in path[state]:
            status = self.call(name, *valid_arguments(self, name))
            assert status == (ERROR if name == "EnterStepMode" else OK), (name, status, self.said)


def valid_arguments(unit: Unit, name: str) -> list[Any]:
    """Return arguments that a function accepts where it may be called."""
    size, boolean, double = ct.c_size_t, lambda: ct.byref(ct.c_bool()), lambda: ct.byref(ct.c_double())
    reference = lambda of: (ct.c_uint32 * 1)(of)  # noqa: E731
    one, flag = [size(1), (ct.c_double * 1)(0.5), size(1)], [size(1), (ct.c_bool * 1)(True), size(1)]
    states, guards = [(ct.c_double * unit.states)(), size(unit.states)], [(ct.c_double * unit.guards)(), size(unit.guards)]
    kept = ct.c_void_p()
    if "FMUState" in name:
        assert unit.call("GetFMUState", ct.byref(kept)) == OK
        length = size()
        assert unit.call("SerializedFMUStateSize", kept, ct.byref(length)) == OK
        content = (ct.c_uint8 * length.value)()
        assert unit.call("SerializeFMUState", kept, content, length) == OK
        unit.kept = kept, content  # type: ignore[attr-defined] # kept alive
    found: dict[str, list[Any]] = {
        "SetDebugLogging": [True, size(0), None],
        "EnterInitializationMode": [False, 0.0, 0.0, True, STOP],
        "GetFloat64": [reference(unit.outputs[0]), *one],
        "SetFloat64": [reference(unit.inputs[0]), size(1), (ct.c_double * 1)(*unit.get(unit.inputs[0])), size(1)],
        "GetBoolean": [reference(unit.flags[0]), *flag],
        "SetBoolean": [reference(unit.flags[0]), *flag],
        "UpdateDiscreteStates": [*(boolean() for _ in range(5)), double()],
        "CompletedIntegratorStep": [True, boolean(), boolean()],
        "SetTime": [0.0],
        "SetContinuousStates": [(ct.c_double * unit.states)(*unit.get(*range(1, unit.states + 1))), size(unit.states)],
        "GetContinuousStates": states,
        "GetContinuousStateDerivatives": states,
        "GetNominalsOfContinuousStates": states,
        "GetEventIndicators": guards,
        "GetNumberOfContinuousStates": [ct.byref(size())],
        "GetNumberOfEventIndicators": [ct.byref(size())],
        "DoStep": [0.0, STEP, True, *(boolean() for _ in range(3)), double()],
    }
    if kept:
        found |= {
            "GetFMUState": [ct.byref(ct.c_void_p())],
            "SetFMUState": [kept],
            "FreeFMUState": [ct.byref(kept)],
            "SerializedFMUStateSize": [kept, ct.byref(length)],
            "SerializeFMUState": [kept, content, length],
            "DeserializeFMUState": [content, length, ct.byref(ct.c_void_p())],
        }
    return found.get(name, [])


def unit_in(folder: Path, exchange: bool, state: str, **changes: Any) -> Unit:
    """Return a new instance that is in a state of the standard's state machine."""
    unit = Unit(folder, exchange, **changes)
    unit.enter(state)
    return unit
