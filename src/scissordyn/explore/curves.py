"""The curves of a run: figures of Bokeh with one time axis, a time cursor, and curves of pinned runs."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from bokeh.core.properties import value
from bokeh.layouts import gridplot
from bokeh.models import (
    CDSView,
    ColumnDataSource,
    CustomJS,
    CustomJSTickFormatter,
    GlyphRenderer,
    Legend,
    LegendItem,
    Line,
    MultiLine,
    Range1d,
    Span,
    Title,
    VStrip,
)
from bokeh.plotting import figure

from scissordyn.explore.shell import area
from scissordyn.plot.scale import DEGREES, Scale, engineering
from scissordyn.plot.series import clearance_joints, predictability_horizon
from scissordyn.plot.style import BLACK, BLUE, GREEN, ORANGE, PURPLE, SKY, VERMILION

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["Curves"]

MOST_POINTS = 4000
"""Points of a curve in the browser; of longer runs each interval keeps its smallest and its largest value."""

HEIGHT, LABELS = 128, 32
"""Of a figure, and what the labels of its time axis add [pixel]."""

LEFT = 78
"""Room for the labels of the axes, equal in all figures so that their times stand above each other [pixel]."""

BEYOND = 10.0
"""Where shading ends, in lengths of the run, so that it goes on where somebody zooms out."""

SQUARE = 210
"""Side of the orbit's frame [pixel]."""

PINNED = (VERMILION, GREEN, PURPLE)
"""Colours of pinned runs, the newest first; all dashed."""

THEMES = {
    "light": {"back": "#ffffff", "ink": BLACK, "line": "#e4e4e4", "faint": "#767676", "shade": "#dddddd"},
    "dark": {"back": "#1d2126", "ink": "#e8e8e8", "line": "#3a4048", "faint": "#a0a6ad", "shade": "#3a4048"},
}

BRIGHTER = ((BLUE, "#4FA8E0"), (VERMILION, "#FF8A3D"), (GREEN, "#33C79A"))
"""Colours of curves on a light page, and their lighter tones on a dark one."""

TIME_EVENT = """
const t = cb_obj.x / factor.tags[0];
if (Number.isFinite(t)) window.dispatchEvent(new CustomEvent("scissordyn:go", { detail: t }));
"""
CURSOR = """
const move = event => {
  for (const span of spans) span.setv({ location: event.detail * clock.tags[0] }, { sync: false });  // not to the server
};
if (window.scissordynCursor) window.removeEventListener("scissordyn:time", window.scissordynCursor);
window.scissordynCursor = move;
window.addEventListener("scissordyn:time", move);
"""
DRAWN = """
const run = clock.tags[1];
requestAnimationFrame(() => requestAnimationFrame(() => {
  window.scissordynDrawn = { run, at: performance.now() };
  window.dispatchEvent(new CustomEvent("scissordyn:drawn", { detail: run }));
}));
"""
"""Tells when the curves of a run are on the screen: the library draws in the frame after its data have changed."""

TICKS = """
const step = ticks.length > 1 ? Math.abs(ticks[1] - ticks[0]) : 1;
return tick.toFixed(Math.min(9, Math.max(0, Math.ceil(-Math.log10(step) - 1e-9)))).padStart(6);
"""
"""Labels of one width, in a font of one width: the library lays a figure out anew whenever the width of its labels changes."""


@dataclass
class Panel:
    """One figure over time.

    Parameters
    ----------
    name : str
    lines : sequence of (str, str, str)
        Column of the source, label, colour.
    unit : str
        SI.
    """

    name: str
    lines: Sequence[tuple[str, str, str]]
    unit: str
    figure: Any = field(default=None)


PANELS = (
    Panel("output", (("output", "output", BLUE),), "m"),
    Panel("torque", (("torque", "driving torque", BLUE),), "N m"),
    Panel("force", (("normal", "normal", BLUE), ("friction", "friction", ORANGE)), "N"),
    Panel("slip", (("slip", "slip speed", BLUE),), "m/s"),
    Panel("energy", (("kinetic", "kinetic", BLUE), ("potential", "potential", GREEN), ("work", "work", ORANGE)), "J"),
    Panel("loss", (("dissipated", "dissipated", BLUE),), "J"),
    Panel("track", (("track", "deviation", BLUE),), "m"),
)


