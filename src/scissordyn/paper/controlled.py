"""What control achieves, with and without it, on three kinds of course.

The stroke at 150 rpm is the paper's, and so is holding the contact as a constraint. The deployment and the periodic drive are
ours: slow enough for a motor, and with what the paper leaves out, a limited torque and a gust.
"""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np
import xarray as xr

from scissordyn.analysis.merit import figures_of_merit
from scissordyn.control.delayed.extended import ExtendedDelayedFeedback
from scissordyn.control.delayed.pyragas import Pyragas
from scissordyn.control.tracking.feed_forward import FeedForward
from scissordyn.control.tracking.pid import PID
from scissordyn.errors import ScissordynError
from scissordyn.model.drive import ConstantSpeed, Cycloidal, Harmonic, Motion, tabulated
from scissordyn.model.element import Force
from scissordyn.model.mechanism import Mechanism
from scissordyn.model.record import to_plain
from scissordyn.paper.cases import ARRAY, SPEED, STROKE, Choice, PaperCase
from scissordyn.paper.measures import JOINT
from scissordyn.simulation.feed_forward import feed_forward
from scissordyn.simulation.interrupt import pass_on
from scissordyn.simulation.run import simulate
from scissordyn.units import degrees

__all__ = ["CONTROLLED_RUNS", "COURSES", "ControlledRun", "Course", "compute", "ideal_of", "merits", "mismatch"]

PROPORTIONAL, DERIVATIVE = 2e4, 1500.0
"""Gains of the practical controller [N m/rad, N m s/rad]."""

LIMIT, RAMP = 770.0, 0.02
"""Its torque limit on the deployment, 1.5 times the ideal torque [N m], and the time in which that rises from zero [s]."""

LANDING = -1000.0
"""Its brake on the rate of the eccentricity during the stroke [N s]."""

SERVO = PID(2e5, derivative=4e3)
"""Holds the periodic course; delayed feedback comes on top of it."""

PERIOD = 0.5
SINCE = 40.0 * PERIOD
"""Of the slow periodic course [s], and from when on it is looked at."""

GUST = Force(
    "gust",
    ("slider", "centre"),
    (0.0, -50.0),
    course=tabulated(lambda t: math.sin(math.pi * (t - 0.6) / 0.2) ** 2 if 0.6 < t < 0.8 else 0.0, until=1.2, points=4801),
)
"""50 N on the slider, from 0.6 to 0.8 s."""


@dataclass(frozen=True)
class Course:
    """What the driven bar is to do.

    Parameters
    ----------
    title : str
    motion : Motion
        The angle wanted.
    angle, until : float
        Angle at the start [rad], end of the run [s].
    samples : int
    after : float
        Only what happens from then on counts [s].
    gust : bool
        Whether the slider is disturbed; the ideal mechanism never is.
    """

    title: str
    motion: Motion
    angle: float
    until: float
    samples: int
    after: float = 0.0
    gust: bool = False

    def mechanism(self) -> Mechanism:
        """The array with its loose joint, not driven."""
        described = PaperCase(ARRAY, choice=Choice(angle=self.angle)).described().mechanism
        return dataclasses.replace(described, drives=(), elements=(GUST,) if self.gust else ())


STROKE_COURSE = Course("stroke at 150 rpm", ConstantSpeed(SPEED), degrees(30), STROKE, 2001)
DEPLOYMENT = Course(
    "deployment from 30 to 60 deg in 1 s, gust of 50 N",
    Cycloidal(degrees(30), degrees(60), 1.0),
    degrees(30),
    1.2,
    24_001,
    gust=True,
)
SWINGING = Course(
    "periodic drive, 45 ± 15 deg at 2 Hz, periods 40 to 60",
    Harmonic(mean=degrees(45), amplitude=degrees(15), frequency=2.0 * math.pi / PERIOD),
    degrees(45),
    60.0 * PERIOD,
    30_001,
    after=SINCE,
)
COURSES = {"stroke": STROKE_COURSE, "deployment": DEPLOYMENT, "periodic": SWINGING}

Scheme = Literal[
    "ideal", "prescribed", "feed-forward alone", "feed-forward, feedback", "the same with brake", "servo", "pyragas", "extended"
]


@dataclass(frozen=True)
class ControlledRun:
    """One course under one scheme.

    Parameters
    ----------
    course : {"stroke", "deployment", "periodic"}
    scheme : str
        "ideal" and "prescribed" drive the bar along the course whatever torque that takes.
    """

    course: Literal["stroke", "deployment", "periodic"]
    scheme: Scheme

    @property
    def name(self) -> str:
        """Of its file."""
        return f"{self.course}_{self.scheme.replace(', ', '-').replace(' ', '-')}"

    @property
    def toml(self) -> str:
        """The mechanism as plain data: what the run depends on."""
        return json.dumps(to_plain(self.mechanism()))

    def mechanism(self) -> Mechanism:
        """The array with drive or controllers."""
        course = COURSES[self.course]
        arm = course.mechanism()
        if self.scheme == "ideal":
            return dataclasses.replace(arm.tighten(), elements=()).driven(course.motion)
        if self.scheme == "prescribed":
            return arm.driven(course.motion)
        return _SCHEMES[self.course, self.scheme](arm, course)


