"""Sizes of pictures and letters for a journal's column, a page or slides."""

from __future__ import annotations

from collections.abc import Mapping
from types import TracebackType
from typing import Any

import matplotlib as mpl

from scissordyn.errors import InputError, did_you_mean

STYLES: Mapping[str, Mapping[str, Any]] = {
    "screen": {"figure.figsize": mpl.rcParamsDefault["figure.figsize"], "font.size": mpl.rcParamsDefault["font.size"]},
    "single-column": {"figure.figsize": (3.54, 2.6), "font.size": 8.75},
    "double-column": {"figure.figsize": (7.48, 3.6), "font.size": 8.75},
    "slides": {"figure.figsize": (10.0, 5.6), "font.size": 18.0},
}
"""matplotlib's rcParams by name. Columns are 90 and 190 mm wide, as most journals of mechanics have them; letters are then 7 pt
(ticks, legends) and 8 pt (labels) in print."""


class _Applied:
    """rcParams that have been set; at the end of a ``with`` block they are as before."""

    def __init__(self, chosen: Mapping[str, Any]) -> None:
        parameters: Any = mpl.rcParams  # its keys are annotated one by one
        self._parameters, self._before = parameters, {name: parameters[name] for name in chosen}
        parameters.update(chosen)

    def __enter__(self) -> None:
        """They are set already."""

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self._parameters.update(self._before)


def style(name: str = "screen", **parameters: Any) -> _Applied:
    """Set the size of new pictures and of their letters, for the rest of a program or in a ``with`` block.

    ``with sd.style("single-column"): sd.plot.force(run)``. Pictures follow matplotlib's rcParams: figure.figsize (of pictures
    with several rows of panels its width), font.size, font.family, axes.labelsize, xtick.labelsize, text.usetex.

    Parameters
    ----------
    name : str
        "screen", "single-column" (90 mm), "double-column" (190 mm) or "slides".
    **parameters
        Further rcParams, with underscores in place of dots: ``font_family="serif"``, ``text_usetex=True``.

    Returns
    -------
    context manager
        At its end the parameters are as before.

    Raises
    ------
    InputError
        For an unknown style or parameter, or a value that matplotlib refuses.
    """
    if name not in STYLES:
        raise InputError(f"style '{name}'{did_you_mean(name, STYLES)}", ", ".join(STYLES), 'sd.style("single-column")')
    parameters_by_word: dict[str, str] = {parameter.replace(".", "_"): parameter for parameter in mpl.rcParams}
    for word in parameters:
        if word not in parameters_by_word:
            raise InputError(
                f"style: {word}{did_you_mean(word, parameters_by_word)}", "rcParams of matplotlib", 'font_family="serif"'
            )
    chosen: dict[str, Any] = {**STYLES[name], **{parameters_by_word[word]: value for word, value in parameters.items()}}
    try:
        mpl.RcParams(chosen)
    except ValueError as error:
        raise InputError(f"style: {error}", "what matplotlib allows", 'sd.style("single-column")') from None
    return _Applied(chosen)
