"""Slopes written by hand against dual numbers: energies, rates of gaps, gradients and forces of ports, time functions."""

import numpy as np
import pytest
from tests.compiler.test_c import KERNELS
from tests.compiler.test_dual import elements
from tests.compiler.test_dual import with_derivatives as slopes_of

from scissordyn.components.catalogue import COMPONENTS
from scissordyn.components.port import LINE
from scissordyn.plugin.element import RECIPES

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
