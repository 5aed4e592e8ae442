"""The oil film of a clearance joint, and the asperities of its surfaces: force, friction, energy, pressure, thickness."""

from __future__ import annotations

import math
from typing import Annotated, Any

import numpy as np

from scissordyn.components.declaration import component
from scissordyn.components.film.asperities import ASPERITY_STIFFNESS, asperity_contact, mean_gap
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
from scissordyn.laws.material import STEEL
from scissordyn.units import Meaning, Quantity

MODELS = ("finite", "short", "long")  # Names of the bearing models of an oil film; the kernel gets the index

# Names of the kernel's parameters before the table of film forces
SCALARS = ("viscosity", "clearance", "radius", "length", "roughness", "modulus", "model", "full")
FIRST_TABLE_VALUE = len(SCALARS)  # index of the first entry of the table of film forces in the kernel's parameters


def force(
    x,
    y,
    angle,
    x_rate,
    y_rate,
    speed,
    differences,
    viscosity,
    clearance,
    radius,
    length,
    roughness,
    modulus,
    model,
    full,
    table,
):
    """Return force [N] and torque [N m] on the journal, energy [J], dissipated power [W], then the outputs.

    `roughness` is relative to the clearance. Pressures are not computed if `differences` is 1.
    """
    ex, ey = x / clearance, y / clearance
    eccentricity = math.sqrt(ex * ex + ey * ey)
    nx, ny = (ex / eccentricity, ey / eccentricity) if eccentricity > 0.0 else (1.0, 0.0)
    gap = mean_gap(1.0 - eccentricity, roughness)
    e = 1.0 - gap
    # velocity that changes the film thickness: 2 e'/c minus the rotation, which carries oil along
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
        radial, tangential, pressure = tabulated(table, FIRST_TABLE_VALUE, gap, direction)
        tangential = math.copysign(1.0, sine) * tangential
    stiff = viscosity * (radius / clearance) * (radius / clearance) * size
    if differences == 0.0:
        if model > 0.0:
            pressure = tabulated_pressure(table, FIRST_TABLE_VALUE, gap, direction)
        pressure = max(stiff * pressure, 0.0)
        # Reynolds' equation without a condition on p is odd in the velocity; the cavity of a wedge is in the model of p >= 0,
        # the one that a journal leaves behind is not
        if full == 1.0:
            tension = max(stiff * tabulated_pressure(table, FIRST_TABLE_VALUE, gap, math.pi - direction), 0.0)
        elif cosine < 0.0:
            tension = max(-cosine * stiff * squeezed_pressure(table, FIRST_TABLE_VALUE, gap), 0.0)
    stiff *= radius * length
    fx, fy = stiff * (radial * nx - tangential * ny), stiff * (radial * ny + tangential * nx)
    shear = 2.0 * math.pi * viscosity * speed * radius * radius * radius * length / (clearance * math.sqrt(1.0 - e * e))
    torque = -shear - 0.5 * (x * fy - y * fx)
    lost = -(fx * x_rate + fy * y_rate + torque * speed)
    carried, energy = asperity_contact(eccentricity, roughness)
    carried, energy = modulus * radius * length * carried, modulus * radius * length * clearance * energy
    fx, fy = fx - carried * nx, fy - carried * ny
    away, squeeze = clearance * eccentricity, nx * x_rate + ny * y_rate
    thickness, sliding = clearance - away, radius * abs(speed)
    return fx, fy, torque, energy, lost, thickness, pressure, lost, away, tension, squeeze, sliding, carried


LENGTH = {"above": 0.0, "maximum": 10.0}  # Bounds of an oil film's lengths [m]


