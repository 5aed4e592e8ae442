"""Find the plane of a MuJoCo model: perpendicular to its hinges, or through its slides."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from scissordyn.errors import InputError
from scissordyn.exchange.xml_element import EXAMPLE
from scissordyn.tolerance import ASSEMBLY_TOL

TILT_MAX = 0.01  # [rad] Largest angle between joint axes that count as parallel; rounded angles (1.57) accumulate along a chain

Axes = Sequence[tuple[str, np.ndarray]]  # Names of joints and their unit vectors


def plane_of(hinges: Axes, slides: Axes, gravity: np.ndarray, notes: list[str]) -> np.ndarray:
    """Return the unit vectors along x, y and the normal of the mechanism's plane, in rows; note tilted joint axes."""
    if hinges:
        name, first = hinges[0]
        for other, axis in hinges:
            if (angle := _sine_angle(np.linalg.norm(np.cross(first, axis)))) > TILT_MAX:
                raise InputError(
                    f"hinges '{name}' and '{other}' form an angle of {math.degrees(angle):.4g} deg",
                    "a planar mechanism: parallel hinges",
                    EXAMPLE,
                )
        total = np.sum([axis * math.copysign(1.0, axis @ first) for _, axis in hinges], axis=0)
        normal = total / np.linalg.norm(total)
    elif slides:
        normal = _normal_of_slides([axis for _, axis in slides], gravity)
    else:
        raise InputError("the model has no hinges and no slides", "a planar mechanism with hinges or slides", EXAMPLE)
    tilted = [("hinge", name, _sine_angle(np.linalg.norm(np.cross(axis, normal)))) for name, axis in hinges]
    tilted += [("slide", name, _sine_angle(abs(axis @ normal))) for name, axis in slides]
    for kind, name, tilt in tilted:
        if tilt > TILT_MAX:
            what = f"{kind} '{name}' is tilted by {math.degrees(tilt):.4g} deg to the plane of the others"
            raise InputError(what, "a planar mechanism: slides perpendicular to the hinges", EXAMPLE)
        if tilt > ASSEMBLY_TOL:
            notes.append(f"{kind} '{name}' is tilted by {math.degrees(tilt):.2g} deg to the plane: read as parallel")
    return _basis(normal, notes)


def _sine_angle(sine: Any) -> float:
    """Return the arcsine [rad]; values above 1 by round-off count as 1."""
    return math.asin(min(1.0, float(sine)))


def _normal_of_slides(slides: list[np.ndarray], gravity: np.ndarray) -> np.ndarray:
    """Return the unit normal of the plane that contains all slides.

    Parallel slides are in many planes: the one with gravity is chosen, or else the one whose normal is near y.
    """
    across = max((np.cross(a, b) for a in slides[:1] for b in slides), key=lambda vector: float(np.linalg.norm(vector)))
    if np.linalg.norm(across) <= TILT_MAX:
        across = np.cross(gravity, slides[0])
        if np.linalg.norm(across) <= TILT_MAX * max(float(np.linalg.norm(gravity)), 1e-300):
            near = min(np.eye(3)[[1, 0, 2]], key=lambda axis: round(abs(float(axis @ slides[0])), 9))
            across = near - (near @ slides[0]) * slides[0]
    return np.asarray(across / np.linalg.norm(across))


def _basis(normal: np.ndarray, notes: list[str]) -> np.ndarray:
    """Return unit vectors in rows: x and y of the plane, close to two axes of space, and its normal."""
    main = int(np.argmax(abs(normal)))
    axis = np.eye(3)[main] * (-1.0 if main == 1 else 1.0)
    normal = normal * math.copysign(1.0, float(normal @ axis))
    rows = np.array([*np.delete(np.eye(3), main, axis=0), axis])
    across = np.cross(axis, normal)
    tilt = math.atan2(float(np.linalg.norm(across)), float(axis @ normal))
    if tilt <= ASSEMBLY_TOL:
        return rows
    names = "".join(np.delete(["x", "y", "z"], main))
    notes.append(
        f"the plane of the hinges is tilted by {math.degrees(tilt):.4g} deg to the {names} plane, and so is its y axis"
    )
    # shortest rotation from the axis to the normal (Rodrigues)
    cross = np.array([[0.0, -across[2], across[1]], [across[2], 0.0, -across[0]], [-across[1], across[0], 0.0]])
    turn = np.eye(3) + cross + cross @ cross / (1.0 + float(axis @ normal))
    return np.asarray(rows @ turn.T)
