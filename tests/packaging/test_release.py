"""Contents of a release: sdist, conda recipe, issue forms, and pinned workflows."""

import os
import re
import shutil
import subprocess
import sys
import tarfile
import tomllib
from importlib.metadata import PackageNotFoundError, packages_distributions, requires
from pathlib import Path

import grimp
import pytest
import yaml
from benchmarks import stale

import scissordyn as sd
from scissordyn.sensitivity import library

ROOT = Path(__file__).parents[2]  # Root folder of the repository
WORKFLOW = (ROOT / ".github" / "workflows" / "ci.yml").read_text(encoding="utf-8")  # Text of the CI workflow
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]  # Table [project] of pyproject.toml
# Names of modules of this repository
OWN = {"scissordyn", "scissordyn_paper", "benchmarks", "validation", "reference", "conftest"}


def plain(requirement: str) -> str:
    """Return the name of a requirement, as indexes compare it."""
    return re.split(r"[\s\[<>=!~;]", requirement.strip())[0].lower().replace("_", "-")


def installed(extras: set[str]) -> set[str]:
    """Return the distributions that the package needs with some extras, and their own requirements."""
    wanted = [*PROJECT["dependencies"], *(one for extra in extras for one in PROJECT["optional-dependencies"][extra])]
    found: set[str] = set()
    while wanted:
        one = plain(wanted.pop())
        if one in found:
            continue
        found.add(one)
        try:
            wanted += [line for line in requires(one) or () if "extra ==" not in line]
        except PackageNotFoundError:
            continue
    return found


def imported(folder: str) -> set[str]:
    """Return the modules that the sources of a folder import, without their own and those of Python.

    Lines of text that begin with these words only add names of packages to check.
    """
    names: set[str] = set()
    for path in (ROOT / folder).rglob("*.py"):
        names |= set(re.findall(r"^\s*(?:import|from) (\w+)", path.read_text(encoding="utf-8"), re.MULTILINE))
    local = {path.stem for path in (ROOT / folder).rglob("*.py")}
    return names - OWN - local - set(sys.stdlib_module_names)


def test_ci_installs_what_the_tests_import():
    """Contract: the workflow installs what tests and sources import, except for peers, without which tests are skipped."""
    (extras,) = set(re.findall(r'--editable "\.\[([\w,]+)\]"', WORKFLOW))
    there = installed(set(extras.split(",")))
    distributions = packages_distributions()
    missing = {
        name
        for name in imported("tests") | imported("src")
        if name in distributions and not {plain(one) for one in distributions[name]} & there
    }
    assert missing <= {"exudyn", "numbalsoda"}, missing


def test_systems_and_versions():
    """Contract: tests run on three systems with every version of Python among the classifiers."""
    named = [one.rpartition(" ")[2] for one in PROJECT["classifiers"] if re.search(r"Python :: 3\.\d", one)]
    quoted = ", ".join(f'"{one}"' for one in named)
    assert f"python: [{quoted}]" in WORKFLOW
    assert WORKFLOW.count("os: [ubuntu-latest, macos-latest, windows-latest]") == 2


def test_commands_of_the_workflow():
    """Contract: each command is an existing target of make, an installation with existing extras, or existing tests."""
    targets = re.findall(r"^(\w+):", (ROOT / "Makefile").read_text(encoding="utf-8"), re.MULTILINE)
    commands = [line.strip("\"'").split() for line in re.findall(r"^ *- run: (.+)$", WORKFLOW, re.MULTILINE)]
    assert len(commands) >= 6
    assert "|" not in "".join(re.findall(r"run: (.)", WORKFLOW))
    for words in commands:
        match words:
            case ["make", target]:
                assert target in targets
            case ["python", "-m", "pip", "install", "--editable", what]:
                extras = re.search(r"\[([\w,]+)\]", what)
                assert set(extras[1].split(",")) <= set(PROJECT["optional-dependencies"])
            case ["python", "-m", "pytest", *rest]:
                assert all((ROOT / word).exists() for word in rest if word.startswith("tests"))
            case ["python", "-m", "scissordyn.build", "--c", file] | ["diff", "--from-file", *_, file]:
                assert file.endswith("kernels.c")
            case _:
                raise AssertionError(words)


GITHUB = ROOT / ".github"  # Folder with workflows and forms for GitHub


def spaceless(requirement: str) -> str:
    """Return a requirement in the spelling common to both files."""
    return requirement.replace(" ", "").replace("matplotlib-base", "matplotlib")


def test_conda_recipe_needs_what_the_package_needs():
    """Contract: version, dependencies and command of the recipe are those of the package."""
    recipe = yaml.safe_load((ROOT / "packaging" / "conda" / "recipe.yaml").read_text(encoding="utf-8"))
    assert recipe["context"]["version"] == sd.__version__
    python, *needed = recipe["requirements"]["run"]
    assert spaceless(python) == f"python{PROJECT['requires-python']}"
    assert sorted(map(spaceless, needed)) == sorted(map(spaceless, PROJECT["dependencies"]))
    (script,) = recipe["build"]["python"]["entry_points"]
    assert script == "scissordyn = " + PROJECT["scripts"]["scissordyn"]


