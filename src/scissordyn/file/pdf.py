"""Conversion of an HTML page to PDF by a browser of this machine."""

from __future__ import annotations

import os
import shutil
import subprocess
import tempfile
from pathlib import Path

from scissordyn.errors import InputError, ScissordynError

BROWSERS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome", "microsoft-edge", "msedge")
"""Commands of browsers that can print a page without opening a window."""


PDF_MAGIC = b"%PDF-"  # first bytes of a PDF file


def print_pdf(page: bytes, sample: str = "-o report.html") -> bytes:
    """Print an HTML page as PDF; raise an error if no browser is installed or the browser fails."""
    browser = next(filter(None, map(shutil.which, BROWSERS)), None)
    if browser is None:
        raise InputError("a PDF report needs a browser, and none is installed", "Chromium, Chrome or Edge; or HTML", sample)
    with tempfile.TemporaryDirectory(prefix="scissordyn-", ignore_cleanup_errors=True) as folder:
        source, target = Path(folder) / "page.html", Path(folder) / "page.pdf"
        source.write_bytes(page)
        options = ["--headless", "--disable-gpu", "--no-pdf-header-footer", f"--user-data-dir={folder}/profile"]
        if getattr(os, "geteuid", lambda: 1)() == 0:  # the browser's sandbox does not start for the superuser
            options.append("--no-sandbox")
        try:
            subprocess.run(
                [browser, *options, f"--print-to-pdf={target}", source.as_uri()], capture_output=True, timeout=120, check=False
            )
            content = target.read_bytes()
        except (OSError, subprocess.SubprocessError) as error:
            raise ScissordynError(f"{browser} did not print the report: {type(error).__name__}") from None
    if not content.startswith(PDF_MAGIC):
        raise ScissordynError(f"{browser} did not print the report: its output is not a PDF")
    return content
