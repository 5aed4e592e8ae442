"""Pages printed as PDF by a browser."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import pytest

from scissordyn.errors import InputError, ScissordynError
from scissordyn.file.pdf import BROWSERS, printed

PAGE = b"<!doctype html><html><title>Study</title><h1>first</h1><h1 style='break-before: page'>second</h1></html>"


def browser(folder: Path, monkeypatch: pytest.MonkeyPatch, line: str) -> None:
    """The only browser there is, as a shell script."""
    path = folder / BROWSERS[0]
    path.write_text(f"#!/bin/sh\n{line}\n", encoding="utf-8")
    path.chmod(0o755)
    monkeypatch.setattr(shutil, "which", lambda name: str(path) if name == BROWSERS[0] else None)


@pytest.mark.skipif(not any(map(shutil.which, BROWSERS)), reason="no browser that prints")
def test_a_page_is_printed() -> None:
    """Contract: a PDF with the pages that were asked for."""
    found = printed(PAGE)
    assert found.startswith(b"%PDF-")
    assert found.rstrip().endswith(b"%%EOF")
    assert len(re.findall(rb"/Type\s*/Page\b", found)) == 2


def test_without_a_browser_there_is_none(monkeypatch: pytest.MonkeyPatch) -> None:
    """Contract: the error says what to type."""
    monkeypatch.setattr(shutil, "which", lambda name: None)
    with pytest.raises(InputError, match=r"-o report\.html"):
        printed(PAGE)


def test_what_a_browser_does_not_print_is_an_error(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Contract: nothing written, or something that is no PDF."""
    browser(tmp_path, monkeypatch, "exit 3")
    with pytest.raises(ScissordynError, match="has not printed"):
        printed(PAGE)
    browser(tmp_path, monkeypatch, 'for a in "$@"; do case $a in --print-to-pdf=*) echo no > "${a#*=}";; esac; done')
    with pytest.raises(ScissordynError, match="is no PDF"):
        printed(PAGE)
