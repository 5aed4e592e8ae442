"""The best parameter set by a second formulation: Lagrange's equations in minimal coordinates, laws in plain Python."""

import dataclasses
import math

import numpy as np
import pytest
from scipy.optimize import brentq

from reference.lagrange import Array, constant_speed
from reference.laws import flores, hertz, lankarani_nikravesh, liu
from reference.marching import ClearanceJoint, March, march_in_steps
from scissordyn.laws.material import MATERIALS
from scissordyn_paper.cases import DEFAULT, SIZES, SPEEDS, PaperCase
from scissordyn_paper.results import BEST
from scissordyn_paper.runs import compute

# Choice of parameters that differs from the best set
OTHER = dataclasses.replace(
    DEFAULT, driven_bar="slider", stiffness="bai-zhao-as-printed", damping="gonthier", restitution=0.7, gravity=0.0,
    bearing_material="bronze", travel="falling", angle=math.radians(70.0), method="dopri5", step=2e-5, tolerance=1e-6,
)  # fmt: skip


def modulus(choice):
    """Return E* of journal and bearing [Pa]."""
    materials = MATERIALS[choice.material], MATERIALS[choice.bearing_material or choice.material]
    return 1.0 / sum((1.0 - one.poisson_ratio**2) / one.youngs_modulus for one in materials)


def elastic(choice, c):
    """Return the elastic part of the normal force."""
    if choice.stiffness == "liu":
        return liu(c, choice.bearing_length, modulus(choice))
    if choice.stiffness == "hertz":
        return hertz(c, choice.journal_radius, modulus(choice))
    slope = math.pi * modulus(choice) / 8.0
    return lambda d: slope * math.sqrt(2.0 * d * (3.0 * c + 2.0 * d) ** 2 / (c + d) ** 3) * d**1.5


def damping(choice):
    """Return the damping factor xi; Gonthier's follows from its equation."""
    c = choice.restitution
    if choice.damping == "gonthier":
        rest = lambda d: math.log((1.0 + d / c) / (1.0 - d)) - d * (1.0 + 1.0 / c)  # noqa: E731
        return brentq(rest, 1e-2 * (1.0 - c), 1.0 - 1e-12, xtol=1e-15) / c
    if choice.damping == "zhiying-qishao":
        return 0.75 * (1.0 - c * c) * math.exp(2.0 * (1.0 - c))
    return {"flores": flores, "lankarani-nikravesh": lankarani_nikravesh}[choice.damping](c)


def contacts(case, until):
    """Return the contacts of a run without friction up to a time."""
    choice, c = case.choice, case.clearance
    joint = ClearanceJoint(c, choice.journal_radius, elastic(choice, c), damping(choice))
    speed = case.speed if choice.travel == "rising" else -case.speed
    array = Array(joint, constant_speed(choice.angle, speed), driven_bar=choice.driven_bar, gravity=choice.gravity)
    if choice.step:
        return march_in_steps(array, until, choice.step)
    return March(array, rtol=1e-11, atol=1e-11).run(until).contacts


# Cases of the paper with the best set of parameters
CASES = [PaperCase(size, choice=BEST) for size in SIZES] + [
    PaperCase(speed=speed, choice=BEST) for speed in (SPEEDS[0], SPEEDS[2])
]


@pytest.mark.parametrize("case", [*CASES, PaperCase(choice=OTHER)], ids=lambda case: case.name)
def test_contacts_of_a_second_formulation(case):
    """Second formulation: starts, speeds and rebounds of the first contacts; each contact magnifies differences."""
    run = compute(case, trust=False)
    most = 5
    until = float(run["contact_start"].values[most - 1]) + 1e-9 if run.sizes["contact"] >= most else case.until
    step = case.choice.step
    expected = contacts(case, step * round(until / step) if step else until)[: most - 1]
    assert len(expected) >= 2
    for name, error in (("contact_start", 1e-4), ("approach_speed", 2e-3), ("rebound_speed", 2e-3)):
        values = [getattr(one, name.removeprefix("contact_")) for one in expected[:-1]]
        assert run[name].values[: len(values)] == pytest.approx(values, rel=error), name
    assert np.all(np.diff(run["contact_start"].values) > 0.0)
