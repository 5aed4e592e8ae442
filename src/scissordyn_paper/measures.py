"""Numbers of a run by which the paper's statements are checked."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import xarray as xr

from scissordyn.analysis.contact import contact_spans, smallest_arc
from scissordyn.kinematics.path import smooth_peak

JOINT = "A"  # Name of the joint with clearance

SETTLING_TIME = 5e-3  # The paper's first interval [s]: "the fluctuation of the curves within 0.005 s"
LATE_TIME = 0.03  # The paper's "when the working time exceeds 0.03 s" [s]
CONTINUOUS_FRACTION = 0.99  # Fraction of time in contact from which contact is called continuous
LAST_FRACTION = 0.2  # Fraction of a run, at its end, in which contact that becomes continuous "eventually" is continuous
CENTRAL_PART = 0.95  # Fraction of the contact time that the contact arc contains


@dataclass(frozen=True)
class Deviation:
    """Size of the difference between a quantity of a run and of the run with ideal joints."""

    largest: float  # Largest difference before `SETTLING_TIME`, as a fraction of the common range of both curves
    before: float  # Root mean square of the difference before `SETTLING_TIME` [SI]
    after: float  # Root mean square of the difference after `SETTLING_TIME` [SI]
    early: float  # Fraction of the integrated squared difference that lies before `SETTLING_TIME`


@dataclass(frozen=True)
class Measures:
    """Numbers of one run, compared with the run with ideal joints."""

    peak_force: float  # Largest normal force in the whole run [N]
    late_peak_force: float  # Largest normal force after `LATE_TIME` [N]
    # Smallest normal force; zero in free flight, negative where a constrained contact is in compression [N]
    smallest_force: float
    ideal_force: float  # Largest reaction at the same joint without clearance [N]
    peak_torque: float  # Largest magnitude of the driving torque [N m]
    ideal_torque: float  # Largest magnitude of the driving torque with ideal joints [N m]
    impacts: int  # Number of contacts that start in the whole run
    early_impacts: int  # Number of contacts that start before `LATE_TIME`
    late_impacts: int  # Number of contacts that start from `LATE_TIME` on
    settled_impacts: int  # Number of contacts that start from `SETTLING_TIME` on
    whole_fraction: float  # Fraction of the whole run in contact
    settled_fraction: float  # Fraction of the time from `SETTLING_TIME` on in contact
    final_fraction: float  # Fraction of the last fifth of the run in contact
    late_rate: float  # Contacts that start per second from `LATE_TIME` on [1/s]
    settled_rate: float  # Contacts that start per second from `SETTLING_TIME` on [1/s]
    deviations: dict[str, Deviation]  # Deviation of each quantity
    position_deviation: float  # Largest difference of the slider's displacement, as a fraction of the range of both curves
    angle_deviation: float  # Largest difference of the angle of bar 2, as a fraction of the range of both curves
    # Root mean square of the slider acceleration's difference from the ideal one after `SETTLING_TIME`, over the root mean
    # square of the ideal one
    irregularity: float
    arc: float  # Smallest arc of the bearing with 95 % of the contact time [rad]
    trusted_until: float  # Predictability horizon [s]
    end: float  # End of the run [s]

    @property
    def arc_degrees(self) -> float:
        """Smallest arc of the bearing with 95 % of the contact time [deg]."""
        return math.degrees(self.arc)


@dataclass(frozen=True, eq=False)
class Curves:
    """Curves and contacts of a run with clearance, from which its measures are computed."""

    time: np.ndarray  # (nt,) [s]
    series: dict[str, np.ndarray]  # (nt,) Motion of the slider and of the free bar, by quantity
    normal: np.ndarray  # (nt,) Normal force [N]
    place: np.ndarray  # (nt, 2) Eccentricity [m]
    touching: np.ndarray  # (nt,) True in contact
    spans: np.ndarray  # (contacts, 2) Start and end of each contact [s]
    peak: np.ndarray  # (contacts,) Largest normal force of each contact [N]
    when: np.ndarray  # (contacts,) Instant of the largest normal force [s]
    torque: float  # Largest magnitude of the driving torque [N m]
    trusted_until: float = math.nan  # Predictability horizon [s]


def curves_of(run: xr.Dataset) -> Curves:
    """Return the curves and contacts of a run."""
    spans = contact_spans(run, JOINT)
    return Curves(
        time=run.variables["time"].values,
        series=_series(run),
        normal=_at_joint(run, "normal_force", "time"),
        place=_at_joint(run, "eccentricity", "time", "axis"),
        touching=_at_joint(run, "in_contact", "time").astype(bool),
        spans=spans,
        peak=run.variables["peak_normal_force"].values,
        when=spans[:, 0] + run.variables["peak_normal_time"].values,
        torque=float(run.variables["peak_drive_torque"].values[0]),
        trusted_until=float(run.attrs.get("trusted_until", math.nan)),
    )


@dataclass(frozen=True, eq=False)
class IdealMotion:
    """Motion with ideal joints, with which the runs of the same drive are compared."""

    curves: dict[str, np.ndarray]  # (nt,) Motion of the slider and of bar 2, by quantity
    force: float  # Largest reaction at the joint [N]
    torque: float  # Largest magnitude of the driving torque [N m]


def ideal_motion(run: xr.Dataset) -> IdealMotion:
    """Return motion, largest reaction and largest torque of a run with ideal joints."""
    # at a right angle the ideal reactions are not determined: that instant is left out
    reaction = np.hypot(*_at_joint(run, "reaction", "axis", "time"))
    force = smooth_peak(run.variables["time"].values, reaction)[0]
    curves = {name: values.copy() for name, values in _series(run).items()}  # the run itself need not stay in memory
    return IdealMotion(curves, force, float(run.variables["peak_drive_torque"].values[0]))


def measure(run: xr.Dataset | Curves, ideal: xr.Dataset | IdealMotion) -> Measures:
    """Compute the measures of a run with clearance, compared with the run with ideal joints."""
    expected = ideal if isinstance(ideal, IdealMotion) else ideal_motion(ideal)
    drawn = run if isinstance(run, Curves) else curves_of(run)
    time, peak, when, normal = drawn.time, drawn.peak, drawn.when, drawn.normal
    end = float(time[-1])
    start, stop = drawn.spans.T
    before = time <= SETTLING_TIME
    curves, wanted = drawn.series, expected.curves
    differences = {name: curves[name] - wanted[name] for name in _SERIES}
    ranges = {name: float(np.ptp([curves[name], wanted[name]])) for name in _SERIES}
    acceleration = wanted["slider_acceleration"][~before]
    return Measures(
        peak_force=float(np.max(peak, initial=0.0)),
        late_peak_force=max(
            float(np.max(peak[when >= LATE_TIME], initial=0.0)),
            # a contact with an earlier peak can still last
            float(np.max(normal[time >= LATE_TIME])),
        ),
        smallest_force=float(np.min(normal)),
        ideal_force=expected.force,
        peak_torque=drawn.torque,
        ideal_torque=expected.torque,
        impacts=start.size,
        early_impacts=int(np.sum(start < LATE_TIME)),
        late_impacts=int(np.sum(start >= LATE_TIME)),
        settled_impacts=int(np.sum(start >= SETTLING_TIME)),
        whole_fraction=_fraction(start, stop, 0.0, end),
        settled_fraction=_fraction(start, stop, SETTLING_TIME, end),
        final_fraction=_fraction(start, stop, (1.0 - LAST_FRACTION) * end, end),
        late_rate=float(np.sum(start >= LATE_TIME)) / (end - LATE_TIME),
        settled_rate=float(np.sum(start >= SETTLING_TIME)) / (end - SETTLING_TIME),
        deviations={
            name: Deviation(
                largest=_ratio(np.max(np.abs(values[before])), ranges[name]),
                before=_rms(values[before]),
                after=_rms(values[~before]),
                early=_ratio(np.sum(values[before] ** 2), np.sum(values**2)),
            )
            for name, values in differences.items()
        },
        position_deviation=_ratio(np.max(np.abs(differences["slider_position"])), ranges["slider_position"]),
        angle_deviation=_ratio(np.max(np.abs(differences["angle"])), ranges["angle"]),
        irregularity=_rms(differences["slider_acceleration"][~before]) / _rms(acceleration),
        arc=_arc(drawn),
        trusted_until=drawn.trusted_until,
        end=end,
    )


_SERIES = (
    "slider_position",
    "slider_velocity",
    "slider_acceleration",
    "angle",
    "angular_velocity",
    "angular_acceleration",
)

FREE_BAR = "unit 1/bar 2"  # The bar whose response figure 6 shows; it is not driven in either variant


def _series(run: xr.Dataset) -> dict[str, np.ndarray]:
    """Return the motion of the slider and of the free bar over time, by quantity."""
    bar = run.variables["body"].values.tolist().index(FREE_BAR)
    values = {name: run.variables[name].values for name in _SERIES}
    return {name: each if name.startswith("slider") else each[:, bar] for name, each in values.items()}


def _at_joint(run: xr.Dataset, name: str, *dims: str) -> np.ndarray:
    """Return the values of a variable of a run at joint A, with the dimensions in the order `dims`."""
    joint = run.variables["joint"].values.tolist().index(JOINT)
    # run[name] would make a DataArray with its coordinates
    return np.asarray(run.variables[name].isel(joint=joint).transpose(*dims).values)


def _ratio(part: float, whole: float) -> float:
    """Return the ratio of a part to the whole; 0 if the whole is 0."""
    return float(part) / float(whole) if whole else 0.0


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))


def _fraction(start: np.ndarray, stop: np.ndarray, since: float, end: float) -> float:
    """Return the fraction of the time from `since` to `end` that lies inside the intervals from `start` to `stop`."""
    return float(np.sum(np.clip(np.minimum(stop, end) - np.maximum(start, since), 0.0, None))) / (end - since)


def _arc(drawn: Curves) -> float:
    place = drawn.place[drawn.touching]
    return smallest_arc(np.arctan2(place[:, 1], place[:, 0]), fraction=CENTRAL_PART)
