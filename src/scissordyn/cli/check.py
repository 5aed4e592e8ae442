"""Commands ``check`` and ``preview``: describe a case before it is run."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from scissordyn.cli.option import AsJson, CaseFile, Changes, Quiet
from scissordyn.cli.output import DONE, check_picture, print_json, say
from scissordyn.cli.parameter import Option


def check(
    case: CaseFile,
    change: Changes = None,
    quiet: Quiet = False,
    as_json: AsJson = False,
    converge: Annotated[
        str | None, Option(metavar="MEASURE", help="Find the tolerance that a measure needs, such as 'tip.error within 1 %'.")
    ] = None,
    modes: Annotated[
        bool, Option("--modes", help="With --converge: find the number of bending modes instead of the tolerance.")
    ] = False,
) -> int:
    from scissordyn.cli.check_lines import check_lines

    lines, record = check_lines(case, change or [], converge, modes)
    if as_json:
        print_json(record)
    elif not quiet:
        say(*lines)
    return DONE


def preview(
    case: CaseFile,
    output: Annotated[
        Path | None, Option("-o", "--output", metavar="FILE", help="Draw the assembled mechanism to this .svg or .png file.")
    ] = None,
    curves: Annotated[
        Path | None,
        Option(metavar="FILE", help="Draw output, transmission angles, torque and reactions with ideal joints to this file."),
    ] = None,
    change: Changes = None,
) -> int:
    from scissordyn.cli.check_lines import preview_lines, worn_lines
    from scissordyn.config.file import read_case
    from scissordyn.model.commanded import commanded
    from scissordyn.run.ideal import ideal_kinematics

    for path in (output, curves):
        check_picture(path, case, "-o picture.svg")
    read = read_case(case, change or [])
    followed = commanded(read.mechanism)
    ideal = ideal_kinematics(followed, until=read.run.until)
    say(*preview_lines(read.mechanism, followed, ideal, read.run.until), *worn_lines(read))
    if output is not None or curves is not None:
        from scissordyn.plot.file import write
        from scissordyn.plot.preview import preview as draw
        from scissordyn.plot.stroke import kinematics

        if output is not None:
            say(write(draw(read.mechanism, start=ideal), output))
        if curves is not None:
            say(write(kinematics(ideal), curves))
    return DONE
