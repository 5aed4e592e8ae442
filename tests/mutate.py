"""Change one number, sign, term, bound or comparison of the package, and see whether a test notices.

Run by hand: ``python tests/mutate.py [FILE ...] [--write]``, and ``python tests/mutate.py --drawn [--write]``.

The first command multiplies numbers by 1.01, for every law, controller and component in the files of `TARGETS`: every float but
zero, every exponent, every parameter that a kernel reads, and every number that a law passes to its kernel. The second command
draws changes of other kinds (`mutators.KINDS`) at random in the subpackages of `DRAWN_CHANGES`. Each change is made alone: a
changed kernel runs as plain Python in a copy of the package, or is compiled again if the tests simulate; other changes use the
compiled library.

Every change of a number must be noticed by a test, or be listed in `EQUIVALENT` with a reason. Of the drawn changes all but
`UNNOTICED_MAX` must be noticed or be listed in `SAME_ANSWER`. Otherwise the script ends with status 1. ``--write`` updates its
part of the page in docs/decisions/measured. An interrupted run continues as long as the sources are the same.
"""

import argparse
import ast
import hashlib
import importlib
import os
import shutil
import signal
import sys
import tempfile
import traceback
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

# kernels run as plain Python unless a target says that its tests need the compiler
os.environ["SCISSORDYN_ENGINE"] = "python"
import pytest

# imported once, before the processes that try the mutations are forked
for _library in ("scipy.integrate", "scipy.linalg", "scipy.optimize", "scipy.spatial", "xarray"):
    importlib.import_module(_library)

from mutators import KINDS, Change, Mutator, changed, changes_of, drawn
from noticing import DRAWN_CHANGES, EQUIVALENT, NAMED, SAME_ANSWER, SEED, UNNOTICED_MAX, of_runs, tests_of

# Subpackages with kernels, whose changes need a compilation
KERNEL_SUBPACKAGES = ("plugin", "laws", "control", "components", "mechanics", "integrate", "plan")
HERE = Path(__file__).parent  # Folder of the tests
PACKAGE = HERE.parent / "src" / "scissordyn"  # Folder of the package's sources
PAGE = HERE.parent / "docs" / "decisions" / "measured" / "mutations.md"  # Page with the results
LOG = HERE.parent / "out" / "mutations.log"  # File of the results so far, with which an interrupted run continues
PATIENCE = 400  # [s] longest time of a test file; one that takes longer has noticed the change, which may cause an endless loop


@dataclass(frozen=True)
class Target:
    """Files with kernels, and the tests that must notice changes of their numbers."""

    files: tuple[str, ...]  # Patterns of paths in the package
    tests: tuple[str, ...]  # Test files in tests/
    by_name: bool = False  # Run only tests with the name of a law in the file, or of a law that imports it
    compiled: bool = False  # The tests need the compiler


COMPONENT_TESTS = ("components/test_closed_forms.py",)  # Test files that must notice changes of components

# Files in which numbers are changed, with the test files that must notice this
TARGETS = (
    Target(("laws/elastic/[!q]*.py",), ("laws/test_elastic.py", "laws/test_energy.py"), by_name=True),
    Target(("laws/elastic/quadrature.py",), ("laws/test_energy.py",), compiled=True),
    Target(("laws/damping/[!s]*.py",), ("laws/test_damping.py",), by_name=True),
    Target(("laws/damping/standard_linear_solid.py",), ("laws/test_relaxation.py",), compiled=True),
    Target(("laws/friction/*.py",), ("laws/test_bristle.py", "laws/test_friction.py"), by_name=True),
    Target(("control/delayed/*.py", "control/tracking/*.py", "control/signal.py"), ("control/test_torque.py",)),
    # springs, dampers, motors, loads, latches, end stops of angles and of travel
    Target(
        ("components/[!_abcdptu]*.py", "components/a*_stop.py", "components/bushing.py", "components/c*_*.py"), COMPONENT_TESTS
    ),
    Target(
        ("components/cable.py", "components/torque.py", "components/torsion_spring.py", "components/travel_stop.py"),
        COMPONENT_TESTS,
    ),
    Target(("components/tape_spring.py",), (*COMPONENT_TESTS, "components/test_tape_spring.py")),
    Target(("components/beam.py",), ("components/test_beam.py",)),
    Target(("components/clutch.py",), ("components/test_clutch.py",), compiled=True),
    # the corners of a block in a clearance guide: where they are, and how their gaps and moment arms follow
    Target(
        ("model/clearance.py", "mechanics/plane_contact.py"),
        ("mechanics/test_plane_contact.py", "test_clearance_guide.py"),
        compiled=True,
    ),
)


