"""Run a server of the explorer in a separate process, and its page in Chromium; record the messages that the page logs."""

from __future__ import annotations

import shutil
from contextlib import contextmanager
from pathlib import Path
from signal import SIGINT

from tests.process import Duplicate, run_program

CASE = """
[structure]
kind = "scissor"
units = 2            # two of them
bar_length = "2 m"
angle = "30 deg"

[drive]
speed = "150 rpm"

[[clearance]]
joint = "A"
clearance = "0.5 mm"

[[clearance]]
joint = "unit 1/pivot"
clearance = "0.3 mm"

[run]
until = "8 ms"
samples = 401
"""
"""Case file with two clearance joints without friction, whose run takes some ten milliseconds."""

MOST_THREADS = 100  # Largest number of threads that a server may start


def missing():
    """Return the reason why a browser cannot be driven here, empty if it can."""
    for name in ("websockets", "tomlkit", "playwright"):
        try:
            __import__(name)
        except ImportError:
            return f"the package {name} is not installed"
    return "" if shutil.which("chromium") else "the program chromium is not installed (apt-get install chromium)"


@contextmanager
def served(case, *options):
    """Serve the page of a case by the command until the end of the block; yield its address."""
    process = Duplicate(run_program, "explore", case, "--no-browser", *options)
    try:
        line = process.stdout.readline()
        yield line.split()[0] if line.startswith("http://127.0.0.1:") else ""
        tasks = Path(f"/proc/{process.pid}/task")
        assert not tasks.exists() or len(list(tasks.iterdir())) < MOST_THREADS
    finally:
        process.send_signal(SIGINT)
        _, said = process.communicate(timeout=10)
    assert process.returncode == 130, said  # minus a signal if Ctrl-C does not end the server
    # a page that is closed in the middle of a run is none of the explorer's faults
    assert "scissordyn/" not in said, said


