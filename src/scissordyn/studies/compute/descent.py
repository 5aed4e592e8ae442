"""Search along derivatives: SLSQP, which gets the results of one point after the other from the store."""

from __future__ import annotations

from typing import Any

import numpy as np

from scissordyn.errors import InputError, ScissordynError
from scissordyn.sensitivity.gradient import exact_options, slopes_of
from scissordyn.studies.ask.description import Study
from scissordyn.studies.ask.design import quantiles

# [parameter ranges] Step of finite differences of a search's goals, whose errors are about the runs' tolerance
DIFFERENCE_STEP = 1e-3
QUANTILE_STEP = 1e-6  # [-] Step in probability of finite differences of quantile functions, which are smooth
GOAL_TOL = 1e-8  # [-] Relative change of the goal, and sum of violations, at which a search ends; about the error of runs


class _MissingPointError(Exception):
    """Signal: the search needs the results of a point that is not computed yet."""

    def __init__(self, point: np.ndarray) -> None:
        super().__init__()
        self.point = point


class Descent:
    """Sequential quadratic programming (SLSQP; Kraft 1988) from the middle of the ranges, in the unit cube.

    For each new point the search is repeated from its start with the results of the earlier ones. It proposes the same points
    again when it gets the same results. Derivatives are exact where they exist, otherwise differences of further points.
    """

    def __init__(self, study: Study) -> None:
        self.study, self.count = study, len(study.factors)
        self.results: dict[bytes, tuple[float, np.ndarray]] = {}  # goal and margins of each point
        self.slopes: dict[bytes, np.ndarray] = {}  # their exact derivatives
        self.reasons: dict[bytes, str] = {}  # why a point has no exact derivatives
        self.converged = False
        self.failure = ""  # why the search has ended without an optimum

    def ask(self) -> np.ndarray:
        """Return the next point, shape (1, factors), or no point at the end of the search."""
        from scipy.optimize import minimize

        constraints: Any = []
        if self.study.requirements:
            # margins of twice the tolerance, so that the point at which the search ends meets all requirements
            inner = {"fun": lambda u: self._result(u)[1:] - 2.0 * GOAL_TOL, "jac": lambda u: self._slopes(u)[1:]}
            constraints = [{"type": "ineq", **inner}]
        try:
            optimum = minimize(  # type: ignore[call-overload]
                lambda u: self._result(u)[0],
                np.full(self.count, 0.5),
                jac=lambda u: self._slopes(u)[0],
                method="SLSQP",
                bounds=[(0.0, 1.0)] * self.count,
                constraints=constraints,
                tol=GOAL_TOL,
            )
        except _MissingPointError as missing:
            return missing.point[None]
        goal, margins = self.results[np.clip(optimum.x, 0.0, 1.0).tobytes()]
        has_value = bool(np.isfinite(goal) and np.isfinite(margins).all())
        self.converged = bool(optimum.success) and has_value
        self.failure = "" if self.converged else str(optimum.message) if has_value else "the last point has no value"
        return np.empty((0, self.count))

    def tell(self, point: np.ndarray, goal: float, margins: np.ndarray) -> None:
        """Take the goal of a point and its margins to the requirements; infinite ones mean a failed case."""
        self.results[point.tobytes()] = goal, margins

    def summary(self) -> dict[str, Any]:
        """Return how the search has ended, as plain data."""
        reasons = list(dict.fromkeys(self.reasons.values()))
        return {
            "converged": self.converged,
            "failure": self.failure,
            "gradients": len(self.slopes),
            "differences": len(self.reasons),
            "reasons": reasons,
        }

    def _result(self, u: np.ndarray) -> np.ndarray:
        """Return the goal as a fraction of the first finite one, and the margins; a failed case has a bad goal."""
        point = np.clip(u, 0.0, 1.0)
        if point.tobytes() not in self.results:
            raise _MissingPointError(point)
        finite_goals = [goal for goal, _ in self.results.values() if np.isfinite(goal)]
        goal, margins = self.results[point.tobytes()]
        scale = abs(finite_goals[0]) or 1.0 if finite_goals else 1.0
        if not (np.isfinite(goal) and np.isfinite(margins).all()):
            return np.array([max(finite_goals, default=0.0) / scale + 1.0, *np.full(margins.size, -1.0)])
        return np.array([goal / scale, *margins])

    def _slopes(self, u: np.ndarray) -> np.ndarray:
        """Return the derivatives of goal and margins by the position in the unit cube, shape (1 + requirements, factors)."""
        point = np.clip(u, 0.0, 1.0)
        key = point.tobytes()
        if key not in self.slopes and key not in self.reasons:
            try:
                self.slopes[key] = self._exact(point)
            except ScissordynError as error:
                self.reasons[key] = error.what if isinstance(error, InputError) else str(error)
        if key in self.reasons:
            return self._differences(point)
        first_goal = next(goal for goal, _ in self.results.values() if np.isfinite(goal))
        return np.concatenate([self.slopes[key][:1] / (abs(first_goal) or 1.0), self.slopes[key][1:]])

    def _differences(self, point: np.ndarray) -> np.ndarray:
        columns, middle = [], self._result(point)
        for k in range(self.count):
            step = DIFFERENCE_STEP if point[k] < 0.5 else -DIFFERENCE_STEP
            moved = point.copy()
            moved[k] += step
            columns.append((self._result(moved) - middle) / step)
        return np.stack(columns, axis=1)

    def _exact(self, point: np.ndarray) -> np.ndarray:
        study, (goal,) = self.study, self.study.goals
        if study.per_point > 1:
            raise InputError("several runs of each point have no common derivatives", "one sample and one member")
        if study.variant_factors:
            raise InputError("a number that only the case file has", "numbers of the mechanism")
        variations = [factor.variation for factor in study.factors]
        ends = np.clip([point - QUANTILE_STEP, point + QUANTILE_STEP], 0.0, 1.0)
        low, high = quantiles(variations, ends)
        by_place = (high - low) / (ends[1] - ends[0])
        values = dict(zip(study.paths, quantiles(variations, point[None])[0].tolist(), strict=True))
        goal_is_factor = goal.measure in study.paths
        responses = [
            *([] if goal_is_factor else [goal.response]),
            *(requirement.response for requirement in study.requirements),
        ]
        if any(response.unit for response in responses):
            raise InputError("a measure of forces and torques of several parts", "the measure of one part")
        signs = np.array([-1.0 if requirement.sign.startswith("<") else 1.0 for requirement in study.requirements])
        bounds = np.array([requirement.bound for requirement in study.requirements])
        scales = signs / np.where(bounds, np.abs(bounds), 1.0)
        slopes = np.eye(self.count)[[study.paths.index(goal.measure)]] if goal_is_factor else np.empty((0, self.count))
        if responses:
            goal_value, margins = self.results[point.tobytes()]
            expected = [*([] if goal_is_factor else [goal.sign * goal_value]), *(bounds + margins / scales)]
            options = exact_options(study.options)
            exact = slopes_of(study.mechanism_of(values), options, responses, study.paths, expected)
            slopes = np.concatenate([slopes, exact])
        factors = np.append(goal.sign, scales)
        return np.asarray(factors[:, None] * slopes * by_place)
