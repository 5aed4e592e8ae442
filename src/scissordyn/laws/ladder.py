"""From a law's tag to its kernel.

An integer into a ladder of ifs: machine code with such a ladder is kept on disk, a function passed as an argument is not.
"""

from __future__ import annotations

from scissordyn.jit import kernel
from scissordyn.laws.damping import proportional
from scissordyn.laws.elastic import hertz, liu
from scissordyn.laws.friction import ambrosio, lugre

__all__ = ["elastic_force", "friction_force", "friction_start", "normal_force"]

_liu, _hertz = liu.force, hertz.force
_proportional = proportional.force
_lugre, _lugre_start, _ambrosio = lugre.force, lugre.start, ambrosio.force


@kernel()
def elastic_force(tag, delta, p):
    """Elastic part [N] of law `tag` at indentation delta > 0 [m]."""
    if tag == 0:
        return _liu(delta, p)
    if tag == 1:
        return _hertz(delta, p)
    return 0.0


@kernel()
def normal_force(tag, elastic, delta, rate, approach, p):
    """Normal force [N] that damping `tag` makes of an elastic part; never a pull."""
    force = elastic
    if tag == 0:
        force = _proportional(elastic, delta, rate, approach, p)
    return max(force, 0.0)


@kernel()
def friction_force(tag, v, normal, z, dz, p):
    """Tangential force [N] of friction `tag`; writes the rates of its hidden states into dz."""
    if tag == 0:
        return 0.0
    if tag == 1:
        return _lugre(v, normal, z, dz, p)
    if tag == 2:
        return _ambrosio(v, normal, p)
    return 0.0


@kernel()
def friction_start(tag, v, z, p):
    """Hidden states at the start of a contact that begins at slip speed v [m/s]."""
    if tag == 1:
        _lugre_start(v, z, p)
