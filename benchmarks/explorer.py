"""Measure the explorer in Chromium: new curves after a slider's release, frames per second, the first page, memory."""

from __future__ import annotations

import json
import statistics
import subprocess
import sys
import tempfile
import threading
import time
from contextlib import ExitStack
from pathlib import Path
from signal import SIGINT
from typing import Any

from benchmarks.measure import command, table
from scissordyn.config.template import template

TESTS = Path(__file__).parent.parent / "tests"
CASE = Path(__file__).parent.parent / "examples" / "paper.toml"

CURVES, FRAMES, DRAWING, FIRST = 0.080, 30.0, 1.0, 1.5
"""Targets: release of a slider to new curves [s], frames per second, a page to its first drawing and first curves [s]."""

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
"""Lines of a case file that give clearance to all twelve joints."""

RELEASE = """([name, part]) => {
  const slider = document.querySelector(`input[type=range][aria-label="${name}"]`);
  slider.value = part * Number(slider.max);
  slider.dispatchEvent(new Event("input"));
  slider.dispatchEvent(new Event("change"));
}"""
"""Script that moves and releases a slider at once, so that nothing is computed while it is held."""

LATENCY = """run => {
  const { drawn, released } = window.scissordyn;
  return drawn && drawn.run > run && drawn.at > released ? drawn.at - released : null;
}"""

ARRIVALS = """window.arrived = [];
const Socket = window.WebSocket;
window.WebSocket = class extends Socket {
  constructor(...given) {
    super(...given);
    this.addEventListener("message", event => {
      if (event.data.byteLength > 20000) window.arrived.push(performance.now());
    });
  }
};"""
"""Script that records when messages with runs arrive."""

DRAWN = "() => document.querySelector('#sd-canvas canvas[data-drawn]') && window.scissordyn"
"""Script: whether the mechanism is drawn and declared."""

SHOWN = "() => ((window.scissordyn || {}).shown || { bar: { note: 'none' } }).bar.note === ''"
"""Script: whether the run of the case is shown, and not an earlier one."""

ARRAY = ("structure.units=5", "clearance.joint=all", "clearance.clearance=0.1 mm")
"""Changes that make an array of five units with clearance at all fifteen joints."""

TWENTY = ("structure.units=20", "clearance.joint=all", "clearance.clearance=0.1 mm", "run.until=2 ms", "run.samples=101")
"""Changes that make an array of twenty units with clearance at all joints."""

WEIGHT = """() => performance.getEntriesByType("resource").concat(performance.getEntriesByType("navigation"))
  .reduce((sum, entry) => sum + entry.encodedBodySize, 0)"""


