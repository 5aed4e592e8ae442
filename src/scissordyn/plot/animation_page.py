"""A film as one HTML file: a drawing in SVG and a small player, without other files or network access."""

from __future__ import annotations

import html
import json
import math
from pathlib import Path
from typing import Any

import numpy as np

from scissordyn.plot.animation_scene import TRAIL, ClearanceJoint, Scene, newtons, time_scale_in_words
from scissordyn.plot.channel_scene import EDGE, GAP, Channel
from scissordyn.plot.scale import engineering
from scissordyn.plot.style import BLACK, BLUE, GREEN, GREY, LIGHT, ORANGE, PURPLE, SKY, SMALL, VERMILION

__all__ = ["page", "write_page"]

WIDTH, HEIGHT = 900.0, 560.0
LETTERS = 13.0
"""Largest size of the structure's drawing [pixel]."""

RADIUS = 48.0
"""Drawn radius of a journal [pixel]."""

SPEEDS = (0.1, 0.25, 0.5, 1, 2, 4)

STYLE = f"""
body {{ font: 15px/1.4 system-ui, sans-serif; color: {BLACK}; background: #fff;
  margin: 1rem auto; max-width: 960px; padding: 0 1rem }}
svg {{ display: block; max-width: 100%; height: auto }}
.controls {{ display: flex; flex-wrap: wrap; gap: .75rem; align-items: center; margin: .5rem 0 }}
.controls input {{ flex: 1 1 16rem }}
.controls output {{ min-width: 8em; font-variant-numeric: tabular-nums }}
button, select {{ font: inherit; padding: .2rem .8rem }}
.stage, .joints {{ display: flex; flex-wrap: wrap; gap: 1rem; align-items: center }}
.stage > svg {{ flex: none }}
.joints {{ flex: 1 1 160px; justify-content: center }}
figure {{ flex: none; margin: 0; text-align: center }}
figcaption {{ font-size: 13px; font-variant-numeric: tabular-nums }}
small {{ color: {GREY} }}
.bar, .component, .rod, .guide, .path {{ fill: none; stroke-linejoin: round; stroke-linecap: round }}
.bar {{ stroke-width: 3.5 }}
.plate {{ fill-opacity: .15; stroke-width: 2.5 }}
.block {{ fill: {LIGHT}; stroke: {BLACK} }}
.component {{ stroke: {PURPLE}; stroke-width: 1.5 }}
.rod {{ stroke: {PURPLE}; stroke-width: 2; stroke-dasharray: 6 3 }}
.guide {{ stroke: {GREY}; stroke-dasharray: 12 4 2 4 }}
.joint, .support, .bearing {{ fill: #fff; stroke: {BLACK}; stroke-width: 1.5 }}
.ring {{ fill: none; stroke-width: 2.5 }}
.journal {{ fill: {LIGHT}; stroke-width: 3 }}
.corner {{ fill: {VERMILION} }}
.surface {{ fill: {LIGHT}; stroke: {BLACK} }}
.name {{ font-size: {LETTERS:g}px; text-anchor: middle; dominant-baseline: central }}
.name {{ paint-order: stroke; stroke: #fff; stroke-width: 3px }}
.turning {{ flex: 1 1 100%; text-align: center; font-size: 13px }}
figure[hidden] {{ display: none }}
.path {{ stroke: {ORANGE}; stroke-width: 1.5 }}
"""

TURNING = """<div class="turning"><button id="back" type="button" aria-label="joints with larger forces">&lsaquo;</button>
<output id="which"></output> <button id="on" type="button" aria-label="joints with smaller forces">&rsaquo;</button></div>
"""

