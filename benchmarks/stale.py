"""List measured pages that are older than a change of what they measure: ``python -m benchmarks.stale``.

A page is as old as its oldest line with machine and versions. It measures the subpackages that its programs reach.
Their changes are commits with a line in the changelog, as changed numbers have, except those of words.
"""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

import grimp

from scissordyn import MODULE_OF

ROOT = Path(__file__).parent.parent


def git(*arguments: str) -> list[str]:
    """Return the lines that git prints."""
    return subprocess.run(["git", *arguments], cwd=ROOT, capture_output=True, text=True, check=True).stdout.splitlines()


def subpackages(graph: grimp.ImportGraph, program: str) -> set[str]:
    """Return the subpackages that a program reaches by imports, public names and commands that it starts."""
    reached = {program, *graph.find_upstream_modules(program, as_package=True)}
    for own in [name for name in reached if not name.startswith("scissordyn")]:
        for path in ROOT.glob(own.replace(".", "/") + "*.py"):
            named = re.findall(r"scissordyn(?:\.\w+)+|\bsd\.\w+", path.read_text(encoding="utf-8"))
            used = {
                f"scissordyn.{MODULE_OF.get(name[3:])}" if name.startswith("sd.") else name for name in named
            } & graph.modules
            reached = reached.union(used, *map(graph.find_upstream_modules, used))
    return {name.split(".")[1] for name in reached if name.startswith("scissordyn.")}


def changes(page: Path, graph: grimp.ImportGraph) -> list[str]:
    """Return the changes since the oldest measurement of a page, and it, as commit, date and subject; the newest first."""
    measured = [
        line.split()[0]
        for line in git("blame", "-ls", "--root", "HEAD", "--", str(page))
        if re.search(r"\d cores, load .*numpy", line)
    ]
    programs = set(re.findall(r"python -m ([\w.]+)", page.read_text(encoding="utf-8"))) & graph.modules
    if not measured or not programs:  # written by hand, or by a program that was removed
        return []
    oldest = git("log", "--no-walk", "--format=%h %cs %s", *measured)[-1]
    since, form = f"{oldest.split()[0]}..", "--format=%h %cs %s"
    folders = {f"src/scissordyn/{name}*" for program in programs for name in subpackages(graph, program)}
    listed = set(git("log", form, since, "--", "CHANGELOG.md"))
    return [line for line in git("log", form, since, "--", *folders) if line in listed and " words:" not in line] + [oldest]


if __name__ == "__main__":
    everything = grimp.build_graph("scissordyn", "benchmarks", "validation", cache_dir=None)
    for page in [ROOT / "docs/validation.md", *sorted(ROOT.glob("docs/decisions/measured/*.md"))]:
        *found, oldest = changes(page, everything) or [""]
        if found:
            print(f"{page.relative_to(ROOT)}: {len(found)} changes since {oldest}", *found[:3], sep="\n    ")
