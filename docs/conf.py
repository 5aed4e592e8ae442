"""The site: ``make docs``."""

from __future__ import annotations

import inspect
import re
import shutil
import sys
from importlib import metadata
from pathlib import Path
from typing import Any

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE.parent / "src"))
sys.path.insert(0, str(HERE))

import _generate  # noqa: E402
import _notebooks  # noqa: E402
import _pictures  # noqa: E402
import _split  # noqa: E402
import _tables  # noqa: E402
from docutils import nodes  # noqa: E402

import scissordyn as sd  # noqa: E402

project = "scissordyn"
author = "the scissordyn developers"
copyright = "2026, the scissordyn developers"
version = release = sd.__version__

extensions = ["myst_nb", "sphinx.ext.autodoc", "sphinx.ext.autosummary", "sphinx.ext.mathjax", "numpydoc"]
INTERNAL = ("decisions", "maintain.md", "reference.md", "release.md")
"""Pages for developers: they stay in the repository and are no part of the site or of its search."""

exclude_patterns = ["_build", "jupyter_execute", *INTERNAL, "decisions/**"]
html_theme = "furo"
html_title = "scissordyn"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_copy_source = False
html_show_sphinx = False
html_search_scorer = str(HERE / "_scorer.js")
suppress_warnings = ["config.cache"]

NOTEBOOKS = "_static/notebooks"
"""Where the site has the tutorials as notebooks."""

# equations are rendered by a copy of MathJax beside the pages, so that they can be read without a network
MATHJAX = "tex-svg-full.js"
mathjax_path = f"mathjax/{MATHJAX}"

myst_enable_extensions = ["dollarmath", "amsmath", "deflist", "colon_fence", "attrs_inline"]
myst_heading_anchors = 4
myst_dmath_double_inline = True

nb_execution_mode = "cache"
nb_execution_cache_path = str(HERE.parent / "out" / "notebooks")
nb_execution_in_temp = True
# a cell may compile kernels for minutes, and other processes may have the processors
nb_execution_timeout = 1800
nb_execution_raise_on_error = True
nb_merge_streams = True

autosummary_generate = False
autodoc_typehints = "none"
autodoc_member_order = "groupwise"
numpydoc_show_class_members = False
numpydoc_class_members_toctree = False
numpydoc_xref_param_type = False


def _rewrite_links(_app: Any, docname: str, source: list[str]) -> None:
    """Replace links to folders, to files outside docs and to pages for developers by the path in the repository."""
    folder = (HERE / docname).parent

    def plain(match: re.Match[str]) -> str:
        moved = _split.moved_target(docname, match[2])
        label, target = match[1], moved.split("#")[0]
        if not target or "://" in target or target.startswith(("mailto:", "doi:")):
            return f"[{label}]({moved})"
        path = (folder / target).resolve()
        inside = path.is_relative_to(HERE) and path.relative_to(HERE).parts[0] not in INTERNAL
        if path.is_dir() or not inside:
            if not path.exists():
                raise FileNotFoundError(f"{docname}: {match[2]}")
            shown = path.relative_to(HERE.parent)
            return f"{label} (`{shown}`)" if label != str(shown) else f"`{shown}`"
        return f"[{label}]({moved})"

    source[0] = _split.shortened(docname, source[0])
    source[0] = re.sub(r"(?<!!)\[(`[^`]+`|[^\]]+)\]\(([^)\s]+)\)", plain, source[0])


def _show_thumbnails(_app: Any, docname: str, source: list[str]) -> None:
    """Show the picture of each mechanism of the zoo in its row of the gallery."""
    if docname == "gallery":
        row = r"^\| (\[[^\]]+\]\(zoo/([\w-]+)\.md\)) "
        source[0] = re.sub(row, r"| ![\2](zoo/\2.png){width=180px} \1 ", source[0], flags=re.MULTILINE)


def _offer_notebook(_app: Any, docname: str, source: list[str]) -> None:
    """A link to the page as a Jupyter notebook, below its title."""
    if docname.startswith("tutorials/") and "{code-cell}" in source[0]:
        name = docname.removeprefix("tutorials/")
        link = f'<p><a href="../{NOTEBOOKS}/{name}.ipynb" download>Download this page as a notebook</a></p>'
        source[0] = re.sub(r"^(# .*)$", rf"\1\n\n```{{raw}} html\n{link}\n```", source[0], count=1, flags=re.MULTILINE)


def _write_notebooks(app: Any, failure: Exception | None) -> None:
    """Each tutorial as a notebook beside the pages."""
    if failure is None:
        _notebooks.write_notebooks(Path(app.outdir) / NOTEBOOKS)


def _plain_docstring(_app: Any, what: str, name: str, obj: Any, _options: Any, lines: list[str]) -> None:
    """Sections that numpydoc leaves are plain paragraphs; a class without parameters lists its fields."""
    if (
        what == "class"
        and not any(line.startswith(":Parameters") or "rubric" in line for line in lines)
        and inspect.isclass(obj)
    ):
        lines += _generate.fields(obj)


def _literal_formulas(_app: Any, _what: str, _name: str, _obj: Any, _options: Any, lines: list[str]) -> None:
    """Formulas in the text of a docstring keep their lines."""
    lines[:] = _generate.literal_formulas(lines)


def _copy_mathjax(app: Any, failure: Exception | None) -> None:
    """The one file of MathJax that the pages load, from the package of requirements-docs.txt."""
    if failure is None:
        [source] = [path for path in metadata.files("sphinx-mathjax-offline") or () if path.name == MATHJAX]
        target = Path(app.outdir) / "_static" / mathjax_path
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(source.locate(), target)


def _keep_tags(_app: Any, doctree: Any) -> None:
    r"""Numbered equations with line breaks stay as written: Sphinx would put them into an environment that allows no \tag."""
    for equation in doctree.findall(nodes.math_block):
        text = equation.astext()
        if r"\tag" in text and r"\\" in text:
            equation["no-wrap"] = True
            equation.children = [nodes.Text(rf"\[{text}\]")]


def setup(app: Any) -> None:
    """Generate what is made from declarations, and connect."""
    _generate.write(HERE)
    _split.write()
    _tables.refresh(HERE)
    _pictures.draw_pictures()
    app.connect("doctree-read", _keep_tags)
    app.connect("build-finished", _copy_mathjax)
    app.connect("build-finished", _write_notebooks)
    app.connect("source-read", _rewrite_links)
    app.connect("source-read", _show_thumbnails)
    app.connect("source-read", _offer_notebook)
    app.connect("autodoc-process-docstring", _literal_formulas, priority=400)  # before numpydoc
    app.connect("autodoc-process-docstring", _plain_docstring)
