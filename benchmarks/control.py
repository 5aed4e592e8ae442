"""What controllers do to contact: the tables of docs/control.md.

Keeping contact on one stroke of the paper's array, with a gust on its slider; delayed feedback on a periodic drive; the order
of convergence with a delay.
"""

from __future__ import annotations

import math
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import xarray as xr

import scissordyn as sd
from benchmarks.measure import command, table
from scissordyn.analysis.motor import figures_of_merit
from scissordyn.components.force import Force
from scissordyn.components.time_function import Cycloidal, tabulated
from scissordyn.control.delayed.extended import ExtendedDelayedFeedback
from scissordyn.control.delayed.pyragas import Pyragas
from scissordyn.control.tracking.feed_forward import FeedForward
from scissordyn.control.tracking.none import NoControl
from scissordyn.control.tracking.pid import PID
from scissordyn.run.inverse_dynamics import feed_forward

__all__ = ["measure"]

sys.path.append(str(Path(__file__).parents[1] / "tests"))

CLEARANCE, LIMIT, UNTIL = 0.5e-3, 770.0, 1.2
STROKE = Cycloidal(math.radians(30.0), math.radians(60.0), 1.0)
FAST = sd.ConstantSpeed(sd.rpm(150.0))
GAINS = 2e4, 1500.0

FREQUENCY = 2.0  # Of the periodic drive [Hz]

PER_PERIOD = 200
FIRST, LAST, LATE = 40, 60, (130, 150)  # Periods over which the mismatch is taken

FEEDBACKS = (
    ("servo alone", None),
    *((f"pyragas K = {gain:+.0f}", (gain, 0.0)) for gain in (-500.0, -1000.0, -1500.0, -2000.0, 1000.0)),
    *((f"extended R = 0.5, K = {gain:+.0f}", (gain, 0.5)) for gain in (-1000.0, -1500.0)),
)


def _array(gust: float = 0.0, end: float = 0.8) -> sd.Mechanism:
    arm = sd.scissor(units=2).with_clearance("A", sd.Clearance(CLEARANCE))
    pulse = tabulated(
        lambda t: math.sin(math.pi * (t - 0.6) / (end - 0.6)) ** 2 if 0.6 < t < end else 0.0, until=UNTIL, points=4801
    )
    return replace(arm, components=(Force("gust", ("slider", "centre"), (0.0, -gust), time_function=pulse),)) if gust else arm


def _row(name: str, run: xr.Dataset, ideal: xr.Dataset) -> list[str]:
    found = figures_of_merit(run, ideal)
    numbers = [
        f"{float(found['contact_fraction'][0]):.3f}",
        f"{int(found['separations'][0])}",
        f"{float(found['in_contact_from'][0]):.4f}",
        f"{float(found['peak_force'][0]):.0f}",
        f"{float(found['peak_torque']):.0f}",
        f"{float(found['energy_used']):.1f}",
        f"{1e3 * float(found['tracking_error']):.3g}",
        f"{1e3 * float(found['position_error']):.3g}",
        f"{1e3 * float(found['synchronisation_error']):.3g}",
    ]
    return [name, *numbers]


HEAD = (
    "",
    "fraction in contact",
    "separations",
    "in contact from [s]",
    "peak force [N]",
    "peak torque [N m]",
    "energy [J]",
    "angle error [mrad]",
    "position error [mm]",
    "synchronisation error [mm]",
)


def _stroke() -> str:
    """One stroke: prescribed, with feed-forward, with feedback."""
    calm, windy = _array(), _array(50.0)
    ideal = sd.simulate(calm.ideal().driven(STROKE), until=UNTIL)
    torque = feed_forward(calm, STROKE, until=UNTIL)
    even = sd.ConstantSpeed(math.radians(30.0))
    even_ideal = sd.simulate(calm.ideal().driven(even), until=UNTIL)
    laws = {
        "feed-forward alone": FeedForward(limit=LIMIT),
        "feed-forward, feedback, ramp 20 ms": FeedForward(*GAINS, limit=LIMIT, ramp=0.02),
    }
    rows = [
        _row("constant speed, no gust", sd.simulate(calm.driven(even), until=UNTIL), even_ideal),
        _row("prescribed motion", sd.simulate(windy.driven(STROKE), until=UNTIL), ideal),
    ]
    short = sd.simulate(calm.ideal().driven(STROKE), until=0.3)
    falling = sd.simulate(calm.controlled(NoControl(), reference=STROKE), until=0.3)
    rows.append(_row("no control (falls; first 0.3 s, no gust)", falling, short))
    for name, law in laws.items():
        run = sd.simulate(windy.controlled(law, reference=STROKE, feed_forward=torque), until=UNTIL)
        rows.append(_row(name, run, ideal))
    strong = _array(200.0, 0.65)
    driven = figures_of_merit(sd.simulate(strong.driven(STROKE), until=UNTIL), ideal)
    held = strong.controlled(laws["feed-forward, feedback, ramp 20 ms"], reference=STROKE, feed_forward=torque)
    closed = figures_of_merit(sd.simulate(held, until=UNTIL), ideal)
    fractions = [f"{float(one['contact_fraction'][0]):.2f}" for one in (driven, closed)]
    return (
        table(HEAD, rows)
        + f"\nWith a gust of 200 N within 50 ms: fraction in contact {fractions[0]} prescribed, {fractions[1]} controlled.\n"
    )


