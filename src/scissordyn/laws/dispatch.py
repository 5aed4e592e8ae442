"""Dispatch from the kernel kind of a law to its kernel.

The kind is an integer that a chain of ifs compares: numba caches such machine code on disk, but not a function passed as an
argument. A kind without a branch gives NaN, which ends the run and names the joint.
"""

from __future__ import annotations

import math

from scissordyn.jit import kernel
from scissordyn.laws.damping import dashpot, proportional
from scissordyn.laws.elastic import bai_zhao, hertz, linear, liu, logarithmic, persson, power, quadrature
from scissordyn.laws.friction import (
    ambrosio,
    bengisu_akay,
    brown_mcphee,
    coulomb,
    dahl,
    elastoplastic,
    gonthier,
    lugre,
    stribeck,
    threlfall,
)
from scissordyn.plugin.pointer import USER, call_at

__all__ = [
    "elastic_energy",
    "elastic_force",
    "friction_force",
    "friction_limit",
    "friction_start",
    "friction_steady",
    "normal_force",
]

_liu, _hertz, _logarithmic, _power = liu.force, hertz.force, logarithmic.force, power.force
_linear, _persson, _bai_zhao = linear.force, persson.force, bai_zhao.force
_proportional, _dashpot = proportional.force, dashpot.force
_lugre, _ambrosio, _coulomb, _threlfall, _bengisu_akay = (
    lugre.force,
    ambrosio.force,
    coulomb.force,
    threlfall.force,
    bengisu_akay.force,
)
_brown_mcphee, _stribeck, _dahl, _elastoplastic, _gonthier = (
    brown_mcphee.force,
    stribeck.force,
    dahl.force,
    elastoplastic.force,
    gonthier.force,
)
_lugre_start, _dahl_start, _elastoplastic_start, _gonthier_start = lugre.start, dahl.start, elastoplastic.start, gonthier.start
_lugre_steady, _dahl_steady, _elastoplastic_steady, _gonthier_steady = (
    lugre.steady,
    dahl.steady,
    elastoplastic.steady,
    gonthier.steady,
)
_lugre_limit, _ambrosio_limit, _coulomb_limit, _threlfall_limit, _bengisu_akay_limit = (
    lugre.static_limit,
    ambrosio.static_limit,
    coulomb.static_limit,
    threlfall.static_limit,
    bengisu_akay.static_limit,
)
_brown_mcphee_limit, _stribeck_limit, _dahl_limit, _elastoplastic_limit, _gonthier_limit = (
    brown_mcphee.static_limit,
    stribeck.static_limit,
    dahl.static_limit,
    elastoplastic.static_limit,
    gonthier.static_limit,
)
_liu_energy, _hertz_energy, _logarithmic_energy, _power_energy = liu.energy, hertz.energy, logarithmic.energy, power.energy
_linear_energy, _persson_energy, _bai_zhao_energy = linear.energy, persson.energy, bai_zhao.energy
_user_energy = quadrature.user_energy


@kernel()
def elastic_force(kind, delta, p):
    """Elastic part [N] of law `kind` at indentation delta > 0 [m]."""
    if kind == 0:
        return _liu(delta, p)
    if kind == 1:
        return _hertz(delta, p)
    if kind == 2:
        return _logarithmic(delta, p)
    if kind == 3:
        return _power(delta, p)
    if kind == 4:
        return _linear(delta, p)
    if kind == 5:
        return _persson(delta, p)
    if kind == 6:
        return _bai_zhao(delta, p)
    if kind == USER:
        return call_at((delta,), p)  # type: ignore[call-arg]
    return math.nan


@kernel()
def elastic_energy(kind, delta, p):
    """Work [J] to press the elastic part of law `kind` in by delta [m]."""
    if delta <= 0.0:
        return 0.0
    if kind == 0:
        return _liu_energy(delta, p)
    if kind == 1:
        return _hertz_energy(delta, p)
    if kind == 2:
        return _logarithmic_energy(delta, p)
    if kind == 3:
        return _power_energy(delta, p)
    if kind == 4:
        return _linear_energy(delta, p)
    if kind == 5:
        return _persson_energy(delta, p)
    if kind == 6:
        return _bai_zhao_energy(delta, p)
    if kind == USER:
        return _user_energy(delta, p)
    return math.nan


@kernel()
def normal_force(kind, elastic, delta, rate, approach, p):
    """Normal force [N] of damping `kind` from an elastic part; never negative."""
    force = math.nan
    if kind == 0:
        force = _proportional(elastic, delta, rate, approach, p)
    elif kind == 1:
        force = _dashpot(elastic, delta, rate, approach, p)
    elif kind == USER:
        force = call_at((elastic, delta, rate, approach), p)  # type: ignore[call-arg]
    # max() would drop a NaN
    return 0.0 if force < 0.0 else force


@kernel()
def friction_force(kind, v, normal, z, dz, p):
    """Tangential force [N] of friction `kind`; writes the rates of its internal states into dz."""
    if kind == 0:
        return 0.0
    if kind == 1:
        return _lugre(v, normal, z, dz, p)
    if kind == 2:
        return _ambrosio(v, normal, p)
    if kind == 3:
        return _coulomb(v, normal, p)
    if kind == 4:
        return _threlfall(v, normal, p)
    if kind == 5:
        return _bengisu_akay(v, normal, p)
    if kind == 6:
        return _brown_mcphee(v, normal, p)
    if kind == 7:
        return _stribeck(v, normal, p)
    if kind == 8:
        return _dahl(v, normal, z, dz, p)
    if kind == 9:
        return _elastoplastic(v, normal, z, dz, p)
    if kind == 10:
        return _gonthier(v, normal, z, dz, p)
    if kind == USER:
        return call_at((v, normal), p)  # type: ignore[call-arg]
    return math.nan


@kernel()
def friction_start(kind, v, z, p):
    """Internal states at the start of a contact that begins at slip speed v [m/s]."""
    if kind == 1:
        _lugre_start(v, z, p)
    elif kind == 8:
        _dahl_start(v, z, p)
    elif kind == 9:
        _elastoplastic_start(v, z, p)
    elif kind == 10:
        _gonthier_start(v, z, p)


@kernel()
def friction_steady(kind, v, z, p):
    """Internal states of steady sliding at slip speed v [m/s]."""
    if kind == 1:
        _lugre_steady(v, z, p)
    elif kind == 8:
        _dahl_steady(v, z, p)
    elif kind == 9:
        _elastoplastic_steady(v, z, p)
    elif kind == 10:
        _gonthier_steady(v, z, p)


@kernel()
def friction_limit(kind, v, normal, p):
    """Largest |F_t| [N] that friction `kind` itself allows: static friction and the viscous part; infinite for a user's law."""
    if kind == 0:
        return 0.0
    if kind == 1:
        return _lugre_limit(v, normal, p)
    if kind == 2:
        return _ambrosio_limit(v, normal, p)
    if kind == 3:
        return _coulomb_limit(v, normal, p)
    if kind == 4:
        return _threlfall_limit(v, normal, p)
    if kind == 5:
        return _bengisu_akay_limit(v, normal, p)
    if kind == 6:
        return _brown_mcphee_limit(v, normal, p)
    if kind == 7:
        return _stribeck_limit(v, normal, p)
    if kind == 8:
        return _dahl_limit(v, normal, p)
    if kind == 9:
        return _elastoplastic_limit(v, normal, p)
    if kind == 10:
        return _gonthier_limit(v, normal, p)
    if kind == USER:
        return math.inf
    return math.nan
