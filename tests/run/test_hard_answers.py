"""Results and reports of runs with hard contact: estimated forces, impulses, immobile contacts, failed models."""

import io
import math
import re

import numpy as np
import pytest
from tests.build import EXAMPLES, counts_of, warnings_of

import scissordyn as sd
from scissordyn.cli.compare import measures
from scissordyn.cli.show import show_run
from scissordyn.cli.text_console import TextConsole
from scissordyn.exchange.fmu.pack import fmu
from scissordyn.explore.answers import cards, contact_table
from scissordyn.mechanics import impulse_solver as solver
from scissordyn.plan.plan import plan
from scissordyn.record.joint_force import joint_summaries
from scissordyn.record.summary import summary_of
from scissordyn.run.trajectory import make_driver, model_failure


def array(contact):
    """Return two units whose slider pin has clearance."""
    joint = sd.Clearance(5e-4, damping=sd.Flores(0.7), contact=contact)
    return sd.scissor(units=2).driven(speed=sd.rpm(150)).with_clearance("A", joint)


@pytest.fixture(scope="module")
def run():
    """Return a run with some impacts at one hard joint."""
    return sd.simulate(array("hard"), until=0.01, samples=101)


def printed(run):
    """Return the text that the command line prints about a run."""
    out = io.StringIO()
    show_run(run, 5, to=TextConsole(file=out, width=200))
    return out.getvalue()


def test_largest_force_is_an_estimate(run):
    """Contract: the largest of estimated impact forces and sampled lasting forces, called an estimate everywhere."""
    largest = max(float(run["peak_force_estimate"].max()), float(run["normal_force"].sel(joint="A").max()))
    answer = summary_of(run).force
    assert answer.estimated
    assert answer.force == largest > 0.0
    assert str(answer).endswith("; an estimate, as contact is hard.")
    (joint,) = joint_summaries(run)
    assert (joint.largest, joint.when) == (answer.force, answer.when)
    assert measures(run)["largest force at A"] == (largest, "N")
    assert next(cards(summary_of(run)))["detail"].endswith(", an estimate")


def test_unknown_forces_of_hard_contacts(run):
    """Limit: without estimates and samples the answer is the lasting force of ideal joints."""
    nothing = run.assign(peak_force_estimate=run["peak_force_estimate"] * math.nan, normal_force=run["normal_force"] * math.nan)
    force = summary_of(nothing).force
    assert (force.kind, force.loose) == ("ideal joint", None)
    assert "without the impulses of hard contacts" in str(force)
    assert summary_of(nothing.drop_vars("joint_peak_force")).force is None
    assert "no largest force, as contact is hard" in printed(nothing)


def test_tables_show_impulses(run):
    """Contract: tables in the terminal and in the explorer have the run's impulses, and no NaN."""
    text = printed(run)
    assert "impulse" in text
    assert "peak" not in text
    assert "nan" not in text
    shown = {column["title"]: column["values"] for column in contact_table(run)["columns"]}
    assert np.array_equal(shown["impulse [N s]"], run["impulse"].values)


def test_tables_of_both_kinds_of_contact(run):
    """Contract: with hard and compliant contacts the tables have impulses and peak forces."""
    one = run["contact"] == 0
    both = run.assign(peak_force=run["peak_force"].where(~one, 321.0), peak_time=run["peak_time"].where(~one, 1e-4))
    text = printed(both)
    assert {"impulse", "peak force", "to peak"} <= set(text.replace("  ", "\n").replace("\n ", "\n").split("\n"))
    assert "321.0" in text
    assert "nan" not in text
    assert {"impulse [N s]", "peak force [N]"} <= {column["title"] for column in contact_table(both)["columns"]}


def test_compliant_contact_has_no_estimates():
    """Contract: the force of a compliant contact is not an estimate."""
    run = sd.simulate(array("compliant"), until=0.01, samples=101)
    answer = summary_of(run).force
    assert not answer.estimated
    assert answer.loose.force == float(run["peak_force"].max())
    titles = [column["title"] for column in contact_table(run)["columns"]]
    assert any("peak force" in title for title in titles)
    assert "impulse [N s]" not in titles


