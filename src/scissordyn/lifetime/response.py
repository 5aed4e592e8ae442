"""Life of worn joints as a response of studies."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from scissordyn.errors import InputError, ScissordynError
from scissordyn.lifetime.loads import with_coefficients, worn_surfaces
from scissordyn.lifetime.wear import wear_out
from scissordyn.model.mechanism import Mechanism
from scissordyn.model.options import Options
from scissordyn.model.wear import Wear

LIFE = "life"  # name of the response
LIFE_UNIT = "cycles"


@dataclass(frozen=True)
class WearLife:
    """Number of cycles until the first requirement on worn joints fails; infinite if all hold for the computed cycles."""

    settings: Wear

    @property
    def attributes(self) -> dict[str, Any]:
        """Attributes of the response: its meaning, and the number of cycles beyond which lives are not known."""
        return {"long_name": "life until a requirement on worn joints fails", "beyond": self.settings.cycles}

    def check(self, mechanism: Mechanism, bounds: Iterable[tuple[str, float]]) -> None:
        """Raise `InputError` if no requirement can fail, or a bound, given by its text, is above the computed cycles."""
        worn, settings = with_coefficients(mechanism, self.settings.coefficients)[0], self.settings
        clearances = [worn.joint(surface.joint).clearance for surface in worn_surfaces(worn)]
        bush = any(clearance is not None and clearance.bush is not None for clearance in clearances)
        tracked = settings.loads == "simulated" and any(track.tolerance is not None for track in mechanism.tracks)
        if settings.most_clearance is None and not bush and not tracked:
            raise InputError(
                f"'{LIFE}': no requirement on worn joints, which could fail",
                "most_clearance in [wear], the bush of a joint, or the tolerance of a tracked point",
                'most_clearance = "0.2 mm"',
            )
        for text, bound in bounds:
            if bound > settings.cycles:
                raise InputError(
                    f"'{text}': only {settings.cycles} cycles are computed",
                    "as many cycles as the bound, or more",
                    f"cycles = {bound:.0f}",
                )

    def __call__(self, mechanism: Mechanism, options: Options) -> tuple[float, list[str]]:
        """Return the life of a mechanism and the warnings of its wear."""
        run = wear_out(mechanism, options, self.settings)
        if run.attrs["status"] == "interrupted":
            raise KeyboardInterrupt
        lives = run["life"].values
        finite_lives = lives[np.isfinite(lives)]
        if run.attrs["status"] == "failed" and not finite_lives.size:
            raise ScissordynError(run.attrs["cause"])
        return float(finite_lives.min()) if finite_lives.size else math.inf, json.loads(run.attrs["warnings"])
