"""Three published records of rigid contact: by their own scheme step by step, and by the package at the same step."""

from __future__ import annotations

import math

import numpy as np
import xarray as xr
from benchmarks.woodpecker import hard
from scipy.integrate import solve_ivp

import scissordyn as sd
from reference.theta_method import combined, direct, free, sweeps
from scissordyn.casefile.quantity import read_quantity
from scissordyn.units import Quantity
from validation.case import Case, Check, Printed
from validation.controlled_four_bar.record import ANGLES, ECCENTRICITIES
from validation.records.models import four_bar, slider_crank, woodpecker_of_small_angles
from validation.records.numbers import SLIDER_CRANK, WOODPECKER
from validation.records.systems import FourBar, SliderCrank, Woodpecker

__all__ = ["CASE", "STEPS", "by_its_scheme"]

STEPS = {"slider-crank": (1e-4, 2000), "woodpecker": (2e-5, 14_999), "four-bar": (1e-4, 10_000)}
"""Step size [s] and number of steps of each record."""

JOINTS = ["crank pin", "rocker pin", "rocker bearing"]

SETTLED = 2  # Index of the first of the 21 instants at which all journals have settled in contact


def by_its_scheme(name: str, count: int | None = None) -> np.ndarray:
    """Compute the motion of a record again by its scheme; return coordinates and velocities at every step."""
    step, most = STEPS[name]
    steps = most if count is None else count
    if name == "slider-crank":
        return direct(SliderCrank(), *SliderCrank.start, step, steps)
    if name == "woodpecker":
        return free(Woodpecker(), *Woodpecker.start, step, steps)
    return combined(FourBar(), *FourBar.start, step, steps, sweeps(1e-6))


def woodpecker_apart(steps: int) -> tuple[float, float, float]:
    """Return the largest differences of scheme and package: height [m], rotations of sleeve and bird [rad]."""
    step, scale, velocities = STEPS["woodpecker"][0], 1e-5, np.array([-0.34, 0.0, -7.5])
    wanted = free(Woodpecker(), np.zeros(3), velocities, step, steps)
    ours = _hard(woodpecker_of_small_angles(scale, velocities), steps * step, steps + 1, step)
    height = ours["position"].sel(body="sleeve", axis="y").values
    sleeve, bird = (ours["angle"].sel(body=body).values for body in ("sleeve", "bird"))
    found = [float(np.abs(path / scale - wanted[:, k]).max()) for k, path in enumerate((height, sleeve, bird))]
    return found[0], found[1], found[2]


def checks() -> list[Check]:
    """Check the schemes against their records, and the package against the schemes."""
    return [*_slider_crank(), *_woodpecker(), *_four_bar(), *_first_impacts()]


def _hard(one: sd.Mechanism, until: float, samples: int, step: float, events: str = "crossed") -> xr.Dataset:
    return sd.simulate(one, until=until, start="as-placed", samples=samples, step=step, events=events)


def _slider_crank() -> list[Check]:
    kept = by_its_scheme("slider-crank")
    made = []
    for at, turned, speed in SLIDER_CRANK:
        label = f"slider-crank, its scheme, step {at}: crank's"
        found = float(kept[at, 0]) / (2.0 * math.pi)
        made.append(Check(f"{label} revolutions", turned, found, 1e-13, "published"))
        made.append(Check(f"{label} angular velocity [rad/s]", speed, float(kept[at, 3]), 1e-12, "published"))
    until = 0.2  # the scheme is of first order: results with steps of 10 and 5 us are extrapolated
    by_step = [direct(SliderCrank(), *SliderCrank.start, step, round(until / step))[-1, 0] for step in (1e-5, 5e-6)]
    limit = float(2.0 * by_step[1] - by_step[0]) / (2.0 * math.pi)
    at_hand = _revolutions()[2000]
    label = "slider-crank, ours at its step against the limit of its scheme: crank's revolutions at 200 ms"
    return [*made, Check(label, limit, at_hand, 5e-4, "second formulation")]