PLAYER = """
"use strict";
const film = JSON.parse(document.getElementById("film").textContent);
const part = id => document.getElementById(id);
const shapes = [...document.querySelectorAll("[data-shape]")], pins = [...document.querySelectorAll(".joint")];
const rings = [...document.querySelectorAll(".ring")], joints = [...document.querySelectorAll("figure")];
const names = [...document.querySelectorAll(".name")];
const slider = part("frame"), button = part("play"), speed = part("speed"), clock = part("clock");
const last = film.time.length - 1;
let playing = false, now = 0, before = null;

function centre(circle, x, y) { circle.setAttribute("cx", x); circle.setAttribute("cy", y); }
let first = 0;
function turn(by) {
  first += by * film.shown;
  joints.forEach((joint, k) => {
    joint.hidden = k < first || k >= first + film.shown;
    names[k].style.display = joint.hidden ? "none" : "";
  });
  if (film.joints.length > film.shown) {
    part("which").textContent = `${first + 1} to ${Math.min(first + film.shown, joints.length)} of ${joints.length}`;
    part("back").disabled = first === 0; part("on").disabled = first + film.shown >= joints.length;
  }
}
function show(frame) {
  shapes.forEach((shape, k) => shape.setAttribute("points", film.shapes[k][frame].join(" ")));
  pins.forEach((joint, k) => centre(joint, ...film.pins[frame].slice(2 * k, 2 * k + 2)));
  film.joints.forEach((joint, k) => {
    const color = joint.touched[frame] ? film.contact : film.free;
    centre(rings[k], ...joint.place[frame]);
    rings[k].style.stroke = color;
    names[k].setAttribute("x", joint.place[frame][0] + joint.aside[0]);
    names[k].setAttribute("y", joint.place[frame][1] + joint.aside[1]);
    joints[k].querySelector(".state").textContent = joint.touched[frame] ? joint.force[frame] : "free";
    if (joint.block) {
      const block = joints[k].querySelector(".journal");
      block.setAttribute("points", joint.block[frame].join(" "));
      block.style.stroke = color;
      joints[k].querySelectorAll(".corner").forEach((corner, c) => {
        centre(corner, ...joint.block[frame].slice(2 * c, 2 * c + 2));
        corner.style.display = joint.corners[frame][c] ? "" : "none";
      });
      return;
    }
    const journal = joints[k].querySelector(".journal");
    centre(journal, ...joint.journal[frame]);
    journal.style.stroke = color;
    const begin = joint.reached[Math.max(0, frame - film.trail)] - 1;
    joints[k].querySelector(".path").setAttribute("points", joint.path.slice(2 * begin, 2 * joint.reached[frame]).join(" "));
  });
  slider.value = frame;
  clock.textContent = film.time[frame];
}
function play(on) {
  playing = on;
  before = null;
  button.textContent = on ? "Pause" : "Play";
  if (on) { if (now >= last) now = 0; requestAnimationFrame(step); }
}
function step(instant) {
  if (!playing) return;
  if (before !== null) now += (instant - before) / 1000 * film.rate * Number(speed.value);
  before = instant;
  if (now >= last) { now = last; show(last); play(false); return; }
  show(Math.floor(now));
  requestAnimationFrame(step);
}
function go(frame) { play(false); now = Math.min(last, Math.max(0, frame)); show(now); }
button.addEventListener("click", () => play(!playing));
slider.addEventListener("input", () => go(Number(slider.value)));
document.addEventListener("keydown", event => {
  if (event.target === speed || (event.target === button && event.key === " ")) return;
  const move = {ArrowLeft: -1, ArrowRight: 1}[event.key];
  if (event.key === " ") { event.preventDefault(); play(!playing); }
  else if (move) { event.preventDefault(); go(Math.floor(now) + move); }
});
if (film.joints.length > film.shown) {
  part("back").addEventListener("click", () => turn(-1));
  part("on").addEventListener("click", () => turn(1));
}
turn(0);
const wanted = Number(location.hash.slice(1));
go(Number.isFinite(wanted) ? Math.floor(wanted) : 0);
"""


def _numbers(values: np.ndarray) -> Any:
    """Pixels to a tenth, whole ones without a point."""
    rounded = np.round(values, 1)
    return json.loads(json.dumps(rounded.tolist()).replace(".0,", ",").replace(".0]", "]"))


def page(scene: Scene, rate: int, slower: float) -> str:
    """The page of a film.

    Parameters
    ----------
    scene : Scene
    rate : int
        Frames per second.
    slower : float
        Time scale: film time over simulated time.

    Returns
    -------
    str
        The HTML of the page.
    """
    extent = scene.high - scene.low
    gain = min(WIDTH / extent[0], HEIGHT / extent[1])
    width, height = (gain * extent).tolist()

    def pixels(points: np.ndarray) -> np.ndarray:
        return np.stack([gain * (points[..., 0] - scene.low[0]), height - gain * (points[..., 1] - scene.low[1])], axis=-1)

    film = {
        "rate": rate,
        "trail": TRAIL,
        "contact": VERMILION,
        "free": SKY,
        "time": [f"t = {scene.scale.factor * t:.4g} {scene.scale.unit}" for t in scene.time.tolist()],
        "shapes": [_numbers(pixels(shape.points).reshape(len(scene.time), -1)) for shape in scene.shapes],
        "pins": _numbers(pixels(scene.pins).reshape(len(scene.time), -1)),
        "shown": scene.shown,
        "joints": [
            {**_magnified(joint), "place": _numbers(pixels(joint.place)), "aside": _numbers(aside)}
            for joint, aside in zip(scene.magnified, LETTERS / SMALL * scene.asides * (1.0, -1.0), strict=True)
        ],
    }
    # "<" in a name could end the script
    data = json.dumps(film, separators=(",", ":"), ensure_ascii=True).replace("<", "\\u003c")
    options = "".join(f"<option value={s}{' selected' if s == 1 else ''}>{s:g}×</option>" for s in SPEEDS)
    figures = "\n".join(_figure(joint) for joint in scene.magnified)
    turning = TURNING if len(scene.magnified) > scene.shown else ""
    return f"""<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width">
<title>scissordyn</title>
<style>{STYLE}</style>
</head>
<body>
<div class="stage">
<svg viewBox="0 0 {width:.1f} {height:.1f}" width="{width:.0f}" height="{height:.0f}" role="img" aria-label="the mechanism">
{_drawing(scene, gain, pixels(scene.supports))}
</svg>
<div class="joints">
{figures}
{turning}</div>
</div>
<div class="controls">
<button id="play" type="button">Play</button>
<input id="frame" type="range" min="0" max="{len(scene.time) - 1}" value="0" aria-label="frame">
<output id="clock"></output>
<label>speed <select id="speed">{options}</select></label>
</div>
<small>{_extent(scene)} At speed 1×: {time_scale_in_words(slower)}. Space plays, arrow keys step.</small>
<script type="application/json" id="film">{data}</script>
<script>{PLAYER}</script>
</body>
</html>
"""


