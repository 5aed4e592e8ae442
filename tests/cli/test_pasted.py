"""Commands that are shown to be pasted into a shell, and what of a file that a case names is shown."""

from __future__ import annotations

import ast
import re
import shlex
import subprocess
from pathlib import Path

import pytest

import scissordyn
from reference.paper_case import paper_case
from scissordyn.cli.main import status_of
from scissordyn.errors import command

SOURCES = Path(scissordyn.__file__).parent  # Folder of the package's sources

# File name that would execute commands if a message pasted it into a shell without quotes
BAD = "a;touch pasted $(touch pasted) `touch pasted` 'b\" &"


def shown(capsys: pytest.CaptureFixture[str]) -> list[str]:
    """Return the commands in the output since the last call: texts from the program's name to the end of the line."""
    said = capsys.readouterr()
    return re.findall(r"scissordyn (?:study|new|run|explore|sweep) .*$", said.out + said.err, re.MULTILINE)


def pasted(line: str, folder: Path) -> list[str]:
    """Return the words that a program gets from a shell for a command line; the program here only writes them down."""
    program = 'scissordyn() { printf "%s\\0" "$@" > words; }\n'
    (folder / "words").unlink(missing_ok=True)
    subprocess.run(["bash", "-c", program + line], cwd=folder, check=True, timeout=20)
    assert not (folder / "pasted").exists(), line
    return (folder / "words").read_text().split("\0")[:-1]


@pytest.mark.parametrize("name", [BAD, "plain.db", "a b", "--rm", "~/x", "é", "a\\b", "*", "#", "!x"])
def test_words_stay_words(name, tmp_path):
    """Contract: what the shell makes of a command are the words that it was made of."""
    assert pasted(command("scissordyn", "study", "resume", name), tmp_path) == ["study", "resume", name]


def test_a_line_break_is_no_command(tmp_path):
    """Contract: a name of two lines, or with an escape code, stays one harmless word."""
    line = command("scissordyn", "study", "resume", "a\ntouch pasted\n\x1b[2J")
    assert line.isprintable()
    assert len(pasted(line, tmp_path)) == 3


def test_commands_of_a_study(tmp_path, capsys, monkeypatch):
    """Contract: the store is one word in each command that sweep, status and report show, in the report as well."""
    monkeypatch.chdir(tmp_path)
    Path("case.toml").write_text(paper_case("2 ms"))
    steps = ("--set", "run.most_steps=3", "--vary", "A.clearance=0.1..0.2 mm, 2 values", "--threads", "1")
    assert status_of(["sweep", "case.toml", *steps, "-o", BAD]) == 3
    lines = shown(capsys)
    assert status_of(["study", "status", BAD]) == 0
    lines += shown(capsys)
    assert {shlex.split(line)[2] for line in lines} == {"status", "replay"}
    for line in lines:
        assert str(tmp_path / BAD) in pasted(line, tmp_path)
    assert status_of(["study", "resume", "case.toml", BAD]) == 2
    capsys.readouterr()
    missing = f"{BAD}.toml"
    assert status_of(["run", missing]) == 2
    (line,) = shown(capsys)
    assert pasted(line, tmp_path) == ["new", "scissor"]  # into a file of that name
    assert Path(missing).exists() or Path(missing).name in {path.name for path in tmp_path.iterdir()}


def placeholders(text: ast.JoinedStr) -> list[ast.expr]:
    """Return the values that a text puts behind the beginning of a command."""
    found, before = list[ast.expr](), ""
    for part in text.values:
        if isinstance(part, ast.FormattedValue):
            found += [part.value] if re.search(r"scissordyn [a-z]+ [^;:']*$", before) else []
            before += "{}"
        else:
            assert isinstance(part, ast.Constant)
            before += str(part.value)
    return found


OURS = {"what": "one of the words of the command", "next(iter(FIGURES))": "a number of a figure"}
"""Expressions whose values messages put into a command without quotes, with the reason why that is safe."""


@pytest.fixture(scope="module")
def nodes():
    """Return all texts with placeholders and all errors in the sources of the package, with their files."""
    texts = ((path, path.read_text(encoding="utf-8")) for path in SOURCES.rglob("*.py"))
    # other files have no command and no option in a text
    trees = ((path, ast.parse(text)) for path, text in texts if re.search(r"scissordyn |[\"']-", text))
    return [(path, node) for path, tree in trees for node in ast.walk(tree) if isinstance(node, ast.JoinedStr | ast.Call)]


