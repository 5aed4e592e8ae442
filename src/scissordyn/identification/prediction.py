"""Predictions of a fitted mechanism for records that were not used for the fit."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr

from scissordyn.analysis.agreement import Measured
from scissordyn.errors import InputError
from scissordyn.identification.problem import FailedRunError, Problem, records_of
from scissordyn.identification.start import prepare_segments
from scissordyn.model.mechanism import Mechanism
from scissordyn.model.options import Options
from scissordyn.units import checked


@checked
def prediction(
    mechanism: Mechanism, options: Options, records: Sequence[Measured], *, segment: float | None = None, window: float = 0.1
) -> xr.Dataset:
    """Run a mechanism for records that were not used to fit it.

    Parameters
    ----------
    mechanism : Mechanism
    options : Options
        Options of the runs.
    records : sequence of Measured
    segment : float, optional
        Duration of segments whose starts are estimated, as in `fit` [s]; if None, the case gives the start of each record.
    window : float
        Initial fraction of a segment from which its start is estimated; the rest is predicted.

    Returns
    -------
    Dataset
        Over `row` and `column`: `measured`, `predicted`. Over `row`: `time`, `segment`, `elapsed` since the start of the
        segment [s], and `counted` (False inside the window). Over `column`: `rms` of the counted errors.

    Raises
    ------
    InputError
        If a run fails, or `window` is not between 0 and 1.
    """
    if not 0.0 < window < 1.0:
        raise InputError(f"window = {window:g}", "the initial fraction of a segment, between 0 and 1", "window=0.1")
    segments, columns, options = prepare_segments(mechanism, options, records, segment=segment, windows=(0.5 * window, window))
    problem = Problem(mechanism, options, (), segments, columns, np.ones(len(columns)))
    try:
        predicted = np.concatenate([run.curves for run in problem.run_segments(problem.start())])
    except FailedRunError as failed:
        raise InputError(
            f"a run for the prediction fails: {failed}", "a mechanism that runs over the time of the data"
        ) from None
    rows = records_of(segments)
    elapsed = np.concatenate([part.record.time - part.record.time[0] for part in segments])
    cut = [0.0 if part.chart is None else window * (part.record.time[-1] - part.record.time[0]) for part in segments]
    counted = elapsed >= np.array(cut)[rows["segment"][1]]
    rms = np.sqrt(np.mean((predicted - rows["measured"][1])[counted] ** 2, axis=0))
    about = {"long_name": "root mean square error of the prediction, in the unit of its column"}
    return xr.Dataset(
        {
            **rows,
            "elapsed": ("row", elapsed, {"units": "s", "long_name": "time since the start of the segment"}),
            "counted": ("row", counted, {"long_name": "true after the window, where errors count in rms"}),
            "predicted": (("row", "column"), predicted, {"long_name": "predicted value"}),
            "rms": ("column", rms, about),
        },
        attrs={"title": "scissordyn prediction"},
    )
