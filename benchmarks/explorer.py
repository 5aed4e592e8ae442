"""The explorer in Chromium: from a released slider to new curves, frames of the animation, the first page."""

from __future__ import annotations

import resource
import statistics
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from benchmarks.measure import command, table

TESTS = Path(__file__).parent.parent / "tests"
CASE = Path(__file__).parent.parent / "examples" / "paper.toml"

CURVES, FRAMES, PAGE = 0.150, 30.0, 3.0
"""Targets: released slider to new curves [s], frames per second, start of the command to the first page [s]."""

TWELVE = """
[structure]
kind = "scissor"
units = 4

[drive]
speed = "150 rpm"

[[clearance]]
joint = "all"
clearance = "0.5 mm"

[run]
until = "5 ms"
samples = 501
"""
"""Clearance at all twelve joints."""

RELEASE = """([name, part]) => {
  const find = root => {
    for (const each of root.querySelectorAll("*")) {
      if (each.matches("input[type=range]") && each.getAttribute("aria-label") === name) return each;
      const inner = each.shadowRoot && find(each.shadowRoot);
      if (inner) return inner;
    }
    return null;
  };
  const slider = find(document);
  slider.value = part * Number(slider.max);
  slider.dispatchEvent(new Event("input"));
  slider.dispatchEvent(new Event("change"));
}"""
"""A slider that is moved and released at once, so that nothing is computed while it is still held."""

LATENCY = """run => {
  const drawn = window.scissordynDrawn;
  return drawn && drawn.run > run && drawn.at > window.scissordynReleased ? drawn.at - window.scissordynReleased : null;
}"""

DRAWN = "() => document.querySelector('#sd-early canvas[data-drawn]')"
"""Whether the mechanism is drawn, as it is declared."""

MOVES = "() => document.querySelector('#sd-early[data-moves]') || (window.scissordynShown || {}).scene"
"""Whether the drawing moves: with ideal joints, or as a run."""

ARRAY = ("structure.units=5", "clearance.joint=all", "clearance.clearance=0.1 mm")
"""Changes that make an array of five units with clearance at all fifteen joints."""

WEIGHT = """() => performance.getEntriesByType("resource").concat(performance.getEntriesByType("navigation"))
  .reduce((sum, entry) => sum + entry.encodedBodySize, 0)"""


MARKS = """() => ["scissordyn:page", "scissordyn:numbers"].map(
  name => (performance.timeOrigin + performance.getEntriesByName(name)[0].startTime) / 1000)"""
"""When the bar of the page and the numbers of the case were there, in seconds of the clock."""


