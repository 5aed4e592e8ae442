"""Curves of contact forces with the instants of the contacts in them, which are located between samples."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import xarray as xr

from scissordyn.run.answer.joint_force import joint_force


@dataclass(frozen=True)
class ContactTimes:
    """The contacts of one joint."""

    start: np.ndarray  # (contacts,) [s]; a contact that lasts ends with the run
    end: np.ndarray  # (contacts,)
    peak_time: np.ndarray  # (contacts,) Instant of the largest force [s]; NaN where there is none
    peak: np.ndarray  # (contacts,) Largest force [N]
    lasting: np.ndarray  # (contacts,) Whether a contact goes on at the end of the run


def contact_times(run: xr.Dataset, joint: str, *, normal: bool = False) -> ContactTimes:
    """The contacts of a joint, with the peaks of their force or of its normal part; none in a run without contacts."""
    if "contact_joint" not in run:
        nothing = np.empty(0)
        return ContactTimes(nothing, nothing, nothing, nothing, nothing.astype(bool))
    read = run.variables  # without their coordinates, which take longer than all else where there are many joints
    ours = read["contact_joint"].values.astype(str) == joint
    start, duration = read["contact_start"].values[ours], read["contact_duration"].values[ours]
    lasting = ~np.isfinite(duration)
    end = np.where(lasting, float(read["time"].values[-1]), start + np.where(lasting, 0.0, duration))
    part = "peak_normal_" if normal else "peak_"
    return ContactTimes(start, end, start + read[f"{part}time"].values[ours], read[f"{part}force"].values[ours], lasting)


def with_instants(time: np.ndarray, values: np.ndarray, when: np.ndarray, also: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A sampled curve with further points in it.

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


def force_curve(run: xr.Dataset, joint: str, *, normal: bool = False) -> xr.DataArray:
    """The force of a joint, or its normal part, at its samples and where it is largest; dry also at both ends of contacts.

    A line through samples alone is lower than the peaks between them, and misses a contact that is shorter than their distance.
    """
    time = run["time"].values
    values = run["normal_force"].sel(joint=joint).values if normal else joint_force(run, joint)
    attributes = {"units": "N", "long_name": "normal force" if normal else "force"}
    if not normal and "joint_peak_force" in run and np.isfinite(peak := run["joint_peak_force"].sel(joint=joint).values):
        time, values = with_instants(time, values, run["joint_peak_force_time"].sel(joint=joint).values[None], peak[None])
        return xr.DataArray(values, {"time": time}, ("time",), attrs=attributes)
    contacts = contact_times(run, joint, normal=normal)
    before, after = contacts.start[contacts.start > time[0]], contacts.end[~contacts.lasting & (contacts.end < time[-1])]
    # without a force at its ends, except where a sample is
    zero = np.concatenate([before, after])
    time, values = with_instants(time, values, zero, np.zeros(zero.size))
    time, values = with_instants(time, values, contacts.peak_time, contacts.peak)
    return xr.DataArray(values, {"time": time}, ("time",), attrs=attributes)


def frame_contacts(run: xr.Dataset, joint: str, frames: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """What the contacts of a joint add to frames of an animation, each of which covers the time since the one before.

    Shapes: `frames` (frames,) [s]; returns `touched` (frames,), `largest` (frames,) [N].
    """
    touched, largest = np.zeros(frames.size, bool), np.zeros(frames.size)
    contacts = contact_times(run, joint)
    first = np.searchsorted(frames, contacts.start)
    last = np.minimum(np.searchsorted(frames, contacts.end), frames.size - 1)
    for begin, end in zip(first.tolist(), last.tolist(), strict=True):
        touched[begin : end + 1] = True
    inside = np.isfinite(contacts.peak) & (contacts.peak_time <= frames[-1])
    np.maximum.at(largest, np.searchsorted(frames, contacts.peak_time[inside]), contacts.peak[inside])
    return touched, largest
