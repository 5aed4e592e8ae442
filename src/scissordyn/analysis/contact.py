"""Statistics of contacts in clearance joints, and the deviation from the ideal motion that they cause."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from scissordyn.analysis.variable import Variable, dataset_variable, window
from scissordyn.casefile.configuration import ATTRIBUTE, read_configuration
from scissordyn.components.place import GROUND
from scissordyn.errors import InputError
from scissordyn.record.joint_force import largest_force, require_clearance_joints
from scissordyn.record.sampling import time_mean
from scissordyn.units import checked

QUANTILES = (0.05, 0.25, 0.5, 0.75, 0.95)  # Probabilities of the reported quantiles of forces and impulses


def contact_spans(run: xr.Dataset, joint: str) -> np.ndarray:
    """Return start and end of every contact of a joint [s], shape (contacts, 2)."""
    table = run.variables  # faster than run[name], which creates a DataArray with coordinates
    ours = table["contact_joint"].values.astype(str) == joint
    start = table["contact_start"].values[ours]
    end = start + table["contact_duration"].values[ours]
    return np.stack([start, np.where(np.isnan(end), float(table["time"].values[-1]), end)], axis=1)


def contact_groups(run: xr.Dataset, joints: Iterable[str]) -> dict[str, list[str]]:
    """Return the clearance joints by the joint or guide that they belong to; a guide has several corners."""
    if ATTRIBUTE not in run.attrs:
        return {joint: [joint] for joint in joints}
    return read_configuration(run).mechanism.contact_groups(joints)


def united_spans(run: xr.Dataset, joints: Iterable[str], start: float, end: float) -> np.ndarray:
    """Return start and end [s] of the contacts of any of the joints between two instants, shape (k, 2); they do not overlap."""
    spans = np.concatenate([contact_spans(run, joint) for joint in joints])
    united: list[list[float]] = []
    for first, last in sorted(spans[(spans[:, 1] > start) & (spans[:, 0] < end)].clip(start, end).tolist()):
        if united and first <= united[-1][1]:
            united[-1][1] = max(united[-1][1], last)
        else:
            united.append([first, last])
    return np.array(united).reshape(-1, 2)


def flight_fractions(run: xr.Dataset, start: float, end: float) -> dict[str, float]:
    """Return the fraction of the time in which no surfaces touch, by joint or guide with clearance."""
    groups = contact_groups(run, require_clearance_joints(run))
    return {
        name: 1.0 - float(np.sum(np.diff(united_spans(run, joints, start, end)))) / (end - start)
        for name, joints in groups.items()
    }


@checked
def contact_statistics(
    run: xr.Dataset, *, ideal: xr.Dataset | None = None, after: float = 0.0, until: float | None = None
) -> xr.Dataset:
    """Compute statistics of the contacts of each clearance joint: count, time, arc, forces, impulses and energy losses.

    Counts, fractions of time, peaks, impulses and losses come from the table of contacts and are as exact as the run. Arcs and
    forces over time come from the samples.

    Parameters
    ----------
    run : Dataset
    ideal : Dataset, optional
        Run of the same mechanism with ideal joints, at the same instants; adds the variables of `deviation`.
    after, until : float
        Window of the evaluation [s]; by default to the end of the run.

    Returns
    -------
    Dataset
        Variables along the clearance joints:

        * `impacts` and `impact_rate`: contacts that start in the window.
        * `contact_fraction`, `flight_fraction` of the window; `longest_flight`.
        * `contact_arc_95` and `contact_arc`: smallest arcs of the bearing with 95 % and all of the sampled contact time, in the
          frame of the bearing if the run contains its mechanism (attribute `arc_frame`).
        * `peak_force`, `peak_force_quantile`; `mean_force` over the window, flights included; `contact_force` and
          `contact_force_quantile` over the contact time.
        * `impulse` (sum), `impulse_mean`, `impulse_largest`, `impulse_quantile`.
        * `damping_loss`, `friction_loss`, `dissipated_energy` (their sum), `dissipated_power`.

        Sums and quantiles of contacts include those that start in the window. A value is NaN without contact, or if the table
        lacks the column. Quantiles of peak forces and impulses, with one value per contact, are linear between the sorted
        values (definition 7 of Hyndman and Fan 1996, doi:10.1080/00031305.1996.10473566). A quantile of the contact force is
        the smallest sampled force that is not exceeded for the fraction of the contact time (definition 1, samples weighted
        by time).

    Raises
    ------
    InputError
        If no joint has clearance, the window is empty, or the ideal run has other instants.
    """
    joints = require_clearance_joints(run)
    start, end = window(run, after, until)
    bearings = _bearing_angles(run, joints)
    columns = [
        {**_measures_of_table(run, name, start, end), **_measures_of_samples(run, name, start, end, bearings.get(name))}
        for name in joints
    ]
    variables: dict[str, Variable] = {}
    for name, (units, text) in CONTACT_STATISTICS.items():
        values = np.array([column[name] for column in columns])
        variables[name] = dataset_variable(("joint", "quantile")[: values.ndim], values, units, text)
    coordinates = {"joint": joints, "quantile": list(QUANTILES)}
    frame = "bearing" if bearings else "fixed"
    statistics = xr.Dataset(variables, coords=coordinates, attrs={"after": start, "until": end, "arc_frame": frame})
    if ideal is None:
        return statistics
    return statistics.merge(deviation(run, ideal, after=start, until=end), combine_attrs="override")


CONTACT_STATISTICS = {  # Unit and meaning of each variable of `contact_statistics`
    "impacts": ("1", "contacts that start in the window"),
    "impact_rate": ("1/s", "contacts per time"),
    "contact_fraction": ("1", "fraction of the time in contact"),
    "flight_fraction": ("1", "fraction of the time in free flight"),
    "longest_flight": ("s", "longest free flight"),
    "contact_arc_95": ("rad", "smallest arc of the bearing with 95 % of the contact time"),
    "contact_arc": ("rad", "smallest arc of the bearing with all contact"),
    "peak_force": ("N", "largest force that the joint transmits"),
    "peak_force_quantile": ("N", "quantiles of the largest force of a contact, linear between contacts"),
    "mean_force": ("N", "mean normal force over the window"),
    "contact_force": ("N", "mean normal force while in contact"),
    "contact_force_quantile": ("N", "normal force not exceeded for a fraction of the contact time"),
    "impulse": ("N s", "sum of the impulses of the contacts"),
    "impulse_mean": ("N s", "mean impulse of a contact"),
    "impulse_largest": ("N s", "largest impulse of a contact"),
    "impulse_quantile": ("N s", "quantiles of the impulse of a contact, linear between contacts"),
    "damping_loss": ("J", "energy dissipated by contact damping"),
    "friction_loss": ("J", "energy dissipated by friction"),
    "dissipated_energy": ("J", "energy dissipated in the joint"),
    "dissipated_power": ("W", "mean dissipated power"),
}


def _measures_of_table(run: xr.Dataset, joint: str, start: float, end: float) -> dict[str, float | np.ndarray]:
    """Return the statistics of one joint that come from the table of contacts: counts, times, peaks, impulses, losses."""
    spans = np.clip(contact_spans(run, joint), start, end)
    ours = run["contact_joint"].values.astype(str) == joint
    begin = run["contact_start"].values
    begun = ours & (begin >= start) & (begin < end)
    # flights lie between contacts, and at both ends of the window
    flights = np.append(spans[:, 0], end) - np.concatenate([[start], spans[:, 1]])
    touching = float(np.sum(spans[:, 1] - spans[:, 0])) / (end - start)
    impulse = _column(run, "impulse", begun)
    lost = [float(np.sum(_column(run, f"contact_{by}_loss", begun))) for by in ("damping", "friction")]
    return {
        "impacts": int(np.sum(begun)),
        "impact_rate": float(np.sum(begun)) / (end - start),
        "contact_fraction": touching,
        "flight_fraction": 1.0 - touching,
        "longest_flight": float(np.max(flights)),
        "peak_force": largest_force(run, joint, start, end),
        "peak_force_quantile": _quantiles(run["peak_force"].values[begun]),
        "impulse": float(np.sum(impulse)),
        "impulse_mean": float(np.mean(impulse)) if impulse.size else math.nan,
        "impulse_largest": float(np.max(impulse)) if impulse.size else math.nan,
        "impulse_quantile": _quantiles(impulse),
        "damping_loss": lost[0],
        "friction_loss": lost[1],
        "dissipated_energy": sum(lost),
        "dissipated_power": sum(lost) / (end - start),
    }


def _measures_of_samples(
    run: xr.Dataset, joint: str, start: float, end: float, bearing: np.ndarray | None
) -> dict[str, float | np.ndarray]:
    """Return contact arcs and mean forces of a joint; `bearing` (nt,) is the angle of a moving bearing over time [rad]."""
    time = run["time"].values
    inside = (time >= start) & (time <= end)
    place = run["eccentricity"].sel(joint=joint).transpose("time", "axis").values
    force = run["normal_force"].sel(joint=joint).values
    direction = np.arctan2(place[:, 1], place[:, 0]) - (0.0 if bearing is None else bearing)
    touching = inside & run["in_contact"].sel(joint=joint).values.astype(bool)
    # the weight of a sample is the time halfway to its neighbours, at most to the ends of the window
    middles = np.concatenate([time[:1], 0.5 * (time[1:] + time[:-1]), time[-1:]])
    standing = np.diff(np.clip(middles, start, end)) if time.size > 1 else np.ones(1)
    steps = time[inside]
    mean = float(np.trapezoid(force[inside], steps) / (steps[-1] - steps[0])) if steps.size > 1 else math.nan
    in_contact = force[touching]
    return {
        "contact_arc_95": smallest_arc(direction[touching], fraction=0.95, weights=standing[touching]),
        "contact_arc": smallest_arc(direction[touching]),
        "mean_force": mean,
        "contact_force": float(np.average(in_contact, weights=standing[touching])) if in_contact.size else math.nan,
        "contact_force_quantile": _quantiles(in_contact, weights=standing[touching]),
    }


def _column(run: xr.Dataset, name: str, selected: np.ndarray) -> np.ndarray:
    """Return the entries `selected` of a column in the table of contacts; a single NaN if the table lacks the column."""
    return run[name].values[selected] if name in run else np.full(1, math.nan)


def _quantiles(values: np.ndarray, weights: np.ndarray | None = None) -> np.ndarray:
    """Return the quantiles of values at the probabilities `QUANTILES`.

    Values without weights are interpolated linearly. With weights a quantile is the smallest value whose cumulative weight
    reaches the probability.
    """
    if not values.size:
        return np.full(len(QUANTILES), math.nan)
    if weights is None:
        return np.asarray(np.quantile(values, QUANTILES, method="linear"))
    return np.asarray(np.quantile(values, QUANTILES, method="inverted_cdf", weights=weights))


def _bearing_angles(run: xr.Dataset, joints: list[str]) -> dict[str, np.ndarray]:
    """Return the angle of each joint's bearing over time; empty if the run does not contain its mechanism."""
    if ATTRIBUTE not in run.attrs:
        return {}
    joints_of_run = read_configuration(run).mechanism.joints
    bodies = {joint.name: joint.bearing[0] for joint in joints_of_run if joint.name in joints}
    still = np.zeros(run.sizes["time"])
    return {name: still if body == GROUND else run["angle"].sel(body=body).values for name, body in bodies.items()}


