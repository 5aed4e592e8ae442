"""No damping."""

from __future__ import annotations

from scissordyn.laws.contact import Damping, JointContact
from scissordyn.laws.damping import proportional
from scissordyn.plugin.element import element


@element(name="none", force=proportional.force, source="Hertz 1881")
class NoDamping(Damping):
    """A contact without dissipation: xi = 0."""

    @property
    def factor(self) -> float:
        """Damping factor xi [1]."""
        return 0.0

    def parameters(self, joint: JointContact) -> tuple[float, ...]:
        """Return the damping factor xi [1]."""
        return (self.factor,)
