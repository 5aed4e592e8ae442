"""Drawings in DXF."""

import io
import math

import numpy as np
import pytest

import scissordyn as sd

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
    assert any("1 TEXT left out: it is not a bar" in note for note in notes)
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
    assert [guide.follower for guide in mechanism.guides] == [("bar 2", "pin 4")]  # the other pin on the line is fixed
    run = sd.simulate(mechanism.driven(speed=0.5, body="bar 1"), until=0.5, samples=20)
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
    assert any("'pin 2' and 'pin 3' at (100, 0) mm are not joined: they are 0.02 mm apart" in note for note in notes)
    assert any("'pin 5' at (50, 0) mm ends on 'bar 1'" in note for note in notes)


@pytest.mark.parametrize(
    ("corners", "closed", "sides"),
    [
        ([(0, 0), (1, 0), (1, 1)], False, [(0, 1), (1, 2)]),
        ([(0, 0), (1, 0), (1, 1)], True, [(0, 1), (1, 2), (2, 0)]),
        ([(0, 0), (1, 0), (1, 1), (0, 0)], False, [(0, 1), (1, 2), (2, 0)]),
        ([(0, 0), (2, 2), (1, 1)], False, [(0, 1)]),
        ([(0, 0), (1, 1), (2, 2)], True, [(0, 2)]),
        ([(0, 0), (2, 0), (1, 0), (1, 1), (1, 0)], False, [(0, 1), (2, 3)]),
    ],
)
def test_the_mass_of_a_polyline_is_that_of_its_sides_without_overlaps(corners, closed, sides):
    """Closed form: thin rods, mass centre and inertia by Steiner; an inch is 0.0254 m."""
    document, space = drawing(1)
    space.add_lwpolyline(corners, close=closed)
    space.add_lwpolyline([(0, 0, 0.5), (1, 0, 0.5)], format="xyb")
    mechanism, notes = sd.read_dxf(text(document), linear_density=2.0)
    body = mechanism.body("bar 1")
    rods = [(0.0254 * np.array(corners[a]), 0.0254 * np.array(corners[b])) for a, b in sides]
    masses = [2.0 * np.linalg.norm(a - b) for a, b in rods]
    centre = sum(m * (a + b) / 2 for m, (a, b) in zip(masses, rods, strict=True)) / sum(masses)
    arms = [(a + b) / 2 - centre for a, b in rods]
    assert body.mass == pytest.approx(sum(masses))
    assert np.add(body.position, body.turned(body.centre)) == pytest.approx(centre)
    assert body.inertia == pytest.approx(
        sum(m * ((a - b) @ (a - b) / 12 + r @ r) for m, (a, b), r in zip(masses, rods, arms, strict=True))
    )
    assert any(note.startswith("1 LWPOLYLINE left out: it is curved") for note in notes)


def arcs_only():
    document, space = drawing()
    space.add_arc((0, 0), 1, 0, 90)
    space.add_arc((1, 0), 1, 0, 90)
    return text(document)


@pytest.mark.parametrize(
    ("content", "options", "said"),
    [
        (arcs_only(), {}, "the DXF has no line that is a bar; it has 2 ARC"),
        ("not a drawing", {}, "cannot read the DXF"),
        (text(four_bar()[0]), {"unit": "cm"}, "unit 'cm', but the DXF has 'mm'"),
        (text(four_bar()[0]), {"unit": "parsec"}, "unit 'parsec'"),
        (text(drawing(0)[0]), {}, "without a unit of length"),
    ],
)
def test_what_is_no_linkage_is_one_line(content, options, said):
    """Contract: the error names what came."""
    with pytest.raises(sd.InputError, match=said) as error:
        sd.read_dxf(content, **options)
    assert "\n" not in str(error.value)


def test_a_file_without_a_header_has_no_unit():
    """Contract: the unit of the library's new documents is none of the file."""
    content = "0 SECTION 2 ENTITIES 0 LINE 8 0 10 0 20 0 11 80 21 60 0 ENDSEC 0 EOF ".replace(" ", "\n")
    with pytest.raises(sd.InputError, match="without a unit of length"):
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