@dataclass(frozen=True)
class Mutation:
    """Change of one number of a source file."""

    file: str  # Path of the file in the package
    index: int  # Index of the number in the file
    line: int
    owner: str  # Name of the class with the number, or ""
    function: str  # Name of the function with the number, or ""
    text: str  # Number before the change
    which: int  # Count of equal numbers before it in the function

    @property
    def reason(self) -> str:
        """Reason why the change has no effect; "" if it has one."""
        key = (self.file, self.function, self.text)
        return EQUIVALENT.get((*key, self.which) if self.which else key, "")


@dataclass(frozen=True)
class Job:
    """Tests to run on a changed file, or on the unchanged package."""

    mutation: Mutation | Change | None
    tests: tuple[str, ...]  # Test files in tests/
    compiled: bool  # The tests need the compiler
    chosen: str  # Option -k of pytest that selects some of the tests; "" for all
    in_place: bool = False  # The file has no kernels, so that the compiled kernels of the package are used

    @property
    def digest(self) -> str:
        """Hash of the job and of the sources that it depends on."""
        # a line says where to look, no more
        where = replace(self, mutation=self.mutation and replace(self.mutation, line=0))
        return hashlib.sha256(f"{where!r}{sources(self.tests)}".encode()).hexdigest()


def above_kernels(file: str) -> bool:
    """Return whether a file has no kernels and no part of them."""
    return not file.startswith(KERNEL_SUBPACKAGES)


def by_name(file: str) -> bool:
    """Return whether the kernels of a file read their parameters by name."""
    return file.startswith(("components/", "control/", "laws/"))


def mutations_of(file: str) -> list[Mutation]:
    everything = Mutator(named=by_name(file))
    everything.visit(ast.parse((PACKAGE / file).read_text()))
    texts = [found[1:] for found in everything.found]
    return [Mutation(file, index, *found, texts[:index].count(found[1:])) for index, found in enumerate(everything.found)]


def mutated(mutation: Mutation | Change) -> str:
    if isinstance(mutation, Change):
        return changed(PACKAGE, mutation)
    tree = Mutator(mutation.index, by_name(mutation.file)).visit(ast.parse((PACKAGE / mutation.file).read_text()))
    return ast.unparse(ast.fix_missing_locations(tree))


def law_names() -> tuple[dict[str, dict[str, str]], dict[str, set[str]]]:
    """Return the names of laws by file and class, and the files of the room that import a file directly or indirectly."""
    names: dict[str, dict[str, str]] = {}
    imports: dict[str, set[str]] = {}
    for path in sorted((PACKAGE / "laws").rglob("*.py")):
        file, tree = str(path.relative_to(PACKAGE)), ast.parse(path.read_text())
        names[file] = {
            node.name: keyword.value.value
            for node in tree.body
            if isinstance(node, ast.ClassDef)
            for call in node.decorator_list
            if isinstance(call, ast.Call)
            for keyword in call.keywords
            if keyword.arg == "name" and isinstance(keyword.value, ast.Constant)
        }
        modules = [node for node in ast.walk(tree) if isinstance(node, ast.ImportFrom) and node.module]
        imports[file] = {
            f"{name.removeprefix('scissordyn.').replace('.', '/')}.py"
            for node in modules
            for name in (node.module, *(f"{node.module}.{alias.name}" for alias in node.names))
            if name.startswith("scissordyn.laws.")
        }
    importers = {file: {file} for file in names}
    grown = True
    while grown:
        grown = False
        for file, used in imports.items():
            for one in used & importers.keys():
                if not importers[file] <= importers[one]:
                    importers[one] |= importers[file]
                    grown = True
    return names, importers


def selection(mutation: Mutation, names, importers) -> str:
    """Return pytest's option that selects tests of the law with the number, or of laws that use this law."""
    own = names[mutation.file].get(mutation.owner)
    found = {own} if own else {name for file in importers[mutation.file] for name in names[file].values()}
    words = sorted({word for name in found - {"none"} for word in (name, name.replace("-", "_"))})
    return f"({' or '.join(words)}) and not whole_table" if words else "not whole_table"