def smallest_arc(angles: ArrayLike, *, fraction: float = 1.0, weights: ArrayLike | None = None) -> float:
    """Return the smallest arc of a circle that contains a given fraction of the total weight of points on the circle.

    With the angles sorted around the circle and w_i their weights, it is the smallest a_j - a_i with

        w_i + ... + w_j >= fraction sum w

    where the arc may cross angle zero. The arc of all points is 2 pi less the largest gap (circular range, Mardia and Jupp
    2000, Directional Statistics, doi:10.1002/9780470316979).

    Shapes: `angles` (n,) [rad], `weights` (n,).
    """
    if not 0.0 < fraction <= 1.0:
        raise InputError(f"fraction = {fraction!r}", "a number > 0 and <= 1")
    around = np.mod(np.asarray(angles, float), 2.0 * np.pi)
    weight = np.ones_like(around) if weights is None else np.asarray(weights, float)
    if around.ndim != 1 or weight.shape != around.shape or np.any(weight < 0.0):
        raise InputError(f"angles of shape {around.shape} with weights of shape {weight.shape}", "one weight >= 0 per angle")
    order = np.argsort(around[weight > 0.0])
    around, weight = around[weight > 0.0][order], weight[weight > 0.0][order]
    if not around.size:
        return float("nan")
    twice = np.concatenate([around, around + 2.0 * np.pi])
    cumulative = np.concatenate([[0.0], np.cumsum(np.concatenate([weight, weight]))])
    first = np.arange(around.size)
    # round-off in the sum must not require more points than exist
    needed = fraction * cumulative[around.size] * (1.0 - 1e-12)
    last = np.minimum(np.searchsorted(cumulative, cumulative[first] + needed, side="left") - 1, first + around.size - 1)
    return float(np.min(twice[last] - twice[first]))


