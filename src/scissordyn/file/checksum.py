"""Checksum of a file: SHA-256 of its content, in a line after the content. HDF5 ignores bytes after the end of its data."""

from __future__ import annotations

import hashlib
import os

CHECKSUM_MARK = b"\nSHA-256 of what is above, by scissordyn: "  # First bytes of the checksum line
CHUNK_BYTES = 2**20  # [bytes] Size of the blocks in which files are read and arrays are stored; that of HDF5's default cache
LINE_BYTES = len(CHECKSUM_MARK) + len(hashlib.sha256().hexdigest()) + len("\n")  # [bytes] Length of the checksum line


def checksum_line(content: bytes | memoryview) -> bytes:
    """Return the line with the checksum of a file's content, to be appended to the content."""
    return CHECKSUM_MARK + hashlib.sha256(content).hexdigest().encode() + b"\n"


def verify_checksum(path: str | os.PathLike[str]) -> bool:
    """Return True if a file matches its checksum, False if it has none; raise `ValueError` if they differ."""
    with open(path, "rb") as file:
        rest = os.fstat(file.fileno()).st_size - LINE_BYTES
        digest = hashlib.sha256()
        while rest > 0 and (block := file.read(min(rest, CHUNK_BYTES))):
            digest.update(block)
            rest -= len(block)
        line = file.read(LINE_BYTES)
    if not line.startswith(CHECKSUM_MARK):
        return False
    if line != CHECKSUM_MARK + digest.hexdigest().encode() + b"\n":
        raise ValueError("its content does not match its checksum: the file is damaged")
    return True
