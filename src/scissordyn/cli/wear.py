"""Command ``wear``: compute the wear of joints over many cycles, and their life."""

from __future__ import annotations

import dataclasses
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from scissordyn.cli.option import AsJson, Changes, Quiet
from scissordyn.cli.output import EXIT_STATUSES, PROGRESS_TEXT, bars, check_folder, check_movie, check_run, print_json, say
from scissordyn.cli.parameter import Argument, Option
from scissordyn.errors import command, printable

if TYPE_CHECKING:
    import xarray as xr

PLOT_EXAMPLE = "--plot pictures"  # Correct option for pictures of wear, which error texts show


def wear(
    case: Annotated[Path, Argument(help="A case file with a wear coefficient in a [[clearance]] table.")],
    cycles: Annotated[int | None, Option(help="Number of cycles, instead of that in [wear].", min=1)] = None,
    output: Annotated[
        Path | None,
        Option("-o", "--output", help="Save the result here after each simulated cycle. The same command continues from it."),
    ] = None,
    change: Changes = None,
    plot: Annotated[Path | None, Option(help="Draw worn contours, and curves over the cycles, into this folder.")] = None,
    film: Annotated[
        Path | None,
        Option("--animate", metavar="FILM", help="Animate the deepest worn profile over the cycles: .gif, .mp4 or .html."),
    ] = None,
    report: Annotated[
        Path | None, Option(metavar="FILE", help="Write answers, tables and pictures to this .html or .pdf file.")
    ] = None,
    quiet: Quiet = False,
    as_json: AsJson = False,
) -> int:
    from scissordyn.config.file import read_case
    from scissordyn.lifetime.wear import wear_out
    from scissordyn.model.wear import Wear
    from scissordyn.record.store import save

    check_run(output, case, "-o life.nc")
    check_folder(plot, PLOT_EXAMPLE)
    check_movie(film, case, "--animate life.gif")
    read = read_case(case, change or [])
    settings = read.wear or Wear()
    if cycles is not None:
        settings = dataclasses.replace(settings, cycles=cycles)
    earlier = _earlier(output)

    def keep(run: xr.Dataset) -> None:
        if output is not None:
            save(run, output)

    with bars(PROGRESS_TEXT, "BarColumn", "MofNCompleteColumn", "TimeRemainingColumn") as update:
        run = wear_out(
            read.mechanism,
            read.run,
            settings,
            earlier=earlier,
            each=keep,
            progress=None if update is None else lambda done, total: update("cycles", completed=done, total=total),
        )
    keep(run)
    files = [*_draw(run, plot, film), *([] if report is None else [_report(run, report)])]
    if as_json:
        print_json(_record(run) | {"files": [str(file) for file in [*([] if output is None else [output]), *files]]})
    elif not quiet:
        _show(run, output, files)
    if run.attrs["status"] != "complete":
        resumed = ""
        if run.attrs["status"] == "interrupted" and output is not None:
            whole = not change and cycles is None
            again = command("scissordyn", "wear", case, "-o", output) if whole else "the same command"
            resumed = f"; {again} continues from there"
        print(f"scissordyn: {printable(run.attrs['cause'])}{resumed}", file=sys.stderr)
    return EXIT_STATUSES[run.attrs["status"]]


def _earlier(output: Path | None) -> xr.Dataset | None:
    """Return the result in the output file of an earlier command; None if there is none."""
    from scissordyn.file.output_file import regular_size
    from scissordyn.record.store import load

    return None if output is None or not output.exists() or not regular_size(output) else load(output)


def _draw(run: xr.Dataset, folder: Path | None, film: Path | None) -> list[Path]:
    """Draw the worn contour of each joint, the curves over the cycles, and a film; return the paths of the files."""
    files = list[Path]()
    if film is not None:
        from scissordyn.plot.wear import film as write_film

        files.append(write_film(run, film))
    if folder is not None:
        from scissordyn.plot.file import write
        from scissordyn.plot.wear import history, profile

        folder.mkdir(parents=True, exist_ok=True)
        files.append(write(history(run), folder / "wear.png"))
        for number, joint in enumerate(run["joint"].values.tolist(), start=1):
            files.append(write(profile(run, joint), folder / f"profile-{number}.png"))
    return files


def _report(run: xr.Dataset, path: Path) -> Path:
    """Write the report of a life: its answers, a table of the joints, warnings, and the pictures."""
    from scissordyn.lifetime.life import JOINT_HEAD, joint_rows, life_lines, simulated_line
    from scissordyn.plot.file import figure_of
    from scissordyn.plot.wear import history, profile
    from scissordyn.record.warn import warning_lines, warnings_of
    from scissordyn.studies.answer.report import write_page
    from scissordyn.studies.answer.section import Section

    joints, count = run["joint"].values.tolist(), int(run.sizes["requirement"])
    answers = Section(lines=(*life_lines(run)[: count or None], simulated_line(run)))
    sections = [answers, Section(JOINT_HEAD, joint_rows(run), "Joints")]
    if warnings := warning_lines(warnings_of(run)):
        sections.append(Section(title="Warnings", lines=tuple(warnings)))
    drawn = [("Clearance and deviation over the cycles", figure_of(history(run)))]
    drawn += [(f"Worn bearing of joint {joint}", figure_of(profile(run, joint))) for joint in joints]
    return write_page(path, f"Wear of joints over {int(run['cycle'][-1])} cycles", sections, drawn)


def _show(run: xr.Dataset, output: Path | None, files: list[Path]) -> None:
    from scissordyn.cli.show import warning_texts
    from scissordyn.lifetime.life import life_lines, simulated_line

    say(*(life_lines(run) if run["cycle"].values[-1] else []), highlight=False, soft_wrap=True)
    say(simulated_line(run), highlight=False)
    say(*warning_texts(run), highlight=False, soft_wrap=True)
    if output is not None:
        say(f"Saved to {output}" + ("" if run.attrs["status"] == "complete" else f", marked {run.attrs['status']}"))
    say(*files)


def _record(run: xr.Dataset) -> dict[str, Any]:
    """Return the result as a dictionary for JSON, in SI units."""
    from scissordyn.cli.show import warning_record

    numbers, keys = ("life", "life_low", "life_high"), ("depth_largest", "depth_error", "worn_volume", "worn_clearance")
    needs, limiting = run["requirement"].values.tolist(), run["limited_by"].values.tolist()
    lives = [
        {"requirement": need, "limited_by": joint, **{name: float(run[name].values[r]) for name in numbers}}
        for r, (need, joint) in enumerate(zip(needs, limiting, strict=True))
    ]
    joints = {name: {key: float(run[key].sel(joint=name)[-1]) for key in keys} for name in run["joint"].values.tolist()}
    attributes = {key: run.attrs[key] for key in ("status", "cause", "cycles", "simulated_cycles")}
    return {**attributes, "lives": lives, "joints": joints, **warning_record(run)}
