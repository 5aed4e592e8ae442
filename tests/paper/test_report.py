"""The report: one page without external resources."""

import dataclasses
import json
import re
import shutil
import subprocess
from html.parser import HTMLParser

import pytest

import scissordyn as sd
from scissordyn import processor
from scissordyn.cli import paper as command
from scissordyn.cli.option import EngineOptions
from scissordyn_paper import controlled, periodic
from scissordyn_paper import page as picture_files
from scissordyn_paper import reproduce as module
from scissordyn_paper.cases import CLEARANCES, CONTROLLED, DEFAULT, FRICTION, SPEEDS
from scissordyn_paper.explanation import EXPLANATIONS, STATEMENTS, explanation, summary
from scissordyn_paper.figures import FIGURES, FURTHER
from scissordyn_paper.parameters import PARAMETERS, STATED_PARAMETERS, parameter_table
from scissordyn_paper.report import _summary
from scissordyn_paper.reproduce import draw_figure, reproduce
from scissordyn_paper.results import BEST, BEST_OF
from scissordyn_paper.statements import CHECKS
from scissordyn_paper.verdict import Finding, Verdict

# Path of the browser Chromium; None if it is not installed
CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
VOID = {"meta", "img", "br"}  # HTML elements without an end tag
# Number of statements that are also checked with a periodic drive
PERIODIC_CHECKS = sum(check.periodically is not None for check in CHECKS)
# Number of verdicts in a report: with its parameters, with the best set, and periodic
BADGES = 2 * len(CHECKS) + PERIODIC_CHECKS


@pytest.fixture(scope="module")
def report(runs, runs_folder, few_periods, remembered):
    """Return the report on the default choice, with short periodic runs; no stored result is read again."""
    with remembered() as patch:
        for name, count in few_periods.items():
            patch.setattr(periodic, name, count)
        short = dataclasses.replace(controlled.MANOEUVRES["periodic"], until=2.0, samples=1001, after=0.5)
        patch.setitem(controlled.MANOEUVRES, "periodic", short)
        patch.setattr(module, "save_picture", vector_file)
        yield reproduce(runs_folder.parent, engine=1)


def vector_file(drawn, folder, name):
    """Write a picture as SVG for the page, and one of them in all formats."""
    with pytest.MonkeyPatch.context() as patch:
        if name != "figure-09":
            patch.setattr(picture_files, "FORMATS", ("svg",))
        return picture_files.save_picture(drawn, folder, name)


class Outline(HTMLParser):
    """Open tags, addresses and the number of table rows of a page."""

    def __init__(self):
        super().__init__()
        self.open, self.addresses, self.rows = [], [], 0

    def handle_starttag(self, tag, attrs):
        """Record a tag that opens."""
        if tag not in VOID:
            self.open.append(tag)
        self.rows += tag == "tr"
        self.addresses += [value for name, value in attrs if name in ("src", "href")]

    def handle_endtag(self, tag):
        """Check that the closing tag was the last to open."""
        assert self.open.pop() == tag


def test_page_is_self_contained(report):
    """Contract: tags are balanced, pictures are embedded, and the only address is the paper's."""
    text = report.report.read_text()
    outline = Outline()
    outline.feed(text)
    assert outline.open == []
    outside = [address for address in outline.addresses if not address.startswith(("data:image/svg+xml;base64,", "#"))]
    assert outside == ["https://doi.org/10.1177/1369433220971728"]
    assert sum(address.startswith("data:") for address in outline.addresses) == len(FIGURES) + len(FURTHER)
    assert "<script" not in text
    assert "@import" not in text
    assert len(re.findall(r'class="badge (?:yes|no)"', text)) == BADGES


