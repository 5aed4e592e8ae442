"""Pictures for journals and slides: sizes, letters, legends, LaTeX."""

import inspect

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.text import Text

import scissordyn as sd
from scissordyn.cli.main import status_of
from scissordyn.plot.file import figure_of
from scissordyn.plot.style import STYLES, label_curves, literal, wrap_text

NAMES = ("figure.figsize", "font.size", "font.family")  # Settings of Matplotlib that a picture may not change

KINDS = ("response", "force", "torque", "orbit", "energy", "track")  # Kinds of pictures of a run


@pytest.fixture(scope="module")
def run():
    """Return a run of an array with a tracked point."""
    arm = sd.scissor(units=2, angle=sd.degrees(60.0)).with_clearance("A", sd.Clearance(0.5e-3)).driven(speed=sd.rpm(-150.0))
    return sd.simulate(arm.track("tip", "unit 2/bar 1", "end", 1e-3), until=0.02, samples=201)


@pytest.mark.parametrize("kind", KINDS)
def test_size_of_pictures_for_a_column(run, kind):
    """Contract: 90 mm wide, labels of 8 pt, ticks of 7 pt, and no overlapping labels of y axes."""
    with sd.style("single-column"):
        drawn = getattr(sd.plot, kind)(run)
    figure = figure_of(drawn[0])
    assert figure.get_figwidth() == pytest.approx(90.0 / 25.4, rel=2e-3)
    assert drawn[0].yaxis.label.get_fontsize() == pytest.approx(8.0, rel=0.02)
    assert drawn[0].yaxis.get_ticklabels()[0].get_fontsize() == pytest.approx(7.0, rel=0.01)
    renderer = FigureCanvasAgg(figure).get_renderer()
    figure.draw_without_rendering()
    boxes = [axes.yaxis.label.get_window_extent(renderer) for axes in drawn]
    assert not any(one.overlaps(other) for k, one in enumerate(boxes) for other in boxes[:k])
    for box in boxes:
        assert box.y0 >= -2.0
        assert box.y1 <= figure.bbox.y1 + 2.0


@pytest.fixture(scope="module")
def many():
    """Return runs for every kind of picture: many clearance joints and an actuator, bending bars, an oil film."""
    arm = sd.scissor(units=2, angle=sd.degrees(60.0)).with_clearance("all", sd.Clearance(0.5e-3))
    servo = arm.controlled(sd.PID(proportional=5e4, derivative=3e3), speed=-0.1)
    loose = sd.simulate(servo.track("tip", "unit 2/bar 1", "end", 1e-3), until=0.01, samples=41, rtol=1e-5, atol=1e-5)
    bent = sd.with_bending(sd.scissor(bar_length=2.0, bar_mass=5.68), section="tube 60x60x1.56 mm", material="steel", modes=1)
    oil = sd.Clearance(1e-4, lubrication=sd.Lubrication("ISO VG 46", temperature=313.15))
    return {
        "bending": sd.simulate(bent.driven(speed=sd.rpm(60)), until=0.01, samples=21, rtol=1e-5, atol=1e-5),
        "film": sd.simulate(sd.scissor().driven(speed=sd.rpm(60)).with_clearance("A", oil), until=0.003, samples=41),
        "statics": sd.statics(arm.ideal().driven(speed=-0.5), until=0.5, points=21),
        **dict.fromkeys((*KINDS, "structure", "comparison"), loose),
    }


@pytest.mark.parametrize("kind", sorted(sd.plot.__all__))
def test_nothing_of_a_narrow_picture_is_cut(many, kind):
    """Contract: in a page column no text leaves the figure, and no panel is narrower than a fifth of it."""
    run = many[kind]
    with sd.style("single-column"):
        drawn = getattr(sd.plot, kind)(run, *([run] if kind == "comparison" else []))
    figure = figure_of(drawn[0])
    renderer = FigureCanvasAgg(figure).get_renderer()
    figure.draw_without_rendering()
    ticks = {id(label) for axes in figure.axes for axis in (axes.xaxis, axes.yaxis) for label in axis.findobj(Text)}
    ticks -= {
        id(axis.label) for axes in figure.axes for axis in (axes.xaxis, axes.yaxis)
    }  # those out of sight have places, too
    for text in figure.findobj(Text):
        box = text.get_window_extent(renderer)
        if id(text) not in ticks and text.get_visible() and text.get_text() and box.width:
            assert box.x0 >= -2.0, text.get_text()
            assert box.x1 <= figure.bbox.x1 + 2.0, text.get_text()
    for axes in drawn:
        assert axes.get_window_extent(renderer).width > 0.2 * figure.bbox.width


def test_style_ends_with_its_block(run):
    """Contract: a style changes no parameter after its block, and pictures use the parameters of matplotlib."""
    before, kept = figure_of(sd.plot.torque(run)[0]).get_size_inches(), {name: mpl.rcParams[name] for name in NAMES}
    for name in STYLES:
        with sd.style(name, font_family="serif"):
            assert mpl.rcParams["font.family"] == ["serif"]
    assert {name: mpl.rcParams[name] for name in NAMES} == kept
    assert (figure_of(sd.plot.torque(run)[0]).get_size_inches() == before).all()
    with mpl.rc_context({"figure.figsize": (5.0, 4.0), "axes.labelsize": 13.0, "xtick.labelsize": "large"}):
        (axes,) = sd.plot.torque(run)
        assert tuple(figure_of(axes).get_size_inches()) == (5.0, 4.0)
        assert axes.xaxis.label.get_fontsize() == 13.0
        assert axes.xaxis.get_ticklabels()[0].get_fontsize() == pytest.approx(12.0)


