"""The block of a clearance guide in its channel, with magnified clearance."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.patches import Polygon, Rectangle

from scissordyn.component.place import GROUND
from scissordyn.errors import InputError
from scissordyn.model.mechanism import Mechanism
from scissordyn.plot.style import BLACK, GREY, LIGHT, SKY, SMALL, VERMILION, literal

__all__ = ["GAP", "channel", "guides_of"]

GAP = 0.35
"""The clearance of a magnified joint as a fraction of the drawn journal's radius, or of half the drawn block's width."""

LONG = 1.3
"""Half the length of the drawn block."""


def guides_of(mechanism: Mechanism, names: Iterable[str]) -> list[str]:
    """Names of clearance joints with the contact points of each clearance guide replaced by the guide, once."""
    guide = {point.name: point.guide for point in mechanism.contact_points}
    return list(dict.fromkeys(guide.get(name, name) for name in names))


def channel(run: xr.Dataset, mechanism: Mechanism, sample: int, guide: str, *, axes: Axes) -> Axes:
    """A clearance guide at one sample, its line horizontal: the block between the guide surfaces, points in contact marked.

    Parameters
    ----------
    run : Dataset
    mechanism : Mechanism
    sample : int
        Index along "time".
    guide : str
    axes : Axes

    Returns
    -------
    Axes

    Raises
    ------
    InputError
        If the guide has no clearance.
    """
    described = mechanism.guide(guide)
    gap = described.clearance
    if gap is None:
        raise InputError(
            f"guide '{guide}' is ideal", "a clearance guide", f'mechanism.with_clearance("{guide}", GuideClearance(...))'
        )
    points = [point for point in mechanism.contact_points if point.guide == guide]
    now = run.isel(time=sample).sel(joint=[point.name for point in points])
    depth, touching = now["indentation"].values, now["in_contact"].values.astype(bool)
    follower = mechanism.body(described.follower[0])
    base = 0.0 if described.body == GROUND else mechanism.body(described.body).angle
    direction = base + described.direction - follower.angle
    x, y = (np.array([point.centre for point in points]) - np.array(follower.points[described.follower[1]])).T
    cos, sin = math.cos(direction), math.sin(direction)
    along, across = cos * x + sin * y, cos * y - sin * x
    side, distance = np.sign(across), np.array([point.distance for point in points])
    half = float(np.mean(distance)) - gap.clearance
    centred = np.abs(across) + gap.corner_radius  # extent of the outline with the block centred
    moved = depth + distance - centred
    surface = distance / half + (GAP / gap.clearance - 1.0 / half) * gap.clearance
    tips = np.stack([LONG * along / np.max(np.abs(along)), side * (centred / half + GAP * moved / gap.clearance)], axis=1)
    for face in (1.0, -1.0):
        at = face * float(surface[side == face][0])
        strip = Rectangle(
            (-1.7, min(at, at + 0.25 * face)), 3.4, 0.25, facecolor="white", edgecolor=GREY, hatch="//////", linewidth=0.0
        )
        axes.add_patch(strip)
        axes.plot([-1.7, 1.7], [at, at], color=BLACK, linewidth=1.2)
    order = np.argsort(np.arctan2(across, along))
    axes.add_patch(Polygon(tips[order], facecolor=LIGHT, edgecolor=VERMILION if touching.any() else SKY, linewidth=1.4))
    axes.plot(*tips[touching].T, linestyle="", marker="o", markersize=4.5, color=VERMILION)
    axes.plot([-1.7, 1.7], [0.0, 0.0], color=GREY, linewidth=0.7, linestyle=(0, (6, 2, 1, 2)))
    axes.set_aspect("equal", adjustable="box")
    axes.set(xlim=(-1.75, 1.75), ylim=(-1.75, 1.75), xticks=[], yticks=[])
    for spine in axes.spines.values():
        spine.set_visible(False)
    count = int(np.sum(touching))
    state = f"{count} corner{'s' * (count > 1)} in contact" if count else "free flight"
    gain = GAP * half / gap.clearance
    title = f"{literal(guide)}: {state}\nclearance magnified {gain:.2g} times"
    axes.set_title(title, fontsize=SMALL, color=BLACK)
    return axes
