"""Recoil of the bristles in ideal pins and guides: friction whose bristles are too soft to hold a sudden load."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np

from scissordyn.components.lugre import GuideLuGre, PinLuGre, bristle_ratio
from scissordyn.kernel import Handle
from scissordyn.plan.plan import Plan
from scissordyn.plan.system import rates
from scissordyn.warning import RunWarning, warning


def recoil_warnings(
    plan: Plan, system: Handle, instants: Iterable[tuple[float, np.ndarray]], holding: float = 0.3
) -> list[RunWarning]:
    """Warn of ideal pins and guides whose bristles recoil faster than the Stribeck speed while the joint is nearly at rest.

    `instants` yields times and states, and sets the system's modes and memories to each. A mass m under the normal force N on
    bristles of stiffness sigma_0 N, bent up to mu_s/sigma_0, recoils at mu_s sqrt(N/(sigma_0 m)). Above the Stribeck speed,
    friction falls to its kinetic value within one vibration of the bristles.

    `holding`: [Stribeck speeds] recoil speed that bristles of the recommended stiffness have. They hold a suddenly applied
    load up to the friction coefficient mu_k + 0.87 (mu_s - mu_k) (decision 0006).
    """
    start, first = system.content.model.state_start, 2 * plan.coordinates.free
    parts = [
        (i, part, first + int(start[len(plan.contacts) + i]))
        for i, part in enumerate(plan.acting)
        if isinstance(part, PinLuGre | GuideLuGre) and part.static > part.kinetic
    ]
    fastest = dict[int, tuple[float, float]]()
    for time, y in instants if parts else ():
        for i, part, entry in parts:
            speed = recoil_speed(plan, system, time, y, part, entry)
            if speed > fastest.get(i, (part.stribeck_speed, 0.0))[0]:
                fastest[i] = speed, time
    warnings = []
    for i, part, _ in parts:
        if i in fastest:
            speed, time = fastest[i]
            stiffness = part.bristle_stiffness * (speed / (holding * part.stribeck_speed)) ** 2
            numbers = {"recoil": speed, "time": time, "speed": part.stribeck_speed}
            numbers |= {"static": part.static, "kinetic": part.kinetic, "stiffer": stiffness}
            warnings.append(warning("recoil", part.name, part.declaration.label, **numbers))
    return warnings


def recoil_speed(plan: Plan, system: Handle, time: float, y: np.ndarray, part: PinLuGre | GuideLuGre, entry: int) -> float:
    """Return the speed [m/s] at which bent bristles throw back the mass that they hold; 0 above the Stribeck speed.

    It is mu_s sqrt(N / (sigma_0 m)). The function bends the bristles a little to both sides: the quotient of the changes of
    slip acceleration and friction coefficient is the normal force N divided by the moving mass m. `entry` is the index of the
    bristle state in `y`.
    """
    coefficients = part.parameters(())[:7]
    n, moved, bend = plan.coordinates.free, y.copy(), 1e-3 * part.static

    def rates_at(bristles: float) -> np.ndarray:
        moved[entry] = bristles
        return rates(system, time, moved)

    def slip() -> float:
        """Return the slip speed: the rate of unbent bristles divided by their stiffness."""
        return float(rates_at(0.0)[entry]) / part.bristle_stiffness

    speed = slip()
    faster = (rates_at(-bend) - rates_at(bend))[n : 2 * n]
    ratios = [bristle_ratio(speed, bristles, *coefficients)[0] for bristles in (bend, -bend)]
    size = float(np.max(np.abs(faster), initial=0.0))
    if not (abs(speed) <= part.stribeck_speed and math.isfinite(size) and size > 0.0 and ratios[0] > ratios[1]):
        return 0.0
    moved[n : 2 * n] += faster / size
    gain = abs(slip() - speed) * size
    return part.static * math.sqrt(gain / ((ratios[0] - ratios[1]) * part.bristle_stiffness))
