"""Consistent positions and velocities to start from."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import lsqr

from scissordyn.errors import InputError
from scissordyn.mechanics.elimination import in_words
from scissordyn.mechanics.form import Form, Layout, placed
from scissordyn.mechanics.motion import course_at, prescribe
from scissordyn.mechanics.system import System
from scissordyn.model.mechanism import Mechanism

__all__ = ["Start", "assemble", "basis_at_start", "carry_over", "hold_joints", "natural_state"]

CLOSED = 1e-12
MOST_STEPS = 50

FAR = 0.1
"""Errors above this share of the largest are named when a mechanism cannot be assembled."""


@dataclass(frozen=True)
class Start:
    """A consistent state of a mechanism at t = 0.

    Parameters
    ----------
    position, velocity : ndarray, shape (n,)
        Free coordinates and their rates.
    """

    position: np.ndarray
    velocity: np.ndarray


def basis_at_start(system: System) -> tuple[np.ndarray, np.ndarray]:
    """The basis b and its rate at t = 0."""
    prescribe(0.0, system.motion, system.motion_start, system.basis, system.angle)
    return system.basis[0].copy(), system.basis[1].copy()


def carry_over(layout: Layout, system: System, position: np.ndarray, velocity: np.ndarray) -> Start:
    """The free coordinates nearest (in the sense of kinetic energy) to given natural coordinates and velocities.

    Parameters
    ----------
    layout : Layout
    system : System
    position, velocity : ndarray, shape (nZ,)

    Returns
    -------
    Start
    """
    b, rate = basis_at_start(system)
    n = layout.free
    moving, known = layout.coordinates[:, :n], layout.coordinates[:, n:]
    weighted = sp.csr_array(moving.T @ layout.mass)
    return Start(weighted @ (position - known @ b), weighted @ (velocity - known @ rate))


def natural_state(layout: Layout, system: System, start: Start) -> tuple[np.ndarray, np.ndarray]:
    """Natural coordinates and velocities of a state."""
    b, rate = basis_at_start(system)
    return layout.coordinates @ np.append(start.position, b), layout.coordinates @ np.append(start.velocity, rate)


def assemble(layout: Layout, system: System) -> Start:
    """Positions that close the mechanism nearest to where its bodies were placed, and velocities that its drives demand.

    Parameters
    ----------
    layout : Layout
    system : System

    Returns
    -------
    Start

    Raises
    ------
    InputError
        If the bodies as placed cannot be brought together.
    """
    guess = carry_over(layout, system, *placed(layout))
    return hold_joints(layout, system, guess, *_directed_links(layout, system))


def _directed_links(layout: Layout, system: System) -> tuple[tuple[str, ...], tuple[Form, ...], np.ndarray, np.ndarray]:
    """Names and forms of the links whose direction at the start is given, with the values and rates they start from."""
    names: list[str] = []
    forms: list[Form] = []
    offsets, rates = [], []
    level_rate = _level_rates(system)
    for link in layout.mechanism.rods:
        if link.direction is None:
            continue
        k = [condition.name for condition in layout.conditions].index(link.name)
        along = np.array([math.cos(link.direction), math.sin(link.direction)])
        length = math.sqrt(2.0 * layout.conditions[k].level)
        names.append(link.name)
        forms.append(layout.conditions[k].parts[0][1])
        offsets.append(length * along)
        rates.append(level_rate[k] / length * along)
    return tuple(names), tuple(forms), np.array(offsets).reshape(-1, 2), np.array(rates).reshape(-1, 2)


def _level_rates(system: System) -> np.ndarray:
    """Rates of the levels of all conditions at t = 0."""
    rates = np.zeros(system.level.shape[1])
    for k, course in zip(system.timed, system.timed_course, strict=True):
        course_at(0.0, system.motion[system.motion_start[course] : system.motion_start[course + 1]], system.angle)
        rates[k] = system.angle[0] * system.angle[1]
    return rates


def hold_joints(
    layout: Layout,
    system: System,
    guess: Start,
    names: tuple[str, ...],
    forms: tuple[Form, ...],
    offsets: np.ndarray,
    rates: np.ndarray,
) -> Start:
    """The state nearest to a guess that has unit lengths and prescribed values of some forms.

    Parameters
    ----------
    layout : Layout
    system : System
    guess : Start
    names : tuple of str
        Joints or links whose forms are held, for messages.
    forms : tuple of Form
        Vectors to hold, such as the eccentricities of loose joints.
    offsets, rates : ndarray, shape (forms, 2)
        Their values [m] and rates [m/s].

    Returns
    -------
    Start
    """
    n = layout.free
    b, b_rate = basis_at_start(system)
    parts = [(k, weight, form) for k, condition in enumerate(layout.conditions) for weight, form in condition.parts]
    owner = sp.csr_array(
        (
            np.array([w * (not layout.conditions[k].latch) for k, w, _ in parts]),
            (np.array([k for k, _, _ in parts], int), np.arange(len(parts))),
        ),
        shape=(len(layout.conditions), len(parts)),
    )
    level = np.array([condition.level for condition in layout.conditions])
    squares, held = _matrix(layout, tuple(form for _, _, form in parts)), _matrix(layout, forms)
    x = guess.position.copy()
    for _ in range(MOST_STEPS):
        full = np.append(x, b)
        d = (squares @ full).reshape(-1, 2)
        residual = np.concatenate([owner @ (0.5 * np.sum(d * d, axis=1)) - level, held @ full - offsets.ravel()])
        jacobian = _gradients(owner, squares, held, d)[:, :n]
        if np.max(np.abs(residual), initial=0.0) < CLOSED:
            break
        x -= _least_change(jacobian, residual)
    else:
        raise InputError(
            f"the mechanism as placed cannot be assembled: {_worst(layout, residual, names)}",
            "positions and angles at the start that are near a closed configuration",
        )
    v = guess.velocity.copy()
    full_rate = np.append(v, b_rate)
    bent = np.sum(d * (squares @ full_rate).reshape(-1, 2), axis=1)
    rate_residual = np.concatenate([owner @ bent - _level_rates(system), held @ full_rate - rates.ravel()])
    v -= _least_change(jacobian, rate_residual)
    return Start(x, v)


def _matrix(layout: Layout, forms: tuple[Form, ...]) -> sp.csr_array:
    rows = np.concatenate(
        [np.repeat([2 * k, 2 * k + 1], form.columns.size) for k, form in enumerate(forms)] or [np.zeros(0, int)]
    )
    columns = np.concatenate([np.tile(form.columns, 2) for form in forms] or [np.zeros(0, int)])
    values = np.concatenate([form.rows.ravel() for form in forms] or [np.zeros(0)])
    return sp.csr_array((values, (rows, columns)), shape=(2 * len(forms), layout.free + layout.basis))


def _gradients(owner: sp.csr_array, squares: sp.csr_array, held: sp.csr_array, d: np.ndarray) -> sp.csr_array:
    """Gradients of the quadratic conditions and of the held forms."""
    count = d.shape[0]
    pairing = sp.csr_array((d.ravel(), (np.repeat(np.arange(count), 2), np.arange(2 * count))), shape=(count, 2 * count))
    return sp.csr_array(sp.vstack([owner @ (pairing @ squares), held]))


def _least_change(jacobian: sp.csr_array, residual: np.ndarray) -> np.ndarray:
    """The smallest correction that removes a residual to first order, also where conditions are redundant."""
    if not residual.size or not np.any(residual):
        return np.zeros(jacobian.shape[1])
    if jacobian.shape[0] <= 400:
        return np.asarray(np.linalg.lstsq(jacobian.toarray(), residual, rcond=1e-10)[0])
    return np.asarray(lsqr(jacobian, residual, atol=1e-15, btol=1e-15, iter_lim=20 * jacobian.shape[0])[0])


def _worst(layout: Layout, residual: np.ndarray, held: tuple[str, ...]) -> str:
    """What is furthest from being kept, and what holds it: where the search ends, the errors are the contradiction."""
    count = len(layout.conditions)
    errors = np.abs(residual)
    if np.argmax(errors) >= count:
        return f"joint '{held[(int(np.argmax(errors)) - count) // 2]}' cannot be held where it should start"
    far = [layout.conditions[k] for k in np.argsort(-errors[:count], kind="stable") if errors[k] > FAR * np.max(errors)]
    subjects = [condition.subject for condition in far]
    bodies = {body for condition in far for body in condition.bodies}
    around = _holding(layout.mechanism, bodies)
    by = f", held by {in_words(around)}" if around else ""
    return f"{in_words(subjects)} cannot keep the length{'s' if len(subjects) > 1 else ''} given{by}"


def _holding(mechanism: Mechanism, bodies: set[str]) -> list[str]:
    """The ideal joints, guides, welds and drives at some bodies."""
    names = [f"joint '{joint.name}'" for joint in mechanism.joints if bodies & set(joint.bodies)]
    names += [f"guide '{guide.name}'" for guide in mechanism.guides if bodies & {guide.follower[0], guide.body}]
    names += [f"weld '{weld.name}'" for weld in mechanism.welds if bodies & {weld.start[0], weld.end[0]}]
    return names + [f"the drive of body '{drive.body}'" for drive in mechanism.drives if drive.body in bodies]
