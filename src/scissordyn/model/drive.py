"""Drives, which prescribe the angle of a body."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from scissordyn.component.time_function import TimeFunction
from scissordyn.units import Meaning, check_quantities, documented


@documented
@dataclass(frozen=True)
class Drive:
    """A prescribed angle of a body; the driving torque follows from the motion."""

    body: Annotated[str, Meaning("the driven body")]
    motion: Annotated[TimeFunction, Meaning("the prescribed angle", "ConstantSpeed(rpm(150))")]

    def __post_init__(self) -> None:
        check_quantities(self, f"drive of '{self.body}'")