def test_tables_agree_with_the_page(report):
    """Contract: answers in JSON and CSV are those of the verdicts; case files can be read."""
    folder = report.report.parent
    rows = json.loads((folder / "verdicts.json").read_text())["verdicts"]
    assert [(row["check"], row["answer"]) for row in rows] == [(v.check.key, v.answer) for v in report.verdicts]
    lines = (folder / "verdicts.csv").read_text().splitlines()
    assert len(lines) == 1 + len(CHECKS)
    text = report.report.read_text()
    for row in rows:
        assert row["measured"][1:] in text  # the page writes it as a sentence
    cases = sorted((folder / "cases").iterdir())
    assert len(cases) == 24 + len(periodic.ALL_CASES)
    assert (len(list((folder / "runs").iterdir())), len(list((folder / "periodic").iterdir()))) == (24, len(periodic.ALL_CASES))
    for path in cases:
        sd.read_case(path)
    both = [(row["periodic"] or {}).get("answer") for row in rows]
    assert both == [None if v.periodic is None else v.periodic.answer for v in report.verdicts]
    assert sum(answer is not None for answer in both) == PERIODIC_CHECKS


def test_tables_beyond_the_paper(report):
    """Contract: a row for each motion, contact statistic and control scheme, and the counts of the summary."""
    text = report.report.read_text()

    def rows(name):
        part = re.search(rf'<h2 id="{name}">.*?</section>', text, re.DOTALL)[0]
        return len(re.findall(r"<tr><td", part))

    assert rows("regularity") == len(periodic.BY_CLEARANCE) + len(periodic.BY_FRICTION)
    assert rows("statistics") == len(CLEARANCES) + len(SPEEDS) + len(FRICTION)
    further = [job for job in controlled.CONTROLLED_RUNS if job.scheme != "ideal"]
    assert rows("control") == 3 * len(CONTROLLED) + len(further)
    agreeing = sum(verdict.finding.holds for verdict in report.verdicts)
    assert f"<strong>{agreeing} of {len(CHECKS)}</strong>" in text


def test_report_is_reproducible(report):
    """Contract: page and tables depend on neither clock nor random names."""
    folder = report.report.parent
    kept = [*folder.glob("*.html"), *folder.glob("verdicts.*")]
    before = {path: path.read_bytes() for path in kept}
    assert len(before) == 3
    with pytest.MonkeyPatch.context() as patch:
        # drawing all pictures again is another test's business
        named = {number: f"figure-{number:02d}" for number in FIGURES} | {name: name for name in FURTHER}
        files = {name: [folder / "figures" / f"{file}.svg"] for name, file in named.items()}
        patch.setattr(module, "_drawn", lambda *_: files)
        reproduce(folder, engine=1)
    assert {path: path.read_bytes() for path in kept} == before


def test_one_figure_can_be_drawn_alone(report):
    """Contract: one figure has the bytes that it has among the others."""
    folder = report.report.parent
    before = {path: path.read_bytes() for path in (folder / "figures").glob("figure-09.*")}
    written = draw_figure(9, folder, engine=1)
    assert [path.name for path in written] == ["figure-09.png", "figure-09.svg"]
    assert {path: path.read_bytes() for path in written} == before


def test_figure_without_results_is_refused(tmp_path):
    """Contract: the error names the figure, and nothing is written."""
    with pytest.raises(sd.InputError, match="figure 4"):
        draw_figure(4, tmp_path / "none", engine=1)
    assert not (tmp_path / "none").exists()


@pytest.mark.parametrize(
    ("processors", "options", "expected"),
    [
        (4, (None, None, None), EngineOptions(workers=4)),
        (200, (None, None, None), EngineOptions(workers=command.WORKERS_MAX)),
        (1, (None, None, None), EngineOptions()),
        (4, (3, None, None), EngineOptions(threads=3)),
        (4, (None, 3, None), EngineOptions(workers=3)),
        (4, (None, None, 9), EngineOptions()),
    ],
)
def test_processes_are_the_default(monkeypatch, processors, options, expected):
    """Contract: one process per processor by default; threads on request, for one figure, or on one processor."""
    monkeypatch.setattr(processor, "processors", lambda: processors)
    assert command._engine_options(*options) == expected


def test_command_shows_the_answers(report, capsys, monkeypatch):
    """Contract: every check with its answer, and the path of the report, in a hundred columns."""
    monkeypatch.setattr(module, "reproduce", lambda folder, **_: report)
    assert command.paper(report.report.parent, threads=1) == 0
    shown = capsys.readouterr().out
    for verdict in report.verdicts:
        assert re.search(rf"^ *{verdict.check.key} +{verdict.answer} ", shown, re.MULTILINE)
    assert str(report.report) in shown.splitlines()[-1]
    assert max(map(len, shown.splitlines()[:-1])) <= 100


