"""Sketches of SolveSpace."""

import cmath
import math

import numpy as np
import pytest

import scissordyn as sd
from scissordyn.cli.main import status_of

from .slvs_file import ORIGIN, end, joined, length, slvs


def on_circles(a, r, b, s):
    """Return the point at the distance r from a and s from b, on the left of the line from a to b."""
    gap = abs(b - a)
    x = (r * r - s * s + gap * gap) / (2.0 * gap)
    return a + (b - a) / gap * complex(x, math.sqrt(r * r - x * x))


def tracks(text, body="", samples=13):
    """Return the mechanism of a sketch, and its bars' angles and origins [m] over one revolution."""
    found = sd.read_slvs(text).mechanism
    run = sd.simulate(found.driven(speed=2.0 * math.pi, body=body or found.input_body), until=1.0, samples=samples)
    angles = {part.name: run["angle"].sel(body=part.name).values for part in found.bodies}
    centres = {part.name: run["position"].sel(body=part.name).values @ (1.0, 1j) for part in found.bodies}
    origins = {part.name: centres[part.name] - complex(*part.centre) * np.exp(1j * angles[part.name]) for part in found.bodies}
    return found, angles, origins


def four_bar(more=(), **options):
    """Return a four-bar with a ternary coupler, whose ground line is a construction line."""
    A, C = 30 * cmath.exp(0.9j), 100 + 0j
    B = on_circles(A, 80, C, 60)
    P = A + (B - A) * (0.5 + 0.4j)
    lines = [(0, C), (0, A), (A, B), (C, B), (A, P), (P, B)]
    ends = [(ORIGIN, end(0, 1)), (end(0, 1), end(1, 1)), (end(1, 2), end(2, 1)), (end(2, 2), end(3, 2)), (end(3, 1), end(0, 2))]
    ends += [(end(4, 1), end(2, 1)), (end(4, 2), end(5, 1)), (end(5, 2), end(2, 2))]
    lengths = [length(k, abs(b - a)) for k, (a, b) in enumerate(lines)]
    return slvs(lines, [*joined(*ends), {"type": 80, "entityA": end(0)}, *lengths, *more], thin=[0], **options)


def test_a_four_bar_moves_as_intersections_of_circles():
    """Closed form: joints and the point of the coupler over a revolution; lengths in a triangle are one body."""
    found, angles, origins = tracks(four_bar())
    assert [(body.name, len(body.points)) for body in found.bodies] == [("r005", 2), ("r006", 3), ("r007", 2)]
    assert dict(found.ground) == {"r004 p1": (0.0, 0.0), "r004 p2": pytest.approx((0.1, 0.0))}
    assert found.body("r006").mass == pytest.approx(0.08 * (1.0 + 2.0 * abs(0.5 + 0.4j)))
    local = complex(*found.body("r006").points["r008 p2"])
    for k, turn in enumerate(np.linspace(0.0, 2.0 * math.pi, 13)):
        A = 0.03 * cmath.exp(1j * (0.9 + turn))
        B = on_circles(A, 0.08, 0.1, 0.06)
        assert origins["r006"][k] + local * np.exp(1j * angles["r006"][k]) == pytest.approx(
            A + (B - A) * (0.5 + 0.4j), abs=1e-10
        )


def test_a_point_on_a_line_slides_on_the_ground():
    """Closed form: slider-crank with an offset; the line is held by its direction and one end, and has no length."""
    A = 30 * cmath.exp(0.9j)
    B = complex(A.real + math.sqrt(90**2 - (A.imag + 8) ** 2), -8)
    ends = joined((ORIGIN, end(0, 1)), (end(0, 2), end(1, 1)))
    rail = [{"type": 42, "ptA": end(1, 2), "entityA": end(2)}, {"type": 80, "entityA": end(2)}, {"type": 200, "ptA": end(2, 1)}]
    text = slvs([(0, A), (A, B), (20 - 8j, 200 - 8j)], [*ends, *rail, length(0, 30), length(1, 90)])
    found, angles, origins = tracks(text, "r004")
    assert not any("left out" in note for note in sd.read_slvs(text).notes)
    assert [(guide.follower, guide.body) for guide in found.guides] == [(("r005", "r005 p2"), "ground")]
    slider = origins["r005"] + 0.09 * np.exp(1j * angles["r005"])
    A = 0.03 * np.exp(1j * (0.9 + np.linspace(0.0, 2.0 * math.pi, 13)))
    assert slider == pytest.approx(A.real + np.sqrt(0.09**2 - (A.imag + 0.008) ** 2) - 0.008j, abs=1e-10)


