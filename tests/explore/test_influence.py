"""Influence of the numbers of a case on the answers and curves of its run: values, order, bands, reasons, cancelling."""

import dataclasses
import threading
from pathlib import Path

import numpy as np
import pytest

import scissordyn as sd

pytest.importorskip("tomlkit", reason="the package tomlkit is not installed")

from scissordyn.explore.answers import figures
from scissordyn.explore.case import Case
from scissordyn.explore.influence import Influence, Influences, Order, influences, measures
from scissordyn.explore.session import Outcome

from .browser import CASE, Tab, missing
from .heard import Heard, until

SPEED, CLEARANCE, MASS = "drive.speed", "clearance.0.clearance", "structure.bar_mass"
UNTIL = 3e-3  # [s] End of the runs, after a few contacts
SHORT = CASE.replace("8 ms", "3 ms")


@pytest.fixture
def case():
    """Return a case with a short run."""
    from scissordyn.casefile.code import Code

    return Case("case.toml", SHORT, Code(Path()))


def ran(case):
    """Return the run of a case."""
    options = case.options
    return Outcome(1, case, sd.simulate(case.mechanism, until=options.until, samples=options.samples, start=options.start))


def last(order):
    """Return the complete influence of an order."""
    return list(influences(order))[-1]


def test_influence_is_the_gradient(case):
    """Identity: the elasticity of a number is that of `sd.gradient`; that of all bars' mass is a sum over bars."""
    outcome = ran(case)
    found = last(Order(outcome, (MASS, SPEED, CLEARANCE), "")).plain()
    of = list(measures(outcome.summary, case.mechanism))
    assert found["measures"] == of == ["A.peak_force", "unit 1/bar 1.peak_drive_torque"]
    bars = [body.name for body in case.mechanism.bodies if "bar" in body.name]
    parts = [f"body.{bar}.{part}" for bar in bars for part in ("mass", "inertia")]
    by = ["drive.speed", "A.clearance", *parts]
    exact = sd.gradient(case.mechanism, of=of, by=by, until=UNTIL, start=case.options.start)["elasticity"].values
    rows = found["rows"]
    # other parameters in a pass divide its steps in other parts: each value has an error of 1e-8
    assert rows[SPEED]["elasticity"] == pytest.approx(exact[:, 0], rel=1e-8)
    assert rows[CLEARANCE]["elasticity"] == pytest.approx(exact[:, 1], rel=1e-8)
    assert rows[MASS]["elasticity"] == pytest.approx(exact[:, 2:].sum(axis=1), rel=1e-6)


def test_answers_have_the_values_of_their_measures(case):
    """Identity: the measure behind an answer has the value that its card shows, within the tolerance of the run."""
    tracked = dataclasses.replace(case.mechanism, tracks=(sd.Track("tip", "unit 2/bar 1", "end"),))
    outcome = ran(Case.of("tracked", tracked, case.options))
    summary = outcome.summary
    found = last(Order(outcome, ("drive.0.speed",), ""))
    assert found.answers is not None, found.error
    assert summary.force is not None
    shown = [(summary.force.loose or summary.force).force, summary.points[0].deviation, summary.actuators[0].torque]
    assert list(measures(summary, tracked)) == found.answers["measure"].values.tolist()
    assert found.answers["value"].values == pytest.approx(shown, rel=1e-5)


def test_bands_are_derivatives_over_time(case):
    """Identity: half the width of a band is five times the derivative of the curve times a hundredth of the number."""
    outcome = ran(case)
    found = last(Order(outcome, (SPEED,), SPEED))
    tangent = found.tangent(outcome.run)
    assert tangent is not None
    assert tangent.label == "change of the curves by ±1 % of drive speed, drawn 5 times as wide"
    drawn = figures(outcome.run, outcome.summary, (), "A", case.mechanism.output_body, tangent)["figures"]
    exact = sd.gradient(case.mechanism, by=["drive.speed"], until=UNTIL, start=case.options.start, trajectory=True, samples=401)
    step = 5.0 * 0.01 * abs(float(exact["parameter_value"][0]))
    for name, variable in (("output", "slider_position"), ("loss", "dissipated_energy")):
        figure = next(each for each in drawn if each["name"] == name)
        (band,) = (line for line in figure["lines"] if line["style"] == "band")
        factor = {"m": 1.0, "mm": 1e3, "J": 1.0}[figure["unit"]]
        assert band["x"].size == 401
        wanted = factor * step * np.abs(exact[f"{variable}_derivative"].values[:, 0])
        assert band["size"] == pytest.approx(wanted, rel=1e-4, abs=1e-6 * wanted.max())


def test_bands_do_not_show_the_tolerance(case):
    """Identity: bands of a coarse run are as wide as those of an accurate one; they had the difference between both runs."""
    wide = []
    for rtol in (1e-9, 1e-3):
        options = case.options
        run = sd.simulate(case.mechanism, until=options.until, samples=options.samples, start=options.start, rtol=rtol)
        outcome = Outcome(1, case, run)
        found = last(Order(outcome, (CLEARANCE,), CLEARANCE)).tangent(run)
        assert found is not None
        moved, drawn = found.run["slider_position"].values, run["slider_position"].values
        wide.append(np.interp(np.linspace(0.0, UNTIL, 101), found.run["time"].values, moved - drawn[: moved.size]))
    np.testing.assert_allclose(wide[1], wide[0], rtol=0.0, atol=1e-6 * np.max(np.abs(wide[0])))