def _fed(law: FeedForward) -> Callable[[Mechanism, Course], Mechanism]:
    def controlled(arm: Mechanism, course: Course) -> Mechanism:
        torque = feed_forward(arm, course.motion, until=course.until)
        sensor = JOINT if law.senses else None
        return arm.controlled(law, reference=course.motion, feed_forward=torque, sensor=sensor)

    return controlled


def _delayed(law: Pyragas | ExtendedDelayedFeedback | None) -> Callable[[Mechanism, Course], Mechanism]:
    def controlled(arm: Mechanism, course: Course) -> Mechanism:
        held = arm.controlled(SERVO, reference=course.motion)
        return held if law is None else held.controlled(law, sensor=("slider", "centre"))

    return controlled


_SCHEMES: dict[tuple[str, str], Callable[[Mechanism, Course], Mechanism]] = {
    # at full speed from the start a limit as on the deployment would only let the bar fall
    ("stroke", "feed-forward, feedback"): _fed(FeedForward(PROPORTIONAL, DERIVATIVE)),
    ("stroke", "the same with brake"): _fed(FeedForward(PROPORTIONAL, DERIVATIVE, landing=LANDING)),
    ("deployment", "feed-forward alone"): _fed(FeedForward(limit=LIMIT)),
    ("deployment", "feed-forward, feedback"): _fed(FeedForward(PROPORTIONAL, DERIVATIVE, limit=LIMIT, ramp=RAMP)),
    ("periodic", "servo"): _delayed(None),
    ("periodic", "pyragas"): _delayed(Pyragas(-1000.0, PERIOD, "sensor_rate_y", limit=2000.0)),
    ("periodic", "extended"): _delayed(ExtendedDelayedFeedback(-1500.0, PERIOD, 0.5, "sensor_rate_y", limit=2000.0)),
}

CONTROLLED_RUNS = (
    *(ControlledRun("stroke", scheme) for scheme in ("ideal", "feed-forward, feedback", "the same with brake")),
    *(
        ControlledRun("deployment", scheme)
        for scheme in ("ideal", "prescribed", "feed-forward alone", "feed-forward, feedback")
    ),
    *(ControlledRun("periodic", scheme) for scheme in ("ideal", "prescribed", "servo", "pyragas", "extended")),
)
"""Those that are not among the paper's own runs."""


def ideal_of(job: ControlledRun) -> ControlledRun:
    """The ideal mechanism along the same course."""
    return ControlledRun(job.course, "ideal")


def compute(job: ControlledRun) -> xr.Dataset:
    """Simulate a course under a scheme.

    Parameters
    ----------
    job : ControlledRun

    Returns
    -------
    Dataset

    Raises
    ------
    ScissordynError
        If the run breaks off.
    """
    course = COURSES[job.course]
    run = pass_on(simulate(job.mechanism(), until=course.until, samples=course.samples))
    if run.attrs["status"] != "complete":
        raise ScissordynError(f"run '{job.name}': {run.attrs['cause']}")
    return run


def merits(run: xr.Dataset, ideal: xr.Dataset, after: float = 0.0) -> dict[str, float]:
    """The figures of merit of a run as plain numbers, those of joint A among them.

    Parameters
    ----------
    run, ideal : Dataset
    after : float
        [s]

    Returns
    -------
    dict of str to float
        As of `analysis.merit`.
    """
    found = figures_of_merit(run, ideal, after=after)
    return {str(name): float(found[name].sel(joint=JOINT) if "joint" in found[name].dims else found[name]) for name in found}


def mismatch(run: xr.Dataset, after: float) -> float:
    """Root mean square of how the eccentricity changes from one period to the next, in clearances: zero if it repeats.

    Parameters
    ----------
    run : Dataset
        Along the periodic course.
    after : float
        [s]

    Returns
    -------
    float
    """
    time = run["time"].values
    lag = round(PERIOD / float(time[1] - time[0]))
    place = run["eccentricity"].sel(joint=JOINT).transpose("time", "axis").values
    change = (place[lag:] - place[:-lag])[time[lag:] >= after + PERIOD]
    return float(np.sqrt(np.mean(np.sum(change**2, axis=1)))) / float(run["clearance"].sel(joint=JOINT))
