"""Bars that bend: elastica, vibration, rotation, a wall and heat."""

from __future__ import annotations

import dataclasses
import itertools
import math
from typing import Any

import numpy as np
import xarray as xr
from scipy.optimize import minimize_scalar

import scissordyn as sd
from scissordyn.components.time_function import tabulated
from scissordyn.laws.damping.none import NoDamping
from scissordyn.laws.elastic.linear import Linear
from validation.case import Case, Check

__all__ = ["CASE"]

NAME = "bending"
RIGIDITY = 100.0  # Bending stiffness of the bar [N m^2]
ELASTICA = {
    1.0: (0.46135194971188, 0.056433236283377, 0.30172077379981),
    10.0: (1.4302855388039, 0.55499559775375, 0.8106090248803),
}
"""Angle at the tip and displacements of the tip along and across the bar, over L, by P L^2/EI."""

MODES = 24  # Modes of a bar as one part against a wall

BETA = 1.87510406871196, 4.69409113297417, 7.85475743823761  # Eigenvalues beta L of the first modes of a cantilever
FLAPPING = {1.0: (3.681647, 22.181011, 61.841763), 2.0: (4.137320, 22.614922, 62.273184)}
"""Flapping frequencies of a rotating cantilever by rotation speed, both times sqrt(mu L^4/EI)."""


@dataclasses.dataclass(frozen=True)
class Kind:
    """Way in which a bar is made flexible: by beam elements or by modes.

    Parameters
    ----------
    name : str
    last : str
        Name of the last cross-section.
    options : dict
        Options of `with_bending`.
    """

    name: str
    last: str
    options: dict[str, Any]


CHAIN = Kind("8 elements", "bar/8", {"elements": 8})
WHOLE = Kind("12 modes", "bar/2", {"modes": 12})


def bar(*, length: float = 1.0, mass: float = 1.0) -> sd.Mechanism:
    """Return a rigid bar, pinned at its start, that a drive may clamp."""
    pin = sd.Revolute("clamp", ("bar", "start"), ("ground", "O"))
    return sd.Mechanism(
        (sd.bar("bar", length=length, mass=mass),), (pin,), ground=(("O", (0.0, 0.0)),), gravity=0.0, input_body="bar"
    )


def still(mechanism: sd.Mechanism) -> xr.Dataset:
    """Return a run of a mechanism at rest in static equilibrium."""
    return sd.simulate(mechanism, until=1e-5, samples=2, start="static")


def tip(found: xr.Dataset) -> tuple[float, float, float]:
    """Return x and y [m] and the angle [rad] of the last cross-section."""
    last = str(found["body"].values[-1])
    place = found["position"].sel(body=last)[0].values
    return float(place[0]), float(place[1]), float(found["angle"].sel(body=last)[0])


def welded(count: int, *, middle: bool = True) -> sd.Mechanism:
    """Return a bar of 1 m that consists of `count` welded bars, with a cross-section in the middle of each if `middle`."""
    parts = [sd.bar(f"bar {k}", length=1.0 / count, mass=1.0 / count, position=(k / count, 0.0)) for k in range(1, count)]
    bars = (sd.bar("bar", length=1.0 / count, mass=1.0 / count), *parts)
    if not middle:
        ends = ("start", "end")
        bars = tuple(dataclasses.replace(each, points={name: each.points[name] for name in ends}) for each in bars)
    welds = tuple(
        sd.Weld(f"weld {k}", (one.name, "end"), (other.name, "start"))
        for k, (one, other) in enumerate(itertools.pairwise(bars))
    )
    return dataclasses.replace(bar(), bodies=bars, welds=welds)


def checks() -> list[Check]:
    """Check bending, vibration, rotation, a wall and heat, for bars of elements and for bars of modes."""
    chains = [*_elastica(), *_circle(), *_vibration(), *_rotating(CHAIN, 5e-6), *_spun_up(CHAIN, 2e-4), *_wall(), *_heated()]
    wholes = [*_elastica_by_modes(), *_circle_by_modes(), *_vibration_by_modes(), *_rotating(WHOLE, 5e-6)]
    wholes += [*_spun_up(WHOLE, 2e-3), *_wall(modes=MODES), *_heated_by_modes()]
    return [*chains, *_balance("2 elements", elements=2), *wholes, *_balance("8 modes", modes=8)]


