"""From states at the samples to what the user reads: motions, contact quantities, torques, energies."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from scissordyn.jit import Handle, kernel
from scissordyn.laws.dispatch import elastic_force
from scissordyn.mechanics.equations import accelerate, constraint_forces, project
from scissordyn.mechanics.joint import kinematics
from scissordyn.mechanics.latch import engage
from scissordyn.mechanics.system import open_system

__all__ = ["Record", "elastic_energy", "record"]

NODES: np.ndarray = 0.5 * (np.polynomial.legendre.leggauss(16)[0] + 1.0)
WEIGHTS: np.ndarray = 0.5 * np.polynomial.legendre.leggauss(16)[1]


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
        Of the quadratic constraints.
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
def elastic_energy(tag, delta, p):
    """Work [J] to press an elastic part in by delta [m].

    With delta = d s^2 the usual powers 3/2, 10/9 and 1 of delta become smooth in s, so Gauss's rule is exact to round-off.
    """
    if delta <= 0.0:
        return 0.0
    total = 0.0
    for k in range(NODES.size):
        s = NODES[k]
        total += WEIGHTS[k] * elastic_force(tag, delta * s * s, p) * 2.0 * s
    return total * delta


@kernel()
def fill(time, state, mode, memory, address, R):
    """Evaluate everything at each sample."""
    S = open_system(address)
    n, nb = S.model.n, S.model.nb
    for at in range(time.size):
        for j in range(S.state.mode.size):
            S.state.mode[j] = mode[at, j]
            S.state.memory[j] = memory[at, j]
        engage(S)
        # dense output keeps lengths only to its own accuracy
        project(time[at], state[at], S)
        accelerate(time[at], state[at], S, S.work.scratch)
        kinetic = potential = 0.0
        for i in range(n + nb):
            R.X[at, i], R.V[at, i], R.A[at, i] = S.work.X[i], S.work.V[i], S.work.A[i]
            potential -= S.parameters.weight[i] * S.work.X[i]
        for i in range(n):
            kinetic += 0.5 * S.work.V[i] * S.work.V[i]
            for k in range(nb):
                kinetic += S.work.V[i] * S.model.inertia[i, k] * S.work.basis[1, k]
        for i in range(nb):
            for k in range(nb):
                kinetic += 0.5 * S.work.basis[1, i] * S.model.inertia_b[i, k] * S.work.basis[1, k]
        R.kinetic[at], R.potential[at] = kinetic, potential
        constraint_forces(S, S.work.work_b)
        for d in range((S.model.nb - 1) // 2):
            i = 1 + 2 * d
            R.torque[at, d] = S.work.work_b[i + 1] * S.work.basis[0, i] - S.work.work_b[i] * S.work.basis[0, i + 1]
        for k in range(S.work.multiplier.size):
            R.multiplier[at, k] = S.work.multiplier[k]
            S.work.work[k] = -S.work.value[0, k]
        for p in range(S.work.part_weight.size):
            S.work.work[S.model.part_constraint[p]] += 0.5 * S.work.part_weight[p] * (S.work.direction[p, 0] ** 2 + S.work.direction[p, 1] ** 2)
        for k in range(S.work.multiplier.size):
            R.length_error[0] = max(R.length_error[0], abs(S.work.work[k]))
        R.elastic[at] = R.springs[at] = 0.0
        for i in range(S.parameters.component.shape[0]):
            R.springs[at] += S.parameters.component[i, 5]
            for q in range(3):
                R.element[at, i, q] = S.parameters.component[i, 8 + q]
            R.observed[at, i, 0], R.observed[at, i, 1] = S.work.observed[i, 0], S.work.observed[i, 1]
        for j in range(S.parameters.contact.size):
            if S.state.mode[j] == 0:
                kinematics(j, S)
                S.work.contact[j, 3] = S.work.contact[j, 4] = S.work.contact[j, 5] = 0.0
            else:
                R.elastic[at] += elastic_energy(S.parameters.law[j, 0], S.work.contact[j, 0], S.parameters.elastic[j])
            for q in range(9):
                R.joint[at, j, q] = S.work.contact[j, q]


def record(system: Handle, time: np.ndarray, state: np.ndarray, mode: np.ndarray, memory: np.ndarray) -> Record:
    """Evaluate everything at the samples.

    Parameters
    ----------
    system : Handle
        Of a `System`; its contact state is overwritten.
    time : ndarray, shape (nt,)
    state : ndarray, shape (nt, ny)
        Projected in place onto the length constraints.
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
