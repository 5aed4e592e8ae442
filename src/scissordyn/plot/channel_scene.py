"""A clearance guide in its channel, sample by sample, independent of how it is drawn."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from scissordyn.component.place import GROUND
from scissordyn.errors import InputError
from scissordyn.model.mechanism import Mechanism

if TYPE_CHECKING:
    import xarray as xr

GAP = 0.35
"""The clearance of a magnified joint as a fraction of the drawn journal's radius, or of half the drawn block's width."""

LONG = 1.3
"""Half the length of the drawn block."""

EDGE = 1.7
"""Half the length of the drawn channel."""


@dataclass(frozen=True)
class Channel:
    """The block of a clearance guide between the guide surfaces, its line horizontal, in drawn half widths of the block."""

    name: str  # Of the guide
    block: np.ndarray  # (samples, corners, 2) The corners around the block, with magnified clearance
    touching: np.ndarray  # (samples, corners) Which corners are in contact
    surfaces: dict[float, float]  # Heights of the guide surfaces by their sides, 1 and -1
    force: np.ndarray  # (samples,) Largest force of a corner [N]
    place: np.ndarray  # (samples, 2) Where the block is in the picture [m]; empty if not asked for
    gain: float  # Magnification of the clearance relative to that of the block
    corners: tuple[str, ...]  # Names of the contact points, as they stand around the block
    hollow: bool = False  # Whether the block surrounds the guide, as a ring does a pole


def guides_of(mechanism: Mechanism, names: Iterable[str]) -> list[str]:
    """Names of clearance joints with the contact points of each clearance guide replaced by the guide, once."""
    guide = {point.name: point.guide for point in mechanism.contact_points}
    return list(dict.fromkeys(guide.get(name, name) for name in names))


def channel_of(run: xr.Dataset, mechanism: Mechanism, samples: Any, guide: str, place: np.ndarray | None = None) -> Channel:
    """The channel of a guide at samples of a run.

    Shapes: `place` (samples, 2) [m].
    """
    described = mechanism.guide(guide)
    gap = described.clearance
    if gap is None:
        raise InputError(
            f"guide '{guide}' is ideal", "a clearance guide", f'mechanism.with_clearance("{guide}", GuideClearance(...))'
        )
    points = [point for point in mechanism.contact_points if point.guide == guide]
    now = run[["indentation", "in_contact", "reaction"]].isel(time=samples).sel(joint=[point.name for point in points])
    now = now.transpose("time", "joint", "axis", missing_dims="ignore")
    follower = mechanism.body(described.follower[0])
    base = 0.0 if described.body == GROUND else mechanism.body(described.body).placed_angle
    direction = base + described.direction - follower.placed_angle
    x, y = (np.array([point.centre for point in points]) - np.array(follower.points[described.follower[1]])).T
    cos, sin = math.cos(direction), math.sin(direction)
    along, across = cos * x + sin * y, cos * y - sin * x
    side, distance = np.sign(across), np.array([point.distance for point in points])
    inside = -1.0 if gap.around else 1.0  # where a surface is, seen from the corner that faces it
    half = abs(float(np.mean(distance)) - gap.clearance)
    centred = inside * np.abs(across) + gap.corner_radius  # extent of the outline towards the surface with the block centred
    moved = now["indentation"].values + distance - centred
    surface = distance / half + (GAP / gap.clearance - 1.0 / half) * gap.clearance
    heights = inside * side * (centred / half + GAP * moved / gap.clearance)
    tips = np.stack([np.broadcast_to(LONG * along / np.max(np.abs(along)), heights.shape), heights], axis=-1)
    around = np.argsort(np.arctan2(across, along))
    return Channel(
        guide,
        tips[:, around],
        now["in_contact"].values.astype(bool)[:, around],
        {face: face * float(surface[inside * side == face][0]) for face in (1.0, -1.0)},
        np.linalg.norm(now["reaction"].values, axis=2).max(axis=1),
        np.empty((0, 2)) if place is None else place,
        GAP * half / gap.clearance,
        tuple(points[k].name for k in around),
        gap.around,
    )