class Curves:
    """Figures of one page.

    Parameters
    ----------
    dark : bool
    """

    def __init__(self, *, dark: bool = False) -> None:
        names = [column for panel in PANELS for column, _, _ in panel.lines]
        # one sample draws nothing, and axes with its range have the size of later ones
        empty: dict[str, Any] = {"time": [0.0], **{name: [0.0] for name in names}}
        self.dark = dark
        self.source = ColumnDataSource(empty, name="curves")
        first = [panel.lines[0][0] for panel in PANELS]
        self.pinned = ColumnDataSource({"time": [], **{name: [] for name in first}, "color": []}, name="pinned")
        self.orbit_source = ColumnDataSource({"x": [], "y": []})
        self.circle = ColumnDataSource({"x": [], "y": []})
        self.pinned_orbits = ColumnDataSource({"x": [], "y": [], "color": []})
        self.views: dict[str, CDSView] = {}
        self.range = Range1d(0.0, 1.0)
        self.horizon = ColumnDataSource({"from": [], "to": []}, name="horizon")
        self.spans: list[Span] = []
        self.shades: list[Any] = []
        self.factor = 1.0
        self._until = 0.0
        # a model that is not drawn carries numbers to the browser: the factor of the time axis, the number of the run
        self.clock = Title(tags=[1.0, 0], name="clock")
        self.ticks = CustomJSTickFormatter(code=TICKS)
        self.figures = [self._time_figure(panel) for panel in PANELS]
        self._end_with(self.figures[-2])  # as for most runs, which track no point
        self.figures[-1].visible = False
        # one bar of tools for all figures: to lay out one for each takes longer than the figures themselves
        self.stack = gridplot(
            [[made] for made in self.figures],
            sizing_mode="stretch_width",
            toolbar_location="right",
            toolbar_options={"logo": None, "autohide": True},
        )
        self.stack.styles = {**area("curves"), "overflow-y": "auto"}
        self.orbit = self._orbit_figure()
        self.source.js_on_change("data", CustomJS(args={"clock": self.clock}, code=DRAWN))
        self.start = CustomJS(args={"spans": self.spans, "clock": self.clock}, code=CURSOR)
        self.theme(dark=dark)

    def _time_figure(self, panel: Panel) -> Any:
        made = figure(
            height=HEIGHT,
            sizing_mode="stretch_width",
            x_range=self.range,
            tools="xpan,xwheel_zoom,box_zoom,reset,save",
            active_drag="box_zoom",
            name=panel.name,
            min_border_left=LEFT,
            output_backend="canvas",
        )
        first = panel.lines[0][0]
        self._add(made, self.pinned, MultiLine(xs="time", ys=first, line_color="color", line_dash=[6, 3], line_width=1.3))
        drawn = [
            self._add(made, self.source, Line(x="time", y=column, line_color=color, line_width=1.4))
            for column, _, color in panel.lines
        ]
        if len(panel.lines) > 1:  # in place of the title, where no curve is
            made.title.visible = False
            items = [
                LegendItem(label=value(label), renderers=[line]) for (_, label, _), line in zip(panel.lines, drawn, strict=True)
            ]
            legend = Legend(items=items, orientation="horizontal", location=(0, 0), padding=0, margin=0, spacing=14)
            legend.update(glyph_width=14, glyph_height=16, label_height=16, label_width=10, label_standoff=4)
            legend.update(label_text_font_size="13px", label_text_font_style="bold")
            made.add_layout(legend, "above")
        else:
            made.title.text = panel.lines[0][1]  # it takes its room from the beginning
        # labels as high as later ones: the library lays a figure out anew when they grow
        made.yaxis.axis_label, made.xaxis.axis_label = panel.unit, "time [s]"
        made.yaxis.formatter = self.ticks
        made.yaxis.major_label_text_font = "monospace"
        span = Span(location=0.0, dimension="height", line_color=VERMILION, line_width=1.2, tags=["cursor"])
        made.add_layout(span)
        self.spans.append(span)
        # a strip of data and no annotation: setting the edge of one makes the library look through all models of the page
        shade = VStrip(x0="from", x1="to", fill_alpha=0.5, line_alpha=0.0)
        self.shades.append(self._add(made, self.horizon, shade, level="underlay"))
        made.js_on_event("tap", CustomJS(args={"factor": self.clock}, code=TIME_EVENT))
        return made

    def _add(self, made: Any, source: ColumnDataSource, glyph: Any, *, level: str = "glyph") -> GlyphRenderer:
        """Draw data, with no model for selections, as the figures have none: each model costs time when a page opens."""
        renderer = GlyphRenderer(data_source=source, glyph=glyph, view=self.views.setdefault(source.id, CDSView()), level=level)
        made.renderers.append(renderer)
        return renderer

    def _orbit_figure(self) -> Any:
        made = figure(
            frame_width=SQUARE,
            frame_height=SQUARE,
            x_range=Range1d(-1.0, 1.0),
            y_range=Range1d(-1.0, 1.0),
            tools="pan,wheel_zoom,reset,save",
            active_scroll="wheel_zoom",
            toolbar_location="right",
            name="orbit",
            styles=area("orbit"),
            min_border_left=LEFT,
        )
        made.title.text, made.xaxis.axis_label, made.yaxis.axis_label = "journal orbit", "x [mm]", "y [mm]"
        self._add(made, self.circle, Line(x="x", y="y", line_color=THEMES["light"]["faint"], line_dash=[2, 2]))
        pinned = MultiLine(xs="x", ys="y", line_color="color", line_dash=[6, 3], line_width=1.0)
        self._add(made, self.pinned_orbits, pinned)
        self._add(made, self.orbit_source, Line(x="x", y="y", line_color=SKY, line_width=1.2))
        return made

    def theme(self, *, dark: bool) -> None:
        """Colours for a light or a dark page."""
        self.dark = dark
        for source in (self.pinned, self.pinned_orbits):
            _renew(source, {**source.data, "color": self._colors(len(source.data["color"]))})
        look = THEMES["dark" if dark else "light"]
        for made in (*self.figures, self.orbit):
            made.background_fill_color = made.border_fill_color = look["back"]
            made.outline_line_color = look["line"]
            made.title.text_color = look["ink"]
            made.toolbar.logo = None
            made.toolbar.autohide = True
            for axis in made.axis:
                axis.minor_tick_line_color = None
                axis.axis_line_color = axis.major_tick_line_color = look["faint"]
                axis.major_label_text_color = axis.axis_label_text_color = look["ink"]
                axis.axis_label_text_font_style = "normal"
            made.grid.grid_line_color = look["line"]
            for legend in made.legend:
                legend.label_text_color = look["ink"]
                legend.background_fill_alpha = legend.border_line_alpha = 0.0
            for drawn in set(made.renderers) - set(self.shades):
                pair = next((pair for pair in BRIGHTER if drawn.glyph.line_color in pair), None)
                if pair is not None:
                    drawn.glyph.line_color = pair[int(dark)]
        for shade in self.shades:
            shade.glyph.fill_color = look["shade"]

    def show(self, run: xr.Dataset, pins: Sequence[xr.Dataset], joint: str, output: str, number: int) -> None:
        """Draw a run.

        Parameters
        ----------
        run : Dataset
        pins : sequence of Dataset
            The newest last.
        joint : str
            Of force, slip and orbit; "" for a run without clearance joints.
        output : str
            The output body.
        number : int
            Of the run in its session.
        """
        scales, data = self._scaled(run, joint, output, None)
        time = scales["time"]
        until = time.factor * float(run["time"].values[-1])
        if until != self._until:
            self._until = until
            self.range.update(start=0.0, end=until, reset_start=0.0, reset_end=until)
        self.clock.tags = [time.factor, number]
        horizon = predictability_horizon(run)
        names = self._titles(run, joint, output)
        shaded = {"from": [], "to": []} if horizon is None else {"from": [time.factor * horizon], "to": [BEYOND * until]}
        _renew(self.horizon, shaded)
        for panel, made in zip(PANELS, self.figures, strict=True):
            made.yaxis.axis_label = scales[panel.name].unit or "1"
            made.title.text = names[panel.name]
            if made.legend:
                made.legend[0].items[0].label = value(f"{names[panel.name]}: {panel.lines[0][1]}")
            made.visible = any(len(data[column]) and np.isfinite(data[column]).any() for column, _, _ in panel.lines)
            made.xaxis.axis_label = f"time [{time.unit}]"
        self._end_with([made for made in self.figures if made.visible][-1])
        before = [self._scaled(pin, joint, output, scales)[1] for pin in reversed(pins)]
        columns = {name: [data[name] for data in before] for name in self.pinned.data if name != "color"}
        _renew(self.pinned, {**columns, "color": self._colors(len(before))})
        self._show_orbit(run, pins, joint)
        self.source.data = data

    def _end_with(self, last: Any) -> None:
        """Label the times below the last figure only."""
        for made in self.figures:
            made.xaxis.visible = made is last
            made.height = HEIGHT + (LABELS if made is last else 0)

    def _colors(self, count: int) -> list[str]:
        """Colours of pinned runs."""
        lighter = dict(BRIGHTER) if self.dark else {}
        return [lighter.get(color, color) for color in PINNED[:count]]

    def _titles(self, run: xr.Dataset, joint: str, output: str) -> dict[str, str]:
        of_joint = f" at {joint}" if joint else ""
        moved = "displacement of the slider" if "slider_position" in run else f"angle of {output}"
        tracked = [str(name) for name in run["track"].values] if "track" in run.coords else []
        bodies = run["body"].values.astype(str).tolist()
        moved = moved if output in bodies else moved.replace("angle of ", f"angle of {bodies[-1]}")
        return {
            "output": moved,
            "torque": "driving torque",
            "force": f"contact force{of_joint}",
            "slip": f"slip speed{of_joint}",
            "energy": "energy",
            "loss": "dissipated in contacts",
            "track": f"deviation of {tracked[0]} from the ideal mechanism" if tracked else "",
        }

    def _scaled(
        self, run: xr.Dataset, joint: str, output: str, scales: dict[str, Scale] | None
    ) -> tuple[dict[str, Scale], dict[str, np.ndarray]]:
        """The columns of the source in units that suit them, or in given ones."""
        time = run["time"].values
        raw = _columns(run, joint, output)
        kept = _thinned(time.size, [raw["normal"], raw["torque"]])
        angular = "slider_position" not in run
        if scales is None:
            scales = {"time": engineering("s", time)}
            for panel in PANELS:
                values = [raw[column][np.isfinite(raw[column])] for column, _, _ in panel.lines]
                degrees = panel.name == "output" and angular
                scales[panel.name] = DEGREES if degrees else engineering(panel.unit, *values)
        data = {"time": scales["time"].factor * time[kept]}
        for panel in PANELS:
            data.update({column: scales[panel.name].factor * raw[column][kept] for column, _, _ in panel.lines})
        return scales, data

    def _show_orbit(self, run: xr.Dataset, pins: Sequence[xr.Dataset], joint: str) -> None:
        plane = bool(run["plane_contact"].sel(joint=joint)) if joint and "plane_contact" in run else False
        self.orbit.visible = bool(joint) and not plane
        if not self.orbit.visible:
            return
        clearance = float(run["clearance"].sel(joint=joint))
        scale = engineering("m", clearance)
        around = np.linspace(0.0, 2.0 * math.pi, 181)
        size = scale.factor * clearance
        _renew(self.circle, {"x": size * np.cos(around), "y": size * np.sin(around)})
        self.orbit_source.data = _orbit(run, joint, scale.factor)
        shown = [_orbit(pin, joint, scale.factor) for pin in reversed(pins) if joint in clearance_joints(pin)]
        before = {axis: [data[axis] for data in shown] for axis in "xy"}
        _renew(self.pinned_orbits, {**before, "color": self._colors(len(shown))})
        drawn = [np.abs(data[axis]).max(initial=0.0) for data in (self.orbit_source.data, *shown) for axis in "xy"]
        reach = _rounded(1.1 * max(size, *map(float, drawn)))
        for range in (self.orbit.x_range, self.orbit.y_range):
            range.update(start=-reach, end=reach, reset_start=-reach, reset_end=reach)
        self.orbit.title.text = f"journal orbit at {joint}"
        self.orbit.xaxis.axis_label, self.orbit.yaxis.axis_label = f"x [{scale.unit}]", f"y [{scale.unit}]"


