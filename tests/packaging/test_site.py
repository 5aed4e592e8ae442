"""The equations of the site, as a browser without a network shows them."""

import importlib.util
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
BROWSER = shutil.which("chromium") or shutil.which("chromium-browser")
OFFLINE = (
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--host-resolver-rules=MAP * ~NOTFOUND",
    "--virtual-time-budget=30000",
)


@pytest.mark.slow
@pytest.mark.skipif(BROWSER is None, reason="no chromium")
@pytest.mark.skipif(importlib.util.find_spec("myst_nb") is None, reason="the site's requirements are not installed")
def test_equations_render_without_a_network(tmp_path: Path) -> None:
    """Contract: every displayed equation of the theory becomes a picture, and none an error."""
    theory = "\n".join(path.read_text(encoding="utf-8") for path in sorted((ROOT / "docs" / "theory").glob("*.md")))
    equations = re.findall(r"^\$\$\n.*?^\$\$\n", theory, flags=re.MULTILINE | re.DOTALL)
    assert len(equations) > 30
    source = tmp_path / "source"
    source.mkdir()
    (source / "index.md").write_text("# Equations\n\n" + "\n".join(equations), encoding="utf-8")
    command = [
        sys.executable,
        "-m",
        "sphinx",
        "-b",
        "html",
        "-q",
        "-c",
        str(ROOT / "docs"),
        str(source),
        str(tmp_path / "site"),
    ]
    subprocess.run(command, check=True, timeout=300, cwd=tmp_path)
    page = (tmp_path / "site" / "index.html").as_uri()
    shown = subprocess.run(
        [str(BROWSER), *OFFLINE, f"--user-data-dir={tmp_path / 'profile'}", "--dump-dom", page],
        check=True,
        timeout=120,
        capture_output=True,
        text=True,
    ).stdout
    assert re.findall(r'data-mjx-error="([^"]*)"', shown) == []
    assert len(re.findall(r"<mjx-container[^>]*display=\"true\"", shown)) == len(equations)