def start(copy: Path, job: Job) -> int:
    """Run the tests of a job on the copy in a process of its own; returns its id."""
    process = os.fork()
    if process:
        return process
    # nothing of this process may go on here, whatever happens
    try:
        signal.alarm(PATIENCE)
        with Path(copy, "output").open("w") as output:
            os.dup2(output.fileno(), 1)
            os.dup2(output.fileno(), 2)
        os.chdir(HERE.parent)
        os.environ |= {"PYTHONPATH": str(copy), "PYTHONDONTWRITEBYTECODE": "1"}
        options = ["-x", "-q", "-p", "no:cacheprovider", *(str(HERE / test) for test in job.tests)]
        options += ["-k", job.chosen] if job.chosen else []
        if job.in_place and job.mutation:
            # the package itself, with its library
            altered = PACKAGE / job.mutation.file, copy / "scissordyn" / job.mutation.file
            os.environ |= dict(zip(("ALTERED", "ALTERED_FROM"), map(str, altered), strict=True))
            options += ["-p", "tests.altered"]
        if job.in_place:
            os.environ["PYTHONPATH"] = str(PACKAGE.parent)
        if job.compiled or job.in_place:
            os.environ["SCISSORDYN_ENGINE"] = ""
            os.execv(sys.executable, [sys.executable, "-m", "pytest", *options])
        sys.dont_write_bytecode = True
        sys.path[:0] = [str(copy), str(HERE.parent)]
        status = int(pytest.main(options))
        sys.stdout.flush()
    except BaseException:
        traceback.print_exc()
        status = int(pytest.ExitCode.INTERNAL_ERROR)
    sys.stderr.flush()
    os._exit(status)


def fails(status: int, copy: Path) -> bool:
    """Return whether a process that has ended had a failing test."""
    if os.WIFSIGNALED(status) and os.WTERMSIG(status) == signal.SIGALRM:
        return True
    code = os.waitstatus_to_exitcode(status)
    # 2 is an error while tests are collected: the file no longer loads
    if code not in (0, 1, 2):
        raise RuntimeError(f"pytest ended with {code}\n{Path(copy, 'output').read_text()[-4000:]}")
    return code != 0


def judge(jobs: list[Job], workers: int, done: dict[str, bool], keep: Callable[[Job, bool], None]) -> None:
    """Run the jobs that are not in `done`, and pass each to `keep` with whether its tests failed."""
    left = iter([job for job in jobs if job.digest not in done])
    with tempfile.TemporaryDirectory() as folder:
        copies = [Path(folder, str(k)) for k in range(workers)]
        for copy in copies:
            shutil.copytree(PACKAGE, copy / "scissordyn", ignore=shutil.ignore_patterns("__pycache__"))
        running: dict[int, tuple[Path, Job]] = {}
        try:
            while True:
                while copies and (job := next(left, None)) is not None:
                    copy = copies.pop()
                    if job.mutation:
                        (copy / "scissordyn" / job.mutation.file).write_text(mutated(job.mutation))
                    running[start(copy, job)] = copy, job
                if not running:
                    return
                process, status = os.wait()
                copy, job = running.pop(process)
                if job.mutation:
                    (copy / "scissordyn" / job.mutation.file).write_text((PACKAGE / job.mutation.file).read_text())
                copies.append(copy)
                keep(job, fails(status, copy))
        finally:
            for process in running:
                os.kill(process, signal.SIGTERM)


def jobs_of(targets: tuple[Target, ...]) -> list[Job]:
    """Return jobs for all mutations with their tests, after jobs with the same tests on the unchanged package."""
    names, importers = law_names()
    tried = []
    for target in targets:
        for file in sorted({str(path.relative_to(PACKAGE)) for pattern in target.files for path in PACKAGE.glob(pattern)}):
            for mutation in mutations_of(file):
                chosen = selection(mutation, names, importers) if target.by_name else ""
                tried.append(Job(mutation, target.tests, target.compiled, chosen))
    sound = dict.fromkeys(replace(job, mutation=None) for job in tried)
    return [*sound, *tried]


