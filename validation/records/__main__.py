"""Compare every step of a copy of the records with their schemes: ``python -m validation.records COPY``.

COPY is the folder ``examples/mechanics`` of https://github.com/siconos/siconos-tutorials, which is not part of this package.
"""

from __future__ import annotations

import math
import sys
from pathlib import Path

import numpy as np

from validation.records.case import by_its_scheme

FILES = {
    "slider-crank": "SliderCrank/SliderCrankMoreauJeanDirectProjectionOSI.ref",
    "woodpecker": "Woodpecker/Woodpecker.ref",
    "four-bar": "FourBarLinkageWith3clearance/FourBarClearance.ref",
}
"""Names of the files by record; a file's first line has its numbers of rows and columns."""


def main(folder: Path) -> None:
    """Print the largest difference of each coordinate and velocity, and the number of steps compared."""
    for name, file in FILES.items():
        record = np.loadtxt(folder / file, skiprows=1)
        kept = by_its_scheme(name)
        if name == "slider-crank":
            wanted = record[:, 1:7] * np.array([2.0 * math.pi, *(1.0,) * 5])
        elif name == "woodpecker":
            wanted = record[:, [1, 3, 5, 2, 4, 6]]
        else:
            wanted, kept = record[:, 1:11], kept[::500, :10]
        count, half = len(wanted), 7 if name == "four-bar" else 3
        missed = np.abs(kept[:count] - wanted).max(axis=0)
        print(f"{name}: {count} rows; places {missed[:half].max():.1e}, velocities {missed[half:].max():.1e}")


if __name__ == "__main__":
    if len(sys.argv) != 2 or not Path(sys.argv[1]).is_dir():
        raise SystemExit(str(__doc__).partition("\n")[0])
    main(Path(sys.argv[1]))
