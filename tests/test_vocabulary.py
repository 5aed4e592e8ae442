"""What a user reads is in the words of multibody dynamics."""

import ast
import re
from pathlib import Path

import pytest

from scissordyn.cli.main import COMMANDS, load_command

ROOT = Path(__file__).parents[1]

REPLACED = {
    "energy books": "energy balance",
    "the books": "the energy balance",
    "watched": "monitored",
    "slackness": "constraint velocity residual",
    "on course": "on the reference motion",
    "loose joint": "clearance joint",
    "loose joints": "clearance joints",
    "loosen": "with clearance",
    "loosened": "with clearance",
    "tighten": "ideal",
    "hidden state": "internal state",
    "hidden states": "internal states",
    "rung": "branch",
    "rungs": "branches",
    "ladder": "dispatch",
    "lever": "moment arm",
    "levers": "moment arms",
    "swing": "oscillation",
    "swings": "oscillates",
    "summit": "local maximum",
    "remark": "event data",
    "remarks": "event data",
    "parting": "divergence",
    "hold contact": "constrained contact",
    "held contact": "constrained contact",
    "knock": "impact",
    "knocks": "impacts",
    "knocking": "impacts",
    "rub": "friction",
    "rubs": "friction",
    "rubbing": "friction",
    "heat": "dissipation",
    "told": "reported",
    "pace": "step scaling",
    "lost tables": "parameters whose tables are lost",
    "counts as true": "criterion",
    "rest the pointer": "hover",
    "leaves samples": "returns samples",
    "hang on": "depend on",
}
"""Words that do not stand in texts for users, and what stands for them."""

PATTERN = re.compile(r"(?<![\w-])(" + "|".join(sorted(REPLACED, key=len, reverse=True)) + r")(?![\w-])", re.IGNORECASE)
PAGES = sorted(
    (
        *(page for page in (ROOT / "docs").rglob("*.md") if page.parent.name != "api"),
        *(ROOT / "validation").rglob("*.md"),
        *(ROOT / name for name in ("README.md", "CONTRIBUTING.md", "CHANGELOG.md")),
        *(ROOT / "examples").rglob("*.toml"),
    )
)


def found(text: str) -> list[str]:
    """Words of the list, with what stands for them."""
    return [f"'{match[0]}': {REPLACED[match[0].lower()]}" for match in PATTERN.finditer(text)]


def messages(source: str) -> list[str]:
    """Strings of a module that hold more than one word, and docstrings."""
    return [
        node.value
        for node in ast.walk(ast.parse(source))
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and " " in node.value
    ]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_pages(page: Path) -> None:
    """Contract: no word of the list on a page, in an example or in the text of a validation case."""
    text = page.read_text(encoding="utf-8")
    # titles of publications, which are not ours, are named as they are
    assert not found(re.sub(r"^\* `.*$", "", text, flags=re.MULTILINE) if page.name == "references.md" else text)


@pytest.mark.parametrize("room", sorted(path.name for path in (ROOT / "src" / "scissordyn").iterdir() if path.is_dir()))
def test_messages_and_docstrings(room: str) -> None:
    """Contract: nor in the messages, reports and docstrings of the package."""
    for path in sorted((ROOT / "src" / "scissordyn" / room).rglob("*.py")):
        for text in messages(path.read_text(encoding="utf-8")):
            assert not found(text), f"{path.name}: {text[:80]}"


@pytest.mark.parametrize("command", sorted(COMMANDS))
def test_help(command: str) -> None:
    """Contract: nor in the help of a command."""
    loaded = load_command(command)
    texts = [loaded.help or "", *(getattr(parameter, "help", "") or "" for parameter in loaded.params)]
    assert any(texts)
    assert not found(" ".join(texts))


def test_the_list_is_found() -> None:
    """Limit: the search finds each word alone, and no part of another word or of a file name."""
    assert all(found(f"It is {word} here.") for word in REPLACED)
    assert not found("rubber.py, feed-forward, clever, spatial, heated, knocked-out")
