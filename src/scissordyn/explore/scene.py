"""A run as data for the canvas: JSON, with arrays as 32-bit floats in base64."""

from __future__ import annotations

import base64
import json
from typing import Any

import numpy as np
import xarray as xr

from scissordyn.model.mechanism import Mechanism
from scissordyn.plot.animation_scene import ClearanceJoint, Scene, scene_of
from scissordyn.plot.channel_scene import EDGE, Channel
from scissordyn.plot.place import upright
from scissordyn.plot.series import clearance_pins, largest_forces, predictability_horizon
from scissordyn.run.placement import Placement

__all__ = ["FRAMES", "packed_scene"]

FRAMES = 500
"""Most frames of an animation; between two of them contacts and largest forces are kept."""


def packed_scene(run: xr.Dataset, mechanism: Mechanism, *, number: int = 0, note: str = "", frames: int = FRAMES) -> str:
    """The scene of a run for the canvas.

    Parameters
    ----------
    run : Dataset
        With two samples or more.
    mechanism : Mechanism
        The one that was run.
    number : int
        Of the run in its session.
    note : str
        A line below the drawing.
    frames : int
        Most frames.

    Returns
    -------
    str
        JSON.
    """
    samples = run.sizes["time"]
    chosen = np.unique(np.linspace(0, samples - 1, min(samples, frames)).round().astype(int))
    pins = clearance_pins(run)
    loose = [guide.name for guide in mechanism.guides if guide.clearance is not None]
    scene = scene_of(run, mechanism, chosen, pins, guides=loose)
    placement = Placement.at(mechanism, run, chosen, turns=upright(mechanism))
    data = {
        "run": number,
        "note": note,
        "time": _packed(scene.time),
        "timeScale": scene.scale.factor,
        "timeUnit": scene.scale.unit,
        "low": scene.low.tolist(),
        "high": scene.high.tolist(),
        "horizon": predictability_horizon(run),
        "shapes": [
            {
                "name": shape.name,
                "kind": shape.kind,
                "tone": shape.tone,
                "count": shape.points.shape[1],
                "points": _packed(_all(shape.points, scene)),
            }
            for shape in scene.shapes
        ],
        "pins": {"names": [joint.name for joint in mechanism.ideal_joints], "points": _packed(scene.pins)},
        "supports": scene.supports.tolist(),
        "joints": [_joint(joint) for joint in scene.clearance_joints],
        "channels": [_channel(channel, run, mechanism) for channel in scene.channels],
        "asides": scene.asides.tolist(),
        "tracks": [
            {"name": track.name, "points": _packed(_tracked(mechanism, placement, track))} for track in mechanism.tracks
        ],
    }
    return json.dumps(data, separators=(",", ":"))


def _packed(values: np.ndarray, kind: type = np.float32) -> str:
    return base64.b64encode(np.ascontiguousarray(values, dtype=kind).tobytes()).decode()


def _all(points: np.ndarray, scene: Scene) -> np.ndarray:
    """Points at every frame; what does not move may be there once."""
    return np.broadcast_to(points, (len(scene.time), *points.shape[1:]))


def _joint(joint: ClearanceJoint) -> dict[str, Any]:
    return {
        "name": joint.name,
        "gain": joint.gain,
        "place": _packed(joint.place),
        "journal": _packed(joint.journal),
        "touched": _packed(joint.touched, np.uint8),
        "force": _packed(joint.force),
    }


def _channel(channel: Channel, run: xr.Dataset, mechanism: Mechanism) -> dict[str, Any]:
    largest = largest_forces(run)
    corners = [point.name for point in mechanism.contact_points if point.guide == channel.name]
    return {
        "name": channel.name,
        "joint": max(corners, key=lambda name: largest[name]),  # whose curves a click shows
        "gain": channel.gain,
        "edge": EDGE,
        "surfaces": [[side, height] for side, height in channel.surfaces.items()],
        "count": channel.block.shape[1],
        "place": _packed(channel.place),
        "block": _packed(channel.block),
        "touching": _packed(channel.touching, np.uint8),
        "force": _packed(channel.force),
    }


def _tracked(mechanism: Mechanism, placement: Placement, track: Any) -> np.ndarray:
    point = mechanism.body(track.body).points[track.point] if isinstance(track.point, str) else track.point
    return placement.points(track.body, np.array([point], float))[:, 0]
