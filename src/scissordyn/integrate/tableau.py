"""Define the coefficients of a method; the algorithms are in `integrate.step`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cache
from typing import Annotated, Any, NamedTuple, get_args

import numpy as np

from scissordyn.interpolation import gauss_rule, lagrange_polynomials
from scissordyn.kernel import F1, F2, I1, fields_of

EXPLICIT, ROSENBROCK = range(2)  # Kinds of methods

Rows = Sequence[Sequence[float]]  # Rows of coefficients, without zeros at their ends


class Tableau(NamedTuple):
    """Coefficients of a one-step method with s stages; annotations give the sizes of coefficients that only one kind has."""

    kind: int  # `EXPLICIT` Runge-Kutta or `ROSENBROCK`
    order: float  # Order of the error estimate plus one: the step scales with error ** (-1/order)
    stages: int  # Stages of the step itself; further rows are for the dense output
    combined: int  # 1 if two error estimates are combined (Hairer's DOP853)
    gamma: float  # Diagonal coefficient of a Rosenbrock method
    a: F2  # (s, s) Stage coefficients
    c: Annotated[F2, "s", "s"]  # Rosenbrock: coefficients C_ij / h of earlier stages on the right-hand side
    nodes: F1  # (s,)
    slopes: Annotated[F1, "s"]  # Rosenbrock: coefficients of the time derivative
    error: F2  # (2, s) Error estimates; the second is zero unless two are combined
    dense: F2  # (k, s) Rows of the dense output
    # Explicit: 1 for stages that contribute to the step, its dense output or its end; powers are evaluated only there
    followed: Annotated[I1, "s"]
    pattern: I1  # (p,) Factors of the nested dense output from outside to inside: 0 for theta, 1 for 1 - theta
    gauss: Annotated[F1, 0]  # Rosenbrock: Gauss nodes inside a step, enough for the order of the dense output
    weight: Annotated[F1, 0]  # Weights of these nodes
    primitive: Annotated[F2, 0, 0]  # Polynomial coefficients from `primitives`


def arrays_of(described: type, sizes: Mapping[str, int], ready: Mapping[str, Any]) -> dict[str, Any]:
    """Return the fields of a named tuple: the given ones, and zero arrays with the sizes in the annotations of the others."""
    arrays = dict(ready)
    for name, dtype, dimensions in _sized_fields(described):
        if name not in arrays:
            arrays[name] = np.zeros([size if isinstance(size, int) else sizes[size] for size in dimensions], dtype)
    return arrays


@cache
def _sized_fields(described: type) -> list[tuple[str, Any, list[int | str]]]:
    """Return name, type and size of each array of a named tuple whose annotation has a size."""
    fields = []
    for name, hint in fields_of(described):
        _, kind, *dimensions = get_args(hint) or (None, None)
        if dimensions:
            fields.append((name, kind.dtype, dimensions))
    return fields


def primitives(nodes: np.ndarray) -> np.ndarray:
    """Return the integrals from 0 to theta of the Lagrange polynomials on the nodes.

    A row has the coefficients of theta, theta^2, ...
    """
    rows = lagrange_polynomials(nodes)
    return np.array([[coefficient / power for power, coefficient in enumerate(row, 1)] for row in rows], float)


def _pad_rows(rows: Rows, size: int, idle: Sequence[int] = (), count: int = 0) -> np.ndarray:
    """Return rows of coefficients, padded with zeros for idle stages and at their ends."""
    matrix, columns = np.zeros((max(len(rows), count), size)), np.delete(np.arange(size), idle)
    for target, row in zip(matrix, rows, strict=False):
        target[columns[: len(row)]] = row
    return matrix


def explicit_tableau(
    *,
    order: float,
    stages: int,
    rows: Rows,
    nodes: Sequence[float],
    error: Rows,
    dense: Rows,
    further: Rows = (),
    idle: Sequence[int] = (),
) -> Tableau:
    """Return an explicit Runge-Kutta method whose last stage is the slope at the end of the step (first same as last).

    The `further` rows of stages, errors and the dense output omit the `idle` stages.
    """
    size = len(nodes)
    coefficients = np.vstack([_pad_rows([(), *rows], size), _pad_rows(further, size, idle)])
    rows_of_dense = _pad_rows(dense, size, idle)
    followed = (coefficients[stages] != 0.0) | np.any(rows_of_dense != 0.0, axis=0)
    followed[stages] = True
    ready = {
        "kind": EXPLICIT,
        "order": order,
        "stages": stages,
        "combined": int(len(error) > 1),
        "gamma": 0.0,
        "a": coefficients,
        "nodes": np.array(nodes),
        "error": _pad_rows(error, size, idle, 2),
        "dense": rows_of_dense,
        "followed": followed.astype(np.int64),
        "pattern": np.arange(3 + len(dense)) % 2,
    }
    return Tableau(**arrays_of(Tableau, {"s": size}, ready))


def rosenbrock_tableau(
    *, order: float, gamma: float, rows: Rows, couplings: Rows, nodes: Sequence[float], slopes: Sequence[float], dense: Rows
) -> Tableau:
    """Return a stiffly accurate Rosenbrock method whose last stage is its error estimate."""
    size, (gauss, weight) = len(nodes), gauss_rule(len(dense) + 1)
    ready = {
        "kind": ROSENBROCK,
        "order": order,
        "stages": size,
        "combined": 0,
        "gamma": gamma,
        "a": _pad_rows([(), *rows], size),
        "c": _pad_rows([(), *couplings], size),
        "nodes": np.array(nodes),
        "slopes": _pad_rows([slopes], size)[0],
        "error": _pad_rows([np.eye(size)[-1]], size, (), 2),
        "dense": np.array(dense),
        "pattern": np.array([0, 1, *([0] * (len(dense) - 1))], np.int64),
        "gauss": gauss,
        "weight": weight,
        "primitive": primitives(gauss),
    }
    return Tableau(**arrays_of(Tableau, {"s": size}, ready))