def test_position_of_a_legend(run):
    """Contract: the legend is inside narrow Axes of a user's figure; in wide ones the names are next to the curves."""
    figure = Figure(figsize=(9.0, 3.0))
    first, second, third = figure.subplots(1, 3)
    sd.plot.torque(run, axes=second)
    inside = second.get_legend()
    figure.draw_without_rendering()
    renderer = FigureCanvasAgg(figure).get_renderer()
    box = inside.get_window_extent(renderer)
    assert not any(box.overlaps(one.get_window_extent(renderer)) for one in (first, third))
    wide = Figure(figsize=(9.0, 3.0)).subplots()
    sd.plot.torque(run, axes=wide)
    [beside] = [text for text in wide.texts if text.get_text() == "with clearance"]
    assert beside.get_color() == wide.lines[0].get_color()
    assert beside.get_window_extent(renderer).x0 >= wide.get_window_extent(renderer).x1 - 1.0


def test_names_of_curves_keep_apart():
    """Contract: names are in the order of the curves' right ends, inside the panel, and no two are on one place."""
    axes = Figure(figsize=(6.0, 3.0)).subplots()
    ends = {"low": 0.0, "near": 0.01, "nearer": 0.011, "high": 1.0}
    for name, end in ends.items():
        axes.plot([2.0, 1.0, 0.0], [end, 5.0, -5.0], label=name)  # drawn from right to left
    assert label_curves(axes, dict(zip(ends, axes.lines, strict=True))) == list(ends)
    heights = [text.xy[1] for text in axes.texts]
    assert np.min(np.diff(heights)) * 0.77 * 3.0 * 72.0 > 8.0
    assert 0.0 <= heights[0] < heights[-1] <= 1.0


def test_pictures_of_a_run_share_their_arguments():
    """Contract: each picture of a run takes the run first, and the start and end of a window."""
    for kind in (*KINDS, "film", "structure", "bending"):
        arguments = list(inspect.signature(getattr(sd.plot, kind)).parameters)
        assert arguments[0] == "run"
        assert {"start", "end"} <= set(arguments)


def test_latex_escapes():
    """Closed form: each character with a meaning in LaTeX is escaped."""
    with mpl.rc_context({"text.usetex": True}):
        assert literal("peak_force < 5 % & $A^2{#}~") == (
            r"peak\_force \textless{} 5 \% \& \$A\textasciicircum{}2\{\#\}\textasciitilde{}"
        )
        assert literal("a\\b") == r"a\textbackslash{}b"
    assert literal("peak_force < 5 %, 3 $") == r"peak_force < 5 %, 3 \$"


def test_texts_of_pictures_of_a_run_are_safe_for_latex(run):
    """Contract: no text of a picture has an unescaped special character."""
    with sd.style("single-column", text_usetex=True):
        for kind in KINDS:
            figure = figure_of(getattr(sd.plot, kind)(run)[0])
            for text in figure.findobj(Text):
                bare = text.get_text().replace("\\_", "").replace("\\%", "").replace("\\mathdefault", "").replace("$", "")
                assert not set("%&#_") & set(bare)


def test_long_labels_take_several_lines():
    """Closed form: letters of 5 pt, 0.58 as wide as high, are 24 to the inch."""
    assert wrap_text("angular velocity [rad/s]", 1.0, 5.0) == "angular velocity [rad/s]"
    assert wrap_text("angular velocity [rad/s]", 0.9, 5.0) == "angular velocity\n[rad/s]"
    assert wrap_text("acceleration", 0.1, 5.0) == "acceleration"


def test_plot_command_with_a_style(run, tmp_path, monkeypatch):
    """Contract: a PDF of 90 mm, the same file each time; an unknown style or parameter gets a suggestion."""
    monkeypatch.chdir(tmp_path)
    sd.save(run, "run.nc")
    command = ["plot", "run.nc", "-o", "out", "--only", "torque", "--format", "pdf", "--style", "single-column"]
    assert status_of(command) == 0
    content = (tmp_path / "out" / "torque.pdf").read_bytes()
    assert content.startswith(b"%PDF-")
    assert b"/MediaBox [ 0 0 254.88" in content
    assert status_of(command) == 0
    assert (tmp_path / "out" / "torque.pdf").read_bytes() == content
    assert status_of([*command[:-1], "single"]) == 2
    with pytest.raises(sd.InputError, match="did you mean 'single-column'"):
        sd.style("single-colum")
    with pytest.raises(sd.InputError, match="did you mean 'font_family'"):
        sd.style("screen", font_famly="serif")
    with pytest.raises(sd.InputError, match="what matplotlib allows"):
        sd.style("screen", font_size="huge letters")
