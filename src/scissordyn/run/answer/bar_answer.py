"""What bars that bend carry at most in a run: stress, bending moment, deflection, and compression against buckling."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from scissordyn.errors import printable
from scissordyn.run.answer.words import Words
from scissordyn.run.results import Run
from scissordyn.units import short


@dataclass(frozen=True)
class BarAnswer(Words):
    """The bar that bends which carries most."""

    bar: str  # The one with the largest utilisation; without a material that with the largest bending moment
    moment: float  # Its largest bending moment [N m]
    stress: float  # Its largest stress [Pa]; NaN without a material
    utilisation: float  # That over the yield strength; NaN if that is not known
    when: float  # Instant of it [s]
    place: float  # Distance of it from the bar's first end [m]
    deflection: float  # The largest deflection of any bar [m], and of which one
    deflected: str
    # The least factor of the axial forces of all bars at which the mechanism buckles, its drives locked; NaN without
    # compression
    buckling: float
    buckled: str  # Which bar takes part in that and is compressed; empty without one

    def __str__(self) -> str:
        has_material = math.isfinite(self.stress)
        what = (
            f"largest stress {short(self.stress, 'Pa')}"
            if has_material
            else f"largest bending moment {short(self.moment, 'N m')}"
        )
        text = f"Bars: {what} in {printable(self.bar)}, {short(self.place, 'm')} from its end, at {short(self.when, 's')}"
        if math.isfinite(self.utilisation):
            text += f", {self.utilisation:.3g} of its yield strength"
        text += f"; largest deflection {short(self.deflection, 'm')} ({printable(self.deflected)})"
        if math.isfinite(self.buckling):
            text += f"; buckles, drives locked, at {self.buckling:.3g} times its axial forces ({printable(self.buckled)})"
        return f"{text}."


def bar_answer(run: Run) -> BarAnswer | None:
    """The bar that carries most, or None if no bar bends or there are no samples."""
    if "bar_largest_buckling_ratio" not in run or not run.sizes["bar"]:
        return None
    names = run["bar"].values.astype(str).tolist()
    size = {
        name: np.abs(run[f"bar_largest_{name}"].values) for name in ("stress", "utilisation", "bending_moment", "deflection")
    }
    by = next((name for name in ("utilisation", "stress") if size[name].any()), "bending_moment")
    most, bent = int(np.argmax(size[by])), int(np.argmax(size["deflection"]))
    ratio = run["bar_largest_buckling_ratio"].values
    pressed = int(np.argmax(ratio))
    return BarAnswer(
        bar=names[most],
        moment=float(size["bending_moment"][most]),
        stress=float(size["stress"][most]) if size["stress"].any() else math.nan,
        utilisation=float(size["utilisation"][most]) if by == "utilisation" else math.nan,
        when=float(run[f"bar_largest_{by}_time"].values[most]),
        place=float(run[f"bar_largest_{by}_place"].values[most]),
        deflection=float(size["deflection"][bent]),
        deflected=names[bent],
        buckling=1.0 / float(ratio[pressed]) if ratio[pressed] > 0.0 else math.nan,
        buckled=names[pressed] if ratio[pressed] > 0.0 else "",
    )
