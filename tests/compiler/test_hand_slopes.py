"""Slopes written by hand against dual numbers: energies, rates of gaps, gradients and forces of ports, time functions."""

import ctypes
import math

import numpy as np
import pytest
from tests.compiler.dual_system import number_type
from tests.compiler.test_c import KERNELS, QUICK
from tests.compiler.test_dual import elements, inputs_of
from tests.compiler.test_dual import with_derivatives as slopes_of

import scissordyn.components.time_function as sd_time
from scissordyn.compiler.c import load_source
from scissordyn.compiler.unit import Unit
from scissordyn.components.catalogue import COMPONENTS
from scissordyn.components.port import FRAME, HINGE, LINE, POINT, TRAVEL
from scissordyn.kernel import F1, Entry
from scissordyn.mechanics.port import add_port_curvature, port_forces, sense_port, write_port_gradients
from scissordyn.mechanics.time_function import function_at, function_rows
from scissordyn.plugin.element import RECIPES

# Name, pointer and parameters of the kernels that return an energy
POTENTIALS = [(name.removesuffix(" energy"), pointer, row) for name, pointer, row in KERNELS if name.endswith(" energy")]
FORCES = {name: pointer for name, pointer, _ in KERNELS}  # Pointers to all kernels by name


@pytest.mark.parametrize(("name", "pointer", "row"), POTENTIALS, ids=[name for name, _, _ in POTENTIALS])
def test_an_elastic_force_is_the_slope_of_its_energy(name, pointer, row):
    """Identity: dE/d(indentation) = F, from light contact to one as deep as the clearance."""
    energy, force = RECIPES[pointer], RECIPES[FORCES[f"{name} force"]]
    for depth in 4e-4 * 10.0 ** np.linspace(-5.0, 0.0, 41):
        inputs = np.zeros((4, 24))
        inputs[0, 0] = depth
        slope = slopes_of(elements()[energy], inputs, row, inputs_of(energy))[1][24, 0]
        exerted = slopes_of(elements()[force], inputs, row, inputs_of(force))[0][24]
        assert slope == pytest.approx(exerted, rel=1e-12), depth


# Name, pointer and parameters of the kernels that return a gap
GAPS = [(name.removesuffix(" gap"), pointer, row) for name, pointer, row in KERNELS if name.endswith(" gap")]


@pytest.mark.parametrize(("name", "pointer", "row"), GAPS, ids=[name for name, _, _ in GAPS])
def test_the_rate_of_a_gap_is_its_slope(name, pointer, row):
    """Identity: d(gap)/dt = sum of d(gap)/dq_k v_k, in each mode."""
    recipe, random = RECIPES[pointer], np.random.default_rng(3)
    for mode in (0.0, 1.0, -1.0, 2.0):
        inputs = random.uniform(-1.0, 1.0, (4, 24))
        inputs[3, 2] = mode
        values, slopes = slopes_of(elements()[recipe], inputs, row, [(0, k) for k in range(4)])
        assert values[1] == pytest.approx(slopes[0] @ inputs[1, :4], rel=1e-12)


# Ports whose coordinates have derivatives written by hand, by name
PORTS = {"line": LINE, "hinge": HINGE, "travel": TRAVEL, "point": POINT, "frame": FRAME}


def port_at(port: int, maps: F1, out: F1, q: F1, v: F1, forces: F1) -> None:
    """Compute coordinates and rates of a port from its six rows and their rates, and the forces of the port on the rows."""
    rows = maps[0], maps[1], maps[2], maps[3], maps[4], maps[5], maps[6], maps[7], maps[8], maps[9], maps[10], maps[11]
    angle = math.atan2(maps[3], maps[2]) - math.atan2(maps[5], maps[4])
    sense_port(port, rows, angle, q, v)
    forces[0], forces[1], forces[2], forces[3], forces[4], forces[5] = port_forces(port, rows, q, out)


@pytest.mark.parametrize("name", PORTS)
def test_the_slopes_of_a_port_are_exact(name):
    """Cross-check: gradients of coordinates and rates, and how forces change with the rows, at unit directions."""
    port, random, count = PORTS[name], np.random.default_rng(4), len(PORTS[name].coordinates)
    unit, entry = Unit(derivatives=12), Entry(port_at)
    unit.entry(entry)
    called = getattr(load_source(unit.text(), *QUICK), entry.symbol)
    maps, exerted = random.uniform(-1.0, 1.0, 12), random.uniform(-1.0, 1.0, 12)
    for k, angle in ((2, 0.7), (4, -1.9)):
        maps[k : k + 2] = math.cos(angle), math.sin(angle)
    arrays = [np.zeros((12, 13)) for _ in range(5)]
    arrays[0][:, 0], arrays[1][:, 0] = maps, exerted
    arrays[0][:, 1:] = np.eye(12)
    called.argtypes, called.restype = [ctypes.c_int64, *[ctypes.c_void_p, ctypes.c_int64] * 5], None
    called(port.code, *(word for array in arrays for word in (array.ctypes.data, len(array))))
    _, _, q, v, forces = arrays
    G, R, K = np.zeros((12, 6)), np.zeros((12, 6)), np.zeros((6, 6))
    write_port_gradients(port.code, tuple(maps.tolist()), G, R)
    add_port_curvature(port.code, q[:, 0], exerted, G, K)
    close = {"rtol": 1e-12, "atol": 1e-13}
    np.testing.assert_allclose(G[:count], q[:count, 1:7], **close)
    np.testing.assert_allclose(G[:count], v[:count, 7:], **close)
    np.testing.assert_allclose(R[:count], v[:count, 1:7], **close)
    np.testing.assert_allclose(K, forces[:6, 1:7], **close)


