"""The forms in which CAD programs write one drawing: extrusions, blocks, polylines of all versions, hidden entities."""

import math

import numpy as np
import pytest
from tests.build import one_line_error

import scissordyn as sd
from scissordyn.exchange import dxf_entity

from .test_drawings import ezdxf, text

MIRRORED = {"extrusion": (0, 0, -1)}  # DXF attributes of an entity that is seen from behind

FIGURE = [
    ("0", [(0, 0), (100, 200)], False),
    ("0", [(100, 200), (300, 200), (300, 320)], False),
    ("input", [(300, 320), (420, 60)], False),
    ("0", [(420, 60), (500, 60), (470, 130)], True),
    ("0", [(150, 300), (250, 120)], False),
    ("0", [(200, 200)], False),
    ("GROUND", [(0, 0)], False),
    ("ground", [(500, 60)], False),
    ("ground", [(465, 80)], False),  # within the plate
    ("guide", [(400, 360), (200, 280)], False),
]
"""Layer, corners, and True for a closed outline of each shape in a drawing; one corner means a point or circle."""


def structure(mechanism):
    """Return bars with pins, masses and inertias, joints, ground and guides, described by positions without names."""
    body = {part.name: part for part in mechanism.bodies}

    def place(name, point):
        x, y = dict(mechanism.ground)[point] if name == "ground" else body[name].place(point)
        return round(x, 9) + 0.0, round(y, 9) + 0.0

    bars = {name: tuple(sorted(place(name, point) for point in part.points)) for name, part in body.items()} | {"ground": ()}
    numbers = sorted((bars[b.name], b.mass, b.inertia, *np.add(b.position, b.turned(b.centre))) for b in mechanism.bodies)
    on = {}
    for joint in mechanism.joints:
        for end in (joint.journal, joint.bearing):
            on.setdefault(place(*end), set()).add(bars[end[0]])
    directions = sorted(
        (place(*g.follower), round(math.cos(2 * g.direction), 9), round(math.sin(2 * g.direction), 9)) for g in mechanism.guides
    )
    driven = bars[mechanism.input_body] if mechanism.input_body else None
    return (
        [row[0] for row in numbers],
        [row[1:] for row in numbers],
        on,
        sorted(map(place, ["ground"] * 9, dict(mechanism.ground))),
        directions,
        driven,
    )


def plain():
    document = ezdxf.new("R2010")
    document.header["$INSUNITS"] = 4
    for layer, corners, closed in FIGURE:
        draw(document.modelspace(), layer, corners, closed)
    return document


def draw(space, layer, corners, closed, form="", rng=None):
    """Draw a part with the given corners in world coordinates, as the kind of entity `form`."""
    attributes = {"layer": layer}
    across = [(-x, y) for x, y in corners]
    if len(corners) == 1:
        if form == "mirrored":
            space.add_circle(across[0], 4, dxfattribs={**attributes, **MIRRORED})
        elif form == "other":
            space.add_ellipse(corners[0], (4, 0), 0.5, dxfattribs=attributes)
        else:
            space.add_point(
                corners[0], dxfattribs={**attributes, **(MIRRORED if rng is not None and rng.random() < 0.5 else {})}
            )
    elif form == "mirrored":
        space.add_lwpolyline(across, close=closed, dxfattribs={**attributes, **MIRRORED})
    elif form == "other":
        (space.add_polyline2d if rng.random() < 0.5 else space.add_polyline3d)(corners, close=closed, dxfattribs=attributes)
    elif len(corners) == 2:
        way = 1 if rng is None else rng.choice([1, -1])
        # a line is in world coordinates, whatever its extrusion
        space.add_line(*corners[::way], dxfattribs=attributes | (MIRRORED if rng is not None and rng.random() < 0.5 else {}))
    else:
        space.add_lwpolyline(corners, close=closed, dxfattribs=attributes)


def insert(document, space, number, rng):
    """Add a block and a reference to it; return the block and the map from world coordinates to those of the block."""
    block = document.blocks.new(f"PART{number}", base_point=(7, -3))
    sx, sy = rng.choice([1, -1, 2, -0.5, 3], 2)
    turn, (x, y), mirrored = rng.choice([0, 90, 33.7]), rng.integers(-50, 50, 2), rng.random() < 0.5
    attributes = {"xscale": sx, "yscale": sy, "rotation": turn, "layer": "0"} | (MIRRORED if mirrored else {})
    space.add_blockref(block.name, (int(x), int(y)), dxfattribs=attributes)

    def local(place):
        # inverse of: mirror (insert + rotation (scale (place - base)))
        u, v = (-place[0] if mirrored else place[0]) - x, place[1] - y
        cos, sin = math.cos(math.radians(turn)), math.sin(math.radians(turn))
        return 7 + (cos * u + sin * v) / sx, -3 + (-sin * u + cos * v) / sy

    return block, local


