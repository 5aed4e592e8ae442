"""Numbers of pages: what a printed block shows against what a program prints, and where a number of the prose comes from."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass

UNIT_WORD = r"(?:[GMkmµn]?(?:N|J|W|Pa|Hz|s|m|g|rad)|deg|rpm|%|times|steps)(?:\^?\d|[²³])?"  # Pattern of a unit in a page
NUMBER = r"(?<![\w.^/{-])[-+]?\d+(?:[  ]\d{3})*(?:\.\d+)?(?:e[-+]?\d+)?"  # Pattern of a number in a page
# Pattern of a number with or without a unit
QUANTITY = re.compile(rf"({NUMBER})(?:\s+({UNIT_WORD}(?:[ /·]{UNIT_WORD})*)(?![\w^]))?")
PREFIXES = {"G": 9, "M": 6, "k": 3, "m": -3, "µ": -6, "n": -9}  # Exponents of ten of unit prefixes
BLOCK = re.compile(r"^ *```.*?^ *```", re.DOTALL | re.MULTILINE)  # Pattern of a code block in a page
RESULT_DIGITS = 2  # smallest number of significant digits with which a number with a unit counts as a result
CELL_DIGITS = 3  # smallest number of significant digits with which a number in a table counts as a result

SOURCE = re.compile(
    r"\]\([^)]*(?:decisions/|validation\.md|doi\.org)|doi:|\b(?:19|20)\d\d[,:)]"
    r"|`(?:pytest )?(?:tests|benchmarks)/|`python -m |Check by hand"
)
"""Pattern of the source of a section's numbers: a citation, a closed form with a test, or a program."""

WALL_TIME = re.compile(r"simulated in [\d.]+ (?:µs|ms|s|min)")
"""Pattern of the computing time of a run, which differs between machines."""

STEPS = re.compile(r"\d+ steps of (\w+), \d+ rejected")
"""Pattern of the number of steps of a run, which differs between processors by round-off."""

MARKER = re.compile(r"<!-- numbers: (.*?) -->")
"""Commands, tests or pages that give the numbers of a section, or of the page if it stands before the second heading."""


@dataclass(frozen=True)
class Quantity:
    """A number as it is printed, with its unit."""

    text: str
    unit: str

    @property
    def value(self) -> float:
        return float(re.sub(r"[  ](?=\d{3})", "", self.text))

    @property
    def digits(self) -> int:
        """Number of significant digits; zeros at the end of an integer do not count."""
        whole = re.sub(r"[  +-]", "", self.text.partition("e")[0])
        figures = whole.replace(".", "") if "." in whole else whole.rstrip("0")
        return len(figures.lstrip("0"))

    @property
    def scaled(self) -> tuple[float, str]:
        """Value and unit without the prefix of the unit."""
        first = re.match(r"([GMkmµn])(?=N|J|W|Pa|Hz|s|m|rad)", self.unit)
        unit = self.unit.translate(str.maketrans({"²": "2", "³": "3", "^": None, "·": " "}))
        return (self.value * 10.0 ** PREFIXES[first[1]], unit[1:]) if first else (self.value, unit)

    def shows(self, other: Quantity) -> bool:
        """Return whether this is another number, rounded to this one's digits; without a unit, any metric prefix is allowed."""
        (value, unit), (found, its_unit) = self.scaled, other.scaled
        if unit and its_unit:
            return unit == its_unit and self._rounds(value, found)
        return any(self._rounds(abs(self.value), abs(other.value) * 10.0**k) for k in (0, -9, -6, -3, 3, 6, 9, 2, -2))

    def _rounds(self, value: float, found: float) -> bool:
        scale = abs(value / self.value) if self.value else 1.0
        return abs(value - found) <= 0.5000001 * scale * last_digit(self.text)


def last_digit(text: str) -> float:
    """Return the value of one unit of the last digit of a printed number."""
    mantissa, _, exponent = text.partition("e")
    return 10.0 ** (int(exponent or 0) - len(mantissa.partition(".")[2]))


def quantities(text: str) -> list[Quantity]:
    return [Quantity(number, unit or "") for number, unit in QUANTITY.findall(text)]


def sections(page: str) -> list[str]:
    """Return the sections of a page without its generated tables; the first one begins with its title."""
    page = re.sub(r"<!-- made.*?<!-- end -->", "", page, flags=re.DOTALL)
    page = BLOCK.sub(lambda block: re.sub(r"^#", " #", block[0], flags=re.MULTILINE), page)
    return [section for section in re.split(r"^(?=#)", page, flags=re.MULTILINE) if section.strip()]


