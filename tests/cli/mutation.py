"""Case files with slips: the examples with lines lost, doubled and swapped, and values exchanged for unfit ones."""

from __future__ import annotations

import math
import random
import re
from collections.abc import Iterator
from pathlib import Path

EXAMPLES = Path(__file__).parents[2] / "examples"

NUMBERS = (
    *("0", "-0.0", "1e308", "-1e308", "5e-324", "1e-308", "nan", "inf", "-inf", "1e999", "-1", "0.5", "3", "1e30", "1e-30"),
    *("9" * 400, "9" * 5000, "0x7fffffffffffffff", "0b1", "1_000", "100000", "1e12", "1e-12"),
)
"""Numbers that a file may hold."""

UNITS = (
    *("m", "mm", "kg", "s", "rad", "deg", "rpm", "N", "m/0", "m^-9", "m**m", "", "furlong", "m m", "Hz", "1/s", "N m", "%"),
    *("m/", "m/(s-s)", "m^0.5"),
)

VALUES = (
    *("true", '""', '"\\u0000"', '"[/red]"', '"$\\\\frac{$"', '"none"', '"ground"', '"ground.O"', '"a.b.c"', "[]", "{}"),
    *("[[]]", "[{}]", "[1, 2]", '["1 m", "2 m"]', "{ law = 3 }", '{ law = "liu", x = 1 }', "{ law = [] }", "{ kind = [] }"),
    *("[[[[1]]]]", "1979-05-27", "07:32:00", '"my.py:f"', '"*"', '"all"', "[" * 40 + "]" * 40, "[" * 1200 + "]" * 1200),
    *('"' + "x" * 3000 + '"', '"1, 2 m"', '"0, 0 m"', "{ time = [], angle = [] }", '{ time = "0 1 s", angle = "0 1 deg" }'),
)
"""Values of other kinds."""

LINES = (
    *("[run]", "[[clearance]]", "[structure]", "[[body]]", "[[spring]]", "[[drive]]", "[drive.x]", "= 3", "a = "),
    *("\ufeff", "\x00"),
)

ENTRY = re.compile(r"^(\s*[\w.-]+\s*=\s*)([^\n#]*)", re.MULTILINE)
UNITS_KEY = re.compile(r"\bunits = (\d[\d_]*)")
MOST_UNITS = 40  # A larger array that can be computed takes its time and shows nothing new

INNER = re.compile(r'([\w-]+ = )("[^"\n]*"|[-\w.]+)')


def _value(chance: random.Random) -> str:
    kind = chance.random()
    if kind < 0.3:
        return chance.choice(NUMBERS)
    if kind < 0.7:
        return f'"{chance.choice(NUMBERS)} {chance.choice(UNITS)}"'
    return chance.choice(VALUES)


def _scaled(number: str, chance: random.Random) -> str:
    """Another number of any size, zero or of the other sign now and then; a whole one stays whole."""
    factor = chance.choice((-1.0, 0.0, 0.5, 2.0, 10.0 ** chance.randint(-14, 14), 10.0 ** chance.uniform(-3.0, 3.0)))
    scaled = float(number) * factor
    broken = "." in number or chance.random() < 0.5 or not math.isfinite(scaled)
    return repr(scaled if broken else int(scaled))


def _number(found: str, chance: random.Random) -> str:
    """The value with another number and its own unit."""
    numbers = list(re.finditer(r"[-+]?\d+\.?\d*", found))
    if not numbers:
        return _value(chance)
    one = chance.choice(numbers)
    if chance.random() < 0.8:
        return found[: one.start()] + _scaled(one[0], chance) + found[one.end() :]
    return found[: one.start()] + chance.choice(NUMBERS) + found[one.end() :]


