"""Read, change and write case files, and find the folder of the package's examples."""

from __future__ import annotations

import copy
import os
import re
import tomllib
from collections.abc import Iterable, Iterator, Mapping, Set
from contextlib import contextmanager
from dataclasses import replace
from difflib import get_close_matches
from pathlib import Path
from typing import Any

from scissordyn.casefile.case import Case, CaseTable
from scissordyn.casefile.case_text import FIRST_LINE, case_text
from scissordyn.casefile.code import Code
from scissordyn.casefile.quantity import read_quantity
from scissordyn.casefile.table import Context, PlacedError, example_text, instance
from scissordyn.casefile.text import NESTING_MAX, line_of, place_of_name, place_text, read_text, table_name, value_at
from scissordyn.errors import InputError, command, did_you_mean
from scissordyn.file.output_file import OTHER_ENDINGS, check_target, write_file
from scissordyn.model.mechanism import Mechanism
from scissordyn.model.options import Options
from scissordyn.model.parameter_path import FIELD_OF_KIND, number
from scissordyn.model.section import with_dimension
from scissordyn.run.inverse_dynamics import feed_forward
from scissordyn.units import Quantity, checked

WRITE_EXAMPLE = "write_case(arm, 'arm.toml')"  # Correct call, which error texts show

UNQUOTED = re.compile(r"\s*(?P<key>[\w-]+)\s*[=:]\s*\"?(?P<value>(?:[+-]?[\d.]+\s*)?[a-zA-Z°µ][^\"#{\[]*)\"?\s*(#.*)?")
"""Wrong TOML line: text or quantity without quotes or with one quote, or a colon instead of an equals sign."""

REPEATED = "is repeated"  # last words of errors about a key or table that occurs twice
TOML_ERROR_TEXTS = (
    (r"Cannot overwrite a value", f"a key or table {REPEATED}"),
    (r"Cannot declare .* twice", f"a table {REPEATED}"),
    (r"Illegal character '\\n'", "a text has no closing quote"),
)
"""Patterns of messages of Python's TOML parser, and clearer texts that replace them."""

CASE_TABLES = frozenset(("structure", "body", "joint", "run"))  # a file with one of these tables is a case file


@checked
def read_case(path: str | os.PathLike[str], changes: Iterable[str] = ()) -> Case:
    """Read the case that a TOML file describes.

    Parameters
    ----------
    path : path
    changes : iterable of str, optional
        Values that replace those of the file, for example "drive.speed=250 rpm".

    Raises
    ------
    InputError
        For the first error, with its line and its place in the file.
    """
    path = Path(path)
    text = read_text(path, "a case file in TOML", "" if path.exists() else f"scissordyn new scissor > {command(path)}")
    written = parse_toml(text, path, "TOML, as 'scissordyn new scissor' prints it")
    of_file, of_parts = split_changes(written, changes, CaseTable.declared_keys().keys())
    tree = apply_changes(written, of_file)
    if is_study(written):
        what = f"'{path}' is a study file"
        raise InputError(what, "a case file", command("scissordyn", "study", path, "-o", f"{path.stem}.db"))
    if "structure" not in tree and tree.keys() <= CaseTable.declared_keys().keys():
        kind = "mechanism" if "body" in tree else "scissor"
        raise InputError(f"{path}: the table [structure] is missing", "a mechanism", f'structure = {{ kind = "{kind}" }}')
    with in_file(path, text, tree, written):
        case = make_case(tree, {"folder": path.parent, "code": _code(tree, path.parent)})
        return replace(case, mechanism=apply_numbers(case.mechanism, of_parts)) if of_parts else case


def make_case(tree: Mapping[str, Any], context: Context) -> Case:
    """Return the case that parsed TOML describes."""
    table: Any = instance(CaseTable, tree, context)
    described: Case = table.case(feed_forward)
    return described


def is_study(tree: dict[str, Any]) -> bool:
    """Return True if parsed TOML is a study file, which has the key `case`."""
    return isinstance(tree.get("case"), str) and not CASE_TABLES & tree.keys()


def is_case(tree: dict[str, Any]) -> bool:
    """Return True if parsed TOML is a case file and not a study file."""
    return "case" not in tree and bool(CASE_TABLES & tree.keys())


@checked
def write_case(described: Mechanism | Case, path: str | os.PathLike[str], *, run: Options | None = None) -> Path:
    """Write a mechanism and the options of its simulation to a case file; reading the file gives equal objects.

    An existing file is replaced only if `write_case` wrote it. The file is written completely or not at all.

    Parameters
    ----------
    described : Mechanism or Case
    path : path
    run : Options, optional
        Options of the simulation; by default those of the case, or the defaults for 50 ms.

    Raises
    ------
    InputError
        If a part cannot be written, for example a function that is not in a file, or if the path is another kind of file.
    """
    if Path(path).suffix.lower() in (".nc", *OTHER_ENDINGS) and Path(path).suffix.lower() != ".toml":
        raise InputError(f"'{path}' is not a name for a case file", "a name that ends in .toml", f"{Path(path).stem}.toml")
    check_target(path, sample=WRITE_EXAMPLE, beginning=FIRST_LINE.encode())
    text = case_text(described, run, folder=Path(path).absolute().parent)
    return write_file(path, text.encode(), sample=WRITE_EXAMPLE)


