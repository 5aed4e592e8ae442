"""The result of a fit as a Dataset."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import xarray as xr

from scissordyn.identification.solve import Search
from scissordyn.identification.uncertainty import LEVEL, Uncertainty
from scissordyn.run.configuration import write_configuration

TITLE = "scissordyn fit"

ALIKE = 0.98  # Numbers whose correlation is larger are hardly distinguished
DEPENDENT = 2.0  # Errors that grow by more than this factor by the dependence of residuals show that they are no noise
AT_BOUND = 1e-6  # A number within this fraction of its scale of a bound is at the bound


def fit_dataset(found: Search, errors: Uncertainty, seconds: float) -> xr.Dataset:
    """Numbers, their errors and correlations, and measured and fitted curves."""
    problem, unknowns = found.problem, found.unknowns
    values, curves = problem.values(unknowns), problem.every_curve(unknowns)
    records = [segment.record for segment in problem.segments]
    shown = [
        curve.ravel()[: record.values.size].reshape(record.values.shape) for curve, record in zip(curves, records, strict=True)
    ]
    measured, fitted = np.concatenate([record.values for record in records]), np.concatenate(shown)
    headings = list(records[0].headings)

    def of_parameters(numbers: Any, about: str) -> tuple[str, Any, dict[str, str]]:
        return "parameter", numbers, {"long_name": about}

    data = xr.Dataset(
        {
            "value": of_parameters(values, "fitted value, in the unit of the number"),
            "start_value": of_parameters([parameter.start for parameter in problem.free], "value that the search started from"),
            "standard_error": of_parameters(errors.error, "standard error; infinite where the data do not determine it"),
            "low": of_parameters(values - errors.half_width, f"lower end of the interval with probability {LEVEL:g}"),
            "high": of_parameters(values + errors.half_width, f"upper end of the interval with probability {LEVEL:g}"),
            "lower_bound": of_parameters([parameter.low for parameter in problem.free], "lower bound of the search"),
            "upper_bound": of_parameters([parameter.high for parameter in problem.free], "upper bound of the search"),
            "unit": of_parameters(np.array([parameter.unit for parameter in problem.free], dtype=str), "unit"),
            "correlation": (("parameter", "other"), errors.correlation, {"units": "1", "long_name": "correlation"}),
            "covariance": (("parameter", "other"), errors.covariance, {"long_name": "covariance, in SI units"}),
            "time": ("row", np.concatenate([record.time for record in records]), {"units": "s", "long_name": "time"}),
            "segment": (
                "row",
                np.repeat(np.arange(len(records)), [record.time.size for record in records]),
                {"long_name": "segment"},
            ),
            "measured": (("row", "column"), measured, {"long_name": "measured value, in the unit of its column"}),
            "fitted": (("row", "column"), fitted, {"long_name": "value of the fitted mechanism"}),
            "residual": (("row", "column"), fitted - measured, {"long_name": "fitted less measured"}),
            "column_unit": ("column", np.array(list(records[0].units), dtype=str), {"long_name": "unit"}),
            "deviation": ("column", problem.deviation, {"long_name": "standard deviation that weights the residuals"}),
            "rms": ("column", np.sqrt(np.mean((fitted - measured) ** 2, axis=0)), {"long_name": "root mean square residual"}),
        },
        coords={
            "parameter": np.array([parameter.path for parameter in problem.free], dtype=str),
            "other": np.array([parameter.path for parameter in problem.free], dtype=str),
            "column": np.array(headings, dtype=str),
        },
    )
    data.attrs = {
        "title": TITLE,
        "status": "complete" if found.status == "complete" else "failed",
        "cause": "" if found.status == "complete" else found.status,
        "configuration": write_configuration(problem.fitted(unknowns), problem.options),
        "statistics": json.dumps(
            {"seconds": seconds, "runs": problem.runs, "evaluations": found.evaluations, "unknowns": problem.unknowns}
        ),
        "chi_square": errors.chi_square,
        "dependence": errors.dependence,
        "warnings": json.dumps(_warnings(found, errors, values)),
    }
    return data


def _warnings(found: Search, errors: Uncertainty, values: np.ndarray) -> list[str]:
    """What the user has to know of the numbers."""
    free, warnings = found.problem.free, list[str]()
    if found.status != "complete":
        warnings.append(f"the search did not end: {found.status}")
    for direction in errors.alike:
        names = [f"'{free[k].path}'" for k in direction]
        if len(names) == 1:
            warnings.append(f"{names[0]} cannot be determined: the data do not depend on it beyond their errors")
        else:
            together = ", ".join(f"{free[k].path} {share:+.3g} %" for k, share in direction.items())
            warnings.append(
                f"{' and '.join(names)} cannot be distinguished: with {together} the measured curves stay the same; keep one "
                "of them fixed at a value that was measured otherwise"
            )
    if errors.dependence > DEPENDENT:
        warnings.append(
            f"neighbouring residuals depend on each other, which makes the intervals {errors.dependence:.1f} times as wide "
            "as noise would: the mechanism or its start differs from what was measured"
        )
    correlation = errors.correlation
    for i in range(len(free)):
        for j in range(i):
            both = np.isfinite(errors.error[[i, j]]).all()
            if both and abs(correlation[i, j]) > ALIKE:
                warnings.append(
                    f"'{free[j].path}' and '{free[i].path}' are hardly distinguished: correlation {correlation[i, j]:.4f}"
                )
    for parameter, value in zip(free, values.tolist(), strict=True):
        for bound in (parameter.low, parameter.high):
            if abs(value - bound) <= AT_BOUND * parameter.scale:
                warnings.append(f"'{parameter.path}' is at its bound {bound:g} {parameter.unit}: its interval does not hold")
    return warnings