def test_every_command_is_quoted(nodes):
    """Contract: whatever is put into a command, in any text of the package, goes through `errors.command`."""
    looked_at = 0
    for path, node in nodes:
        for value in placeholders(node) if isinstance(node, ast.JoinedStr) else ():
            looked_at += 1
            quoted = isinstance(value, ast.Call) and isinstance(value.func, ast.Name) and value.func.id == "command"
            assert quoted or ast.unparse(value) in OURS, f"{path}, line {node.lineno}: {ast.unparse(value)}"
    assert looked_at >= 4


def test_options_that_are_shown_are_quoted(nodes):
    """Contract: so does what stands behind an option in the last argument of an error, but for whole numbers and our names."""
    allowed = {"2 * study.design.points", "','.join(makers)", "example(quantity)", "ending", "POINTS_MIN", "words[0]"}
    for path, node in nodes:
        if not (isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "InputError"):
            continue
        for text in node.args[2:]:
            if isinstance(text, ast.JoinedStr) and re.match(r"-|scissordyn", str(getattr(text.values[0], "value", ""))):
                inside = [part.value for part in text.values if isinstance(part, ast.FormattedValue)]
                unquoted = {ast.unparse(value) for value in inside if "command(" not in ast.unparse(value)}
                assert unquoted <= allowed | OURS.keys(), f"{path}, line {node.lineno}"


# Python file with a user-defined law; when it is executed, it writes a character to the file `executed`
LAWS = """
from pathlib import Path

with (Path(__file__).parent / "executed").open("a") as mark:
    mark.write("x")


import scissordyn as sd


@sd.element(slot="stiffness")
def soft(indentation, stiffness):
    return stiffness * indentation
"""


def test_reading_a_study_executes_nothing(tmp_path, capsys, monkeypatch):
    """Contract: status, report and export of a study with a law of the user's own do not need, or execute, its file."""
    monkeypatch.chdir(tmp_path)
    laws, mark = tmp_path / "my_laws.py", tmp_path / "executed"
    laws.write_text(LAWS)
    Path("case.toml").write_text(paper_case("2 ms"))
    own = ("--set", "clearance.A.stiffness={ law = 'my_laws.py:soft', stiffness = 1e8 }")
    vary = ("--vary", "A.clearance=0.1..0.2 mm, 2 values", "--threads", "1")
    assert status_of(["sweep", "case.toml", *own, *vary, "-o", "own.db"]) == 0
    assert mark.exists()
    mark.unlink()
    reading = (["status"], ["report", "-o", "own.html"], ["export", "-o", "own.csv"])
    for allowed in ([], ["--allow-code", "my_laws.py"]):
        for what, *options in reading:
            capsys.readouterr()
            assert status_of(["study", what, "own.db", *options, *allowed]) == 0, capsys.readouterr().err
    laws.unlink()
    for what, *options in reading:
        assert status_of(["study", what, "own.db", *options]) == 0
    assert not mark.exists()
    assert "0.1" in Path("own.html").read_text()
    assert len(Path("own.csv").read_text().splitlines()) == 3
    capsys.readouterr()
    assert status_of(["study", "resume", "own.db"]) == 2
    assert "--allow-code my_laws.py" in capsys.readouterr().err


@pytest.mark.parametrize("content", ["root:x:0:0:secret\n", "time [ms], angle [deg]\n0 1\nsecret 2\n", "secret"])
@pytest.mark.parametrize("place", ["drive.table", "--cluster"])
def test_no_text_of_another_file_is_shown(content, place, tmp_path, capsys, monkeypatch):
    """Contract: a case that names a file as its table, as somebody else's may, shows nothing that is in it."""
    monkeypatch.chdir(tmp_path)
    Path("other").write_text(content if place == "drive.table" else f"a: [\n{content}")
    Path("case.toml").write_text(paper_case("2 ms").replace('speed = "150 rpm"', 'table = "other"'))
    if place == "drive.table":
        assert status_of(["check", "case.toml"]) == 2
    else:
        Path("case.toml").write_text(paper_case("2 ms"))
        vary = ("--vary", "A.clearance=0.1..0.2 mm, 2 values")
        assert status_of(["sweep", "case.toml", *vary, "-o", "a.db", "--cluster", "other"]) == 2
    said = capsys.readouterr().err
    assert "other" in said
    assert "secret" not in said
