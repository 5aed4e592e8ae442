"""Runs of three manoeuvres with and without control.

The stroke at 150 rpm and the contact as a constraint are the paper's. The deployment and the periodic drive are additions: slow
enough for a motor, with a limited torque and a gust, which the paper does not have.
"""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import xarray as xr

from scissordyn.analysis.motor import figures_of_merit
from scissordyn.components.force import Force
from scissordyn.components.time_function import ConstantSpeed, Cycloidal, Harmonic, TimeFunction, tabulated
from scissordyn.control.delayed.extended import ExtendedDelayedFeedback
from scissordyn.control.delayed.pyragas import Pyragas
from scissordyn.control.tracking.feed_forward import FeedForward
from scissordyn.control.tracking.pid import PID
from scissordyn.errors import ScissordynError
from scissordyn.model.mechanism import Mechanism
from scissordyn.model.record import to_plain
from scissordyn.run.advance.interrupt import raise_if_interrupted
from scissordyn.run.inverse_dynamics import feed_forward
from scissordyn.run.simulate import simulate
from scissordyn.units import degrees
from scissordyn_paper.cases import ARRAY_CLEARANCE, SPEED, STROKE_DURATION, Choice, PaperCase
from scissordyn_paper.measures import JOINT

PROPORTIONAL, DERIVATIVE = 2e4, 1500.0  # Gains of the practical controller [N m/rad, N m s/rad]

LIMIT, RAMP = 770.0, 0.02
"""Torque limit of the practical controller on the deployment, 1.5 times the ideal torque [N m], and the time in which the
limit rises from zero [s]."""

ECCENTRICITY_RATE_DAMPING = -1000.0  # Torque of the practical controller per rate of the eccentricity on the stroke [N s]
SERVO = PID(2e5, derivative=4e3)  # Controller that follows the periodic reference, and to which delayed feedback is added

SLOW_PERIOD = 0.5  # Period of the periodic drive in the slow manoeuvre [s]
EVALUATION_START = 40.0 * SLOW_PERIOD  # Start of the evaluation [s]

GUST: Any = Force(
    "gust",
    ("slider", "centre"),
    (0.0, -50.0),
    time_function=tabulated(
        lambda t: math.sin(math.pi * (t - 0.6) / 0.2) ** 2 if 0.6 < t < 0.8 else 0.0, until=1.2, points=4801
    ),
)
"""Force of up to 50 N along -y on the slider, from 0.6 to 0.8 s."""


@dataclass(frozen=True)
class Manoeuvre:
    """Reference motion of the driven bar, with the loads on the mechanism."""

    title: str
    motion: TimeFunction  # Reference angle of the driven bar
    angle: float  # Angle of the driven bar at the start [rad]
    until: float  # End of the run [s]
    samples: int
    after: float = 0.0  # Time from which the figures of merit are computed [s]
    gust: bool = False  # True if a gust acts on the slider; it never acts on the ideal mechanism

    def mechanism(self) -> Mechanism:
        """Return the array with its clearance joint, without drive."""
        described = PaperCase(ARRAY_CLEARANCE, choice=Choice(angle=self.angle)).build().mechanism
        return dataclasses.replace(described, drives=(), components=(GUST,) if self.gust else ())


STROKE_MANOEUVRE = Manoeuvre("stroke at 150 rpm", ConstantSpeed(SPEED), degrees(30), STROKE_DURATION, 2001)
DEPLOYMENT = Manoeuvre(
    "deployment from 30 to 60 deg in 1 s, gust of 50 N",
    Cycloidal(degrees(30), degrees(60), 1.0),
    degrees(30),
    1.2,
    24_001,
    gust=True,
)
PERIODIC_MANOEUVRE = Manoeuvre(
    "periodic drive, 45 ± 15 deg at 2 Hz, periods 40 to 60",
    Harmonic(mean=degrees(45), amplitude=degrees(15), angular_frequency=2.0 * math.pi / SLOW_PERIOD),
    degrees(45),
    60.0 * SLOW_PERIOD,
    30_001,
    after=EVALUATION_START,
)
MANOEUVRES = {"stroke": STROKE_MANOEUVRE, "deployment": DEPLOYMENT, "periodic": PERIODIC_MANOEUVRE}

Scheme = Literal[
    "ideal",
    "prescribed",
    "feed-forward alone",
    "feed-forward, feedback",
    "the same with rate damping",
    "servo",
    "pyragas",
    "extended",
]


