"""Drawing of the rooms of the package: a chart whose arrows are the imports between them."""

from __future__ import annotations

__all__ = ["room_chart"]


def room_chart() -> list[str]:
    """Return the lines of a Mermaid chart; an arrow that a longer way implies is not drawn."""
    import grimp  # imported here because the site is built without it

    graph = grimp.build_graph("scissordyn", include_external_packages=False, cache_dir=None)
    names = sorted(child.rpartition(".")[2] for child in graph.find_children("scissordyn"))
    imports = {
        room: {
            other
            for other in names
            if other != room and graph.direct_import_exists(importer=_path(room), imported=_path(other), as_packages=True)
        }
        for room in names
    }
    lines = ["```mermaid", "flowchart TD"]
    lines += [f"    {room} --> {other}" for room in names for other in sorted(_direct(imports, room))]
    return [*lines, "```"]


def _path(room: str) -> str:
    return f"scissordyn.{room}"


def _direct(imports: dict[str, set[str]], room: str) -> set[str]:
    """Return what a room imports, without what other rooms that it imports lead to."""
    return {other for other in imports[room] if not any(other in _below(imports, way) for way in imports[room] - {other})}


def _below(imports: dict[str, set[str]], room: str) -> set[str]:
    """Return all rooms that a room leads to."""
    found, left = set[str](), [room]
    while left:
        new = imports[left.pop()] - found
        found |= new
        left += new
    return found
