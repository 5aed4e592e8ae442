"""Evaluate laws through the pointers of their kernels."""

from __future__ import annotations

import math

import numpy as np

from scissordyn.kernel import F1, call_at, entry, kernel
from scissordyn.laws.elastic.quadrature import quadrature_energy

APPROACH_FLOOR = 1e-6  # Least reference speed of damping [m/s]; avoids a division by zero in a contact at rest


@entry
def elastic_force(pointer: int, delta: float, p: F1) -> float:
    """Return the elastic force [N] at indentation delta > 0 [m]."""
    return call_at(pointer, (delta,), (), (), (), p, ())


@entry
def write_elastic_forces(pointer: int, delta: F1, p: F1, force: F1) -> None:
    """Compute the elastic forces [N] at indentations delta > 0 [m]."""
    for k in range(delta.size):
        force[k] = elastic_force(pointer, delta[k], p)


@entry
def elastic_energy(pointer: int, force_pointer: int, delta: float, p: F1) -> float:
    """Return the work [J] of the elastic force up to indentation delta [m], by quadrature if the law has no energy kernel."""
    if delta <= 0.0:
        return 0.0
    if pointer == 0:
        return quadrature_energy(force_pointer, delta, p)
    return call_at(pointer, (delta,), (), (), (), p, ())


@entry
def write_elastic_energies(pointer: int, force_pointer: int, delta: F1, p: F1, energy: F1) -> None:
    """Compute the work [J] of the elastic force up to each indentation [m]."""
    for k in range(delta.size):
        energy[k] = elastic_energy(pointer, force_pointer, delta[k], p)


@kernel
def rate_in_range(rate, approach):
    """Return the rate of the indentation [m/s] at which the damping law of a contact is evaluated.

    A damping factor is derived for rates up to the speed v at which the contact began. For a contact that closed from rest,
    `approach` is -v with a tiny v; its damping is at most that of the rate v.
    """
    if approach >= 0.0:
        return rate
    over = rate / approach
    return rate / math.sqrt(1.0 + over * over)


@entry
def reference_speed(elastic: float, delta: float, rate: float, approach: float, mass: float) -> float:
    r"""Return the speed [m/s] to which damping relates the rate of the indentation.

    It is the approach speed v0 until the kinetic and elastic energy of the contact correspond to more than twice that speed:

    .. math:: v = \max(v_0, \tfrac{1}{2}\sqrt{\dot\delta^2 + F_{el}\,\delta/m})

    A free impact never reaches that. `mass` is the effective mass m at the onset [kg]. A mass of 0 keeps v0 at all times;
    `approach` may then be negative, see `rate_in_range`.
    """
    if mass == 0.0:
        return approach
    loaded = 0.5 * math.sqrt(rate * rate + elastic * delta / mass)
    speed = loaded if loaded > approach else approach
    return speed if speed > 0.0 else APPROACH_FLOOR


@entry
def normal_force(pointer: int, elastic: float, delta: float, rate: float, approach: float, z: F1, dz: F1, p: F1) -> float:
    """Return the normal force [N], never negative, from an elastic force; write the rates of the internal states into dz.

    `approach` is that of `reference_speed`.
    """
    rate = rate_in_range(rate, approach)
    force = call_at(pointer, (elastic, delta, rate, abs(approach)), (), z, (), p, dz)
    # max() would hide a NaN
    return 0.0 if force < 0.0 else force


@entry
def settled_states(pointer: int, elastic: float, delta: float, z: F1, p: F1) -> None:
    """Compute the internal states of damping at a constant indentation."""
    if pointer == 0:
        z[:] = 0.0
    else:
        call_at(pointer, (elastic, delta), (), (), (), p, z)


@entry
def friction_force(pointer: int, v: float, normal: float, z: F1, dz: F1, p: F1) -> float:
    """Return the tangential force [N]; write the rates of the internal states into dz."""
    if pointer == 0:
        return 0.0
    return call_at(pointer, (v, normal), (), z, (), p, dz)


@entry
def friction_states(pointer: int, v: float, z: F1, p: F1) -> None:
    """Compute the internal states at the start of a contact with slip speed v [m/s], or those of steady sliding."""
    if pointer == 0:
        z[:] = 0.0
    else:
        call_at(pointer, (v,), (), (), (), p, z)


@entry
def friction_limit(pointer: int, v: float, normal: float, p: F1) -> float:
    """Return the largest |F_t| [N] of static friction and the viscous part; infinite if unknown."""
    if pointer == 0:
        return math.inf
    return call_at(pointer, (v, normal), (), (), (), p, ())


def elastic_forces(pointer: int, delta: np.ndarray, row: np.ndarray) -> np.ndarray:
    """Return the elastic forces [N] at indentations delta > 0 [m], in the shape of `delta`."""
    depths = np.array(delta, float).ravel()
    forces = np.zeros(depths.size)
    write_elastic_forces(pointer, depths, row, forces)
    return forces.reshape(np.shape(delta))


def elastic_energies(pointer: int, force_pointer: int, delta: np.ndarray, row: np.ndarray) -> np.ndarray:
    """Return the work [J] of the elastic force up to indentations of shape (k,) [m]."""
    energies = np.zeros(delta.size)
    write_elastic_energies(pointer, force_pointer, delta, row, energies)
    return energies
