"""Standard output and errors that are closed, full, or of another encoding than UTF-8."""

from __future__ import annotations

import codecs
import io
import os
import sys
import unicodedata

WRITTEN = "scissordyn"  # Name of the error handler of encodings

IN_ASCII = {"\u00b5": "u", "\u03bc": "u", "\u00b0": "deg", "\u00b7": "*", "\u00d7": "x", "\u2026": "...", "\u2019": "'"}
"""Letters of units and signs as they are typed; of others the letter without its accent, or else the code."""


def prepare_streams() -> None:
    """Make everything that a command prints fit its standard output: what is closed is nowhere, no letter is an error."""
    codecs.register_error(WRITTEN, _written)
    for name in ("stdout", "stderr"):
        stream = getattr(sys, name)
        if stream is None:
            setattr(sys, name, open(os.devnull, "w", encoding="utf-8"))  # noqa: SIM115
        elif isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors=WRITTEN)


def _written(error: UnicodeError) -> tuple[bytes, int]:
    """Letters that an encoding does not have, in those that every encoding has; bytes of file names as they are."""
    assert isinstance(error, UnicodeEncodeError)
    written = b""
    for letter in error.object[error.start : error.end]:
        plain = IN_ASCII.get(letter) or unicodedata.normalize("NFKD", letter).encode("ascii", "ignore").decode()
        if "\udc80" <= letter <= "\udcff":
            written += bytes([ord(letter) - 0xDC00])
        else:
            written += (plain or letter).encode("ascii", "backslashreplace")
    return written, error.end


def give_up(name: str) -> None:
    """Send what "stdout" or "stderr" has still to print nowhere; the interpreter would try again when it ends, and fail."""
    try:
        number = getattr(sys, name).fileno()
    except (OSError, ValueError):  # a test's own stream
        return
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, number)
    os.close(nowhere)
