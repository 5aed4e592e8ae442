"""Models of other codes on the slider-crank against exact solutions: without contact, and through one contact.

Errors grow by four decades and more from contact to contact until the end of the revolution, where the goal is 1e-3 of the
clearance. A model must be accurate to 1e-7 of the clearance before the second contact.
"""

from __future__ import annotations

import math
from functools import cache

import numpy as np
from scipy.integrate import solve_ivp
from scipy.special import ellipj

from reference.laws import hertz, lankarani_nikravesh
from reference.marching import ClearanceJoint, March
from reference.slider_crank import SliderCrank
from validation.case import Model
from validation.slider_crank.codes import numbalsodas, scipys
from validation.slider_crank.equations import (
    CLEARANCE,
    CRANK,
    JOURNAL,
    RESTITUTION,
    ROD,
    ROD_INERTIA,
    ROD_MASS,
    SPEED,
    TIMES,
    UNTIL,
    rates,
    start,
)
from validation.slider_crank.exudyn_pin import Settings, contact_free, exudyns

__all__ = ["free_orbit", "models", "second_formulation", "until_second_contact"]

SECOND_CONTACT = 0.63e-3  # Time shortly before the second contact [s]


def free_orbit() -> np.ndarray:
    """Return the orbit of the journal without contact, in closed form.

    The slider rests. The rod's angle relative to the crank moves like a pendulum, from rest position at the speed -(r/l + 1) w.
    """
    natural = math.sqrt(0.5 * ROD_MASS * ROD * CRANK / (ROD_INERTIA + 0.25 * ROD_MASS * ROD**2)) * SPEED
    modulus = (CRANK / ROD + 1.0) * SPEED / (2.0 * natural)
    sine = ellipj(natural * TIMES, modulus**2)[0]
    angle = SPEED * TIMES - 2.0 * np.arcsin(modulus * sine)
    x = CRANK * np.cos(SPEED * TIMES) + ROD * np.cos(angle) - (CRANK + ROD)
    return np.column_stack([x, CRANK * np.sin(SPEED * TIMES) + ROD * np.sin(angle)])


@cache
def second_formulation() -> np.ndarray:
    """Return the orbit until the second contact, from the coordinates of the journal and another list of laws."""
    joint = ClearanceJoint(CLEARANCE, JOURNAL, hertz(CLEARANCE, JOURNAL), lankarani_nikravesh(RESTITUTION))
    march = March(SliderCrank(joint, SPEED), max_step=1e-5).run(SECOND_CONTACT)
    return march.at(TIMES[TIMES < SECOND_CONTACT]).eccentricity[:, 0]


def until_second_contact(orbit: np.ndarray) -> float:
    """Return the largest error of an orbit before the second contact, in clearances."""
    return _farthest(orbit[TIMES < SECOND_CONTACT], second_formulation())


def models() -> list[Model]:
    """Return the models; scipy and numbalsoda have the same equations, and each integrator is checked through one contact."""
    free = "no contact, one revolution [c]: closed form; tolerance 1e-12"
    once = "until the second contact [c]: second formulation; tolerance {}"
    made = [Model("equations derived by hand", free, lambda: _farthest(_free_equations(1e-12), free_orbit()), 1e-7)]
    made += [
        Model(f"scipy {method}", once.format(f"{one:g}"), lambda m=method, t=one: until_second_contact(scipys(m, t)[1]), 1e-7)
        for method, one in (("DOP853", 3e-14), ("LSODA", 1e-11))
    ]
    made += [
        Model(
            f"numbalsoda DOP853, time in {1e3 * unit:g} ms",
            once.format("1e-10"),
            lambda unit=unit: until_second_contact(numbalsodas(1e-10, unit)[1]),
            1e-7,
            "numbalsoda",
        )
        for unit in (1e-5, 1e-4, 1e-3)
    ]
    made += [
        Model("Exudyn DOPRI5", free, lambda: _farthest(contact_free(1e-12), free_orbit()), 1e-7, "exudyn"),
        Model(
            "Exudyn DOPRI5",
            once.format("1e-10"),
            lambda: until_second_contact(exudyns(1e-10, Settings(longest=6e-6))[1]),
            1e-7,
            "exudyn",
        ),
    ]
    return made


def _free_equations(tolerance: float) -> np.ndarray:
    """Return the orbit of the equations derived by hand without contact."""

    def slope(t: float, y: np.ndarray) -> np.ndarray:
        return np.array(rates(t, *y, False, 1.0))

    atol = tolerance * np.array([CLEARANCE, CLEARANCE, 100.0, 10.0])
    found = solve_ivp(slope, (0.0, UNTIL), start(), "DOP853", t_eval=TIMES, rtol=tolerance, atol=atol)
    x = CRANK * np.cos(SPEED * TIMES) + ROD * np.cos(found.y[0]) - found.y[1]
    return np.column_stack([x, CRANK * np.sin(SPEED * TIMES) + ROD * np.sin(found.y[0])])


def _farthest(orbit: np.ndarray, exact: np.ndarray) -> float:
    """Return the largest distance, in clearances."""
    return float(np.max(np.hypot(*(orbit - exact).T))) / CLEARANCE
