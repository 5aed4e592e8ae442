"""Multiply one number of a kernel by 1.01 and see whether a physics test notices: for every law, controller and component.

Run by hand: ``python tests/mutate.py [FILE ...] [--write]``. The numbers are every float but zero, every exponent, every
parameter that a kernel reads (p[k], or by its name in a component) and every number that a law hands to its kernel, in the
files of `TARGETS`. Each is changed alone, in a copy of the package. Every change has to be noticed or to stand in
`EQUIVALENT` with a reason; otherwise the script ends with status 1. ``--write`` keeps the table in docs/decisions/measured.
A run that was stopped goes on where it was when it is started again on the same sources.
"""

from __future__ import annotations

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
from pathlib import Path

# kernels run as plain Python unless a target says that its tests need the compiler; numba reads this when it is imported
os.environ["NUMBA_DISABLE_JIT"] = "1"
import pytest

# imported once, before the processes that try the mutations are forked
for _library in ("numba", "scipy.integrate", "scipy.linalg", "scipy.optimize", "scipy.spatial", "xarray"):
    importlib.import_module(_library)

HERE = Path(__file__).parent
PACKAGE = HERE.parent / "src" / "scissordyn"
PAGE = HERE.parent / "docs" / "decisions" / "measured" / "mutations.md"
LOG = HERE.parent / "out" / "mutations.log"
FACTOR = 1.01
INPUTS = {
    *("length", "rate", "angle", "speed", "travel", "x", "y", "cosine", "sine", "x_rate", "y_rate", "cosine_rate", "sine_rate"),
    *("mode", "approach_speed", "factor", "depth", "twist", "table", "first", "count", "straight", "negative", "positive"),
    *("t", "q", "z", "dz", "p", "follows"),
}
"""Arguments of kernels that are no parameters: coordinates, rates, states, rows, counts and switches."""

PATIENCE = 900
"""A test that takes longer [s] has noticed, too: a mutation can keep a loop from ending."""


@dataclass(frozen=True)
class Target:
    """Kernel files and the tests that have to notice their mutations.

    Parameters
    ----------
    files : tuple of str
        Patterns below the package.
    tests : tuple of str
        Test files below tests/.
    by_name : bool
        Whether only tests that carry the name of a law in the file, or of one that imports it, are run.
    compiled : bool
        Whether the tests need the compiler.
    """

    files: tuple[str, ...]
    tests: tuple[str, ...]
    by_name: bool = False
    compiled: bool = False


COMPONENT_TESTS = ("component/test_closed_forms.py",)

TARGETS = (
    Target(("laws/elastic/[!q]*.py",), ("laws/test_elastic.py", "laws/test_energy.py"), by_name=True),
    Target(("laws/elastic/quadrature.py",), ("laws/test_energy.py",), compiled=True),
    Target(("laws/damping/*.py",), ("laws/test_damping.py",), by_name=True),
    Target(("laws/friction/*.py",), ("laws/test_bristle.py", "laws/test_friction.py"), by_name=True),
    Target(("control/delayed/*.py", "control/tracking/*.py", "control/signal.py"), ("control/test_torque.py",)),
    # springs, dampers, motors, loads, latches, end stops of angles and of travel
    Target(("component/[!_acdpu]*.py", "component/a*_stop.py", "component/c*_*.py", "component/cable.py"), COMPONENT_TESTS),
    # the corners of a block in a clearance guide: where they are, and how their gaps and moment arms follow
    Target(
        ("model/guide_clearance.py", "mechanics/plane_contact.py"),
        ("mechanics/test_plane_contact.py", "test_clearance_guide.py"),
        compiled=True,
    ),
)

