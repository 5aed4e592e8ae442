"""Searches along derivatives: an optimum that is known, fewer runs than with differences, and when they are used."""

import dataclasses
import math

import pytest
from tests.build import one_line_error

import scissordyn as sd
from scissordyn.laws.damping.none import NoDamping
from scissordyn.laws.elastic.linear import Linear
from scissordyn.studies.ask.requirement import Goal, Optimisation

STIFFNESS, SPEED, IMPULSE = 1e7, 0.5, 0.6  # Contact stiffness [N/m], speed at the start [m/s] and impulse [N s]

OPTIONS = sd.Options(0.0035, "as-placed", 2, 1e-9, 1e-9, "dop853")  # Options of the runs of a search


def searched(store, *further, generations=40):
    """Search for the smallest force with which an elastic impact turns a ball back that has a given momentum."""
    ball = sd.Body("ball", 1.0, 1e-3, points={"centre": (0.0, 0.0)}, position=(0.0, 0.0), velocity=(SPEED, 0.1))
    gap = sd.Clearance(1e-3, journal_radius=0.01, stiffness=Linear(STIFFNESS), damping=NoDamping(), friction=sd.NoFriction())
    hole = sd.Revolute("hole", ("ball", "centre"), ("ground", "middle"), clearance=gap)
    mechanism = sd.Mechanism(bodies=(ball,), joints=(hole,), ground=(("middle", (0.0, 0.0)),), gravity=0.0)
    return sd.study(
        mechanism,
        {"body.ball.velocity.y": (-0.3, 0.5), "body.ball.mass": (0.2, 2.0)},
        options=OPTIONS,
        requirements=[f"impulse > {IMPULSE} N s", *further],
        goals="minimise peak_force",
        search="gradient",
        generations=generations,
        store=store,
    )


def test_the_known_optimum(tmp_path):
    """Closed form: force v sqrt(k m), impulse 2 m v; the ball flies straight on, and has just the mass that is needed."""
    found = searched(tmp_path / "exact.db")
    best = found.optimum.points.isel(point=found.optimum.best)
    assert best["minimise peak_force"].item() == pytest.approx(math.sqrt(STIFFNESS * IMPULSE * SPEED / 2.0), rel=1e-7)
    assert best["body.ball.mass"].item() == pytest.approx(IMPULSE / (2.0 * SPEED), rel=1e-6)
    assert best["body.ball.velocity.y"].item() == pytest.approx(0.0, abs=1e-3 * SPEED)
    ended = found.store.search()
    assert ended == {"converged": True, "failure": "", "gradients": found.study.points, "differences": 0, "reasons": []}
    assert found.study.points <= 10


def test_differences_are_used_with_a_reason(tmp_path):
    """Contract: the same search where a requirement has no derivatives, with a reason; it can be interrupted and continued."""
    count = "contact_count < 100"
    begun = searched(tmp_path / "search.db", count, generations=5)
    assert not begun.store.search()["converged"]
    found = searched(tmp_path / "search.db", count)
    best = found.optimum.points.isel(point=found.optimum.best)
    assert best["minimise peak_force"].item() == pytest.approx(math.sqrt(STIFFNESS * IMPULSE * SPEED / 2.0), rel=1e-5)
    ended = found.store.search()
    assert (ended["converged"], ended["gradients"]) == (True, 0)
    assert ended["reasons"] == ["'contact_count' has no derivatives: it is a count"]


def contacted(store, vary, goal, requirements):
    """Return a search for a ball that meets its bearing along x; its first contact and largest force have closed forms."""
    ball = sd.Body("ball", 1.0, 1e-3, points={"centre": (0.0, 0.0)}, position=(0.0, 0.0), velocity=(SPEED, 0.0))
    gap = sd.Clearance(1e-3, journal_radius=0.01, stiffness=Linear(STIFFNESS), damping=NoDamping(), friction=sd.NoFriction())
    hole = sd.Revolute("hole", ("ball", "centre"), ("ground", "middle"), clearance=gap)
    mechanism = sd.Mechanism(bodies=(ball,), joints=(hole,), ground=(("middle", (0.0, 0.0)),), gravity=0.0)
    named = {"goals": goal, "requirements": requirements, "search": "gradient", "generations": 30, "store": store}
    return sd.study(mechanism, vary, options=dataclasses.replace(OPTIONS, until=6e-3), **named)


@pytest.mark.parametrize(
    ("vary", "goal", "requirements", "optimum"),
    [
        (
            {"hole.stiffness.stiffness": (5e6, 2e7), "ball.velocity.x": (0.3, 0.7)},
            "minimise hole.first_contact",
            ["peak_force < 1200 N"],
            (5e6, 1200.0 / math.sqrt(5e6)),
        ),
        ({"ball.velocity.x": (0.05, 0.7)}, "minimise peak_force", ["hole.first_contact < 4 ms"], (0.25,)),
        (
            {"ball.mass": (0.5, 2.0), "ball.velocity.x": (0.3, 0.7)},
            "minimise hole.impulse",
            ["peak_force > 1200 N", "hole.first_contact > 2.2 ms"],
            (1200.0**2 / STIFFNESS * 2.2**2, 1.0 / 2.2),
        ),
    ],
)
def test_an_active_requirement(tmp_path, vary, goal, requirements, optimum):
    """Closed form: the best point is where requirements and bounds are just met; it was an earlier one, up to 50 % off.

    SLSQP ends within its tolerance of a requirement, on either side. The best point has to meet all requirements.
    """
    found = contacted(tmp_path / "active.db", vary, goal, requirements)
    best = found.optimum.points.isel(point=found.optimum.best)
    assert [best[name].item() for name in vary] == pytest.approx(optimum, rel=1e-6)
    assert best["violation"].item() == 0.0
    assert found.store.search()["converged"]


def test_a_search_from_a_point_without_a_value(tmp_path):
    """Contract: where no point near the start has a contact, the search has not converged, and says why."""
    found = contacted(tmp_path / "none.db", {"ball.velocity.x": (0.05, 0.25)}, "minimise hole.first_contact", [])
    ended = found.store.search()
    assert (ended["converged"], ended["failure"]) == (False, "the last point has no value")
    with one_line_error(match="no point has a value of the goal"):
        _ = found.best


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"method": "gradients"}, r"method 'gradients' of an optimisation \(did you mean 'gradient'\?\)"),
        ({"method": "gradient", "population": 8}, "an optimisation with a population by gradients"),
        ({"method": "gradient", "goals": (Goal("peak_force"), Goal("mass"))}, "an optimisation with 2 goals by gradients"),
    ],
)
def test_errors(options, message):
    """Contract: a search that is not one along derivatives is refused in one line."""
    with one_line_error(match=message):
        Optimisation(**{"goals": (Goal("peak_force"),), **options})
