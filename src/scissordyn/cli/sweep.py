"""``scissordyn sweep``: vary numbers of a case, and say where it meets requirements."""

from __future__ import annotations

import re
from typing import Annotated

import typer

from scissordyn.cli.option import BlockSize, CaseFile, Changes
from scissordyn.cli.output import check_store_name
from scissordyn.cli.where import QueueFile, Scheduler, ThreadCount, Where, WorkerCount
from scissordyn.errors import InputError

VARY = "--vary A.clearance='0.05..0.4 mm'"

DISTRIBUTED = re.compile(r"(.*?)=(\s*[a-z]+\s*\(.*\)[^()=]*)", re.DOTALL)
"""An address and a distribution, whose table may be a file with an equals sign in its name."""


def sweep(
    case: CaseFile,
    output: Annotated[str, typer.Option("-o", "--output", help="The store: a file.")],
    vary: Annotated[
        list[str] | None,
        typer.Option(metavar="ADDRESS=VALUES", help="A number and its range, levels or distribution. Repeatable."),
    ] = None,
    uncertain: Annotated[
        list[str] | None,
        typer.Option(metavar="ADDRESS=VALUES", help="A number that nobody chooses, and its distribution. Repeatable."),
    ] = None,
    measure: Annotated[
        list[str] | None, typer.Option(metavar="NAME", help="A measure, or 'NAME [UNIT]=FILE.py:FUNCTION'. Repeatable.")
    ] = None,
    require: Annotated[
        list[str] | None, typer.Option(metavar="REQUIREMENT", help="As in 'peak_force < 500 N'. Repeatable.")
    ] = None,
    design: Annotated[
        str, typer.Option(help="grid, zip, one-at-a-time, random, latin-hypercube, sobol, saltelli or morris.")
    ] = "grid",
    points: Annotated[int, typer.Option("--points", "--values", metavar="N", help="Points of a sampled design.", min=0)] = 0,
    seed: Annotated[int, typer.Option(help="Of a sampled design.", min=0)] = 0,
    samples: Annotated[int, typer.Option(help="Samples of the uncertain numbers at each point.", min=1)] = 1,
    members: Annotated[int, typer.Option(help="Runs of each sample, from starts that differ by round-off.", min=1)] = 1,
    change: Changes = None,
    threads: ThreadCount = None,
    workers: WorkerCount = None,
    scheduler: Scheduler = None,
    cluster: QueueFile = None,
    block: BlockSize = None,
) -> int:
    """Vary numbers of a case, keep all results in a store, and say where requirements are met."""
    from scissordyn.cli.study import compute
    from scissordyn.config.study import StudyText, study_of
    from scissordyn.study.ask.description import Sampling
    from scissordyn.study.ask.design import Design

    check_store_name(output)
    text = StudyText(
        case=case,
        changes=tuple(change or ()),
        vary=addressed(vary, "--vary"),
        uncertain=addressed(uncertain, "--uncertain"),
        measures=tuple(measure or ()),
        require=tuple(require or ()),
        design=Design(design, points, seed),
        sampling=Sampling(samples, seed=seed),
        members=members,
    )
    return compute(study_of(text), output, Where(threads, workers, scheduler, cluster), block=block)


def addressed(given: list[str] | None, option: str) -> dict[str, str]:
    """Texts by address, of ``ADDRESS=VALUES``."""
    found: dict[str, str] = {}
    for each in given or ():
        called = DISTRIBUTED.fullmatch(each)
        # names of joints may have equals signs, levels and ranges have none
        address, equals, values = (called[1], "=", called[2]) if called else each.rpartition("=")
        if not equals or not values.strip():
            raise InputError(f"{option} {each!r}", "an address, an equals sign and values", VARY)
        if address.strip() in found:
            raise InputError(f"{option} {each!r}: '{address.strip()}' varies twice", "each address once")
        found[address.strip()] = values
    return found