@pytest.mark.parametrize("kinds", [("hard",), ("compliant",), ("compliant", "hard")])
def test_default_measures_of_a_batch(kinds):
    """Identity: a batch has the largest forces of each kind of contact in the mechanism, equal to those of the run."""
    mechanism = array(kinds[0])
    if "hard" in kinds[1:]:
        mechanism = mechanism.with_clearance("unit 1/pivot", array("hard").joint("A").clearance)
    batch = sd.simulate_many(mechanism, {"A.clearance": [5e-4]}, until=0.01, threads=1)
    run = sd.simulate(mechanism, until=0.01)
    assert ("peak_force" in batch, "peak_force_estimate" in batch) == ("compliant" in kinds, "hard" in kinds)
    for name in {"peak_force", "peak_force_estimate"} & set(batch):
        found, own = batch[name].isel(case=0), run[name].values
        *contacts, others = zip(found["joint"].values.tolist(), found.values.tolist(), strict=True)
        ideal = run["joint_peak_force"].values[np.isnan(run["clearance"].values)].max()
        assert others == (
            "ideal joints",
            pytest.approx(ideal, rel=5e-3) if name == "peak_force" else pytest.approx(math.nan, nan_ok=True),
        )
        for joint, value in contacts:
            largest = np.nanmax(own[run["contact_joint"].values == joint], initial=0.0)
            assert value == largest > 0.0 or (math.isnan(value) and largest == 0.0)
        assert np.any(np.isfinite(found))


def test_refused_uses_of_hard_contact():
    """Contract: an FMU, and a requirement on peak forces, are refused."""
    with pytest.raises(sd.InputError, match="joint 'A' has hard contact, which an FMU does not support"):
        fmu(array("hard"), sd.Options(until=0.01), sources_only=True)
    with pytest.raises(
        sd.InputError, match="'peak_force' of joint 'A', whose contact is hard: its impacts have no largest force"
    ):
        sd.study(array("hard"), {"A.clearance": (1e-4, 5e-4)}, until=0.01, requirements={"peak_force": 500.0}, points=2)


GAP, PUSH = 1e-3, 5.0  # Clearance of the pins [m] and force on the last mass [N]


def sliders(count, angle, **laws):
    """Return masses of 1 kg on a line, each in a hard loose pin of the previous one or the ground, pushed apart."""
    along = math.cos(angle), math.sin(angle)
    bodies = tuple(sd.Body(f"m{i}", 1.0, None, {"c": (0.0, 0.0)}) for i in range(count))
    gaps = [sd.Clearance(GAP, damping=sd.LankaraniNikravesh(0.5), contact="hard", **laws) for _ in bodies]
    ends = [("ground", "o"), *((body.name, "c") for body in bodies)]
    return sd.Mechanism(
        bodies,
        joints=tuple(sd.Revolute(f"p{i}", ends[i], ends[i + 1], gaps[i]) for i in range(count)),
        guides=tuple(sd.Guide(f"g{i}", (body.name, "c"), direction=angle) for i, body in enumerate(bodies)),
        ground=(("o", (0.0, 0.0)),),
        components=(sd.Force("push", ends[-1], (PUSH * along[0], PUSH * along[1])),),
        gravity=0.0,
    )


@pytest.mark.parametrize("angle", [0.0, 0.5])
@pytest.mark.parametrize("friction", [{}, {"friction": sd.LuGre(kinetic=0.3)}])
def test_slider_in_a_pin_comes_to_rest(angle, friction):
    """Closed form: the impacts of a ball with e = 1/2 under F/m; friction across the line does no work."""
    run = sd.simulate(sliders(1, angle, **friction), until=0.1, start="concentric", step=2e-5)
    first = math.sqrt(2.0 * GAP / PUSH)
    expected = first * np.concatenate([[1.0], 1.0 + 2.0 * np.cumsum(0.5 ** np.arange(1, 8))])
    np.testing.assert_allclose(run["contact_start"].values[:8], expected, rtol=1e-9)
    assert counts_of(run)["steps_not_solved"] == 0
    assert float(run["damping_loss"][-1]) == pytest.approx(PUSH * GAP, rel=1e-9)
    assert run["normal_force"].values[-1, 0] == pytest.approx(PUSH, rel=1e-9)
    assert float(run["friction_loss"][-1]) == 0.0


