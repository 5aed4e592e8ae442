"""What a fitted mechanism predicts of records that it was not fitted to."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np
import xarray as xr

from scissordyn.analysis.agreement import Measured
from scissordyn.errors import InputError
from scissordyn.identification.fit import prepared
from scissordyn.identification.forward import FailedRunError
from scissordyn.identification.problem import Problem, Segment
from scissordyn.identification.solve import estimated_start
from scissordyn.model.mechanism import Mechanism
from scissordyn.run.options import Options

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
    first, columns, options = prepared(mechanism, options, [records[0].rows(0, 2)], segment=None)
    del first
    parts = [part for record in records for part in (record.segments(segment) if segment is not None else [record])]
    segments, bodies, cut = list[Segment](), mechanism.bodies, np.zeros(len(parts))
    if segment is not None:
        options = dataclasses.replace(options, start="as-placed")
    for k, part in enumerate(parts):
        if segment is None:
            segments.append(Segment(part, None, np.zeros(len(columns))))
        else:
            started, bodies = estimated_start(mechanism, options, part, columns, bodies, (0.5 * window, window))
            segments.append(started)
            cut[k] = window * (part.time[-1] - part.time[0])
    problem = Problem(mechanism, options, (), segments, columns, np.ones(len(columns)))
    try:
        curves = np.concatenate(problem.every_curve(problem.start()))
    except FailedRunError as failed:
        raise InputError(
            f"a run that is to predict fails: {failed}", "a mechanism that runs over the time of the data"
        ) from None
    sizes = [part.time.size for part in parts]
    owner = np.repeat(np.arange(len(parts)), sizes)
    time, measured = np.concatenate([part.time for part in parts]), np.concatenate([part.values for part in parts])
    elapsed = time - np.repeat([part.time[0] for part in parts], sizes)
    counted = elapsed >= cut[owner]
    rms = np.sqrt(np.mean((curves - measured)[counted] ** 2, axis=0))
    about = {"long_name": "root mean square error of what was predicted, in the unit of its column"}
    return xr.Dataset(
        {
            "time": ("row", time, {"units": "s", "long_name": "time"}),
            "segment": ("row", owner, {"long_name": "segment"}),
            "elapsed": ("row", elapsed, {"units": "s", "long_name": "time since the start of the segment"}),
            "counted": ("row", counted, {"long_name": "whether it is behind the window"}),
            "measured": (("row", "column"), measured, {"long_name": "measured value, in the unit of its column"}),
            "predicted": (("row", "column"), curves, {"long_name": "value that the mechanism predicts"}),
            "rms": ("column", rms, about),
            "column_unit": ("column", np.array(list(parts[0].units), dtype=str), {"long_name": "unit"}),
        },
        coords={"column": np.array(list(parts[0].headings), dtype=str)},
        attrs={"title": "scissordyn prediction"},
    )
