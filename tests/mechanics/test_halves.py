"""Records of samples that two threads evaluate."""

from __future__ import annotations

import numpy as np
import pytest

import scissordyn as sd
from scissordyn.mechanics.outputs import record, record_in_halves
from scissordyn.plan.plan import plan
from scissordyn.run.trajectory import compute

TUBE = {"section": "tube 60x60x1.56 mm", "material": "steel", "modes": 2}

GAPS = {
    "compliant": sd.Clearance(5e-4),
    "bristles": sd.Clearance(5e-4, friction=sd.LuGre(0.05)),
    "hard": sd.Clearance(5e-4, contact="hard", friction=sd.NoFriction()),
    "oil": sd.Clearance(5e-4, friction=sd.NoFriction(), lubrication=sd.Lubrication(viscosity=0.1)),
}


@pytest.mark.parametrize("kind", [*GAPS, "chain", "delayed"])
def test_halves_are_those_of_one_thread(kind):
    """Identity: each sample determines its record alone, to the bit, whatever was evaluated before it."""
    how = TUBE | {"damping": 1e-6} | ({"modes": "auto", "elements": 2} if kind == "chain" else {})
    loose = sd.scissor(units=2).with_clearance("A", GAPS.get(kind, GAPS["compliant"]))
    bent = sd.with_bending(loose, **how)
    driven = bent.driven(speed=sd.rpm(150))
    if kind == "delayed":
        driven = bent.controlled(sd.Pyragas(500.0, 1e-3), reference=sd.Cycloidal(0.0, 0.5, 0.05))
    path = compute(plan(driven), sd.Options(4e-3, samples=41))
    assert path.status == "complete"
    assert kind in ("oil", "delayed") or 0 < np.sum(path.samples.mode[:, 0]) < 41
    found, expected = (make(path.plan.maps, path.system, path.samples) for make in (record_in_halves, record))
    for name in expected._fields:
        assert getattr(found, name).tobytes() == getattr(expected, name).tobytes(), name
