"""Responses between the points of a study: interpolated field, requirement line, and where they are uncertain."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from scissordyn.plot.scale import Scale
from scissordyn.plot.style import BLACK, BLUE, GREY, LINE, ORANGE, VERMILION, literal, small

TWO_SIDED = 1.96
"""Standard deviations of a 95 % interval."""

VEIL = 0.75
"""Opacity of the veil where the interpolation knows no more than the mean of all points."""

COLOURS = (BLACK, VERMILION, BLUE, ORANGE, GREY)


@dataclass(frozen=True)
class Field:
    """A response over two numbers, in SI."""

    x: np.ndarray  # (n,)
    y: np.ndarray  # (n,)
    mean: np.ndarray  # (m, n)
    deviation: np.ndarray  # (m, n) Standard deviation of the prediction
    spread: float  # Standard deviation of the response over all points
    error: float  # Of points left out, as a fraction of the mean response


@dataclass(frozen=True)
class Bound:
    """A requirement on a response with a field."""

    label: str
    field: Field
    value: float  # In SI


def draw_field(axes: Axes, field: Field, scales: tuple[Scale, Scale, Scale], look: dict[str, Any]) -> Any:
    """The field in colour, paler where it is uncertain."""
    x, y = field.x * scales[0].factor, field.y * scales[1].factor
    drawn = axes.pcolormesh(x, y, field.mean * scales[2].factor, shading="nearest", zorder=0.5, **look)
    veil = VEIL * np.clip(field.deviation / max(field.spread, 1e-300), 0.0, 1.0)
    white = np.ones((*veil.shape, 4))
    white[..., 3] = veil
    axes.pcolormesh(x, y, white, shading="nearest", zorder=0.6, rasterized=True)
    return drawn


def draw_bounds(axes: Axes, bounds: Sequence[Bound], scales: tuple[Scale, Scale]) -> list[Line2D | Patch]:
    """Lines at which requirements are met, hatched where it is uncertain on which side of them a point is."""
    shown: list[Line2D | Patch] = []
    hatched = False
    for k, bound in enumerate(bounds):
        field, colour = bound.field, COLOURS[k % len(COLOURS)]
        x, y = field.x * scales[0].factor, field.y * scales[1].factor
        with np.errstate(divide="ignore", invalid="ignore"):
            away = np.abs(field.mean - bound.value) / (TWO_SIDED * field.deviation)
        if np.nanmin(away) < 1.0:
            axes.contourf(x, y, away, levels=[0.0, 1.0], colors="none", hatches=["////"], zorder=0.7)
            hatched = True
        if field.mean.min() < bound.value < field.mean.max():
            axes.contour(x, y, field.mean, levels=[bound.value], colors=[colour], linewidths=1.5 * LINE, zorder=1.5)
            shown.append(Line2D([], [], color=colour, linewidth=1.5 * LINE, label=literal(bound.label)))
    if hatched:
        shown.append(Patch(facecolor="none", edgecolor=GREY, hatch="////", label=literal("side of the line uncertain (95 %)")))
    return shown


def note_error(axes: Axes, error: float) -> None:
    """Say how well the field predicts points that it has not seen."""
    text = literal(f"kriging between the points: {error:.1%} error at points left out; pale is uncertain")
    axes.set_title(text, loc="left", fontsize=small())