@pytest.fixture(scope="module")
def chromium(tmp_path_factory):
    """Return a browser that starts; some systems have a command of that name that only says what to install."""
    if CHROMIUM is None:
        pytest.skip("no chromium here: apt-get install chromium")
    blank = tmp_path_factory.mktemp("blank") / "blank.html"
    blank.write_text("<p>here</p>")
    try:
        shown = dumped(CHROMIUM, blank.as_uri(), blank.parent / "profile")
    except (OSError, subprocess.SubprocessError) as error:
        pytest.skip(f"{CHROMIUM} does not start here: {type(error).__name__}")
    if "here" not in shown:
        pytest.skip(f"{CHROMIUM} shows nothing here")
    return CHROMIUM


def dumped(browser, address, profile):
    """Return a page as a browser renders it."""
    options = ("--headless", "--no-sandbox", "--disable-gpu", f"--user-data-dir={profile}", "--dump-dom")
    return subprocess.run([browser, *options, address], capture_output=True, text=True, timeout=60, check=True).stdout


def test_browser_shows_the_report(report, chromium, tmp_path):
    """Cross-check: the page rendered by a browser has every answer and all pictures."""
    shown = dumped(chromium, report.report.as_uri(), tmp_path)
    assert len(re.findall(r'class="badge (?:yes|no)"', shown)) == BADGES
    assert shown.count("data:image/svg+xml") == len(FIGURES) + len(FURTHER)


def test_summary_of_both_parameter_sets():
    """Contract: counts of the parameter set chosen in advance and of the best one, which was chosen afterwards."""
    finding = Finding(True, "words", {})
    verdicts = [Verdict(check, finding, True, finding if check.periodically else None) for check in CHECKS]
    best = [finding] * 3 + [Finding(False, "words", {})] * (len(CHECKS) - 3)
    text = " ".join(_summary(verdicts, best))
    assert f"<strong>{len(CHECKS)} of {len(CHECKS)}</strong>" in text
    assert (
        f"<strong>3 of {len(CHECKS)}</strong><span>checks agree with the best of {BEST_OF // 1000} 000 parameter sets" in text
    )
    assert "chosen before its agreement was known" in text
    assert "chosen afterwards" in text


def test_parameters_have_three_digits_and_units():
    """Contract: every parameter that the two sets differ in has a row, and no number has more than three digits."""
    text = parameter_table(DEFAULT, BEST)
    assert len(re.findall(r"<tr><td", text)) == len(STATED_PARAMETERS) + len(PARAMETERS)
    assert "0.773" in text
    assert "<td>5.1</td>" in text  # journal radius of the best set [mm]
    assert not re.search(r"\d\.\d{4,}", text)
    one = dataclasses.replace(DEFAULT, journal_radius=2.0 * DEFAULT.journal_radius)
    assert parameter_table(DEFAULT, DEFAULT) != parameter_table(DEFAULT, one)


def test_explanations_belong_to_the_answers(report):
    """Contract: each sentence of mechanics explains the answer that comes out; another answer is not explained by it."""
    assert list(EXPLANATIONS) == [check.key for check in CHECKS]
    assert {key for key, (agrees, _) in EXPLANATIONS.items() if agrees} == set(
        " ".join(statement.agreeing for statement in STATEMENTS.values()).split()
    )
    assert "they have changed" not in report.report.read_text()
    assert "it has changed" not in report.report.read_text()
    first = report.verdicts[0]
    other = dataclasses.replace(first, finding=Finding(not first.finding.holds, "words", {}))
    assert explanation(first) == EXPLANATIONS["1a"][1]
    assert explanation(other) == "This answer has no explanation here: it has changed."
    assert summary(1, [other]) != STATEMENTS[1].words


def test_contents_name_every_section(report):
    """Contract: each entry of the contents leads to a section, and no section is missing."""
    text = report.report.read_text()
    sections = re.findall(r'<section><h2 id="([^"]*)">', text)
    entries = re.findall(r'<li><a href="#([^"]*)">', text)
    assert entries == sections
    words = re.sub(r'<pre>.*?</pre>|src="data:[^"]*"', "", text, flags=re.DOTALL)
    assert ".py" not in words
