"""Figures of merit of a drive or controller: contact, force, torque, energy and errors against the ideal mechanism."""

from __future__ import annotations

import numpy as np
import xarray as xr

from scissordyn.analysis.variable import described
from scissordyn.component.actuator import Actuator
from scissordyn.errors import InputError
from scissordyn.run.advance.instants import time_mean
from scissordyn.run.answer.joint_force import clearance_joints, largest_force
from scissordyn.run.configuration import number_attribute, read_configuration


def figures_of_merit(run: xr.Dataset, ideal: xr.Dataset, *, after: float = 0.0) -> xr.Dataset:
    """Figures of merit of a drive or a controller.

    Parameters
    ----------
    run : Dataset
        Of a mechanism with clearance joints, driven or controlled.
    ideal : Dataset
        Of the ideal mechanism on the reference motion, over the same time.
    after : float
        Start of the evaluation [s].

    Returns
    -------
    Dataset
        For each clearance joint: `contact_fraction` of the time, number of `separations`, `in_contact_from` [s], the start of
        the contact that lasts to the end (NaN for none), `peak_force` [N]. For the whole: `peak_torque` [N m],
        `torque_root_mean_square` [N m], `energy_used` [J] (the positive power, integrated over the samples), `tracking_error`
        [rad] of the driven body, `position_error` [m] of the output body and its `synchronisation_error` [m]: its
        distance from the position in the ideal mechanism at the same angle of the driven body, NaN if more than half of the
        samples have an angle that the ideal run does not reach. Errors are the largest ones at the samples.

    Raises
    ------
    InputError
        If the runs have no driven body or are not of the same mechanism.
    """
    body = _driven_body(run)
    for needed, name in ((run, "run"), (ideal, "ideal run")):
        if "slider_position" not in needed:
            raise InputError(f"a {name} without slider_position", "a mechanism whose output body is guided")
    time = run["time"].values
    part = time >= after
    if int(np.sum(part)) < 2:
        raise InputError(f"after = {after:g} s leaves fewer than two samples", f"a time before {time[-1]:g} s")
    torque, speed = _torque(run, body)[part], run["angular_velocity"].sel(body=body).values[part]
    power = np.clip(torque * speed, 0.0, None)

    wanted_angle = np.interp(time, ideal["time"].values, ideal["angle"].sel(body=body).values)
    wanted_place = np.interp(time, ideal["time"].values, ideal["slider_position"].values)
    angle, place = run["angle"].sel(body=body).values, run["slider_position"].values
    order = np.argsort(ideal["angle"].sel(body=body).values)
    through = np.interp(angle, ideal["angle"].sel(body=body).values[order], ideal["slider_position"].values[order])
    inside = (
        part & (angle >= wanted_angle.min()) & (angle <= wanted_angle.max())
    )  # outside this range the ideal run has no values

    single = {
        "peak_torque": (_peak_torque(run, body, torque, after), "N m", "largest driving torque"),
        "torque_root_mean_square": (np.sqrt(time_mean(torque**2, time[part])), "N m", "root mean square of the driving torque"),
        "energy_used": (np.trapezoid(power, time[part]), "J", "positive driving power, integrated"),
        "tracking_error": (np.max(np.abs(angle - wanted_angle)[part]), "rad", "largest angle error of the driven body"),
        "position_error": (np.max(np.abs(place - wanted_place)[part]), "m", "largest position error of the output body"),
        "synchronisation_error": (
            np.max(np.abs(place - through)[inside]) if 2 * np.sum(inside) >= np.sum(part) else np.nan,
            "m",
            "largest distance of the output body from its ideal position at the same angle",
        ),
    }
    figures = {name: described((), float(value), units, text) for name, (value, units, text) in single.items()}
    joints = clearance_joints(run)
    rows = np.array([_contact(run, joint, after) for joint in joints]).reshape(-1, 4)
    named = (
        ("contact_fraction", "1", "fraction of the time in contact"),
        ("separations", "1", "contacts that ended"),
        ("in_contact_from", "s", "start of the contact that lasts to the end"),
        ("peak_force", "N", "largest force that the joint transmits"),
    )
    for column, (name, units, text) in enumerate(named):
        figures[name] = described(("joint",), rows[:, column], units, text)
    return xr.Dataset(figures, coords={"joint": ("joint", joints)}, attrs={"title": "figures of merit", "after": after})


def _driven_body(run: xr.Dataset) -> str:
    """The body of the first drive or, without one, of the first actuator."""
    mechanism = read_configuration(run).mechanism
    bodies = [drive.body for drive in mechanism.drives]
    bodies += [component.body for component in mechanism.components if isinstance(component, Actuator)]
    if not bodies:
        raise InputError("a run without a drive or an actuator", "a mechanism that is driven() or controlled()")
    return str(bodies[0])


def _torque(run: xr.Dataset, body: str) -> np.ndarray:
    """Sum of the torques of drive and actuators on the driven body [N m]."""
    total = np.zeros(run.sizes["time"])
    if "drive_torque" in run:
        total += run["drive_torque"].values
    if "control_torque" in run:
        total += run["control_torque"].values[:, _own(run, body)].sum(axis=1)
    return total


def _own(run: xr.Dataset, body: str) -> np.ndarray:
    """Which actuators act on a body."""
    components = read_configuration(run).mechanism.components
    names = [component.name for component in components if getattr(component, "body", None) == body]
    return np.isin(run["actuator"].values, names)


def _peak_torque(run: xr.Dataset, body: str, torque: np.ndarray, after: float) -> float:
    """Largest torque: as the integrator located it if it has one source and the whole run counts, else its largest sample."""
    sources = list(np.abs(run["peak_drive_torque"].values[:1])) if "drive_torque" in run else []
    if "control_torque" in run:
        sources += list(run["peak_control_torque"].values[_own(run, body)])
    located = len(sources) == 1 and after <= float(run["time"][0])
    return float(sources[0]) if located else float(np.max(np.abs(torque)))


def _contact(run: xr.Dataset, joint: str, after: float) -> tuple[float, float, float, float]:
    """Fraction of the time in contact, separations, start of the contact that lasts, largest force."""
    end = number_attribute(run, "end")
    chosen = run["contact_joint"].values == joint
    start, duration = run["contact_start"].values[chosen], run["contact_duration"].values[chosen]
    lasting = np.isnan(duration)
    stop = np.where(lasting, end, start + duration)
    touched = np.clip(stop - np.maximum(start, after), 0.0, None)
    counted = stop > after
    kept = float(start[lasting][0]) if np.any(lasting) else np.nan
    separations = float(np.sum(counted & ~lasting))
    return float(np.sum(touched)) / (end - after), separations, kept, largest_force(run, joint, after)
