"""Tables of points."""

import math

import numpy as np
import pytest
from tests.build import one_line_error

import scissordyn as sd

# Table of points of a slider-crank [mm]
TABLE = """name,x,y,bars,support
O,0,0,left,fixed
P,900,500,left right,
Q,1800,0,right,slide 0
"""


def test_two_bars_and_a_slide():
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
def test_other_columns(delimiter):
    """Identity: semicolons and tabs separate as commas do; the order of columns is free."""
    lines = [line.split(",") for line in TABLE.splitlines()]
    turned = "\ufeff" + "\n".join(delimiter.join(cells[::-1]) for cells in lines)
    assert sd.read_points(turned, unit="mm").mechanism == sd.read_points(TABLE, unit="mm").mechanism


@pytest.mark.parametrize(
    ("text", "line"),
    [
        (
            "x,y\n0,1\n",
            "the table of points has no column 'name'; expected name, x, y, bars, support; for example name,x,y,bars,support",
        ),
        (TABLE.replace("900", "wide"), r"x = 'wide' \(line 3\); expected a number"),
        (
            TABLE.replace("fixed", "welded"),
            r"unknown support 'welded' of point 'O' \(line 2\); expected fixed, slide ANGLE, or nothing",
        ),
        (TABLE.replace("left right", "left"), "bar 'right' has only one point, 'Q'; expected two points or more of each bar"),
        (TABLE + "O,1,1,,\n", r"point 'O' is given twice \(line 5\); expected each point once"),
    ],
)
def test_refused(text, line):
    """Bad input: one line with the place in the table."""
    with pytest.raises(sd.InputError, match=line):
        sd.read_points(text)


def test_command(tmp_path, answer):
    """Contract: `import` writes the case of a table and names what the table lacks; an unknown unit is one line."""
    path, case = tmp_path / "points.csv", tmp_path / "case.toml"
    path.write_text(TABLE, encoding="utf-8")
    assert "note: no gravity and no drive" in answer("import", path, "--unit", "mm", "-o", case)
    assert sd.read_case(case).mechanism.bodies == sd.read_points(TABLE, unit="mm").mechanism.bodies
    line = answer("import", path, "--unit", "furlong", "-o", case, status=2)
    assert "unknown unit 'furlong' of a table; expected mm, cm, dm, m, um, in, ft" in line


# Table of points of a scissor unit [m]
ARMS = """name,x,y,bars,support
A,0,0,a,fixed
C,0.5,0.5,a b,
B,1,1,a,
D,0,1,b,
E,1,0,b,slide 0
"""


@pytest.mark.parametrize("seed", range(6))
def test_the_order_of_rows_changes_no_mass(seed):
    """Identity: bars of three points on one line have the mass of a bar, in any order and with rounded coordinates."""
    rng = np.random.default_rng(seed)
    head, *rows = ARMS.splitlines()
    kink = 1e-4 * seed  # of the middle point, as tables round it
    shuffled = [rows[k] for k in rng.permutation(5)]
    text = "\n".join([head, *shuffled]).replace("C,0.5,0.5", f"C,{0.5 + kink},0.5")
    mechanism, notes = sd.read_points(text)
    for body in mechanism.bodies:
        if body.rotates:
            assert body.mass == pytest.approx(math.sqrt(2.0), abs=1e-12 + 2.0 * kink**2)
            assert body.inertia == pytest.approx(math.sqrt(2.0) / 6.0, abs=1e-12 + 2.0 * kink)
            assert np.add(body.position, body.turned(body.centre)) == pytest.approx((0.5, 0.5), abs=1e-12 + 2.0 * kink)
    assert not any("are not on one line" in note for note in notes)


def test_a_bar_whose_points_are_not_on_one_line_is_made_of_the_shortest_rods():
    """Closed form: an angulated bar of two arms, and the rods of a square, in every order of rows."""
    angulated = "name,x,y,bars\nA,0,0,p\nB,3,4,p\nC,6,0,p\n"
    mechanism, notes = sd.read_points(angulated)
    assert mechanism.body("p").mass == pytest.approx(10.0)
    assert "the points of bar 'p' are not on one line: its mass is that of rods A-B, B-C" in notes
    square = ["A,0,0,p", "B,1,0,p", "C,1,1,p", "D,0,1,p"]
    made = set()
    for order in ([0, 1, 2, 3], [3, 1, 0, 2], [2, 0, 3, 1]):
        body = sd.read_points("\n".join(["name,x,y,bars", *(square[k] for k in order)])).mechanism.body("p")
        made.add((round(body.mass, 12), *np.round(np.add(body.position, body.turned(body.centre)), 12)))
    assert len(made) == 1
    assert next(iter(made))[0] == 3.0