@pytest.mark.parametrize("seed", range(12))
def test_all_forms_of_a_drawing_are_one_mechanism(seed):
    """Identity: extrusions, mirrored and stretched blocks within blocks, kinds of polylines, order, and what is not shown."""
    rng = np.random.default_rng(seed)
    document = ezdxf.new(rng.choice(["R2000", "R2010", "R2018"]))
    document.header["$INSUNITS"] = 4
    document.layers.add("old").off()
    document.layers.add("older").freeze()
    for number in rng.permutation(len(FIGURE)).tolist():
        layer, corners, closed = FIGURE[number]
        space, local = document.modelspace(), lambda place: place
        for depth in range(rng.integers(0, 3)):
            space, step = insert(document, space, f"{number} {depth}", rng)
            local = lambda place, inner=step, outer=local: inner(outer(place))  # noqa: E731
        draw(space, layer, [local(corner) for corner in corners], closed, rng.choice(["", "mirrored", "other"]), rng)
        hidden = rng.choice(["old", "older", ""])
        space.add_line((0, 0), rng.integers(1, 300, 2).tolist(), dxfattribs={"layer": hidden or "0", "invisible": not hidden})
    same, numbers, *further = structure(sd.read_dxf(text(document)).mechanism)
    bars, expected, *others = structure(sd.read_dxf(text(plain())).mechanism)
    assert same == bars
    assert np.array(numbers) == pytest.approx(np.array(expected), rel=1e-9)
    assert further == others


def drawn(document, *, unit=""):
    return sd.read_dxf(text(document), unit=unit)


def test_line_ends_of_windows_are_read():
    """Identity: a drawing whose lines end with carriage return and line feed."""
    unix = text(plain())
    assert sd.read_dxf(unix.replace("\n", "\r\n")) == sd.read_dxf(unix)


def test_a_reference_hides_what_its_layer_hides():
    """Contract of AutoCAD: a frozen layer hides a whole block, one that is off only what takes the layer of the reference."""
    document = plain()
    block = document.blocks.new("PAIR")
    block.add_line((600, 0), (700, 0))
    block.add_line((600, 0), (700, 50), dxfattribs={"layer": "own"})
    document.layers.add("old").off()
    document.layers.add("older").freeze()
    counts = []
    for attributes in ({"layer": "old"}, {"layer": "older"}, {"invisible": 1}, {}):
        reference = document.modelspace().add_blockref("PAIR", (0, 0), dxfattribs=attributes)
        mechanism, notes = drawn(document)
        counts.append(len(mechanism.bodies) - 5)
        hidden = [note for note in notes if "LINE left out: " in note]
        assert len(hidden) == bool(attributes)
        assert all("of block 'PAIR'" in note for note in hidden)
        document.modelspace().delete_entity(reference)
    assert counts == [1, 0, 0, 2]


def test_old_polylines_are_read():
    """Identity: a drawing of AutoCAD 12, without unit and handles, by the polylines of its time."""
    document = ezdxf.new("R12")
    for layer, corners, closed in FIGURE:
        if len(corners) > 2:
            document.modelspace().add_polyline2d(corners, close=closed, dxfattribs={"layer": layer})
        else:
            draw(document.modelspace(), layer, corners, closed)
    document.modelspace().add_polyline2d([(0, 0, 0.5), (9, 9, 0)], format="xyb")
    mechanism, notes = drawn(document, unit="mm")
    assert structure(mechanism)[1] == structure(drawn(plain()).mechanism)[1]
    assert any(note.startswith("1 POLYLINE left out: it is curved") for note in notes)
    bare = "0 SECTION 2 ENTITIES 0 ARC 8 0 10 3 20 4 40 1 50 0 51 9 0 LINE 8 0 10 0 20 0 11 8 21 6 0 ENDSEC 0 EOF "
    assert any(note.endswith("ARC at (3, 4)") for note in sd.read_dxf(bare.replace(" ", "\n"), unit="mm").notes)


def on(layer):
    """Return the option of an entity on a layer."""
    return {"dxfattribs": {"layer": layer}}


