"""Derivatives of the responses of a study's cases by the numbers that vary, and the reasons why some are missing."""

from __future__ import annotations

import json
from collections.abc import Mapping

import numpy as np
import xarray as xr

from scissordyn.errors import InputError, ScissordynError
from scissordyn.model.mechanism import Mechanism
from scissordyn.run.response import Response
from scissordyn.sensitivity.gradient import compute_gradient, difference_text, exact_options
from scissordyn.sensitivity.limit import LIMIT_REASONS
from scissordyn.sensitivity.measure import check_measure
from scissordyn.studies.ask.description import Study
from scissordyn.studies.ask.requirement import response_values, whole_responses
from scissordyn.studies.compute.table import SLOPE_BY, SLOPE_OF, SLOPES

NO_SLOPE = "no derivative of "  # First words of a case's warning that gives the reason for a missing derivative
CHANGE = 1e-3  # [-] relative change of a parameter up to which a derivative must be valid, as in `gradient`


def with_slopes(study: Study, runs: xr.Dataset) -> xr.Dataset:
    """Return the runs of some cases with the derivatives of their responses, NaN where they are not valid until the end.

    A case gets a further run with derivatives by each eight numbers, and lines among its warnings with the reasons why
    derivatives are missing.
    """
    responses = [requirement.response for requirement in study.requirements] + list(study.responses)
    responses += [response for name in study.measures if runs[name].size for response in whole_responses(runs, name)]
    chosen = {response.name: response for response in responses}
    names = list(chosen)
    derivatives = np.full((runs.sizes["case"], len(names), len(study.factor_names)), np.nan)
    texts = runs["warnings"].values.astype(object)
    for case in np.flatnonzero(runs["status"].values == "complete"):
        numbers = {name: float(runs[name][case]) for name in study.factor_names}
        run, reasons = runs.isel(case=[case]), dict[str, str]()
        for response in chosen.values():
            reasons |= _reason(run, response)
        values = {name: float(response_values(run, chosen[name])[0]) for name in names if name not in reasons}
        if values:
            slopes, further = _slopes(study, study.mechanism_of(numbers), values)
            derivatives[case, [names.index(name) for name in values]] = slopes
            reasons |= further
        lines = [f"{NO_SLOPE}{what}: {reason}" for what, reason in reasons.items()]
        texts[case] = "\n".join([*([texts[case]] if texts[case] else []), *lines])
    labels = {SLOPE_OF: names, SLOPE_BY: list(study.factor_names)}
    about = {"long_name": "derivative of a response by a number, in SI units"}
    slopes_array = xr.DataArray(derivatives, labels, ("case", SLOPE_OF, SLOPE_BY), attrs=about)
    return runs.assign({SLOPES: slopes_array, "warnings": ("case", texts)})


def _reason(run: xr.Dataset, response: Response) -> dict[str, str]:
    """Return the reason, by the name of the response, why it has no derivatives in a run; empty if it may have some."""
    try:
        check_measure(response)
    except InputError as refused:
        return {response.name: refused.what}
    if response.unit:
        return {response.name: "it compares several parts"}
    return {} if np.isfinite(response_values(run, response)).all() else {response.name: "it has no value in this run"}


def _slopes(study: Study, mechanism: Mechanism, values: Mapping[str, float]) -> tuple[np.ndarray, dict[str, str]]:
    """Return the valid derivatives of responses by the varied numbers, and the reasons why others are not valid."""
    slopes = np.full((len(values), len(study.factor_names)), np.nan)
    try:
        exact = compute_gradient(mechanism, list(values), study.factor_names, exact_options(study.options), CHANGE, np.zeros(0))
    except ScissordynError as error:
        reason = error.what if isinstance(error, InputError) else str(error)
        return slopes, dict.fromkeys(values, reason)
    left_out = json.loads(exact.attrs["left_out"])
    reasons = {f"{name} by {path}": reason for name in values for path, reason in left_out.items()}
    for k, path in enumerate(exact["parameter"].values.tolist()):
        part = exact.isel(parameter=k)
        limit, until = str(part["limit"].item()), float(part["valid_until"])
        for row, (name, value) in enumerate(values.items()):
            if differs := difference_text(float(part["value"][row]), value):
                reasons[name] = f"it {differs}"
            elif limit:
                why = LIMIT_REASONS.get(limit, "")
                why = f"a change of {100.0 * CHANGE:g} % {why}" if why else "a run at another tolerance diverges"
                reasons[f"{name} by {path}"] = f"from t = {until:.3g} s on, {why}"
            elif not np.isfinite(part["derivative"][row]):
                reasons[f"{name} by {path}"] = "the largest value is at a kink"
            elif not part["smooth"][row]:
                reasons[f"{name} by {path}"] = "another part or contact has nearly the same largest value"
            else:
                slopes[row, study.factor_names.index(path)] = float(part["derivative"][row])
    return slopes, reasons
