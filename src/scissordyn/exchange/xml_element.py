"""Elements of an XML text with the bytes that they take, and the text of a model with its includes."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from xml.parsers import expat

from scissordyn.errors import InputError
from scissordyn.exchange.source import SIZE_MAX, decode, read_source

SAMPLE = "scissordyn import model.xml -o case.toml"

ELEMENTS_MAX = 200_000  # Elements of a text, used or not
DEPTH_MAX = 200  # Elements within each other
FILES_MAX = 100  # Files that a model includes
NAME_MAX = 60  # Characters of a name in a note
TEXT_MAX = 200  # Characters of the text of an element that are kept, such as the name of a link

START_TAG = re.compile(rb"""<[^"'>]*(?:"[^"]*"[^"'>]*|'[^']*'[^"'>]*)*>""")
LINE_BREAKS = bytes.maketrans(b"\r\n", b"  ")


@dataclass
class Element:
    """An element of the text and the bytes that it takes."""

    tag: str
    attributes: dict[str, str]
    line: int
    start: int
    inside: int  # First byte after its start tag
    close: int  # First byte of its end tag
    end: int = 0
    text: str = ""
    children: list[Element] = field(default_factory=list)

    @property
    def shown(self) -> str:
        name = self.attributes.get("name", "")[:NAME_MAX]
        return f"'{name}' (line {self.line})" if name else f"line {self.line}"

    def descendants(self) -> Iterator[Element]:
        """Yield the elements within it, in any order."""
        stack = list(self.children)
        while stack:
            element = stack.pop()
            stack += element.children
            yield element


def parse(content: bytes) -> Element:
    """The root of a text."""
    parser = expat.ParserCreate("utf-8")
    top = Element("", {}, 0, 0, 0, 0)
    open_elements, count = [top], [0]

    def start(tag: str, attributes: dict[str, str]) -> None:
        if len(open_elements) > DEPTH_MAX:
            raise InputError(f"line {parser.CurrentLineNumber} is within more than {DEPTH_MAX} elements", "fewer", SAMPLE)
        count[0] += 1
        if count[0] > ELEMENTS_MAX:
            raise InputError(f"a model of MuJoCo with more than {ELEMENTS_MAX} elements", "a smaller model", SAMPLE)
        first = parser.CurrentByteIndex
        tag_text = START_TAG.match(content, first)
        last = tag_text.end() if tag_text else first
        element = Element(tag, attributes, parser.CurrentLineNumber, first, last, last, last)
        open_elements[-1].children.append(element)
        open_elements.append(element)

    def end(tag: str) -> None:
        element = open_elements.pop()
        if content[element.inside - 2 : element.inside] != b"/>":
            element.close = parser.CurrentByteIndex
            element.end = content.index(b">", element.close) + 1

    def text(data: str) -> None:
        element = open_elements[-1]
        element.text += data[: TEXT_MAX - len(element.text)]

    def doctype(*_: object) -> None:
        raise InputError(f"line {parser.CurrentLineNumber} of the model declares a document type", "a model without it", SAMPLE)

    parser.buffer_text = True
    parser.StartElementHandler, parser.EndElementHandler, parser.CharacterDataHandler = start, end, text
    parser.StartDoctypeDeclHandler = doctype
    try:
        parser.Parse(content, True)
    except expat.ExpatError as error:
        raise InputError(f"no model of MuJoCo: {error}", "MJCF or URDF without further files", SAMPLE) from None
    return top.children[0]


def with_includes(text: str, folder: Path | None, notes: list[str]) -> str:
    """Return a model with the content of the files that it includes, each on the line of its element.

    The files are within a folder; without one an include is an error.
    """
    content = text.encode("utf-8", "replace")
    files: set[Path] = set()
    while found := [part for part in _mjcf_elements(content) if part.tag == "include"]:
        include = min(found, key=lambda part: part.start)
        name = include.attributes.get("file", "")
        path = _included(include, name, folder)
        if path in files:
            raise InputError(f"line {include.line}: '{name}' is included twice", "each file once, as MuJoCo demands", SAMPLE)
        if len(files) == FILES_MAX:
            raise InputError(f"line {include.line}: more than {FILES_MAX} files are included", "fewer", SAMPLE)
        files.add(path)
        inner, further = decode(read_source(path), path.suffix.lower())
        part = inner.encode("utf-8", "replace")
        root = parse(part)
        content = content[: include.start] + part[root.inside : root.close].translate(LINE_BREAKS) + content[include.end :]
        if len(content) > SIZE_MAX:
            raise InputError(f"a model with more than {SIZE_MAX // 2**20} MiB in its files", "a smaller model", SAMPLE)
        notes += [f"'{name}' (line {include.line}) is included", *further]
    return content.decode("utf-8")


def _mjcf_elements(content: bytes) -> Iterator[Element]:
    """The elements of a model in MJCF; none of a URDF, which has no includes."""
    root = parse(content)
    return root.descendants() if root.tag == "mujoco" else iter(())


def _included(include: Element, name: str, folder: Path | None) -> Path:
    """The file that an element includes."""
    if folder is None:
        raise further_file(include, "file")
    path = (folder / name).resolve()
    if not path.is_relative_to(folder.resolve()):
        raise InputError(f"line {include.line}: '{name}' is outside the folder of the model", "a file within it", SAMPLE)
    return path


def further_file(element: Element, name: str) -> InputError:
    """The error for an attribute that names a file."""
    return InputError(
        f"line {element.line}: <{element.tag} {name}='{element.attributes.get(name, '')[:NAME_MAX]}'> names a further file",
        "a model in one text, with masses",
        SAMPLE,
    )
