"""Requirements on measures: ``peak_force < 500 N``."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import xarray as xr

from scissordyn.errors import InputError, did_you_mean

__all__ = ["Requirement", "Response", "response_values"]

SIGNS = ("<=", ">=", "<", ">")


@dataclass(frozen=True)
class Response:
    """One number of each case: a measure, or that of one of its joints, drives or components.

    Parameters
    ----------
    measure : str
    part : str
        Name of the joint, drive or component; empty for the largest of all.
    smallest : bool
        The smallest of all instead.
    """

    measure: str
    part: str = ""
    smallest: bool = False

    @property
    def name(self) -> str:
        """As in a study file."""
        return f"{self.part}.{self.measure}" if self.part else self.measure


@dataclass(frozen=True)
class Requirement:
    """A bound on a response; without a part, all joints, drives or components have to meet it.

    Parameters
    ----------
    measure : str
    sign : {"<", "<=", ">", ">="}
    bound : float
        In SI.
    part : str
        Name of a joint, drive or component; empty for all.
    text : str
        As the user wrote it.
    """

    measure: str
    sign: str
    bound: float
    part: str = ""
    text: str = ""

    def __post_init__(self) -> None:
        if self.sign not in SIGNS:
            raise InputError(f"sign '{self.sign}' of a requirement", ", ".join(SIGNS))

    @property
    def response(self) -> Response:
        """The number that decides: the largest where an upper bound is given, the smallest where a lower one."""
        return Response(self.measure, self.part, self.sign.startswith(">"))

    @property
    def label(self) -> str:
        """The requirement in words."""
        return self.text or f"{self.response.name} {self.sign} {self.bound:g}"

    def margin(self, values: np.ndarray) -> np.ndarray:
        """How far values are on the right side of the bound, as a fraction of it; negative where they are on the wrong one."""
        distance = self.bound - values if self.sign.startswith("<") else values - self.bound
        return np.asarray(distance / (abs(self.bound) or 1.0))

    def met(self, values: np.ndarray) -> np.ndarray:
        """Whether values meet it; not where they are NaN."""
        with np.errstate(invalid="ignore"):
            match self.sign:
                case "<":
                    return np.asarray(values < self.bound)
                case "<=":
                    return np.asarray(values <= self.bound)
                case ">":
                    return np.asarray(values > self.bound)
                case _:
                    return np.asarray(values >= self.bound)


def response_values(results: xr.Dataset, response: Response) -> np.ndarray:
    """A response of all cases.

    Parameters
    ----------
    results : Dataset
        With the measures along `case`.
    response : Response

    Returns
    -------
    ndarray, shape (cases,)
        NaN for a case without results.

    Raises
    ------
    InputError
        If there is no such measure or part.
    """
    known = [str(name) for name in results.data_vars if results[name].attrs.get("role") == "measure"]
    if response.measure not in known:
        raise InputError(
            f"measure '{response.measure}'{did_you_mean(response.measure, known)}", ", ".join(known) or "no measure"
        )
    found = results[response.measure]
    dims = found.dims[1:]
    values = np.asarray(found.values, float)
    if response.part:
        parts = [str(part) for dim in dims for part in found[dim].values]
        if response.part not in parts:
            raise InputError(
                f"no part '{response.part}' with a {response.measure}{did_you_mean(response.part, parts)}", ", ".join(parts)
            )
        return np.asarray(values[:, parts.index(response.part)])
    if not dims:
        return values
    nothing = np.all(np.isnan(values), axis=1)  # a measure that some parts do not have is NaN there
    reduced = np.min(np.where(np.isnan(values), np.inf, values), axis=1) if response.smallest else None
    reduced = np.max(np.where(np.isnan(values), -np.inf, values), axis=1) if reduced is None else reduced
    return np.where(nothing, np.nan, reduced)
