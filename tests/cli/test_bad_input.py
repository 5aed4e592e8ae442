"""Unfit case files and saved files: one line and status 2, whatever they hold."""

import itertools
import math
import random
import re
from collections.abc import Callable
from pathlib import Path

import pytest
from tests.build import copy_with_attribute, write_as_other

import scissordyn as sd
from scissordyn.cli.main import status_of

EXAMPLES = Path(__file__).parents[2] / "examples"  # Folder of the package's example cases
# Numbers of damaged cases: in every test run, in all slow tests, and in each of the slow tests
QUICK_CASES, ALL, BLOCK = 30, 2000, 100
SHORT = ("--set", "run.most_steps=2000", "--samples", "5")  # Options that end a run of any case file within a second

# Smallest case file that runs
SMALLEST_CASE = '[structure]\nkind = "scissor"\n[drive]\nspeed = "1 rpm"\n[run]\nuntil = "1 ms"\n'
# Table of a clearance joint, to be appended to a case file
CLEARANCE_TABLE = '[[clearance]]\njoint = "A"\nclearance = "0.5 mm"\n'


NUMBERS = (
    *("0", "-0.0", "1e308", "-1e308", "5e-324", "1e-308", "nan", "inf", "-inf", "1e999", "-1", "0.5", "3", "1e30", "1e-30"),
    *("9" * 400, "9" * 5000, "0x7fffffffffffffff", "0b1", "1_000", "100000", "1e12", "1e-12"),
)
"""Numbers, right and wrong, that replace a number of a case file."""

# Units, right and wrong, that replace a unit of a case file
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
"""TOML values of other types, which replace a value of a case file."""

# Lines, most of them wrong, that are inserted into a case file
LINES = (
    *("[run]", "[[clearance]]", "[structure]", "[[body]]", "[[spring]]", "[[drive]]", "[drive.x]", "= 3", "a = "),
    *("\ufeff", "\x00"),
)

ENTRY = re.compile(r"^(\s*[\w.-]+\s*=\s*)([^\n#]*)", re.MULTILINE)  # Pattern of a line "key = value"
UNITS_KEY = re.compile(r"\bunits = (\d[\d_]*)")  # Pattern of the key `units`, the number of scissor units
UNITS_MAX = 40  # Largest number of scissor units in a damaged case; larger arrays only take longer

INLINE_ENTRY = re.compile(r'([\w-]+ = )("[^"\n]*"|[-\w.]+)')  # Pattern of an entry of an inline table: key and value


def _value(chance):
    kind = chance.random()
    if kind < 0.3:
        return chance.choice(NUMBERS)
    if kind < 0.7:
        return f'"{chance.choice(NUMBERS)} {chance.choice(UNITS)}"'
    return chance.choice(VALUES)


def _scaled(number, chance):
    """Return another number of random size, sometimes zero or with the opposite sign; an integer is replaced by an integer."""
    factor = chance.choice((-1.0, 0.0, 0.5, 2.0, 10.0 ** chance.randint(-14, 14), 10.0 ** chance.uniform(-3.0, 3.0)))
    scaled = float(number) * factor
    broken = "." in number or chance.random() < 0.5 or not math.isfinite(scaled)
    return repr(scaled if broken else int(scaled))


def _number(found, chance):
    """Return a value with its number replaced and its unit unchanged."""
    numbers = list(re.finditer(r"[-+]?\d+\.?\d*", found))
    if not numbers:
        return _value(chance)
    one = chance.choice(numbers)
    if chance.random() < 0.8:
        return found[: one.start()] + _scaled(one[0], chance) + found[one.end() :]
    return found[: one.start()] + chance.choice(NUMBERS) + found[one.end() :]


def _mutated(text, chance):
    """Return the text with one random mistake."""
    kind, lines = chance.random(), text.split("\n")
    at = chance.randrange(len(lines))
    if kind < 0.85:
        pattern = ENTRY if chance.random() < 0.7 else INLINE_ENTRY
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
    place = chance.randrange(len(text))
    if kind < 0.95:
        return text[:place]
    return text[:place] + chr(chance.choice((0, 27, 34, 39, 91, 93, 123, 125, 61, 0x202E, 0xFFFF))) + text[place + 1 :]


def _examples():
    return [path.read_text(encoding="utf-8") for path in sorted(EXAMPLES.glob("*.toml")) if path.name != "long.toml"]


def mutated_cases(count, seed=1):
    """Yield texts of case files, each with one to three random mistakes; equal seeds give equal texts."""
    chance = random.Random(seed)
    texts = _examples()
    made = 0
    while made < count:
        text = chance.choice(texts)
        for _ in range(chance.choice((1, 1, 2, 3))):
            text = _mutated(text, chance)
        if not any(UNITS_MAX < float(units.replace("_", "")) < 1e6 for units in UNITS_KEY.findall(text)):
            made += 1
            yield text


