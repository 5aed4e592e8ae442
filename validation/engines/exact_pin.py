"""Event-driven solution of a bar with a hole on a fixed pin: flights in closed form, contacts by tight integration.

It is the reference of the pin in a hole, and uses no equations of scissordyn. Restitution is Newton's, friction Coulomb's.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

State = np.ndarray  # x, y, angle of the mass centre and their rates

REST = 1e-10  # [m/s] a slower rebound is the end of an infinite sequence of impacts


class Pin(NamedTuple):
    """Bar of 1 m and 1 kg, hung with its end on a pin at the origin."""

    clearance: float
    radius: float  # [m] of the hole
    restitution: float
    friction: float = 0.0
    gravity: float = 9.81
    inertia: float = 1.0 / 12.0
    arm: float = 0.5  # [m] from the hole to the mass centre


def rows(pin: Pin, state: State) -> tuple[float, np.ndarray, np.ndarray]:
    """Return the gap, and the derivatives of the gap and of the slip to the coordinates."""
    x, y, turn = state[:3]
    along = np.array([math.cos(turn), math.sin(turn)])
    centre = np.array([x, y]) - pin.arm * along
    far = float(np.hypot(*centre))
    normal = -centre / max(far, 1e-300)
    tangent, lever = np.array([-normal[1], normal[0]]), pin.arm * np.array([along[1], -along[0]])
    return pin.clearance - far, np.array([*normal, normal @ lever]), np.array([*tangent, tangent @ lever + pin.radius])


def struck(pin: Pin, state: State) -> State:
    """Return the state after an impact."""
    _, gap_row, slip_row = rows(pin, state)
    inverse = np.array([1.0, 1.0, 1.0 / pin.inertia])
    speeds = np.array([gap_row @ state[3:], slip_row @ state[3:]])
    both = np.vstack([gap_row, slip_row])
    effect = both * inverse @ both.T
    impulse = np.linalg.solve(effect, [-(1.0 + pin.restitution) * speeds[0], -speeds[1]])
    if abs(impulse[1]) > pin.friction * impulse[0]:  # it slips
        share = math.copysign(pin.friction, impulse[1])
        impulse = np.array([1.0, share]) * -(1.0 + pin.restitution) * speeds[0] / (effect[0, 0] + share * effect[0, 1])
    return np.concatenate([state[:3], state[3:] + inverse * (impulse @ both)])


def pressed(pin: Pin, state: State, slipping: float) -> tuple[np.ndarray, np.ndarray]:
    """Return accelerations and the two forces of a closed contact; `slipping` is the sense of slip, 0 if it sticks."""
    _, gap_row, slip_row = rows(pin, state)
    inverse, free = np.array([1.0, 1.0, 1.0 / pin.inertia]), np.array([0.0, -pin.gravity, 0.0])
    turn, spin = state[2], state[5]
    bend = pin.arm * spin**2 * np.array([math.cos(turn), math.sin(turn)])  # acceleration of the hole's centre without rates
    normal, tangent = gap_row[:2], slip_row[:2]
    speed = (slip_row @ state[3:]) - pin.radius * spin  # of the hole's centre along the surface
    both = np.vstack([gap_row, slip_row])
    wanted = np.array([speed**2 / pin.clearance - normal @ bend, -(tangent @ bend)]) - both @ free
    effect = both * inverse @ both.T
    if slipping:
        force = np.array([1.0, -pin.friction * slipping])
        force *= wanted[0] / (effect[0] @ force)
    else:
        force = np.linalg.solve(effect, wanted)
    return free + inverse * (force @ both), force


def _flight(pin: Pin, state: State, left: float) -> tuple[float, State]:
    """Return the time and the state at which a flight ends, at the latest after the time that is left."""
    down = np.array([0.0, -pin.gravity, 0.0])

    def at(time: float) -> State:
        return np.concatenate([state[:3] + time * state[3:] + 0.5 * time**2 * down, state[3:] + time * down])

    leaves = rows(pin, state)[1] @ state[3:]
    before, step = 0.0, min(1e-5, max(leaves, REST) / 1e3)  # of a flight of 2 v / g, a small part
    while before < left:
        after = min(before + step, left)
        if rows(pin, at(after))[0] < 0.0 and (before > 0.0 or leaves <= 0.0):
            time = float(brentq(lambda t: rows(pin, at(t))[0], before, after, xtol=1e-16)) if before > 0.0 else after
            return time, at(time)
        before, step = after, min(1.1 * step, 1e-5)
    return left, at(left)


def _slide(pin: Pin, state: State, left: float) -> tuple[float, State]:
    """Return the time and the state at which a closed contact opens or its slip changes, at the latest after the time left."""
    slip = rows(pin, state)[2] @ state[3:]
    sense = 0.0 if abs(slip) < 1e-9 else math.copysign(1.0, slip)
    if not sense:  # does it stick?
        force = pressed(pin, state, 0.0)[1]
        sense = 0.0 if abs(force[1]) <= pin.friction * force[0] else -math.copysign(1.0, force[1])

    def opens(_: float, y: State) -> float:
        return float(pressed(pin, y, sense)[1][0])

    def turns(_: float, y: State) -> float:
        if sense:
            return float(rows(pin, y)[2] @ y[3:]) * sense + (1e-12 if abs(slip) > 1e-9 else 1.0)
        force = pressed(pin, y, 0.0)[1]
        return float(pin.friction * force[0] - abs(force[1]))

    events = [opens, turns] if pin.friction else [opens]
    for event in events:
        event.terminal, event.direction = True, -1.0  # type: ignore[attr-defined]
    found = solve_ivp(
        lambda _, y: np.concatenate([y[3:], pressed(pin, y, sense)[0]]),
        (0.0, left),
        state,
        "DOP853",
        rtol=1e-12,
        atol=1e-14,
        max_step=1e-3,
        events=events,
    )
    return float(found.t[-1]), found.y[:, -1]


def motion(pin: Pin, times: np.ndarray, start: State) -> tuple[np.ndarray, int]:
    """Return the states at increasing times, and the number of impacts."""
    state, now, closed, impacts, made = np.array(start, float), 0.0, False, 0, []
    for until in times:
        while now < until:
            taken, state = (_slide if closed else _flight)(pin, state, until - now)
            now = until if taken >= until - now else now + taken
            if now >= until:
                break
            if closed:
                closed = pressed(pin, state, math.copysign(1.0, rows(pin, state)[2] @ state[3:]))[1][0] > 1e-9
                continue
            state, impacts = struck(pin, state), impacts + 1
            closed = rows(pin, state)[1] @ state[3:] < REST
        made.append(state)
    return np.array(made), impacts
