"""Picture of the page on measured pendula."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from scissordyn.plot.file import write
from scissordyn.plot.style import BLUE, GREY, LINE_WIDTH, VERMILION, dress, legend, small
from validation.measured.chains import Comparison

__all__ = ["draw"]


def draw(path: Path, chains: Sequence[Comparison], rest: Mapping[str, xr.Dataset]) -> Path:
    """Draw errors of prediction of the chains over time, and the decay of the single pendulum with two laws.

    Parameters
    ----------
    path : Path
    chains : sequence of Comparison
    rest : mapping of str to Dataset
        Fits by law.
    """
    figure = Figure(figsize=(9.0, 5.2), layout="constrained")
    upper = figure.subplots(2, 2, height_ratios=[1.0, 1.2])
    for axes, chain in zip(upper[0], chains, strict=True):
        axes.plot(chain.elapsed, np.degrees(chain.ours_error), color=BLUE, linewidth=LINE_WIDTH, label="fitted here")
        axes.plot(
            chain.elapsed,
            np.degrees(chain.their_error),
            color=VERMILION,
            linewidth=LINE_WIDTH,
            linestyle="--",
            label="the authors'",
        )
        axes.axvspan(0.0, 0.1 * float(chain.elapsed[-1]), color=GREY, alpha=0.2, linewidth=0.0)
        axes.set_ylim(0.0)
        axes.set_xlabel("time since the start of a piece [s]")
        axes.set_ylabel("rms error of angles [deg]", fontsize=small())
        axes.set_title({2: "double pendulum, pieces not fitted", 3: "triple pendulum, pieces not fitted"}[chain.arms])
        dress(axes)
    legend([upper[0][0]], above=False)
    grid = upper[1][0].get_gridspec()
    for axes in upper[1]:
        axes.remove()
    below = figure.add_subplot(grid[1, :])
    first = next(iter(rest.values()))
    below.plot(first["time"], np.degrees(first["measured"].values[:, 0]), ".", color=GREY, markersize=2.5, label="measured")
    for (law, fit), color in zip(rest.items(), (VERMILION, BLUE), strict=True):
        rms = 1e3 * float(fit["rms"][0])
        label = f"{law} friction, rms {rms:.2g} mrad"
        below.plot(fit["time"], np.degrees(fit["fitted"].values[:, 0]), color=color, linewidth=LINE_WIDTH, label=label)
    below.set_xlabel("time [s]")
    below.set_ylabel("angle [deg]", fontsize=small())
    below.set_title("single pendulum, decay to rest")
    dress(below)
    below.legend(loc="upper right", frameon=False, fontsize=small())
    return write(figure, path)