def _code(tree: dict[str, Any], folder: Path) -> Code:
    digests = tree.get("code", {})
    return Code(folder, digests if isinstance(digests, dict) else {})


@contextmanager
def in_file(path: Path, text: str, tree: dict[str, Any], written: dict[str, Any] | None = None) -> Iterator[None]:
    """Add file and line number to any `InputError` raised in the block.

    `tree` is the parsed TOML with changes, `written` the parsed text. The line is left out for a value that was changed.
    """
    written = tree if written is None else written
    try:
        yield
    except InputError as error:
        what, place = error.what, place_of_name(tree, error.what) if written == tree else ()
        if isinstance(error, PlacedError):
            what, place = error.error_text(place_text(tree, error.place)), (*error.place, *filter(None, [error.key]))
            place = place if value_at(written, place) == value_at(tree, place) else ()
        line = line_of(text, place)
        where = f"{path}, line {line}" if line else f"{path}"
        raise InputError(f"{where}: {what}", error.expected, example_text(error.example)) from None


def _quote_value(text: str, reason: str) -> str:
    """Return the wrong line of a TOML error with its quantity in quotes; "" if the error has another cause."""
    place = re.search(r"at line (\d+)", reason)
    lines = text.splitlines()
    match = UNQUOTED.fullmatch(lines[int(place[1]) - 1]) if place and int(place[1]) <= len(lines) else None
    return f'{match["key"]} = "{match["value"].strip()}"' if match else ""


def _broken_table(text: str, reason: str) -> str:
    """Return an error text for an inline table with a line break or trailing comma (not allowed in TOML 1.0), else ""."""
    place = re.search(r"(?:key part|Unclosed inline table) \(at line (\d+), column (\d+)\)", reason)
    if place is None:
        return ""
    line = text.splitlines()[int(place[1]) - 1]
    before, after = line[: int(place[2]) - 1].rstrip(), line[int(place[2]) - 1 :].strip()
    where = f"an inline table {{ ... }} of line {place[1]}"
    if before.endswith(("{", ",")) or "Unclosed" in reason:
        if not after or after.startswith("#"):
            return f"{where} has a line break; write it on one line, or as a [table]"
        if after.startswith("}") and before.endswith(","):
            return f"{where} has a comma before its closing brace"
    return ""


def parse_toml(text: str, path: Path, allowed: str = "TOML") -> dict[str, Any]:
    try:
        tree = tomllib.loads(text)
    except RecursionError:
        raise InputError(f"'{path}' has too deeply nested lists or tables", f"at most {NESTING_MAX} levels") from None
    except ValueError as error:  # an integer with thousands of digits raises a plain ValueError
        reason = str(error) if isinstance(error, tomllib.TOMLDecodeError) else "a number of thousands of digits"
        what = next(
            (re.sub(pattern, words, reason) for pattern, words in TOML_ERROR_TEXTS if re.search(pattern, reason)), reason
        )
        what = _broken_table(text, reason) or what
        sample = "" if REPEATED in what else _quote_value(text, reason)
        raise InputError(f"'{path}' is not valid TOML: {what}", allowed, sample) from None
    level: list[Any] = [tree]
    for _ in range(NESTING_MAX):
        level = [inner for outer in level for inner in (outer.values() if isinstance(outer, dict) else outer)]
        level = [inner for inner in level if isinstance(inner, dict | list)]
    if level:
        raise InputError(f"'{path}' nests tables and lists more than {NESTING_MAX} levels deep", f"at most {NESTING_MAX}")
    return tree


def folder_of_examples() -> Path:
    """Return the folder of the examples: in an installed package, or in the root of the repository."""
    package = Path(__file__).parents[1]
    installed = package / "examples"
    return installed if installed.is_dir() else package.parents[1] / "examples"


CHANGE_EXAMPLE = "--set drive.speed='250 rpm'"  # correct option, which error texts show
# Unit and bound of each width and thickness
SECTION_DIMENSION_QUANTITY = Quantity("m", above=0.0, help="dimension of a section")
PIN_FRICTIONS = ("pin_friction", "pin_lugre")  # tables of friction in ideal pins
LAW_KEYS = ("stiffness", "damping", "friction")  # keys whose value is a law: its name, or a table


def apply_changes(tree: dict[str, Any], changes: Iterable[str]) -> dict[str, Any]:
    """Return parsed TOML with values changed by texts of the form ``path=value``.

    In a path, a table of a list is given by index, name or joint (``clearance.A.friction``). ``clearance.all.friction``
    changes all tables of the list.
    """
    new = copy.deepcopy(tree)
    for change in changes:
        path, equals, value = change.partition("=")
        keys = [key.strip() for key in path.split(".")]
        if not equals or not all(keys):
            raise InputError(f"wrong form of --set {change!r}", "a path of keys, an equals sign and a value", CHANGE_EXAMPLE)
        for path_of_one in _expand_all(new, keys):
            _set_value(new, path_of_one, _parse_value(value.strip()), change)
    return new


