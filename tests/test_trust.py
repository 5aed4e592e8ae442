"""The page on what is refused and what is warned of: every row is run, and says what the page says."""

import json
import re
import shlex
from pathlib import Path

import pytest
import xarray as xr

import scissordyn as sd
from scissordyn.cli.main import status_of
from scissordyn.config.template import template

HERE = Path(__file__).parent  # Folder of the tests
# Text of the page about messages
PAGE = (HERE.parent / "docs" / "decisions" / "measured" / "messages.md").read_text(encoding="utf-8")
# Python code in the page, which defines the names of its commands
NAMES = "\n".join(re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL))
# Cells of the rows of the page's table of messages
ROWS = [
    [cell.strip() for cell in line.strip("|").split(" | ")]
    for line in PAGE.splitlines()
    if line.startswith("| ") and " `" in line and "---" not in line
]


def said(command, folder, capsys):
    """Return the output of a command: the error, the warnings of a run and its cause, or what is printed."""
    if command.startswith("scissordyn "):
        (folder / "case.toml").write_text(template("scissor"), encoding="utf-8")
        status = status_of(shlex.split(command)[1:])
        shown = capsys.readouterr()
        assert status in (0, 2)
        return " ".join((shown.err if status == 2 else shown.out).split())
    known = {"__name__": __name__}
    exec(NAMES, known)
    try:
        found = eval(command, known)
    except sd.InputError as error:
        return str(error)
    assert isinstance(found, xr.Dataset)
    attributes = found.attrs
    texts = [*json.loads(attributes["warnings"]), attributes["cause"], attributes.get("predictability", "")]
    return "\n".join(texts)


@pytest.mark.parametrize(("message", "tests", "command"), [row[1:] for row in ROWS], ids=[row[0] for row in ROWS])
def test_every_row_is_true(message, tests, command, tmp_path, monkeypatch, capsys):
    """Contract: the command of a row says the row's message, and the test that it names exists."""
    monkeypatch.chdir(tmp_path)
    file, function = tests.strip("`").split("::")
    assert f"def {function}(" in (HERE / file).read_text(encoding="utf-8")
    # "..." stands for words that are left out
    pattern = ".*".join(map(re.escape, message.strip("`").split("...")))
    assert re.search(pattern, said(command.strip("`"), tmp_path, capsys), re.DOTALL)


def test_the_page_has_its_rows():
    """Contract: no row is lost by a mistake of the table's syntax."""
    assert len(ROWS) == PAGE.count("::test_")
    assert len(ROWS) >= 19
