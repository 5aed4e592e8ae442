"""Kernels in C against the machine code of the package."""

from __future__ import annotations

import ctypes
import dataclasses
import math
import shutil
import types
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from scissordyn.plugin.address import recipe_of

import scissordyn as sd
from scissordyn.compiler.kind import FLOAT, INT
from scissordyn.compiler.unit import Unit
from scissordyn.component.catalogue import COMPONENTS
from scissordyn.component.compiled import kernels_of
from scissordyn.config.part import PARTS
from scissordyn.control.catalogue import CONTROLLERS
from scissordyn.errors import InputError
from scissordyn.exchange.fmu.pack import COMPILERS, FLAGS, compiled_library
from scissordyn.exchange.fmu.source import Source
from scissordyn.laws.catalogue import DAMPING, ELASTIC, FRICTION
from scissordyn.laws.contact import JointContact
from scissordyn.mechanics import functions
from scissordyn.plan.plan import plan
from scissordyn.plugin.element import addresses, row_of
from scissordyn.run.trajectory import make_driver

pytestmark = pytest.mark.skipif(not any(map(shutil.which, COMPILERS)), reason="there is no C compiler")

POINTER = ctypes.POINTER(ctypes.c_double)
KERNEL = ctypes.CFUNCTYPE(ctypes.c_double, *[POINTER] * 6)
QUICK = tuple("-O0" if flag == "-O2" else flag for flag in FLAGS)
"""Compilers take a fifth of the time so."""

ASKED = """
__attribute__((visibility("default"))) double asked(int k, double *q, double *v, double *z, double *x, double *p, double *out) {
    return KERNELS[k](q, v, z, x, p, out);
}
"""

JOINT = JointContact(clearance=4e-4, journal_radius=10e-3, length=15e-3, journal=sd.STEEL, bearing=sd.STEEL)


def loaded(text: str, folder: Path, name: str) -> ctypes.CDLL:
    library = folder / f"{name}.so"
    library.write_bytes(compiled_library(text, flags=QUICK))
    return ctypes.CDLL(str(library))


def law_kernels() -> Iterator[tuple[str, int, np.ndarray]]:
    """Name, address and parameters of each kernel of each law and controller."""
    for laws, handed in ((ELASTIC, (JOINT,)), (DAMPING, (JOINT,)), (FRICTION, (JOINT,)), (CONTROLLERS, ())):
        for name, kind in laws.items():
            fields = [each for each in dataclasses.fields(kind) if each.default is each.default_factory is dataclasses.MISSING]
            part = kind(*(0.5 for _ in fields))
            for key, address in addresses(part).items():
                if address:
                    yield f"{name} {key}", address, row_of(part, *handed)


def component_kernels() -> Iterator[tuple[str, int, np.ndarray]]:
    """The same for the example of each component, and for the film of oil in a joint."""
    oil = sd.slider_crank().with_clearance("slider pin", sd.Clearance(1e-4, lubrication=sd.Lubrication(viscosity=0.05)))
    parts = [*oil.exerting]
    for kind in (kind for kind in COMPONENTS.values() if kind.declaration.section in PARTS):
        declared = kind.declaration
        table = {"name": "part", **declared.example}
        table.pop("length" if declared.section == "rod" else "", None)
        parts.append(PARTS[declared.section].reader.func(table, types.SimpleNamespace(context=None)))
    for part in parts:
        numbers = part.parameters(tuple(0.3 + 0.1 * k for k in range(len(part.declaration.port.coordinates))))
        found, row = kernels_of(type(part), len(numbers)), np.zeros(max(64, len(numbers)))
        row[: len(numbers)] = numbers
        for key in ("force", "gap", "switch"):
            if getattr(found, key):
                yield f"{type(part).__name__} {key}", getattr(found, key), row


KERNELS = [*law_kernels(), *component_kernels()]