EQUIVALENT: dict[tuple[str | int, ...], str] = {
    ("component/force.py", "parameters", "float(self.follows)"): "a switch",
    ("component/latch.py", "", "1e-06"): "how near counts as at the angle",
    ("laws/elastic/logarithmic.py", "_pieces", "2.0"): "first guess of Newton's method, which converges from above",
    ("laws/elastic/logarithmic.py", "_pieces", "1.0", 1): "slope in Newton's method, whose limit is the same",
    ("laws/elastic/quadrature.py", "", "1e-14"): "tolerance below rounding",
    ("laws/elastic/quadrature.py", "user_energy", "1.0"): "only in the tolerance",
    ("laws/damping/exact.py", "", "700.0"): "end of a bracket far beyond the root",
    ("laws/damping/exact.py", "", "0.1"): "where a series takes over that agrees to rounding",
    ("laws/damping/none.py", "parameters", "self.factor"): "zero",
    ("laws/friction/bristle.py", "", "1000000.0"): "constant damping to rounding, either way",
    ("laws/friction/dahl.py", "force", "p[2]"): "shortcut for n = 1",
    ("laws/friction/dahl.py", "force", "1.0", 2): "shortcut for n = 1",
    ("laws/friction/stribeck.py", "sliding_coefficient", "p[3]"): "shortcut for gamma = 2",
    ("laws/friction/stribeck.py", "sliding_coefficient", "2.0"): "shortcut for gamma = 2",
}
"""Mutations that change no answer beyond rounding, with the reason: by file, function, number and, after the first, which."""


@dataclass(frozen=True)
class Mutation:
    """One number that is changed.

    Parameters
    ----------
    file : str
        Below the package.
    index : int
        Which number of the file.
    line : int
    owner : str
        Class in which it stands, empty outside.
    function : str
        Function in which it stands, empty outside.
    text : str
        The number.
    which : int
        How many times the function had it before.
    """

    file: str
    index: int
    line: int
    owner: str
    function: str
    text: str
    which: int

    @property
    def reason(self) -> str:
        """Why it changes nothing, empty if it does."""
        key = (self.file, self.function, self.text)
        return EQUIVALENT.get((*key, self.which) if self.which else key, "")


@dataclass(frozen=True)
class Job:
    """Tests to run on a mutation, or on the package as it is.

    Parameters
    ----------
    mutation : Mutation or None
    tests : tuple of str
        Test files below tests/.
    compiled : bool
        Whether they need the compiler.
    chosen : str
        Which of them, as pytest's option -k; all if empty.
    """

    mutation: Mutation | None
    tests: tuple[str, ...]
    compiled: bool
    chosen: str

    @property
    def digest(self) -> str:
        """Names what is done."""
        return hashlib.sha256(repr(self).encode()).hexdigest()


