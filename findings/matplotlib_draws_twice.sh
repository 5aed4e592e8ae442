#!/usr/bin/env bash
# matplotlib 3.11.2 (PyPI), 2026-11-30: a figure whose layout engine was switched off is still drawn twice by savefig.
#
# `figure.set_layout_engine("none")` keeps the computed layout and replaces the engine by a placeholder. savefig draws a figure with any engine once
# without output, to apply its layout, and then again: also with the placeholder, which applies nothing. Without an engine it draws once.
# Seen: 2 drawings with "constrained", 2 after switching it off by "none", 1 without an engine.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check matplotlib==3.11.2
cat > "$folder/look.py" <<'PY'
import io

from matplotlib.figure import Figure
from matplotlib.lines import Line2D


class Counted(Line2D):
    drawn = 0

    def draw(self, renderer):
        Counted.drawn += 1
        super().draw(renderer)


def drawings(layout, then=""):
    figure = Figure(layout=layout)
    axes = figure.add_subplot()
    axes.add_line(Counted([0, 1], [0, 1]))
    if then:
        figure.draw_without_rendering()
        figure.set_layout_engine(then)
    Counted.drawn = 0
    figure.savefig(io.BytesIO(), format="png")
    return Counted.drawn


seen = {"constrained": drawings("constrained"), "then none": drawings("constrained", "none"), "no engine": drawings(None)}
print(seen)
assert seen == {"constrained": 2, "then none": 2, "no engine": 1}, "savefig draws another number of times now"
PY
"$folder/venv/bin/python" "$folder/look.py"
