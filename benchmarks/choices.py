"""Figures behind single decisions: the weight of internal states, the energy balance."""

from __future__ import annotations

import json
from unittest import mock

import numpy as np

import scissordyn as sd
from benchmarks.cases import FRICTION, UNTIL, array, name_of
from benchmarks.measure import command, table
from scissordyn.integrate import tableau
from scissordyn.integrate.tableau import primitives
from scissordyn.interpolation import gauss_rule
from scissordyn.run.advance import driver, tolerance


def measure(quick: bool = False) -> str:
    """Both."""
    return "\n".join((_hidden_states(), _books()))


def _hidden_states() -> str:
    rows = []
    for kinetic in (0.01, 0.1):
        reference = sd.simulate(array(kinetic), until=UNTIL, rtol=1e-12, atol=1e-12, method="dop853")["contact_start"].values
        for weight in (1.0, 10.0, 100.0, 1000.0):
            with mock.patch.object(tolerance, "FRICTION_STATE_FACTOR", weight):
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
    nodes, weights = gauss_rule(points)
    return tableau.tableau(name)._replace(gauss=nodes, weight=weights, primitive=primitives(nodes))


if __name__ == "__main__":
    command("choices", measure)