def results(section: str) -> list[Quantity]:
    """Return the numbers of prose and tables that look like results."""
    prose = re.sub(r"\$\$.*?\$\$|<!--.*?-->", "", BLOCK.sub("", section), flags=re.DOTALL)
    prose = re.sub(r"`[^`]*`|\]\([^)]*\)|95 %", " ", prose)  # 95 % is the usual confidence
    found = [one for one in quantities(prose) if one.unit and one.digits >= RESULT_DIGITS]
    cells = [cell for line in prose.splitlines() if line.startswith("|") for cell in line.split("|")]
    bare = (one for cell in cells if re.fullmatch(r"[\s\d.,e+-]+", cell) for one in quantities(cell))
    return found + [one for one in bare if one.digits >= CELL_DIGITS]


def code(text: str) -> str:
    """Return the blocks and spans of code of a text."""
    blocks = (block[0] for block in BLOCK.finditer(text))
    return "\n".join([*blocks, *re.findall(r"`[^`]*`", BLOCK.sub("", text))])


def marked(section: str) -> list[str]:
    """Return the commands, tests and pages of the markers of a section."""
    return [one.strip() for marker in MARKER.findall(section) for one in marker.split(" ; ")]


def without_evidence(page: str, printed: Iterable[str] | None = None) -> list[str]:
    """Return the results of a page that are neither in its code nor printed, in sections that name no source.

    `printed` is what the commands of the page and of its markers print. Without it, commands in markers count as sources.
    """
    evidence = quantities("\n".join([code(page), *(printed or ())]))
    first, *others = sections(page)
    missing = []
    for section in (first, *others):
        sources = [one for one in marked(first) + marked(section) if printed is None or not one.startswith("scissordyn ")]
        if SOURCE.search(section) or sources:
            continue
        missing += [one for one in results(section) if not any(one.shows(other) for other in evidence)]
    return [f"{one.text} {one.unit}".strip() for one in missing]


# Pattern of a code block that a reader types
TYPED = re.compile(r"^( *)```(sh|console|python|toml|\{code-cell\} ipython3)\n(.*?)^ *```\n", re.DOTALL | re.MULTILINE)
# Pattern of the printed output after a code block
PRINTED = re.compile(r"\s*(?:(?!```)[^\n#|][^\n]*\n)*\s*```text\n(.*?)^ *```", re.DOTALL | re.MULTILINE)


@dataclass(frozen=True)
class Block:
    """Block of a page that a reader types, and what it prints."""

    language: str  # "sh", "console", "python" or "toml"
    code: str
    printed: str  # Text that follows at once, or after a paragraph that ends with a colon; "" if none does


def typed_blocks(page: str) -> list[Block]:
    """Return the blocks of files, Python and commands of a page, in their order."""
    found = []
    for block in TYPED.finditer(page):
        indent, language, code = block.groups()
        code = re.sub(rf"^{indent}", "", code, flags=re.MULTILINE)
        after = PRINTED.match(page, block.end())
        between = after[0].partition("```")[0].strip() if after else ""
        printed = after[1] if after and (not between or between.endswith(":")) else ""
        if language == "console":
            printed = "".join(line for line in code.splitlines(keepends=True) if not line.startswith("$ "))
        if "code-cell" in language:
            language, code = "python", re.sub(r"^:.*\n", "", code, flags=re.MULTILINE)
        found.append(Block(language, code, printed))
    return found


def differing(shown: str, printed: str) -> list[str]:
    """Return the parts of a printed block, between dots that stand alone, that a program does not print to the digits shown."""
    return [part for part in re.split(r"(?<!\S)\.\.\.(?!\S)", shown) if part.strip() and not _within(part, printed)]


def _within(part: str, printed: str) -> bool:
    plain = (STEPS.sub(r"steps of \1", WALL_TIME.sub("simulated in a while", text)) for text in (part, printed))
    wanted, words = (re.sub("─+", "─", text).split() for text in plain)
    return any(
        all(_same(one, other) for one, other in zip(wanted, words[start : start + len(wanted)], strict=False))
        for start in range(len(words) - len(wanted) + 1)
    )


def _same(shown: str, printed: str) -> bool:
    """Return whether two words are equal; numbers in them may differ by one unit of the last digit."""
    if re.sub(NUMBER, "#", shown) != re.sub(NUMBER, "#", printed):
        return False
    pairs = zip(re.findall(NUMBER, shown), re.findall(NUMBER, printed), strict=True)
    return all(abs(float(one) - float(other)) <= 1.0001 * last_digit(one) for one, other in pairs)
