"""By which factor the loads of a mechanism may grow until it buckles."""

from __future__ import annotations

import dataclasses
from typing import Annotated, Any

import numpy as np
import scipy.linalg as sl
import xarray as xr

from scissordyn.component.force import Force
from scissordyn.component.torque import Torque
from scissordyn.errors import InputError
from scissordyn.model.mechanism import Mechanism
from scissordyn.plan.flexible import with_mode_counts
from scissordyn.plan.plan import plan
from scissordyn.run.answer.geometric_stiffness import ROUNDING, geometric_stiffness
from scissordyn.run.start.small_motion import placed
from scissordyn.run.start.stiffness import stiffness
from scissordyn.units import Quantity, checked


@checked
def buckling(
    mechanism: Mechanism, *, count: Annotated[int, Quantity("1", minimum=1, help="number of factors")] = 3
) -> xr.Dataset:
    """Factors of gravity, forces and torques at which a mechanism with locked drives buckles.

    Linear buckling: (K + factor G) a = 0 with the stiffness K without loads, bars straight, and the geometric stiffness G of
    what the loads cause there by K: axial forces of bars, forces of springs, bushings and rollers, reactions. Clearance joints
    are taken as ideal. Deflections before buckling are left out: where they are large a mechanism fails at less. A position
    without loads must be stable, which bars that bend, springs or drives see to.

    Parameters
    ----------
    mechanism : Mechanism
        With bars that bend.
    count : int
        Number of factors, from the smallest; fewer, or none, if the loads compress nothing.

    Returns
    -------
    Dataset
        `load_factor` over `mode`: the position under the loads as they are is stable if the first is above one.

    Raises
    ------
    InputError
        If the mechanism has no loads, or is not stable without them.

    References
    ----------
    Crisfield 1991, Non-linear finite element analysis of solids and structures
    """
    ideal = with_mode_counts(mechanism).ideal()
    if ideal.gravity == 0.0 and not any(isinstance(part, Force | Torque) for part in ideal.components):
        raise InputError("the buckling of a mechanism without loads", "gravity, forces or torques")
    at, _ = placed(plan(_loaded(ideal, 0.0)).at_rest, "concentric", None)
    slopes, allowed = stiffness(at)
    rest = allowed.T @ slopes @ allowed
    if allowed.shape[1] == 0 or np.linalg.eigvalsh(rest)[0] <= 0.0:
        raise InputError("the buckling of a mechanism that is not stable without loads", "a drive, springs or bars that bend")
    loads = placed(plan(_loaded(ideal, 1.0)).at_rest, "concentric", None)[0]
    change = allowed.T @ geometric_stiffness(at, loads, slopes, allowed) @ allowed
    # change a = mu rest a with mu = -1/factor: the factors are positive where mu is negative
    inverse = sl.eigh(change, rest, eigvals_only=True)
    factors = np.sort(-1.0 / inverse[inverse < -ROUNDING * np.max(np.abs(inverse))])[:count]
    described = {"units": "1", "long_name": "factor of the loads at which the mechanism buckles"}
    return xr.Dataset({"load_factor": ("mode", factors, described)}, {"mode": np.arange(1, factors.size + 1)})


def _loaded(mechanism: Mechanism, factor: float) -> Mechanism:
    """The mechanism with its loads times a factor."""

    def scaled(part: Any) -> Any:
        if isinstance(part, Force):
            return dataclasses.replace(part, force=(factor * part.force[0], factor * part.force[1]))
        return dataclasses.replace(part, torque=factor * part.torque) if isinstance(part, Torque) else part

    return dataclasses.replace(
        mechanism, gravity=factor * mechanism.gravity, components=tuple(scaled(part) for part in mechanism.components)
    )
