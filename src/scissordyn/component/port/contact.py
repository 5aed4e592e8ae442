"""The ports of contacts: a journal in its bearing, and a corner of a block at a guide surface."""

from __future__ import annotations

from typing import Any

from scissordyn.component.port.declaration import Attachment, Ends, direction, frame, place


def journal_attachments(joint: Any) -> tuple[Attachment, ...]:
    """From the bearing to the journal, and the directions of both bodies that rotate."""
    ends = place(joint.journal), place(joint.bearing, -1.0)
    return (*ends, direction(2, joint.journal[0]), direction(4, joint.bearing[0]))


def journal_ends(joint: Any) -> Ends:
    """The contact force acts on the journal."""
    return joint.journal, joint.bearing


def surface_attachments(corner: Any) -> tuple[Attachment, ...]:
    """From the guide's line to the centre of the corner's arc, the block's direction, and that of the guide's frame."""
    ends = place((corner.follower, corner.centre)), place((corner.body, corner.through), -1.0)
    return (*ends, direction(2, corner.follower), frame(4, corner.body))


def surface_ends(corner: Any) -> Ends:
    """The contact force acts on the block."""
    return (corner.follower, corner.centre), (corner.body, corner.through)
