"""What public CI installs is what the tests import."""

import ast
import re
import sys
import tomllib
from importlib.metadata import PackageNotFoundError, packages_distributions, requires
from pathlib import Path

ROOT = Path(__file__).parents[2]
WORKFLOW = (ROOT / ".github" / "workflows" / "ci.yml").read_text(encoding="utf-8")
OWN = {"scissordyn", "scissordyn_paper", "benchmarks", "validation", "reference", "conftest"}


def plain(requirement: str) -> str:
    """The name of a requirement, as indexes compare it."""
    return re.split(r"[\s\[<>=!~;]", requirement.strip())[0].lower().replace("_", "-")


def installed(extras: set[str]) -> set[str]:
    """The distributions that the package needs with these extras, and what they need in turn."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    wanted = [*project["dependencies"], *(one for extra in extras for one in project["optional-dependencies"][extra])]
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
    """The modules that the sources of a folder import, without their own and those of Python."""
    names: set[str] = set()
    for path in (ROOT / folder).rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Import):
                names |= {alias.name.split(".")[0] for alias in node.names}
            elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
                names.add(node.module.split(".")[0])
    local = {path.stem for path in (ROOT / folder).rglob("*.py")}
    return names - OWN - local - set(sys.stdlib_module_names)


def test_ci_installs_what_the_tests_import() -> None:
    """Contract: with the extras of the workflow, but for peers and pictures of a browser, which tests skip without."""
    (extras,) = set(re.findall(r'--editable "\.\[([\w,]+)\]"', WORKFLOW))
    there = installed(set(extras.split(",")))
    distributions = packages_distributions()
    missing = {
        name
        for name in imported("tests") | imported("src")
        if name in distributions and not {plain(one) for one in distributions[name]} & there
    }
    assert missing <= {"exudyn", "numbalsoda"}, missing
