"""What is said of runs with hard contact: estimated forces, impulses, contacts that cannot move, failed models."""

from __future__ import annotations

import io
import math

import numpy as np
import pytest
import xarray as xr
from tests.build import EXAMPLES, counts_of, warnings_of

import scissordyn as sd
from scissordyn.cli.compare import measures
from scissordyn.cli.show import show_run
from scissordyn.cli.text_console import TextConsole
from scissordyn.components.force import Force
from scissordyn.errors import InputError
from scissordyn.exchange.fmu.pack import fmu
from scissordyn.explore.answers import cards, contact_table
from scissordyn.laws.damping.factors import LankaraniNikravesh
from scissordyn.mechanics import impulse_solver as solver
from scissordyn.model.body import Body
from scissordyn.model.joint import Guide, Revolute
from scissordyn.model.mechanism import Mechanism
from scissordyn.model.options import Options
from scissordyn.plan.plan import plan
from scissordyn.record.joint_force import joint_summaries
from scissordyn.record.summary import summary_of
from scissordyn.run.trajectory import make_driver, model_failure


def array(contact: str) -> sd.Mechanism:
    """Two units whose slider pin has clearance."""
    joint = sd.Clearance(5e-4, damping=sd.Flores(0.7), contact=contact)  # type: ignore[arg-type]
    return sd.scissor(units=2).driven(speed=sd.rpm(150)).with_clearance("A", joint)


@pytest.fixture(scope="module")
def run() -> xr.Dataset:
    """Some impacts at one hard joint."""
    return sd.simulate(array("hard"), until=0.01, samples=101)


def printed(run: xr.Dataset) -> str:
    """What the command line prints of a run."""
    out = io.StringIO()
    show_run(run, 5, to=TextConsole(file=out, width=200))
    return out.getvalue()


def test_the_largest_force_is_an_estimate(run: xr.Dataset) -> None:
    """Contract: the largest of the estimates of impacts and of the sampled forces that last, and it is called so everywhere."""
    largest = max(float(run["peak_force_estimate"].max()), float(run["normal_force"].sel(joint="A").max()))
    answer = summary_of(run).force
    assert answer.estimated
    assert answer.force == largest > 0.0
    assert str(answer).endswith("; an estimate, as contact is hard.")
    (joint,) = joint_summaries(run)
    assert (joint.largest, joint.when) == (answer.force, answer.when)
    assert measures(run)["largest force at A"] == (largest, "N")
    assert next(cards(summary_of(run)))["detail"].endswith(", an estimate")


def test_a_run_without_impacts_has_no_largest_force(run: xr.Dataset) -> None:
    """Limit: estimates and samples that are not known; ideal joints carry what lasts."""
    nothing = run.assign(peak_force_estimate=run["peak_force_estimate"] * math.nan, normal_force=run["normal_force"] * math.nan)
    force = summary_of(nothing).force
    assert (force.kind, force.loose) == ("ideal joint", None)
    assert "without the impulses of hard contacts" in str(force)
    assert summary_of(nothing.drop_vars("joint_peak_force")).force is None
    assert "no largest force, as contact is hard" in printed(nothing)


def test_impulses_stand_in_the_place_of_peaks(run: xr.Dataset) -> None:
    """Contract: tables in the terminal and in the explorer have the impulses of the run, and no number is NaN."""
    text = printed(run)
    assert "impulse" in text
    assert "peak" not in text
    assert "nan" not in text
    shown = {column["title"]: column["values"] for column in contact_table(run)["columns"]}
    assert np.array_equal(shown["impulse [N s]"], run["impulse"].values)


def test_tables_of_both_kinds_of_contact_have_impulses_and_peaks(run: xr.Dataset) -> None:
    """Contract: where one of the contacts has a force, as a compliant one beside hard ones, it is shown beside the impulses."""
    one = run["contact"] == 0
    both = run.assign(peak_force=run["peak_force"].where(~one, 321.0), peak_time=run["peak_time"].where(~one, 1e-4))
    text = printed(both)
    assert {"impulse", "peak force", "to peak"} <= set(text.replace("  ", "\n").replace("\n ", "\n").split("\n"))
    assert "321.0" in text
    assert "nan" not in text
    assert {"impulse [N s]", "peak force [N]"} <= {column["title"] for column in contact_table(both)["columns"]}


def test_compliant_contact_keeps_its_peaks() -> None:
    """Contract: no estimate where the contact has a force."""
    run = sd.simulate(array("compliant"), until=0.01, samples=101)
    answer = summary_of(run).force
    assert not answer.estimated
    assert answer.loose.force == float(run["peak_force"].max())
    titles = [column["title"] for column in contact_table(run)["columns"]]
    assert any("peak force" in title for title in titles)
    assert "impulse [N s]" not in titles


@pytest.mark.parametrize("kinds", [("hard",), ("compliant",), ("compliant", "hard")])
def test_a_batch_that_names_no_measures_has_forces_of_its_contacts(kinds: tuple[str, ...]) -> None:
    """Identity: the largest forces of each kind of contact that there is, equal to those of the run, and no others."""
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


def test_what_hard_contact_does_not_have_is_refused_in_one_line() -> None:
    """Bad input: an FMU, and a requirement on forces that impacts do not have."""
    with pytest.raises(InputError, match="joint 'A' has hard contact, which an FMU does not support"):
        fmu(array("hard"), Options(until=0.01), sources_only=True)
    with pytest.raises(InputError, match="'peak_force' of joint 'A', whose contact is hard: its impacts have no largest force"):
        sd.study(array("hard"), {"A.clearance": (1e-4, 5e-4)}, until=0.01, requirements={"peak_force": 500.0}, points=2)


GAP, PUSH = 1e-3, 5.0


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


@pytest.mark.parametrize("angle", [0.0, 0.5])
@pytest.mark.parametrize("friction", [{}, {"friction": sd.LuGre(kinetic=0.3)}])
def test_a_slider_in_a_pin_comes_to_rest(angle: float, friction: dict[str, object]) -> None:
    """Closed form: the impacts of a ball with e = 1/2 under F/m; friction across the line has no work to do."""
    run = sd.simulate(sliders(1, angle, **friction), until=0.1, start="concentric", step=2e-5)
    first = math.sqrt(2.0 * GAP / PUSH)
    expected = first * np.concatenate([[1.0], 1.0 + 2.0 * np.cumsum(0.5 ** np.arange(1, 8))])
    np.testing.assert_allclose(run["contact_start"].values[:8], expected, rtol=1e-9)
    assert counts_of(run)["steps_not_solved"] == 0
    assert float(run["damping_loss"][-1]) == pytest.approx(PUSH * GAP, rel=1e-9)
    assert run["normal_force"].values[-1, 0] == pytest.approx(PUSH, rel=1e-9)
    assert float(run["friction_loss"][-1]) == 0.0


@pytest.mark.parametrize("count", [3, 5])
def test_a_train_of_sliders_comes_to_rest(count: int) -> None:
    """Closed form: at the end every pin is taut and carries the push, whose work restitution has taken."""
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


def test_a_run_with_many_unsolved_steps_has_failed() -> None:
    """Contract: one step in a thousand that is not solved is a warning, one in ten is a failure."""
    driver, _, _ = make_driver(plan(sliders(1, 0.0)), Options(0.1))
    driver.stepping.content.state.counts[solver.IMPULSIVE] = 1000
    for unsolved, failed in ((1, False), (100, True)):
        driver.stepping.content.state.counts[solver.UNSOLVED] = unsolved
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
