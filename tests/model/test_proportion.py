"""Numbers out of all proportion to the mechanism that they belong to are told; ordinary ones are not."""

from __future__ import annotations

import dataclasses
import json
import re
from pathlib import Path

import pytest

import scissordyn as sd
from scissordyn.config.file import read_case
from scissordyn.model.check import proportion_warnings
from scissordyn.model.mechanism import Mechanism

EXAMPLES = sorted((Path(__file__).parents[2] / "examples").glob("*.toml"))


def arm(**surfaces: float) -> Mechanism:
    """The array of the paper, of two units of 2 m, with clearance at A."""
    return sd.scissor(units=2).with_clearance("A", sd.Clearance(**{"clearance": 5e-4, **surfaces}))  # type: ignore[arg-type]


def changed(mechanism: Mechanism, name: str, **facts: object) -> Mechanism:
    """With other facts of one body."""
    bodies = tuple(dataclasses.replace(b, **facts) if b.name == name else b for b in mechanism.bodies)  # type: ignore[arg-type]
    return dataclasses.replace(mechanism, bodies=bodies)


def rotor(inertia: float) -> Mechanism:
    """With a motor."""
    motor = sd.Motor("m", "unit 1/bar 1", 1.0, 10.0, inertia=inertia)
    return dataclasses.replace(arm(), components=(motor,))


@pytest.mark.parametrize(
    ("mechanism", "message"),
    [
        (
            arm(bearing_length=1e6),
            r"joint 'A' has a bearing length of 1e\+06 m, .* times the size of the mechanism; check its unit",
        ),
        (arm(journal_radius=1e6), r"joint 'A' has a journal radius of 1e\+06 m"),
        (arm(clearance=0.5, journal_radius=1.0), r"joint 'A' has a clearance of 0\.5 m, 0\.2"),
        (changed(arm(), "slider", mass=1e9), r"body 'slider' has a mass of 1e\+09 kg, .* times that of body 'unit 1/bar 1'"),
        (changed(arm(), "unit 1/bar 1", inertia=1e9), r"body 'unit 1/bar 1' has a radius of gyration of"),
        (rotor(1e9), r"motor 'm' has a rotor of 1e\+09 kg m\^2"),
    ],
)
def test_absurd_numbers_are_told_once(mechanism: Mechanism, message: str) -> None:
    """Limit: a number a million times beyond the mechanism's own has one warning, with its name and the proportion."""
    (said,) = proportion_warnings(mechanism)
    assert re.match(message, said)


def test_a_run_and_a_check_tell_it(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    """Contract: the warning stands in a run, in many runs, and on the terminal before a run."""
    from scissordyn.cli.main import status_of
    from scissordyn.config.template import template

    wide = arm(bearing_length=1e6).driven(speed=1.0)
    (expected,) = proportion_warnings(wide)
    assert expected in json.loads(sd.simulate(wide, until=1e-3, samples=3).attrs["warnings"])
    many = sd.simulate_many(wide, {"A.clearance": [4e-4, 5e-4]}, until=1e-3)
    assert all(expected in text.splitlines() for text in many["warnings"].values.tolist())
    (tmp_path / "case.toml").write_text(template("scissor"), encoding="utf-8")
    assert status_of(["check", str(tmp_path / "case.toml"), "--set", "A.bearing_length=1e9 mm"]) == 0
    assert "has a bearing length of 1e+06 m" in " ".join(capsys.readouterr().out.split())


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_examples_are_in_proportion(path: Path) -> None:
    """Limit: no ordinary mechanism is told to be absurd."""
    assert proportion_warnings(read_case(path).mechanism) == []