FACTORS = (0.0, -1.0, 0.01, 0.1, 0.5, 0.9, 1.1, 2.0, 10.0, 1000.0)  # Factors by which a number of a case file is multiplied
PLAIN_NUMBER = re.compile(r"(?<![\w.])[-+]?\d+\.?\d*(?:[eE][-+]?\d+)?")  # Pattern of a number without its unit
OTHER_VALUES = {
    "start": ("run", ("concentric", "in-contact", "static", "as-placed")),
    "events": ("run", ("located", "crossed")),
    "method": ("run", ("rodas5p", "dop853")),
    "contact": ("clearance", ("hard", "compliant")),
    "driven_bar": ("structure", ("pinned", "slider")),
}
"""Allowed words of some keys, with the table of each key."""


def _altered(text, chance):
    """Return the text with one number scaled, one table removed or doubled, or one word replaced; the file is plausible."""
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


def altered_cases(count, seed=1):
    """Yield texts of case files that differ from an example in one number, table or word; equal seeds give equal texts."""
    chance = random.Random(seed)
    texts = _examples()
    for _ in range(count):
        yield _altered(chance.choice(texts), chance)


Said = Callable[..., tuple[int, str]]


def tried(said, folder, texts):
    """Run case files and return the statuses; check that `check` accepts and refuses the same files as `run`."""
    statuses = []
    for number, text in enumerate(texts):
        (folder / "case.toml").write_text(text, encoding="utf-8", errors="surrogatepass")
        try:
            checked, _ = said("check", "case.toml")
            status, line = said("run", "case.toml", *SHORT)
            assert (checked == 2) == (status == 2), f"check ends with {checked}, run with {status}: {line}"
        except AssertionError as error:
            raise AssertionError(f"case {number}: {error}\n{text}") from None
        statuses.append(status)
    return statuses


def test_mutated_case_files(folder, said):
    """Contract: files with slips run, or are refused or fail in one line; some do each."""
    assert {0, 2, 3} <= set(tried(said, folder, mutated_cases(QUICK_CASES)))


@pytest.mark.slow
@pytest.mark.parametrize("first", range(QUICK_CASES, ALL, BLOCK))
def test_all_mutated_case_files(folder, said, first):
    """Contract: as above, for the rest of 2000 files."""
    assert 2 in tried(said, folder, itertools.islice(mutated_cases(ALL), first, min(first + BLOCK, ALL)))


@pytest.mark.slow
@pytest.mark.parametrize("first", range(0, 420, 70))
def test_altered_case_files(folder, said, first):
    """Identity: check agrees with run on examples in which a number, a table or a word is another one; most can be run."""
    statuses = tried(said, folder, itertools.islice(altered_cases(420), first, first + 70))
    assert statuses.count(2) < 35


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("x = " + "[" * 1000 + "]" * 1000, "nested"),
        ("x = " + "[" * 60 + "]" * 60, "lists more than 32 levels deep"),
        ("x = " + "{ y = " * 500 + "1" + " }" * 500, "nested"),
        (SMALLEST_CASE.replace('"1 ms"', "9" * 5000), "a number of thousands of digits"),
        (SMALLEST_CASE.replace('"1 ms"', "9" * 4000), "a number of hundreds of digits: out of bounds"),
        (SMALLEST_CASE + "samples = " + "9" * 4000 + "\n", "run.samples"),
        (SMALLEST_CASE.replace("1 ms", "1 m/0"), "is not a unit"),
        (SMALLEST_CASE.replace("1 ms", "1e-308 s"), "run.until = \"1e-308 s\": out of bounds; expected a number from 1e-12"),
        (SMALLEST_CASE.replace('"scissor"', '["scissor"]'), "unknown kind of structure"),
        (SMALLEST_CASE.replace('"scissor"', '{ a = "scissor" }'), "unknown kind of structure"),
        (SMALLEST_CASE + CLEARANCE_TABLE + "material = []\n", "unknown material"),
        (SMALLEST_CASE + CLEARANCE_TABLE + 'stiffness = { law = ["liu"] }\n', "the stiffness law has no name"),
        (SMALLEST_CASE + CLEARANCE_TABLE + 'journal_radius = "1e308 m"\n', "to 1e+06 [m]"),
        (SMALLEST_CASE + CLEARANCE_TABLE + 'friction = { law = "ambrosio", kinetic = 1e308 }\n', "to 10"),
        (SMALLEST_CASE.replace("[drive]", 'bar_mass = "5e-324 kg"\n[drive]'), "from 1e-12 to 1e+09 [kg]"),
        (SMALLEST_CASE.replace("[drive]", 'gravity = "1e300 m/s^2"\n[drive]'), "to 1e+06 [m/s^2]"),
        (SMALLEST_CASE.replace('speed = "1 rpm"', 'speed = "1e200 rpm"'), "to 1e+07 [rad/s]"),
        (
            SMALLEST_CASE.replace('speed = "1 rpm"', 'table = { time = "0 1 2 3 4 5 us", angle = "30 31 32 33 34 35 deg" }'),
            "tabulated from 0 s to 5e-06 s",
        ),
        (
            SMALLEST_CASE + '[[force]]\nname = "f"\npoint = "slider.centre"\nforce = "1, 0 N"\n'
            'time_function = { table = { time = "0 1 2 3 4 5 us", factor = [0, 1, 2, 3, 4, 5] } }\n',
            "a time function of 'f' is tabulated from 0 s to 5e-06 s",
        ),
    ],
)  # fmt: skip
def test_extreme_files_are_refused(folder, said, text, says):
    """Limit: nesting, numbers and units beyond reason, and tables that end before the run; `check` finds them as `run` does."""
    (folder / "case.toml").write_text(text)
    for command in ("check", "run"):
        status, error = said(command, "case.toml")
        assert status == 2
        assert says in error


