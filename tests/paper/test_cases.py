"""The paper's runs as data and as case files."""

import math

import numpy as np
import pytest

import scissordyn as sd
from scissordyn.laws.elastic.bai_zhao import BaiZhaoAsPrinted
from scissordyn_paper.cases import OSCILLATION, Choice, PaperCase, contact_starts, every_case
from scissordyn_paper.figures import FIGURES, figure_of
from scissordyn_paper.open_question import ONE_AT_A_TIME
from scissordyn_paper.parameter_sets import FACTORS, choice_at
from scissordyn_paper.periodic import PERIODIC
from scissordyn_paper.runs import compute


def test_case_file_of_the_default_choice(tmp_path):
    """Contract: the case file of the default choice describes the array that is built by hand."""
    path = tmp_path / "case.toml"
    path.write_text(PaperCase(friction=0.03).toml)
    case = sd.read_case(path)
    joint = sd.Clearance(0.5e-3, damping=sd.Flores(0.9), friction=sd.LuGre(0.03), reference="onset")
    expected = sd.scissor(angle=sd.degrees(30)).with_clearance("A", joint).driven(speed=sd.rpm(150))
    assert case.mechanism.bodies == expected.bodies
    assert case.mechanism.joints == expected.joints
    assert case.mechanism.gravity == expected.gravity
    assert case.mechanism.drives[0].motion.speed == pytest.approx(sd.rpm(150), rel=1e-14)
    assert (case.run.until, case.run.samples, case.run.start) == (0.05, 2001, "concentric")


def test_fields_of_a_choice_in_the_mechanism():
    """Contract: each field of a choice is in the mechanism."""
    choice = Choice("slider", sd.degrees(60), "falling", 0.5, 30e-3, "bai-zhao-as-printed")
    described = PaperCase(0.2e-3, sd.rpm(100), choice=choice).build()
    joint = described.mechanism.joint("A").clearance
    laws = {"stiffness": BaiZhaoAsPrinted(), "damping": sd.Flores(0.5), "reference": "onset"}
    assert joint == sd.Clearance(0.2e-3, bearing_length=30e-3, **laws)
    assert described.mechanism.drives[0].motion.speed == pytest.approx(-sd.rpm(100), rel=1e-14)
    assert described.mechanism.bodies == sd.scissor(driven_bar="slider", angle=sd.degrees(60)).bodies


@pytest.mark.parametrize(
    "choice", [Choice(), Choice("slider", sd.degrees(60), "falling", 0.5, 30e-3, "bai-zhao-as-printed"), PERIODIC]
)
def test_cases_built_from_the_ideal_one(choice):
    """Contract: a case built on the ideal mechanism equals that of its file, for any contact law."""
    for case in (*every_case(choice), *contact_starts(choice)):
        ideal = case.ideal.without_contact_laws.build()
        assert ideal == case.ideal.build()
        if case.clearance is not None:
            assert case.build_from(ideal) == case.build()


def test_contact_laws_have_no_effect_on_a_constrained_contact():
    """Contract: a constrained contact does not depend on contact laws, so that the survey computes it once."""
    case = PaperCase(0.3e-3, constrained=True, choice=Choice(angle=sd.degrees(45), restitution=0.5, bearing_length=30e-3))
    other = case.without_contact_laws
    assert other.choice == Choice(angle=sd.degrees(45))
    one, two = (compute(each, trust=False) for each in (case, other))
    assert one.drop_attrs(deep=False).identical(two.drop_attrs(deep=False))


def test_speed_of_the_oscillation():
    """Closed form: amplitude times frequency is the speed of the stroke, and the run lasts two periods."""
    case = PaperCase(speed=sd.rpm(250), choice=Choice(angle=sd.degrees(45), travel="oscillating"))
    motion = case.build().mechanism.drives[0].motion
    assert isinstance(motion, sd.Harmonic)
    assert motion.amplitude * motion.angular_frequency == pytest.approx(sd.rpm(250), rel=1e-11)
    assert motion.mean == pytest.approx(sd.degrees(45), rel=1e-14)
    assert case.until * motion.angular_frequency == pytest.approx(4.0 * math.pi, rel=1e-11)


def test_no_run_meets_the_change_point():
    """Limit: the driven bar stays away from the angle zero, where the array can continue in two ways."""
    lowest = {"rising": [], "falling": [], "oscillating": []}
    for choice in (*ONE_AT_A_TIME, *(choice_at(u) for u in np.random.default_rng(1).random((64, len(FACTORS))))):
        for case in every_case(choice):
            turned = {"rising": 0.0, "falling": case.speed * case.until, "oscillating": OSCILLATION}[choice.travel]
            lowest[choice.travel].append(math.degrees(choice.angle - turned))
    assert min(lowest["rising"]) == pytest.approx(5.0)
    assert min(lowest["falling"]) == pytest.approx(10.0)
    assert min(lowest["oscillating"]) == pytest.approx(30.0)


def test_names_and_choices_are_distinct():
    """Contract: no two runs share a file name, and no choice is counted twice."""
    cases = every_case(Choice())
    assert len({case.name for case in cases}) == len(cases) == 20
    assert len({choice.words for choice in ONE_AT_A_TIME}) == len(ONE_AT_A_TIME)


def test_every_figure_finds_its_runs():
    """Contract: the runs that figures need are among those computed."""
    cases = set(every_case(Choice()))
    for figure in FIGURES.values():
        assert cases.issuperset(figure.cases)
        assert cases.issuperset(case.ideal for case in figure.cases)


def test_refused_cases():
    """Contract: a figure without results, friction in an ideal joint and a restitution above 1 are refused."""
    with pytest.raises(sd.InputError, match=r"figure 5; expected a figure with results: 6, 7"):
        figure_of(5)
    with pytest.raises(sd.InputError, match="without clearance"):
        PaperCase(None, friction=0.1)
    with pytest.raises(sd.InputError, match="restitution"):
        Choice(restitution=1.5)