@pytest.mark.parametrize(
    ("text", "notes"),
    [
        (
            TABLE.replace("support\n", "support,mass\n").replace("right,\n", "right,,3\n"),
            {"column 'mass' left out: it has values in line 3"},
        ),
        (TABLE.replace("support\n", "support,Colour\n"), {"column 'Colour' left out: it is empty"}),
        (TABLE.replace("right,\n", "right,,\n"), set()),
        (TABLE + "Z,1,1,,fixed\n", {"point 'Z' (line 5) left out: it is on no bar"}),
        (TABLE + ",,,,\n\nZ,1,1,,slide 3\n", {"point 'Z' (line 7) left out: it is on no bar"}),
        (TABLE.replace("O,", "O.1,"), {"'O.1' (line 2) is called 'O_1' in the case"}),
        (
            TABLE + "R,1800,0,left,\n",
            {"points Q, R have the same place and are not joined: bars that share a point share a pin"},
        ),
        (
            TABLE.replace("fixed", "").replace("slide 0", ""),
            {"nothing is grounded: write 'fixed' in the column 'support' of each fixed point"},
        ),
    ],
)
def test_what_is_not_used_is_named(text, notes):
    """Contract: columns, points without bars, changed names and coincident points; nothing else is said."""
    always = {
        "bars have 1 kg/m, as the table gives no masses",
        "no gravity and no drive: add [drive] to the case",
        "blocks that slide have 0.1 kg each",
    }
    said = {note for note in sd.read_points(text, unit="mm").notes if "not on one line" not in note}
    assert said - always == notes


@pytest.mark.parametrize(
    "written",
    [
        TABLE.upper().replace("LEFT", "left").replace("RIGHT", "right"),
        TABLE.replace("slide 0", "Slide 0 deg"),
        TABLE.replace("slide 0", "slide 0°"),
        TABLE.replace("slide 0", "slide 0 rad"),
        TABLE.replace("slide 0", "slide"),
        TABLE.replace("left right", '"left, right"'),
        TABLE.replace("left right", "left;right"),
        TABLE.replace("900", "9e2").replace("500", '"500,0"'),
        "\n" + TABLE.replace("\n", "\r\n"),
        "sep=;\n" + TABLE.replace(",", ";").replace("500", "500,00"),
        "sep=\t\r\n" + TABLE.replace(",", "\t"),
    ],
)
def test_the_ways_of_spreadsheets(written):
    """Identity: capitals, units of the angle, quoted cells, decimal commas, empty lines and Excel's first line."""
    assert sd.read_points(written, unit="mm").mechanism == sd.read_points(TABLE, unit="mm").mechanism


def test_an_angle_in_degrees_and_radians():
    """Closed form: a right angle is pi/2."""
    for angle in ("90", "90 deg", "90°", "1.5707963267948966 rad"):
        (guide,) = sd.read_points(TABLE.replace("slide 0", f"slide {angle}")).mechanism.guides
        assert guide.direction == pytest.approx(math.pi / 2)


@pytest.mark.parametrize(
    ("encoding", "said"),
    [
        ("utf-8", ""),
        ("utf-8-sig", ""),
        ("utf-16", ""),
        ("utf-16-le", ""),
        ("utf-16-be", ""),
        ("utf-32", ""),
        ("latin-1", "text: line 2 is not UTF-8; the file is read as Windows-1252 (Latin-1)"),
    ],
)
def test_encodings(encoding, said, tmp_path):
    """Identity: what spreadsheets write is one table; an encoding that was assumed is named."""
    path = tmp_path / "points.csv"
    path.write_bytes(TABLE.replace("left", "Träger").encode(encoding))
    mechanism, notes = sd.read_drawing(path, unit="mm")
    assert [body.name for body in mechanism.bodies][:2] == ["Träger", "right"]
    assert notes[: bool(said)] == (said,) * bool(said)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (TABLE.replace("900,500", "900,5,500,5"), r"line 3 of the table has 7 cells for 5 columns"),
        (TABLE.replace("support", "x"), "the table of points has 2 columns 'x'"),
        (TABLE.replace("O,0", ",0"), r"line 2: the point has no name"),
        (TABLE.replace("left right", "left.1 left_1"), r"'left_1' \(line 3\) and 'left.1' both become 'left_1'"),
        (TABLE.replace("slide 0", "slide far"), r"the angle of a slide = 'far' \(line 4\)"),
        (TABLE.replace("slide 0", "slide 3 grad"), r"unknown support 'slide 3 grad' of point 'Q' \(line 4\)"),
        ("name,x,y,bars\nA,0,0,\nB,1,0,\n", "the table of points has no bars"),
        ("", "has no column 'name'"),
        ('name,x,y,bars\nA,0,0,"' + "a" * 200_000, "field larger than field limit"),
        ("name,x,y,bars\n" + "\n".join(f"P{k},{k},0,a" for k in range(10_001)), "more than 10000 points"),
    ],
)
def test_tables_that_cannot_be_right(text, said):
    """Contract: one line with the place."""
    with one_line_error(match=said):
        sd.read_points(text)
