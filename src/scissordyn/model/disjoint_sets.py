"""Disjoint sets, such as bodies that are connected to each other (union-find)."""

from __future__ import annotations

from collections.abc import Hashable
from typing import Any


class DisjointSets:
    """Disjoint sets of members, each with a representative; a member that was never united is alone in its set."""

    def __init__(self) -> None:
        self.above: dict[Any, Any] = {}

    def __contains__(self, member: Hashable) -> bool:
        """Return whether a member has been united with another one."""
        return member in self.above

    def find(self, member: Any) -> Any:
        """Return the representative of the set of a member."""
        while (up := self.above.get(member, member)) != member:
            member = up
        return member

    def join(self, kept: Any, other: Any) -> None:
        """Unite the sets of two members; the representative is that of the first."""
        kept, other = self.find(kept), self.find(other)
        self.above[other] = self.above[kept] = kept
