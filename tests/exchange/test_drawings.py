"""Drawings in DXF, and tables of points."""

import io
import math
from pathlib import Path

import numpy as np
import pytest

import scissordyn as sd
from scissordyn.cli.main import status_of
from scissordyn.errors import InputError

ezdxf = pytest.importorskip("ezdxf")


def drawing(unit=4):
    document = ezdxf.new("R2010")
    document.header["$INSUNITS"] = unit
    return document, document.modelspace()


def text(document):
    held = io.StringIO()
    document.write(held)
    return held.getvalue()


def four_bar():
    document, space = drawing()
    for start, end in (((0, 0), (30, 40)), ((30, 40), (175, 110)), ((175, 110), (160, 0))):
        space.add_line(start, end, dxfattribs={"layer": "input" if start == (0, 0) else "bars"})
    space.add_line((0, 0), (160, 0), dxfattribs={"layer": "Ground"})
    return document, space


def test_a_four_bar_moves_as_the_one_that_is_described():
    """Cross-check: the same linkage from its lengths, by `four_bar`."""
    document, space = four_bar()
    space.add_text("four-bar")
    mechanism, notes = sd.read_dxf(text(document))
    assert mechanism.input_body == "bar 1"
    run = sd.simulate(mechanism.driven(speed=sd.rpm(60)), until=1.0, samples=50)
    lengths = {"crank": 0.05, "coupler": math.hypot(0.145, 0.07), "rocker": math.hypot(0.015, 0.11), "ground": 0.16}
    other = sd.four_bar(**lengths, angle=math.atan2(40, 30))
    exact = sd.simulate(other.driven(speed=sd.rpm(60)), until=1.0, samples=50)
    assert run["angle"].sel(body="bar 2").values == pytest.approx(exact["angle"].sel(body="coupler").values, abs=1e-9)
    assert any("1 TEXT left out" in note for note in notes)
    assert any("kg/m along each bar is assumed" in note for note in notes)


def test_bars_that_cross_are_joined_where_a_point_is_drawn():
    """Closed form: the end of a scissor unit, whose joint slides on a guide, is at 2 L cos(angle)."""
    document, space = drawing(6)
    space.add_line((0, 0), (0.8, 0.6))
    space.add_line((0, 0.6), (0.8, 0))
    space.add_point((0, 0), dxfattribs={"layer": "ground"})
    space.add_line((-1, 0), (3, 0), dxfattribs={"layer": "guide"})
    crossed, _ = sd.read_dxf(text(document))
    assert len(crossed.joints) == 1
    space.add_circle((0.4, 0.3), 0.01)
    mechanism, _ = sd.read_dxf(text(document))
    assert len(mechanism.joints) == 2
    assert {guide.follower for guide in mechanism.guides} == {("bar 1", "pin 1"), ("bar 2", "pin 4")}
    kept = sd.Mechanism(
        mechanism.bodies,
        mechanism.joints,
        tuple(g for g in mechanism.guides if g.follower[0] == "bar 2"),
        ground=mechanism.ground,
    )
    run = sd.simulate(kept.driven(speed=0.5, body="bar 1"), until=0.5, samples=20)
    angle = run["angle"].sel(body="bar 1").values
    x, y = run["position"].sel(body="bar 2").values.T
    assert x == pytest.approx(0.5 * np.cos(angle), abs=1e-9)
    assert y == pytest.approx(0.5 * np.sin(angle), abs=1e-9)


def test_ends_that_nearly_meet_or_touch_a_bar_are_named():
    """Contract: what is not joined is said."""
    document, space = drawing()
    space.add_line((0, 0), (100, 0))
    space.add_line((100.02, 0), (100, 80))
    space.add_line((50, 0), (50, 70))
    _, notes = sd.read_dxf(text(document))
    assert any("'pin 2' and 'pin 3' are 2e-05 m apart" in note for note in notes)
    assert any("'pin 5' ends on 'bar 1'" in note for note in notes)


def test_polylines_are_plates_and_inches_are_metres():
    """Closed form: two thin rods of 1 in at right angles; mass centre at a quarter of both, inertia by Steiner."""
    document, space = drawing(1)
    space.add_lwpolyline([(0, 0), (1, 0), (1, 1)])
    space.add_lwpolyline([(0, 0, 0.5), (1, 0, 0.5)], format="xyb")
    mechanism, notes = sd.read_dxf(text(document), linear_density=2.0)
    plate = mechanism.body("bar 1")
    inch = 0.0254
    sides = np.array([[0, 0], [1, 0], [1, 1]]) * inch
    lengths = [inch, inch, math.sqrt(2) * inch]
    middles = [(sides[0] + sides[1]) / 2, (sides[1] + sides[2]) / 2, (sides[2] + sides[0]) / 2]
    centre = sum(n * m for n, m in zip(lengths, middles, strict=True)) / sum(lengths)
    assert plate.mass == pytest.approx(2.0 * sum(lengths))
    assert plate.centre == pytest.approx(centre)
    assert plate.inertia == pytest.approx(
        sum(2.0 * n * (n * n / 12 + (m - centre) @ (m - centre)) for n, m in zip(lengths, middles, strict=True))
    )
    assert any("1 LWPOLYLINE left out" in note for note in notes)


def arcs_only():
    document, space = drawing()
    space.add_arc((0, 0), 1, 0, 90)
    space.add_arc((1, 0), 1, 0, 90)
    return text(document)


@pytest.mark.parametrize(
    ("content", "options", "said"),
    [
        (arcs_only(), {}, "without lines that are bars; it has 2 ARC"),
        ("not a drawing", {}, "no DXF"),
        (text(four_bar()[0]), {"unit": "cm"}, "unit 'cm', but the DXF says 'mm'"),
        (text(four_bar()[0]), {"unit": "parsec"}, "unit 'parsec'"),
        (text(drawing(0)[0]), {}, "without a unit of length"),
    ],
)
def test_what_is_no_linkage_is_one_line(content, options, said):
    """Contract: the error names what came."""
    with pytest.raises(InputError, match=said) as error:
        sd.read_dxf(content, **options)
    assert "\n" not in str(error.value)


def test_a_file_without_a_header_has_no_unit():
    """Contract: the unit of the library's new documents is none of the file."""
    content = "0 SECTION 2 ENTITIES 0 LINE 8 0 10 0 20 0 11 80 21 60 0 ENDSEC 0 EOF ".replace(" ", "\n")
    with pytest.raises(InputError, match="without a unit of length"):
        sd.read_dxf(content)
    mechanism, notes = sd.read_dxf(content, unit="mm")
    assert mechanism.bodies[0].extent == pytest.approx(0.1)
    assert any("nothing is grounded" in note for note in notes)


def test_blocks_are_expanded():
    """Closed form: a block of one bar, rotated and moved by its insert, on the layer of the insert."""
    document, space = drawing()
    document.blocks.new("BAR").add_line((0, 0), (100, 0))
    space.add_blockref("BAR", (50, 20), dxfattribs={"rotation": 90, "layer": "input"})
    body = sd.read_dxf(text(document)).mechanism.bodies[0]
    assert body.position == pytest.approx((0.05, 0.02))
    assert (body.angle, body.extent) == pytest.approx((math.pi / 2, 0.1))


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
