"""Call a functional mock-up unit in ways that the FMI 3.0 standard forbids, and check that it reports an error.

``python -m benchmarks.fmu_attacks unit.fmu`` prints each attack that the unit accepted or that ended its process. Each attack
runs in its own process; ``--together`` runs all of them in one, which is faster.
"""

from __future__ import annotations

import argparse
import ctypes as ct
import os
import signal
import sys
import tempfile
import zipfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from benchmarks.fmu_unit import ERROR, NAMES, OK, STEP, STOP, WARNING, Unit, unit_in, valid_arguments

__all__ = ["Attack", "attacks", "outcomes"]

ENDLESS = 20  # Time after which an attack counts as endless [s]
UNKNOWN = 987654  # Value reference that no variable has

LETTERS = {"I": "instantiated", "N": "initialization", "S": "step", "E": "event", "C": "continuous", "T": "terminated"}

CALLABLE = {
    "SetDebugLogging": ("INST", "INECT"),
    "EnterInitializationMode": ("I", "I"),
    "ExitInitializationMode": ("N", "N"),
    "EnterEventMode": ("", "C"),
    "EnterStepMode": ("", ""),
    "EnterConfigurationMode": ("", ""),
    "ExitConfigurationMode": ("", ""),
    "Terminate": ("S", "EC"),
    "Reset": ("INST", "INECT"),
    "GetFloat64": ("INST", "INECT"),
    "SetFloat64": ("INS", "INEC"),
    "GetBoolean": ("INST", "INECT"),
    "SetBoolean": ("IN", "IN"),
    "GetFMUState": ("INST", "INECT"),
    "SetFMUState": ("INST", "INECT"),
    "FreeFMUState": ("INST", "INECT"),
    "SerializedFMUStateSize": ("INST", "INECT"),
    "SerializeFMUState": ("INST", "INECT"),
    "DeserializeFMUState": ("INST", "INECT"),
    "EvaluateDiscreteStates": ("", ""),
    "UpdateDiscreteStates": ("", "E"),
    "EnterContinuousTimeMode": ("", "E"),
    "CompletedIntegratorStep": ("", "C"),
    "SetTime": ("", "EC"),
    "SetContinuousStates": ("", "C"),
    "GetContinuousStates": ("", "NECT"),
    "GetContinuousStateDerivatives": ("", "NECT"),
    "GetNominalsOfContinuousStates": ("", "NECT"),
    "GetEventIndicators": ("", "NECT"),
    "GetNumberOfContinuousStates": ("", "INECT"),
    "GetNumberOfEventIndicators": ("", "INECT"),
    "DoStep": ("S", ""),
}
"""States in which FMI 3.0 (sections 2.3, 3.2 and 4.2) allows each function: in co-simulation and in model exchange.

The unit has no clocks, no structural parameters and no Event Mode in co-simulation. `fmi3SetTime` is also accepted in Event
Mode, as by the Reference FMUs of the Modelica Association."""


@dataclass(frozen=True)
class Attack:
    """A sequence of calls and the result that it must have.

    Parameters
    ----------
    kind : str
    name : str
    act : callable
        Makes the calls on the unit unpacked in a folder; returns the last status, or whether a condition holds.
    expected : int or bool
        The result that FMI 3.0 requires.
    """

    kind: str
    name: str
    act: Callable[[Path], int | bool]
    expected: int | bool = ERROR


def attacks() -> list[Attack]:
    """Return all attacks. The unit needs a driven body, a contact in its first 20 ms, and no feedback with a delay."""
    return [*_calls(), *_null_pointers(), *_times(), *_values(), *_starts(), *_bytes(), *_repairs()]


def _calls() -> Iterator[Attack]:
    """Yield each function in each state: it must fail if the state does not allow it, and only then."""
    for name, letters in CALLABLE.items():
        for exchange, allowed in enumerate(letters):
            for state in [LETTERS[letter] for letter in ("INECT" if exchange else "INST")] + ["failed"]:
                letter = "T" if state == "failed" else next(key for key, value in LETTERS.items() if value == state)

                def act(folder: Path, name: str = name, exchange: int = exchange, state: str = state) -> int:
                    unit = unit_in(folder, bool(exchange), state)
                    return unit.call(name, *valid_arguments(unit, name))

                interface = "model exchange" if exchange else "co-simulation"
                expected = OK if letter in allowed else ERROR
                yield Attack(
                    "allowed calls" if expected == OK else "calls in a wrong state",
                    f"{name}, {interface}, {state}",
                    act,
                    expected,
                )