def measure(quick: bool = False) -> str:
    """The three times, and the weight of the page."""
    sys.path.insert(0, str(TESTS))
    from explore.browser import Tab, chromium, missing, served

    if missing():
        return f"Not measured: {missing()}."
    runs = 5 if quick else 20
    with chromium() as browser, tempfile.TemporaryDirectory() as folder:
        phases, spent, weight, latencies = [], [], 0, []
        for turn in range(2 if quick else 5):
            tab = Tab(browser, "")  # an open window, as that of whoever types the command
            tab.page.wait_for_timeout(1000)
            began, before = time.time(), _spent()
            with served(CASE) as url:
                ready = time.time()
                tab.open(url)
                if turn:  # the first process of all reads its files from the disk
                    phases.append([mark - began for mark in (ready, *tab.page.evaluate(MARKS), time.time())])
                weight = tab.page.evaluate(WEIGHT)
                if turn == 1:
                    latencies = _latencies(tab, runs)
                tab.close()
            if turn > 1:  # a process that has done no more than open a page
                spent.append(_spent() - before)
        twelve = Path(folder) / "twelve.toml"
        twelve.write_text(TWELVE)
        with served(twelve) as url:
            tab = Tab(browser, url)
            frames = _frames(tab, 2.0 if quick else 4.0)
            tab.close()
        drawn, moves = _first_drawings(browser, Path(folder), quick)
    latency = statistics.median(latencies)
    slowest = max(drawn, key=lambda name: drawn[name])
    address, page, numbers, first = (statistics.median(each) for each in zip(*phases, strict=True))
    rows = [
        [
            f"slider released to new curves on the screen, median of {len(latencies)}",
            f"{1e3 * latency:.0f} ms ({1e3 * min(latencies):.0f} to {1e3 * max(latencies):.0f})",
            f"{1e3 * CURVES:.0f} ms: {'met' if latency <= CURVES else 'missed'}",
        ],
        [
            "animation with 12 clearance joints",
            f"{frames:.0f} frames/s",
            f"{FRAMES:.0f}: {'met' if frames >= FRAMES else 'missed'}",
        ],
        [f"start of the command to its address, median of {len(phases)}", f"{address:.1f} s", ""],
        ["to the first page, with its bar, drawing and figures", f"{page:.1f} s", _verdict(page)],
        ["to the numbers of the case", f"{numbers:.1f} s", _verdict(numbers)],
        ["to the first run in drawing and figures", f"{first:.1f} s", _verdict(first)],
        [
            f"to the first drawing, the slowest of {len(drawn)}: every example and a five-unit array",
            f"{drawn[slowest]:.1f} s ({slowest}); median {statistics.median(drawn.values()):.1f} s",
            _verdict(drawn[slowest]),
        ],
        [
            "to its ideal motion, the slowest of them",
            f"{max(moves.values()):.1f} s; median {statistics.median(moves.values()):.1f} s",
            "",
        ],
        ["processor time of the server for it", f"{statistics.median(spent):.1f} s" if spent else "-", ""],
        ["weight of the page, with all libraries", f"{weight / 1e6:.1f} MB", ""],
    ]
    case = "`examples/paper.toml` and a case with 12 clearance joints, in an open window of Chromium without a graphics card."
    return f"{case}\n\n" + table(["measured", "found", "target"], rows)


def _first_drawings(browser: Any, folder: Path, quick: bool) -> tuple[dict[str, float], dict[str, float]]:
    """Times from the start of the command to a drawing, and to one that moves, by the names of cases [s]."""
    from explore.browser import Tab, served
    from scissordyn.config.template import template

    array = folder / "array.toml"
    array.write_text(template("scissor", ("servo", "tip", "payload"), ARRAY))
    drawn, moves = {}, {}
    for case in (*sorted(CASE.parent.glob("*.toml"))[: 2 if quick else None], array):
        tab = Tab(browser, "")
        began = time.time()
        with served(case) as url:
            tab.page.goto(url, wait_until="commit")
            for kind, found in ((DRAWN, drawn), (MOVES, moves)):
                tab.page.wait_for_function(kind, polling=20, timeout=120_000)
                found[case.stem] = time.time() - began
            tab.ready(0, 240.0)
            tab.close()
    return drawn, moves


def _verdict(seconds: float) -> str:
    return f"{PAGE:g} s: {'met' if seconds <= PAGE else 'missed'}"


def _spent() -> float:
    """Processor time of all processes that have ended [s]."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def _latencies(tab: Any, runs: int) -> list[float]:
    """Times between the release of a slider and the frame that shows the new curves [s]."""
    found = []
    for turn in range(runs + 3):
        before = tab.run
        tab.page.evaluate(RELEASE, ["drive speed", 0.35 + 0.3 * (turn % 7) / 6.0 + 1e-3 * turn])
        lasting = tab.page.wait_for_function(LATENCY, arg=before, timeout=30_000).json_value()
        tab.ready(before)
        if turn >= 3:  # the first runs warm up
            found.append(1e-3 * lasting)
    return found


def _frames(tab: Any, seconds: float) -> float:
    """Frames of the animation that are drawn in a second."""
    canvas = tab.page.locator("canvas[data-run]")
    tab.page.locator("[data-id=play]").click()
    tab.page.wait_for_timeout(300)
    first, began = int(canvas.get_attribute("data-drawn")), time.perf_counter()
    tab.page.wait_for_timeout(1e3 * seconds)
    last, ended = int(canvas.get_attribute("data-drawn")), time.perf_counter()
    return (last - first) / (ended - began)


if __name__ == "__main__":
    command("explorer", measure)
