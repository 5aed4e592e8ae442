"""The block of a clearance guide in its channel, with magnified clearance."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

from matplotlib.axes import Axes
from matplotlib.patches import Polygon, Rectangle

from scissordyn.model.mechanism import Mechanism
from scissordyn.plot.channel_scene import EDGE, Channel, channel_of
from scissordyn.plot.style import BLACK, GREY, LIGHT, SKY, VERMILION, literal, small

if TYPE_CHECKING:
    import xarray as xr


def guides_of(mechanism: Mechanism, names: Iterable[str]) -> list[str]:
    """Names of clearance joints with the contact points of each clearance guide replaced by the guide, once."""
    guide = {point.name: point.guide for point in mechanism.contact_points}
    return list(dict.fromkeys(guide.get(name, name) for name in names))


def channel(run: xr.Dataset, mechanism: Mechanism, sample: int, guide: str, *, axes: Axes) -> Axes:
    """A clearance guide at one sample, its line horizontal: the block between the guide surfaces, points in contact marked."""
    view = channel_of(run, mechanism, [sample], guide)
    touching = view.touching[0]
    surfaces(axes, view)
    axes.add_patch(
        Polygon(
            view.block[0],
            facecolor="none" if view.hollow else LIGHT,
            edgecolor=VERMILION if touching.any() else SKY,
            linewidth=1.4,
        )
    )
    axes.plot(*view.block[0][touching].T, linestyle="", marker="o", markersize=4.5, color=VERMILION)
    count = int(touching.sum())
    state = f"{count} corner{'s' * (count > 1)} in contact" if count else "free flight"
    title = f"{literal(guide)}: {state}\nclearance magnified {view.gain:.2g} times"
    axes.set_title(title, fontsize=small(), color=BLACK)
    return axes


def surfaces(axes: Axes, view: Channel) -> None:
    """Draw the guide surfaces and the line of a channel, and fit the axes to them."""
    for face, height in view.surfaces.items():
        low = min(height, height + 0.25 * face)
        strip = Rectangle((-EDGE, low), 2.0 * EDGE, 0.25, facecolor="white", edgecolor=GREY, hatch="//////", linewidth=0.0)
        axes.add_patch(strip)
        axes.plot([-EDGE, EDGE], [height, height], color=BLACK, linewidth=1.2)
    axes.plot([-EDGE, EDGE], [0.0, 0.0], color=GREY, linewidth=0.7, linestyle=(0, (6, 2, 1, 2)))
    axes.set_aspect("equal", adjustable="box")
    axes.set(xlim=(-1.75, 1.75), ylim=(-1.75, 1.75), xticks=[], yticks=[])
    for spine in axes.spines.values():
        spine.set_visible(False)
