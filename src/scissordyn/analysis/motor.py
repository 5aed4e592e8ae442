"""Sizing of drives, actuators and motors: required torque over speed, fraction of a motor curve, tracking errors."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from scissordyn.analysis.variable import dataset_variable
from scissordyn.annotation import is_number, shown
from scissordyn.casefile.configuration import read_configuration
from scissordyn.components.actuator import Actuator
from scissordyn.components.motor import Motor
from scissordyn.components.place import GROUND
from scissordyn.components.tabulated_motor import TabulatedMotor
from scissordyn.errors import InputError, did_you_mean
from scissordyn.model.options import AUTO, DEFAULT_SAMPLES
from scissordyn.record.joint_force import clearance_joints, largest_force
from scissordyn.record.sampling import is_whole, time_mean
from scissordyn.units import checked

EXAMPLE = "sd.MotorCurve((0.0, 10.0, 30.0), (60.0, 60.0, 0.0))"  # Correct call, which error texts show


@dataclass(frozen=True)
class MotorCurve:
    """Torque-speed curve of a motor, and the largest fraction of it that a run requires.

    Called with a run it returns that fraction, so it can be a response of a study; above 1 the motor is too weak.

    Parameters
    ----------
    speeds : tuple of float
        Speeds of the motor [rad/s], ascending from 0; beyond the last one its torque is zero.
    torques : tuple of float
        Torques of the motor at these speeds [N m], linear in between; the same in both senses of rotation.
    of : str
        Name of the actuator or motor of the mechanism, or "drive"; not needed if there is only one.
    ratio : float
        Ratio of a gear without losses: turns of the motor per turn of the joint.
    """

    speeds: tuple[float, ...]
    torques: tuple[float, ...]
    of: str = ""
    ratio: float = 1.0

    def __post_init__(self) -> None:
        for name in ("speeds", "torques"):
            object.__setattr__(self, name, _numbers(name, getattr(self, name)))
        speeds, torques = np.array(self.speeds), np.array(self.torques)
        if speeds.size < 2 or speeds.size != torques.size:
            raise InputError(
                f"a motor with {speeds.size} speeds and {torques.size} torques", "the same number of each, at least 2", EXAMPLE
            )
        if not (np.all(np.isfinite(speeds)) and speeds[0] == 0.0 and np.all(np.diff(speeds) > 0.0)):
            came = ", ".join(f"{speed:g}" for speed in speeds)
            raise InputError(f"the speeds of a motor are {came} rad/s", "values ascending from 0", EXAMPLE)
        if not (np.all(np.isfinite(torques)) and np.all(torques >= 0.0) and np.any(torques > 0.0)):
            raise InputError(
                f"the torques of a motor are {', '.join(f'{torque:g}' for torque in torques)} N m", "numbers >= 0", EXAMPLE
            )
        if not 0.0 < self.ratio < math.inf:
            raise InputError(f"the gear ratio is {self.ratio:g}", "a number > 0", "ratio=50.0")

    def available(self, speed: np.ndarray) -> np.ndarray:
        """Return the torque available at the joint, after the gear [N m], at joint speeds [rad/s]; 0 beyond the curve."""
        return np.asarray(self.ratio * np.interp(self.ratio * np.abs(speed), self.speeds, self.torques, right=0.0))

    def fraction(self, needed: xr.Dataset) -> np.ndarray:
        """Return required over available torque at the instants of `torque_over_speed`; infinite beyond the curve."""
        torque, speed = np.abs(needed["torque"].values), needed["speed"].values
        available, beyond = self.available(speed), self.ratio * np.abs(speed) > self.speeds[-1]
        with np.errstate(divide="ignore", invalid="ignore"):
            share = np.where(torque > 0.0, torque / available, 0.0)
        return np.where(beyond, np.inf, share)

    def __call__(self, run: xr.Dataset) -> float:
        """Return the largest required torque of a run as a fraction of the motor's torque at the same speed."""
        return float(np.max(self.fraction(torque_over_speed(_without_contact_samples(run), self.of))))


