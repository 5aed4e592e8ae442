"""The examples in the documentation run as they stand there."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

DOCS = Path(__file__).parents[1] / "docs"


def snippets(page: str, heading: str) -> list[str]:
    """The Python code below a heading of a page, or on all of it."""
    section = (DOCS / page).read_text(encoding="utf-8")
    if heading:
        section = re.split(rf"^## {re.escape(heading)}$", section, flags=re.MULTILINE)[1].split("\n## ")[0]
    return re.findall(r"^```python\n(.*?)^```", section, flags=re.MULTILINE | re.DOTALL)


@pytest.mark.parametrize(
    ("page", "heading"),
    [("files.md", "Case files and Python"), ("files.md", "Checkpoints"), ("batches.md", ""), ("measures.md", "")],
)
def test_examples_run(page: str, heading: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Identity: all code below a heading, one block after the other, in an empty folder."""
    monkeypatch.chdir(tmp_path)
    known: dict[str, object] = {"__name__": "example"}
    blocks = snippets(page, heading)
    assert blocks
    for block in blocks:
        exec(compile(block, f"{page}: {heading}", "exec"), known)
