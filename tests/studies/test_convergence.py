"""The tolerance that a quantity of a run needs."""

import itertools
import json
import math

import numpy as np
import pytest

import scissordyn as sd
from scissordyn.cli.main import status_of
from scissordyn.studies.compute.convergence import Level, _agrees, _settings_to_try, read_wanted


@pytest.fixture(scope="module")
def arm():
    """Return the paper's array."""
    return sd.scissor(units=2).with_clearance("A", sd.Clearance(0.5e-3)).driven(speed=sd.rpm(150))


def test_chosen_tolerance_is_enough(arm):
    """Limit: the quantity is within the wanted error of a run at 1e-11; a smaller error needs a tighter tolerance."""
    options = sd.Options(0.01)
    exact = float(sd.simulate(arm, until=0.01, rtol=1e-11, atol=1e-11)["peak_force"].max())
    found = {within: sd.convergence(arm, options, "A.peak_force", within=within) for within in (1e-2, 1e-6)}
    for within, one in found.items():
        level = next(level for level in one.levels if level.setting == one.setting)
        assert abs(level.value / exact - 1.0) < within
        assert not one.chaotic
    assert found[1e-6].setting < found[1e-2].setting
    assert [level.setting for level in found[1e-2].levels] == [
        level.setting for level in found[1e-6].levels[: len(found[1e-2].levels)]
    ]


def test_agreement():
    """Closed form: two finer levels must agree within the wanted error or the spread of members; failed ones never do."""

    def level(value, error=0.0, cause=""):
        return Level(1e-3, value, 0.0, error, 1.0, cause)

    assert _agrees(level(1.0), [level(1.009), level(1.005)], 0.01)
    assert not _agrees(level(1.0), [level(1.0), level(1.02)], 0.01)
    assert not _agrees(level(1.0), [level(1.02), level(1.0)], 0.01)
    assert _agrees(level(1.0, 0.05), [level(1.1, 0.05), level(1.0, 0.05)], 0.01)
    assert not _agrees(level(1.0), [level(1.0, cause="stuck"), level(1.0)], 0.01)
    assert not _agrees(level(math.nan), [level(1.0), level(1.0)], 0.01)
    assert _agrees(level(math.inf), [level(math.inf), level(math.inf)], 0.01)
    assert not _agrees(level(math.inf), [level(math.inf), level(1.0)], 0.01)


def test_chaotic_motion_is_reported():
    """Limit: members of a chaotic motion differ, and the result says so."""
    arm = sd.scissor(units=2).with_clearance("all", sd.Clearance(0.5e-3)).driven(speed=sd.rpm(150))
    found = sd.convergence(arm, sd.Options(0.12), "contact_count", within=0.001, members=3)
    assert found.chaotic
    assert max(level.spread for level in found.levels) > 0.001


def test_steps_of_hard_contact(arm):
    """Contract: with hard contact the step is halved from level to level."""
    hard = arm.replace("A.contact", "hard")
    found = sd.convergence(hard, sd.Options(0.01), "peak_drive_torque", within=0.05)
    assert found.varied == "step"
    settings = [level.setting for level in found.levels]
    assert all(coarse == 2.0 * fine for coarse, fine in itertools.pairwise(settings))
    if found.options:
        assert found.options == {"step": found.setting}


def test_steps_around_a_given_one(arm):
    """Contract: a shorter given step is in the middle of those tried; a longer one has no effect."""
    hard = arm.replace("A.contact", "hard")
    steps = {
        asked: [each[0] for each in _settings_to_try(hard, sd.Options(0.01, step=asked), "accuracy")[1]]
        for asked in (None, 1e-8, 1e-2)
    }
    assert steps[1e-8] == [1e-8 * 2.0**k for k in range(4, -4, -1)]
    assert steps[None] == steps[1e-2] != steps[1e-8]


@pytest.mark.parametrize(
    ("text", "wanted"),
    [
        ("tip.error within 1 %", ("tip.error", 0.01)),
        ("peak_force within 0.5%", ("peak_force", 0.005)),
        (" unit 1/pivot.peak_force within 2 %", ("unit 1/pivot.peak_force", 0.02)),
    ],
)
def test_text_of_a_wanted_error(text, wanted):
    """Contract: a measure and a percentage, 1 % by default."""
    assert read_wanted(text)[0] == wanted[0]
    assert read_wanted(text)[1] == pytest.approx(wanted[1])
    assert read_wanted(wanted[0])[1] == 0.01


@pytest.mark.parametrize("text", ["", "tip.error within", "tip.error within 0 %", "tip.error within 3 mm", "two words"])
def test_refused_texts(text):
    """Contract: any other text is refused in one line."""
    with pytest.raises(sd.InputError, match="wrong form of"):
        read_wanted(text)


def test_unknown_measures(arm):
    """Contract: an unknown measure or joint is refused before a run."""
    with pytest.raises(sd.InputError, match="unknown measure"):
        sd.convergence(arm, sd.Options(0.01), "peak_forces")
    with pytest.raises(sd.InputError, match="no joint"):
        sd.convergence(arm, sd.Options(0.01), "Q.peak_force")


def test_events_that_do_not_happen(arm):
    """Contract: a tip that never settles does so at every tolerance; a measure without a value is refused."""
    tracked = arm.track("tip", "unit 2/bar 1", "end", tolerance=1e-6)
    found = sd.convergence(tracked, sd.Options(0.001), "settling_time")
    assert [(level.value, level.spread) for level in found.levels] == [(math.inf, 0.0)] * 3
    assert found.setting == found.levels[0].setting
    with pytest.raises(sd.InputError, match="'deployment_time' has no value in this run"):
        sd.convergence(arm, sd.Options(0.001), "deployment_time")


def test_command(arm, tmp_path, capsys):
    """Contract: `check --converge` gives the result of Python, and the command to run with it."""
    sd.write_case(arm, tmp_path / "case.toml", run=sd.Options(0.005))
    case = str(tmp_path / "case.toml")
    assert status_of(["check", case, "--converge", "peak_force within 2 %", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)["convergence"]
    found = sd.convergence(arm, sd.Options(0.005), "peak_force", within=0.02)
    assert told["setting"] == found.setting
    assert np.array([level["value"] for level in told["levels"]]) == pytest.approx([level.value for level in found.levels])
    assert status_of(["check", case, "--converge", "peak_force within 2 %"]) == 0
    assert f"--set run.rtol={found.setting:g}" in " ".join(capsys.readouterr().out.split())
    assert status_of(["check", case, "--set", "A.clearance=0.2 mm", "--converge", "peak_force within 20 %"]) == 0
    assert "--set 'A.clearance=0.2 mm' --set run.rtol=" in " ".join(capsys.readouterr().out.split())
