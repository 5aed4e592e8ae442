"""The largest contact force of a run, and the one after the start, in which concentric journals fall through clearances."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from scissordyn.errors import printable
from scissordyn.run.answer.joints import clearance_joints, joint_force
from scissordyn.run.answer.words import Words
from scissordyn.run.results import Run
from scissordyn.units import short

if TYPE_CHECKING:
    from scissordyn.run.answer.summary import JointSummary

ESTIMATE = "an estimate, as contact is hard"


def estimate_in_words(force: float, least: float) -> str:
    """That a force is an estimate, and how far down it reaches where impulses pass through closed contacts [N]."""
    if not least < LESS * force:
        return ESTIMATE
    return f"{ESTIMATE}: {short(least, 'N')} by approach speeds and lasting forces, up to this by impulses that others pass on"


FALLS = 20.0
"""Length of the start, in times until every joint that has contacts has had its first one. Of six units under gravity that is
1.6 ms, the largest force comes at 6.2 ms, and from 30 ms on it is that of the load."""

LESS = 0.9
"""Part of the largest force below which the largest one after the start is given beside it."""


def parts_of_oiled(metal: float, film: float) -> str:
    """What metal and film reach each [N], in words; "" of a dry joint."""
    if math.isnan(film):
        return ""
    return f", its film alone at most {short(film, 'N')}, metal {short(metal, 'N')}"


@dataclass(frozen=True)
class ForceAnswer(Words):
    """The largest force that a clearance joint transmits in a run."""

    joint: str
    force: float  # [N]
    when: float  # [s]
    estimated: bool = False  # Of a hard contact
    start: float | None = None  # End of the start to which it belongs [s], and the largest force after it [N]
    after: float | None = None
    metal: float = math.nan  # Of an oiled joint, the largest of each part, at instants of their own [N]; NaN of a dry one
    film: float = math.nan
    least: float = math.nan  # The least that it is estimated to be [N]

    def __str__(self) -> str:
        estimate = f"; {estimate_in_words(self.force, self.least)}" if self.estimated else ""
        more = ""
        if self.start is not None and self.after is not None:
            more = (
                f" It belongs to the start, as journals fall from the middle of their bearings: after {short(self.start, 's')} "
                f"the largest is {short(self.after, 'N')}."
            )
        where = f"at joint {printable(self.joint)}, at {short(self.when, 's')}"
        return f"Largest force: {short(self.force, 'N')} {where}{parts_of_oiled(self.metal, self.film)}{estimate}.{more}"


def force_after_start(run: Run, start: str, joint: JointSummary) -> tuple[float, float] | None:
    """End of the start [s] and the largest force after it [N], at the contacts that begin then and the samples.

    None where journals do not start concentric, the largest force is not of the start, the run ends in it, or the load of that
    joint is larger in the start than it ever is after it: then the motion explains the force, too.
    """
    force, when = joint.largest, joint.when
    joints, begun = run["contact_joint"].values, run["contact_start"].values
    if start != "concentric" or not begun.size:
        return None
    end = FALLS * max(float(np.min(begun[joints == joint])) for joint in np.unique(joints))
    time = run["time"].values
    if not when < end < float(run.attrs["end"]) or not (time >= end).any():
        return None
    peaks = [run[name].values[begun >= end] for name in ("peak_force", "peak_force_estimate") if name in run]
    after = np.concatenate([*peaks, *(joint_force(run, joint)[time >= end] for joint in clearance_joints(run))])
    largest = float(np.nanmax(after)) if np.isfinite(after).any() else 0.0
    if largest >= LESS * force or _largest_load(run, joint.name, 0.0, end) * LESS > _largest_load(run, joint.name, end, end):
        return None
    return end, largest


def _largest_load(run: Run, joint: str, begin: float, length: float) -> float:
    """Largest mean of the force of a joint [N] over intervals of a length, from an instant on to the end, at the samples.

    Impacts change the force at an instant, not its mean over many of them, which carries the load. From 0 on the first interval
    counts alone.
    """
    time = run["time"].values
    size = joint_force(run, joint)
    total = np.concatenate([[0.0], np.cumsum(0.5 * (size[1:] + size[:-1]) * np.diff(time))])
    starts = time[(time >= begin) & (time + length <= time[-1])] if begin > 0.0 else time[:1]
    if not starts.size:
        starts, length = np.array([begin]), time[-1] - begin
    impulse = np.interp(starts + length, time, total) - np.interp(starts, time, total)
    return float(np.max(impulse / length))
