"""Read files of other programs: check their size and decode their text."""

from __future__ import annotations

import codecs
import re
import stat
from collections.abc import Iterable
from pathlib import Path

from scissordyn.errors import InputError
from scissordyn.lookup import library

POINTS_MAX = 10_000  # Largest number of points in an imported table or drawing; a larger mechanism takes minutes to simulate
SIZE_MAX = 16 * 2**20  # [bytes] Largest total size of an imported model's files; a DXF of this size takes about 20 s and 350 MB

BYTE_ORDER_MARKS = (  # First bytes of a file, and encoding
    (codecs.BOM_UTF8, "utf-8-sig"),
    (codecs.BOM_UTF32_LE, "utf-32"),  # before UTF-16, because its mark begins with that of UTF-16
    (codecs.BOM_UTF32_BE, "utf-32"),
    (codecs.BOM_UTF16_LE, "utf-16"),
    (codecs.BOM_UTF16_BE, "utf-16"),
)

SOLVESPACE_MARK = b"\xb1\xb2\xb3"  # First bytes of a SolveSpace file, before its text

# Pattern of the encoding in an XML declaration
XML_ENCODING = re.compile(rb"""\A\s*<\?xml[^>]{0,200}?encoding\s*=\s*["']([\w.:-]{1,40})["']""")
DXF_VERSION = re.compile(rb"\$ACADVER\s+1\s+AC(\d{4})\b")  # Pattern of the format version in a DXF
DXF_CODEPAGE = re.compile(rb"\$DWGCODEPAGE\s+3\s+(\w{1,40})")  # Pattern of the code page in a DXF

UNSUPPORTED_FILES = (
    (b"AutoCAD Binary DXF", "a binary DXF", "a DXF in ASCII"),
    (b"AC10", "a DWG", "a drawing in DXF"),
    (b"PK\x03\x04", "a workbook or a ZIP archive", "the file in it, or a sheet saved as .csv"),
    (b"\x89HDF", "a saved run, in NetCDF", "a drawing, a model or a table"),
)
"""Files that cannot be imported: first bytes, kind of file, and expected kind of file in the error message."""


def listed(texts: Iterable[str], most: int = 5) -> str:
    """Return the first `most` texts and the number of further ones."""
    names = list(texts)
    return ", ".join(names[:most]) + (f" and {len(names) - most} more" if len(names) > most else "")


def read_source(path: Path) -> bytes:
    """Return the content of a file of at most `SIZE_MAX` bytes."""
    sample = "scissordyn import linkage.dxf"
    try:
        if not stat.S_ISREG(path.stat().st_mode):
            kind = "a folder" if path.is_dir() else "not a regular file"
            raise InputError(f"cannot read '{path}': it is {kind}", "a file or a link", sample)
        with path.open("rb") as file:
            content = file.read(SIZE_MAX + 1)
    except InputError:
        raise
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise InputError(f"cannot read '{path}': {reason}", "a file or a link", sample) from None
    if len(content) > SIZE_MAX:
        raise InputError(f"'{path}' has more than {SIZE_MAX // 2**20} MiB", "a smaller file with only the linkage", sample)
    for start, what, expected in UNSUPPORTED_FILES:
        if content.startswith(start):
            raise InputError(f"'{path}' is {what}", expected, sample)
    return content


def decode(content: bytes, ending: str) -> tuple[str, list[str]]:
    """Return the text of a file, and a note if its encoding was assumed."""
    for mark, encoding in BYTE_ORDER_MARKS:
        if content.startswith(mark):
            return _decode(content, encoding), []
    if content[1:2] == b"\0" or content[:1] == b"\0":
        return _decode(content, "utf-16-be" if content[:1] == b"\0" else "utf-16-le"), []
    if ending == ".dxf":
        return _decode_dxf(content), []
    content = content.removeprefix(SOLVESPACE_MARK)
    declared = XML_ENCODING.match(content)
    if declared and ending not in (".csv", ".tsv"):
        return _decode(content, declared[1].decode()), []
    try:
        return content.decode("utf-8"), []
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
    try:
        return content.decode("cp1252"), [f"text: line {line} is not UTF-8; the file is read as Windows-1252 (Latin-1)"]
    except UnicodeDecodeError:
        return content.decode("latin-1"), [f"text: line {line} is not UTF-8; the file is read as Latin-1"]


def _decode(content: bytes, encoding: str) -> str:
    try:
        return content.decode(encoding)
    except LookupError:
        raise InputError(f"unknown encoding '{encoding}' of the file", "UTF-8, UTF-16 or Latin-1") from None
    except UnicodeDecodeError as error:
        raise InputError(
            f"byte {error.start} is not valid {encoding}, the encoding that the file declares", "a text in UTF-8"
        ) from None


def _decode_dxf(content: bytes) -> str:
    """Return the text of a DXF: in UTF-8, or before AutoCAD 2007 in the code page that it names."""
    utf8_version = 1021  # AC1021 is the first version whose text is always UTF-8
    version, page = DXF_VERSION.search(content), DXF_CODEPAGE.search(content)
    encoding = "utf-8"
    if version and int(version[1]) < utf8_version:
        pages = library("ezdxf.tools.codepage", "exchange", "DXF")
        encoding = pages.toencoding(page[1].decode()) if page else "cp1252"
    return content.decode(encoding, errors="surrogateescape")
