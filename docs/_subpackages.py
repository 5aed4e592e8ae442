"""Drawing of the package: a chart of its subpackages and modules, whose arrows are the imports between them."""

from __future__ import annotations

__all__ = ["import_chart"]


def import_chart() -> list[str]:
    """Return the lines of a Mermaid chart; an arrow that a longer way implies is not drawn."""
    import grimp  # imported here because the site is built without it

    graph = grimp.build_graph("scissordyn", include_external_packages=False, cache_dir=None)
    names = sorted(child.rpartition(".")[2] for child in graph.find_children("scissordyn"))
    imports = {
        part: {
            other
            for other in names
            if other != part and graph.direct_import_exists(importer=_path(part), imported=_path(other), as_packages=True)
        }
        for part in names
    }
    lines = ["```mermaid", "flowchart TD"]
    lines += [f"    {part} --> {other}" for part in names for other in sorted(_direct(imports, part))]
    return [*lines, "```"]


def _path(part: str) -> str:
    return f"scissordyn.{part}"


def _direct(imports: dict[str, set[str]], part: str) -> set[str]:
    """Return what a part imports, without what other parts that it imports lead to."""
    return {other for other in imports[part] if not any(other in _below(imports, way) for way in imports[part] - {other})}


def _below(imports: dict[str, set[str]], part: str) -> set[str]:
    """Return all parts that a part leads to."""
    found, left = set[str](), [part]
    while left:
        new = imports[left.pop()] - found
        found |= new
        left += new
    return found
