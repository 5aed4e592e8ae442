"""``scissordyn study``: compute a study file, continue a study, and show its results."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from scissordyn.cli.option import BlockSize
from scissordyn.cli.output import check_store_name
from scissordyn.cli.progress import DESCRIPTION, bar
from scissordyn.cli.status import DONE, INTERRUPTED, UNFINISHED
from scissordyn.cli.where import QueueFile, Scheduler, ThreadCount, Where, WorkerCount
from scissordyn.errors import InputError, command, did_you_mean, printable
from scissordyn.units import counted, short

if TYPE_CHECKING:
    from scissordyn.study.ask.description import Study
    from scissordyn.study.compute.execute import Progress
    from scissordyn.study.result import StudyResult

ACTIONS = ("status", "resume", "retry", "extend", "refine", "report", "export", "replay", "convert")

UNITS = (("a second", 1.0), ("a minute", 60.0), ("an hour", 3600.0))

EVENTS = 20
"""Contacts of a replayed case that are shown."""

EVERY = 30.0
"""Seconds between two lines of progress where there is no terminal."""


def study(
    what: Annotated[str, typer.Argument(help=f"A study file, or one of: {', '.join(ACTIONS)}.")],
    store: Annotated[str | None, typer.Argument(help="The store, after one of these words.")] = None,
    case: Annotated[int | None, typer.Argument(help="The case to replay.")] = None,
    output: Annotated[
        str | None, typer.Option("-o", "--output", help="The store of a study file; the file of a report, export or replay.")
    ] = None,
    plot: Annotated[Path | None, typer.Option(help="Also draw the pictures of a report into this folder.")] = None,
    points: Annotated[int | None, typer.Option(help="Points from now on, for extend, or of refine.", min=1)] = None,
    vary: Annotated[
        list[str] | None, typer.Option(metavar="ADDRESS=VALUES", help="For refine: a new range. Repeatable.")
    ] = None,
    uncertain: Annotated[
        list[str] | None, typer.Option(metavar="ADDRESS=VALUES", help="For refine: an uncertain number. Repeatable.")
    ] = None,
    samples: Annotated[int | None, typer.Option(help="For refine: samples of the uncertain numbers.", min=1)] = None,
    seed: Annotated[int | None, typer.Option(help="For refine: of design and samples.", min=0)] = None,
    goal: Annotated[list[str] | None, typer.Option(help="For refine: as in 'minimise peak_force'. Repeatable.")] = None,
    budget: Annotated[
        str | None, typer.Option(metavar="TIME", help="Of a study file with [screen]: time for all runs, as in '10 min'.")
    ] = None,
    threads: ThreadCount = None,
    workers: WorkerCount = None,
    scheduler: Scheduler = None,
    cluster: QueueFile = None,
    block: BlockSize = None,
    allow_code: Annotated[
        list[Path] | None, typer.Option(metavar="FILE", help="A Python file of yours that the study uses. Repeatable.")
    ] = None,
) -> int:
    """Compute a study file; or show, resume, retry, extend, refine, report, export or convert one, or replay a case."""
    where = Where(threads, workers, scheduler, cluster)
    changes = {"vary": vary, "uncertain": uncertain, "samples": samples, "seed": seed, "goal": goal}
    named = next((name for name, value in changes.items() if value is not None), None)
    if named is not None and what != "refine":
        sample = "scissordyn study refine study.db --samples 64 -o next.db"
        raise InputError(f"--{named} without refine", "study refine", sample)
    if plot is not None and what != "report":
        raise InputError("--plot without a report", "study report", "scissordyn study report study.db --plot figures")
    if what not in ACTIONS:
        return _from_file(what, store, output, where, block, budget)
    if budget is not None:
        raise InputError("--budget without a study file", "a study file", "scissordyn study study.toml -o study.db")
    if store is None:
        raise InputError(f"'study {what}' without a store", "the store of a study", f"scissordyn study {what} study.db")
    if what == "convert":
        return _convert(Path(store), output)
    from scissordyn.config.studies import open_study
    from scissordyn.study.compute.store import damage_text

    result = open_study(store, allow_code=allow_code or [])
    if what in ("resume", "retry", "extend") and (damaged := result.store.damage()):
        print(f"scissordyn: {damage_text(damaged)}", file=sys.stderr)
    match what:
        case "status":
            return _status(result)
        case "resume" | "retry":
            return compute(result.built(), store, where, retry=what == "retry")
        case "extend":
            if result.study.optimisation is not None:
                sample = command("scissordyn", "study", "study.toml", "-o", store)
                raise InputError("more points of an optimisation", "its study file with more generations", sample)
            if points is None:
                raise InputError("'study extend' without --points", "the number of points from now on", "--points 2048")
            return compute(result.built(), store, where, points=points)
        case "refine":
            if output is None:
                raise InputError("'study refine' without a store of its own", "-o and a file", "-o next.db")
            from scissordyn.cli.sweep import addressed
            from scissordyn.config.refine import refined

            check_store_name(output)
            ranges, drawn = addressed(vary, "--vary"), addressed(uncertain, "--uncertain")
            now = refined(
                result.built(), vary=ranges, uncertain=drawn, points=points, samples=samples, seed=seed, goals=goal or ()
            )
            return compute(now, output, where, block=block)
        case "report":
            return _report(result, output, plot)
        case "export":
            from scissordyn.cli.answers import show_damage

            print(f"Saved to {result.export(output or 'study.csv')}")
            show_damage(result)
            return DONE
        case _:
            return _replay(result, case, output)


def _from_file(what: str, store: str | None, output: str | None, where: Where, block: int | None, budget: str | None) -> int:
    path = Path(what)
    if not path.exists():
        raise InputError(
            f"no study file '{what}'{did_you_mean(what, ACTIONS)}",
            f"a study file in TOML, or {', '.join(ACTIONS)}",
            "study.toml",
        )
    if store is not None:
        raise InputError(f"'{store}' after a study file", "-o and the store", command("-o", store))
    from scissordyn.config.quantity import read_quantity
    from scissordyn.config.study import read_study, study_of
    from scissordyn.units import Quantity

    text = read_study(path)
    if output is None:
        sample = command("scissordyn", "study", path, "-o", f"{path.stem}.db")
        raise InputError("a study without a store", "-o and a file", sample)
    check_store_name(output)
    seconds = None if budget is None else read_quantity(budget, Quantity("s", above=0.0, help="time"), "--budget '10 min'")
    return compute(study_of(text), output, where, block=block, budget=seconds)


def compute(
    described: Study,
    address: str,
    where: Where,
    *,
    block: int | None = None,
    retry: bool = False,
    points: int | None = None,
    budget: float | None = None,
) -> int:
    """Do what is missing of a study, and show its answers."""
    from scissordyn.run.engine import EngineError
    from scissordyn.study.compute.block import ProgramError
    from scissordyn.study.compute.store import Store, StoreError
    from scissordyn.study.result import computed

    store = Store(address)

    def kept() -> str:
        if not store.begun():
            return "nothing was computed yet; the same command begins anew"
        return f"what is complete is in {printable(address)}; {on()}"

    def on() -> str:
        return f"to go on: {command('scissordyn', 'study', 'resume', address)}"

    try:
        if store.exists() and points is None and described.design.kind != "adaptive":
            store.check(described)  # before workers are started for nothing
        with where.engine() as engine, _progress() as told:
            result = computed(
                described, address, engine=engine, block=block, retry=retry, points=points, budget=budget, progress=told
            )
    except KeyboardInterrupt:
        print(f"scissordyn: interrupted; {kept()}", file=sys.stderr)
        return INTERRUPTED
    except (EngineError, StoreError, ProgramError) as error:
        then = on() if store.begun() else "the same command begins anew"
        print(f"scissordyn: {printable(str(error))}; {then}", file=sys.stderr)
        return UNFINISHED
    return _answers(result)


@contextmanager
def _progress() -> Iterator[Callable[[Progress], None]]:
    """A function of the progress: a bar on a terminal, a line now and then elsewhere."""
    last = [time.monotonic()]

    def line(one: Progress) -> None:
        if time.monotonic() - last[0] > EVERY:
            last[0] = time.monotonic()
            print(_words(one), file=sys.stderr)

    with bar("BarColumn", DESCRIPTION, described="preparing", total=None) as update:
        if update is None:
            yield line
        else:
            yield lambda one: update(completed=one.complete + one.failed, total=one.cases, description=_words(one))


def _words(one: Progress) -> str:
    done = one.complete + one.failed
    failed = f", {one.failed / max(done, 1):.1%} failed" if one.failed else ""
    minutes, seconds = divmod(int(min(one.left, 1e9)), 60)
    left = f"{minutes // 60} h {minutes % 60} min" if minutes >= 60 else f"{minutes} min {seconds} s"
    which = f"generation {one.generation}: " if one.generation else ""
    return f"{which}{done} of {one.cases} cases{failed}, {_rate(one.rate)}, {left} left"


def _rate(rate: float) -> str:
    """Cases in the largest unit of time in which they are one or more."""
    unit, seconds = next(((unit, size) for unit, size in UNITS if rate * size >= 1.0), UNITS[-1])
    return f"{rate * seconds:.3g} {unit}"


def _answers(result: StudyResult) -> int:
    from scissordyn.cli.answers import show_answers

    show_answers(result)
    result.store.conclude(result.conclusion.to_plain())
    address, counts = result.store.address, result.counts
    print(f"Saved to {printable(address)}")
    if counts["failed"] and not counts["complete"]:
        why = command("scissordyn", "study", "status", address)
        print(f"scissordyn: all {counts['failed']} cases failed; for the causes: {why}", file=sys.stderr)
        return UNFINISHED
    return DONE


def _status(result: StudyResult) -> int:
    from scissordyn.cli.answers import show_causes, show_damage, show_warnings

    counts, study, times = result.counts, result.study, result.store.times()
    said = ", ".join(f"{count} {name}" for name, count in counts.items())
    print(f"{study.points} points x {study.per_point} cases: {said}; blocks of {result.store.block}")
    worked, cases = float(times["seconds"].sum()), float(times["cases"].sum())
    if cases and worked:
        integration = float(times["integration_seconds"].sum())
        print(
            f"{short(worked / cases, 's')} a case and worker, {1.0 - integration / worked:.0%} of it beside the integration; "
            f"about {counts['pending'] * worked / cases / 60.0:.3g} worker minutes to go"
        )
    show_causes(result)
    show_warnings(result)
    show_damage(result)
    if counts["pending"]:
        print(f"To go on: {command('scissordyn', 'study', 'resume', result.store.address)}")
    return DONE


def _convert(old: Path, output: str | None) -> int:
    """A study of format 2, a folder, as a file, with the accurate runs beside it."""
    from scissordyn.study.compute.convert import convert
    from scissordyn.study.compute.screening import verified_address

    target = output or str(old.with_suffix(".db"))
    beside = old.with_name(f"{old.stem}.verified{old.suffix}")
    for folder, file in ((old, target), (beside, verified_address(target))):
        if folder == old or folder.is_dir():
            store, damaged = convert(folder, Path(file))
            if damaged:
                print(
                    f"scissordyn: {counted(len(damaged), 'damaged block')} left out, whose cases are pending", file=sys.stderr
                )
            print(f"Saved to {printable(store.address)}")
    return DONE


def _report(result: StudyResult, output: str | None, plot: Path | None) -> int:
    from scissordyn.cli.answers import show_answers
    from scissordyn.cli.output import check_folder
    from scissordyn.study.answer.report import write_figures

    if plot is not None:
        check_folder(plot, "--plot figures")
    files = [result.report(output or "report.html")]
    files += [] if plot is None else write_figures(result.study, result.dataset, result.store.address, plot)
    show_answers(result)
    for path in files:
        print(f"Saved to {path}")
    return DONE


def _replay(result: StudyResult, case: int | None, output: str | None) -> int:
    from scissordyn.study.answer.verdict import replay_command

    address = result.store.address
    if case is None or not 0 <= case < result.store.cases:
        what = "'study replay' without a case" if case is None else f"case {case}"
        raise InputError(what, f"0 to {result.store.cases - 1}", replay_command(address, 0))
    from scissordyn.cli.output import check_run
    from scissordyn.cli.show import console, show_answer, show_events, show_summary
    from scissordyn.run.store import save

    if output is not None:
        check_run(Path(output), Path(address), "-o run.nc")
    run = result.replay(case)
    if member := int(result.dataset["member"][case]):
        print(f"Case {case} is member {member}: its start differs from this run's by round-off")
    to = console()
    show_answer(run, to)
    show_events(run, EVENTS, to)
    show_summary(run, to)
    if output is not None:
        print(f"Saved to {save(run, Path(output))}")
    return {"complete": DONE, "interrupted": INTERRUPTED}.get(run.attrs["status"], UNFINISHED)
