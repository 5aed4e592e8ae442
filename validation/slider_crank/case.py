"""The slider-crank with clearance between rod and slider: contacts, and work against precision."""

from __future__ import annotations

import math
import time

import numpy as np
from benchmarks import peers

import scissordyn as sd
from reference.laws import hertz, lankarani_nikravesh
from reference.marching import ClearanceJoint, March
from reference.slider_crank import SliderCrank
from validation.case import Case, Check, Code, Measured, mechanism, run

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
    found = sd.simulate(one, until=peers.UNTIL, samples=peers.SAMPLES, rtol=tolerance, atol=tolerance)
    seconds = time.perf_counter() - began
    return error(found["eccentricity"].sel(joint="slider pin").values), seconds


def integration(tolerance: float) -> Measured:
    """The package, integration alone."""
    seconds, orbit, _ = peers.package(tolerance)
    return error(orbit), seconds


def error(orbit: np.ndarray) -> float:
    """Root mean square error of the orbit, in clearances."""
    return peers.orbit_error(orbit, _exact())


_EXACT: list[np.ndarray] = []


def _exact() -> np.ndarray:
    if not _EXACT:
        _EXACT.append(peers.scipys("DOP853", 3e-14)[1])
    return _EXACT[0]


def other(seconds_orbit: tuple[float, np.ndarray, list[float]]) -> Measured:
    """Error and seconds of another code."""
    return error(seconds_orbit[1]), seconds_orbit[0]


def codes() -> list[Code]:
    """The codes at a range of settings."""
    fine = (1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 1e-11, 1e-12)
    return [
        Code("scissordyn, integration", integration, (1e-6, 5e-7, 2e-7, 1e-7, 5e-8, 1e-8, 1e-9), repeats=7),
        Code("scissordyn, simulate()", ours, (1e-6, 5e-7, 2e-7, 1e-7, 5e-8, 1e-8, 1e-9), repeats=7),
        Code("numbalsoda DOP853, without events", lambda one: other(peers.numbalsodas(one)), fine, repeats=5),
        Code("numbalsoda DOP853, located contacts", lambda one: other(peers.numbalsodas_located(one)), fine[1:5], repeats=5),
        Code("scipy DOP853, compiled equations", lambda one: other(peers.scipys("DOP853", one)), fine[2:5], repeats=2),
        Code("scipy LSODA, compiled equations", lambda one: other(peers.scipys("LSODA", one)), fine[3:6], repeats=2),
        Code("Exudyn DOPRI5, sphere in sphere", lambda one: other(peers.exudyns(one)), fine[3:], repeats=1),
        Code(
            "Exudyn RK44, sphere in sphere",
            lambda one: other(peers.exudyns(1e-12, one)),
            (1e-6, 3e-7, 1e-7, 5e-8),
            "step [s]",
            1,
        ),
    ]


CASE = Case(
    NAME, "Slider-crank with a clearance joint", checks, "root mean square error of the orbit, in clearances", 1e-3, codes
)
