"""Parse XML elements with their byte ranges, and insert the files that a model includes."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from xml.parsers import expat

from scissordyn.annotation import SHOWN_LENGTH_MAX
from scissordyn.errors import InputError
from scissordyn.exchange.source import SIZE_MAX, decode, read_source

EXAMPLE = "scissordyn import model.xml -o case.toml"  # Correct import command, which error texts show

DEPTH_MAX = 200  # [levels] Largest nesting of XML elements in a model; each link of a chain is one level deeper

BODIES_MAX = 1_000  # Largest number of bodies in a model, with replicated ones; the matrices of a chain grow with the square

VALUE_MAX = 1e16  # Largest magnitude of a number in a model; SDF writes missing limits of a joint as 1e16

# Pattern of an XML start tag; quotes may contain ">"
START_TAG = re.compile(rb"""<[^"'>]*(?:"[^"]*"[^"'>]*|'[^']*'[^"'>]*)*>""")
LINE_BREAKS = bytes.maketrans(b"\r\n", b"  ")  # Translation table that replaces line breaks by blanks


@dataclass
class Element:
    """XML element with its byte range in the text."""

    tag: str
    attributes: dict[str, str]
    line: int
    start: int
    inside: int  # First byte after the start tag
    close: int  # First byte of the end tag
    end: int = 0
    text: str = ""
    children: list[Element] = field(default_factory=list)

    @property
    def shown(self) -> str:
        name = self.attributes.get("name", "")[:SHOWN_LENGTH_MAX]
        return f"'{name}' (line {self.line})" if name else f"line {self.line}"

    def descendants(self) -> Iterator[Element]:
        """Yield the elements inside this one, in any order."""
        stack = list(self.children)
        while stack:
            element = stack.pop()
            stack += element.children
            yield element


def parse(content: bytes) -> Element:
    """Parse an XML text and return its root element."""
    text_max = 200  # number of characters of an element's text that are kept
    elements_max = 200_000  # largest number of elements of a text
    parser = expat.ParserCreate("utf-8")
    top = Element("", {}, 0, 0, 0, 0)
    open_elements, count = [top], [0]

    def start(tag: str, attributes: dict[str, str]) -> None:
        if len(open_elements) > DEPTH_MAX:
            raise InputError(
                f"line {parser.CurrentLineNumber} is nested in more than {DEPTH_MAX} elements",
                f"at most {DEPTH_MAX} levels",
                EXAMPLE,
            )
        count[0] += 1
        if count[0] > elements_max:
            raise InputError(f"the model has more than {elements_max} elements", "a smaller model", EXAMPLE)
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
        element.text += data[: text_max - len(element.text)]

    def doctype(*_: object) -> None:
        raise InputError(
            f"line {parser.CurrentLineNumber} of the model declares a document type", "a model without it", EXAMPLE
        )

    parser.buffer_text = True
    parser.StartElementHandler, parser.EndElementHandler, parser.CharacterDataHandler = start, end, text
    parser.StartDoctypeDeclHandler = doctype
    try:
        parser.Parse(content, True)
    except expat.ExpatError as error:
        raise InputError(f"cannot read the model: {error}", "MJCF, URDF or SDF without further files", EXAMPLE) from None
    return top.children[0]


def with_includes(text: str, folder: Path | None, notes: list[str]) -> str:
    """Return the text of a model in which each include element is replaced by the content of its file, on the same line.

    All files must be inside `folder`; without a folder an include is an error. As in MuJoCo, a file name is relative to this
    folder, or else to the file that includes it.
    """
    files_max = 100  # largest number of included files
    content = text.encode("utf-8", "replace")
    files: set[Path] = set()
    regions: list[tuple[int, Path]] = []  # Number of bytes behind each included part that is open, and folder of its file
    while includes := [part for part in _mjcf_elements(content) if part.tag == "include"]:
        include = min(includes, key=lambda part: part.start)
        name = include.attributes.get("file", "")
        while regions and include.start >= len(content) - regions[-1][0]:
            regions.pop()
        path, found_in = _included(include, name, folder, regions[-1][1] if regions else folder)
        if path in files:
            raise InputError(f"line {include.line}: '{name}' is included twice", "each file once, as MuJoCo requires", EXAMPLE)
        if len(files) == files_max:
            raise InputError(f"line {include.line}: too many files are included", f"at most {files_max} files", EXAMPLE)
        files.add(path)
        inner, further = decode(read_source(path), path.suffix.lower())
        part = inner.encode("utf-8", "replace")
        root = parse(part)
        regions.append((len(content) - include.end, path.parent))
        content = content[: include.start] + part[root.inside : root.close].translate(LINE_BREAKS) + content[include.end :]
        if len(content) > SIZE_MAX:
            raise InputError(f"the files of the model have more than {SIZE_MAX // 2**20} MiB", "a smaller model", EXAMPLE)
        notes += [f"'{name}' (line {include.line}) is included{found_in}", *further]
    return content.decode("utf-8")


def _mjcf_elements(content: bytes) -> Iterator[Element]:
    """Return the elements of a model in MJCF; none for a URDF, which has no includes."""
    root = parse(content)
    return root.descendants() if root.tag == "mujoco" else iter(())


def _included(include: Element, name: str, folder: Path | None, including_folder: Path | None) -> tuple[Path, str]:
    """Return the path of an included file, and "" or, for a file next to the including file, " from 'path'" for notes."""
    if folder is None or including_folder is None:
        raise further_file(include, "file")
    # unlike those of `Path`, these functions accept any name and links in a circle
    root, in_folder, next_to_file = (
        Path(os.path.realpath(place)) for place in (folder, folder / name, including_folder / name)
    )
    is_in_folder, is_next_to_file = (
        place.is_relative_to(root) and os.path.isfile(place) for place in (in_folder, next_to_file)
    )
    if is_next_to_file and not is_in_folder:
        return next_to_file, f" from '{next_to_file.relative_to(root)}'"
    if not in_folder.is_relative_to(root):
        raise InputError(f"line {include.line}: '{name}' is outside the folder of the model", "a file within it", EXAMPLE)
    return in_folder, ""


def further_file(element: Element, name: str) -> InputError:
    """Return the error for an attribute that refers to another file."""
    target = element.attributes.get(name, "")[:SHOWN_LENGTH_MAX]
    return InputError(
        f"line {element.line}: <{element.tag} {name}='{target}'> refers to another file",
        "a model in one file, with masses",
        EXAMPLE,
    )


def number_text(*values: float) -> str:
    """Return numbers as the text of an XML attribute, with all digits."""
    return " ".join(repr(float(value)) for value in values)


def numbers(text: str, count: int, what: str) -> tuple[float, ...]:
    """Return the numbers in a text; raise `InputError`, which begins with `what`, if they are not `count` finite numbers."""
    try:
        values = tuple(map(float, text.split()))
    except ValueError:
        values = ()
    if len(values) != count or not all(abs(value) <= VALUE_MAX for value in values):
        expected = f"{count} number{'s' * (count > 1)} of at most {VALUE_MAX:g}"
        raise InputError(f"{what} = '{text.strip()[:SHOWN_LENGTH_MAX]}'", expected, EXAMPLE)
    return values


def child_of(element: Element, tag: str) -> Element | None:
    """Return the first child with a tag, or None."""
    return next((child for child in element.children if child.tag == tag), None)


def text_of(element: Element, tag: str, default: str = "") -> str:
    """Return the text of the first child with a tag, without blanks at its ends; `default` if there is no such child."""
    child = child_of(element, tag)
    return default if child is None else child.text.strip()


def value_of(element: Element, tag: str, default: float) -> float:
    """Return the number in the first child with a tag; `default` if there is no such child."""
    child = child_of(element, tag)
    return default if child is None else numbers(child.text, 1, f"line {child.line}: <{tag}>")[0]


def is_true(text: str) -> bool:
    """Return True if SDF reads a text as true: "true" or "1"."""
    return text.strip().lower() in ("true", "1")
