"""Each port alone: rates, gradients, curvature and the work of its forces, compared with differences of its coordinates."""

import math

import numpy as np
import pytest

from scissordyn.components.port import FRAME, HINGE, LINE, POINT, TRAVEL, frame, hinge, line, point, travel

# Ports with the modules of their functions, by name
PORTS = {
    "line": (LINE, line),
    "hinge": (HINGE, hinge),
    "travel": (TRAVEL, travel),
    "point": (POINT, point),
    "frame": (FRAME, frame),
}
SEEDS = range(3)  # Seeds of random positions


def at(seed):
    """Return maps u, a, b with unit directions, their rates as those of two rotating bodies, and both speeds."""
    rng = np.random.default_rng(seed)
    first, second = rng.uniform(-3.0, 3.0, 2)
    speeds = rng.normal(size=2)
    u, v = rng.normal(size=2), rng.normal(size=2)
    a, b = np.array([math.cos(first), math.sin(first)]), np.array([math.cos(second), math.sin(second)])
    turned = [speed * np.array([-d[1], d[0]]) for speed, d in zip(speeds, (a, b), strict=True)]
    return np.concatenate([u, a, b]), np.concatenate([v, *turned]), speeds


def sensed(name, maps, rates):
    """Return coordinates and rates of a port; the angle is that from b to a."""
    port, module = PORTS[name]
    q, v = np.zeros(4), np.zeros(4)
    _, _, ax, ay, bx, by = maps
    module.sense((*maps, *rates), math.atan2(bx * ay - by * ax, bx * ax + by * ay), q, v)
    count = len(port.coordinates)
    return q[:count], v[:count]


def slopes(function, x, h=1e-6):
    """Return central differences, shape (results, arguments)."""
    columns = []
    for c in range(x.size):
        up, down = x.copy(), x.copy()
        up[c] += h
        down[c] -= h
        columns.append((np.asarray(function(up)) - np.asarray(function(down))) / (2.0 * h))
    return np.stack(columns, axis=1)


def gradients(name, maps, rates):
    """Return the port's gradients of coordinates and of rates by the maps."""
    port, module = PORTS[name]
    G, R = np.zeros((4, 6)), np.zeros((4, 6))
    module.gradients((*maps, *rates), G, R)
    return G[: len(port.coordinates)], R[: len(port.coordinates)]


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("name", PORTS)
def test_gradients(name, seed):
    """Cross-check: analytic gradients of coordinates and of rates by the maps equal central differences.

    An angle depends on directions only: its gradient along the radius of a map is zero.
    """
    maps, rates, _ = at(seed)
    G, R = gradients(name, maps, rates)
    by_maps = slopes(lambda x: sensed(name, x, rates)[0], maps)
    assert pytest.approx(by_maps, abs=1e-8) == G
    assert pytest.approx(slopes(lambda x: sensed(name, x, rates)[1], maps), abs=1e-8) == R
    # the rates follow from the gradients
    assert sensed(name, maps, rates)[1] == pytest.approx(G @ rates, abs=1e-12)
    assert slopes(lambda x: sensed(name, maps, x)[1], rates) == pytest.approx(G, abs=1e-8)


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("name", PORTS)
def test_forces_do_the_work_of_their_coordinates(name, seed):
    """Identity: forces on the maps are the gradients times the port's forces; a tension counts against its length."""
    port, module = PORTS[name]
    maps, rates, speeds = at(seed)
    out = np.random.default_rng(seed + 10).normal(size=4)
    q, v = sensed(name, maps, rates)
    G, _ = gradients(name, maps, rates)
    forces = np.array(module.forces((*maps, *rates), q, out))
    count = len(port.forces)
    assert forces == pytest.approx(port.sense * G[:count].T @ out[:count], abs=1e-12)
    # the same as a force on the first body's point and torques on both bodies
    along = np.array([0.6, 0.8])
    fx, fy, torque_a, torque_b = module.wrench((*maps, *rates), along, out, forces[0], forces[1])
    moved = rates[0] * along if name == "travel" else rates[:2]
    power = fx * moved[0] + fy * moved[1] + torque_a * speeds[0] + torque_b * speeds[1]
    assert power == pytest.approx(port.sense * out[:count] @ v[:count], abs=1e-12)


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("name", PORTS)
def test_curvature(name, seed):
    """Cross-check: the change of the maps' forces at constant port forces equals central differences."""
    _, module = PORTS[name]
    maps, rates, _ = at(seed)
    out = np.random.default_rng(seed + 20).normal(size=4)

    def forces(x):
        return module.forces((*x, *rates), sensed(name, x, rates)[0], out)

    K = np.ones((6, 6))  # it is added to what is there
    G, _ = gradients(name, maps, rates)
    module.curvature(sensed(name, maps, rates)[0], out, np.vstack([G, np.zeros((4 - len(G), 6))]), K)
    assert pytest.approx(slopes(forces, maps), abs=1e-8) == K - 1.0


def test_line_without_length():
    """Limit: at zero distance there is no direction and no force; the rate is the speed at which the points separate."""
    maps, rates = np.array([0.0, 0.0, 1.0, 0.0, 1.0, 0.0]), np.array([0.3, -0.4, 0.0, 0.0, 0.0, 0.0])
    q, v = sensed("line", maps, rates)
    assert (q[0], v[0]) == (0.0, pytest.approx(0.5))
    assert line.forces((*maps, *rates), q, np.ones(4)) == (0.0,) * 6
    G, R = gradients("line", maps, rates)
    assert not np.any(G)
    assert not np.any(R)
    K = np.zeros((6, 6))
    line.curvature(q, np.ones(4), np.zeros((4, 6)), K)
    assert not np.any(K)


@pytest.mark.parametrize("name", PORTS)
def test_coordinates_at_the_start(name):
    """Cross-check: coordinates from placed points and angles equal those sensed on the maps of the port."""
    from types import SimpleNamespace

    port, _ = PORTS[name]
    places = {("one", "p"): (0.3, -0.2), ("two", "q"): (-0.5, 0.7)}
    angles = {"one": 0.4, "two": -1.1}
    component = SimpleNamespace(
        declaration=SimpleNamespace(port=port),
        start=("one", "p"),
        end=("two", "q"),
        point=("two", "q"),
        body="two",
        base="one",
        direction=0.6,
    )
    maps = np.zeros(6)
    for part in port.attachments(component):
        if part.what == "place":
            value = np.array(places[part.body, part.point])
            if part.along is not None:
                value = np.array([value @ (math.cos(part.along), math.sin(part.along)), 0.0])
        else:
            value = np.array([math.cos(angles[part.body]), math.sin(angles[part.body])])
        maps[part.row : part.row + 2] += part.sign * value
    found = port.start(component, lambda where: places[where], lambda body: angles[body])
    assert sensed(name, maps, np.zeros(6))[0] == pytest.approx(found, abs=1e-14)
    (first, first_point), (second, _) = port.ends(component)
    assert first == "two"
    assert first_point == (None if name == "hinge" else "q")
    if port.angle:
        assert second == "one"