@dataclass(frozen=True)
class ControlledRun:
    """Run of one manoeuvre with one control scheme."""

    manoeuvre: Literal["stroke", "deployment", "periodic"]
    scheme: Scheme  # "ideal" and "prescribed" prescribe the motion of the bar

    @property
    def name(self) -> str:
        """Name of the run in file names."""
        return f"{self.manoeuvre}_{self.scheme.replace(', ', '-').replace(' ', '-')}"

    @property
    def toml(self) -> str:
        """Text of the mechanism, by which a changed run is recognised."""
        return json.dumps(to_plain(self.mechanism()))

    def mechanism(self) -> Mechanism:
        """Return the array with the drive or the controllers of the scheme."""
        manoeuvre = MANOEUVRES[self.manoeuvre]
        arm = manoeuvre.mechanism()
        if self.scheme == "ideal":
            return dataclasses.replace(arm.ideal(), components=()).driven(manoeuvre.motion)
        if self.scheme == "prescribed":
            return arm.driven(manoeuvre.motion)
        return _SCHEMES[self.manoeuvre, self.scheme](arm, manoeuvre)


def _fed(law: FeedForward) -> Callable[[Mechanism, Manoeuvre], Mechanism]:
    def controlled(arm: Mechanism, manoeuvre: Manoeuvre) -> Mechanism:
        torque = feed_forward(arm, manoeuvre.motion, until=manoeuvre.until)
        sensor = JOINT if law.uses_sensor else None
        return arm.controlled(law, reference=manoeuvre.motion, feed_forward=torque, sensor=sensor)

    return controlled


def _delayed(law: Pyragas | ExtendedDelayedFeedback | None) -> Callable[[Mechanism, Manoeuvre], Mechanism]:
    def controlled(arm: Mechanism, manoeuvre: Manoeuvre) -> Mechanism:
        servo = arm.controlled(SERVO, reference=manoeuvre.motion)
        return servo if law is None else servo.controlled(law, sensor=("slider", "centre"))

    return controlled


_SCHEMES: dict[tuple[str, str], Callable[[Mechanism, Manoeuvre], Mechanism]] = {
    # with full speed at the start, the torque limit of the deployment could not carry the bar
    ("stroke", "feed-forward, feedback"): _fed(FeedForward(PROPORTIONAL, DERIVATIVE)),
    ("stroke", "the same with rate damping"): _fed(
        FeedForward(PROPORTIONAL, DERIVATIVE, eccentricity_rate_damping=ECCENTRICITY_RATE_DAMPING)
    ),
    ("deployment", "feed-forward alone"): _fed(FeedForward(limit=LIMIT)),
    ("deployment", "feed-forward, feedback"): _fed(FeedForward(PROPORTIONAL, DERIVATIVE, limit=LIMIT, ramp=RAMP)),
    ("periodic", "servo"): _delayed(None),
    ("periodic", "pyragas"): _delayed(Pyragas(-1000.0, SLOW_PERIOD, "sensor_rate_y", limit=2000.0)),
    ("periodic", "extended"): _delayed(ExtendedDelayedFeedback(-1500.0, SLOW_PERIOD, 0.5, "sensor_rate_y", limit=2000.0)),
}

CONTROLLED_RUNS = (
    *(ControlledRun("stroke", scheme) for scheme in ("ideal", "feed-forward, feedback", "the same with rate damping")),
    *(
        ControlledRun("deployment", scheme)
        for scheme in ("ideal", "prescribed", "feed-forward alone", "feed-forward, feedback")
    ),
    *(ControlledRun("periodic", scheme) for scheme in ("ideal", "prescribed", "servo", "pyragas", "extended")),
)
"""Runs of the manoeuvres with control schemes that the paper does not have."""

LONGEST_FIRST = CONTROLLED_RUNS[::-1]  # Periodic runs take some seconds, strokes a fraction of a second


def ideal_of(job: ControlledRun) -> ControlledRun:
    """Return the job of the ideal mechanism on the same manoeuvre."""
    return ControlledRun(job.manoeuvre, "ideal")


def compute(job: ControlledRun) -> xr.Dataset:
    """Simulate a manoeuvre with a control scheme."""
    manoeuvre = MANOEUVRES[job.manoeuvre]
    run = raise_if_interrupted(simulate(job.mechanism(), until=manoeuvre.until, samples=manoeuvre.samples))
    if run.attrs["status"] != "complete":
        raise ScissordynError(f"run '{job.name}': {run.attrs['cause']}")
    return run


def merits(run: xr.Dataset, ideal: xr.Dataset, after: float = 0.0) -> dict[str, float]:
    """Return the figures of merit of a run from the time `after` on, including those of joint A, as numbers by name."""
    found = figures_of_merit(run, ideal, after=after)
    return {str(name): float(found[name].sel(joint=JOINT) if "joint" in found[name].dims else found[name]) for name in found}


def mismatch(run: xr.Dataset, after: float) -> float:
    """Return the rms change of the eccentricity from one period to the next, divided by the clearance; 0 if periodic."""
    time = run["time"].values
    lag = round(SLOW_PERIOD / float(time[1] - time[0]))
    place = run["eccentricity"].sel(joint=JOINT).transpose("time", "axis").values
    change = (place[lag:] - place[:-lag])[time[lag:] >= after + SLOW_PERIOD]
    return float(np.sqrt(np.mean(np.sum(change**2, axis=1)))) / float(run["clearance"].sel(joint=JOINT))