class Mutator(ast.NodeTransformer):
    """Counts the numbers of a file and changes the one with a given index."""

    def __init__(self, target: int | None = None, named: bool = False):
        self.target, self.named, self.found, self.owner, self.function = target, named, [], "", ""
        self.parameters: set[str] = set()

    def number(self, node):
        """The node, scaled if it is the one."""
        self.found.append((node.lineno, self.owner, self.function, ast.unparse(node)))
        if len(self.found) - 1 != self.target:
            return node
        return ast.BinOp(ast.Constant(FACTOR), ast.Mult(), node)

    def visit_ClassDef(self, node):
        """Remember whose methods these are."""
        self.owner = node.name
        node.body = [self.visit(part) for part in node.body]
        self.owner = ""
        return node

    def visit_FunctionDef(self, node):
        """Only the body counts, and not that of __post_init__, which checks."""
        if node.name == "__post_init__":
            return node
        outer, self.function = self.function, node.name
        if self.named and not self.owner:
            self.parameters = {argument.arg for argument in node.args.args} - INPUTS
        node.body = [self.visit(part) for part in node.body]
        self.function, self.parameters = outer, set()
        return node

    def visit_Name(self, node):
        """A parameter of a component, which its kernel reads by name."""
        return self.number(node) if node.id in self.parameters and isinstance(node.ctx, ast.Load) else node

    def visit_AnnAssign(self, node):
        """Fields of a class are declarations."""
        return node if self.owner else self.generic_visit(node)

    def visit_Raise(self, node):
        """Nor are messages physics."""
        return node

    def visit_Call(self, node):
        """Units and bounds are declarations, and a count of table entries is no measure."""
        if not isinstance(node.func, ast.Name) or not (self.named or node.func.id == "Quantity"):
            return self.generic_visit(node)
        if node.func.id not in ("Quantity", "component", "int"):
            plain = node.func.id in ("min", "max", "abs")
            node.args = [self.visit(part) if plain or not self.passed_on(part) else part for part in node.args]
        return node

    def visit_Attribute(self, node):
        """A number of a contact's record, which the mechanics read by its name."""
        record = ast.unparse(node.value) in ("p", "S.parameters.contact[j]")
        return self.number(node) if record and isinstance(node.ctx, ast.Load) else self.generic_visit(node)

    def passed_on(self, node) -> bool:
        """Whether an argument is a parameter that another function of the file reads."""
        return isinstance(node, ast.Name) and node.id in self.parameters and self.function in ("force", "gap", "switch")

    def visit_Compare(self, node):
        """A parameter that is compared with zero has the same sign when it is scaled."""
        sides = [node.left, *node.comparators]
        if any(isinstance(side, ast.Constant) and side.value == 0 for side in sides):
            sides = [side if is_parameter(side) else self.visit(side) for side in sides]
            node.left, node.comparators = sides[0], sides[1:]
            return node
        return self.generic_visit(node)

    def visit_Return(self, node):
        """Each number of a row."""
        rows = self.function in ("parameters", "row") or self.function.endswith("_numbers")
        if rows and isinstance(node.value, ast.Tuple):
            # a literal is one number, not two
            node.value.elts = [
                self.visit(part) if isinstance(part, ast.Starred | ast.Constant) else self.number(self.visit(part))
                for part in node.value.elts
            ]
            return node
        return self.generic_visit(node)

    def visit_BinOp(self, node):
        """An exponent."""
        node = self.generic_visit(node)
        if isinstance(node.op, ast.Pow) and isinstance(node.right, ast.Constant) and isinstance(node.right.value, int):
            node.right = self.number(node.right)
        return node

    def visit_Constant(self, node):
        """Any float but zero."""
        return self.number(node) if isinstance(node.value, float) and node.value != 0.0 else node

    def visit_Subscript(self, node):
        """A parameter that a kernel reads."""
        of_table = self.named and isinstance(node.value, ast.Name) and node.value.id == "table"
        read = (is_parameter(node) or of_table) and isinstance(node.ctx, ast.Load)
        return self.number(node) if read else self.generic_visit(node)


def is_parameter(node) -> bool:
    """Whether an expression is a number of a kernel's row, p[3]."""
    return isinstance(node, ast.Subscript) and isinstance(node.value, ast.Name) and node.value.id == "p"


def by_name(file: str) -> bool:
    """Whether the kernels of a file read their parameters by name."""
    return file.startswith("component/")


def mutations_of(file: str) -> list[Mutation]:
    """All of one file."""
    everything = Mutator(named=by_name(file))
    everything.visit(ast.parse((PACKAGE / file).read_text()))
    texts = [found[1:] for found in everything.found]
    return [Mutation(file, index, *found, texts[:index].count(found[1:])) for index, found in enumerate(everything.found)]


def mutated(mutation: Mutation) -> str:
    """The file with one number changed."""
    tree = Mutator(mutation.index, by_name(mutation.file)).visit(ast.parse((PACKAGE / mutation.file).read_text()))
    return ast.unparse(ast.fix_missing_locations(tree))


