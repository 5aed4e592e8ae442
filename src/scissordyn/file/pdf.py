"""A page as PDF, printed by a browser of this machine."""

from __future__ import annotations

import os
import shutil
import subprocess
import tempfile
from pathlib import Path

from scissordyn.errors import InputError, ScissordynError

BROWSERS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome", "microsoft-edge", "msedge")
"""Commands of browsers that print without a window."""

LONGEST = 120  # Time that a browser may take [s]

START = b"%PDF-"


def printed(page: bytes, sample: str = "-o report.html") -> bytes:
    """A page in HTML as PDF."""
    browser = next(filter(None, map(shutil.which, BROWSERS)), None)
    if browser is None:
        raise InputError("a report as PDF without a browser that prints", "Chromium, Chrome or Edge; or HTML", sample)
    with tempfile.TemporaryDirectory(prefix="scissordyn-", ignore_cleanup_errors=True) as folder:
        source, target = Path(folder) / "page.html", Path(folder) / "page.pdf"
        source.write_bytes(page)
        options = ["--headless", "--disable-gpu", "--no-pdf-header-footer", f"--user-data-dir={folder}/profile"]
        if getattr(os, "geteuid", lambda: 1)() == 0:  # its sandbox does not start for the superuser
            options.append("--no-sandbox")
        try:
            subprocess.run(
                [browser, *options, f"--print-to-pdf={target}", source.as_uri()],
                capture_output=True,
                timeout=LONGEST,
                check=False,
            )
            content = target.read_bytes()
        except (OSError, subprocess.SubprocessError) as error:
            raise ScissordynError(f"{browser} has not printed the report: {type(error).__name__}") from None
    if not content.startswith(START):
        raise ScissordynError(f"{browser} has not printed the report: what it wrote is no PDF")
    return content
