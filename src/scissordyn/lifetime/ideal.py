"""Loads that wear joints, estimated from the forces of ideal joints."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr

from scissordyn.components.place import GROUND
from scissordyn.errors import ScissordynError
from scissordyn.lifetime.loads import Loads, WornSurface
from scissordyn.mechanics.worn_contact import LOAD_DIRECTIONS
from scissordyn.model.commanded import commanded
from scissordyn.model.mechanism import Mechanism
from scissordyn.run.simulate import simulate
from scissordyn.warning import warning


class IdealRunner:
    """Loads of one cycle with ideal joints; they are the same for all contours."""

    cycles_each = 0  # no contact is simulated

    def __init__(self, mechanism: Mechanism, surfaces: Sequence[WornSurface], cycle_time: float) -> None:
        self.cycle_time = cycle_time
        self._loads = ideal_loads(mechanism, surfaces, cycle_time)

    def loads(self, depths: np.ndarray) -> Loads:
        return self._loads


def ideal_loads(mechanism: Mechanism, surfaces: Sequence[WornSurface], until: float, samples: int = 2001) -> Loads:
    """Return the loads on worn surfaces in the motion with ideal joints and the commanded drives.

    A joint slides by the relative rotation of its bodies times the radius of the journal. The motion of a loose journal across
    its bearing is neglected; it is smaller by the ratio of clearance and radius.
    """
    run = simulate(commanded(mechanism).ideal(), until=until, samples=samples)
    if run.attrs["status"] != "complete":
        raise ScissordynError(f"the motion with ideal joints {run.attrs['cause']}")
    parts, peak, least = np.zeros((4, 1, len(surfaces), LOAD_DIRECTIONS)), np.zeros((1, len(surfaces))), {}
    step = until / (samples - 1) * np.where(np.isin(np.arange(samples), (0, samples - 1)), 0.5, 1.0)
    for j, (name, side) in enumerate(surfaces):
        joint = mechanism.joint(name)
        assert joint.clearance is not None
        force = -run["reaction"].sel(joint=name).transpose("time", "axis").values  # on the bearing
        size = np.hypot(force[:, 0], force[:, 1])
        if not np.all(np.isfinite(size)):
            raise ScissordynError(f"the force of joint '{name}' is not determined with ideal joints")
        angles = [_of_body(run, "angle", body) for body in (joint.bearing[0], joint.journal[0])]
        direction, turn = np.arctan2(force[:, 1], force[:, 0]) - angles[side == "journal"], angles[1] - angles[0]
        spin = _of_body(run, "angular_velocity", joint.journal[0]) - _of_body(run, "angular_velocity", joint.bearing[0])
        work = size * joint.clearance.surfaces.journal_radius * np.abs(spin) * step
        place = direction * LOAD_DIRECTIONS / (2.0 * np.pi)
        low = np.floor(place)
        for at, share in ((low, 1.0 - (place - low)), (low + 1.0, place - low)):
            k = at.astype(int) % LOAD_DIRECTIONS
            for part, factor in zip(parts[:, 0, j], (1.0, size, np.cos(turn), np.sin(turn)), strict=True):
                np.add.at(part, k, share * work * factor)
        peak[0, j] = size.max()
        least[name] = float(size.min() / size.max()) if size.any() else 0.0
    near = min(least, key=lambda name: least[name])
    warnings = [warning("ideal forces", joint=near, percent=100.0 * least[near])]
    if any(track.tolerance is not None for track in mechanism.tracks):
        warnings.append(warning("ideal deviation"))
    return Loads(parts[0], parts[1], parts[2], parts[3], peak, np.full((1, len(mechanism.tracks)), np.nan), tuple(warnings))


def _of_body(run: xr.Dataset, variable: str, body: str) -> np.ndarray:
    """Return an angle or angular velocity of a body over time; zeros for the ground."""
    return np.zeros(run.sizes["time"]) if body == GROUND else np.asarray(run[variable].sel(body=body).values)
