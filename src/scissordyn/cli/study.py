"""Commands ``study`` and ``sweep``: compute a study, continue it, and show its results."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from scissordyn.cli.option import (
    BlockSize,
    CaseFile,
    Changes,
    EngineOptions,
    QueueFile,
    Scheduler,
    ThreadCount,
    WorkerCount,
    split_values,
)
from scissordyn.cli.output import (
    DONE,
    EXIT_STATUSES,
    INTERRUPTED,
    PROGRESS_TEXT,
    ROWS_MAX,
    UNFINISHED,
    bars,
    check_folder,
    check_run,
    check_store_name,
    print_words,
    say,
)
from scissordyn.cli.parameter import Argument, Option
from scissordyn.errors import InputError, command, did_you_mean, printable
from scissordyn.units import Quantity, short

if TYPE_CHECKING:
    from scissordyn.studies.answer.section import Section
    from scissordyn.studies.ask.description import Study
    from scissordyn.studies.compute.execute import Progress
    from scissordyn.studies.result import StudyResult

# words that can follow ``scissordyn study`` as actions
ACTIONS = ("status", "resume", "retry", "extend", "refine", "report", "export", "replay")

STUDY_FILE = "a study file"  # name, in error texts, of a first argument that is not an action
REFINE_OPTIONS = {
    "--vary": "--vary A.clearance='0.05..0.4 mm'",
    "--uncertain": "--uncertain A.clearance='norm(loc=0.2, scale=0.02) mm'",
    "--samples": "--samples 64",
    "--seed": "--seed 1",
    "--goal": "--goal 'minimise peak_force'",
}
"""Options that only ``study refine`` has, each with an example."""

REFINE, RESUME = "scissordyn study refine study.db", "scissordyn study resume study.db"  # commands with which examples begin

USES = {
    **{option: (("refine",), f"{REFINE} {shown} -o next.db") for option, shown in REFINE_OPTIONS.items()},
    "--points": (("extend", "refine"), "scissordyn study extend study.db --points 2048"),
    "--plot": (("report",), "scissordyn study report study.db --plot figures"),
    "--budget": ((STUDY_FILE,), "scissordyn study study.toml --budget '10 min' -o study.db"),
    "--block": ((STUDY_FILE, "refine"), "scissordyn study study.toml --block 64 -o study.db"),
    "-o": ((STUDY_FILE, "refine", "report", "export", "replay"), "scissordyn study report study.db -o report.html"),
    "a case number": (("replay",), "scissordyn study replay study.db 8"),
    **{
        f"--{name}": ((STUDY_FILE, "resume", "retry", "extend", "refine"), f"{RESUME} --{name} {value}")
        for name, value in (("threads", 2), ("workers", 2), ("scheduler", "tls://10.0.0.1:8786"), ("cluster", "cluster.yaml"))
    },
}
"""Actions of ``scissordyn study`` that use an option, and a correct use, by the option."""

# units of the rate of computed cases: text, and length of the unit of time [s]
RATE_UNITS = (("a second", 1.0), ("a minute", 60.0), ("an hour", 3600.0))


VARY_EXAMPLE = "--vary A.clearance='0.05..0.4 mm'"  # Correct option with a varied parameter, which error texts show

Varied = Annotated[
    list[str] | None,
    Option("--vary", metavar="PARAMETER=VALUES", help="A parameter and its range, levels or distribution. Repeatable."),
]
Uncertain = Annotated[
    list[str] | None,
    Option("--uncertain", metavar="PARAMETER=VALUES", help="An uncertain parameter and its distribution. Repeatable."),
]


def study(
    what: Annotated[str, Argument(help=f"A study file, or an action: {', '.join(ACTIONS)}.")],
    store: Annotated[str | None, Argument(help="The store of the study, after an action.")] = None,
    case: Annotated[int | None, Argument(help="Number of the case to replay.")] = None,
    output: Annotated[
        str | None, Option("-o", "--output", help="The store for a study file; the output file of report, export or replay.")
    ] = None,
    plot: Annotated[Path | None, Option(help="Draw the pictures of a report into this folder.")] = None,
    points: Annotated[int | None, Option(help="New number of points, for extend and refine.", min=1)] = None,
    vary: Varied = None,
    uncertain: Uncertain = None,
    samples: Annotated[int | None, Option(help="For refine: number of samples of the uncertain parameters.", min=1)] = None,
    seed: Annotated[int | None, Option(help="For refine: seed of design and samples.", min=0)] = None,
    goal: Annotated[list[str] | None, Option(help="For refine: a goal, such as 'minimise peak_force'. Repeatable.")] = None,
    budget: Annotated[
        str | None, Option(metavar="TIME", help="For a study file with [screen]: time for all runs, such as '10 min'.")
    ] = None,
    threads: ThreadCount = None,
    workers: WorkerCount = None,
    scheduler: Scheduler = None,
    cluster: QueueFile = None,
    block: BlockSize = None,
    allow_code: Annotated[
        list[Path] | None,
        Option(metavar="FILE", help="Your Python file that the study uses and that may be executed. Repeatable."),
    ] = None,
) -> int:
    where = EngineOptions(threads, workers, scheduler, cluster)
    _check_uses(
        what,
        {
            "--vary": vary,
            "--uncertain": uncertain,
            "--samples": samples,
            "--seed": seed,
            "--goal": goal,
            "--points": points,
            "--plot": plot,
            "--budget": budget,
            "--block": block,
            "-o": output,
            **{f"--{name}": value for name, value in asdict(where).items()},
            "a case number": case,
        },
    )
    if what not in ACTIONS:
        return _from_file(what, store, output, where, block, budget)
    if store is None:
        raise InputError(f"'study {what}' without a store", "the store of a study", f"scissordyn study {what} study.db")
    from scissordyn.config.studies import open_study

    result = open_study(store, allow_code=allow_code or [])
    if what in ("resume", "retry", "extend"):
        return _continue(result, what, where, points)
    if what == "refine":
        from scissordyn.config.studies import refine_study

        if output is None:
            raise InputError("'study refine' without a new store", "-o and a file", "-o next.db")
        check_store_name(output)
        ranges, drawn = values_by_parameter(vary, "--vary"), values_by_parameter(uncertain, "--uncertain")
        numbers = {"points": points, "samples": samples, "seed": seed}
        narrowed = refine_study(result.built(), vary=ranges, uncertain=drawn, goals=goal or (), **numbers)
        return compute(narrowed, output, where, block=block)
    if what == "status":
        return _status(result)
    if what == "report":
        return _report(result, output, plot)
    if what == "replay":
        return _replay(result, case, output)
    from scissordyn.studies.answer.page import damage_section

    print(f"Saved to {result.export(output or 'study.csv')}")
    _show(damage_section(result, result.store.path))
    return DONE


def _check_uses(what: str, given: dict[str, object]) -> None:
    """Raise `InputError` for a given option that the action, or a study file, does not use."""
    action = what if what in ACTIONS else STUDY_FILE
    for option, value in given.items():
        actions, shown = USES[option]
        if value is not None and action not in actions:
            words = [word if word == STUDY_FILE else f"study {word}" for word in actions]
            raise InputError(f"{option} without {actions[0]}", ", ".join(words), shown)


def _continue(result: StudyResult, what: str, where: EngineOptions, points: int | None) -> int:
    """Resume, retry or extend a study."""
    from scissordyn.studies.compute.store import damage_text

    store = result.store.path
    if damaged := result.store.damage():
        print(f"scissordyn: {damage_text(damaged)}", file=sys.stderr)
    if what != "extend":
        return compute(result.built(), store, where, retry=what == "retry")
    if result.study.optimisation is not None:
        sample = command("scissordyn", "study", "study.toml", "-o", store)
        raise InputError("'study extend' for an optimisation", "a larger number of generations in the study file", sample)
    if points is None:
        raise InputError("'study extend' without --points", "the new number of points", "--points 2048")
    return compute(result.built(), store, where, points=points)


def _from_file(
    what: str, store: str | None, output: str | None, where: EngineOptions, block: int | None, budget: str | None
) -> int:
    from scissordyn.casefile.quantity import read_quantity
    from scissordyn.config.study import read_study, study_of

    path = Path(what)
    if not path.exists():
        near = did_you_mean(what, ACTIONS)
        raise InputError(
            f"no study file or action '{what}'{near}", f"a study file in TOML, or {', '.join(ACTIONS)}", "study.toml"
        )
    if store is not None:
        raise InputError(f"a second argument '{store}' after a study file", "-o and the store", command("-o", store))
    text = read_study(path)
    if output is None:
        sample = command("scissordyn", "study", path, "-o", f"{path.stem}.db")
        raise InputError("a study without a store", "-o and a file", sample)
    check_store_name(output)
    seconds = None if budget is None else read_quantity(budget, Quantity("s", above=0.0, help="time"), "--budget '10 min'")
    return compute(study_of(text), output, where, block=block, budget=seconds)


def sweep(
    case: CaseFile,
    output: Annotated[str, Option("-o", "--output", help="File of the study's store.")],
    vary: Varied = None,
    uncertain: Uncertain = None,
    measure: Annotated[
        list[str] | None, Option(metavar="NAME", help="A measure, or 'NAME [UNIT]=FILE.py:FUNCTION'. Repeatable.")
    ] = None,
    require: Annotated[
        list[str] | None, Option(metavar="REQUIREMENT", help="A requirement, such as 'peak_force < 500 N'. Repeatable.")
    ] = None,
    design: Annotated[
        str, Option(help="Design: grid, zip, one-at-a-time, random, latin-hypercube, sobol, saltelli or morris.")
    ] = "grid",
    points: Annotated[
        int, Option("--points", "--values", metavar="N", help="Number of points of a sampled design.", min=0)
    ] = 0,
    seed: Annotated[int, Option(help="Seed of a sampled design.", min=0)] = 0,
    samples: Annotated[int, Option(help="Number of samples of the uncertain parameters at each point.", min=1)] = 1,
    members: Annotated[int, Option(help="Number of runs of each sample, with starts that differ by round-off.", min=1)] = 1,
    gradients: Annotated[bool, Option(help="Compute exact derivatives too: trends and maps need fewer points.")] = False,
    change: Changes = None,
    threads: ThreadCount = None,
    workers: WorkerCount = None,
    scheduler: Scheduler = None,
    cluster: QueueFile = None,
    block: BlockSize = None,
) -> int:
    from scissordyn.config.study import StudyText, study_of
    from scissordyn.studies.ask.design import Design, Sampling

    check_store_name(output)
    text = StudyText(
        case=str(case),
        set=tuple(change or ()),
        vary=values_by_parameter(vary, "--vary"),
        uncertain=values_by_parameter(uncertain, "--uncertain"),
        measures=tuple(measure or ()),
        require=tuple(require or ()),
        design=Design(design, points, seed),
        sampling=Sampling(samples, seed=seed),
        members=members,
        gradients=gradients,
    )
    return compute(study_of(text), output, EngineOptions(threads, workers, scheduler, cluster), block=block)


def values_by_parameter(texts: list[str] | None, option: str) -> dict[str, str]:
    """Read texts of the form ``PARAMETER=VALUES``; return the values by parameter path."""
    varied: dict[str, str] = {}
    for text in texts or ():
        path, equals, values = split_values(text)
        if not equals or not values.strip():
            raise InputError(f"wrong form of {option} {text!r}", "a parameter, an equals sign and values", VARY_EXAMPLE)
        if path in varied:
            raise InputError(f"{option} {text!r}: '{path}' is varied twice", "each parameter once")
        varied[path] = values
    return varied


def compute(
    study: Study,
    file: str,
    where: EngineOptions,
    *,
    block: int | None = None,
    retry: bool = False,
    points: int | None = None,
    budget: float | None = None,
) -> int:
    """Compute the missing cases of a study and show its results."""
    from scissordyn.run.engine import EngineError
    from scissordyn.studies.compute.execute import ProgramError
    from scissordyn.studies.compute.store import Store, StoreError
    from scissordyn.studies.result import computed

    store, options = Store(file), {"block": block, "retry": retry, "points": points, "budget": budget}
    further = f"to go on: {command('scissordyn', 'study', 'resume', file)}"
    try:
        if store.exists() and points is None and study.design.kind != "adaptive":
            store.check(study)  # before workers are started
        with where.engine(Path(store.path).parent) as engine, _progress() as progress:
            result = computed(study, file, engine=engine, progress=progress, **options)  # type: ignore[arg-type]
    except KeyboardInterrupt:
        complete = f"what is complete is in {printable(file)}; {further}"
        state = complete if store.has_content() else "nothing was computed yet; the same command starts again"
        print(f"scissordyn: interrupted; {state}", file=sys.stderr)
        return INTERRUPTED
    except (EngineError, StoreError, ProgramError) as error:
        then = further if store.has_content() else "the same command starts again"
        print(f"scissordyn: {printable(str(error))}; {then}", file=sys.stderr)
        return UNFINISHED
    show_answers(result)
    store.conclude(result.conclusion.to_plain())
    print(f"Saved to {printable(store.path)}")
    if result.counts["failed"] and not result.counts["complete"]:
        why = command("scissordyn", "study", "status", store.path)
        print(f"scissordyn: all {result.counts['failed']} cases failed; for the causes: {why}", file=sys.stderr)
        return UNFINISHED
    return DONE


@contextmanager
def _progress(seconds: float = 30.0) -> Iterator[Callable[[Progress], None]]:
    """Yield a function that shows progress: a bar on a terminal, otherwise a line at intervals.

    `seconds`: [s] between two lines of progress without a terminal.
    """
    last = [time.monotonic()]

    def line(state: Progress) -> None:
        if time.monotonic() - last[0] > seconds:
            last[0] = time.monotonic()
            print(_progress_text(state), file=sys.stderr)

    with bars("BarColumn", PROGRESS_TEXT) as update:
        if update is None:
            yield line
        else:
            update("preparing")
            yield lambda state: update(
                "preparing", completed=state.complete + state.failed, total=state.cases, description=_progress_text(state)
            )


def _progress_text(state: Progress) -> str:
    done = state.complete + state.failed
    failed = f", {state.failed / max(done, 1):.1%} failed" if state.failed else ""
    minutes, seconds = divmod(int(min(state.left, 1e9)), 60)
    left = f"{minutes // 60} h {minutes % 60} min" if minutes >= 60 else f"{minutes} min {seconds} s"
    which = f"generation {state.generation}: " if state.generation else ""
    return f"{which}{done} of {state.cases} cases{failed}, {_rate(state.rate)}, {left} left"


def _rate(rate: float) -> str:
    """Return cases per second, minute or hour as text; the unit makes the number at least one."""
    unit, seconds = next(((unit, size) for unit, size in RATE_UNITS if rate * size >= 1.0), RATE_UNITS[-1])
    return f"{rate * seconds:.3g} {unit}"


def _status(result: StudyResult) -> int:
    from scissordyn.studies.answer.page import cause_sections, damage_section

    counts, study, times, store = result.counts, result.study, result.store.times(), result.store.path
    states = ", ".join(f"{count} {name}" for name, count in counts.items())
    print(f"{study.points} points x {study.per_point} cases: {states}; blocks of {result.store.block}")
    worked, cases = float(times["seconds"].sum()), float(times["cases"].sum())
    if cases and worked:
        integration = float(times["integration_seconds"].sum())
        left = (
            f"; about {counts['pending'] * worked / cases / 60.0:.3g} minutes left for one worker" if counts["pending"] else ""
        )
        outside = f"{1.0 - integration / worked:.0%} of it outside the integration"
        print(f"{short(worked / cases, 's')} for each case on one worker, {outside}{left}")
    for part in (*cause_sections(result, store, ROWS_MAX), damage_section(result, store)):
        _show(part)
    if counts["pending"]:
        print(f"To go on: {command('scissordyn', 'study', 'resume', store)}")
    return DONE


def _report(result: StudyResult, output: str | None, plot: Path | None) -> int:
    from scissordyn.studies.answer.report import write_figures

    check_folder(plot, "--plot figures")
    files = [result.report(output or "report.html")]
    files += [] if plot is None else write_figures(result, plot)
    show_answers(result)
    print(*(f"Saved to {path}" for path in files), sep="\n")
    return DONE


def _replay(result: StudyResult, case: int | None, output: str | None) -> int:
    from scissordyn.studies.answer.page import replay_command

    file = result.store.path
    if case is None or not 0 <= case < result.store.cases:
        what = "'study replay' without a case" if case is None else f"case {case}"
        raise InputError(what, f"0 to {result.store.cases - 1}", replay_command(file, 0))
    from scissordyn.cli.show import show_run
    from scissordyn.record.store import save

    target = None if output is None else Path(output)
    check_run(target, Path(file), "-o run.nc")
    run = result.replay(case)
    if member := int(result.dataset["member"][case]):
        print(f"Case {case} is member {member}: its start differs from this run's by round-off")
    show_run(run, ROWS_MAX)
    if target is not None:
        print(f"Saved to {save(run, target)}")
    return EXIT_STATUSES[run.attrs["status"]]


def show_answers(result: StudyResult) -> None:
    """Print the results of a study, section by section."""
    from scissordyn.studies.answer.page import page

    for part in page(result, result.store.path, ROWS_MAX):
        _show(part)


def _show(part: Section) -> None:
    """Print a section; each command is on a separate line below its purpose."""
    if part.title:
        say(part.title, style="bold")
    say(*part.lines)
    if part.head[-1:] == ("command",):
        for *cells, typed in part.rows:
            print("; ".join(printable(f"{head} {cell}".lstrip()) for head, cell in zip(part.head[:-1], cells, strict=True)))
            print(f"  {typed}")
    elif part.rows:
        print_words(part.head, part.rows)
    for note in part.notes if part.rows else ():
        print(note)
