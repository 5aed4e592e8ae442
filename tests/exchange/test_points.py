"""Mechanisms from a table of points."""

import math
from pathlib import Path

import numpy as np
import pytest

import scissordyn as sd
from scissordyn.cli.main import status_of

TABLE = """name,x,y,bars,support
O,0,0,left,fixed
P,900,500,left right,
Q,1800,0,right,slide 0
"""


def test_two_bars_and_a_slide() -> None:
    """Closed form: the slide of a slider-crank."""
    mechanism = sd.read_points(TABLE, unit="mm", linear_density=2.0).mechanism
    length = math.hypot(0.9, 0.5)
    assert mechanism.body("left").mass == pytest.approx(2.0 * length)
    assert mechanism.body("right").inertia == pytest.approx(2.0 * length**3 / 12.0)
    run = sd.simulate(mechanism.driven(speed=0.5, body="left"), until=0.5, samples=3)
    angle = run["angle"].sel(body="left").values
    place = run["position"].sel(body="block Q", axis="x").values
    assert place == pytest.approx(2.0 * length * np.cos(angle))


@pytest.mark.parametrize("delimiter", [";", "\t"])
def test_other_columns(delimiter: str) -> None:
    """Identity: semicolons and tabs separate as commas do; the order of columns is free."""
    lines = [line.split(",") for line in TABLE.splitlines()]
    turned = "\ufeff" + "\n".join(delimiter.join(cells[::-1]) for cells in lines)
    assert sd.read_points(turned, unit="mm").mechanism == sd.read_points(TABLE, unit="mm").mechanism


@pytest.mark.parametrize(
    ("text", "line"),
    [
        (
            "x,y\n0,1\n",
            "a table of points without the column 'name'; allowed: name, x, y, bars, support; type: name,x,y,bars,support",
        ),
        (TABLE.replace("900", "wide"), r"x = 'wide' \(line 3\); allowed: a number"),
        (
            TABLE.replace("fixed", "welded"),
            r"support 'welded' of point 'O' \(line 2\); allowed: fixed, slide ANGLE, or nothing",
        ),
        (TABLE.replace("left right", "left"), "bar 'right' has one point only, 'Q'; allowed: two points or more of each bar"),
        (TABLE + "O,1,1,,\n", r"point 'O' given twice \(line 5\); allowed: each point once"),
    ],
)
def test_refused(text: str, line: str) -> None:
    with pytest.raises(sd.InputError, match=line):
        sd.read_points(text)


def test_command(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path, case = tmp_path / "points.csv", tmp_path / "case.toml"
    path.write_text(TABLE, encoding="utf-8")
    assert status_of(["import", str(path), "--unit", "mm", "-o", str(case)]) == 0
    assert "note: no gravity and no drive" in capsys.readouterr().out
    assert sd.read_case(case).mechanism.bodies == sd.read_points(TABLE, unit="mm").mechanism.bodies
    assert status_of(["import", str(path), "--unit", "furlong", "-o", str(case)]) == 2
    assert "unit 'furlong' of a table; allowed: mm, cm, dm, m, um, in, ft" in capsys.readouterr().err
