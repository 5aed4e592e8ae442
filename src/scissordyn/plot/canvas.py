"""Write the scene of a film for the canvas of a browser: as JSON with base64 arrays, or as a page with a player."""

from __future__ import annotations

import base64
import json
from dataclasses import dataclass, field
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from scissordyn.errors import InputError
from scissordyn.model.mechanism import Mechanism
from scissordyn.plot.animation_scene import Channel, Scene, scale_in_words, scene_of
from scissordyn.plot.bar_diagram import DIAGRAM_MAP, QUANTITIES, Diagram
from scissordyn.plot.scale import engineering
from scissordyn.plot.series import clearance_pins, largest_forces, mechanism_of, predictability_horizon
from scissordyn.plot.style import SIZES
from scissordyn.record.results import Results, Run, described, labels
from scissordyn.record.sampling import spread_samples
from scissordyn.units import checked

if TYPE_CHECKING:
    import xarray as xr

# Names of the JavaScript files that `CANVAS_SCRIPT` consists of
SCRIPT_FILES = ("scene.js", "ruler.js", "diagram.js", "canvas.js")

CANVAS_SCRIPT = "".join((Path(__file__).parent / "assets" / part).read_text(encoding="utf-8") for part in SCRIPT_FILES)
"""JavaScript module that draws a scene, for the explorer, notebooks and films."""


def run_scene(run: Run, mechanism: Mechanism, frames: int = SIZES.frames_max) -> Scene:
    """Return the scene of a run in which everything with a clearance is magnified."""
    chosen = spread_samples(run["time"].values, min(run.sizes["time"], frames))
    loose = [guide.name for guide in mechanism.guides if guide.clearance is not None]
    return scene_of(run, mechanism, chosen, clearance_pins(run), guides=loose)


def pack_run(run: Run, mechanism: Mechanism, *, number: int = 0, note: str = "", frames: int = SIZES.frames_max) -> str:
    """Return the scene of a run, with at most `frames` samples, as JSON for the canvas of a browser."""
    return pack_scene(run_scene(run, mechanism, frames), run, number=number, note=note)


def pack_scene(scene: Scene, run: Run, *, number: int = 0, note: str = "", seconds: float = SIZES.film_duration) -> str:
    """Return a scene as JSON for the canvas of a browser; it plays in `seconds`."""
    most_names = 6  # with more joints only the chosen one shows its name, above it, as in canvas.js
    largest = largest_forces(run) if scene.channels else {}
    named = len(scene.channels if len(scene.clearance_joints) > most_names else scene.magnified)
    data = {
        "run": number,
        "note": note,
        "seconds": seconds,
        "time": scene.time,
        "timeScale": scene.scale.factor,
        "timeUnit": scene.scale.unit,
        "low": scene.low.tolist(),
        "high": scene.high.tolist(),
        "horizon": predictability_horizon(run),
        "shapes": [
            {
                **_fields_of(shape, "name", "kind", "tone", "parts"),
                "count": shape.points.shape[1],
                "points": np.broadcast_to(shape.points, (len(scene.time), *shape.points.shape[1:])),
            }
            for shape in scene.shapes
        ],
        "pins": {"names": list(scene.pin_names), "points": scene.pins},
        "supports": scene.supports.tolist(),
        "joints": [
            _fields_of(joint, "name", "gain", "place", "journal", "touched", "force") for joint in scene.clearance_joints
        ],
        # a click on a channel shows the curves of the corner with the largest force
        "channels": [_channel(channel, max(channel.corners, key=largest.__getitem__)) for channel in scene.channels],
        "asides": np.round(scene.name_offsets(named), 1).tolist(),
        "magnification": scene.magnification,
        "diagrams": [_diagram(diagram) for diagram in scene.diagrams],
        "onBars": scene.on_bars,
        "tracks": [{"name": name, "points": points} for name, points in scene.tracks],
    }
    return json.dumps(data, separators=(",", ":"), default=_encode_array)


def declared_positions(mechanism: Mechanism) -> Results:
    """Return a run with the bodies at their declared start, at two equal instants; no constraint is solved."""
    bodies = mechanism.bodies
    angle, origin, centre = (
        np.array([getattr(body, name) for body in bodies]) for name in ("placed_angle", "placed_position", "centre")
    )
    cos, sin = np.cos(angle), np.sin(angle)
    across = np.stack([cos * centre[:, 0] - sin * centre[:, 1], sin * centre[:, 0] + cos * centre[:, 1]], axis=1)
    return Results(
        {
            "time": described("time", np.zeros(2), "s", "time"),
            "body": labels("body", [body.name for body in bodies]),
            "position": described(("time", "body", "axis"), np.repeat((origin + across)[None], 2, axis=0), "m", "position"),
            "angle": described(("time", "body"), np.repeat(angle[None], 2, axis=0), "rad", "angle"),
        },
        {},
    )


