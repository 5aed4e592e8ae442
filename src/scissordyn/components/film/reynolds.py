"""Reynolds' equation of a journal bearing of finite length, solved once for the table of `finite.npz`.

With the film thickness c H, H = 1 + e cos(theta), theta from the thick side, and zeta = z/(L/2), the pressure is
mu (R/c)^2 V P(theta, zeta) with

    d/dtheta (H^3 dP/dtheta) + (D/L)^2 d/dzeta (H^3 dP/dzeta) = 6 cos(theta - psi),   P >= 0,   P(zeta = +-1) = 0,

where the film thickness changes by c V cos(theta - psi)/2 per unit of time, rotation included: the pressure is linear in V.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import splu


@dataclass(frozen=True)
class Impedance:
    """Forces on the journal and largest pressure per unit of the velocity V (see `impedance`)."""

    radial: float  # Force over mu R L (R/c)^2 V, along the eccentricity and across it
    tangential: float
    pressure: float  # Largest pressure over mu (R/c)^2 V


class _Mesh:
    """Finite-volume mesh of half of the bearing's length: finer in theta where the film is thin, in zeta at the end."""

    def __init__(self, eccentricity: float, around: int, along: int) -> None:
        even = (np.arange(around) + 0.5) / around * 2.0 * np.pi - np.pi
        finer = ((1.0 - eccentricity) / (1.0 + eccentricity)) ** 0.25
        edges = np.linspace(-np.pi, np.pi, around + 1)
        # about the thin side: tan(x/2) = finer tan(even/2)
        self.theta = np.pi + 2.0 * np.arctan(finer * np.tan(0.5 * even))
        edge = np.pi + 2.0 * np.arctan(finer * np.tan(0.5 * edges[1:-1]))
        self.edge = np.concatenate([[0.0], edge, [2.0 * np.pi]])
        cut = np.sin(0.5 * np.pi * np.linspace(0.0, 1.0, along + 1))
        self.zeta, self.cut = 0.5 * (cut[1:] + cut[:-1]), cut
        self.width, self.height = np.diff(self.edge), np.diff(cut)


def _operator(mesh: _Mesh, eccentricity: float, ratio: float) -> sp.csc_matrix:
    """Return the finite-volume matrix of the left-hand side of Reynolds' equation; `ratio` is L/D."""
    n, m = mesh.theta.size, mesh.zeta.size
    gap = np.diff(np.concatenate([mesh.theta[-1:] - 2.0 * np.pi, mesh.theta, mesh.theta[:1] + 2.0 * np.pi]))
    across = (1.0 + eccentricity * np.cos(mesh.edge)) ** 3 / gap
    around = sp.lil_matrix((n, n))
    for i in range(n):
        around[i, i - 1] += across[i]
        around[i, (i + 1) % n] += across[i + 1]
        around[i, i] -= across[i] + across[i + 1]
    apart = np.diff(np.concatenate([mesh.zeta, [1.0]]))
    axial = sp.lil_matrix((m, m))
    for k in range(m):
        axial[k, k] -= 1.0 / apart[k]
        if k + 1 < m:
            axial[k, k + 1] += 1.0 / apart[k]
            axial[k + 1, k] += 1.0 / apart[k]
            axial[k + 1, k + 1] -= 1.0 / apart[k]
    cube = sp.diags((1.0 + eccentricity * np.cos(mesh.theta)) ** 3 * mesh.width)
    whole = sp.kron(around, sp.diags(mesh.height)) + ratio**-2 * sp.kron(cube, axial)
    return sp.csc_matrix(whole)


def impedance(
    eccentricity: float, directions: np.ndarray, ratio: float, *, around: int = 160, along: int = 12
) -> list[Impedance]:
    """Return the impedances of a bearing at one eccentricity for several directions psi of the velocity."""
    mesh = _Mesh(eccentricity, around, along)
    matrix = _operator(mesh, eccentricity, ratio)
    area = np.outer(mesh.width, mesh.height)
    pressures, film = [], np.ones(area.size, bool)
    for psi in directions:
        # cell means of the cosine
        source = 6.0 * np.outer(np.diff(np.sin(mesh.edge - psi)), mesh.height).ravel()
        for _ in range(100):  # which cells have a film: Newton's method for the complementarity, ends after a few
            inside = np.flatnonzero(film)
            pressure = np.zeros(film.size)
            if inside.size:
                pressure[inside] = splu(matrix[inside][:, inside]).solve(source[inside])
            rest = matrix @ pressure - source  # positive where a ruptured film would need a supply of oil
            now = np.where(film, pressure > 0.0, rest > 1e-14)
            if np.array_equal(now, film):
                break
            film = now
        pressure = np.maximum(pressure, 0.0).reshape(area.shape)
        mean = pressure @ mesh.height
        radial, tangential = (float(np.sum(mean * np.diff(part))) for part in (np.sin(mesh.edge), -np.cos(mesh.edge)))
        pressures.append(Impedance(radial, tangential, float(pressure.max())))
    return pressures
