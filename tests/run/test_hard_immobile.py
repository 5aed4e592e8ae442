"""Hard contacts that cannot move along their tangent, rotation, estimates of forces, and what is said of a failed model."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest

import scissordyn as sd
from scissordyn.component.force import Force
from scissordyn.laws.damping.factors import LankaraniNikravesh
from scissordyn.mechanics import impulse_solver as solver
from scissordyn.model.body import Body
from scissordyn.model.joint import Guide, Revolute
from scissordyn.model.mechanism import Mechanism
from scissordyn.plan.plan import plan
from scissordyn.run.advance.trajectory import make_driver, model_failure
from scissordyn.run.answer.joint_force import joint_summaries
from scissordyn.run.answer.summary import summary_of
from scissordyn.run.options import Options

GAP, PUSH = 1e-3, 5.0

EXAMPLES = Path(__file__).parents[2] / "examples"


def sliders(count: int, angle: float, **laws: object) -> Mechanism:
    """Masses of 1 kg on one line, each hung in the one before by a hard loose pin, the first at the ground; pushed apart."""
    along = math.cos(angle), math.sin(angle)
    bodies = tuple(Body(f"m{i}", 1.0, None, {"c": (0.0, 0.0)}) for i in range(count))
    gaps = [sd.Clearance(GAP, damping=LankaraniNikravesh(0.5), contact="hard", **laws) for _ in bodies]
    ends = [("ground", "o"), *((body.name, "c") for body in bodies)]
    return Mechanism(
        bodies,
        joints=tuple(Revolute(f"p{i}", ends[i], ends[i + 1], gaps[i]) for i in range(count)),
        guides=tuple(Guide(f"g{i}", (body.name, "c"), direction=angle) for i, body in enumerate(bodies)),
        ground=(("o", (0.0, 0.0)),),
        components=(Force("push", ends[-1], (PUSH * along[0], PUSH * along[1])),),
        gravity=0.0,
    )


def counts(run) -> dict[str, object]:
    """Counters of a run."""
    return json.loads(run.attrs["statistics"])


@pytest.mark.parametrize("angle", [0.0, 0.5])
@pytest.mark.parametrize("friction", [{}, {"friction": sd.LuGre(kinetic=0.3)}])
def test_a_slider_in_a_pin_comes_to_rest(angle: float, friction: dict[str, object]) -> None:
    """Closed form: the impacts of a ball with e = 1/2 under F/m; friction across the line has no work to do."""
    run = sd.simulate(sliders(1, angle, **friction), until=0.1, start="concentric", step=2e-5)
    first = math.sqrt(2.0 * GAP / PUSH)
    expected = first * np.concatenate([[1.0], 1.0 + 2.0 * np.cumsum(0.5 ** np.arange(1, 8))])
    np.testing.assert_allclose(run["contact_start"].values[:8], expected, rtol=1e-9)
    assert counts(run)["steps_not_solved"] == 0
    assert float(run["damping_loss"][-1]) == pytest.approx(PUSH * GAP, rel=1e-9)
    assert run["normal_force"].values[-1, 0] == pytest.approx(PUSH, rel=1e-9)
    assert float(run["friction_loss"][-1]) == 0.0


@pytest.mark.parametrize("count", [3, 5])
def test_a_train_of_sliders_comes_to_rest(count: int) -> None:
    """Closed form: at the end every pin is taut and carries the push, whose work restitution has taken."""
    run = sd.simulate(sliders(count, 0.5), until=0.5, start="concentric")
    assert run.attrs["status"] == "complete"
    assert counts(run)["steps_not_solved"] == 0
    pins = [f"p{i}" for i in range(count)]
    np.testing.assert_allclose(run["normal_force"].sel(joint=pins).values[-1], PUSH, rtol=1e-6)
    work = float(run["load_work"][-1])
    assert work == pytest.approx(PUSH * count * GAP, rel=1e-3)
    assert float(run["damping_loss"][-1]) == pytest.approx(work, rel=2e-3)
    assert abs(float(run["energy_residual"][-1])) < 1e-4 * work


@pytest.mark.parametrize("offset", [0.0, 0.05])
@pytest.mark.parametrize("speed", [30.0, 300.0])
def test_a_free_rotor_keeps_its_speed(speed: float, offset: float) -> None:
    """Identity: at the default step a body that rotates freely, beside a hard contact, keeps speed, energy and phase."""
    bodies = (
        Body("rotor", 1.0, 0.01, {"o": (offset, 0.0), "a": (0.1, 0.0)}, angular_velocity=speed),
        Body("ball", 1.0, None, {"c": (0.0, 0.0)}, position=(1.0, 0.0)),
    )
    pin = Revolute("pin", ("ball", "c"), ("ground", "p"), sd.Clearance(GAP, damping=LankaraniNikravesh(0.5), contact="hard"))
    run = sd.simulate(
        Mechanism(bodies, joints=(pin,), ground=(("p", (1.0, 0.0)),), gravity=0.0), until=0.5, start="as-placed", samples=101
    )
    assert float(run["angular_velocity"].sel(body="rotor")[-1]) == pytest.approx(speed, rel=1e-6)
    assert float(np.ptp(run["angle"].sel(body="rotor").values)) == pytest.approx(0.5 * speed, rel=1e-6)
    assert float(np.abs(run["energy_residual"]).max()) < 2e-6 * float(run["kinetic_energy"][0])


def test_the_estimate_sees_impacts_through_closed_contacts() -> None:
    """Cross-check: a latch that locks throws a closed contact; its force is that of compliant contact without damping."""
    case = sd.read_case(EXAMPLES / "self_deploying.toml")
    peaks, options = {}, {"until": 0.7105, "samples": 11}
    for kind in ("hard", "compliant"):
        mechanism = case.mechanism
        for name in ("unit 1/pivot", "unit 3/pivot"):
            mechanism = mechanism.replace(f"{name}.contact", kind) if kind == "hard" else mechanism
            mechanism = mechanism if kind == "hard" else mechanism.replace(f"{name}.damping.restitution", 1.0)
        run = sd.simulate(mechanism, **options)
        own = run["contact_joint"].values == "unit 3/pivot"
        peaks[kind] = run["peak_force_estimate" if kind == "hard" else "peak_force"].values[own]
        if kind == "hard":
            assert not np.isnan(run["peak_force_estimate"].values[run["impulse"].values > 0.0]).any()
            when = (run["contact_start"] + run["peak_force_estimate_time"]).values[own][np.argmax(peaks[kind])]
            assert when == pytest.approx(0.7101, abs=5e-4)
    assert 0.6 < np.max(peaks["hard"]) / np.max(peaks["compliant"]) < 1.5


def test_losses_that_have_not_converged_are_said() -> None:
    """Contract: the part of the losses in contacts that follow each other within three steps, from the table of contacts."""
    run = sd.simulate(sliders(5, 0.0), until=0.2, start="concentric")
    (said,) = [text for text in json.loads(run.attrs["warnings"]) if "have not converged" in text]
    near, ends, unresolved = 3.0 * float(counts(run)["step"]), dict[str, float](), 0.0
    rows = zip(
        *(run[name].values for name in ("contact_joint", "contact_start", "contact_duration", "contact_damping_loss")),
        strict=True,
    )
    for joint, start, lasting, lost in rows:
        unresolved += lost if start < ends.get(joint, -1.0) + near else 0.0
        ends[joint] = start + lasting
    assert f"{unresolved:.3g} of {float(run['contact_damping_loss'].sum()):.3g} J" in said
    located = sd.simulate(sliders(1, 0.0), until=0.1, start="concentric")
    assert "converged" not in located.attrs["warnings"]


def test_a_run_with_many_unsolved_steps_has_failed() -> None:
    """Contract: one step in a thousand that is not solved is a warning, one in ten is a failure."""
    driver, _, _ = make_driver(plan(sliders(1, 0.0)), Options(0.1))
    assert driver.stepping is not None
    driver.stepping.content.counts[solver.IMPULSIVE] = 1000
    for unsolved, failed in ((1, False), (100, True)):
        driver.stepping.content.counts[solver.UNSOLVED] = unsolved
        assert bool(model_failure(driver)) is failed


def test_the_estimate_says_from_where_on_it_reaches() -> None:
    """Cross-check: the force of compliant contact, which takes the impulse of a latch in 1.5 ms, is in the range."""
    case = sd.read_case(EXAMPLES / "self_deploying.toml")
    hard = case.mechanism
    for name in ("unit 1/pivot", "unit 3/pivot"):
        hard = hard.replace(f"{name}.contact", "hard")
    runs = [sd.simulate(mechanism, **case.run.keywords | {"samples": 11}) for mechanism in (case.mechanism, hard)]
    exact, (unit, *_) = (joint_summaries(run) for run in runs)
    force = next(joint.largest for joint in exact if joint.name == unit.name == "unit 1/pivot")
    assert unit.least < force < unit.largest
    answer = summary_of(runs[1]).force
    assert (answer.force, answer.least) == (unit.largest, unit.least)
    assert f"{sd.units.short(unit.least, 'N')} by approach speeds" in str(answer)
