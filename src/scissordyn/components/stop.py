"""Compute the force of an end stop from its indentation."""

from __future__ import annotations

from typing import Annotated

from scissordyn.kernel import kernel
from scissordyn.laws.damping.factors import Flores
from scissordyn.laws.evaluate import reference_speed
from scissordyn.units import Quantity

Exponent = Annotated[float, Quantity("1", minimum=1.0, maximum=5.0, help="n")]
Restitution = Annotated[float, Quantity("1", minimum=0.01, maximum=1.0, help="restitution coefficient")]

START_DEPTH_FRACTION = 0.01  # Largest initial indentation of a cam or an edge contact, as a fraction of its size


@kernel
def push(mode, approach_speed, effective_mass, depth, rate, stiffness, exponent, damping):
    r"""Return the force or torque of an end stop, its elastic energy [J] and the dissipated power [W].

    .. math:: F = K \delta^n (1 + \xi \delta'/v)

    A negative force is cut off. v is the speed at the touch, or more where the stop is loaded later
    (`laws.evaluate.reference_speed`).
    """
    if mode == 0.0 or depth <= 0.0:
        return 0.0, 0.0, 0.0
    elastic = stiffness * depth**exponent
    reference = reference_speed(elastic, depth, rate, approach_speed, effective_mass)
    energy, share = elastic * depth / (exponent + 1.0), damping * rate / reference
    if share < -1.0:
        return 0.0, energy, -elastic * rate
    return elastic * (1.0 + share), energy, elastic * share * rate


def stop_damping(restitution: float) -> float:
    """Return the damping factor xi of an end stop [1] (Flores et al. 2011, doi:10.1007/s11044-010-9237-4)."""
    return Flores(restitution=restitution).factor