def declared_scene(mechanism: Mechanism) -> str:
    """Return the scene of a mechanism at its declared position, with ideal joints, as JSON; nothing is computed for it."""
    ideal = mechanism.ideal()
    return pack_run(declared_positions(ideal), ideal, note="as declared; its motion follows")


def _encode_array(values: np.ndarray) -> str:
    """Return an array in base64: numbers as 32-bit floats, booleans as bytes."""
    kind = np.uint8 if values.dtype == bool else np.float32
    return base64.b64encode(np.ascontiguousarray(values, dtype=kind).tobytes()).decode()


def _fields_of(part: object, *names: str) -> dict[str, Any]:
    return {name: getattr(part, name) for name in names}


def _diagram(diagram: Diagram) -> dict[str, Any]:
    from matplotlib import colormaps
    from matplotlib.colors import to_hex

    tone, colours = QUANTITIES[diagram.quantity].tone, colormaps[DIAGRAM_MAP]
    return {
        "quantity": diagram.quantity,
        "label": diagram.label,
        "largest": diagram.largest,
        "factor": diagram.scale.factor,
        "ordinate": SIZES.ordinate_length if tone else 0.0,
        "ramp": [to_hex(colours(part)) for part in np.linspace(0.0, 1.0, 32)] if diagram.coloured else [tone],
        "values": diagram.values,
    }


def _channel(channel: Channel, joint: str) -> dict[str, Any]:
    return {
        **_fields_of(channel, "name", "gain", "hollow", "place", "block", "touching", "force"),
        "joint": joint,
        "edge": SIZES.channel_half_length,
        "surfaces": list(channel.surfaces.items()),
        "count": channel.block.shape[1],
    }


# HTML template of a film with its player; `page` fills it
PAGE = """<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width">
<title>{title}</title>
<style>
body {{ font: 15px/1.4 system-ui, sans-serif; margin: 1rem auto; max-width: 1100px; padding: 0 1rem }}
h1 {{ font-size: 17px; margin: 0 0 0.5rem }}
#film {{ height: min(78vh, 680px) }}
#film canvas:focus-visible {{ outline: 1px solid #ccc }}
small {{ color: #666 }}
</style>
</head>
<body>
<h1>{title}</h1>
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
const framed = window !== window.parent;
document.querySelector("h1").hidden = framed;  // the page around a frame has its own title
if (!framed) canvas.focus();  // in a frame it would scroll the page around it
// film.html#20 begins at frame 20
const frame = Math.floor(Number(location.hash.slice(1)));
if (frame > 0) place.querySelector(".sd-stage").frame(frame);
</script>
</body>
</html>
"""


def page(scene: Scene, run: Run, seconds: float, *, title: str = "Motion", ghost: str = "") -> str:
    """Return a film as a self-contained page with a player."""
    wide = float(scene.high[0] - scene.low[0])
    scale = engineering("m", wide)
    slower = seconds / float(scene.time[-1] - scene.time[0])
    scale_text = scale_in_words(slower, scene.magnification)
    about = f"The drawing is {scale.factor * wide:.3g} {scale.unit} wide. At speed 1×: {scale_text}."
    # a "<" in a name could end the script
    data, other = (text.replace("<", "\\u003c") for text in (pack_scene(scene, run, seconds=seconds), ghost))
    return PAGE.format(
        title=escape(title),
        about=about,
        scene=data,
        ghost=other,
        canvas=CANVAS_SCRIPT.replace("export default { render };", ""),
    )


@dataclass(frozen=True)
class View:
    """Film that a notebook displays.

    Parameters
    ----------
    html : str
        HTML page of the film.
    """

    html: str = field(repr=False)

    def _repr_html_(self) -> str:
        height = 520  # height of the frame [pixel]
        # an iframe separates the styles and scripts of page and notebook
        return f'<iframe srcdoc="{escape(self.html)}" style="width: 100%; height: {height}px; border: 0"></iframe>'


@checked
def view(run: xr.Dataset, *, ghost: xr.Dataset | None = None) -> View:
    """Return the motion of a run as a film for a notebook, with its clearance joints magnified.

    Parameters
    ----------
    run : Dataset
    ghost : Dataset, optional
        Another run, drawn dashed at the same times.

    Returns
    -------
    View
        Displayed by Jupyter, marimo and other notebooks that show HTML. `html` is a self-contained page.

    Raises
    ------
    InputError
        If a run has fewer than two samples.
    """
    if any(shown.sizes.get("time", 0) < 2 for shown in (run, ghost) if shown is not None):
        raise InputError("the run has fewer than two samples", "a run with two samples or more", "samples=200")
    other = "" if ghost is None else pack_run(ghost, mechanism_of(ghost))
    return View(page(run_scene(run, mechanism_of(run)), run, SIZES.film_duration, ghost=other))
