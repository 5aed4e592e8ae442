"""Findings of a study as data, the table of their texts, and the sections of its page."""

from __future__ import annotations

import re
import string
from collections.abc import Sequence
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any

from scissordyn.plot.scale import Scale

INTERVAL = "[ (95 % interval {low:.1%} to {high:.1%})]"
FIT = "(R2 {r2:.2f}, {error:.1%} error at points left out of the fit)"
NEEDED = "[, with the other parameters {others} at the point above][; cases fail at {failing} of {points} on that side]"

WORDS = MappingProxyType(
    {
        # whether and where the requirements are met
        "unknown": "No case is complete: the requirements cannot be judged.",
        "probability": f"Probability that all requirements are met: {{fraction:.1%}}{INTERVAL}, from {{trials}} samples.",
        "met": "{always} of {tried} points meet all requirements[; {partly} more in some of their cases]: "
        f"{{fraction:.1%}} of the {{of}}{INTERVAL}. These points have {{where}}[; {{wider}} may take most of their range].",
        "met in part": "No point meets all requirements in all its cases (0 of {tried}); {partly} meet them in some of their "
        f"cases: {{fraction:.1%}} of the {{of}}{INTERVAL}.",
        "met nowhere": "No point meets all requirements (0 of {tried})[; at most {high:.1%} of the range meets them (95 %)].",
        "met range": "{part} {first:u} to {last:u}{unit} (of {least:u} to {most:u})",
        "met value": "{part} = {first:u}{unit} (of {least:u} to {most:u})",
        "met names": "{part} = {names}[ (of {tried})]",
        # the point to build
        "least margin": "The requirement with the least margin: {part}, {margin}.",
        "recommended": "Recommended: point {point}, {where}. Least margin: {part}, {margin}.",
        "nearest": "Nearest to the requirements: point {point}, {where}. Least margin: {part}, {margin}.",
        "only point": "The only point, {where}. Least margin: {part}, {margin}.",
        "samples": "It meets all requirements in {hits} of {samples} samples of the uncertain parameters: probability "
        "{fraction:.0%} (95 % interval {low:.1%} to {high:.1%}).[ The same samples chose this point; new samples {chosen}.]",
        "value": "{part} = {value:u}{unit}",
        "name": "{part} = {value}",
        # trends of responses
        "no trend": f"{{part}}: no clear trend with {{numbers}} {FIT}.",
        "constant": f"{{part}}: nearly constant {FIT}.",
        "trend": f"{{part}}: {{how}}[; hardly depends on {{little}}] {FIT}.",
        "factor": "{verb} with {part} by a factor of {factor:.3g}",
        "exponent": "{verb} with {part} (exponent {slope:.2f} ± {half:.2f})",
        "exponent 1": "about proportional to {part} (exponent {slope:.2f} ± {half:.2f})",
        "exponent 2": "about proportional to the square of {part} (exponent {slope:.2f} ± {half:.2f})",
        "exponent -1": "about inversely proportional to {part} (exponent {slope:.2f} ± {half:.2f})",
        "exponent 0.5": "about proportional to the root of {part} (exponent {slope:.2f} ± {half:.2f})",
        "line": "{verb} linearly with {part}, by {change} from {first:u3} to {last:u3}{unit}",
        "line of a name": "{verb} by {change} with {part}",
        "no number": "{part}: no value in {missing} of {cases}, which count as not met; no trend is fitted to the other cases.",
        # values that requirements need
        "need": f"{{part}} requires {{number}} of {{side}} about {{value:u2}}{{unit}}{NEEDED}.",
        "need beyond": f"{{part}} requires {{number}} of {{side}} about {{value:u2}}{{unit}}{NEEDED} (extrapolated: the data "
        "go from {first:u3} to {last:u3}{unit}[; {form} fits as well and gives {other:u2}{unit}]"
        "[; {lacking} fits as well and gives no such value]).",
        "met everywhere": f"{{part}}: according to this trend, met at every {{number}} of the range{NEEDED}.",
        "not enough": f"{{part}}: according to this trend, no {{number}} in or near the range is sufficient{NEEDED}.",
        # members
        "agree": "Members (runs whose starts differ by round-off) agree to {least:.1%} of every measure at all points.",
        "disagree": "Members (runs whose starts differ by round-off) differ by more than {least:.1%} of a measure at {differ} "
        "of {tried} ({fraction}): the motion is chaotic there, and the answer is a distribution.[ Round-off decides at "
        "{undecided} of them whether all requirements are met.]",
        # cheap and accurate runs
        "both": "{fraction:.1%} of the range meets all requirements ({low:.1%} to {high:.1%}, 95 %), from {cheap} points with "
        "cheap runs[, an interpolation between {interpolated}] and {accurate} accurate runs[; accurate runs alone would "
        "take {saved:.1f} times as many][ and {longer:.1f} times the time of both].",
        "cheap": "Points, maps, trends and worst cases come from cheap runs; accurate runs correct the table of both kinds.",
        "confirmed": "Of the best {tried} points of the search, {met} meet all requirements in accurate runs; all other "
        "values of the search come from cheap runs.",
        "confirmed front": "Of {tried} points of the search that were run accurately, {best} meet all requirements and are "
        "best there; all other values of the search come from cheap runs.",
        # proposals for further computation
        "pending": "Cases are pending",
        "narrower": "For a narrower interval",
        "new samples": "To check the recommended point with new samples",
        "tolerances": "To check the recommended point with tolerances",
        "more points": "For a more certain fraction of the range",
        "goes on": "To reach {part} if the trend continues",
        "interpolated": "To compute the point that meets them by interpolation",
        "search": "To search the same ranges for a point that meets them",
    }
)
"""Texts in brackets are printed only if all their numbers are known. Formats that begin with u use the unit of the finding."""

