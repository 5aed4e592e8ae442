"""Checksum of a file: SHA-256 of its content, in a line after the content. HDF5 ignores bytes after the end of its data."""

from __future__ import annotations

import hashlib
import os

MARK = b"\nSHA-256 of what is above, by scissordyn: "
CHUNK_BYTES = 2**20  # [bytes] Part of a file that is read at once, and chunk of an array; HDF5's default cache has this size
LINE_BYTES = len(MARK) + len(hashlib.sha256().hexdigest()) + len("\n")


def checksum_line(content: bytes | memoryview) -> bytes:
    """Return the line with the checksum of a file's content, to be appended to the content."""
    return MARK + hashlib.sha256(content).hexdigest().encode() + b"\n"


def verify_checksum(path: str | os.PathLike[str]) -> bool:
    """Check a file against its checksum; return False if it has no checksum.

    Raises
    ------
    ValueError
        If the content does not match the checksum.
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
