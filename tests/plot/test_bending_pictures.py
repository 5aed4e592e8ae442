"""Pictures of bending bars: magnified deflections, diagrams, modes as motions and as curves."""

import numpy as np
import pytest

import scissordyn as sd
from scissordyn.cli.main import status_of
from scissordyn.components.port.axis import bent_axis
from scissordyn.components.port.stroke import bent
from scissordyn.equilibrium.deflection import magnified_deflection
from scissordyn.plan.bending import beams_of
from scissordyn.plan.flexible import flexible_bars
from scissordyn.plot.animation import Film
from scissordyn.plot.animation_scene import scene_of
from scissordyn.plot.bar_diagram import QUANTITIES, diagram_of, ordinate_edges
from scissordyn.plot.modes import frequencies, oscillation, shapes
from scissordyn.plot.still import bending
from scissordyn.plot.style import SKY, VERMILION
from scissordyn.record.bars import SPAN_PARTS
from scissordyn.record.placement import Placement

# Case file with flexible bars
CASE = """
[structure]
kind = "scissor"
units = 1
bar_length = "2 m"
bar_mass = "5.68 kg"

[drive]
speed = "10 rpm"

[[bending]]
bars = "unit */bar *"
section = "tube 60x60x1.56 mm"
material = "steel"
elements = 2

[run]
until = "1 ms"
"""


@pytest.fixture(scope="module")
def unit():
    rigid = sd.scissor(units=1, bar_length=2.0, bar_mass=5.68)
    return sd.with_bending(rigid, section="tube 60x60x1.56 mm", material="steel", elements=2).driven(speed=1.0)


@pytest.fixture(scope="module")
def run(unit):
    return sd.simulate(unit, until=2e-3, samples=4, start="static")


def test_magnified_deflections(run, unit):
    """Identity: deflections are linear in the factor, bars stay together at their pin, and rigid bars do not change."""
    two, four = (magnified_deflection(run, unit, factor)["position"] for factor in (2.0, 4.0))
    np.testing.assert_allclose(four - run["position"], 3.0 * (two - run["position"]), atol=1e-12)
    middle = {bar: four.sel(body=f"unit 1/bar {bar}/1").values for bar in (1, 2)}
    np.testing.assert_allclose(middle[1], middle[2], atol=1e-9)
    straight = 2.0 * run["position"] - two  # factor 0
    ends = [straight.sel(body=name).values for name in ("unit 1/bar 1", "unit 1/bar 1/1", "unit 1/bar 1/2")]
    np.testing.assert_allclose(ends[1], 0.5 * (ends[0] + ends[2]), atol=1e-9)
    with pytest.raises(sd.InputError, match="no flexible bars to magnify"):
        magnified_deflection(run, sd.scissor(units=1), 2.0)


def test_only_drawn_samples_are_magnified(run, unit):
    """Contract: other samples are left unchanged, and titles give the factor."""
    moved = magnified_deflection(run, unit, 5.0, samples=[2])
    apart = np.abs(moved["position"] - run["position"]).max(["body", "axis"]).values
    assert apart[2] > 0.0
    assert np.all(apart[[0, 1, 3]] == 0.0)
    drawn = sd.plot.structure(run, unit, times=2, magnify=5.0)
    assert all("deflections 5×" in axes.get_title(loc="left") for axes in drawn)


def test_diagram_of_moment_and_stress(run, unit):
    """Cross-check: the largest moment and stress are those of the run; the yield strength is drawn."""
    drawn = sd.plot.bending(run, unit, time=0.0)
    values = np.abs(run["beam_start_moment"].isel(time=0)), np.abs(run["beam_end_moment"].isel(time=0))
    largest = float(np.maximum(*values).max())
    assert f"{largest:.3g} N·m" in drawn[0].get_title(loc="left").replace("-", "")
    lines = drawn[-1].get_lines()
    assert float(np.max(lines[0].get_ydata())) == pytest.approx(1e-6 * float(run["beam_stress"].max()), rel=1e-12)
    assert lines[1].get_ydata()[0] == pytest.approx(235.0, rel=1e-9)
    rigid = sd.scissor(units=1)
    with pytest.raises(sd.InputError, match="no bar of the mechanism bends"):
        sd.plot.bending(run, rigid)


@pytest.fixture(scope="module")
def whole():
    """Return a unit whose bars bend by modes, and its run."""
    rigid = sd.scissor(units=1, bar_length=2.0, bar_mass=5.68)
    unit = sd.with_bending(rigid, section="tube 60x60x1.56 mm", material="steel", modes=2).driven(speed=1.0)
    return unit, sd.simulate(unit, until=2e-3, samples=4, start="static")


