"""Slider-crank with a rod that bends and clearance: the orbit of the journal against Exudyn's cables."""

from __future__ import annotations

import time
from functools import cache, partial

import numpy as np

import scissordyn as sd
from scissordyn.mechanics.outputs import record
from scissordyn.model.options import Options
from scissordyn.plan.plan import plan
from scissordyn.run.trajectory import compute
from validation.case import Case, Check, Code, Measured, Model, mechanism, run
from validation.flexible_slider_crank.cable import CLEARANCE, TIMES, UNTIL, Settings, orbit, vibration

__all__ = ["CASE", "GOAL", "error"]

NAME = "flexible_slider_crank"
GOAL = 1e-3  # Largest distance from the reference that codes have to reach [clearances]
FINE = 32  # Number of elements of the reference, and of Exudyn's model when it is checked alone

PIN = "slider pin"


@cache
def exact() -> np.ndarray:
    """Return the orbit with many beam elements, whose shapes and forces are not those of bars with few modes."""
    found = run(NAME, f"bending.0.elements={FINE}", rtol=1e-8, atol=1e-8)
    return np.asarray(found["eccentricity"].sel(joint=PIN).values)


def error(found: np.ndarray) -> float:
    """Return the largest distance from the reference, in clearances."""
    return float(np.max(np.hypot(*(found - exact()).T))) / CLEARANCE


def ours(tolerance: float, change: str) -> Measured:
    """Run the package, with its Dataset."""
    one = mechanism(NAME, change)
    began = time.process_time()
    found = sd.simulate(one, until=UNTIL, samples=TIMES.size, rtol=tolerance, atol=tolerance)
    seconds = time.process_time() - began
    return error(found["eccentricity"].sel(joint=PIN).values), seconds


def integration(tolerance: float, change: str, monitor: bool = True) -> Measured:
    """Run the package's integration with its preparation; without `monitor` it computes motion and events only."""
    planned = plan(mechanism(NAME, change))
    began = time.process_time()
    path = compute(planned, Options(UNTIL, samples=TIMES.size, rtol=tolerance, atol=tolerance), monitor=monitor)
    seconds = time.process_time() - began
    pin = record(planned.maps, path.system, path.samples).contact[:, 0]
    return error(pin["distance"][:, None] * np.column_stack([pin["nx"], pin["ny"]])), seconds


def checks() -> list[Check]:
    """Check the first contacts of a rod of few modes against the reference, whose shapes and forces are others."""
    kind, made = "second formulation", []
    fine, coarse = (run(NAME, f"bending.0.{one}", rtol=1e-8, atol=1e-8) for one in (f"elements={FINE}", "modes=16"))
    for k in range(2):
        for name, unit, allowed in (("contact_start", "s", 1e-4), ("approach_speed", "m/s", 2e-3), ("peak_force", "N", 2e-2)):
            label = f"contact {k + 1}: {name.replace('_', ' ')} [{unit}]"
            made.append(Check(label, float(fine[name][k]), float(coarse[name][k]), allowed, kind))
    orbits = error(coarse["eccentricity"].sel(joint=PIN).values)
    made.append(Check("largest distance of the orbits [c]", 0.0, orbits, 0.5 * GOAL, kind, relative=False))
    return made


def models() -> list[Model]:
    """Return the checks of Exudyn's cable against the closed form, and of the whole model in the limit of many elements."""
    alone, whole = Settings(FINE, radius=1.0, newton=1e-6, located=True), Settings(FINE, located=True)
    first = f"first mode of the rod on two pins, {FINE} cables, three periods [amplitude]: closed form; 1 us"
    orbits = f"orbit until 15 ms, {FINE} cables [c]: {FINE} beam elements of scissordyn at 1e-8; 1 us"
    return [
        Model("Exudyn ANCFCable2D", first, lambda: vibration(1e-6, alone), 1e-6, "exudyn"),
        Model("Exudyn ANCFCable2D", orbits, lambda: error(orbit(1e-6, whole)[0]), 5e-4, "exudyn"),
    ]


def codes() -> list[Code]:
    """Return both codes at settings near the goal."""
    tolerances = (1e-5, 1e-6, 1e-7, 1e-8)
    made = []
    for change in OURS:
        roads = {
            "integration": integration,
            "integration, motion only": partial(integration, monitor=False),
            "simulate()": ours,
        }
        made += [
            Code(f"scissordyn, {name}, {change}", partial(road, change=f"bending.0.{change}"), tolerances, repeats=3)
            for name, road in roads.items()
        ]
    for chosen in EXUDYN:
        method = "trapezoidal rule" if chosen.radius == 1.0 else f"generalised alpha {chosen.radius:g}"
        name = f"Exudyn, {chosen.elements} cables, {method}, {'modified' if chosen.modified else 'full'} Newton"
        steps = (8e-6, 4e-6, 3e-6, 2e-6, 1e-6)
        made.append(Code(name, partial(cables, chosen=chosen), steps, meaning="step [s]", repeats=3, package="exudyn"))
    return made


def cables(step: float, chosen: Settings) -> Measured:
    """Run Exudyn."""
    found, seconds = orbit(step, chosen)
    return error(found), seconds


OURS = ("modes=12", "modes=16", "elements=16")

EXUDYN = (Settings(16, newton=1e-3, located=True), Settings(16, radius=1.0, newton=1e-3, located=True))
"""Best settings of `python -m validation.flexible_slider_crank.settings`."""

NOTES = (
    "The two orbits tend to each other as elements and steps get finer. Errors of both are those of their elements; nearby\n"
    "motions diverge from contact to contact, so that the goal is set through the second one. Times are of the processor.\n"
    "The step of Exudyn is shortened at contacts (`adaptiveStep`). Its models are the best of a wider scan, `python -m\n"
    "validation.flexible_slider_crank.settings`: 48 of its 144 runs reach the goal, with 12 and 16 cables, two quadratures,\n"
    "three methods and two Newton methods at two tolerances. With fixed steps Newton's method fails at the first contact.\n"
    "Exudyn's time is that of its solver, which stores places and velocities of both points; compare it with\n"
    'the rows "integration". The time of `simulate()` includes planning, forces and stresses at 1501 instants and the Dataset.',
)

CASE = Case(
    NAME,
    "Slider-crank with a rod that bends and a clearance joint",
    checks,
    "largest distance from the reference, in clearances",
    GOAL,
    codes,
    quick=False,
    notes=NOTES,
    models=models,
)
