"""The plane of a model of MuJoCo: at right angles to its hinges, or through its slides."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from scissordyn.errors import InputError

SAMPLE = "scissordyn import model.xml -o case.toml"

PARALLEL_TOL = 1e-9  # [rad] of axes that MuJoCo computes from exact ones
TILT_MAX = 0.01  # [rad] of axes with rounded right angles (1.57, 3.14, 0.707), added up along a chain

Axes = Sequence[tuple[str, np.ndarray]]  # Names of joints and their unit vectors


def plane_of(hinges: Axes, slides: Axes, gravity: np.ndarray, notes: list[str]) -> np.ndarray:
    """Unit vectors of x and y of the plane, and of its normal, as rows; tilted axes are added to the notes."""
    if hinges:
        name, first = hinges[0]
        for other, axis in hinges:
            if (angle := _sine_angle(np.linalg.norm(np.cross(first, axis)))) > TILT_MAX:
                raise InputError(
                    f"hinges '{name}' and '{other}' are at {math.degrees(angle):.4g} deg to each other",
                    "a planar mechanism: parallel hinges",
                    SAMPLE,
                )
        total = np.sum([axis * math.copysign(1.0, axis @ first) for _, axis in hinges], axis=0)
        normal = total / np.linalg.norm(total)
    elif slides:
        normal = _normal_of_slides([axis for _, axis in slides], gravity)
    else:
        raise InputError("a model without hinges and slides", "a planar mechanism with hinges or slides", SAMPLE)
    tilted = [("hinge", name, _sine_angle(np.linalg.norm(np.cross(axis, normal)))) for name, axis in hinges]
    tilted += [("slide", name, _sine_angle(abs(axis @ normal))) for name, axis in slides]
    for kind, name, tilt in tilted:
        if tilt > TILT_MAX:
            what = f"{kind} '{name}' is tilted by {math.degrees(tilt):.4g} deg to the plane of the others"
            raise InputError(what, "a planar mechanism: slides at right angles to the hinges", SAMPLE)
        if tilt > PARALLEL_TOL:
            notes.append(f"{kind} '{name}' is tilted by {math.degrees(tilt):.2g} deg to the plane: read as in it")
    return _basis(normal, notes)


def _sine_angle(sine: Any) -> float:
    """The angle of a sine between 0 and 1 up to round-off [rad]."""
    return math.asin(min(1.0, float(sine)))


def _normal_of_slides(slides: list[np.ndarray], gravity: np.ndarray) -> np.ndarray:
    """At right angles to the slides; to one direction of all slides and to gravity, else near y."""
    across = max((np.cross(a, b) for a in slides[:1] for b in slides), key=lambda vector: float(np.linalg.norm(vector)))
    if np.linalg.norm(across) <= TILT_MAX:
        across = np.cross(gravity, slides[0])
        if np.linalg.norm(across) <= TILT_MAX * max(float(np.linalg.norm(gravity)), 1e-300):
            near = min(np.eye(3)[[1, 0, 2]], key=lambda axis: round(abs(float(axis @ slides[0])), 9))
            across = near - (near @ slides[0]) * slides[0]
    return np.asarray(across / np.linalg.norm(across))


def _basis(normal: np.ndarray, notes: list[str]) -> np.ndarray:
    """The plane whose x and y are nearest to two coordinates of space."""
    main = int(np.argmax(abs(normal)))
    axis = np.eye(3)[main] * (-1.0 if main == 1 else 1.0)
    normal = normal * math.copysign(1.0, float(normal @ axis))
    rows = np.array([*np.delete(np.eye(3), main, axis=0), axis])
    across = np.cross(axis, normal)
    tilt = math.atan2(float(np.linalg.norm(across)), float(axis @ normal))
    if tilt <= PARALLEL_TOL:
        return rows
    names = "".join(np.delete(["x", "y", "z"], main))
    notes.append(f"the plane of the hinges is tilted by {math.degrees(tilt):.4g} deg to the {names} plane, and its y with it")
    # the rotation that takes the axis to the normal by the shortest way (Rodrigues)
    cross = np.array([[0.0, -across[2], across[1]], [across[2], 0.0, -across[0]], [-across[1], across[0], 0.0]])
    turn = np.eye(3) + cross + cross @ cross / (1.0 + float(axis @ normal))
    return np.asarray(rows @ turn.T)
