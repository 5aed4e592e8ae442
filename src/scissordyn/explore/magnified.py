"""The drawing of a run whose bars bend with larger deflections."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from scissordyn.errors import InputError
from scissordyn.plan.bending import bends

if TYPE_CHECKING:
    import xarray as xr

    from scissordyn.model.mechanism import Mechanism

AUTO = "auto"

LARGEST = 1e6

SHARE = 0.05  # The largest deflection, magnified, is at most this part of the size of the mechanism
FRAMES = 61  # Of a drawing with magnified deflections: each needs the mechanism assembled with straight bars

STEPS = (1.0, 2.0, 5.0)


def wish(given: Any) -> float | str:
    """A magnification as the page asks for it: "auto", or a number."""
    if given == AUTO:
        return AUTO
    if isinstance(given, bool) or not isinstance(given, int | float) or not 1.0 <= given <= LARGEST:
        raise InputError("magnification of deflections", f"'{AUTO}', 1 to {LARGEST:g}", AUTO)
    return float(given)


def factor_of(wanted: float | str, run: xr.Dataset, mechanism: Mechanism) -> float:
    """How many times deflections are drawn as large as they are; 1 without bars that bend."""
    if not bends(mechanism):
        return 1.0
    if isinstance(wanted, float):
        return wanted
    largest = float(abs(run["bar_largest_deflection"]).max()) if "bar_largest_deflection" in run else 0.0
    room = SHARE * mechanism.size / largest if largest > 0.0 else 1.0
    if not 1.0 < room < LARGEST:
        return LARGEST if room >= LARGEST else 1.0
    power = 10.0 ** math.floor(math.log10(room))
    return float(max(step * power for step in STEPS if step * power <= room * (1.0 + 1e-12)))


def magnified_scene(run: xr.Dataset, mechanism: Mechanism, factor: float, number: int) -> str:
    """The scene of a run with larger deflections, which takes seconds."""
    from scissordyn.plot.canvas import packed_scene
    from scissordyn.run.advance.instants import spread_samples
    from scissordyn.run.answer.deflection import magnified_deflection

    frames = min(run.sizes["time"], FRAMES)
    samples = spread_samples(run["time"].values, frames).tolist()
    larger = magnified_deflection(run, mechanism, factor, samples=samples)
    return packed_scene(larger, mechanism, number=number, frames=frames)