# Values of the attribute `configuration` that no run has
MALFORMED = (None, "", "{", "[]", "3", "null", '{"mechanism": 3}', '{"mechanism": {}, "options": []}', 7)


@pytest.fixture(scope="module")
def saved(tmp_path_factory):
    """Return the path of a saved run."""
    path = tmp_path_factory.mktemp("saved") / "run.nc"
    arguments = ["run", str(EXAMPLES / "paper.toml"), "-o", str(path), "--samples", "3", "--set", "run.until=0.1 ms"]
    assert status_of(arguments) == 0
    return path


@pytest.fixture(scope="module")
def diagram(tmp_path_factory):
    """Return the path of a saved bifurcation diagram that the arguments `SCAN` continue."""
    path = tmp_path_factory.mktemp("diagram") / "diagram.nc"
    assert status_of(["bifurcation", *SCAN, "-o", str(path)]) == 0
    return path


# Arguments of a short bifurcation diagram of two values
SCAN = (
    *(str(EXAMPLES / "periodic.toml"), "--over", "drive.angular_frequency", "--from", "3 Hz", "--to", "3.1 Hz"),
    *("--values", "2", "--cycles", "1", "--threads", "1"),
)


@pytest.mark.parametrize(("name", "value"), [("title", None), *(("configuration", value) for value in MALFORMED)])
def test_saved_runs_with_other_attributes_are_refused(saved, folder, said, name, value):
    """Contract: an attribute that a saved run needs is named in one line if it is missing or holds something else."""
    copy_with_attribute(saved, folder / "other.nc", name, value)
    status, error = said("run", "other.nc")
    assert status == 2
    assert "other.nc" in error or "attribute" in error or "mechanism" in error or "options" in error


@pytest.mark.parametrize("lost", ["status", "cause", "completed_cycles", "slider_velocity", "value", "joint", "cycle"])
def test_diagrams_that_are_not_whole_are_refused(diagram, folder, said, lost):
    """Contract: a store without one of its variables is named, and left as it is."""
    write_as_other(sd.load(diagram).drop_vars(lost), "other.nc")
    before = Path("other.nc").read_bytes()
    status, error = said("bifurcation", *SCAN, "-o", "other.nc")
    assert status == 2
    assert "other.nc" in error
    assert Path("other.nc").read_bytes() == before


@pytest.mark.parametrize("name", ["title", "status", "configuration", "versions", "parameter", "phase", "cycles"])
def test_diagrams_with_other_attributes_are_refused_or_mended(diagram, folder, said, name):
    """Contract: an attribute that is missing or of another type is no fault of the program."""
    for value in (None, 3, "nonsense"):
        copy_with_attribute(diagram, folder / "other.nc", name, value)
        status, _ = said("bifurcation", *SCAN, "-o", "other.nc")
        assert status in (0, 2)


@pytest.mark.parametrize("value", [None, "soon", [1.0, 2.0]])
def test_cycles_with_other_attributes_are_refused(folder, value):
    """Contract: a run of cycles cannot be continued without its period, and says so."""
    mechanism = sd.read_case(EXAMPLES / "periodic.toml").mechanism
    run = sd.cycle(mechanism, cycles=1)
    run.attrs.pop("period") if value is None else run.attrs.update(period=value)
    with pytest.raises(sd.InputError, match="attribute 'period'"):
        sd.cycle(mechanism, cycles=1, start=run)


def test_the_drawn_variable_is_checked_first(folder, said, monkeypatch):
    """Contract: an unknown name is refused before anything is computed, and so is a parameter that cannot be varied."""
    monkeypatch.setattr("scissordyn.periodic.bifurcation.bifurcation", None)
    status, error = said("bifurcation", *SCAN, "--variable", "nope", "--plot", "x.png")
    assert status == 2
    assert "--variable 'nope'" in error
    assert "slider_velocity" in error
    crank = [word if word != "drive.angular_frequency" else "structure.crank" for word in SCAN]
    status, error = said("bifurcation", *crank)
    assert status == 2
    assert "no part 'structure' for 'structure.crank'; expected one of O, A, " in error
    assert "gravity" in error