def stations(mechanism, placed):
    """Return start, middle and end of each part, in the order of a `Diagram`, shape (samples, parts, 3, 2) [m]."""
    places = []
    for beam in beams_of(mechanism):
        angles = placed.angle(beam.start[0]), placed.angle(beam.end[0])
        ends = placed.place(beam.start), placed.place(beam.end)
        places.append(bent(np.array([0.0, 0.5, 1.0]), *ends, beam.length, angles)[:, None])
    inside = 2 * np.arange(SPAN_PARTS)[:, None] + np.arange(3)
    for bar in flexible_bars(mechanism):
        axis = bent_axis(bar, placed, np.linspace(0.0, 1.0, 2 * SPAN_PARTS + 1))
        spans = axis.reshape(len(axis), -1, 2 * SPAN_PARTS + 1, 2)
        places.append(spans[:, :, inside].reshape(len(axis), -1, 3, 2))
    return np.concatenate(places, axis=1)


@pytest.mark.parametrize("quantity", ["bending moment", "stress"])
def test_values_on_bars_are_those_of_the_run(run, unit, whole, quantity):
    """Contract: by elements and by modes, values are the run's, on its deformed axis, with ordinates on the tension side."""
    for mechanism, found in ((unit, run), whole):
        diagram = diagram_of(found, mechanism, quantity)
        scene = scene_of(found, mechanism, np.arange(4), [], on_bars=quantity)
        shown = next(each for each in scene.diagrams if each.quantity == quantity)
        one = QUANTITIES[quantity]
        for end, name in enumerate((one.first, one.last)):
            expected = found[name].sel(beam=list(diagram.parts)).transpose("time", "beam").values
            np.testing.assert_array_equal(diagram.values[..., end], expected)
            np.testing.assert_array_equal(shown.values[..., end], expected)
        placed = Placement.at(mechanism, found, slice(None), turns=scene.turns)
        places = stations(mechanism, placed)
        for shape in (shape for shape in scene.shapes if shape.parts):
            np.testing.assert_allclose(shape.places[:, :, [0, -1]], places[:, list(shape.parts)][:, :, [0, 2]], atol=1e-12)
        drawn = diagram.ordinates(places, 0.5) - places[:, :, [0, 2]]
        np.testing.assert_allclose(np.linalg.norm(drawn, axis=-1), 0.5 * np.abs(diagram.values) / diagram.largest, atol=1e-12)


def test_cantilever_is_in_tension_above():
    """Closed form: a cantilever under its weight has the moment w L^2 / 2 at the clamp, drawn above (six modes: 0.2 %)."""
    boom = sd.Mechanism(
        (sd.bar("boom", length=2.0, mass=5.68),),
        (sd.Revolute("pin", ("boom", "start"), ("ground", "O")),),
        ground=(("O", (0.0, 0.0)),),
        input_body="boom",
    )
    held = sd.with_bending(boom, section="tube 60x60x1.56 mm", material="steel", modes=6).driven(speed=0.0)
    found = sd.simulate(held, until=1e-4, samples=2, start="static")
    diagram = diagram_of(found, held, "bending moment")
    places = stations(held, Placement.at(held, found, [0]))
    outer = diagram.at([0]).ordinates(places, 0.5)[0, 0, 0]
    assert outer[1] > 0.49
    assert abs(diagram.values[0, 0, 0]) == pytest.approx(5.68 * 9.81 * 1.0, rel=2e-3)


def test_envelope(run, unit):
    """Contract: the envelope has the extreme values over all samples at every place; the title gives the largest."""
    diagram = diagram_of(run, unit, "bending moment")
    np.testing.assert_array_equal(diagram.envelope().values, [diagram.values.max(axis=0), diagram.values.min(axis=0)])
    drawn = sd.plot.bending(run, unit, envelope=True)
    assert f"{abs(diagram.largest_value()[0]):.3g} N·m" in drawn[0].get_title(loc="left").replace("-", "")


def test_rings_of_diagrams_show_contact(unit):
    """Contract: the ring of a joint next to a diagram has the colour of `in_contact`, also after a contact."""
    loose = sd.simulate(unit.with_clearance("A", sd.Clearance(1e-5)), until=8e-3, samples=201)
    touched = loose["in_contact"].sel(joint="A").values.astype(bool)
    first = int(np.argmax(touched))
    flying = np.flatnonzero(~touched)
    assert flying[0] < first < flying[-1]
    for sample, color in ((int(flying[0]), SKY), (first, VERMILION), (int(flying[-1]), SKY)):
        drawn = bending(loose, time=float(loose["time"][sample]))
        rings = [line for line in drawn[0].lines if line.get_zorder() == 5.0 and line.get_marker() == "o"]
        assert [ring.get_color() for ring in rings] == [color]


