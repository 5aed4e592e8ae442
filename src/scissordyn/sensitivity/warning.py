"""Warnings about derivatives: errors, limits, other parts with nearly the same value, and derivatives of one side."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from scissordyn.sensitivity.limit import LIMIT_REASONS
from scissordyn.tolerance import DATA_TOL
from scissordyn.units import counted

if TYPE_CHECKING:
    import xarray as xr


def gradient_warnings(found: xr.Dataset, change: float, rough: float, one_sided: Mapping[str, tuple[str, str]]) -> list[str]:
    """Return the warnings about the derivatives in a Dataset of `sensitivity.gradient`.

    `rough` is the estimated relative error of derivatives of integrals. `one_sided` has the values for which derivatives hold,
    and the reason, by the parameter's path.
    """
    warnings = _one_sided_warnings(one_sided)
    if rough > DATA_TOL:
        warnings.append(
            f"derivatives of works, losses and other integrals have errors of about {rough:.1g} of their size, "
            "because forces change too often within a step"
        )
    for path, limit, time in zip(
        found["parameter"].values.tolist(), found["limit"].values.tolist(), found["valid_until"].values.tolist(), strict=True
    ):
        if limit == "horizon":
            warnings.append(
                f"'{path}': from t = {time:.6g} s on, a run at another tolerance or step diverges: "
                "the derivatives may be those of this computed trajectory only"
            )
        elif limit:
            warnings.append(
                f"'{path}': from t = {time:.6g} s on, a change of {100.0 * change:g} % {LIMIT_REASONS[limit]}: "
                "the derivatives are valid only for smaller changes"
            )
    for name, flags in zip(found["measure"].values.tolist(), found["smooth"].values, strict=True):
        if not np.all(flags):
            warnings.append(f"'{name}': another part, contact or instant has nearly the same value, with another derivative")
    for name, slopes in zip(found["measure"].values.tolist(), found["derivative"].values, strict=True):
        if unknown := int(np.isnan(slopes).sum()):
            reason = "its largest value is at a kink or a jump"
            warnings.append(f"'{name}': no derivative by {counted(unknown, 'parameter')}: {reason}")
    return warnings


def _one_sided_warnings(one_sided: Mapping[str, tuple[str, str]]) -> list[str]:
    """Return a warning for all parameters with derivatives for larger values only, and one for those for smaller values."""
    sides = dict[str, list[str]]()
    for path, (side, _) in one_sided.items():
        sides.setdefault(side, []).append(path)
    return [
        f"derivatives by {', '.join(map(repr, paths))} are those for {side} only, for example because of this: "
        + one_sided[paths[0]][1]
        for side, paths in sides.items()
    ]
