"""Curves of contact forces and torques that include their maxima between samples."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from scissordyn.record.joint_force import clearance_joints, joint_force, oiled_joints
from scissordyn.record.results import Curve, Run, along, curve_of, values_at
from scissordyn.record.summary import actuator_limits

TORQUE_VARIABLES = (("control_torque", "actuator", "peak_control_torque"), ("motor_torque", "motor", "motor_peak_torque"))
"""Variables of a run for each kind of torque source: torque, dimension of the sources, largest torque."""


@dataclass(frozen=True)
class ContactTimes:
    """Start, end and peak force of each contact of one joint."""

    start: np.ndarray  # (contacts,) [s]
    end: np.ndarray  # (contacts,) [s]; the end of the run for a contact that is still closed then
    peak_time: np.ndarray  # (contacts,) Instant of the largest force [s]; NaN if unknown
    peak: np.ndarray  # (contacts,) Largest force [N]
    lasting: np.ndarray  # (contacts,) True for a contact that is still closed at the end of the run


def contact_times(run: Run, joint: str, *, normal: bool = False) -> ContactTimes:
    """Return the contacts of a joint with the peaks of the force, or of its normal part; empty for a run without contacts."""
    if "contact_joint" not in run:
        nothing = np.empty(0)
        return ContactTimes(nothing, nothing, nothing, nothing, nothing.astype(bool))
    read = run.variables  # variables without coordinates: selecting by coordinate is slow for many joints
    ours = read["contact_joint"].values.astype(str, copy=False) == joint
    start, duration = read["contact_start"].values[ours], read["contact_duration"].values[ours]
    lasting = ~np.isfinite(duration)
    end = np.where(lasting, float(read["time"].values[-1]), start + np.where(lasting, 0.0, duration))
    part = "peak_normal_" if normal else "peak_"
    return ContactTimes(start, end, start + read[f"{part}time"].values[ours], read[f"{part}force"].values[ours], lasting)


def insert_points(time: np.ndarray, values: np.ndarray, when: np.ndarray, also: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Insert points with the instants `when` and the values `also` into a sampled curve.

    Shapes: `time, values` (samples,), `when, also` (points,).
    """
    if not time.size:
        return time, values
    inside = np.isfinite(when) & np.isfinite(also) & (when >= time[0]) & (when <= time[-1])
    when, also = when[inside], also[inside]
    at = np.minimum(np.searchsorted(time, when), time.size - 1)
    sampled = time[at] == when
    values = values.copy()
    for k, value in zip(at[sampled].tolist(), also[sampled].tolist(), strict=True):
        values[k] = max(values[k], value, key=abs)
    merged = np.concatenate([time, when[~sampled]])
    order = np.argsort(merged, kind="stable")
    return merged[order], np.concatenate([values, also[~sampled]])[order]


def force_curve(run: Run, joint: str, *, normal: bool = False) -> Curve:
    """Return the force of a joint, or its normal part, at the samples and at its maxima between samples.

    For a dry joint the curve is zero at both ends of each contact. A line through the samples alone would miss peaks and short
    contacts between them.
    """
    time = run["time"].values
    values = values_at(run, "normal_force", "time", joint=joint) if normal else joint_force(run, joint)
    dry = joint in clearance_joints(run) and joint not in oiled_joints(run)
    if not (normal or dry) and np.isfinite(peak := values_at(run, "joint_peak_force", joint=joint)):
        when = values_at(run, "joint_peak_force_time", joint=joint)
        return Curve(*insert_points(time, values, when[None], peak[None]), "N")
    contacts = contact_times(run, joint, normal=normal)
    before, after = contacts.start[contacts.start > time[0]], contacts.end[~contacts.lasting & (contacts.end < time[-1])]
    # the force is zero at the ends of a contact, except where a sample exists
    zero = np.concatenate([before, after])
    time, values = insert_points(time, values, zero, np.zeros(zero.size))
    return Curve(*insert_points(time, values, contacts.peak_time, contacts.peak), "N")