def test_stress_without_a_section_is_refused(tmp_path):
    """Contract: stress needs a section in stills and films; the moment is drawn without one, and no panel is empty."""
    rigid = sd.scissor(units=1, bar_length=2.0, bar_mass=5.68)
    numbers = sd.with_bending(rigid, bending_stiffness=42743.0, axial_stiffness=7.5e7, modes=2).driven(speed=1.0)
    found = sd.simulate(numbers, until=1e-3, samples=3)
    for draw in (
        lambda: sd.plot.structure(found, numbers, bars="stress"),
        lambda: sd.animate(found, numbers, tmp_path / "film.html", bars="utilisation"),
    ):
        with pytest.raises(sd.InputError, match="has no youngs_modulus"):
            draw()
    with pytest.raises(sd.InputError, match="stres"):
        sd.plot.structure(found, numbers, bars="stres")
    assert len(sd.plot.bending(found, numbers)) == 3
    legends = sd.plot.structure(found, numbers, bars="bending moment", times=1)[0].get_figure(root=True).legends
    assert "on the side in tension" in legends[0].get_texts()[0].get_text()


def test_film_with_stress(run, unit, tmp_path):
    """Cross-check: the colours of a film's last frame are the run's stress; a page has every quantity."""
    scene = scene_of(run, unit, np.arange(4), [], on_bars="stress")
    film = Film(scene, 1.0)
    film.show(3)
    parts = [part for shape in scene.shapes for part in shape.parts]
    expected = diagram_of(run, unit, "stress").values[3, parts, 0]
    np.testing.assert_array_equal(film.drawing.diagram.lines.get_array(), expected)
    page = sd.animate(run, unit, tmp_path / "film.html", bars="stress").read_text()
    assert all(f'"quantity":"{name}"' in page for name in QUANTITIES)
    assert '"onBars":"stress"' in page


def test_pictures_of_modes(unit, tmp_path):
    """Contract: a quarter of a period from rest the displacement is the shape; films and curves are written."""
    found = sd.modes(unit, count=3, times=[0.0, 0.1])
    first, ideal = found.isel(time=0), unit.ideal()
    motion = oscillation(first, ideal, 2, frames=9, periods=1)
    moved = (motion["position"].isel(time=2) - motion["position"].isel(time=0)).values
    shape = first["shape"].sel(mode=2).values
    np.testing.assert_allclose(moved / np.abs(moved).max(), shape / np.abs(shape).max(), atol=1e-12)
    assert len(shapes(first, unit)) == 3
    assert frequencies(found).get_lines()[0].get_ydata() == pytest.approx(found["frequency"].sel(mode=1).values)
    assert sd.animate(motion, ideal, tmp_path / "mode.gif", seconds=0.5).stat().st_size > 1000
    with pytest.raises(sd.InputError, match="mode 9"):
        oscillation(first, ideal, 9)


def test_modes_command(tmp_path, capsys):
    """Contract: the command prints a table and writes pictures and a file."""
    case = tmp_path / "case.toml"
    case.write_text(CASE)
    arguments = ["modes", str(case), "--until", "0.2 s", "--points", "3", "--count", "2"]
    assert status_of([*arguments, "--plot", str(tmp_path / "figures"), "-o", str(tmp_path / "modes.nc")]) == 0
    shown = capsys.readouterr().out
    assert "frequencies [Hz]" in shown
    assert (tmp_path / "figures" / "frequencies.png").stat().st_size > 10_000
    assert (tmp_path / "figures" / "shapes.png").stat().st_size > 10_000
    assert (tmp_path / "modes.nc").exists()


def test_ordinates_of_connected_parts():
    """Closed form: connected parts share an area and a line, with jumps in the line; a separate part has its own."""
    places = np.array(
        [[[0.0, 0.0], [1.0, 0.0], [2.0, 0.0]], [[2.0, 0.0], [3.0, 0.0], [4.0, 0.0]], [[0.0, 9.0], [1.0, 9.0], [2.0, 9.0]]]
    )
    outer = np.array([[[0.0, 1.0], [2.0, 1.0]], [[2.0, 3.0], [4.0, 3.0]], [[0.0, 8.0], [2.0, 8.0]]])
    areas, lines = ordinate_edges(places, outer)
    assert [line.tolist() for line in lines] == [[[0.0, 1.0], [2.0, 1.0], [2.0, 3.0], [4.0, 3.0]], [[0.0, 8.0], [2.0, 8.0]]]
    sizes = [
        abs(sum(x * v - u * y for (x, y), (u, v) in zip(area, np.roll(area, -1, axis=0), strict=True))) / 2 for area in areas
    ]
    assert sizes == [8.0, 2.0]
