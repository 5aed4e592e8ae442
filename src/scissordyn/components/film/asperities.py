"""Asperity contact of two rough surfaces in a joint (Greenwood and Tripp 1970), and the mean gap that oil fills.

The heights of both surfaces together are Gaussian with the rms roughness sigma. Where their mean planes are h apart, the
asperities carry the pressure

    p = K E* F_5/2(h/sigma),   F_n(x) = integral of (s - x)^n phi(s) ds from x to infinity,   phi the standard normal density.

A journal at the eccentricity e leaves h = c - e cos(theta). With sin(theta/2)^2 as variable, the integral of p cos(theta) over
the arc is a series in sigma/e, whose terms are F_3, F_4, F_5: closed forms.
"""

from __future__ import annotations

import math

from scissordyn.kernel import kernel

ASPERITY_STIFFNESS = 16.0 * math.sqrt(2.0) * math.pi / 15.0 * 0.05**2 * math.sqrt(0.01)
"""K = (16 sqrt(2) pi/15) (eta beta sigma)^2 sqrt(sigma/beta) of usual ground surfaces [1].

They have eta beta sigma = 0.05 and sigma/beta = 0.01. eta is the number of asperities per area, beta their tip radius, sigma
the rms roughness.
"""


@kernel
def mean_gap(distance, roughness):
    """Return the mean gap of rough surfaces, with overlaps as gaps of zero (Patir and Cheng 1978).

    `distance` is that of the mean planes. From contact on (distance <= 0) the surfaces give way by the indentation of the
    contact law, so that their mean planes stay together.
    """
    x = max(distance, 0.0) / roughness
    if x > 8.0:  # the rest is below 1e-17
        return distance
    normal = math.exp(-0.5 * x * x) / math.sqrt(2.0 * math.pi)
    return roughness * (0.5 * x * math.erfc(-x / math.sqrt(2.0)) + normal)


@kernel
def asperity_contact(eccentricity, roughness):
    """Return force and energy of the asperities over R L K E* and R L K E* c; both arguments are over the clearance c.

    The force is the exact derivative of the energy. From contact on (eccentricity >= 1) it keeps its value.
    """
    e = min(eccentricity, 1.0)
    x = (1.0 - e) / roughness
    if x > 8.0:  # the asperities carry less than 1e-16 of their load at contact
        return 0.0, 0.0
    normal = math.exp(-0.5 * x * x) / math.sqrt(2.0 * math.pi)
    above = 0.5 * math.erfc(x / math.sqrt(2.0))
    square, ratio = x * x, roughness / e
    third = max((square + 2.0) * normal - x * (square + 3.0) * above, 0.0)
    fourth = max((square * (square + 6.0) + 3.0) * above - x * (square + 5.0) * normal, 0.0)
    fifth = max((square * (square + 9.0) + 8.0) * normal - x * (square * (square + 10.0) + 15.0) * above, 0.0)
    arc = 5.0 * math.pi / 16.0 * math.sqrt(2.0 * ratio)
    force = arc * (third - 3.0 / 32.0 * ratio * fourth - 3.0 / 320.0 * ratio * ratio * fifth)
    energy = 0.25 * roughness * arc * (fourth + 0.025 * ratio * fifth)
    return force, energy + force * (eccentricity - e)
