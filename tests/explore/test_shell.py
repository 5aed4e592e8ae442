"""The first page of the explorer, which the browser gets before the libraries of the page are imported."""

from __future__ import annotations

import asyncio
from typing import Any

import pytest

pytest.importorskip("panel", reason="the package panel is not installed")

from bokeh.document import Document
from panel.io.resources import Resources, bundle_resources
from panel.io.state import set_curdoc
from tornado.ioloop import IOLoop

from scissordyn.explore.access import Access
from scissordyn.explore.first import FirstRun
from scissordyn.explore.page import Page
from scissordyn.explore.shell import SCRIPTS, Entrance, package_folder


def test_frame_has_the_scripts_of_the_page() -> None:
    """Cross-check: the scripts and their order are those that the library lists for the page, but WebGL and maps of imports."""

    async def bundled() -> Any:  # a page is made in the server's loop
        IOLoop.current()
        document = Document()
        with set_curdoc(document):
            Page("case.toml", FirstRun(lambda: pytest.fail("nothing is read yet"))).show()
            return bundle_resources(document.roots, Resources(mode="server", root_url=""))

    bundle = asyncio.run(bundled())
    listed = [str(url).partition("?")[0].lstrip("/") for url in bundle.js_files]
    assert [url for url in listed if "bokeh-gl" not in url and "es-module-shims" not in url] == list(SCRIPTS)


def test_scripts_are_files_of_the_packages() -> None:
    """Contract: each script is where the server looks for it, without an import of the packages."""
    folders = {
        "static/extensions/panel/": package_folder("panel") / "dist",
        "static/js/": package_folder("bokeh") / "server" / "static" / "js",
    }
    for script in SCRIPTS:
        start = next(start for start in folders if script.startswith(start))
        assert (folders[start] / script.removeprefix(start)).is_file()


def test_name_of_a_case_is_text_in_the_first_page() -> None:
    """Contract: a file named like a script shows its name."""
    frame = Entrance("<script>alert(1)</script>.toml", Access("token", ())).frame
    assert "<script>alert" not in frame
    assert "&lt;script&gt;alert(1)&lt;/script&gt;.toml" in frame
