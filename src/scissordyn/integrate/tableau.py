"""What the coefficients of a method are. Coefficients are data; the algorithms stand in `integrate.step`."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from scissordyn.errors import InputError, did_you_mean
from scissordyn.integrate.quadrature import gauss_nodes, primitives
from scissordyn.kernel import F1, F2, I1

EXPLICIT, ROSENBROCK = range(2)  # Kinds of methods


class Tableau(NamedTuple):
    """Coefficients of a one-step method."""

    kind: int  # `EXPLICIT` Runge-Kutta or `ROSENBROCK`
    order: float  # Order of the error estimate plus one: the step scales with error ** (-1/order)
    stages: int  # Stages of the step itself; further rows serve the dense output
    combined: int  # 1 where two error estimates are combined (Hairer's DOP853)
    gamma: float  # Diagonal coefficient of a Rosenbrock method
    a: F2  # (s, s) Stage coefficients
    c: F2  # (s, s) Rosenbrock: coefficients C_ij / h of earlier stages on the right-hand side
    nodes: F1  # (s,)
    slopes: F1  # (s,) Rosenbrock: coefficients of the time derivative
    error: F2  # (2, s) Error estimates; the second is zero unless two are combined
    dense: F2  # (k, s) Rows of the dense output
    # (s,) Explicit: 1 for stages that count in the step, in its dense output, or as its end; powers are evaluated at these
    # alone
    followed: I1
    pattern: I1  # (p,) Factors of the nested dense output from outside in: 0 for theta, 1 for 1 - theta
    gauss: F1  # (g,) Rosenbrock: nodes of the quadratures inside a step, enough for the order of the dense output
    weight: F1  # (g,) Weights of these nodes
    primitive: F2  # (g, g) See `quadrature.primitives`


def _lower(rows: tuple[tuple[float, ...], ...], size: int) -> np.ndarray:
    matrix = np.zeros((size, size))
    for i, row in enumerate(rows, start=1):
        matrix[i, : len(row)] = row
    return matrix


def explicit_tableau(
    *,
    order: float,
    stages: int,
    rows: tuple[tuple[float, ...], ...],
    nodes: tuple[float, ...],
    error: tuple[tuple[float, ...], ...],
    dense: tuple[tuple[float, ...], ...],
) -> Tableau:
    """An explicit Runge-Kutta method whose last stage of the step is the slope at its end."""
    size = len(nodes)
    estimates = np.zeros((2, size))
    for i, estimate in enumerate(error):
        estimates[i, : len(estimate)] = estimate
    rows_of_dense = np.zeros((len(dense), size))
    for i, row in enumerate(dense):
        rows_of_dense[i, : len(row)] = row
    pattern = np.array([k % 2 for k in range(3 + len(dense))], np.int64)
    zeros = np.zeros(size)
    coefficients = _lower(rows, size)
    followed = (coefficients[stages] != 0.0) | np.any(rows_of_dense != 0.0, axis=0)
    followed[stages] = True
    return Tableau(
        EXPLICIT,
        order,
        stages,
        int(len(error) > 1),
        0.0,
        coefficients,
        np.zeros((size, size)),
        np.array(nodes),
        zeros,
        estimates,
        rows_of_dense,
        followed.astype(np.int64),
        pattern,
        np.zeros(0),
        np.zeros(0),
        np.zeros((0, 0)),
    )


def rosenbrock_tableau(
    *,
    order: float,
    gamma: float,
    rows: tuple[tuple[float, ...], ...],
    couplings: tuple[tuple[float, ...], ...],
    nodes: tuple[float, ...],
    slopes: tuple[float, ...],
    dense: tuple[tuple[float, ...], ...],
) -> Tableau:
    """A stiffly accurate Rosenbrock method whose last stage is its error estimate."""
    size = len(nodes)
    error = np.zeros((2, size))
    error[0, -1] = 1.0
    pattern = np.array([0, 1, *([0] * (len(dense) - 1))], np.int64)
    gauss = gauss_nodes(len(dense) + 1)
    primitive = primitives(gauss)
    return Tableau(
        ROSENBROCK,
        order,
        size,
        0,
        gamma,
        _lower(rows, size),
        _lower(couplings, size),
        np.array(nodes),
        np.array([*slopes, *([0.0] * (size - len(slopes)))]),
        error,
        np.array(dense),
        np.zeros(size, np.int64),
        pattern,
        gauss,
        primitive.sum(axis=1),
        primitive,
    )


METHODS = ("dop853", "dopri5", "rodas5p", "rodas4p")  # Names of the methods, explicit ones first


def tableau(name: str) -> Tableau:
    """The coefficients of a method."""
    from scissordyn.integrate import dop853, dopri5, rodas4p, rodas5p

    modules = {"dop853": dop853, "dopri5": dopri5, "rodas5p": rodas5p, "rodas4p": rodas4p}
    if name not in modules:
        raise InputError(f"method '{name}'{did_you_mean(name, METHODS)}", "auto, " + ", ".join(METHODS))
    chosen: Tableau = modules[name].TABLEAU
    return chosen
