"""Gonthier, McPhee, Lange and Piedboeuf's damping factor."""

from __future__ import annotations

from scissordyn.laws.damping.exact import exact_factor
from scissordyn.laws.damping.proportional import DampingFactor, PositiveRestitution
from scissordyn.plugin.element import element


@element(name="gonthier", restitution_range=(0.0, 1.0), source="Gonthier et al. 2004, doi:10.1023/B:MUBO.0000029392.21648.bc")
class Gonthier(DampingFactor):
    r"""Damping found from the restitution without an assumption on the size of the loss.

    .. math:: \xi = d/c_e,\quad \frac{1 + d/c_e}{1 - d} = e^{d(1 + 1/c_e)}

    This is the factor of the law "exact", written with d. The common approximation is d = 1 - c_e^2.
    """

    restitution: PositiveRestitution = 0.9
    approximate: bool = False

    @property
    def factor(self) -> float:
        """Damping factor xi [1]."""
        if self.approximate:
            return (1.0 - self.restitution**2) / self.restitution
        return exact_factor(self.restitution)
