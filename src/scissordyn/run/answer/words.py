"""Parts of a summary as plain data."""

from __future__ import annotations

import dataclasses
import math
from typing import Any


class Words:
    """A part of a summary, which is a dataclass, as plain data."""

    def plain(self) -> dict[str, Any]:
        """Its numbers by name, in SI units; None for what is not known."""
        names = (field.name for field in dataclasses.fields(self))  # type: ignore[arg-type]  # of the dataclasses below it
        return {name: plain(getattr(self, name)) for name in names}


def plain(value: Any) -> Any:
    """A value of a summary as plain data."""
    if isinstance(value, Words):
        return value.plain()
    if isinstance(value, tuple):
        return [plain(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
