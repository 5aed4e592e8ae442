"""Command ``run``: simulate a case, show and save the result."""

from __future__ import annotations

import dataclasses
import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from scissordyn.cli.option import AsJson, Changes, OwnCode, Quiet
from scissordyn.cli.output import (
    EXIT_STATUSES,
    INTERRUPTED,
    check_file,
    check_folder,
    check_movie,
    check_run,
    print_json,
    progress_bar,
)
from scissordyn.cli.parameter import Argument, Option
from scissordyn.errors import InputError, printable

if TYPE_CHECKING:  # so that the help of a command does not load libraries
    from scissordyn.model.mechanism import Mechanism
    from scissordyn.record.results import Results
    from scissordyn.run.advance.checkpoint import Checkpoint


def run(
    case: Annotated[Path, Argument(help="A case file, or a saved run to run again.")],
    output: Annotated[Path | None, Option("-o", "--output", help="Save the run to this NetCDF file.")] = None,
    change: Changes = None,
    plot: Annotated[Path | None, Option(help="Draw pictures of the run into this folder, next to ideal joints.")] = None,
    film: Annotated[Path | None, Option("--animate", help="Animate the run to this .gif, .mp4 or .html file.")] = None,
    trust: Annotated[bool, Option("--trust", help="Run twice and report the time until which both runs agree.")] = False,
    samples: Annotated[str | None, Option(metavar="N", help="Number of samples; 'auto' adds samples in contacts.")] = None,
    events: Annotated[int, Option(help="Number of contacts to show.", min=0)] = 20,
    checkpoint: Annotated[
        str | None,
        Option(
            metavar="TIME",
            help="Save the state next to the file of -o at intervals such as '60 s'. The same command continues from it.",
        ),
    ] = None,
    allow_code: OwnCode = None,
    quiet: Quiet = False,
    as_json: AsJson = False,
) -> int:
    from scissordyn.cli.show import run_record, show_run

    check_run(output, case, "-o run.nc")
    check_folder(plot, "--plot figures")
    check_movie(film, case, "--animate film.html")
    keeper = None if checkpoint is None else _checkpoint(checkpoint, output, case)
    changes = [*(change or ()), *["run.trust=true"] * trust, *([] if samples is None else [f"run.samples={samples}"])]
    drawn = plot is not None or film is not None
    silent, stopped = quiet or as_json, False
    if _is_saved(case):
        mechanism, result = _replay(case, changes, allow_code or [], keeper, silent=silent)
    elif allow_code:
        raise InputError("--allow-code with a case file", "a saved run; Python files of a case file need no permission")
    else:
        mechanism, result = _from_case(case, changes, keeper, kept=output is not None or drawn)
    try:
        if output is not None:
            stopped = _save(result, output, keeper)
    finally:  # show the result even if it could not be saved
        if not silent:
            show_run(result, events, mechanism)
    status = result.attrs["status"]
    if output is not None and not silent:
        print(f"Saved to {output}" + ("" if status == "complete" else f", marked {status}"))
    if stopped:
        return INTERRUPTED
    moved = result.sizes["time"] > 1 and status != "interrupted"
    pictures = _pictures(result, mechanism, plot, film) if moved else []
    if as_json:
        print_json(run_record(result, [*([] if output is None else [output]), *pictures]))
    elif not quiet and pictures:
        print(*pictures, sep="\n")
    if status != "complete":
        can_continue = status == "interrupted" and keeper is not None and Path(keeper.path).exists()
        resumed = "; the same command continues from there" if can_continue else ""
        print(f"scissordyn: {printable(result.attrs['cause'])}{resumed}", file=sys.stderr)
    return EXIT_STATUSES[status]


def _save(result: Results, output: Path, keeper: Checkpoint | None) -> bool:
    """Save the run and remove its checkpoint; return True if Ctrl-C was pressed meanwhile, which takes effect afterwards."""
    from scissordyn.record.store import write_results

    try:
        write_results(result, output)
        if keeper is not None and result.attrs["status"] != "interrupted":
            keeper.remove()
    except KeyboardInterrupt:
        return True
    return False


