"""Compute the results of measured pendula: ``python -m validation.measured COPY`` (about ten minutes).

COPY is a copy of the repository that `read` names.
"""

from __future__ import annotations

import sys
from pathlib import Path

from validation.measured.chains import compared
from validation.measured.friction import at_rest, cross_validated, forecasts
from validation.measured.picture import draw

PICTURE = Path(__file__).parents[2] / "docs" / "decisions" / "measured" / "pendula.png"


def main(copy: Path) -> None:
    """Print all results, and draw the picture of their page."""
    rest = {law: fit for law, fit in at_rest(copy).items() if law in ("viscous", "dry")}
    chains = [compared(copy, arms, 40) for arms in (2, 3)]
    print(draw(PICTURE, chains, rest))
    forecasts(copy)
    cross_validated(copy)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
