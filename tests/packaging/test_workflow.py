"""The workflow of the public checks: systems, versions of Python, and commands that exist."""

import re
import tomllib
from pathlib import Path

ROOT = Path(__file__).parents[2]
WORKFLOW = (ROOT / ".github" / "workflows" / "ci.yml").read_text(encoding="utf-8")
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]


def test_systems_and_versions() -> None:
    """Contract: tests run on three systems with every version of Python that the classifiers name."""
    named = [one.rpartition(" ")[2] for one in PROJECT["classifiers"] if re.search(r"Python :: 3\.\d", one)]
    quoted = ", ".join(f'"{one}"' for one in named)
    assert f"python: [{quoted}]" in WORKFLOW
    assert WORKFLOW.count("os: [ubuntu-latest, macos-latest, windows-latest]") == 2


def test_commands_exist() -> None:
    """Contract: each command is a target of make, an installation with extras that exist, or tests that exist."""
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
            case _:
                raise AssertionError(words)
