"""A film as one HTML file: the canvas of the explorer with its player, without other files or network access."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from scissordyn.plot.animation_scene import Scene, scale_in_words
from scissordyn.plot.canvas import CANVAS, packed
from scissordyn.plot.scale import engineering

if TYPE_CHECKING:
    import xarray as xr

PAGE = """<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width">
<title>scissordyn</title>
<style>
body {{ font: 15px/1.4 system-ui, sans-serif; margin: 1rem auto; max-width: 1100px; padding: 0 1rem }}
#film {{ height: min(78vh, 680px) }}
#film canvas:focus-visible {{ outline: 1px solid #ccc }}
small {{ color: #666 }}
</style>
</head>
<body>
<div id="film"></div>
<small>{about} Space plays, arrow keys step, the wheel zooms.</small>
<script type="application/json" id="scene">{scene}</script>
<script type="application/json" id="ghost">{ghost}</script>
<script type="module">
{canvas}
const place = document.getElementById("film"), heard = {{}};
const text = id => document.getElementById(id).textContent;
const values = {{ scene: text("scene"), ghost: text("ghost"), movable: false }};
render({{ el: place, model: {{
  get: name => values[name],
  set: (name, value) => {{ values[name] = value; (heard[`change:${{name}}`] || []).forEach(each => each()); }},
  on: (event, reaction) => (heard[event] = heard[event] || []).push(reaction),
  save_changes: () => {{}}, send: () => {{}},
}} }});
const canvas = place.querySelector("canvas");
canvas.focus();
// film.html#20 begins at frame 20
const frame = Math.floor(Number(location.hash.slice(1)));
if (frame > 0) place.querySelector(".sd-stage").frame(frame);
</script>
</body>
</html>
"""


def page(scene: Scene, run: xr.Dataset, seconds: float, *, ghost: str = "") -> str:
    wide = float(scene.high[0] - scene.low[0])
    scale = engineering("m", wide)
    slower = seconds / float(scene.time[-1] - scene.time[0])
    scale_text = scale_in_words(slower, scene.magnification)
    about = f"The drawing is {scale.factor * wide:.3g} {scale.unit} wide. At speed 1×: {scale_text}."
    # "<" in a name could end the script
    data, other = (text.replace("<", "\\u003c") for text in (packed(scene, run, seconds=seconds), ghost))
    return PAGE.format(about=about, scene=data, ghost=other, canvas=CANVAS.replace("export default { render };", ""))


def write_page(scene: Scene, run: xr.Dataset, path: Path, seconds: float) -> None:
    path.write_text(page(scene, run, seconds), encoding="utf-8")
