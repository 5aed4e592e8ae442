"""From states at the samples to what the user reads: motions, contact quantities, torques, energies."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from scissordyn.jit import Handle, kernel
from scissordyn.laws.dispatch import elastic_energy
from scissordyn.mechanics.equations import accelerate, constraint_forces, project
from scissordyn.mechanics.joint import kinematics
from scissordyn.mechanics.latch import engage
from scissordyn.mechanics.system import open_system

__all__ = ["Record", "record"]


class Record(NamedTuple):
    """Quantities at the samples.

    Parameters
    ----------
    X, V, A : ndarray, shape (nt, n + nb)
        Columns [x; b] and their two derivatives.
    joint : ndarray, shape (nt, nj, 9)
        delta, delta', slip speed, elastic, normal and tangential force, n_x, n_y, |e|.
    elastic : ndarray, shape (nt,)
        Elastic energy of all contacts [J].
    springs : ndarray, shape (nt,)
        Energy stored in springs [J].
    element : ndarray, shape (nt, elements, 3)
        Force on the element's end [N] and torque on its body [N m].
    observed : ndarray, shape (nt, elements, 2)
        Angle error [rad] and recorded signal of actuators.
    torque : ndarray, shape (nt, drives)
    multiplier : ndarray, shape (nt, m)
        Of the quadratic conditions.
    kinetic, potential : ndarray, shape (nt,)
    length_error : float
        Largest relative error of a length.
    """

    X: np.ndarray
    V: np.ndarray
    A: np.ndarray
    joint: np.ndarray
    elastic: np.ndarray
    springs: np.ndarray
    element: np.ndarray
    observed: np.ndarray
    torque: np.ndarray
    multiplier: np.ndarray
    kinetic: np.ndarray
    potential: np.ndarray
    length_error: np.ndarray


@kernel()
def fill(time, state, mode, memory, address, R):
    """Evaluate everything at each sample."""
    S = open_system(address)
    n, nb = S.n, S.nb
    for at in range(time.size):
        for j in range(S.mode.size):
            S.mode[j] = mode[at, j]
            S.approach[j] = memory[at, j]
        engage(S)
        # dense output keeps lengths only to its own accuracy
        project(time[at], state[at], S)
        accelerate(time[at], state[at], S, S.scratch)
        kinetic = potential = 0.0
        for i in range(n + nb):
            R.X[at, i], R.V[at, i], R.A[at, i] = S.X[i], S.V[i], S.A[i]
            potential -= S.weight[i] * S.X[i]
        for i in range(n):
            kinetic += 0.5 * S.V[i] * S.V[i]
            for k in range(nb):
                kinetic += S.V[i] * S.inertia[i, k] * S.basis[1, k]
        for i in range(nb):
            for k in range(nb):
                kinetic += 0.5 * S.basis[1, i] * S.inertia_b[i, k] * S.basis[1, k]
        R.kinetic[at], R.potential[at] = kinetic, potential
        constraint_forces(S, S.work_b)
        for d in range((S.nb - 1) // 2):
            i = 1 + 2 * d
            R.torque[at, d] = S.work_b[i + 1] * S.basis[0, i] - S.work_b[i] * S.basis[0, i + 1]
        for k in range(S.multiplier.size):
            R.multiplier[at, k] = S.multiplier[k]
            S.work[k] = -S.level[0, k]
        for p in range(S.part_weight.size):
            S.work[S.part_condition[p]] += 0.5 * S.part_weight[p] * (S.direction[p, 0] ** 2 + S.direction[p, 1] ** 2)
        for k in range(S.multiplier.size):
            R.length_error[0] = max(R.length_error[0], abs(S.work[k]))
        R.elastic[at] = R.springs[at] = 0.0
        for i in range(S.element.shape[0]):
            R.springs[at] += S.element[i, 5]
            for q in range(3):
                R.element[at, i, q] = S.element[i, 8 + q]
            R.observed[at, i, 0], R.observed[at, i, 1] = S.observed[i, 0], S.observed[i, 1]
        for j in range(S.radius.shape[0]):
            if S.mode[j] == 0:
                kinematics(j, S)
                S.joint[j, 3] = S.joint[j, 4] = S.joint[j, 5] = 0.0
            else:
                R.elastic[at] += elastic_energy(S.law[j, 0], S.joint[j, 0], S.elastic[j])
            for q in range(9):
                R.joint[at, j, q] = S.joint[j, q]


def record(system: Handle, time: np.ndarray, state: np.ndarray, mode: np.ndarray, memory: np.ndarray) -> Record:
    """Evaluate everything at the samples.

    Parameters
    ----------
    system : Handle
        Of a `System`; its contact state is overwritten.
    time : ndarray, shape (nt,)
    state : ndarray, shape (nt, ny)
        Projected in place onto the length conditions.
    mode, memory : ndarray, shape (nt, guards)
        Contact states and approach speeds.

    Returns
    -------
    Record
    """
    content = system.content
    instants, columns, joints = time.size, content.n + content.nb, content.radius.shape[0]
    found = Record(
        X=np.empty((instants, columns)),
        V=np.empty((instants, columns)),
        A=np.empty((instants, columns)),
        joint=np.empty((instants, joints, 9)),
        elastic=np.empty(instants),
        springs=np.empty(instants),
        element=np.empty((instants, content.element.shape[0], 3)),
        observed=np.empty((instants, content.element.shape[0], 2)),
        torque=np.empty((instants, (content.nb - 1) // 2)),
        multiplier=np.empty((instants, content.multiplier.size)),
        kinetic=np.empty(instants),
        potential=np.empty(instants),
        length_error=np.zeros(1),
    )
    fill(time, state, mode, memory, system.address, found)
    return found