def test_every_law_controller_and_component_gives_the_same_in_c(tmp_path):
    """Cross-check: each kernel at 60 random inputs, in C and as numba compiles it from the same source."""
    unit = Unit()
    numbers = [unit.kernel(recipe_of(address)) for _, address, _ in KERNELS]
    library = loaded(unit.text() + ASKED, tmp_path, "laws")
    library.asked.restype = ctypes.c_double
    random = np.random.default_rng(1)
    assert len(KERNELS) > 70
    for (name, address, row), number in zip(KERNELS, numbers, strict=True):
        ours = KERNEL(address)
        for _ in range(60):
            size = 10.0 ** random.uniform(-7, 1)
            inputs = [random.uniform(-1, 1, 24) * size for _ in range(4)]
            inputs[0][0] = abs(inputs[0][0]) if name.partition(" ")[0] in (*ELASTIC, *DAMPING) else inputs[0][0]
            answers = []
            for call in (ours, lambda *given, number=number: library.asked(number, *given)):
                out = np.zeros(24)
                given = [np.array(each) for each in (*inputs, row, out)]
                answer = call(*(each.ctypes.data_as(POINTER) for each in given))
                answers.append(np.append(given[-1], answer))
            assert np.allclose(*answers, rtol=1e-12, atol=1e-300, equal_nan=True), name


def machines():
    loose = sd.Clearance(4e-4, friction=sd.LuGre(kinetic=0.05))
    crank = sd.slider_crank(slider_inertia=1e-4)
    channel = sd.GuideClearance(2e-4, length=0.04, width=0.02, friction=sd.Ambrosio(kinetic=0.1))
    spring = sd.Spring("spring", ("rod", "end"), ("ground", "origin"), stiffness=400.0, free_length=0.1, damping=3.0)
    stop = sd.AngleStop("stop", "rod", angle=-0.3)
    servo = sd.slider_crank().with_clearance("crank pin", loose)
    arm = sd.scissor(units=2).with_clearance("A", loose)
    return {
        "slider-crank": sd.slider_crank().with_clearance("all", loose).driven(speed=100.0),
        "channel": crank.with_clearance("guide", channel).driven(speed=50.0),
        "parts": sd.Mechanism(
            crank.bodies, crank.joints, crank.guides, ground=crank.ground, components=(spring, stop), input_body="crank"
        ),
        "servo": servo.controlled(sd.PID(50.0, 3.0, 20.0), reference=sd.Harmonic(0.3, 0.2, 10.0)),
        "scissor": arm.driven(sd.Cycloidal(sd.degrees(30), sd.degrees(60), 0.5)),
        "bars that bend": arm.with_bending("all", section="tube 60x60x1.5 mm", material="aluminium", mass="section").driven(
            speed=3.0
        ),
        "oil": sd.slider_crank()
        .with_clearance("slider pin", sd.Clearance(1e-4, lubrication=sd.Lubrication(viscosity=0.05)))
        .driven(speed=60.0),
    }


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
    library = loaded(Source(found, driver, tolerance=1e-8, token="test").text + RATES, tmp_path, name)
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
    """Operators whose meaning differs between Python and C."""
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


def test_operators_have_the_meaning_of_python(tmp_path):
    """Identity: quotients and remainders of negative numbers, chains of comparisons, tuples, loops."""
    unit = Unit()
    unit.function(arithmetic, (INT, INT, FLOAT, FLOAT), "asked_for")
    made = next(iter(unit.made.values()))
    export = (
        f'__attribute__((visibility("default"))) void both(int64_t i, int64_t j, double x, double y, double *out) {{'
        f" {made.body.result.c} r = asked_for(i, j, x, y); out[0] = r.e0; out[1] = r.e1; out[2] = r.e2; out[3] = r.e3;"
        " out[4] = r.e4; out[5] = r.e5; }"
    )
    library = loaded(unit.text() + export, tmp_path, "operators")
    for i, j, x, y in ((7, 2, 0.3, 0.7), (-7, 2, 2.5, -0.4), (7, -2, -2.5, 0.4), (-3, -2, 1.0, 0.1), (2, 5, -0.2, 3.0)):
        out = np.zeros(6)
        library.both(
            ctypes.c_int64(i), ctypes.c_int64(j), ctypes.c_double(x), ctypes.c_double(y), out.ctypes.data_as(ctypes.c_void_p)
        )
        exact = arithmetic(i, j, x, y)
        assert np.allclose(out, [complex(each).real for each in exact], rtol=1e-15, atol=1e-15), (i, j, x, y)


def unknown(x):
    return sorted([x])[0]


def test_what_is_not_translated_is_one_line():
    """Identity: a kernel with a list is refused by its name."""
    with pytest.raises(InputError, match="List in a kernel") as error:
        Unit().function(unknown, (FLOAT,))
    assert "\n" not in str(error.value)