def _null_pointers() -> Iterator[Attack]:
    """Yield each function with each of its pointers, the instance included, as a null pointer."""
    counts = {
        "EnterInitializationMode": (),
        "ExitInitializationMode": (),
        "Terminate": (),
        "Reset": (),
        "SetTime": (),
        "SetDebugLogging": (),
        "GetFMUState": (0,),
        "SetFMUState": (0,),
        "SerializedFMUStateSize": (0, 1),
        "DoStep": (3, 4, 5, 6),
        "SerializeFMUState": (0, 1),
        "DeserializeFMUState": (0, 2),
        "CompletedIntegratorStep": (1, 2),
        **dict.fromkeys(("GetFloat64", "SetFloat64", "GetBoolean", "SetBoolean"), (0, 2)),
        "UpdateDiscreteStates": (0, 1, 2, 3, 4, 5),
        **{name: (0,) for name in CALLABLE if name.endswith(("ContinuousStates", "Derivatives", "EventIndicators"))},
    }
    for name, places in counts.items():
        exchange = not CALLABLE[name][0]
        state = LETTERS[CALLABLE[name][exchange][-1 if name == "Terminate" else 0]]
        for place in (-1, *places):

            def act(folder: Path, name: str = name, exchange: bool = exchange, state: str = state, place: int = place) -> int:
                unit = unit_in(folder, exchange, state)
                arguments = valid_arguments(unit, name)
                if place < 0:
                    unit.instance = None
                else:
                    arguments[place] = None
                return unit.call(name, *arguments)

            yield Attack("null pointers", f"{name}, {'instance' if place < 0 else f'argument {place + 1}'}", act)


def _stepped(folder: Path, *steps: tuple[float, float], early: bool = False) -> int:
    """Make steps and return the status of the last."""
    unit = unit_in(folder, False, "step", early=early)
    for start, size in steps[:-1]:
        assert unit.step(start, size) == OK
    return unit.step(*steps[-1])


def _sums(folder: Path, size: float, count: int, added: bool) -> int:
    """Reach the stop time by equal steps whose times are sums or products, and return the worst status."""
    unit = Unit(folder)
    assert unit.call("EnterInitializationMode", False, 0.0, 0.0, True, size * count) == OK
    assert unit.call("ExitInitializationMode") == OK
    time, status = 0.0, OK
    for k in range(count):
        status = max(status, unit.step(time if added else k * size, size))
        time += size
    return status


