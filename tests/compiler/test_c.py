"""Kernels in C against the Python functions that they are, to the last bit, and the C of FMUs against the library."""

from __future__ import annotations

import ctypes
import dataclasses
import math
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from tests.build import in_c

import scissordyn as sd
from scissordyn.casefile.part import PARTS
from scissordyn.compiler.c import FLAGS, compile_library
from scissordyn.compiler.kind import FLOAT
from scissordyn.compiler.unit import Unit
from scissordyn.components.catalogue import COMPONENTS
from scissordyn.components.declaration import kernels_of
from scissordyn.control.catalogue import CONTROLLERS
from scissordyn.exchange.fmu.source import Source
from scissordyn.kernel import F1, PYTHON, call_at
from scissordyn.laws.catalogue import DAMPING, ELASTIC, FRICTION
from scissordyn.laws.contact import JointContact
from scissordyn.mechanics import functions
from scissordyn.plan.plan import plan
from scissordyn.plugin.element import RECIPES, pointers, row_of
from scissordyn.run.trajectory import make_driver

# Compiler flags without optimisation, with which compilation takes a fifth of the time
QUICK = tuple("-O0" if flag == "-O2" else flag for flag in FLAGS)

# Joint of the contacts in which laws are compared
JOINT = JointContact(clearance=4e-4, journal_radius=10e-3, length=15e-3, journal=sd.STEEL, bearing=sd.STEEL)


def law_parts() -> Iterator[tuple[str, object, tuple[object, ...]]]:
    """Name and example of each law and controller, and what its parameters follow from."""
    for laws, handed in ((ELASTIC, (JOINT,)), (DAMPING, (JOINT,)), (FRICTION, (JOINT,)), (CONTROLLERS, ())):
        for name, kind in laws.items():
            fields = [each for each in dataclasses.fields(kind) if each.default is each.default_factory is dataclasses.MISSING]
            yield name, kind(*(0.5 for _ in fields)), handed


def component_parts() -> Iterator[object]:
    """Return the example of each component, and the oil film in a joint."""
    oil = sd.slider_crank().with_clearance("slider pin", sd.Clearance(1e-4, lubrication=sd.Lubrication(viscosity=0.05)))
    yield from oil.exerting
    for kind in (kind for kind in COMPONENTS.values() if kind.declaration.section in PARTS):
        declared = kind.declaration
        table = {"name": "part", **declared.example}
        table.pop("length" if declared.section == "rod" else "", None)
        yield PARTS[declared.section].reader.read(table, {})


def component_row(part) -> np.ndarray:
    """Return the parameters of a component's kernels, from a start that is none of their special values."""
    numbers = part.parameters(tuple(1.0 + 0.1 * k for k in range(len(part.declaration.port.coordinates))))
    row = np.zeros(max(64, len(numbers)))
    row[: len(numbers)] = numbers
    return row


def law_kernels() -> Iterator[tuple[str, int, np.ndarray]]:
    """Name, address and parameters of each kernel of each law and controller."""
    for name, part, handed in law_parts():
        for key, address in pointers(part).items():
            if address:
                yield f"{name} {key}", address, row_of(part, *handed)


def component_kernels() -> Iterator[tuple[str, int, np.ndarray]]:
    """Name, address and parameters of each kernel of each component."""
    for part in component_parts():
        found = kernels_of(type(part))
        for key in ("force", "gap", "switch"):
            if found[key]:
                yield f"{type(part).__name__} {key}", found[key], component_row(part)


KERNELS = [*law_kernels(), *component_kernels()]  # Name, pointer and parameters of the kernels of all laws and components


POWERS = ("bai-zhao-as-printed energy", "Beam force")
"""Kernels with the power x**3, which is two products in C but a library function in Python; results differ by round-off."""


@pytest.mark.parametrize(("name", "pointer", "row"), KERNELS, ids=[name for name, _, _ in KERNELS])
def test_the_kernel_of_an_element_is_the_same_in_c(name, pointer, row):
    """Cross-check: at 60 random inputs, by its pointer and as the Python function, bit for bit."""
    in_python, random, compared = RECIPES[pointer].python(), np.random.default_rng(1), 0
    for _ in range(60):
        inputs = random.uniform(-1, 1, (4, 24)) * 10.0 ** random.uniform(-7, 1)
        if name.partition(" ")[0] in (*ELASTIC, *DAMPING):
            inputs[0, 0] = abs(inputs[0, 0])
        compiled, interpreted = np.zeros(25), np.zeros(25)
        compiled[24] = call_at(pointer, *inputs, row, compiled[:24])
        try:
            interpreted[24] = in_python(*inputs, row, interpreted[:24])
        except (ValueError, OverflowError, ZeroDivisionError):  # Python's functions have no NaN and no infinity
            assert not np.isfinite(compiled).all()
            continue
        compared += 1
        bits = 1e-14 if name in POWERS else 0.0
        assert np.allclose(compiled, interpreted, rtol=bits, atol=0.0, equal_nan=True)
    assert compared > 20


