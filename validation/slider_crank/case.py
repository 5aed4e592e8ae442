"""Slider-crank with clearance between rod and slider: contacts, and work against precision."""

from __future__ import annotations

import math
import time
from functools import cache, partial

import numpy as np

import scissordyn as sd
from reference.laws import hertz, lankarani_nikravesh
from reference.marching import ClearanceJoint, March
from reference.slider_crank import SliderCrank
from scissordyn.mechanics.outputs import record
from scissordyn.model.options import Options
from scissordyn.plan.plan import plan
from scissordyn.run.trajectory import compute
from validation.case import Case, Check, Code, Measured, mechanism, run
from validation.slider_crank.codes import Found, numbalsodas, scipys
from validation.slider_crank.equations import CLEARANCE, SAMPLES, UNTIL, orbit_error
from validation.slider_crank.exudyn_pin import Settings, exudyns
from validation.slider_crank.models import models

__all__ = ["CASE"]

NAME = "slider_crank"
CONTACTS = 6  # Number of contacts that are compared


def checks() -> list[Check]:
    """Check the first contacts; errors grow from contact to contact, as nearby motions diverge."""
    found = run(NAME, until=2.2e-3, samples=11, rtol=1e-12, atol=1e-12)
    joint = ClearanceJoint(0.5e-3, 9.5e-3, hertz(0.5e-3, 9.5e-3), lankarani_nikravesh(0.9))
    march = March(SliderCrank(joint, 5000.0 * math.pi / 30.0), max_step=1e-5).run(2.2e-3, most_contacts=CONTACTS)
    made = []
    for k, contact in enumerate(march.contacts[:CONTACTS]):
        one = found.isel(contact=k)
        allowed = 1e-9 * 10.0**k
        for name, reference, unit in (
            ("contact_start", contact.start, "s"),
            ("approach_speed", contact.approach_speed, "m/s"),
            ("peak_force", contact.peak_force, "N"),
            ("rebound_speed", contact.rebound_speed, "m/s"),
        ):
            label = f"contact {k + 1}: {name.replace('_', ' ')} [{unit}]"
            made.append(Check(label, reference, float(one[name]), max(allowed, 1e-8), "second formulation"))
    return made


def ours(tolerance: float) -> Measured:
    """Run the package, with its Dataset."""
    one = mechanism(NAME)
    began = time.perf_counter()
    found = sd.simulate(one, until=UNTIL, samples=SAMPLES, rtol=tolerance, atol=tolerance)
    seconds = time.perf_counter() - began
    return error(found["eccentricity"].sel(joint="slider pin").values), seconds


def integration(tolerance: float, monitor: bool = True) -> Measured:
    """Run the package's integration alone; without `monitor` it computes motion and events only."""
    path = compute(plan(mechanism(NAME)), Options(UNTIL, samples=SAMPLES, rtol=tolerance, atol=tolerance), monitor=monitor)
    pin = record(path.plan.maps, path.system, path.samples).contact[:, 0]
    orbit = pin["distance"][:, None] * np.column_stack([pin["nx"], pin["ny"]])
    return error(orbit), float(path.statistics["seconds"])


@cache
def exact() -> np.ndarray:
    """Return the orbit of the equations derived by hand, by scipy's DOP853 at its smallest tolerance."""
    return scipys("DOP853", 3e-14)[1]


def error(orbit: np.ndarray) -> float:
    """Return the root mean square error of the orbit, in clearances."""
    return orbit_error(orbit, exact())


def other(found: Found) -> Measured:
    """Return error and seconds of another code."""
    seconds, orbit = found
    return error(orbit), seconds


def codes() -> list[Code]:
    """Return the codes at a range of settings."""
    own = (1e-6, 5e-7, 3e-7, 2e-7, 1.5e-7, 1e-7, 5e-8, 1e-8, 1e-9)
    decades = (1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 1e-11, 1e-12)
    located = (1e-6, 1e-7, 5e-8, 2e-8, 1e-8, 5e-9, 2e-9, 1e-9, 1e-10)
    made = [
        Code("scissordyn, integration", integration, own, repeats=21),
        Code("scissordyn, integration, motion only", partial(integration, monitor=False), own, repeats=21),
        Code("scissordyn, simulate()", ours, own, repeats=21),
    ]
    for unit in (1e-5, 1e-4, 1e-3):
        name = f"numbalsoda DOP853, located contacts, time in {1e3 * unit:g} ms"
        run = partial(numbalsodas, unit=unit)
        made.append(Code(name, lambda one, run=run: other(run(one)), located, repeats=21, package="numbalsoda"))
    made += [
        Code("scipy DOP853, compiled equations", lambda one: other(scipys("DOP853", one)), decades[2:5], repeats=3),
        Code("scipy LSODA, compiled equations", lambda one: other(scipys("LSODA", one)), decades[3:6], repeats=3),
    ]
    for chosen in EXUDYN:
        absolute = "clearances" if chosen.scale == CLEARANCE else "metres"
        numbers = f"{1e3 * chosen.longest:g} ms, {chosen.force_error:g} N, {chosen.increase:g}, {absolute}"
        name = f"Exudyn DOPRI5, {numbers}"
        run = partial(exudyns, settings=chosen)
        made.append(Code(name, lambda one, run=run: other(run(one)), located, repeats=5, package="exudyn"))
    return made


EXUDYN = (
    Settings(1e-3, 100.0, 5.0),
    Settings(1e-3, 1.0, 5.0),
    Settings(1e-3, 1.0, 5.0, 1.0),
    Settings(1e-4, 100.0, 10.0),
    Settings(1e-4, 30.0, 30.0),
    Settings(1e-4, 10.0, 5.0),
)
"""Fastest settings of `python -m validation.slider_crank.settings`, and the most reliable one."""

NOTES = (
    "The equations derived by hand compute only the orbit; scissordyn also computes torque, energies and contacts,\n"
    "unless only the motion is requested.\n"
    "numbalsoda has no events: a compiled loop around it, 60 lines, ends each integration where the gap changes its sign.",
    "Exudyn has crank and rod as a kinematic tree, the slider as a mass with one coordinate, the pin as a sphere in a hollow\n"
    "sphere, and no constraint. The numbers in the name of the code are the longest step, `discontinuous.iterationTolerance`,\n"
    "`stepSizeMaxIncrease`, and the unit of the absolute tolerance. They are the best of a wider scan, `python -m\n"
    "validation.slider_crank.settings`: 168 of its 320 runs, at tolerances of 1e-8 to 1e-10, reach the goal. With the slider\n"
    "as a rigid body of three coordinates, two of them constrained, the error before the second contact falls with the square\n"
    "root of the tolerance only, and after one revolution it is 12 % of the clearance at every tolerance down to 1e-10: such\n"
    "a model, which is right as its equations go, does not suit the explicit solver.",
)

CASE = Case(
    NAME,
    "Slider-crank with a clearance joint",
    checks,
    "root mean square error of the orbit, in clearances",
    1e-3,
    codes,
    notes=NOTES,
    models=models,
)
