"""Numbers on axes and other signs: logarithmic ticks, minus signs, colours, titles of films."""

from pathlib import Path
from types import SimpleNamespace

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from scissordyn.plot.animation import film_title
from scissordyn.plot.file import content_of
from scissordyn.plot.scale import Scale
from scissordyn.plot.style import dark_map, number_decades, panels, signed

NARROW = 2.6  # [inch] width and height of a panel of a study


@pytest.mark.parametrize(
    ("low", "high", "expected"),
    [
        (0.03, 0.9, ["0.05", "0.1", "0.2", "0.5"]),
        (2.0, 90.0, ["2", "5", "10", "20", "50"]),
        (1.5, 5e3, ["10", "100", "1000"]),
        (1e-12, 1e7, None),
    ],
)
def test_numbers_of_logarithmic_axes_keep_apart(low, high, expected):
    """Contract: at 1, 2 and 5 below two decades, at powers of ten above, and never over each other in a narrow panel."""
    figure = Figure(figsize=(NARROW, NARROW), layout="constrained")
    (axes,) = panels(figure.subplots(), 1, size=(NARROW, NARROW))
    axes.loglog([low, high], [low, high])
    axes.set(xlim=(low, high), ylim=(low, high))
    renderer = FigureCanvasAgg(figure).get_renderer()
    for axis in (axes.xaxis, axes.yaxis):
        number_decades(axis)
        figure.draw_without_rendering()
        shown = [
            label
            for label, place in zip(axis.get_ticklabels(), axis.get_ticklocs(), strict=True)
            if low <= place <= high and label.get_text()
        ]
        assert expected is None or [label.get_text() for label in shown] == expected
        assert 2 <= len(shown) <= 6
        boxes = [label.get_window_extent(renderer) for label in shown]
        assert not any(one.overlaps(other) for k, one in enumerate(boxes) for other in boxes[:k])
        assert not any(label.get_text() for label in axis.get_ticklabels(minor=True))


def test_minus_signs_are_those_of_the_axes():
    """Contract: negative numbers have the sign U+2212, names keep their hyphens; a user may choose hyphens for all."""
    assert signed("-540 N·m in unit-1, from -3 to 2") == "\N{MINUS SIGN}540 N·m in unit-1, from \N{MINUS SIGN}3 to 2"
    with mpl.rc_context({"axes.unicode_minus": False}):
        assert signed("-540 N·m") == "-540 N·m"
    axes = Figure().subplots()
    axes.set_title("from -3 to 2")
    axes.annotate("-1", (0.0, 0.0))
    content_of(axes, "svg")
    assert [axes.get_title(), axes.texts[0].get_text()] == ["from \N{MINUS SIGN}3 to 2", "\N{MINUS SIGN}1"]


def test_films_have_titles():
    """Contract: the name of the file and the time that is shown."""
    scene = SimpleNamespace(scale=Scale(1e3, "ms"), time=np.array([0.0, 0.01, 0.05]))
    assert film_title(Path("solar_array.html"), scene) == "solar array: 0 ms to 50 ms"


@pytest.mark.parametrize("name", ["viridis", "plasma"])
def test_colours_of_curves_are_visible_on_white_and_on_dark_pages(name):
    """Limit: luminance of every colour is between that of black and white paper by a contrast of two at least."""
    rgb = np.array([dark_map(name)(k)[:3] for k in range(256)])
    linear = np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)
    light = linear @ [0.2126, 0.7152, 0.0722]
    assert np.all(1.05 / (light + 0.05) > 2.0)
