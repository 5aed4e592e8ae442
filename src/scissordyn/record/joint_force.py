"""Largest forces that joints, guides and welds transmit, over the whole run and after its start.

At the start of a run concentric journals fall through their clearances.
"""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from scissordyn.errors import InputError, printable
from scissordyn.numeral import finite_or_none
from scissordyn.record.results import Run, along, values_at
from scissordyn.record.transmitted import START_DURATION
from scissordyn.units import short

ESTIMATE = "an estimate, as contact is hard"  # Accuracy of the largest force in a hard contact, as printed

LATER_FORCE_RATIO_MAX = 0.9  # [-] ratio of the largest force after the start to that of the run, up to which both are reported


class Answer:
    """Base of the dataclasses that a summary consists of."""

    DERIVED: ClassVar[tuple[str, ...]] = ()  # Names of properties that `plain` includes

    def plain(self) -> dict[str, Any]:
        """Return the values by name, in SI units; None for unknown values."""
        fields = (field.name for field in dataclasses.fields(self))  # type: ignore[arg-type]  # subclasses are dataclasses
        return {name: _plain(getattr(self, name)) for name in (*fields, *self.DERIVED)}


def _plain(value: Any) -> Any:
    if isinstance(value, Answer):
        return value.plain()
    if isinstance(value, tuple):
        return [_plain(item) for item in value]
    return finite_or_none(value)


def clearance_joints(run: Run) -> list[str]:
    if "clearance" not in run:
        return []
    names: list[str] = run.variables["joint"].values[np.isfinite(run.variables["clearance"].values)].astype(str).tolist()
    return names


def joint_force(run: Run, joint: str) -> np.ndarray:
    """Return the magnitude of the force that a joint, a guide or a weld transmits, at the samples [N]."""
    names = run.variables["joint"].values.tolist()
    dim, force = ("joint", "reaction") if joint in names else ("weld", "weld_force")
    k = run.variables[dim].values.tolist().index(joint)
    return np.asarray(np.hypot(*along(run.variables[force], dim, "axis", "time")[k]))


def largest_force(run: Run, joint: str, start: float = -math.inf, end: float = math.inf) -> float:
    """Return the largest force of a joint between two instants [N], including maxima between samples.

    The result is NaN if the joint has impacts of hard contact, or if neither a sample nor a maximum lies between the instants.
    """
    time, sizes = run["time"].values, [joint_force(run, joint)]
    whens = [time]
    if "joint_peak_force" in run and np.isfinite(whole := float(values_at(run, "joint_peak_force", joint=joint))):
        sizes.append(np.array([whole]))
        whens.append(values_at(run, "joint_peak_force_time", joint=joint)[None])
    if "contact_joint" in run and joint not in oiled_joints(run):
        here = run["contact_joint"].values.astype(str) == joint
        sizes.append(run["peak_force"].values[here])
        begun = run["contact_start"].values[here]
        whens.append(np.where(np.isnan(sizes[-1]), begun, begun + run["peak_time"].values[here]))
    size, when = np.concatenate(sizes), np.concatenate(whens)
    inside = size[(when >= start) & (when <= end)]
    return float(np.max(inside)) if inside.size else math.nan


def oiled_joints(run: Run) -> list[str]:
    names: list[str] = run.variables["film"].values.astype(str).tolist() if "film" in run else []
    return names


def require_clearance_joints(run: Run, among: list[str] | None = None) -> list[str]:
    """Return the names of the clearance joints of a run, all or those `among`; raise `InputError` if there is none."""
    joints = clearance_joints(run) if among is None else among
    if not joints:
        raise InputError(
            "a run without clearance joints",
            "a run of a mechanism with a clearance",
            'arm.with_clearance("A", Clearance(0.5e-3))',
        )
    return joints