def frame_contacts(run: Run, joints: Sequence[str], frames: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return whether each frame contains a contact of each joint, and the largest peak force in it.

    A frame covers the time since the previous one.

    Shapes: `frames` (frames,) [s]; returns `touched` (frames, joints), `largest` (frames, joints) [N].
    """
    touched, largest = np.zeros((frames.size, len(joints)), bool), np.zeros((frames.size, len(joints)))
    for k, joint in enumerate(joints):
        contacts = contact_times(run, joint)
        first = np.searchsorted(frames, contacts.start)
        last = np.minimum(np.searchsorted(frames, contacts.end), frames.size - 1)
        for begin, end in zip(first.tolist(), last.tolist(), strict=True):
            touched[begin : end + 1, k] = True
        inside = np.isfinite(contacts.peak) & (contacts.peak_time <= frames[-1])
        np.maximum.at(largest[:, k], np.searchsorted(frames, contacts.peak_time[inside]), contacts.peak[inside])
    return touched, largest


@dataclass(frozen=True)
class TorqueSource:
    name: str
    variable: str  # Name of the variable in the run
    part: int
    curve: Curve  # Torque along "time" [N m], including the located maximum between samples
    peak: tuple[float, float] | None = None  # Instant [s] and value [N m] of the largest magnitude, if the run has it
    limit: float | None = None  # Largest torque in either direction [N m], if there is a limit


def torque_sources(run: Run) -> list[TorqueSource]:
    """Return the torques of drives, actuators and motors, in this order."""
    sources = []
    drives = run.sizes.get("drive", 1) if "drive_torque" in run else 0
    for k in range(drives):
        sampled = _part(run, "drive_torques", "drive", k) if "drive_torques" in run else curve_of(run, "drive_torque")
        name = "driving torque" if drives == 1 else f"torque of drive {k + 1}"
        peak = _peak(run, sampled.values, "peak_drive_torque", k)
        sources.append(TorqueSource(name, "drive_torque", k, _insert_peak(sampled, peak), peak))
    limits = actuator_limits(run) if any(variable in run for variable, _, _ in TORQUE_VARIABLES) else {}
    for variable, dim, largest in TORQUE_VARIABLES:
        if variable in run and dim in run[variable].dims:
            for k, name in enumerate(run[dim].values.astype(str).tolist()):
                sampled = _part(run, variable, dim, k)
                peak = _peak(run, sampled.values, largest, k)
                curve = _insert_peak(sampled, peak)
                sources.append(TorqueSource(f"torque of {name}", variable, k, curve, peak, limits.get(name)))
    return sources


def _part(run: Run, variable: str, dim: str, k: int) -> Curve:
    part = run.variables[variable]
    return Curve(run.variables["time"].values, along(part, dim, "time")[k], part.attrs["units"])


def _insert_peak(sampled: Curve, peak: tuple[float, float] | None) -> Curve:
    when, value = (np.empty(0), np.empty(0)) if peak is None else (np.array([peak[0]]), np.array([peak[1]]))
    return Curve(*insert_points(sampled.time, sampled.values, when, value), sampled.units)


def _peak(run: Run, values: np.ndarray, largest: str, source: int) -> tuple[float, float] | None:
    """Return the instant [s] and value [N m] of a source's largest torque; None if it is not in this part of the run."""
    if largest not in run or f"{largest}_time" not in run:
        return None
    when, size = (float(run.variables[name].values[source]) for name in (f"{largest}_time", largest))
    time = run["time"].values
    if not (time.size and time[0] <= when <= time[-1] and math.isfinite(size)):
        return None
    # the run stores the magnitude; its sign is that of the larger neighbouring sample
    after = min(int(np.searchsorted(time, when)), len(time) - 1)
    around = values[max(0, after - 1) : after + 1]
    return when, math.copysign(size, float(around[np.argmax(np.abs(around))]))
