"""The README does what it says."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
README = (ROOT / "README.md").read_text(encoding="utf-8")


def blocks(language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```", README, flags=re.MULTILINE | re.DOTALL)


def test_python_runs(capsys: pytest.CaptureFixture[str]) -> None:
    """Cross-check: the lines of Python run as they stand and print a peak force and a predictability horizon within the run."""
    (code,) = blocks("python")
    assert len(code.splitlines()) <= 10
    exec(compile(code, "README.md", "exec"), {})
    found = re.fullmatch(r"(\d+) N, predictable until (0\.\d+) s\n", capsys.readouterr().out)
    assert found
    assert float(found[1]) > 1e4
    assert 0.01 < float(found[2]) <= 0.05


def test_the_checks_call_what_is_named() -> None:
    """Contract: the commands of make on the page are targets with their set-up, and the checks call the tests by the same."""
    named = re.findall(r"\bmake (\w+)", "".join(blocks("sh")))
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    assert {"paper", "test"} <= set(named)
    for target in named:
        assert re.search(rf"^{target}: \.venv/\.\w+$", makefile, flags=re.MULTILINE), target
    called = re.findall(r"^(?:env .*)?make (\w+)$", (ROOT / ".ci" / "run").read_text(encoding="utf-8"), flags=re.MULTILINE)
    assert "test" in called
    assert set(called) <= set(named)


def test_links_lead_somewhere() -> None:
    """Contract: every relative link of README and CONTRIBUTING is a file or a folder."""
    for page in ("README.md", "CONTRIBUTING.md"):
        text = (ROOT / page).read_text(encoding="utf-8")
        for target in re.findall(r"\]\(([^)#:]+)\)", text):
            assert (ROOT / target).exists(), target