@dataclass(frozen=True)
class JointSummary(Answer):
    """Number of contacts, fraction of time in contact, and largest force of one joint, guide or weld in a run."""

    name: str
    contacts: int
    fraction: float  # Fraction of the time in contact
    # Largest force that the joint transmits [N]; NaN for hard contact without an impact or a sampled force
    largest: float
    when: float  # Instant of the largest force [s]
    # True for hard contact: the force is then the larger one of the estimated force of impacts and the sampled force of lasting
    # contacts
    estimated: bool = False
    metal: float = math.nan  # Largest asperity force in an oiled joint [N]; NaN for a dry joint
    film: float = math.nan  # Largest force of the oil film [N]; NaN for a dry joint
    least: float = math.nan  # Lower bound of the estimated force of hard contacts [N]


def joint_summaries(run: Run) -> list[JointSummary]:
    """Return summaries of joints with contacts, in the order of their first contact, then of oiled joints without contact."""
    end, summaries = float(run.attrs["end"]), []
    oiled = oiled_joints(run)
    for joint in dict.fromkeys([*run["contact_joint"].values.tolist(), *oiled]):
        here = run["contact_joint"].values == joint
        start, lasting = (run[name].values[here] for name in ("contact_start", "contact_duration"))
        lasting = np.where(np.isnan(lasting), end - start, lasting)
        fraction = float(lasting.sum()) / end if end > 0.0 else 0.0
        numbers = _largest_force(run, here)
        if joint in oiled:  # force of metal and film together, and of each alone
            at, film = (run[dim].values.tolist().index(joint) for dim in ("joint", "film"))
            numbers = {
                "largest": float(run["joint_peak_force"].values[at]),
                "when": float(run["joint_peak_force_time"].values[at]),
                "metal": numbers["largest"] if start.size else 0.0,
                "film": float(run["film_peak_force"].values[film]),
            }
        summaries.append(JointSummary(str(joint), start.size, fraction, **numbers))
    return summaries


def ideal_summaries(run: Run) -> list[JointSummary]:
    """Return summaries of the ideal joints, guides and welds that transmit a force."""
    summaries = []
    for dim in ("joint", "weld"):
        if f"{dim}_peak_force" not in run:
            continue
        loose = clearance_joints(run) if dim == "joint" else []
        columns = (run[name].values.tolist() for name in (dim, f"{dim}_peak_force", f"{dim}_peak_force_time"))
        for name, largest, when in zip(*columns, strict=True):
            if name not in loose and largest > 0.0:
                summaries.append(JointSummary(str(name), 0, 0.0, largest, when))
    return summaries


def kinds_left_out(run: Run) -> tuple[str, ...]:
    """Return the variables to omit from a table of contacts: peaks if all contacts are hard, impulses if none is hard."""
    if "peak_force_estimate" not in run:
        return ("impulse",)
    peaks = run["peak_force"].values
    if np.isnan(peaks).all():
        return "peak_force", "peak_time"
    return () if np.isnan(peaks).any() else ("impulse",)


def _largest_force(run: Run, here: np.ndarray) -> dict[str, Any]:
    """Return the force fields of a `JointSummary` from the contacts `here`; the force of hard contacts is an estimate."""
    for force, time in (("peak_force", "peak_time"), ("peak_force_estimate", "peak_force_estimate_time")):
        sizes = run[force].values[here] if force in run else np.zeros(0)
        if np.isnan(sizes).all():
            continue
        highest = int(np.nanargmax(sizes))
        when = float(run["contact_start"].values[here][highest] + run[time].values[here][highest])
        least = float(np.nanmax(run[f"{force}_least"].values[here])) if f"{force}_least" in run else math.nan
        return {"largest": float(sizes[highest]), "when": when, "estimated": force != "peak_force", "least": least}
    return {"largest": math.nan, "when": math.nan, "estimated": True}


def estimate_in_words(force: float, least: float) -> str:
    """Return the text that a force [N] is an estimate; with the lower bound `least` [N] if that is much smaller."""
    if not least < LATER_FORCE_RATIO_MAX * force:
        return ESTIMATE
    low = short(least, "N")
    return f"{ESTIMATE}: {low} from approach speeds and lasting forces, up to this value with impulses from other joints"


def parts_of_oiled(metal: float, film: float) -> str:
    """Return a clause with the largest forces of oil film and metal [N] of an oiled joint; an empty text for a dry joint."""
    if math.isnan(film):
        return ""
    return f", its film alone at most {short(film, 'N')}, metal {short(metal, 'N')}"