def _fast() -> str:
    """150 rpm from a concentric start, 50 ms."""
    arm = _array()
    ideal = sd.simulate(arm.ideal().driven(FAST), until=0.05)
    torque = feed_forward(arm, FAST, until=0.05)
    rows = [_row("prescribed motion", sd.simulate(arm.driven(FAST), until=0.05), ideal)]
    for name, damping in (("controlled", 0.0), ("k_s = -1000 N s", -1000.0), ("k_s = -8000 N s", -8000.0)):
        law = FeedForward(*GAINS, eccentricity_rate_damping=damping)
        run = sd.simulate(arm.controlled(law, reference=FAST, feed_forward=torque, sensor="A" if damping else None), until=0.05)
        rows.append(_row(name, run, ideal))
    return table(HEAD, rows)


def _periodic(feedback: tuple[float, float] | None, periods: int, tolerance: float = 1e-8) -> xr.Dataset:
    drive = sd.Harmonic(math.radians(45.0), math.radians(15.0), 2.0 * math.pi * FREQUENCY)
    arm = sd.scissor(units=2, angle=math.radians(45.0)).with_clearance("A", sd.Clearance(CLEARANCE))
    arm = arm.controlled(PID(2e5, 4e3), reference=drive)
    if feedback is not None:
        gain, recursion = feedback
        options = {"recorded": "sensor_rate_y", "limit": 2000.0}
        law = (
            ExtendedDelayedFeedback(gain, 1.0 / FREQUENCY, recursion, **options)
            if recursion
            else Pyragas(gain, 1.0 / FREQUENCY, **options)
        )
        arm = arm.controlled(law, name="delayed", sensor=("slider", "centre"))
    return sd.simulate(arm, until=periods / FREQUENCY, samples=periods * PER_PERIOD + 1, rtol=tolerance, atol=tolerance)


def _mismatch(run: xr.Dataset, first: int, last: int) -> float:
    """Root mean square of the length of the change of the vector e/c over one period."""
    place = run["eccentricity"].sel(joint="A").values[first * PER_PERIOD : last * PER_PERIOD + 1] / CLEARANCE
    return float(np.sqrt(np.mean(np.sum((place[PER_PERIOD:] - place[:-PER_PERIOD]) ** 2, axis=1))))


def _delayed(name: str, feedback: tuple[float, float] | None, first: int, last: int, tolerance: float = 1e-8) -> list[str]:
    run = _periodic(feedback, last, tolerance)
    window = slice(first * PER_PERIOD, last * PER_PERIOD + 1)
    counted = run["contact_start"].values >= first / FREQUENCY
    peak = max(
        float(run["peak_force"].values[counted].max(initial=0.0)),
        float(run["normal_force"].sel(joint="A").values[window].max()),
    )
    torque = "-" if feedback is None else f"{np.abs(run['control_torque'].values[window, -1]).max():.0f}"
    contact = float(run["in_contact"].sel(joint="A").values[window].mean())
    return [name, f"{_mismatch(run, first, last):.3f}", f"{peak:.0f}", f"{contact:.3f}", torque]


def _orders() -> str:
    """X' = -x(t - 1) on a rotating body against the method of steps, as the tests have it."""
    from control.test_delay import lagged

    rows = []
    for method in ("dopri5", "rodas5p", "rodas4p"):
        found = [lagged(method, tolerance)[1:] for tolerance in (1e-8, 1e-9, 1e-10, 1e-11)]
        order = -np.polyfit(np.log([steps for _, steps in found]), np.log([error for error, _ in found]), 1)[0]
        rows.append([method, f"{order:.1f}"])
    return table(("method", "order with a delay"), rows)


def _recursion() -> str:
    """Largest error of the recorded S(t) = y(t) + R S(t - T) at the samples, with and without an active limit."""
    from control.test_delay import recursion_error

    rows = [[text, f"{recursion_error(limit):.0e}"] for text, limit in (("without limit", None), ("limit of 0.4 N m", 0.4))]
    return table(("bar on a servo, R = 0.5, tolerance 1e-10", "error of the recorded signal [rad/s]"), rows)


def measure(quick: bool = False) -> str:
    """The page: one stroke, 150 rpm, delayed feedback."""
    chosen = FEEDBACKS[:2] if quick else FEEDBACKS
    rows = [_delayed(name, feedback, FIRST, LAST) for name, feedback in chosen]
    if not quick:
        name, feedback = FEEDBACKS[-1]
        rows.append(_delayed(f"{FEEDBACKS[0][0]}, after {LATE[1]} periods", None, *LATE))
        late = f"{name}, after {LATE[1]} periods, tolerance"
        rows.extend(_delayed(f"{late} {tolerance:g}", feedback, *LATE, tolerance) for tolerance in (1e-8, 1e-7, 1e-9))
        name, feedback = FEEDBACKS[2]
        rows.extend(_delayed(f"{name}, tolerance {one:g}", feedback, FIRST, LAST, one) for one in (1e-7, 1e-9))
    head = ("", "mismatch", "peak force [N]", "fraction in contact", "largest torque of the feedback [N m]")
    return (
        f"## Keeping contact\n\n{_stroke()}\n## 150 rpm, 50 ms\n\n{_fast()}\n## Delayed feedback on a periodic drive\n\n"
        f"Periods {FIRST} to {LAST}, or the last {LATE[1] - LATE[0]}.\n\n{table(head, rows)}\n"
        f"## Order of convergence\n\n{_orders()}\n## Recorded signal\n\n{_recursion()}"
    )


if __name__ == "__main__":
    command("control", measure)