def _renew(source: ColumnDataSource, data: dict[str, Any]) -> None:
    """Give a source other data; the same ones would be sent and drawn once more."""
    if any(not _equal(source.data[name], values) for name, values in data.items()):
        source.data = data


def _equal(before: Any, after: Any) -> bool:
    """Whether two columns are the same, of numbers, of texts or of curves."""
    if len(before) != len(after):
        return False
    if isinstance(after, list):
        return all(np.array_equal(one, other) for one, other in zip(before, after, strict=True))
    return np.array_equal(before, after)


def _rounded(reach: float) -> float:
    """A length rounded up to two digits, so that an axis stays when a curve changes little."""
    if reach <= 0.0:
        return 1.0
    digit = 10.0 ** (math.floor(math.log10(reach)) - 1)
    return math.ceil(reach / digit) * digit


def _columns(run: xr.Dataset, joint: str, output: str) -> dict[str, np.ndarray]:
    """The curves in SI; NaN where a run has none."""
    nothing = np.full(run.sizes["time"], np.nan)
    here = joint if joint in clearance_joints(run) else ""

    def of_joint(name: str) -> np.ndarray:
        return np.asarray(run[name].sel(joint=here).values) if here and name in run else nothing

    def of_run(name: str) -> np.ndarray:
        return np.asarray(run[name].values) if name in run else nothing

    bodies = run["body"].values.astype(str).tolist()
    body = output if output in bodies else bodies[-1]
    moved = of_run("slider_position") if "slider_position" in run else run["angle"].sel(body=body).values
    friction, lost = of_joint("friction_force"), of_run("dissipated_energy")
    return {
        "output": np.asarray(moved),
        "torque": of_run("drive_torque"),
        "normal": of_joint("normal_force"),
        "friction": friction if np.any(np.nan_to_num(friction)) else nothing,
        "slip": of_joint("slip_speed"),
        "kinetic": of_run("kinetic_energy"),
        "potential": of_run("potential_energy"),
        "work": of_run("drive_work"),
        "dissipated": lost if np.any(np.nan_to_num(lost)) else nothing,
        "track": _deviation(run, nothing),
    }