@pytest.mark.parametrize(
    ("add", "said"),
    [
        (lambda s: s.add_line((50, 50), (50, 50)), "LINE {} at (50, 50) mm left out: no length"),
        (lambda s: s.add_lwpolyline([(1, 1), (1, 1)]), "LWPOLYLINE {} at (1, 1) mm left out: no length"),
        (lambda s: s.add_line((9, 9, 0), (9, 9, 30)), "LINE {} at (9, 9) mm left out: no length"),
        (
            lambda s: s.add_line((9, 9, 0), (90, 9, 30)),
            "z left out of LINE {}, up to 30 mm above or below the others: the drawing is read as seen along z",
        ),
        (
            lambda s: s.add_point((200, -50), **on("ground")),
            "ground at (200, -50) mm left out (POINT {}): no bar has an end or a point there",
        ),
        (lambda s: s.add_circle((200, -50), 3), "CIRCLE {} at (200, -50) mm left out: no bar passes through it"),
        (
            lambda s: s.add_line((400, 0), (400, 0), **on("guide")),
            "guide LINE {} at (400, 0) mm left out: it has no length, so no direction",
        ),
        (
            lambda s: s.add_lwpolyline([(400, 0), (400, 9), (0, 0)], **on("Guide")),
            "guide LWPOLYLINE {} at (400, 0) mm left out: it bends, and a guide is straight",
        ),
        (lambda s: s.add_line((400, 0), (400, 9), **on("guide")), "guide LINE {} at (400, 0) mm left out: no pin is on it"),
        (
            lambda s: s.add_line((90, 200), (290, 200), **on("ground")),
            "'pin 2' at (100, 200) mm is on LINE {} of layer 'ground' and is not fixed: "
            "draw a point there on that layer to fix it",
        ),
        (
            lambda s: s.add_line((100, 200), (0, 0)),
            "'bar 6' (LINE {}) has the corners of 'bar 1' (LINE 2F): both are kept, with their masses",
        ),
        (lambda s: s.add_line((9, 9), (90, 9), **on("input")), "bar 3, bar 6 on layer 'input': only the first one is driven"),
        (lambda s: s.add_arc((0, 0), 5, 0, 90), "1 ARC left out: it is not a bar, pin or guide: ARC {}"),
        (lambda s: s.add_ellipse((0, 0), (5, 0), 0.5, 0, 3), "1 ELLIPSE left out: it is not a bar, pin or guide: ELLIPSE {}"),
    ],
)
def test_what_is_left_out_is_named_with_its_place(add, said):
    """Contract: one note for each, and the other bars stay."""
    document = plain()
    entity = add(document.modelspace())
    mechanism, notes = drawn(document)
    assert said.format(entity.dxf.handle) in notes
    assert structure(mechanism)[0][:1] == structure(drawn(plain()).mechanism)[0][:1]


def test_other_layouts_references_and_attributes_are_named():
    """Contract: paper, external references, clipped blocks and attributes."""
    document = plain()
    document.layout("Layout1").add_line((0, 0), (50, 50))
    document.add_xref_def("other.dwg", "XREF")
    document.modelspace().add_blockref("XREF", (0, 0))
    document.blocks.new("TAG").add_line((9, 9), (90, 9))
    reference = document.modelspace().add_blockref("TAG", (0, 0))
    reference.add_attrib("NAME", "left", (0, 0))
    from ezdxf.xclip import XClip

    XClip(reference).set_block_clipping_path([(0, 0), (20, 20)])
    notes = "\n".join(drawn(document).notes)
    assert "layout 'Layout1' left out (1 entities): only the model space is read" in notes
    assert "1 INSERT left out: block 'XREF' is in another file" in notes
    assert "1 ATTRIB left out: it is not a bar, pin or guide" in notes
    assert "clipping (XCLIP) of INSERT" in notes


def within_itself(document):
    document.blocks.new("A").add_blockref("B", (0, 0))
    document.blocks.new("B").add_blockref("A", (0, 0))
    document.modelspace().add_blockref("A", (0, 0))


def doubled(document):
    for k in range(30):
        block = document.blocks.new(f"B{k}")
        for _ in range(2 if k else 0):
            block.add_blockref(f"B{k - 1}", (0, 0))
    document.modelspace().add_blockref("B29", (0, 0))


def nested(document):
    for k in range(100):
        block = document.blocks.new(f"B{k}")
        if k:
            block.add_blockref(f"B{k - 1}", (0, 0))
    document.modelspace().add_blockref("B99", (0, 0))


def arrayed(document):
    document.blocks.new("A").add_line((0, 0), (1, 0))
    grid = {"row_count": 30000, "column_count": 30000, "row_spacing": 1, "column_spacing": 1}
    document.modelspace().add_blockref("A", (0, 0), dxfattribs=grid)


def many(document):
    document.modelspace().add_lwpolyline([(k, k % 7) for k in range(10_001)])


def infinite(document):
    document.modelspace().add_line((0, 0), (math.inf, 0))


@pytest.mark.parametrize(
    ("add", "said"),
    [
        (within_itself, "block 'A' of the DXF inserts itself"),
        (doubled, f"more than {dxf_entity.ENTITIES_MAX} entities"),
        (nested, f"nested too deeply; expected at most {dxf_entity.NESTING_MAX} levels"),
        (arrayed, f"more than {dxf_entity.ENTITIES_MAX} entities"),
        (many, "more than 10000 corners and points"),
        (infinite, r"LINE \w+ of the DXF in m = \(inf, 0.0\)"),
        (lambda document: document.modelspace().add_blockref("NONE", (0, 0)), "refers to block 'NONE'"),
    ],
)
def test_drawings_without_bounds_are_one_line(add, said):
    """Contract: blocks within themselves, doubled blocks, arrays and huge coordinates are errors before they are expanded."""
    document = plain()
    add(document)
    with one_line_error(match=said):
        drawn(document)


def test_a_drawing_that_is_cut_off_is_no_drawing():
    """Contract: no mechanism is made of a part of a file, wherever it ends."""
    whole = text(plain())
    for end in np.linspace(0, len(whole) - 8, 12).astype(int):
        with pytest.raises(sd.InputError, match="DXF"):
            sd.read_dxf(whole[:end])
