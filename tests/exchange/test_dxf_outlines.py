"""Drawings in DXF of parts by their outlines: areas, holes, joints, frames."""

import io
import itertools
import math

import numpy as np
import pytest
from tests.build import one_line_error

import scissordyn as sd
from scissordyn.cli.main import status_of

ezdxf = pytest.importorskip("ezdxf")

SHEET = {"thickness": 5e-3, "density": 7850.0}  # Steel sheet [m, kg/m^3]
AREA_DENSITY = 39.25  # [kg/m^2] of this sheet


def drawing():
    document = ezdxf.new("R2010")
    document.header["$INSUNITS"] = 4
    return document, document.modelspace()


def text(document):
    held = io.StringIO()
    document.write(held)
    return held.getvalue()


def slot(space, a, b, radius, hole=0.0, *, form="polyline", layer="0"):
    """Draw a bar with round ends between two points [mm], with a hole at each if `hole` is not 0."""
    length = math.dist(a, b)
    along = complex(b[0] - a[0], b[1] - a[1]) / length
    attributes = {"layer": layer}
    corners = [complex(*a) + along * z for z in (-1j * radius, length - 1j * radius, length + 1j * radius, 1j * radius)]
    places = [(z.real, z.imag) for z in corners]
    if form == "polyline":
        points = [(*place, bulge) for place, bulge in zip(places, (0, 1, 0, 1), strict=True)]
        space.add_lwpolyline(points, format="xyb", close=True, dxfattribs=attributes)
    else:
        turn = math.degrees(math.atan2(along.imag, along.real))
        space.add_arc(a, radius, turn + 90, turn + 270, dxfattribs=attributes)
        space.add_line(places[3], places[2], dxfattribs=attributes)
        space.add_line(places[0], places[1], dxfattribs=attributes)
        space.add_arc(b, radius, turn - 90, turn + 90, dxfattribs=attributes)
    for place in (a, b) if hole else ():
        space.add_circle(place, hole, dxfattribs=attributes)


def slot_numbers(length, radius, hole):
    """Return mass and inertia of a steel bar with round ends and two holes, from closed forms [m]."""
    half, disc = 0.5 * math.pi * radius**2, math.pi * hole**2
    offset = 4.0 * radius / (3.0 * math.pi)  # of a half disc's centre
    ends = half * (0.5 * radius**2 - offset**2 + (0.5 * length + offset) ** 2)
    holes = disc * (0.5 * hole**2 + 0.25 * length**2)
    area = 2.0 * radius * length + 2.0 * (half - disc)
    inertia = 2.0 * radius * length * (length**2 + 4.0 * radius**2) / 12.0 + 2.0 * (ends - holes)
    return AREA_DENSITY * area, AREA_DENSITY * inertia


def placed(body):
    """Return the mass centre of a body at the start."""
    return np.add(body.placed_position, body.turned(body.centre))


@pytest.mark.parametrize("form", ["polyline", "lines"])
@pytest.mark.parametrize("scale", [(1, 1), (-1, 1), (2, 2)])
def test_a_bar_with_round_ends_has_the_mass_of_its_closed_form(form, scale):
    """Closed form: mass, centre and inertia, however the outline is drawn, in a block that is turned, mirrored or scaled."""
    document, space = drawing()
    block = document.blocks.new("BAR")
    slot(block, (30, 0), (130, 0), 12, 5, form=form)
    space.add_blockref("BAR", (7, 9), dxfattribs={"xscale": scale[0], "yscale": scale[1], "rotation": 30})
    (body,) = sd.read_dxf(text(document), **SHEET).mechanism.bodies
    mass, inertia = slot_numbers(0.1 * scale[1], 0.012 * scale[1], 0.005 * scale[1])
    assert (body.mass, body.inertia) == pytest.approx((mass, inertia), rel=1e-12)
    middle = 0.08 * scale[0] * np.array([math.cos(math.pi / 6), 0.5]) + (0.007, 0.009)
    assert placed(body) == pytest.approx(middle, abs=1e-12)