def test_a_point_on_a_bar_slides_along_it():
    """Closed form: the lever points from its pivot to the pin of the crank."""
    A, Q = 25 * cmath.exp(0.4j), -60 + 0j
    fixed = [*joined((ORIGIN, end(0, 1))), {"type": 200, "ptA": end(1, 1)}, {"type": 42, "ptA": end(0, 2), "entityA": end(1)}]
    text = slvs([(0, A), (Q, Q + (A - Q) / abs(A - Q) * 120)], [*fixed, length(0, 25), length(1, 120)])
    _, angles, _ = tracks(text)
    crank = 0.025 * np.exp(1j * (0.4 + np.linspace(0.0, 2.0 * math.pi, 13)))
    assert angles["r005"] == pytest.approx(np.angle(crank + 0.06), abs=1e-10)


def test_constraints_make_bodies_and_guides():
    """Contract: circle with diameter, equal lengths, perpendicular lines, midpoint, distances to line, plane and point."""
    A = 20 * cmath.exp(1.1j)
    B = A + 50 * cmath.exp(-0.3j)
    E, M = B + (B - A) * 0.4j, 0.5 * (A + B)
    F = M + 50 * cmath.exp(-1.2j)
    lines = [(0, A), (A, B), (B, E), (M, F), (F, F + 30)]
    ends = [(ORIGIN, end(0, 1)), (end(0, 2), end(1, 1)), (ORIGIN, end(5, 1)), (end(2, 1), end(1, 2)), (end(4, 1), end(3, 2))]
    held = [
        {"type": 100, "ptA": end(0, 2), "entityA": end(5)},
        {"type": 90, "entityA": end(5), "valA": 40},
        {"type": 122, "entityA": end(2), "entityB": end(1)},
        {"type": 70, "ptA": end(3, 1), "entityA": end(1)},
        {"type": 50, "entityA": end(3), "entityB": end(1)},
        {"type": 31, "ptA": end(2, 2), "entityA": 0x30000, "valA": E.imag},
        {"type": 34, "ptA": end(3, 2), "ptB": ORIGIN, "entityA": 0x20020, "valA": -F.real},
    ]
    mechanism, notes = sd.read_slvs(
        slvs(lines, [*joined(*ends), *held, length(1, 50), length(2, 20), length(4, 30)], circles=[(0, 20)])
    )
    assert [len(body.points) for body in mechanism.bodies] == [2, 4, 2, 2]
    assert mechanism.body("r005").mass == pytest.approx(0.07)
    slides = {guide.follower: math.cos(guide.direction) for guide in mechanism.guides}
    assert slides == {("r005", "r006 p2"): pytest.approx(-1.0), ("r007", "r007 p2"): pytest.approx(0.0, abs=1e-12)}
    assert not any("left out" in note for note in notes)


def test_an_angle_to_the_ground_is_the_start_of_the_input():
    """Contract: it does not hold the bar; that of a construction line does, and one between two bars makes them one."""
    angle = [{"type": 120, "valA": 51, "entityA": end(1), "entityB": end(0)}]
    mechanism, notes = sd.read_slvs(four_bar(angle))
    assert mechanism.input_body == "r005"
    assert "r005 is free to turn: its angle c010 to the ground is the start" in notes
    bent = [{"type": 120, "valA": 51, "entityA": end(3), "entityB": end(2)}]
    with pytest.raises(sd.InputError, match="no line of fixed length moves in the sketch; expected a linkage"):
        sd.read_slvs(four_bar(bent))
    both = [(0, 100j), (0, 50), (50, 50 + 70j)]
    ends = joined((ORIGIN, end(0, 1)), (ORIGIN, end(1, 1)), (end(1, 2), end(2, 1)))
    angle = {"type": 120, "valA": 90, "entityA": end(0), "entityB": 0x10020}
    lengths = [length(0, 100), length(1, 50), length(2, 70)]
    kept = sd.read_slvs(slvs(both, [*ends, angle, *lengths], thin=[0])).mechanism
    assert [body.name for body in kept.bodies] == ["r005", "r006"]


def test_bars_that_stay_parallel_are_coupled():
    """Contract: two bars of one direction without a common pin turn alike."""
    text = slvs(
        [(0, 30 + 10j), (80, 140 + 20j)],
        [
            *joined((ORIGIN, end(0, 1))),
            {"type": 200, "ptA": end(1, 1)},
            {"type": 121, "entityA": end(0), "entityB": end(1)},
            length(0, abs(30 + 10j)),
            length(1, abs(60 + 20j)),
        ],
    )
    found, angles, _ = tracks(text)
    assert len(found.couplings) == 1
    assert angles["r005"] == pytest.approx(angles["r004"], abs=1e-10)


def group(number, kind, name, remap=()):
    """Return a group as a record; `remap` has rows of index, original and copy."""
    rows = "".join(f"\n    {index} {source:08x} {copy}" for index, source, copy in remap)
    return "Group", {"h.v": number, "type": kind, "name": name, "remap": "{" + rows + "\n}"}


def copied_line(number, index, start, stop):
    """Return a line of a group and its ends as records; they have the indices from `index` on."""
    base = 0x80000000 | number << 16
    ends = {"point[0].v": base + index + 1, "point[1].v": base + index + 2}
    places = [
        ("Entity", {"h.v": base + index + k, "type": 2010, "actPoint.x": z.real, "actPoint.y": z.imag})
        for k, z in enumerate(map(complex, (start, stop)), start=1)
    ]
    return [("Entity", {"h.v": base + index, "type": 11000, **ends}), *places]


