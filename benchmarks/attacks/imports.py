"""Attack imports and case files with hostile texts: endless nesting, entities, huge numbers, and random changes."""

from __future__ import annotations

import random
import tempfile
import time
import warnings
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from types import MappingProxyType
from typing import Any

import scissordyn as sd
from benchmarks.attacks.report import Attack, command

__all__ = ["attack"]

TRIES, QUICK_TRIES, SEED = 300, 30, 1

SECONDS = 10.0  # Longest time of an import that survives [s]

MJCF = '<mujoco><worldbody><body name="a"><joint type="hinge" axis="0 1 0"/>'
MJCF += '<geom type="capsule" fromto="0 0 0 1 0 0" size="0.01"/></body></worldbody></mujoco>'

DXF = "  0\nSECTION\n  2\nENTITIES\n" + "  0\nLINE\n 10\n0\n 20\n0\n 11\n1\n 21\n1\n  0\nLINE\n 10\n1\n 20\n1\n 11\n2\n 21\n0\n"
DXF += "  0\nENDSEC\n  0\nEOF\n"

CASE = (Path(__file__).parents[2] / "examples" / "four_bar.toml").read_text()

ENTITIES = '<!DOCTYPE m [<!ENTITY a "aaaaaaaaaa">' + "".join(
    f'<!ENTITY {chr(98 + k)} "{f"&{chr(97 + k)};" * 10}">' for k in range(9)
)

HOSTILE: Mapping[str, str] = MappingProxyType(
    {
        "nesting of 100 000 elements": "<mujoco><worldbody>" + "<body>" * 100_000,
        "entities that grow to a gigabyte": f"{ENTITIES}]><mujoco>&j;</mujoco>",
        "a file of this machine as an entity": '<!DOCTYPE m [<!ENTITY a SYSTEM "file:///etc/passwd">]><mujoco>&a;</mujoco>',
        "numbers of a million digits": MJCF.replace('"0 1 0"', f'"0 {"1" * 10**6} 0"'),
        "numbers that are none": MJCF.replace('size="0.01"', 'size="nan"').replace("1 0 0", "inf 0 0"),
    }
)


def read_case(text: str) -> sd.Case:
    """Read a case file with this text."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "case.toml"
        path.write_text(text, errors="surrogatepass")
        return sd.read_case(path)


WHOLE: Mapping[str, tuple[str, Callable[[str], Any]]] = MappingProxyType(
    {"MJCF": (MJCF, sd.read_mjcf), "DXF": (DXF, partial(sd.read_dxf, unit="mm")), "case file": (CASE, read_case)}
)
"""Hostile texts by kind, with the function that reads them."""

ABOUT = (
    f"Survived: the text is read, or refused in one line, within {SECONDS:g} s. Random changes replace, remove or repeat a "
    f"part of a whole text, drawn with seed {SEED}."
)


def changed(text: str, chance: random.Random) -> str:
    """Return a text with a part replaced, removed or repeated."""
    first = chance.randrange(len(text) + 1)
    last = min(len(text), first + chance.randrange(20))
    new = chance.choice(("", text[first:last] * 50, "\0", "-1e999", '"', "<", "\u202e", "9" * 500, "[[", "nan"))
    return text[:first] + new + text[last:]


def result_of(read: Callable[[str], Any], text: str) -> str:
    """Return what happened to a text."""
    began = time.monotonic()
    try:
        read(text)
        result = "read"
    except sd.ScissordynError:
        result = "refused"
    except Exception as error:
        result = type(error).__name__
    return result if time.monotonic() - began < SECONDS else "too slow"


def row(what: str, results: Sequence[str]) -> Attack:
    """Return one row of the table."""
    counts = {result: results.count(result) for result in dict.fromkeys(results)}
    survived = counts.get("read", 0) + counts.get("refused", 0)
    return Attack(what, len(results), survived, ", ".join(f"{count} {result}" for result, count in counts.items()))


def attack(quick: bool = False) -> Sequence[Attack]:
    """Return the rows of the table."""
    warnings.simplefilter("ignore")
    rows = [row(f"MJCF: {what}", [result_of(sd.read_mjcf, text)]) for what, text in HOSTILE.items()]
    chance = random.Random(SEED)
    for kind, (text, read) in WHOLE.items():
        tries = QUICK_TRIES if quick else TRIES
        assert result_of(read, text) == "read", kind
        rows.append(row(f"{kind}: random changes", [result_of(read, changed(text, chance)) for _ in range(tries)]))
    return rows


if __name__ == "__main__":
    command("imports", "Hostile imports", attack, ABOUT)