def test_a_number_that_is_zero(case):
    """Contract: it has no influence in percent and no band, with the reason; alone it is the reason of the page."""
    level = case.changed({"structure.gravity": "9.81 m/s^2", "structure.gravity_direction": "0 deg"})
    outcome, key = ran(level), "structure.gravity_direction"
    found = last(Order(outcome, (SPEED, key), key))
    assert found.plain()["rows"][key] == {"why": "it is zero, and no change is a percentage of zero"}
    assert found.tangent(outcome.curves) is None
    assert "no change is a percentage of zero" in last(Order(outcome, (key,), key)).plain()["reason"]


def test_step_of_a_case_is_not_used(case):
    """Contract: a note says so, except with hard contact, which uses it."""
    from scissordyn.casefile.code import Code

    text = SHORT.replace("[run]", '[run]\nstep = "5 us"')
    stepped = Case("case.toml", text, Code(Path()))
    assert "without the step of the case" in last(Order(ran(stepped), (SPEED,), "")).plain()["note"]
    hard = Case("case.toml", text.replace(' mm"', ' mm"\ncontact = "hard"'), Code(Path()))
    assert not last(Order(ran(hard), (SPEED,), "")).plain()["note"]
    assert not last(Order(ran(case), (SPEED,), "")).plain()["note"]


def test_band_has_a_gap_where_a_change_is_not_small(case):
    """Contract: a curve whose change is beyond a tenth of its range has no band there, and none at all after its limit."""
    outcome = ran(case)
    found = last(Order(outcome, (SPEED,), SPEED, change=0.2))
    tangent = found.tangent(outcome.run)
    assert found.curves is not None
    assert tangent is not None
    limit = float(found.curves["valid_until"][0])
    assert 0.0 < limit < UNTIL
    assert "valid until" in tangent.label
    drawn = figures(outcome.run, outcome.summary, (), "A", case.mechanism.output_body, tangent)["figures"]
    bands = [line for figure in drawn for line in figure["lines"] if line["style"] == "band"]
    assert all(band["x"].max() <= 1e3 * limit for band in bands)
    assert any(np.isnan(band["size"]).any() for band in bands)


def test_reason_why_there_is_no_influence(case):
    """Contract: a number without derivatives gives the reason of `sd.gradient`, a run that ends early gives its own."""
    found = last(Order(ran(case), ("structure.units",), "")).plain()
    assert "'structure.units' cannot change alone: it is an integer" in found["reason"]
    assert not found["rows"]
    part = sd.simulate(case.mechanism, until=UNTIL, most_steps=60)
    found = last(Order(Outcome(1, case, part), (SPEED,), "")).plain()
    assert found["reason"] == "the run is not complete; expected a run that reaches its end"


def test_estimated_force_is_no_answer():
    """Contract: hard contact has influences, but not on the force of an impact, which is an estimate."""
    from scissordyn.casefile.code import Code

    hard = Case("case.toml", SHORT.replace(' mm"', ' mm"\ncontact = "hard"'), Code(Path()))
    outcome = ran(hard)
    assert list(measures(outcome.summary, hard.mechanism)) == ["unit 1/bar 1.peak_drive_torque"]
    found = last(Order(outcome, (SPEED,), ""))
    exact = sd.gradient(hard.mechanism, of=["unit 1/bar 1.peak_drive_torque"], by=["drive.speed"], until=UNTIL)
    assert found.plain()["rows"][SPEED]["elasticity"] == pytest.approx(exact["elasticity"].values[:, 0], rel=1e-9)


def test_number_without_effect_is_left_out(case):
    """Contract: beside numbers that act, one that does not has its reason in its row."""
    rows = last(Order(ran(case), (SPEED, "structure.units", "run.until"), "")).plain()["rows"]
    assert "integer" in rows["structure.units"]["why"]
    assert "does not affect this run" in rows["run.until"]["why"]
    assert np.isfinite(rows[SPEED]["elasticity"]).all()


def test_newest_order_is_computed(case):
    """Contract: an order that a newer one replaces, or that is cancelled, is not reported."""
    outcome, done = ran(case), list[Influence]()
    background = Influences(done.append)
    orders = [Order(outcome, (key,), "") for key in (SPEED, MASS, CLEARANCE)]
    for order in orders:
        background.order(order, None)
    until(lambda: done)
    assert {id(found.order) for found in done} == {id(orders[-1])}
    known = done[-1]
    background.order(dataclasses.replace(orders[-1], drawn=CLEARANCE), known)
    until(lambda: done[-1].curves is not None)
    assert done[-1].answers is known.answers
    count = len(done)
    background.order(orders[0], None)
    background.cancel()
    until(lambda: not any(thread.name == "scissordyn influence" for thread in threading.enumerate()))
    assert len(done) == count


