"""Compare friction laws on the decay of the single pendulum: each is fitted to some pieces and predicts the others."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import xarray as xr

import scissordyn as sd
from scissordyn.analysis.agreement import Measured
from scissordyn.identification.problem import Problem
from scissordyn.identification.start import prepare_segments
from scissordyn.model.mechanism import Mechanism
from validation.measured.pendulum import Numbers, numbers, pendulum
from validation.measured.read import estimated, free_decay, records

__all__ = ["LAWS", "Forecast", "Verdict", "at_rest", "cross_validated", "forecasts"]

VISCOUS, DRY, DRAG = "friction A.damping", "dry friction.capacity", "air.factor"

LAWS = {
    "viscous": (VISCOUS,),
    "dry and drag": (DRY, DRAG),
    "viscous and dry": (VISCOUS, DRY),
    "dry": (DRY,),
    "viscous and drag": (VISCOUS, DRAG),
    "viscous, dry and drag": (VISCOUS, DRY, DRAG),
}
"""Parameters of each law that are fitted."""

OPTIONS = sd.Options(1.0, "as-placed")

DEVIATIONS = {"angle of arm 1": 5e-3, "angular_velocity of arm 1": 5e-2}
"""Weights of both columns [rad], [rad/s], the same for all laws."""

FOLDS = 3  # Number of folds of the cross-validation


@dataclass(frozen=True)
class Verdict:
    """Quality of the fit of a law.

    Parameters
    ----------
    law : str
    values, errors : dict of str to float
        Parameters fitted to all pieces, and their standard errors.
    fitted, left_out, predicted : float
        Root mean square error of the angle [rad]: of fitted pieces; of other pieces with fitted starts; and of other pieces
        with starts estimated from their first tenth.
    """

    law: str
    values: dict[str, float]
    errors: dict[str, float]
    fitted: float
    left_out: float
    predicted: float


def _mechanism(given: Numbers, law: str, yield_angle: float) -> Mechanism:
    names = LAWS[law]
    own = dataclasses.replace(given, damping=[2e-4 if VISCOUS in names else 0.0])
    made = pendulum(own, coulomb=4e-4 if DRY in names else 0.0, drag=1e-5 if DRAG in names else 0.0)
    return made.replace("dry friction.yield_angle", yield_angle) if DRY in names else made


def _with_values(made: Mechanism, found: object) -> Mechanism:
    for name, value in zip(found["parameter"].values.astype(str), found["value"].values.tolist(), strict=True):  # type: ignore[index]
        made = made.replace(name, max(value, 1e-12))
    return made


def _fitted(made: Mechanism, law: str, pieces: Sequence[Measured]):  # type: ignore[no-untyped-def]
    return sd.fit(made, pieces, ["arm 1.inertia", *LAWS[law]], segment=math.inf, deviations=DEVIATIONS, options=OPTIONS)


def cross_validated(copy: Path, every: int = 50) -> list[Verdict]:
    """Fit each law to the six pieces of 9.2 s by three folds of two pieces each.

    Parameters
    ----------
    copy : Path
        Copy of the repository, see `read`.
    every : int
        Use every n-th instant.
    """
    pieces = records(copy, 1, "id", every) + records(copy, 1, "vad", every)
    found = []
    for law in LAWS:
        made = _mechanism(numbers(estimated(copy, 1)), law, 1e-2)
        whole = _fitted(made, law, pieces)
        made = _with_values(made, whole)
        errors_of = list[np.ndarray](), list[np.ndarray]()
        for fold in range(FOLDS):
            kept = [piece for k, piece in enumerate(pieces) if k % FOLDS != fold]
            left = [piece for k, piece in enumerate(pieces) if k % FOLDS == fold]
            known = _with_values(made, _fitted(made, law, kept))
            segments, columns, options = prepare_segments(known, OPTIONS, left, segment=math.inf)
            problem = Problem(known, options, (), segments, columns, np.ones(len(columns)))
            curves = [run.curves for run in problem.run_segments(problem.start())]
            errors_of[0].extend(curve[:, 0] - piece.values[:, 0] for curve, piece in zip(curves, left, strict=True))
            held = sd.prediction(known, OPTIONS, left, segment=math.inf)
            errors_of[1].append((held["predicted"] - held["measured"]).values[held["counted"].values, 0])
        left_out, predicted = (math.sqrt(float(np.mean(np.concatenate(each) ** 2))) for each in errors_of)
        names = whole["parameter"].values.astype(str).tolist()
        values, errors = (dict(zip(names, whole[name].values.tolist(), strict=True)) for name in ("value", "standard_error"))
        found.append(Verdict(law, values, errors, float(whole["rms"][0]), left_out, predicted))
        print(found[-1], flush=True)
    return found


@dataclass(frozen=True)
class Forecast:
    """Prediction of the rest of the decay by a law that was fitted to its beginning.

    Parameters
    ----------
    law : str
    until : float
        End of the fitted part [s].
    fitted, predicted : float
        Root mean square errors of the angle before and after `until` [rad].
    """

    law: str
    until: float
    fitted: float
    predicted: float


def _decay(copy: Path, until: float, every: int) -> Measured:
    record = free_decay(copy, every)
    return record.rows(0, int(np.searchsorted(record.time, until)))


def _fitted_decay(copy: Path, law: str, record: Measured) -> tuple[Mechanism, xr.Dataset]:
    """Fit a law to a decay and the direction of gravity, since the record's vertical is not exactly the encoder's."""
    made = _mechanism(numbers(estimated(copy, 1)), law, 1e-3)
    free = ["arm 1.inertia", "gravity_direction", *LAWS[law]] + (["dry friction.yield_angle"] if DRY in LAWS[law] else [])
    return made, sd.fit(made, [record], free, segment=math.inf, deviations={"angle of arm 1": 1e-4}, options=OPTIONS)


def at_rest(copy: Path, until: float = 8.0, every: int = 200) -> dict[str, xr.Dataset]:
    """Return fits of each law to the decay to rest."""
    record, found = _decay(copy, until, every), {}
    for law in LAWS:
        _, fit = _fitted_decay(copy, law, record)
        print(law, fit[["value", "standard_error"]].to_dataframe(), float(fit["rms"][0]), flush=True)
        found[law] = fit
    return found


def forecasts(copy: Path, cuts: Sequence[float] = (3.0, 4.0, 5.0), until: float = 8.0, every: int = 200) -> list[Forecast]:
    """Fit each law to the decay up to each cut, with its start, and predict the rest."""
    record, found = _decay(copy, until, every), []
    for law in LAWS:
        for cut in cuts:
            made, fit = _fitted_decay(copy, law, record.rows(0, int(np.searchsorted(record.time, cut))))
            known = _with_values(made, fit)
            ahead = sd.prediction(known, OPTIONS, [record], segment=math.inf, window=cut / float(record.time[-1]))
            found.append(Forecast(law, cut, float(fit["rms"][0]), float(ahead["rms"][0])))
            print(found[-1], flush=True)
    return found