def measure(quick: bool = False) -> str:
    """Return the times, the memory of the server and the weight of the page."""
    sys.path.insert(0, str(TESTS))
    from explore.browser import Tab, chromium, missing, served

    if missing():
        return f"Not measured: {missing()}."
    turns, runs = (2, 5) if quick else (5, 20)
    with chromium() as browser, tempfile.TemporaryDirectory() as folder:
        started = [_opening(browser, CASE) for _ in range(turns)]
        with served(CASE) as url:
            tab = Tab(browser, "")
            tab.page.add_init_script(ARRIVALS)
            tab.open(url)
            weight = tab.page.evaluate(WEIGHT)
            latencies = _latencies(tab, runs, "drive speed")
            opened = [_page(browser, url) for _ in range(turns)]
            tab.close()
        memory = {count: _memory(count) for count in (1, 20)}
        cases = {
            "twelve": TWELVE,
            "array": template("scissor", ("servo", "tip", "payload"), ARRAY),
            "twenty": template("scissor", (), TWENTY),
        }
        for name, text in cases.items():
            (Path(folder) / f"{name}.toml").write_text(text)
        with served(Path(folder) / "twelve.toml") as url:
            tab = Tab(browser, url)
            frames = _frames(tab, 2.0 if quick else 4.0)
            tab.close()
        with served(Path(folder) / "twenty.toml") as url:
            tab = Tab(browser, url, patience=300.0)
            beyond = _beyond(tab, runs // 4)
            tab.close()
        examples = [*sorted(CASE.parent.glob("*.toml"))[: 2 if quick else None], Path(folder) / "array.toml"]
        slowest = max((_opening(browser, case, whole=False)[0], case.stem) for case in examples)
        server = [_server(path, 1 + runs // 2) for path in (CASE, Path(folder) / "twenty.toml")]
    latency, arrival = (statistics.median(column) for column in zip(*latencies, strict=True))
    totals = [total for total, _ in latencies]
    drawing, curves = (statistics.median(column) for column in zip(*opened, strict=True))
    first_drawing, first_curves = (statistics.median(column) for column in zip(*started, strict=True))
    rows = [
        [
            f"slider released to new curves on the screen, median of {len(latencies)}",
            f"{1e3 * latency:.0f} ms ({1e3 * min(totals):.0f} to {1e3 * max(totals):.0f})",
            f"{1e3 * CURVES:.0f} ms: {_verdict(latency, CURVES)}",
        ],
        [
            "of it until the message of the run is there, and until it is drawn",
            f"{1e3 * arrival:.0f} and {1e3 * (latency - arrival):.0f} ms",
            "",
        ],
        [
            "processor time of the server for one change, the run in it; of twenty units",
            " and ".join(f"{1e3 * used:.0f} ms" for used in server),
            "",
        ],
        [
            "the same of twenty units, beyond the computation of the accurate run: ideal and coarse runs can precede it",
            f"{1e3 * beyond:.0f} ms",
            f"150 ms: {_verdict(beyond, 0.150)}",
        ],
        [f"page to its first drawing, median of {turns}", f"{drawing:.2f} s", f"{DRAWING:g} s: {_verdict(drawing, DRAWING)}"],
        ["page to the curves of its run", f"{curves:.2f} s", f"{FIRST:g} s: {_verdict(curves, FIRST)}"],
        ["start of the command to its first drawing", f"{first_drawing:.1f} s", ""],
        ["start of the command to the curves of the run", f"{first_curves:.1f} s", ""],
        [
            f"start of the command to the first drawing, the slowest of {len(examples)}",
            f"{slowest[0]:.1f} s ({slowest[1]})",
            "",
        ],
        [
            "animation with 12 clearance joints",
            f"{frames:.0f} frames/s",
            f"{FRAMES:.0f}: {'met' if frames >= FRAMES else 'missed'}",
        ],
        ["memory of the server with one page and with twenty", " and ".join(f"{memory[count]:.0f} MB" for count in memory), ""],
        ["weight of the page", f"{weight / 1e6:.2f} MB", ""],
    ]
    case = "`examples/paper.toml`, cases of 12 and 60 clearance joints; an open window of Chromium without a graphics card."
    return f"{case}\n\n" + table(["measured", "found", "target"], rows)


def _opening(browser: Any, case: Path, *, whole: bool = True) -> tuple[float, float]:
    """Return the times from the start of the command to the first drawing and to the curves of the run [s]."""
    from explore.browser import Tab, served

    tab = Tab(browser, "")  # an open window, like that of a user who types the command
    began = time.time()
    with served(case) as url:
        times = _times(tab, url, began, whole=whole)
        tab.close()
    return times


def _page(browser: Any, url: str) -> tuple[float, float]:
    """Return the times from the request for a page to its first drawing and to the curves of its run [s]."""
    from explore.browser import Tab

    tab = Tab(browser, "")
    times = _times(tab, url, time.time(), whole=True)
    tab.close()
    return times


def _times(tab: Any, url: str, began: float, *, whole: bool) -> tuple[float, float]:
    tab.page.goto(url, wait_until="commit")
    tab.page.wait_for_function(DRAWN, polling=10, timeout=120_000)
    drawn = time.time() - began
    if whole:
        tab.page.wait_for_function(SHOWN, polling=10, timeout=120_000)
    return drawn, time.time() - began


def _memory(pages: int) -> float:
    """Return the resident memory of a server with `pages` pages, each with its run [MB]."""
    from websockets.sync.client import connect

    command = [sys.executable, "-m", "scissordyn.cli.main", "explore", str(CASE), "--no-browser"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process, ExitStack() as stack:
        assert process.stdout is not None
        stack.callback(process.send_signal, SIGINT)
        url = process.stdout.readline().split()[0]
        for _ in range(pages):
            page = stack.enter_context(connect(f"ws{url.removeprefix('http')}ws", max_size=None))
            while b'"type":"run"' not in bytes(page.recv(60.0)):  # type: ignore[arg-type]
                pass
        time.sleep(3.0)
        status = Path(f"/proc/{process.pid}/status").read_text()
        return int(status.partition("VmRSS:")[2].split()[0]) / 1e3


def _verdict(found: float, target: float) -> str:
    return "met" if found <= target else "missed"


def _latencies(tab: Any, runs: int, slider: str) -> list[tuple[float, float]]:
    """Return times from the release of a slider to the frame with the new curves, and to their message [s]."""
    times = []
    for turn in range(runs + 3):
        before = tab.run
        tab.page.evaluate(RELEASE, [slider, 0.35 + 0.3 * (turn % 7) / 6.0 + 1e-3 * turn])
        lasting = tab.page.wait_for_function(LATENCY, arg=before, timeout=300_000).json_value()
        tab.ready(before)
        if turn >= 3:  # the first runs warm up
            arrived, released = tab.page.evaluate("() => [window.arrived, window.scissordyn.released]")
            times.append((1e-3 * lasting, 1e-3 * (next(at for at in arrived if at > released) - released)))
    return times


def _server(path: Path, runs: int) -> float:
    """Return the median processor time of the server for a change of one number with its run [s]."""
    from scissordyn.explore.case import open_case
    from scissordyn.explore.page import Page
    from scissordyn.explore.serve import pack_message
    from scissordyn.explore.session import Session

    case, shown = open_case(path), threading.Event()
    used: list[float] = []

    def send(message: Any) -> None:
        pack_message(message)
        if "scene" in message and not message["bar"]["note"]:
            shown.set()
        if "scene" in message:
            threading.Timer(1e-3, lambda: page.hear(json.dumps({"type": "drawn", "run": message["run"]}))).start()

    page = Page(Session(case, lambda what: None), send)
    page.begin()
    shown.wait(300.0)
    for turn in range(runs):
        time.sleep(1.5)  # the run has been recomputed for its curves
        shown.clear()
        began = time.process_time()
        page.hear(json.dumps({"type": "change", "key": "drive.speed", "text": f"{151 + turn} rpm"}))
        shown.wait(300.0)
        used.append(time.process_time() - began)
    page.close()
    return statistics.median(used)


def _beyond(tab: Any, runs: int) -> float:
    """Return the median delay of new curves after the run was computed, by the time that the run reports [s]."""
    times = []
    for turn in range(runs):
        before = tab.run
        tab.page.evaluate(RELEASE, ["drive speed", 0.45 + 0.01 * turn])
        tab.ready(before)
        drawn, released = tab.page.evaluate("() => [window.scissordyn.drawn.at, window.scissordyn.released]")
        value, unit = tab.state.split(" in ")[1].split()
        times.append(1e-3 * (drawn - released) - float(value) * {"s": 1.0, "ms": 1e-3}[unit])
    return statistics.median(times)


def _frames(tab: Any, seconds: float) -> float:
    """Return the number of frames of the animation per second."""
    canvas = tab.page.locator("#sd-canvas canvas")
    tab.page.locator("[data-id=play]").click()
    tab.page.wait_for_timeout(300)
    first, began = int(canvas.get_attribute("data-drawn")), time.perf_counter()
    tab.page.wait_for_timeout(1e3 * seconds)
    last, ended = int(canvas.get_attribute("data-drawn")), time.perf_counter()
    return (last - first) / (ended - began)


if __name__ == "__main__":
    command("explorer", measure)