@cache
def code_of(file: Path) -> str:
    """Return the code of a file without comments, and without the docstrings that no code reads."""
    tree = ast.parse(file.read_text())
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef) and ast.get_docstring(node) is not None:
            node.body = node.body[1:] or [ast.Pass()]
    return ast.unparse(tree)


@cache
def sources(tests: tuple[str, ...]) -> str:
    """Return a digest of the package, of some test files and of shared test code; stored results are valid for this digest."""
    files = [*PACKAGE.rglob("*.py"), *(HERE / test for test in tests), HERE / "conftest.py", *(HERE / "reference").glob("*.py")]
    files += [helper for test in tests for helper in (HERE / test).parent.glob("[!t]*.py")]
    text = "".join(f"{file.relative_to(HERE.parent)}\n{code_of(file)}" for file in sorted(files))
    return hashlib.sha256(text.encode()).hexdigest()


def verdict(mutation: Mutation, failing: bool) -> str:
    """Return one word for the table: the result of a mutation."""
    return "noticed" if failing else "equivalent" if mutation.reason else "not noticed"


def page(found: list[tuple[Mutation, str]]) -> str:
    """Return the text of the page: table, equivalent mutations, and mutations that no test noticed."""
    lines = ["| file | numbers | noticed | equivalent | not noticed |", "| --- | ---: | ---: | ---: | ---: |"]
    for file in dict.fromkeys(mutation.file for mutation, _ in found):
        verdicts = [verdict for mutation, verdict in found if mutation.file == file]
        counts = [len(verdicts), *(verdicts.count(word) for word in ("noticed", "equivalent", "not noticed"))]
        lines.append(f"| {file} | {' | '.join(map(str, counts))} |")
    for word, head in (("equivalent", "Equivalent:"), ("not noticed", "Not noticed:")):
        rows = []
        for mutation, verdict in found:
            if verdict == word:
                reason = mutation.reason and f": {mutation.reason}"
                rows.append(f"* `{mutation.file}`, {mutation.function or 'module'}, `{mutation.text}`{reason}")
        if rows:
            lines += ["", head, "", *dict.fromkeys(rows)]
    return "\n".join([*lines, "", f"{len(found)} mutations."])


def kept(file: Path) -> dict[str, bool]:
    file.parent.mkdir(parents=True, exist_ok=True)
    lines = file.read_text().split("\n") if file.exists() else []
    # the last line may be half-written
    return {line[:64]: line[65:] == "fails" for line in lines if line[65:] in ("fails", "passes")}


def try_drawn(
    files: list[str], workers: int, done: dict[str, bool], keep: Callable[[Job, bool], None]
) -> list[tuple[Change, str]]:
    """Return each drawn or named change with the first test file that notices it, or "" if none does."""
    everything = [*drawn(PACKAGE, DRAWN_CHANGES, SEED), *named()]
    changes = [each for each in everything if not files or each.file.startswith(tuple(files))]
    tests = {change: tests_of(change.file) for change in changes}
    asked = dict.fromkeys(test for each in tests.values() for test in each)
    noticed: dict[Change, str] = {}
    above = {test: above_kernels(change.file) for change, each in tests.items() for test in each}
    judge([Job(None, (file,), of_runs(file), "", above[file]) for file in asked], workers, done, keep)
    for turn in range(max(map(len, tests.values()))):
        unnoticed = (each for each in changes if each not in noticed and turn < len(tests[each]))
        asking = ((each, tests[each][turn]) for each in unnoticed)
        jobs = [Job(each, (test,), of_runs(test), "", above_kernels(each.file)) for each, test in asking]
        judge(jobs, workers, done, keep)
        noticed |= {job.mutation: job.tests[0] for job in jobs if done[job.digest] and isinstance(job.mutation, Change)}
    return [(change, noticed.get(change, "")) for change in changes]


def named() -> list[Change]:
    return [
        next(each for each in changes_of(PACKAGE, file) if (each.function, each.kind, each.text) == (function, kind, text))
        for file, function, kind, text in NAMED
    ]


def reason_of(change: Change) -> str:
    """Return the reason why a change gives the same answers, empty if a test should notice it."""
    return SAME_ANSWER.get((change.file, change.function, change.kind, change.text), "")