@contextmanager
def chromium():
    """Yield Debian's Chromium without a window."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=shutil.which("chromium"), args=["--no-sandbox"])
        yield browser
        browser.close()


class Tab:
    """Page of the explorer in the browser.

    Parameters
    ----------
    browser
        Of Playwright.
    url : str
        "" for a window that is empty until `open`.
    size : (int, int)
        Width and height of the window [pixel].
    dark : bool
        Whether the browser asks for dark pages.
    patience : float
        Longest time that a run may take [s].
    """

    def __init__(self, browser, url, *, size=(1500, 900), dark=False, patience=60.0):
        self.patience = patience
        self.context = browser.new_context(
            viewport={"width": size[0], "height": size[1]},
            accept_downloads=True,
            permissions=["clipboard-read", "clipboard-write"],
            color_scheme="dark" if dark else "light",
        )
        self.page = self.context.new_page()
        self.errors: list[str] = []
        self.weight = 0
        self.page.on("console", lambda message: self.errors.append(message.text) if message.type == "error" else None)
        self.page.on("pageerror", lambda error: self.errors.append(str(error)))
        self.page.on("dialog", lambda dialog: (self.errors.append(f"dialog: {dialog.message}"), dialog.dismiss()))
        self.page.on("requestfailed", lambda request: self.errors.append(f"failed: {request.url}"))
        if url:
            self.open(url)

    def open(self, url):
        """Open a page, and wait for its first run."""
        self.page.on("request", lambda request: self._local(request.url, url))
        self.page.goto(url)
        self.ready(0, 4.0 * self.patience)  # kernels that no run has needed yet are compiled first

    def _local(self, asked, url):
        origin = "/".join(url.split("/", 3)[:3])
        if not asked.startswith((url, "data:", f"blob:{origin}/")):
            self.errors.append(f"a request to {asked}")

    def ready(self, before, patience=None):
        """Wait until canvas, curves and bar show a run with a number above `before`; return its number."""
        self.page.wait_for_function(
            """before => {
              const number = wanted => Number((document.querySelector(wanted) || { dataset: {} }).dataset.run || 0);
              const state = document.querySelector(".sd-state"), run = number("#sd-canvas canvas");
              return document.querySelector(".sd-row") && state && state.dataset.computing === "false" && run > before
                && number("#sd-curves") === run && number(".sd-state") === run && state.dataset.ordered === state.dataset.run;
            }""",
            arg=before,
            polling=50,  # to look at each frame would slow the page down
            timeout=1e3 * (self.patience if patience is None else patience),
        )
        return self.run

    def fine(self):
        """Wait until the curves go through the instants of the contacts of the run."""
        self.page.locator(".sd-state[data-fine=true]").wait_for(timeout=1e3 * self.patience)

    def until(self, condition):
        """Wait until a condition holds."""
        for _ in range(200):
            if condition():
                return
            self.page.wait_for_timeout(50)
        raise AssertionError("it did not happen within 10 s")

    @property
    def run(self):
        """Number of the run that is shown."""
        return int(self.page.locator("#sd-canvas canvas").get_attribute("data-run") or 0)

    @property
    def state(self):
        """Text of the page's status bar."""
        return str(self.page.locator(".sd-state").text_content())

    def press(self, name):
        """Press a button of the bar, in its menu if it is in one."""
        menu = self.page.locator(".sd-bar details", has=self.page.locator(f"button[data-id={name}]"))
        if menu.count() and menu.get_attribute("open") is None:
            menu.locator("summary").click()
        self.page.locator(f".sd-bar button[data-id={name}]").click()

    def field(self, key):
        """Open the group of a number and return its row."""
        row = self.page.locator(f".sd-form details .sd-row[data-key='{key}']")
        if not row.is_visible():
            self.page.locator(".sd-form details", has=self.page.locator(f".sd-row[data-key='{key}']")).locator(
                "summary"
            ).click()
        return row

    def type(self, key, text):
        """Type a number."""
        box = self.field(key).locator("input[type=text]")
        box.fill(text)
        box.press("Enter")

    def text(self, key):
        """Return the text in the field of a number."""
        return str(self.field(key).locator("input[type=text]").input_value())

    def handle(self, name):
        """Return the position of a joint or of the handle of a length in the window [pixel]."""
        x, y = self.page.locator(".sd-stage").evaluate("(root, name) => root.handles()[name]", name)
        box = self.page.locator(".sd-stage canvas").bounding_box()
        return box["x"] + x, box["y"] + y

    def drag(self, start, end, *, steps=6):
        """Move the pointer with its button down from one place of the window to another [pixel]."""
        mouse = self.page.mouse
        mouse.move(*start)
        mouse.down()
        mouse.move(*end, steps=steps)
        self.page.wait_for_timeout(300)
        mouse.up()

    def table(self):
        """Return the table of contacts: number of its run, titles, all rows and visible rows, as texts."""
        script = """root => ({
          run: Number(root.dataset.run), rows: window.scissordyn.contacts.rows(),
          titles: [...root.querySelectorAll("[role=columnheader]")].map(cell => cell.textContent),
          seen: [...root.querySelectorAll(".sd-rows [role=row]")].map(row => [...row.children].map(cell => cell.textContent)),
        })"""
        return dict(self.page.locator(".sd-contacts").evaluate(script))

    def curve(self, figure, label="", *, axis="y", pinned=False):
        """Return the numbers of the line of a figure with a label, or of the first line."""
        script = """([name, label, axis, pinned]) => {
          const lines = window.scissordyn.shown.figures.find(each => each.name === name).lines;
          const line = lines.find(each => (each.style === "dash") === pinned && (!label || each.label === label));
          return Array.from(line[axis]);
        }"""
        return list(self.page.evaluate(script, [figure, label, axis, pinned]))

    def close(self):
        """Close the page; fail if it has logged an error."""
        self.context.close()
        assert not self.errors, self.errors
