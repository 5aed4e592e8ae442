"""Derivatives through contacts of many laws at once, whose impacts overlap, against differences of runs."""

import dataclasses
import math
import re
from pathlib import Path

import numpy as np
import pytest

import scissordyn as sd
from scissordyn.model.parameter_path import changed
from scissordyn.plan.plan import plan
from scissordyn.run.advance.loop import advance
from scissordyn.run.trajectory import make_driver
from scissordyn.sensitivity.forward import forward
from scissordyn.sensitivity.seed import Start, derivatives, parameter_of

LAWS = (
    ("hertz", "flores", "ambrosio"),
    ("johnson", "hunt-crossley", "threlfall"),
    ("persson", "standard-linear-solid", "coulomb"),
    ("liu", "gonthier", "lugre"),
    ("linear", "kelvin-voigt", "dahl"),
    ("esdu-78035", "lankarani-nikravesh", "elasto-plastic"),
    ("radzimovsky", "flores", "brown-mcphee"),
    ("pereira", "hu-guo", "gonthier-bristle"),
)
"""Elastic, damping and friction law of each tested joint."""

# Values of parameters without a default, in SI units
NEEDED = {"restitution": 0.7, "kinetic": 0.1, "static": 0.15, "stiffness": 1e9, "damping": 1e3, "exponent": 1.5}
NEEDED |= {"bristle_stiffness": 1e5, "relaxation_stiffness": 1e8, "relaxation_time": 1e-5}
"""Values of parameters without default."""

STEP = 3e-3  # Relative step of differences


def chosen(slot, name):
    law = sd.law(slot, name)
    missing = dataclasses.MISSING
    needed = [field.name for field in dataclasses.fields(law) if field.default is field.default_factory is missing]
    return law(**{key: NEEDED.get(key, 1.0) for key in needed})


def journals():
    """Return turning journals that strike their bearings obliquely, one after another."""
    bodies, joints = [], []
    for k, (elastic, damping, friction) in enumerate(LAWS):
        laws = {"stiffness": chosen("stiffness", elastic), "damping": chosen("damping", damping)}
        reference = "onset" if k % 2 else "loaded"
        gap = sd.Clearance(1e-3, journal_radius=0.01, friction=chosen("friction", friction), reference=reference, **laws)
        points, start = {"c": (0.0, 0.0)}, {"position": (0.0, 0.0), "velocity": (0.4 + 0.04 * k, 0.1), "angular_velocity": 20.0}
        bodies.append(sd.Body(f"b{k}", 1.0, 1e-4, points=points, **start))
        joints.append(sd.Revolute(f"b{k}", (f"b{k}", "c"), ("ground", "o"), clearance=gap))
    return sd.Mechanism(bodies=tuple(bodies), joints=tuple(joints), ground=(("o", (0.0, 0.0)),), gravity=9.81)


def test_contacts_of_many_laws():
    """Cross-check: coordinates and rates after all impacts, by each clearance."""
    mechanism, options = journals(), sd.Options(0.0036, "as-placed", 2, 1e-12, 1e-12, "dop853", events="located")
    begin, paths = Start(mechanism, "as-placed"), [f"b{k}.clearance" for k in range(len(LAWS))]
    run = forward(plan(mechanism), options, [derivatives(begin, parameter_of(mechanism, path, 1.0)) for path in paths])
    assert len(run.log) == 2 * len(LAWS)
    n = plan(mechanism).coordinates.free
    for k, path in enumerate(paths):
        slope = np.zeros(2 * n)
        for place, weight in ((1, 0.75), (2, -0.15), (3, 1.0 / 60.0)):
            for sign in (1.0, -1.0):
                driver, _, _ = make_driver(plan(changed(mechanism, path, 1e-3 * (1.0 + sign * place * STEP))), options)
                advance(driver, options.until)
                slope += sign * weight / STEP * driver.state.y[: 2 * n]
        for part in (slice(n), slice(n, 2 * n)):
            assert run.state[part, k] == pytest.approx(slope[part], abs=2e-7 * np.max(np.abs(slope[part])))


PAGE = Path(__file__).parents[2] / "docs" / "howto" / "own_elements.md"  # Page about user-defined elements


@pytest.mark.parametrize("question", ["equals(exponent, 2.0)", "exponent == 2.0"])
def test_formula_for_one_value_of_a_parameter(question, tmp_path):
    """Closed form: the page's law keeps the derivative of the largest force by its exponent; a comparison by value loses it."""
    (code,) = re.findall(r"^```python\n# power\.py\n(.*?)^```", PAGE.read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL)
    assert "equals(exponent, 2.0)" in code
    file = tmp_path / "power.py"
    file.write_text(code.replace("equals(exponent, 2.0)", question), encoding="utf-8")
    stiffness, speed, n = 1e11, 0.5, 2.0
    law = sd.law("stiffness", f"{file}:power")(stiffness, n)
    wall = sd.Clearance(1e-3, stiffness=law, damping=sd.Flores(1.0), friction=sd.NoFriction())
    ball = sd.Body("ball", 1.0, 1e-3, {"centre": (0.0, 0.0)}, (0.0, 0.0), velocity=(speed, 0.0))
    hole = sd.Revolute("hole", ("ball", "centre"), ("ground", "middle"), clearance=wall)
    free = sd.Mechanism(bodies=(ball,), joints=(hole,), ground=(("middle", (0.0, 0.0)),), gravity=0.0)
    found = sd.gradient(free, of=["hole.peak_force"], by=["hole.stiffness.exponent"], until=3e-3, start="as-placed")
    energy = (n + 1.0) * speed**2 / (2.0 * stiffness)
    exact = n * (math.log(energy) / (n + 1.0) ** 2 + n / (n + 1.0) ** 2)
    assert found["elasticity"].item() == (pytest.approx(exact, rel=1e-6) if "equals" in question else 0.0)
