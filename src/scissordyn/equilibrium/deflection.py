"""Magnified deflections of flexible bars, relative to the position in which the bars are straight."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Annotated

import numpy as np
import xarray as xr

from scissordyn.equilibrium.start import assembled_near
from scissordyn.errors import InputError
from scissordyn.kinematics.assembly import natural_state
from scissordyn.model.mechanism import Mechanism
from scissordyn.plan.bending import bends
from scissordyn.plan.flexible import with_mode_counts
from scissordyn.plan.plan import Plan, plan
from scissordyn.plan.rest import lock_drives
from scissordyn.plan.system import make_system
from scissordyn.units import Quantity, checked


@checked
def magnified_deflection(
    run: xr.Dataset,
    mechanism: Mechanism,
    factor: Annotated[float, Quantity("1", above=0.0, maximum=1e6, help="magnification")],
    *,
    samples: Sequence[int] | None = None,
) -> xr.Dataset:
    """Return the run with the displacements from the position with straight bars multiplied by a factor.

    That position is the one nearest to the run's, with straight bars and ideal joints on the same drive. Pins stay together,
    because all bodies are moved by the same rule.
    """
    if not bends(mechanism):
        raise InputError("the mechanism has no flexible bars to magnify", "flexible bars", "sd.with_bending(mechanism, ...)")
    if factor == 1.0:
        return run
    names = [body.name for body in mechanism.bodies]
    where = run["position"].sel(body=names).transpose("time", "body", "axis").values
    angle = run["angle"].sel(body=names).transpose("time", "body").values
    ideal = plan(with_mode_counts(mechanism).ideal())
    placed = np.array([body.placed_angle for body in ideal.bodies])
    straight, turned = where.copy(), angle.copy()
    for k in range(len(where)) if samples is None else samples:
        turns = dict(zip(names, (angle[k] - placed).tolist(), strict=True))
        locked = lock_drives(ideal, float(run["time"].values[k]), turns)
        straight[k], turned[k] = _straight_position(locked, where[k], angle[k])
    apart = np.remainder(angle - turned + math.pi, 2.0 * math.pi) - math.pi
    moved = run.copy()
    dims = ("time", "body", "axis")
    moved["position"] = run["position"].transpose(*dims).copy()
    moved["angle"] = run["angle"].transpose(*dims[:2]).copy()
    moved["position"].loc[{"body": names}] = straight + factor * (where - straight)
    moved["angle"].loc[{"body": names}] = angle + (factor - 1.0) * apart
    return moved.assign_attrs(magnified=factor)


def _straight_position(locked: Plan, where: np.ndarray, angle: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return mass centres [m] and angles [rad] in the position with straight bars that is nearest to a given one."""
    system, offsets = make_system(locked).content, locked.coordinates.natural.offsets
    natural = np.array(locked.coordinates.placed[0])
    for b, body in enumerate(locked.bodies):
        p = offsets[body.name]
        natural[p : p + 2] = where[b] - _turned(body.centre, angle[b])
        if locked.coordinates.natural.rotates(body.name):
            natural[p + 2 : p + 4] = math.cos(angle[b]), math.sin(angle[b])
    locked.coordinates.natural.deflect_statically(natural)
    start = assembled_near(locked, system, natural, straight=True)
    return places(locked, natural_state(locked, system, start)[0])


def places(locked: Plan, natural: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return mass centres [m] and angles from -pi to pi [rad] of the bodies, from their natural coordinates."""
    where, angle = np.zeros((len(locked.bodies), 2)), np.zeros(len(locked.bodies))
    for b, body in enumerate(locked.bodies):
        p = locked.coordinates.natural.offsets[body.name]
        angle[b] = locked.coordinates.natural.angle_of(body.name, natural)
        where[b] = natural[p : p + 2] + _turned(body.centre, angle[b])
    return where, angle


def _turned(vector: tuple[float, float], angle: float) -> np.ndarray:
    cos, sin = math.cos(angle), math.sin(angle)
    return np.array([cos * vector[0] - sin * vector[1], sin * vector[0] + cos * vector[1]])
