"""Table of an attack: what was tried, how often, and what was lost."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from benchmarks.measure import machine, paragraph, table, write_section

__all__ = ["Attack", "command"]


@dataclass(frozen=True)
class Attack:
    """One kind of attack and its result.

    Parameters
    ----------
    what : str
    tried, survived : int
        Number of attempts, and number of attempts in which nothing was lost.
    result : str
        What happened in the attempts that survived, and what was lost in the others.
    """

    what: str
    tried: int
    survived: int
    result: str


def command(name: str, heading: str, attack: Callable[[bool], Sequence[Attack]], about: str) -> None:
    """Run an attack from the command line.

    Parameters
    ----------
    name : str
        Name of the script in benchmarks/attacks.
    heading : str
        Heading of its section of docs/decisions/measured/attacks.md.
    attack : callable
        Function from `quick` to the rows of the table.
    about : str
        Method, and what counts as survived.
    """
    parser = argparse.ArgumentParser(description=heading)
    parser.add_argument("--write", action="store_true", help="save the section in docs/decisions/measured/attacks.md")
    parser.add_argument("--quick", action="store_true", help="fewer attempts")
    given = parser.parse_args()
    rows = [
        (row.what, f"{row.tried}", f"{row.survived}", f"{row.tried - row.survived}", row.result) for row in attack(given.quick)
    ]
    lines = table(("attack", "tried", "survived", "lost", "result"), rows)
    text = f"{paragraph(about)}\n\n{lines}\n{machine()}\n"
    print(text)
    if given.write:
        write_section("attacks", heading, f"python -m benchmarks.attacks.{name} --write", text)
