"""Kernel that all damping factors share: F = F_el (1 + xi delta'/delta'(-)) and the restitution that xi is found from."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, ClassVar

from scissordyn.laws.contact import Damping, JointContact
from scissordyn.plugin.element import Kernel
from scissordyn.units import Quantity

Restitution = Annotated[float, Quantity("1", minimum=0.0, maximum=1.0, help="restitution coefficient c_e")]
PositiveRestitution = Annotated[float, Quantity("1", minimum=1e-3, maximum=1.0, help="restitution coefficient c_e")]
"""For factors that grow as 1/c_e; impacts that return less than a thousandth of their speed are beyond these laws."""


def force(elastic, rate, approach, factor):
    """Return the normal force [N] from the elastic part [N], delta' and delta'(-) [m/s]; tension is cut off later."""
    return elastic * (1.0 + factor * rate / approach)


@dataclass(frozen=True)
class DampingFactor(Damping):
    """Base of laws that find a damping factor from a restitution coefficient; each adds name, source, range and formula."""

    kernels: ClassVar[Mapping[str, Kernel]] = {"force": force}

    restitution: Restitution = 0.9

    @staticmethod
    def _xi(c: float) -> float:
        raise NotImplementedError

    @property
    def factor(self) -> float:
        """Damping factor xi [1]."""
        return self._xi(self.restitution)

    def parameters(self, joint: JointContact) -> tuple[float, ...]:
        """Return the damping factor xi [1]."""
        return (self.factor,)