def test_changelog_has_the_version():
    """Contract: the first section is that of the version, with its date or unreleased."""
    heading = re.search(r"^## (\S+) \((.+)\)$", (ROOT / "CHANGELOG.md").read_text(encoding="utf-8"), re.MULTILINE)
    assert heading[1] == sd.__version__
    assert heading[2] == "unreleased" or re.fullmatch(r"\d{4}-\d{2}-\d{2}", heading[2])


@pytest.mark.parametrize("path", sorted((GITHUB / "workflows").glob("*.yml")), ids=lambda path: path.name)
def test_actions_are_pinned(path):
    """Contract: each action is pinned by its digest with its version as a comment, and a checkout keeps no credentials."""
    text = path.read_text(encoding="utf-8")
    used = re.findall(r"uses: (\S+)(.*)", text)
    assert used
    for action, behind in used:
        assert re.fullmatch(r"[\w./-]+@[0-9a-f]{40}", action), action
        assert re.fullmatch(r" # v\d+\.\d+\.\d+", behind), action
    assert text.count("actions/checkout@") == text.count("persist-credentials: false")
    assert "permissions" in yaml.safe_load(text)


def test_measured_pages_older_than_their_subject(tmp_path, monkeypatch):
    """Contract: listed are changes with a line in the changelog, of what a page measures, since it was measured."""
    graph = grimp.build_graph("scissordyn", "benchmarks", cache_dir=None)
    assert {"laws", "mechanics", "run"} <= stale.subpackages(graph, "benchmarks.film")  # by public names alone
    assert "cli" in stale.subpackages(graph, "benchmarks.study_kills") - stale.subpackages(graph, "benchmarks.speed")
    monkeypatch.setattr(stale, "subpackages", lambda *_: {"laws"})
    monkeypatch.setattr(stale, "ROOT", tmp_path)
    page = tmp_path / "page.md"

    def commit(subject, *names, text=None):
        for path in (tmp_path / name for name in names):
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text or subject)
        stale.git("add", ".")
        stale.git("-c", "user.name=a", "-c", "user.email=a@b.c", "commit", "-qm", subject)

    stale.git("init", "-q")
    commit("measure", "page.md", text="By `python -m benchmarks.speed`.\n\nAMD, 2 cores, load 0.1; numpy 2.\n")
    law, other, log = "src/scissordyn/laws/a.py", "src/scissordyn/plot/a.py", "CHANGELOG.md"
    for subject, names in {"laws: a": (law, log), "laws: b": (law,), "words: c": (law, log), "plot: d": (other, log)}.items():
        commit(subject, *names)
    assert [line.split(None, 2)[2] for line in stale.changes(page, graph)] == ["laws: a", "measure"]
    commit("again", "page.md", text=page.read_text().replace("0.1", "0.2"))
    assert [line.split(None, 2)[2] for line in stale.changes(page, graph)] == ["again"]


def test_libraries_of_a_wheel_have_names_of_modules():
    """Contract: the check of wheels takes a library for a module, whose name is an identifier."""
    assert all(library.file_name(kind, 8).partition(".")[0].isidentifier() for kind in library.KINDS)


@pytest.mark.slow
def test_wheel_of_the_sdist(tmp_path):
    """Contract: a wheel with the examples can be built from the sdist, which has the tests."""
    source, made = tmp_path / "source", tmp_path / "made"
    listed = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=True).stdout.split("\n")
    for name in filter(None, listed):
        if not name.startswith("docs/") and (ROOT / name).is_file():
            (source / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(ROOT / name, source / name)
    build = "import setuptools.build_meta as b, sys; print(getattr(b, sys.argv[1])(sys.argv[2]))"
    done = subprocess.run(
        [sys.executable, "-c", build, "build_sdist", str(made)], cwd=source, capture_output=True, text=True, check=True
    )
    archive = made / done.stdout.split()[-1]
    with tarfile.open(archive) as packed:
        packed.extractall(tmp_path, filter="data")
    folder = tmp_path / archive.name.removesuffix(".tar.gz")
    assert (folder / "tests" / "conftest.py").is_file()
    assert (folder / "CHANGELOG.md").is_file()
    quick = {**os.environ, "SCISSORDYN_DERIVATIVES": "no"}
    done = subprocess.run(
        [sys.executable, "-c", build, "build_wheel", str(made)],
        cwd=folder,
        env=quick,
        capture_output=True,
        text=True,
        check=True,
    )
    names = subprocess.run(
        [sys.executable, "-m", "zipfile", "-l", str(made / done.stdout.split()[-1])], capture_output=True, text=True, check=True
    ).stdout
    assert "scissordyn/examples/paper.toml" in names
    assert "scissordyn/py.typed" in names
