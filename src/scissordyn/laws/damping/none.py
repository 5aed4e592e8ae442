"""No damping."""

from __future__ import annotations

from scissordyn.laws.contact import JointContact
from scissordyn.laws.damping import proportional
from scissordyn.laws.slot import DAMPING
from scissordyn.plugin.element import element

__all__ = ["NoDamping"]


@element(
    slot=DAMPING,
    name="none",
    force=proportional.force,
    source="Hertz 1881",
)
class NoDamping:
    """A contact without dissipation: xi = 0."""

    @property
    def factor(self) -> float:
        """Damping factor xi [1]."""
        return 0.0

    def parameters(self, joint: JointContact) -> tuple[float, ...]:
        """Damping factor xi [1]."""
        return (self.factor,)