def test_warning_of_contacts_that_stick_at_rest():
    """Closed form: a falling mass with e = 1/2 rests after 3 sqrt(2 c/g); a run warns that its contact sticks from then on."""
    for friction, sticks in ((sd.LuGre(kinetic=0.3), True), (sd.NoFriction(), False)):
        gap = sd.Clearance(GAP, damping=sd.LankaraniNikravesh(0.5), contact="hard", friction=friction)
        mass = sd.Body("mass", 1.0, None, {"c": (0.0, 0.0)})
        pin = sd.Revolute("pin", ("mass", "c"), ("ground", "o"), gap)
        falling = sd.Mechanism((mass,), joints=(pin,), ground=(("o", (0.0, 0.0)),), gravity=9.81)
        run = sd.simulate(falling, until=0.5, start="concentric", samples=5001)
        texts = [text for text in warnings_of(run) if text.startswith("at rest or jammed")]
        assert len(texts) == sticks
        if sticks:
            assert texts[0].endswith("nothing moves, and the contacts of 'pin' stick")
            rest = float(re.search("from t = (.*) s on", texts[0])[1])
            assert rest == pytest.approx(3.0 * math.sqrt(2.0 * GAP / 9.81), abs=1e-4)


@pytest.mark.parametrize("count", [3, 5])
def test_train_of_sliders_comes_to_rest(count):
    """Closed form: in the end every pin carries the push, and restitution has dissipated its work."""
    run = sd.simulate(sliders(count, 0.5), until=0.5, start="concentric")
    assert run.attrs["status"] == "complete"
    assert counts_of(run)["steps_not_solved"] == 0
    pins = [f"p{i}" for i in range(count)]
    np.testing.assert_allclose(run["normal_force"].sel(joint=pins).values[-1], PUSH, rtol=1e-6)
    work = float(run["load_work"][-1])
    assert work == pytest.approx(PUSH * count * GAP, rel=5e-3)
    assert float(run["damping_loss"][-1]) == pytest.approx(work, rel=2e-3)
    assert abs(float(run["energy_residual"][-1])) < 1e-4 * work


@pytest.mark.parametrize("offset", [0.0, 0.05])
@pytest.mark.parametrize("speed", [30.0, 300.0])
def test_free_rotor_keeps_its_speed(speed, offset):
    """Identity: a body that rotates freely next to a hard contact keeps speed, energy and phase at the default step."""
    bodies = (
        sd.Body("rotor", 1.0, 0.01, {"o": (offset, 0.0), "a": (0.1, 0.0)}, angular_velocity=speed),
        sd.Body("ball", 1.0, None, {"c": (0.0, 0.0)}, position=(1.0, 0.0)),
    )
    pin = sd.Revolute(
        "pin", ("ball", "c"), ("ground", "p"), sd.Clearance(GAP, damping=sd.LankaraniNikravesh(0.5), contact="hard")
    )
    run = sd.simulate(
        sd.Mechanism(bodies, joints=(pin,), ground=(("p", (1.0, 0.0)),), gravity=0.0), until=0.5, start="as-placed", samples=101
    )
    assert float(run["angular_velocity"].sel(body="rotor")[-1]) == pytest.approx(speed, rel=1e-6)
    assert float(np.ptp(run["angle"].sel(body="rotor").values)) == pytest.approx(0.5 * speed, rel=1e-6)
    assert float(np.abs(run["energy_residual"]).max()) < 2e-6 * float(run["kinetic_energy"][0])


def test_estimate_of_an_impact_in_a_closed_contact():
    """Cross-check: a latch throws a closed contact; the estimate is near the force of compliant contact without damping."""
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


def test_warning_of_unresolved_losses():
    """Contract: the warning gives the losses of contacts that follow each other within three steps."""
    run = sd.simulate(sliders(5, 0.0), until=0.2, start="concentric")
    (said,) = [text for text in warnings_of(run) if "have not converged" in text]
    near, ends, unresolved = 3.0 * float(counts_of(run)["step"]), dict[str, float](), 0.0
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


def test_runs_with_unsolved_steps():
    """Contract: one unsolved step in a thousand gives a warning, one in ten a failure."""
    driver, _, _ = make_driver(plan(sliders(1, 0.0)), sd.Options(0.1))
    driver.stepping.content.state.counts[solver.IMPULSIVE] = 1000
    for unsolved, failed in ((1, False), (100, True)):
        driver.stepping.content.state.counts[solver.UNSOLVED] = unsolved
        assert bool(model_failure(driver)) is failed


def test_range_of_the_estimate():
    """Cross-check: the force of compliant contact, which takes a latch's impulse in 1.5 ms, is in the estimated range."""
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
    assert f"{sd.units.short(unit.least, 'N')} from approach speeds" in str(answer)