def _times() -> Iterator[Attack]:
    nan, inf = float("nan"), float("inf")
    first = (0.0, STEP)
    wrong = {
        "a repeated step": (first, first),
        "a repeated shorter step": (first, (0.0, STEP / 2.0)),
        "a step from a later point": (first, (2.0 * STEP, STEP)),
        "a step from a point one thousandth of a step late": (first, (1.001 * STEP, STEP)),
        "a first step from a later point": ((STEP, STEP),),
        "a step from NaN": ((nan, STEP),),
        "a step of 0": ((0.0, 0.0),),
        "a step back": (first, (STEP, -STEP / 2.0)),
        "a step of NaN": ((0.0, nan),),
        "an endless step": ((0.0, inf),),
        "a step beyond the stop time": ((0.0, 1.01 * STOP),),
        "a further step after the stop time": ((0.0, STOP), (STOP, STEP)),
    }
    for name, steps in wrong.items():
        yield Attack("times", name, lambda folder, steps=steps: _stepped(folder, *steps))
    for added in (True, False):
        for size, count in ((1e-4, 200), (STOP / 7.0, 7), (0.02 / 3.0, 3), (1.1e-5, 1000)):
            name = f"{count} steps of {size:.4g} s, {'added up' if added else 'multiplied'}, to the stop time"
            yield Attack(
                "allowed times", name, lambda folder, size=size, count=count, added=added: _sums(folder, size, count, added), OK
            )

    def ignored(folder: Path) -> int:
        unit = unit_in(folder, False, "step", early=True)
        early, reached, time = ct.c_bool(), ct.c_double(), 0.0
        while not early:
            others = [ct.byref(ct.c_bool()) for _ in range(2)]
            assert unit.call("DoStep", time, STEP, True, *others, ct.byref(early), ct.byref(reached)) == OK
            time += STEP
        assert reached.value < time
        return unit.step(time)

    def returns(folder: Path, allowed: bool) -> bool:
        unit, early, reached = unit_in(folder, False, "step", early=allowed), ct.c_bool(), ct.c_double()
        others = [ct.byref(ct.c_bool()) for _ in range(2)]
        assert unit.call("DoStep", 0.0, STOP, True, *others, ct.byref(early), ct.byref(reached)) == OK
        return bool(early) == allowed == (reached.value < STOP)

    yield Attack("allowed times", "an early return, if it is allowed", lambda folder: returns(folder, True), True)
    yield Attack("allowed times", "no early return, if it is not allowed", lambda folder: returns(folder, False), True)
    yield Attack("times", "a step after an early return from where that was to end", ignored)

    def back(folder: Path, time: float) -> int:
        unit = unit_in(folder, True, "continuous")
        assert unit.call("SetTime", STEP) == OK
        assert unit.call("CompletedIntegratorStep", *valid_arguments(unit, "CompletedIntegratorStep")) == OK
        assert unit.call("EnterEventMode") == OK
        return unit.call("SetTime", time)

    yield Attack("times", "model exchange: time before the last event", lambda folder: back(folder, STEP / 2.0))
    yield Attack("times", "model exchange: time NaN", lambda folder: back(folder, nan))
    yield Attack("times", "model exchange: time infinite", lambda folder: back(folder, inf))
    yield Attack("allowed times", "model exchange: time of the last event", lambda folder: back(folder, STEP), OK)

    def beyond(folder: Path, time: float) -> int:
        unit = unit_in(folder, True, "continuous")
        assert unit.call("SetTime", time) == OK
        return unit.call("CompletedIntegratorStep", *valid_arguments(unit, "CompletedIntegratorStep"))

    yield Attack("times", "model exchange: a step beyond the stop time", lambda folder: beyond(folder, 1.01 * STOP))
    yield Attack("allowed times", "model exchange: a step to the stop time", lambda folder: beyond(folder, STOP), OK)


def _values() -> Iterator[Attack]:
    def access(folder: Path, name: str, reference: int | str, value: float = 0.5, count: int = 1, state: str = "step") -> int:
        unit = unit_in(folder, state in ("event", "continuous"), state)
        found = unit.references.get(reference, -1) if isinstance(reference, str) else reference
        found = {-2: unit.inputs[0], -3: unit.flags[0], -4: unit.outputs[0]}.get(found, found)
        kind = ct.c_bool if "Boolean" in name else ct.c_double
        return unit.call(name, (ct.c_uint32 * 1)(found), ct.c_size_t(1), (kind * 8)(*[value] * 8), ct.c_size_t(count))

    flag, given, output = -3, -2, -4
    wrong: dict[str, tuple[Any, ...]] = {
        "get an unknown Float64": ("GetFloat64", UNKNOWN),
        "get the largest reference": ("GetFloat64", 2**32 - 1),
        "get a Boolean as Float64": ("GetFloat64", flag),
        "get a Float64 as Boolean": ("GetBoolean", output),
        "set an unknown Float64": ("SetFloat64", UNKNOWN),
        "set an output": ("SetFloat64", output),
        "set the time": ("SetFloat64", 0),
        "set a state": ("SetFloat64", 1),
        "set a Float64 as Boolean": ("SetBoolean", given),
        "set an input to NaN": ("SetFloat64", given, float("nan")),
        "set an input to infinity": ("SetFloat64", given, float("inf")),
        "get 1 variable into no values": ("GetFloat64", output, 0.0, 0),
        "get 1 variable into 8 values": ("GetFloat64", output, 0.0, 8),
        "set 1 variable from 8 values": ("SetFloat64", given, 0.0, 8),
        "get 1 flag into no values": ("GetBoolean", flag, 0.0, 0),
    }
    for name, arguments in wrong.items():
        yield Attack("values", name, lambda folder, arguments=arguments: access(folder, *arguments))
    for state in ("step", "event", "continuous", "terminated"):
        about = f"set a fixed parameter in {state} mode" if state != "terminated" else "set a fixed parameter after the end"
        yield Attack("values", about, lambda folder, state=state: access(folder, "SetBoolean", flag, 1.0, 1, state))
    yield Attack(
        "values", "an input without effect is told (warning)", lambda folder: access(folder, "SetFloat64", given), WARNING
    )
    for name, length in (
        ("GetContinuousStates", 1),
        ("SetContinuousStates", 1),
        ("GetEventIndicators", 64),
        ("GetNominalsOfContinuousStates", 0),
    ):

        def act(folder: Path, name: str = name, length: int = length) -> int:
            unit = unit_in(folder, True, "continuous")
            return unit.call(name, (ct.c_double * 4096)(), ct.c_size_t(length))

        yield Attack("values", f"{name} with {length} values", act)
    for name in ("GetFloat32", "SetInt32", "GetString", "SetUInt64"):

        def typed(folder: Path, name: str = name) -> int:
            unit = unit_in(folder, False, "step")
            return unit.call(name, (ct.c_uint32 * 1)(unit.outputs[0]), ct.c_size_t(1), (ct.c_uint64 * 1)(), ct.c_size_t(1))

        yield Attack("values", f"{name} of a Float64", typed)