def test_all_elements_are_compared():
    """Contract."""
    assert len(KERNELS) > 70


# Function that returns digests of whole runs, to compare the compiled engine with Python
WHOLE = """
import hashlib, numpy as np, scissordyn as sd
loose = sd.Clearance(4e-4, friction=sd.LuGre(kinetic=0.05))
oil = sd.Clearance(4e-4, lubrication=sd.Lubrication(viscosity=0.05))
hard = sd.Clearance(4e-4, contact="hard", damping=sd.LankaraniNikravesh(0.5))
arm = sd.scissor(units=2, angle=sd.degrees(30))
tubes = sd.with_bending(arm, "all", section="tube 60x60x1.5 mm", material="aluminium", mass="section")
crank = sd.slider_crank()
cases = {
    "lugre": (arm.with_clearance("A", loose).driven(speed=15.0), 1.5e-3),
    "oil": (crank.with_clearance("slider pin", oil).driven(speed=60.0), 2e-4),
    "hard": (arm.with_clearance("A", hard).driven(speed=15.0), 2e-3),
    "bars": (tubes.with_clearance("A", sd.Clearance(4e-4)).driven(speed=3.0), 1e-4),
    "servo": (crank.controlled(sd.PID(50.0, 3.0, 20.0), reference=sd.Harmonic(0.3, 0.2, 10.0)), 2e-2),
}
def answers(names):
    for name in names:
        mechanism, until = cases[name]
        run = sd.simulate(mechanism, until=until, samples=5)
        digest = hashlib.sha256()
        for variable in sorted(run.data_vars):
            if run[variable].dtype.kind == "f":
                digest.update(variable.encode() + np.ascontiguousarray(run[variable].values).tobytes())
        yield f"{name} {run.attrs['status']} {digest.hexdigest()}"
"""


@pytest.mark.parametrize(
    "names", [("lugre", "servo"), pytest.param(("oil", "hard", "bars"), marks=pytest.mark.slow)], ids=" ".join
)
def test_whole_runs_are_the_same_in_python(names):
    """Cross-check: each float of each variable, with every index of every kernel within its bounds."""
    here = {}
    exec(WHOLE, here)
    environment, code = {**os.environ, "SCISSORDYN_ENGINE": "python"}, f"{WHOLE}\nprint(*answers({names}), sep='\\n')"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False, env=environment)
    assert done.returncode == 0, done.stderr
    assert not PYTHON
    assert done.stdout.splitlines() == list(here["answers"](names))


def machines():
    """Return mechanisms with all kinds of tables; `exchange/test_fmu.py` follows the motions of six others."""
    loose = sd.Clearance(4e-4, friction=sd.LuGre(kinetic=0.05))
    oil = sd.Clearance(1e-4, lubrication=sd.Lubrication(viscosity=0.05))
    channel = sd.GuideClearance(2e-4, length=0.04, width=0.02, friction=sd.Ambrosio(kinetic=0.1))
    spring = sd.Spring("spring", ("rod", "end"), ("ground", "origin"), stiffness=400.0, free_length=0.1, damping=3.0)
    stop = sd.AngleStop("stop", "rod", angle=-0.3)
    crank = sd.slider_crank(slider_inertia=1e-4)
    parts = sd.slider_crank().with_parts({"components": (spring, stop)}).with_clearance("all", loose)
    arm = sd.with_bending(sd.scissor(units=2), "all", section="tube 60x60x1.5 mm", material="aluminium", mass="section")
    return {
        "channel": crank.with_clearance("guide", channel).driven(speed=50.0),
        "parts": parts.controlled(sd.PID(50.0, 3.0, 20.0), reference=sd.Harmonic(0.3, 0.2, 10.0)),
        "bars that bend": arm.with_clearance("A", loose).driven(sd.Cycloidal(sd.degrees(30), sd.degrees(60), 0.5)),
        "oil": sd.slider_crank().with_clearance("slider pin", oil).driven(speed=60.0),
    }


# C function that evaluates the rates of an FMU at a state
RATES = """
__attribute__((visibility("default"))) void *opened(void) {
    Fmu *m = calloc(1, sizeof(Fmu));
    m->w = calloc(WORDS + 1, sizeof(word));
    connect(m);
    return m;
}
__attribute__((visibility("default"))) void rates(void *c, double t, double *y, int64_t *mode, double *dy, double *value) {
    Fmu *m = c;
    F1_array state = {y, STATES}, slope = {dy, STATES}, found = {value, GUARDS};
    for (int k = 0; k < GUARDS; k++) m->system.state.mode.p[k] = mode[k];
    m->system.work.instant.p[0] = NAN;
    root_rate(t, state, &m->system, slope);
    root_guards(t, state, &m->system, found, m->integration.work.rate);
}
"""


