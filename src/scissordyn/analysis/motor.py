"""Torque and speed that a drive, an actuator or a motor needs in a run, against the curve of a motor."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr

from scissordyn.analysis.variable import described
from scissordyn.component.actuator import Actuator
from scissordyn.component.motor import Motor
from scissordyn.component.place import GROUND
from scissordyn.component.tabulated_motor import TabulatedMotor
from scissordyn.errors import InputError, did_you_mean
from scissordyn.run.configuration import read_configuration
from scissordyn.run.options import AUTO, EQUALLY_SPACED

SAMPLE = "sd.MotorCurve((0.0, 10.0, 30.0), (60.0, 60.0, 0.0))"


@dataclass(frozen=True)
class MotorCurve:
    """Largest torque that a run needs, as a fraction of what the motor gives at its speed.

    Called with a run it returns that fraction, so that it is a measure of a study: above 1 the motor is too weak.

    Parameters
    ----------
    speeds : tuple of float
        Of the motor [rad/s], ascending from 0; beyond the last one it gives nothing.
    torques : tuple of float
        That it gives at these speeds [N m], linear in between; in both senses of rotation the same.
    of : str
        Name of the actuator or motor of the mechanism, or "drive"; not needed where there is one of them only.
    ratio : float
        Of a gear without losses: turns of the motor for one turn of the joint.
    """

    speeds: tuple[float, ...]
    torques: tuple[float, ...]
    of: str = ""
    ratio: float = 1.0

    def __post_init__(self) -> None:
        for name in ("speeds", "torques"):
            object.__setattr__(self, name, tuple(map(float, getattr(self, name))))
        speeds, torques = np.array(self.speeds), np.array(self.torques)
        if speeds.size < 2 or speeds.size != torques.size:
            raise InputError(f"a motor with {speeds.size} speeds and {torques.size} torques", "as many, at least two", SAMPLE)
        if not (np.all(np.isfinite(speeds)) and speeds[0] == 0.0 and np.all(np.diff(speeds) > 0.0)):
            came = ", ".join(f"{speed:g}" for speed in speeds)
            raise InputError(f"speeds of a motor: {came} rad/s", "ascending from 0", SAMPLE)
        if not (np.all(np.isfinite(torques)) and np.all(torques >= 0.0) and np.any(torques > 0.0)):
            raise InputError(
                f"torques of a motor: {', '.join(f'{torque:g}' for torque in torques)} N m", "numbers >= 0", SAMPLE
            )
        if not 0.0 < self.ratio < math.inf:
            raise InputError(f"a gear ratio of {self.ratio:g}", "a number > 0", "ratio=50.0")

    def available(self, speed: np.ndarray) -> np.ndarray:
        """Torque at the joint at given speeds of the joint [N m]; 0 beyond the curve."""
        return np.asarray(self.ratio * np.interp(self.ratio * np.abs(speed), self.speeds, self.torques, right=0.0))

    def fraction(self, needed: xr.Dataset) -> np.ndarray:
        """Torque as a fraction of what the motor gives, along the time of `torque_over_speed`; infinite beyond the curve."""
        torque, speed = np.abs(needed["torque"].values), needed["speed"].values
        available, beyond = self.available(speed), self.ratio * np.abs(speed) > self.speeds[-1]
        with np.errstate(divide="ignore", invalid="ignore"):
            share = np.where(torque > 0.0, torque / available, 0.0)
        return np.where(beyond, np.inf, share)

    def __call__(self, run: xr.Dataset) -> float:
        """The largest fraction in a run."""
        return float(np.max(self.fraction(torque_over_speed(_equally_spaced(run), self.of))))


def _equally_spaced(run: xr.Dataset) -> xr.Dataset:
    """A run without the further samples of "auto", so that a fraction does not depend on whether these were computed."""
    options = read_configuration(run).options
    if options is None or options.samples != AUTO or run.attrs["status"] != "complete":
        return run
    return run.isel(time=np.isin(run["time"].values, np.linspace(0.0, float(run["time"][-1]), EQUALLY_SPACED)))


def torque_over_speed(run: xr.Dataset, of: str = "") -> xr.Dataset:
    """Torque and relative speed of a drive, an actuator or a motor.

    Parameters
    ----------
    run : Dataset
    of : str
        Name of an actuator or a motor, "drive", or the driven body where there are several drives; not needed where there is
        one of all these only.

    Returns
    -------
    Dataset
        Along `time`: `torque` [N m], `speed` [rad/s] of the body against its base, and `power` [W]: at the samples of the run
        and, between them, at the located largest torque, with the speed of the sample before it.

    Raises
    ------
    InputError
        If there is no such part.
    """
    mechanism = read_configuration(run).mechanism
    sources: dict[str, tuple[str, str, np.ndarray, str, str, int]] = {}
    drives = list(mechanism.drives)
    for k, drive in enumerate(drives):
        values = run["drive_torques"].values[:, k] if "drive_torques" in run else run["drive_torque"].values
        name = "drive" if len(drives) == 1 else str(drive.body)
        sources[name] = (str(drive.body), GROUND, values, "peak_drive_torque", "drive", k)
    for kind, variable, along, peak in (
        (Actuator, "control_torque", "actuator", "peak_control_torque"),
        (Motor, "motor_torque", "motor", "motor_peak_torque"),
        (TabulatedMotor, "tabulated_motor_torque", "tabulated_motor", "tabulated_motor_peak_torque"),
    ):
        names = run[along].values.astype(str).tolist() if variable in run else []
        components: tuple[Any, ...] = mechanism.components
        for component in components:
            if isinstance(component, kind) and component.name in names:
                k = names.index(component.name)
                body, base = str(component.body), str(component.base)
                sources[str(component.name)] = (body, base, run[variable].values[:, k], peak, along, k)
    if not sources:
        raise InputError("a run without a drive, an actuator or a motor", "a mechanism that is driven() or controlled()")
    if of not in sources and (of or len(sources) > 1):
        what = f"torque of '{of}'{did_you_mean(of, sources)}" if of else "the torque of one of several"
        raise InputError(what, ", ".join(sources), f"of='{next(iter(sources))}'")
    body, base, torque, largest, along, k = sources[of or next(iter(sources))]
    speed = run["angular_velocity"].sel(body=body).values
    if base != GROUND:
        speed = speed - run["angular_velocity"].sel(body=base).values
    time = run["time"].values
    if largest in run and f"{largest}_time" in run:
        when, size = (float(run[name].isel({along: k})) for name in (f"{largest}_time", largest))
        if math.isfinite(size) and time[0] <= when <= time[-1]:
            after = int(np.clip(np.searchsorted(time, when), 1, time.size - 1))
            sign = math.copysign(1.0, float(torque[after - 1 : after + 1][np.argmax(np.abs(torque[after - 1 : after + 1]))]))
            time, speed = np.insert(time, after, when), np.insert(speed, after, speed[after - 1])
            torque = np.insert(torque, after, sign * size)
    return xr.Dataset(
        {
            "torque": described(("time",), torque, "N m", "torque"),
            "speed": described(("time",), speed, "rad/s", "speed"),
            "power": described(("time",), torque * speed, "W", "power"),
        },
        coords={"time": ("time", time, {"units": "s"})},
        attrs={"of": of or next(iter(sources)), "body": body},
    )