def _woodpecker() -> list[Check]:
    kept = by_its_scheme("woodpecker")
    made = []
    for at, height, sleeve, bird in WOODPECKER:
        label = f"woodpecker, its scheme, step {at}:"
        for name, wanted, k in (("height [m]", height, 0), ("sleeve [rad]", sleeve, 1), ("bird [rad]", bird, 2)):
            made.append(Check(f"{label} {name}", wanted, float(kept[at, k]), 1e-13, "published", relative=False))
    label = "woodpecker, ours at its step in the limit of small angles, upright start, 5000 steps: largest difference of"
    names = (("the height [m]", 2e-5), ("the sleeve [rad]", 5e-4), ("the bird [rad]", 5e-4))
    for (name, allowed), missed in zip(names, woodpecker_apart(5000), strict=True):
        made.append(Check(f"{label} {name}", 0.0, missed, allowed, "second formulation", relative=False))
    return made


def _four_bar() -> list[Check]:
    kept = by_its_scheme("four-bar")[::500]
    missed = float(np.abs(kept[:, :3] - ANGLES).max())
    label = "four-bar, its scheme: largest difference at 21 instants of"
    made = [Check(f"{label} the angles [rad]", 0.0, missed, 1e-6, "published", relative=False)]
    signs = np.array([-1.0, -1.0, 1.0])  # the first two offsets are offsets of the bearing
    places = np.array([signs[:, None] * FourBar().offsets(state[:7])[0] for state in kept]).reshape(-1, 6)
    missed = float(np.abs(1e3 * places - ECCENTRICITIES).max())
    made.append(Check(f"{label} the journals' places [mm]", 0.0, missed, 1e-4, "published", relative=False))
    ours = _hard(four_bar(), 1.0, 21, 1e-4)
    missed = float(np.abs(np.unwrap(ours["angle"].values, axis=0) - ANGLES).max())
    label = "four-bar, ours at its step: largest difference at 21 instants of"
    made.append(Check(f"{label} the angles [rad]", 0.0, missed, 5e-4, "published", relative=False))
    found = 1e3 * ours["eccentricity"].sel(joint=JOINTS).values.reshape(21, 6)
    missed = float(np.abs(found - ECCENTRICITIES)[SETTLED:].max()) / 5.0
    made.append(Check(f"{label} the journals' places, in clearances", 0.0, missed, 0.1, "published", relative=False))
    return made


def _first_impacts() -> list[Check]:
    """Check located impacts of the woodpecker of large angles and of the four-bar after free flights of other formulations."""
    declared = [read_quantity(one.value, Quantity(one.value.split()[1])) for one in sd.zoo["woodpecker"].numbers]
    bar, (place, speeds) = FourBar(), FourBar.start
    closing = lambda _, state: bar.gaps(state[:7])[0]  # noqa: E731
    closing.terminal = True  # type: ignore[attr-defined]
    flight = solve_ivp(
        lambda time, state: np.concatenate([state[7:], bar.force(time, state[:7], state[7:]) / np.diag(bar.mass(state[:7]))]),
        (0.0, 0.02),
        np.concatenate([place, speeds]),
        "DOP853",
        events=closing,
        rtol=1e-13,
        atol=1e-15,
    )
    last = flight.y[:, -1]
    approach = -float(bar.gradients(last[:7])[0] @ last[7:])
    made = []
    for name, one, until, time, speed in (
        ("woodpecker", hard(sd.zoo["woodpecker"].mechanism), 0.011, declared[0], declared[1]),
        ("four-bar", four_bar(), 0.0115, float(flight.t[-1]), approach),
    ):
        ours = _hard(one, until, 3, 1e-6, "located")
        label = f"{name}: first impact, located at a step of 1 µs"
        made.append(Check(f"{label} [s]", time, float(ours["contact_start"][0]), 1e-8, "second formulation"))
        made.append(
            Check(f"{label}, approach speed [m/s]", speed, float(ours["approach_speed"][0]), 1e-7, "second formulation")
        )
    return made


def _revolutions() -> dict[int, float]:
    """Return revolutions of the crank at steps of the slider-crank's record, by our time stepping at its step."""
    step, count = STEPS["slider-crank"]
    found = _hard(slider_crank(rotation=0.0), step * count, count + 1, step)
    turned = np.unwrap(found["angle"].sel(body="crank").values) / (2.0 * math.pi)
    return {at: float(turned[at]) for at, *_ in SLIDER_CRANK}


def published() -> list[Printed]:
    """Return revolutions of the slider-crank's record and of our time stepping at its step."""
    ours = _revolutions()
    return [
        Printed(f"slider-crank: crank's revolutions at {0.1 * at:g} ms", turned, ours[at], 0.02)
        for at, turned, _ in SLIDER_CRANK
    ]


CASE = Case("records", "Published records of rigid contact", checks, quick=False, published=published)