def _expand_all(tree: dict[str, Any], keys: list[str]) -> list[list[str]]:
    """Expand "all" in a path: ``clearance.all.friction`` becomes a path for each [[clearance]] table.

    A path without "all", or to a table that is named "all", is returned unchanged.
    """
    tables = tree.get(keys[0])
    if len(keys) < 3 or keys[1] != "all" or not isinstance(tables, list) or "all" in map(table_name, tables):
        return [keys]
    return [[keys[0], str(index), *keys[2:]] for index in range(len(tables))]


def _parse_value(text: str) -> Any:
    try:
        table = tomllib.loads(f"value = {text}")
    except (ValueError, RecursionError):  # not valid TOML: keep the text, and the reader of the key reports the error
        return text
    return table["value"] if len(table) == 1 else text


def _set_value(tree: dict[str, Any], keys: list[str], value: Any, change: str) -> None:
    place: Any = tree
    for depth, key in enumerate(keys[:-1]):
        if isinstance(place, list) and not (_is_only(place, key) and (key in place[0] or key in LAW_KEYS)):
            place = _find_table(place, key, change)
            continue
        place = place[0] if isinstance(place, list) else place
        inner = place.setdefault(key, {})
        if key == "section" and isinstance(inner, str) and depth == len(keys) - 2:
            place[key] = with_dimension(inner, keys[-1], read_quantity(value, SECTION_DIMENSION_QUANTITY, f"--set {change!r}"))
            return
        if key in LAW_KEYS and isinstance(inner, str):  # "lugre" is equivalent to { law = "lugre" }
            inner = place[key] = {"law": inner}
        if not isinstance(inner, dict | list):
            raise InputError(
                f"--set {change!r}: '{'.'.join(keys[: depth + 1])}' has no keys below it", "a path of keys", CHANGE_EXAMPLE
            )
        place = inner
    if isinstance(place, list) and len(keys) > 1 and _is_only(place, keys[-1]):
        place = place[0]
    if isinstance(place, list):
        names = [table_name(entry) or str(number) for number, entry in enumerate(place)]
        which = keys[-1] in names or keys[-1].isdecimal()
        path = ".".join([*keys, "KEY"] if which else [*keys[:-1], names[0], keys[-1]]) if names else ""
        what = f"'{'.'.join(keys)}' is a whole table" if which else f"the name of the [[{keys[-2]}]] is missing"
        raise InputError(
            f"--set {change!r}: {what}",
            "a key below it" if which else "one of " + ", ".join(names),
            command("--set", f"{path}=VALUE") if path else "",
        )
    place[keys[-1]] = value


def _is_only(items: list[Any], key: str) -> bool:
    """Return True if a list has a single table that `key` does not name; a path may then omit the name of the table."""
    return len(items) == 1 and isinstance(items[0], dict) and key != table_name(items[0]) and not key.isdecimal()


def _find_table(items: list[Any], key: str, change: str) -> Any:
    handles = list(map(table_name, items))
    if key.isdecimal() and int(key) < len(items):
        return items[int(key)]
    if key in handles:
        return items[handles.index(key)]
    names = [name for name in handles if name] + [str(index) for index in range(len(items))]
    raise InputError(f"--set {change!r}: no table '{key}'{did_you_mean(key, names)}", "one of " + ", ".join(names))


def split_changes(tree: dict[str, Any], changes: Iterable[str], sections: Set[str]) -> tuple[list[str], list[str]]:
    """Split changes into two lists: of tables in the file, and of parts that [structure] generates, such as bars."""
    of_file, of_parts = [], []
    for change in changes:
        parameter, equals, _ = change.partition("=")
        head, dot, _ = (word.strip() for word in parameter.partition("."))
        # a kind of part that has no table in the file
        of_part = not tree.get(head) and (head in FIELD_OF_KIND or (head in PIN_FRICTIONS and "joint_friction" in tree))
        of_table = not of_part and bool(get_close_matches(head, sections, n=1, cutoff=0.75))
        if not (equals and dot) or of_table:  # the reader of the file reports a misspelt table
            of_file.append(change)
            continue
        listed = [section for section, items in tree.items() if isinstance(items, list) and head in map(table_name, items)]
        if listed:
            of_file.append(f"{'clearance' if 'clearance' in listed else listed[0]}.{change}")
        else:
            of_parts.append(change)
    return of_file, of_parts


def apply_numbers(mechanism: Mechanism, changes: Iterable[str]) -> Mechanism:
    for change in changes:
        parameter, _, text = change.partition("=")
        place = number(mechanism, parameter.strip())
        assert place.quantity is not None
        try:
            value = read_quantity(float(text) if place.quantity.unit == "1" else text.strip(), place.quantity)
        except (InputError, ValueError) as error:
            what = error.what if isinstance(error, InputError) else str(error)
            raise InputError(f"--set {change!r}: {what}", f"a value [{place.quantity.unit}]", CHANGE_EXAMPLE) from None
        mechanism = mechanism.replace(parameter.strip(), value)
    return mechanism