def test_a_plate_with_holes_and_a_cutout_has_the_mass_of_its_closed_form():
    """Closed form: rectangle less two round holes and a rectangle; a ring around a hole and a point in it change nothing."""
    document, space = drawing()
    space.add_lwpolyline([(0, 0), (200, 0), (200, 100), (0, 100)], close=True)
    space.add_lwpolyline([(80, 20), (120, 20), (120, 60), (80, 60), (80, 20)])
    for x, radius in ((30, 10), (30, 8), (170, 15)):
        space.add_circle((x, 50), radius)
    space.add_point((170, 50))
    found = sd.read_dxf(text(document), **SHEET)
    (body,) = found.mechanism.bodies
    areas = np.array([0.02, -math.pi * 1e-4, -math.pi * 2.25e-4, -0.0016])
    centres = np.array([[0.1, 0.05], [0.03, 0.05], [0.17, 0.05], [0.1, 0.04]])
    own = np.array([0.05 / 12, 0.5e-4, 0.5 * 2.25e-4, 0.0032 / 12])  # polar, per area
    centre = areas @ centres / areas.sum()
    inertia = areas @ (own + ((centres - centre) ** 2).sum(axis=1))
    assert (body.mass, body.inertia) == pytest.approx((AREA_DENSITY * areas.sum(), AREA_DENSITY * inertia), rel=1e-12)
    assert placed(body) == pytest.approx(centre, abs=1e-12)
    assert len(body.points) == 2
    assert any(note.startswith("1 cutouts of LWPOLYLINE") for note in found.notes)


@pytest.mark.parametrize("seed", range(4))
def test_arcs_weigh_as_their_triangles(seed):
    """Cross-check by a second formulation: triangles from one corner to 20000 chords of each arc."""
    rng = np.random.default_rng(seed)
    document, space = drawing()
    angles = np.sort(rng.uniform(0, 2 * math.pi, 7))
    corners = rng.uniform(60, 100, 7) * np.exp(1j * angles)
    bulges = rng.uniform(-0.2, 0.4, 7)
    space.add_lwpolyline(list(zip(corners.real, corners.imag, bulges, strict=True)), format="xyb", close=True)
    space.add_circle((0, 0), 5)
    (body,) = sd.read_dxf(text(document), **SHEET).mechanism.bodies
    z = []
    for start, end, bulge in zip(corners, np.roll(corners, -1), bulges, strict=True):
        centre = start + (end - start) * (0.5 + 0.5j * (1 / bulge - bulge) / 2)
        z.append(centre + (start - centre) * np.exp(1j * np.linspace(0, 4 * math.atan(bulge), 20001)[:-1]))
    z = 1e-3 * np.concatenate(z)
    a, b, c = z[0], z[:-1], z[1:]
    areas = 0.5 * ((b - a).conj() * (c - a)).imag
    hole = math.pi * 25e-6
    mass = areas.sum() - hole
    centre = areas @ (a + b + c) / 3.0 / mass
    polar = areas @ (abs(a + b) ** 2 + abs(b + c) ** 2 + abs(c + a) ** 2) / 12.0 - 0.5 * hole * 25e-6
    assert body.mass == pytest.approx(AREA_DENSITY * mass, rel=1e-8)
    assert placed(body) == pytest.approx((centre.real, centre.imag), abs=1e-9)
    assert body.inertia == pytest.approx(AREA_DENSITY * (polar - mass * abs(centre) ** 2), rel=1e-8)