@pytest.mark.parametrize("name", machines())
def test_the_right_hand_side_and_guards_are_the_same_in_c(name, tmp_path):
    """Cross-check: at random states, times and modes of contact, to round-off."""
    found = plan(machines()[name])
    driver, _, _ = make_driver(found, sd.Options(until=0.1))
    source = Source(found, driver, tolerance=1e-8, token="test").text + RATES
    compile_library(source, tmp_path / "unit.so", QUICK)
    library = ctypes.CDLL(str(tmp_path / "unit.so"))
    library.opened.restype = ctypes.c_void_p
    handle = ctypes.c_void_p(library.opened())
    random, size, content = np.random.default_rng(2), driver.state.y.size, driver.system.content
    guards = content.state.mode.size
    for trial in range(50):
        y = driver.state.y + (1e-4 * random.normal(size=size) if trial else 0.0)
        t = float(random.uniform(0.0, 0.1))
        mode = random.integers(0, 2, guards)
        content.state.mode[:] = mode
        content.work.instant[0] = math.nan
        dy, value, rate = np.zeros(size), np.zeros(guards), np.zeros(guards)
        functions.rate(t, y, driver.system.address, dy)
        functions.guards(t, y, driver.system.address, value, rate)
        other, other_value = np.zeros(size), np.zeros(max(1, guards))
        kept = np.ascontiguousarray(mode, dtype=np.int64) if guards else np.zeros(1, np.int64)
        library.rates(
            handle,
            ctypes.c_double(t),
            *(each.ctypes.data_as(ctypes.c_void_p) for each in (np.array(y), kept, other, other_value)),
        )
        assert np.max(abs(other - dy)) <= 1e-12 * max(1.0, np.max(abs(dy)))
        assert np.max(abs(other_value[:guards] - value), initial=0.0) <= 1e-15


def arithmetic(i, j, x, y):
    """Return results of operators whose meaning differs between Python and C."""
    low, high = min(x, y), max(x, y, 0.25)
    total = i // j + i % j + abs(i) + int(x)
    if not 0.0 <= low < high or i in (2, -3):
        total += 100
    for k in range(3, -4, -2):
        total += k
        if k < -1:
            break
    a, b = x, y
    a, b = b, a - b
    return total + i / j, x // y + x % y, low**3 + high**0.5, a, b, k


def write_arithmetic(i: int, j: int, x: float, y: float, out: F1) -> None:
    out[0], out[1], out[2], out[3], out[4], out[5] = arithmetic(i, j, x, y)


def test_operators_have_the_meaning_of_python():
    """Contract: quotients and remainders of negative numbers, chains of comparisons, tuples, loops."""
    compiled = in_c(write_arithmetic)
    for i, j, x, y in ((7, 2, 0.3, 0.7), (-7, 2, 2.5, -0.4), (7, -2, -2.5, 0.4), (-3, -2, 1.0, 0.1), (2, 5, -0.2, 3.0)):
        out = np.zeros(6)
        compiled(i, j, x, y, out)
        exact = arithmetic(i, j, x, y)
        assert out.tolist() == pytest.approx([complex(part).real for part in exact], rel=1e-15), (i, j, x, y)


def write_numpy(x: float, y: float, out: F1) -> None:
    out[0], out[1], out[2] = np.minimum(x, y), np.maximum(x, y), np.sign(x)
    out[3], out[4] = np.where(x > y, 1.0, 2.0), np.clip(x, -0.5, 0.5)
    out[5], out[6] = np.arctan2(x, y), math.degrees(x)


def test_numpy_has_its_meaning():
    """Contract: functions of numbers, also of NaN."""
    compiled = in_c(write_numpy)
    for x, y in ((0.3, 0.7), (-2.0, 1.0), (0.0, -0.0), (math.nan, 1.0), (1.0, math.nan)):
        out, exact = np.zeros((2, 7))
        compiled(x, y, out)
        write_numpy(x, y, exact)
        assert out == pytest.approx(exact, rel=1e-15, nan_ok=True)


def unknown(x):
    return sorted([x])[0]


def test_what_is_not_translated_is_one_line():
    """Contract: a kernel with a list is refused by its file, line and word."""
    with pytest.raises(
        sd.InputError, match=rf"{Path(__file__).name}:\d+: unknown: List in a kernel: \[x\].*; expected numbers"
    ) as error:
        Unit().function(unknown, (FLOAT,))
    assert "\n" not in str(error.value)
