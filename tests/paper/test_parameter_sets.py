"""Parameter sets of the paper: drawn, judged, stored and weighted."""

import dataclasses
import re

import numpy as np
import pytest

import scissordyn as sd
from scissordyn.cli import paper as command
from scissordyn_paper import judge, parameter_sets, parameter_sets_page
from scissordyn_paper.cases import DEFAULT, PaperCase, every_case
from scissordyn_paper.judge import findings
from scissordyn_paper.measures import measure
from scissordyn_paper.parameter_sets import ANGLES, FACTORS, Judged, choice_at, fetch_parameter_sets
from scissordyn_paper.parameter_sets_page import (
    answer_parameter_sets,
    information_by_factor,
    level_shares,
    never_together,
    weights,
)
from scissordyn_paper.reproduce import verdicts
from scissordyn_paper.runs import compute
from scissordyn_paper.statements import CHECKS
from scissordyn_paper.verdict import answer

# Choice of parameters that differs from the best set
OTHER = dataclasses.replace(
    DEFAULT, driven_bar="slider", restitution=0.6, damping="gonthier", journal_radius=0.02, gravity=0.0, slip="contact-points",
    viscous=0.1, tolerance=1e-6, stiffness="hertz", bearing_material="bronze",
)  # fmt: skip


def test_runs_without_histories_have_the_same_answers(runs):
    """Cross-check: findings word by word, of the default choice and of a very different one."""
    assert [finding.words for finding in findings(DEFAULT)] == [verdict.finding.words for verdict in verdicts(runs)]
    cases = [*every_case(OTHER), *{case.ideal for case in every_case(OTHER)}]
    made = {case: compute(case, trust=False) for case in dict.fromkeys(cases)}
    measured = {case: measure(run, made[case.ideal]) for case, run in made.items() if case.clearance is not None}
    expected = [answer(check, OTHER, measured).finding for check in CHECKS]
    assert [finding.words for finding in findings(OTHER)] == [finding.words for finding in expected]


def test_findings_of_neighbours():
    """Contract: clearances that differ by 1e-9 change the numbers, and at most one answer."""
    first, second = findings(DEFAULT), findings(DEFAULT, 1)
    assert first != second
    assert sum(a.holds != b.holds for a, b in zip(first, second, strict=True)) <= 1


def test_samples_of_a_curve_miss_peaks(monkeypatch):
    """Limit: few samples miss peaks; many give those of the motion."""
    peaks = []
    for samples in (201, 20001):
        numbers = findings(dataclasses.replace(DEFAULT, samples=samples))[4].numbers
        peaks.append(numbers["peak_N"])
    exact = findings(DEFAULT)[4].numbers["peak_N"]
    assert peaks[0] < peaks[1] <= exact
    assert peaks[1] == pytest.approx(exact, rel=1e-4)


def test_statements_of_a_failed_run(monkeypatch):
    """Contract: statements about a failed run are not met and have no numbers; those about complete runs are answered."""
    monkeypatch.setattr(judge, "MOST_STEPS", 20)
    found = dict(zip((check.key for check in CHECKS), findings(DEFAULT), strict=True))
    assert not found["1a"].holds
    assert (found["1a"].words, found["1a"].numbers) == ("c-0.5mm_150rpm has failed", {})
    assert found["7a"].numbers


@pytest.mark.parametrize("seed", range(12))
def test_every_parameter_set_is_a_case_file(seed, tmp_path):
    """Contract: each factor sets options of a case, and the case file gives the same mechanism."""
    choice = choice_at(np.random.default_rng(seed).random(len(FACTORS)))
    case = next(case for case in every_case(choice) if case.friction)
    path = tmp_path / "case.toml"
    path.write_text(case.toml)
    again = sd.read_case(path)
    assert again.mechanism == case.build().mechanism
    assert again.run.keywords == case.options.keywords
    assert round(np.degrees(choice.angle)) in ANGLES[choice.travel]
    if choice.start == "in-contact":
        assert (choice.step, choice.method) == (0.0, "auto")


def test_levels_of_factors():
    """Contract: levels cover the unit interval, and each is a setting."""
    for factor in FACTORS:
        at = np.linspace(0.0, 1.0, 81)[:-1] + 1e-3
        for u in at:
            assert factor.level(u)
            assert factor.fields_at(u) or factor.level(u) in ("steel", "concentric", "the motion itself")
    radius = next(factor for factor in FACTORS if factor.name == "journal radius")
    assert radius.level(0.0) == "5 to 7.83 mm"
    assert radius.fields_at(0.5)["journal_radius"] == pytest.approx((5e-3 * 30e-3) ** 0.5)


