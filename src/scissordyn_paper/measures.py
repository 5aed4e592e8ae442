"""Measures of one run for the paper's statements."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import xarray as xr

from scissordyn.analysis.contact import contact_spans, smallest_arc
from scissordyn.kinematics.path import smooth_peak

JOINT = "A"

SETTLING_TIME = 5e-3  # The paper's first interval [s]: "the fluctuation of the curves within 0.005 s"
LATE_TIME = 0.03  # The paper's "when the working time exceeds 0.03 s" [s]
CONTINUOUS_FRACTION = 0.99  # Fraction of time in contact from which contact is called continuous
LAST_FRACTION = 0.2  # Fraction of a run that is its end, for contact that becomes continuous "eventually"
CENTRAL_PART = 0.95  # Fraction of the contact time inside the contact arc


@dataclass(frozen=True)
class Deviation:
    """Difference of a quantity from that of the ideal run."""

    largest: float  # Largest difference before `SETTLING_TIME`, as a fraction of the common range of both curves
    before: float  # Root mean square of the difference before `SETTLING_TIME` and after it [SI]
    after: float
    early: float  # Fraction of the integral of the squared difference before `SETTLING_TIME`


@dataclass(frozen=True)
class Measures:
    """Numbers of one run, compared with the run with ideal joints."""

    peak_force: float  # Largest normal force, in the whole run and after `LATE_TIME` [N]
    late_peak_force: float
    # Smallest normal force; zero in free flight, negative where a constrained contact is in compression [N]
    smallest_force: float
    ideal_force: float  # Largest reaction at the same joint without clearance [N]
    peak_torque: float  # Largest driving torque by magnitude, with clearance and without [N m]
    ideal_torque: float
    impacts: int  # Contacts that start: all, before `LATE_TIME`, from `LATE_TIME` on, from `SETTLING_TIME` on
    early_impacts: int
    late_impacts: int
    settled_impacts: int
    whole_fraction: float  # Fraction of time in contact: in the whole run, from `SETTLING_TIME` on, in the last fifth
    settled_fraction: float
    final_fraction: float
    late_rate: float  # Impacts per second from `LATE_TIME` on and from `SETTLING_TIME` on [1/s]
    settled_rate: float
    deviations: dict[str, Deviation]  # Deviation of each quantity
    # Largest difference of the slider's displacement and of bar 2's angle, as a fraction of that range
    position_deviation: float
    angle_deviation: float
    # Root mean square of the slider acceleration's difference from the ideal one after `SETTLING_TIME`, over the root mean
    # square of the ideal one
    irregularity: float
    arc: float  # Smallest arc of the bearing with 95 % of the contact time [rad]
    trusted_until: float  # [s]
    end: float

    @property
    def arc_degrees(self) -> float:
        """The arc [deg]."""
        return math.degrees(self.arc)


@dataclass(frozen=True, eq=False)
class Curves:
    """Curves that are measured in a run with clearance."""

    time: np.ndarray  # (nt,) [s]
    series: dict[str, np.ndarray]  # (nt,) Motion of the slider and of the free bar, by quantity
    normal: np.ndarray  # (nt,) Normal force [N]
    place: np.ndarray  # (nt, 2) Eccentricity [m]
    touching: np.ndarray  # (nt,) Whether in contact
    spans: np.ndarray  # (contacts, 2) Start and end [s]
    peak: np.ndarray  # (contacts,) Largest normal force [N], and when [s]
    when: np.ndarray
    torque: float  # Largest driving torque by magnitude [N m]
    trusted_until: float = math.nan  # [s]


def curves_of(run: xr.Dataset) -> Curves:
    """The curves of a run."""
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
    """Ideal motion with which the runs on one drive are compared."""

    curves: dict[str, np.ndarray]  # (nt,) Motion of the slider and of bar 2, by quantity
    force: float  # Largest reaction at the joint [N] and largest driving torque by magnitude [N m]
    torque: float


def ideal_motion(run: xr.Dataset) -> IdealMotion:
    """Return the motion of the run with ideal joints, for comparison."""
    # at a right angle the ideal reactions are not determined: that instant is left out
    reaction = np.hypot(*_at_joint(run, "reaction", "axis", "time"))
    force = smooth_peak(run.variables["time"].values, reaction)[0]
    curves = {name: values.copy() for name, values in _series(run).items()}  # the run itself need not stay in memory
    return IdealMotion(curves, force, float(run.variables["peak_drive_torque"].values[0]))


def measure(run: xr.Dataset | Curves, ideal: xr.Dataset | IdealMotion) -> Measures:
    """Measure a run."""
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
                largest=_part(np.max(np.abs(values[before])), ranges[name]),
                before=_rms(values[before]),
                after=_rms(values[~before]),
                early=_part(np.sum(values[before] ** 2), np.sum(values**2)),
            )
            for name, values in differences.items()
        },
        position_deviation=_part(np.max(np.abs(differences["slider_position"])), ranges["slider_position"]),
        angle_deviation=_part(np.max(np.abs(differences["angle"])), ranges["angle"]),
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
    """The curves of the slider and of the free bar."""
    bar = run.variables["body"].values.tolist().index(FREE_BAR)
    values = {name: run.variables[name].values for name in _SERIES}
    return {name: each if name.startswith("slider") else each[:, bar] for name, each in values.items()}


def _at_joint(run: xr.Dataset, name: str, *dims: str) -> np.ndarray:
    """The values of a variable at the joint, along some dimensions; run[name] would make a DataArray with its coordinates."""
    joint = run.variables["joint"].values.tolist().index(JOINT)
    return np.asarray(run.variables[name].isel(joint=joint).transpose(*dims).values)


def _part(part: float, whole: float) -> float:
    """A ratio; 0/0 is 0."""
    return float(part) / float(whole) if whole else 0.0


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))


def _fraction(start: np.ndarray, stop: np.ndarray, since: float, end: float) -> float:
    """Fraction of the time from `since` to `end` inside the intervals."""
    return float(np.sum(np.clip(np.minimum(stop, end) - np.maximum(start, since), 0.0, None))) / (end - since)


def _arc(drawn: Curves) -> float:
    place = drawn.place[drawn.touching]
    return smallest_arc(np.arctan2(place[:, 1], place[:, 0]), fraction=CENTRAL_PART)
