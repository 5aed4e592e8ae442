"""``scissordyn check --converge``: which tolerance, step or number of modes a number of the run needs."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

from scissordyn.errors import command

if TYPE_CHECKING:
    from scissordyn.study.compute.convergence import Convergence


def converged_lines(found: Convergence, case: str, changed: Sequence[str] = ()) -> list[str]:
    """What was found, a line each."""
    import xarray as xr

    from scissordyn.plot.scale import scale_of

    scale = scale_of(xr.DataArray(found.value, attrs={"units": found.units}))
    what = {"step": "steps", "modes": "numbers of bending modes"}.get(found.varied, "rtol = atol")
    lines = [f"{found.response} to within {100.0 * found.within:g} %, with {what} from coarse to fine:"]
    for level in found.levels:
        if level.cause:
            lines.append(f"  {_setting(found, level.setting)}  failed: {level.cause}")
        else:
            said = f"members differ by {level.spread:.2%}, {level.seconds:.3g} s a run"
            lines.append(f"  {_setting(found, level.setting)}  {scale.said(level.value, 5)}, {said}")
    if math.isnan(found.setting):
        last = _setting(found, found.levels[-1].setting)
        lines.append(f"None {'up' if found.varied == 'modes' else 'down'} to {last} agrees with the two that follow it.")
        return lines
    lines.append(f"{_setting(found, found.setting)} is enough: the next two agree with it.")
    if found.chaotic:
        lines.append(
            "The motion is chaotic: starts that differ by round-off give numbers that differ by more than that at any "
            f"{found.varied}. Agreement is that of means; a study with members gives the distribution."
        )
    if found.varied == "modes":
        lines.append(f"To run it so: modes = {found.setting:.0f} in [[bending]] of {case}.")
        return lines
    settings = [f"run.{name}={_setting(found, found.setting)}" for name in found.options]
    changes = [part for change in (*changed, *settings) for part in ("--set", change)]
    lines.append(f"To run it so: {command('scissordyn', 'run', case, *changes)}")
    return lines


def _setting(found: Convergence, value: float) -> str:
    """A tolerance or a step, as it is typed."""
    from scissordyn.units import short

    return short(value, "s") if found.varied == "step" else f"{value:g}"


def plain(found: Convergence) -> dict[str, object]:
    """The same for JSON."""
    return {
        "response": found.response,
        "units": found.units,
        "within": found.within,
        "varied": found.varied,
        "setting": None if math.isnan(found.setting) else found.setting,
        "chaotic": found.chaotic,
        "levels": [
            {
                "setting": level.setting,
                "value": None if level.cause else level.value,
                "spread": None if level.cause else level.spread,
                "seconds": level.seconds,
                "cause": level.cause,
            }
            for level in found.levels
        ],
    }