def _without_contact_samples(run: xr.Dataset) -> xr.Dataset:
    """Return a run without the samples that "auto" adds during contacts, so that the fraction does not depend on them."""
    options = read_configuration(run).options
    if options is None or options.samples != AUTO or run.attrs["status"] != "complete":
        return run
    return run.isel(time=np.isin(run["time"].values, np.linspace(0.0, float(run["time"][-1]), DEFAULT_SAMPLES)))


class _TorqueSource(NamedTuple):
    """Drive, actuator or motor that turns a body relative to another body or the ground."""

    name: str
    body: str
    base: str
    torque: np.ndarray  # (nt,) [N m]
    peak: str  # Variable of the run with its largest torque
    dimension: str  # Dimension of that variable
    entry: int  # Index of this source along that dimension


def _sources(run: xr.Dataset) -> list[_TorqueSource]:
    """Return the drives, actuators and motors of a run; a single drive is called "drive"."""
    mechanism = read_configuration(run).mechanism
    sources, drives, components = list[_TorqueSource](), mechanism.drives, list[Any](mechanism.components)
    for k, drive in enumerate(drives):
        torque = run["drive_torques"].values[:, k] if "drive_torques" in run else run["drive_torque"].values
        name = "drive" if len(drives) == 1 else str(drive.body)
        sources.append(_TorqueSource(name, str(drive.body), GROUND, torque, "peak_drive_torque", "drive", k))
    for kind, variable, along, peak in (
        (Actuator, "control_torque", "actuator", "peak_control_torque"),
        (Motor, "motor_torque", "motor", "motor_peak_torque"),
        (TabulatedMotor, "tabulated_motor_torque", "tabulated_motor", "tabulated_motor_peak_torque"),
    ):
        names = run[along].values.astype(str).tolist() if variable in run else []
        for part in components:
            if isinstance(part, kind) and part.name in names:
                k = names.index(part.name)
                torque = run[variable].values[:, k]
                sources.append(_TorqueSource(part.name, str(part.body), str(part.base), torque, peak, along, k))
    return sources


def _relative_speed(run: xr.Dataset, source: _TorqueSource) -> np.ndarray:
    """Return the speed of a source's body relative to its base at the samples [rad/s]."""
    speed = run["angular_velocity"].sel(body=source.body).values
    return speed if source.base == GROUND else speed - run["angular_velocity"].sel(body=source.base).values


def _source(sources: list[_TorqueSource], of: str) -> _TorqueSource:
    """Return the source with this name, or the only one if it is empty; raise `InputError` if it is not exactly one."""
    names = [source.name for source in sources]
    if not names:
        raise InputError("the run has no drive, actuator or motor", "a mechanism with driven() or controlled()")
    if of not in names and (of or len(names) > 1):
        what = f"torque of '{of}'{did_you_mean(of, names)}" if of else "torque of one of several parts, which is not named"
        raise InputError(what, ", ".join(names), f"of='{names[0]}'")
    if of and names.count(of) > 1:
        kinds = " and ".join(source.dimension.replace("_", " ") for source in sources if source.name == of)
        raise InputError(
            f"torque of '{of}', a name of {names.count(of)} parts: {kinds}",
            "an actuator or motor with another name than the drive",
            f"'{of} servo'",
        )
    return next(source for source in sources if of in (source.name, ""))