def _mutated(text: str, others: list[str], chance: random.Random) -> str:
    """One slip."""
    kind, lines = chance.random(), text.split("\n")
    at = chance.randrange(len(lines))
    if kind < 0.85:
        pattern = ENTRY if chance.random() < 0.7 else INNER
        found = list(pattern.finditer(text))
        if not found:
            return text + chance.choice(LINES)
        one = chance.choice(found)
        new = _number(one[2], chance) if chance.random() < 0.8 else _value(chance)
        return text[: one.start(2)] + new + text[one.end(2) :]
    if kind < 0.87:
        return "\n".join(lines[:at] + lines[at + 1 :])
    if kind < 0.90:
        return "\n".join(lines[: at + 1] + lines[at:])
    if kind < 0.92:
        return "\n".join([*lines[:at], chance.choice(LINES), *lines[at:]])
    if kind < 0.92:
        return "\n".join([*lines[:at], *chance.choice(others).split("\n")[at : at + 4], *lines[at:]])
    if kind < 0.95:
        place = chance.randrange(len(text))
        return text[:place]
    place = chance.randrange(len(text))
    return text[:place] + chr(chance.choice((0, 27, 34, 39, 91, 93, 123, 125, 61, 0x202E, 0xFFFF))) + text[place + 1 :]


def mutated_cases(count: int, seed: int = 1) -> Iterator[str]:
    """Texts of case files, each with one to three slips; the same for the same seed.

    Parameters
    ----------
    count, seed : int
    """
    chance = random.Random(seed)
    texts = [path.read_text(encoding="utf-8") for path in sorted(EXAMPLES.glob("*.toml")) if path.name != "long.toml"]
    made = 0
    while made < count:
        text = chance.choice(texts)
        for _ in range(chance.choice((1, 1, 2, 3))):
            text = _mutated(text, texts, chance)
        if not any(MOST_UNITS < float(units.replace("_", "")) < 1e6 for units in UNITS_KEY.findall(text)):
            made += 1
            yield text


FACTORS = (0.0, -1.0, 0.01, 0.1, 0.5, 0.9, 1.1, 2.0, 10.0, 1000.0)
PLAIN_NUMBER = re.compile(r"(?<![\w.])[-+]?\d+\.?\d*(?:[eE][-+]?\d+)?")
OTHER_VALUES = {
    "start": ("run", ("concentric", "in-contact", "static", "as-placed")),
    "events": ("run", ("located", "crossed")),
    "method": ("run", ("rodas5p", "dop853")),
    "contact": ("clearance", ("hard", "compliant")),
    "driven_bar": ("structure", ("pinned", "slider")),
}
"""Words of some keys, with their tables."""


def _altered(text: str, chance: random.Random) -> str:
    """One number times a factor, one table less or twice, or another word: a file that may well be meant."""
    kind, tables = chance.random(), re.split(r"(?m)^(?=\[)", text)
    if kind < 0.7:
        entry = chance.choice([place for place in ENTRY.finditer(text) if PLAIN_NUMBER.search(place[2])])
        number = chance.choice(list(PLAIN_NUMBER.finditer(entry[2])))
        value = float(number[0]) * chance.choice(FACTORS)
        written = str(int(value)) if "." not in number[0] and value == int(value) else f"{value:.12g}"
        return text[: entry.start(2)] + entry[2][: number.start()] + written + entry[2][number.end() :] + text[entry.end(2) :]
    at = chance.randrange(1, len(tables))
    if kind < 0.85:
        return "".join(tables[:at] + tables[at : at + 1] * (2 if kind > 0.8 else 0) + tables[at + 1 :])
    key = chance.choice(list(OTHER_VALUES))
    table, words = OTHER_VALUES[key]
    line = f'{key} = "{chance.choice(words)}"\n'
    if re.search(rf"(?m)^{key}\s*=", text):
        return re.sub(rf"(?m)^{key}\s*=.*\n", lambda _: line, text)
    return re.sub(rf"(?m)^(\[\[?{table}\]\]?[^\n]*\n)", lambda head: head[1] + line, text, count=1)


def altered_cases(count: int, seed: int = 1) -> Iterator[str]:
    """Texts of case files that differ from an example in one number, table or word; the same for the same seed."""
    chance = random.Random(seed)
    texts = [path.read_text(encoding="utf-8") for path in sorted(EXAMPLES.glob("*.toml")) if path.name != "long.toml"]
    for _ in range(count):
        yield _altered(chance.choice(texts), chance)