def _bent_by_force(rigid: sd.Mechanism, name: str, allowed: tuple[float, float], load: float, **options: Any) -> list[Check]:
    """Check an elastica; `allowed` has the errors of the angle and of the position of the tip."""
    made = sd.with_bending(rigid, bending_stiffness=RIGIDITY, axial_stiffness=1e9, **options)
    force = sd.Force("push", (made.bodies[-1].name, "end"), (0.0, RIGIDITY * load))
    x, y, angle = tip(still(made.with_parts({"components": (*made.components, force)}).driven(speed=0.0)))
    name, expected = f"P L²/EI = {load:g}, {name}", ELASTICA[load]
    return [
        Check(f"{name}: angle at the tip [rad]", expected[0], angle, allowed[0], "closed form"),
        Check(f"{name}: way along the bar [L]", expected[1], 1.0 - x, allowed[1], "closed form"),
        Check(f"{name}: way across it [L]", expected[2], y, allowed[1], "closed form"),
    ]


def _elastica() -> list[Check]:
    found = []
    for load in ELASTICA:
        for elements in (8, 16):
            allowed = 1e-6 if load < 5.0 or elements > 8 else 1e-5
            found += _bent_by_force(bar(), f"{elements} elements", (allowed, allowed), load, elements=elements)
    return found


def _elastica_by_modes() -> list[Check]:
    """Check an elastica by modes: one bar with a large slope is less accurate; several bars need few modes."""
    found = []
    for load in ELASTICA:
        allowed = (1e-6, 5e-6) if load < 5.0 else (2e-5, 2e-5)
        found += _bent_by_force(bar(), WHOLE.name, allowed, load, **WHOLE.options)
        found += _bent_by_force(welded(8), "8 bars of 3 modes", (1e-6, 1e-6), load, modes=3)
    return found


def _bent_by_moment(rigid: sd.Mechanism, name: str, allowed: float, **options: Any) -> list[Check]:
    """Check a bar bent to a circle."""
    made = sd.with_bending(rigid, bending_stiffness=RIGIDITY, axial_stiffness=1e7, **options)
    moment = sd.Torque("moment", made.bodies[-1].name, 2.0 * math.pi * RIGIDITY)
    x, y, angle = tip(still(made.with_parts({"components": (*made.components, moment)}).driven(speed=0.0)))
    name = f"end moment 2 pi EI/L, {name}"
    away = math.hypot(x, y)
    return [
        Check(f"{name}: distance of the end from the clamp [L]", 0.0, away, allowed, "closed form", relative=False),
        Check(f"{name}: angle at the end [rad]", 2.0 * math.pi, angle, allowed, "closed form"),
    ]


def _circle() -> list[Check]:
    return _bent_by_moment(bar(), CHAIN.name, 1e-10, **CHAIN.options)


def _circle_by_modes() -> list[Check]:
    """Check a circle by modes, which assume small strains: with EI kappa^2/EA = 3.9e-4 the curvature is 7.9e-4 too large."""
    return _bent_by_moment(welded(2, middle=False), "2 bars of 8 modes", 1e-3, modes=8)


def _vibrating(name: str, allowed: tuple[float, float, float], **options: Any) -> list[Check]:
    made = sd.with_bending(bar(), bending_stiffness=RIGIDITY, axial_stiffness=1e7, **options).driven(speed=0.0)
    omega = sd.modes(made, position="concentric", count=3)["angular_frequency"].values
    beta = np.sqrt(omega * math.sqrt(1.0 / RIGIDITY))
    return [
        Check(f"cantilever, {name}: beta L of mode {k + 1}", BETA[k], float(beta[k]), allowed[k], "closed form")
        for k in range(3)
    ]


def _vibration() -> list[Check]:
    return _vibrating("16 elements", (1e-6, 1e-5, 1e-4), elements=16)


def _vibration_by_modes() -> list[Check]:
    return _vibrating(WHOLE.name, (1e-6, 1e-5, 1e-5), **WHOLE.options)


def _rotating(kind: Kind, allowed: float) -> list[Check]:
    """Check the frequencies of the vibration after a push by least squares."""
    found, unit = [], math.sqrt(RIGIDITY)
    for part, flapping in FLAPPING.items():
        made = sd.with_bending(bar(), bending_stiffness=RIGIDITY, axial_stiffness=1e8, **kind.options)
        push = sd.Force("push", (kind.last, "end"), (0.0, 0.05), time_function=sd.Cycloidal(1.0, 0.0, 0.05))
        made = made.with_parts({"components": (*made.components, push)}).driven(speed=part * unit)
        path = sd.simulate(made, until=2.0, samples=4001, rtol=1e-9, atol=1e-9)
        time = path["time"].values
        across = _in_clamp_frame(path)[:, 1][time > 0.06]
        time = time[time > 0.06]
        omega = [unit * math.sqrt(each**2 - part**2) for each in flapping]
        for _ in range(3):
            for k in range(3):
                omega[k] = _nearest(time, across, omega, k)
        expected = unit * math.sqrt(flapping[0] ** 2 - part**2)
        name = f"rotating at {part:g} sqrt(EI/µ)/L², {kind.name}: first frequency in its plane [rad/s]"
        found.append(Check(name, expected, omega[0], allowed, "closed form"))
    return found


