"""Double and triple pendulum: parameters compared with those of the authors, and errors of prediction over time."""

from __future__ import annotations

import dataclasses
import math
import time as clocks
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import xarray as xr

import scissordyn as sd
from scissordyn.analysis.agreement import Measured
from scissordyn.casefile.configuration import read_configuration
from scissordyn.model.mechanism import Mechanism
from scissordyn.model.parameter_path import number
from validation.measured.pendulum import Numbers, numbers, pendulum
from validation.measured.read import estimated, records

__all__ = ["Comparison", "compared", "error_over_time", "horizon"]

OPTIONS = sd.Options(1.0, "as-placed")

FREE = {
    2: ["arm 1.inertia", "arm 1.centre.x", "arm 1.points.end.x", "arm 2.inertia", "friction A.damping", "friction B.damping"],
    3: [
        *("arm 1.inertia", "arm 1.centre.x", "arm 1.points.end.x", "arm 2.inertia", "arm 2.centre.x", "arm 2.points.end.x"),
        *("arm 3.inertia", "friction A.damping", "friction B.damping", "friction C.damping"),
    ],
}
"""Parameters that are fitted; masses and the last mass centre keep the authors' values, as a free oscillation allows."""

LEAST = 1e-5  # Smallest initial value of a damping coefficient in the search [N m s/rad]


@dataclass(frozen=True)
class Comparison:
    """Parameters of a chain by its authors and by a fit, and errors of prediction.

    Parameters
    ----------
    arms : int
    fit : Dataset
    theirs : list of float
        Authors' values of the fitted parameters.
    seconds : float
        Duration of the fit [s].
    elapsed : ndarray
        Times since the start of a piece [s].
    ours_error, their_error : ndarray
        Root mean square over pieces and arms of the error of predicted angles [rad].
    horizon : float
        Median time in which an error of the start grows tenfold [s].
    """

    arms: int
    fit: xr.Dataset
    theirs: list[float]
    seconds: float
    elapsed: np.ndarray
    ours_error: np.ndarray
    their_error: np.ndarray
    horizon: float


def compared(copy: Path, arms: int, every: int) -> Comparison:
    """Fit every second piece of the recording, and predict the others after their first tenth.

    Parameters
    ----------
    copy : Path
        Copy of the repository, see `read`.
    arms : {2, 3}
    every : int
        Use every n-th instant.
    """
    pieces = records(copy, arms, "id", every) + records(copy, arms, "vad", every)
    given: Numbers = numbers(estimated(copy, arms))
    theirs = pendulum(given)
    start = pendulum(dataclasses.replace(given, damping=[max(LEAST, one) for one in given.damping]))
    began = clocks.process_time()
    fit = sd.fit(start, pieces[::2], FREE[arms], segment=math.inf, options=OPTIONS)
    seconds = clocks.process_time() - began
    ours = read_configuration(fit).build_mechanism()
    values = [float(number(theirs, name).value) for name in FREE[arms]]
    left = pieces[1::2]
    elapsed, mine = error_over_time(ours, left, arms)
    _, other = error_over_time(theirs, left, arms)
    found = Comparison(arms, fit, values, seconds, elapsed, mine, other, horizon(ours, left))
    print(found.fit[["value", "standard_error"]].to_dataframe(), found.theirs, found.seconds, found.horizon, flush=True)
    print(np.round(found.ours_error[::8], 4), np.round(found.their_error[::8], 4), fit.attrs["warnings"], flush=True)
    return found


def error_over_time(made: Mechanism, pieces: list[Measured], arms: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the root mean square error of the angles over the time since the start of a piece."""
    held = sd.prediction(made, OPTIONS, pieces, segment=math.inf)
    error = (held["predicted"] - held["measured"]).values[:, :arms]
    count = min(piece.time.size for piece in pieces)
    rows = np.concatenate([np.flatnonzero(held["segment"].values == k)[:count] for k in range(len(pieces))])
    squares = np.mean(error[rows].reshape(len(pieces), count, arms) ** 2, axis=(0, 2))
    return held["elapsed"].values[rows[:count]], np.sqrt(squares)


def horizon(made: Mechanism, pieces: list[Measured]) -> float:
    """Return the median over the pieces of the time in which a start difference of 1e-6 rad in each angle grows tenfold."""
    times = []
    for piece in pieces:
        bodies = [
            dataclasses.replace(
                body,
                angle=float(piece.column(f"angle of {body.name}")[0]),
                angular_velocity=float(piece.column(f"angular_velocity of {body.name}")[0]),
            )
            for body in made.bodies
        ]
        until = float(piece.time[-1] - piece.time[0])
        runs = []
        for change in (0.0, 1e-6):
            moved = tuple(dataclasses.replace(body, angle=body.angle + change * (-1.0) ** k) for k, body in enumerate(bodies))
            case = made.with_parts({"bodies": moved}, check=False)
            runs.append(sd.simulate(case, until=until, start="as-placed", samples=401, rtol=1e-12, atol=1e-12)["angle"].values)
        apart = np.linalg.norm(runs[1] - runs[0], axis=1)
        grown = np.flatnonzero(apart > 10.0 * apart[0])
        times.append(until * grown[0] / 400.0 if grown.size else until)
    return float(np.median(times))