def test_a_four_bar_of_outlines_moves_as_the_one_that_is_described():
    """Cross-check: its torque is that of bodies with the closed forms of mass and inertia; its frame is on the ground layer."""
    document, space = drawing()
    joints = [(0, 0), (30, 40), (175, 110), (160, 0)]
    for (a, b), layer in zip(itertools.pairwise(joints), ("input", "rod", "rocker"), strict=True):
        slot(space, a, b, 10, 4, layer=layer, form="lines" if layer == "rod" else "polyline")
    slot(space, joints[0], joints[3], 14, 4, layer="ground")
    mechanism, notes = sd.read_dxf(text(document), **SHEET)
    assert mechanism.input_body == "bar 1"
    assert not any("left out" in note or "not joined" in note for note in notes)
    bodies = []
    for number, (a, b) in enumerate(itertools.pairwise(1e-3 * np.array(joints)), start=1):
        length = math.dist(a, b)
        mass, inertia = slot_numbers(length, 0.01, 0.004)
        points, angle = {"a": (0.0, 0.0), "b": (length, 0.0)}, math.atan2(*(b - a)[::-1])
        bodies.append(sd.Body(f"bar {number}", mass, inertia, points, (length / 2, 0.0), tuple(a), angle))
    pins = [(("ground", "O"), "a"), (("bar 1", "b"), "a"), (("bar 2", "b"), "a"), (("bar 3", "b"), None)]
    joined = [sd.Revolute(f"J{k}", (f"bar {k + 1}", "a") if at else ("ground", "C"), end) for k, (end, at) in enumerate(pins)]
    other = sd.Mechanism(tuple(bodies), tuple(joined), ground=(("O", (0.0, 0.0)), ("C", (0.16, 0.0))), gravity=0.0)
    runs = [sd.simulate(part.driven(speed=sd.rpm(60), body="bar 1"), until=1.0, samples=21) for part in (mechanism, other)]
    for name in ("position", "angle", "drive_torque"):
        assert runs[0][name].values == pytest.approx(runs[1][name].values, rel=1e-8, abs=1e-9)


def test_overlapping_parts_keep_their_own_holes():
    """Contract: a circle is a hole of the outlines around it on its layer or in its block, or else of all around it."""
    document, space = drawing()
    slot(space, (0, 0), (100, 0), 10, 4, layer="a")
    slot(space, (50, -40), (50, 40), 10, 4, layer="b")
    link = document.blocks.new("LINK")
    slot(link, (0, 0), (0, 60), 10, 4)
    space.add_circle((0, 0), 3, dxfattribs={"layer": "ground"})
    space.add_blockref("LINK", (100, 0))
    space.add_blockref("LINK", (50, 40), dxfattribs={"rotation": -90})
    mechanism = sd.read_dxf(text(document), **SHEET).mechanism
    assert sorted(len(body.points) for body in mechanism.bodies) == [2, 2, 2, 2]
    bodies = sorted(joint.bodies for joint in mechanism.joints)
    assert bodies == [("bar 1", "bar 3"), ("bar 1", "ground"), ("bar 2", "bar 4")]
    space.add_circle((50, 0), 4, dxfattribs={"layer": "pivot"})
    assert ("bar 1", "bar 2") in [joint.bodies for joint in sd.read_dxf(text(document), **SHEET).mechanism.joints]


def test_discs_splines_and_stretched_arcs_are_outlines():
    """Closed form: a crank disc, and an ellipse drawn as ellipse, spline and stretched circle, within chords of 1e-4."""
    document, space = drawing()
    space.add_circle((0, 0), 50)
    space.add_circle((0, 0), 5)
    space.add_circle((30, 0), 4)
    (disc,) = sd.read_dxf(text(document), **SHEET).mechanism.bodies
    areas, places = math.pi * np.array([2500e-6, -25e-6, -16e-6]), np.array([0.0, 0.0, 0.03])
    assert disc.mass == pytest.approx(AREA_DENSITY * areas.sum(), rel=1e-12)
    assert placed(disc)[0] == pytest.approx(areas @ places / areas.sum(), abs=1e-12)
    circle = document.blocks.new("CIRCLE")
    circle.add_circle((0, 0), 1)
    for form in ("ellipse", "spline", "circle"):
        document.modelspace().delete_all_entities()
        if form == "ellipse":
            space.add_ellipse((0, 0), (80, 0), 0.5)
        elif form == "spline":
            space.add_spline([(80 * math.cos(t), 40 * math.sin(t)) for t in np.linspace(0, 2 * math.pi, 65)])
        else:
            space.add_blockref("CIRCLE", (0, 0), dxfattribs={"xscale": 80, "yscale": 40})
        space.add_circle((20, 0), 10)
        (body,) = sd.read_dxf(text(document), **SHEET).mechanism.bodies
        assert body.mass == pytest.approx(AREA_DENSITY * math.pi * 3.1e-3, rel=5e-4)