def test_page_follows_its_run(case):
    """Contract: the influence comes after the run, belongs to it, and follows a change; bands end with their run."""
    heard = Heard(case)
    first = heard.until_run(0)["run"]
    heard.say("influence", keys=[SPEED, "nothing"], drawn=SPEED)
    until(lambda: any(line["style"] == "band" for figure in heard.of("run")[-1]["figures"] for line in figure["lines"]))
    assert heard.of("influence")[-1]["run"] == first
    assert list(heard.of("influence")[-1]["rows"]) == [SPEED]
    heard.say("change", key=SPEED, text="140 rpm")
    run = heard.until_run(first)
    assert not any(line["style"] == "band" for figure in run["figures"] for line in figure["lines"])
    until(lambda: heard.of("influence")[-1]["run"] == run["run"])
    heard.say("influence", keys=[], drawn="")
    assert not any(line["style"] == "band" for figure in heard.of("run")[-1]["figures"] for line in figure["lines"])
    heard.say("influence", keys="x", drawn="")
    assert "not a list" in heard.of("said")[-1]["text"]
    heard.page.close()


@pytest.fixture
def opened(browser, tmp_path):
    """Yield a function that opens the page of a case, which this process serves with quickly compiled derivatives."""
    from scissordyn.explore.case import open_case
    from scissordyn.explore.serve import listen, serve

    tabs = list[Tab]()

    def open_page(text):
        path = tmp_path / "case.toml"
        path.write_text(text)
        urls, announced = list[str](), threading.Event()
        given = {"name": path.name, "address": "127.0.0.1", "show": False}
        announce = lambda url: (urls.append(url), announced.set())  # noqa: E731
        serving = lambda: serve(lambda: open_case(path), listen("127.0.0.1", 0), announce=announce, **given)  # noqa: E731
        threading.Thread(target=serving, daemon=True).start()
        assert announced.wait(60.0)
        tabs.append(Tab(browser, urls[0]))
        return tabs[-1]

    yield open_page
    for tab in tabs:
        tab.close()


@pytest.mark.skipif(bool(missing()), reason=missing())
def test_sliders_show_and_sort_by_influence(opened, case):
    """Contract: the page shows the elasticities of `sd.gradient`, sorts when it is asked to, and draws and removes bands."""
    tab = opened(SHORT)
    labels = {
        "structure: angle": "structure.angle",
        "drive: speed": SPEED,
        "clearance A: clearance": CLEARANCE,
        "clearance unit 1/pivot: clearance": "clearance.1.clearance",
    }
    rows = tab.page.locator(".sd-row:has(input[type=range])")
    assert rows.locator("label").all_text_contents() == list(labels)
    assert tab.page.locator(".sd-effect:visible").count() == 0
    tab.page.get_by_label("influence on").check()
    effects = tab.page.locator(".sd-effect:visible b")
    effects.first.wait_for(timeout=600_000)
    answers = tab.page.get_by_label("answer").locator("option").all_text_contents()
    assert answers == ["largest force at A", "largest torque of unit 1/bar 1"]
    paths = ["drive.speed", "A.clearance", "unit 1/pivot.clearance"]
    exact = sd.gradient(case.mechanism, of=["A.peak_force"], by=paths, until=UNTIL, start=case.options.start)
    shown = [float(text.split(" %")[0].replace("\N{MINUS SIGN}", "-")) for text in effects.all_text_contents()]
    assert shown[1:] == pytest.approx(exact["elasticity"].values[0], rel=6e-3)
    tab.page.get_by_role("button", name="Sort").click()
    order = sorted(range(4), key=lambda k: -abs(shown[k]))
    assert order != [0, 1, 2, 3]
    assert rows.locator("label").all_text_contents() == [list(labels)[k] for k in order]
    tab.page.locator(f"[data-key='{SPEED}'] .sd-effect:visible").click()
    tab.page.get_by_text("±1 % of drive speed").wait_for(timeout=60_000)
    first = tab.run
    tab.type("clearance.0.clearance", "0.4 mm")
    tab.ready(first)
    tab.page.locator(".sd-effect[data-stale=false]:visible").first.wait_for(timeout=60_000)
    assert rows.locator("label").all_text_contents() == [list(labels)[k] for k in order]  # until somebody sorts again
    tab.page.get_by_label("influence on").uncheck()
    tab.page.get_by_text("±1 % of drive speed").wait_for(state="hidden")
    assert tab.page.locator(".sd-effect:visible").count() == 0


@pytest.mark.skipif(bool(missing()), reason=missing())
def test_page_says_why_there_is_no_influence(opened):
    """Contract: if the only slider is that of a number that does not act, the page says so in one sentence."""
    tab = opened(SHORT)
    for _ in range(4):
        tab.page.locator(".sd-row:has(input[type=range]) button[aria-pressed=true]").first.click()
    tab.field("run.until").get_by_role("button").first.click()
    tab.page.get_by_label("influence on").check()
    tab.page.get_by_text("not available: 'run.until' does not affect this run").wait_for(timeout=60_000)
    assert tab.page.locator(".sd-effect:visible").count() == 0