def _nearest(time: np.ndarray, values: np.ndarray, omega: list[float], k: int) -> float:
    """Return the frequency k whose harmonics leave the least residual, with the other frequencies fixed."""

    def left(trial: float) -> float:
        waves = [wave(each * time) for each in (*omega[:k], trial, *omega[k + 1 :]) for wave in (np.cos, np.sin)]
        columns = np.column_stack([*waves, np.ones_like(time)])
        amplitudes = np.linalg.lstsq(columns, values, rcond=None)[0]
        return float(np.sum((columns @ amplitudes - values) ** 2))

    reach = 3e-3 / (k + 1.0)
    bounds = omega[k] * (1.0 - reach), omega[k] * (1.0 + reach)
    return float(minimize_scalar(left, bounds=bounds, method="bounded", options={"xatol": 1e-9 * omega[k]}).x)


def _in_clamp_frame(found: xr.Dataset) -> np.ndarray:
    """Return the position of the last cross-section along and across the clamp's direction [m]."""
    angle, place = found["angle"].sel(body="bar").values, found["position"].isel(body=-1).values
    cos, sin = np.cos(angle), np.sin(angle)
    return np.column_stack([cos * place[:, 0] + sin * place[:, 1], cos * place[:, 1] - sin * place[:, 0]])


def _spun_up(kind: Kind, allowed: float) -> list[Check]:
    """Check the extension of a bar that is spun up; with modes its unit first direction must be compensated."""
    length, axial, mass, speed, lasting = 10.0, 2.8e7, 12.0, 6.0, 15.0

    def angle(t: float) -> float:
        if t >= lasting:
            return speed * (t - 0.5 * lasting)
        turn = 2.0 * math.pi / lasting
        return speed / lasting * (0.5 * t**2 + (math.cos(turn * t) - 1.0) / turn**2)

    made = sd.with_bending(bar(length=length, mass=mass), bending_stiffness=1.4e4, axial_stiffness=axial, **kind.options)
    driven = made.driven(tabulated(angle, until=20.0, points=401))
    found = sd.simulate(driven, until=20.0, samples=4001, method="rodas5p", rtol=1e-6, atol=1e-6)
    along = _in_clamp_frame(found)[:, 0]
    k = math.sqrt(mass / length * speed**2 * length**2 / axial)
    late = found["time"].values > lasting + 0.5
    name = f"spun up, {kind.name}"
    return [
        Check(
            f"{name}: mean extension after 15.5 s [m]",
            length * (math.tan(k) / k - 1.0),
            float(np.mean(along[late])) - length,
            allowed,
            "closed form",
        ),
        Check(
            f"{name}: the same as published [m]", 5.14e-4, float(np.mean(along[late])) - length, max(allowed, 1e-3), "published"
        ),
    ]


def _wall(modes: int | None = None) -> list[Check]:
    """Check a bar against a wall, with 16 elements or with modes."""
    speed, axial, gap = 1.0, 1e6, 1e-3
    loose = sd.Clearance(gap, stiffness=Linear(1e9), damping=NoDamping(), friction=sd.NoFriction())
    free = dataclasses.replace(sd.bar("bar", length=1.0, mass=1.0), velocity=(speed, 0.0))
    wall = sd.Revolute("wall", ("bar", "end"), ("ground", "wall"))
    made = sd.Mechanism((free,), (wall,), ground=(("wall", (1.0, 0.0)),), gravity=0.0).with_clearance("wall", loose)
    kind: dict[str, Any] = {"elements": 16} if modes is None else {"modes": modes}
    made = sd.with_bending(made, bending_stiffness=RIGIDITY, axial_stiffness=axial, **kind)
    found = sd.simulate(made, until=4.2e-3, samples=8001, start="as-placed")
    time, force = found["time"].values, found["normal_force"].sel(joint="wall").values
    wave, start = math.sqrt(axial), gap / speed
    lasting = found["contact_start"].values + found["contact_duration"].values
    within = (time > start + 0.1 * 2.0 / wave) & (time < start + 0.9 * 2.0 / wave)
    name = f"against a wall, {'16 elements' if modes is None else f'{modes} modes'}"
    return [
        Check(f"{name}: mean force [N]", wave * speed, float(np.mean(force[within])), 0.02, "closed form"),
        Check(f"{name}: time until it leaves [s]", 2.0 / wave, float(lasting.max()) - start, 0.05, "closed form"),
        Check(f"{name}: rebound speed [m/s]", speed, float(np.trapezoid(force, time)) - speed, 0.02, "closed form"),
    ]


