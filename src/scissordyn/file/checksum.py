"""Checksum of a file: SHA-256 of its content, in a line after the content. HDF5 ignores what follows the end of its data."""

from __future__ import annotations

import hashlib
import os

MARK = b"\nSHA-256 of what is above, by scissordyn: "
CHUNK_BYTES = 2**20  # [bytes] of a file in memory at once; HDF5's default chunk cache has this size
LINE_BYTES = len(MARK) + len(hashlib.sha256().hexdigest()) + len("\n")


def checksum_line(content: bytes | memoryview) -> bytes:
    """Return the checksum line of a content, to append after it."""
    return MARK + hashlib.sha256(content).hexdigest().encode() + b"\n"


def verify_checksum(path: str | os.PathLike[str]) -> bool:
    """Return whether a file has a checksum.

    Raises
    ------
    ValueError
        If the content does not match it.
    """
    with open(path, "rb") as file:
        rest = os.fstat(file.fileno()).st_size - LINE_BYTES
        digest = hashlib.sha256()
        while rest > 0 and (block := file.read(min(rest, CHUNK_BYTES))):
            digest.update(block)
            rest -= len(block)
        line = file.read(LINE_BYTES)
    if not line.startswith(MARK):
        return False
    if line != MARK + digest.hexdigest().encode() + b"\n":
        raise ValueError("its content does not match its checksum: the file is damaged")
    return True