def _deviation(run: xr.Dataset, nothing: np.ndarray) -> np.ndarray:
    """How far the first tracked point is from where the ideal mechanism has it."""
    if "track_deviation" not in run or not run.sizes.get("track", 0):
        return nothing
    values = run["track_deviation"].isel(track=0).transpose("time", ...).values
    return np.asarray(np.hypot(*values.T) if values.ndim == 2 else values)


def _orbit(run: xr.Dataset, joint: str, factor: float) -> dict[str, np.ndarray]:
    place = factor * run["eccentricity"].sel(joint=joint).transpose("time", "axis").values
    step = max(1, len(place) // MOST_POINTS)
    return {"x": place[::step, 0], "y": place[::step, 1]}


def _thinned(count: int, curves: Sequence[np.ndarray]) -> np.ndarray | slice:
    """Samples to draw: all of a short run, of a long one the extreme ones of each interval."""
    if count <= MOST_POINTS:
        return slice(None)
    edges = np.linspace(0, count, MOST_POINTS // (2 * len(curves)) + 1).astype(int)
    found = {0, count - 1}
    for curve in curves:
        values = np.nan_to_num(curve)
        for first, last in itertools.pairwise(edges.tolist()):
            found.update((first + int(np.argmin(values[first:last])), first + int(np.argmax(values[first:last]))))
    return np.array(sorted(found))
