"""What a release takes: the sdist, the conda recipe, forms, and workflows that cannot be changed under it."""

import re
import shutil
import subprocess
import sys
import tarfile
import tomllib
from pathlib import Path

import pytest
import yaml

import scissordyn as sd

ROOT = Path(__file__).parents[2]
GITHUB = ROOT / ".github"
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]


def spaceless(requirement: str) -> str:
    """A requirement as both files spell it."""
    return requirement.replace(" ", "").replace("matplotlib-base", "matplotlib")


def test_conda_recipe_needs_what_the_package_needs() -> None:
    """Contract: version, dependencies and the command of the recipe are those of the package."""
    recipe = yaml.safe_load((ROOT / "packaging" / "conda" / "recipe.yaml").read_text(encoding="utf-8"))
    assert recipe["context"]["version"] == sd.__version__
    python, *needed = recipe["requirements"]["run"]
    assert spaceless(python) == f"python{PROJECT['requires-python']}"
    assert sorted(map(spaceless, needed)) == sorted(map(spaceless, PROJECT["dependencies"]))
    (script,) = recipe["build"]["python"]["entry_points"]
    assert script == "scissordyn = " + PROJECT["scripts"]["scissordyn"]


def test_changelog_has_the_version() -> None:
    """Contract: the first section is that of the version, with its date or unreleased."""
    heading = re.search(r"^## (\S+) \((.+)\)$", (ROOT / "CHANGELOG.md").read_text(encoding="utf-8"), re.MULTILINE)
    assert heading[1] == sd.__version__
    assert heading[2] == "unreleased" or re.fullmatch(r"\d{4}-\d{2}-\d{2}", heading[2])


@pytest.mark.parametrize("path", sorted((GITHUB / "workflows").glob("*.yml")), ids=lambda path: path.name)
def test_actions_are_pinned(path: Path) -> None:
    """Contract: each action is named by its digest, with the version behind it, and a checkout keeps no credentials."""
    text = path.read_text(encoding="utf-8")
    used = re.findall(r"uses: (\S+)(.*)", text)
    assert used
    for action, behind in used:
        assert re.fullmatch(r"[\w./-]+@[0-9a-f]{40}", action), action
        assert re.fullmatch(r" # v\d+\.\d+\.\d+", behind), action
    assert text.count("actions/checkout@") == text.count("persist-credentials: false")
    assert "permissions" in yaml.safe_load(text)


def test_forms_are_forms() -> None:
    """Contract: each form of an issue has a name, a description and fields with labels; Dependabot knows both kinds of pins."""
    forms = [path for path in (GITHUB / "ISSUE_TEMPLATE").glob("*.yml") if path.name != "config.yml"]
    assert len(forms) == 3
    for path in forms:
        form = yaml.safe_load(path.read_text(encoding="utf-8"))
        assert {"name", "description", "body"} <= form.keys()
        for field in form["body"]:
            assert field["type"] in ("input", "textarea", "dropdown", "checkboxes")
            assert field["attributes"]["label"]
        names = [field["id"] for field in form["body"]]
        assert len(set(names)) == len(names)
    updates = yaml.safe_load((GITHUB / "dependabot.yml").read_text(encoding="utf-8"))["updates"]
    assert {one["package-ecosystem"] for one in updates} == {"github-actions", "pip"}


@pytest.mark.slow
def test_wheel_of_the_sdist(tmp_path: Path) -> None:
    """Contract: a wheel can be built from what the sdist holds, and has the examples; the sdist has the tests."""
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
    done = subprocess.run(
        [sys.executable, "-c", build, "build_wheel", str(made)], cwd=folder, capture_output=True, text=True, check=True
    )
    names = subprocess.run(
        [sys.executable, "-m", "zipfile", "-l", str(made / done.stdout.split()[-1])], capture_output=True, text=True, check=True
    ).stdout
    assert "scissordyn/examples/paper.toml" in names
    assert "scissordyn/py.typed" in names
