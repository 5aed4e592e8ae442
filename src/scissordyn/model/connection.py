"""Welds, which make bodies one."""

from __future__ import annotations

from dataclasses import dataclass

from scissordyn.component.place import Name, Reference
from scissordyn.errors import InputError
from scissordyn.units import check_quantities, documented


@documented
@dataclass(frozen=True)
class Weld:
    """A rigid connection: two points coincide and the bodies keep the relative angle of the start."""

    name: Name
    start: Reference
    end: Reference

    def __post_init__(self) -> None:
        check_quantities(self, f"weld '{self.name}'")
        if self.start[0] == self.end[0]:
            raise InputError(f"weld '{self.name}' connects body '{self.start[0]}' with itself", "two different bodies")
