"""The pictures of docs/examples.md: each example as it is assembled, and at four instants of its run."""

from __future__ import annotations

import sys
from pathlib import Path

from scissordyn.config.file import read_case
from scissordyn.plot.file import write
from scissordyn.plot.preview import preview
from scissordyn.plot.structure import structure
from scissordyn.simulation.run import simulate

ROOT = Path(__file__).parent.parent


def draw(name: str) -> None:
    """Draw one example."""
    case = read_case(ROOT / "examples" / f"{name}.toml")
    run = simulate(case.mechanism, **case.run.keywords)
    for axes, ending in ((preview(case.mechanism), "-preview"), (structure(run, case.mechanism)[0], "")):
        figure = axes.get_figure(root=True)
        assert figure is not None
        print(write(figure, ROOT / "docs" / "examples" / f"{name}{ending}.png"), flush=True)


if __name__ == "__main__":
    for path in sorted((ROOT / "examples").glob("*.toml")):
        if len(sys.argv) < 2 or path.stem in sys.argv[1:]:
            draw(path.stem)
