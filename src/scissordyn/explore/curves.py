"""The figures of the page: figures of Bokeh with one time axis and a time cursor, and what is drawn in them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
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

from scissordyn.explore.columns import UNITS, chosen_point, chosen_torques, orbit, requirements, scaled
from scissordyn.explore.shell import area
from scissordyn.plot.scale import Scale, engineering
from scissordyn.plot.series import predictability_horizon
from scissordyn.plot.source import TorqueSource
from scissordyn.plot.style import BLACK, BLUE, GREEN, ORANGE, PURPLE, SKY, VERMILION
from scissordyn.run.joints import clearance_joints
from scissordyn.units import short

if TYPE_CHECKING:
    import xarray as xr

    from scissordyn.run.summary import PointAnswer, Summary

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
SHOWN = (Path(__file__).parent / "assets" / "shown.js").read_text(encoding="utf-8")

TICKS = """
const step = ticks.length > 1 ? Math.abs(ticks[1] - ticks[0]) : 1;
return tick.toFixed(Math.min(9, Math.max(0, Math.ceil(-Math.log10(step) - 1e-9)))).padStart(6);
"""
"""Labels of one width, in a font of one width: the library lays a figure out anew whenever the width of its labels changes."""


@dataclass
class Panel:
    """One figure over time."""

    name: str
    lines: Sequence[tuple[str, str, str]]  # Column of the source, label, colour
    figure: Any = field(default=None)


LINES: dict[str, tuple[tuple[str, str], ...]] = {
    "output": (("output", BLUE),),
    "torque": (("driving torque", BLUE), ("", ORANGE), ("", GREEN), ("", PURPLE)),
    "force": (("force", BLUE), ("friction", ORANGE), ("metal alone", GREEN)),
    "slip": (("slip speed", BLUE),),
    "energy": (
        ("kinetic", BLUE),
        ("potential", GREEN),
        ("springs", PURPLE),
        ("drive", VERMILION),
        ("motors", ORANGE),
        ("loads", SKY),
    ),
    "loss": (("dissipated", BLUE),),
    "film": (("film thickness", BLUE),),
    "stress": (("largest stress of the bars", BLUE),),
    "track": (("deviation", BLUE),),
}
"""Labels and colours of the lines; the names of torques are those of a run."""

RARE = 3
"""Last figures that most runs have not: of a film, of stress and of a tracked point."""

ALLOWED = ("torque", "track")
"""Figures with lines of what is allowed."""

PANELS = tuple(
    Panel(name, [(column, *look) for column, look in zip(columns, LINES[name], strict=True)])
    for name, (_, columns) in UNITS.items()
)


class Curves:
    """Figures of one page."""

    def __init__(self, *, dark: bool = False) -> None:
        names = [column for panel in PANELS for column, _, _ in panel.lines]
        # one sample draws nothing, and axes with its range have the size of later ones
        empty: dict[str, Any] = {"time": [0.0], **{name: [0.0] for name in names}}
        self.dark = dark
        self.source = ColumnDataSource(empty, name="curves")
        first = [panel.lines[0][0] for panel in PANELS]
        self.pinned = ColumnDataSource({"time": [], **{name: [] for name in first}, "color": []}, name="pinned")
        self.orbit_source = ColumnDataSource({"x": [], "y": []}, name="orbit points")
        self.circle = ColumnDataSource({"x": [], "y": []})
        self.pinned_orbits = ColumnDataSource({"x": [], "y": [], "color": []})
        self.views: dict[str, CDSView] = {}
        self.range = Range1d(0.0, 1.0)
        self.allowed = ColumnDataSource({"time": [], **{name: [] for name in ALLOWED}}, name="allowed")
        self.horizon = ColumnDataSource({"from": [], "to": []}, name="horizon")
        self.spans: list[Span] = []
        self.shades: list[Any] = []
        self.legends: list[Legend] = []
        # a model that is not drawn carries all that is shown of a run to the browser, in one message: the factor of the time
        # axis, the number of the run, and what `shown.js` puts in its places
        self.clock = Title(tags=[1.0, 0], name="clock")
        self.ticks = CustomJSTickFormatter(code=TICKS)
        self.figures = [self._time_figure(panel) for panel in PANELS]
        rare = self.figures[-RARE:]
        self._end_with(self.figures[-RARE - 1])
        for made in rare:
            made.visible = False
        # one bar of tools for all figures: to lay out one for each takes longer than the figures themselves
        self.stack = gridplot(
            [[made] for made in self.figures],
            sizing_mode="stretch_width",
            toolbar_location="right",
            toolbar_options={"logo": None, "autohide": True},
        )
        self.stack.styles = {**area("curves"), "overflow-y": "auto", "max-height": "100%"}
        self.orbit = self._orbit_figure()
        self.start = CustomJS(args={"spans": self.spans, "clock": self.clock}, code=CURSOR)
        self.clock.js_on_change("tags", CustomJS(args=self._places(), code=SHOWN))
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
        if panel.name in ALLOWED:
            line = Line(x="time", y=panel.name, line_color=THEMES["light"]["faint"], line_dash=[8, 3, 2, 3], line_width=1.3)
            self._add(made, self.allowed, line)
        if len(panel.lines) > 1:  # in place of the title, where no curve is
            made.title.visible = False
            items = [
                LegendItem(label=value(label), renderers=[line]) for (_, label, _), line in zip(panel.lines, drawn, strict=True)
            ]
            legend = Legend(items=items, orientation="horizontal", location=(0, 0), padding=0, margin=0, spacing=14)
            legend.update(glyph_width=14, glyph_height=16, label_height=16, label_width=10, label_standoff=4)
            legend.update(label_text_font_size="12px", label_text_font_style="bold")
            made.add_layout(legend, "above")
            self.legends.append(legend)
        else:
            made.title.text = panel.lines[0][1]  # it takes its room from the beginning
        # labels as high as later ones: the library lays a figure out anew when they grow
        made.yaxis.axis_label, made.xaxis.axis_label = UNITS[panel.name][0], "time [s]"
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

    def _places(self) -> dict[str, Any]:
        """The models of the browser that get what is shown."""
        sources = {
            "curves": self.source,
            "pinned": self.pinned,
            "allowed": self.allowed,
            "orbit": self.orbit_source,
            "circle": self.circle,
            "pinnedOrbits": self.pinned_orbits,
            "horizon": self.horizon,
        }
        return {
            "clock": self.clock,
            "sources": sources,
            "figures": self.figures,
            "titles": [made.title for made in self.figures],
            "legends": [made.legend[0] if made.legend else None for made in self.figures],
            "times": [made.xaxis[0] for made in self.figures],
            "sizes": [made.yaxis[0] for made in self.figures],
            "range": self.range,
            "orbit": self.orbit,
            "orbitParts": [self.orbit.title, self.orbit.xaxis[0], self.orbit.yaxis[0], self.orbit.x_range, self.orbit.y_range],
        }

    def drawn(
        self, run: xr.Dataset, summary: Summary, pins: Sequence[xr.Dataset], joint: str, output: str
    ) -> tuple[float, dict[str, Any]]:
        """What the browser draws of a run."""
        torques, more = chosen_torques(run)
        point = chosen_point(summary)
        of = (joint, output, [source.name for source in torques], point.name if point else "")
        scales, data = scaled(run, *of, None, torques)
        time = scales["time"]
        until = time.factor * float(run["time"].values[-1])
        horizon = predictability_horizon(run)
        before = [scaled(pin, *of, scales)[1] for pin in reversed(pins)]
        pinned = {name: [each[name] for each in before] for name in self.pinned.data if name != "color"}
        drawn = {
            "curves": data,
            "pinned": {**pinned, "color": self.colors(len(before))[1:]},
            "allowed": self._allowed(torques, point, scales, data, until),
            "horizon": {"from": [], "to": []} if horizon is None else {"from": [time.factor * horizon], "to": [BEYOND * until]},
            "until": until,
            "height": HEIGHT,
            "labels": LABELS,
            "time": f"time [{time.unit}]",
            "looks": self._looks(self._titles(run, joint, output, point), torques, more, scales, data),
            **self._drawn_orbit(run, pins, joint),
        }
        return time.factor, drawn

    def _allowed(
        self,
        torques: Sequence[TorqueSource],
        point: PointAnswer | None,
        scales: dict[str, Scale],
        data: dict[str, np.ndarray],
        until: float,
    ) -> dict[str, np.ndarray]:
        """Lines over the whole time, with a gap between two of one figure."""
        factor = scales["torque"].factor
        levels = requirements(torques, point, {name: data[name] / factor for name in UNITS["torque"][1]})
        most = max(len(each) for each in levels.values())
        found = {"time": np.array([0.0, until, math.nan] * most)}
        for name, each in levels.items():
            values = np.full(most, math.nan)
            values[: len(each)] = scales[name].factor * np.array(each)
            found[name] = np.repeat(values, 3)
        return found

    def _looks(
        self,
        titles: dict[str, str],
        torques: Sequence[TorqueSource],
        more: int,
        scales: dict[str, Scale],
        data: dict[str, np.ndarray],
    ) -> list[dict[str, Any]]:
        """What is written at each figure, and which lines it has."""
        looks = []
        for panel in PANELS:
            labels = list(map(_with_limit, torques)) if panel.name == "torque" else [label for _, label, _ in panel.lines]
            if panel.name == "torque" and more:
                labels[-1] += f"; {more} more are smaller"
            if panel.name in ("force", "energy"):
                labels[0] = f"{titles[panel.name].removeprefix('contact ')}: {labels[0]}"
            there = [bool(np.isfinite(data[column]).any()) for column, _, _ in panel.lines]
            looks.append(
                {
                    "title": titles[panel.name],
                    "unit": scales[panel.name].unit or "1",
                    "labels": [*labels, *[""] * (len(there) - len(labels))],
                    "there": there,
                    "visible": any(there),
                }
            )
        return looks

    def _end_with(self, last: Any) -> None:
        """Label the times below the last figure only."""
        for made in self.figures:
            made.xaxis.visible = made is last
            made.height = HEIGHT + (LABELS if made is last else 0)

    def colors(self, pins: int) -> list[str]:
        """Colours of the run that is shown and of pinned ones, the newest of these first."""
        lighter = dict(BRIGHTER) if self.dark else {}
        return [lighter.get(color, color) for color in (BLUE, *PINNED[:pins])]

    def _titles(self, run: xr.Dataset, joint: str, output: str, point: PointAnswer | None) -> dict[str, str]:
        of_joint = f" at {joint}" if joint else ""
        moved = "displacement of the slider" if "slider_position" in run else f"angle of {output}"
        bodies = run["body"].values.astype(str).tolist()
        moved = moved if output in bodies else moved.replace("angle of ", f"angle of {bodies[-1]}")
        return {
            "output": moved,
            "torque": "torque",
            "force": f"contact force{of_joint}",
            "slip": f"slip speed{of_joint}",
            "energy": "energy",
            "loss": "dissipated energy",
            "film": f"film thickness{of_joint}",
            "stress": "largest stress of the bars",
            "track": "" if point is None else f"deviation of {point.name}{_allowing(point)}",
        }

    def _drawn_orbit(self, run: xr.Dataset, pins: Sequence[xr.Dataset], joint: str) -> dict[str, Any]:
        plane = bool(run["plane_contact"].sel(joint=joint)) if joint and "plane_contact" in run else False
        if not joint or plane:
            return {"orbit": None}
        clearance = float(run["clearance"].sel(joint=joint))
        scale = engineering("m", clearance)
        around = np.linspace(0.0, 2.0 * math.pi, 181)
        size = scale.factor * clearance
        now = orbit(run, joint, scale.factor)
        shown = [orbit(pin, joint, scale.factor) for pin in reversed(pins) if joint in clearance_joints(pin)]
        before = {axis: [data[axis] for data in shown] for axis in "xy"}
        extreme = [np.abs(data[axis]).max(initial=0.0) for data in (now, *shown) for axis in "xy"]
        return {
            "orbit": now,
            "circle": {"x": size * np.cos(around), "y": size * np.sin(around)},
            "pinnedOrbits": {**before, "color": self.colors(len(shown))[1:]},
            "orbitTexts": [f"journal orbit at {joint}", f"x [{scale.unit}]", f"y [{scale.unit}]"],
            "orbitReach": _rounded(1.1 * max(size, *map(float, extreme))),
        }


def _with_limit(source: TorqueSource) -> str:
    """The label of a torque."""
    return source.name if source.limit is None else f"{source.name}, limit {short(source.limit, 'N m')}"


def _allowing(point: PointAnswer) -> str:
    return "" if point.tolerance is None else f"; allowed {short(point.tolerance, 'm')}"


def _rounded(reach: float) -> float:
    """A length rounded up to two digits, so that an axis stays when a curve changes little."""
    if reach <= 0.0:
        return 1.0
    digit = 10.0 ** (math.floor(math.log10(reach)) - 1)
    return math.ceil(reach / digit) * digit