def _pictures(result: Results, mechanism: Mechanism, plot: Path | None, film: Path | None) -> list[Path]:
    """Draw pictures and the animation of the run; return the paths of the files."""
    if plot is None and film is None:
        return []
    from scissordyn.model.options import Options
    from scissordyn.run.advance.interrupt import raise_if_interrupted
    from scissordyn.run.simulate import compute_results

    files = []
    if plot is not None:
        from scissordyn.plot.report import draw_all

        same = Options(until=float(result["time"].values[-1]), samples=result.sizes["time"])
        ideal = raise_if_interrupted(compute_results(mechanism.ideal(), same)) if mechanism.contacts else None
        files += draw_all(result, ideal, plot, mechanism)
    if film is not None:
        from scissordyn.plot.animation import animate
        from scissordyn.record.xarray_dataset import as_dataset

        files.append(animate(as_dataset(result), mechanism, film))
    return files


def _is_saved(path: Path) -> bool:
    """Return True if a file is a saved run, complete or damaged, and not a case file."""
    from scissordyn.file.output_file import HDF_MAGIC, regular_size

    if path.suffix == ".nc":
        return True
    try:
        if regular_size(path) is None:
            return False
        with path.open("rb") as file:
            return file.read(4) == HDF_MAGIC[:4]
    except (OSError, ValueError):
        return False  # the reader of case files reports the error


def _checkpoint(every: str, output: Path | None, case: Path) -> Checkpoint:
    """Return the checkpoint of a run, a file next to the output file."""
    from scissordyn.casefile.quantity import read_quantity
    from scissordyn.casefile.table import add_prefix
    from scissordyn.run.advance.checkpoint import Checkpoint
    from scissordyn.units import quantities

    sample = "-o run.nc --checkpoint '60 s'"
    if output is None:
        raise InputError("--checkpoint without -o", "-o and a file for the run; its state is kept next to that file", sample)
    with add_prefix(f"--checkpoint {every}"):
        seconds = read_quantity(every, quantities(Checkpoint)["every"], "60 s")
    path = output.with_name(f"{output.name}.checkpoint")
    check_file(path, case, sample)
    return Checkpoint(path, seconds, keep=True)


def _from_case(path: Path, changes: list[str], keeper: Checkpoint | None, *, kept: bool) -> tuple[Mechanism, Results]:
    """Run a case; if the run is saved or drawn (`kept`) and the user did not choose samples, contacts get samples too."""
    from scissordyn.config.file import read_case
    from scissordyn.model.options import AUTO
    from scissordyn.run.simulate import compute_results

    case = read_case(path, changes)
    options = case.run.equally_spaced
    if kept:
        options = case.run if _samples_chosen(path, changes) else dataclasses.replace(case.run, samples=AUTO)
    with progress_bar(case.run.until) as progress:
        return case.mechanism, compute_results(case.mechanism, options, progress, keeper)


def _samples_chosen(path: Path, changes: list[str]) -> bool:
    """Return True if the case file or a change has the key `samples`."""
    from scissordyn.casefile.text import read_text
    from scissordyn.config.file import parse_toml

    keys = {text.partition("=")[0].replace(" ", "") for text in changes}
    return "run.samples" in keys or "samples" in parse_toml(read_text(path, "a case file in TOML"), path).get("run", {})


def _computed_again(path: Path, saved: Any, until: float, *, kept: bool) -> str:
    """Return the message that a saved run, which was interrupted, is computed again from its start."""
    from scissordyn.units import short

    reached, taken = float(saved.attrs["end"]), float(json.loads(saved.attrs["statistics"])["seconds"])
    return (
        f"scissordyn: '{path}' was interrupted at {short(reached, 's')} of {short(until, 's')}, "
        f"after {short(taken, 's')}: it is computed from its start again"
        + ("" if kept else "; with -o FILE --checkpoint '60 s' a run can go on")
    )


def _replay(
    path: Path, changes: list[str], allow_code: list[Path], keeper: Checkpoint | None, *, silent: bool
) -> tuple[Mechanism, Results]:
    from scissordyn.casefile.configuration import read_configuration
    from scissordyn.record.store import load
    from scissordyn.run.simulate import replay_results

    if changes:
        raise InputError(f"--set '{changes[0]}' with a saved run", "a saved run without changes, or a case file")
    if not path.exists():
        raise InputError(f"cannot read '{path}': no such file", "a case file or a saved run")
    saved = load(path)
    configuration = read_configuration(saved)
    until = 0.0 if configuration.options is None else configuration.options.until
    if str(saved.attrs.get("status")) == "interrupted" and not silent:
        print(_computed_again(path, saved, until, kept=keeper is not None), file=sys.stderr)
    with progress_bar(until) as progress:
        result = replay_results(saved, allow_code=allow_code, progress=progress, checkpoint=keeper)
    return configuration.build_mechanism(allow_code), result
