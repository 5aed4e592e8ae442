"""Relaxing surfaces: a spring parallel to a spring and a dashpot in series."""

from __future__ import annotations

from typing import Annotated

from scissordyn.laws.contact import Damping
from scissordyn.plugin.element import element
from scissordyn.units import Quantity, State


def force(elastic, relaxed_force, ratio, relaxation_time):
    """Return the normal force [N] and z' [N/s], the rate of the relaxed force."""
    lag = elastic - relaxed_force
    return elastic + ratio * lag, lag / relaxation_time


def settled(elastic):
    """Return the relaxed force z [N] at a constant indentation: the elastic force."""
    return elastic


@element(
    name="standard-linear-solid",
    force=force,
    settled=settled,
    states=(State("relaxed_force", "N", scale=1.0),),
    source="Zener 1948, Elasticity and Anelasticity of Metals",
)
class StandardLinearSolid(Damping):
    r"""Linings of polymers, which are stiffer the faster they are pressed in, and creep under a lasting force.

    .. math:: F_n = F_{el} + r (F_{el} - z),\quad \tau z' = F_{el} - z

    F_el is the force at rest, (1 + r) F_el that of a sudden indentation, which relaxes in tau. A lining has recovered when the
    next contact begins.
    """

    ratio: Annotated[float, Quantity("1", minimum=0.0, maximum=1e4, help="r, stiffness that relaxes over that at rest")] = 1.0
    relaxation_time: Annotated[float, Quantity("s", minimum=1e-9, maximum=1e6, help="tau at constant indentation")] = 1e-3
