"""``scissordyn check --converge``: which tolerance a number of the run needs."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from scissordyn.errors import command

if TYPE_CHECKING:
    from scissordyn.study.convergence import Convergence

__all__ = ["converged_lines", "plain"]


def converged_lines(found: Convergence, case: str) -> list[str]:
    """What was found, a line each.

    Parameters
    ----------
    found : Convergence
    case : str
        The case file, for the command that runs it so.
    """
    import xarray as xr

    from scissordyn.plot.scale import scale_of

    scale = scale_of(xr.DataArray(found.value, attrs={"units": found.units}))
    lines = [f"{found.response} to within {100.0 * found.within:g} %, with rtol = atol from coarse to fine:"]
    for level in found.levels:
        if level.cause:
            lines.append(f"  {level.tolerance:.0e}  failed: {level.cause}")
        else:
            said = f"members differ by {level.spread:.2%}, {level.seconds:.3g} s a run"
            lines.append(f"  {level.tolerance:.0e}  {scale.said(level.value, 5)}, {said}")
    if math.isnan(found.tolerance):
        lines.append(f"No tolerance down to {found.levels[-1].tolerance:.0e} agrees with the two that follow it.")
        return lines
    lines.append(f"{found.tolerance:.0e} is enough: the next two agree with it.")
    if found.chaotic:
        lines.append(
            "The motion is chaotic: starts that differ by round-off give numbers that differ by more than that at any "
            "tolerance. Agreement is that of means; a study with members gives the distribution."
        )
    changes = [f"run.rtol={found.tolerance:g}", f"run.atol={found.tolerance:g}"]
    lines.append(f"To run it so: {command('scissordyn', 'run', case, '--set', changes[0], '--set', changes[1])}")
    return lines


def plain(found: Convergence) -> dict[str, object]:
    """The same for JSON."""
    return {
        "response": found.response,
        "units": found.units,
        "within": found.within,
        "tolerance": None if math.isnan(found.tolerance) else found.tolerance,
        "chaotic": found.chaotic,
        "levels": [
            {
                "tolerance": level.tolerance,
                "value": None if level.cause else level.value,
                "spread": None if level.cause else level.spread,
                "seconds": level.seconds,
                "cause": level.cause,
            }
            for level in found.levels
        ],
    }
