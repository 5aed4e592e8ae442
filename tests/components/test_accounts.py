"""Energies of components; the balance of a run adds them up and cannot notice that one is wrong."""

from __future__ import annotations

import inspect
import math

import numpy as np
import pytest

import scissordyn as sd
from scissordyn.components.catalogue import COMPONENTS
from scissordyn.components.declaration import Component
from scissordyn.components.port import LINE

from .shared import ENDS as BALL
from .shared import ball_on
from .test_user import own

ENDS = ("one", "start"), ("other", "start")  # End points of components between two bodies
HINGED = "one", "other"  # Two bodies between which rotational components act
# Points (angle [rad], radius [m]) of the profile of an eccentric cam
PROFILE = tuple((math.radians(angle), 0.08 + 0.02 * math.cos(math.radians(angle))) for angle in range(0, 361, 30))

# One component of each passive class
PARTS: tuple[Component, ...] = (
    sd.Spring("spring", *ENDS, stiffness=80.0, free_length=0.4, damping=3.0),
    sd.ConstantForceSpring("drum", *ENDS, tension=20.0, uncoiling_length=0.6, damping=2.0),
    sd.NonlinearSpring("curve", *ENDS, ((0.05, -3.0), (0.3, 0.0), (0.6, 9.0), (1.0, 11.0)), damping=2.0),
    sd.GasSpring("strut", *ENDS, 60.0, 0.9, 0.85, 1.6, 1.3, friction=4.0, friction_speed=0.1, damping=2.0),
    sd.Cable("cable", *ENDS, stiffness=500.0, free_length=0.4, damping=60.0),
    sd.TorsionSpring("hinge", *HINGED, stiffness=5.0, free_angle=0.3, damping=0.4),
    sd.TapeSpring("tape", *HINGED, 20.0, 2.0, 0.3, 0.8, 0.2, 0.1),
    sd.PinFriction("pin", *HINGED[:1], 0.2, 0.3, HINGED[1], 0.5, 0.2, 0.1),
    sd.GuideFriction("rail", *ENDS, 0.4, 0.3, 0.5, 0.2, 0.1),
    sd.Bushing("bush", *ENDS, 40.0, 60.0, 5.0, 3.0, 0.5, 0.7, 0.1, 0.2),
    sd.Beam("beam", *ENDS, 0.5, 200.0, 3.0, 1.0),
    sd.Roller("wheel", ("one", "start"), "other", stiffness=70.0, damping=2.0),
    sd.Roller("guide", ("one", "start"), "other", stiffness=70.0, clearance=0.3, restitution=0.4),
    sd.AngleStop("stop", "one", 0.2, "other", stiffness=1e3, restitution=0.4),
    sd.Cam("cam", *ENDS, PROFILE, roller=0.01, stiffness=70.0, exponent=1.2, restitution=0.4),
    sd.TravelStop("end", ("one", "start"), direction=0.3, limit=0.2, stiffness=1e4, restitution=0.4),
    sd.Drag("air", ("one", "start"), 0.3, 0.5, 0.2, 4.0),
)


# Values of the arguments that depend on the state of a contact or load, by name
CONTEXT = {"approach_speed": 1.5, "effective_mass": 20.0, "factor": 0.7, "factor_rate": 0.0, "reaction": 30.0}


def test_every_passive_component_is_here():
    """Identity: a component with energies of its own has its account tested; one with states or laws has a test of its own."""
    declared = {kind: kind.declaration for kind in COMPONENTS.values()}
    passive = {kind for kind, each in declared.items() if each.passive and each.force and not (each.states or each.contact)}
    assert {type(part) for part in PARTS} == passive


@pytest.mark.parametrize("part", PARTS, ids=lambda part: part.name)
@pytest.mark.parametrize("mode", [0.0, 1.0])
def test_power_is_stored_or_dissipated(part, mode):
    """Identity: the forces' power is minus the growth of the stored energy minus the dissipation, which is never negative.

    The growth is the derivative of the energy by the coordinates, by differences, times their rates.
    """
    declared, random = part.declaration, np.random.default_rng(7)
    forces, coordinates = len(declared.port.forces), len(declared.port.coordinates)
    kernel = getattr(declared.force, "py_func", declared.force)
    start = (0.1, *(1.0,) * (coordinates - 1))
    given = part.parameters(start)
    names = list(inspect.signature(kernel).parameters)
    fixed = {**dict(zip(declared.numbers, given, strict=False)), "table": np.array(given), **CONTEXT, "mode": mode}
    for _ in range(200):
        q, v = random.uniform(0.05, 1.0, coordinates), random.uniform(-2.0, 2.0, coordinates)

        def answer(at: np.ndarray, rates: np.ndarray = v) -> np.ndarray:
            varying = zip((*declared.port.coordinates, *declared.port.rates), (*at, *rates), strict=True)
            values = {**fixed, **dict(varying)}
            return np.array(kernel(*(values[name] for name in names)))

        found, step = answer(q), 1e-7
        growth = sum(
            (answer(q + step * row)[forces] - answer(q - step * row)[forces]) / (2.0 * step) * rate
            for row, rate in zip(np.eye(coordinates), v, strict=True)
        )
        power = found[:forces] @ v[:forces] * (-1.0 if declared.port is LINE else 1.0)
        dissipation = found[forces + 1]
        assert dissipation >= 0.0
        assert power == pytest.approx(-growth - dissipation, rel=1e-5, abs=1e-5)


def pushing(length, rate, strength):
    """Return force, stored energy and dissipation of a damper with negative coefficient, whose dissipation is negative."""
    return -strength * rate, 0.0, -strength * rate * rate


Pusher = own("Pusher", "line", pushing, {"strength": "N s/m"})


def test_a_component_that_gives_energy_is_named():
    """Limit: the energy balance of a negative damper closes; the loss that falls is a warning."""
    coil = sd.Spring("coil", *BALL, stiffness=200.0, free_length=0.4)
    run = sd.simulate(ball_on(coil, Pusher("pusher", *BALL, 4.0)), until=1.0)
    assert float(np.max(np.abs(run["energy_residual"]))) < 1e-6 * float(np.max(run["kinetic_energy"]))
    assert "a component gives energy: damper_loss falls by" in run.attrs["warnings"]
    assert sd.simulate(ball_on(coil), until=1.0).attrs["warnings"] == "[]"