def drawn_page(found: list[tuple[Change, str]]) -> str:
    """Return the page of the changes that were drawn, with the tests that noticed them."""
    lines = ["| | file | function | kind | expression | noticed by |", "| ---: | --- | --- | --- | --- | --- |"]
    for number, (change, test) in enumerate(found, start=1):
        text = change.text if len(change.text) <= 70 else f"{change.text[:67]}..."
        said = f"tests/{test}" if test else f"none: {reason_of(change)}"
        where = f"{change.file}:{change.line} | {change.function or 'module'}"
        lines.append(f"| {number} | {where} | {change.kind} | `{text.replace('|', '/')}` | {said} |")
    counts = ", ".join(f"{subpackage} {count}" for subpackage, count in DRAWN_CHANGES.items())
    kinds = "".join(f"* {kind}: {what}\n" for kind, what in KINDS.items())
    same = sum(not test and reason_of(change) != "" for change, test in found)
    noticed = sum(test != "" for _, test in found)
    said = f"The last {len(NAMED)} are named: no test noticed them once."
    head = (
        f"Drawn with seed {SEED}: {counts}. Each kind of change in a subpackage is as likely as any other. {said}\n\n{kinds}\n"
    )
    counts = f"{noticed} noticed, {same} give the same answers, {len(found) - noticed - same} not noticed"
    return f"{head}{chr(10).join(lines)}\n\n{len(found)} changes: {counts}."


def write(part: str, text: str) -> None:
    """Keep a part of the page, and the other as it is."""
    heads = {"numbers": "## Numbers times 1.01", "drawn": "## Changes drawn at random"}
    old = PAGE.read_text(encoding="utf-8") if PAGE.exists() else ""
    parts = {name: old.split(head)[1].split("\n## ")[0].strip() if head in old else "" for name, head in heads.items()}
    package = sources(())
    parts[part] = f"{text}\n\nOf the package whose sources have the digest {package[:12]} (`sources(())` of the script)."
    body = "\n\n".join(f"{heads[name]}\n\n{text}" for name, text in parts.items() if text)
    said = "Written by `python tests/mutate.py --write`, a part at a time."
    PAGE.write_text(f"# mutations\n\n{said}\n\n{body}\n", encoding="utf-8")


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("files", nargs="*", help="files of the package, e.g. laws/friction/lugre.py; with --drawn, subpackages")
    parser.add_argument("--tests", nargs="+", help="test files below tests/ for the files, if they are in no target")
    parser.add_argument("--drawn", action="store_true", help="changes drawn at random in the place of numbers")
    parser.add_argument("--workers", type=int, default=2, help="tests that run at once")
    parser.add_argument("--write", action="store_true", help="keep the table in docs/decisions/measured")
    parser.add_argument("--log", type=Path, default=LOG, help="file of what is done; a run on the same sources goes on from it")
    given = parser.parse_args()
    targets = TARGETS
    if given.files and given.tests:
        targets = (Target(tuple(given.files), tuple(given.tests)),)
    elif given.files:
        targets = tuple(
            replace(target, files=(file,))
            for target in TARGETS
            for file in given.files
            if any((PACKAGE / file) in PACKAGE.glob(pattern) for pattern in target.files)
        )
    done = kept(given.log)

    def keep(job: Job, failing: bool) -> None:
        if job.mutation is None and failing:
            raise RuntimeError(f"{job}: the tests fail on the package as it is")
        done[job.digest] = failing
        with given.log.open("a") as log:
            log.write(f"{job.digest} {'fails' if failing else 'passes'}\n")
        if job.mutation:
            where = f"{job.mutation.file}:{job.mutation.line} {job.mutation.function} {job.mutation.text}"
            print(f"{where}: {'noticed' if failing else 'passes'} by {' '.join(job.tests)}", flush=True)

    if given.drawn:
        seen = try_drawn(given.files, given.workers, done, keep)
        text = drawn_page(seen)
        print(text)
        if given.write:
            write("drawn", text)
        return 1 if sum(not test and not reason_of(change) for change, test in seen) > UNNOTICED_MAX else 0
    jobs = jobs_of(targets)
    judge(jobs, given.workers, done, keep)
    found = [(job.mutation, verdict(job.mutation, done[job.digest])) for job in jobs if job.mutation]
    text = page(found)
    print(text)
    if given.write:
        write("numbers", text)
    return 1 if any(said == "not noticed" for _, said in found) else 0


if __name__ == "__main__":
    sys.exit(main())
