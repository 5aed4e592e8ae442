"""Messages of many cases, merged if they differ only in their numbers."""

from __future__ import annotations

import re
from collections.abc import Iterable

# Pattern of a number in a text; texts that differ only in numbers form one group
NUMBER = re.compile(r"[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?")


def grouped(texts: Iterable[tuple[str, int]]) -> dict[str, list[int]]:
    """Group cases by their message, the most frequent first; messages that differ only in numbers are one group."""
    groups: dict[str, list[int]] = {}
    label: dict[str, str] = {}
    for text, case in texts:
        cases = groups.setdefault(label.setdefault(NUMBER.sub("#", text), text), [])
        if not cases or cases[-1] != case:  # several joints of a case may give the same message
            cases.append(case)
    return dict(sorted(groups.items(), key=lambda item: -len(item[1])))


def grouped_lines(texts: Iterable[object]) -> dict[str, list[int]]:
    """Group cases by the lines of their messages, the most frequent line first; cases are numbered in the order of `texts`."""
    return grouped((line, case) for case, text in enumerate(texts) for line in str(text).split("\n") if line)
