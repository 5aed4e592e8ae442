"""Compute results in parallel, each once, and store them as files."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Generator, Hashable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, Protocol, TypeVar, cast

import xarray as xr

from scissordyn.errors import InputError, ScissordynError
from scissordyn.file.provenance import DISPLAY_SUBPACKAGES, PACKAGE
from scissordyn.file.provenance import provenance as made_with
from scissordyn.record.store import load, save
from scissordyn.run.engine import Engine, error_text, outcomes

Progress = Callable[[str, int, int], None]  # Function that shows the kind of work, number of finished jobs and total number

PRESENTATION_SOURCES = (
    *DISPLAY_SUBPACKAGES,
    "figure",
    *(
        f"{name}.py"
        for name in (
            *("beyond", "explanation", "figures", "open_answers", "page"),
            *("parameters", "parameter_sets_page", "report", "reproduce", "results"),
        )
    ),
)
"""Sources that only draw and write what was computed: a change of these does not make stored results outdated."""


class Job(Hashable, Protocol):
    """Computation whose result is stored in a file."""

    @property
    def name(self) -> str:
        """Name of the job in file names."""

    @property
    def toml(self) -> str:
        """Text of all inputs of the result, except the sources."""


Work = TypeVar("Work", bound=Job)
Task = TypeVar("Task")
Value = TypeVar("Value")


def provenance() -> str:
    """Return versions and a digest of the sources that affect results, as JSON; results with equal texts are equal."""
    return made_with(PRESENTATION_SOURCES, (PACKAGE, Path(__file__).parent))


@dataclass(frozen=True)
class Jobs:
    """Jobs of one kind, with the functions that compute, store and read their results."""

    jobs: Sequence[Any]  # Jobs with distinct names
    # Function from a job to its result; the engine calls it on other threads or in other processes
    compute: Callable[[Any], xr.Dataset]
    folder: Path  # Folder with a NetCDF file for each finished job
    what: str = "runs"  # Kind of work for `progress`


def fetch(
    jobs: Sequence[Work],
    compute: Callable[[Work], xr.Dataset],
    folder: Path,
    *,
    what: str = "runs",
    engine: Engine = None,
    progress: Progress | None = None,
) -> dict[Work, xr.Dataset]:
    """Return the results of jobs from the files in a folder; compute missing and outdated results first."""
    (found,) = fetch_all(Jobs(jobs, compute, folder, what), engine=engine, progress=progress)
    return found


def fetch_all(*asked: Jobs, engine: Engine = None, progress: Progress | None = None) -> tuple[dict[Any, xr.Dataset], ...]:
    """Return the results of several kinds of jobs, a dictionary per kind; compute missing ones of all kinds in parallel."""
    found: list[dict[Any, xr.Dataset]] = []
    missing: list[tuple[int, Any]] = []
    for kind, each in enumerate(asked):
        each.folder.mkdir(parents=True, exist_ok=True)
        wanted = tuple(dict.fromkeys(each.jobs))
        found.append({job: result for job in wanted if (result := _stored(job, each.folder)) is not None})
        missing += [(kind, job) for job in wanted if job not in found[kind]]
    work = partial(_compute_and_save, tuple((each.compute, each.folder) for each in asked))
    for (kind, job), _ in compute_tasks(work, missing, what=lambda task: asked[task[0]].what, engine=engine, progress=progress):
        found[kind][job] = load(_path(job, asked[kind].folder))
    return tuple({job: each[job] for job in dict.fromkeys(kind.jobs)} for kind, each in zip(asked, found, strict=True))


def compute_tasks(
    compute: Callable[[Task], Value],
    tasks: Sequence[Task],
    *,
    what: Callable[[Task], str],
    engine: Engine = None,
    progress: Progress | None = None,
    named: Callable[[Task], str] = lambda _: "",
) -> Iterator[tuple[Task, Value]]:
    """Compute tasks in parallel; yield each with its result when it is finished. The first error ends the computation.

    `what` returns the kind of a task for `progress`, `named` the text before the error of a task.
    """
    of, count = Counter(map(what, tasks)), Counter[str]()
    results = outcomes(engine, compute, tasks)
    try:
        for done in results:
            if done.error is not None:
                raise ScissordynError(named(done.task) + error_text(done.error)) from done.error
            yield done.task, cast(Value, done.value)
            kind = what(done.task)
            count[kind] += 1
            if progress is not None:
                progress(kind, count[kind], of[kind])
    finally:
        if isinstance(results, Generator):
            results.close()  # tasks in progress stop at once, and not only after the error is shown


def _path(job: Job, folder: Path) -> Path:
    return folder / f"{job.name}.nc"


def _stored(job: Job, folder: Path) -> xr.Dataset | None:
    """Return the stored result of a job if inputs and sources are unchanged; None otherwise."""
    try:
        result = load(_path(job, folder))
    except InputError:
        return None
    return result if (result.attrs.get("case"), result.attrs.get("provenance")) == (job.toml, provenance()) else None


def _compute_and_save(kinds: Sequence[tuple[Callable[[Any], xr.Dataset], Path]], task: tuple[int, Any]) -> str:
    (compute, folder), job = kinds[task[0]], task[1]
    result = compute(job).assign_attrs(case=job.toml, provenance=provenance())
    return str(save(result, _path(job, folder), replace_broken=True))
