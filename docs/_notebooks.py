"""The tutorials as notebooks of Jupyter, without results: `python docs/_notebooks.py DIR`; needs myst-nb."""

from __future__ import annotations

import sys
from pathlib import Path

import nbformat
from myst_nb.core.read import read_myst_markdown_notebook

__all__ = ["write_notebooks"]

TUTORIALS = Path(__file__).parent / "tutorials"


def write_notebooks(target: Path) -> list[Path]:
    """Write every tutorial that has cells.

    Parameters
    ----------
    target : Path
        Folder, made if it is not there.
    """
    target.mkdir(parents=True, exist_ok=True)
    written = []
    for page in sorted(TUTORIALS.glob("*.md")):
        text = page.read_text(encoding="utf-8")
        if "{code-cell}" in text:
            written.append(target / f"{page.stem}.ipynb")
            nbformat.write(read_myst_markdown_notebook(text), written[-1])
    return written


if __name__ == "__main__":
    print(*(path.name for path in write_notebooks(Path(sys.argv[1]))), sep="\n")