@component(
    port=FRAME,
    force=force,
    context=("differences",),
    outputs=(
        Output("thickness", "m", "least distance of the surfaces' mean planes, negative in contact"),
        Output("pressure", "Pa", "largest pressure of the film", monitored=True),
        Output("power_lost", "W", "power lost by shear and by flow"),
        Output("eccentricity", "m", "distance of the journal from the centre of its bearing", monitored=True),
        Output(
            "tension", "Pa", "drop below ambient pressure that the film behind a receding journal would have", monitored=True
        ),
        Output("squeeze_speed", "m/s", "speed at which the film gets thinner"),
        Output("sliding_speed", "m/s", "sliding speed of the surfaces"),
        Output("asperity_force", "N", "part of the force that the asperities carry"),
    ),
    example={"start": "crank.end", "end": "rod.start", "viscosity": "50 mPa s", "clearance": "0.2 mm"},
    source="Booker 1965, Dynamically loaded journal bearings: mobility method of solution; "
    "Greenwood and Tripp 1970, The contact of two nominally flat rough surfaces; "
    "Patir and Cheng 1978, An average flow model for three-dimensional roughness in partial lubrication",
)
class Film:
    r"""Oil film between a journal and its bearing; a clearance joint with `lubrication` has one.

    .. math:: F = \mu R L \left(\frac{R}{c}\right)^2 \left|2\dot\varepsilon - \omega\times\varepsilon\right| W(\varepsilon,\psi)

    with the impedance W of a short, a long or a finite bearing. Only positive pressures count. The table of finite bearings
    satisfies Reynolds' equation with that condition, for lengths of a quarter to four diameters. W is that of a smooth bearing
    whose least film thickness is the mean gap of the rough surfaces. Film and asperities carry the load together.
    """

    name: str
    start: Annotated[BodyPoint, Meaning("centre of the bearing")]
    end: Annotated[BodyPoint, Meaning("centre of the journal")]
    viscosity: Annotated[float, Quantity("Pa s", above=0.0, maximum=1e4, help="dynamic viscosity mu")]
    clearance: Annotated[float, Quantity("m", **LENGTH, help="radial clearance c")]
    radius: Annotated[float, Quantity("m", **LENGTH, help="radius R of the journal")] = 10e-3
    length: Annotated[float, Quantity("m", **LENGTH, help="axial length L of the bearing")] = 15e-3
    roughness: Annotated[float, Quantity("m", **LENGTH, help="combined rms roughness sigma of both surfaces")] = 1e-6
    modulus: Annotated[float, Quantity("Pa", minimum=0.0, maximum=1e13, help="K E* of the asperities")] = (
        0.5 * ASPERITY_STIFFNESS / STEEL.compliance
    )
    model: Annotated[str, Meaning("finite, short or long bearing")] = "finite"
    full: Annotated[bool, Meaning("whether negative pressures count, too, as under high ambient pressure")] = False

    def parameters(self, start: tuple[float, ...]) -> tuple[float, ...]:
        """Return the parameters of the kernel, then the table of impedances for the length of the bearing."""
        ratio, model = 0.5 * self.length / self.radius, MODELS.index(self.model)
        table = pressure_table(self.model, ratio) if model else finite_table(ratio)
        oil = self.viscosity, self.clearance, self.radius, self.length
        surfaces = self.roughness / self.clearance, self.modulus
        return (*oil, *surfaces, float(model), float(self.full), *padded(table).ravel().tolist())


def with_contact_damping(parameters: np.ndarray, place: np.ndarray) -> np.ndarray:
    """Return the parameters of a film with a thicker oil and without asperities, which do not damp.

    With the journal at `place`, it damps approach and separation, on average, as the given film damps an approach at contact.
    """
    viscosity, nearest = parameters[:2]
    without = np.concatenate([parameters[:5], [0.0], parameters[6:]])
    here = min(math.hypot(place[0], place[1]), nearest)

    def damping(away: float, rate: float) -> float:
        plain: Any = force
        return -float(plain(away, 0.0, 0.0, rate, 0.0, 0.0, 1.0, *without[:FIRST_TABLE_VALUE], without)[0]) / rate

    stronger = 2.0 * damping(nearest, 1.0) / (damping(here, 1.0) + damping(here, -1.0))
    return np.concatenate([[stronger * viscosity], without[1:]])
