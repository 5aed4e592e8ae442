"""The explorer in Chromium: from a released slider to new curves, frames of the animation, the first page."""

from __future__ import annotations

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

WEIGHT = """() => performance.getEntriesByType("resource").concat(performance.getEntriesByType("navigation"))
  .reduce((sum, entry) => sum + entry.encodedBodySize, 0)"""


def measure(quick: bool = False) -> str:
    """The three times, and the weight of the page."""
    sys.path.insert(0, str(TESTS))
    from explore.browser import Tab, chromium, missing, served

    if missing():
        return f"Not measured: {missing()}."
    runs = 5 if quick else 20
    with chromium() as browser, tempfile.TemporaryDirectory() as folder:
        pages, firsts, weight, latencies = [], [], 0, []
        for turn in range(2 if quick else 5):
            began = time.perf_counter()
            with served(CASE) as url:
                ready = time.perf_counter() - began
                tab = Tab(browser, url)
                if turn:  # the first process of all reads its files from the disk
                    pages.append(ready)
                    firsts.append(time.perf_counter() - began)
                weight = tab.page.evaluate(WEIGHT)
                if turn == 1:
                    latencies = _latencies(tab, runs)
                tab.close()
        twelve = Path(folder) / "twelve.toml"
        twelve.write_text(TWELVE)
        with served(twelve) as url:
            tab = Tab(browser, url)
            frames = _frames(tab, 2.0 if quick else 4.0)
            tab.close()
    latency, first = statistics.median(latencies), statistics.median(firsts)
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
        ["start of the command to the page being served", f"{statistics.median(pages):.1f} s", ""],
        [
            f"start of the command to the first page with its run, median of {len(firsts)}",
            f"{first:.1f} s",
            f"{PAGE:g} s: {'met' if first <= PAGE else 'missed'}",
        ],
        ["weight of the page, with all libraries", f"{weight / 1e6:.1f} MB", ""],
    ]
    return "`examples/paper.toml` and a case with 12 clearance joints, in Chromium without a graphics card.\n\n" + table(
        ["measured", "found", "target"], rows
    )


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
