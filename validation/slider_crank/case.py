"""The slider-crank with clearance between rod and slider: contacts, and work against precision."""

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
from scissordyn.simulation.options import Options
from scissordyn.simulation.trajectory import compute
from validation.case import Case, Check, Code, Measured, mechanism, run
from validation.slider_crank.codes import Found, exudyns, numbalsodas, numbalsodas_located, scipys
from validation.slider_crank.equations import SAMPLES, UNTIL, orbit_error

__all__ = ["CASE"]

NAME = "slider_crank"
CONTACTS = 6


def checks() -> list[Check]:
    """The first contacts; errors grow from contact to contact, as nearby motions diverge."""
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
    """The package, with its Dataset."""
    one = mechanism(NAME)
    began = time.perf_counter()
    found = sd.simulate(one, until=UNTIL, samples=SAMPLES, rtol=tolerance, atol=tolerance)
    seconds = time.perf_counter() - began
    return error(found["eccentricity"].sel(joint="slider pin").values), seconds


def integration(tolerance: float, monitor: bool = True) -> Measured:
    """The package, integration alone; with torque, energies, peaks and events, or motion and events only."""
    path = compute(mechanism(NAME), Options(UNTIL, samples=SAMPLES, rtol=tolerance, atol=tolerance), monitor=monitor)
    pin = record(path.reduced, path.system, path.samples).contact[:, 0]
    orbit = pin["distance"][:, None] * np.column_stack([pin["nx"], pin["ny"]])
    return error(orbit), float(path.statistics["seconds"])


@cache
def exact() -> np.ndarray:
    """The orbit by scipy's DOP853 at the smallest tolerance that it takes, of the equations derived by hand."""
    return scipys("DOP853", 3e-14)[1]


def error(orbit: np.ndarray) -> float:
    """Root mean square error of the orbit, in clearances."""
    return orbit_error(orbit, exact())


def other(found: Found) -> Measured:
    """Error and seconds of another code."""
    seconds, orbit = found
    return error(orbit), seconds


def codes() -> list[Code]:
    """The codes at a range of settings."""
    own = (1e-6, 5e-7, 3e-7, 2e-7, 1.5e-7, 1e-7, 5e-8, 1e-8, 1e-9)
    decades = (1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 1e-11, 1e-12)
    located = (1e-6, 1e-7, 5e-8, 2e-8, 1e-8, 5e-9, 2e-9, 1e-9, 1e-10)
    made = [
        Code("scissordyn, integration", integration, own, repeats=21),
        Code("scissordyn, integration, motion only", partial(integration, monitor=False), own, repeats=21),
        Code("scissordyn, simulate()", ours, own, repeats=21),
        Code("numbalsoda DOP853, without events", lambda one: other(numbalsodas(one)), decades, repeats=5),
    ]
    for unit in (1e-5, 1e-4, 1e-3):
        name = f"numbalsoda DOP853, located contacts, time in {1e3 * unit:g} ms"
        made.append(Code(name, lambda one, unit=unit: other(numbalsodas_located(one, unit)), located, repeats=21))
    made += [
        Code("scipy DOP853, compiled equations", lambda one: other(scipys("DOP853", one)), decades[2:5], repeats=3),
        Code("scipy LSODA, compiled equations", lambda one: other(scipys("LSODA", one)), decades[3:6], repeats=3),
    ]
    for longest in (1e-4, 6e-6):
        for force in (1.0, 10.0, 1000.0):
            name = f"Exudyn DOPRI5, steps up to {1e6 * longest:g} \u00b5s, {force:g} N"
            run = partial(exudyns, longest=longest, force_error=force)
            made.append(Code(name, lambda one, run=run: other(run(one)), decades[1:6], repeats=2))
    fixed = (1e-6, 3e-7, 1e-7, 5e-8)
    made.append(Code("Exudyn RK44", lambda one: other(exudyns(1e-12, one, fixed=True)), fixed, "step [s]", 1))
    return made


NOTES = (
    "The equations derived by hand compute the orbit alone; scissordyn also torque, energies and the table of contacts,\n"
    "unless only the motion is asked for.\n"
    "numbalsoda has no events: a compiled loop around it, 60 lines, ends each integration where the gap changes its sign.",
    "Exudyn's contact of two spheres shortens the step that ends a flight, so that a contact begins where it should (approach\n"
    "speed of the first one to 1e-7), but not the step that ends a contact: the error of the orbit falls with the first power\n"
    "of that step, and grows from contact to contact. The force in the name of the code is the setting\n"
    "`discontinuous.iterationTolerance`. A wider scan (longest steps of 1 ms, 100 and 6 \u00b5s, tolerances of 1e-8 to 1e-10,\n"
    "four such forces, two initial steps, absolute tolerances in metres or in clearances: 288 runs) had no error below 5e-3.",
)

CASE = Case(
    NAME,
    "Slider-crank with a clearance joint",
    checks,
    "root mean square error of the orbit, in clearances",
    1e-3,
    codes,
    notes=NOTES,
)