def _heated() -> list[Check]:
    depth, alpha, rise, across = 0.02, 12e-6, 80.0, 30.0
    options: dict[str, Any] = {"section": "solid 20x20 mm", "material": "steel", "elements": 2, "temperature_rise": rise}
    mass = 7850.0 * depth**2
    x, y, angle = tip(still(sd.with_bending(bar(mass=mass), **options, temperature_difference=across).driven(speed=0.0)))
    arc = alpha * across / depth
    longer = 1.0 + alpha * rise
    held = bar(mass=mass)
    held = dataclasses.replace(held, guides=(sd.Guide("end", ("bar", "end"), (1.0, 0.0), math.pi / 2.0),))
    pressed = still(sd.with_bending(held, **options).driven(speed=0.0))
    return [
        Check("heated: angle of the free end [rad]", arc, angle, 1e-9, "closed form"),
        Check("heated: x of the free end [m]", longer * math.sin(arc) / arc, x, 1e-10, "closed form"),
        Check("heated: y of the free end [m]", longer * (1.0 - math.cos(arc)) / arc, y, 1e-7, "closed form"),
        Check(
            "heated between walls: axial force [N]",
            -210e9 * depth**2 * alpha * rise,
            float(pressed["beam_axial_force"][0, 0]),
            1e-8,
            "closed form",
        ),
    ]


def _heated_by_modes() -> list[Check]:
    """Check heat by modes: rise and gradient apart, as a clamped direction has length one, and a rise between pins."""
    depth, alpha, rise, across = 0.02, 12e-6, 8.0, 30.0
    options: dict[str, Any] = {"section": "solid 20x20 mm", "material": "steel", **WHOLE.options}
    mass, arc, name = 7850.0 * depth**2, alpha * across / depth, f"heated, {WHOLE.name}"
    x, y, angle = tip(still(sd.with_bending(bar(mass=mass), **options, temperature_difference=across).driven(speed=0.0)))
    clamped = tip(still(sd.with_bending(bar(mass=mass), **options, temperature_rise=rise).driven(speed=0.0)))
    along = dataclasses.replace(bar(mass=mass), guides=(sd.Guide("end", ("bar", "end")),))
    free = tip(still(sd.with_bending(along, **options, temperature_rise=rise)))
    pins = (*bar().joints, sd.Revolute("end", ("bar", "end"), ("ground", "E")))
    held = dataclasses.replace(bar(mass=mass), joints=pins, ground=(("O", (0.0, 0.0)), ("E", (1.0, 0.0))))
    pressed = still(sd.with_bending(held, **options, temperature_rise=rise))
    return [
        Check(f"{name}, gradient alone: angle of the free end [rad]", arc, angle, 1e-7, "closed form"),
        Check(f"{name}, gradient alone: x of the free end [m]", math.sin(arc) / arc, x, 1e-7, "closed form"),
        Check(f"{name}, gradient alone: y of the free end [m]", (1.0 - math.cos(arc)) / arc, y, 1e-7, "closed form"),
        Check(f"{name}, clamped: extension [m]", alpha * rise, clamped[0] - 1.0, 1e-2, "closed form"),
        Check(f"{name}, pinned: extension [m]", alpha * rise, free[0] - 1.0, 1e-9, "closed form"),
        Check(
            f"{name}, between pins: axial force [N]",
            -210e9 * depth**2 * alpha * rise,
            float(pressed["beam_axial_force"][0, 0]),
            1e-9,
            "closed form",
        ),
    ]


def _balance(name: str, **options: int) -> list[Check]:
    """Check the energy balance of a mechanism with bars that bend and a film."""
    arm = sd.scissor(units=1, bar_length=2.0, bar_mass=5.68, slider_mass=5.0, angle=sd.degrees(30))
    oil = sd.Lubrication(viscosity=0.1)
    loose = sd.Clearance(0.5e-3, journal_radius=10e-3, bearing_length=15e-3, friction=sd.NoFriction(), lubrication=oil)
    made = sd.with_bending(arm.with_clearance("A", loose), section="tube 60x60x1.56 mm", material="steel", **options)
    found = sd.simulate(made.driven(speed=sd.rpm(60)), until=0.02, rtol=1e-10, atol=1e-10)
    work = float(np.ptp(found["drive_work"].values))
    left = abs(float(found["energy_residual"].values[-1])) / work  # samples inside steps have the error of their interpolation
    return [
        Check(
            f"bars that bend and oil, {name}: energy that is missing at the end, over the work of the drive",
            0.0,
            left,
            1e-8,
            "closed form",
            relative=False,
        )
    ]


CASE = Case(NAME, "Bars that bend", checks, quick=False)