def test_links_are_bodies_and_copies_move_with_their_originals():
    """Contract: the points of a linked file form one body; copies of the ground are fixed, and copied bars turn alike."""
    triangle = [(30, 60), (60, 45 + 20j), (45 + 20j, 30)]
    linked = [record for k, line in enumerate(triangle) for record in copied_line(3, 3 * k + 1, *line)]
    copies = [*copied_line(4, 1, 200j, 30 + 200j), *copied_line(4, 4, 0, 30)]
    rows = [(k + 1 + 3 * (1 - copy), end(0, k), copy) for copy in (0, 1) for k in range(3)]  # copy 0 stays in place
    more = [group(3, 5300, "plate"), *linked, group(4, 5201, "copy", rows), *copies]
    more += [group(5, 5100, "extrude"), *copied_line(5, 1, 0, 30)]
    ends = joined((ORIGIN, end(0, 1)), (end(0, 2), 0x80030002))
    mechanism, notes = sd.read_slvs(slvs([(0, 30)], [*ends, length(0, 30)], more=more))
    assert [(body.name, len(body.points)) for body in mechanism.bodies] == [("plate", 3), ("r004", 2), ("copy 1", 2)]
    assert sorted(joint.bodies for joint in mechanism.joints) == [("copy 1", "ground"), ("plate", "r004"), ("r004", "ground")]
    assert [{part.output.body, part.input.body} for part in mechanism.couplings] == [{"r004", "copy 1"}]
    assert "groups extrude left out: no sketches, links or copies of sketches" in notes


def test_what_is_not_read_is_named():
    """Contract: constraints that the mechanism does not keep, lines without length, curves, references, no ground."""
    lines = [(0, 30), (30, 60 + 10j), (30, 90), (0, 50j)]
    curve = [("Request", {"h.v": 8, "type": 300, "group.v": 2}), ("Entity", {"h.v": end(4), "type": 12000})]
    constraints = [
        *joined((end(0, 2), end(1, 1)), (end(2, 1), end(0, 2))),
        *(length(k, abs(lines[k][1] - lines[k][0])) for k in (0, 1, 3)),
        {"type": 54, "entityA": end(0), "entityB": end(1), "entityC": end(1), "entityD": end(0)},
        {"type": 30, "valA": 90, "ptA": end(2, 1), "ptB": end(2, 2), "reference": 1},
        {"type": 80, "entityA": end(3)},
    ]
    _, notes = sd.read_slvs(slvs(lines, constraints, more=curve))
    assert "c006 (equal angles) left out: the mechanism does not keep it" in notes
    assert "c008 (direction) left out: the mechanism does not keep it" in notes
    assert "r006 left out: no fixed length" in notes
    assert "r008 left out: no line, circle or arc" in notes
    assert "nothing is grounded: join a point to the origin of the sketch, or fix it" in notes


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("<linkage2/>", "the text is not a file of SolveSpace; expected a file that begins with SolveSpaceREVa"),
        ("SolveSpaceREVa\n", "the file has no sketch in a workplane; expected a linkage in a workplane"),
        (
            four_bar().replace("Constraint.ptB.v=00040001", "Constraint.ptB.v=00990001"),
            "the file refers to 00990001, which is not",
        ),
        (
            four_bar().replace("Group.type=5001", "Group.type=plane"),
            "line 12 of the file: 'Group.type=plane'; expected a number",
        ),
        (four_bar().replace("actPoint.x=100.0", "actPoint.x=inf"), "actPoint.x=inf'; expected a number"),
        (
            slvs([(0, 30)], [length(0, 30), {"type": 200, "ptA": end(0, 1)}, {"type": 200, "ptA": end(0, 2)}]),
            "no line of fixed",
        ),
    ],
)
def test_damaged_and_other_files_are_one_line(text, said):
    """Contract: what is wrong is named in one line."""
    with pytest.raises(sd.InputError) as caught:
        sd.read_slvs(text)
    assert said in str(caught.value)
    assert "\n" not in str(caught.value)


def test_the_command_reads_the_file_as_solvespace_saves_it(tmp_path, monkeypatch, capsys):
    """Contract: three bytes before the text, line ends of Windows; a unit does not apply."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "bars.slvs").write_bytes(b"\xb1\xb2\xb3" + four_bar().replace("\n", "\r\n").encode())
    assert status_of(["import", "bars.slvs", "-o", "case.toml"]) == 0
    assert "not UTF-8" not in capsys.readouterr().out
    assert sd.read_case("case.toml").mechanism == sd.read_slvs(four_bar()).mechanism
    assert status_of(["import", "bars.slvs", "--unit", "mm", "-o", "other.toml"]) == 2
    assert "unit 'mm' does not apply to a sketch of SolveSpace" in capsys.readouterr().err