ARRAY_BAR = re.compile(r"unit (\d+)/(bar \d+)")  # Pattern of a bar's name in an array, "unit 2/bar 1"


def deviation(run: xr.Dataset, ideal: xr.Dataset, *, after: float = 0.0, until: float | None = None) -> xr.Dataset:
    """Compute the deviation from the ideal motion: position error, and synchronisation error between the units of an array.

    With e_k the angle of a bar minus that of the ideal mechanism in unit k, the synchronisation error is the spread between the
    units, largest over the bars of a unit:

        s(t) = max_bars ( max_k e_k(t) - min_k e_k(t) )
    """
    start, end = window(run, after, until)
    times, ideal_times = run["time"].values, ideal["time"].values[: run.sizes["time"]]
    if times.shape != ideal_times.shape or not np.allclose(
        times, ideal_times, rtol=0.0, atol=1e-9 * float(times[-1] - times[0])
    ):
        raise InputError(
            f"the ideal run has {ideal.sizes['time']} instants up to {float(ideal['time'].values[-1]):g} s, the run has "
            f"{times.size} instants up to {times[-1]:g} s",
            "a run of the mechanism with ideal joints and the same options `until` and `samples`",
            "simulate(arm.ideal(), until=..., samples=...)",
        )
    bodies = [str(name) for name in run["body"].values]
    if bodies != [str(name) for name in ideal["body"].values]:
        raise InputError("the ideal run has other bodies", "a run of the same mechanism with ideal joints")
    inside = (times >= start) & (times <= end)
    if not np.any(inside):
        raise InputError(f"no sample between {start:g} s and {end:g} s", "a window with samples")

    def difference(name: str, *dims: str) -> np.ndarray:
        ours, theirs = (part[name].transpose("time", *dims).values for part in (run, ideal))
        gap: np.ndarray = (ours - theirs[: times.size])[inside]
        return gap

    variables: dict[str, Variable] = {}

    def extremes(name: str, values: np.ndarray, units: str, text: str) -> None:
        dims = ("body",) if values.ndim > 1 else ()
        mean_square = time_mean(np.square(values), times[inside])
        variables[f"{name}_max"] = dataset_variable(dims, np.max(np.abs(values), axis=0), units, f"largest {text}")
        variables[f"{name}_rms"] = dataset_variable(dims, np.sqrt(mean_square), units, f"root mean square {text}")

    apart = np.linalg.norm(difference("position", "body", "axis"), axis=-1)
    extremes("position_error", apart, "m", "error of position")
    output_body = str(read_configuration(run).mechanism.output_body) if ATTRIBUTE in run.attrs else ""
    if "slider_position" in run and "slider_position" in ideal:
        extremes("output_error", difference("slider_position"), "m", "error of the output")
    elif output_body in bodies:
        extremes("output_error", apart[:, bodies.index(output_body)], "m", "error of the output")
    if units := _equal_bars(bodies):
        turned = np.mod(difference("angle", "body") + np.pi, 2.0 * np.pi) - np.pi
        spread = np.max([np.ptp(turned[:, columns], axis=1) for columns in units], axis=0)
        text = "spread between units of the error of a bar's angle"
        variables["synchronisation_error"] = dataset_variable(("time",), spread, "rad", text)
        extremes("synchronisation_error", spread, "rad", text)
    coordinates = {"body": bodies, "time": dataset_variable(("time",), times[inside], "s", "time")}
    return xr.Dataset(variables, coords=coordinates, attrs={"after": start, "until": end})


def _equal_bars(bodies: list[str]) -> list[list[int]]:
    """Return one list for each bar of a scissor unit: its body indices in all units; empty for a single unit."""
    parts: dict[str, list[int]] = {}
    for column, name in enumerate(bodies):
        if matched := ARRAY_BAR.fullmatch(name):
            parts.setdefault(matched[2], []).append(column)
    return [columns for columns in parts.values() if len(columns) > 1]
