"""The oil film of a clearance joint: force and friction on the journal, power lost, thickness and pressure."""

from __future__ import annotations

import math
from typing import Annotated, Any

import numpy as np

from scissordyn.components.declaration import component
from scissordyn.components.film.impedance import (
    finite_table,
    long_bearing,
    padded,
    pressure_table,
    short_bearing,
    squeezed_pressure,
    tabulated,
    tabulated_pressure,
)
from scissordyn.components.place import BodyPoint
from scissordyn.components.port import FRAME, Output
from scissordyn.kernel import kernel
from scissordyn.units import Meaning, Quantity

MODELS = ("finite", "short", "long")  # Bearing models: their place is the kernel's number for them
FIRST = 7  # Where the table begins among the parameters


@kernel
def film_gap(gap, thinnest):
    """Film thickness over the clearance, which goes smoothly over to a least one where the surfaces' roughness carries."""
    bend = 0.5 * thinnest
    reach = (gap - thinnest) / bend
    if reach > 40.0:
        return gap
    return thinnest + bend * math.log1p(math.exp(reach))


def force(x, y, angle, x_rate, y_rate, speed, differences, viscosity, clearance, radius, length, thinnest, model, full, table):
    """Force [N] and torque [N m] on the journal, energy [J], power lost [W], then the outputs; differences need no pressure."""
    ex, ey = x / clearance, y / clearance
    eccentricity = math.sqrt(ex * ex + ey * ey)
    nx, ny = (ex / eccentricity, ey / eccentricity) if eccentricity > 0.0 else (1.0, 0.0)
    gap = film_gap(1.0 - eccentricity, thinnest)
    e = 1.0 - gap
    # what changes the thickness: 2 e'/c less the rotation that carries oil
    ux, uy = 2.0 * x_rate / clearance + speed * ey, 2.0 * y_rate / clearance - speed * ex
    size = math.sqrt(ux * ux + uy * uy)
    cosine, sine = ((nx * ux + ny * uy) / size, (nx * uy - ny * ux) / size) if size > 0.0 else (1.0, 0.0)
    direction = math.atan2(abs(sine), cosine)
    ratio, pressure, tension = 0.5 * length / radius, 0.0, 0.0
    if model == 1.0:
        radial, tangential = short_bearing(e, sine, cosine, full == 1.0)
        radial, tangential = ratio * ratio * radial, ratio * ratio * tangential
    elif model == 2.0:
        radial, tangential = long_bearing(e, sine, cosine, full == 1.0)
    else:
        radial, tangential, pressure = tabulated(table, FIRST, gap, direction)
        tangential = math.copysign(1.0, sine) * tangential
    stiff = viscosity * (radius / clearance) * (radius / clearance) * size
    if differences == 0.0:
        if model > 0.0:
            pressure = tabulated_pressure(table, FIRST, gap, direction)
        pressure = max(stiff * pressure, 0.0)
        # Reynolds' equation without a condition on p is odd in the velocity; the cavity of a wedge is in the model of p >= 0,
        # the one that a journal leaves behind is not
        if full == 1.0:
            tension = max(stiff * tabulated_pressure(table, FIRST, gap, math.pi - direction), 0.0)
        elif cosine < 0.0:
            tension = max(-cosine * stiff * squeezed_pressure(table, FIRST, gap), 0.0)
    stiff *= radius * length
    fx, fy = stiff * (radial * nx - tangential * ny), stiff * (radial * ny + tangential * nx)
    shear = 2.0 * math.pi * viscosity * speed * radius * radius * radius * length / (clearance * math.sqrt(1.0 - e * e))
    torque = -shear - 0.5 * (x * fy - y * fx)
    lost = -(fx * x_rate + fy * y_rate + torque * speed)
    away, squeeze = clearance * eccentricity, nx * x_rate + ny * y_rate
    return fx, fy, torque, 0.0, lost, clearance - away, pressure, lost, away, tension, squeeze, radius * abs(speed)


LENGTH = {"above": 0.0, "maximum": 10.0}


@component(
    port=FRAME,
    force=force,
    context=("differences",),
    outputs=(
        Output("thickness", "m", "least distance of the surfaces, negative where they touch"),
        Output("pressure", "Pa", "largest pressure of the film", monitored=True),
        Output("power_lost", "W", "power lost by shear and by flow"),
        Output("eccentricity", "m", "distance of the journal from the centre of its bearing", monitored=True),
        Output(
            "tension", "Pa", "how far the film behind a journal that leaves would fall below the surroundings", monitored=True
        ),
        Output("squeeze_speed", "m/s", "how fast the film gets thinner"),
        Output("sliding_speed", "m/s", "of the surfaces past each other"),
    ),
    example={"start": "crank.end", "end": "rod.start", "viscosity": "50 mPa s", "clearance": "0.2 mm"},
    source="Booker 1965, Dynamically loaded journal bearings: mobility method of solution",
)
class Film:
    r"""The oil between a journal and its bearing; a clearance joint with `lubrication` has one.

    .. math:: F = \mu R L \left(\frac{R}{c}\right)^2 \left|2\dot\varepsilon - \omega\times\varepsilon\right| W(\varepsilon,\psi)

    with the impedance W of a short, a long or a finite bearing. Pressure counts where it is positive; the table of finite
    bearings satisfies Reynolds' equation with that condition, for lengths of a quarter to four diameters.
    """

    name: str
    start: Annotated[BodyPoint, Meaning("centre of the bearing")]
    end: Annotated[BodyPoint, Meaning("centre of the journal")]
    viscosity: Annotated[float, Quantity("Pa s", above=0.0, maximum=1e4, help="dynamic viscosity mu")]
    clearance: Annotated[float, Quantity("m", **LENGTH, help="radial clearance c")]
    radius: Annotated[float, Quantity("m", **LENGTH, help="radius R of the journal")] = 10e-3
    length: Annotated[float, Quantity("m", **LENGTH, help="axial length L of the bearing")] = 15e-3
    roughness: Annotated[float, Quantity("m", above=0.0, maximum=1e-2, help="film thickness at which peaks carry")] = 1e-6
    model: Annotated[str, Meaning("finite, short or long bearing")] = "finite"
    full: Annotated[bool, Meaning("whether negative pressures count, too, as under high ambient pressure")] = False

    def parameters(self, start: tuple[float, ...]) -> tuple[float, ...]:
        """Its numbers, and the table of its length."""
        ratio, model = 0.5 * self.length / self.radius, MODELS.index(self.model)
        table = pressure_table(self.model, ratio) if model else finite_table(ratio)
        thinnest = self.roughness / self.clearance
        parameters = (self.viscosity, self.clearance, self.radius, self.length, thinnest, float(model), float(self.full))
        return (*parameters, *padded(table).ravel().tolist())


def thinned(parameters: np.ndarray, place: np.ndarray) -> np.ndarray:
    """Parameters of an oil with which the film damps here, on average, as its own does an approach where roughness carries."""
    viscosity, clearance, _, _, thinnest = parameters[:5]
    nearest = (1.0 - thinnest) * clearance
    here = min(math.hypot(place[0], place[1]), nearest)

    def damping(away: float, rate: float) -> float:
        plain: Any = force
        return -float(plain(away, 0.0, 0.0, rate, 0.0, 0.0, 1.0, *parameters[:FIRST], parameters)[0]) / rate

    stronger = 2.0 * damping(nearest, 1.0) / (damping(here, 1.0) + damping(here, -1.0))
    return np.concatenate([[stronger * viscosity], parameters[1:]])
