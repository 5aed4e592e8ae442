"""Brown and McPhee's friction."""

from __future__ import annotations

import math
from typing import Annotated

from scissordyn.laws.friction.coefficients import Kinetic, Static, StaticFriction, static_limit
from scissordyn.plugin.element import element
from scissordyn.units import Quantity


def force(slip_speed, normal_force, kinetic, static, transition_speed):
    """Return the tangential force [N] at a slip speed [m/s]."""
    s = slip_speed / transition_speed
    rest = 0.25 * s * s + 0.75
    return normal_force * (kinetic * math.tanh(4.0 * s) + (static - kinetic) * s / (rest * rest))


@element(name="brown-mcphee", force=force, limit=static_limit, source="Brown, McPhee 2016, doi:10.1115/1.4033658")
class BrownMcPhee(StaticFriction):
    r"""Stribeck friction as one smooth function, its peak at the transition speed.

    .. math::
        F_t = F_n \left[\mu_k \tanh\frac{4v}{v_t} + \frac{(\mu_s - \mu_k)\, v/v_t}{\left((v/2v_t)^2 + 3/4\right)^2}\right]

    The viscous part of the source is left out. The static coefficient is 1.5 times the kinetic one unless it is given.
    """

    kinetic: Kinetic = 0.05
    static: Static = None
    transition_speed: Annotated[float, Quantity("m/s", minimum=1e-7, maximum=10.0, help="v_t, at which friction peaks")] = 1e-3
