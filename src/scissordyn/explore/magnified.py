"""The drawing of a run whose bars bend with larger deflections, made in a thread as it takes seconds."""

from __future__ import annotations

import logging
import math
import threading
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from scissordyn.errors import InputError, ScissordynError
from scissordyn.plan.bending import bends

if TYPE_CHECKING:
    import xarray as xr

    from scissordyn.explore.worker import Outcome
    from scissordyn.model.mechanism import Mechanism

AUTO = "auto"

LARGEST = 1e6

SHARE = 0.05
"""The largest deflection, magnified, is at most this part of the size of the mechanism."""

FRAMES = 61
"""Of a drawing with magnified deflections: each needs the mechanism assembled with straight bars."""

STEPS = (1.0, 2.0, 5.0)

log = logging.getLogger(__name__)


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


class Larger:
    """The scene of the newest run with magnified deflections, one at a time."""

    def __init__(self, done: Callable[[str], None]) -> None:
        self.wanted: float | str = 1.0
        self._done = done
        self._made: tuple[Outcome, float, str] | None = None
        self._busy = False

    def factor(self, shown: Outcome) -> float:
        """The magnification of a run; runs that precede another have none."""
        if shown.run is None or shown.note or self.wanted == 1.0:
            return 1.0
        return factor_of(self.wanted, shown.run, shown.case.mechanism)

    def scene(self, shown: Outcome) -> str:
        """The scene of a run, "" if there is none yet, which is being made then, or if nothing is to be magnified."""
        factor = self.factor(shown)
        if factor == 1.0:
            return ""
        if self._made is not None and self._made[0] is shown and self._made[1] == factor:
            return self._made[2]
        if not self._busy:  # else it is asked for once more when the one before is there
            self._busy = True
            threading.Thread(target=self._make, args=(shown, factor), name="scissordyn magnifies", daemon=True).start()
        return ""

    def _make(self, shown: Outcome, factor: float) -> None:
        said = ""
        try:
            self._made = shown, factor, _scene(shown, factor)
        except ScissordynError as error:
            said = str(error)
        except Exception as error:
            log.exception("deflections cannot be magnified")
            said = f"deflections cannot be magnified: {type(error).__name__}"
        finally:
            self._busy = False
        if said:
            self.wanted = 1.0
        self._done(said)


def _scene(shown: Outcome, factor: float) -> str:
    from scissordyn.plot.canvas import packed_scene
    from scissordyn.run.advance.spacing import spread_samples
    from scissordyn.run.answer.deflection import magnified_deflection

    run, mechanism = shown.run, shown.case.mechanism
    assert run is not None
    frames = min(run.sizes["time"], FRAMES)
    samples = spread_samples(run["time"].values, frames).tolist()
    larger = magnified_deflection(run, mechanism, factor, samples=samples)
    return packed_scene(larger, mechanism, number=shown.number, frames=frames)
