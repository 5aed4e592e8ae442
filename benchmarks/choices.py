"""Figures behind single decisions: the weight of internal states, the energy balance, how kernels get arrays."""

from __future__ import annotations

import json
from typing import Any
from unittest import mock

import numba
import numpy as np
from numba import types
from numba.core.types.function_type import CompileResultWAP

import scissordyn as sd
from benchmarks.cases import FRICTION, UNTIL, array, name_of
from benchmarks.measure import command, interleaved, table
from scissordyn.integrate import tableau
from scissordyn.integrate.quadrature import gauss_nodes, primitives
from scissordyn.mechanics.system import open_system
from scissordyn.plan.plan import plan
from scissordyn.run import driver, tolerance
from scissordyn.run.driver import make_system

CALLS = 300_000


def measure(quick: bool = False) -> str:
    """All three."""
    return "\n".join((_hidden_states(), _books(), _handing_over(3 if quick else 9)))


def _hidden_states() -> str:
    rows = []
    for kinetic in (0.01, 0.1):
        reference = sd.simulate(array(kinetic), until=UNTIL, rtol=1e-12, atol=1e-12, method="dop853")["contact_start"].values
        for weight in (1.0, 10.0, 100.0, 1000.0):
            with mock.patch.object(tolerance, "INTERNAL_STATES", weight):
                run = sd.simulate(array(kinetic), until=UNTIL)
            errors = np.abs(run["contact_start"].values[:5] - reference[:5])
            steps = json.loads(run.attrs["statistics"])["steps"]
            rows.append([f"{name_of(kinetic)}, {weight:g}", str(steps), *(f"{errors[k]:.0e}" for k in (1, 2, 4))])
    text = "Tolerance of the internal states larger by a factor: errors of contact starts 2, 3 and 5 [s] at 1e-8.\n\n"
    return text + table(["case, factor", "steps", "contact 2", "contact 3", "contact 5"], rows)


def _books() -> str:
    rows = []
    for kinetic in [kinetic for kinetic in FRICTION if kinetic]:  # explicit methods integrate on their stages
        for points in (3, 4, 5, 6, 7):
            with mock.patch.object(driver, "tableau", lambda name, k=points: _with_nodes(name, k)):
                run = sd.simulate(array(kinetic), until=UNTIL)
            residual = float(abs(run["energy_residual"]).max() / run["kinetic_energy"].max())
            chosen = json.loads(run.attrs["statistics"])["method"]
            own = " (chosen)" if tableau.tableau(chosen).gauss.size == points else ""
            rows.append([f"{name_of(kinetic)}, {points} nodes{own}", chosen, f"{residual:.1e}"])
    text = "Largest energy residual over the largest kinetic energy at 1e-8, by Gauss nodes of the powers in each step.\n\n"
    return text + table(["case", "method", "residual"], rows)


def _with_nodes(name: str, points: int) -> tableau.Tableau:
    nodes = gauss_nodes(points)
    primitive = primitives(nodes)
    return tableau.tableau(name)._replace(gauss=nodes, weight=primitive.sum(axis=1), primitive=primitive)


def _handing_over(repeats: int) -> str:
    handle = make_system(plan(array(None)))
    system = handle.content
    candidates = {
        "by value": _caller(True, True, system),
        "by value, no reference counts": _caller(True, False, system),
        "by address, no reference counts": _caller(False, False, handle.address),
    }
    times = interleaved(candidates, repeats)
    rows = [[name, f"{1e9 * found.median / CALLS:.1f}"] for name, found in times.items()]
    arrays = sum(isinstance(part, np.ndarray) for group in system for part in group)
    text = (
        f"A call through a typed pointer of a function that touches four of a system's {arrays} arrays, all passed by\n"
        "value or as one address.\n\n"
    )
    return text + table(["passed", "per call [ns]"], rows)


def _caller(by_value: bool, counts: bool, content: Any) -> Any:
    """A loop of calls through a typed pointer."""
    vector = types.float64[::1]
    options: dict[str, Any] = {"error_model": "numpy"} if counts else {"error_model": "numpy", "_nrt": False}

    if by_value:
        layout = numba.typeof(content)

        def touch(t, S, dy):
            dy[0] = t + S.parameters.weight[0] + S.work.X[0] + S.work.V[0]
            S.work.A[0] = dy[0]
    else:
        layout = types.int64

        def touch(t, address, dy):
            S = open_system(address)
            dy[0] = t + S.parameters.weight[0] + S.work.X[0] + S.work.V[0]
            S.work.A[0] = dy[0]

    signature = types.void(types.float64, layout, vector)
    compiled = numba.njit(**options)(touch)
    pointer = CompileResultWAP(compiled.get_compile_result(signature))

    @numba.njit(**options)
    def loop(function, S, dy):
        for k in range(CALLS):
            function(float(k), S, dy)

    dy = np.zeros(3)
    return lambda: loop(pointer, content, dy)


if __name__ == "__main__":
    command("choices", measure)