@checked
def torque_over_speed(run: xr.Dataset, of: str = "") -> xr.Dataset:
    """Return torque, relative speed and power of a drive, an actuator or a motor over time.

    Parameters
    ----------
    run : Dataset
    of : str
        Name of an actuator or a motor, "drive", or the driven body if there are several drives. Not needed if the run has
        only one of them.

    Returns
    -------
    Dataset
        Along `time`: `torque` [N m], `speed` [rad/s] of the body relative to its base, and `power` [W]. The instants are the
        samples of the run and that of the largest torque, with a speed interpolated between samples. `root_mean_square` of
        the torque [N m] over the run: of a drive integrated with the motion, of others and of part of a run over the samples.

    Raises
    ------
    InputError
        If the run has no drive, actuator or motor of that name, or several.
    """
    source = _source(_sources(run), of)
    name, body, _, torque, largest, along, number = source
    speed = _relative_speed(run, source)
    time = run["time"].values
    integrated = along == "drive" and "rms_drive_torque" in run and is_whole(run, read_configuration(run).options)
    mean = float(run["rms_drive_torque"].values[number]) if integrated else math.sqrt(time_mean(torque**2, time))
    if largest in run and f"{largest}_time" in run:
        when, size = (float(run[name].isel({along: number})) for name in (f"{largest}_time", largest))
        if math.isfinite(size) and time[0] <= when <= time[-1]:
            after = int(np.clip(np.searchsorted(time, when), 1, time.size - 1))
            sign = math.copysign(1.0, float(torque[after - 1 : after + 1][np.argmax(np.abs(torque[after - 1 : after + 1]))]))
            speed = np.insert(speed, after, np.interp(when, time, speed))
            time = np.insert(time, after, when)
            torque = np.insert(torque, after, sign * size)
    return xr.Dataset(
        {
            "torque": dataset_variable(("time",), torque, "N m", "torque"),
            "speed": dataset_variable(("time",), speed, "rad/s", "speed"),
            "power": dataset_variable(("time",), torque * speed, "W", "power"),
            "root_mean_square": dataset_variable((), mean, "N m", "root mean square of the torque"),
        },
        coords={"time": ("time", time, {"units": "s"})},
        attrs={"of": name, "body": body},
    )


def end_of_fall(run: xr.Dataset) -> float:
    """Return the instant [s] until which journals fall from the centres of their bearings and bounce; 0 if it is not known.

    It is the start of a contact that lasts longer than everything before it, of the last joint that has one.
    """
    options = read_configuration(run).options
    if options is None or options.start != "concentric":
        return 0.0
    joint, start = run["contact_joint"].values, run["contact_start"].values
    duration = np.where(np.isnan(run["contact_duration"].values), run.attrs["end"] - start, run["contact_duration"].values)
    lasting = duration > start
    settled = [start[lasting & (joint == name)] for name in clearance_joints(run)]
    return max((float(starts[0]) for starts in settled if starts.size), default=0.0)