OPTIONAL = re.compile(r"\[([^\]]*)\]")


@dataclass(frozen=True)
class Fact:
    """Fact about a part of a study: a requirement, a response, a parameter that varies, or the whole study.

    Numbers are in SI units, or are facts of which the sentence consists; None is not known.
    """

    kind: str
    part: str = ""
    numbers: dict[str, Any] = field(default_factory=dict)
    scale: Scale | None = field(default=None, compare=False)  # Unit and scale of the numbers shown

    def __str__(self) -> str:
        unit = f" {self.scale.unit}" if self.scale is not None and self.scale.unit else ""
        numbers = {"part": self.part, "unit": unit, **self.numbers}
        written = _Words(self.scale)

        def optional(words: re.Match[str]) -> str:
            names = [name for _, name, _, _ in written.parse(words[1]) if name]
            return words[1] if all(numbers.get(name) is not None for name in names) else ""

        return written.vformat(OPTIONAL.sub(optional, WORDS[self.kind]), (), numbers)

    def to_plain(self) -> dict[str, Any]:
        """Return plain data for JSON."""
        return {"kind": self.kind, "part": self.part, "numbers": {name: _plain(value) for name, value in self.numbers.items()}}


class _Words(string.Formatter):
    def __init__(self, scale: Scale | None) -> None:
        self._scale = scale

    def format_field(self, value: Any, format_spec: str) -> str:
        if isinstance(value, tuple):
            return ("; " if any(fact.kind.startswith("met ") for fact in value) else ", ").join(map(str, value))
        if not format_spec.startswith("u"):
            return str(super().format_field(value, format_spec))
        assert self._scale is not None
        digits = int(format_spec[1:] or 4)
        text = self._scale.text(value, digits)
        return f"{float(text):g}" if digits == 2 else text


def _plain(value: Any) -> Any:
    if isinstance(value, tuple):
        return [fact.to_plain() for fact in value]
    return value.item() if hasattr(value, "item") else value


@dataclass(frozen=True)
class Section:
    """A part of the answers; the last column of its table may be "command", what can be typed."""

    head: tuple[str, ...] = ()
    rows: Sequence[tuple[str, ...]] = ()
    title: str = ""
    notes: tuple[str, ...] = ()  # Sentences below the table
    lines: Sequence[object] = ()  # Above it