# Names of the component classes that store energy
STORES = (
    *("Spring", "ConstantForceSpring", "Cable", "TorsionSpring", "TapeSpring", "Bushing", "Beam", "Roller"),
    *("AngleStop", "TravelStop"),
)
# Declarations of the component classes in `STORES`, by name
BY_CLASS = {kind.__name__: kind.declaration for kind in COMPONENTS.values() if kind.__name__ in STORES}
# Name, pointer and parameters of the force kernels of the classes in `STORES`
STORING = [
    (name.removesuffix(" force"), pointer, row) for name, pointer, row in KERNELS if name.removesuffix(" force") in BY_CLASS
]


@pytest.mark.parametrize(("name", "pointer", "row"), STORING, ids=[name for name, _, _ in STORING])
def test_the_force_of_a_component_is_the_slope_of_its_energy(name, pointer, row):
    """Identity: dE/dq = -F at rest, and = F of a line, whose force is a tension; of a beam at rotations that an element has."""
    port, random, stored = BY_CLASS[name].port, np.random.default_rng(5), 0
    coordinates, forces = len(port.coordinates), len(port.forces)
    for trial in range(30):
        inputs = np.zeros((4, 24))
        inputs[0, :coordinates] = random.uniform(-1.0, 1.0, coordinates) * (1.0, 5.0)[trial % 2]
        inputs[3, 2:4] = (0.0, 1.0, -1.0)[trial % 3], 1.0
        if name == "Beam":
            inputs[0, :3] = 0.5 * (1.0 + 1e-3 * inputs[0, 0]), 1e-2 * inputs[0, 1], 1e-2 * inputs[0, 2]
        values, slopes = slopes_of(elements()[RECIPES[pointer]], inputs, row, [(0, k) for k in range(coordinates)])
        exerted = values[:forces] if port is LINE else -values[:forces]
        np.testing.assert_allclose(slopes[forces], exerted, rtol=1e-12, atol=1e-12 * np.max(np.abs(exerted)))
        stored += bool(values[forces] > 0.0)
    assert stored


def of_kinds() -> dict[str, sd_time.TimeFunction]:
    return {
        "constant speed": sd_time.ConstantSpeed(3.0),
        "harmonic": sd_time.Harmonic(0.1, 0.4, 5.0, 0.3),
        "polynomial": sd_time.Polynomial((0.1, -2.0, 0.5, 3.0, -1.0)),
        "cycloidal": sd_time.Cycloidal(0.2, 1.5, 1.0),
        "trapezoidal": sd_time.Trapezoidal(0.2, 1.5, 1.0, 0.3),
        "tabulated": sd_time.Tabulated(tuple(np.linspace(0.0, 1.0, 9)), tuple(np.sin(np.linspace(0.0, 3.0, 9)))),
    }


@pytest.mark.parametrize("kind", of_kinds())
def test_the_derivatives_of_time_functions_are_their_slopes(kind):
    """Identity: each of three derivatives is the slope of the one before."""
    unit, entry = Unit(derivatives=2), Entry(function_at.python)
    unit.entry(entry)
    called, rows = getattr(load_source(unit.text(), *QUICK), entry.symbol), function_rows(of_kinds()[kind], 0.7)
    number = number_type(2)
    called.argtypes, called.restype = [number, ctypes.c_void_p, *[ctypes.c_int64] * 3, ctypes.c_void_p, ctypes.c_int64], None
    table, value = np.zeros((*rows.shape, 3)), np.zeros((4, 3))
    table[..., 0] = rows
    for time in np.linspace(-0.1, 1.1, 37):
        called(number((ctypes.c_double * 3)(time, 1.0)), table.ctypes.data, *rows.shape, rows.shape[1], value.ctypes.data, 4)
        scale = 1.0 + np.max(np.abs(value[:, 0]))
        np.testing.assert_allclose(value[1:, 0], value[:-1, 1], rtol=1e-12, atol=1e-13 * scale)