@pytest.fixture
def small(monkeypatch):
    """Reduce rounds to three blocks of two parameter sets; statements hold for random numbers below one half."""

    def judged(choice, member=0):
        finding = judge.Finding
        numbers = np.random.default_rng(round(1e6 * choice.restitution)).random(len(CHECKS))
        return tuple(finding(bool(number < 0.5), "", {"number": float(number)}) for number in numbers)

    monkeypatch.setattr(parameter_sets, "findings", judged)
    for name, value in {
        "BLOCK_SIZE": 2,
        "QUASI_BLOCKS": 2,
        "NEAR_BLOCKS": 1,
        "PARENT_SETS": 2,
        "LEADING_SETS": 4,
        "NEIGHBOURS": 2,
    }.items():
        monkeypatch.setattr(parameter_sets, name, value)


def test_parameter_sets_continue_after_an_interruption(small, tmp_path, monkeypatch):
    """Identity: parameter sets in two parts equal those of one run, and stored parameter sets are not judged again."""
    whole = fetch_parameter_sets(tmp_path / "whole", 12, engine=1)
    fetch_parameter_sets(tmp_path / "parts", 7, engine=1)
    parts = fetch_parameter_sets(tmp_path / "parts", 12, engine=2)
    assert np.array_equal(whole.points, parts.points)
    assert np.array_equal(whole.agreeing, parts.agreeing)
    assert whole.quasi.tolist() == [True] * 4 + [False] * 2 + [True] * 4 + [False] * 2
    sobol = parameter_sets.sobol_numbers(parameter_sets.SAMPLING_SEED, len(FACTORS), np.arange(8))
    assert np.array_equal(whole.points[whole.quasi], sobol)

    def never(*_):
        raise AssertionError("judged again")

    monkeypatch.setattr(parameter_sets, "findings", never)
    again = fetch_parameter_sets(tmp_path / "whole", 12, engine=1)
    assert np.array_equal(again.agreeing, whole.agreeing)
    with pytest.raises(sd.ScissordynError, match="AssertionError: judged again"):
        fetch_parameter_sets(tmp_path / "whole", 14, engine=1)


def test_later_parameter_sets_lie_near_the_best(small, tmp_path):
    """Contract: each factor is inherited from a parent or drawn."""
    found = fetch_parameter_sets(tmp_path / "near", 6, engine=1)
    best = found.points[np.argsort(-found.agreeing_count[:4], kind="stable")[:2]]
    inherited = np.isclose(found.points[4:, None, :], best[None]).any(axis=1)
    assert 0.6 < inherited.mean() < 1.0


def planted(count=4096):
    """Return parameter sets that meet statement 1 where bar 1 is pinned, 2 where it is not, and the others by chance."""
    rng = np.random.default_rng(5)
    points = rng.random((count, len(FACTORS)))
    agreeing = (rng.random((count, len(CHECKS))) < 0.5).astype(float)
    agreeing[:, 0], agreeing[:, 1] = points[:, 0] < 0.5, points[:, 0] >= 0.5
    agreeing[:, 2:4] = (points[:, 3:4] < 0.5) * 1.0
    return Judged(points, agreeing, np.ones(count), np.full(count, ""), np.ones(count, bool))


def test_information_of_statements():
    """Closed form: two statements of one level weigh nine to one, 0.531 bits; two that cancel give no information."""
    judged = planted()
    assert weights(judged).sum() == pytest.approx(1.0)
    gravity = [pair[1] for pair in level_shares(judged, 3).values()]
    assert gravity == pytest.approx([0.9, 0.1], abs=0.02)
    bits, chance = information_by_factor(judged)["gravity"]
    assert bits == pytest.approx(1.0 + 0.9 * np.log2(0.9) + 0.1 * np.log2(0.1), abs=0.06)
    assert chance < 0.03
    assert information_by_factor(judged)["driven bar"][0] < 0.03
    assert never_together(judged)["1a"] == ["1b"]
    assert not never_together(judged)["4a"]


def test_page_and_command(small, tmp_path, monkeypatch, capsys):
    """Contract: a row for each statement and level, pictures, a table of every parameter set, and a line on the terminal."""
    monkeypatch.setattr(parameter_sets_page, "agreeing", lambda choice, members: np.ones(len(CHECKS)))
    monkeypatch.setattr("scissordyn_paper.parameter_sets.LEADING_SETS", 4)
    assert command.paper(tmp_path, parameter_sets=True, number=12, threads=1) == 0
    shown = " ".join(capsys.readouterr().out.split())
    assert re.search(r"12 parameter sets, \d+ s of one processor. For the best one \d+.\d\d of 26 checks agree", shown)
    text = (tmp_path / "parameter_sets.html").read_text()
    assert all(check.key in text for check in CHECKS)
    assert text.count("data:image/svg+xml") == 2
    assert len((tmp_path / "parameter_sets.csv").read_text().splitlines()) == 13
    assert {path.name for path in (tmp_path / "figures").iterdir()} == {
        f"parameter_sets-{name}.{form}" for name in ("checks", "parameters") for form in ("png", "svg")
    }
    with pytest.raises(sd.InputError, match="--beyond and --parameter-sets together"):
        command.paper(tmp_path, beyond=True, parameter_sets=True)
    assert answer_parameter_sets(tmp_path, 12, engine=1).leading.agreeing_count.size == 4
    assert PaperCase(choice=DEFAULT).options.rtol == 1e-8
