"""Results of long benchmarks, saved so that an interrupted benchmark continues."""

from __future__ import annotations

import dataclasses
import hashlib
import json
import tempfile
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any, Generic, TypeVar

import scissordyn as sd

__all__ = ["Kept"]

Result = TypeVar("Result")


class Kept(Generic[Result]):
    """Results by key, one line each in a file in the system's temporary folder.

    The file belongs to the present sources of the package and the benchmark: after a change everything is measured again.

    Parameters
    ----------
    name : str
        Name of the benchmark.
    kind : type
        A dataclass.
    *sources : str
        Files of the benchmark.
    """

    def __init__(self, name: str, kind: type[Result], *sources: str) -> None:
        folder = Path(tempfile.gettempdir()) / "scissordyn-benchmarks"
        folder.mkdir(exist_ok=True)
        self.path = folder / f"{name}-{_digest(sources)}.jsonl"
        self.done: dict[Any, Result] = {}
        if self.path.exists():
            for line in self.path.read_text(encoding="utf-8").splitlines():
                key, fields = json.loads(line)
                self.done[tuple(key) if isinstance(key, list) else key] = kind(**fields)

    def complete(self, keys: Iterable[Any], result: Callable[[Any], Result]) -> list[Result]:
        """Return the results of all keys; missing ones are computed."""
        found = []
        for key in keys:
            if key not in self.done:
                self.add(key, result(key))
            found.append(self.done[key])
        return found

    def add(self, key: Any, result: Result) -> None:
        """Save one more result."""
        self.done[key] = result
        with self.path.open("a", encoding="utf-8") as file:
            file.write(json.dumps([key, dataclasses.asdict(result)]) + "\n")  # type: ignore[call-overload]


def _digest(sources: tuple[str, ...]) -> str:
    digest = hashlib.sha256()
    for path in [*sorted(Path(sd.__file__).parent.rglob("*.py")), *map(Path, sources)]:
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]
