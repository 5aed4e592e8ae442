"""How film and contact are joined: the film of rough surfaces beside the contact, or both blended over a band of roughness.

The blend is that of Flores et al. 2006: for c < e < c + e_0 the force is ((c + e_0 - e) F_film + (e - c) F_dry)/e_0, the film
alone below, the contact alone above. F_film at e >= c is that of the mean gap of
rough surfaces whose mean planes touch, without asperities.
"""

from __future__ import annotations

import json
import math
from statistics import median
from time import perf_counter
from typing import Annotated

import numpy as np
import xarray as xr

import scissordyn as sd
from benchmarks.measure import command, table
from scissordyn.components.film.film import FIRST, Film, force
from scissordyn.components.film.impedance import finite_table, padded
from scissordyn.laws.elastic.liu import Liu
from scissordyn.laws.elastic.liu import force as foundation

UNTIL = 1.0 / 15.0
CLEARANCE, RADIUS, LENGTH, VISCOSITY, ROUGHNESS = 5e-4, 10e-3, 15e-3, 0.05, 1e-6
BANDS = (1e-6, 3e-6, 10e-6)

LAST = FIRST + padded(finite_table(1.0)).size  # Where the band stands among the parameters


def blended_film(
    x, y, angle, x_rate, y_rate, speed, viscosity, clearance, radius, length, roughness, modulus, model, full, table
):
    """The film's force, fading over the band beyond the clearance."""
    fx, fy, torque, _, lost, thickness, pressure, _, _, _, _, _, _ = force(
        x, y, angle, x_rate, y_rate, speed, 0.0, viscosity, clearance, radius, length, roughness, 0.0, model, full, table
    )
    part = min(max((table[LAST] + clearance - math.sqrt(x * x + y * y)) / table[LAST], 0.0), 1.0)
    return part * fx, part * fy, part * torque, 0.0, part * lost, thickness, pressure


@sd.component(
    port="frame",
    force=blended_film,
    section="blended",
    outputs=(
        sd.Output("thickness", "m", "least distance of the surfaces"),
        sd.Output("pressure", "Pa", "largest pressure"),
    ),
)
class BlendedFilm:
    """An oil film that ends a band beyond the clearance."""

    name: str
    start: tuple[str, str]
    end: tuple[str, str]
    band: float

    def parameters(self, start: tuple[float, ...]) -> tuple[float, ...]:
        """Those of a film, and the band."""
        film = Film(self.name, self.start, self.end, VISCOSITY, CLEARANCE, RADIUS, LENGTH, ROUGHNESS)
        return *film.parameters(start), self.band


def blended_contact(indentation, scale, clearance, band):
    """The law of Liu, growing over the band."""
    return min(indentation / band, 1.0) * foundation(indentation, scale, clearance)


@sd.element(slot="stiffness", force=blended_contact)
class BlendedLiu:
    """A contact on an elastic foundation that begins over a band."""

    band: Annotated[float, sd.Quantity("m", above=0.0)] = 1e-6

    def parameters(self, joint: sd.JointContact) -> tuple[float, ...]:
        """Those of Liu's law, and the band."""
        return *Liu().parameters(joint), self.band


def array(band: float | None) -> sd.Mechanism:
    """The paper's array with oil in joint A, 0.5 mm, LuGre friction."""
    driven = sd.scissor(units=2).driven(speed=sd.rpm(150))
    if band is None:
        oil = sd.Lubrication(viscosity=VISCOSITY, roughness=ROUGHNESS)
        return driven.with_clearance("A", sd.Clearance(CLEARANCE, friction=sd.LuGre(0.05), lubrication=oil))
    joint = driven.joint("A")
    gap = sd.Clearance(CLEARANCE, friction=sd.LuGre(0.05), stiffness=BlendedLiu(band))
    film = BlendedFilm("A", joint.bearing, joint.journal, band)
    return driven.with_clearance("A", gap).with_parts({"components": (film,)})


def measure(quick: bool) -> str:
    """The page."""
    made = {"rough surfaces": array(None)} | {f"blend over {1e6 * band:g} um": array(band) for band in BANDS}
    seconds: dict[str, list[float]] = {name: [] for name in made}
    for turn in range(2 if quick else 6):
        for name, mechanism in made.items():
            began = perf_counter()
            sd.simulate(mechanism, until=UNTIL)
            if turn:
                seconds[name].append(perf_counter() - began)
    rows = []
    for name, mechanism in made.items():
        run = sd.simulate(mechanism, until=UNTIL, samples=4001)
        tight = sd.simulate(mechanism, until=UNTIL, samples=4001, rtol=1e-10, atol=1e-10)
        counted = json.loads(run.attrs["statistics"])
        ratio = median(one / first for one, first in zip(seconds[name], seconds["rough surfaces"], strict=True))
        contacts = run["peak_force"].values
        rows.append(
            [
                name,
                str(counted["steps"]),
                str(counted["rejected"]),
                f"{ratio:.2f}",
                f"{_residual(run):.1e}",
                f"{_residual(tight):.1e}",
                str(run.sizes["contact"]),
                f"{1e-3 * contacts.max():.4g}" if contacts.size else "-",
                f"{1e6 * float(run['indentation'].max()):.3g}",
            ]
        )
    head = ["", "steps", "rejected", "time", "balance", "at 1e-10", "contacts", "contact [kN]", "pressed in [um]"]
    return (
        "The paper's array, joint A 0.5 mm, LuGre friction of 0.05, 150 rpm over the stroke; oil of 50 mPa s, finite bearing, "
        "roughness 1 um. Time over that of the rough surfaces, interleaved runs; energy balance over the work of the drive at "
        f"the default tolerance and at 1e-10.\n\n{table(head, rows)}"
    )


def _residual(run: xr.Dataset) -> float:
    return float(np.abs(run["energy_residual"]).max() / np.abs(run["drive_work"]).max())


if __name__ == "__main__":
    command("film_transition", measure)
