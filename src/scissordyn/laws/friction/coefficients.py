"""Static and kinetic friction coefficients, for all laws that have both."""

from __future__ import annotations

from scissordyn.errors import InputError

__all__ = ["STATIC_OVER_KINETIC", "static_coefficient"]

STATIC_OVER_KINETIC = 1.5
"""Default of the static coefficient, as a multiple of the kinetic one."""


def static_coefficient(law: str, kinetic: float, static: float | None) -> float:
    """The static friction coefficient, given or not.

    Parameters
    ----------
    law : str
        Name of the law.
    kinetic : float
        mu_k [1].
    static : float, optional
        mu_s [1].

    Returns
    -------
    float

    Raises
    ------
    InputError
        If the static coefficient is below the kinetic one.
    """
    if static is None:
        return STATIC_OVER_KINETIC * kinetic
    if static < kinetic:
        raise InputError(
            f"{law}: static = {static:g} below kinetic = {kinetic:g}",
            "static >= kinetic",
            f"static = {STATIC_OVER_KINETIC * kinetic:g}",
        )
    return static
