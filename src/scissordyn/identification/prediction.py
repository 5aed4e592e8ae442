"""What a fitted mechanism predicts of records that it was not fitted to."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr

from scissordyn.analysis.agreement import Measured
from scissordyn.errors import InputError
from scissordyn.identification.problem import FailedRunError, Problem, records_of
from scissordyn.identification.start import prepared
from scissordyn.model.mechanism import Mechanism
from scissordyn.model.options import Options

WINDOW = 0.1  # Part of a record from which its start is estimated, in growing windows


def prediction(
    mechanism: Mechanism,
    options: Options,
    records: Sequence[Measured],
    *,
    segment: float | None = None,
    window: float = WINDOW,
) -> xr.Dataset:
    """Runs of a mechanism beside records that were not used to fit it.

    Parameters
    ----------
    mechanism : Mechanism
    options : Options
        Of its runs.
    records : sequence of Measured
    segment : float, optional
        As for `fit`: duration of parts that start anew [s]; if None each record starts as the case says.
    window : float
        Part of a segment, from its start on, that its start is estimated from; what follows is predicted.

    Returns
    -------
    Dataset
        Over `row` and `column`: `measured`, `predicted`; over `row`: `time`, `segment`, `elapsed` since the start of the
        segment [s], `counted`, whether it is behind the window. Over `column`: `rms` of the errors that count.

    Raises
    ------
    InputError
        If a run fails, or a window is no part of a record.
    """
    if not 0.0 < window < 1.0:
        raise InputError(f"a window of {window:g}", "a part of a record between 0 and 1", "0.1")
    segments, columns, options = prepared(mechanism, options, records, segment=segment, windows=(0.5 * window, window))
    problem = Problem(mechanism, options, (), segments, columns, np.ones(len(columns)))
    try:
        predicted = np.concatenate([shown.curves for shown in problem.everything_shown(problem.start())])
    except FailedRunError as failed:
        raise InputError(
            f"a run that is to predict fails: {failed}", "a mechanism that runs over the time of the data"
        ) from None
    rows = records_of(segments)
    elapsed = np.concatenate([part.record.time - part.record.time[0] for part in segments])
    cut = [0.0 if part.chart is None else window * (part.record.time[-1] - part.record.time[0]) for part in segments]
    counted = elapsed >= np.array(cut)[rows["segment"][1]]
    rms = np.sqrt(np.mean((predicted - rows["measured"][1])[counted] ** 2, axis=0))
    about = {"long_name": "root mean square error of what was predicted, in the unit of its column"}
    return xr.Dataset(
        {
            **rows,
            "elapsed": ("row", elapsed, {"units": "s", "long_name": "time since the start of the segment"}),
            "counted": ("row", counted, {"long_name": "whether it is behind the window"}),
            "predicted": (("row", "column"), predicted, {"long_name": "value that the mechanism predicts"}),
            "rms": ("column", rms, about),
        },
        attrs={"title": "scissordyn prediction"},
    )
