"""Slider-crank with a clearance guide: compliant contact against rigid contact."""

from __future__ import annotations

import functools
import math

import numpy as np

import scissordyn as sd
from reference.moreau import SliderCrank, march
from validation.case import Case, Check, Printed, mechanism, run
from validation.guide.reference import START, Impact, cluster, free_flight
from validation.records.numbers import SLIDER_CRANK
from validation.records.systems import SliderCrank as Recorded

__all__ = ["CASE", "agreeing", "published"]

NAME = "guide"
MODEL = SliderCrank()
BEGIN, END = 2.69e-3, 2.6926e-3  # Free flight until shortly before the first contact; end of the cluster of impacts [s]
WITHIN = 0.02  # Largest relative difference at which revolutions count as equal


def compliant(stiffness: float, until: float, tolerance: float) -> list[Impact]:
    """Return the contacts of the package with a stiffness of the corners [N/m]."""
    one = mechanism(NAME).replace("guide.stiffness.stiffness", stiffness)
    found = sd.simulate(one, until=until, samples=3, start="as-placed", rtol=tolerance, atol=tolerance)
    return [
        # corners 4 and 3 of the package are rear and front of the left (here upper) guide surface
        Impact(5 - int(str(name)[-1]), float(start), float(speed), -float(back))
        for name, start, speed, back in zip(
            found["contact_joint"].values,
            found["contact_start"].values,
            found["approach_speed"].values,
            found["rebound_speed"].values,
            strict=True,
        )
    ]


def agreeing(found: list[Impact], rigid: list[Impact], within: float) -> int:
    """Return how many first impacts have the corner, approach speed and rebound speed of rigid contact."""
    count = 0
    for one, other in zip(found, rigid, strict=False):
        near = abs(one.approach / other.approach - 1.0) < within and abs(one.rebound / other.rebound - 1.0) < within
        if one.corner != other.corner or not near:
            break
        count += 1
    return count


def checks() -> list[Check]:
    """Check the free flight, the cluster of impacts as the stiffness grows, and averages after it."""
    flight = run(NAME, until=2.2e-3, samples=2, rtol=1e-11, atol=1e-11)
    crank = float(flight["angular_velocity"].sel(body="crank")[-1])
    rigid, _ = cluster(MODEL, BEGIN, END)
    stiff = compliant(1e15, END, 1e-10)
    made = [
        Check(
            "crank's angular velocity at 2.2 ms [rad/s]",
            float(free_flight(2.2e-3, MODEL)[3]),
            crank,
            1e-10,
            "second formulation",
        ),
        Check("first contact starts [s]", rigid[0].time, stiff[0].time, 1e-9, "second formulation"),
        Check("its approach speed [m/s]", rigid[0].approach, stiff[0].approach, 1e-8, "second formulation"),
    ]
    label = "rebound speed at k = 1e15 N/m [m/s]"
    made += [
        Check(f"impact {k + 1}: {label}", rigid[k].rebound, stiff[k].rebound, 1e-3, "second formulation") for k in range(3)
    ]
    # impacts that end before the next one begins agree; a higher stiffness has more of them
    for stiffness, number in ((1e9, 0.0), (1e11, 1.0), (1e13, 3.0), (1e15, 6.0)):
        count = agreeing(compliant(stiffness, END, 1e-10), rigid, 1e-2)
        label = f"impacts that agree within 1 % at k = {stiffness:.0e} N/m"
        made.append(Check(label, number, float(count), 0.0, "second formulation", relative=False))
    # Moreau's stepping from the end of the free flight until a time between the fifth and the sixth impact
    state, until = free_flight(BEGIN, MODEL), 2.692535e-3
    _, wanted = cluster(MODEL, BEGIN, until)
    kept, _ = march(MODEL, state[:3].copy(), state[3:].copy(), until - BEGIN, 1e-11, round((until - BEGIN) / 1e-11))
    made.append(
        Check(
            "Moreau's stepping at 1e-11 s after five impacts: angular velocity of the slider [rad/s]",
            float(wanted[5]),
            float(kept[-1, 5]),
            1e-2,
            "second formulation",
        )
    )
    kept, _ = march(MODEL, START[:3].copy(), START[3:].copy(), 0.03, 1e-6, 30_000)
    late = run(NAME, until=0.03, samples=2)
    late_crank = float(late["angular_velocity"].sel(body="crank")[-1])
    label = "crank's angular velocity at 30 ms, k = 1e9 N/m, against Moreau's stepping at 1e-6 s [rad/s]"
    made.append(Check(label, float(kept[-1, 3]), late_crank, 2e-2, "second formulation"))
    return made + check_from_record()


def check_from_record() -> list[Check]:
    """Check a run from the record's start against the limit of rigid contact, from which the record itself differs by 6 %."""
    directions, speeds = Recorded.start
    fine, _ = march(MODEL, directions.copy(), speeds.copy(), 0.2, 1e-6, 100)
    wanted = float(fine[-1, 0]) / (2.0 * math.pi)
    label = "crank's revolutions at 200 ms from the record's start, k = 1e9 N/m, against Moreau's stepping at 1 µs"
    return [Check(label, wanted, revolutions()[1e-4 * 2000], 1e-2, "second formulation")]


@functools.cache
def revolutions() -> dict[float, float]:
    """Return revolutions of the crank at the times of the record, from its start, with k = 1e9 N/m."""
    found = run(NAME, "slider.angular_velocity=0 rad/s", until=0.2, samples=2001, rtol=1e-7, atol=1e-7)
    turned = np.unwrap(found["angle"].sel(body="crank").values) / (2.0 * math.pi)
    return {1e-4 * at: float(np.interp(1e-4 * at, found["time"].values, turned)) for at, *_ in SLIDER_CRANK}


def published() -> list[Printed]:
    """Return the record with our results."""
    ours = revolutions()
    return [
        Printed(f"crank's revolutions at {0.1 * at:g} ms", turned, ours[1e-4 * at], WITHIN) for at, turned, _ in SLIDER_CRANK
    ]


CASE = Case(NAME, "Slider-crank with a clearance guide", checks, quick=False, published=published)