def _starts() -> Iterator[Attack]:
    def made(folder: Path, exchange: bool = False, **changes: Any) -> bool:
        unit = Unit(folder, exchange, **changes)
        return unit.instance is None and len(unit.said) == 1

    for name, changes in {
        "without a token": {"token": None},
        "with another token": {"token": b"{0}"},
        "without a name": {"name": None},
        "with an empty name": {"name": b" "},
        "with event mode": {"events": True},
        "with intermediate variables": {"n": 1},
    }.items():
        yield Attack("starts", f"instantiated {name}", lambda folder, changes=changes: made(folder, **changes), True)
    yield Attack("starts", "model exchange without a token", lambda folder: made(folder, True, token=None), True)

    def begun(folder: Path, *arguments: Any) -> int:
        return Unit(folder).call("EnterInitializationMode", *arguments)

    for name, arguments in {
        "a start at 1 s": (False, 0.0, 1.0, False, 0.0),
        "a start at NaN": (False, 0.0, float("nan"), False, 0.0),
        "a stop time of 0": (False, 0.0, 0.0, True, 0.0),
        "a stop time before the start": (False, 0.0, 0.0, True, -1.0),
        "a stop time of NaN": (False, 0.0, 0.0, True, float("nan")),
        "a tolerance of 0": (True, 0.0, 0.0, False, 0.0),
        "a tolerance of NaN": (True, float("nan"), 0.0, False, 0.0),
        "a tolerance of 10": (True, 10.0, 0.0, False, 0.0),
    }.items():
        yield Attack("starts", name, lambda folder, arguments=arguments: begun(folder, *arguments))


def _bytes() -> Iterator[Attack]:
    def damaged(folder: Path, place: float, length: int = 0) -> int:
        unit = unit_in(folder, False, "step")
        content, size, kept = valid_arguments(unit, "DeserializeFMUState")
        if place >= 0.0:
            content[int(place * (size.value - 1))] ^= 4
        return unit.call("DeserializeFMUState", content, ct.c_size_t(size.value + length), kept)

    for place in (0.0, 0.01, 0.1, 0.5, 1.0):
        yield Attack(
            "states", f"a bit of its bytes at {place:.0%} is another", lambda folder, place=place: damaged(folder, place)
        )
    yield Attack("states", "a byte is missing", lambda folder: damaged(folder, -1.0, -1))
    yield Attack("allowed states", "its bytes as they are", lambda folder: damaged(folder, -1.0), OK)

    def other(folder: Path) -> int:
        unit, exchange = unit_in(folder, False, "step"), unit_in(folder, True, "event")
        return unit.call("SetFMUState", *valid_arguments(exchange, "SetFMUState"))

    yield Attack("states", "one of model exchange in co-simulation", other)


