"""The kernel that all line-contact laws with a logarithm share, inverted to round-off.

Johnson, Radzimovsky, ESDU 78035 and Dubowsky and Freudenstein all read delta = A F ln(G/F) for a force F. With w = F/G and
y = delta/(A G) that is y = -w ln w, one function for all of them: its ascending branch is w = y/t, where t = -ln w > 1 solves
t - ln t = -ln y (t is -W_{-1}(-y), the lower real branch of Lambert's function).
"""

from __future__ import annotations

import math

from scissordyn.jit import kernel

__all__ = ["TAG", "TURN", "force", "row"]

TAG = 2

TURN = 1.25
"""t at which the curve is left for its tangent. At t = 1 the laws have their deepest indentation and an infinite stiffness;
until here, 97 % of it, they are followed to round-off."""


def row(compliance: float, ceiling: float) -> tuple[float, ...]:
    """What the kernel reads, for delta = A F ln(G/F).

    Parameters
    ----------
    compliance : float
        A [m/N].
    ceiling : float
        G [N].

    Returns
    -------
    tuple of float
        1/(A G), G, the indentation and the force at `TURN`, the stiffness there.
    """
    w = math.exp(-TURN)
    return (
        1.0 / (compliance * ceiling),
        ceiling,
        compliance * ceiling * TURN * w,
        ceiling * w,
        1.0 / (compliance * (TURN - 1.0)),
    )


@kernel()
def force(delta, p):
    """Force [N] at indentation delta > 0 [m]."""
    if delta >= p[2]:
        return p[3] + p[4] * (delta - p[2])
    y = delta * p[0]
    level = -math.log(y)
    # start: the branch point's square root joined to the logarithmic tail, after Barry et al. 2000,
    # doi:10.1016/S0378-4754(00)00172-5 (relative error below 3e-4)
    root = math.sqrt(level - 1.0)
    t = level + 2.0 / 0.3361 * (
        1.0 - 1.0 / (1.0 + 0.3361 * math.sqrt(0.5) * root / (1.0 - 0.0042 * (level - 1.0) * math.exp(-0.0201 * root)))
    )
    # one step of Fritsch, Shafer and Crowley 1973, doi:10.1145/361952.361970, of order four: 3e-4 becomes round-off
    z = t - math.log(t) - level
    q = 2.0 * (1.0 - t) * (1.0 - t + 2.0 / 3.0 * z)
    t *= 1.0 + z / (1.0 - t) * (q - z) / (q - 2.0 * z)
    return p[1] * y / t
