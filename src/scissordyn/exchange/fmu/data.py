"""The numbers of a mechanism in C: one block of words for each instance, and the arrays that lie in it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from scissordyn.compiler.kind import Array, Struct, Tuple, kind_of, written

GAP = 6  # So many zeros in a row begin a new run of numbers


class Block:
    """All arrays of some named tuples, each in one place however often it is named."""

    def __init__(self, roots: Mapping[str, Any], known: dict[Any, Any]) -> None:
        self.known = known
        self.words: list[Any] = []
        self.places: dict[tuple[int, int], int] = {}
        self.lines: list[str] = []
        for name, root in roots.items():
            self._connect(f"m->{name}", root)

    def _connect(self, name: str, content: Any) -> None:
        kind = kind_of(content, name.rpartition(".")[2], self.known)
        if isinstance(kind, Struct):
            for part, value in content._asdict().items():
                self._connect(f"{name}.{part}", value)
        elif isinstance(kind, Tuple):
            for k, number in enumerate(content):
                self._connect(f"{name}.v[{k}]", number)
        elif isinstance(kind, Array):
            shape = [str(size) for size in content.shape] + ([str(content.shape[1])] if content.ndim == 2 else [])
            pointer = f"({kind.element.c} *)(m->w + {self._place(content)})"
            self.lines.append(f"    {name} = ({kind.c}){{{', '.join([pointer, *shape])}}};")
        else:
            self.lines.append(f"    {name} = {written(content)};")

    def _place(self, array: np.ndarray) -> int:
        """Where an array begins; one that is there already, as that of another tuple, is not repeated."""
        key = (array.ctypes.data, array.size)
        if array.size and key in self.places:
            return self.places[key]
        place = len(self.words)
        self.words += [
            number for entry in array.ravel().tolist() for number in (entry if isinstance(entry, tuple) else (entry,))
        ]
        self.places[key] = place
        return place

    def text(self) -> str:
        """The numbers at the start, where they are not zero, and `connect`, which puts them into an instance."""
        runs: list[tuple[int, list[Any]]] = []
        for place, number in enumerate(self.words):
            if number == 0 and not (isinstance(number, float) and np.signbit(number)):
                continue
            if runs and place - (runs[-1][0] + len(runs[-1][1])) < GAP:
                start, numbers = runs[-1]
                numbers += [0] * (place - start - len(numbers)) + [number]
            else:
                runs.append((place, [number]))
        flat = [number for _, numbers in runs for number in numbers]
        texts = [f"{{.{'f' if isinstance(number, float) else 'i'} = {written(number)}}}" for number in flat]
        rows = [", ".join(texts[k : k + 6]) for k in range(0, len(texts), 6)]
        table = ", ".join(f"{{{start}, {len(numbers)}}}" for start, numbers in runs)
        return "\n".join(
            (
                f"enum {{ WORDS = {len(self.words)}, RUNS = {len(runs)} }};",
                "static const word NUMBERS[] = {\n    " + ",\n    ".join(rows or ["{0}"]) + "};",
                f"static const int RUN[][2] = {{{table or '{0, 0}'}}};",
                "",
                "static void connect(Fmu *m) {",
                "    const word *from = NUMBERS;",
                "    for (int run = 0; run < RUNS; run++) {",
                "        memcpy(m->w + RUN[run][0], from, (size_t)RUN[run][1] * sizeof(word));",
                "        from += RUN[run][1];",
                "    }",
                *self.lines,
                "}",
                "",
            )
        )