@pytest.mark.parametrize(
    ("options", "holes", "said"),
    [
        ({"thickness": 1e-3}, 5, "outlines without a density; expected both"),
        ({"thickness": 1e-3, "density": -1.0}, 5, "thickness = 0.001 m, density = -1 kg/m^3; expected values above 0"),
        (SHEET, 0, "the DXF has no closed outline with a hole; expected a closed outline with circles for each part"),
        ({}, 5, "outlines of parts need --thickness and --density"),
    ],
)
def test_missing_numbers_and_holes_are_one_line(options, holes, said):
    """Contract: what is missing is named in one line."""
    document, space = drawing()
    slot(space, (0, 0), (100, 0), 12, holes)
    with one_line_error(said):
        sd.read_dxf(text(document), **options)


def test_an_arc_without_bound_is_one_line():
    """Contract: the bulge of a full turn, which no arc has."""
    document, space = drawing()
    space.add_lwpolyline([(0, 0, 0), (9, 0, 1e300), (9, 9, 0)], format="xyb", close=True)
    with pytest.raises(sd.InputError, match="of the DXF has wrong coordinates: a bulge without bound; expected numbers"):
        sd.read_dxf(text(document), **SHEET)


def test_what_is_no_part_is_named():
    """Contract: open outlines, outlines without holes and circles beside all outlines, with handles and places."""
    document, space = drawing()
    slot(space, (0, 0), (100, 0), 12, 5)
    space.add_line((0, 50), (100, 50))
    space.add_lwpolyline([(0, 70), (50, 70), (50, 90)], close=True)
    space.add_circle((200, 0), 5)
    notes = sd.read_dxf(text(document), **SHEET).notes
    assert any("from (0, 50) mm to (100, 50) mm left out: it closes no outline" in note for note in notes)
    assert any(note.startswith("LWPOLYLINE") and note.endswith("left out: no hole, so no pin") for note in notes)
    assert any("at (200, 0) mm left out: no bar passes through it" in note for note in notes)


@pytest.mark.parametrize(
    ("corners", "hole", "said"),
    [
        ([(0, 0), (100, 0), (100, 20), (0, 20)], (10, 10, 5), None),
        ([(0, 0), (100, 0), (0, 20), (50, 20)], (50, 4, 2), "crosses itself at x = 0.03333 m, y = 0.01333 m: check the mass"),
        ([(0, 0), (100, 0), (0, 100)], (45, 45, 8), "crosses CIRCLE"),
    ],
)
def test_outlines_that_cross_are_named(corners, hole, said):
    """The area of an outline that crosses itself, or a hole across its edge, is not that of the part."""
    document, space = drawing()
    space.add_lwpolyline(corners, close=True)
    space.add_circle(hole[:2], hole[2])
    slot(space, (10, 60), (90, 60), 8, 3)
    notes = [note for note in sd.read_dxf(text(document), **SHEET).notes if "crosses" in note]
    assert (said in notes[0] and len(notes) == 1) if said else not notes


def test_the_command_takes_thickness_and_density_with_units(tmp_path, monkeypatch, capsys):
    """Contract: the case has the masses; a file of another kind, and an exported drawing with its masses, are named."""
    monkeypatch.chdir(tmp_path)
    document, space = drawing()
    slot(space, (0, 0), (100, 0), 12, 5)
    document.saveas("bar.dxf")
    sheet = ["--thickness", "5 mm", "--density", "7.85 g/cm^3"]
    assert status_of(["import", "bar.dxf", *sheet, "-o", "case.toml"]) == 0
    assert "without their holes, of 39.25 kg/m^2" in " ".join(capsys.readouterr().out.split())
    (body,) = sd.read_case("case.toml").mechanism.bodies
    assert body.mass == pytest.approx(slot_numbers(0.1, 0.012, 0.005)[0], rel=1e-12)
    with pytest.warns(UserWarning, match="gravity: left out"):
        sd.export(sd.four_bar(), "own.dxf", pin_radius=2e-3)
    assert "thickness and density are not used" in str(sd.read_drawing("own.dxf", **SHEET).notes)
    (tmp_path / "points.csv").write_text("name,x,y,bars\nA,0,0,a\nB,1,0,a\n")
    assert status_of(["import", "points.csv", *sheet, "-o", "other.toml"]) == 2
    assert "thickness = 0.005 does not apply to 'points.csv'" in capsys.readouterr().err
