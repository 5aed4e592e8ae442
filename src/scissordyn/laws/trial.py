"""Test user-defined laws in their joint before a run: errors stop the run, doubtful results give warnings."""

from __future__ import annotations

import itertools
import math
from functools import lru_cache
from typing import Any

import numpy as np

from scissordyn.errors import InputError
from scissordyn.kernel import F1, F2, call_at, entry
from scissordyn.laws.contact import Damping, Elastic, JointContact
from scissordyn.plugin.element import arguments_of, pointers, row_of
from scissordyn.tolerance import DATA_TOL, ROUND_OFF_TOL

APPROACHES = (1e-6, 1e-3, 1e-2, 0.1, 1.0, 10.0)  # Test values of the approach speed at contact onset of damping laws [m/s]

# Test values of the indentation rate of damping laws, in both directions [m/s]
RATES = (*(-np.logspace(1, -6, 8)).tolist(), 0.0, *np.logspace(-6, 1, 8).tolist())
FORCES = (0.0, *np.logspace(-3, 6, 10).tolist())  # Test values of the normal force of damping and friction laws [N]
SPEEDS = (*(-np.logspace(1, -9, 11)).tolist(), 0.0, *np.logspace(-9, 1, 11).tolist())
"""Test values of the slip speed of friction laws, from rest to 10 m/s in both directions [m/s]."""

DEPTHS = np.unique(np.concatenate([[0.0], np.geomspace(1e-6, 1.0, 61), np.linspace(0.0, 1.0, 65)[1:]]))
"""Test indentations of a stiffness law, in clearances (in corner radii at a plane guide surface)."""


def _largest_depth(joint: JointContact) -> tuple[float, str]:
    """Return the largest test indentation of a law in a joint [m] and what it is; 1 m for a point."""
    size, what = joint.size
    return size or 1.0, what


@lru_cache(maxsize=256)
def trial_forces(law: Any, joint: JointContact) -> np.ndarray:
    """Return the forces [N] of a law without states at all test points of a joint.

    Raise `InputError` at the first point with a force that is not finite, pulls, acts at zero indentation, or drives the slip.
    """
    size, what = _largest_depth(joint)
    allowed = "a finite number there"
    if isinstance(law, Elastic):
        points: Any = DEPTHS[:, None] * size
    elif isinstance(law, Damping):
        points = list(itertools.product(FORCES, (np.geomspace(1e-6, 1.0, 7) * size).tolist(), RATES, APPROACHES))
    else:
        points = list(itertools.product(SPEEDS, FORCES))
    points = np.array(points, float)
    forces = np.empty(len(points))
    _evaluate_all(pointers(law)["force"], points, row_of(law, joint), forces)
    wrong = ~np.isfinite(forces)
    if isinstance(law, Elastic) and not wrong.any():
        allowed = f"a push up to the {what}: 0 N or more, and 0 N at 0 m"
        wrong = np.where(points[:, 0] > 0.0, forces < 0.0, np.abs(forces) > DATA_TOL * abs(forces[-1]))
        if not forces[-1] > 0.0:
            allowed, wrong = f"a push at one {what}: above 0 N", np.arange(len(forces)) == len(forces) - 1
    elif not isinstance(law, Damping) and not wrong.any():
        allowed, wrong = "a force of the sign of the slip speed, or 0 N", forces * points[:, 0] < 0.0
    if wrong.any():
        first = int(np.argmax(wrong))
        at = dict(zip(law.slot.inputs, points[first].tolist(), strict=True))
        where = ", ".join(f"{name} = {value:g}" for name, value in at.items())
        raise InputError(
            f"{law.slot.title} '{law.name}' {_describe_result(law, joint, at, float(forces[first]))} at {where}", allowed
        )
    return forces


def _describe_result(law: Any, joint: JointContact, at: dict[str, float], force: float) -> str:
    """Describe what a law's kernel gives or raises at a test point, evaluated in Python."""
    kernel = law.declaration.kernels["force"]
    values = at | dict(zip(law.declaration.numbers, law.parameters(joint), strict=True))
    try:
        result = kernel(**{name: values[name] for name in arguments_of(kernel)})
        return "gives a complex number, a power of a negative number," if isinstance(result, complex) else f"gives {result!r}"
    except Exception as error:
        return f"raises {type(error).__name__} ({error})" if not math.isfinite(force) else f"gives {force!r}"


@entry
def _evaluate_all(pointer: int, points: F2, numbers: F1, forces: F1) -> None:
    for k in range(forces.size):
        forces[k] = call_at(pointer, points[k], (), (), (), numbers, ())


def doubts(law: Any, joint: JointContact) -> list[str]:
    """Return reasons to doubt a user-defined law in a joint, as clauses for warnings; laws with states are not tested."""
    if getattr(law, "states", ()):
        return []
    forces = trial_forces(law, joint)
    if isinstance(law, Elastic):
        return _stiffness_doubts(forces, joint)
    if isinstance(law, Damping):
        return _damping_doubts(forces.reshape(len(FORCES), -1, len(RATES), len(APPROACHES)))
    return _friction_doubts(np.abs(forces.reshape(len(SPEEDS), len(FORCES))))


def _stiffness_doubts(force: np.ndarray, joint: JointContact) -> list[str]:
    """Return reasons to doubt a stiffness law, from its forces [N] at the indentations `DEPTHS`."""
    size, what = _largest_depth(joint)
    falls = np.flatnonzero(np.diff(force) <= 0.0)
    if not falls.size:
        return []
    low, high = 1e3 * size * DEPTHS[falls[0]], 1e3 * size * DEPTHS[falls[0] + 1]
    return [f"the force does not grow from {low:.4g} mm to {high:.4g} mm of indentation (tried up to the {what})"]


def _damping_doubts(force: np.ndarray) -> list[str]:
    """Return reasons to doubt a damping law, from its normal forces [N], shape (FORCES, depths, RATES, APPROACHES)."""
    elastic = np.array(FORCES)[:, None, None, None]
    rate = np.array(RATES)[None, None, :, None]
    # the kernels cut off a pull
    gain = (elastic - np.maximum(force, 0.0)) * np.sign(rate)
    if not np.any(gain > ROUND_OFF_TOL * (1.0 + elastic)):
        return []
    at = np.unravel_index(int(np.argmax(gain)), gain.shape)
    what = "lowers the elastic force on approach" if RATES[at[2]] > 0.0 else "raises the elastic force on rebound"
    return [f"it {what} ({FORCES[at[0]]:g} N at {RATES[at[2]]:g} m/s), so that contacts may gain energy"]


def _friction_doubts(force: np.ndarray, coefficient_max: float = 10.0) -> list[str]:
    """Return reasons to doubt a friction law, from the magnitudes of its forces [N], shape (SPEEDS, FORCES).

    `coefficient_max`: [-] ratio F_t/F_n above which there is a warning; the bound of the package's laws.
    """
    without = ["it gives a force where the normal force is zero"] if np.any(force[:, 0] > 0.0) else []
    largest = float(np.max((force[:, 1:] - force[:, :1]) / np.array(FORCES[1:])))
    high = [f"its friction coefficient reaches {largest:.3g} at 10 m/s or less"] if largest > coefficient_max else []
    return without + high