@dataclass(frozen=True)
class ForceAnswer(Answer):
    """Largest force that any joint, guide or weld transmits in a run."""

    joint: str
    kind: str  # "clearance joint", "ideal joint", "guide", "contact point" or "weld"
    force: float  # [N]
    when: float  # [s]
    estimated: bool = False  # True for a hard contact
    start: float | None = None  # End of the starting phase [s], if the largest force occurs in it
    after: float | None = None  # Largest force after the starting phase [N]
    metal: float = math.nan  # Largest asperity force of an oiled joint [N]; NaN for a dry joint
    film: float = math.nan  # Largest force of its oil film [N]; NaN for a dry joint
    least: float = math.nan  # Lower bound of the estimated force of hard contact [N]
    loose: ForceAnswer | None = None  # Largest force at a clearance joint, if another joint transmits more
    partial: bool = False  # True if impulses of hard contacts through the joint are left out

    def __str__(self) -> str:
        more = ""
        if self.start is not None and self.after is not None:
            more = (
                f" It belongs to the start, as journals fall from the middle of their bearings: after {short(self.start, 's')} "
                f"the largest is {short(self.after, 'N')}."
            )
        less = "" if self.loose is None else f"; {self.loose.words}"
        return f"Largest force: {self.words}{less}.{more}"

    @property
    def words(self) -> str:
        """Text with magnitude, joint and instant of the force, its parts by metal and film, and a note if it is an estimate."""
        estimate = f"; {estimate_in_words(self.force, self.least)}" if self.estimated else ""
        estimate += ", without the impulses of hard contacts" if self.partial else ""
        where = f"at {self.kind} {printable(self.joint)}, at {short(self.when, 's')}"
        return f"{short(self.force, 'N')} {where}{parts_of_oiled(self.metal, self.film)}{estimate}"


def force_after_start(run: Run, start: str, joint: JointSummary) -> tuple[float, float] | None:
    """Return the end of the starting phase [s] and the largest force of all joints after it [N], or None.

    Return None if journals do not start concentric, the largest force is later or the run ends earlier than this phase, a force
    nearly as large follows, or the mean load of `joint` is larger in it than afterwards, so that the motion explains the force.
    """
    force, when = joint.largest, joint.when
    joints, contact_starts = run["contact_joint"].values, run["contact_start"].values
    if start != "concentric" or not contact_starts.size:
        return None
    end = START_DURATION * max(float(np.min(contact_starts[joints == joint])) for joint in np.unique(joints))
    time = run["time"].values
    if not when < end < float(run.attrs["end"]) or not (time >= end).any():
        return None
    later = [run["peak_force_estimate"].values[contact_starts >= end]] if "peak_force_estimate" in run else []
    peak_names = ("joint_peak_force_after_start", "weld_peak_force_after_start")
    later += [run[name].values for name in peak_names if name in run]
    later += [joint_force(run, joint)[time >= end] for joint in clearance_joints(run)]
    later_forces = np.concatenate(later)
    largest = float(np.nanmax(later_forces)) if np.isfinite(later_forces).any() else 0.0
    if largest >= LATER_FORCE_RATIO_MAX * force or _largest_load(
        run, joint.name, 0.0, end
    ) * LATER_FORCE_RATIO_MAX > _largest_load(run, joint.name, end, end):
        return None
    return end, largest


def _largest_load(run: Run, joint: str, begin: float, length: float) -> float:
    """Return the largest moving average of a joint's force [N] over intervals of a given length, from an instant to the end.

    Impacts change the force at an instant but not its mean over many impacts, which balances the load. If `begin` is 0, only
    the first interval counts.
    """
    time = run["time"].values
    size = joint_force(run, joint)
    total = np.concatenate([[0.0], np.cumsum(0.5 * (size[1:] + size[:-1]) * np.diff(time))])
    starts = time[(time >= begin) & (time + length <= time[-1])] if begin > 0.0 else time[:1]
    if not starts.size:
        starts, length = np.array([begin]), time[-1] - begin
    impulse = np.interp(starts + length, time, total) - np.interp(starts, time, total)
    return float(np.max(impulse / length))