def _repairs() -> Iterator[Attack]:
    """Yield the two ways to continue after an error; the results must equal those of an undisturbed instance."""

    def same(folder: Path, way: str) -> bool:
        undisturbed, unit = unit_in(folder, False, "step"), unit_in(folder, False, "step")
        assert undisturbed.step(0.0) == OK
        assert unit.step(0.0) == OK
        kept = valid_arguments(unit, "SetFMUState")
        assert unit.step(0.0) == ERROR
        assert unit.step(STEP) == ERROR  # the unit does not recover by itself
        if way == "kept":
            assert unit.call("SetFMUState", *kept) == OK
        else:
            assert unit.call("Reset") == OK
            unit.enter("step")
            assert unit.step(0.0) == OK
        for k in range(1, 20):
            assert undisturbed.step(k * STEP) == unit.step(k * STEP) == OK
        return undisturbed.get(*undisturbed.outputs) == unit.get(*unit.outputs)

    yield Attack("repairs", "from a kept state after an error", lambda folder: same(folder, "kept"), True)
    yield Attack("repairs", "from the beginning after an error", lambda folder: same(folder, "reset"), True)


def _outcome(attack: Attack, folder: Path) -> str:
    """Return "" if an attack ends as it must, else what happened."""
    try:
        found = attack.act(folder)
    except Exception as error:
        return f"{type(error).__name__}: {error}"
    return "" if found == attack.expected else NAMES[int(found)]


def _outcome_apart(attack: Attack, folder: Path) -> str:
    """Run an attack in its own process."""
    read, write = os.pipe()
    process = os.fork()
    if process == 0:
        signal.alarm(ENDLESS)
        os.write(write, _outcome(attack, folder).encode()[:300])
        os._exit(0)
    os.close(write)
    with os.fdopen(read, "rb") as pipe:
        text = pipe.read().decode(errors="replace")
    _, status = os.waitpid(process, 0)
    if not os.WIFSIGNALED(status):
        return text
    number = os.WTERMSIG(status)
    return f"no return within {ENDLESS} s" if number == signal.SIGALRM else f"ended by {signal.Signals(number).name}"


def outcomes(unit: Path, *, together: bool = False) -> list[tuple[Attack, str]]:
    """Run all attacks on a unit.

    Parameters
    ----------
    unit : Path
    together : bool
        Whether all of them run in this process.

    Returns
    -------
    list of (Attack, str)
        Each attack with "" if it ended as it must, else with what happened.
    """
    run = _outcome if together else _outcome_apart
    with tempfile.TemporaryDirectory() as folder:
        with zipfile.ZipFile(unit) as archive:
            archive.extractall(folder)
        return [(attack, run(attack, Path(folder))) for attack in attacks()]


def _section(found: list[tuple[Attack, str]]) -> str:
    from benchmarks.measure import machine, table

    kinds: dict[str, list[bool]] = {}
    for attack, text in found:
        kinds.setdefault(attack.kind, []).append(not text)
    rows = [[kind, str(len(right)), str(sum(right))] for kind, right in kinds.items()]
    return f"{table(('kind', 'attacks', 'ended as FMI 3.0 requires'), rows)}\n{machine()}\n"


def main() -> int:
    """Attack a unit, print what it accepted, and return 1 if it accepted anything."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("unit", type=Path, help="a unit with a driven body and a clearance joint, as of examples/four_bar.toml")
    parser.add_argument("--together", action="store_true", help="all attacks in one process")
    parser.add_argument("--write", action="store_true", help="save the counts in docs/decisions/measured/agreement.md")
    given = parser.parse_args()
    found = outcomes(given.unit, together=given.together)
    for attack, text in found:
        if text:
            print(f"{attack.kind}: {attack.name}: {text}")
    wrong = sum(bool(text) for _, text in found)
    print(f"{len(found) - wrong} of {len(found)} attacks ended as FMI 3.0 requires")
    if given.write:
        from benchmarks.measure import write_section

        write_section(
            "agreement",
            "Attacks on functional mock-up units",
            f"python -m benchmarks.fmu_attacks {given.unit} --write",
            _section(found),
        )
    return int(wrong > 0)


if __name__ == "__main__":
    sys.exit(main())
