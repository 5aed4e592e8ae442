"""Compare the largest force of an oiled joint with that of the dry one, for rigid and elastic surfaces.

The joint varies in roughness, viscosity and clearance. Elastic surfaces are computed for a free mass by scipy: the foundation
of Liu's contact law yields by u under the force F_el(u) of film and asperities. The mean planes are h = c - e + u apart, and
the film is squeezed at the rate -h'.
"""

from __future__ import annotations

import math

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import scissordyn as sd
from benchmarks.measure import command, table
from scissordyn.components.film.asperities import ASPERITY_STIFFNESS, asperity_contact, mean_gap
from scissordyn.components.film.impedance import finite_table, looked_up

UNTIL, RADIUS, LENGTH = 0.05, 10e-3, 15e-3
CLEARANCES, VISCOSITIES, ROUGHNESSES = (2e-4, 4e-4, 6e-4), (0.01, 0.03, 0.1, 0.3), (0.5e-6, 1e-6, 2e-6, 4e-6, 8e-6)
MASS, SPEEDS = 4.4, (0.46, 0.65, 0.80)
"""Mass [kg] and speeds [m/s] of a free journal: values of the array's first dry impacts, by speed, force and clearance."""

MODULUS = 1.0 / (2.0 * sd.STEEL.compliance)  # E* of steel on steel [Pa]
TABLE = finite_table(0.5 * LENGTH / RADIUS)


def array(clearance: float, oil: sd.Lubrication | None) -> tuple[float, float]:
    """Return the largest force of joint A in the stroke [N] and the ratio of film thickness to roughness at that instant."""
    joint = sd.Clearance(clearance, friction=sd.NoFriction(), lubrication=oil)
    run = sd.simulate(sd.scissor(units=2).driven(speed=sd.rpm(150)).with_clearance("A", joint), until=UNTIL, samples=11)
    thickness = math.nan if oil is None else float(run["film_peak_force_thickness"][0]) / oil.roughness
    return float(run["joint_peak_force"].sel(joint="A")), thickness


def foundation(u: float, clearance: float) -> float:
    """Return the force of Liu's elastic foundation [N]."""
    return LENGTH * 0.5 * math.pi * MODULUS * u * math.sqrt(u / (2.0 * (clearance + u))) if u > 0.0 else 0.0


def free_mass(clearance: float, speed: float, oil: sd.Lubrication, *, elastic: bool) -> tuple[float, float]:
    """Return the largest force on a free journal that starts at the centre [N], and the gap of the mean planes then [m]."""
    assert oil.viscosity is not None
    area, rough = RADIUS * LENGTH, oil.roughness / clearance
    scale = 2.0 * oil.viscosity * area * (RADIUS / clearance) ** 2 / clearance

    def film(h: float) -> tuple[float, float]:
        """Return the damping of an approach [N s/m] and the force of the asperities [N]."""
        radial = looked_up(TABLE, 1.0 - mean_gap(h / clearance, rough), 0.0)[0]
        return scale * abs(radial), area * ASPERITY_STIFFNESS * MODULUS * asperity_contact(1.0 - h / clearance, rough)[0]

    def of_elastic(t: float, y: np.ndarray) -> list[float]:
        damping, carried = film(clearance - y[0] + y[2])
        force = foundation(y[2], clearance)
        return [y[1], -force / MASS, y[1] - (force - carried) / damping]

    def of_rigid(t: float, y: np.ndarray) -> list[float]:
        damping, carried = film(clearance - y[0])
        return [y[1], -(damping * y[1] + carried + foundation(y[0] - clearance, clearance)) / MASS]

    def stops(t: float, y: np.ndarray) -> float:
        return float(of_elastic(t, y)[2] if elastic else y[1])

    stops.terminal, stops.direction = True, -1.0  # type: ignore[attr-defined]
    rates, start = (of_elastic, [0.0, speed, 1e-9]) if elastic else (of_rigid, [0.0, speed])
    span = clearance / speed
    found = solve_ivp(rates, (0.0, 20.0 * span), start, "Radau", rtol=1e-7, atol=1e-13, events=stops, max_step=0.05 * span).y.T
    force = [-MASS * rates(0.0, y)[1] for y in found]
    at = int(np.argmax(force))
    return force[at], clearance - found[at, 0] + (found[at, 2] if elastic else 0.0)


def dry_impact(clearance: float, speed: float) -> float:
    """Return the largest force of the dry impact of the free mass, without damping [N]."""
    depth = np.linspace(0.0, 5e-4, 2001)
    forces = np.array([foundation(u, clearance) for u in depth])
    energy = np.concatenate([[0.0], np.cumsum(0.5 * (forces[1:] + forces[:-1]) * np.diff(depth))])
    reach = brentq(lambda u: np.interp(u, depth, energy) - 0.5 * MASS * speed**2, 0.0, depth[-1])
    return foundation(reach, clearance)


def measure(quick: bool) -> str:
    """Return the page."""
    roughnesses = ROUGHNESSES[1:4] if quick else ROUGHNESSES
    rows, free = [], []
    for clearance, speed in zip(CLEARANCES, SPEEDS, strict=True):
        dry, lone = array(clearance, None)[0], dry_impact(clearance, speed)
        for viscosity in VISCOSITIES:
            first = [f"{1e3 * clearance:g} mm", f"{1e3 * viscosity:g} mPa s"]
            oils = [sd.Lubrication(viscosity=viscosity, roughness=roughness) for roughness in roughnesses]
            found = [array(clearance, oil) for oil in oils]
            rows.append([*first, *(f"{force / dry:.2f} at {round(thick, 1) + 0.0:.1f}" for force, thick in found)])
            row = list(first)
            for oil in oils:
                force, (soft, h) = (
                    free_mass(clearance, speed, oil, elastic=False)[0],
                    free_mass(clearance, speed, oil, elastic=True),
                )
                row.append(f"{force / lone:.2f}; {soft / lone:.2f} at {round(h / oil.roughness, 1) + 0.0:.1f}")
            free.append(row)
    head = ["", "", *(f"{1e6 * roughness:g} um" for roughness in roughnesses)]
    first_text = (
        "The paper's array, joint A, frictionless, stroke of 50 ms at 150 rpm, a finite film between rigid surfaces: "
        "largest force of contact, film and asperities over that of the dry joint, by the combined rms roughness; then the "
        "film thickness at that instant over the roughness (0.0: at contact)."
    )
    speeds = ", ".join(f"{speed:g}" for speed in SPEEDS)
    second_text = (
        f"A free journal of {MASS:g} kg from the centre, at {speeds} m/s: the same ratio with rigid surfaces; then with "
        "elastic ones in series with the film, and the distance of the mean planes at that instant over the roughness."
    )
    return f"{first_text}\n\n{table(head, rows)}\n{second_text}\n\n{table(head, free)}"


if __name__ == "__main__":
    command("film_roughness", measure)