def _extent(scene: Scene) -> str:
    """Width of the drawing, in words."""
    scale = engineering("m", float(scene.high[0] - scene.low[0]))
    return f"The drawing is {scale.factor * float(scene.high[0] - scene.low[0]):.3g} {scale.unit} wide."


def _drawing(scene: Scene, gain: float, supports: np.ndarray) -> str:
    """The artists of the structure; the player moves them."""
    lines = []
    for shape in scene.shapes:
        color = (BLUE, GREEN)[shape.tone]
        look = {"bar": f' stroke="{color}"', "plate": f' stroke="{color}" fill="{color}"'}.get(shape.kind, "")
        tag = "polygon" if shape.kind in ("block", "plate") else "polyline"
        lines.append(f'<{tag} data-shape class="{shape.kind}"{look}><title>{html.escape(shape.name)}</title></{tag}>')
    size = 0.025 * gain * float(np.max(scene.high - scene.low))
    for x, y in supports.tolist():
        lines.append(
            f'<polygon class="support" points="{x:.1f},{y:.1f} {x - size:.1f},{y + 1.6 * size:.1f} '
            f'{x + size:.1f},{y + 1.6 * size:.1f}"/>'
        )
    lines += ['<circle class="joint" r="4"/>'] * scene.pins.shape[1]
    lines += [f'<circle class="ring" r="9"><title>{html.escape(joint.name)}</title></circle>' for joint in scene.magnified]
    lines += [f'<text class="name">{html.escape(joint.name)}</text>' for joint in scene.magnified]
    return "\n".join(lines)


def _magnified(joint: ClearanceJoint | Channel) -> dict[str, Any]:
    """Data of a joint or a channel for the player; y points down on a screen."""
    screen = RADIUS * np.array([1.0, -1.0])
    if isinstance(joint, Channel):
        return {
            "block": _numbers((screen * joint.block).reshape(len(joint.block), -1)),
            "corners": joint.touching.astype(int).tolist(),
            "touched": joint.touching.any(axis=1).astype(int).tolist(),
            "force": [newtons(force) for force in joint.force.tolist()],
        }
    return {
        "journal": _numbers(screen * joint.journal),
        "path": _numbers((screen * joint.path).ravel()),
        "reached": joint.reached.tolist(),
        "touched": joint.touched.astype(int).tolist(),
        "force": [newtons(force) for force in joint.force.tolist()],
    }


def _figure(joint: ClearanceJoint | Channel) -> str:
    edge = math.ceil((1.05 * EDGE if isinstance(joint, Channel) else 1.5) * RADIUS)
    if isinstance(joint, Channel):
        long = EDGE * RADIUS
        drawn = "".join(
            f'<rect class="surface" x="{-long:g}" width="{2 * long:g}" height="{0.25 * RADIUS:g}" '
            f'y="{-RADIUS * max(height, height + 0.25 * face):g}"/>'
            for face, height in joint.surfaces.items()
        )
        drawn += f'<path class="guide" d="M{-long:g} 0H{long:g}"/><polygon class="journal"/>'
        drawn += '<circle class="corner" r="4"/>' * joint.block.shape[1]
    else:
        drawn = (
            f'<circle class="bearing" r="{(1.0 + GAP) * RADIUS:g}"/><circle class="journal" r="{RADIUS:g}"/>'
            '<polyline class="path"/><circle r="2"/>'
        )
    return (
        f'<figure><svg viewBox="{-edge} {-edge} {2 * edge} {2 * edge}" width="{2 * edge}" height="{2 * edge}">{drawn}</svg>'
        f'<figcaption>{html.escape(joint.name)}: <span class="state"></span><br>'
        f"<small>clearance magnified {joint.gain:.2g} times</small>"
        "</figcaption></figure>"
    )


def write_page(scene: Scene, path: Path, rate: int, slower: float) -> None:
    """Write the page of a film to a file.

    Parameters
    ----------
    scene : Scene
    path : Path
    rate : int
        Frames per second.
    slower : float
        Time scale: film time over simulated time.
    """
    path.write_text(page(scene, rate, slower), encoding="utf-8")