def law_names() -> tuple[dict[str, dict[str, str]], dict[str, set[str]]]:
    """Names of the laws by file and class, and which files of the room import a file, transitively."""
    names: dict[str, dict[str, str]] = {}
    imports: dict[str, set[str]] = {}
    for path in sorted((PACKAGE / "laws").rglob("*.py")):
        file, tree = str(path.relative_to(PACKAGE)), ast.parse(path.read_text())
        names[file] = {
            node.name: part.value.value
            for node in tree.body
            if isinstance(node, ast.ClassDef)
            for part in node.body
            if isinstance(part, ast.AnnAssign) and ast.unparse(part.target) == "name" and isinstance(part.value, ast.Constant)
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
    """The tests that name the law in which a number stands, or any law that it may reach."""
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
        os.environ |= {"PYTHONPATH": str(copy), "SCISSORDYN_CACHE": str(copy / "cache"), "PYTHONDONTWRITEBYTECODE": "1"}
        options = ["-x", "-q", "-p", "no:cacheprovider", *(str(HERE / test) for test in job.tests)]
        options += ["-k", job.chosen] if job.chosen else []
        if job.compiled:
            os.environ["NUMBA_DISABLE_JIT"] = "0"
            os.execv(sys.executable, [sys.executable, "-m", "pytest", *options])
        sys.dont_write_bytecode = True
        sys.path.insert(0, str(copy))
        status = int(pytest.main(options))
        sys.stdout.flush()
    except BaseException:
        traceback.print_exc()
        status = int(pytest.ExitCode.INTERNAL_ERROR)
    sys.stderr.flush()
    os._exit(status)


def fails(status: int, copy: Path) -> bool:
    """Whether a process that has ended had a failing test."""
    if os.WIFSIGNALED(status) and os.WTERMSIG(status) == signal.SIGALRM:
        return True
    code = os.waitstatus_to_exitcode(status)
    # 2 is an error while tests are collected: the file no longer loads
    if code not in (0, 1, 2):
        raise RuntimeError(f"pytest ended with {code}\n{Path(copy, 'output').read_text()[-4000:]}")
    return code != 0


def judge(jobs: list[Job], workers: int, done: dict[str, bool], keep: Callable[[Job, bool], None]) -> None:
    """Try the jobs that are not done yet, and keep whether their tests fail."""
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
    """Every mutation with its tests, and before them the same tests on the package as it is."""
    names, importers = law_names()
    tried = []
    for target in targets:
        for file in sorted({str(path.relative_to(PACKAGE)) for pattern in target.files for path in PACKAGE.glob(pattern)}):
            for mutation in mutations_of(file):
                chosen = selection(mutation, names, importers) if target.by_name else ""
                tried.append(Job(mutation, target.tests, target.compiled, chosen))
    sound = dict.fromkeys(replace(job, mutation=None) for job in tried)
    return [*sound, *tried]


def sources() -> str:
    """A digest of the package and of all tests: what is kept of a run holds for them only."""
    files = [*PACKAGE.rglob("*.py"), *HERE.rglob("*.py")]
    text = "".join(f"{file.relative_to(HERE.parent)}\n{file.read_text()}" for file in sorted(files) if file != Path(__file__))
    return hashlib.sha256(text.encode()).hexdigest()


def verdict(mutation: Mutation, failing: bool) -> str:
    """One word for the table."""
    return "noticed" if failing else "equivalent" if mutation.reason else "not noticed"


def page(found: list[tuple[Mutation, str]]) -> str:
    """The table, the equivalents and what was not noticed."""
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
    """What an earlier run on the same sources found; a file of other sources begins anew."""
    now = sources()
    lines = file.read_text().split("\n") if file.exists() else []
    if lines[:1] != [now]:
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(f"{now}\n")
        return {}
    # the last line may be half-written
    return {line[:64]: line[65:] == "fails" for line in lines[1:] if line[65:] in ("fails", "passes")}


def main() -> int:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("files", nargs="*", help="files below the package to try, e.g. laws/friction/lugre.py; all of TARGETS")
    parser.add_argument("--tests", nargs="+", help="test files below tests/ for the files, if they are in no target")
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
    jobs, done = jobs_of(targets), kept(given.log)

    def keep(job: Job, failing: bool) -> None:
        if job.mutation is None and failing:
            raise RuntimeError(f"{job}: the tests fail on the package as it is")
        done[job.digest] = failing
        with given.log.open("a") as log:
            log.write(f"{job.digest} {'fails' if failing else 'passes'}\n")
        if job.mutation:
            where = f"{job.mutation.file}:{job.mutation.line} {job.mutation.function} {job.mutation.text}"
            print(f"{where}: {verdict(job.mutation, failing)}", flush=True)

    judge(jobs, given.workers, done, keep)
    found = [(job.mutation, verdict(job.mutation, done[job.digest])) for job in jobs if job.mutation]
    text = page(found)
    print(text)
    if given.write:
        PAGE.write_text(f"# mutations\n\nWritten by `python tests/mutate.py --write`.\n\n{text}\n", encoding="utf-8")
    return 1 if any(said == "not noticed" for _, said in found) else 0


if __name__ == "__main__":
    sys.exit(main())