@checked
def figures_of_merit(run: xr.Dataset, ideal: xr.Dataset, *, after: float = 0.0) -> xr.Dataset:
    """Compute figures of merit of a driven or controlled mechanism: contact, torque, energy, and errors of the motion.

    Parameters
    ----------
    run : Dataset
        Run of a mechanism with clearance joints, driven or controlled.
    ideal : Dataset
        Run of the ideal mechanism on the reference motion, over the same time.
    after : float
        Start of the evaluation [s].

    Returns
    -------
    Dataset
        For each clearance joint: `contact_fraction` of the time, number of `separations`, `in_contact_from` [s] (start of the
        contact that lasts to the end, or NaN), `peak_force` [N]. For the whole mechanism: `peak_torque` [N m],
        `torque_root_mean_square` [N m], `energy_used` [J] (integral of the positive power over the samples), `tracking_error`
        [rad] of the driven body, `position_error` [m] of the output body, and its `synchronisation_error` [m]: the distance
        from its position in the ideal mechanism at the same angle of the driven body. The latter is NaN if the ideal run
        does not reach that angle for more than half of the samples. Errors are the largest ones at the samples.

    Raises
    ------
    InputError
        If the runs have no driven body, belong to different mechanisms or are swapped.
    """
    sources = [source for source in _sources(run) if source.dimension in ("drive", "actuator")]
    if not sources:
        raise InputError("the run has no drive or actuator", "a mechanism with driven() or controlled()")
    if clearance_joints(ideal) and not clearance_joints(run):
        raise InputError(
            "the ideal run has clearance joints and the run has none", "first the run, then the ideal run", "run, ideal"
        )
    body = sources[0].body
    sources = [source for source in sources if source.body == body]
    for needed, name in ((run, "run"), (ideal, "ideal run")):
        if "slider_position" not in needed:
            raise InputError(f"the {name} has no slider_position", "a mechanism whose output body is guided")
    time = run["time"].values
    after = max(after, float(time[0]))  # a run may be cut
    part = time >= after
    if int(np.sum(part)) < 2:
        raise InputError(f"after = {after:g} s leaves fewer than two samples", f"a time before {time[-1]:g} s")
    torque = np.sum([source.torque for source in sources], axis=0)[part]
    power = np.clip(np.sum([source.torque * _relative_speed(run, source) for source in sources], axis=0)[part], 0.0, None)
    # the integrator has located the largest torque of each source between samples, but only over the whole run
    located = len(sources) == 1 and after <= time[0] and is_whole(run, read_configuration(run).options)
    peak = abs(run[sources[0].peak].values[sources[0].entry]) if located else np.max(np.abs(torque))
    integrated = located and sources[0].dimension == "drive" and "rms_drive_torque" in run
    mean = run["rms_drive_torque"].values[sources[0].entry] if integrated else np.sqrt(time_mean(torque**2, time[part]))
    (angle, place), (ideal_angle, ideal_place) = (
        (motion["angle"].sel(body=body).values, motion["slider_position"].values) for motion in (run, ideal)
    )
    wanted_angle, wanted_place = (np.interp(time, ideal["time"].values, ours) for ours in (ideal_angle, ideal_place))
    order = np.argsort(ideal_angle)
    through = np.interp(angle, ideal_angle[order], ideal_place[order])
    # the ideal run has no positions for angles outside this range
    inside = part & (angle >= wanted_angle.min()) & (angle <= wanted_angle.max())
    single = {
        "peak_torque": (peak, "N m", "largest driving torque"),
        "torque_root_mean_square": (mean, "N m", "root mean square of the driving torque"),
        "energy_used": (np.trapezoid(power, time[part]), "J", "positive driving power, integrated"),
        "tracking_error": (np.max(np.abs(angle - wanted_angle)[part]), "rad", "largest angle error of the driven body"),
        "position_error": (np.max(np.abs(place - wanted_place)[part]), "m", "largest position error of the output body"),
        "synchronisation_error": (
            np.max(np.abs(place - through)[inside]) if 2 * np.sum(inside) >= np.sum(part) else np.nan,
            "m",
            "largest distance of the output body from its ideal position at the same angle",
        ),
    }
    figures = {name: dataset_variable((), float(value), units, text) for name, (value, units, text) in single.items()}
    joints = clearance_joints(run)
    rows = np.array([_contact_figures(run, joint, after, float(time[-1])) for joint in joints]).reshape(-1, 4)
    named = (
        ("contact_fraction", "1", "fraction of the time in contact"),
        ("separations", "1", "contacts that ended"),
        ("in_contact_from", "s", "start of the contact that lasts to the end"),
        ("peak_force", "N", "largest force that the joint transmits"),
    )
    for column, (name, units, text) in enumerate(named):
        figures[name] = dataset_variable(("joint",), rows[:, column], units, text)
    return xr.Dataset(figures, coords={"joint": ("joint", joints)}, attrs={"title": "figures of merit", "after": after})


def _contact_figures(run: xr.Dataset, joint: str, after: float, end: float) -> tuple[float, float, float, float]:
    """Return a joint's fraction of time in contact, count of separations, start of its last contact [s], and peak force [N].

    All belong to the time from `after` to `end`. The start is NaN if that time does not end in contact.
    """
    chosen = run["contact_joint"].values == joint
    start, duration = run["contact_start"].values[chosen], run["contact_duration"].values[chosen]
    stop = np.where(np.isnan(duration), np.inf, start + duration)
    lasting = (start <= end) & (stop > end)
    touched = np.clip(np.minimum(stop, end) - np.maximum(start, after), 0.0, None)
    kept = float(start[lasting][0]) if np.any(lasting) else np.nan
    separations = float(np.sum((stop > after) & (stop <= end)))
    return float(np.sum(touched)) / (end - after), separations, kept, largest_force(run, joint, after, end)


def _numbers(name: str, values: object) -> tuple[float, ...]:
    """Return values as a tuple of floats; raise `InputError` if they are not numbers."""
    numbers = tuple(values) if isinstance(values, tuple | list | np.ndarray) and np.ndim(values) == 1 else ()
    if not numbers or not all(map(is_number, numbers)):
        raise InputError(f"{name} = {shown(values)} of a motor", "a tuple of numbers", EXAMPLE)
    return tuple(map(float, numbers))
